//! Who is near whom: the fish of one kind sorted by the cells of a lattice, as arrays.
//!
//! The lattice repeats itself, so that few cells do for any sea: who is in the same cell of another
//! repetition is only looked at in vain. In a cell fish go by their numbers: their order depends on where
//! they are alone.

use glam::Vec3;
use reef_sdk::{Chunks, Workers};

use crate::lanes::WIDTH;

/// What others see of a fish, relative to the shoal's anchor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Seen {
    /// Centre [m].
    pub(super) at: Vec3,
    /// The way that it looks, unit.
    pub(super) course: Vec3,
    /// Its length [m].
    pub(super) length: f32,
    /// It looks for a mate.
    pub(super) courts: bool,
}

/// All fish of a kind by cells.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Cells in a metre along each axis: they are shorter along x, the way that rows go.
    per_metre: [f32; 3],
    /// Cells along each axis, as powers of two.
    bits: [u32; 3],
    /// Where each cell begins, and the end.
    starts: Vec<u32>,
    /// The cell of each, as they are kept.
    cells: Vec<u32>,
    /// By slots: each one's place in the order.
    places: Vec<u32>,
    /// Slots in the order.
    pub(super) slots: Vec<u32>,
    /// In the order: centres [m], and behind them a vector's that are infinitely far; courses, lengths [m],
    /// and 1 for those that look for a mate.
    pub(super) at: [Vec<f32>; 3],
    pub(super) course: [Vec<f32>; 3],
    pub(super) length: Vec<f32>,
    pub(super) courts: Vec<f32>,
    /// Of each job's, and of all.
    extents: Vec<Extent>,
    extent: Extent,
}

/// What bounds fish.
#[derive(Clone, Copy, Debug)]
struct Extent {
    /// The box around them [m].
    low: Vec3,
    high: Vec3,
    /// The least and the greatest length [m].
    shortest: f32,
    longest: f32,
}

impl Extent {
    /// Of nobody.
    const NONE: Self =
        Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY, shortest: f32::INFINITY, longest: 0.0 };

    fn with(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            shortest: self.shortest.min(other.shortest),
            longest: self.longest.max(other.longest),
        }
    }
}

/// Cells across rows for one along them.
const ALONG: f32 = 4.0;
/// Cells along an axis at most, as a power of two.
const MOST_BITS: u32 = 8;
/// Fish that one job sorts.
const CHUNK: usize = 1024;

/// Part of a row of cells, in which fish follow one another.
pub(super) type Run = core::ops::Range<usize>;

impl Grid {
    /// A grid for so many fish, with cells of a side [m].
    pub(super) fn new(count: usize, side: f32) -> Self {
        let side = side.max(1e-3);
        // About as many cells as fish.
        let total = count.max(1).ilog2() + 1;
        let across = (total / 3).clamp(1, MOST_BITS);
        let bits = [total.saturating_sub(2 * across).clamp(2, MOST_BITS), across, across];
        let floats = || vec![0.0; count];
        let centres = || {
            let mut centres = floats();
            centres.resize(count + WIDTH, f32::INFINITY);
            centres
        };
        Self {
            per_metre: [ALONG / side, 1.0 / side, 1.0 / side],
            starts: vec![0; (1 << bits.iter().sum::<u32>()) + 1],
            bits,
            cells: vec![0; count],
            places: vec![0; count],
            slots: vec![0; count],
            at: [centres(), centres(), centres()],
            course: [floats(), floats(), floats()],
            length: floats(),
            courts: floats(),
            extents: vec![Extent::NONE; count.div_ceil(CHUNK)],
            extent: Extent::NONE,
        }
    }

    /// Cell along an axis, not yet taken into the lattice.
    fn along(&self, axis: usize, x: f32) -> i32 {
        // A cast saturates, and takes what is no number to 0.
        (x * self.per_metre[axis]).floor() as i32
    }

    fn cell(&self, at: Vec3) -> u32 {
        let [x, y, z] = [0, 1, 2].map(|axis| self.within(axis, self.along(axis, at[axis])));
        self.row(y, z) + x
    }

    fn within(&self, axis: usize, cell: i32) -> u32 {
        cell as u32 & ((1 << self.bits[axis]) - 1)
    }

    /// The first cell of a row.
    fn row(&self, y: u32, z: u32) -> u32 {
        ((z << self.bits[1]) | y) << self.bits[0]
    }

    /// Sorts all fish anew. `kept` says by slots where each is kept, from `first` on; `seen` what others see
    /// of the one that is kept somewhere.
    pub(super) fn fill(
        &mut self,
        workers: Workers<'_>,
        (first, kept): (usize, &[u32]),
        seen: impl Fn(usize) -> Seen + Sync,
    ) {
        let mut cells = core::mem::take(&mut self.cells);
        let grid = &*self;
        workers.for_each_part(Chunks::new(&mut cells, CHUNK), |chunk, cells| {
            for (i, cell) in cells.iter_mut().enumerate() {
                *cell = grid.cell(seen(chunk * CHUNK + i).at);
            }
        });
        self.cells = cells;
        self.order(first, kept);
        let Self { slots, at: [x, y, z], course: [cx, cy, cz], length, courts, extents, .. } = self;
        let slots = &*slots;
        let count = slots.len();
        let split = (
            (Chunks::new(&mut x[..count], CHUNK), Chunks::new(&mut y[..count], CHUNK)),
            (Chunks::new(&mut z[..count], CHUNK), Chunks::new(extents, 1)),
            (Chunks::new(cx, CHUNK), Chunks::new(cy, CHUNK), Chunks::new(cz, CHUNK)),
            (Chunks::new(length, CHUNK), Chunks::new(courts, CHUNK)),
        );
        workers.for_each_part(split, |chunk, ((x, y), (z, extent), (cx, cy, cz), (length, courts))| {
            let mut all = Extent::NONE;
            for (i, slot) in slots[chunk * CHUNK..][..x.len()].iter().enumerate() {
                let seen = seen(kept[*slot as usize] as usize - first);
                [x[i], y[i], z[i]] = seen.at.to_array();
                [cx[i], cy[i], cz[i]] = seen.course.to_array();
                (length[i], courts[i]) = (seen.length, f32::from(u8::from(seen.courts)));
                let Seen { at, length, .. } = seen;
                all = all.with(Extent { low: at, high: at, shortest: length, longest: length });
            }
            extent[0] = all;
        });
        self.extent = self.extents.iter().copied().fold(Extent::NONE, Extent::with);
    }

    /// From cells to places by slots and slots by places.
    fn order(&mut self, first: usize, kept: &[u32]) {
        let Self { starts, cells, places, slots, .. } = self;
        starts.fill(0);
        for cell in cells.iter() {
            starts[*cell as usize] += 1;
        }
        let mut sum = 0;
        for start in starts.iter_mut() {
            (*start, sum) = (sum, sum + *start);
        }
        for ((slot, at), place) in (0..).zip(kept).zip(places.iter_mut()) {
            let next = &mut starts[cells[*at as usize - first] as usize];
            *place = *next;
            slots[*next as usize] = slot;
            *next += 1;
        }
        // Each is where the next begins now.
        let ends = starts.len() - 1;
        starts.copy_within(..ends, 1);
        starts[0] = 0;
    }

    /// Memory that they take [bytes].
    pub(super) fn bytes(&self) -> usize {
        let words = [&self.starts, &self.cells, &self.places, &self.slots].map(|words| size_of_val(&**words));
        let [x, y, z] = &self.at;
        let [cx, cy, cz] = &self.course;
        let numbers =
            [x, y, z, cx, cy, cz, &self.length, &self.courts].map(|numbers| size_of_val(&**numbers));
        words.iter().chain(&numbers).sum()
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.slots.len()
    }

    /// Where the fish of a slot is in the order.
    pub(super) fn place(&self, slot: usize) -> usize {
        self.places[slot] as usize
    }

    /// Whether any of them is in a box.
    pub(super) fn reaches(&self, low: Vec3, high: Vec3) -> bool {
        self.extent.low.cmple(high).all() && low.cmple(self.extent.high).all()
    }

    /// The least length [m].
    pub(super) fn shortest(&self) -> f32 {
        self.extent.shortest
    }

    /// The greatest length [m].
    pub(super) fn longest(&self) -> f32 {
        self.extent.longest
    }

    /// Runs of fish among whom are all in the box, each once.
    pub(super) fn runs(&self, low: Vec3, high: Vec3) -> Runs<'_> {
        let span = |axis: usize| {
            let (first, last) = (self.along(axis, low[axis]), self.along(axis, high[axis]));
            let (more, cells) = (last.wrapping_sub(first) as u32, 1_u32 << self.bits[axis]);
            // The lattice repeats itself: all of it once.
            if more >= cells - 1 { [0, cells] } else { [self.within(axis, first), more + 1] }
        };
        let [x, y, z] = [0, 1, 2].map(span);
        let cells = 1_u32 << self.bits[0];
        let end = x[0] + x[1];
        Runs {
            grid: self,
            first: [x[0], end.min(cells)],
            second: end.saturating_sub(cells),
            y,
            rows: y[1] * z[1],
            z: z[0],
            row: 0,
            layer: 0,
            wrapped: false,
        }
    }

    /// None.
    pub(super) fn no_runs(&self) -> Runs<'_> {
        Runs {
            grid: self,
            first: [0; 2],
            second: 0,
            y: [0; 2],
            rows: 0,
            z: 0,
            row: 0,
            layer: 0,
            wrapped: false,
        }
    }
}

/// Goes through the rows of cells of a box.
#[derive(Clone, Debug)]
pub(super) struct Runs<'a> {
    grid: &'a Grid,
    /// Cells of a row that are in the box, and how many of them are beyond its end, at its beginning.
    first: [u32; 2],
    second: u32,
    /// First row and how many there are in a layer; how many are left in all; first layer.
    y: [u32; 2],
    rows: u32,
    z: u32,
    row: u32,
    layer: u32,
    /// The row's first part was given.
    wrapped: bool,
}

impl Iterator for Runs<'_> {
    type Item = Run;

    #[inline(always)]
    fn next(&mut self) -> Option<Run> {
        while self.rows > 0 {
            let y = self.grid.within(1, (self.y[0] + self.row) as i32);
            let z = self.grid.within(2, (self.z + self.layer) as i32);
            let [from, to] = if self.wrapped { [0, self.second] } else { self.first };
            if self.wrapped || self.second == 0 {
                self.wrapped = false;
                self.rows -= 1;
                self.row += 1;
                if self.row == self.y[1] {
                    (self.row, self.layer) = (0, self.layer + 1);
                }
            } else {
                self.wrapped = true;
            }
            let cells = self.grid.row(y, z);
            let begin = |cell: u32| self.grid.starts[(cells + cell) as usize] as usize;
            let run = begin(from)..begin(to);
            if !run.is_empty() {
                return Some(run);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use reef_flow::random::Random;

    use super::*;

    fn filled(places: &[Vec3], side: f32) -> Grid {
        let mut grid = Grid::new(places.len(), side);
        let kept: Vec<u32> = (0..places.len() as u32).collect();
        grid.fill(Workers::inline(), (0, &kept), |at| Seen { at: places[at], ..Seen::default() });
        grid
    }

    #[test]
    fn all_in_a_box_are_found_once_wherever_it_is() {
        let mut random = Random::new(3, 1);
        for (count, side, extent) in [(500, 0.5, 4.0), (500, 0.05, 40.0), (3, 1.0, 2.0), (1, 1.0, 1e4)] {
            let mut place = || Vec3::from([(); 3].map(|()| random.between(-extent, extent) as f32));
            let places: Vec<Vec3> = (0..count).map(|_| place()).collect();
            let grid = filled(&places, side);
            for reach in [0.1, 1.0, 2.5, 30.0] {
                let (low, high) = (places[0] - reach, places[0] + reach);
                let mut found = Vec::new();
                grid.runs(low, high).for_each(|run| found.extend_from_slice(&grid.slots[run]));
                found.sort_unstable();
                assert!(found.is_sorted_by(|a, b| a < b), "each once: {found:?}");
                let inside = |slot: &u32| {
                    let at = places[*slot as usize];
                    at.cmpge(low).all() && at.cmple(high).all()
                };
                found.retain(inside);
                assert_eq!(found, (0..count as u32).filter(inside).collect::<Vec<_>>());
                assert!(grid.reaches(low, high));
            }
        }
    }

    #[test]
    fn the_order_is_that_of_cells_and_then_of_slots() {
        let places = [0.9, -0.4, 0.1, 0.05, f32::MAX, f32::NAN].map(|x| Vec3::new(x, 0.0, 0.0));
        let grid = filled(&places, 1.0);
        let cells: Vec<u32> = grid.slots.iter().map(|slot| grid.cell(places[*slot as usize])).collect();
        assert!(cells.is_sorted(), "{cells:?}");
        let order: Vec<u32> = grid.slots.iter().copied().filter(|slot| [2, 3, 5].contains(slot)).collect();
        assert_eq!(order, [2, 3, 5], "all three are in cell 0");
        for (place, slot) in grid.slots.iter().enumerate() {
            assert_eq!(grid.place(*slot as usize), place);
            assert_eq!(grid.at[0][place].to_bits(), places[*slot as usize].x.to_bits());
        }
    }
}
