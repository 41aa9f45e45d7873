//! The dispersion relation of linear waves: ω² = g k tanh(k h).

use glam::DVec2;

use super::GRAVITY;

/// ω [rad/s] of a wave number k [rad/m] over the depth h [m].
pub fn frequency(wave_number: f64, depth: f64) -> f64 {
    (GRAVITY * wave_number * tanh(wave_number * depth)).sqrt()
}

/// k [rad/m] of a frequency ω [rad/s] over the depth h [m], to 1e-12 of itself. 0 where ω or h is not above
/// 0.
///
/// Newton's iteration from Eckart's (1952) estimate k = (ω²/g) / √tanh(ω² h / g), which errs by 5 % at most.
pub fn wave_number(frequency: f64, depth: f64) -> f64 {
    let deep = frequency * frequency / GRAVITY;
    if !(deep > 0.0 && depth > 0.0) {
        return 0.0;
    }
    let mut k = deep / tanh(deep * depth).sqrt();
    for _ in 0..12 {
        let t = tanh(k * depth);
        // k h (1 − t²) where k h is infinite: no current of the bed is left.
        let slope = if t < 1.0 { t + k * depth * (1.0 - t * t) } else { 1.0 };
        let change = (k * t - deep) / slope;
        k -= change;
        if change.abs() <= 1e-14 * k {
            break;
        }
    }
    k
}

/// tanh x for x ≥ 0, the same on every platform: from glam's exponential, which does not come from the
/// system.
pub fn tanh(x: f64) -> f64 {
    if x > 20.0 {
        return 1.0;
    }
    if x < 1e-3 {
        // The quotient below would lose digits; the next term is 17/315 x⁷.
        let x2 = x * x;
        return x * (1.0 - x2 * (1.0 / 3.0 - x2 * (2.0 / 15.0)));
    }
    let e = exp(-2.0 * x);
    (1.0 - e) / (1.0 + e)
}

/// eˣ, the same on every platform.
pub(super) fn exp(x: f64) -> f64 {
    DVec2::splat(x).exp().x
}

/// ln x, the same on every platform.
pub(super) fn ln(x: f64) -> f64 {
    DVec2::splat(x).ln().x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hyperbolic_tangent_is_that_of_the_system() {
        for i in 0..30_000 {
            let x = 1e-6 * 1.0006_f64.powi(i);
            assert!((tanh(x) / x.tanh() - 1.0).abs() < 1e-12, "{x}");
        }
        assert_eq!((tanh(0.0), tanh(f64::INFINITY)), (0.0, 1.0));
    }

    #[test]
    fn nothing_comes_of_nothing() {
        for (omega, depth) in [(0.0, 5.0), (1.0, 0.0), (1.0, -3.0), (f64::NAN, 5.0), (1.0, f64::NAN)] {
            assert_eq!(wave_number(omega, depth), 0.0, "{omega} {depth}");
        }
        assert_eq!(wave_number(2.0, f64::INFINITY), 4.0 / GRAVITY);
    }
}
