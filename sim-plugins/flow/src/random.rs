//! Chance that depends on a seed alone: the hash behind all small differences.

/// A well mixed 64-bit hash of a 64-bit number (the finaliser of SplitMix64).
pub fn mix(value: u64) -> u64 {
    let z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A stream of numbers that depends on its seed alone (SplitMix64).
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// A stream for `seed`; `purpose` keeps streams apart that share a seed.
    pub fn new(seed: u64, purpose: u64) -> Self {
        Self(mix(seed ^ mix(purpose)))
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    /// Even between 0 and 1, 1 left out.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Even between −1 and 1.
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Even between two bounds.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// Places that fill a box evenly, one after the other, for a seed: steps by powers of the root of x⁴ = x + 1
/// (M. Roberts 2018).
#[derive(Clone, Copy, Debug)]
pub struct Even([f64; 3]);

impl Even {
    const STEPS: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_4];
    /// Share of a box along each side in which there is none.
    const MARGIN: f64 = 0.1;

    /// The places of a seed.
    pub fn new(seed: u64) -> Self {
        let mut random = Random::new(seed, 0);
        Self([(); 3].map(|()| random.unit()))
    }

    /// The place with a number, in a box between two corners.
    pub fn place(&self, number: u32, low: [f64; 3], high: [f64; 3]) -> [f64; 3] {
        core::array::from_fn(|axis| {
            let share = (self.0[axis] + Self::STEPS[axis] * f64::from(number)).fract();
            let (low, extent) = (low[axis], high[axis] - low[axis]);
            let inner = extent * Self::MARGIN;
            low + inner + (extent - 2.0 * inner) * share
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_streams_depend_on_seed_and_purpose_only() {
        let draw = |seed, purpose| Random::new(seed, purpose).bits();
        assert_eq!(draw(1, 2), draw(1, 2));
        assert_ne!(draw(1, 2), draw(1, 3));
        assert_ne!(draw(1, 2), draw(2, 2));
        let mut random = Random::new(7, 7);
        assert!((0..1000).all(|_| (0.0..1.0).contains(&random.unit())));
    }

    #[test]
    fn even_places_fill_their_box_but_for_its_margin() {
        let even = Even::new(3);
        let places: Vec<[f64; 3]> =
            (0..512).map(|i| even.place(i, [-1.0, 0.0, 5.0], [1.0, 10.0, 6.0])).collect();
        for (axis, low, extent) in [(0, -1.0, 2.0), (1, 0.0, 10.0), (2, 5.0, 1.0)] {
            let mut counts = [0; 8];
            for place in &places {
                let share = (place[axis] - low) / extent;
                assert!((0.1..=0.9).contains(&share), "{place:?}");
                counts[((share - 0.1) / 0.8 * 8.0).min(7.0) as usize] += 1;
            }
            assert!(counts.iter().all(|count| (56..=72).contains(count)), "{counts:?}");
        }
    }
}
