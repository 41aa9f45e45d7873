//! The least that the parts of a step can cost: where the water was and the clamped bicubic there, the
//! transforms and the solve, over hot data, and nothing else — no rims and walls, no way of more than a cell,
//! no folding, no gradient, no viscosity, no animal. What everything else is measured against.

use fearless_simd::{Simd, prelude::*};
use reef_flow::{Level, random::Random, simd::splat};

use crate::{
    lanes::WIDTH,
    water::{Axis, Field, Projection, way, within_a_cell},
};

/// Data of a grid of n × n cells.
#[derive(Clone, Debug)]
pub struct Bare {
    n: usize,
    fields: [Field<f32>; 2],
    into: Field<f32>,
    projection: Projection<f32>,
}

impl Bare {
    /// Water that moves less than a cell in a step.
    pub fn new(n: usize) -> Self {
        let mut random = Random::new(1, 1);
        let mut field = || {
            let mut field = Field::new(n);
            field.data.iter_mut().for_each(|value| *value = 0.4 * random.signed() as f32);
            field
        };
        Self { n, fields: [field(), field()], into: Field::new(n), projection: Projection::new(n) }
    }

    /// Both components of one step.
    pub fn advect(&mut self, level: Level) {
        reef_flow::dispatch!(level, simd => self.carry(simd));
    }

    /// The transform there and back: one step's.
    pub fn transform(&mut self, level: Level) {
        reef_flow::dispatch!(level, simd => {
            self.projection.forward(simd);
            self.projection.back(simd);
        });
    }

    /// The tridiagonal systems: one step's.
    pub fn solve(&mut self, level: Level) {
        reef_flow::dispatch!(level, simd => self.projection.solve(simd));
    }

    /// Multiply-adds of one [`Bare::transform`].
    pub fn transform_products(&self) -> usize {
        let (even, odd) = (self.n.div_ceil(2), self.n / 2);
        2 * self.n * (even * even + odd * odd)
    }

    #[inline(always)]
    fn carry<S: Simd>(&mut self, simd: S) {
        let cells = splat(simd, -1.0);
        let [u, v] = &self.fields;
        for (axis, own, other) in [(Axis::X, u, v), (Axis::Y, v, u)] {
            for j in 0..self.n {
                for i in (0..self.n).step_by(WIDTH) {
                    let at = own.at(i, j);
                    let [x, y] = way::<S, f32>(simd, axis, own, other, at, cells);
                    let value = within_a_cell::<S, f32>(simd, own, at, x, y);
                    value.store_slice(&mut self.into.data[at..at + WIDTH]);
                }
            }
        }
    }
}
