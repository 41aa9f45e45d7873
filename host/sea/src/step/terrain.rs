//! The sea bed: dunes from noise, and rocks settled into them.

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use glam::{DVec2, DVec3};
use reef_abi as abi;
use reef_streams::environment::{Ripples, Rock, Terrain};

use super::random::Random;
use crate::scene::terrain_tables::{RockTable, TerrainTable};

/// Tries for each rock before it is left out: a full bed takes a while to be recognised.
const TRIES: u32 = 24;

/// The bed of a scene at a mean depth [m].
pub fn build(table: &TerrainTable, depth: f64, scene_seed: u64) -> Terrain {
    let seed = table.seed.unwrap_or(scene_seed);
    let steps = [0, 1].map(|axis| (table.size[axis] / table.cell).ceil().max(1.0));
    let (columns, rows) = (steps[0] as u32 + 1, steps[1] as u32 + 1);
    let origin = [0, 1].map(|axis| table.center[axis] - 0.5 * steps[axis] * table.cell);
    let mut noise = FastNoiseLite::with_seed(Random::new(seed, "dunes").bits() as i32);
    noise.set_noise_type(Some(NoiseType::OpenSimplex2S));
    noise.set_fractal_type(Some(FractalType::FBm));
    noise.set_fractal_octaves(Some(table.octaves as i32));
    noise.set_fractal_gain(Some(table.gain as f32));
    noise.set_fractal_lacunarity(Some(2.0));
    noise.set_frequency(Some(1.0));
    let mut heights = Vec::with_capacity(columns as usize * rows as usize);
    for row in 0..rows {
        for column in 0..columns {
            // From the middle, so that the noise sees small numbers and the bed keeps its shape when it is
            // moved.
            let x = (f64::from(column) - 0.5 * steps[0]) * table.cell;
            let z = (f64::from(row) - 0.5 * steps[1]) * table.cell;
            let dune = noise.get_noise_2d((x / table.relief_length) as f32, (z / table.relief_length) as f32);
            let mean = -depth + table.slope[0] * x + table.slope[1] * z;
            heights.push((mean + table.relief * f64::from(dune)) as f32);
        }
    }
    let ripples = Ripples {
        spacing: table.ripples.spacing as f32,
        height: table.ripples.height as f32,
        direction: table.ripples.direction.to_radians() as f32,
    };
    let cell = table.cell as f32;
    let mut terrain = Terrain { origin, cell, columns, rows, heights, rocks: Vec::new(), ripples };
    let mut random = Random::new(seed, "rocks");
    for rock in &table.rock {
        let rock = settle(&terrain, rock, random.bits() as u32);
        terrain.rocks.push(rock);
    }
    scatter(&mut terrain, table, &mut random);
    terrain
}

/// Height of the bed [m] at x, z [m]: bilinear, the edge's beyond the edge.
pub fn height(terrain: &Terrain, x: f64, z: f64) -> f64 {
    let cell = f64::from(terrain.cell);
    let (last_column, last_row) = (terrain.columns.saturating_sub(1), terrain.rows.saturating_sub(1));
    let u = ((x - terrain.origin[0]) / cell).clamp(0.0, f64::from(last_column));
    let v = ((z - terrain.origin[1]) / cell).clamp(0.0, f64::from(last_row));
    let (column, row) = (u.floor() as u32, v.floor() as u32);
    let (next_column, next_row) = ((column + 1).min(last_column), (row + 1).min(last_row));
    let at = |column: u32, row: u32| {
        let index = row as usize * terrain.columns as usize + column as usize;
        f64::from(terrain.heights.get(index).copied().unwrap_or_default())
    };
    let (s, t) = (u - f64::from(column), v - f64::from(row));
    let near = at(column, row) * (1.0 - s) + at(next_column, row) * s;
    let far = at(column, next_row) * (1.0 - s) + at(next_column, next_row) * s;
    near * (1.0 - t) + far * t
}

fn settle(terrain: &Terrain, table: &RockTable, seed: u32) -> Rock {
    let [x, z] = table.position;
    let [a, b, c] = table.half_axes;
    // The lowest ground under the rock carries it, so that no side hangs in the water.
    let ground = (0..8)
        .map(|step| {
            let way = DVec2::from_angle(f64::from(step) * std::f64::consts::FRAC_PI_4);
            height(terrain, x + 0.7 * a.max(c) * way.x, z + 0.7 * a.max(c) * way.y)
        })
        .fold(height(terrain, x, z), f64::min);
    Rock {
        position: [x, ground + b * (1.0 - 2.0 * table.buried), z],
        half_axes: [a as f32, b as f32, c as f32],
        yaw: table.yaw.to_radians() as f32,
        seed,
    }
}

fn scatter(terrain: &mut Terrain, table: &TerrainTable, random: &mut Random) {
    let rocks = &table.rocks;
    for _ in 0..rocks.count {
        for _ in 0..TRIES {
            // Small rocks are many, great ones few.
            let share = random.unit();
            let width = rocks.size[0] + (rocks.size[1] - rocks.size[0]) * share * share * share;
            let x = table.center[0] + (random.unit() - 0.5) * table.size[0];
            let z = table.center[1] + (random.unit() - 0.5) * table.size[1];
            let half_axes = [
                width,
                width * rocks.flatness * random.between(0.8, 1.15),
                width * random.between(0.65, 1.0),
            ];
            let yaw = random.between(0.0, 360.0);
            let seed = random.bits() as u32;
            let from_middle = DVec2::new(x - table.center[0], z - table.center[1]).length();
            let free = |other: &Rock| {
                let between = DVec2::new(x - other.position[0], z - other.position[2]).length();
                between > width + f64::from(other.half_axes[0].max(other.half_axes[2]))
            };
            if from_middle < rocks.clearing + width || !terrain.rocks.iter().all(free) {
                continue;
            }
            let rock = RockTable { position: [x, z], half_axes, yaw, buried: rocks.buried };
            let rock = settle(terrain, &rock, seed);
            terrain.rocks.push(rock);
            break;
        }
    }
}

/// First id of the obstacles that stand for rocks.
pub const FIRST_ROCK: u64 = 1 << 32;

/// The capsule that stands for a rock: along its longer horizontal axis.
pub fn capsule(rock: &Rock, number: usize) -> abi::Obstacle {
    let [a, b, c] = rock.half_axes.map(f64::from);
    let radius = b.min(a).min(c);
    let (long, along_x) = if a >= c { (a, true) } else { (c, false) };
    let half = (long - radius).max(0.0);
    let turn = DVec2::from_angle(f64::from(rock.yaw));
    // A turn about y by the angle takes x to (cos, 0, −sin) and z to (sin, 0, cos).
    let way = if along_x { DVec3::new(turn.x, 0.0, -turn.y) } else { DVec3::new(turn.y, 0.0, turn.x) };
    let from = DVec3::from_array(rock.position) - way * half;
    abi::Obstacle {
        id: FIRST_ROCK + number as u64,
        from: from.to_array(),
        delta: (way * 2.0 * half).as_vec3().to_array(),
        radius: radius as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::terrain_tables::RocksTable;

    fn bed() -> TerrainTable {
        let rocks = RocksTable { count: 120, size: [0.1, 0.4], ..RocksTable::default() };
        TerrainTable { size: [20.0, 12.0], rocks, ..TerrainTable::default() }
    }

    #[test]
    fn the_bed_has_no_steps_and_stays_within_its_relief() {
        let table = bed();
        let terrain = build(&table, 5.0, 1);
        assert_eq!(terrain.heights.len(), (terrain.columns * terrain.rows) as usize);
        for row in 0..terrain.rows as usize {
            for column in 1..terrain.columns as usize {
                let at = row * terrain.columns as usize + column;
                let rise = (terrain.heights[at] - terrain.heights[at - 1]).abs();
                // A layer of amplitude a and length l rises at most 2π a / l; each layer has 2 · 0.45 of the
                // slope before.
                let steepest: f64 =
                    (0..4).map(|layer| 0.9_f64.powi(layer)).sum::<f64>() * std::f64::consts::TAU * 0.25 / 6.0;
                assert!(f64::from(rise) <= steepest * table.cell * 2.0, "a step of {rise} m");
            }
        }
        assert!(terrain.heights.iter().all(|y| (f64::from(*y) + 5.0).abs() <= table.relief * 1.001));
        let (low, high) =
            terrain.heights.iter().fold((0.0_f32, -10.0_f32), |(l, h), y| (l.min(*y), h.max(*y)));
        assert!(high - low > 0.2, "dunes can be seen: {low} to {high}");
    }

    #[test]
    fn heights_between_the_samples_are_continuous_and_meet_them() {
        let terrain = build(&bed(), 5.0, 1);
        let x = terrain.origin[0] + 17.0 * f64::from(terrain.cell);
        let z = terrain.origin[1] + 5.0 * f64::from(terrain.cell);
        let sample = terrain.heights[5 * terrain.columns as usize + 17];
        assert!((height(&terrain, x, z) - f64::from(sample)).abs() < 1e-9);
        let mut before = height(&terrain, -11.0, 0.3);
        for step in 1..=22_000 {
            let now = height(&terrain, -11.0 + f64::from(step) * 1e-3, 0.3);
            assert!((now - before).abs() < 1e-3, "a jump at {step} mm");
            before = now;
        }
        assert_eq!(height(&terrain, -1e9, 0.0), height(&terrain, terrain.origin[0], 0.0));
    }

    #[test]
    fn rocks_are_half_buried_apart_and_out_of_the_clearing() {
        let table = bed();
        let terrain = build(&table, 5.0, 1);
        assert!(terrain.rocks.len() > 20, "{} rocks", terrain.rocks.len());
        for (at, rock) in terrain.rocks.iter().enumerate() {
            let [x, y, z] = rock.position;
            let half = f64::from(rock.half_axes[1]);
            let ground = height(&terrain, x, z);
            assert!(y - half < ground && ground < y + half, "rock {at} is neither under nor over the sand");
            assert!(x.hypot(z) > table.rocks.clearing);
            for other in &terrain.rocks[..at] {
                let between = (x - other.position[0]).hypot(z - other.position[2]);
                assert!(between > f64::from(rock.half_axes[0] + other.half_axes[0]) * 0.99);
            }
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_bed_and_another_another() {
        assert_eq!(build(&bed(), 5.0, 1), build(&bed(), 5.0, 1));
        assert_ne!(build(&bed(), 5.0, 1).heights, build(&bed(), 5.0, 2).heights);
    }

    #[test]
    fn a_full_bed_ends_with_fewer_rocks() {
        let rocks = RocksTable { count: 500, size: [2.0, 3.0], ..RocksTable::default() };
        let terrain = build(&TerrainTable { size: [20.0, 20.0], cell: 1.0, rocks, ..bed() }, 5.0, 1);
        assert!((1..100).contains(&terrain.rocks.len()));
    }

    #[test]
    fn a_rocks_capsule_lies_within_it() {
        let rock = Rock { position: [1.0, -2.0, 3.0], half_axes: [0.5, 0.2, 0.3], yaw: 0.5, seed: 0 };
        let capsule = capsule(&rock, 3);
        assert_eq!(capsule.radius, 0.2);
        let length = DVec3::from_array(capsule.delta.map(f64::from)).length();
        assert!((length - 0.6).abs() < 1e-6);
        let middle = DVec3::from_array(capsule.from) + 0.5 * DVec3::from_array(capsule.delta.map(f64::from));
        assert!((middle - DVec3::new(1.0, -2.0, 3.0)).length() < 1e-6);
    }
}
