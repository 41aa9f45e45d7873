//! The cosine transform along rows (DCT-II and its inverse), as a product with its matrix.
//!
//! A row is folded about its middle first: its even part has the even coefficients, its odd part the odd
//! ones, so each product is half as wide and half as long. For grids of up to some hundred cells this is as
//! fast as a recursive transform, and each coefficient's sum has one order, whatever the width of vectors.

use fearless_simd::{Simd, prelude::*};

use crate::lanes::{Real, WIDTH};

/// Rows that are transformed together: as many accumulators as there are registers.
const ROWS: usize = 3;
/// Vectors that are made together.
const VECTORS: usize = 4;

/// The matrices of both directions, for rows of `n`.
#[derive(Clone, Debug)]
pub(crate) struct Cosine<T> {
    n: usize,
    /// Numbers of a half, padded to whole vectors: a folded row is two halves.
    half: usize,
    /// [x][k], for the even and the odd half.
    forward: [Vec<T>; 2],
    /// [k][x].
    back: [Vec<T>; 2],
}

impl<T: Real> Cosine<T> {
    pub(crate) fn new(n: usize) -> Self {
        let half = n.div_ceil(2).next_multiple_of(WIDTH);
        let count = |parity: usize| if parity == 0 { n.div_ceil(2) } else { n / 2 };
        let wave = |x: usize, k: usize| {
            reef_flow::math::cos_sin_f64(core::f64::consts::PI * k as f64 * (x as f64 + 0.5) / n as f64).0
        };
        let mut made = Self { n, half, forward: [vec![], vec![]], back: [vec![], vec![]] };
        for parity in 0..2 {
            let mut forward = vec![T::default(); count(parity) * half];
            let mut back = forward.clone();
            for a in 0..count(parity) {
                for b in 0..count(parity) {
                    let (k, scale) = (2 * b + parity, 1.0);
                    forward[a * half + b] = T::of(scale * wave(a, k));
                    let k = 2 * a + parity;
                    let scale = if k == 0 { 1.0 } else { 2.0 } / n as f64;
                    back[a * half + b] = T::of(scale * wave(b, k));
                }
            }
            (made.forward[parity], made.back[parity]) = (forward, back);
        }
        made
    }

    /// Numbers of a folded row.
    pub(crate) fn width(&self) -> usize {
        2 * self.half
    }

    /// The wave number of each number of a row of coefficients; None: padding.
    pub(crate) fn wave_number(&self, at: usize) -> Option<usize> {
        let (parity, b) = (at / self.half, at % self.half);
        Some(2 * b + parity).filter(|k| *k < self.n)
    }

    /// Folds a row: `into` gets its even part, then its odd part.
    #[inline(always)]
    pub(crate) fn fold<S: Simd>(&self, simd: S, row: &[T], into: &mut [T]) {
        let (half, n) = (self.n / 2, self.n);
        let (even, odd) = into.split_at_mut(self.half);
        let mut x = 0;
        while x + WIDTH <= half {
            let near = T::Wide::<S>::from_slice(simd, &row[x..x + WIDTH]);
            let far = T::Wide::<S>::from_slice(simd, &row[n - x - WIDTH..n - x]).reverse();
            (near + far).store_slice(&mut even[x..x + WIDTH]);
            (near - far).store_slice(&mut odd[x..x + WIDTH]);
            x += WIDTH;
        }
        for x in x..half {
            even[x] = row[x] + row[n - 1 - x];
            odd[x] = row[x] - row[n - 1 - x];
        }
        if n % 2 == 1 {
            even[half] = row[half];
        }
    }

    /// The opposite of [`Cosine::fold`] for what comes out of the inverse transform.
    #[inline(always)]
    pub(crate) fn unfold<S: Simd>(&self, simd: S, from: &[T], row: &mut [T]) {
        let (half, n) = (self.n / 2, self.n);
        let (even, odd) = from.split_at(self.half);
        let mut x = 0;
        while x + WIDTH <= half {
            let e = T::Wide::<S>::from_slice(simd, &even[x..x + WIDTH]);
            let o = T::Wide::<S>::from_slice(simd, &odd[x..x + WIDTH]);
            (e + o).store_slice(&mut row[x..x + WIDTH]);
            (e - o).reverse().store_slice(&mut row[n - x - WIDTH..n - x]);
            x += WIDTH;
        }
        for x in x..half {
            row[x] = even[x] + odd[x];
            row[n - 1 - x] = even[x] - odd[x];
        }
        if n % 2 == 1 {
            row[half] = even[half];
        }
    }

    /// Folded rows to rows of coefficients.
    #[inline(always)]
    pub(crate) fn forward<S: Simd>(&self, simd: S, rows: &[T], into: &mut [T]) {
        self.product(simd, &self.forward, rows, into);
    }

    /// Rows of coefficients to folded rows.
    #[inline(always)]
    pub(crate) fn back<S: Simd>(&self, simd: S, rows: &[T], into: &mut [T]) {
        self.product(simd, &self.back, rows, into);
    }

    #[inline(always)]
    fn product<S: Simd>(&self, simd: S, matrices: &[Vec<T>; 2], rows: &[T], into: &mut [T]) {
        let width = self.width();
        let (mut rows, mut into) = (rows.chunks_exact(ROWS * width), into.chunks_exact_mut(ROWS * width));
        for (rows, into) in (&mut rows).zip(&mut into) {
            self.some_rows::<S, ROWS>(simd, matrices, rows, into);
        }
        let rest = into.into_remainder();
        for (row, into) in rows.remainder().chunks_exact(width).zip(rest.chunks_exact_mut(width)) {
            self.some_rows::<S, 1>(simd, matrices, row, into);
        }
    }

    #[inline(always)]
    fn some_rows<S: Simd, const R: usize>(
        &self,
        simd: S,
        matrices: &[Vec<T>; 2],
        rows: &[T],
        into: &mut [T],
    ) {
        for (parity, matrix) in matrices.iter().enumerate() {
            let first = parity * self.half;
            let mut at = 0;
            while at < self.half {
                let left = (self.half - at) / WIDTH;
                match left.min(VECTORS) {
                    1 => self.tile::<S, R, 1>(simd, matrix, rows, into, first, at),
                    2 => self.tile::<S, R, 2>(simd, matrix, rows, into, first, at),
                    3 => self.tile::<S, R, 3>(simd, matrix, rows, into, first, at),
                    _ => self.tile::<S, R, VECTORS>(simd, matrix, rows, into, first, at),
                }
                at += WIDTH * left.min(VECTORS);
            }
        }
    }

    /// `V` vectors of `R` rows.
    #[inline(always)]
    fn tile<S: Simd, const R: usize, const V: usize>(
        &self,
        simd: S,
        matrix: &[T],
        rows: &[T],
        into: &mut [T],
        first: usize,
        at: usize,
    ) {
        let width = self.width();
        let mut sums = [[T::Wide::<S>::splat(simd, T::default()); V]; R];
        let count = matrix.len() / self.half;
        // Of one known length each: no look at bounds is left in the loop.
        let mut halves: [&[T]; R] = [&[]; R];
        for (r, half) in halves.iter_mut().enumerate() {
            *half = &rows[r * width + first..][..count];
        }
        for (x, line) in matrix.chunks_exact(self.half).enumerate().take(count) {
            let line = &line[at..at + V * WIDTH];
            for r in 0..R {
                let factor = T::Wide::<S>::splat(simd, halves[r][x]);
                for v in 0..V {
                    let wave = T::Wide::<S>::from_slice(simd, &line[v * WIDTH..(v + 1) * WIDTH]);
                    sums[r][v] = T::mul_add(factor, wave, sums[r][v]);
                }
            }
        }
        for (r, sums) in sums.iter().enumerate() {
            for (v, sum) in sums.iter().enumerate() {
                let start = r * width + first + at + v * WIDTH;
                sum.store_slice(&mut into[start..start + WIDTH]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use reef_flow::Level;

    use super::*;

    #[test]
    fn the_transform_is_its_sum_and_its_inverse_takes_it_back() {
        for n in [16, 17, 33, 50, 100] {
            let cosine = Cosine::<f64>::new(n);
            let width = cosine.width();
            let rows: Vec<Vec<f64>> =
                (0..5).map(|r| (0..n).map(|x| ((x * x + 3 * r) as f64).sin()).collect()).collect();
            let (mut folded, mut waves) = (vec![0.0; 5 * width], vec![0.0; 5 * width]);
            let mut back = vec![0.0; n];
            for level in Level::all() {
                reef_flow::dispatch!(level, simd => {
                    for (row, folded) in rows.iter().zip(folded.chunks_exact_mut(width)) {
                        cosine.fold(simd, row, folded);
                    }
                    cosine.forward(simd, &folded, &mut waves);
                });
                for (row, waves) in rows.iter().zip(waves.chunks_exact(width)) {
                    for (at, wave) in waves.iter().enumerate() {
                        let Some(k) = cosine.wave_number(at) else { continue };
                        let angle = |x: usize| core::f64::consts::PI * k as f64 * (x as f64 + 0.5) / n as f64;
                        let sum: f64 = row.iter().enumerate().map(|(x, value)| value * angle(x).cos()).sum();
                        assert!((wave - sum).abs() < 1e-12 * n as f64, "{n} {k}: {wave} {sum}");
                    }
                }
                reef_flow::dispatch!(level, simd => cosine.back(simd, &waves, &mut folded));
                for (row, folded) in rows.iter().zip(folded.chunks_exact(width)) {
                    reef_flow::dispatch!(level, simd => cosine.unfold(simd, folded, &mut back));
                    assert!(row.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-13 * n as f64));
                }
            }
        }
    }
}
