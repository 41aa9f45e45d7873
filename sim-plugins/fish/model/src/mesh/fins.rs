//! Fins: thin sheets on the ridge and beside the body. Each is there twice, back to back: a mesh that is lit
//! from both sides would be lit from behind at the body's outline.

use glam::DVec3;

use super::{Draft, PLAIN, Patch, Surface};
use crate::{
    look::{Fin, Look},
    paint::{FIN_EDGE, FIN_ROOT},
    species::Species,
};

/// Thickness of a fin at its root and at its edge, as shares of the fish's length.
const THICKNESS: [f64; 2] = [0.012, 0.002];
/// How deep roots stand in the skin, as a share of its height there.
const SUNK: f64 = 0.12;
/// Where on the sides pectoral fins begin, as a share of the height: a little below the middle; and pelvic
/// ones.
const PECTORAL: f64 = -0.25;
const PELVIC: f64 = -0.86;
/// How far the end of a paired fin is off the skin at most, as a share of its length.
const LIES: f64 = 0.5;
/// How straight the tail fin's upper and lower edges are: so straight that the springs to its corners stay
/// within.
const STRAIGHT: f64 = 0.9;
/// How much wider than its root a paired fin is at its end, as a share of its length.
const FAN: f64 = 0.9;

/// How far out a fin reaches along its root: round, highest at its peak.
fn rise(fin: &Fin, share: f64) -> f64 {
    let q = if share < fin.peak { share / fin.peak } else { (1.0 - share) / (1.0 - fin.peak) };
    let q = q.clamp(0.0, 1.0);
    (q * (2.0 - q)).sqrt()
}

/// u on the picture of a share of the way from a fin's root to its edge.
fn across(share: f64) -> f64 {
    FIN_ROOT + (FIN_EDGE - FIN_ROOT) * share.clamp(0.0, 1.0)
}

impl Draft<'_> {
    /// All fins; how far they stray from their surfaces [m].
    pub(super) fn fins(&mut self, species: &Species, size: [u32; 2]) -> f64 {
        let Look { dorsal, anal, pectoral, pelvic, fork, .. } = &species.look;
        if size[0] == 0 {
            // What is left out strays by as far as it stands off the skin: paired fins lie back.
            let ridge = dorsal.height.max(anal.height);
            let most = ridge.max(LIES * pectoral.height.max(pelvic.height)) * self.outline.length;
            return self.tail(species, *fork, [2, 1]).max(most);
        }
        let tail = size.map(|count| 2 * count);
        let mut strays: f64 = 0.0;
        for (fin, side) in [(dorsal, 1.0), (anal, -1.0)] {
            strays = strays.max(self.ridge(fin, side, size));
        }
        for side in [1.0, -1.0] {
            strays = strays.max(self.paired(pectoral, [PECTORAL, 0.93, -0.25, 0.55], side, size));
            strays = strays.max(self.paired(pelvic, [PELVIC, 0.4, -0.7, 0.3], side, size));
        }
        strays.max(self.tail(species, *fork, tail))
    }

    fn sheet(
        &mut self,
        root: Option<f64>,
        at: Surface<'_>,
        uv: &dyn Fn(f64, f64) -> [f64; 2],
        size: [u32; 2],
    ) -> f64 {
        let length = self.outline.length;
        let [thick, thin] = THICKNESS.map(|share| share * length);
        let thickness = |_: f64, b: f64| thick + (thin - thick) * b;
        let back = |a: f64, b: f64| at(1.0 - a, b);
        let back_uv = |a: f64, b: f64| uv(1.0 - a, b);
        self.patch(&Patch { at: &back, uv: &back_uv, thickness: &thickness, root, color: PLAIN }, size);
        self.patch(&Patch { at, uv, thickness: &thickness, root, color: PLAIN }, size)
    }

    /// A fin on the back (side 1) or below (−1).
    fn ridge(&mut self, fin: &Fin, side: f64, size: [u32; 2]) -> f64 {
        if fin.height <= 0.0 {
            return 0.0;
        }
        let outline = self.outline;
        let along = |a: f64| fin.from + (fin.to - fin.from) * a;
        let at = |a: f64, b: f64| {
            let v = along(a);
            let [height, _] = outline.extent(v);
            let out = fin.height * outline.length * rise(fin, a) * b;
            DVec3::new(outline.x(v) - fin.sweep * out, side * (height * (1.0 - SUNK) + out), 0.0)
        };
        let uv = |a: f64, b: f64| [across(b), along(a)];
        self.sheet(None, &at, &uv, size)
    }

    /// A fin beside the body, on the right (side 1) or on the left (−1): where on the skin it stands, as
    /// shares of height and width, and how far it turns down and out.
    fn paired(&mut self, fin: &Fin, [up, wide, down, out]: [f64; 4], side: f64, size: [u32; 2]) -> f64 {
        if fin.height <= 0.0 {
            return 0.0;
        }
        let outline = self.outline;
        let reach = fin.height * outline.length;
        // Back, down and out; a sweep of 1 lies back as far as it stands out.
        let way = DVec3::new(-0.5 - fin.sweep, down, side * out).normalize();
        let at = |a: f64, b: f64| {
            let v = fin.from + (fin.to - fin.from) * a;
            let [height, width] = outline.extent(v);
            let root = DVec3::new(outline.x(v), up * height, side * wide * width);
            let open = DVec3::new(0.0, FAN * reach * (0.5 - a) * b, 0.0);
            root + way * (reach * b * (0.7 + 0.3 * rise(fin, a))) + open
        };
        let v = 0.5 * (fin.from + fin.to);
        let uv = |_: f64, b: f64| [across(b), v];
        self.sheet(Some(outline.x(v)), &at, &uv, size)
    }

    /// The tail fin, upright or level.
    fn tail(&mut self, species: &Species, fork: f64, size: [u32; 2]) -> f64 {
        let outline = self.outline;
        let (span, level) = (species.body.half_span, species.body.level_fin);
        let root = outline.last() + 0.15 * (outline.end - outline.last());
        let [height, width] = outline.extent(root);
        let stalk = if level { width } else { height } * (1.0 - SUNK);
        let at = |a: f64, b: f64| {
            let across = 2.0 * a - 1.0;
            // The rays of the middle are shorter, or longer.
            let edge = 1.0 - fork * (1.0 - root) * (1.0 - across * across);
            let v = root + (edge - root) * b;
            let half = stalk + (span - stalk) * b * (STRAIGHT + (1.0 - STRAIGHT) * b);
            let x = outline.x(v);
            if level { DVec3::new(x, 0.0, across * half) } else { DVec3::new(x, across * half, 0.0) }
        };
        let uv = |a: f64, b: f64| {
            let v = (root + (1.0 - root) * b).min(1.0);
            [across((2.0 * a - 1.0).abs() * 0.8), v]
        };
        self.sheet(None, &at, &uv, size)
    }
}
