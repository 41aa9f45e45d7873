//! Scalar functions that give the same bytes on every machine, and the hash behind all small differences.

use glam::DVec2;

/// e to the power of `x`, through glam's libm: std's depends on the system.
pub fn exp(x: f64) -> f64 {
    DVec2::new(x, 0.0).exp().x
}

/// `base` to the power of `exponent`, for a base above zero, through glam's libm.
pub fn pow(base: f64, exponent: f64) -> f64 {
    DVec2::new(base, 1.0).powf(exponent).x
}

/// (sine, cosine) of an angle [rad].
pub fn sin_cos(angle: f64) -> (f64, f64) {
    let v = DVec2::from_angle(angle);
    (v.y, v.x)
}

/// Angle [rad] between 0 and π of the point (x, y), y ≥ 0.
pub fn atan2(y: f64, x: f64) -> f64 {
    DVec2::new(x, y).to_angle()
}

/// Share of the way to its target that a quantity goes in one step: 1 − exp(−dt/τ); all of it for τ = 0 (the
/// paper's jump), none of it for dt = 0.
pub fn relaxation(dt: f64, tau: f64) -> f64 {
    if dt <= 0.0 {
        0.0
    } else if tau <= 0.0 {
        1.0
    } else {
        1.0 - exp(-dt / tau)
    }
}

/// A well mixed 64-bit hash of a 64-bit number (the finaliser of SplitMix64).
pub fn mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relaxation_is_the_papers_jump_without_a_time_constant() {
        assert_eq!(relaxation(1.0 / 60.0, 0.0), 1.0);
        assert_eq!(relaxation(0.0, 0.3), 0.0);
        // 1 − 1/e after one time constant; libm's exp is within one unit in the last place.
        assert!((relaxation(0.3, 0.3) - 0.632_120_558_828_557_7).abs() < 1e-15);
    }

    #[test]
    fn random_streams_depend_on_seed_and_purpose_only() {
        let draw = |seed, purpose| Random::new(seed, purpose).bits();
        assert_eq!(draw(1, 2), draw(1, 2));
        assert_ne!(draw(1, 2), draw(1, 3));
        assert_ne!(draw(1, 2), draw(2, 2));
        let mut random = Random::new(7, 7);
        assert!((0..1000).all(|_| (0.0..1.0).contains(&random.unit())));
    }
}
