//! A vertical slice of the animal in its own water (§3.2): an immersed boundary of springs, carried by the
//! water that it pushes.

mod build;
mod forces;
mod gait;
mod solve;

use glam::DVec2;
use reef_flow::Level;

use crate::{
    lanes::Real,
    water::{Grid, Water},
};

pub use build::{Build, CHAIN, STRAND};
pub use gait::{CONTRACTION, FREQUENCIES, Gait, TURN};

use build::Network;
use forces::{Implicit, Pose};
use solve::System;

/// Longest step [s].
pub const LONGEST_STEP: f64 = 0.02;
/// Greatest speed of a point, in grid widths a second: no force makes it leave its water in a step.
const FASTEST: f64 = 10.0;
/// Cells whose water a point sets in motion, for the implicit springs, at the least and at the most; and the
/// share of k dt² of a spring of the bell that this mass is in between. Implicit springs give way by as much
/// as k dt² outweighs the mass: so they give way alike in near and far steps, and the bell keeps its shape in
/// both.
const CELLS_OF_POINT: [f64; 2] = [0.6, 3.2];
const GIVE: f64 = 1.0 / 15.0;
/// Longest that a spring of the bell gets, over its length at rest: what would draw it out further (in far
/// steps, above all) slips along it: strain limiting, as cloth has it. Points have no mass, so what slips
/// takes no momentum from the water or gives it any: the spring pulls on both of its ends as before.
const LONGEST_SPRING: f64 = 1.95;
/// Widths of the bell along a side of the grid, at the least: closer walls hold the animal.
pub const LEAST_ROOM: f64 = 2.5;
/// Bend of the bell's joints for an aim at right angles, and the most of it [rad]: more turns it no faster.
const STEERING: f64 = 0.2;
const STEERED: f64 = 0.05;
/// Farthest that a window goes from where it was first, and an animal from the middle of the world, along
/// each axis [m]: there a number still tells places apart that are 2 nm from each other.
pub const FARTHEST: f64 = 1e7;
/// How far the bell gets from the middle of the window before that follows, in cells.
const SLACK: f64 = 1.0;

/// A slice, its water, and where both are.
#[derive(Clone, Debug)]
pub struct Slice<T> {
    build: Build,
    network: Network,
    gait: Gait,
    /// Which way is up for the animal: a unit vector.
    up: DVec2,
    follows: bool,
    water: Water<T>,
    /// From the lower left corner of the window [m].
    points: Vec<DVec2>,
    velocity: Vec<DVec2>,
    /// See [`Slice::tow`].
    towed: DVec2,
    system: System,
    /// Where the window has gone, in cells.
    offset: [i64; 2],
    /// Share of the present period.
    phase: f64,
}

/// What a later step depends on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SliceState<T> {
    /// Points [m], x and y one after the other.
    pub points: Vec<f64>,
    /// The faces of the water [m/s].
    pub faces: Vec<T>,
    /// Where the window has gone, in cells.
    pub offset: [i64; 2],
    /// Share of the present period.
    pub phase: f64,
}

impl<T: Real> Slice<T> {
    /// A slice at rest in the middle of water at rest.
    ///
    /// # Errors
    /// What of the build or the grid is wrong, and what is allowed.
    pub fn new(build: Build, grid: Grid) -> Result<Self, String> {
        build.check()?;
        grid.check()?;
        build.check_room(&grid)?;
        let network = build.network();
        let middle = DVec2::splat(0.5 * grid.width()) - DVec2::new(0.0, centre(&network, &network.rest).y);
        let points: Vec<DVec2> = network.rest.iter().map(|point| *point + middle).collect();
        Ok(Self {
            build,
            gait: Gait::default(),
            up: DVec2::Y,
            follows: true,
            water: Water::new(grid)?,
            velocity: vec![DVec2::ZERO; points.len()],
            towed: DVec2::ZERO,
            system: System::new(points.len() / 2),
            points,
            network,
            offset: [0; 2],
            phase: 0.0,
        })
    }

    /// How it swims from now on.
    ///
    /// # Errors
    /// As [`Gait::check`]; then it goes on as before.
    pub fn set_gait(&mut self, gait: Gait) -> Result<(), String> {
        gait.check()?;
        self.gait = gait;
        Ok(())
    }

    /// How it swims.
    pub fn gait(&self) -> Gait {
        self.gait
    }

    /// Swims toward a direction, as long as nothing else is said: the couple that rights it holds it there,
    /// and its contractions are as uneven as it points elsewhere. Asked for anew in each step by who steers.
    pub fn steer(&mut self, aim: DVec2) {
        let aim = aim.normalize_or(DVec2::Y);
        self.up = aim;
        let axis = self.axis();
        // Positive x is to the right of an animal that looks up.
        let off = if axis.dot(aim) >= 0.0 { aim.perp_dot(axis) } else { aim.perp_dot(axis).signum() };
        self.gait.turn = (STEERING * off).clamp(-STEERED, STEERED);
    }

    /// Pushes all points of the bell alike in the next step, as if each became so much faster [m/s].
    pub fn tow(&mut self, by: DVec2) {
        self.towed = if by.is_finite() { by } else { DVec2::ZERO };
    }

    /// What it is made of.
    pub fn build(&self) -> &Build {
        &self.build
    }

    /// Its water.
    pub fn water(&self) -> &Water<T> {
        &self.water
    }

    /// Whether the window follows the bell (it does), or the walls stand.
    pub fn follow(&mut self, follows: bool) {
        self.follows = follows;
    }

    /// Share of the present period, 0..1.
    pub fn phase(&self) -> f64 {
        self.phase
    }

    /// Density [kg/m³] and kinematic viscosity [m²/s] of its water from now on; what no water has changes
    /// nothing.
    pub fn set_water(&mut self, density: f64, viscosity: f64) {
        self.water.set_kind(density, viscosity);
    }

    /// Weight less buoyancy from now on [N per metre of depth]; what is no number is 0.
    pub fn set_weight(&mut self, weight: f64) {
        self.build.weight = if weight.is_finite() { weight } else { 0.0 };
    }

    /// Swims on in water at rest on another grid, in the middle of its window. Its place stays what it is.
    ///
    /// # Errors
    /// As [`Slice::new`]; then nothing has changed.
    pub fn regrid(&mut self, grid: Grid) -> Result<(), String> {
        self.build.check_room(&grid)?;
        let water = Water::new(grid)?;
        let shift = DVec2::splat(0.5 * grid.width()) - centre(&self.network, &self.points);
        // The corner moves by whole cells, the points by what is left.
        let corner = ((self.corner() - shift) / grid.cell).round();
        let rest = self.corner() - corner * grid.cell;
        self.points.iter_mut().for_each(|point| *point += rest);
        self.offset = [corner.x as i64, corner.y as i64];
        self.water = water;
        Ok(())
    }

    /// Springs and muscles as pairs of places [m, as [`Slice::chain`]], and of a muscle by which share it is
    /// shorter than at rest.
    pub fn springs(&self) -> impl Iterator<Item = ([DVec2; 2], Option<f64>)> + '_ {
        let place = |point: usize| self.points[point] + self.corner();
        let springs = self.network.springs.iter().map(move |spring| (spring.ends.map(place), None));
        springs.chain(self.network.muscles.iter().map(move |muscle| {
            let [a, b] = muscle.spring.ends.map(place);
            ([a, b], Some(1.0 - a.distance(b) / muscle.spring.rest))
        }))
    }

    /// Greatest length of a spring of the bell, and of one of the strands, over its length at rest.
    pub fn longest(&self) -> [f64; 2] {
        let mut longest = [0.0_f64; 2];
        for spring in &self.network.springs {
            let [a, b] = spring.ends;
            let longest = &mut longest[usize::from(b / 2 > self.network.margin)];
            *longest = longest.max(self.points[a].distance(self.points[b]) / spring.rest);
        }
        longest
    }

    /// Begins the period somewhere else: `phase` 0..1.
    pub fn set_phase(&mut self, phase: f64) {
        self.phase = phase - phase.floor();
    }

    /// Moves all points [m], without the water.
    pub fn displace(&mut self, mut by: impl FnMut(usize) -> DVec2) {
        self.points.iter_mut().enumerate().for_each(|(i, point)| *point += by(i));
    }

    /// The chain from the margin of negative x through the apex to that of positive x [m], from where the
    /// window's corner was first.
    pub fn chain(&self) -> impl DoubleEndedIterator<Item = DVec2> + ExactSizeIterator + '_ {
        let margin = self.network.margin;
        (0..2 * margin + 1).map(move |i| {
            let (pair, side) =
                if i < margin { (margin - i, 0) } else { (i - margin, usize::from(i > margin)) };
            self.points[2 * pair + side] + self.corner()
        })
    }

    /// The strand of a side (0: negative x), from the margin's point to its tip [m].
    pub fn strand(&self, side: usize) -> impl ExactSizeIterator<Item = DVec2> + Clone + '_ {
        let first = self.network.margin;
        (first..first + self.build.strand_segments + 1)
            .map(move |pair| self.points[2 * pair + side.min(1)] + self.corner())
    }

    /// Where the window's corner has gone [m].
    pub fn corner(&self) -> DVec2 {
        DVec2::new(self.offset[0] as f64, self.offset[1] as f64) * self.water.grid().cell
    }

    /// Mean of the bell's points [m], from where the window's corner was first.
    pub fn place(&self) -> DVec2 {
        centre(&self.network, &self.points) + self.corner()
    }

    /// Mean velocity of the bell's points [m/s].
    pub fn velocity(&self) -> DVec2 {
        let bell = self.points[..2 * self.network.margin + 2].iter().enumerate().filter(|(i, _)| *i != 1);
        let count = (2 * self.network.margin + 1) as f64;
        bell.map(|(_, point)| DVec2::from(self.water.velocity(point.to_array()))).sum::<DVec2>() / count
    }

    /// Where the apex points, seen from the middle of the margin: a unit vector.
    pub fn axis(&self) -> DVec2 {
        let margin = 2 * self.network.margin;
        (self.points[0] - 0.5 * (self.points[margin] + self.points[margin + 1])).normalize_or(DVec2::Y)
    }

    /// Elastic energy, that of the muscles included, and kinetic energy of the water [J per metre of depth].
    pub fn energy(&self) -> f64 {
        self.pose().energy(&self.points) + self.water.energy()
    }

    /// Internal forces on all points [N per metre of depth], and the places that they act on [m].
    pub fn forces(&self) -> Vec<(DVec2, DVec2)> {
        let mut forces = vec![DVec2::ZERO; self.points.len()];
        self.pose().forces(&self.points, &mut forces);
        self.points.iter().copied().zip(forces).collect()
    }

    fn pose(&self) -> Pose<'_> {
        Pose { network: &self.network, gait: self.gait, phase: self.phase, push: self.build.push }
    }

    /// One step of `dt` [s], at most [`LONGEST_STEP`].
    pub fn step(&mut self, level: Level, dt: f64) {
        let dt = dt.clamp(0.0, LONGEST_STEP);
        self.phase += dt * self.gait.frequency;
        self.phase -= self.phase.floor();
        self.push(dt);
        self.water.diffuse(level, dt);
        self.water.project(level);
        self.ride(dt);
        self.water.advect(level, dt);
        if self.follows {
            self.move_window();
        }
    }

    /// Muscles, springs and what else acts on the animal: onto the water.
    pub fn push(&mut self, dt: f64) {
        for (velocity, point) in self.velocity.iter_mut().zip(&self.points) {
            *velocity = DVec2::from(self.water.velocity(point.to_array()));
        }
        let grid = self.water.grid();
        let cell = grid.density * grid.cell * grid.cell;
        let stiffness = self.network.springs.first().map_or(0.0, |spring| spring.stiffness);
        let [least, most] = CELLS_OF_POINT.map(|cells| cells * cell);
        let mass = (GIVE * stiffness * dt * dt).clamp(least, most);
        self.system.begin(mass);
        let pose = Pose { network: &self.network, gait: self.gait, phase: self.phase, push: self.build.push };
        pose.forces(&self.points, &mut Implicit { system: &mut self.system, velocity: &self.velocity, dt });
        let margin = 2 * self.network.margin;
        // A couple toward upright, from the apex and the margin; and the weight, which all points share.
        let tilt = self.up.perp_dot(self.axis());
        let right = self.axis().perp() * (-self.build.righting * tilt * dt);
        self.system.push(0, right);
        self.system.push(margin, right * -0.5);
        self.system.push(margin + 1, right * -0.5);
        let count = (self.points.len() - 1) as f64;
        let weight = DVec2::new(0.0, -self.build.weight * dt / count);
        for (i, _) in self.points.iter().enumerate().filter(|(i, _)| *i != 1) {
            self.system.push(i, weight);
        }
        let towed = core::mem::take(&mut self.towed);
        if towed != DVec2::ZERO {
            for i in (0..margin + 2).filter(|i| *i != 1) {
                self.system.push(i, towed * mass);
            }
        }
        self.system.solve();
        for (i, point) in self.points.iter().enumerate().filter(|(i, _)| *i != 1) {
            // What changes the points' velocity in the step is what the water gets.
            let force = self.system.of(i) * (mass / dt);
            if force.is_finite() {
                self.water.push(point.to_array(), force.to_array(), dt);
            }
        }
    }

    /// Moves the points with the water, by the midpoint rule.
    fn ride(&mut self, dt: f64) {
        let width = self.water.grid().width();
        for point in &mut self.points {
            let way = |at: DVec2| DVec2::from(self.water.velocity(at.to_array())) * dt;
            let way = way(*point + 0.5 * way(*point)).clamp_length_max(FASTEST * width * dt);
            *point = (*point + way).clamp(DVec2::ZERO, DVec2::splat(width));
        }
        self.limit();
        // The apex stands for both of its pair.
        self.points[1] = self.points[0];
    }

    /// Draws in what is farther from the apex than springs let it be: from the apex outward, so one sweep
    /// does it exactly.
    fn limit(&mut self) {
        for spring in &self.network.springs {
            let [inner, outer] = spring.ends;
            let way = self.points[outer] - self.points[inner];
            let of_bell = outer / 2 <= self.network.margin;
            let longest = if of_bell { LONGEST_SPRING } else { self.build.strand_stretch } * spring.rest;
            if way.length_squared() > longest * longest {
                self.points[outer] = self.points[inner] + way.clamp_length_max(longest);
            }
        }
    }

    fn move_window(&mut self) {
        let grid = *self.water.grid();
        let off = centre(&self.network, &self.points) - DVec2::splat(0.5 * grid.width());
        let step = |off: f64| if off.abs() > SLACK * grid.cell { off.signum() as isize } else { 0 };
        let by = [step(off.x), step(off.y)];
        if by == [0, 0] {
            return;
        }
        self.water.follow(by);
        let way = DVec2::new(by[0] as f64, by[1] as f64) * grid.cell;
        self.points.iter_mut().for_each(|point| *point -= way);
        self.offset = [self.offset[0] + by[0] as i64, self.offset[1] + by[1] as i64];
    }

    /// The present state.
    pub fn save(&self) -> SliceState<T> {
        SliceState { faces: self.water.faces().collect(), ..self.save_all_but_faces() }
    }

    /// The same without the faces of its water.
    pub fn save_all_but_faces(&self) -> SliceState<T> {
        SliceState {
            points: self.points.iter().flat_map(|point| point.to_array()).collect(),
            faces: Vec::new(),
            offset: self.offset,
            phase: self.phase,
        }
    }

    /// Takes back what [`Slice::save`] gave.
    ///
    /// # Errors
    /// What is wrong with it; then nothing has changed.
    pub fn load(&mut self, state: &SliceState<T>) -> Result<(), String> {
        let (own, given) = (2 * self.points.len(), state.points.len());
        if given != own {
            return Err(format!("has {given} coordinates of points; this animal has {own}"));
        }
        let width = self.water.grid().width();
        if !state.points.iter().all(|value| (0.0..=width).contains(value)) {
            return Err(format!("has a point outside of its window of {width} m"));
        }
        let cell = self.water.grid().cell;
        if !state.offset.iter().all(|cells| (*cells as f64 * cell).abs() <= FARTHEST) {
            return Err(format!(
                "has its window {:?} cells of {cell} m from where it began, which must be at most {FARTHEST} m",
                state.offset
            ));
        }
        if !(0.0..1.0).contains(&state.phase) {
            return Err(format!("has a phase of {}, which must be 0 to below 1", state.phase));
        }
        if !state.faces.iter().all(|value| value.wide().is_finite()) {
            return Err("has a velocity that is not finite".to_owned());
        }
        self.water.set_faces(&state.faces)?;
        for (point, [x, y]) in self.points.iter_mut().zip(state.points.as_chunks::<2>().0) {
            *point = DVec2::new(*x, *y);
        }
        (self.offset, self.phase) = (state.offset, state.phase);
        Ok(())
    }
}

/// Mean of the bell's points; the apex once.
fn centre(network: &Network, points: &[DVec2]) -> DVec2 {
    let bell = &points[2..2 * network.margin + 2];
    (points[0] + bell.iter().sum::<DVec2>()) / (bell.len() + 1) as f64
}
