//! Which tiles of the sea bed are drawn, and how fine: a quadtree around the eye whose finest tiles have the
//! height field's own cells.

use glam::{DVec2, Vec3};
use reef_streams::environment::Terrain;

use super::{quality::Quality, view::Lens};

/// Quads along a side of a tile at low quality, and at high quality.
pub(crate) const QUADS_LOW: u32 = 4;
pub(crate) const QUADS_HIGH: u32 = 8;

/// Quads along a side of a tile.
pub fn quads(quality: Quality) -> u32 {
    match quality {
        Quality::Low => QUADS_LOW,
        Quality::High => QUADS_HIGH,
    }
}
/// Tiles of one picture at most.
const MOST: usize = 1024;

/// Distance up to which a level is drawn, in sides of its tiles: so neighbours
/// differ by one level at most. A tile of side s ends within (3 + 2 sqrt(2)) s of the eye, one that is two
/// levels coarser begins at 6 s.
pub(crate) const SIDES: f64 = 3.0;
/// Coarsest level.
const LEVELS: u32 = 26;
/// Cells from the field's corner to the eye that count at most: single precision holds them exactly.
const NEAREST: f64 = (1 << 24) as f64;
/// Cells from the eye to where the bed ends at most: whole numbers of 32 bits hold all tiles.
const REACH: f64 = (1 << 28) as f64;

reef_gpu::record! {
    /// A tile as the shader reads it.
    pub struct Tile = "Tile" {
        /// Column and row of its corner [cells].
        pub corner: [i32; 2],
        /// Distance of its vertices [cells].
        pub step: i32,
    }
}

reef_gpu::record! {
    /// A height with its slopes, as the shader reads it.
    pub struct Height = "Height" {
        /// y [m].
        pub height: f32,
        /// dy/dx, dy/dz.
        pub slope: [f32; 2],
    }
}

/// Lowest and highest ground of a height field [m].
pub fn band(terrain: &Terrain) -> [f32; 2] {
    let wider = |[low, high]: [f32; 2], h: &f32| [low.min(*h), high.max(*h)];
    terrain.heights.iter().fold([f32::INFINITY, f32::NEG_INFINITY], wider)
}

/// How far an eye at a height is from the layer that the ground lies in [m].
pub fn aloof([low, high]: [f32; 2], eye: f64) -> f64 {
    (eye - f64::from(high)).max(f64::from(low) - eye).max(0.0)
}

/// Column and row of the height that is nearest to an eye; the field may end before it.
pub fn nearest(terrain: &Terrain, lens: &Lens) -> DVec2 {
    let eye = DVec2::new(lens.eye.x, lens.eye.z);
    let at = (eye - DVec2::from(terrain.origin)) / f64::from(terrain.cell);
    at.round().clamp(DVec2::splat(-NEAREST), DVec2::splat(NEAREST))
}

/// Heights with their slopes, row by row.
pub fn heights(terrain: &Terrain) -> Vec<Height> {
    let (columns, rows) = (terrain.columns as usize, terrain.rows as usize);
    let at = |x: usize, z: usize| terrain.heights[z.min(rows - 1) * columns + x.min(columns - 1)];
    let slope = |low: f32, high: f32, steps: usize| (high - low) / (steps.max(1) as f32 * terrain.cell);
    let mut heights = Vec::with_capacity(columns * rows);
    for z in 0..rows {
        for x in 0..columns {
            let (x0, x1) = (x.saturating_sub(1), (x + 1).min(columns - 1));
            let (z0, z1) = (z.saturating_sub(1), (z + 1).min(rows - 1));
            let slope = [slope(at(x0, z), at(x1, z), x1 - x0), slope(at(x, z0), at(x, z1), z1 - z0)];
            heights.push(Height { height: at(x, z), slope });
        }
    }
    heights
}

/// The tiles that this lens can see, `quads` to a side; `band`: of the terrain's heights.
pub fn tiles(terrain: &Terrain, band: [f32; 2], lens: &Lens, quads: u32) -> Vec<Tile> {
    let mut tiles = Vec::new();
    let cell = f64::from(terrain.cell);
    let eye = (DVec2::new(lens.eye.x, lens.eye.z) - DVec2::from(terrain.origin)) / cell;
    // The bed goes on level beyond the height field, as far as one can see.
    let reach = (f64::from(lens.far) / cell).min(REACH);
    let wanted = reach * 2.0 + f64::from(terrain.columns.max(terrain.rows));
    let mut level = 0_u32;
    while f64::from(quads << level) < wanted && level < LEVELS {
        level += 1;
    }
    let walk = Walk { lens, quads, cell, eye, band, aloof: aloof(band, lens.eye.y) };
    // Roots lie on a grid that holds the height field's corner, so that vertices lie on its heights.
    let size = f64::from(quads << level);
    let eye = eye.clamp(DVec2::splat(-NEAREST), DVec2::splat(NEAREST));
    let [first, last] = [-reach, reach].map(|way| ((eye + DVec2::splat(way)) / size).floor());
    for z in first.y as i32..=last.y as i32 {
        for x in first.x as i32..=last.x as i32 {
            let size = (quads << level) as i32;
            walk.visit([x * size, z * size], level, &mut tiles);
        }
    }
    tiles
}

/// Lengths are in cells, and count from the height field's corner, where nothing else is said.
struct Walk<'a> {
    lens: &'a Lens,
    quads: u32,
    /// [m]
    cell: f64,
    eye: DVec2,
    /// Lowest and highest ground [m].
    band: [f32; 2],
    /// See [`aloof`] [m].
    aloof: f64,
}

impl Walk<'_> {
    fn visit(&self, corner: [i32; 2], level: u32, tiles: &mut Vec<Tile>) {
        let side = (self.quads << level) as i32;
        let [low, high] =
            [0, side].map(|more| (DVec2::from(corner.map(|c| f64::from(c + more))) - self.eye) * self.cell);
        let [bottom, top] = self.band.map(|y| (f64::from(y) - self.lens.eye.y) as f32);
        let least = Vec3::new(low.x as f32, bottom, low.y as f32);
        let most = Vec3::new(high.x as f32, top, high.y as f32);
        if self.lens.culls((least + most) * 0.5, least.distance(most) * 0.5) || tiles.len() >= MOST {
            return;
        }
        let nearest = DVec2::ZERO.clamp(low, high).extend(self.aloof).length();
        // The range of the level below.
        if level > 0 && nearest < SIDES * 0.5 * f64::from(side) * self.cell {
            let half = side / 2;
            for [x, z] in [[0, 0], [half, 0], [0, half], [half, half]] {
                self.visit([corner[0] + x, corner[1] + z], level - 1, tiles);
            }
            return;
        }
        tiles.push(Tile { corner, step: 1 << level });
    }
}

/// Indices of a tile's triangles, counter-clockwise from above.
pub fn indices(quads: u32) -> Vec<u16> {
    let quads = quads as u16;
    let side = quads + 1;
    let mut indices = Vec::new();
    for z in 0..quads {
        for x in 0..quads {
            let a = z * side + x;
            let (b, c, d) = (a + 1, a + side, a + side + 1);
            indices.extend([a, c, b, b, c, d]);
        }
    }
    indices
}
