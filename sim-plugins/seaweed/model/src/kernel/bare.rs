//! The least that the physical method can cost: the same system for blades without branches, in water that is
//! the same everywhere, over hot data, and nothing else — no waves, surface, contacts, levels of detail or
//! boxes. What everything else is measured against.

use fearless_simd::{Simd, prelude::*};
use reef_flow::{
    Level,
    simd::{mul_add, splat},
};

use super::{
    Row, pose,
    solve::{Answer, Body, take_out},
};
use crate::lanes::{Lane, add, add_scaled, cross, dot, load, load3, scale, store, store3};

/// Eight equal blades with other angles.
#[derive(Clone, Debug)]
pub struct Bare {
    rows: Vec<Row>,
    frames: Vec<[[Lane; 3]; 2]>,
    answers: Vec<[Answer; 2]>,
    velocity: [f32; 3],
}

const LENGTH: f32 = 0.1;
const MASS: f32 = 0.2;
const DRAG: f32 = 1.0;
const STIFFNESS: f32 = 1.5;
const DAMPING: f32 = 0.25;
const DT: f32 = 1.0 / 60.0;

impl Bare {
    /// Blades of so many segments.
    pub fn new(segments: usize) -> Self {
        let row = |i: usize| {
            let spread =
                |factor: f32| Lane(core::array::from_fn(|lane| 0.1 * (factor * (i + lane) as f32).sin()));
            Row { theta: spread(0.7), phi: spread(1.3), ..Row::default() }
        };
        Self {
            rows: (0..segments).map(row).collect(),
            frames: vec![Default::default(); segments],
            answers: vec![Default::default(); segments],
            velocity: [0.1, 0.0, 0.03],
        }
    }

    /// Joints that one [`Bare::step`] computes.
    pub fn joints(&self) -> usize {
        8 * self.rows.len()
    }

    /// One step.
    pub fn step(&mut self, level: Level) {
        reef_flow::dispatch!(level, simd => {
            bend(simd, self);
            gather(simd, self);
            advance(simd, self);
        });
    }
}

#[inline(always)]
fn upright<S: Simd>(simd: S) -> pose::Frame<S> {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    pose::Frame { x: [one, zero, zero], y: [zero, one, zero], origin: [zero; 3] }
}

#[inline(always)]
fn bend<S: Simd>(simd: S, bare: &mut Bare) {
    let mut frame = upright(simd);
    let height = splat(simd, LENGTH);
    for (row, into) in bare.rows.iter().zip(&mut bare.frames) {
        frame = pose::turned(frame, height, load(simd, &row.theta), load(simd, &row.phi));
        store3(&mut into[0], frame.x);
        store3(&mut into[1], frame.y);
    }
}

#[inline(always)]
fn gather<S: Simd>(simd: S, bare: &mut Bare) {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let dt = splat(simd, DT);
    let (long, half) = (splat(simd, LENGTH), splat(simd, 0.5 * LENGTH));
    let (mass, drag, stiffness) = (splat(simd, MASS), splat(simd, DRAG), splat(simd, STIFFNESS));
    let hold = dt * mul_add(dt, stiffness, splat(simd, DAMPING));
    let inert = mul_add(dt, drag, mass);
    let force = scale(bare.velocity.map(|v| splat(simd, v)), drag);
    let spread = inert * long * long * splat(simd, 1.0 / 12.0);
    let spin = mass * long * long * splat(simd, 1.0 / 12.0);
    let mut body = Body::empty(simd);
    let mut total = [zero; 3];
    for i in (0..bare.rows.len()).rev() {
        let row = &bare.rows[i];
        let (x, y) = (load3(simd, &bare.frames[i][0]), load3(simd, &bare.frames[i][1]));
        let below = if i == 0 { upright(simd).y } else { load3(simd, &bare.frames[i - 1][1]) };
        let speed = load3(simd, &row.speed);
        let acting = add_scaled(force, speed, -drag);
        let pull = half * dot(y, acting) + long * dot(y, total);
        total = add(total, acting);
        let momentum = add_scaled(scale(speed, mass), force, dt);
        let round = spread + mul_add(inert, half * half, dt * dt * pull.max(zero));
        body.bear(y, [spread, round], [inert * half, inert]);
        body.push(cross(y, scale(momentum, half)), momentum);
        body.push(scale(load3(simd, &row.omega), spin), [zero; 3]);
        let bent = [load(simd, &row.theta), load(simd, &row.phi)];
        let [theta, phi] = &mut bare.answers[i];
        take_out(simd, &mut body, x, [hold, dt * stiffness * bent[1], one], phi);
        take_out(simd, &mut body, below, [hold, dt * stiffness * bent[0], one], theta);
        body.shift(simd, scale(below, long));
    }
}

#[inline(always)]
fn advance<S: Simd>(simd: S, bare: &mut Bare) {
    let zero = splat(simd, 0.0);
    let (dt, long) = (splat(simd, DT), splat(simd, LENGTH));
    let (mut omega, mut speed) = ([zero; 3], [zero; 3]);
    let mut below = upright(simd).y;
    for ((row, frame), answers) in bare.rows.iter_mut().zip(&bare.frames).zip(&bare.answers) {
        let (x, y) = (load3(simd, &frame[0]), load3(simd, &frame[1]));
        let theta = answers[0].rate(simd, omega, speed);
        omega = add_scaled(omega, below, theta);
        let phi = answers[1].rate(simd, omega, speed);
        omega = add_scaled(omega, x, phi);
        let angles = [load(simd, &row.theta), load(simd, &row.phi)];
        store(&mut row.theta, mul_add(dt, theta, angles[0]));
        store(&mut row.phi, mul_add(dt, phi, angles[1]));
        let end = cross(omega, scale(y, long));
        store3(&mut row.omega, omega);
        store3(&mut row.speed, add_scaled(speed, end, splat(simd, 0.5)));
        speed = add(speed, end);
        below = y;
    }
}
