//! Orbits in all depths, by all kernels, and the surface above them.

use core::f64::consts::TAU;

use fearless_simd::{f32x8, prelude::*};
use reef_abi as abi;
use reef_flow::{
    Level,
    waves::{
        self, Surface, Trains,
        bare::{Bare, Scalar},
        reference,
    },
};

use super::{at, axes, carried, length, orbit, orbits, path, single, wind_sea};
use crate::common::Random;

#[test]
fn in_deep_water_an_orbit_is_a_circle_of_radius_r_exp_ky_and_period_two_pi_over_omega() {
    let depth = 40.0;
    for (wave_number, y) in [(0.8, 0.0), (0.8, -0.5), (0.8, -2.0), (3.0, -1.0), (1.3, -6.0)] {
        let train = single(0.3, wave_number, depth, 0.9);
        let radius = train.amplitude * (wave_number * y).exp();
        let path = path(&train, depth, [2.0, y, -1.5]);
        for p in &path {
            let seen = (p[0] * p[0] + p[1] * p[1]).sqrt();
            assert!((seen / radius - 1.0).abs() < 1e-4, "k {wave_number} y {y}: {seen} {radius}");
        }
        // Once round, and never nearly back before.
        let apart = |i: usize| ((path[i][0] - path[0][0]).powi(2) + (path[i][1] - path[0][1]).powi(2)).sqrt();
        assert!(apart(64) < 1e-4 * radius, "{}", apart(64));
        assert!((1..64).all(|i| apart(i) > 0.09 * radius), "k {wave_number} y {y}");
    }
}

#[test]
fn in_intermediate_water_an_orbit_is_an_ellipse_that_flattens_toward_the_bed() {
    let depth = 5.0;
    // λ/20 < h < λ/2.
    for wavelength in [12.0, 25.0, 80.0] {
        let k = TAU / wavelength;
        let train = single(0.3, k, depth, -2.0);
        let mut flatness = f64::INFINITY;
        for y in [0.0, -1.0, -2.5, -4.0, -4.9] {
            let [a, b] = [(k * (y + depth)).cosh(), (k * (y + depth)).sinh()]
                .map(|axis| train.amplitude * axis / (k * depth).sinh());
            for p in path(&train, depth, [1.0, y, 3.0]) {
                let on = (p[0] / a).powi(2) + (p[1] / b).powi(2);
                // The lesser axis near the bed is a difference of two exponentials.
                assert!((on - 1.0).abs() < 1e-4, "λ {wavelength} y {y}: {on}");
            }
            assert!(b / a < flatness, "flatter and flatter");
            flatness = b / a;
        }
        let [across, up] = axes(&path(&train, depth, [1.0, -depth, 3.0]));
        assert!(up < 2e-7 * train.amplitude && across > 0.0, "at the bed water only slides: {up}");
    }
}

#[test]
fn in_shallow_water_the_major_axis_is_constant_and_the_vertical_one_falls_linearly_to_the_bed() {
    let depth = 2.0;
    for wavelength in [60.0, 400.0, 1e5] {
        let k = TAU / wavelength;
        let kh = k * depth;
        let train = single(0.05, k, depth, 0.3);
        for share in [1.0, 0.75, 0.5, 0.25, 0.1] {
            let [across, up] = axes(&path(&train, depth, [0.0, depth * (share - 1.0), 0.0]));
            // cosh(kh) − 1 and sinh(kh)/kh − 1 are what linear theory itself departs by; 64 steps may miss
            // the furthest point by 1 − cos(π/64).
            let slack = 0.5 * kh * kh + 1.3e-3;
            assert!((across * kh / train.amplitude - 1.0).abs() < slack, "λ {wavelength} {share}: {across}");
            assert!((up / (train.amplitude * share) - 1.0).abs() < slack, "λ {wavelength} {share}: {up}");
        }
    }
}

#[test]
fn the_three_regimes_meet_without_a_step() {
    // Across both borders, k h = ½ and e^(−k h) = 1e-6, the orbit changes as little as k does.
    let depth = 3.0;
    for border in [0.5, 13.815_510_558] {
        for y in [0.0, -0.7, -1.5, -2.9] {
            let [below, above] = [1.0 - 2e-7, 1.0 + 2e-7].map(|factor| {
                let mut wave = single(0.2, border / depth, depth, 0.0).at(0.0);
                wave.wave_number = (border * factor / depth) as f32;
                orbit(&[wave], depth, [0.0, y, 0.0])
            });
            for part in 0..3 {
                for axis in 0..3 {
                    let gap = (below[part][axis] - above[part][axis]).abs();
                    // What the deep form leaves out, 1e-6 r at the bed; ω² is up to 45 there.
                    assert!(gap < 3e-7 * 45.0_f64.powf(0.5 * part as f64), "{border} {y}: {gap:e}");
                }
            }
        }
    }
}

#[test]
fn every_regime_is_linear_theory_from_the_surface_to_the_bed() {
    let depth = 4.0;
    for i in 0..120 {
        let kh = 0.05 * 1.055_f64.powi(i);
        let wave = single(0.2, kh / depth, depth, 1.0).at(0.0);
        let (k, r) = (f64::from(wave.wave_number), f64::from(wave.amplitude));
        for share in [0.0, 0.02, 0.3, 0.8, 0.97, 1.0] {
            let p = [0.0, -share * depth, 0.0];
            let (seen, truth) = (orbit(&[wave], depth, p)[0], reference::orbit(&[wave], depth, p)[0]);
            // What the deep form leaves out, and f32 of the greater axis.
            let slack = r * (1.05e-6 + 4e-7 * reference::axes(k, depth, 0.0)[0]);
            let error = length([0, 1, 2].map(|i| seen[i] - truth[i]));
            assert!(error < slack, "k h {kh}, {share}: {error:e} {slack:e}");
        }
    }
}

#[test]
fn the_signs_are_those_of_equation_2() {
    // As printed, in deep water: x with sin, y with −cos, of k·x − ω t; its phase is ours a quarter turn
    // later.
    let trains = wind_sea(5.0, 1e6, 30, 3);
    let random = &mut Random(5);
    for time in [0.0, 1.7, 33.0] {
        for _ in 0..40 {
            let p = [random.within(-9.0, 9.0), random.within(-3.0, 0.0), random.within(-9.0, 9.0)];
            let mut printed = [0.0; 3];
            for t in &trains {
                let (sine, cosine) = t.heading.sin_cos();
                let angle =
                    t.wave_number * (p[0] * cosine + p[2] * sine) - t.frequency * time + t.phase + 0.25 * TAU;
                let radius = t.amplitude * (t.wave_number * p[1]).exp();
                printed[0] += cosine * radius * angle.sin();
                printed[1] -= radius * angle.cos();
                printed[2] += sine * radius * angle.sin();
            }
            let [d, _, _] = orbit(&at(&trains, time), 1e6, p);
            // Angles of up to 4 turns in f32 err by 2e-6, the amplitudes sum to 2 m.
            assert!(length([0, 1, 2].map(|i| d[i] - printed[i])) < 4e-6, "{d:?} {printed:?}");
        }
    }
}

#[test]
fn a_crests_water_moves_with_the_wave_and_a_troughs_against_it() {
    for depth in [0.4, 4.0, 100.0] {
        let train = single(0.1, 0.9, depth, 2.2);
        let (sine, cosine) = train.heading.sin_cos();
        for time in [0.0, 0.9] {
            // The crest is where ψ is a quarter turn.
            for (quarter, sign) in [(0.25, 1.0), (0.75, -1.0)] {
                let far = (TAU * quarter - train.phase + train.frequency * time) / train.wave_number;
                let wave = [train.at(time)];
                let [d, v, a] = orbit(&wave, depth, [far * cosine, -0.1 * depth, far * sine]);
                let along = v[0] * cosine + v[2] * sine;
                assert!(sign * d[1] > 0.0 && sign * along > 0.0 && v[1].abs() < 1e-5 * along.abs());
                assert!(sign * a[1] < 0.0, "what is up falls");
                let [height, ..] = reference::surface(&wave, [far * cosine, far * sine]);
                assert!((height - sign * train.amplitude).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn velocity_and_acceleration_are_what_the_displacement_does_in_time() {
    for depth in [0.8, 6.0, 300.0] {
        let trains = wind_sea(4.0, depth, 30, 8);
        let h = 1e-4;
        for p in [[0.0, -0.1, 0.0], [3.0, -0.5, -2.0], [-7.0, -0.79, 5.0]] {
            // The differences in f64; the kernel's own are held against them.
            let [before, _, _] = reference::orbit(&at(&trains, 2.0 - h), depth, p);
            let [here, v64, a64] = reference::orbit(&at(&trains, 2.0), depth, p);
            let [after, _, _] = reference::orbit(&at(&trains, 2.0 + h), depth, p);
            let [_, v, a] = orbit(&at(&trains, 2.0), depth, p);
            for i in 0..3 {
                let speed = (after[i] - before[i]) / (2.0 * h);
                // f32 phases of up to 2π: 2.4e-7 of some decimetres over 2 h.
                assert!((v64[i] - speed).abs() < 5e-3 && (v[i] - v64[i]).abs() < 2e-6, "{depth} {p:?}");
                assert!((a[i] - a64[i]).abs() < 1e-5, "{depth} {p:?}: {} {}", a[i], a64[i]);
                assert!(here[i].is_finite());
            }
        }
    }
}

#[test]
fn no_depth_no_length_and_no_amplitude_gives_anything_but_numbers() {
    let sound = single(0.2, 1.0, 5.0, 0.3).at(1.0);
    let odd = [
        abi::Wave { amplitude: f32::NAN, ..sound },
        abi::Wave { amplitude: -1.0, ..sound },
        abi::Wave { wave_number: 0.0, ..sound },
        abi::Wave { wave_number: f32::INFINITY, ..sound },
        abi::Wave { phase: f32::NAN, ..sound },
        abi::Wave { wave_number: 1e30, ..sound },
        abi::Wave { wave_number: 1e-30, ..sound },
        abi::Wave { amplitude: 1e30, wave_number: 1e-20, ..sound },
        sound,
    ];
    let points = [[0.0; 3], [1.0, -1.0, 2.0], [1e6, -1e6, 1e6], [0.0, 1e6, 0.0], [0.0, -11_000.0, 0.0]];
    for depth in [f64::NAN, f64::NEG_INFINITY, -5.0, 0.0, 1e-300, 1e-30, 1e-6, 5.0, 1e5, 1e30, f64::INFINITY]
    {
        for (p, orbit) in points.iter().zip(orbits(Level::best(), &odd, depth, [0.0; 3], &points)) {
            assert!(orbit.iter().flatten().all(|v| v.is_finite()), "depth {depth}, {p:?}: {orbit:?}");
        }
    }
    let still = orbits(Level::best(), &[sound], -5.0, [0.0; 3], &points);
    assert!(still.iter().flatten().flatten().all(|v| *v == 0.0), "no water, no waves");
    let deep = orbits(Level::best(), &[sound], f64::INFINITY, [0.0; 3], &points);
    assert_eq!(deep[1], orbits(Level::best(), &[sound], 1e4, [0.0; 3], &points)[1]);
}

#[test]
fn the_lanes_agree_with_the_scalar_reference_in_f64() {
    for (wind, depth) in [(3.0, 1.0), (5.0, 5.0), (8.0, 20.0), (12.0, 4000.0)] {
        let waves = at(&wind_sea(wind, depth, 30, 6), 77.7);
        let mut random = Random(9);
        let points: Vec<[f32; 3]> = (0..203)
            .map(|_| {
                [random.within(-10.0, 10.0), -random.unit() * depth.min(15.0), random.within(-10.0, 10.0)]
                    .map(|c| c as f32)
            })
            .collect();
        // f32 angles of up to |k x| / 2π turns, and sums over 30 trains: what each train's own derivative
        // makes of them.
        let mut slack = [0.0; 3];
        for wave in &waves {
            let [r, k, omega] = [wave.amplitude, wave.wave_number, wave.frequency].map(f64::from);
            let wide = reference::axes(k, depth, 0.0)[0] * r;
            let angle = 4e-7 * (2.0 + k * 15.0);
            for (part, slack) in slack.iter_mut().enumerate() {
                *slack += wide * omega.powi(part as i32) * angle;
            }
        }
        for (p, seen) in points.iter().zip(orbits(Level::best(), &waves, depth, [0.0; 3], &points)) {
            let truth = reference::orbit(&waves, depth, p.map(f64::from));
            for part in 0..3 {
                let error = length([0, 1, 2].map(|i| f64::from(seen[part][i]) - truth[part][i]));
                assert!(error < slack[part], "{wind} {depth} {p:?} part {part}: {error:e} {:e}", slack[part]);
            }
        }
        assert!(slack[0] < 2e-4, "the tolerance itself stays below what anybody sees: {}", slack[0]);
    }
}

#[test]
fn the_bare_kernels_compute_the_same_orbits() {
    let waves = at(&wind_sea(5.0, 1e5, 30, 1), 3.0);
    let (mut bare, mut scalar) = (Bare::new(&waves), Scalar::new(&waves));
    scalar.step();
    for level in Level::all() {
        bare.step(level);
        for point in (0..512).step_by(37) {
            for (a, b) in bare.state(point).iter().zip(scalar.state(point)) {
                // f32 angles of up to 20 rad.
                assert!((a - b).abs() < 2e-5, "{} {point}: {a} {b}", level.name());
            }
        }
    }
    assert_eq!((bare.evaluations(), scalar.evaluations()), (512 * 30, 512 * 30));
}

#[test]
fn every_level_gives_the_same_bytes_wherever_the_slices_are_cut() {
    for (wind, depth) in [(3.0, 1.0), (6.0, 5.0), (12.0, 4000.0)] {
        let waves = at(&wind_sea(wind, depth, 30, 6), 12.3);
        let mut trains = Trains::new();
        trains.fill(&waves, depth, [100.0, -0.5, -3.0]);
        let mut random = Random(1);
        let axis = |random: &mut Random, low: f64, high: f64| -> Vec<f32> {
            (0..203).map(|_| random.within(low, high) as f32).collect()
        };
        let (x, y, z) =
            (axis(&mut random, -9.0, 9.0), axis(&mut random, -1.5, 0.5), axis(&mut random, -9.0, 9.0));
        let bits = |arrays: [Vec<f32>; 6]| arrays.map(|a| a.iter().map(|v| v.to_bits()).collect::<Vec<_>>());
        for count in [0, 7, usize::MAX] {
            let scalar = bits(carried(Level::scalar(), &trains, count, [&x, &y, &z]));
            for level in Level::all() {
                let whole = bits(carried(level, &trains, count, [&x, &y, &z]));
                assert!(whole == scalar, "{} differs from scalar, {wind} m/s, {count} trains", level.name());
                for (first, end) in [(0, 1), (5, 26), (17, 203)] {
                    let cut = [&x[first..end], &y[first..end], &z[first..end]];
                    let part = bits(carried(level, &trains, count, cut));
                    assert!((0..6).all(|i| part[i] == scalar[i][first..end]), "{first}..{end}");
                }
            }
        }
        // All nine numbers of a kernel, too.
        let points: Vec<[f32; 3]> = (0..203).map(|i| [x[i], y[i], z[i]]).collect();
        let all = |level| {
            let nine = orbits(level, &waves, depth, [0.0; 3], &points);
            nine.iter().flatten().flatten().map(|v| v.to_bits()).collect::<Vec<_>>()
        };
        assert!(Level::all().into_iter().all(|level| all(level) == all(Level::scalar())));
    }
}

#[test]
fn the_surface_is_where_orbits_at_still_water_are_and_its_normal_follows_its_slope() {
    let depth = 8.0;
    let waves = at(&wind_sea(6.0, depth, 30, 11), 5.0);
    let mut trains = Trains::new();
    trains.fill(&waves, depth, [0.0; 3]);
    let mut random = Random(2);
    for _ in 0..50 {
        let [x, _, z] = random.point(12.0);
        let five: [[f32; 8]; 4] = reef_flow::dispatch!(Level::best(), simd => {
            let p = [f32x8::splat(simd, x as f32), f32x8::splat(simd, z as f32)];
            let Surface { height, normal: [nx, ny, nz] } = waves::surface(simd, &trains, usize::MAX, p);
            [height.into(), nx.into(), ny.into(), nz.into()]
        });
        let [height, nx, ny, nz] = five.map(|lanes| f64::from(lanes[0]));
        let [truth, sx, sz] = reference::surface(&waves, [x, z]);
        assert!((height - truth).abs() < 1e-5, "{height} {truth}");
        assert!((nx / ny + sx).abs() < 1e-5 && (nz / ny + sz).abs() < 1e-5);
        assert!((length([nx, ny, nz]) - 1.0).abs() < 1e-6 && ny > 0.0);
        let [d, _, _] = orbit(&waves, depth, [x, 0.0, z]);
        assert!((d[1] - height).abs() < 1e-5, "{} {height}", d[1]);
    }
}

#[test]
fn orbits_are_the_same_from_any_origin_and_a_day_later() {
    let depth = 5.0;
    let trains = wind_sea(5.0, depth, 30, 3);
    let day = 86_400.0;
    let (waves, later) = (at(&trains, 1.25), at(&trains, day));
    for wave in &later {
        assert!((0.0..=TAU as f32).contains(&wave.phase));
    }
    for (a, b) in trains.iter().zip(&later) {
        // ω t of 5e5 rad carries 1e-10 in f64; the f32 of the result 2.4e-7.
        let exact = (a.phase - a.frequency * day).rem_euclid(TAU);
        assert!((f64::from(b.phase) - exact).abs() < 3e-7);
    }
    let near = orbits(Level::best(), &waves, depth, [0.0; 3], &[[2.25, -1.5, -0.75]])[0];
    let far = orbits(Level::best(), &waves, depth, [2.0, -1.0, -1.0], &[[0.25, -0.5, 0.25]])[0];
    for i in 0..3 {
        assert!((near[0][i] - far[0][i]).abs() < 2e-6 && (near[1][i] - far[1][i]).abs() < 4e-6);
    }
}
