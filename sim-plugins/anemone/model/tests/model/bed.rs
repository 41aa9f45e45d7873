//! What must hold for plants: the paper's counts and figures, species, states, bad input.

use glam::DVec3;
use reef_anemone_model::{
    Anemones,
    bed::{Settings, Surroundings},
    config::{Anemone, Config, FibreGrid, Scatter, Tuft},
};
use reef_flow::Level;
use reef_sdk::{
    Heightfield, SceneInfo,
    abi::{self, Flow},
};

use crate::common::{current, local};
use crate::scene::*;

const DT: f64 = 1.0 / 60.0;
/// Metres per unit of the figures' scenes.
const UNIT: f64 = 0.01;

/// A singularity in the figures' units.
pub fn figure_flow(kind: u32, at: [f64; 3], strength: f32) -> Flow {
    let unit = UNIT as f32;
    local(kind, DVec3::from(at) * UNIT, strength * unit * unit * unit, 10.0 * unit, 5.0 * unit)
}

pub fn one_strawberry() -> Config {
    Config {
        anemones: vec![Anemone {
            species: "actinia-fragacea".into(),
            position: [0.0; 3],
            scale: 1.0,
            yaw: 30.0,
            seed: None,
        }],
        ..Config::default()
    }
}

pub fn info(names: &[&str]) -> SceneInfo {
    let none = serde_json::Map::new();
    SceneInfo {
        name: "test".into(),
        seed: 5,
        scale: 1.0,
        dt: DT,
        species: names.iter().map(|n| ((*n).to_owned(), species_table(n, &none).into())).collect(),
    }
}

#[test]
fn figure_13_has_the_papers_14760_nodes_and_126720_vertices() {
    let mut bed = bed("scenes/anemone-fig13-36-anemones.toml");
    assert_eq!(bed.plant_count(), 36);
    assert_eq!(bed.fibre_count(), 36 * 41);
    assert_eq!(bed.node_count(), 14_760);
    assert_eq!(bed.vertex_count(), 126_720);
    run(&mut bed, &[], DT, 1);
    assert_eq!(bed.trace().count(), 14_760);
    assert_eq!(bed.fibres().map(|f| u64::from(f.node_count) * u64::from(f.sides)).sum::<u64>(), 126_720);
}

#[test]
fn every_species_of_the_assets_grows_and_has_the_room_that_it_asks_for() {
    let names = species_names();
    for wanted in
        ["actinia-fragacea", "anthopleura-xanthogrammica", "stomphia-coccinea", "anthothoe-chilensis"]
    {
        assert!(names.iter().any(|name| name == wanted), "{wanted}");
    }
    for name in &names {
        let config = Config {
            anemones: vec![Anemone {
                species: name.clone(),
                position: [0.0; 3],
                scale: 1.0,
                yaw: 0.0,
                seed: None,
            }],
            ..Config::default()
        };
        let (bed, remarks) = Anemones::plant(&info(&[name]), &config).unwrap_or_else(|e| panic!("{e}"));
        assert!(remarks.is_empty(), "{remarks:?}");
        let species = species(name);
        assert_eq!(bed.fibre_count(), species.tentacles.count as usize + usize::from(species.has_foot()));
    }
}

#[test]
fn figure_12_a_source_pushes_out_a_hole_pulls_in_and_a_whirlwind_turns() {
    let singularity = [0.0, 88.0, 0.0];
    let moved = |kind| {
        let mut bed = bed("scenes/anemone-fig12-singularities.toml");
        run(&mut bed, &[], DT, 1);
        let rest = tips(&bed);
        run(&mut bed, &[figure_flow(kind, singularity, 1e4)], DT, 600);
        rest.into_iter().zip(tips(&bed)).collect::<Vec<_>>()
    };
    let center = DVec3::from(singularity) * UNIT;
    let flat = |v: DVec3| DVec3::new(v.x, 0.0, v.z);
    for (kind, sign) in [(abi::FLOW_SOURCE, 1.0), (abi::FLOW_HOLE, -1.0)] {
        let mut by_distance: Vec<(f64, f64)> = Vec::new();
        for (rest, tip) in moved(kind) {
            let out = flat(rest - center);
            let radial = flat(tip - rest).dot(out.normalize());
            assert!(radial * sign > 0.0, "kind {kind}, tip at rest {rest}, now {tip}");
            by_distance.push((out.length(), radial.abs()));
        }
        // The effect falls with distance: near fibres move more than far ones, ring by ring.
        let mean = |from: f64, to: f64| {
            let ring: Vec<f64> =
                by_distance.iter().filter(|(d, _)| *d >= from && *d < to).map(|(_, m)| *m).collect();
            ring.iter().sum::<f64>() / ring.len() as f64
        };
        assert!(mean(0.5, 1.2) > mean(1.2, 1.9) && mean(1.2, 1.9) > mean(1.9, 2.8), "kind {kind}");
    }
    // Tips near the axis wind about it by more than half a turn: their turns are added up on the way.
    let mut bed = bed("scenes/anemone-fig12-singularities.toml");
    run(&mut bed, &[], DT, 1);
    let rest = tips(&bed);
    let (mut before, mut turned) = (rest.clone(), vec![0.0; rest.len()]);
    for _ in 0..120 {
        run(&mut bed, &[figure_flow(abi::FLOW_WHIRLWIND, singularity, 1e4)], DT, 5);
        for ((turned, before), tip) in turned.iter_mut().zip(&mut before).zip(tips(&bed)) {
            let (a, b) = (flat(*before - center), flat(tip - center));
            // Positive along (p − C) × R.
            *turned += -a.cross(b).y.atan2(a.dot(b));
            *before = tip;
        }
    }
    for (turned, rest) in turned.iter().zip(&rest) {
        assert!(*turned > 0.0, "tip at rest {rest} turned by {turned} rad");
    }
}

#[test]
fn figure_15_the_tentacles_cross_from_away_to_toward_once_and_continuously() {
    let at = DVec3::new(0.18, 0.07, 0.0);
    let mut bed = grow(&info(&["actinia-fragacea"]), &one_strawberry());
    run(&mut bed, &[], DT, 1);
    let rest = tips(&bed);
    let (mut signs, mut last) = (Vec::new(), f64::NAN);
    let steps = 600;
    run(&mut bed, &[local(abi::FLOW_SOURCE, at, 0.004, 0.6, 0.01)], 0.2, 100);
    for step in 0..steps {
        let share = f64::from(step) / f64::from(steps);
        let strength = 0.004 * (1.0 - 2.0 * share) as f32;
        // Each intensity is held long enough that what is seen is the steady pose.
        run(&mut bed, &[local(abi::FLOW_SOURCE, at, strength, 0.6, 0.01)], 0.2, 3);
        let now = tips(&bed);
        let mean = rest.iter().zip(&now).map(|(r, n)| (*n - *r).dot((at - *r).normalize())).sum::<f64>()
            / rest.len() as f64;
        // Less than half a millimetre a step: nothing jumps.
        assert!(last.is_nan() || (mean - last).abs() < 5e-4, "step {step}: {last} {mean}");
        last = mean;
        if mean.abs() > 1e-6 {
            signs.push(mean > 0.0);
        }
    }
    assert_eq!(signs.windows(2).filter(|pair| pair[0] != pair[1]).count(), 1);
    assert!(!signs[0] && signs[signs.len() - 1], "away from the source first, toward the hole at last");
}

#[test]
fn figure_16_no_tip_jumps_while_a_fish_passes() {
    let mut bed = grow(&info(&["actinia-fragacea"]), &one_strawberry());
    run(&mut bed, &[], DT, 1);
    let mut before = tips(&bed);
    let mut furthest: f64 = 0.0;
    for step in 0..480 {
        let x = 0.6 - 1.2 * f64::from(step) / 480.0;
        let mut hole = local(abi::FLOW_HOLE, DVec3::new(x, 0.12, 0.01), 5e-3, 0.6, 0.012);
        (hole.reach, hole.fade) = (0.35, 0.5);
        run(&mut bed, &[hole], DT, 1);
        let now = tips(&bed);
        furthest = before.iter().zip(&now).map(|(b, n)| b.distance(*n)).fold(furthest, f64::max);
        before = now;
    }
    // A tentacle of 48 mm never moves by more than 6 mm in a sixtieth of a second: it sweeps, but does not
    // pop. The bound is a gain of 1 − exp(−dt/τ) ≈ 0.045 of the greatest way that a tip can have before it,
    // twice its length, with slack.
    assert!(furthest < 6e-3, "{furthest}");
    assert!(furthest > 1e-4, "the fish was felt");
}

#[test]
fn a_primitive_that_appears_or_vanishes_moves_no_tip_at_once() {
    let mut bed = grow(&info(&["actinia-fragacea"]), &one_strawberry());
    run(&mut bed, &[], DT, 1);
    for flow in [vec![local(abi::FLOW_SOURCE, DVec3::new(0.1, 0.1, 0.0), 2e-3, 0.5, 0.01)], vec![]] {
        let before = tips(&bed);
        run(&mut bed, &flow, DT, 1);
        let moved = before.iter().zip(tips(&bed)).map(|(b, n)| b.distance(n)).fold(0.0, f64::max);
        assert!(moved < 4e-3, "{moved}");
        run(&mut bed, &flow, DT, 200);
    }
}

#[test]
fn an_anemone_in_a_surge_leans_together_with_different_phases() {
    let mut bed = grow(&info(&["actinia-fragacea"]), &one_strawberry());
    let surge = |step: i32| {
        let mut flow = current(DVec3::X * 0.1);
        flow.modulation = 1.0;
        flow.phase =
            (std::f64::consts::TAU * f64::from(step) * DT / 6.0).rem_euclid(std::f64::consts::TAU) as f32;
        [flow]
    };
    let mut tracks: Vec<Vec<f64>> = Vec::new();
    for step in 0..1080 {
        run(&mut bed, &surge(step), DT, 1);
        if step >= 720 {
            tracks.push(tips(&bed).iter().map(|tip| tip.x).collect());
        }
    }
    // Phase of each tip's swing against the surge, by its first harmonic.
    let phase = |fibre: usize| {
        let (mut s, mut c) = (0.0, 0.0);
        for (i, row) in tracks.iter().enumerate() {
            let angle = std::f64::consts::TAU * (i as f64) * DT / 6.0;
            s += row[fibre] * angle.sin();
            c += row[fibre] * angle.cos();
        }
        (c.atan2(s).to_degrees(), s.hypot(c) / 180.0)
    };
    let swings: Vec<(f64, f64)> = (1..tracks[0].len()).map(phase).collect();
    let mean = swings.iter().map(|(p, _)| p).sum::<f64>() / swings.len() as f64;
    let spread = swings.iter().map(|(p, _)| (p - mean).abs()).fold(0.0, f64::max);
    let swing = swings.iter().map(|(_, a)| a).sum::<f64>() / swings.len() as f64;
    assert!(mean < -5.0 && mean > -90.0, "tips lag behind the surge: {mean}");
    assert!(spread > 3.0 && spread < 60.0, "together, but not in step: {spread}");
    assert!(swing > 2e-3, "the swing is seen: {swing} m");
}

#[test]
fn feet_and_tentacles_keep_their_lengths_while_both_move() {
    let mut bed = grow(&info(&["actinia-fragacea"]), &one_strawberry());
    let lengths = |bed: &reef_anemone_model::bed::Bed| {
        let nodes: Vec<_> = bed.trace().collect();
        nodes
            .windows(2)
            .filter(|pair| pair[0].object == pair[1].object)
            .map(|pair| DVec3::from(pair[0].position).distance(DVec3::from(pair[1].position)))
            .collect::<Vec<_>>()
    };
    run(&mut bed, &[], DT, 1);
    let rest = lengths(&bed);
    run(&mut bed, &[current(DVec3::new(1.0, 0.3, -0.5))], DT, 400);
    let worst = rest.iter().zip(lengths(&bed)).map(|(a, b)| (b / a - 1.0).abs()).fold(0.0, f64::max);
    // f32 positions up to 13 cm from the plant's origin: 7e-9 m in 4 mm.
    assert!(worst < 1e-5, "{worst}");
}

#[test]
fn roots_ride_on_the_top_of_the_foot() {
    let mut bed = grow(&info(&["actinia-fragacea"]), &one_strawberry());
    run(&mut bed, &[], DT, 1);
    let place = |bed: &reef_anemone_model::bed::Bed| {
        let nodes: Vec<_> = bed.trace().collect();
        let top = nodes.iter().rfind(|n| n.object == 0).map(|n| DVec3::from(n.position)).expect("a foot");
        let roots: Vec<DVec3> =
            nodes.iter().filter(|n| n.object > 0 && n.node == 0).map(|n| DVec3::from(n.position)).collect();
        (top, roots)
    };
    let (top, roots) = place(&bed);
    run(&mut bed, &[current(DVec3::X * 3.0)], DT, 300);
    let (moved, after) = place(&bed);
    assert!(moved.x - top.x > 2e-3, "the foot leans: {}", moved - top);
    for (a, b) in roots.iter().zip(&after) {
        // Carried rigidly: the distance to the top stays. 1e-7 m: f32 positions.
        assert!(((*a - top).length() - (*b - moved).length()).abs() < 1e-7);
    }
}

#[test]
fn every_instruction_set_gives_a_bed_the_same_bytes() {
    let bytes = |level| {
        let mut bed = grow(&info(&["actinia-fragacea"]), &one_strawberry());
        let flow = [
            current(DVec3::new(0.1, 0.0, 0.2)),
            local(abi::FLOW_HOLE, DVec3::new(0.1, 0.1, 0.0), 1e-3, 0.5, 0.01),
        ];
        let nodes = run_at(&mut bed, &flow, DT, 30, level);
        nodes.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>()
    };
    let scalar = bytes(Level::scalar());
    for level in Level::all() {
        assert!(bytes(level) == scalar, "{}", level.name());
    }
}

#[test]
fn a_bed_that_was_saved_and_loaded_goes_on_with_the_same_bytes() {
    let flow = [current(DVec3::new(0.15, 0.0, -0.1))];
    let make = || grow(&info(&["actinia-fragacea"]), &one_strawberry());
    let mut bed = make();
    run(&mut bed, &flow, DT, 40);
    let state = bed.save();
    let mut other = make();
    assert!(other.load(&state[1..]).unwrap_err().contains("numbers"));
    for (at, number) in [(3, f32::NAN), (3, 4.0), (11, -1e24), (state.len() - 1, 0.5)] {
        let mut damaged = state.clone();
        damaged[at] = number;
        assert!(other.load(&damaged).unwrap_err().contains("that no step leaves behind"), "{at}: {number}");
    }
    other.load(&state).expect("the same plants");
    assert_eq!(run(&mut other, &flow, 0.0, 1), run(&mut bed, &flow, 0.0, 1), "before any further step");
    assert_eq!(run(&mut other, &flow, DT, 20), run(&mut bed, &flow, DT, 20));
}

#[test]
fn a_step_of_no_time_changes_nothing() {
    let flow = [current(DVec3::X)];
    let mut bed = grow(&info(&["actinia-fragacea"]), &one_strawberry());
    let rest = run(&mut bed, &flow, 0.0, 1);
    assert_eq!(run(&mut bed, &flow, 0.0, 5), rest);
    assert_ne!(run(&mut bed, &flow, DT, 5), rest);
}

#[test]
fn figure_18_interpolated_fibres_keep_their_lengths_and_lie_between_their_guides() {
    let mut bed = bed("scenes/anemone-fig18-guides.toml");
    run(&mut bed, &[], DT, 600);
    let nodes: Vec<_> = bed.trace().collect();
    let mut lowest: f64 = f64::INFINITY;
    for pair in nodes.windows(2).filter(|pair| pair[0].object == pair[1].object) {
        let length = DVec3::from(pair[0].position).distance(DVec3::from(pair[1].position));
        assert!((length / (5.0 * UNIT) - 1.0).abs() < 1e-5, "{length}");
        lowest = lowest.min(pair[1].position[1]);
    }
    // Gravity bends guides and followers alike: the tips of the second tuft droop as those of the first do.
    let tips = tips(&bed);
    let mean = |range: std::ops::Range<usize>| {
        tips[range.clone()].iter().map(|t| t.y).sum::<f64>() / range.len() as f64
    };
    let (guides, plant) = (mean(0..50), mean(50..750));
    assert!((guides - plant).abs() < 0.1 * 45.0 * UNIT, "{guides} {plant}");
    assert!(guides < 0.9 * 45.0 * UNIT, "{guides}");
}

/// A flat bed at y = −1.
fn flat(heights: &[f32]) -> Heightfield<'_> {
    Heightfield { heights, origin: [-5.0, -5.0], cell: 10.0, columns: 2, rows: 2 }
}

#[test]
fn plants_stand_on_the_bed_and_their_tentacles_do_not_enter_it_or_a_rock() {
    let heights = [-1.0; 4];
    let rock = abi::Obstacle { id: 1, from: [0.12, -0.93, 0.0], delta: [0.0, 0.05, 0.0], radius: 0.06 };
    let deepest = |contact: f32| {
        let mut bed = grow(&info(&["actinia-fragacea"]), &one_strawberry());
        let mut nodes = vec![[0.0; 4]; bed.node_count()];
        let flow = [current(DVec3::new(0.5, -0.4, 0.0))];
        for _ in 0..400 {
            let around = Surroundings {
                flow: &flow,
                obstacles: &[rock],
                ground: Some(flat(&heights)),
                ..Surroundings::default()
            };
            bed.step(&around, &Settings { contact, ..Settings::default() }, &mut nodes);
        }
        let foot = bed.trace().next().expect("a foot").position;
        assert!((foot[1] + 1.0).abs() < 0.01, "the foot begins at the bed: {foot:?}");
        bed.trace()
            .filter(|n| n.object > 0)
            .map(|n| {
                let p = DVec3::from(n.position);
                let axis = DVec3::new(0.12, p.y.clamp(-0.93, -0.88), 0.0);
                (0.06 - p.distance(axis)).max(-1.0 - p.y)
            })
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let (without, with) = (deepest(0.0), deepest(4.0));
    assert!(without > 0.015, "without contacts they go through: {without}");
    // A penalty gives way in proportion to the load: a third of the way, in a strong current.
    assert!(with < 0.5 * without, "{with} of {without}");
}

#[test]
fn a_fibre_breaks_off_above_its_threshold_and_only_then() {
    let grid = |break_force| Config {
        fibres: vec![FibreGrid { count: [3, 1], break_force, ..FibreGrid::default() }],
        ..Config::default()
    };
    let left = |break_force, speed: f64| {
        let mut bed = grow(&info(&[]), &grid(break_force));
        run(&mut bed, &[current(DVec3::X * speed)], DT, 60);
        bed.fibres().count()
    };
    // Nine nodes in 0.2 m/s: ½ρLrV sums to about 0.011 N.
    assert_eq!(left(Some(0.02), 0.2), 3);
    assert_eq!(left(Some(0.005), 0.2), 0);
    assert_eq!(left(None, 1e6), 3);
}

#[test]
fn wild_counts_are_refused_with_the_limit_named() {
    let refuse = |config: Config, path: &str, limit: &str| {
        let error = Anemones::plant(&info(&["actinia-fragacea"]), &config).map(|_| ()).unwrap_err();
        assert!(error.path.starts_with(path) && error.message.contains(limit), "{error}");
    };
    let scatter = Scatter {
        species: vec!["actinia-fragacea".into()],
        count: 20_001,
        center: [0.0; 2],
        size: [1.0; 2],
        spacing: 0.0,
        scale: [1.0; 2],
        grid: None,
        seed: None,
    };
    refuse(Config { scatter: vec![scatter.clone()], ..Config::default() }, "scatter[0].count", "20000");
    refuse(
        Config { scatter: vec![Scatter { count: 19_999, ..scatter }], ..Config::default() },
        "scatter[0]",
        "400000",
    );
    let grid = FibreGrid { count: [1000, 1000], ..FibreGrid::default() };
    refuse(Config { fibres: vec![grid], ..Config::default() }, "fibres[0]", "400000");
    let tuft = Tuft { fibres: 10, guides: 20, ..Tuft::default() };
    refuse(Config { tufts: vec![tuft], ..Config::default() }, "tufts[0].fibres", "guides");
    let mut unknown = one_strawberry();
    unknown.anemones[0].species = "actinia".into();
    refuse(unknown, "anemones[0].species", "unknown species `actinia`; allowed: actinia-fragacea");
}

#[test]
fn plants_that_no_stream_takes_are_refused_where_they_stand() {
    let refuse = |config: Config, path: &str| {
        let error = Anemones::plant(&info(&["actinia-fragacea"]), &config).map(|_| ()).unwrap_err();
        assert!(error.path == path && error.message.contains("the limits are"), "{error}");
    };
    let grid = |grid: FibreGrid| Config { fibres: vec![FibreGrid::default(), grid], ..Config::default() };
    refuse(grid(FibreGrid { count: [1000, 1], spacing: 1e5, ..FibreGrid::default() }), "fibres[1]");
    refuse(grid(FibreGrid { nodes: 256, length: 1e5, ..FibreGrid::default() }), "fibres[1]");
    refuse(grid(FibreGrid { position: [0.0, -1e6, 0.0], ..FibreGrid::default() }), "fibres[1]");
    let tuft = Tuft { spread: 1e5, ..Tuft::default() };
    refuse(Config { tufts: vec![tuft], ..Config::default() }, "tufts[0]");
    let mut far = one_strawberry();
    far.anemones[0].position[2] = 1e15;
    refuse(far, "anemones[0]");
    for length in [0.0, 1e-300, -1.0] {
        let config = grid(FibreGrid { length, ..FibreGrid::default() });
        let error = Anemones::plant(&info(&[]), &config).map(|_| ()).unwrap_err();
        assert_eq!(error.path, "fibres[1].length");
    }
}

#[test]
fn a_crowded_disc_is_told() {
    let mut scene = info(&["actinia-fragacea"]);
    scene.species["actinia-fragacea"]["tentacles"]["count"] = 4000.into();
    let (_, remarks) = Anemones::plant(&scene, &one_strawberry()).expect("fewer tentacles are no error");
    assert!(remarks[0].contains("room for") && remarks[0].contains("4000"), "{remarks:?}");
}

#[test]
fn bounding_spheres_save_evaluations_without_changing_a_byte() {
    let run_with = |far: bool| {
        let mut bed = bed("scenes/anemone-fig13-36-anemones.toml");
        let mut flow = vec![local(abi::FLOW_SOURCE, DVec3::new(0.1, 0.1, 0.1), 4e-3, 0.5, 0.01)];
        (flow[0].reach, flow[0].fade) = (0.3, 0.6);
        if far {
            for i in 0..20 {
                let mut fish = flow[0];
                fish.position = [50.0 + f64::from(i), 0.0, 0.0];
                flow.push(fish);
            }
        }
        let nodes = run(&mut bed, &flow, DT, 20);
        (nodes, bed.evaluations())
    };
    let (near, (done, _)) = run_with(false);
    let (with_far, (done_with_far, saved)) = run_with(true);
    assert!(near == with_far);
    assert_eq!(done, done_with_far);
    assert!(saved > 20 * 13_000, "{saved}");
}
