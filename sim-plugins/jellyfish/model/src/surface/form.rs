//! What a surface looks like, and what of it never changes: vertices' places in the mesh, triangles, texture
//! coordinates.

use reef_sdk::abi::MeshVertex;

use super::noise::AROUND;
use crate::lanes::WIDTH;

/// The looks of a species' surface. Lengths are in units of the bell's thickness ϑ, as in figure 11.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Form {
    /// Vertices around a ring: a multiple of 64, up to 256.
    pub around: usize,
    /// Rings from the apex over the margin to the inner apex, 8 to 256.
    pub rings: usize,
    /// Thickness of the mesoglea at the margin over that at the apex.
    pub margin_thickness: f64,
    /// α_str / ϑ: height of structural ridges, eq. (2).
    pub structure: f64,
    /// f of eq. (2).
    pub structures: u32,
    /// |sin| instead of sin in eq. (2): grooves between lobes.
    pub lobes: bool,
    /// α_cmp / ϑ: height of the ridges of a contracted bell, eq. (4).
    pub compression: f64,
    /// How many of these there are around the bell.
    pub compressions: u32,
    /// α_noise / ϑ: differences between individuals, eq. (5).
    pub noise: f64,
}

impl Default for Form {
    fn default() -> Self {
        Self {
            around: 64,
            rings: 92,
            margin_thickness: 0.3,
            structure: 0.375,
            structures: 8,
            lobes: false,
            compression: 0.25,
            compressions: 16,
            noise: 2.25,
        }
    }
}

/// Fewest and most rings, and most vertices around.
const RINGS: [usize; 2] = [8, 256];
const MOST_AROUND: usize = 256;

impl Form {
    /// Whether it can be made.
    ///
    /// # Errors
    /// The key, what is wrong with it, and what is allowed.
    pub fn check(&self) -> Result<(), String> {
        let step = AROUND * WIDTH;
        if self.around == 0 || !self.around.is_multiple_of(step) || self.around > MOST_AROUND {
            return Err(format!(
                "around must be a multiple of {step} up to {MOST_AROUND}, is {}",
                self.around
            ));
        }
        let [fewest, most] = RINGS;
        if !(fewest..=most).contains(&self.rings) || self.rings % 2 == 1 {
            return Err(format!("rings must be even and {fewest} to {most}, are {}", self.rings));
        }
        if !(0.02..=1.0).contains(&self.margin_thickness) {
            return Err(format!("margin_thickness must be 0.02 to 1, is {}", self.margin_thickness));
        }
        let heights =
            [("structure", self.structure), ("compression", self.compression), ("noise", self.noise)];
        for (key, value) in heights {
            if !(0.0..=10.0).contains(&value) {
                return Err(format!("{key} must be 0 to 10, is {value}"));
            }
        }
        for (key, value) in [("structures", self.structures), ("compressions", self.compressions)] {
            // A wave needs four vertices to be seen as one.
            if value as usize * 4 > self.around {
                return Err(format!(
                    "{key} must be at most {} for {} vertices around, are {value}",
                    self.around / 4,
                    self.around
                ));
            }
        }
        Ok(())
    }

    /// Vertices of the bell: its rings, then the outer and the inner apex.
    pub fn bell_vertices(&self) -> usize {
        self.rings * self.around + 2
    }

    /// Triangles of the bell, counter-clockwise from outside, closed. They come from the inner apex over the
    /// margin to the outer one: where light shines through, what is seen last is drawn last.
    pub fn bell_indices(&self) -> Vec<u32> {
        let (around, rings) = (self.around as u32, self.rings as u32);
        let at = |ring: u32, j: u32| ring * around + j % around;
        let [outer, inner] = [rings * around, rings * around + 1];
        let mut indices = Vec::with_capacity(6 * self.rings * self.around);
        indices.extend((0..around).flat_map(|j| [inner, at(rings - 1, j), at(rings - 1, j + 1)]));
        for ring in (0..rings - 1).rev() {
            for j in 0..around {
                let [a, b, c, d] = [at(ring, j), at(ring, j + 1), at(ring + 1, j), at(ring + 1, j + 1)];
                indices.extend([a, b, c, b, d, c]);
            }
        }
        indices.extend((0..around).flat_map(|j| [outer, at(0, j + 1), at(0, j)]));
        indices
    }

    /// Texture coordinates of the bell's vertices: u around, v from the outer apex (0) to the inner one (1).
    pub fn bell_mesh(&self) -> Vec<MeshVertex> {
        let vertex = |u: f64, v: f64| MeshVertex {
            uv: [u as f32, v as f32],
            glow: 1.0,
            color: u32::MAX,
            ..MeshVertex::default()
        };
        let mut vertices = Vec::with_capacity(self.bell_vertices());
        for ring in 0..self.rings {
            for j in 0..self.around {
                vertices.push(vertex(j as f64 / self.around as f64, self.place(ring)));
            }
        }
        vertices.extend([vertex(0.0, 0.0), vertex(0.0, 1.0)]);
        vertices
    }

    /// Where a ring lies on the way from the outer apex (0) over the margin (1/2) to the inner one (1).
    pub(crate) fn place(&self, ring: usize) -> f64 {
        (ring + 1) as f64 / (self.rings + 1) as f64
    }
}
