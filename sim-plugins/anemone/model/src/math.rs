//! Scalar functions that give the same bytes on every machine.

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
}
