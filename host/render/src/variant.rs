//! Draws by what a picture's materials need: a software rasteriser runs both sides of every branch, so what
//! no material needs is not compiled in.

use std::ops::RangeInclusive;

use reef_abi::{self as abi, Material};

use super::{gather::Gathered, layers::size_bit, quality::Quality};

/// What mirrors no more than this is not seen to mirror anything: a little more than tissue under water does.
const TISSUE: f32 = 0.001;
/// The patterns that shaders have; what has another one has none.
const PATTERNS: RangeInclusive<u32> = abi::PATTERN_SPOTS..=abi::PATTERN_BLOTCHES;

/// What is compiled into the shaders of materials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Variant {
    /// Of the picture.
    pub quality: Quality,
    /// Bit n: some material has pattern n, which is one that there is.
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
            patterns: all.patterns | if PATTERNS.contains(&m.pattern) { 1 << m.pattern } else { 0 },
            textures: all.textures | if m.texture == 0 { 0 } else { size_bit(m.texture) },
            shiny: all.shiny || m.specular > TISSUE,
            ..all
        })
    }

    /// What the materials of a picture's fibres need; fibres mirror nothing.
    pub fn of_fibres(quality: Quality, gathered: &Gathered) -> Self {
        let mut worn = vec![false; gathered.materials.len()];
        gathered.fibres.iter().for_each(|fibre| worn[fibre.material as usize] = true);
        let used =
            gathered.materials.iter().zip(worn).filter_map(|(material, worn)| worn.then_some(material));
        Self { shiny: false, ..Self::of(quality, used) }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::GpuFibre;

    #[test]
    fn a_variant_has_the_patterns_that_there_are_and_no_others() {
        let patterns = |of: &[u32]| {
            let materials: Vec<Material> =
                of.iter().map(|pattern| Material { pattern: *pattern, ..Material::default() }).collect();
            Variant::of(Quality::High, materials.iter()).patterns
        };
        assert_eq!(patterns(&[abi::PATTERN_NONE]), 0);
        assert_eq!(patterns(&[abi::PATTERN_NONE, abi::PATTERN_SPOTS, abi::PATTERN_BLOTCHES]), 0b10010);
        assert_eq!(patterns(&[abi::PATTERN_BLOTCHES + 1, 31, 32, u32::MAX]), 0);
    }

    #[test]
    fn what_only_meshes_wear_is_not_compiled_into_fibres() {
        let own = Material { pattern: abi::PATTERN_BANDS, specular: 0.5, ..Material::default() };
        let others = Material { pattern: abi::PATTERN_SPOTS, texture: 1 << 16, ..own };
        let gathered = Gathered {
            fibres: vec![GpuFibre { material: 1, ..GpuFibre::default() }],
            materials: vec![others, own],
            ..Gathered::default()
        };
        let alone = Variant { patterns: 1 << abi::PATTERN_BANDS, ..Variant::default() };
        assert_eq!(Variant::of_fibres(Quality::default(), &gathered), alone);
    }
}
