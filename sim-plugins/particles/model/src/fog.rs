//! The local fog (§3.3.3): what stands for particles that are too far away to be seen one by one.
//!
//! A box is cut into cells. Beyond D_M a cell shows one sprite with the texture of a cloud, as opaque and of
//! the colour that the cell's particles are in the mean: their sprites cover the area B = Σ size² · opacity ·
//! (mean cover of their texture), which hides 1 − exp(−B / A) of an area A where they lie at random.

use core::f64::consts::TAU;

use glam::{DVec2, DVec3};
use reef_flow::{
    Level,
    random::mix,
    sample::Points,
    view::View,
    waves::{Carried, Trains, carry},
};
use reef_sdk::abi::{self, Billboard};

use crate::{
    config::BoxPlan,
    levels::Levels,
    looks::{Looks, packed},
    texture::Mean,
};

/// Cells of a box at most.
const MOST_CELLS: f64 = 2048.0;
/// Greatest and least side of a cell [m].
const SIDE: [f64; 2] = [2.0, 0.25];
/// Diameter of a cell's sprite over the cell's side: neighbours overlap, so that no gaps are seen.
const OVERLAP: f64 = 1.7;

/// The fog of one box.
#[derive(Clone, Debug)]
pub struct Fog {
    /// Middles of the cells [m, relative to the box's], one list an axis.
    at: [Vec<f32>; 3],
    /// [rad]
    roll: Vec<f32>,
    /// Diameter of a sprite [m].
    size: f64,
    /// What the particles of a cell cover with opacity 1 [m²].
    cover: f64,
    /// Mean colour of a particle, linear.
    color: [f64; 3],
    /// The picture from afar.
    mean: Mean,
    texture: u32,
    position: [Vec<f32>; 3],
    velocity: [Vec<f32>; 3],
}

/// What the fog of a box is shown with.
#[derive(Clone, Copy, Debug)]
pub struct Show<'a> {
    /// Who looks.
    pub view: &'a View,
    /// Switches and borders.
    pub levels: &'a Levels,
    /// The wave trains, relative to the box's middle.
    pub trains: &'a Trains,
    /// How many of them matter.
    pub count: usize,
    /// The box's middle [m, world].
    pub center: DVec3,
    /// How far orbits reach [m].
    pub reach: f64,
    /// Number of the box in the stream of objects.
    pub object: u32,
    /// Instruction set.
    pub level: Level,
}

impl Fog {
    /// The fog of a box, with a texture and what that looks like from afar.
    pub fn new(plan: &BoxPlan, looks: &Looks, texture: u32, mean: Mean) -> Self {
        let extent = plan.extent;
        let least = extent.into_iter().fold(f64::INFINITY, f64::min);
        let volume = extent[0] * extent[1] * extent[2];
        // A flat box's fog stays about as flat as it is.
        let side = (1.25 * least).clamp(SIDE[1], SIDE[0]);
        let side = side.max(DVec2::splat(volume / MOST_CELLS).powf(1.0 / 3.0).x);
        let count = extent.map(|e| (e / side).round().max(1.0));
        let cells = (count[0] * count[1] * count[2]) as usize;
        let mut fog = Self {
            at: core::array::from_fn(|_| Vec::with_capacity(cells)),
            roll: Vec::with_capacity(cells),
            size: OVERLAP * side,
            cover: looks.squares(u64::from(plan.count)) * looks.mean.alpha * plan.opacity / cells as f64,
            color: core::array::from_fn(|i| looks.color[i] * looks.mean.color[i]),
            mean,
            texture,
            position: core::array::from_fn(|_| vec![0.0; cells]),
            velocity: core::array::from_fn(|_| vec![0.0; cells]),
        };
        for cell in 0..cells {
            let (x, y, z) = (cell % count[0] as usize, cell / count[0] as usize, count[1] as usize);
            let place = [x, y % z, y / z];
            let hash = mix(plan.seed ^ 0x0066_6f67 ^ mix(cell as u64));
            for axis in 0..3 {
                // Off the middle of its cell by up to a fifth of it: rows would be seen.
                let chance = f64::from((hash >> (16 * axis)) as u16) / 65536.0 - 0.5;
                let middle = (place[axis] as f64 + 0.5 + 0.4 * chance) / count[axis] - 0.5;
                fog.at[axis].push((middle * extent[axis]) as f32);
            }
            fog.roll.push((f64::from((hash >> 48) as u16) / 65536.0 * TAU) as f32);
        }
        fog
    }

    /// Cells of the box: sprites at most.
    pub fn cells(&self) -> usize {
        self.roll.len()
    }

    /// Adds the sprites that are seen in this step.
    pub fn show(&mut self, show: &Show<'_>, out: &mut Vec<Billboard>) {
        if self.cover <= 0.0 || self.roll.is_empty() {
            return;
        }
        let Show { view, levels, .. } = show;
        let size = self.size;
        // As much as the particles cover of the sprite's own square, by a texture that covers a part of it.
        let covered = self.cover * levels.opacity * levels.size * levels.size / (size * size);
        let opaque = 1.0 - DVec2::splat(-covered).exp().x;
        let opacity = (opaque / self.mean.alpha.max(1e-3)).min(1.0) as f32;
        let color = packed(core::array::from_fn(|i| self.color[i] / self.mean.color[i].max(1e-3)));
        let [x, y, z] = &self.at;
        let [px, py, pz] = &mut self.position;
        let [vx, vy, vz] = &mut self.velocity;
        let out_of = Carried { position: [px, py, pz], velocity: [vx, vy, vz] };
        carry(show.level, show.trains, show.count, Points { x, y, z }, out_of);
        let (fog, end) = (levels.fog_band(), levels.end_band());
        let margin = 0.5 * size + show.reach;
        let from_eye = show.center - view.eye;
        for cell in 0..self.roll.len() {
            let center = DVec3::new(x[cell].into(), y[cell].into(), z[cell].into()) + from_eye;
            let distance = center.length() as f32;
            let share = fog.at(distance) * (1.0 - end.at(distance));
            let seen = !levels.visible || view.normals.iter().all(|normal| normal.dot(center) >= -margin);
            if share <= 0.0 || !seen {
                continue;
            }
            out.push(Billboard {
                position: [self.position[0][cell], self.position[1][cell], self.position[2][cell]],
                size: size as f32,
                axis: [0.0, 1.0, 0.0],
                opacity: (opacity * share).clamp(0.0, 1.0),
                velocity: [self.velocity[0][cell], self.velocity[1][cell], self.velocity[2][cell]],
                roll: self.roll[cell],
                object: show.object,
                texture: self.texture,
                color,
                flags: abi::BILLBOARD_FACING,
            });
        }
    }
}
