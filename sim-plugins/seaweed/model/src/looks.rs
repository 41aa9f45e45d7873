//! Colours: of materials, of a mesh's vertices, and how individuals differ.

use reef_flow::color::{byte, linear_rgb};
use reef_sdk::abi::Material;

use crate::{mesh::AGES, sow::Traits, species::Species};

/// What a tip pales to with age.
const PALE: [f32; 3] = [0.62, 0.52, 0.26];
/// What grows on old blades.
const OVERGROWN: [f32; 3] = [0.24, 0.20, 0.11];

/// Colours of a species at an age, linear. A material has the greatest of the root's and the stem's in each
/// channel; vertices take from it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Palette {
    base: [f32; 3],
    tip: [f32; 3],
    /// Of stems over the base's.
    stem: [f32; 3],
    /// Of a blade's root over the base's.
    root: [f32; 3],
    /// From young (0) to old (1).
    ripe: f32,
}

fn mixed(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    core::array::from_fn(|i| a[i] + (b[i] - a[i]) * share)
}

impl Palette {
    /// Of an age from 0 to [`AGES`] − 1.
    pub(crate) fn new(species: &Species, age: usize) -> Self {
        let rgb = |text: &str| linear_rgb(text).unwrap_or([0.5; 3]);
        let look = &species.look;
        let (stem, root) = (rgb(&look.stem), rgb(&look.base));
        let base: [f32; 3] = core::array::from_fn(|i| stem[i].max(root[i]).max(1e-3));
        let over = |color: [f32; 3]| core::array::from_fn(|i| color[i] / base[i]);
        let ripe = age as f32 / (AGES - 1) as f32 * species.variation.age as f32;
        let tip = mixed(rgb(&look.tip), PALE, 0.35 * ripe);
        Self { base, tip, stem: over(stem), root: over(root), ripe }
    }

    /// From young (0) to old (1).
    pub(crate) fn ripe(&self) -> f64 {
        f64::from(self.ripe)
    }

    /// The colour of a blade at a share of its length, overgrown by a share, linear.
    pub(crate) fn blade(&self, v: f64, overgrown: f64) -> [f32; 3] {
        let t = ((v as f32 - TIP) / (1.0 - TIP)).clamp(0.0, 1.0);
        let color = mixed(self.base, self.tip, t * t * (3.0 - 2.0 * t));
        mixed(color, OVERGROWN, overgrown as f32)
    }

    /// The colour of a vertex, sRGB: `stem` is how much it is a stem (1) or a blade (0), `shade` how much
    /// light it throws back.
    pub(crate) fn vertex(&self, stem: f64, shade: f64) -> u32 {
        self.tinted(stem, [shade; 3])
    }

    /// The same for a vertex that has a colour of its own, linear.
    pub(crate) fn tinted(&self, stem: f64, own: [f64; 3]) -> u32 {
        let color = mixed(self.root, self.stem, stem as f32);
        let [r, g, b] = core::array::from_fn(|i| byte(f64::from(color[i]) * own[i]));
        u32::from_le_bytes([r, g, b, 0xff])
    }
}

/// Share of a blade's length from which on it takes its tip's colour.
const TIP: f32 = 0.25;
/// What a blade that is wide mirrors: a soft gleam along it, no spot.
const GLEAM: f32 = 0.004;
/// How wide the gleam is.
const SOFT: f32 = 0.55;

/// The material of a species at an age; `texture` is that of its picture, 0 where it has none.
pub(crate) fn material(species: &Species, age: usize, texture: u32) -> Material {
    let palette = Palette::new(species, age);
    let with = |[r, g, b]: [f32; 3], last: f32| [r, g, b, last];
    let painted = texture != 0;
    Material {
        base: with(palette.base, 1.0),
        tip: with(palette.tip, TIP),
        texture,
        translucency: species.look.translucency as f32,
        wrap: 0.5,
        rim: 0.3,
        roughness: if painted { SOFT } else { 1.0 },
        specular: if painted { GLEAM } else { 0.0003 },
        ..Material::default()
    }
}

/// What makes the look of one plant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dress {
    /// Its mesh and its material among those of all species: species by species, age by age.
    pub number: u32,
    /// Of patterns, 0 to 1.
    pub phase: f32,
    /// Turn of its hues [rad].
    pub hue: f32,
    /// Colours times 1 + this.
    pub value: f32,
}

impl Dress {
    /// Of a plant of a species, by its number and its table.
    pub fn new(kind: usize, species: &Species, traits: &Traits) -> Self {
        let age = ((traits.age * AGES as f64) as usize).min(AGES - 1);
        let signed = |share: f64| 2.0 * share - 1.0;
        Self {
            number: (kind * AGES + age) as u32,
            phase: traits.phase as f32,
            hue: (species.variation.hue.to_radians() * signed(traits.hue)) as f32,
            // The hue's own lattice, folded: light ones are not all of one hue.
            value: (0.16 * signed((3.0 * traits.phase + traits.hue).fract())) as f32,
        }
    }
}
