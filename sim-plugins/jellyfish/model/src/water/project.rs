//! The exact projection (∇·u = 0, eq. (1)): a cosine transform along x leaves one tridiagonal system along y
//! for each wave number, and these are solved side by side.

use fearless_simd::{Simd, prelude::*};
use reef_flow::Level;

use super::{
    Water,
    cosine::Cosine,
    field::{Axis, Field},
};
use crate::lanes::{Real, WIDTH};

/// What a projection needs besides the velocity.
#[derive(Clone, Debug)]
pub(crate) struct Projection<T> {
    pub(crate) cosine: Cosine<T>,
    /// 1 / pivot of each system at each row, [row][wave number].
    pivots: Vec<T>,
    /// Folded rows, and coefficients.
    pub(crate) folded: Vec<T>,
    pub(crate) waves: Vec<T>,
    /// dt p / (ρ h): its differences are velocities [m/s].
    potential: Field<T>,
}

impl<T: Real> Projection<T> {
    pub(crate) fn new(n: usize) -> Self {
        let cosine = Cosine::new(n);
        let width = cosine.width();
        let mut pivots = vec![T::default(); n * width];
        for at in 0..width {
            let Some(k) = cosine.wave_number(at) else { continue };
            // Second difference along x of a wave: 2 − 2 cos(π k / n).
            let angle = core::f64::consts::PI * k as f64 / n as f64;
            let bend = 2.0 - 2.0 * reef_flow::math::cos_sin_f64(angle).0;
            let mut before = 0.0;
            for j in 0..n {
                let neighbours = f64::from(u8::from(j > 0)) + f64::from(u8::from(j + 1 < n));
                let pivot = neighbours + bend - before;
                // The mean potential is free: the last row of wave number 0 is 0.
                before = if k == 0 && j + 1 == n { 0.0 } else { 1.0 / pivot };
                pivots[j * width + at] = T::of(before);
            }
        }
        let room = vec![T::default(); n * width];
        Self { cosine, pivots, folded: room.clone(), waves: room, potential: Field::new(n) }
    }

    /// Solves all systems, in place: forward from the first row, then back from the last.
    #[inline(always)]
    pub(crate) fn solve<S: Simd>(&mut self, simd: S) {
        let width = self.cosine.width();
        let rows = self.waves.len() / width;
        for j in 0..rows {
            let (done, rest) = self.waves.split_at_mut(j * width);
            let before = if j == 0 { None } else { Some(&done[(j - 1) * width..]) };
            let pivots = &self.pivots[j * width..(j + 1) * width];
            let row = &mut rest[..width];
            for at in (0..width).step_by(WIDTH) {
                let mut value = T::Wide::<S>::from_slice(simd, &row[at..at + WIDTH]);
                if let Some(before) = before {
                    value += T::Wide::<S>::from_slice(simd, &before[at..at + WIDTH]);
                }
                let pivot = T::Wide::<S>::from_slice(simd, &pivots[at..at + WIDTH]);
                (value * pivot).store_slice(&mut row[at..at + WIDTH]);
            }
        }
        for j in (0..rows.saturating_sub(1)).rev() {
            let (rest, done) = self.waves.split_at_mut((j + 1) * width);
            let pivots = &self.pivots[j * width..(j + 1) * width];
            let (row, behind) = (&mut rest[j * width..], &done[..width]);
            for at in (0..width).step_by(WIDTH) {
                let value = T::Wide::<S>::from_slice(simd, &row[at..at + WIDTH]);
                let behind = T::Wide::<S>::from_slice(simd, &behind[at..at + WIDTH]);
                let pivot = T::Wide::<S>::from_slice(simd, &pivots[at..at + WIDTH]);
                T::mul_add(pivot, behind, value).store_slice(&mut row[at..at + WIDTH]);
            }
        }
    }

    /// The transform there.
    #[inline(always)]
    pub(crate) fn forward<S: Simd>(&mut self, simd: S) {
        self.cosine.forward(simd, &self.folded, &mut self.waves);
    }

    /// The transform back.
    #[inline(always)]
    pub(crate) fn back<S: Simd>(&mut self, simd: S) {
        self.cosine.back(simd, &self.waves, &mut self.folded);
    }
}

impl<T: Real> Water<T> {
    /// Takes the divergence out of the velocity.
    pub fn project(&mut self, level: Level) {
        reef_flow::dispatch!(level, simd => {
            self.gather(simd);
            self.projection.forward(simd);
            self.projection.solve(simd);
            self.projection.back(simd);
            self.subtract(simd);
        });
        self.u.close(Axis::X);
        self.v.close(Axis::Y);
    }

    /// −h ∇·u of each row, folded.
    #[inline(always)]
    fn gather<S: Simd>(&mut self, simd: S) {
        let n = self.n();
        let Projection { cosine, folded, potential, .. } = &mut self.projection;
        let width = cosine.width();
        let padded = n.next_multiple_of(WIDTH);
        for (j, folded) in folded.chunks_exact_mut(width).enumerate() {
            let u = self.u.row(j, padded + 1);
            let (below, above) = (self.v.row(j, padded), self.v.row(j + 1, padded));
            // The potential's own row is room enough.
            let at = potential.at(0, j);
            let row = &mut potential.data[at..at + padded];
            for x in (0..n).step_by(WIDTH) {
                let left = T::Wide::<S>::from_slice(simd, &u[x..x + WIDTH]);
                let right = T::Wide::<S>::from_slice(simd, &u[x + 1..x + 1 + WIDTH]);
                let below = T::Wide::<S>::from_slice(simd, &below[x..x + WIDTH]);
                let above = T::Wide::<S>::from_slice(simd, &above[x..x + WIDTH]);
                ((left - right) + (below - above)).store_slice(&mut row[x..x + WIDTH]);
            }
            cosine.fold(simd, &row[..n], folded);
        }
    }

    /// Subtracts the potential's gradient.
    #[inline(always)]
    fn subtract<S: Simd>(&mut self, simd: S) {
        let n = self.n();
        let Projection { cosine, folded, potential, .. } = &mut self.projection;
        for (j, folded) in folded.chunks_exact(cosine.width()).enumerate() {
            let at = potential.at(0, j);
            cosine.unfold(simd, folded, &mut potential.data[at..at + n]);
        }
        for j in 0..n {
            let at = potential.at(0, j);
            let stride = potential.stride();
            for x in (0..n).step_by(WIDTH) {
                let at = at + x;
                let here = T::Wide::<S>::from_slice(simd, &potential.data[at..at + WIDTH]);
                let left = T::Wide::<S>::from_slice(simd, &potential.data[at - 1..at - 1 + WIDTH]);
                let below = T::Wide::<S>::from_slice(simd, &potential.data[at - stride..at - stride + WIDTH]);
                let u = &mut self.u.data[at..at + WIDTH];
                (T::Wide::<S>::from_slice(simd, u) - (here - left)).store_slice(u);
                let v = &mut self.v.data[at..at + WIDTH];
                (T::Wide::<S>::from_slice(simd, v) - (here - below)).store_slice(v);
            }
        }
    }
}
