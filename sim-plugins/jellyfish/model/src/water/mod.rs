//! The water around one animal: ∂u/∂t = ν ∇²u − u·∇u − ∇p/ρ + F, ∇·u = 0 (eq. (1)), on n × n cells.
//!
//! The grid is staggered: the component along x stands on the faces between columns, that along y on those
//! between rows. Walls are free-slip. A step is [`Water::push`] for each point, then [`Water::diffuse`],
//! [`Water::project`], and, once the points have moved, [`Water::advect`]; all eight faces wide.
//!
//! Places are in metres from the lower left corner.

mod advect;
mod cosine;
mod field;
mod project;

use fearless_simd::{Simd, prelude::*};
use reef_flow::Level;

use crate::lanes::{Real, WIDTH};
pub(crate) use advect::{way, within_a_cell};
pub(crate) use field::{Axis, Field};
pub(crate) use project::Projection;

/// Fewest and most cells along a side.
pub const CELLS: [usize; 2] = [16, 256];
/// Most of a cell's velocity that viscosity may take in a step: above 1/4 the explicit step is unstable.
const MOST_DIFFUSION: f64 = 0.2;

/// The grid and what fills it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// n: cells along a side.
    pub n: usize,
    /// h: width of a cell [m].
    pub cell: f64,
    /// ρ [kg/m³].
    pub density: f64,
    /// ν: kinematic viscosity [m²/s].
    pub viscosity: f64,
}

impl Grid {
    /// Whether water on this grid can be stepped.
    ///
    /// # Errors
    /// What is wrong, and what is allowed.
    pub fn check(&self) -> Result<(), String> {
        let [fewest, most] = CELLS;
        if !(fewest..=most).contains(&self.n) {
            return Err(format!("the grid must have {fewest} to {most} cells along a side, has {}", self.n));
        }
        let finite = |value: f64| value.is_finite() && value > 0.0;
        let viscous = self.viscosity.is_finite() && self.viscosity >= 0.0;
        if !(finite(self.cell) && finite(self.density) && viscous) {
            return Err(format!(
                "cells must be wider than 0 m, density above 0 kg/m³ and viscosity not below 0 m²/s; they are {}, {} and {}",
                self.cell, self.density, self.viscosity
            ));
        }
        Ok(())
    }

    /// Width of the whole grid [m].
    pub fn width(&self) -> f64 {
        self.n as f64 * self.cell
    }
}

/// The water. See the [module](self) for the order of a step.
#[derive(Clone, Debug)]
pub struct Water<T> {
    grid: Grid,
    u: Field<T>,
    v: Field<T>,
    next_u: Field<T>,
    next_v: Field<T>,
    projection: Projection<T>,
    /// Whether something was pushed so near a wall that the rim is no mirror of it any more.
    open: bool,
}

/// The four faces around a place, and the share of each.
struct Around {
    at: usize,
    shares: [f64; 4],
}

impl<T: Real> Water<T> {
    /// Water at rest.
    ///
    /// # Errors
    /// As [`Grid::check`].
    pub fn new(grid: Grid) -> Result<Self, String> {
        grid.check()?;
        let field = Field::new(grid.n);
        Ok(Self {
            grid,
            u: field.clone(),
            v: field.clone(),
            next_u: field.clone(),
            next_v: field,
            projection: Projection::new(grid.n),
            open: false,
        })
    }

    /// What it stands on.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Density [kg/m³] and kinematic viscosity [m²/s] from now on; what no water has changes nothing.
    pub fn set_kind(&mut self, density: f64, viscosity: f64) {
        let grid = Grid { density, viscosity, ..self.grid };
        if grid.check().is_ok() {
            self.grid = grid;
        }
    }

    fn n(&self) -> usize {
        self.grid.n
    }

    #[inline(always)]
    fn around(&self, axis: Axis, [x, y]: [f64; 2]) -> Around {
        let (n, h) = (self.grid.n as f64, self.grid.cell);
        let (dx, dy) = if axis == Axis::X { (0.0, 0.5) } else { (0.5, 0.0) };
        // Places are kept inside the walls; one that is no number ends at a wall, too.
        let (x, y) = ((x / h - dx).max(-dx).min(n - dx), (y / h - dy).max(-dy).min(n - dy));
        // Not below −1: what is cut off is the fraction.
        let (i, j) = ((x + 1.0) as isize - 1, (y + 1.0) as isize - 1);
        let (fx, fy) = (x - i as f64, y - j as f64);
        let at = self.u.at(0, 0) as isize + j * self.u.stride() as isize + i;
        Around {
            at: at as usize,
            shares: [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy],
        }
    }

    /// Spreads what a force [N per metre of depth] does in `dt` [s] over the four nearest faces of each
    /// component, bilinearly.
    pub fn push(&mut self, place: [f64; 2], force: [f64; 2], dt: f64) {
        let scale = dt / (self.grid.density * self.grid.cell * self.grid.cell);
        for (axis, force) in [(Axis::X, force[0]), (Axis::Y, force[1])] {
            let Around { at, shares } = self.around(axis, place);
            let field = if axis == Axis::X { &mut self.u } else { &mut self.v };
            self.open |= field.near_rim(at);
            for (offset, share) in [0, 1, field.stride(), field.stride() + 1].into_iter().zip(shares) {
                field.data[at + offset] += T::of(scale * force * share);
            }
        }
    }

    /// The velocity at a place [m/s], bilinearly from the four nearest faces.
    pub fn velocity(&self, place: [f64; 2]) -> [f64; 2] {
        [(Axis::X, &self.u), (Axis::Y, &self.v)].map(|(axis, field)| {
            let Around { at, shares } = self.around(axis, place);
            let [a, b, c, d] = [0, 1, field.stride(), field.stride() + 1].map(|o| field.data[at + o].wide());
            (a * shares[0] + b * shares[1]) + (c * shares[2] + d * shares[3])
        })
    }

    /// Viscosity in `dt` [s]: ν ∇²u, explicitly. Leaves the rim to the projection.
    pub fn diffuse(&mut self, level: Level, dt: f64) {
        if core::mem::take(&mut self.open) {
            self.u.close(Axis::X);
            self.v.close(Axis::Y);
        }
        let share = self.grid.viscosity * dt / (self.grid.cell * self.grid.cell);
        if share == 0.0 {
            return;
        }
        let share = T::of(share.min(MOST_DIFFUSION));
        reef_flow::dispatch!(level, simd => {
            spread_out(simd, self.grid.n, &self.u, &mut self.next_u, share);
            spread_out(simd, self.grid.n, &self.v, &mut self.next_v, share);
        });
        core::mem::swap(&mut self.u, &mut self.next_u);
        core::mem::swap(&mut self.v, &mut self.next_v);
        // On a wall the sum is 0 as its terms cancel; the projection closes the rim.
    }

    /// Moves the window by whole cells, (columns, rows): the water in it moves the other way, and what comes
    /// in is at rest. The next step projects again.
    pub fn follow(&mut self, [columns, rows]: [isize; 2]) {
        self.u.shift([-columns, -rows], Axis::X);
        self.v.shift([-columns, -rows], Axis::Y);
        self.u.close(Axis::X);
        self.v.close(Axis::Y);
    }

    /// Greatest |∇·u| [1/s].
    pub fn divergence(&self) -> f64 {
        let mut most = 0.0_f64;
        for j in 0..self.n() {
            for i in 0..self.n() {
                let at = self.u.at(i, j);
                let across = self.u.data[at + 1].wide() - self.u.data[at].wide();
                let up = self.v.data[at + self.v.stride()].wide() - self.v.data[at].wide();
                most = most.max(((across + up) / self.grid.cell).abs());
            }
        }
        most
    }

    /// Greatest component of the velocity, on all faces [m/s]; NaN where one is no number.
    pub fn fastest(&self) -> f64 {
        let (mut most, n) = (0.0_f64, self.n());
        for (field, width, height) in [(&self.u, n + 1, n), (&self.v, n, n + 1)] {
            for value in (0..height).flat_map(|j| field.row(j, width)) {
                let value = value.wide().abs();
                most = if value.is_nan() || value > most { value } else { most };
            }
        }
        most
    }

    /// Greatest velocity across a wall [m/s].
    pub fn across_walls(&self) -> f64 {
        let n = self.n();
        let sides = (0..n).flat_map(|j| [self.u.data[self.u.at(0, j)], self.u.data[self.u.at(n, j)]]);
        let ends = [0, n].into_iter().flat_map(|j| self.v.row(j, n).iter().copied());
        sides.chain(ends).fold(0.0, |most, value| most.max(value.wide().abs()))
    }

    /// Momentum of all faces, per metre of depth [kg/s].
    pub fn momentum(&self) -> [f64; 2] {
        let (n, mass) = (self.n(), self.grid.density * self.grid.cell * self.grid.cell);
        [(&self.u, n + 1, n), (&self.v, n, n + 1)].map(|(field, width, height)| {
            mass * (0..height).flat_map(|j| field.row(j, width)).map(|value| value.wide()).sum::<f64>()
        })
    }

    /// Kinetic energy of all faces, per metre of depth [J/m].
    pub fn energy(&self) -> f64 {
        let (n, mass) = (self.n(), self.grid.density * self.grid.cell * self.grid.cell);
        let of = |field: &Field<T>, width: usize, height: usize| {
            (0..height).flat_map(|j| field.row(j, width)).map(|value| value.wide().powi(2)).sum::<f64>()
        };
        0.5 * mass * (of(&self.u, n + 1, n) + of(&self.v, n, n + 1))
    }

    /// All faces: those of the component along x row by row, n + 1 a row, then those along y, n a row.
    pub fn faces(&self) -> impl Iterator<Item = T> {
        self.face_rows().flatten().copied()
    }

    /// The same, row by row.
    pub fn face_rows(&self) -> impl Iterator<Item = &[T]> {
        let n = self.n();
        let along_x = (0..n).map(move |j| self.u.row(j, n + 1));
        along_x.chain((0..=n).map(move |j| self.v.row(j, n)))
    }

    /// How many faces there are.
    pub fn face_count(&self) -> usize {
        2 * self.n() * (self.n() + 1)
    }

    /// Takes back what [`Water::faces`] gave.
    ///
    /// # Errors
    /// How many there must be; then nothing has changed.
    pub fn set_faces(&mut self, faces: &[T]) -> Result<(), String> {
        let n = self.n();
        if faces.len() != self.face_count() {
            return Err(format!("has {} faces; this grid has {}", faces.len(), self.face_count()));
        }
        let (along_x, along_y) = faces.split_at(n * (n + 1));
        for (field, rows, width) in [(&mut self.u, along_x, n + 1), (&mut self.v, along_y, n)] {
            for (j, row) in rows.chunks_exact(width).enumerate() {
                let at = field.at(0, j);
                field.data[at..at + width].copy_from_slice(row);
            }
        }
        self.u.close(Axis::X);
        self.v.close(Axis::Y);
        Ok(())
    }
}

/// `from` + share · (the four neighbours − 4 · itself).
#[inline(always)]
fn spread_out<S: Simd, T: Real>(simd: S, n: usize, from: &Field<T>, into: &mut Field<T>, share: T) {
    let stride = from.stride();
    let share = T::Wide::<S>::splat(simd, share);
    let minus_four = T::Wide::<S>::splat(simd, T::of(-4.0));
    for j in 0..=n {
        let start = from.at(0, j);
        let count = (n + 1).next_multiple_of(WIDTH);
        let middle = &from.data[start - 1..start + count + 1];
        let below = &from.data[start - stride..start - stride + count];
        let above = &from.data[start + stride..start + stride + count];
        let into = &mut into.data[start..start + count];
        for x in (0..count).step_by(WIDTH) {
            let load = |row: &[T], x: usize| T::Wide::<S>::from_slice(simd, &row[x..x + WIDTH]);
            let here = load(middle, x + 1);
            let around = (load(middle, x) + load(middle, x + 2)) + (load(below, x) + load(above, x));
            let bend = T::mul_add(here, minus_four, around);
            T::mul_add(bend, share, here).store_slice(&mut into[x..x + WIDTH]);
        }
    }
}

#[cfg(test)]
mod tests {
    use reef_flow::random::Random;

    use super::*;

    /// Water that moves by chance.
    fn stirred<T: Real>(n: usize) -> Water<T> {
        let grid = Grid { n, cell: 0.004, density: 1000.0, viscosity: 1.304e-6 };
        let mut water = Water::new(grid).expect("a grid");
        let mut random = Random::new(7, n as u64);
        let faces: Vec<T> = (0..2 * n * (n + 1)).map(|_| T::of(0.3 * random.signed())).collect();
        water.set_faces(&faces).expect("as many faces");
        water
    }

    fn steps<T: Real>(water: &mut Water<T>, count: usize) {
        for _ in 0..count {
            water.diffuse(Level::best(), 0.005);
            water.project(Level::best());
            water.advect(Level::best(), 0.005);
        }
    }

    #[test]
    fn no_number_of_a_row_outgrows_the_faces_of_its_water() {
        // Where a row ends in a vector: each remainder.
        for n in 48..56 {
            let mut water = stirred::<f32>(n);
            steps(&mut water, 300);
            let most = water.fastest();
            let all = water.u.data.iter().chain(&water.v.data);
            let largest = all.fold(0.0_f64, |most, value| most.max(value.wide().abs()));
            assert!(most > 1e-4 && largest <= most, "{n}: {largest} beside {most} m/s");
        }
    }

    #[test]
    fn loaded_water_goes_on_to_the_same_bytes() {
        fn both<T: Real>(n: usize) -> [Vec<u64>; 2] {
            let mut first = stirred::<T>(n);
            steps(&mut first, 300);
            let mut second = Water::new(first.grid).expect("a grid");
            second.set_faces(&first.faces().collect::<Vec<_>>()).expect("as many faces");
            [&mut first, &mut second].map(|water| {
                steps(water, 20);
                water.faces().map(|value| value.wide().to_bits()).collect()
            })
        }
        for n in 48..56 {
            for [first, second] in [both::<f32>(n), both::<f64>(n)] {
                assert!(first == second, "{n}");
            }
        }
    }
}
