//! The sea bed's tiles: that they cover the ground, and that nothing shows between them.

use std::collections::HashMap;

use glam::{DVec2, DVec3, Vec2, Vec3};
use reef_sea::{scene::terrain_tables::TerrainTable, step::terrain};
use reef_streams::{
    Outputs,
    environment::{Environment, Terrain},
    frame::CameraPose,
};

use super::{
    Quality, Settings, Shot,
    device_tests::{SIZE, keep, open},
    sample, tiles,
    view::Lens,
};
use crate::Studio;

/// The default sea's bed without its rocks.
fn bed() -> Terrain {
    terrain::build(&TerrainTable { size: [48.0, 48.0], relief: 0.2, ..TerrainTable::default() }, 5.0, 20)
}

/// A lens that sees all of the ground from an eye above it.
fn all_around(eye: DVec3) -> Lens {
    let pose = sample::looking_at(eye, eye - DVec3::new(0.0, 1.0, 1e-3));
    Lens { tangent: [1e4, 1e4], ..Lens::new(&pose, [640, 360], 60.0) }
}

fn eyes() -> Vec<DVec3> {
    let turn = |i: usize| DVec2::from_angle(i as f64 * 2.4) * (1.7 * i as f64);
    let high = [0.3, 0.05, 1.2, 3.9, 0.6];
    let mut eyes: Vec<DVec3> =
        (0..20).map(|i| DVec3::new(turn(i).x, -4.8 + high[i % 5], turn(i).y)).collect();
    // Beyond the field, where the bed is level.
    eyes.extend([DVec3::new(31.3, -4.2, 3.0), DVec3::new(-900.2, -4.0, 417.9)]);
    eyes
}

/// The twin of `tile_vertex` in `shaders/tile.glsl`: where a vertex is drawn, in cells from the height near
/// the eye.
struct Twin {
    origin: Vec2,
    base: [i32; 2],
    cell: f32,
    aloof: f32,
    quads: i32,
}

impl Twin {
    fn new(terrain: &Terrain, lens: &Lens, quads: u32) -> Self {
        let near = tiles::nearest(terrain, lens);
        let place = DVec2::from(terrain.origin) + near * f64::from(terrain.cell);
        Self {
            origin: (place - DVec2::new(lens.eye.x, lens.eye.z)).as_vec2(),
            base: [near.x as i32, near.y as i32],
            cell: terrain.cell,
            aloof: tiles::aloof(tiles::band(terrain), lens.eye.y) as f32,
            quads: quads as i32,
        }
    }

    fn offset(&self, at: [i32; 2]) -> Vec2 {
        Vec2::new((at[0] - self.base[0]) as f32, (at[1] - self.base[1]) as f32)
    }

    fn gone(&self, at: [i32; 2], step: i32) -> f32 {
        let p = self.origin + self.offset(at) * self.cell;
        let range = 3.0 * self.quads as f32 * self.cell * step as f32;
        let gone = ((p.extend(self.aloof).length() / range - 0.7) / 0.25).clamp(0.0, 1.0);
        (gone * 32.0).floor() * 0.03125
    }

    fn at(&self, tile: tiles::Tile, vertex: u16) -> Vec2 {
        let side = self.quads + 1;
        let mut step = tile.step;
        let mut at = [
            tile.corner[0] + i32::from(vertex) % side * step,
            tile.corner[1] + i32::from(vertex) / side * step,
        ];
        let coarser = |at: [i32; 2], step: i32| at.map(|v| v & !(2 * step - 1));
        for _ in 0..2 {
            if self.gone(coarser(at, step), step) >= 1.0 {
                step *= 2;
            }
            at = at.map(|v| v & !(step - 1));
        }
        let end = coarser(at, step);
        let gone = self.gone(end, step);
        self.offset(at) * (1.0 - gone) + self.offset(end) * gone
    }
}

/// Edges of triangles that do not lie in exactly two of them, once in each way, out of all edges.
fn open_edges(terrain: &Terrain, lens: &Lens, quads: u32) -> (usize, usize) {
    let twin = Twin::new(terrain, lens, quads);
    let mut edges: HashMap<[[u32; 2]; 2], u32> = HashMap::new();
    let corners = tiles::indices(quads);
    for tile in tiles::tiles(terrain, tiles::band(terrain), lens, quads) {
        for triangle in corners.chunks_exact(3) {
            let p = [0, 1, 2].map(|i| twin.at(tile, triangle[i]).to_array().map(f32::to_bits));
            if p[0] == p[1] || p[1] == p[2] || p[2] == p[0] {
                continue;
            }
            for i in 0..3 {
                *edges.entry([p[i], p[(i + 1) % 3]]).or_default() += 1;
            }
        }
    }
    // The bed ends somewhere: beyond what can be seen.
    let seen = |v: [u32; 2]| {
        (twin.origin + Vec2::from(v.map(f32::from_bits)) * twin.cell).length() < 0.95 * lens.far
    };
    let open = edges
        .iter()
        .filter(|([a, b], n)| (**n != 1 || !edges.contains_key(&[*b, *a])) && seen(*a) && seen(*b));
    (open.count(), edges.len())
}

#[test]
fn every_edge_of_the_ground_belongs_to_two_triangles_wherever_the_eye_is() {
    let bed = bed();
    for quality in [Quality::Low, Quality::High] {
        for eye in eyes() {
            let (open, all) = open_edges(&bed, &all_around(eye), tiles::quads(quality));
            assert!(all > 1000, "{quality:?} at {eye}: {all} edges");
            assert_eq!(open, 0, "{quality:?} at {eye}: of {all} edges");
        }
    }
}

#[test]
fn neither_quality_shows_anything_between_the_tiles_of_the_ground() {
    let Some(gpu) = open() else { return };
    let magenta = Some([1.0, 0.0, 1.0]);
    let environment =
        Environment { terrain: Some(bed().into()), plain_background: magenta, ..sample::environment() };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let mut holes = Vec::new();
    for (i, eye) in eyes().into_iter().step_by(2).take(10).enumerate() {
        let ahead = DVec2::from_angle(i as f64 * 0.9);
        let camera = sample::looking_at(eye, eye + DVec3::new(ahead.x, -0.12 * (i % 4) as f64, ahead.y));
        let frame = sample::frame(1, camera, Outputs::default());
        let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
        for quality in [Quality::Low, Quality::High] {
            let picture = studio.shoot(&shot, &Settings::of(quality)).expect("a picture");
            keep(&format!("ground-{i}-{quality:?}"), &picture);
            let through = |p: &[u8; 4]| p[0] > 250 && p[1] < 5 && p[2] > 250;
            let pixel = |x, y| picture.pixel(x, y).expect("inside");
            let (below, ground): (Vec<_>, Vec<_>) = (0..SIZE.0 * SIZE.1)
                .map(|n| (n % SIZE.0, n / SIZE.0))
                .filter(|&(x, y)| is_below_the_horizon(&camera, x, y))
                .partition(|&(x, y)| through(&pixel(x, y)));
            assert!(ground.len() > 20_000, "camera {i}, {quality:?}: {} pixels of ground", ground.len());
            holes.extend(
                below.first().map(|at| format!("camera {i}, {quality:?}: {} at {at:?}", below.len())),
            );
        }
    }
    assert!(holes.is_empty(), "the background is seen through the ground: {holes:#?}");
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

/// Whether a pixel's ray goes down by more than half a pixel.
fn is_below_the_horizon(camera: &CameraPose, x: u32, y: u32) -> bool {
    let lens = Lens::new(camera, [SIZE.0, SIZE.1], 60.0);
    let way = |n: u32, of: u32| (n as f32 + 0.5) / of as f32 * 2.0 - 1.0;
    let ray: Vec3 = lens.forward + lens.right * (way(x, SIZE.0) * lens.tangent[0])
        - lens.up * (way(y, SIZE.1) * lens.tangent[1]);
    ray.y * lens.pixels_per_metre() < -0.5
}

#[test]
fn tiles_near_the_eye_are_finer_than_those_far_away() {
    let environment = sample::environment();
    let Some(terrain) = &environment.terrain else { return };
    let pose = sample::looking_at(DVec3::new(0.0, -3.2, 4.0), DVec3::new(0.0, -4.0, -4.0));
    let lens = Lens::new(&pose, [640, 360], 60.0);
    let tiles = tiles::tiles(terrain, tiles::band(terrain), &lens, 8);
    assert!(!tiles.is_empty() && tiles.len() < 200, "{}", tiles.len());
    let cell = f64::from(terrain.cell);
    for tile in tiles.iter().filter(|t| t.step > 1) {
        let side = 8.0 * f64::from(tile.step) * cell;
        let [x, z] = [0, 1].map(|i| f64::from(tile.corner[i]) * cell + terrain.origin[i]);
        let eye = DVec2::new(lens.eye.x, lens.eye.z);
        let away = eye.clamp(DVec2::new(x, z), DVec2::new(x + side, z + side)).distance(eye);
        assert!(away.hypot(0.5) >= side * 1.5, "within half of its range a tile gives way to finer ones");
    }
    let steps = || tiles.iter().map(|t| t.step);
    assert_eq!(steps().min(), Some(1));
    assert!(steps().max() >= Some(4));
}

#[test]
fn tiles_cover_the_ground_ahead_exactly_once() {
    let environment = sample::environment();
    let Some(terrain) = &environment.terrain else { return };
    let pose = sample::looking_at(DVec3::new(0.3, -3.2, 4.1), DVec3::new(0.0, -4.0, -4.0));
    let lens = Lens::new(&pose, [640, 360], 60.0);
    let tiles = tiles::tiles(terrain, tiles::band(terrain), &lens, 8);
    for i in 1..200 {
        let p = lens.eye + (lens.forward * (i as f32 * 0.1)).as_dvec3();
        let at = (DVec2::new(p.x, p.z) - DVec2::from(terrain.origin)) / f64::from(terrain.cell);
        let over = |t: &&tiles::Tile| {
            let from = DVec2::from(t.corner.map(f64::from));
            at.cmpge(from).all() && at.cmplt(from + f64::from(8 * t.step)).all()
        };
        assert_eq!(tiles.iter().filter(over).count(), 1, "at {p}");
    }
}

#[test]
fn slopes_are_those_of_the_heights() {
    let environment = sample::environment();
    let Some(terrain) = &environment.terrain else { return };
    let heights = tiles::heights(terrain);
    let at = 20 * 65 + 30;
    let slope = (heights[at + 1].height - heights[at - 1].height) / (2.0 * terrain.cell);
    assert_eq!(heights[at].slope[0], slope);
    assert_eq!(heights.len(), 65 * 65);
}
