//! The levels of detail (§3.3): nobody sees what they leave out.

use std::collections::HashSet;

use glam::DVec3;
use reef_flow::waves::Rule;
use reef_particles_model::{Levels, Surroundings};
use reef_sdk::abi::{self, Billboard, Camera};

use crate::common::*;

/// The paper's box: 4 000 particles in 10 × 1 × 10 m, half a metre below the surface.
const PAPER: &str = "[[boxes]]\nlow = [-5.0, -1.5, -5.0]\nhigh = [5.0, -0.5, 5.0]\ncount = 4000\n";

/// The eye of the table's walk at a distance [m] from the box.
fn walker(distance: f64) -> Camera {
    camera(DVec3::new(0.3, -1.0, 5.0 + distance), DVec3::new(0.0, -1.0, 0.0))
}

/// From 12 m to inside of the box, at 1 m/s.
fn walk(every: usize) -> impl Iterator<Item = (u64, f64)> {
    (0..840).step_by(every).map(|frame| (frame as u64 + 1, 12.0 - frame as f64 * DT))
}

/// Greatest difference on the screen [px] that the choice of trains makes along the walk.
fn worst_choice(threshold: f64, every: usize) -> f64 {
    let (mut chosen, mut whole) = (cloud(PAPER), cloud(PAPER));
    let mut worst: f64 = 0.0;
    for (number, distance) in walk(every) {
        let camera = walker(distance);
        let waves = sea(5.0, 50.0, number as f64 * DT);
        let flow = [current(DVec3::new(0.1, 0.0, 0.05))];
        let around = Surroundings { step: number, trace: true, ..around(&flow, &waves, &camera) };
        let (_, all) = step(&mut whole, &around, &no_levels());
        let levels = Levels { trains: true, threshold, ..no_levels() };
        let (_, some) = step(&mut chosen, &around, &levels);
        for (a, b) in all.iter().zip(&some) {
            let (Some(a), Some(b)) =
                (project(&camera, a.position.into()), project(&camera, b.position.into()))
            else {
                continue;
            };
            if inside(&camera, a) {
                worst = worst.max((a.0 - b.0).hypot(a.1 - b.1));
            }
        }
    }
    worst
}

#[test]
fn the_choice_of_trains_errs_by_less_than_its_threshold_for_every_particle_in_every_frame() {
    let worst = worst_choice(1.0, 1);
    println!("worst {worst} px");
    assert!(worst < 1.0, "{worst} px");
    // Something is left out, and more with a higher threshold: the measure is one.
    assert!(worst > 0.05, "{worst} px");
    let coarse = worst_choice(10.0, 60);
    assert!(coarse > 1.0 && coarse < 10.0, "{coarse} px");
}

/// Trains that are evaluated for one particle, in the mean.
fn trains_a_particle(distance: f64, levels: Levels) -> f64 {
    let mut cloud = cloud(PAPER);
    let (camera, waves) = (walker(distance), sea(5.0, 50.0, 1.0));
    step(&mut cloud, &around(&[], &waves, &camera), &levels);
    let [orbits, trains] = cloud.work();
    assert_eq!(orbits, 4000);
    trains as f64 / orbits as f64
}

#[test]
fn fewer_trains_count_from_farther_away_fewest_by_the_papers_rule() {
    let of =
        |selection, distance| trains_a_particle(distance, Levels { trains: true, selection, ..no_levels() });
    for distance in [0.0, 3.0, 6.0, 9.0, 12.0] {
        let [sum, each] = [Rule::Sum, Rule::Each].map(|rule| of(rule, distance));
        println!("{distance} m: {sum:.1} by the sum, {each:.1} each");
        // From nearby a particle's depth tells more than its distance.
        assert!(sum <= 30.0 && (each < sum || distance < 9.0));
        for rule in [Rule::Sum, Rule::Each] {
            assert!(distance == 0.0 || of(rule, distance) < of(rule, distance - 3.0), "{distance} m");
        }
    }
    assert!(of(Rule::Sum, 12.0) < 25.0 && of(Rule::Each, 12.0) < 22.5);
    assert_eq!(trains_a_particle(12.0, no_levels()), 30.0);
}

#[test]
fn no_sprite_that_reaches_into_the_picture_is_left_out() {
    for (number, distance) in walk(30) {
        let camera = walker(distance);
        let waves = sea(3.0, 50.0, number as f64 * DT);
        let around = Surroundings { step: number, ..around(&[], &waves, &camera) };
        let key = |sprite: &Billboard| sprite.position.map(f32::to_bits);
        let levels = Levels { visible: true, margin: 0.0, ..no_levels() };
        let (seen, _) = step(&mut cloud(PAPER), &around, &levels);
        let kept: HashSet<_> = seen.iter().map(key).collect();
        let (all, _) = step(&mut cloud(PAPER), &around, &no_levels());
        assert_eq!(all.len(), 4000);
        assert!(distance > -1.0 || kept.len() < 3000, "{} of 4000 at {distance} m", kept.len());
        let center = DVec3::new(0.0, -1.0, 0.0);
        for sprite in &all {
            let p = center + DVec3::from(sprite.position.map(f64::from));
            if project(&camera, p).is_some_and(|at| inside(&camera, at)) {
                assert!(kept.contains(&key(sprite)), "{sprite:?} at {distance} m");
            }
        }
    }
}

#[test]
fn slaves_follow_their_master_beyond_d_m_and_ride_by_themselves_before() {
    let waves = sea(7.0, 50.0, 3.0);
    let offset = |distance: f64, levels: Levels| {
        let mut cloud = cloud(PAPER);
        let camera = walker(distance);
        let around = Surroundings { trace: true, ..around(&[], &waves, &camera) };
        let (_, trace) = step(&mut cloud, &around, &levels);
        let center = DVec3::new(0.0, -1.0, 0.0);
        let offsets: Vec<DVec3> = trace
            .iter()
            .zip(centers(&cloud, 0))
            .map(|(point, own)| DVec3::from(point.position) - center - own)
            .collect();
        (centers(&cloud, 0), offsets, DVec3::from(camera.position) - center)
    };
    let follow = Levels { masters: true, ..no_levels() };
    let (centers, far, _) = offset(20.0, follow);
    let (_, own, _) = offset(20.0, no_levels());
    let [least, most] = cloud(PAPER).plan(0).expect("a box").follow;
    let (mut followers, mut worst) = (0, 0.0_f64);
    for first in (0..4000).step_by(4) {
        for slave in first + 1..first + 4 {
            let apart = (centers[slave] - centers[first]).length();
            if far[slave] != own[slave] {
                assert!((least..=most).contains(&apart), "{apart} m");
            }
            if (far[slave] - far[first]).length() < 1e-6 {
                followers += 1;
                worst = worst.max((far[slave] - own[slave]).length());
            }
        }
    }
    // Nearly all of the 3000 begin beside their masters, and are moved not quite as they would be.
    assert!(followers > 2000, "{followers}");
    assert!(worst > 1e-4 && worst < 0.2, "{worst}");
    // In the middle of the box: those nearer than D_m = 2 m ride as without this level.
    let (centers, near, eye) = offset(-5.0, follow);
    let (_, own, _) = offset(-5.0, no_levels());
    let mut tested = 0;
    for i in 0..4000 {
        if (centers[i] - eye).length() < 2.0 {
            assert!((near[i] - own[i]).length() < 1e-6, "{} {}", near[i], own[i]);
            tested += 1;
        }
    }
    assert!(tested > 100, "{tested}");
}

#[test]
fn a_recorded_slave_is_as_far_from_its_master_as_their_centres_are() {
    let waves = sea(7.0, 50.0, 3.0);
    let mut cloud = cloud(PAPER);
    let camera = walker(20.0);
    let flow = [current(DVec3::new(0.1, 0.0, 0.05)), local(abi::FLOW_WHIRLWIND, DVec3::ZERO, 0.1, 1.0)];
    let around = Surroundings { trace: true, ..around(&flow, &waves, &camera) };
    let levels = Levels { masters: true, ..no_levels() };
    let (_, trace) = step(&mut cloud, &around, &levels);
    let centers = centers(&cloud, 0);
    let at = |i: usize| DVec3::from(trace[i].position);
    let slaves = (0..4000).filter(|number| number % 4 != 0);
    let exact = slaves.filter(|&slave| {
        let master = slave - slave % 4;
        (at(slave) - at(master)).distance(centers[slave] - centers[master]) < 1e-13
    });
    // Nearly all of the 3000 follow. Who rides by itself is moved otherwise than its master is.
    let followers = exact.count();
    assert!(followers > 2000, "{followers}");
}

/// What sprites cover of the sky around the eye [sr]: opacity · area. Those nearer than `least` count as if
/// they were there: they are few, and grow fast.
fn cover(sprites: &[Billboard], eye: DVec3, least: f64) -> f64 {
    let center = DVec3::new(0.0, -1.0, 0.0);
    sprites
        .iter()
        .map(|sprite| {
            let p = center + DVec3::from(sprite.position.map(f64::from));
            let distance = (p - eye).length();
            let area = f64::from(sprite.opacity) * f64::from(sprite.size).powi(2);
            area / distance.max(least).powi(2)
        })
        .sum()
}

#[test]
fn the_fog_covers_as_much_as_the_particles_it_stands_for() {
    let camera = walker(14.0);
    let eye = DVec3::from(camera.position);
    let around = around(&[], &[], &camera);
    let levels = |fog| Levels { fog, visibility: 100.0, ..no_levels() };
    let (singles, _) = step(&mut cloud(PAPER), &around, &levels(false));
    let (fog, _) = step(&mut cloud(PAPER), &around, &levels(true));
    // All of the box is beyond D_M: not one particle is left.
    assert_eq!((singles.len(), fog.len()), (4000, 64));
    let (a, b) = (cover(&singles, eye, 0.0), cover(&fog, eye, 0.0));
    // The same dot stands for both without a host; the rest is chance within the cells.
    assert!((a / b - 1.0).abs() < 0.02, "{a} {b}");
    let mean = |sprites: &[Billboard]| -> [f64; 3] {
        core::array::from_fn(|i| {
            let all = sprites.iter().map(|s| f64::from(s.color.to_le_bytes()[i])).sum::<f64>();
            all / sprites.len() as f64
        })
    };
    for (a, b) in mean(&singles).iter().zip(mean(&fog)) {
        assert!((a - b).abs() < 3.0, "{a} {b}");
    }
    // Opaque where particles hide all that is behind them.
    let dense = "[[boxes]]\nlow = [-5.0, -1.5, -5.0]\nhigh = [5.0, -0.5, 5.0]\ncount = 100000\n\
                 size = [0.1, 0.1]\nopacity = 1.0\n";
    let (fog, _) = step(&mut cloud(dense), &around, &levels(true));
    assert!(fog.iter().all(|sprite| sprite.opacity > 0.99 && sprite.opacity <= 1.0));
}

#[test]
fn a_walk_through_all_borders_has_no_jump() {
    let mut cloud = cloud(PAPER);
    let mut last: Option<f64> = None;
    for (number, distance) in (0..1500).map(|frame| (frame + 1, 20.0 - frame as f64 * DT)) {
        let camera = walker(distance);
        let around = Surroundings { step: number, ..around(&[], &[], &camera) };
        let (sprites, _) = step(&mut cloud, &around, &Levels { visible: false, ..Levels::default() });
        let now = cover(&sprites, DVec3::from(camera.position), 1.5);
        if let Some(last) = last {
            assert!((now / last - 1.0).abs() < 0.01, "at {distance} m: {last} to {now}");
        }
        last = Some(now);
    }
}

#[test]
fn a_sprite_comes_from_where_its_velocity_says_and_a_wrapped_one_says_so() {
    let mut cloud = cloud(PAPER);
    let camera = walker(3.0);
    let flow = [
        current(DVec3::new(0.4, 0.0, 0.1)),
        local(abi::FLOW_WHIRLWIND, DVec3::new(1.0, -1.0, 1.0), 0.02, 0.1),
    ];
    let mut former: Option<Vec<[f64; 3]>> = None;
    let (mut compared, mut wrapped, mut sum) = (0, 0, 0.0);
    for number in 1..200 {
        let waves = sea(6.0, 50.0, number as f64 * DT);
        let around = Surroundings { step: number, trace: true, ..around(&flow, &waves, &camera) };
        // No level of detail: sprites come in the chunks' order, the trace by numbers; matched by place.
        let (sprites, trace) = step(&mut cloud, &around, &no_levels());
        let center = DVec3::new(0.0, -1.0, 0.0);
        if let Some(former) = &former {
            // The trace is summed in f64, sprites are not: they are a micrometre apart at most.
            let cell = |x: f64| (x * 1e5).floor() as i64;
            let by_place: std::collections::HashMap<[i64; 3], usize> =
                trace.iter().enumerate().map(|(i, t)| (t.position.map(cell), i)).collect();
            for sprite in &sprites {
                let p = center + DVec3::from(sprite.position.map(f64::from));
                // Those beside the edge of a cell are left out, and so are two that share one.
                let Some(i) = by_place.get(&p.to_array().map(cell)) else { continue };
                if p.distance(DVec3::from(trace[*i].position)) > 1e-6 {
                    continue;
                }
                let way = p - DVec3::from(former[*i]);
                if sprite.flags & abi::FLAG_NO_BLEND != 0 {
                    wrapped += 1;
                    assert!(way.length() > 0.5, "{way}");
                } else {
                    // What is left: crests that an eddy carries a particle toward.
                    let said = DVec3::from(sprite.velocity.map(f64::from)) * DT;
                    assert!((way - said).length() < 3e-4, "{way} {said}");
                    sum += (way - said).length();
                    compared += 1;
                }
            }
        }
        former = Some(trace.iter().map(|t| t.position).collect());
    }
    assert!(compared > 100_000 && wrapped > 100, "{compared} {wrapped}");
    println!("mean {} m", sum / f64::from(compared));
    assert!(sum / f64::from(compared) < 1e-5, "{sum} m in {compared}");
}
