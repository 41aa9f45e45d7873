//! The grid and the cut: what is left out contributes exactly nothing, or less than was asked for.

use reef_abi::{self as abi, Flow};
use reef_flow::{
    Field, Level, Look, Packed, Sphere,
    limit::{self, limit},
};

use crate::common::{self, Random, difference, sea, velocities};

/// Points inside a sphere, relative to `origin`.
fn inside(sphere: Sphere, origin: [f64; 3], random: &mut Random) -> Vec<[f32; 3]> {
    let mut points = Vec::new();
    while points.len() < 40 {
        let offset = random.point(1.0);
        if offset.iter().map(|c| c * c).sum::<f64>() <= 1.0 {
            let world: [f64; 3] = core::array::from_fn(|i| sphere.center[i] + sphere.radius * offset[i]);
            points.push(core::array::from_fn(|i| (world[i] - origin[i]) as f32));
        }
    }
    points
}

#[test]
fn the_grid_changes_no_byte_inside_the_bounding_sphere() {
    let mut field = Field::new();
    let (mut whole, mut near) = (Packed::new(), Packed::new());
    let mut saved = 0;
    for seed in 0..60 {
        let count = [3, 12, 90, 400][(seed % 4) as usize];
        let mut flows = sea(seed, count, [100.0, -8.0, 50.0], 6.0);
        for flow in &mut flows {
            flow.reach *= 0.3;
        }
        field.refill(&flows);
        let mut random = Random(seed + 1000);
        for object in 0..8 {
            let offset = random.point(9.0);
            let origin = [100.0 + offset[0], -8.0 + offset[1], 50.0 + offset[2]];
            let sphere = Sphere {
                center: core::array::from_fn(|i| origin[i] + random.within(-0.1, 0.1)),
                radius: random.within(0.0, 1.0),
            };
            whole.fill(&flows, origin, object);
            near.fill_near(&field, sphere, origin, object);
            saved += near.saved();
            let points = inside(sphere, origin, &mut random);
            let bits = |packed: &Packed| {
                velocities(Level::best(), packed, &points)
                    .into_iter()
                    .map(|v| v.map(f32::to_bits))
                    .collect::<Vec<_>>()
            };
            assert_eq!(bits(&near), bits(&whole), "seed {seed}, object {object}");
        }
    }
    assert!(saved > 10_000, "the grid must have left most of it out: {saved}");
}

#[test]
fn what_was_saved_and_what_is_evaluated_add_up() {
    let flows: Vec<Flow> = (0..200)
        .map(|i| Flow { reach: 0.5, fade: 0.5, ..common::source([f64::from(i), 0.0, 0.0], 0.1, 1.0) })
        .collect();
    let mut field = Field::new();
    field.refill(&flows);
    let mut packed = Packed::new();
    packed.fill_near(&field, Sphere { center: [100.2, 0.0, 0.0], radius: 0.4 }, [100.0, 0.0, 0.0], 0);
    // 100 (0.2 away) and none else: 101 is 0.8 away, 0.9 is needed to be sure.
    assert!((1..=2).contains(&packed.evaluated()), "{}", packed.evaluated());
    assert_eq!(packed.evaluated() + packed.saved(), 200);
    packed.fill(&flows, [0.0; 3], 0);
    assert_eq!((packed.evaluated(), packed.saved()), (200, 0));
}

#[test]
fn candidates_miss_nothing_that_touches_the_sphere_and_come_in_the_hosts_order() {
    let mut field = Field::new();
    let mut out = Vec::new();
    let mut random = Random(77);
    for seed in 0..40 {
        let mut flows = sea(seed, 300, [0.0; 3], 4.0);
        for flow in &mut flows {
            flow.reach *= [0.05, 0.3, 1.0][(seed % 3) as usize];
        }
        field.refill(&flows);
        for _ in 0..20 {
            let sphere = Sphere { center: random.point(6.0), radius: random.within(0.0, 1.0) };
            field.candidates(sphere, &mut out);
            assert!(out.windows(2).all(|w| w[0] < w[1]), "ascending, without doubles");
            for (index, flow) in (0_u32..).zip(&flows) {
                let touches = flow.reach <= 0.0
                    || flow.kind == abi::FLOW_DIRECTIONAL
                    || sphere.distance_to_center(flow.position) <= f64::from(flow.reach) + sphere.radius;
                assert!(!touches || out.contains(&index), "seed {seed}: {index} is missing");
            }
        }
    }
}

#[test]
fn what_is_found_around_a_box_in_parts_changes_no_byte_inside_it() {
    let (mut field, mut parts) = (Field::new(), Field::new());
    let (mut whole, mut near) = (Packed::new(), Packed::new());
    let mut left_out = 0;
    for seed in 0..40 {
        let mut flows = sea(seed, 300, [0.0; 3], 12.0);
        flows.iter_mut().for_each(|flow| flow.reach *= 0.3);
        let mut random = Random(seed + 2000);
        let corner = random.point(8.0);
        let bounds = [corner, corner.map(|at| at + random.within(0.5, 4.0))];
        let mut looks = [(); 4].map(|()| Look::default());
        for (look, first) in looks.iter_mut().zip((0..).step_by(90)) {
            look.find(&flows[first..flows.len().min(first + 90)], first, bounds);
        }
        let mut look = Look::default();
        look.find(&flows, 0, bounds);
        field.refill_found(&flows, [&look]);
        parts.refill_found(&flows, &looks);
        assert_eq!((parts.flows(), parts.count()), (field.flows(), field.count()));
        left_out += flows.len() - parts.flows().len();
        let [low, high] = bounds;
        let center: [f64; 3] = core::array::from_fn(|i| 0.5 * (low[i] + high[i]));
        let radius = (0..3).map(|i| 0.5 * (high[i] - low[i])).fold(f64::INFINITY, f64::min);
        let sphere = Sphere { center, radius };
        whole.fill(&flows, center, 3);
        near.fill_near(&parts, sphere, center, 3);
        let points = inside(sphere, center, &mut random);
        let both = [&whole, &near].map(|packed| velocities(Level::best(), packed, &points));
        assert_eq!(both[0], both[1], "seed {seed}");
    }
    assert!(left_out > 2000, "most of it is far: {left_out}");
}

#[test]
fn a_field_is_exactly_zero_beyond_its_reach_and_untouched_before_it_fades() {
    let whole = common::source([0.0; 3], 0.4, 1.0);
    let cut = Flow { reach: 2.0, fade: 0.75, ..whole };
    for d in [0.1_f32, 1.0, 1.499] {
        assert_eq!(common::at(&[cut], [d, 0.0, 0.0]), common::at(&[whole], [d, 0.0, 0.0]));
    }
    for d in [2.0_f32, 2.1, 1e9] {
        assert_eq!(common::at(&[cut], [0.0, d, 0.0]), [0.0; 3]);
    }
}

#[test]
fn a_cut_leaves_out_no_more_than_its_threshold() {
    for (strength, peak) in [(0.4, 1.0), (-0.05, 10.0), (10_000.0, 10.0), (1e-6, 0.01)] {
        for threshold in [1e-5_f32, 1e-3, 4e-3] {
            let whole = common::source([0.0; 3], strength, peak);
            let mut cut = whole;
            assert_eq!(limit(&mut cut, threshold), threshold);
            let reach = limit::reach_for(strength, peak, threshold);
            let mut worst = 0.0_f32;
            for i in 0..4000 {
                let point = [reach * (0.5 + i as f32 / 2000.0), 0.0, 0.0];
                worst = worst.max(difference(common::at(&[whole], point), common::at(&[cut], point)));
            }
            assert!(worst <= threshold, "{strength} {threshold}: {worst}");
            // The bound is not idle: what is left out comes near it.
            assert!(worst >= 0.9 * threshold, "{strength} {threshold}: {worst}");
        }
    }
}

#[test]
fn a_cut_leaves_what_is_nearer_global_or_weak_alone() {
    let near = Flow { reach: 0.1, fade: 0.5, ..common::source([0.0; 3], 1.0, 1.0) };
    let mut flow = near;
    assert_eq!(limit(&mut flow, 1e-3), 0.0);
    assert_eq!(flow, near);
    let mut current = common::directional([1.0, 0.0, 0.0], 0.2);
    assert_eq!(limit(&mut current, 1e-3), 0.0);
    assert_eq!(current.reach, 0.0);
    // A field that never passes the threshold goes, and that is within the bound.
    let mut weak = common::source([0.0; 3], 1.0, 5e-4);
    assert_eq!(limit(&mut weak, 1e-3), 1e-3);
    assert_eq!(common::at(&[weak], [0.1, 0.0, 0.0]), [0.0; 3]);
}

#[test]
fn a_moving_primitive_fades_in_without_a_jump() {
    let mut flow = Flow { owner: 3, ..common::hole([0.0; 3], 0.2, 1.0) };
    limit(&mut flow, 1e-3);
    let (mut field, mut packed) = (Field::new(), Packed::new());
    let crowd: Vec<Flow> = (0..20)
        .map(|i| Flow { reach: 0.2, fade: 0.5, ..common::source([0.0, -40.0 - f64::from(i), 0.0], 0.1, 1.0) })
        .collect();
    let sphere = Sphere { center: [0.0; 3], radius: 0.3 };
    let mut last = [0.0; 3];
    let start = f64::from(flow.reach) + 1.0;
    for step in 0..5000 {
        flow.position = [start - 0.004 * f64::from(step), 0.1, 0.0];
        if flow.position[0] < 0.5 {
            break;
        }
        let mut flows = crowd.clone();
        flows.push(flow);
        field.refill(&flows);
        packed.fill_near(&field, sphere, [0.0; 3], 0);
        let now = velocities(Level::best(), &packed, &[[0.2, 0.0, 0.0]])[0];
        // The field's slope: below 2 · Φ / d³ outside of the shell, and threshold · 3 / shell inside, times 4
        // mm.
        let d = flow.position[0] as f32 - 0.2;
        let bound = 0.004 * (2.0 * 0.2 / (d * d * d) + 1e-3 * 3.0 / (0.2 * flow.reach)) + 1e-7;
        assert!(difference(now, last) <= bound, "step {step}: {last:?} {now:?}");
        last = now;
    }
    assert!(common::length(last) > 0.1, "it arrived: {last:?}");
}

#[test]
fn a_refill_allocates_nothing_once_grown() {
    // Capacity is what grows; pointers that stay mean that nothing was allocated anew.
    let flows = sea(9, 300, [0.0; 3], 5.0);
    let (mut field, mut packed) = (Field::new(), Packed::new());
    let sphere = Sphere { center: [0.0; 3], radius: 8.0 };
    field.refill(&flows);
    packed.fill_near(&field, sphere, [0.0; 3], 0);
    let before = (field.flows().as_ptr(), packed.evaluated());
    field.refill(&flows);
    packed.fill_near(&field, sphere, [0.0; 3], 0);
    assert_eq!((field.flows().as_ptr(), packed.evaluated()), before);
    assert_eq!(flows.iter().filter(|f| f.kind == abi::FLOW_DIRECTIONAL).count(), 43);
}
