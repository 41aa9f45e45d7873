//! Textures that instances made.

use reef_abi as abi;

pub use crate::retained::Refused;
use crate::retained::{List, Retained, Store, find};

/// Most textures that one instance may have at a time.
pub const MOST_TEXTURES: usize = 64;
/// Most texels along a side.
pub const LONGEST_SIDE: u32 = 1024;
/// One picture, as its instance gave it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// What elements call it.
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

impl Retained for Texture {
    const WHAT: &'static str = "texture";
    const MANY: &'static str = "textures";
    const MOST: usize = MOST_TEXTURES;

    fn id(&self) -> u32 {
        self.id
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn hash(&self) -> &[u8; 32] {
        &self.hash
    }
}

/// The textures of one instance, in the order of their ids.
pub type TextureList = List<Texture>;

/// The textures that one instance has now.
pub type Textures = Store<Texture>;

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

impl Textures {
    /// Makes one of `wanted.bytes()` bytes; its id.
    pub fn add(&mut self, wanted: Wanted<'_>, texels: &[u8]) -> Result<u32, String> {
        let mut hasher = blake3::Hasher::new();
        for word in [wanted.format, wanted.width, wanted.height] {
            hasher.update(&word.to_le_bytes());
        }
        let hash = *hasher.update(texels).finalize().as_bytes();
        self.hold(wanted.name, &hash, |id, name| Texture {
            id,
            name,
            width: wanted.width,
            height: wanted.height,
            srgb: wanted.format == abi::TEXTURE_RGBA8_SRGB,
            texels: texels.to_vec(),
            hash,
        })
    }
}

/// Whether elements may name this texture; 0 is the host's own.
pub fn known(list: &TextureList, id: u32) -> bool {
    id == 0 || find(list, id).is_some()
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
}
