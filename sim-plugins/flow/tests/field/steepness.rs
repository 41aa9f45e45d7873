//! What must hold for the bound of ‖∇V‖.

use reef_abi::Flow;
use reef_flow::{
    Level, Packed, dispatch,
    fearless_simd::{f32x16, prelude::*},
    reference, steepness,
};

use crate::common::{Random, hole, sea, shelter, source, whirlwind};

/// The bound in a ball around a point [1/s].
fn bound(level: Level, flows: &[Flow], at: [f32; 3], reach: f32) -> f32 {
    let mut packed = Packed::new();
    packed.fill(flows, [0.0; 3], 0);
    let mut out = [0.0_f32; 16];
    dispatch!(level, simd => {
        let p = at.map(|x| f32x16::splat(simd, x));
        steepness(simd, &packed, p, f32x16::splat(simd, reach)).store_slice(&mut out);
    });
    out[7]
}

/// |V(b) − V(a)| / |b − a| [1/s], in f64.
fn stretch(flows: &[Flow], a: [f64; 3], b: [f64; 3]) -> f64 {
    let v = |p| reference::velocity(flows, p, 0);
    let long = |d: [f64; 3]| (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
    let (va, vb) = (v(a), v(b));
    long(core::array::from_fn(|i| vb[i] - va[i])) / long(core::array::from_fn(|i| b[i] - a[i]))
}

/// Local fields with cores, some of them fading.
fn fields() -> Vec<Vec<Flow>> {
    let cored = |flow: Flow| Flow { core: 0.01, ..flow };
    let faded = |flow: Flow| Flow { reach: 0.3, fade: 0.5, ..flow };
    let axis = [0.6, 0.8, 0.0];
    vec![
        vec![cored(source([0.0; 3], 0.005, 1.0))],
        vec![cored(faded(hole([0.02, 0.0, 0.0], 0.02, 0.5)))],
        vec![cored(whirlwind([0.0; 3], axis, 0.005, 1.0))],
        vec![
            cored(faded(whirlwind([0.0, 0.01, 0.0], axis, 0.02, 0.7))),
            shelter([0.1, 0.0, 0.0], 0.6, 0.2, 0.3),
        ],
    ]
}

#[test]
fn no_two_points_differ_by_more_than_the_bound_says() {
    let mut random = Random(5);
    for (kind, flows) in fields().iter().enumerate() {
        let mut tightest = f64::INFINITY;
        for _ in 0..4000 {
            let at: [f32; 3] = core::array::from_fn(|_| random.within(-0.2, 0.2) as f32);
            let near: [f64; 3] = core::array::from_fn(|i| f64::from(at[i]) + random.within(-1e-4, 1e-4));
            let seen = stretch(flows, at.map(f64::from), near);
            let at_point = f64::from(bound(Level::best(), flows, at, 2e-4));
            assert!(seen <= at_point * 1.001 + 1e-4, "kind {kind} at {at:?}: {seen} > {at_point}");
            if seen > 0.1 {
                tightest = tightest.min(at_point / seen);
            }
            // A ball of 5 cm around a point near by holds it, too.
            let around: [f32; 3] = core::array::from_fn(|i| at[i] + random.within(-0.028, 0.028) as f32);
            let in_ball = f64::from(bound(Level::best(), flows, around, 0.05));
            assert!(at_point <= in_ball * 1.001 + 1e-4, "kind {kind}: {at_point} > {in_ball}");
        }
        // A bound that is far off would cost steps.
        assert!(tightest < 1.6, "kind {kind}: {tightest}");
    }
}

#[test]
fn the_bound_is_the_same_bytes_at_every_level() {
    for flows in fields().into_iter().chain([sea(7, 40, [0.0; 3], 0.3)]) {
        let of = |level| bound(level, &flows, [0.03, 0.05, -0.02], 0.01).to_bits();
        for level in Level::all() {
            assert_eq!(of(level), of(Level::scalar()), "{}", level.name());
        }
    }
}
