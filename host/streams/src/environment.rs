//! What a scene fixes for its whole length and the renderer needs: water, light, ground.

use std::sync::Arc;

use glam::Vec3;
use reef_abi as abi;

/// How water changes light, per metre at 620/540/460 nm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaterOptics {
    /// Beam attenuation c along a view ray [1/m].
    pub beam: [f32; 3],
    /// Downwelling attenuation Kd of sunlight with depth [1/m].
    pub downwelling: [f32; 3],
    /// Light scattered toward the viewer at the surface, W0 (linear RGB).
    pub scattered: [f32; 3],
}

/// The light from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit vector under water from the scene toward the refracted sun.
    pub direction: Vec3,
    /// Direct light just below the surface (linear RGB; white is 1).
    pub color: [f32; 3],
    /// Light from the whole hemisphere just below the surface (linear RGB).
    pub ambient: [f32; 3],
    /// How bright the shafts of light are, as a multiple; 0: there are none.
    pub shafts: f32,
}

/// A half-buried boulder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rock {
    /// Centre [m].
    pub position: [f64; 3],
    /// Half axes [m].
    pub half_axes: [f32; 3],
    /// Turn about y [rad].
    pub yaw: f32,
    /// Shape of its bumps.
    pub seed: u32,
}

/// The sea bed: heights y at origin + (column, row) · cell, row after row along z, bilinear between.
#[derive(Clone, Debug, PartialEq)]
pub struct Terrain {
    /// x and z of the first height [m].
    pub origin: [f64; 2],
    /// Distance between two heights [m].
    pub cell: f32,
    /// Heights along x.
    pub columns: u32,
    /// Heights along z.
    pub rows: u32,
    /// y [m], `rows * columns` of them.
    pub heights: Vec<f32>,
    /// Boulders, already settled into the ground.
    pub rocks: Vec<Rock>,
    /// Sand ripples, for the eye only.
    pub ripples: Ripples,
}

/// The sea bed as modules read it.
#[derive(Clone, Copy, Debug)]
pub struct Heightfield<'a> {
    /// y [m], `rows * columns`, row after row along z, columns along x.
    pub heights: &'a [f32],
    /// x and z of the first height [m].
    pub origin: [f64; 2],
    /// Distance between two heights [m].
    pub cell: f32,
    /// Heights along x.
    pub columns: u32,
    /// Heights along z.
    pub rows: u32,
}

/// Sand ripples on the bed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ripples {
    /// From crest to crest [m].
    pub spacing: f32,
    /// Of a crest over its trough [m]; 0: smooth sand.
    pub height: f32,
    /// Way of the surge across the crests [rad]: 0 along +z, π/2 along +x.
    pub direction: f32,
}

impl Default for Ripples {
    fn default() -> Self {
        Self { spacing: 0.14, height: 0.012, direction: 1.2 }
    }
}

/// The still part of a scene, as the renderer sees it.
#[derive(Clone, Debug)]
pub struct Environment {
    /// How the water looks.
    pub optics: WaterOptics,
    /// The light.
    pub sun: Sun,
    /// None: open water without ground (the figures' scenes).
    pub terrain: Option<Arc<Terrain>>,
    /// A plain background colour (linear RGB) in place of water, for diagrams. None: the sea.
    pub plain_background: Option<[f32; 3]>,
    /// Wave trains, greatest first; empty on a still sea.
    pub waves: Vec<abi::Wave>,
}

impl Environment {
    /// The ground as modules read it.
    pub fn heightfield(&self) -> Option<Heightfield<'_>> {
        self.terrain.as_deref().map(|terrain| Heightfield {
            heights: &terrain.heights,
            origin: terrain.origin,
            cell: terrain.cell,
            columns: terrain.columns,
            rows: terrain.rows,
        })
    }
}
