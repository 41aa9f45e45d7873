//! What an animal does to the sea: its jet as a source below the aperture, its refill as a hole there, fitted
//! to the water of its own slice. No net water leaves a slice, so the fit misses nearly all of the speed
//! around ([`Fit::error`]); what is left is a weak pulse in the rhythm of the bell.

use glam::{DVec2, DVec3};
use reef_sdk::abi::{self, Flow};

use crate::{lanes::Real, slice::Slice};

/// Rings of places at which the fit looks, in widths of the bell, and places on each.
const RINGS: [f64; 3] = [0.6, 0.9, 1.3];
const PLACES: usize = 16;
/// How far the primitive reaches, in widths of the bell, and from which share on it fades.
const REACH: f64 = 6.0;
const FADE: f64 = 0.5;
/// What is weaker than this [m³/s] moves nobody.
const WEAKEST: f64 = 1e-9;

/// The primitive that is nearest to the slice's water.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Middle of the aperture, in the slice [m].
    pub place: DVec2,
    /// Φ [m³/s]: positive for the jet, negative for the refill.
    pub strength: f64,
    /// Distance at which the speed is half of what it would be without a core [m].
    pub core: f64,
    /// What the primitive misses of the water's speed around, as a share (root of mean squares).
    pub error: f64,
}

/// Least squares over places around the aperture: V ≈ Φ r / (|r| (core² + r²)).
pub fn fit<T: Real>(slice: &Slice<T>, core: f64) -> Fit {
    let mut chain = slice.chain();
    let (left, right) = (chain.next().unwrap_or_default(), chain.next_back().unwrap_or_default());
    let place = 0.5 * (left + right);
    let corner = slice.corner();
    let diameter = slice.build().diameter;
    let [mut own, mut both, mut all] = [0.0; 3];
    for ring in RINGS {
        for k in 0..PLACES {
            let (cos, sin) =
                reef_flow::math::cos_sin_f64(core::f64::consts::TAU * (k as f64 + 0.5) / PLACES as f64);
            let way = DVec2::new(cos, sin);
            let distance = ring * diameter;
            let velocity = DVec2::from(slice.water().velocity((place + way * distance - corner).to_array()));
            let shape = way / (core * core + distance * distance);
            own += shape.length_squared();
            both += shape.dot(velocity);
            all += velocity.length_squared();
        }
    }
    let strength = if own > 0.0 { both / own } else { 0.0 };
    let missed = (all - strength * both).max(0.0);
    Fit { place, strength, core, error: if all > 0.0 { (missed / all).sqrt() } else { 0.0 } }
}

/// As an element of the sea's flow, at a place of the world.
pub(super) fn flow(fit: &Fit, owner: u64, place: DVec3, diameter: f64) -> Flow {
    let strength = fit.strength.abs().max(WEAKEST);
    Flow {
        owner,
        kind: if fit.strength >= 0.0 { abi::FLOW_SOURCE } else { abi::FLOW_HOLE },
        position: place.to_array(),
        strength: strength as f32,
        peak: (strength / (fit.core * fit.core)) as f32,
        core: (0.2 * fit.core) as f32,
        reach: (REACH * diameter) as f32,
        fade: FADE as f32,
        ..Flow::default()
    }
}
