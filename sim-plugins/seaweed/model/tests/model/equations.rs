//! The wide kernels against the equations in f64, and against closed forms.

use glam::DVec3;
use reef_seaweed_model::{
    bed::Bed,
    levels::{Levels, Method},
    reference::Reference,
    skeleton::Segment,
};

use crate::common::*;

/// Levels that leave nothing out.
fn all(method: Method) -> Levels {
    Levels { contact: 0.0, method, blend: 0.0, ..Levels::none() }
}

/// The largest difference of angles between a bed's first plant and the reference.
fn apart(bed: &Bed, reference: &Reference) -> f64 {
    let pairs = angles(bed, 0).into_iter().zip(&reference.angles);
    pairs.map(|(a, b)| (a[0] - b[0]).abs().max((a[1] - b[1]).abs())).fold(0.0, f64::max)
}

#[test]
fn the_physical_kernel_is_the_system_of_the_equations() {
    for (skeleton, steps) in [(usual_blade(), 120), (bush(), 120)] {
        let mut bed = alone(skeleton.clone());
        let mut reference = Reference::new(&skeleton);
        let water = DVec3::new(0.3, 0.05, -0.2);
        let mut moved: f64 = 0.0;
        for _ in 0..steps {
            run_with(&mut bed, &[current(water)], DT, 1, &all(Method::Physical));
            reference.step(DT, &|_| [water, DVec3::ZERO]);
            moved = moved.max(reference.velocities.iter().map(|v| v[1].length()).fold(0.0, f64::max));
            // f32 against f64 over two seconds of motion.
            let apart = apart(&bed, &reference);
            assert!(apart < 2e-4, "{apart}");
        }
        assert!(moved > 0.1, "nothing moved: {moved}");
    }
}

#[test]
fn the_procedural_kernel_is_equations_5_and_6() {
    let skeleton = bush();
    let mut bed = alone(skeleton.clone());
    let mut reference = Reference::new(&skeleton);
    let water = DVec3::new(0.1, 0.0, 0.07);
    for _ in 0..60 {
        run_with(&mut bed, &[current(water)], DT, 1, &all(Method::Procedural));
        reference.step_procedurally(1.0 - (-DT / 0.3_f64).exp(), &|_| [water, DVec3::ZERO]);
        let apart = apart(&bed, &reference);
        assert!(apart < 1e-4, "{apart}");
    }
    assert!(apart(&bed, &Reference::new(&skeleton)) > 0.05);
}

#[test]
fn both_methods_have_the_same_static_equilibrium() {
    for skeleton in [usual_blade(), bush()] {
        let length = skeleton.reach();
        for water in [DVec3::new(0.15, 0.0, 0.0), DVec3::new(-0.2, 0.03, 0.4)] {
            let settled = |method| {
                let mut bed = alone(skeleton.clone());
                run_with(&mut bed, &[current(water)], DT, 2400, &all(method));
                nodes(&mut bed, 0)
            };
            let (physical, procedural) = (settled(Method::Physical), settled(Method::Procedural));
            let apart = physical.iter().zip(&procedural).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            assert!(apart < 0.01 * length, "{apart} of {length}");
            // And it is that of eq. (6): each angle is its torque over its stiffness.
            let mut bed = alone(skeleton.clone());
            run_with(&mut bed, &[current(water)], DT, 2400, &all(Method::Physical));
            let mut reference = Reference::new(&skeleton);
            reference.angles = angles(&bed, 0);
            let torques = reference.torques(&|_| [water, DVec3::ZERO]);
            for ((segment, angles), torque) in skeleton.segments().iter().zip(&reference.angles).zip(torques)
            {
                let bent = [angles[0] - segment.theta, angles[1] - segment.phi];
                for (bent, torque) in bent.into_iter().zip(torque) {
                    assert!((bent - torque / segment.stiffness).abs() < 0.01, "{bent} {torque}");
                }
            }
        }
    }
}

#[test]
fn without_forces_the_equilibrium_angles_stay_exactly() {
    let mut skeleton = bush().segments().to_vec();
    skeleton.iter_mut().for_each(|segment| segment.lift = 0.0);
    for method in [Method::Physical, Method::Procedural] {
        let mut bed = alone(self::skeleton(&skeleton));
        let before = bed.save().joints;
        run_with(&mut bed, &[], DT, 200, &all(method));
        assert_eq!(bed.save().joints, before);
    }
}

/// One segment of mass m that only its spring and damper hold: m L²/3 φ̈ + v φ̇ + k φ = 0.
#[test]
fn one_segment_swings_and_decays_as_a_damped_spring() {
    let (k, v, m, l) = (1.5, 0.004, 0.2, 0.3);
    let like =
        Segment { stiffness: k, damping: v, mass: m, length: l, drag: 0.0, lift: 0.0, ..Segment::default() };
    let inertia = m * l * l / 3.0;
    let (decay, omega) = (0.5 * v / inertia, (k / inertia - (0.5 * v / inertia).powi(2)).sqrt());
    let mut bed = alone(skeleton(&[like]));
    let mut state = bed.save();
    state.joints[1] = 0.3;
    bed.load(&state).unwrap();
    // Small steps: a linearly implicit step damps by itself, as ω² dt/2.
    let dt = 2e-5;
    let (mut last, mut crossings, mut peaks) = (0.3, Vec::new(), Vec::new());
    let (mut peak, mut time): (f64, f64) = (0.0, 0.0);
    while crossings.len() < 5 {
        run(&mut bed, &[], dt, 1);
        time += dt;
        assert!(time < 10.0, "it does not swing: {crossings:?}");
        let phi = angles(&bed, 0)[0][1];
        peak = peak.max(phi.abs());
        if phi * last < 0.0 {
            crossings.push(time);
            peaks.push(peak);
            peak = 0.0;
        }
        last = phi;
    }
    let half_period = (crossings[4] - crossings[0]) / 4.0;
    let found = core::f64::consts::PI / half_period;
    assert!((found / omega - 1.0).abs() < 0.01, "ω {found}, expected {omega}");
    let found = (peaks[1] / peaks[4]).ln() / (3.0 * half_period);
    assert!((found / decay - 1.0).abs() < 0.01, "decay {found}, expected {decay}");
}

#[test]
fn without_forcing_energy_never_grows_at_any_step() {
    for dt in [0.001, DT, 0.05, 0.1, 1.0, 100.0] {
        let mut segments = bush().segments().to_vec();
        for segment in &mut segments {
            segment.lift = 0.0;
            // Without any damping, too.
            segment.damping = 0.0;
            segment.drag = 0.0;
        }
        let mut bed = alone(skeleton(&segments));
        let mut state = bed.save();
        for (i, joint) in state.joints.chunks_exact_mut(8).enumerate() {
            joint[0] += if i % 2 == 0 { 0.7 } else { -0.5 };
            joint[1] += if i % 3 == 0 { -0.8 } else { 0.6 };
        }
        bed.load(&state).unwrap();
        let first = energy(&bed, 0);
        let mut before = first;
        for step in 0..400 {
            run(&mut bed, &[], dt, 1);
            let now = energy(&bed, 0);
            // Rounding of f32 sums.
            assert!(now <= before * (1.0 + 1e-5) + 1e-9, "dt {dt}, step {step}: {before} to {now} J");
            before = now;
        }
        assert!(first > 1.0 && before < first, "{first} {before}");
    }
}

#[test]
fn any_stiffness_damping_and_step_stay_finite() {
    for stiffness in [1e-6, 1e-2, 1.5, 1.5e4, 1e9] {
        for damping in [0.0, 0.25, 1e6] {
            for dt in [1e-4, DT, 1.0, 100.0] {
                for method in [Method::Physical, Method::Procedural] {
                    let like = Segment { stiffness, damping, ..Segment::default() };
                    let mut bed = alone(skeleton(&blade(12, 1.0, like)));
                    let flow = [current(DVec3::new(1.5, 0.2, -0.7))];
                    run_with(&mut bed, &flow, dt, 50, &all(method));
                    let tip = tip(&mut bed, 0);
                    let state = bed.save();
                    let finite = state.joints.iter().all(|v| v.is_finite());
                    assert!(finite && tip.length() < 1.21, "{stiffness} {damping} {dt} {method:?}: {tip}");
                }
            }
        }
    }
}

#[test]
fn a_stiff_undamped_plant_at_long_steps_comes_to_the_same_rest() {
    let like = Segment { stiffness: 1.5e4, damping: 0.0, lift: 0.0, ..Segment::default() };
    let segments = blade(10, core::f64::consts::FRAC_PI_2, like);
    // A current that such a plant notices.
    let flow = [current(DVec3::new(60.0, 0.0, 0.0))];
    let rest = |dt: f64, steps| {
        let mut bed = alone(skeleton(&segments));
        run(&mut bed, &flow, dt, steps);
        let state = bed.save();
        assert!(state.joints.iter().all(|v| v.is_finite()));
        tip(&mut bed, 0)
    };
    let (long, small) = (rest(0.05, 400), rest(0.001, 20_000));
    let bent = (small - DVec3::new(0.0, 1.0, 0.0)).length();
    assert!(bent > 0.005, "{bent}");
    assert!(long.distance(small) < 0.05 * bent, "{long} {small}");
}

#[test]
fn a_stretched_branch_of_short_soft_segments_does_not_flutter() {
    // A string that a float pulls: tension times length is far above what the joints' own stiffness is.
    let like = Segment {
        length: 0.05,
        stiffness: 0.002,
        damping: 0.0,
        mass: 0.004,
        drag: 0.05,
        lift: 0.0,
        ..Segment::default()
    };
    let mut segments = blade(20, core::f64::consts::FRAC_PI_2, like);
    segments[19].lift = 4.0;
    for method in [Method::Physical, Method::Procedural] {
        let mut bed = alone(skeleton(&segments));
        run_with(&mut bed, &[current(DVec3::new(0.4, 0.0, 0.1))], 0.05, 1200, &all(method));
        let before = tip(&mut bed, 0);
        run_with(&mut bed, &[current(DVec3::new(0.4, 0.0, 0.1))], 0.05, 1, &all(method));
        let apart = tip(&mut bed, 0).distance(before);
        assert!(apart < 1e-3, "{method:?}: the tip goes on by {apart} m a step");
    }
}
