//! Semi-Lagrangian advection (Stam 1999): each face takes the velocity from where its water was, by a
//! bicubic that stays between the four nearest values. Where it was is found to second order in time.

use fearless_simd::{Select, Simd, prelude::*};
use reef_flow::Level;

use super::{
    Water,
    field::{Axis, Field, RIM},
};
use crate::lanes::{Real, WIDTH};

/// Faces that a cubic reaches to either side, where water goes less than one cell in a step.
const REACH: usize = 2;
const TAPS: usize = 2 * REACH + 1;

impl<T: Real> Water<T> {
    /// Carries the velocity along with itself for `dt` [s].
    pub fn advect(&mut self, level: Level, dt: f64) {
        let cells = T::of(-dt / self.grid.cell);
        reef_flow::dispatch!(level, simd => {
            carry(simd, Axis::X, self.n(), &self.u, &self.v, cells, &mut self.next_u);
            carry(simd, Axis::Y, self.n(), &self.v, &self.u, cells, &mut self.next_v);
        });
        core::mem::swap(&mut self.u, &mut self.next_u);
        core::mem::swap(&mut self.v, &mut self.next_v);
        self.u.close(Axis::X);
        self.v.close(Axis::Y);
    }
}

/// One component: `own` along `axis`, `other` across it; `cells`: a velocity's way back in a step, in cells.
#[inline(always)]
pub(crate) fn carry<S: Simd, T: Real>(
    simd: S,
    axis: Axis,
    n: usize,
    own: &Field<T>,
    other: &Field<T>,
    cells: T,
    into: &mut Field<T>,
) {
    let (width, height) = if axis == Axis::X { (n + 1, n) } else { (n, n + 1) };
    let wide_cells = T::Wide::<S>::splat(simd, cells);
    let one = T::Wide::<S>::splat(simd, T::of(1.0));
    for j in 0..height {
        for i in (0..width).step_by(WIDTH) {
            let at = own.at(i, j);
            let [x, y] = way::<S, T>(simd, axis, own, other, at, wide_cells);
            let near = x.abs().simd_lt(one) & y.abs().simd_lt(one);
            let value = if near.all_true() {
                within_a_cell(simd, own, at, x, y)
            } else {
                let mut lanes = T::Wide::<S>::splat(simd, T::default());
                for lane in 0..WIDTH {
                    lanes[lane] = anywhere(own, axis, n, [i + lane, j], [x[lane], y[lane]]);
                }
                lanes
            };
            value.store_slice(&mut into.data[at..at + WIDTH]);
        }
    }
}

/// The way back of eight faces in a step, along x and y, in cells. `cells`: that of a velocity.
#[inline(always)]
pub(crate) fn way<S: Simd, T: Real>(
    simd: S,
    axis: Axis,
    own: &Field<T>,
    other: &Field<T>,
    at: usize,
    cells: T::Wide<S>,
) -> [T::Wide<S>; 2] {
    let stride = own.stride();
    // Half of a difference over two cells, and the mean of four faces.
    let quarter_cells = cells * T::of(0.25);
    // The four faces of the other component around this one.
    let corner = if axis == Axis::X { at - 1 } else { at - stride };
    let [a, b] = [load(simd, other, corner), load(simd, other, corner + 1)];
    let [c, d] = [load(simd, other, corner + stride), load(simd, other, corner + stride + 1)];
    let (below, above) = (a + b, c + d);
    let along = load(simd, own, at) * cells;
    let across = (below + above) * quarter_cells;
    // The way begins halfway, where the water was in the middle of the step: way + (way · ∇) way / 2,
    // with differences from one cell to the next.
    let along_sides = load(simd, own, at + 1) - load(simd, own, at - 1);
    let along_ends = load(simd, own, at + stride) - load(simd, own, at - stride);
    let (across_sides, across_ends) = ((b - a) + (d - c), above - below);
    let (way_x, way_y) = if axis == Axis::X { (along, across) } else { (across, along) };
    let along = T::mul_add(T::mul_add(way_y, along_ends, way_x * along_sides), quarter_cells, along);
    let across = T::mul_add(T::mul_add(way_y, across_ends, way_x * across_sides), quarter_cells, across);
    if axis == Axis::X { [along, across] } else { [across, along] }
}

#[inline(always)]
fn load<S: Simd, T: Real>(simd: S, field: &Field<T>, at: usize) -> T::Wide<S> {
    T::Wide::<S>::from_slice(simd, &field.data[at..at + WIDTH])
}

/// Weights of the four values around, from left to right (Catmull-Rom), at the share `f` of the way from the
/// second to the third.
#[inline(always)]
fn weights<S: Simd, T: Real>(simd: S, f: T::Wide<S>) -> [T::Wide<S>; 4] {
    let all = |value: f64| T::Wide::<S>::splat(simd, T::of(value));
    let f2 = f * f;
    [
        f * T::mul_add(f, T::mul_add(f, all(-0.5), all(1.0)), all(-0.5)),
        T::mul_add(f2, T::mul_add(f, all(1.5), all(-2.5)), all(1.0)),
        f * T::mul_add(f, T::mul_add(f, all(-1.5), all(2.0)), all(0.5)),
        f2 * T::mul_add(f, all(0.5), all(-0.5)),
    ]
}

/// The weights of five values around the face itself, for a way of less than one cell to either side.
#[inline(always)]
fn taps<S: Simd, T: Real>(simd: S, way: T::Wide<S>) -> [T::Wide<S>; TAPS] {
    let zero = T::Wide::<S>::splat(simd, T::default());
    let one = T::Wide::<S>::splat(simd, T::of(1.0));
    let back = way.simd_lt(zero);
    let [a, b, c, d] = weights::<S, T>(simd, back.select(way + one, way));
    [back.select(a, zero), back.select(b, a), back.select(c, b), back.select(d, c), back.select(zero, d)]
}

/// The bicubic where no water goes as far as a cell.
#[inline(always)]
pub(crate) fn within_a_cell<S: Simd, T: Real>(
    simd: S,
    own: &Field<T>,
    at: usize,
    x: T::Wide<S>,
    y: T::Wide<S>,
) -> T::Wide<S> {
    let zero = T::Wide::<S>::splat(simd, T::default());
    let (across, up) = (taps::<S, T>(simd, x), taps::<S, T>(simd, y));
    let stride = own.stride();
    let mut sum = zero;
    let mut pairs = [[zero; 2]; 3];
    let start = at - REACH * stride - REACH;
    for row in 0..TAPS {
        let values = &own.data[start + row * stride..start + row * stride + WIDTH + TAPS - 1];
        let mut line = T::Wide::<S>::from_slice(simd, &values[..WIDTH]) * across[0];
        for column in 1..TAPS {
            let value = T::Wide::<S>::from_slice(simd, &values[column..column + WIDTH]);
            line = T::mul_add(value, across[column], line);
        }
        sum = T::mul_add(line, up[row], sum);
        if (1..=3).contains(&row) {
            pairs[row - 1] = corners::<S, T>(simd, x, values);
        }
    }
    between::<S, T>(simd, y, pairs, sum)
}

/// In one of the middle rows: the face's own value, and that of the column that the water came from.
#[inline(always)]
fn corners<S: Simd, T: Real>(simd: S, x: T::Wide<S>, values: &[T]) -> [T::Wide<S>; 2] {
    let back = x.simd_lt(T::Wide::<S>::splat(simd, T::default()));
    let value = |column: usize| T::Wide::<S>::from_slice(simd, &values[column..column + WIDTH]);
    [value(REACH), back.select(value(REACH - 1), value(REACH + 1))]
}

/// A value held between the four nearest ones: out of the face's own row, the one below, the one above.
#[inline(always)]
fn between<S: Simd, T: Real>(
    simd: S,
    y: T::Wide<S>,
    pairs: [[T::Wide<S>; 2]; 3],
    value: T::Wide<S>,
) -> T::Wide<S> {
    let down = y.simd_lt(T::Wide::<S>::splat(simd, T::default()));
    let [below, [a, b], above] = pairs;
    let (c, d) = (down.select(below[0], above[0]), down.select(below[1], above[1]));
    let low = a.min(b).min(c.min(d));
    let high = a.max(b).max(c.max(d));
    value.max(low).min(high)
}

/// The same for one face and any way, which ends at the walls.
#[inline(never)]
fn anywhere<T: Real>(own: &Field<T>, axis: Axis, n: usize, face: [usize; 2], way: [T; 2]) -> T {
    let mut base = [0_usize; 2];
    let mut weights = [[T::default(); 4]; 2];
    let n = n as f64;
    // Along a component's own axis, faces 0 and n are the walls; across it, these are half a cell before
    // the first and behind the last.
    let (on, between) = ([0.0, n], [-0.5, n - 0.5]);
    let walls = if axis == Axis::X { [on, between] } else { [between, on] };
    for axis in 0..2 {
        // Not `clamp`: what is no number ends at a wall, too.
        let place = (face[axis] as f64 + way[axis].wide()).max(walls[axis][0]).min(walls[axis][1]);
        let whole = place.floor();
        let f = T::of(place - whole);
        let (f2, m) = (f * f, T::mul_add_one);
        weights[axis] = [
            f * m(f, m(f, T::of(-0.5), T::of(1.0)), T::of(-0.5)),
            m(f2, m(f, T::of(1.5), T::of(-2.5)), T::of(1.0)),
            f * m(f, m(f, T::of(-1.5), T::of(2.0)), T::of(0.5)),
            f2 * m(f, T::of(0.5), T::of(-0.5)),
        ];
        base[axis] = (whole + RIM as f64) as usize;
    }
    // Counted from RIM columns and rows before the first.
    let first = own.at(0, 0) - RIM * own.stride() - RIM;
    let value = |column: usize, row: usize| {
        own.data[first + (base[1] + row - 1) * own.stride() + base[0] + column - 1]
    };
    let mut sum = T::default();
    for (row, up) in weights[1].iter().enumerate() {
        let mut line = value(0, row) * weights[0][0];
        for (column, across) in weights[0].iter().enumerate().skip(1) {
            line = T::mul_add_one(value(column, row), *across, line);
        }
        sum = T::mul_add_one(line, *up, sum);
    }
    let corners = [value(1, 1), value(2, 1), value(1, 2), value(2, 2)];
    let low = corners.into_iter().fold(corners[0], |a, b| if b < a { b } else { a });
    let high = corners.into_iter().fold(corners[0], |a, b| if b > a { b } else { a });
    if sum < low {
        low
    } else if sum > high {
        high
    } else {
        sum
    }
}

#[cfg(test)]
mod tests {
    use reef_flow::random::Random;

    use super::*;

    /// The bits of one component after a step in which no water goes farther than `most` cells, and of the
    /// same face by face.
    fn both<T: Real>(level: Level, most: f64) -> [Vec<u64>; 2] {
        let n = 29;
        let mut random = Random::new(3, 4);
        let mut fields = [Field::<T>::new(n), Field::new(n)];
        for (field, axis) in fields.iter_mut().zip([Axis::X, Axis::Y]) {
            field.data.iter_mut().for_each(|value| *value = T::of(most * random.signed()));
            field.close(axis);
        }
        let [u, v] = &fields;
        let mut into = u.clone();
        reef_flow::dispatch!(level, simd => carry(simd, Axis::X, n, u, v, T::of(-1.0), &mut into));
        let mut single = u.clone();
        for j in 0..n {
            for i in 0..=n {
                let at = u.at(i, j);
                let (below, above) = (at, at + u.stride());
                let (a, b, c, d) = (v.data[below - 1], v.data[below], v.data[above - 1], v.data[above]);
                let (stride, back) = (u.stride(), T::of(-1.0));
                let x = u.data[at] * back;
                let y = ((a + b) + (c + d)) * (back * T::of(0.25));
                let bent = |way: T, sides: T, ends: T| {
                    T::mul_add_one(T::mul_add_one(y, ends, x * sides), back * T::of(0.25), way)
                };
                let way = [
                    bent(x, u.data[at + 1] - u.data[at - 1], u.data[at + stride] - u.data[at - stride]),
                    bent(y, (b - a) + (d - c), (c + d) - (a + b)),
                ];
                single.data[at] = anywhere(u, Axis::X, n, [i, j], way);
            }
        }
        let bits = |field: &Field<T>| -> Vec<u64> {
            (0..n).flat_map(|j| field.row(j, n + 1).iter().map(|value| value.wide().to_bits())).collect()
        };
        [bits(&into), bits(&single)]
    }

    #[test]
    fn faces_side_by_side_and_one_by_one_agree_within_rounding() {
        for level in Level::all() {
            for (wide, single) in [both::<f64>(level, 0.45), both::<f64>(level, 3.0)].map(|[a, b]| (a, b)) {
                for (a, b) in wide.iter().zip(&single) {
                    assert!((f64::from_bits(*a) - f64::from_bits(*b)).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn every_instruction_set_carries_to_the_same_bytes() {
        for most in [0.9, 5.0] {
            let [first, _] = both::<f32>(Level::scalar(), most);
            let [wide, _] = both::<f64>(Level::scalar(), most);
            for level in Level::all() {
                assert!(both::<f32>(level, most)[0] == first && both::<f64>(level, most)[0] == wide);
            }
        }
    }
}
