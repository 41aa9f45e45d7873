//! Linearly implicit springs: (m I + c dt² K) ΔV = dt (F − c dt K V), c from 1/2 to 1.
//!
//! Forces reach no farther than two pairs of points along the chain, so the matrix has five diagonals of
//! 4 × 4 blocks, a pair of points each; it is positive definite, and Cholesky's factors have the same shape.

use glam::{DMat2, DVec2};

type Block = [[f64; 4]; 4];

/// The system of one animal, and the room to solve it.
#[derive(Clone, Debug)]
pub(crate) struct System {
    /// Of each pair: its block on the diagonal, that with the pair before it, and that with the pair before
    /// that.
    rows: Vec<[Block; 3]>,
    right: Vec<[f64; 4]>,
}

impl System {
    pub(crate) fn new(pairs: usize) -> Self {
        Self { rows: vec![[[[0.0; 4]; 4]; 3]; pairs], right: vec![[0.0; 4]; pairs] }
    }

    /// Nothing but the mass of each point [kg per metre of depth].
    pub(crate) fn begin(&mut self, mass: f64) {
        for (row, right) in self.rows.iter_mut().zip(&mut self.right) {
            *row = [[[0.0; 4]; 4]; 3];
            *right = [0.0; 4];
            for (i, line) in row[0].iter_mut().enumerate() {
                line[i] = mass;
            }
        }
    }

    /// Adds to the matrix what the force on point `a` owes to point `b`; the other triangle follows.
    #[inline(always)]
    pub(crate) fn add(&mut self, a: usize, b: usize, value: DMat2) {
        let (from, to) = (a / 2, b / 2);
        // The lower triangle only.
        if from < to {
            return;
        }
        let block = &mut self.rows[from][from - to];
        let (i, j) = (2 * (a % 2), 2 * (b % 2));
        block[i][j] += value.x_axis.x;
        block[i + 1][j] += value.x_axis.y;
        block[i][j + 1] += value.y_axis.x;
        block[i + 1][j + 1] += value.y_axis.y;
    }

    /// Adds to the right side.
    #[inline(always)]
    pub(crate) fn push(&mut self, a: usize, value: DVec2) {
        let right = &mut self.right[a / 2];
        right[2 * (a % 2)] += value.x;
        right[2 * (a % 2) + 1] += value.y;
    }

    /// Solves it, in place.
    pub(crate) fn solve(&mut self) {
        for k in 0..self.rows.len() {
            let (done, rest) = self.rows.split_at_mut(k);
            let [diagonal, near, far] = &mut rest[0];
            if let Some([own, before, _]) = k.checked_sub(1).map(|j| &done[j]) {
                if let Some([farther, ..]) = k.checked_sub(2).map(|j| &done[j]) {
                    divide(far, farther);
                    subtract_product(diagonal, far, far);
                    subtract_product(near, far, before);
                }
                divide(near, own);
                subtract_product(diagonal, near, near);
            }
            root(diagonal);
        }
        for k in 0..self.rows.len() {
            let (done, rest) = self.right.split_at_mut(k);
            let [diagonal, near, far] = &self.rows[k];
            let value = &mut rest[0];
            for (block, back) in [(near, 1), (far, 2)] {
                let Some(known) = k.checked_sub(back).map(|j| done[j]) else { continue };
                for i in 0..4 {
                    for (factor, known) in block[i].iter().zip(known) {
                        value[i] -= factor * known;
                    }
                }
            }
            for i in 0..4 {
                for j in 0..i {
                    value[i] -= diagonal[i][j] * value[j];
                }
                value[i] *= diagonal[i][i];
            }
        }
        for k in (0..self.rows.len()).rev() {
            let mut value = self.right[k];
            for (block, ahead) in [(1, k + 1), (2, k + 2)] {
                let (Some(row), Some(known)) = (self.rows.get(ahead), self.right.get(ahead)) else {
                    continue;
                };
                for i in 0..4 {
                    for j in 0..4 {
                        value[i] -= row[block][j][i] * known[j];
                    }
                }
            }
            let diagonal = &self.rows[k][0];
            for i in (0..4).rev() {
                for j in i + 1..4 {
                    value[i] -= diagonal[j][i] * value[j];
                }
                value[i] *= diagonal[i][i];
            }
            self.right[k] = value;
        }
    }

    /// Of a solved system: ΔV of a point.
    #[inline(always)]
    pub(crate) fn of(&self, a: usize) -> DVec2 {
        let right = &self.right[a / 2];
        DVec2::new(right[2 * (a % 2)], right[2 * (a % 2) + 1])
    }
}

/// A ← A C⁻ᵀ for a lower triangle C, with the reciprocals of its diagonal there.
#[inline(always)]
fn divide(a: &mut Block, c: &Block) {
    for row in a {
        for j in 0..4 {
            for i in 0..j {
                row[j] -= row[i] * c[j][i];
            }
            row[j] *= c[j][j];
        }
    }
}

/// A ← A − B Cᵀ.
#[inline(always)]
fn subtract_product(a: &mut Block, b: &Block, c: &Block) {
    for (row, b) in a.iter_mut().zip(b) {
        for (value, c) in row.iter_mut().zip(c) {
            *value -= (b[0] * c[0] + b[1] * c[1]) + (b[2] * c[2] + b[3] * c[3]);
        }
    }
}

/// A ← its lower Cholesky factor, with the reciprocals of the diagonal there.
#[inline(always)]
fn root(a: &mut Block) {
    for i in 0..4 {
        for j in 0..i {
            for k in 0..j {
                a[i][j] -= a[i][k] * a[j][k];
            }
            a[i][j] *= a[j][j];
        }
        for k in 0..i {
            a[i][i] -= a[i][k] * a[i][k];
        }
        a[i][i] = 1.0 / a[i][i].sqrt();
    }
}

#[cfg(test)]
mod tests {
    use reef_flow::random::Random;

    use super::*;

    #[test]
    fn the_solution_fulfils_the_system() {
        let mut random = Random::new(5, 6);
        let points = 2 * 26;
        let mut system = System::new(26);
        system.begin(0.01);
        let mut whole = vec![vec![0.0; 2 * points]; 2 * points];
        (0..2 * points).for_each(|i| whole[i][i] = 0.01);
        let mut right = vec![0.0; 2 * points];
        for a in 0..points {
            let force = DVec2::new(random.signed(), random.signed());
            system.push(a, force);
            (right[2 * a], right[2 * a + 1]) = (force.x, force.y);
            // A spring with each point up to two pairs ahead.
            for b in a + 1..points.min(2 * (a / 2) + 6) {
                let d = DVec2::new(random.signed(), random.signed());
                let k = DMat2::from_cols(d * d.x, d * d.y);
                for (p, q, k) in [(a, a, k), (b, b, k), (a, b, -k), (b, a, -k)] {
                    system.add(p, q, k);
                    for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                        whole[2 * p + i][2 * q + j] += k.col(j)[i];
                    }
                }
            }
        }
        system.solve();
        for i in 0..2 * points {
            let sum: f64 = (0..2 * points).map(|j| whole[i][j] * system.of(j / 2)[j % 2]).sum();
            assert!((sum - right[i]).abs() < 1e-11, "{i}: {sum} {}", right[i]);
        }
    }
}
