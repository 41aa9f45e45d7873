//! Round limbs: stipes, gas bladders, and the claw that holds a plant to the ground.

use core::f64::consts::{PI, TAU};

use glam::DVec3;
use reef_flow::{math::cos_sin_f64, waves::GRAVITY};

use super::{Draft, Tissue, Waves, quads, spine::Spine};
use crate::grow::{Limb, Part};

/// What a cubic metre of sea water weighs [N/m³].
const WATER_WEIGHT: f64 = 1025.0 * GRAVITY;

/// Length of a bladder over its thickness.
const SLENDER: f64 = 2.2;
/// Of a bladder's wall [m]: light shines through.
const WALL: f64 = 0.002;

/// Where on a blade's picture what is round has its colours: beside midrib and edges.
pub(crate) const ROUND: f64 = 0.3;

/// A row of a tube: where, its way up, radius, and the radius's slope along the way up.
#[derive(Clone, Copy, Debug)]
struct Ring {
    along: f64,
    /// Moved off the middle line [m].
    off: DVec3,
    radius: f64,
    slope: f64,
    v: f64,
}

impl Draft<'_> {
    /// A stipe that grows thinner toward its end.
    pub(super) fn stipe(&mut self, number: usize, spine: &Spine, radius: f64) {
        let limb = &self.limbs[number];
        let rows = (2.0 * limb.segments.len() as f64 * self.fine.along).round().max(2.0) as u32;
        let blade = limb.part == Part::Blade;
        let [start, end] = self.heights[number];
        let rings: Vec<Ring> = (0..=rows)
            .map(|row| {
                let t = f64::from(row) / f64::from(rows);
                let v = if blade { t } else { 0.5 * (start + (end - start) * t) };
                let taper = 1.0 - 0.65 * t;
                Ring { along: t * spine.length, off: DVec3::ZERO, radius: radius * taper, slope: 0.0, v }
            })
            .collect();
        let stem = if blade { 0.4 } else { 1.0 };
        self.tube(spine, &rings, self.fine.sides, 2.0 * radius, stem);
    }

    /// The gas bladders at a limb's base, whose lift is what the limb's is; returns where the sheet begins
    /// [m]. A blade has one, and grows out of its end; branches have them in pairs beside their middle.
    pub(super) fn bladders(&mut self, limb: &Limb, spine: &Spine, width: f64) -> f64 {
        if limb.bladder <= 0.0 {
            return 0.0;
        }
        let pair = limb.part == Part::Fork;
        let volume = limb.bladder / WATER_WEIGHT / if pair { 2.0 } else { 1.0 };
        let slender = if pair { 1.3 } else { SLENDER };
        let radius = glam::DVec2::splat(volume * 0.75 / (PI * slender)).powf(1.0 / 3.0).x;
        let half = (slender * radius).min(0.4 * spine.length);
        // A blade's stands on a short stalk.
        let stalk = if pair { 0.1 * spine.length } else { 0.5 * half };
        let sides: &[f64] = if pair { &[-1.0, 1.0] } else { &[0.0] };
        // Those of a pair are small.
        let [corners, rows] = self
            .fine
            .bladder
            .map(|count| if pair { count.saturating_sub(2).max(count.min(3)) } else { count });
        for side in sides.iter().filter(|_| corners > 0) {
            let off = spine.inside * (side * (0.25 * width + 0.55 * radius));
            let thin = radius * if pair { 0.05 } else { 0.18 };
            let mut rings = Vec::with_capacity(rows as usize + 2);
            if !pair {
                rings.push(Ring { along: 0.0, off, radius: thin, slope: 0.0, v: 0.0 });
            }
            for row in 0..=rows {
                let (cos, sin) = cos_sin_f64(PI * f64::from(row) / f64::from(rows));
                let along = stalk + half * (1.0 - cos);
                let slope = if sin > 0.05 { radius / half * cos / sin } else { 20.0 * cos };
                rings.push(Ring { along, off, radius: thin.max(radius * sin), slope, v: 0.12 });
            }
            self.tube(spine, &rings, corners, WALL, 0.25);
        }
        if pair { 0.0 } else { stalk + 1.9 * half }
    }

    /// Rings around a middle line. `stem`: share of the stem's colour.
    fn tube(&mut self, spine: &Spine, rings: &[Ring], sides: u32, thickness: f64, stem: f64) {
        let first = self.shape.vertices.len() as u32;
        for ring in rings {
            let spot = spine.at(ring.along);
            let x = (spine.across - spot.up * spot.up.dot(spine.across)).normalize_or(DVec3::X);
            let z = x.cross(spot.up);
            for side in 0..=sides {
                let share = f64::from(side) / f64::from(sides);
                let (cos, sin) = cos_sin_f64(TAU * share);
                let out = x * cos + z * sin;
                let tissue = Tissue {
                    normal: (out - spot.up * ring.slope).normalize_or(out),
                    uv: [ROUND, ring.v],
                    thickness,
                    color: self.palette.vertex(stem, 0.9),
                };
                self.vertex(spot.place + ring.off + out * ring.radius, &spot, &tissue);
            }
        }
        quads(&mut self.shape.indices, first, rings.len() as u32 - 1, sides);
    }

    /// The claw at the root: roots that spread over the ground.
    pub(super) fn holdfast(&mut self) {
        let radius = self.species.look.holdfast;
        let (roots, rows) = match self.fine.waves {
            Waves::All => (9, 4),
            Waves::Long => (9, 2),
            Waves::None => (9, 1),
        };
        if radius <= 0.0 || self.limbs.is_empty() {
            return;
        }
        let spine = Spine::new(self.skeleton, &self.rest, &self.limbs[0], false);
        let spot = spine.at(0.0);
        for root in 0..roots {
            let turn = TAU * f64::from(root) / f64::from(roots);
            // Some reach farther than others.
            let (cos, sin) = cos_sin_f64(turn + 0.35 * cos_sin_f64(7.1 * f64::from(root)).1);
            let reach = radius * (0.75 + 0.25 * cos_sin_f64(4.3 * f64::from(root)).0);
            let (out, aside) = (DVec3::new(cos, 0.0, sin), DVec3::new(-sin, 0.0, cos));
            let first = self.shape.vertices.len() as u32;
            for row in 0..=rows {
                let t = f64::from(row) / f64::from(rows);
                let place =
                    out * (reach * t) + DVec3::Y * (radius * (0.42 * (1.0 - t) * (1.0 - t) - 0.22 * t));
                let half = radius * 0.11 * (1.0 - 0.7 * t);
                let up = (DVec3::Y + out * 0.6).normalize();
                for side in [-1.0, 0.0, 1.0] {
                    let tissue = Tissue {
                        normal: (up + aside * (0.8 * side)).normalize(),
                        uv: [0.5 + 0.5 * side, 0.0],
                        thickness: 2.0 * half,
                        color: self.palette.vertex(1.0, 0.85),
                    };
                    let low = if side == 0.0 { 0.0 } else { -half };
                    self.vertex(place + aside * (half * side) + up * low, &spot, &tissue);
                }
            }
            quads(&mut self.shape.indices, first, rows, 2);
        }
    }
}
