//! How plants follow currents and waves.

use glam::DVec3;
use reef_seaweed_model::{
    bed::Surroundings,
    levels::{Levels, Method},
};

use crate::common::*;

/// Direction [rad] and size [m] of a blade's deflection in a current toward `azimuth` [rad].
fn deflection(method: Method, azimuth: f64, twist: f64) -> (f64, f64) {
    let like = reef_seaweed_model::skeleton::Segment { lift: 0.0, ..Default::default() };
    let mut bed = alone(skeleton(&blade(10, twist, like)));
    let way = DVec3::new(azimuth.cos(), 0.0, azimuth.sin());
    let levels = Levels { method, contact: 0.0, ..Levels::none() };
    run_with(&mut bed, &[current(0.1 * way)], DT, 1200, &levels);
    let tip = tip(&mut bed, 0);
    let off = (tip.x * way.z - tip.z * way.x).atan2(tip.x * way.x + tip.z * way.z).abs();
    (off, tip.x.hypot(tip.z))
}

#[test]
fn a_blade_leans_where_the_current_goes() {
    for method in [Method::Physical, Method::Procedural] {
        let mut sizes = Vec::new();
        for eighth in 0..8 {
            let azimuth = f64::from(eighth) * core::f64::consts::FRAC_PI_4 + 0.2;
            let (off, size) = deflection(method, azimuth, core::f64::consts::FRAC_PI_2);
            assert!(off.to_degrees() < 15.0, "{method:?} {azimuth}: {} degrees off", off.to_degrees());
            sizes.push(size);
        }
        let (least, most) =
            (sizes.iter().copied().fold(f64::MAX, f64::min), sizes.iter().copied().fold(0.0, f64::max));
        assert!(least / most >= 0.6, "{method:?}: {least} to {most}");
        assert!(least > 0.1, "{least}");
    }
    // The trap that the twist is there for: an upright blade with all angles 0 cannot bend along X.
    assert!(deflection(Method::Physical, 0.0, 0.0).1 < 1e-3);
}

/// The tip's x over time [m] in a current and a swell, after `settle` seconds.
fn follow(method: Method, current_speed: f64, amplitude: f64, settle: f64, seconds: f64) -> Vec<f64> {
    let mut bed = alone(usual_blade());
    let camera = camera(PLACE + DVec3::new(0.0, 0.5, 4.0), PLACE);
    let levels = Levels { method, contact: 0.0, ..Levels::none() };
    let flow = [current(DVec3::new(current_speed, 0.0, 0.0))];
    let mut found = Vec::new();
    for step in 0..((settle + seconds) / DT) as usize {
        let time = (step + 1) as f64 * DT;
        let waves = [swell(amplitude, 5.0, time)];
        let waves = if amplitude > 0.0 { &waves[..] } else { &[] };
        let flow = if current_speed > 0.0 { &flow[..] } else { &[] };
        bed.step(&Surroundings { ..around(flow, waves, &camera) }, &levels);
        if time > settle {
            found.push(tip(&mut bed, 0).x);
        }
    }
    found
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Amplitude of the part of `values` that has a period [s].
fn amplitude_at(values: &[f64], period: f64) -> f64 {
    let middle = mean(values);
    let (mut c, mut s) = (0.0, 0.0);
    for (i, value) in values.iter().enumerate() {
        let phase = core::f64::consts::TAU * i as f64 * DT / period;
        c += (value - middle) * phase.cos();
        s += (value - middle) * phase.sin();
    }
    2.0 * c.hypot(s) / values.len() as f64
}

#[test]
fn in_waves_a_plant_follows_with_their_period() {
    for method in [Method::Physical, Method::Procedural] {
        let tips = follow(method, 0.0, 0.3, 20.0, 20.0);
        let at = amplitude_at(&tips, 5.0);
        assert!(at > 0.02, "{method:?} {at}");
        for other in [2.5, 3.3, 10.0] {
            let beside = amplitude_at(&tips, other);
            assert!(beside < 0.2 * at, "{method:?}: {beside} at {other} s, {at} at 5 s");
        }
        // It comes back: a period later it is where it was.
        let back = (tips[300] - tips[600]).abs();
        assert!(back < 0.02 * at, "{method:?} {back} {at}");
    }
}

#[test]
fn in_a_current_a_plant_leans_downstream_and_stays() {
    for method in [Method::Physical, Method::Procedural] {
        let tips = follow(method, 0.12, 0.0, 20.0, 2.0);
        assert!(tips[0] > 0.1, "{}", tips[0]);
        assert!(tips.iter().all(|x| (x - tips[0]).abs() < 1e-4), "{tips:?}");
    }
}

#[test]
fn current_and_waves_together_are_both() {
    for method in [Method::Physical, Method::Procedural] {
        let (still, both) = (follow(method, 0.05, 0.0, 20.0, 1.0), follow(method, 0.05, 0.06, 20.0, 20.0));
        let alone = follow(method, 0.0, 0.06, 20.0, 20.0);
        let lean = mean(&both) / mean(&still);
        assert!((0.85..1.15).contains(&lean), "{method:?}: leans {lean} as far");
        let sway = amplitude_at(&both, 5.0) / amplitude_at(&alone, 5.0);
        assert!((0.7..1.15).contains(&sway), "{method:?}: sways {sway} as far");
    }
}

#[test]
fn the_tip_comes_behind_the_base_in_waves() {
    let mut bed = alone(usual_blade());
    let camera = camera(PLACE + DVec3::new(0.0, 0.5, 4.0), PLACE);
    let levels = Levels { contact: 0.0, ..Levels::none() };
    // cos and sin parts of the motion of the first segment's end and of the tip.
    let (mut base, mut tip) = ([0.0; 2], [0.0; 2]);
    for step in 0..1500 {
        let time = f64::from(step + 1) * DT;
        bed.step(&around(&[], &[swell(0.05, 5.0, time)], &camera), &levels);
        let nodes = nodes(&mut bed, 0);
        let phase = core::f64::consts::TAU * time / 5.0;
        for (part, wave) in [phase.cos(), phase.sin()].into_iter().enumerate().filter(|_| step >= 600) {
            base[part] += wave * (nodes[2].x - nodes[0].x);
            tip[part] += wave * (nodes[10].x - nodes[0].x);
        }
    }
    let behind = (tip[1].atan2(tip[0]) - base[1].atan2(base[0])).to_degrees();
    assert!((1.0..120.0).contains(&behind), "{behind}");
}

/// A stiff segment without drag in a swell: k φ = (water that is carried along) · (its acceleration) · L/2,
/// in phase with it.
#[test]
fn the_orbits_second_derivative_pushes_by_the_water_carried_along() {
    let (k, carried, length) = (5.0, 0.8, 0.4);
    let like = reef_seaweed_model::skeleton::Segment {
        stiffness: k,
        carried,
        length,
        drag: 0.0,
        lift: 0.0,
        mass: 0.01,
        // Bends about Z, in the swell's plane.
        theta: core::f64::consts::FRAC_PI_2,
        ..Default::default()
    };
    for method in [Method::Physical, Method::Procedural] {
        let mut bed = alone(skeleton(&[like]));
        bed_without_lag(&mut bed);
        let camera = camera(PLACE + DVec3::new(0.0, 0.5, 4.0), PLACE);
        let levels = Levels { method, contact: 0.0, blend: 0.0, ..Levels::none() };
        let (mut found, mut expected) = ([0.0; 2], 0.0);
        for step in 0..1200 {
            let time = f64::from(step) * DT;
            let wave = swell(0.4, 5.0, time);
            bed.step(&around(&[], &[wave], &camera), &levels);
            let omega = f64::from(wave.frequency);
            let (kh, ky) = (f64::from(wave.wave_number) * DEPTH, f64::from(wave.wave_number) * (DEPTH - 9.8));
            expected = 0.4 * omega * omega * ky.cosh() / kh.sinh() * carried * 0.5 * length / k;
            let x = tip(&mut bed, 0).x / length;
            for (part, wave) in [(omega * time).cos(), (omega * time).sin()].into_iter().enumerate() {
                if step >= 600 {
                    found[part] += 2.0 / 600.0 * wave * x;
                }
            }
        }
        let amplitude = found[0].hypot(found[1]);
        assert!((amplitude / expected - 1.0).abs() < 0.05, "{method:?}: {amplitude}, expected {expected}");
    }
}

/// A copy whose procedural method has no lag.
fn bed_without_lag(bed: &mut reef_seaweed_model::bed::Bed) {
    let kinds = bed.kinds().iter().map(|kind| reef_seaweed_model::bed::Kind { lag: 0.0, ..kind.clone() });
    *bed = reef_seaweed_model::bed::Bed::new(kinds.collect(), bed.plants().to_vec());
}
