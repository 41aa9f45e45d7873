//! A coarse count of where a box's centres are: it says where some are missing.

use crate::seed::mix;

/// Cells along the longest side at most, as a power of two.
const BITS: u32 = 3;
/// Centres of a cell at least, in the mean: with fewer, chance would look like a lack.
const FEWEST: u64 = 200;
/// Centres that are counted, about: of more, one in so many tells enough.
const SAMPLE: u64 = 16_384;

/// A coarse count of a box's centres.
#[derive(Clone, Debug, Default)]
pub struct Census {
    bits: [u32; 3],
    counts: Vec<u32>,
    total: u64,
    taken: bool,
    /// One in so many centres is counted.
    stride: usize,
}

impl Census {
    /// For a box of an extent [m] and its number of centres: cells about as wide as high and deep, none too small.
    pub fn new(extent: [f64; 3], count: u64) -> Self {
        let stride = (count / SAMPLE).max(1);
        let count = count / stride;
        let greatest = extent.into_iter().fold(0.0, f64::max);
        let cut = |longest: u32| {
            extent.map(|e| {
                // The power of two nearest to each side's share of the longest, from below.
                let fits = |b: &u32| e * 1.5 * f64::from(1 << (longest - b)) >= greatest;
                (0..=longest).rev().find(fits).unwrap_or(0)
            })
        };
        let few = |bits: &[u32; 3]| FEWEST << bits.iter().sum::<u32>() <= count;
        let bits = (0..=BITS).rev().map(cut).find(few).unwrap_or([0; 3]);
        Self {
            bits,
            counts: vec![0; 1 << bits.iter().sum::<u32>()],
            total: 0,
            taken: false,
            stride: stride as usize,
        }
    }

    /// One in so many centres is counted.
    pub fn stride(&self) -> usize {
        self.stride.max(1)
    }

    /// Forgets the count of the step before.
    pub fn forget(&mut self) {
        self.taken = false;
    }

    /// Whether this step's count was taken.
    pub fn is_taken(&self) -> bool {
        self.taken
    }

    /// Begins a count.
    pub fn begin(&mut self) {
        self.counts.fill(0);
        self.total = 0;
        self.taken = true;
    }

    /// Counts a centre.
    pub fn add(&mut self, place: [i32; 3]) {
        let cell = self.cell(place);
        self.counts[cell] += 1;
        self.total += 1;
    }

    fn cell(&self, place: [i32; 3]) -> usize {
        (0..3).rev().fold(0, |cell, axis| {
            let offset = (place[axis] as u32) ^ 0x8000_0000;
            let along = u64::from(offset) >> (32 - self.bits[axis]);
            (cell << self.bits[axis]) | along as usize
        })
    }

    /// Takes a centre out that is counted at `from`, and draws a cell for it by the square of what each lacks. `chance`: a
    /// hash.
    pub fn draw(&mut self, from: [i32; 3], chance: u64) -> usize {
        // Where all are counted, those count who were placed anew before.
        let counted = u32::from(self.stride <= 1);
        let left = self.cell(from);
        self.counts[left] = self.counts[left].saturating_sub(counted);
        let cells = self.counts.len() as u64;
        let total = self.total;
        // At most (4e6)² in each of 512 cells.
        let lack = |count: u32| total.saturating_sub(u64::from(count) * cells).pow(2);
        let lacking: u64 = self.counts.iter().map(|count| lack(*count)).sum();
        let mut cell = (chance % cells) as usize;
        if lacking > 0 {
            let mut rest = mix(chance) % lacking;
            let here = self.counts.iter().position(|count| {
                let own = lack(*count);
                let here = rest < own;
                rest = rest.saturating_sub(own);
                here
            });
            cell = here.unwrap_or(cell);
        }
        self.counts[cell] += counted;
        cell
    }

    /// A place in a cell by chance.
    pub fn within(&self, cell: usize, chance: u64) -> [i32; 3] {
        let (first, second) = (mix(chance ^ 0x7265), mix(chance ^ 0x6574));
        let within = [first as u32, (first >> 32) as u32, second as u32];
        let mut rest = cell;
        core::array::from_fn(|axis| {
            let bits = self.bits[axis];
            let along = rest & ((1 << bits) - 1);
            rest >>= bits;
            let offset = ((along as u64) << (32 - bits)) | u64::from(within[axis]) >> bits;
            (offset as u32 ^ 0x8000_0000) as i32
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_about_as_wide_as_high_and_a_place_is_in_its_own() {
        assert_eq!(Census::new([10.0, 1.0, 10.0], 16_000).bits, [3, 0, 3]);
        assert_eq!(Census::new([10.0, 1.0, 10.0], 4_000).bits, [2, 0, 2]);
        assert_eq!(Census::new([4.0, 4.0, 4.0], 1_000_000).bits, [2, 2, 2]);
        assert_eq!(Census::new([4.0, 4.0, 4.0], 10).bits, [0, 0, 0]);
        let mut census = Census::new([8.0, 2.0, 4.0], 16_000);
        assert_eq!(census.bits, [3, 1, 2]);
        census.begin();
        // All in one corner: whoever is placed anew comes somewhere else.
        (0..64).for_each(|_| census.add([i32::MIN; 3]));
        for chance in 0..63 {
            let cell = census.draw([i32::MIN; 3], mix(chance));
            assert_ne!(cell, 0);
            assert_eq!(census.cell(census.within(cell, chance)), cell);
        }
        assert!(census.counts.iter().all(|count| *count == 1), "{:?}", census.counts);
    }
}
