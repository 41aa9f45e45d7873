//! What single fish do about what they perceive.

use glam::{DVec3, Vec3};
use reef_fish_model::{
    shoal::{Habitat, Kind, Shoal, Start, Surroundings},
    species::Species,
};
use reef_sdk::{
    Heightfield,
    abi::{self, Flow, Obstacle},
};

use crate::{
    DT,
    shoal::{around, habitat},
};

/// Fish without whims.
fn plain() -> Species {
    let mut species = Species::default();
    species.mind.wander = 0.0;
    species
}

fn start(kind: u32, x: f64, z: f64, heading: f64) -> Start {
    let position = DVec3::new(x, -5.0, z);
    Start { kind, position, heading, size: 1.0, habitat: 0, home: None, seed: 7 }
}

fn of(species: &[(&Species, Vec<u32>)], habitat: Habitat, starts: &[Start]) -> Shoal {
    let kinds = species.iter().map(|(species, prey)| Kind::new(species, prey.clone()).expect("a kind"));
    Shoal::new(kinds.collect(), vec![habitat], starts).expect("a shoal")
}

fn run(shoal: &mut Shoal, around: &Surroundings<'_>, seconds: f64) {
    (0..(seconds / DT).round() as usize).for_each(|_| shoal.step(around));
}

#[test]
fn who_is_behind_is_not_seen_and_who_is_ahead_is() {
    let mut species = plain();
    species.mind.cohesion = 5.0;
    let course = |others: &[Start]| {
        let starts: Vec<Start> =
            core::iter::once(start(0, 0.0, 0.0, 0.0)).chain(others.iter().cloned()).collect();
        let mut shoal = of(&[(&species, vec![])], habitat(20.0), &starts);
        shoal.step(&around(0.0));
        shoal.fish()[0].course
    };
    let alone = course(&[]);
    // 25 degrees off its tail, and 35.
    assert_eq!(course(&[start(0, -0.8, 0.37, 0.0)]), alone);
    assert_ne!(course(&[start(0, -0.8, 0.56, 0.0)]), alone);
    assert_ne!(course(&[start(0, 0.8, 0.37, 0.0)]), alone);
    // Six lengths ahead it sees, eight it does not.
    assert_ne!(course(&[start(0, 1.1, 0.3, 0.0)]), alone);
    assert_eq!(course(&[start(0, 1.6, 0.3, 0.0)]), alone);
}

#[test]
fn prey_flees_and_a_hungry_predator_follows_until_it_caught() {
    let mut hunter = plain();
    hunter.mind.hunger = true;
    hunter.mind.range = 20.0;
    hunter.swim.fastest = 6.0;
    hunter.material.cross *= 4.0;
    hunter.material.side *= 4.0;
    hunter.material.long *= 4.0;
    hunter.material.water *= 2.0;
    let starts = [start(0, 0.5, 0.5, 0.0), start(1, 0.0, 0.0, 0.0)];
    let mut apart = of(&[(&plain(), vec![]), (&hunter, vec![])], habitat(20.0), &starts);
    let mut hunted = of(&[(&plain(), vec![]), (&hunter, vec![0])], habitat(20.0), &starts);
    assert!(hunted.kinds()[1].gait.top_speed() > 1.5 * hunted.kinds()[0].gait.top_speed());
    for shoal in [&mut apart, &mut hunted] {
        run(shoal, &around(0.0), 4.0);
    }
    // It hurries away.
    assert!(hunted.fish()[0].fright > 0.0 && apart.fish()[0].fright == 0.0);
    assert!(hunted.fish()[0].speed > 1.3 * apart.fish()[0].speed);
    let gap = |shoal: &Shoal| shoal.fish()[0].position.distance(shoal.fish()[1].position);
    let mut least = f64::INFINITY;
    let mut fed = false;
    for _ in 0..(180.0 / DT) as usize {
        let hunger = hunted.fish()[1].hunger;
        hunted.step(&around(0.0));
        least = least.min(gap(&hunted));
        fed |= hunted.fish()[1].hunger < 0.5 * hunger;
    }
    println!("nearest {least:.3} m");
    assert!(fed, "it comes no nearer than {least} m");
}

#[test]
fn fish_that_court_meet_and_are_content() {
    let mut species = plain();
    species.mind.mating = true;
    species.mind.range = 20.0;
    (species.mind.cohesion, species.mind.alignment) = (0.0, 0.0);
    let starts = [start(0, 0.0, 0.0, 0.0), Start { seed: 3, ..start(0, 2.0, 1.0, 1.0) }];
    let mut shoal = of(&[(&species, vec![])], habitat(6.0), &starts);
    let mut content = [false; 2];
    let mut courted = false;
    for _ in 0..(300.0 / DT) as usize {
        let before = [0, 1].map(|i| shoal.fish()[i].love);
        shoal.step(&around(0.0));
        courted |= before.iter().all(|love| *love >= 1.0);
        for i in 0..2 {
            content[i] |= shoal.fish()[i].love < 0.5 * before[i];
        }
    }
    assert!(courted && content == [true; 2]);
    let mut shoal = of(&[(&plain(), vec![])], habitat(6.0), &starts);
    run(&mut shoal, &around(0.0), 1.0);
    assert!(shoal.fish().iter().all(|fish| fish.love == 0.0 && fish.hunger == 1.0), "switched off");
}

#[test]
fn a_fish_stays_near_its_anemone_and_hides_in_it() {
    let mut species = plain();
    species.mind.home = 5.0;
    species.mind.wander = 1.0;
    let home = DVec3::new(0.0, -5.0, 0.0);
    let timid = Start { home: Some(home), ..start(0, 0.5, 0.0, 0.0) };
    let bold = Start { home: None, ..timid.clone() };
    let farthest = |start: &Start| {
        let mut shoal = of(&[(&species, vec![])], habitat(20.0), core::slice::from_ref(start));
        let mut farthest: f64 = 0.0;
        for _ in 0..(120.0 / DT) as usize {
            shoal.step(&around(0.0));
            farthest = farthest.max(shoal.fish()[0].position.distance(home));
        }
        farthest
    };
    let [stays, leaves] = [&timid, &bold].map(farthest);
    println!("{stays:.2} m with a home, {leaves:.2} m without");
    assert!(stays < 1.6 * 5.0 * 0.2 && leaves > 3.0);
    // A hunter at its side: it goes home.
    let after = |prey: Vec<u32>| {
        let starts = [Start { heading: 1.6, ..timid.clone() }, start(1, 0.7, 0.6, 0.0)];
        let mut shoal = of(&[(&species, vec![]), (&plain(), prey)], habitat(20.0), &starts);
        run(&mut shoal, &around(0.0), 6.0);
        shoal.fish()[0].position.distance(home)
    };
    let [calm, hidden] = [after(vec![]), after(vec![0])];
    println!("{calm:.2} m from home, {hidden:.2} m with a hunter");
    assert!(hidden < 0.6 * calm);
}

#[test]
fn an_anemone_is_no_home_to_a_species_without_one() {
    let mut species = plain();
    let after = |species: &Species, home: Option<DVec3>| {
        let own = Start { home, ..start(0, 0.5, 0.0, 0.0) };
        let mut shoal = of(&[(species, vec![])], habitat(20.0), &[own]);
        run(&mut shoal, &around(0.0), 2.0);
        shoal.fish()[0].position
    };
    let home = Some(DVec3::new(0.0, -5.0, 3.0));
    assert_eq!(after(&species, home), after(&species, None));
    species.mind.home = 5.0;
    assert_ne!(after(&species, home), after(&species, None));
}

#[test]
fn rocks_the_bed_and_the_surface_are_kept_clear_of() {
    let species = {
        let mut species = plain();
        species.mind.wander = 1.0;
        species
    };
    // A slope that rises from −6 to −1.5 m, a ball and a log.
    let heights: Vec<f32> = (0..64).map(|i| -6.0 + 4.5 * (i % 8) as f32 / 7.0).collect();
    let bed = Heightfield { heights: &heights, origin: [-4.0, -4.0], cell: 8.0 / 7.0, columns: 8, rows: 8 };
    let obstacles = [
        Obstacle { from: [-1.0, -3.0, 0.0], radius: 0.5, ..Obstacle::default() },
        Obstacle { from: [-2.0, -2.0, -3.0], delta: [0.0, 0.5, 6.0], radius: 0.3, ..Obstacle::default() },
    ];
    let box_of = Habitat { low: DVec3::new(-4.0, -9.0, -4.0), high: DVec3::new(3.0, 2.0, 4.0) };
    let starts: Vec<Start> = (0..12_u32)
        .map(|i| {
            let at = DVec3::new(-3.5 + 0.25 * f64::from(i), -1.0, 0.6 * f64::from(i) - 3.0);
            Start { position: at, seed: i.into(), heading: f64::from(i), ..start(0, 0.0, 0.0, 0.0) }
        })
        .collect();
    for (near, seconds) in [(0.0, 240.0), (1e9, 240.0)] {
        let mut shoal = of(&[(&species, vec![])], box_of, &starts);
        let here = Surroundings { bed: Some(bed), obstacles: &obstacles, ..around(near) };
        let mut least = [f64::INFINITY; 3];
        for step in 0..(seconds / DT) as usize {
            shoal.step(&here);
            for fish in shoal.fish().iter() {
                let at = fish.position;
                least[0] = least[0].min(at.y - f64::from(bed.height(at.x, at.z)));
                least[1] = least[1].min(-at.y);
                for obstacle in &obstacles {
                    let (from, delta) = (DVec3::from(obstacle.from), Vec3::from(obstacle.delta).as_dvec3());
                    let along = ((at - from).dot(delta) / delta.length_squared().max(1e-9)).clamp(0.0, 1.0);
                    let gap = at.distance(from + delta * along) - f64::from(obstacle.radius);
                    least[2] = least[2].min(if step > 60 { gap } else { f64::INFINITY });
                }
            }
        }
        println!(
            "over the bed {:.3}, under the surface {:.3}, off rocks {:.3} m",
            least[0], least[1], least[2]
        );
        assert!(least.iter().all(|gap| *gap > 0.1), "{least:?}");
        // Points come near all three; bodies are slower to dive.
        assert!(near > 0.0 || least.iter().all(|gap| *gap < 0.6), "they come near: {least:?}");
    }
}

#[test]
fn a_current_carries_points_and_bodies_alike() {
    let flow =
        [Flow { kind: abi::FLOW_DIRECTIONAL, axis: [0.0, 0.0, 1.0], strength: 0.2, ..Flow::default() }];
    for near in [0.0, 1e9] {
        let swim = |flow: &[Flow]| {
            let mut shoal = of(&[(&plain(), vec![])], habitat(40.0), &[start(0, 0.0, 0.0, 0.0)]);
            run(&mut shoal, &Surroundings { flow, ..around(near) }, 10.0);
            shoal.fish()[0].position
        };
        let carried = swim(&flow) - swim(&[]);
        println!("{near}: {carried}");
        // A body takes a while to be taken along.
        assert!((carried - DVec3::new(0.0, 0.0, 2.0)).length() < 0.15);
    }
}

#[test]
fn two_in_the_same_place_come_apart() {
    for near in [0.0, 1e9] {
        let mut species = plain();
        species.mind.separation = 0.0;
        let mut shoal =
            of(&[(&species, vec![])], habitat(20.0), &[start(0, 0.0, 0.0, 0.0), start(0, 0.0, 0.0, 0.0)]);
        run(&mut shoal, &around(near), 0.5);
        let gap = shoal.fish()[0].position.distance(shoal.fish()[1].position);
        println!("{gap:.3} m");
        assert!(gap > shoal.kinds()[0].plan.body().width());
    }
}

#[test]
fn who_swims_beside_another_keeps_its_distance() {
    let gap = |separation: f64| {
        let mut species = plain();
        species.mind.separation = separation;
        species.mind.cohesion = 0.0;
        let starts = [start(0, 0.0, 0.0, 0.0), start(0, 0.0, 0.1, 0.0)];
        let mut shoal = of(&[(&species, vec![])], habitat(40.0), &starts);
        run(&mut shoal, &around(0.0), 15.0);
        shoal.fish()[0].position.distance(shoal.fish()[1].position)
    };
    let [with, without] = [2.0, 0.0].map(gap);
    println!("{with:.3} m, {without:.3} m without");
    assert!(with > 0.8 * 1.2 * 0.2 && with > 1.5 * without);
}

#[test]
fn prey_turns_away_from_a_predator() {
    let mut sated = plain();
    sated.mind.hunger = true;
    let starts = [start(0, 0.0, 0.0, 0.0), start(1, 0.6, 0.1, 0.0)];
    let toward = |prey: Vec<u32>| {
        let mut shoal = of(&[(&plain(), vec![]), (&sated, prey)], habitat(20.0), &starts);
        run(&mut shoal, &around(0.0), 4.0);
        let way = shoal.fish()[1].position - shoal.fish()[0].position;
        way.normalize().dot(shoal.fish()[0].course.as_dvec3())
    };
    let [calm, afraid] = [toward(vec![]), toward(vec![0])];
    println!("{calm:.2}, {afraid:.2}");
    assert!(calm > 0.0 && afraid < -0.3);
}

#[test]
fn a_fish_does_the_same_alone_and_among_others_far_away() {
    // An eddy around one of them.
    let eddy = Flow {
        kind: abi::FLOW_WHIRLWIND,
        position: [10.0, -5.0, 0.5],
        axis: [0.0, 1.0, 0.0],
        strength: 0.2,
        peak: 0.3,
        core: 0.2,
        reach: 3.0,
        fade: 0.5,
        ..Flow::default()
    };
    let (a, b) = (start(0, -10.0, 0.0, 0.0), start(0, 10.0, 0.0, 1.0));
    let swim = |starts: &[Start]| {
        let mut shoal = of(&[(&plain(), vec![])], habitat(60.0), starts);
        run(&mut shoal, &Surroundings { flow: &[eddy], ..around(0.0) }, 10.0);
        shoal.fish().iter().map(|fish| (fish.position, fish.course)).collect::<Vec<_>>()
    };
    let together = swim(&[a.clone(), b.clone()]);
    assert_eq!(together, [swim(&[a])[0], swim(core::slice::from_ref(&b))[0]]);
    assert!(together[1].0.distance(b.position) > 0.1);
}
