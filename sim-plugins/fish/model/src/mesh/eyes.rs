//! Eyes: low domes on both sides of the head, a dark pupil in an iris.

use core::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;
use reef_flow::math::cos_sin_f64;

use super::{Draft, PLAIN, Patch, Surface};
use crate::{look::Look, paint::IRIS};

/// Where around the body they are: a share of a turn from the back.
const TURN: f64 = 0.19;
/// Radius of the pupil over the eye's.
const PUPIL: f64 = 0.6;
/// How far a dome stands out over its radius, and how deep its middle is in the skin.
const DOME: f64 = 0.7;
const SUNK: f64 = 0.35;
/// sRGB.
const BLACK: u32 = 0xff0a_0808;

impl Draft<'_> {
    /// Both eyes; how far they stray from their surfaces [m].
    pub(super) fn eyes(&mut self, look: &Look, size: [u32; 2]) -> f64 {
        if look.eye <= 0.0 || size[0] == 0 {
            return 0.0;
        }
        let outline = self.outline;
        let radius = 0.5 * look.eye * outline.length;
        let mut strays: f64 = 0.0;
        for (turn, side) in [(TURN, 1.0), (1.0 - TURN, -1.0)] {
            let place = outline.skin(look.eye_at, turn);
            let ahead = outline.skin(look.eye_at - 0.01, turn) - place;
            let out =
                ahead.cross(outline.skin(look.eye_at, turn + 0.01) - place).normalize_or(DVec3::Z * side);
            let out = if out.z * side < 0.0 { -out } else { out };
            let (front, top) = (ahead.normalize_or(DVec3::X), out.cross(ahead).normalize_or(DVec3::Y));
            let middle = place - out * (SUNK * DOME * radius);
            let dome = |share: f64, b: f64| {
                let (cos, sin) = cos_sin_f64(share * FRAC_PI_2);
                let (x, y) = cos_sin_f64(TAU * b);
                middle + out * (DOME * radius * cos) + (front * x + top * y) * (radius * sin)
            };
            let pupil = |a: f64, b: f64| dome(PUPIL * a, b);
            let iris = |a: f64, b: f64| dome(PUPIL + (1.0 - PUPIL) * a, b);
            let parts: [(Surface<'_>, u32); 2] = [(&pupil, BLACK), (&iris, PLAIN)];
            for (at, color) in parts {
                let patch = Patch {
                    at,
                    uv: &|_, _| [IRIS, 0.5],
                    thickness: &|_, _| 2.0 * radius,
                    root: Some(place.x),
                    color,
                };
                strays = strays.max(self.patch(&patch, size));
            }
        }
        strays
    }
}
