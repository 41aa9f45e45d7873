//! The waves over a whole plant, to first order, held against linear theory.

use core::f64::consts::TAU;

use reef_abi::{self as abi, Wave};
use reef_flow::{
    Level,
    waves::{
        Choice, Lens, Places, Rule, Surges, Swell, dispersion, reference,
        surge::{LANES, Seen, surges},
    },
};

use crate::common::Random;

fn train(amplitude: f64, wave_number: f64, depth: f64, heading: f64, phase: f64) -> Wave {
    Wave {
        amplitude: amplitude as f32,
        wave_number: wave_number as f32,
        frequency: dispersion::frequency(wave_number, depth) as f32,
        phase: phase as f32,
        direction: [heading.cos() as f32, heading.sin() as f32],
        ..Wave::default()
    }
}

/// Trains from 40 m to 0.4 m long, the longest first.
fn sea(depth: f64) -> Vec<Wave> {
    let wave = |i: u32| {
        let k = TAU / 40.0 * 1.17_f64.powi(i as i32);
        train(0.02 / k.sqrt(), k, depth, 0.3 * f64::from(i), 1.7 * f64::from(i))
    };
    (0..30).map(wave).collect()
}

fn swell(waves: &[Wave], depth: f64) -> Swell {
    let mut swell = Swell::default();
    swell.fill(waves.iter(), depth);
    swell
}

/// What one place feels whose positions are relative to itself.
fn felt(level: Level, swell: &Swell, seen: Option<Seen<'_>>, at: [f64; 3], radius: f64) -> Surges {
    let (mut places, mut out) = (Places::default(), Surges::default());
    places.set(3, at, radius, at);
    surges(level, swell, seen, 1.0, &[places], core::slice::from_mut(&mut out));
    Surges::all(&out, 3)
}

fn length(v: [f64; 3]) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    length([a[0] - b[0], a[1] - b[1], a[2] - b[2]])
}

#[test]
fn a_surge_is_the_orbital_velocity_and_its_gradient() {
    for (k, depth) in [(2.0, 20.0), (0.6, 5.0), (0.02, 4.0)] {
        for share in [0.0, 0.3, 0.7, 0.99] {
            for phase in [0.0, 0.9, 2.5, 4.4] {
                let wave = [train(0.2, k, depth, 0.8, phase)];
                let at = [3.0, -share * depth, -7.0];
                let surge = felt(Level::best(), &swell(&wave, depth), None, at, 1e-3);
                let truth = |p: [f64; 3]| {
                    reference::orbit(&wave, depth, core::array::from_fn(|axis| at[axis] + p[axis]))[1]
                };
                // The speed at the greatest phase; f32 numbers, and a millionth of r where the bed is left
                // out.
                let speed = 0.2 * f64::from(wave[0].frequency) * reference::axes(k, depth, at[1])[0];
                let surface = 0.2 * f64::from(wave[0].frequency);
                let allowed = 2e-6 * speed + 1e-6 * surface;
                assert!(apart(surge.velocity_of(0, [0.0; 3]), truth([0.0; 3])) < allowed, "{k} {share}");
                // Off the place by q = k d: wrong by q²/2.
                let d = 0.01 / k;
                for p in [[d, 0.0, 0.0], [0.0, d, 0.0], [0.0, 0.0, d], [-d, 0.0, d]] {
                    if at[1] + p[1] > 0.0 {
                        continue;
                    }
                    let error = apart(surge.velocity_of(0, p), truth(p));
                    assert!(
                        error < 2e-4 * speed + 1e-6 * surface,
                        "{error} of {speed} at {p:?}, k {k}, share {share}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_gradient_has_no_turn_no_source_and_no_more_than_its_bound() {
    let (depth, mut random) = (6.0, Random(5));
    let swell = swell(&sea(depth), depth);
    for _ in 0..200 {
        let at = [random.within(-50.0, 50.0), random.within(-5.9, 0.0), random.within(-50.0, 50.0)];
        let surge = felt(Level::best(), &swell, None, at, 0.05);
        let still = surge.velocity_of(0, [0.0; 3]);
        let row = |p: [f64; 3]| {
            let v = surge.velocity_of(0, p);
            [v[0] - still[0], v[1] - still[1], v[2] - still[2]]
        };
        let [x, y, z] = [row([1.0, 0.0, 0.0]), row([0.0, 1.0, 0.0]), row([0.0, 0.0, 1.0])];
        let bound: [f32; LANES] = reef_flow::dispatch!(Level::best(), simd => surge.steepness(simd).into());
        let bound = f64::from(bound[0]);
        let most = [x, y, z].into_iter().map(length).fold(0.0, f64::max);
        assert!(most <= bound * 1.00001 && bound < 2.0 * most, "{most} {bound}");
        assert!((x[0] + y[1] + z[2]).abs() < 1e-5 * bound, "no source");
        assert!((x[1] - y[0]).abs() + (x[2] - z[0]).abs() + (y[2] - z[1]).abs() < 1e-5 * bound, "no turn");
    }
}

#[test]
fn a_plant_far_away_keeps_its_phase() {
    let depth = 8.0;
    let waves = sea(depth);
    let swell = swell(&waves, depth);
    for far in [1e5, 1e6] {
        let at = [far + 0.123, -3.0, -2.0 * far + 0.456];
        let error = apart(
            felt(Level::best(), &swell, None, at, 1e-3).velocity_of(0, [0.0; 3]),
            reference::orbit(&waves, depth, at)[1],
        );
        // The reference's own f64 angle errs by 1e-9 of a turn; f32 positions would by a thousandth.
        assert!(error < 2e-6, "{error} at {far}");
    }
}

#[test]
fn a_place_has_the_same_bytes_at_every_level_and_among_any_others() {
    let (depth, mut random) = (5.0, Random(9));
    let waves = sea(depth);
    let swell = swell(&waves, depth);
    let mut choice = Choice::default();
    let lens = Lens { focal: 400.0, corner: 1.6 };
    choice.update(&waves, depth, lens, 1.0, Rule::Sum, [-depth, 0.0]);
    let selection = choice.selection().expect("made");
    let seen = Some(Seen { selection, eye: [0.0, -2.0, 0.0] });
    let all: Vec<([f64; 3], f64)> = (0..40)
        .map(|_| {
            let at = [random.within(-60.0, 60.0), random.within(-5.0, 0.0), random.within(-60.0, 60.0)];
            (at, random.within(0.01, 0.6))
        })
        .collect();
    let mut places = vec![Places::default(); all.len().div_ceil(LANES)];
    for (i, (at, radius)) in all.iter().enumerate() {
        places[i / LANES].set(i % LANES, *at, *radius, *at);
    }
    for level in Level::all() {
        let mut out = vec![Surges::default(); places.len()];
        surges(level, &swell, seen, 1.0, &places, &mut out);
        for (i, (at, radius)) in all.iter().enumerate() {
            let alone = felt(Level::scalar(), &swell, seen, *at, *radius);
            assert!(Surges::all(&out[i / LANES], i % LANES) == alone, "{i} at {}", level.name());
        }
    }
}

#[test]
fn a_train_fades_as_it_gets_shorter_than_the_plant() {
    let share = |q: f64| {
        let k = 4.0;
        let wave = [train(0.1, k, 9.0, 0.0, 1.0)];
        let at = [0.2, -0.4, 0.0];
        let surge = felt(Level::best(), &swell(&wave, 9.0), None, at, q / k);
        length(surge.velocity_of(0, [0.0; 3])) / length(reference::orbit(&wave, 9.0, at)[1])
    };
    assert!((share(0.1) - 1.0).abs() < 1e-5 && (share(1.0) - 1.0).abs() < 1e-5);
    assert!((share(1.5) - 0.5).abs() < 1e-4 && share(2.0) < 1e-6 && share(50.0) == 0.0);
    // Nothing jumps.
    let mut before = share(0.9);
    for i in 1..130 {
        let now = share(0.9 + 0.01 * f64::from(i));
        assert!(now <= before + 1e-6 && before - now < 0.016, "{before} {now}");
        before = now;
    }
}

#[test]
fn what_is_left_out_from_afar_moves_water_by_less_than_the_threshold() {
    let depth = 6.0;
    let waves = sea(depth);
    let lens = Lens::new(&abi::Camera { fov_y: 1.0, width: 1280, height: 720, ..abi::Camera::default() });
    let mut choice = Choice::default();
    choice.update(&waves, depth, lens, 1.0, Rule::Sum, [-depth, 0.0]);
    let mut ordered = Swell::default();
    ordered.fill(choice.in_order(&waves), depth);
    let selection = choice.selection().expect("made");
    let (mut dropped, mut random) = (0, Random(2));
    for _ in 0..300 {
        let distance = random.within(0.5, 60.0);
        let at = [distance, random.within(-6.0, -0.2), 0.0];
        let seen = Some(Seen { selection, eye: [0.0, at[1], 0.0] });
        let [all, chosen] =
            [None, seen].map(|seen| felt(Level::best(), &ordered, seen, at, 0.01).velocity_of(0, [0.0; 3]));
        let fastest = waves.iter().map(|wave| f64::from(wave.frequency)).fold(0.0, f64::max);
        let error = apart(all, chosen) / fastest * lens.focal / distance;
        assert!(error < 1.0, "{error} px at {at:?}");
        dropped += usize::from(all != chosen);
    }
    assert!(dropped > 150, "{dropped}: the choice leaves something out");
}
