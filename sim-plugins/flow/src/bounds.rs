//! How much the water does at most, over a panel of a wall and around a source: what a draw by chance is held
//! against, so that a place is drawn exactly as often as water comes in there, however narrow a source is.
//!
//! Every bound holds at each point; rounding is covered by a small share more.

use core::f32::consts::PI;

use crate::packed::{Local, Packed, Varying, Whirlwind};

/// What rounding may add to a kernel's figures.
const SLACK: f32 = 1.0 + 1e-5;
/// Shells of a source at most.
pub const MOST_SHELLS: usize = 48;
/// Shells of the part where a source fades.
const FADING: u16 = 8;

/// A panel of a wall, or a box: its corners [m, relative to the packed form's origin].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// The least coordinates.
    pub low: [f32; 3],
    /// The greatest.
    pub high: [f32; 3],
}

impl Part {
    /// The squares of the distances of its nearest and its farthest point from a point [m²].
    fn squares(&self, center: [f32; 3]) -> [f32; 2] {
        let (mut near, mut far) = (0.0, 0.0);
        for ((low, high), center) in self.low.into_iter().zip(self.high).zip(center) {
            let (below, above) = (low - center, high - center);
            let beside = below.max(-above).max(0.0);
            let across = above.max(-below);
            near += beside * beside;
            far += across * across;
        }
        [near / SLACK, far * SLACK]
    }
}

/// A spherical shell around a source in which it makes water.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shell {
    /// Of the source [m].
    pub center: [f32; 3],
    /// Square of the inner radius [m²].
    pub inner2: f32,
    /// Square of the outer radius [m²].
    pub outer2: f32,
    /// The divergence in it is at most this over the distance from the centre [m/s].
    pub most: f32,
}

impl Shell {
    /// The integral of the bound over the shell [m³/s].
    pub fn mass(&self) -> f32 {
        2.0 * PI * self.most * (self.outer2 - self.inner2)
    }

    /// The bound of the divergence at a point; 0 outside of the shell [1/s].
    pub fn at(&self, [x, y, z]: [f32; 3]) -> f32 {
        let [dx, dy, dz] = [x - self.center[0], y - self.center[1], z - self.center[2]];
        let square = dx * dx + dy * dy + dz * dz;
        if square >= self.inner2 && square < self.outer2 { self.most / square.sqrt() } else { 0.0 }
    }

    /// The point of the shell that lies in a unit direction, for a `share` 0..1: equal shares have equal
    /// parts of [`Shell::mass`].
    pub fn point(&self, direction: [f32; 3], share: f32) -> [f32; 3] {
        let radius = (self.inner2 + share * (self.outer2 - self.inner2)).sqrt();
        core::array::from_fn(|i| self.center[i] + radius * direction[i])
    }
}

impl Packed {
    /// How fast water comes in at most, anywhere on a panel of a wall of the box `part`, beyond what leaves
    /// through the same place of the wall opposite [m/s]. `axis`: across the wall; `inward`: 1 at the low
    /// wall, −1 at the high one. Currents that travel have to [`fit`](Packed::fit) the box.
    pub fn most_entering(&self, panel: &Part, extent: [f32; 3], axis: usize, inward: f32) -> f32 {
        let mut opposite = *panel;
        let across = inward * extent[axis];
        opposite.low[axis] += across;
        opposite.high[axis] += across;
        let common = inward * self.base[axis];
        let (mut enters, mut more) = (common, 0.0);
        // What comes in here and goes out there is the same but for rounding.
        let mut same = common.abs();
        for field in &self.varying {
            let [most, change] = field.most(panel, extent, axis);
            enters += most;
            more += change;
            same += most;
        }
        more += same * (SLACK - 1.0);
        for source in &self.sources {
            let here = source.most_along(panel, axis, inward);
            enters += here;
            more += here + source.most_along(&opposite, axis, -inward);
        }
        for whirlwind in &self.whirlwinds {
            let here = whirlwind.most(panel);
            enters += here;
            more += here + whirlwind.most(&opposite);
        }
        if !self.shelters.is_empty() {
            // A shelter at one wall and none at the other: what is the same otherwise differs by what it
            // takes.
            let calmed: f32 = self.shelters.iter().map(|shelter| shelter.strength.abs()).sum();
            more = more.max(0.0) + same * calmed;
        }
        SLACK * enters.min(more).max(0.0)
    }

    /// Adds the shells around all sources in which they make water inside of a box, in the sources' order.
    pub fn shells(&self, part: &Part, shells: &mut Vec<Shell>) {
        for source in &self.sources {
            source.shells(part, shells);
        }
    }

    /// Sources and holes.
    pub fn source_count(&self) -> usize {
        self.sources.len()
    }
}

impl Varying {
    /// How fast it is at most across a panel, and by how much it differs at most at the opposite wall [m/s].
    fn most(&self, panel: &Part, extent: [f32; 3], axis: usize) -> [f32; 2] {
        let [low, high] = [panel.low[1], panel.high[1]].map(|y| self.height + self.gradient * y);
        let speed = self.velocity[axis].abs() * self.swing();
        let change = if axis == 1 { self.gradient.abs() * extent[1] } else { 0.0 };
        [speed * low.max(high).max(0.0), speed * change]
    }
}

impl Whirlwind {
    /// How fast it is at most anywhere in a part [m/s].
    fn most(&self, part: &Part) -> f32 {
        let [near, _] = part.squares(self.local.center);
        if near >= self.local.reach2 {
            0.0
        } else {
            self.local.strength.abs() / (self.local.softening + near)
        }
    }
}

impl Local {
    /// How fast a source or hole is at most along an axis times a sign, anywhere in a part [m/s]. Below 0
    /// where it flows the other way everywhere.
    fn most_along(&self, part: &Part, axis: usize, sign: f32) -> f32 {
        let [near, far] = part.squares(self.center);
        if near >= self.reach2 {
            return 0.0;
        }
        let way = sign.copysign(sign * self.strength);
        let [low, high] = [part.low[axis], part.high[axis]].map(|at| way * (at - self.center[axis]));
        let most = low.max(high);
        let over = |square: f32| (self.softening + square) * (square + self.core2).sqrt();
        if most > 0.0 {
            // Its speed along the axis is never more than the whole.
            self.strength.abs() * (most / over(near)).min(1.0 / (self.softening + near))
        } else if self.inv_shell == 0.0 {
            self.strength.abs() * most / over(far)
        } else {
            0.0
        }
    }

    /// See [`Packed::shells`].
    fn shells(&self, part: &Part, shells: &mut Vec<Shell>) {
        let [near, far] = part.squares(self.center);
        let end = far.min(self.reach2);
        let fading = self.inv_shell != 0.0;
        // A hole makes water only where it fades.
        if near >= end || (self.strength < 0.0 && !fading) {
            return;
        }
        let first = shells.len();
        let width = if fading { 1.0 / self.inv_shell } else { 0.0 };
        let start = if fading { (self.reach2 - width).max(0.0) } else { end };
        let mut inner2 = near;
        let mut border = (self.softening + self.core2) / 16.0;
        // Twice the square at each: the bound is at most a few times what it bounds.
        while inner2 < start.min(end) && shells.len() - first < MOST_SHELLS - usize::from(FADING) - 1 {
            while border <= inner2 * SLACK {
                border *= 2.0;
            }
            let outer2 = border.min(start).min(end);
            self.shell(inner2, outer2, shells);
            inner2 = outer2;
        }
        if inner2 < start.min(end) {
            self.shell(inner2, start.min(end), shells);
            inner2 = start.min(end);
        }
        for number in 1..=FADING {
            let outer2 = (start + width * f32::from(number) / f32::from(FADING)).min(end);
            if outer2 > inner2 {
                self.shell(inner2, outer2, shells);
                inner2 = outer2;
            }
        }
    }

    /// r (3 s + 2 q s′), q = r², is at most Φ (3 − 2q/(|Φ|/Φ_max + q) − q/(q + core²)) / (|Φ|/Φ_max + q)
    /// times what is left of it by fading, which takes from a source and gives to a hole.
    fn shell(&self, inner2: f32, outer2: f32, shells: &mut Vec<Shell>) {
        let strength = self.strength.abs();
        let soft = self.softening + inner2;
        let outer = outer2.sqrt();
        let u = |square: f32| ((self.reach2 - square) * self.inv_shell).clamp(0.0, 1.0);
        let fading = self.inv_shell != 0.0;
        let [u0, u1] = if fading { [u(inner2), u(outer2)] } else { [1.0; 2] };
        let most = if self.strength > 0.0 {
            let shares = 3.0 - 2.0 * inner2 / soft - inner2 / (inner2 + self.core2);
            // Digits cancel far out.
            let shares = shares.max(0.0) + 3e-7;
            let fade = u0 * u0 * (3.0 - 2.0 * u0);
            strength * fade * outer / (outer2 + self.core2).sqrt() / soft * shares
        } else {
            let steepest = if u1 <= 0.5 && u0 >= 0.5 { 0.25 } else { (u0 * (1.0 - u0)).max(u1 * (1.0 - u1)) };
            let fade = 6.0 * self.inv_shell * strength * steepest;
            2.0 * outer2 * outer * fade / (soft * (inner2 + self.core2).sqrt())
        };
        if most > 0.0 && most.is_finite() {
            shells.push(Shell { center: self.center, inner2, outer2, most: SLACK * most });
        }
    }
}

#[cfg(test)]
mod tests {
    use reef_abi::{self as abi, Flow};

    use super::*;
    use crate::{
        Level,
        sample::{Points, Velocities, divergence, sample},
    };

    const EXTENT: [f32; 3] = [6.0, 2.0, 5.0];
    /// Points of a shell.
    const DRAWS: usize = 400;

    fn whole() -> Part {
        Part { low: EXTENT.map(|e| -0.5 * e), high: EXTENT.map(|e| 0.5 * e) }
    }

    /// A number 0..1, another one each time.
    fn random(state: &mut u64) -> f32 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 40) as f32 / 16_777_216.0
    }

    fn seas() -> Vec<Vec<Flow>> {
        let local = |kind, position: [f64; 3], strength, peak, reach, fade| Flow {
            kind,
            position,
            axis: [0.0, 0.8, 0.6],
            strength,
            peak,
            core: 0.05,
            reach,
            fade,
            ..Flow::default()
        };
        let (source, hole, eddy) = (abi::FLOW_SOURCE, abi::FLOW_HOLE, abi::FLOW_WHIRLWIND);
        let surge = Flow {
            kind: abi::FLOW_DIRECTIONAL,
            axis: [0.9, 0.1, 0.3],
            strength: 0.3,
            modulation: 0.8,
            wave_vector: [0.7, 0.2, 0.1],
            gradient: 0.2,
            ..Flow::default()
        };
        let shelter = Flow { kind: abi::FLOW_SHELTER, strength: 0.7, reach: 2.0, ..Flow::default() };
        vec![
            vec![local(source, [-1.0, 0.2, 0.5], 0.02, 0.2, 0.0, 0.0), surge],
            vec![
                local(hole, [2.7, 0.0, 2.0], 0.3, 0.3, 1.5, 0.4),
                local(source, [2.6, 0.0, 0.0], 0.05, 2.0, 1.0, 0.0),
            ],
            vec![
                local(source, [4.5, 0.0, 0.0], 0.4, 0.3, 0.0, 0.0),
                local(eddy, [2.9, 0.5, 0.0], 0.2, 0.4, 0.0, 0.0),
            ],
            vec![
                surge,
                shelter,
                local(hole, [0.0, 1.1, 0.0], 0.2, 0.5, 0.0, 0.0),
                local(eddy, [0.0; 3], 0.1, 0.4, 2.5, 0.5),
            ],
        ]
    }

    fn packed(sea: &[Flow]) -> Packed {
        let mut packed = Packed::new();
        packed.fill(sea, [0.0; 3], 0);
        packed.fit(EXTENT.map(f64::from));
        packed
    }

    fn velocity(packed: &Packed, p: [f32; 3]) -> [f32; 3] {
        let mut v = [[0.0]; 3];
        let [x, y, z] = &mut v;
        let points = Points { x: &[p[0]], y: &[p[1]], z: &[p[2]] };
        sample(Level::best(), packed, points, Velocities { x, y, z });
        v.map(|v| v[0])
    }

    #[test]
    fn no_water_comes_in_faster_than_its_bound_and_none_is_far_below() {
        let mut state = 1;
        let (mut tight, mut panels) = (0, 0);
        for sea in seas() {
            let packed = packed(&sea);
            for number in 0..600 {
                let (axis, inward) = (number % 3, if number % 2 == 0 { 1.0 } else { -1.0 });
                let mut panel = whole();
                for ((low, high), extent) in panel.low.iter_mut().zip(&mut panel.high).zip(EXTENT) {
                    *low = -0.5 * extent + extent * 0.75 * random(&mut state);
                    *high = *low + 0.25 * extent;
                }
                let wall = -inward * 0.5 * EXTENT[axis];
                (panel.low[axis], panel.high[axis]) = (wall, wall);
                let most = packed.most_entering(&panel, EXTENT, axis, inward);
                let mut greatest: f32 = 0.0;
                for _ in 0..60 {
                    let p: [f32; 3] = core::array::from_fn(|i| {
                        panel.low[i] + random(&mut state) * (panel.high[i] - panel.low[i])
                    });
                    let mut other = p;
                    other[axis] = -other[axis];
                    let (enters, leaves) =
                        (inward * velocity(&packed, p)[axis], inward * velocity(&packed, other)[axis]);
                    greatest = greatest.max((enters.max(0.0) - leaves.max(0.0)).max(0.0));
                }
                assert!(greatest <= most, "{greatest} of {most} at {panel:?}");
                panels += usize::from(greatest > 0.0);
                tight += usize::from(greatest > 0.1 * most);
            }
        }
        assert!(panels > 300 && 2 * tight > panels, "{tight} of {panels}");
    }

    #[test]
    fn no_source_makes_more_than_its_shells_say_and_a_draw_from_them_finds_it() {
        let mut state = 7;
        for sea in seas() {
            let packed = packed(&sea);
            let mut shells = Vec::new();
            packed.shells(&whole(), &mut shells);
            assert!(shells.len() <= MOST_SHELLS * packed.source_count());
            let check = |p: [f32; 3]| {
                let mut made = [0.0];
                divergence(Level::best(), &packed, Points { x: &[p[0]], y: &[p[1]], z: &[p[2]] }, &mut made);
                let most: f32 = shells.iter().map(|shell| shell.at(p)).sum();
                assert!(made[0] <= most * 1.001 + 1e-7, "{} of {most} at {p:?}", made[0]);
                made[0]
            };
            for _ in 0..4000 {
                check(EXTENT.map(|e| e * (random(&mut state) - 0.5)));
            }
            for shell in &shells {
                for _ in 0..50 {
                    let point = shell.point([0.6, 0.0, 0.8], random(&mut state));
                    if (0..3).all(|i| point[i].abs() < 0.5 * EXTENT[i]) {
                        check(point);
                    }
                }
            }
        }
    }

    #[test]
    fn the_shells_of_a_source_hold_the_water_that_flows_out_of_it() {
        let sea = [Flow { kind: abi::FLOW_SOURCE, strength: 0.02, peak: 0.2, core: 0.05, ..Flow::default() }];
        let packed = packed(&sea);
        let part = Part { low: [-50.0; 3], high: [50.0; 3] };
        let mut shells = Vec::new();
        packed.shells(&part, &mut shells);
        let (mut state, mut sum) = (3, 0.0);
        for shell in &shells {
            for _ in 0..DRAWS {
                let point = shell.point([1.0, 0.0, 0.0], random(&mut state));
                let mut made = [0.0];
                let points = Points { x: &[point[0]], y: &[point[1]], z: &[point[2]] };
                divergence(Level::best(), &packed, points, &mut made);
                sum += f64::from(shell.mass() * made[0] / shell.at(point).max(1e-30)) / DRAWS as f64;
            }
        }
        let flux = 4.0 * f64::from(PI) * 0.02;
        assert!((sum / flux - 1.0).abs() < 0.02, "{sum} of {flux}");
        let mass: f32 = shells.iter().map(Shell::mass).sum();
        assert!(f64::from(mass) < 4.0 * flux, "{mass} for {flux}");
    }
}
