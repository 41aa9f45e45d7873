//! Anemones and seagrasses among the waves: orbital velocity by linear theory, alone and among others, at any
//! time step.

use std::f64::consts::TAU;

use glam::DVec3;
use reef_anemone_model::{
    bed::{Bed, Settings, Surroundings},
    config::{Anemone, Config, FibreGrid, Scatter},
};
use reef_flow::{
    Level,
    waves::{dispersion, reference},
};
use reef_sdk::abi::{Camera, Wave};

use crate::{
    bed::info,
    common::{DT, current},
    own_flow,
    scene::*,
};

const DEPTH: f64 = 6.0;

/// One train along x at a time [s]; `phase`: ψ at the origin at time 0.
pub fn train(amplitude: f64, length: f64, phase: f64, time: f64) -> Wave {
    let k = TAU / length;
    let omega = dispersion::frequency(k, DEPTH);
    Wave {
        amplitude: amplitude as f32,
        wave_number: k as f32,
        frequency: omega as f32,
        phase: (phase - omega * time).rem_euclid(TAU) as f32,
        direction: [1.0, 0.0],
        ..Wave::default()
    }
}

/// A swell, and shorter trains over it.
pub fn sea(time: f64) -> Vec<Wave> {
    let wave = |i: u32| {
        let wave = train(0.1 / f64::from(i + 1), 30.0 / f64::from(i + 1), 2.1 * f64::from(i), time);
        let heading = 0.4 * f64::from(i);
        Wave { direction: [heading.cos() as f32, heading.sin() as f32], ..wave }
    };
    (0..12).map(wave).collect()
}

/// Steps a bed in waves that `at` gives for each time [s]; calls `then` after each step.
fn sway(
    bed: &mut Bed,
    around: &Surroundings<'_>,
    settings: &Settings,
    steps: usize,
    at: impl Fn(f64) -> Vec<Wave>,
    mut then: impl FnMut(&Bed, &[[f32; 4]]),
) {
    let mut nodes = vec![[0.0; 4]; bed.node_count()];
    for step in 0..steps {
        let waves = at(step as f64 * around.dt);
        let around = Surroundings { waves: &waves, depth: DEPTH, ..*around };
        bed.step(&around, settings, &mut nodes);
        then(bed, &nodes);
    }
}

/// One upright fibre of the default tentacle, its root at a place.
fn fibre(position: [f64; 3]) -> Bed {
    let grid = FibreGrid { count: [1, 1], position, ..FibreGrid::default() };
    grow(&info(&[]), &Config { fibres: vec![grid], ..Config::default() })
}

fn tip(bed: &Bed) -> DVec3 {
    bed.trace().last().map(|node| DVec3::from(node.position)).expect("a fibre")
}

/// Where the tip rests, over its root, when time stands still.
fn rest(position: [f64; 3], around: &Surroundings<'_>, waves: &[Wave]) -> DVec3 {
    let mut bed = fibre(position);
    sway(&mut bed, around, &Settings::default(), 2000, |_| waves.to_vec(), |_, _| ());
    tip(&bed) - DVec3::from(position)
}

#[test]
fn a_fibre_bends_in_a_train_as_in_a_current_of_its_orbital_velocity() {
    let still = Surroundings::default();
    let upright = rest([0.0, -3.0, 0.0], &still, &[]);
    for depth in [0.5, 2.0, 4.0, 5.9] {
        for phase in [0.4, 1.6, 3.0, 5.1] {
            let root = [0.7, -depth, -0.3];
            let wave = [train(0.1, 25.0, phase, 0.0)];
            // Half of the fibre's 54 mm up.
            let middle = [root[0], root[1] + 0.027, root[2]];
            let velocity = DVec3::from(reference::orbit(&wave, DEPTH, middle)[1]);
            let flow = [current(velocity)];
            let (swayed, flown) =
                (rest(root, &still, &wave), rest(root, &Surroundings { flow: &flow, ..still }, &[]));
            let bent = flown.distance(upright);
            // Over a length of 54 mm a train of 25 m changes by 1.4 %.
            assert!(swayed.distance(flown) < 0.015 * bent + 1e-6, "{depth} {phase}: {swayed} {flown}");
            assert!(bent > 1e-4, "{depth} {phase}: the load is felt: {bent}");
        }
    }
}

/// Half the swing of a tip along x [m], its phase at time 0 against a cosine [rad], and its mean [m], over
/// whole periods.
fn swing(position: [f64; 3], length: f64, dt: f64) -> [f64; 3] {
    let omega = dispersion::frequency(TAU / length, DEPTH);
    let period = (TAU / omega / dt).round() as usize;
    let mut bed = fibre(position);
    let around = Surroundings { dt, ..Surroundings::default() };
    let (mut step, mut sums) = (0, [0.0; 3]);
    sway(
        &mut bed,
        &around,
        &Settings::default(),
        5 * period,
        |time| vec![train(0.04, length, 0.0, time)],
        |bed, _| {
            step += 1;
            if step > 2 * period {
                // The waves of a step are those of its beginning.
                let angle = omega * f64::from(step as u32 - 1) * dt;
                let x = tip(bed).x - position[0];
                sums = [sums[0] + x * angle.cos(), sums[1] + x * angle.sin(), sums[2] + x];
            }
        },
    );
    let scale = 2.0 / (3 * period) as f64;
    let [c, s] = [sums[0] * scale, sums[1] * scale];
    [c.hypot(s), s.atan2(c), 0.5 * scale * sums[2]]
}

#[test]
fn the_swing_falls_with_depth_as_the_orbits_do() {
    let length = 25.0;
    let k = TAU / length;
    let at = |y: f64| swing([0.0, y - 0.027, 0.0], length, DT)[0];
    let top = at(-1.0);
    assert!(top > 2e-3, "{top} m");
    for y in [-2.0, -3.5, -5.9] {
        let ratio = at(y) / top;
        let wanted = reference::axes(k, DEPTH, y)[0] / reference::axes(k, DEPTH, -1.0)[0];
        // A bend that grows a little less than its load does: a few degrees at most.
        assert!((ratio / wanted - 1.0).abs() < 0.02, "{y}: {ratio} for {wanted}");
    }
}

#[test]
fn a_quarter_of_a_wave_apart_fibres_swing_a_quarter_of_a_turn_apart() {
    let length = 25.0;
    let phase = |x: f64| swing([x, -4.0, 0.0], length, DT)[1];
    let here = phase(0.0);
    for quarters in 1..4 {
        let lag = (phase(0.25 * length * f64::from(quarters)) - here).rem_euclid(TAU);
        // Crests go toward +x.
        assert!((lag - 0.25 * TAU * f64::from(quarters)).abs() < 0.01, "{quarters}: {lag}");
    }
}

#[test]
fn a_long_step_sways_a_fibre_as_a_short_one_does() {
    // 24 m over 6 m of water: 4.1 s.
    let [short, phase, mean] = swing([0.0, -4.0, 0.0], 24.0, DT);
    let [long, late, _] = swing([0.0, -4.0, 0.0], 24.0, 1.0 / 30.0);
    assert!((long / short - 1.0).abs() < 0.03, "{long} {short}");
    // The pose at a step's end follows the water of its beginning.
    assert!((late - phase).abs() < 0.06, "{late} {phase}");
    assert!(mean.abs() < 0.03 * short, "a swell drives nobody away: {mean}");
}

#[test]
fn without_the_parameter_waves_there_are_none_bit_for_bit() {
    let flow = [current(DVec3::new(0.05, 0.0, 0.02))];
    let run = |waves: f32, sea: fn(f64) -> Vec<Wave>| {
        let mut bed = own_flow::meadow();
        let around = Surroundings { flow: &flow, ..Surroundings::default() };
        let mut last = Vec::new();
        sway(&mut bed, &around, &Settings { waves, ..Settings::default() }, 60, sea, |_, nodes| {
            last = nodes.to_vec();
        });
        last
    };
    let without = run(1.0, |_| Vec::new());
    assert!(run(0.0, sea) == without);
    assert!(run(1.0, sea) != without, "and with it there are");
}

#[test]
fn every_instruction_set_and_a_loaded_state_sway_alike() {
    let flow = [current(DVec3::new(0.05, 0.0, 0.02))];
    let eye = Camera { position: [0.5, -1.0, 4.0], fov_y: 0.9, width: 640, height: 360, ..Camera::default() };
    let run = |bed: &mut Bed, level: Level, from: f64| {
        let around = Surroundings { flow: &flow, level, camera: Some(&eye), ..Surroundings::default() };
        let mut last = Vec::new();
        sway(
            bed,
            &around,
            &Settings::default(),
            40,
            |time| sea(from + time),
            |_, nodes| last = nodes.to_vec(),
        );
        last
    };
    let mut bed = own_flow::meadow();
    let nodes = run(&mut bed, Level::scalar(), 0.0);
    for level in Level::all() {
        assert!(run(&mut own_flow::meadow(), level, 0.0) == nodes, "{}", level.name());
    }
    let state = bed.save();
    let mut loaded = own_flow::meadow();
    run_at(&mut loaded, &[], 0.0, 1, Level::best());
    loaded.load(&state).expect("its own state");
    assert!(run(&mut loaded, Level::best(), 7.0) == run(&mut bed, Level::best(), 7.0));
}

#[test]
fn fibres_far_apart_in_one_patch_feel_the_waves_where_they_stand() {
    // Two metres apart: one object of eight by eight.
    let grid = FibreGrid { count: [8, 8], spacing: 2.0, position: [3.0, -4.0, 1.0], ..FibreGrid::default() };
    let mut patch = grow(&info(&[]), &Config { fibres: vec![grid], ..Config::default() });
    let around = Surroundings::default();
    sway(&mut patch, &around, &Settings::default(), 200, sea, |_, _| ());
    let all: Vec<_> = patch.trace().collect();
    for fibre_of_patch in all.chunks(10).step_by(7) {
        let root = fibre_of_patch[0].position;
        let mut alone = fibre(root);
        sway(&mut alone, &around, &Settings::default(), 200, sea, |_, _| ());
        let bent = tip(&alone) - DVec3::from(root);
        let here = DVec3::from(fibre_of_patch[9].position) - DVec3::from(root);
        assert!((bent - DVec3::Y * 0.054).length() > 5e-4, "{bent}");
        assert!(here.distance(bent) < 1e-6, "{here} {bent} at {root:?}");
    }
}

#[test]
fn a_plant_far_from_the_worlds_middle_sways_as_one_there_does() {
    let length = 25.0;
    let tracks = [0.0, 1000.0].map(|waves| {
        let mut bed = fibre([waves * length, -4.0, 0.0]);
        // A wave number that f32 holds exactly would be luck: what the train has of it counts.
        let k = f64::from(train(0.1, length, 0.0, 0.0).wave_number);
        let shift = (waves * length * k).rem_euclid(TAU);
        let mut track = Vec::new();
        sway(
            &mut bed,
            &Surroundings::default(),
            &Settings::default(),
            300,
            |time| vec![train(0.1, length, -shift, time)],
            |bed, _| track.push(tip(bed).x - waves * length),
        );
        track
    });
    let most = tracks[0].iter().zip(&tracks[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // A phase in f32: 2e-7 of a turn, of a swing of 8 mm.
    assert!(most < 1e-7, "{most}");
}

#[test]
fn a_step_in_steep_waves_is_taken_in_parts() {
    // Without a time to follow in, a step at once jumps to where the loads of the pose before it lead.
    let soft = FibreGrid {
        count: [1, 1],
        position: [0.0, -0.7, 0.0],
        length: 0.02,
        stiffness: 1.0,
        relaxation: 0.0,
        ..FibreGrid::default()
    };
    let config = Config { fibres: vec![soft], ..Config::default() };
    let waves = vec![train(0.35, 3.5, 1.6, 0.0)];
    let after = |steps: usize| {
        let mut bed = grow(&info(&[]), &config);
        let around = Surroundings::default();
        sway(&mut bed, &around, &Settings::default(), steps, |_| waves.clone(), |_, _| ());
        tip(&bed)
    };
    let (upright, once, rest) = (DVec3::new(0.0, -0.52, 0.0), after(1), after(1000));
    let (bent, left) = (rest.distance(upright), once.distance(rest));
    assert!(bent > 0.05 && left < 0.02 * bent, "{left} m of {bent} m are left after one step");
}

#[test]
fn a_walk_past_a_meadow_pops_nothing_and_leaves_out_what_nobody_sees() {
    let grass = Scatter {
        species: vec!["turtlegrass".into()],
        count: 12,
        center: [0.0, 0.0],
        size: [3.0, 2.0],
        spacing: 0.0,
        scale: [1.0, 1.0],
        grid: Some([4, 3]),
        seed: None,
    };
    let strawberry =
        Anemone { species: "actinia-fragacea".into(), position: [0.0; 3], scale: 1.0, yaw: 0.0, seed: None };
    let config = Config { scatter: vec![grass], anemones: vec![strawberry], ..Config::default() };
    let meadow = || grow(&own_flow::info(), &config);
    let heights = [-3.0_f32; 4];
    let ground =
        reef_sdk::Heightfield { heights: &heights, origin: [-5.0, -5.0], cell: 10.0, columns: 2, rows: 2 };
    let (mut chosen, mut all) = (meadow(), meadow());
    let mut nodes = vec![[0.0; 4]; chosen.node_count()];
    let every = Settings { trains: false, ..Settings::default() };
    let (mut differed, mut worst) = (0.0_f64, 0.0_f64);
    for step in 0..1500 {
        let waves = sea(f64::from(step) * DT);
        let far = 1.0 + 60.0 * f64::from((step - 750_i32).abs()) / 750.0;
        let camera =
            Camera { position: [far, -2.0, 0.5], fov_y: 0.9, width: 1280, height: 720, ..Camera::default() };
        let around = Surroundings {
            waves: &waves,
            depth: DEPTH,
            camera: Some(&camera),
            ground: Some(ground),
            ..Surroundings::default()
        };
        chosen.step(&around, &Settings::default(), &mut nodes);
        all.step(&around, &every, &mut nodes);
        let focal = 360.0 / (0.45_f64).tan();
        for (a, b) in tips(&chosen).iter().zip(tips(&all)) {
            let pixels = a.distance(b) * focal / a.distance(DVec3::from(camera.position));
            differed = differed.max(a.distance(b));
            worst = worst.max(pixels);
        }
    }
    assert!(differed > 1e-5, "something was left out: {differed} m");
    assert!(worst < 1.0, "nobody sees it: {worst} px");
}
