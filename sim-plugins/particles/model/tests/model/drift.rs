//! Where the currents take the centres, eq. (3).

use glam::DVec3;
use reef_particles_model::{Cloud, Levels, Surroundings};
use reef_sdk::abi::{self, Flow};

use crate::common::*;

/// Ten minutes.
const LONG: u64 = 36_000;

const TALL: &str = "[[boxes]]\nlow = [-3.0, -4.0, -3.0]\nhigh = [3.0, -2.0, 3.0]\ncount = 9000\n";

/// Of that box [m].
const EXTENT: DVec3 = DVec3::new(6.0, 2.0, 6.0);

/// χ² of the counts in equal cells, and the value that it passes in one of a hundred uniform boxes (Wilson
/// and Hilferty).
fn chi_square(centers: &[DVec3], cells: [usize; 3]) -> (f64, f64) {
    let extent = EXTENT;
    let mut counts = vec![0.0; cells.iter().product()];
    for center in centers {
        let at: [usize; 3] = core::array::from_fn(|i| {
            let share = (center[i] / extent[i] + 0.5).clamp(0.0, 1.0);
            ((share * cells[i] as f64) as usize).min(cells[i] - 1)
        });
        counts[(at[0] * cells[1] + at[1]) * cells[2] + at[2]] += 1.0;
    }
    let mean = centers.len() as f64 / counts.len() as f64;
    let chi = counts.iter().map(|count: &f64| (count - mean).powi(2) / mean).sum();
    let free = counts.len() as f64 - 1.0;
    let share = 2.0 / (9.0 * free);
    (chi, free * (1.0 - share + 2.326 * share.sqrt()).powi(3))
}

/// Density of a layer at each of the six walls, over the mean. `thickness`: share of the box.
fn walls(cloud: &Cloud, thickness: f64) -> Vec<f64> {
    let extent = cloud.plan(0).expect("a box").extent;
    let centers = centers(cloud, 0);
    let faces = (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]);
    let density = |(axis, side): (usize, f64)| {
        let wall = centers.iter().filter(|c| side * c[axis] > (0.5 - thickness) * extent[axis]).count();
        wall as f64 / (thickness * centers.len() as f64)
    };
    faces.map(density).collect()
}

/// Greatest density of a layer of a twentieth at any of the six walls, over the mean.
fn densest_wall(cloud: &Cloud) -> f64 {
    walls(cloud, 0.05).into_iter().fold(0.0, f64::max)
}

fn inside(cloud: &Cloud) -> bool {
    let extent = cloud.plan(0).expect("a box").extent;
    let centers = centers(cloud, 0);
    centers.iter().all(|c| (0..3).all(|i| c[i].is_finite() && c[i].abs() <= 0.5 * extent[i]))
}

#[test]
fn in_still_water_without_wind_nothing_moves() {
    let mut cloud = cloud(TALL);
    let camera = camera(DVec3::new(0.0, -3.0, 6.0), DVec3::new(0.0, -3.0, 0.0));
    let (first, _) = step(&mut cloud, &around(&[], &[], &camera), &Levels::default());
    assert!(first.len() > 1000, "{}", first.len());
    assert!(first.iter().all(|sprite| sprite.velocity == [0.0; 3]));
    for number in 2..200 {
        let around = Surroundings { step: number, ..around(&[], &[], &camera) };
        let (later, _) = step(&mut cloud, &around, &Levels::default());
        assert_eq!(later, first);
    }
}

#[test]
fn a_uniform_current_moves_every_centre_by_v_t_modulo_its_box() {
    let mut cloud = cloud(TALL);
    let extent = DVec3::from(cloud.plan(0).expect("a box").extent);
    let before = centers(&cloud, 0);
    let flow = current(DVec3::new(0.37, -0.05, 0.21));
    // What the element says, in f32.
    let v = DVec3::from(flow.axis.map(|a| f64::from((f64::from(flow.strength) * f64::from(a)) as f32)));
    run(&mut cloud, &[flow], LONG);
    let way = v * (LONG as f64 * DT);
    for (before, after) in before.iter().zip(centers(&cloud, 0)) {
        let off = after - (*before + way);
        let off = off - (off / extent).round() * extent;
        // Two roundings to 2⁻³² of the box, and 36 000 of an f64.
        assert!(off.abs().max_element() < 1e-8, "{off}");
    }
}

#[test]
fn a_box_is_uniform_after_ten_minutes_of_a_uniform_current() {
    let mut cloud = cloud(TALL);
    run(&mut cloud, &[current(DVec3::new(0.13, 0.02, -0.31))], LONG);
    let (chi, most) = chi_square(&centers(&cloud, 0), [6, 3, 6]);
    assert!(chi < most, "{chi} of at most {most}");
}

#[test]
fn a_box_is_uniform_after_ten_minutes_of_a_vortex_in_its_middle() {
    let mut cloud = cloud(TALL);
    let vortex = local(abi::FLOW_WHIRLWIND, DVec3::new(0.0, -3.0, 0.0), 0.2, 0.3);
    run(&mut cloud, &[vortex], LONG);
    assert!(inside(&cloud));
    let (chi, most) = chi_square(&centers(&cloud, 0), [6, 3, 6]);
    assert!(chi < most, "{chi} of at most {most}");
    // The test sees what it looks for: all of them a twentieth nearer to the middle.
    let spoilt: Vec<DVec3> = centers(&cloud, 0).iter().map(|center| *center * 0.95).collect();
    let (chi, most) = chi_square(&spoilt, [6, 3, 6]);
    assert!(chi > most, "{chi} of at most {most}");
}

/// Lets water go through boxes, and looks at them after one minute and two; through the first of them for
/// five minutes, and with another seed once more. `REEF_LONG=1`: through all.
fn stays_even(cases: &[(&str, Vec<Flow>)]) {
    let long = std::env::var_os("REEF_LONG").is_some();
    for (number, (name, flow)) in cases.iter().enumerate() {
        let runs = [(5, &[1, 2, 5][..]), (6, &[2])];
        let runs = if number == 0 || long { &runs[..] } else { &[(5, &[1, 2][..])] };
        for (seed, times) in runs {
            let mut cloud = cloud(&format!("{TALL}seed = {seed}\n"));
            let mut done = 0;
            for minutes in *times {
                run_on(&mut cloud, flow, done..minutes * LONG / 10);
                done = minutes * LONG / 10;
                let name = format!("{name}, seed {seed}, {minutes} min");
                assert!(inside(&cloud), "{name}");
                assert_eq!(centers(&cloud, 0).len(), 9000, "{name}");
                let densest = densest_wall(&cloud);
                let (chi, most) = chi_square(&centers(&cloud, 0), [6, 2, 6]);
                println!("{name}: {densest:.3} at a wall, χ² {chi:.0} of {most:.0}");
                assert!(densest <= 1.2, "{name}: {densest} at a wall");
                // Twice that of one in a hundred boxes by chance: who wraps keeps his neighbours, and a surge
                // crowds and thins by V/c, 7 %, as it goes through.
                assert!(chi < 2.0 * most, "{name}: χ² {chi} of {most}");
            }
        }
    }
}

fn source(x: f64, y: f64, z: f64) -> Flow {
    local(abi::FLOW_SOURCE, DVec3::new(x, y, z), 0.15, 0.3)
}

/// A surge whose wave does not fit the box.
fn travelling() -> Flow {
    Flow { wave_vector: [0.7, 0.0, 0.2], modulation: 1.0, ..current(DVec3::new(0.1, 0.0, 0.03)) }
}

fn hole(x: f64, y: f64, z: f64) -> Flow {
    local(abi::FLOW_HOLE, DVec3::new(x, y, z), 0.15, 0.3)
}

#[test]
fn a_source_leaves_no_crowd_at_the_walls_and_the_number_as_it_was() {
    stays_even(&[
        ("a source in the middle", vec![source(0.0, -3.0, 0.0)]),
        ("a source beside a wall", vec![source(2.7, -2.3, 0.4)]),
        ("a source in a corner", vec![source(2.8, -3.8, 2.8)]),
        ("a narrow source", vec![local(abi::FLOW_SOURCE, DVec3::new(2.8, -3.0, 0.0), 0.05, 2.0)]),
        ("a source outside", vec![local(abi::FLOW_SOURCE, DVec3::new(5.0, -3.0, 0.0), 0.4, 0.3)]),
    ]);
}

#[test]
fn a_hole_leaves_no_crowd_at_the_walls_and_the_number_as_it_was() {
    stays_even(&[
        ("a hole in the middle", vec![hole(0.0, -3.0, 0.0)]),
        ("a hole beside a wall", vec![hole(2.7, -2.3, 0.4)]),
        ("a hole in a wall", vec![hole(3.0, -3.0, 0.0)]),
        ("a hole in a corner", vec![hole(2.8, -3.8, 2.8)]),
        ("a strong hole", vec![local(abi::FLOW_HOLE, DVec3::new(2.7, -3.0, 0.0), 0.6, 1.0)]),
        ("a hole outside", vec![local(abi::FLOW_HOLE, DVec3::new(3.5, -3.0, 0.0), 0.3, 0.3)]),
    ]);
}

#[test]
fn a_source_and_a_hole_leave_no_crowd_at_the_walls_and_the_number_as_it_was() {
    stays_even(&[
        ("across the box", vec![source(-2.7, -3.0, 0.0), hole(2.7, -3.0, 0.0)]),
        ("at one wall", vec![source(2.7, -3.0, 1.5), hole(2.7, -3.0, -1.5)]),
        ("side by side", vec![source(2.7, -3.0, 0.2), hole(2.7, -3.0, -0.2)]),
        (
            "in a current",
            vec![source(-1.5, -3.0, 0.0), hole(1.5, -3.0, 1.0), current(DVec3::new(0.1, 0.0, 0.06))],
        ),
        ("a hole in water that comes and goes", vec![hole(2.7, -3.0, 0.0), travelling()]),
    ]);
}

#[test]
fn a_source_and_a_hole_in_a_slow_current_leave_all_walls_even() {
    // 4π Φ of 72 m³ comes new in a second: in 300 s, all of it.
    let flow = [
        current(DVec3::new(0.08, 0.0, 0.016)),
        local(abi::FLOW_SOURCE, DVec3::new(-1.0, -2.0, 0.5), 0.02, 0.2),
        local(abi::FLOW_HOLE, DVec3::new(1.2, -1.8, -0.6), 0.02, 0.2),
    ]
    .map(|flow| Flow { core: 0.0, ..flow });
    let long = std::env::var_os("REEF_LONG").is_some();
    let (counts, times): (&[u32], &[u64]) =
        if long { (&[20_000, 60_000], &[60, 300, 600]) } else { (&[20_000], &[60, 300]) };
    let camera = blind();
    let (mut sum, mut expected) = (0.0, 0.0);
    for count in counts {
        for seed in [7, 8] {
            let mut cloud = cloud(&format!(
                "[[boxes]]\nlow = [-3.0, -3.0, -3.0]\nhigh = [3.0, -1.0, 3.0]\ncount = {count}\nseed = {seed}\n"
            ));
            let mut number = 0;
            for time in times {
                while number < 30 * time {
                    number += 1;
                    let around = Surroundings { step: number, dt: 1.0 / 30.0, ..around(&flow, &[], &camera) };
                    cloud.advance(&around, &Levels::default());
                }
                for thickness in [0.025, 0.05, 0.1] {
                    let faces = walls(&cloud, thickness);
                    println!("{count}, seed {seed}, {time} s, {thickness}: {faces:.3?}");
                    let layer = thickness * f64::from(*count);
                    // Chance alone: 5 σ.
                    let most = 1.0 + 5.0 / layer.sqrt();
                    assert!(faces.iter().all(|face| *face < most.min(1.2)), "{faces:?} of at most {most}");
                    sum += faces.iter().sum::<f64>() * layer;
                    expected += 6.0 * layer;
                }
                let (chi, most) = chi_square(&centers(&cloud, 0), [6, 2, 6]);
                assert!(chi < 2.0 * most, "seed {seed}, {time} s: χ² {chi} of {most}");
            }
        }
    }
    // All walls together: chance leaves them half a percent.
    println!("{:.4} of the mean at the walls", sum / expected);
    assert!((sum / expected - 1.0).abs() < 0.015, "{sum} of {expected}");
}

#[test]
fn water_that_comes_and_goes_leaves_no_crowd_at_the_walls() {
    stays_even(&[("a surge", vec![travelling()])]);
}

#[test]
fn an_eddy_beside_a_wall_leaves_no_crowd_there() {
    let eddy = |x: f64| vec![local(abi::FLOW_WHIRLWIND, DVec3::new(x, -3.0, 0.0), 0.15, 0.3)];
    stays_even(&[("at a wall", eddy(2.7)), ("off the middle", eddy(1.0))]);
}

#[test]
fn a_hole_that_passes_pushes_the_particles_and_lets_them_go() {
    // Through the box in ten seconds, or as long in its middle.
    let taken = |speed: f64| {
        let mut cloud = cloud(TALL);
        let camera = blind();
        let mut taken = 0;
        let mut before = centers(&cloud, 0);
        for number in 1..=600 {
            let along = (speed / 0.6) * (number as f64 / 100.0 - 3.0);
            let fish = [Flow { reach: 1.0, fade: 0.5, ..hole(along, -3.0, 0.0) }];
            cloud.advance(&Surroundings { step: number, ..around(&fish, &[], &camera) }, &Levels::default());
            let after = centers(&cloud, 0);
            taken += before.iter().zip(&after).filter(|(a, b)| a.distance(**b) > 0.1).count();
            before = after;
        }
        taken
    };
    let (passing, staying) = (taken(0.6), taken(0.0));
    println!("{passing} taken by one that passes, {staying} by one that stays");
    assert!(staying > 800 && passing * 5 < staying, "{passing} of {staying}");
}

#[test]
fn the_number_of_particles_alive_never_changes() {
    let mut cloud = cloud(
        "[[boxes]]\nlow = [-3.0, -4.0, -3.0]\nhigh = [3.0, -2.0, 3.0]\ncount = 2501\n\
         [[boxes]]\nkind = \"sand\"\nlow = [-1.0, -4.0, -1.0]\nhigh = [1.0, -3.5, 1.0]\nconcentration = 333.0\n",
    );
    let camera = camera(DVec3::new(0.0, -3.0, 6.0), DVec3::new(0.0, -3.0, 0.0));
    let mut fish = local(abi::FLOW_SOURCE, DVec3::ZERO, 0.1, 0.5);
    let counts = [cloud.particles(0), cloud.particles(1)];
    assert_eq!(counts, [2501, 666]);
    for number in 0..2000 {
        let t = number as f64 * DT;
        fish.position = [3.0 * (0.3 * t).sin(), -3.0, 3.0 * (0.41 * t).cos()];
        let waves = sea(6.0, 50.0, t);
        let flow = [fish];
        let around = Surroundings { step: number, trace: true, ..around(&flow, &waves, &camera) };
        let (_, trace) = step(&mut cloud, &around, &Levels::default());
        assert_eq!(trace.len(), 3167);
        for (i, point) in trace.iter().enumerate() {
            let (object, node) = if i < 2501 { (0, i) } else { (1, i - 2501) };
            assert_eq!((point.object, point.node as usize), (object, node));
            assert!(point.position.iter().all(|v| v.is_finite()));
        }
    }
}

#[test]
fn a_step_of_no_length_changes_nothing_and_long_ones_leave_nobody_outside() {
    let mut cloud = cloud(TALL);
    let camera = blind();
    let flow = [current(DVec3::X), local(abi::FLOW_WHIRLWIND, DVec3::new(0.5, -3.0, 0.0), 50.0, 900.0)];
    let before = cloud.save();
    cloud.advance(&Surroundings { dt: 0.0, ..around(&flow, &[], &camera) }, &Levels::default());
    assert_eq!(cloud.save(), before);
    for _ in 0..50 {
        cloud.advance(&Surroundings { dt: 10.0, ..around(&flow, &[], &camera) }, &Levels::default());
    }
    assert_ne!(cloud.save(), before);
    assert!(inside(&cloud));
}
