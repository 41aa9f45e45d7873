//! The least that a step of the paper can cost: its printed equations over packed, hot data, and nothing else
//! — straight fibres, no contacts, no steps in parts, no state to save. `reef bench fibre` takes it as the
//! ceiling that the whole way through a scene is measured against; [`Scalar`] is the same one fibre at a time
//! in plain f32.
//!
//! Per node, tip to root: F = A V + F_L + F_M (13), split against the segment (§4.2), F_M by (12). Root to
//! tip: the joint turns the segment from its parent's direction e toward tan α = F_T / (k L) (10), that is to
//! e + F_T/(k L), made unit.

use fearless_simd::{Simd, prelude::*};
use reef_flow::{
    Level, Packed, dispatch,
    lanes::{Lane, WIDTH, add, add_scaled, dot, load, load3, scale, store3, sub, sub_scaled},
    simd::splat,
    velocity8,
};

/// Shape of the fibres, all alike: the default tentacle (6 mm segments, radius 3 to 1.2 mm).
const LENGTH: f32 = 0.006;
const ROOT_RADIUS: f32 = 0.003;
const TIP_RADIUS: f32 = 0.0012;
const STIFFNESS: f32 = 4.2;
const DENSITY: f32 = 1000.0;
const DRAG_COEFFICIENT: f32 = 0.5;
/// 1 − exp(−dt/τ) for dt = 1/60 s and τ = 0.3 s.
const GAIN: f32 = 0.054;
/// Distance between roots [m].
const SPACING: f32 = 0.012;

/// A segment's fixed numbers: A (9), 1/(k L) (10, 11) and L_i / L_{i−1} (12).
#[derive(Clone, Copy)]
struct Segment {
    drag: f32,
    softness: f32,
    ratio: f32,
}

fn segment(i: usize, segments: usize) -> Segment {
    let share = (i + 1) as f32 / segments as f32;
    let radius = ROOT_RADIUS + (TIP_RADIUS - ROOT_RADIUS) * share;
    let stiffness = STIFFNESS * radius / TIP_RADIUS;
    Segment {
        drag: DENSITY * DRAG_COEFFICIENT * LENGTH * radius,
        softness: 1.0 / (stiffness * LENGTH),
        ratio: 1.0,
    }
}

/// x and z of a fibre's root [m]: a square meadow around the origin.
fn root(fibre: usize, fibres: usize) -> [f32; 2] {
    let row = (fibres as f32).sqrt().ceil().max(1.0) as usize;
    let centred = |i: usize| (i as f32 - 0.5 * (row as f32 - 1.0)) * SPACING;
    [centred(fibre % row), centred(fibre / row)]
}

/// One segment of eight fibres.
#[derive(Clone, Copy)]
struct Wide {
    node: [Lane; 3],
    direction: [Lane; 3],
    bend: [Lane; 3],
    across: [Lane; 3],
    drag: Lane,
    softness: Lane,
    ratio: Lane,
    length: Lane,
}

/// Fibres eight lanes wide.
pub struct Bare {
    groups: usize,
    segments: usize,
    /// Segment by segment from the root, all groups of a segment side by side.
    rows: Vec<Wide>,
    roots: Vec<[Lane; 3]>,
    handed: Vec<[Lane; 3]>,
}

impl Bare {
    /// `groups` times eight upright fibres of `segments` segments each.
    pub fn new(groups: usize, segments: usize) -> Self {
        let fibres = groups * WIDTH;
        let eight = |group: usize, axis: usize| -> Lane {
            Lane(core::array::from_fn(|lane| root(group * WIDTH + lane, fibres)[axis]))
        };
        let roots: Vec<[Lane; 3]> =
            (0..groups).map(|group| [eight(group, 0), Lane::all(0.0), eight(group, 1)]).collect();
        let rows = (0..groups * segments)
            .map(|at| {
                let (i, group) = (at / groups, at % groups);
                let segment = segment(i, segments);
                let [x, _, z] = roots[group];
                Wide {
                    node: [x, Lane::all(LENGTH * (i + 1) as f32), z],
                    direction: [Lane::all(0.0), Lane::all(1.0), Lane::all(0.0)],
                    bend: [Lane::all(0.0); 3],
                    across: [Lane::all(0.0); 3],
                    drag: Lane::all(segment.drag),
                    softness: Lane::all(segment.softness),
                    ratio: Lane::all(segment.ratio),
                    length: Lane::all(LENGTH),
                }
            })
            .collect();
        Self { groups, segments, rows, roots, handed: vec![[Lane::all(0.0); 3]; groups] }
    }

    /// Nodes that one step moves.
    pub fn nodes(&self) -> usize {
        self.groups * WIDTH * self.segments
    }

    /// One step of all fibres.
    pub fn step(&mut self, level: Level, packed: &Packed) {
        dispatch!(level, simd => step(simd, self, packed));
    }

    /// Tip of a fibre [m].
    pub fn tip(&self, fibre: usize) -> [f32; 3] {
        let Some(last) = self.rows.get((self.segments.max(1) - 1) * self.groups + fibre / WIDTH) else {
            return [0.0; 3];
        };
        last.node.map(|axis| axis.0[fibre % WIDTH])
    }
}

#[inline(always)]
fn step<S: Simd>(simd: S, bare: &mut Bare, packed: &Packed) {
    let groups = bare.groups;
    bare.handed.fill([Lane::default(); 3]);
    let up = [splat(simd, 0.0), splat(simd, 1.0), splat(simd, 0.0)];
    for s in (0..bare.segments).rev() {
        let (lower, upper) = bare.rows.split_at_mut(s * groups);
        let below = &lower[lower.len() - groups.min(lower.len())..];
        for (g, (row, handed)) in upper.iter_mut().zip(&mut bare.handed).enumerate() {
            let [x, y, z] = load3(simd, &row.node);
            let v = velocity8(simd, packed, x, y, z);
            let force = add_scaled(load3(simd, handed), v, load(simd, &row.drag));
            let d = load3(simd, &row.direction);
            let along = dot(force, d);
            let across = sub_scaled(force, d, along);
            store3(&mut row.across, across);
            let b = match below.get(g) {
                Some(row) => load3(simd, &row.direction),
                None => up,
            };
            // (12): along −b × (d × F_T), of length F_T L_i / L_{i−1}.
            let m = sub_scaled(scale(across, dot(b, d)), d, dot(b, across));
            let factor =
                (dot(across, across) / dot(m, m).max(splat(simd, 1e-36))).sqrt() * load(simd, &row.ratio);
            store3(handed, add_scaled(scale(m, factor), d, along));
        }
    }
    for s in 0..bare.segments {
        let (lower, upper) = bare.rows.split_at_mut(s * groups);
        let below = &lower[lower.len() - groups.min(lower.len())..];
        for (g, (row, root)) in upper.iter_mut().zip(&bare.roots).enumerate() {
            let (e, from) = match below.get(g) {
                Some(row) => (load3(simd, &row.direction), load3(simd, &row.node)),
                None => (up, load3(simd, root)),
            };
            let old = load3(simd, &row.bend);
            let target = scale(load3(simd, &row.across), load(simd, &row.softness));
            let bend = add_scaled(old, sub(target, old), splat(simd, GAIN));
            store3(&mut row.bend, bend);
            let d = add(e, bend);
            let d = scale(d, splat(simd, 1.0) / dot(d, d).sqrt());
            store3(&mut row.direction, d);
            store3(&mut row.node, add_scaled(from, d, load(simd, &row.length)));
        }
    }
}

/// One segment of one fibre.
#[derive(Clone, Copy)]
struct Single {
    node: [f32; 3],
    direction: [f32; 3],
    bend: [f32; 3],
    across: [f32; 3],
    segment: Segment,
}

/// The same fibres one at a time, in plain f32.
pub struct Scalar {
    segments: usize,
    fibres: Vec<[f32; 3]>,
    rows: Vec<Single>,
}

impl Scalar {
    /// `fibres` upright fibres of `segments` segments each.
    pub fn new(fibres: usize, segments: usize) -> Self {
        let roots: Vec<[f32; 3]> = (0..fibres)
            .map(|fibre| {
                let [x, z] = root(fibre, fibres);
                [x, 0.0, z]
            })
            .collect();
        let rows = (0..fibres * segments)
            .map(|at| {
                let [x, _, z] = roots[at / segments];
                Single {
                    node: [x, LENGTH * (at % segments + 1) as f32, z],
                    direction: [0.0, 1.0, 0.0],
                    bend: [0.0; 3],
                    across: [0.0; 3],
                    segment: segment(at % segments, segments),
                }
            })
            .collect();
        Self { segments, fibres: roots, rows }
    }

    /// Nodes that one step moves.
    pub fn nodes(&self) -> usize {
        self.rows.len()
    }

    /// One step of all fibres.
    pub fn step(&mut self, packed: &Packed) {
        for (root, rows) in self.fibres.iter().zip(self.rows.chunks_exact_mut(self.segments)) {
            step_one(*root, rows, packed);
        }
    }

    /// Tip of a fibre [m].
    pub fn tip(&self, fibre: usize) -> [f32; 3] {
        self.rows.get((fibre + 1) * self.segments - 1).map_or([0.0; 3], |row| row.node)
    }
}

fn dot1(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a + b · s
fn add1(a: [f32; 3], b: [f32; 3], s: f32) -> [f32; 3] {
    [a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s]
}

fn step_one(root: [f32; 3], rows: &mut [Single], packed: &Packed) {
    const UP: [f32; 3] = [0.0, 1.0, 0.0];
    let mut handed = [0.0; 3];
    for i in (0..rows.len()).rev() {
        let b = if i > 0 { rows[i - 1].direction } else { UP };
        let row = &mut rows[i];
        let v = reef_flow::scalar::velocity(packed, row.node);
        let force = add1(handed, v, row.segment.drag);
        let d = row.direction;
        let along = dot1(force, d);
        let across = add1(force, d, -along);
        row.across = across;
        let straight = dot1(b, d);
        let m = add1(across.map(|c| c * straight), d, -dot1(b, across));
        let scale = (dot1(across, across) / dot1(m, m).max(1e-36)).sqrt() * row.segment.ratio;
        handed = add1(m.map(|c| c * scale), d, along);
    }
    let (mut e, mut from) = (UP, root);
    for row in rows {
        for i in 0..3 {
            row.bend[i] += GAIN * (row.across[i] * row.segment.softness - row.bend[i]);
        }
        let d = add1(e, row.bend, 1.0);
        let scale = 1.0 / dot1(d, d).sqrt();
        row.direction = d.map(|c| c * scale);
        row.node = add1(from, row.direction, LENGTH);
        (e, from) = (row.direction, row.node);
    }
}

#[cfg(test)]
mod tests {
    use reef_sdk::abi::{FLOW_SOURCE, FLOW_WHIRLWIND, Flow};

    use super::*;

    #[test]
    fn the_wide_and_the_scalar_ceiling_do_the_same_work() {
        let flow = |kind, x| Flow {
            kind,
            position: [x, 0.1, 0.3],
            axis: [0.0, 1.0, 0.0],
            strength: 0.02,
            peak: 1.0,
            ..Flow::default()
        };
        let mut packed = Packed::new();
        packed.fill(&[flow(FLOW_SOURCE, -0.4), flow(FLOW_WHIRLWIND, 0.5)], [0.0; 3], 0);
        let (mut wide, mut scalar) = (Bare::new(2, 10), Scalar::new(16, 10));
        assert_eq!(wide.nodes(), scalar.nodes());
        for _ in 0..200 {
            wide.step(Level::best(), &packed);
            scalar.step(&packed);
        }
        for fibre in 0..16 {
            let (a, b) = (wide.tip(fibre), scalar.tip(fibre));
            let [x, z] = root(fibre, 16);
            let bent = ((a[0] - x).powi(2) + (a[2] - z).powi(2)).sqrt();
            assert!(bent > 1e-3, "the flow bends it: {a:?}");
            for i in 0..3 {
                // Rounding of positions near 0.1 m, with and without fused operations.
                assert!((a[i] - b[i]).abs() < 1e-5, "{fibre}: {a:?} {b:?}");
            }
        }
    }
}
