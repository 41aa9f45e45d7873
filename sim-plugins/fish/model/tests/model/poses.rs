//! Bodies become points and points become bodies; what is saved comes back.

use glam::{DVec3, Vec3};
use reef_fish_model::{
    shoal::{Shoal, State},
    species::Species,
};
use reef_flow::Level;
use reef_sdk::{StateReader, StateWriter};

use crate::{
    DT,
    shoal::{around, shoal, shoal_of},
};

fn nodes(shoal: &Shoal, number: usize) -> Vec<DVec3> {
    let mut nodes = vec![[0.0; 3]; 23];
    let origin = shoal.nodes(number, &mut nodes);
    nodes.iter().map(|at| origin + Vec3::from(*at).as_dvec3()).collect()
}

/// The farthest that a node of any fish moves in a step, over the time of a step [m/s]; the near field
/// alternates every `every` steps.
fn fastest(every: usize) -> f64 {
    let mut shoal = shoal(6, 6.0);
    let mut fastest: f64 = 0.0;
    for step in 0..900 {
        let before: Vec<Vec<DVec3>> = (0..6).map(|i| nodes(&shoal, i)).collect();
        shoal.step(&around(if (step / every).is_multiple_of(2) { 1e9 } else { 0.0 }));
        for (i, before) in before.iter().enumerate() {
            for (a, b) in before.iter().zip(nodes(&shoal, i)) {
                fastest = fastest.max(a.distance(b) / DT);
            }
        }
    }
    fastest
}

#[test]
fn going_over_between_body_and_point_makes_no_node_jump() {
    let [bodies, changing] = [usize::MAX, 45].map(fastest);
    println!("nodes move at up to {bodies:.3} m/s in bodies, {changing:.3} m/s when they change");
    assert!(changing < 1.5 * bodies);
}

#[test]
fn a_point_swims_as_fast_as_its_body() {
    let swim = |near: f64| {
        let mut species = Species::default();
        species.mind.wander = 0.0;
        let mut shoal = shoal_of(&species, 1, 60.0);
        (0..300).for_each(|_| shoal.step(&around(near)));
        let from = shoal.fish()[0].position;
        (0..600).for_each(|_| shoal.step(&around(near)));
        shoal.fish()[0].position.distance(from) / (600.0 * DT)
    };
    let [body, point] = [1e9, 0.0].map(swim);
    println!("body {body:.4}, point {point:.4} m/s");
    assert!((body / point - 1.0).abs() < 0.15);
}

#[test]
fn a_point_that_gets_a_body_swims_on_as_fast() {
    let mut species = Species::default();
    species.mind.wander = 0.0;
    let mut shoal = shoal_of(&species, 1, 60.0);
    (0..300).for_each(|_| shoal.step(&around(0.0)));
    let (speed, from) = (f64::from(shoal.fish()[0].speed), shoal.fish()[0].position);
    (0..6).for_each(|_| shoal.step(&around(1e9)));
    assert!(shoal.fish()[0].near);
    let now = shoal.fish()[0].position.distance(from) / (6.0 * DT);
    println!("{:.4} before, {now:.4} m/s after", speed);
    assert!((now / speed - 1.0).abs() < 0.25);
}

/// Steps of a shoal of which some are near.
fn go_on(shoal: &mut Shoal, steps: usize) {
    (0..steps).for_each(|_| shoal.step(&around(1.0)));
}

#[test]
fn a_loaded_state_goes_on_as_if_nothing_had_happened() {
    let mut one = shoal(120, 4.0);
    go_on(&mut one, 300);
    assert!(one.fish().iter().any(|fish| fish.near) && one.fish().iter().any(|fish| !fish.near));
    let mut writer = StateWriter::new();
    one.save().write(&mut writer);
    let bytes = writer.finish().expect("a state");
    let saved = State::read(&mut StateReader::parse(2, &bytes).expect("a state")).expect("whole");
    let mut other = shoal(120, 4.0);
    other.load(&saved).expect("of the same fish");
    assert!(other.save() == one.save());
    go_on(&mut one, 300);
    go_on(&mut other, 300);
    assert!(other.save() == one.save());
    // Back again: scrubbing.
    one.load(&saved).expect("its own");
    go_on(&mut one, 300);
    assert!(other.save() == one.save());
}

/// A state as version 1 wrote it: a body for each fish, which had no meaning where it was not stepped.
fn of_version_1(state: &State, near: &[u8]) -> Vec<u8> {
    let (mut places, mut bodies) = (Vec::new(), Vec::new());
    let (mut origins, mut numbers) = (state.origins.chunks(6), state.bodies.chunks(3));
    let mut vector = || numbers.next().expect("a vector of a node").to_vec();
    for (fish, near) in state.near.iter().enumerate() {
        places.extend_from_slice(&state.places[3 * fish..3 * fish + 3]);
        let origin = if *near == 1 { origins.next() } else { None };
        places.extend_from_slice(origin.unwrap_or(&[0.5; 6]));
        for _ in 0..state.nodes[fish] {
            let idle = || vec![0.25; 3];
            let (x, v) = if *near == 1 { (vector(), vector()) } else { (idle(), idle()) };
            let offset = if *near == 2 { vector() } else { idle() };
            bodies.extend([x, v, offset].concat());
        }
    }
    let mut writer = StateWriter::new();
    writer.put_one("time", state.time);
    writer.put("nodes", &state.nodes);
    writer.put("places", &places);
    writer.put("minds", &state.minds);
    writer.put("near", near);
    writer.put("bodies", &bodies);
    writer.finish().expect("a state")
}

#[test]
fn a_state_of_version_1_goes_on_as_it_would_have() {
    let mut one = shoal(120, 4.0);
    go_on(&mut one, 300);
    let saved = one.save();
    assert!((0..3).all(|is| saved.near.contains(&is)), "points, bodies and what fades");
    // What fades is a point there.
    let near: Vec<u8> = saved.near.iter().map(|near| near % 2).collect();
    let bytes = of_version_1(&saved, &near);
    let old = State::read(&mut StateReader::parse(1, &bytes).expect("a state")).expect("whole");
    let mut other = shoal(120, 4.0);
    other.load(&old).expect("of the same fish");
    go_on(&mut one, 100);
    go_on(&mut other, 100);
    assert!(other.save() == one.save());
    let short = State { minds: saved.minds[1..].to_vec(), ..saved.clone() };
    let faded = saved.near.iter().position(|near| *near == 2).expect("one that fades");
    for (bytes, problem) in [
        (of_version_1(&short, &near), "`minds`".to_owned()),
        (
            of_version_1(&saved, &saved.near),
            format!("a fish, {faded}, that is 2; allowed in version 1: 0 and 1"),
        ),
    ] {
        let refused = State::read(&mut StateReader::parse(1, &bytes).expect("a state")).expect_err(&problem);
        assert!(refused.to_string().contains(&problem), "{refused}");
    }
}

#[test]
fn a_body_is_held_by_those_alone_that_need_one() {
    let mut shoal = shoal(700, 12.0);
    let points = shoal.bytes();
    (0..40).for_each(|_| shoal.step(&around(1e9)));
    let bodies = shoal.bytes();
    assert!(bodies > points, "more bodies than there is room for from the start");
    // As points they give them back, and others take these: the memory grows no more.
    for _ in 0..3 {
        (0..40).for_each(|_| shoal.step(&around(0.0)));
        assert!(shoal.save().bodies.is_empty());
        (0..3).for_each(|_| shoal.step(&around(1e9)));
        assert_eq!(shoal.bytes(), bodies);
    }
}

#[test]
fn a_state_of_other_fish_is_refused_and_changes_nothing() {
    let mut shoal = shoal(5, 5.0);
    go_on(&mut shoal, 10);
    let before = shoal.save();
    let mut fewer = before.clone();
    fewer.nodes.pop();
    assert!(shoal.load(&fewer).expect_err("refused").contains("is of 4 fish"));
    let mut short = before.clone();
    short.minds.pop();
    assert!(shoal.load(&short).expect_err("refused").starts_with("`minds` has"));
    assert!(shoal.save() == before);
}

/// Forges the state that a shoal is in: it must refuse that with these words, and stay in its own.
fn refusal<'a>(shoal: &'a mut Shoal, before: &'a State) -> impl FnMut(&dyn Fn(&mut State), &str) + 'a {
    |forge, problem| {
        let mut forged = before.clone();
        forge(&mut forged);
        let refused = shoal.load(&forged).expect_err(problem);
        assert!(refused.contains(problem), "{refused}");
        assert!(shoal.save() == *before);
    }
}

#[test]
fn a_number_that_no_step_writes_is_refused_by_its_name() {
    let mut shoal = shoal(5, 5.0);
    (0..10).for_each(|_| shoal.step(&around(1e9)));
    let before = shoal.save();
    let mut refused = refusal(&mut shoal, &before);
    refused(&|state| state.time = -1.0, "is of the time -1 s");
    refused(&|state| state.near[2] = 3, "has a fish, 2, that is 3; allowed: 0, 1 and 2");
    refused(&|state| state.near[2] = 0, "`origins` has 30 numbers in place of 24");
    refused(&|state| state.homes[2] = 7, "has a fish, 2, with a home that it has not: 0x7");
    refused(&|state| state.home_places[2 * 3] = 1.0, "has a fish, 2, with a home that it has not: 0x0");
    refused(&|state| state.places[2 * 3] = 1e9, "that is away from its habitat [m]");
    for (number, value, problem) in [
        (1, f64::NAN, "that has its origin away from its place [m] NaN; allowed: 0 to "),
        (0, 1e5, "that has its origin away from its place [m] "),
        (5, 100.0, "that has a body in water of [m/s] 100"),
    ] {
        refused(&|state| state.origins[2 * 6 + number] = value, problem);
    }
    for (number, value, problem) in [
        (1, 40.0, "with a course of length 40"),
        (3, f32::INFINITY, "whose speed is inf"),
        (5, -50.0, "that is in water of [m/s] 50"),
        (7, 1.5, "whose phase is 1.5; allowed: 0 to 1"),
        (8, 1.0, "whose time as a point is 1; allowed: 0 to 0.5"),
        (9, 0.2, "whose bias to its side is 0.2"),
        (10, -0.2, "whose bias upward is -0.2"),
        (11, 2.0, "whose hunger is 2; allowed: 0 to 1"),
        (12, -1.0, "whose love is -1"),
        (13, 3.0, "whose fright is 3; allowed: 0 to 2"),
        (14, 1e12, "has a fish, 2, whose reach is 1000000000000; allowed: 1.5 to 6"),
        (14, 1.0, "whose reach is 1; allowed: 1.5 to 6"),
    ] {
        refused(&|state| state.minds[2 * 15 + number] = value, problem);
    }
    for (number, problem) in
        [(1, "whose node 7 has a place of 1000000"), (3, "whose node 7 has a velocity of 1000000")]
    {
        refused(&|state| state.bodies[(2 * 23 + 7) * 6 + number] = 1e6, problem);
    }
    drop(refused);
    // The same fish, fading.
    shoal.step(&around(0.0));
    let before = shoal.save();
    let mut refused = refusal(&mut shoal, &before);
    refused(
        &|state| state.bodies[(2 * 23 + 7) * 3 + 2] = 1e6,
        "whose node 7 has a way off the gait of 1000000",
    );
    refused(&|state| state.minds[2 * 15 + 8] = 0.5, "has a fish, 2, that is 2 after 0.5 s as a point");
}

#[test]
fn every_level_gives_the_same_shoal() {
    let run = |level: Level| {
        let mut shoal = shoal(12, 5.0);
        for _ in 0..40 {
            shoal.step(&reef_fish_model::shoal::Surroundings { level, ..around(1.0) });
        }
        shoal.save()
    };
    let best = run(Level::best());
    for level in Level::all() {
        assert!(run(level) == best, "{}", level.name());
    }
}
