//! One step of eight fish of one species, lanes over the fish: springs and muscles ([`springs`]), the water
//! on the skin ([`skin`]), and the linear system of an implicit sub-step ([`solve`]).
//!
//! A lane's result depends on its own fish alone, bit for bit.

pub mod bare;
mod plan;
mod skin;
mod solve;
mod springs;

use fearless_simd::{Simd, f32x8, prelude::*};
use reef_flow::{
    Level,
    simd::{mul_add, splat},
};

pub use plan::Plan;

use crate::{
    lanes::{Lane, Vector, add_scaled, dot, load, load3, scale, store, store3},
    material::Method,
};

/// What eight fish are told, and the water around them.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Fish8 {
    /// Where in their beat they are [beats], 0..1.
    pub(crate) phase: Lane,
    /// [Hz]
    pub(crate) speed: Lane,
    pub(crate) force: Lane,
    pub(crate) yaw: Lane,
    pub(crate) pitch: Lane,
    /// Velocity of the water [m/s], at the species' own size.
    pub(crate) water: [Lane; 3],
}

/// How long a sub-step is, and how many there are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    pub(crate) dt: f32,
    pub(crate) count: u32,
    pub(crate) method: Method,
}

/// A sub-step's length and its square.
#[derive(Clone, Copy)]
struct Times<S: Simd> {
    dt: f32x8<S>,
    dt2: f32x8<S>,
}

/// Eight fish and room for the work on them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pack {
    pub(crate) positions: Vec<[Lane; 3]>,
    pub(crate) velocities: Vec<[Lane; 3]>,
    room: Room,
}

/// What a sub-step finds out. What is in it from others changes nothing.
#[derive(Clone, Debug, Default)]
struct Room {
    impulse: Vec<[Lane; 3]>,
    /// The matrix: each node's own block, those below the diagonal, and the same of its factor.
    own: Vec<[Lane; 6]>,
    off: Vec<[Lane; 6]>,
    triangles: Vec<solve::Triangle>,
    low: Vec<[Lane; 9]>,
    turns: Vec<Lane>,
}

impl Pack {
    /// Makes room for fish of this species.
    pub(crate) fn fit(&mut self, plan: &Plan) {
        let (nodes, blocks) = (plan.rest.len(), plan.blocks.len());
        self.positions.resize(nodes, Default::default());
        self.velocities.resize(nodes, Default::default());
        self.room.impulse.resize(nodes, Default::default());
        self.room.own.resize(nodes, Default::default());
        self.room.triangles.resize(nodes, Default::default());
        self.room.off.resize(blocks, Default::default());
        self.room.low.resize(blocks, Default::default());
        self.room.turns.resize(plan.gaps as usize, Lane::default());
    }

    /// One step.
    pub(crate) fn step(&mut self, level: Level, plan: &Plan, fish: &mut Fish8, pace: Pace) {
        reef_flow::dispatch!(level, simd => wide(simd, self, plan, fish, pace));
    }
}

#[inline(always)]
fn wide<S: Simd>(simd: S, pack: &mut Pack, plan: &Plan, fish: &mut Fish8, pace: Pace) {
    let dt = splat(simd, pace.dt);
    let times = Times { dt, dt2: dt * dt };
    for _ in 0..pace.count {
        let phase = mul_add(load(simd, &fish.speed), dt, load(simd, &fish.phase));
        store(&mut fish.phase, phase - phase.floor());
        springs::turns(simd, plan, fish, &mut pack.room);
        match pace.method {
            Method::Implicit => implicit(simd, pack, plan, fish, times),
            Method::Symplectic => symplectic(simd, pack, plan, fish, times),
        }
    }
}

#[inline(always)]
fn implicit<S: Simd>(simd: S, pack: &mut Pack, plan: &Plan, fish: &Fish8, times: Times<S>) {
    let Pack { positions, velocities, room } = pack;
    springs::begin(simd, plan, times.dt, room, positions);
    let (zero, mass) = (splat(simd, 0.0), splat(simd, plan.mass));
    for own in &mut room.own {
        for (i, into) in own.iter_mut().enumerate() {
            store(into, if matches!(i, 0 | 3 | 5) { mass } else { zero });
        }
    }
    springs::pull::<S, true>(simd, plan, times, fish, room, [positions, velocities]);
    skin::push::<S, true>(simd, plan, times.dt, fish, room, [positions, velocities]);
    solve::factor(simd, plan, room);
    solve::back(simd, plan, room);
    advance(simd, pack, times.dt, splat(simd, 1.0));
}

#[inline(always)]
fn symplectic<S: Simd>(simd: S, pack: &mut Pack, plan: &Plan, fish: &Fish8, times: Times<S>) {
    let Pack { positions, velocities, room } = pack;
    springs::begin(simd, plan, times.dt, room, positions);
    springs::pull::<S, false>(simd, plan, times, fish, room, [positions, velocities]);
    skin::push::<S, false>(simd, plan, times.dt, fish, room, [positions, velocities]);
    advance(simd, pack, times.dt, splat(simd, 1.0 / plan.mass));
}

/// v += impulse · per, x += dt v.
#[inline(always)]
fn advance<S: Simd>(simd: S, pack: &mut Pack, dt: f32x8<S>, per: f32x8<S>) {
    let moved = pack.positions.iter_mut().zip(&mut pack.velocities);
    for ((position, velocity), impulse) in moved.zip(&pack.room.impulse) {
        let v = add_scaled(load3(simd, velocity), load3(simd, impulse), per);
        let x = add_scaled(load3(simd, position), v, dt);
        store3(velocity, v);
        store3(position, x);
    }
}

/// A vector of length 1; shorter where there is hardly any.
#[inline(always)]
fn unit<S: Simd>(simd: S, v: Vector<S>) -> Vector<S> {
    let length = dot(v, v).max(splat(simd, springs::SHORTEST2)).sqrt();
    scale(v, splat(simd, 1.0) / length)
}
