//! Textures that instances made. They stay with the instance that made them, in the program's memory: the outputs of each
//! step carry the list, and a renderer that looks at them brings them to its device. So a sea without a renderer has them,
//! too, and they go with the last outputs that name them, however the instance ended.

use std::sync::Arc;

use reef_abi as abi;

/// Most textures that one instance may have at a time.
pub const MOST_TEXTURES: usize = 64;
/// Most texels along a side.
pub const LONGEST_SIDE: u32 = 1024;
/// Longest name that is kept [bytes].
const LONGEST_NAME: usize = 200;

/// One picture, as its instance gave it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// What elements call it. What is made again while it is there has the same id, so that an instance that takes up a saved
    /// state, and makes its textures anew for that, emits the same bytes. Never used for anything else.
    pub id: u32,
    /// For messages and debuggers.
    pub name: String,
    /// Texels along a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green and blue are sRGB; else linear. Alpha is linear and straight.
    pub srgb: bool,
    /// Four bytes a texel, row after row.
    pub texels: Vec<u8>,
    /// Of size, encoding and texels: what is the same has the same.
    pub hash: [u8; 32],
}

/// The textures of one instance, in the order of their ids.
pub type TextureList = Arc<Vec<Arc<Texture>>>;

/// What a plugin wants a texture to be, out of the contract's struct.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    /// For messages and debuggers.
    pub name: &'a str,
    /// `abi::TEXTURE_*`.
    pub format: u32,
    /// Texels along a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Wanted<'_> {
    /// Bytes of its texels, or why there can be no such texture.
    pub fn bytes(&self) -> Result<usize, String> {
        let Self { name, format, width, height } = *self;
        if !matches!(format, abi::TEXTURE_RGBA8_SRGB | abi::TEXTURE_RGBA8) {
            return Err(format!("`{name}`: the format is {format}, allowed is 1 (sRGB) or 2 (linear)"));
        }
        let side = 1..=LONGEST_SIDE;
        if !side.contains(&width) || !side.contains(&height) {
            return Err(format!(
                "`{name}`: {width} x {height} texels, allowed is 1 to {LONGEST_SIDE} along each side"
            ));
        }
        Ok(width as usize * height as usize * 4)
    }
}

/// Why textures were refused: the first reason of each kind.
#[derive(Clone, Debug, Default)]
pub struct Refused {
    /// It is none that can be made, or was asked for where none is.
    pub unfit: Option<String>,
    /// One more than there may be.
    pub too_many: Option<String>,
    /// One was to be destroyed that is not there.
    pub missing: Option<String>,
}

/// The textures that one instance has now.
#[derive(Debug, Default)]
pub struct Textures {
    /// What was refused so far.
    pub refused: Refused,
    list: TextureList,
    /// How often each was made and not destroyed.
    holders: Vec<u64>,
    last: u32,
}

impl Textures {
    /// Those that there are.
    pub fn list(&self) -> &TextureList {
        &self.list
    }

    /// Makes one of `wanted.bytes()` bytes; its id.
    pub fn add(&mut self, wanted: Wanted<'_>, texels: &[u8]) -> Result<u32, String> {
        let name = shortened(wanted.name);
        let mut hasher = blake3::Hasher::new();
        for word in [wanted.format, wanted.width, wanted.height] {
            hasher.update(&word.to_le_bytes());
        }
        let hash = *hasher.update(texels).finalize().as_bytes();
        if let Some(at) = self.list.iter().position(|made| made.hash == hash && made.name == name) {
            self.holders[at] += 1;
            return Ok(self.list[at].id);
        }
        if self.list.len() >= MOST_TEXTURES || self.last == u32::MAX {
            let reason = format!("`{name}`: the instance has {MOST_TEXTURES} textures, which is the limit");
            self.refused.too_many.get_or_insert_with(|| reason.clone());
            return Err(reason);
        }
        self.last += 1;
        let texture = Texture {
            id: self.last,
            name,
            width: wanted.width,
            height: wanted.height,
            srgb: wanted.format == abi::TEXTURE_RGBA8_SRGB,
            texels: texels.to_vec(),
            hash,
        };
        Arc::make_mut(&mut self.list).push(Arc::new(texture));
        self.holders.push(1);
        Ok(self.last)
    }

    /// Forgets one, once it was destroyed as often as made.
    pub fn remove(&mut self, id: u32) -> Result<(), String> {
        let Some(at) = self.list.iter().position(|texture| texture.id == id) else {
            let reason = format!("the instance has no texture {id}");
            self.refused.missing.get_or_insert_with(|| reason.clone());
            return Err(reason);
        };
        self.holders[at] -= 1;
        if self.holders[at] == 0 {
            self.holders.remove(at);
            Arc::make_mut(&mut self.list).remove(at);
        }
        Ok(())
    }
}

/// Whether elements may name this texture; 0 is the host's own.
pub fn known(list: &[Arc<Texture>], id: u32) -> bool {
    id == 0 || list.binary_search_by_key(&id, |texture| texture.id).is_ok()
}

fn shortened(name: &str) -> String {
    let mut end = name.len().min(LONGEST_NAME);
    while !name.is_char_boundary(end) {
        end -= 1;
    }
    name[..end].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wanted(name: &str) -> Wanted<'_> {
        Wanted { name, format: abi::TEXTURE_RGBA8, width: 2, height: 1 }
    }

    #[test]
    fn ids_are_never_used_for_anything_else_and_what_is_made_again_keeps_its_own() {
        let mut textures = Textures::default();
        let a = textures.add(wanted("a"), &[1; 8]).expect("room");
        let b = textures.add(wanted("b"), &[1; 8]).expect("room");
        assert_eq!(textures.add(wanted("a"), &[1; 8]), Ok(a), "the same once more");
        let before = textures.list().clone();
        assert_eq!((before.len(), before[0].hash), (2, before[1].hash));
        assert_eq!((textures.remove(a), textures.list().len()), (Ok(()), 2), "it was made twice");
        textures.remove(a).expect("it is there");
        let c = textures.add(wanted("a"), &[2; 8]).expect("room");
        assert_eq!([a, b, c], [1, 2, 3]);
        assert_ne!(textures.list()[1].hash, before[0].hash);
        assert_eq!(before.len(), 2, "who holds the older list keeps it");
        assert_eq!([0, 1, 2, 3, 4].map(|id| known(textures.list(), id)), [true, false, true, true, false]);
        assert_eq!(textures.remove(1), Err("the instance has no texture 1".to_owned()));
    }

    #[test]
    fn a_limit_is_named_in_its_error() {
        let mut textures = Textures::default();
        for i in 0..MOST_TEXTURES {
            textures.add(wanted("x"), &[i as u8; 8]).expect("room");
        }
        assert_eq!(textures.add(wanted("x"), &[0; 8]), Ok(1), "one that is there already needs no room");
        assert!(textures.add(wanted("y"), &[0; 8]).expect_err("it is full").contains("64 textures"));
        let wide = Wanted { width: 1025, ..wanted("wide") }.bytes().expect_err("too wide");
        assert!(wide.contains("`wide`: 1025 x 1 texels") && wide.contains("1024"), "{wide}");
        assert!(Wanted { height: 0, ..wanted("flat") }.bytes().is_err());
        assert!(
            Wanted { format: 9, ..wanted("odd") }.bytes().expect_err("no format").contains("format is 9")
        );
        assert_eq!(wanted("x").bytes(), Ok(8));
    }

    #[test]
    fn a_long_name_is_cut_between_two_characters() {
        assert_eq!(shortened(&"é".repeat(150)).chars().count(), 100);
    }
}
