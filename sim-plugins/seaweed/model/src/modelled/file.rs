//! A binary glTF 2.0 file: its JSON, looked at once, and numbers of its one buffer, read within bounds.

use core::fmt;

use gltf_json::{
    Index, Root,
    accessor::{Accessor, ComponentType, Type},
    mesh::Semantic,
    validation::{Checked, Validate},
};

/// Longest file [bytes]: a plant of 20 000 vertices has about two.
pub const MOST_BYTES: usize = 16 << 20;
/// Longest JSON [bytes]: one of 256 joints has a tenth of it.
const MOST_JSON: usize = 1 << 20;

/// What is wrong with a file: where in its JSON, what, and what is allowed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Path in the JSON, like `skins[0].joints[3]`; empty: the file as a whole.
    pub path: String,
    /// What is wrong, and what is allowed.
    pub problem: String,
}

impl Fault {
    pub(super) fn new(path: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { path: path.into(), problem: problem.into() }
    }

    /// Of the file as a whole.
    pub(super) fn whole(problem: impl Into<String>) -> Self {
        Self::new("", problem)
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.path.as_str() {
            "" => f.write_str(&self.problem),
            path => write!(f, "{path}: {}", self.problem),
        }
    }
}

impl std::error::Error for Fault {}

/// A file whose indices all lead somewhere.
#[derive(Debug)]
pub(super) struct File<'a> {
    pub(super) root: Root,
    bin: &'a [u8],
}

/// Number at a place, little-endian.
fn word(bytes: &[u8], at: usize) -> Option<usize> {
    let four = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(four.try_into().ok()?) as usize)
}

/// The JSON and the buffer of a `.glb`.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), Fault> {
    if !bytes.starts_with(b"glTF") {
        return Err(Fault::whole(
            "is no binary glTF; allowed is a .glb file, as \"glTF Binary\" is exported",
        ));
    }
    let cut = || Fault::whole(format!("is cut off: it has {} bytes, and says that it has more", bytes.len()));
    let (version, length) = (word(bytes, 4).ok_or_else(cut)?, word(bytes, 8).ok_or_else(cut)?);
    if version != 2 {
        return Err(Fault::whole(format!("is of glTF version {version}; allowed is 2")));
    }
    let whole = bytes.get(12..length).ok_or_else(cut)?;
    let chunk = |at: usize| -> Result<(&[u8], &[u8], usize), Fault> {
        let size = word(whole, at).ok_or_else(cut)?;
        let end = (at + 8).checked_add(size).ok_or_else(cut)?;
        let kind = whole.get(at + 4..at + 8).ok_or_else(cut)?;
        Ok((kind, whole.get(at + 8..end).ok_or_else(cut)?, end))
    };
    let (kind, json, end) = chunk(0)?;
    if kind != b"JSON" {
        return Err(Fault::whole("does not begin with its JSON"));
    }
    if json.len() > MOST_JSON {
        let problem = format!("has {} bytes of JSON; at most {MOST_JSON} are allowed", json.len());
        return Err(Fault::whole(problem));
    }
    // Without a buffer there is no second chunk; what follows it is for others.
    let bin = match end {
        end if end < whole.len() => match chunk(end)? {
            (b"BIN\0", bin, _) => bin,
            _ => &[],
        },
        _ => &[],
    };
    Ok((json, bin))
}

/// The look at the whole file takes it for granted that positions lead to accessors.
fn check_positions(root: &Root) -> Result<(), Fault> {
    for (i, mesh) in root.meshes.iter().enumerate() {
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            if let Some(at) = primitive.attributes.get(&Checked::Valid(Semantic::Positions))
                && at.value() >= root.accessors.len()
            {
                let path = format!("meshes[{i}].primitives[{k}].attributes.POSITION");
                let problem = format!("is accessor {} of {}", at.value(), root.accessors.len());
                return Err(Fault::new(path, problem));
            }
        }
    }
    Ok(())
}

impl<'a> File<'a> {
    /// Reads the JSON and looks at it.
    ///
    /// # Errors
    /// No binary glTF 2.0, one that is cut off or too long, JSON that is none or leads nowhere, an extension
    /// without which the file cannot be read.
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, Fault> {
        if bytes.len() > MOST_BYTES {
            let problem = format!("has {} bytes; at most {MOST_BYTES} are allowed", bytes.len());
            return Err(Fault::whole(problem));
        }
        let (json, bin) = chunks(bytes)?;
        let root: Root = gltf_json::deserialize::from_slice(json)
            .map_err(|error| Fault::whole(format!("its JSON is wrong: {error}")))?;
        if let Some(needed) = root.extensions_required.first() {
            let problem = format!("needs `{needed}`; allowed are files that need no extension");
            return Err(Fault::new("extensionsRequired[0]", problem));
        }
        check_positions(&root)?;
        let mut fault = None;
        root.validate(&root, gltf_json::Path::new, &mut |path, error| {
            fault.get_or_insert_with(|| Fault::new(path().to_string(), format!("{error}")));
        });
        match fault {
            Some(fault) => Err(fault),
            None => Ok(Self { root, bin }),
        }
    }

    /// What an accessor has, and what one number of it is; `most` of them are allowed.
    fn look(
        &self,
        at: Index<Accessor>,
        shapes: &[Type],
        most: usize,
    ) -> Result<(&Accessor, ComponentType, Type), Fault> {
        let path = format!("accessors[{}]", at.value());
        let fault = |key: &str, problem: String| Err(Fault::new(format!("{path}{key}"), problem));
        let Some(accessor) = self.root.get(at) else { return fault("", "is not there".into()) };
        let (Checked::Valid(kind), Checked::Valid(shape)) = (accessor.component_type, accessor.type_) else {
            return fault("", "is of no type".into());
        };
        if !shapes.contains(&shape) {
            return fault(".type", format!("must be one of {shapes:?} here, is {shape:?}"));
        }
        if accessor.sparse.is_some() {
            return fault(".sparse", "is not read; allowed are accessors that are whole".into());
        }
        if accessor.count.0 > most as u64 {
            return fault(".count", format!("is {}; at most {most} are allowed", accessor.count.0));
        }
        Ok((accessor, kind.0, shape))
    }

    /// Calls `each` with the bytes of every element of an accessor.
    fn elements(
        &self,
        at: Index<Accessor>,
        accessor: &Accessor,
        size: usize,
        mut each: impl FnMut(&[u8]),
    ) -> Result<(), Fault> {
        let path = format!("accessors[{}]", at.value());
        let Some(number) = accessor.buffer_view else {
            return Err(Fault::new(format!("{path}.bufferView"), "is missing"));
        };
        let of_view = format!("bufferViews[{}]", number.value());
        let view = self.root.get(number).ok_or_else(|| Fault::new(of_view.clone(), "is not there"))?;
        let buffer = view.buffer.value();
        if self.root.buffers.get(buffer).is_some_and(|buffer| buffer.uri.is_some()) || buffer > 0 {
            let problem = "lies in another file; allowed is a .glb that holds its only buffer itself";
            return Err(Fault::new(format!("buffers[{buffer}].uri"), problem));
        }
        let beyond = |path: &str, what: &str| Err(Fault::new(path, format!("reaches beyond {what}")));
        let offset = view.byte_offset.map_or(0, |offset| offset.0);
        let range = usize::try_from(offset).ok().and_then(|start| {
            let end = start.checked_add(usize::try_from(view.byte_length.0).ok()?)?;
            self.bin.get(start..end)
        });
        let Some(bytes) = range else {
            return beyond(&of_view, &format!("the buffer's {} bytes", self.bin.len()));
        };
        let stride = view.byte_stride.map_or(size, |stride| stride.0);
        if stride < size {
            let problem = format!("is {stride}; an element has {size} bytes");
            return Err(Fault::new(format!("{of_view}.byteStride"), problem));
        }
        let start = accessor.byte_offset.map_or(0, |offset| offset.0);
        for i in 0..accessor.count.0 {
            let from = start.checked_add(i * stride as u64).and_then(|from| usize::try_from(from).ok());
            let element = from.and_then(|from| bytes.get(from..from.checked_add(size)?));
            let Some(element) = element else {
                return beyond(&path, &format!("its view's {} bytes", bytes.len()));
            };
            each(element);
        }
        Ok(())
    }

    /// Numbers of an accessor, element after element, and how many an element has. Whole numbers stand for
    /// shares of their type's greatest.
    ///
    /// # Errors
    /// It is of another shape, too long, reaches beyond its buffer, or has a number that is none.
    pub(super) fn numbers(
        &self,
        at: Index<Accessor>,
        shapes: &[Type],
        most: usize,
    ) -> Result<(Vec<f32>, usize), Fault> {
        let (accessor, kind, shape) = self.look(at, shapes, most)?;
        let path = || format!("accessors[{}]", at.value());
        let mut numbers = Vec::new();
        let each = |element: &[u8]| {
            numbers.extend(element.chunks_exact(kind.size()).map(|bytes| match *bytes {
                [byte] => f32::from(byte) / f32::from(u8::MAX),
                [a, b] => f32::from(u16::from_le_bytes([a, b])) / f32::from(u16::MAX),
                [a, b, c, d] => f32::from_le_bytes([a, b, c, d]),
                _ => f32::NAN,
            }));
        };
        if !matches!(kind, ComponentType::F32 | ComponentType::U8 | ComponentType::U16) {
            let problem = format!("must be floats, or bytes or words without a sign, is {kind:?}");
            return Err(Fault::new(format!("{}.componentType", path()), problem));
        }
        self.elements(at, accessor, kind.size() * shape.multiplicity(), each)?;
        if let Some(wrong) = numbers.iter().position(|x| !x.is_finite() || x.abs() > FARTHEST) {
            let element = wrong / shape.multiplicity();
            let problem =
                format!("has {} in element {element}; allowed is up to ±{FARTHEST}", numbers[wrong]);
            return Err(Fault::new(path(), problem));
        }
        Ok((numbers, shape.multiplicity()))
    }

    /// Whole numbers of an accessor, element after element.
    ///
    /// # Errors
    /// As [`File::numbers`].
    pub(super) fn counts(&self, at: Index<Accessor>, shape: Type, most: usize) -> Result<Vec<u32>, Fault> {
        let (accessor, kind, shape) = self.look(at, &[shape], most)?;
        if !matches!(kind, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
            let path = format!("accessors[{}].componentType", at.value());
            return Err(Fault::new(path, format!("must be whole numbers without a sign, is {kind:?}")));
        }
        let mut counts = Vec::new();
        let each = |element: &[u8]| {
            let number = |bytes: &[u8]| bytes.iter().rev().fold(0, |sum, byte| sum << 8 | u32::from(*byte));
            counts.extend(element.chunks_exact(kind.size()).map(number));
        };
        self.elements(at, accessor, kind.size() * shape.multiplicity(), each)?;
        Ok(counts)
    }
}

/// No number of a file is greater: lengths in metres, and what scales them.
const FARTHEST: f32 = 1e5;
