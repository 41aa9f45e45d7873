//! Which tiles of the sea bed are drawn, and how fine: a quadtree around the eye whose finest tiles have the height
//! field's own cells.

use glam::{DVec2, Vec3};

use super::{quality::Quality, view::Lens};
use crate::world::environment::Terrain;

/// Quads along a side of a tile, as in `shaders/terrain.vert` and `terrain_low.vert`.
pub fn quads(quality: Quality) -> u32 {
    match quality {
        Quality::Low => 4,
        Quality::High => 8,
    }
}
/// Tiles of one picture at most.
const MOST: usize = 1024;

/// A tile as the shader reads it: x and z of its corner relative to the eye, distance of its vertices, and the distance
/// from the eye up to which its level is drawn [m].
pub type Tile = [f32; 4];

/// Heights with their slopes, as the shader reads them: y, dy/dx, dy/dz, 0.
pub fn heights(terrain: &Terrain) -> Vec<[f32; 4]> {
    let (columns, rows) = (terrain.columns as usize, terrain.rows as usize);
    let at = |x: usize, z: usize| terrain.heights[z.min(rows - 1) * columns + x.min(columns - 1)];
    let slope = |low: f32, high: f32, steps: usize| (high - low) / (steps.max(1) as f32 * terrain.cell);
    let mut heights = Vec::with_capacity(columns * rows);
    for z in 0..rows {
        for x in 0..columns {
            let (x0, x1) = (x.saturating_sub(1), (x + 1).min(columns - 1));
            let (z0, z1) = (z.saturating_sub(1), (z + 1).min(rows - 1));
            heights.push([
                at(x, z),
                slope(at(x0, z), at(x1, z), x1 - x0),
                slope(at(x, z0), at(x, z1), z1 - z0),
                0.0,
            ]);
        }
    }
    heights
}

/// The tiles that this lens can see, `quads` to a side.
pub fn tiles(terrain: &Terrain, lens: &Lens, quads: u32) -> Vec<Tile> {
    let mut tiles = Vec::new();
    let finest = f64::from(terrain.cell) * f64::from(quads);
    let field = DVec2::new(
        f64::from(terrain.columns.max(2) - 1) * f64::from(terrain.cell),
        f64::from(terrain.rows.max(2) - 1) * f64::from(terrain.cell),
    );
    // The bed goes on level beyond the height field, as far as one can see.
    let wanted = f64::from(lens.far) * 2.0 + field.max_element();
    let mut level = 0_u32;
    while finest * f64::from(1_u32 << level) < wanted && level < 16 {
        level += 1;
    }
    let (low, high) = terrain
        .heights
        .iter()
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), h| (low.min(*h), high.max(*h)));
    let walk = Walk { lens, quads, finest, origin: DVec2::from(terrain.origin), low, high };
    // Roots lie on a grid that holds the height field's corner, so that vertices lie on its heights.
    let size = finest * f64::from(1_u32 << level);
    let eye = DVec2::new(lens.eye.x, lens.eye.z);
    let first = ((eye - DVec2::splat(f64::from(lens.far)) - walk.origin) / size).floor();
    let last = ((eye + DVec2::splat(f64::from(lens.far)) - walk.origin) / size).floor();
    for z in first.y as i64..=last.y as i64 {
        for x in first.x as i64..=last.x as i64 {
            walk.visit(DVec2::new(x as f64, z as f64) * size + walk.origin, level, &mut tiles);
        }
    }
    tiles
}

struct Walk<'a> {
    lens: &'a Lens,
    quads: u32,
    finest: f64,
    origin: DVec2,
    low: f32,
    high: f32,
}

impl Walk<'_> {
    /// Distance up to which a level is drawn [m]: three tiles' sides, so that neighbours differ by one level at most.
    fn range(&self, level: u32) -> f64 {
        self.finest * f64::from(1_u32 << level) * 3.0
    }

    fn visit(&self, corner: DVec2, level: u32, tiles: &mut Vec<Tile>) {
        let size = self.finest * f64::from(1_u32 << level);
        let low = Vec3::new(
            (corner.x - self.lens.eye.x) as f32,
            (f64::from(self.low) - self.lens.eye.y) as f32,
            (corner.y - self.lens.eye.z) as f32,
        );
        let high = Vec3::new(
            low.x + size as f32,
            (f64::from(self.high) - self.lens.eye.y) as f32,
            low.z + size as f32,
        );
        if self.lens.culls((low + high) * 0.5, low.distance(high) * 0.5) || tiles.len() >= MOST {
            return;
        }
        let nearest = f64::from(Vec3::ZERO.clamp(low, high).length());
        if level > 0 && nearest < self.range(level - 1) {
            let half = size * 0.5;
            for child in [[0.0, 0.0], [half, 0.0], [0.0, half], [half, half]] {
                self.visit(corner + DVec2::from(child), level - 1, tiles);
            }
            return;
        }
        tiles.push([low.x, low.z, (size / f64::from(self.quads)) as f32, self.range(level) as f32]);
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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::render::sample;

    const QUADS: u32 = 8;

    #[test]
    fn tiles_near_the_eye_are_finer_than_those_far_away() {
        let environment = sample::environment();
        let Some(terrain) = &environment.terrain else { return };
        let pose = sample::looking_at(DVec3::new(0.0, -3.2, 4.0), DVec3::new(0.0, -4.0, -4.0));
        let lens = Lens::new(&pose, [640, 360], 60.0);
        let tiles = tiles(terrain, &lens, QUADS);
        assert!(!tiles.is_empty() && tiles.len() < 200, "{}", tiles.len());
        let above = (lens.eye.y as f32) - terrain.heights.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        for tile in tiles.iter().filter(|t| t[2] > terrain.cell) {
            let size = tile[2] * QUADS as f32;
            let x = 0.0_f32.clamp(tile[0], tile[0] + size);
            let z = 0.0_f32.clamp(tile[1], tile[1] + size);
            let nearest = Vec3::new(x, above.max(0.0), z).length();
            assert!(nearest >= tile[3] * 0.5, "within half of its range a tile gives way to finer ones");
        }
        let finest = tiles.iter().map(|t| t[2]).fold(f32::INFINITY, f32::min);
        let coarsest = tiles.iter().map(|t| t[2]).fold(0.0, f32::max);
        assert_eq!(finest, terrain.cell);
        assert!(coarsest >= 4.0 * finest);
    }

    #[test]
    fn tiles_cover_the_ground_ahead_exactly_once() {
        let environment = sample::environment();
        let Some(terrain) = &environment.terrain else { return };
        let pose = sample::looking_at(DVec3::new(0.3, -3.2, 4.1), DVec3::new(0.0, -4.0, -4.0));
        let lens = Lens::new(&pose, [640, 360], 60.0);
        let tiles = tiles(terrain, &lens, QUADS);
        for i in 1..200 {
            let p = lens.forward * (i as f32 * 0.1);
            let over = tiles
                .iter()
                .filter(|t| {
                    let size = t[2] * QUADS as f32;
                    p.x >= t[0] && p.x < t[0] + size && p.z >= t[1] && p.z < t[1] + size
                })
                .count();
            assert_eq!(over, 1, "at {p}");
        }
    }

    #[test]
    fn slopes_are_those_of_the_heights() {
        let environment = sample::environment();
        let Some(terrain) = &environment.terrain else { return };
        let heights = heights(terrain);
        let at = 20 * 65 + 30;
        let slope = (heights[at + 1][0] - heights[at - 1][0]) / (2.0 * terrain.cell);
        assert_eq!(heights[at][1], slope);
        assert_eq!(heights.len(), 65 * 65);
    }
}
