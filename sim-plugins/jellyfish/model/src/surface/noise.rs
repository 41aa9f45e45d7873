//! Perlin's noise (2002) over the bell, eq. (5): two cells from the apex to the margin, eight around, which
//! close to a ring, and time.

use reef_flow::random::mix;

/// Cells from the apex to the margin, and around the bell.
const ALONG: usize = 2;
pub(crate) const AROUND: usize = 8;
/// Time of one cell [s].
const CELL_TIME: f64 = 100.0;

/// The noise at one moment. Between two times the gradients' ramps blend to one ramp a lattice point:
/// value + across · x + around · y.
#[derive(Clone, Debug)]
pub(crate) struct Noise {
    seed: u64,
    ramps: [[[f32; 3]; AROUND]; ALONG + 1],
}

/// What is left of the noise on one ring: at each of the eight lines around it, value and slope around.
pub(crate) type RingNoise = [[f32; 2]; AROUND];

/// Perlin's blend: 0 to 1 with two derivatives 0 at both ends.
pub(crate) fn fade(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self { seed, ramps: [[[0.0; 3]; AROUND]; ALONG + 1] }
    }

    /// One of the twelve edges of a cube.
    fn gradient(&self, along: usize, around: usize, time: i64) -> [f64; 3] {
        let place = mix(time.cast_unsigned()) ^ (along * AROUND + around) as u64;
        let chance = mix(self.seed ^ mix(place));
        let [a, b] = [1_u64, 2].map(|bit| if chance & bit == 0 { 1.0 } else { -1.0 });
        match (chance >> 8) % 3 {
            0 => [a, b, 0.0],
            1 => [a, 0.0, b],
            _ => [0.0, a, b],
        }
    }

    /// Goes to a time [s].
    pub(crate) fn set_time(&mut self, time: f64) {
        let place = time / CELL_TIME;
        let whole = place.floor();
        let t = place - whole;
        let share = fade(t);
        for along in 0..=ALONG {
            for around in 0..AROUND {
                let old = self.gradient(along, around, whole as i64);
                let new = self.gradient(along, around, whole as i64 + 1);
                let blend = |old: f64, new: f64| (old + share * (new - old)) as f32;
                let value = blend(old[2] * t, new[2] * (t - 1.0));
                self.ramps[along][around] = [value, blend(old[0], new[0]), blend(old[1], new[1])];
            }
        }
    }

    /// On the ring at a share of the way from the apex (0) to the margin (1).
    pub(crate) fn ring(&self, share: f32) -> RingNoise {
        let place = share * ALONG as f32;
        let cell = (place as usize).min(ALONG - 1);
        let x = place - cell as f32;
        let f = fade(f64::from(x)) as f32;
        core::array::from_fn(|around| {
            let [low, high] = [self.ramps[cell][around], self.ramps[cell + 1][around]];
            let (a, b) = (low[0] + low[1] * x, high[0] + high[1] * (x - 1.0));
            [a + f * (b - a), low[2] + f * (high[2] - low[2])]
        })
    }
}
