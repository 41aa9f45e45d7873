//! What must hold for sources, holes and whirlwinds (Aliaga & Larboulette 2009, eq. 1–4).

use proptest::prelude::*;
use reef_abi::Flow;
use reef_flow::{
    Level, Packed, reference,
    sample::{Points, divergence},
};

use crate::common::{
    self, Random, at, difference, directional, dot, hole, length, sea, shelter, source, unit, velocities,
    whirlwind,
};

/// One step of f32 rounding is 6e-8; an intensity passes through about ten operations.
const ROUNDING: f32 = 1e-6;

#[test]
fn a_source_reaches_its_peak_at_its_centre() {
    for strength in [1e-6, 0.01, 1.0, 1e4, -2.0] {
        let field = [source([0.0; 3], strength, 10.0)];
        for direction in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.0, -0.8]] {
            let v = at(&field, direction.map(|c: f32| c * 1e-7));
            // At 1e-7 m the weakest of them (softening 1e-7 m²) has fallen by 1e-14 / 1e-7.
            assert!((length(v) - 10.0).abs() <= 10.0 * ROUNDING, "{strength} {direction:?}: {v:?}");
            assert!((dot(unit(v), direction) * strength.signum() - 1.0).abs() <= ROUNDING);
        }
    }
}

#[test]
fn where_the_direction_is_undefined_there_is_no_contribution() {
    for core in [0.0, 0.05] {
        let core = |flow: Flow| Flow { core, ..flow };
        assert_eq!(at(&[core(source([0.0; 3], 1.0, 10.0))], [0.0; 3]), [0.0; 3]);
        assert_eq!(at(&[core(hole([0.0; 3], 1e30, 1e30))], [0.0; 3]), [0.0; 3]);
        for axis in [[0.0, 1.0, 0.0], unit([1.0, 2.0, -3.0]), unit([-0.3, 0.01, 5.0])] {
            let field = [core(whirlwind([0.0; 3], axis, 1.0, 10.0))];
            for along in [0.0, 1e-3, 0.7, -12.0] {
                assert_eq!(at(&field, axis.map(|c| c * along)), [0.0; 3], "{axis:?} {along}");
            }
        }
    }
}

#[test]
fn just_beside_a_whirlwinds_centre_the_water_turns_at_its_peak() {
    let field = [whirlwind([0.0; 3], [0.0, 1.0, 0.0], 0.5, 3.0)];
    let v = at(&field, [1e-6, 0.0, 0.0]);
    // (p − C) × R = x × y = z.
    assert!(difference(v, [0.0, 0.0, 3.0]) <= 3.0 * ROUNDING, "{v:?}");
}

#[test]
fn two_equal_sources_cancel_exactly_at_their_midpoint() {
    for (a, b) in [([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), ([0.3, -0.7, 1.1], [0.5, 0.1, -0.9])] {
        let middle: [f64; 3] = core::array::from_fn(|i| 0.5 * (a[i] + b[i]));
        let field = [source(a, 0.037, 0.9), source(b, 0.037, 0.9)];
        let mut packed = Packed::new();
        // In f32 the midpoint exists exactly where it is the origin.
        packed.fill(&field, middle, 0);
        assert_eq!(velocities(Level::best(), &packed, &[[0.0; 3]])[0], [0.0; 3]);
        // A row of them is a wall: nothing crosses the plane between two.
        packed.fill(&[source([-1.0, 0.0, 0.0], 0.5, 1.0), source([1.0, 0.0, 0.0], 0.5, 1.0)], [0.0; 3], 0);
        assert_eq!(velocities(Level::best(), &packed, &[[0.0, 0.3, -0.8]])[0][0], 0.0);
    }
}

#[test]
fn an_intensity_through_zero_is_continuous() {
    let point = [0.05, 0.02, -0.01];
    let speed = |strength: f32| at(&[source([0.0; 3], strength, 4.0)], point);
    let mut last = speed(-1e-2);
    let steps = 20_000;
    for i in 1..=steps {
        let strength = (i as f32 / steps as f32 - 0.5) * 2e-2;
        let now = speed(strength);
        // dV/dΦ is greatest at Φ = 0: 1/d²; twice that for rounding.
        let bound = 2.0 * (2e-2 / steps as f32) / dot(point, point) + ROUNDING;
        assert!(difference(now, last) <= bound, "at {strength}: {last:?} {now:?}");
        last = now;
    }
    assert_eq!(speed(0.0), [0.0; 3]);
    assert!(length(speed(1e-30)) < 1e-25);
}

#[test]
fn a_core_rounds_the_jump_at_the_centre_and_hardly_matters_outside() {
    let sharp = [hole([0.0; 3], 0.1, 1.0)];
    let round = [Flow { core: 0.01, ..sharp[0] }];
    let across = |x: f32| at(&round, [x, 0.0, 0.0])[0];
    for i in -1000..1000 {
        let x = i as f32 * 5e-5;
        // The slope is at most Φ_max / core.
        assert!((across(x + 5e-5) - across(x)).abs() <= 1.001 * 1.0 / 0.01 * 5e-5);
    }
    let far = [0.1, 0.2, 0.0];
    // √(d² + core²) against d: core² / 2d² = 1e-3.
    assert!(difference(at(&sharp, far), at(&round, far)) <= 1e-3 * length(at(&sharp, far)));
}

#[test]
fn what_an_object_emits_does_not_act_on_itself() {
    let scene = source([1.0, 0.0, 0.0], 0.2, 1.0);
    let own = Flow { owner: 7, ..hole([0.0, 0.1, 0.0], 0.5, 2.0) };
    let other = Flow { owner: 8, ..whirlwind([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], 0.1, 2.0) };
    let point = [0.1, 0.2, 0.3];
    let mut packed = Packed::new();
    packed.fill(&[scene, own, other], [0.0; 3], 7);
    assert_eq!(velocities(Level::best(), &packed, &[point])[0], at(&[scene, other], point));
    // Owner 0 is the scene: it feels everything, and so does everybody feel the scene's.
    packed.fill(&[scene, own, other], [0.0; 3], 0);
    assert_eq!(velocities(Level::best(), &packed, &[point])[0], at(&[scene, own, other], point));
}

#[test]
fn the_divergence_is_that_of_the_sources_and_holes() {
    let mut random = Random(11);
    for number in 0..200 {
        let place = |random: &mut Random| random.point(1.0);
        let mut flows = vec![source(place(&mut random), 0.2, 0.7), hole(place(&mut random), 0.1, 0.4)];
        flows[0].core = 0.1;
        (flows[1].core, flows[1].reach, flows[1].fade) = (0.2, 1.6, 0.3);
        // A shelter around all: what it leaves is the same everywhere.
        if number % 2 == 1 {
            flows.push(shelter([0.0; 3], 0.25, 100.0, 1.0));
        }
        let point = place(&mut random);
        // Greatest error of a central difference over h: h² V‴ / 6, with V‴ ≲ 0.7 / 0.1³.
        let h = 1e-4;
        let expected: f64 = (0..3)
            .map(|axis| {
                let at = |off: f64| {
                    let mut point = point;
                    point[axis] += off;
                    reference::velocity(&flows, point, 0)[axis]
                };
                (at(h) - at(-h)) / (2.0 * h)
            })
            .sum();
        // What has no divergence, or is not what comes and goes.
        flows.insert(1, whirlwind([0.3, 0.0, 0.0], [0.0, 1.0, 0.0], 0.2, 0.4));
        flows.push(directional([1.0, 0.0, 0.0], 0.3));
        let mut packed = Packed::new();
        packed.fill(&flows, [0.0; 3], 0);
        let [x, y, z] = point.map(|v| [v as f32]);
        let all = Level::all().into_iter().map(|level| {
            let mut found = [0.0];
            let points = Points { x: &x, y: &y, z: &z };
            divergence(level, &packed, points, &mut found);
            found[0]
        });
        let all: Vec<f32> = all.collect();
        assert!(
            (f64::from(all[0]) - expected).abs() < 2e-4 * expected.abs().max(0.1),
            "{all:?}, not {expected}"
        );
        assert!(all.iter().all(|found| found.to_bits() == all[0].to_bits()), "{all:?}");
    }
}

#[test]
fn extreme_numbers_stay_finite() {
    let extremes = [0.0, 1e-38, 1e-10, 1.0, 1e10, 3e38];
    for strength in extremes {
        for peak in extremes {
            for d in [0.0, 1e-38, 1e-19, 1e-6, 1.0, 1e6, 1e19] {
                for flow in [
                    source([0.0; 3], strength, peak),
                    whirlwind([0.0; 3], unit([1.0, 1.0, 0.0]), -strength, peak),
                    Flow { reach: 1.0, fade: 1.0, ..source([0.0; 3], strength, peak) },
                    Flow { reach: 3e38, fade: 0.5, ..hole([0.0; 3], strength, peak) },
                ] {
                    let v = at(&[flow], [d, 0.0, 0.0]);
                    assert!(v.iter().all(|c| c.is_finite()), "{strength} {peak} {d}: {v:?}");
                }
            }
        }
    }
    let broken = Flow { phase: f32::NAN, ..source([0.0; 3], 1.0, 1.0) };
    let unknown = Flow { kind: 77, ..broken };
    assert_eq!(at(&[broken, unknown, source([f64::INFINITY; 3], 1.0, 1.0)], [1.0; 3]), [0.0; 3]);
}

fn coordinate() -> impl Strategy<Value = f32> {
    -2.0..2.0_f32
}

proptest! {
    #[test]
    fn a_hole_is_exactly_the_opposite_of_a_source(
        x in coordinate(), y in coordinate(), z in coordinate(), strength in 1e-4..10.0_f32, core in 0.0..0.1_f32
    ) {
        let s = at(&[Flow { core, ..source([0.1, 0.2, 0.3], strength, 2.0) }], [x, y, z]);
        let h = at(&[Flow { core, ..hole([0.1, 0.2, 0.3], strength, 2.0) }], [x, y, z]);
        let minus = at(&[Flow { core, ..source([0.1, 0.2, 0.3], -strength, 2.0) }], [x, y, z]);
        prop_assert_eq!(h, s.map(|c| -c));
        prop_assert_eq!(h, minus);
    }

    #[test]
    fn a_whirlwind_is_across_its_axis_and_across_the_way_to_its_centre(
        x in coordinate(), y in coordinate(), z in coordinate(), seed in 0..1000_u64
    ) {
        let axis = common::Random(seed).direction();
        let v = at(&[whirlwind([0.0; 3], axis, 0.7, 1.5)], [x, y, z]);
        let p = [x, y, z];
        prop_assume!(length(p) > 1e-3 && length(v) > 0.0);
        // Near the axis the cross product of unit vectors is small, and its rounding (6e-8 a component)
        // weighs more.
        let sine = (1.0 - dot(unit(p), axis).powi(2)).max(0.0).sqrt();
        prop_assume!(sine > 1e-3);
        let bound = 4e-7 / sine;
        prop_assert!(dot(unit(v), unit(p)).abs() <= bound, "{:?}", v);
        prop_assert!(dot(unit(v), axis).abs() <= bound, "{:?}", v);
    }

    #[test]
    fn the_sum_hardly_depends_on_the_order_of_primitives(seed in 0..1000_u64, turn in 0..24_usize) {
        let mut flows = sea(seed, 24, [0.0; 3], 1.0);
        let point = common::Random(seed).point(1.0).map(|c| c as f32);
        let first = at(&flows, point);
        let greatest: f32 = flows.iter().map(|f| f.peak.max(f.strength.abs() * 2.0)).sum();
        flows.rotate_left(turn);
        flows.swap(3, 17);
        // Each of 24 additions rounds by at most 6e-8 of the greatest partial sum.
        prop_assert!(difference(at(&flows, point), first) <= 24.0 * 6e-8 * greatest);
    }

    #[test]
    fn the_wide_kernel_agrees_with_plain_f64(seed in 0..10_000_u64) {
        // A lagoon 40 km from the world's origin: positions relative to an object's origin keep millimetres
        // there.
        let around = [40_000.0, -12.0, 25_000.0];
        let flows = sea(seed, 40, around, 2.0);
        let mut random = common::Random(seed ^ 0xabcdef);
        let mut packed = Packed::new();
        packed.fill(&flows, around, 2);
        for _ in 0..16 {
            let local = random.point(2.0).map(|c| c as f32);
            let point = core::array::from_fn(|i| around[i] + f64::from(local[i]));
            let truth = reference::velocity(&flows, point, 2);
            let got = velocities(Level::best(), &packed, &[local])[0];
            let error = (0..3).map(|i| (f64::from(got[i]) - truth[i]).powi(2)).sum::<f64>().sqrt();
            // Forty contributions of up to 3 m/s with relative errors of 1e-6, and the sine's 1e-7 of an
            // argument of up to 10 rad: 1e-6 of each; a jump of direction within 1e-3 m of a centre is left
            // aside.
            let near = flows.iter().any(|f| {
                let d = (0..3).map(|i| (f.position[i] - point[i]).powi(2)).sum::<f64>().sqrt();
                d < 1e-3
            });
            prop_assert!(near || error <= 4e-5, "{error}: {got:?} {truth:?}");
        }
    }
}
