//! Draws by what a picture's materials need: a software rasteriser runs both sides of every branch, so what
//! no material needs is not compiled in.

use reef_abi::Material;

use super::{layers::size_bit, quality::Quality};

/// What mirrors no more than this is not seen to mirror anything: a little more than tissue under water does.
const TISSUE: f32 = 0.001;

/// What is compiled into the shaders of materials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Variant {
    /// Of the picture.
    pub quality: Quality,
    /// Bit n: some material has pattern n.
    pub patterns: u32,
    /// Bit n: some material has a texture of size n; 0: none has any.
    pub textures: u32,
    /// Some material mirrors more light than tissue does.
    pub shiny: bool,
}

impl Variant {
    /// What these materials need, whose textures are handles already.
    pub fn of<'a>(quality: Quality, materials: impl Iterator<Item = &'a Material>) -> Self {
        materials.fold(Self { quality, ..Self::default() }, |all, m| Self {
            patterns: all.patterns | 1_u32.checked_shl(m.pattern).unwrap_or(0),
            textures: all.textures | if m.texture == 0 { 0 } else { size_bit(m.texture) },
            shiny: all.shiny || m.specular > TISSUE,
            ..all
        })
    }
}

/// The draws of each variant that was met, and the picture's own.
pub struct Variants<D> {
    met: Vec<(Variant, D)>,
    chosen: Variant,
}

impl<D> Default for Variants<D> {
    fn default() -> Self {
        Self { met: Vec::new(), chosen: Variant::default() }
    }
}

impl<D> Variants<D> {
    /// The picture needs this one; `describe` makes it when it is met for the first time.
    pub fn choose(&mut self, variant: Variant, describe: impl FnOnce(Variant) -> D) {
        self.chosen = variant;
        if self.get().is_none() {
            self.met.push((variant, describe(variant)));
        }
    }

    /// What the picture needs.
    pub fn chosen(&self) -> Variant {
        self.chosen
    }

    /// The picture's draws; None before the first picture.
    pub fn get(&self) -> Option<&D> {
        self.met.iter().find(|(variant, _)| *variant == self.chosen).map(|(_, draws)| draws)
    }
}
