//! Masters and their slaves: which of a box's particles are neighbours (§3.3.3).
//!
//! The box is halved across its longest side, again and again, each time with as many places on one side as
//! on the other, until a cell holds one group. So groups are compact in boxes of any shape, and neighbours in
//! the list are neighbours in the water. The places stay as independent of one another as chance made them,
//! but for those few of which no master is d_pmin … d_pmax away: they are drawn again, in the group's own
//! cell, until it is.

use crate::drift::BLOCK;
use reef_flow::random::mix;

/// Draws of a place in the group's own cell, and then anywhere around the master.
const DRAWS: [u64; 2] = [64, 1024];
/// What a distance keeps off its bounds, as a share of them: it may be found again in f32.
const KEEP: f64 = 1e-3;

/// What groups are made with.
#[derive(Clone, Copy, Debug)]
pub struct Groups {
    /// Of the box [m].
    pub extent: [f64; 3],
    /// A master and its slaves.
    pub members: usize,
    /// Groups of a chunk: those of one lie together.
    pub chunk: usize,
    /// d_pmin, d_pmax [m].
    pub range: [f64; 2],
    /// Of what is drawn again.
    pub seed: u64,
}

/// How much flatter than wide blocks are: waves fade with depth, and a block takes all that its highest
/// particle needs.
const FLAT: f64 = 4.0;

/// A cell: the least and the greatest offsets in it [2⁻³² of the extent].
type Cell = [[i32; 2]; 3];

impl Groups {
    /// Puts places [2⁻³² of the extent] in an order in which `members` in a row are a master and its slaves,
    /// and moves those slaves that would be too near or too far.
    pub fn form(&self, places: &mut [[i32; 3]]) {
        if self.members > 1 {
            self.split(places, [[i32::MIN, i32::MAX]; 3], self.seed);
        }
    }

    fn split(&self, places: &mut [[i32; 3]], cell: Cell, chance: u64) {
        let groups = places.len().div_ceil(self.members);
        if groups <= 1 {
            return self.settle(places, cell, chance);
        }
        // Whole chunks and whole blocks, where that leaves no thin slice.
        let (unit, flat) = match groups {
            _ if groups > self.chunk => (self.chunk, 1.0),
            _ if groups > BLOCK => (BLOCK, FLAT),
            _ => (1, 1.0),
        };
        let half = groups / 2;
        let whole = half.next_multiple_of(unit);
        let half = if whole <= 2 * groups.saturating_sub(whole) { whole } else { half };
        let axis = self.longest(cell, flat);
        let key = |place: &[i32; 3]| (place[axis], place[(axis + 1) % 3], place[(axis + 2) % 3]);
        let (left, next, _) = places.select_nth_unstable_by_key(half * self.members, key);
        let last = left.iter().map(|place| place[axis]).max().unwrap_or(next[axis]);
        // Half-way between the two.
        let border = ((i64::from(last) + i64::from(next[axis])) >> 1) as i32;
        let (mut low, mut high) = (cell, cell);
        (low[axis][1], high[axis][0]) = (border, border);
        let (left, right) = places.split_at_mut(half * self.members);
        self.split(left, low, mix(chance));
        self.split(right, high, mix(!chance));
    }

    /// The axis of a cell's longest side, with its height taken for so many times what it is.
    fn longest(&self, cell: Cell, flat: f64) -> usize {
        let side = |axis: usize| {
            let times = if axis == 1 { flat } else { 1.0 };
            times * self.extent[axis] * f64::from(cell[axis][1].abs_diff(cell[axis][0]))
        };
        (1..3).fold(0, |longest, axis| if side(axis) > side(longest) { axis } else { longest })
    }

    /// One group: the master first, the slaves around it.
    fn settle(&self, group: &mut [[i32; 3]], cell: Cell, chance: u64) {
        // The same whatever order halving left them in.
        group.sort_unstable();
        let middle: [f64; 3] = core::array::from_fn(|axis| {
            group.iter().map(|place| f64::from(place[axis])).sum::<f64>() / group.len() as f64
        });
        let off = |place: &[i32; 3]| self.length(|axis| f64::from(place[axis]) - middle[axis]);
        let apart = |master: usize| group.iter().enumerate().filter(move |(i, _)| *i != master);
        let lost = |master: usize| apart(master).filter(|(_, p)| !self.fits(&group[master], p)).count();
        // The fewest that do not fit, then the one nearest to the middle.
        let rank = |i: &usize| (lost(*i), off(&group[*i]));
        let by_rank = |a: &usize, b: &usize| {
            let (a, b) = (rank(a), rank(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        };
        let Some(master) = (0..group.len()).min_by(by_rank) else { return };
        group.swap(0, master);
        let Some((master, slaves)) = group.split_first_mut() else { return };
        for (number, slave) in (0..).zip(slaves) {
            if !self.fits(master, slave) {
                *slave = self.draw(master, cell, mix(chance ^ number)).unwrap_or(*slave);
            }
        }
    }

    /// Another place for a slave; None: there is none, or hardly any.
    fn draw(&self, master: &[i32; 3], cell: Cell, chance: u64) -> Option<[i32; 3]> {
        let around: Cell = core::array::from_fn(|axis| {
            // A cast saturates.
            let reach = (self.range[1] / self.extent[axis] * 4_294_967_296.0) as u32;
            [master[axis].saturating_sub_unsigned(reach), master[axis].saturating_add_unsigned(reach)]
        });
        let cells = [(cell, DRAWS[0]), (around, DRAWS[1])];
        let mut tries =
            cells.into_iter().flat_map(|(cell, draws)| (0..draws).map(move |number| (cell, number)));
        tries.find_map(|(cell, number)| {
            let (first, second) = (mix(chance ^ number << 1), mix(chance ^ number << 1 ^ 1));
            let words = [first as u32, (first >> 32) as u32, second as u32];
            let place: [i32; 3] = core::array::from_fn(|axis| {
                let [low, high] = cell[axis];
                let side = u64::from(high.abs_diff(low));
                low.saturating_add_unsigned(((side * u64::from(words[axis])) >> 32) as u32)
            });
            self.fits(master, &place).then_some(place)
        })
    }

    /// Whether a slave may be there.
    fn fits(&self, master: &[i32; 3], slave: &[i32; 3]) -> bool {
        let apart = self.length(|axis| f64::from(slave[axis]) - f64::from(master[axis]));
        let [least, most] = self.range;
        apart >= least * (1.0 + KEEP) && apart <= most * (1.0 - KEEP)
    }

    /// Of a way in 2⁻³² of the extent [m].
    fn length(&self, way: impl Fn(usize) -> f64) -> f64 {
        (0..3).map(|axis| (way(axis) * self.extent[axis] / 4_294_967_296.0).powi(2)).sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed;

    #[test]
    fn groups_are_the_same_whatever_order_their_places_came_in() {
        let groups = Groups { extent: [3.0, 1.0, 2.0], members: 4, chunk: 16, range: [0.02, 0.4], seed: 1 };
        let mut places: Vec<[i32; 3]> = (0..999).map(|i| seed::place(5, i)).collect();
        let mut other: Vec<[i32; 3]> = places.iter().rev().copied().collect();
        groups.form(&mut places);
        groups.form(&mut other);
        assert_eq!(places, other);
    }

    #[test]
    fn chunks_are_compact_and_the_last_group_may_lack_slaves() {
        let groups = Groups { extent: [8.0, 1.0, 1.0], members: 4, chunk: 16, range: [0.0, 9.0], seed: 1 };
        let mut places: Vec<[i32; 3]> = (0..64 * 8 - 3).map(|i| seed::place(5, i)).collect();
        groups.form(&mut places);
        for chunk in places.chunks(64) {
            let [low, high] = [chunk.iter().map(|p| p[0]).min(), chunk.iter().map(|p| p[0]).max()];
            let length = high.zip(low).map_or(0, |(high, low)| high.abs_diff(low));
            assert!(f64::from(length) / 4_294_967_296.0 * 8.0 < 1.5, "{length}");
        }
    }
}
