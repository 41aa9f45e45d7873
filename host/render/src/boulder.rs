//! The shape of a rock: a ball of triangles, dented and split by noise, at four levels of detail.

use std::collections::HashMap;

use bytemuck::{Pod, Zeroable};
use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use glam::Vec3;
use reef_streams::environment::{Rock, Terrain};

use super::sunlit::Sunlight;

/// Subdivisions of the icosahedron, finest first.
pub const SUBDIVISIONS: [u32; 4] = [4, 3, 2, 1];

/// `rock.vert`'s vertex.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct RockVertex {
    /// Relative to the rock's position [m].
    pub position: [f32; 3],
    /// Unit normal, and four times the height above the ground [m], each as a signed normalised 16-bit
    /// number.
    pub normal_height: [i16; 4],
    /// Share of the sun's light that nothing keeps away, 0 to 1.
    pub sunlit: f32,
}

/// A ball of radius 1: points and triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Ball {
    /// Unit vectors.
    pub points: Vec<Vec3>,
    /// Three a triangle, counter-clockwise from outside.
    pub indices: Vec<u16>,
}

impl Ball {
    /// An icosahedron, subdivided: 42, 162, 642, 2562 points for 1, 2, 3, 4.
    pub fn new(subdivisions: u32) -> Self {
        let t = (1.0 + 5.0_f32.sqrt()) * 0.5;
        let mut points: Vec<Vec3> = [
            [-1.0, t, 0.0],
            [1.0, t, 0.0],
            [-1.0, -t, 0.0],
            [1.0, -t, 0.0],
            [0.0, -1.0, t],
            [0.0, 1.0, t],
            [0.0, -1.0, -t],
            [0.0, 1.0, -t],
            [t, 0.0, -1.0],
            [t, 0.0, 1.0],
            [-t, 0.0, -1.0],
            [-t, 0.0, 1.0],
        ]
        .into_iter()
        .map(|p| Vec3::from(p).normalize())
        .collect();
        let mut indices: Vec<u16> = vec![
            0, 11, 5, 0, 5, 1, 0, 1, 7, 0, 7, 10, 0, 10, 11, 1, 5, 9, 5, 11, 4, 11, 10, 2, 10, 7, 6, 7, 1, 8,
            3, 9, 4, 3, 4, 2, 3, 2, 6, 3, 6, 8, 3, 8, 9, 4, 9, 5, 2, 4, 11, 6, 2, 10, 8, 6, 7, 9, 8, 1,
        ];
        for _ in 0..subdivisions {
            let mut middles: HashMap<(u16, u16), u16> = HashMap::new();
            let mut next = Vec::with_capacity(indices.len() * 4);
            for triangle in indices.chunks_exact(3) {
                let [a, b, c] = [triangle[0], triangle[1], triangle[2]];
                let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| {
                    *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                        points.push((points[a as usize] + points[b as usize]).normalize());
                        points.len() as u16 - 1
                    })
                });
                next.extend([a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca]);
            }
            indices = next;
        }
        Self { points, indices }
    }
}

/// The vertices of rock `index` on the points of a ball. Normals come from the shape itself, so that all
/// levels agree.
pub fn vertices(terrain: &Terrain, index: usize, sunlight: &Sunlight, ball: &Ball) -> Vec<RockVertex> {
    let rock = &terrain.rocks[index];
    let shape = Shape::new(rock);
    let shade = sunlight.on(index);
    ball.points
        .iter()
        .map(|&p| {
            let position = shape.at(p);
            let (u, v) = p.any_orthonormal_pair();
            let e = 0.02;
            let du = shape.at((p + u * e).normalize()) - shape.at((p - u * e).normalize());
            let dv = shape.at((p + v * e).normalize()) - shape.at((p - v * e).normalize());
            let mut normal = du.cross(dv).normalize_or(p);
            if normal.dot(p) < 0.0 {
                normal = -normal;
            }
            let ground = ground_height(
                terrain,
                rock.position[0] + f64::from(position.x),
                rock.position[2] + f64::from(position.z),
            );
            let above = (rock.position[1] + f64::from(position.y)) as f32 - ground;
            let snorm = |v: f32| (v.clamp(-1.0, 1.0) * 32767.0).round() as i16;
            RockVertex {
                position: position.to_array(),
                normal_height: [snorm(normal.x), snorm(normal.y), snorm(normal.z), snorm(above * 4.0)],
                sunlit: shade.at(position, normal),
            }
        })
        .collect()
}

/// A rock's shape.
pub struct Shape<'a> {
    rock: &'a Rock,
    bumps: FastNoiseLite,
    cracks: FastNoiseLite,
}

impl<'a> Shape<'a> {
    /// That of a rock.
    pub fn new(rock: &'a Rock) -> Self {
        let mut bumps = FastNoiseLite::with_seed(rock.seed as i32);
        bumps.set_noise_type(Some(NoiseType::OpenSimplex2));
        bumps.set_fractal_type(Some(FractalType::FBm));
        bumps.set_fractal_octaves(Some(4));
        bumps.set_frequency(Some(1.2));
        let mut cracks = FastNoiseLite::with_seed(rock.seed.wrapping_add(77) as i32);
        cracks.set_noise_type(Some(NoiseType::OpenSimplex2));
        cracks.set_fractal_type(Some(FractalType::Ridged));
        cracks.set_fractal_octaves(Some(3));
        cracks.set_frequency(Some(1.3));
        Self { rock, bumps, cracks }
    }

    /// Distance of the surface in the direction `p`, a unit vector in the rock's own axes, as a share of the
    /// half axes.
    pub fn radius(&self, p: Vec3) -> f32 {
        let bump = self.bumps.get_noise_3d(p.x, p.y, p.z);
        let crack = self.cracks.get_noise_3d(p.x, p.y, p.z);
        (0.84 + 0.26 * bump - 0.13 * crack.max(0.0)).clamp(0.55, 1.0)
    }

    /// The surface in the direction `p`, relative to the rock's centre [m]. It stays within the half axes,
    /// which is where the simulation keeps things out.
    pub fn at(&self, p: Vec3) -> Vec3 {
        let q = p * self.radius(p) * Vec3::from(self.rock.half_axes);
        let (sin, cos) = self.rock.yaw.sin_cos();
        Vec3::new(q.x * cos + q.z * sin, q.y, q.z * cos - q.x * sin)
    }
}

/// Height of the ground, level beyond the height field.
pub fn ground_height(terrain: &Terrain, x: f64, z: f64) -> f32 {
    let (columns, rows) = (terrain.columns as usize, terrain.rows as usize);
    let at = |v: f64, origin: f64, count: usize| {
        let v = ((v - origin) / f64::from(terrain.cell)).clamp(0.0, (count.max(2) - 1) as f64 - 1e-6);
        (v as usize, (v - v.floor()) as f32)
    };
    let (c, tx) = at(x, terrain.origin[0], columns);
    let (r, tz) = at(z, terrain.origin[1], rows);
    let h = |c: usize, r: usize| terrain.heights[r.min(rows - 1) * columns + c.min(columns - 1)];
    let near = h(c, r) + (h(c + 1, r) - h(c, r)) * tx;
    let far = h(c, r + 1) + (h(c + 1, r + 1) - h(c, r + 1)) * tx;
    near + (far - near) * tz
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;

    #[test]
    fn a_ball_is_closed_and_faces_outward() {
        for (subdivisions, points) in [(1, 42), (2, 162), (3, 642), (4, 2562)] {
            let ball = Ball::new(subdivisions);
            assert_eq!(ball.points.len(), points);
            let mut edges = HashMap::new();
            for t in ball.indices.chunks_exact(3) {
                let [a, b, c] = [t[0], t[1], t[2]].map(|i| ball.points[i as usize]);
                assert!((b - a).cross(c - a).dot(a + b + c) > 0.0);
                for (from, to) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                    *edges.entry((from, to)).or_insert(0) += 1;
                }
            }
            assert!(edges.iter().all(|(&(a, b), n)| *n == 1 && edges.contains_key(&(b, a))));
        }
    }

    #[test]
    fn a_rock_stays_within_its_half_axes_and_is_no_ellipsoid() {
        let environment = sample::environment();
        let Some(terrain) = &environment.terrain else { return };
        let rock = Rock { yaw: 0.0, ..terrain.rocks[0] };
        let terrain = Terrain { rocks: vec![rock], ..Terrain::clone(terrain) };
        let sunlight = Sunlight::new(&terrain.rocks, environment.sun.direction);
        let radii: Vec<f32> = vertices(&terrain, 0, &sunlight, &Ball::new(3))
            .iter()
            .map(|v| (Vec3::from(v.position) / Vec3::from(rock.half_axes)).length())
            .collect();
        let low = radii.iter().copied().fold(f32::INFINITY, f32::min);
        let high = radii.iter().copied().fold(0.0, f32::max);
        assert!(high <= 1.0 + 1e-5, "{high}");
        assert!(high - low > 0.1, "{low}..{high}");
    }

    #[test]
    fn heights_between_grid_points_are_bilinear_and_level_outside() {
        let environment = sample::environment();
        let Some(terrain) = &environment.terrain else { return };
        let h = |i: usize| terrain.heights[i];
        let middle = ground_height(terrain, -16.0 + 0.25, -16.0 + 0.25);
        assert!((middle - (h(0) + h(1) + h(65) + h(66)) * 0.25).abs() < 1e-5);
        assert_eq!(ground_height(terrain, -99.0, -99.0), h(0));
    }
}
