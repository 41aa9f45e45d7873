//! Masters and slaves (§3.3.3): who follows is where the paper places a slave, always; and nobody jumps.

use glam::DVec3;
use reef_particles_model::{Cloud, Levels, Surroundings};
use reef_sdk::abi::{self, Flow};

use crate::common::*;

/// Distances of slaves from their masters that a box has, and d_pmin, d_pmax [m].
fn distances(cloud: &Cloud, number: usize, members: usize) -> (Vec<f64>, [f64; 2]) {
    let centers = centers(cloud, number);
    let all =
        centers.chunks(members).flat_map(|group| group[1..].iter().map(|slave| slave.distance(group[0])));
    (all.collect(), cloud.plan(number).expect("a box").follow)
}

#[test]
fn every_slave_is_placed_within_its_range_in_boxes_of_any_shape() {
    let shapes = [
        "low = [-3.0, -4.0, -3.0]\nhigh = [3.0, -2.0, 3.0]\n",
        "low = [-16.0, -4.9, -26.0]\nhigh = [16.0, -0.2, 6.0]\ncount = 12007\n",
        "low = [-8.0, -4.0, -8.0]\nhigh = [8.0, -3.99, 8.0]\ncount = 3001\n",
        "low = [-9.0, -4.0, -0.01]\nhigh = [9.0, -3.99, 0.01]\ncount = 1000\n",
        "low = [-1.0, -4.0, -1.0]\nhigh = [1.0, -3.0, 1.0]\ncount = 5\n",
        "low = [-1.0, -4.0, -1.0]\nhigh = [1.0, -3.0, 1.0]\ncount = 900\nfollow = [0.02, 0.05]\n",
    ];
    for kind in ["sand", "clay", "phytoplankton", "detritus", "plankton"] {
        for shape in shapes {
            for slaves in [1, 3, 15] {
                let cloud = cloud(&format!("slaves = {slaves}\n[[boxes]]\nkind = \"{kind}\"\n{shape}"));
                let (all, [least, most]) = distances(&cloud, 0, slaves + 1);
                let outside = all.iter().filter(|apart| !(least..=most).contains(*apart)).count();
                assert_eq!(
                    outside,
                    0,
                    "of {} {kind}, {slaves} slaves, {least} to {most} m: {shape}",
                    all.len()
                );
            }
        }
    }
}

#[test]
fn placing_slaves_within_their_range_leaves_the_box_as_even_as_chance() {
    // In cells that hold many groups, and in cells about as large as one.
    for seed in 0..6 {
        let cloud = cloud(&format!(
            "[[boxes]]\nlow = [-3.0, -4.0, -3.0]\nhigh = [3.0, -2.0, 3.0]\ncount = 9000\nseed = {seed}\n"
        ));
        for cells in [[6, 2, 6], [20, 7, 20]] {
            let mut counts = vec![0.0_f64; cells.iter().product()];
            for center in centers(&cloud, 0) {
                let at: [usize; 3] = core::array::from_fn(|i| {
                    let share = center[i] / [6.0, 2.0, 6.0][i] + 0.5;
                    ((share * cells[i] as f64) as usize).min(cells[i] - 1)
                });
                counts[(at[0] * cells[1] + at[1]) * cells[2] + at[2]] += 1.0;
            }
            let mean = 9000.0 / counts.len() as f64;
            let chi: f64 = counts.iter().map(|count| (count - mean).powi(2) / mean).sum();
            let free = counts.len() as f64 - 1.0;
            // Too uneven or too even: 3.5 σ of chance.
            assert!((chi - free).abs() < 3.5 * (2.0 * free).sqrt(), "χ² {chi} of {free}, seed {seed}");
        }
    }
}

/// Particles of all kinds in water that moves them apart: a current through the walls, an eddy, a source and
/// a hole.
fn stirred() -> (Cloud, Vec<Flow>) {
    let kinds = ["sand", "clay", "phytoplankton", "detritus", "plankton"];
    let boxes = kinds.iter().map(|kind| {
        format!(
            "[[boxes]]\nkind = \"{kind}\"\nlow = [-3.0, -4.0, -3.0]\nhigh = [3.0, -2.0, 3.0]\ncount = 801\n"
        )
    });
    let flow = vec![
        current(DVec3::new(0.3, 0.02, 0.1)),
        local(abi::FLOW_WHIRLWIND, DVec3::new(1.0, -3.0, 1.0), 0.1, 0.5),
        local(abi::FLOW_SOURCE, DVec3::new(2.8, -3.0, 0.0), 0.1, 0.4),
        local(abi::FLOW_HOLE, DVec3::new(-2.0, -3.0, 0.0), 0.1, 0.4),
    ];
    (cloud(&boxes.collect::<String>()), flow)
}

#[test]
fn whoever_follows_is_within_its_range_at_every_step_whatever_moves_it() {
    let (mut cloud, flow) = stirred();
    // All of the box is beyond D_m.
    let camera = camera(DVec3::new(0.0, -3.0, 9.0), DVec3::new(0.0, -3.0, 0.0));
    let alone = Levels { masters: false, ..no_levels() };
    let follow = Levels { masters: true, ..no_levels() };
    let (mut followers, mut lost, mut slaves) = (0, 0, 0);
    for number in 1..=1500 {
        let waves = sea(6.0, 50.0, number as f64 * DT);
        let around = Surroundings { step: number, trace: true, ..around(&flow, &waves, &camera) };
        let (_, together) = step(&mut cloud, &around, &follow);
        if number % 10 != 0 {
            continue;
        }
        // The same centres again, without masters.
        let (_, own) = step(&mut cloud, &Surroundings { dt: 0.0, ..around }, &alone);
        assert_eq!((together.len(), own.len()), (4005, 4005));
        for number in 0..5 {
            let first = 801 * number;
            let centers = centers(&cloud, number);
            let [least, most] = cloud.plan(number).expect("a box").follow;
            for i in (0..801).filter(|i| i % 4 != 0) {
                slaves += 1;
                let apart = centers[i].distance(centers[i - i % 4]);
                lost += usize::from(!(least..=most).contains(&apart));
                if together[first + i].position != own[first + i].position {
                    followers += 1;
                    assert!((least..=most).contains(&apart), "{apart} m of {least} to {most}");
                }
            }
        }
    }
    println!("{followers} follow of {slaves}, of which {lost} are elsewhere");
    // The test sees both.
    assert!(5 * followers > slaves && 20 * lost > slaves, "{followers} {lost} of {slaves}");
}

#[test]
fn nobody_jumps_when_a_slave_comes_to_follow_or_ceases_to() {
    let (mut cloud, flow) = stirred();
    let levels = Levels { masters: true, ..no_levels() };
    let mut former: Option<(Vec<DVec3>, Vec<DVec3>)> = None;
    let (mut worst, mut farthest): (f64, f64) = (0.0, 0.0);
    for number in 1..=900 {
        let t = number as f64 * DT;
        // The eye goes through the box at 1 m/s: all come within D_m, and leave it.
        let camera = camera(DVec3::new(0.0, -3.0, 8.0 - t), DVec3::new(0.0, -3.0, -20.0));
        let waves = sea(6.0, 50.0, t);
        let around = Surroundings { step: number, trace: true, ..around(&flow, &waves, &camera) };
        let (_, together) = step(&mut cloud, &around, &levels);
        let (_, own) = step(&mut cloud, &Surroundings { dt: 0.0, ..around }, &no_levels());
        let centers: Vec<DVec3> = (0..5).flat_map(|number| centers(&cloud, number)).collect();
        // What following makes of each one's place.
        let off: Vec<DVec3> = together
            .iter()
            .zip(&own)
            .map(|(together, own)| DVec3::from(together.position) - DVec3::from(own.position))
            .collect();
        if let Some((before, former)) = &former {
            for i in 0..off.len() {
                farthest = farthest.max(off[i].length());
                // Who wrapped or came anew is another one.
                if before[i].distance(centers[i]) < 0.05 {
                    worst = worst.max((off[i] - former[i]).length());
                }
            }
        }
        former = Some((centers, off));
    }
    println!("{worst} m in a step, {farthest} m in all");
    assert!(worst < 0.35 * farthest && farthest > 0.04, "{worst} m in a step of {farthest} m");
}
