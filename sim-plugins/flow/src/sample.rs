//! Velocities at many points at once, for who brings no kernel of their own (reef_host.sample_flow).

use core::ops::Range;

use fearless_simd::{Simd, f32x8, prelude::*};

use crate::{
    Field, Level, Packed, Sphere,
    packed::{self, velocity8},
};

/// Positions [m, relative to the packed form's origin], one slice an axis.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    /// x [m]
    pub x: &'a [f32],
    /// y [m]
    pub y: &'a [f32],
    /// z [m]
    pub z: &'a [f32],
}

/// Velocities [m/s], one slice an axis.
#[derive(Debug)]
pub struct Velocities<'a> {
    /// x [m/s]
    pub x: &'a mut [f32],
    /// y [m/s]
    pub y: &'a mut [f32],
    /// z [m/s]
    pub z: &'a mut [f32],
}

/// The velocity of the water at each point. Takes as many points as the shortest of the six slices has.
pub fn sample(level: Level, packed: &Packed, points: Points<'_>, out: Velocities<'_>) {
    crate::dispatch!(level, simd => sample_wide(simd, packed, points, out));
}

/// Points that one filling of a packed form is for, at most: neighbours in a list are often neighbours in the
/// sea, and what is near is less for few.
const PIECE: usize = 64;

/// Whose own flow is left out.
#[derive(Clone, Copy, Debug)]
pub enum Owner<'a> {
    /// One object's (0: nobody's) at all points.
    One(u64),
    /// At each point another's.
    Each(&'a [u64]),
}

/// The velocity of the sea at each point, whose positions are relative to `origin` [m], without what its
/// owner emits. Takes as many points as the shortest of the lists has. The same bytes as by [`sample`], with
/// all of the field packed for each owner; but a piece of points with one owner pays only for what is near.
pub fn sample_field(
    level: Level,
    field: &Field,
    packed: &mut Packed,
    origin: [f64; 3],
    owner: Owner<'_>,
    points: Points<'_>,
    out: Velocities<'_>,
) {
    let lengths = [points.x.len(), points.y.len(), points.z.len(), out.x.len(), out.y.len(), out.z.len()];
    let mut count = lengths.into_iter().fold(usize::MAX, usize::min);
    if let Owner::Each(owners) = owner {
        count = count.min(owners.len());
    }
    let mut first = 0;
    while first < count {
        let most = (count - first).min(PIECE);
        let (owner, alike) = match owner {
            Owner::One(owner) => (owner, most),
            Owner::Each(owners) => {
                let same = |other: &&u64| **other == owners[first];
                (owners[first], owners[first..first + most].iter().take_while(same).count())
            }
        };
        let here = first..first + alike;
        let own =
            Points { x: &points.x[here.clone()], y: &points.y[here.clone()], z: &points.z[here.clone()] };
        packed.fill_near(field, bounds(&own, origin), origin, owner);
        let (x, y, z) = (&mut out.x[here.clone()], &mut out.y[here.clone()], &mut out.z[here.clone()]);
        sample(level, packed, own, Velocities { x, y, z });
        first = here.end;
    }
}

/// A sphere around points, which are some. One of infinite size where a point is not finite.
fn bounds(points: &Points<'_>, origin: [f64; 3]) -> Sphere {
    let mut square = 0.0;
    let middles = [points.x, points.y, points.z].map(|way| {
        let (low, high) =
            way.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
        let finite = way.iter().all(|v| v.is_finite());
        let (low, high) = if finite { (f64::from(low), f64::from(high)) } else { (0.0, f64::INFINITY) };
        let half = 0.5 * (high - low);
        square += half * half;
        if finite { low + half } else { 0.0 }
    });
    // Wider by what rounding may move a point.
    Sphere { center: core::array::from_fn(|i| origin[i] + middles[i]), radius: square.sqrt() * 1.000_001 }
}

/// What sources and holes make of water at each point, or take away [1/s]. Takes as many points as the
/// shortest of the four slices has.
pub fn divergence(level: Level, packed: &Packed, points: Points<'_>, out: &mut [f32]) {
    crate::dispatch!(level, simd => divergence_wide(simd, packed, points, out));
}

#[inline(always)]
fn divergence_wide<S: Simd>(simd: S, packed: &Packed, points: Points<'_>, out: &mut [f32]) {
    let count = out.len().min(points.x.len()).min(points.y.len()).min(points.z.len());
    let mut first = 0;
    while first < count {
        let here = first..(first + 8).min(count);
        let [x, y, z] = eight_of(simd, &points, here.clone());
        store(out, here.clone(), packed::divergence(simd, packed, x, y, z));
        first = here.end;
    }
}

/// Up to eight points; lanes beyond them hold zero.
#[inline(always)]
fn eight_of<S: Simd>(simd: S, points: &Points<'_>, here: Range<usize>) -> [f32x8<S>; 3] {
    let lanes = |values: &[f32]| {
        let mut eight = [0.0; 8];
        eight[..here.len()].copy_from_slice(&values[here.clone()]);
        f32x8::simd_from(simd, eight)
    };
    [lanes(points.x), lanes(points.y), lanes(points.z)]
}

/// The lanes that stand for points, to their places.
#[inline(always)]
fn store<S: Simd>(to: &mut [f32], here: Range<usize>, values: f32x8<S>) {
    let eight: [f32; 8] = values.into();
    to[here.clone()].copy_from_slice(&eight[..here.len()]);
}

#[inline(always)]
fn sample_wide<S: Simd>(simd: S, packed: &Packed, points: Points<'_>, out: Velocities<'_>) {
    let lengths = [points.x.len(), points.y.len(), points.z.len(), out.x.len(), out.y.len(), out.z.len()];
    let count = lengths.into_iter().fold(usize::MAX, usize::min);
    let mut first = 0;
    while first < count {
        let here = first..(first + 8).min(count);
        let [x, y, z] = eight_of(simd, &points, here.clone());
        let [vx, vy, vz] = velocity8(simd, packed, x, y, z);
        store(out.x, here.clone(), vx);
        store(out.y, here.clone(), vy);
        store(out.z, here.clone(), vz);
        first = here.end;
    }
}

#[cfg(test)]
mod tests {
    use reef_abi::{self as abi, Flow};

    use super::*;
    use crate::random::Random;

    const COUNT: usize = 300;
    const ORIGIN: [f64; 3] = [100.0, -8.0, 40.0];

    /// A sea of small singularities, each an object's own, with a current and a shelter.
    fn sea() -> Vec<Flow> {
        let mut random = Random::new(5, 1);
        let mut between = |low: f64, high: f64| random.between(low, high);
        let kinds = [abi::FLOW_SOURCE, abi::FLOW_HOLE, abi::FLOW_WHIRLWIND, abi::FLOW_SHELTER];
        let mut flows: Vec<Flow> = (1..=COUNT as u64)
            .map(|owner| Flow {
                owner,
                kind: kinds[owner as usize % kinds.len()],
                position: [between(90.0, 110.0), between(-12.0, -4.0), between(30.0, 50.0)],
                axis: [0.0, 0.6, 0.8],
                strength: between(0.01, 0.2) as f32,
                peak: 0.5,
                core: 0.05,
                reach: between(0.3, 2.0) as f32,
                fade: 0.4,
                ..Flow::default()
            })
            .collect();
        let (kind, axis) = (abi::FLOW_DIRECTIONAL, [1.0, 0.0, 0.0]);
        flows.push(Flow { kind, axis, strength: 0.2, gradient: 0.1, ..Flow::default() });
        flows
    }

    #[test]
    fn each_point_feels_all_but_what_its_owner_emits() {
        let flows = sea();
        let mut field = Field::new();
        field.refill(&flows);
        let of = |way: usize| -> Vec<f32> {
            let at = |flow: &Flow| (flow.position[way] - ORIGIN[way]) as f32 + 0.01;
            flows.iter().map(at).collect()
        };
        let [x, y, z] = [of(0), of(1), of(2)];
        // Runs of one owner, points of nobody among them, and each of its own.
        let owners: Vec<u64> =
            (0..x.len() as u64).map(|i| if i < 200 { i / 90 * 7 } else { i + 1 }).collect();
        let points = Points { x: &x, y: &y, z: &z };
        let mut packed = Packed::new();
        let level = Level::best();
        for owner in [Owner::Each(&owners), Owner::One(0), Owner::One(8)] {
            let mut seen = [(); 3].map(|()| vec![0.0; x.len()]);
            let [vx, vy, vz] = &mut seen;
            let out = Velocities { x: vx, y: vy, z: vz };
            sample_field(level, &field, &mut packed, ORIGIN, owner, points, out);
            for i in 0..x.len() {
                let one = Points { x: &x[i..=i], y: &y[i..=i], z: &z[i..=i] };
                let own = match owner {
                    Owner::One(owner) => owner,
                    Owner::Each(owners) => owners[i],
                };
                packed.fill(&flows, ORIGIN, own);
                let mut alone = [[0.0]; 3];
                let [vx, vy, vz] = &mut alone;
                sample(level, &packed, one, Velocities { x: vx, y: vy, z: vz });
                let [ax, ay, az] = alone;
                let seen = [seen[0][i], seen[1][i], seen[2][i]].map(f32::to_bits);
                assert_eq!(seen, [ax[0], ay[0], az[0]].map(f32::to_bits), "point {i}");
            }
        }
    }

    #[test]
    fn a_point_that_is_no_place_harms_no_other() {
        let flows = sea();
        let mut field = Field::new();
        field.refill(&flows);
        let at = |first: f32| {
            let (x, [y, z]) = ([first, 0.5], [[0.2, 0.3], [0.1, 0.4]]);
            let mut seen = [[0.0; 2]; 3];
            let [vx, vy, vz] = &mut seen;
            let points = Points { x: &x, y: &y, z: &z };
            let out = Velocities { x: vx, y: vy, z: vz };
            sample_field(Level::best(), &field, &mut Packed::new(), ORIGIN, Owner::One(0), points, out);
            seen.map(|way| way[1].to_bits())
        };
        assert_eq!(at(f32::NAN), at(0.0));
        assert_eq!(at(f32::INFINITY), at(0.0));
    }
}
