//! What particles are without a word of the scene's.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A kind of particle (§3.1). Each has its place in the sea: sand and clay near the bed, phytoplankton near
/// the surface, marine snow between.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Grains that were stirred up from the bed.
    Sand,
    /// Flocs so fine that they hardly ever settle.
    Clay,
    /// Small plants near the surface, where the light is.
    Phytoplankton,
    /// Marine snow: flakes and threads of what once lived.
    #[default]
    Detritus,
    /// Small animals that drift.
    Plankton,
}

/// How a particle lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Orientation {
    /// Anyhow, each for itself.
    Random,
    /// Turned to the viewer.
    Facing,
}

/// What a kind looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Defaults {
    /// Least and greatest diameter [m].
    pub size: [f64; 2],
    /// 0..1
    pub opacity: f64,
    /// sRGB 0xRRGGBB.
    pub color: u32,
    /// How much lighter or darker one is than the next, 0..1.
    pub variation: f64,
    /// How it lies.
    pub orientation: Orientation,
    /// Particles in a cubic metre.
    pub concentration: f64,
    /// The picture.
    pub texture: &'static [u8],
    /// Its name.
    pub name: &'static str,
}

impl Kind {
    /// What it looks like, unless the scene says otherwise.
    pub fn defaults(self) -> Defaults {
        match self {
            Self::Sand => Defaults {
                size: [0.6e-3, 1.6e-3],
                opacity: 0.8,
                color: 0x00e3_d6b8,
                variation: 0.25,
                orientation: Orientation::Random,
                concentration: 100.0,
                texture: include_bytes!("../../../../assets/textures/sand.png"),
                name: "sand",
            },
            Self::Clay => Defaults {
                size: [0.4e-3, 1.2e-3],
                opacity: 0.4,
                color: 0x00c2_ab8e,
                variation: 0.15,
                orientation: Orientation::Facing,
                concentration: 200.0,
                texture: include_bytes!("../../../../assets/textures/clay.png"),
                name: "clay",
            },
            Self::Phytoplankton => Defaults {
                size: [0.8e-3, 2.2e-3],
                opacity: 0.6,
                color: 0x00c4_d98e,
                variation: 0.2,
                orientation: Orientation::Random,
                concentration: 40.0,
                texture: include_bytes!("../../../../assets/textures/phytoplankton.png"),
                name: "phytoplankton",
            },
            Self::Detritus => Defaults {
                size: [1.0e-3, 6.0e-3],
                opacity: 0.55,
                color: 0x00e6_e3d8,
                variation: 0.2,
                orientation: Orientation::Facing,
                concentration: 40.0,
                texture: include_bytes!("../../../../assets/textures/detritus.png"),
                name: "detritus",
            },
            Self::Plankton => Defaults {
                size: [1.2e-3, 3.0e-3],
                opacity: 0.6,
                color: 0x00f2_ddcf,
                variation: 0.2,
                orientation: Orientation::Random,
                concentration: 20.0,
                texture: include_bytes!("../../../../assets/textures/plankton.png"),
                name: "plankton",
            },
        }
    }
}

/// The picture of a local fog.
pub const FOG_TEXTURE: &[u8] = include_bytes!("../../../../assets/textures/fog.png");
