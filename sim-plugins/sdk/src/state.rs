//! Saved state: tagged fields, little-endian, without pointers.
//!
//! ```text
//! magic u64 · fields u32 · spare u32, then per field:
//! tag u64 (FNV-1a of its name) · type u32 · spare u32 · count u64 · count values, padded with zeros to 8 bytes
//! ```
//! A reader skips tags that it does not know, so a field may be added or dropped without a new state version.

use reef_abi::fnv1a_64;

use crate::error::StateError;

/// "REEFSTAT" as a little-endian integer.
const MAGIC: u64 = u64::from_le_bytes(*b"REEFSTAT");
const HEADER: usize = 16;
const FIELD_HEADER: usize = 24;

mod sealed {
    pub trait Sealed {}
}

/// A number that a state can hold.
pub trait Scalar: bytemuck::Pod + sealed::Sealed {
    /// Number of the type in the file.
    #[doc(hidden)]
    const TYPE: u32;
    /// Makes the values little-endian.
    #[doc(hidden)]
    fn write(values: &mut [Self]);
    /// One value out of exactly `size_of::<Self>()` bytes.
    #[doc(hidden)]
    fn read(bytes: &[u8]) -> Self;
}

macro_rules! scalars {
    ($($name:ident = $type:literal),+ $(,)?) => {$(
        impl sealed::Sealed for $name {}
        impl Scalar for $name {
            const TYPE: u32 = $type;

            fn write(values: &mut [Self]) {
                if cfg!(target_endian = "big") {
                    values.iter_mut().for_each(|value| *value = Self::from_ne_bytes(value.to_le_bytes()));
                }
            }

            fn read(bytes: &[u8]) -> Self {
                let mut raw = [0; size_of::<Self>()];
                raw.copy_from_slice(bytes);
                Self::from_le_bytes(raw)
            }
        }
    )+};
}
scalars!(u8 = 1, u32 = 2, i32 = 3, u64 = 4, i64 = 5, f32 = 6, f64 = 7);

/// Size of a value of a type number; None: unknown to this version.
fn size_of_type(kind: u32) -> Option<usize> {
    match kind {
        1 => Some(1),
        2 | 3 | 6 => Some(4),
        4 | 5 | 7 => Some(8),
        _ => None,
    }
}

/// Where [`crate::Plugin::save`] writes.
#[derive(Debug)]
pub struct StateWriter {
    /// Whole fields, in words of 8 bytes. Behind `used` lies what an earlier state left.
    words: Vec<u64>,
    used: usize,
    tags: Vec<u64>,
    duplicate: Option<String>,
}

impl Default for StateWriter {
    fn default() -> Self {
        Self::new()
    }
}

impl StateWriter {
    /// A state without fields. A plugin's own tests write with it what an older version of it wrote.
    pub fn new() -> Self {
        Self { words: vec![0; HEADER / 8], used: HEADER / 8, tags: Vec::new(), duplicate: None }
    }

    /// A state without fields again; the memory stays.
    pub(crate) fn begin(&mut self) {
        self.used = HEADER / 8;
        self.tags.clear();
        self.duplicate = None;
    }

    /// Writes a field of many values. Each name may be used once.
    pub fn put<T: Scalar>(&mut self, name: &str, values: &[T]) {
        self.fill(name, values.len(), |into| into.copy_from_slice(values));
    }

    /// Writes a field of `count` values which `fill` puts in their places: a model need not gather them
    /// elsewhere first. It sets all of them; what is in their places before has no meaning.
    pub fn fill<T: Scalar>(&mut self, name: &str, count: usize, fill: impl FnOnce(&mut [T])) {
        let tag = fnv1a_64(name.as_bytes());
        if self.tags.contains(&tag) {
            self.duplicate.get_or_insert_with(|| name.to_owned());
            return;
        }
        self.tags.push(tag);
        let first = self.used + FIELD_HEADER / 8;
        let length = count * size_of::<T>();
        self.used = first + length.div_ceil(8);
        if self.words.len() < self.used {
            self.words.resize(self.used, 0);
        }
        let header = [tag, u64::from(T::TYPE), count as u64];
        for (word, value) in self.words[first - header.len()..].iter_mut().zip(header) {
            *word = value.to_le();
        }
        // What fills the last word up is zero.
        if let Some(last) = self.words[first..self.used].last_mut() {
            *last = 0;
        }
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut self.words[first..self.used]);
        let values: &mut [T] = bytemuck::cast_slice_mut(&mut bytes[..length]);
        fill(values);
        T::write(values);
    }

    /// Writes a field of one value.
    pub fn put_one<T: Scalar>(&mut self, name: &str, value: T) {
        self.put(name, &[value]);
    }

    /// The bytes; says which field was written twice.
    pub fn finish(mut self) -> Result<Vec<u8>, String> {
        self.finished().map(<[u8]>::to_vec)
    }

    /// As [`StateWriter::finish`]; the memory stays.
    pub(crate) fn finished(&mut self) -> Result<&[u8], String> {
        if let Some(name) = &self.duplicate {
            return Err(format!("the state has two fields named `{name}` (or of the same hash)"));
        }
        self.words[0] = MAGIC.to_le();
        self.words[1] = (self.tags.len() as u64).to_le();
        Ok(bytemuck::cast_slice(&self.words[..self.used]))
    }
}

/// Where [`crate::Plugin::load`] reads.
#[derive(Debug)]
pub struct StateReader<'a> {
    version: u32,
    fields: Vec<Field<'a>>,
}

#[derive(Debug)]
struct Field<'a> {
    tag: u64,
    kind: u32,
    count: usize,
    values: &'a [u8],
}

impl<'a> StateReader<'a> {
    /// Takes the bytes apart that a version of a plugin wrote; every byte must be accounted for.
    pub fn parse(version: u32, bytes: &'a [u8]) -> Result<Self, StateError> {
        let damaged = |what: &str| StateError::Damaged(what.to_owned());
        let mut rest = bytes;
        let mut take = |length: usize| -> Result<&'a [u8], StateError> {
            let (head, tail) = rest.split_at_checked(length).ok_or_else(|| damaged("it ends too early"))?;
            rest = tail;
            Ok(head)
        };
        let header = take(HEADER)?;
        if u64::read(&header[..8]) != MAGIC {
            return Err(damaged("it does not begin like one"));
        }
        let count = u32::read(&header[8..12]) as usize;
        let mut fields = Vec::with_capacity(count.min(bytes.len() / FIELD_HEADER));
        for _ in 0..count {
            let header = take(FIELD_HEADER)?;
            let kind = u32::read(&header[8..12]);
            let size = size_of_type(kind).ok_or_else(|| damaged("a field is of an unknown type"))?;
            let count =
                usize::try_from(u64::read(&header[16..])).map_err(|_| damaged("it ends too early"))?;
            let length = count.checked_mul(size).ok_or_else(|| damaged("it ends too early"))?;
            let values = take(length)?;
            take(length.next_multiple_of(8) - length)?;
            fields.push(Field { tag: u64::read(&header[..8]), kind, count, values });
        }
        match rest.len() {
            0 => Ok(Self { version, fields }),
            more => Err(StateError::Damaged(format!("{more} bytes follow its end"))),
        }
    }

    /// State version of the library that wrote the bytes: between `STATE_MIN_VERSION` and `STATE_VERSION`.
    pub fn version(&self) -> u32 {
        self.version
    }

    /// Is the field there?
    pub fn has(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    /// A field of many values.
    pub fn get<T: Scalar>(&mut self, name: &str) -> Result<Vec<T>, StateError> {
        let field = self.typed::<T>(name)?;
        Ok(field.values.chunks_exact(size_of::<T>()).map(T::read).collect())
    }

    /// A field of one value.
    pub fn get_one<T: Scalar>(&mut self, name: &str) -> Result<T, StateError> {
        let field = self.typed::<T>(name)?;
        if field.count != 1 {
            return Err(mismatch(name, format!("has {} values in place of one", field.count)));
        }
        Ok(T::read(field.values))
    }

    /// A field of one value, or a default where an older version did not write it.
    pub fn get_one_or<T: Scalar>(&mut self, name: &str, default: T) -> Result<T, StateError> {
        if self.has(name) { self.get_one(name) } else { Ok(default) }
    }

    /// A field of exactly as many values as there is room for.
    pub fn fill<T: Scalar>(&mut self, name: &str, into: &mut [T]) -> Result<(), StateError> {
        let field = self.typed::<T>(name)?;
        if field.count != into.len() {
            return Err(mismatch(name, format!("has {} values in place of {}", field.count, into.len())));
        }
        for (value, bytes) in into.iter_mut().zip(field.values.chunks_exact(size_of::<T>())) {
            *value = T::read(bytes);
        }
        Ok(())
    }

    fn find(&self, name: &str) -> Option<&Field<'a>> {
        let tag = fnv1a_64(name.as_bytes());
        self.fields.iter().find(|field| field.tag == tag)
    }

    fn typed<T: Scalar>(&self, name: &str) -> Result<&Field<'a>, StateError> {
        let field = self.find(name).ok_or_else(|| StateError::Missing(name.to_owned()))?;
        if field.kind != T::TYPE {
            return Err(mismatch(name, "is of another type".into()));
        }
        Ok(field)
    }
}

fn mismatch(name: &str, problem: String) -> StateError {
    StateError::Mismatch { name: name.to_owned(), problem }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saved() -> Vec<u8> {
        let mut writer = StateWriter::new();
        writer.put("angles", &[1.5_f32, -0.0, f32::MAX]);
        writer.put_one("step", u64::MAX);
        writer.put::<f64>("nothing", &[]);
        writer.put("letters", b"reef!");
        writer.finish().unwrap()
    }

    #[test]
    fn what_was_written_comes_back() {
        let bytes = saved();
        let mut reader = StateReader::parse(3, &bytes).unwrap();
        assert_eq!(reader.version(), 3);
        assert_eq!(reader.get::<u8>("letters").unwrap(), b"reef!");
        assert_eq!(reader.get_one::<u64>("step").unwrap(), u64::MAX);
        let mut angles = [0.0_f32; 3];
        reader.fill("angles", &mut angles).unwrap();
        assert_eq!(angles.map(f32::to_bits), [1.5_f32, -0.0, f32::MAX].map(f32::to_bits));
        assert!(reader.get::<f64>("nothing").unwrap().is_empty());
        assert_eq!(reader.get_one_or("later", 7_u32).unwrap(), 7);
    }

    #[test]
    fn memory_of_an_earlier_state_leaves_no_trace() {
        let mut writer = StateWriter::new();
        writer.put("all", &[u64::MAX; 40]);
        writer.put("all", &[0_u8]);
        assert!(writer.finished().is_err());
        writer.begin();
        writer.put("angles", &[1.5_f32, -0.0, f32::MAX]);
        writer.put_one("step", u64::MAX);
        writer.put::<f64>("nothing", &[]);
        writer.fill("letters", 5, |into| into.copy_from_slice(b"reef!"));
        assert_eq!(writer.finished().unwrap(), saved());
    }

    #[test]
    fn missing_fields_and_other_types_are_named() {
        let bytes = saved();
        let mut reader = StateReader::parse(1, &bytes).unwrap();
        assert_eq!(reader.get::<u8>("gone"), Err(StateError::Missing("gone".into())));
        assert!(reader.get_one::<f32>("step").unwrap_err().to_string().contains("`step`"));
        assert!(
            reader
                .fill("angles", &mut [0.0_f32; 2])
                .unwrap_err()
                .to_string()
                .contains("3 values in place of 2")
        );
        assert!(reader.get_one::<f32>("angles").is_err());
    }

    #[test]
    fn a_state_cut_anywhere_or_with_bytes_behind_it_is_refused() {
        let bytes = saved();
        for length in 0..bytes.len() {
            assert!(StateReader::parse(1, &bytes[..length]).is_err(), "cut to {length} bytes");
        }
        let mut longer = bytes.clone();
        longer.push(0);
        assert!(StateReader::parse(1, &longer).is_err());
        let mut huge = bytes;
        huge[HEADER + 16..HEADER + 24].copy_from_slice(&u64::MAX.to_le_bytes());
        assert!(StateReader::parse(1, &huge).is_err());
        assert!(StateReader::parse(1, b"some other file altogether").is_err());
    }

    #[test]
    fn two_fields_of_one_name_are_refused() {
        let mut writer = StateWriter::new();
        writer.put_one("a", 1_u32);
        writer.put_one("a", 2_u32);
        assert!(writer.finish().unwrap_err().contains("`a`"));
    }
}
