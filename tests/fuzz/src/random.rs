//! Choices at random.

use reef_flow::random::Random;

/// What a stream of random numbers chooses.
pub trait Choose {
    /// A number below `count`; 0 where that is 0.
    fn below(&mut self, count: usize) -> usize;

    /// One of these.
    fn one<'a, T>(&mut self, of: &'a [T]) -> Option<&'a T> {
        of.get(self.below(of.len()))
    }
}

impl Choose for Random {
    fn below(&mut self, count: usize) -> usize {
        (self.bits() % count.max(1) as u64) as usize
    }
}

/// The numbers of a seed.
pub fn seeded(seed: u64) -> Random {
    Random::new(seed, 0)
}
