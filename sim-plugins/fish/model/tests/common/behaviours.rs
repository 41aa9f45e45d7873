//! The four behaviours, each as fish in a box, and what is watched while they swim: shared by the tests,
//! which look for a minute, and by `fish_minutes`, which looks for ten.

use std::collections::VecDeque;

use glam::{DVec3, Vec3};
use reef_fish_model::{
    shoal::{Habitat, Host, Kind, Shoal, Start, Surroundings, Waves},
    species::Species,
};
use reef_flow::{Level, random::Random};
use reef_model_tests::species as tables;
use reef_sdk::{
    Heightfield, Workers,
    abi::{Obstacle, fnv1a_32},
};

/// A picture's time [s].
const DT: f64 = 1.0 / 60.0;
/// Nothing is said of how they hold together in the first seconds: fish begin here and there.
const SETTLING: f64 = 25.0;
/// Over so many steps a turn is measured: what is left of a beat in a body's course is none.
const TURN: usize = 20;
/// The species that clownfish live in.
const HOST: &str = "host-anemone";

/// What fish do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Behaviour {
    /// Forty silversides in a box.
    Shoal,
    /// The same with a shark, which hunts them.
    Hunter,
    /// Six clownfish and three anemones.
    Home,
    /// Tangs and butterflyfish between rocks, over a slope.
    Wandering,
}

/// What was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// How far one was out of its habitat at most; below 0: none was [m].
    pub beyond: f64,
    /// For how long one was in a rock or in the bed without a pause, at most [s].
    pub stuck: f64,
    /// For how long two were nearer than a mean width, at most [s].
    pub touching: f64,
    /// The sharpest turn in a third of a second, over what the species' bodies do at their greatest bias.
    pub turning: f64,
    /// Mean length of the mean course.
    pub polarisation: f64,
    /// Least and greatest root mean square distance from the middle of all [m].
    pub spread: [f64; 2],
    /// How far one was from its home at most, in how far it leaves it.
    pub strayed: f64,
    /// How often the hunter caught something.
    pub caught: u32,
}

fn species(name: &str) -> Species {
    serde_json::from_value(tables::table(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Half the side of each behaviour's box [m].
fn half(behaviour: Behaviour) -> f64 {
    match behaviour {
        Behaviour::Shoal => 1.6,
        Behaviour::Hunter => 6.0,
        Behaviour::Home => 1.5,
        Behaviour::Wandering => 3.0,
    }
}

fn shoal(behaviour: Behaviour) -> Shoal {
    let kinds: &[(&str, u32)] = match behaviour {
        Behaviour::Shoal => &[("silverside", 40)],
        Behaviour::Hunter => &[("silverside", 40), ("reef-shark", 1)],
        Behaviour::Home => &[("clownfish", 6)],
        Behaviour::Wandering => &[("regal-tang", 5), ("butterflyfish", 5)],
    };
    let known: Vec<Species> = kinds.iter().map(|(name, _)| species(name)).collect();
    let number = |name: &String| kinds.iter().position(|(known, _)| known == name);
    let kind = |species: &Species| {
        let prey = species.mind.prey.iter().filter_map(number).map(|prey| prey as u32).collect();
        Kind::new(species, prey).expect("a kind")
    };
    let middle = DVec3::new(0.0, -5.0, 0.0);
    let half = half(behaviour);
    // Above the slope, off the rocks.
    let lift = if behaviour == Behaviour::Wandering { 0.4 } else { 0.0 };
    let mut random = Random::new(4, behaviour as u64);
    let mut starts = Vec::new();
    for (kind, (_, count)) in (0..).zip(kinds) {
        for _ in 0..*count {
            let off = DVec3::from([(); 3].map(|()| random.signed())) * DVec3::new(0.6, 0.3, 0.6);
            // A shoal that is one, and a hunter that comes to it.
            let off = match (behaviour, kind) {
                (Behaviour::Hunter, 0) => off * 0.25,
                (Behaviour::Hunter, _) => DVec3::new(-0.6, 0.0, 0.0),
                _ => off,
            };
            starts.push(Start {
                kind,
                position: middle + (off + DVec3::Y * lift) * half,
                heading: 3.1 * random.signed(),
                size: 1.0,
                habitat: 0,
                home: None,
                seed: random.bits(),
            });
        }
    }
    let habitat = Habitat { low: middle - half, high: middle + half };
    Shoal::new(known.iter().map(kind).collect(), vec![habitat], &starts).expect("a shoal")
}

/// Watches a behaviour for so long [s], with bodies or with points.
pub fn watch(behaviour: Behaviour, bodies: bool, seconds: f64) -> Seen {
    let mut shoal = shoal(behaviour);
    let (half, home) = (half(behaviour), behaviour == Behaviour::Home);
    let wandering = behaviour == Behaviour::Wandering;
    let anemone = |id: u64, x: f64, z: f64| Host {
        id,
        species: fnv1a_32(HOST.as_bytes()),
        position: DVec3::new(x, -5.2, z),
        radius: 0.2,
    };
    let anemones = [anemone(1, -0.5, 0.0), anemone(2, 0.4, 0.3), anemone(3, 0.2, -0.6)];
    let ball =
        |x: f64, y: f64, z: f64, radius: f32| Obstacle { from: [x, y, z], radius, ..Obstacle::default() };
    let log = Obstacle { delta: [0.4, 1.5, 0.0], ..ball(1.5, -7.5, 1.0, 0.3) };
    let rocks = [ball(-1.0, -6.5, 0.0, 0.7), ball(0.8, -6.8, -1.4, 0.5), log];
    // From −8 m to −6.5 m.
    let heights: Vec<f32> = (0..64).map(|i| -8.0 + 1.5 * (i % 8) as f32 / 7.0).collect();
    let bed = Heightfield { heights: &heights, origin: [-4.0, -4.0], cell: 8.0 / 7.0, columns: 8, rows: 8 };
    let around = Surroundings {
        flow: &[],
        bed: wandering.then_some(bed),
        waves: Waves::default(),
        obstacles: if wandering { &rocks } else { &[] },
        strangers: &[],
        surface: 0.0,
        hosts: if home { &anemones } else { &[] },
        eye: DVec3::new(0.0, -5.0, 0.0),
        near: if bodies { 1e9 } else { 0.0 },
        dt: DT,
        level: Level::best(),
        workers: Workers::inline(),
    };
    let mut seen = Seen {
        beyond: f64::NEG_INFINITY,
        stuck: 0.0,
        touching: 0.0,
        turning: 0.0,
        polarisation: 0.0,
        spread: [f64::INFINITY, 0.0],
        strayed: 0.0,
        caught: 0,
    };
    let count = shoal.fish().len();
    let (mut touching, mut inside) = (vec![0.0; count * count], vec![0.0; count]);
    let mut courses: VecDeque<Vec<Vec3>> = VecDeque::new();
    let steps = (seconds / DT).round() as usize;
    let mut counted = 0.0;
    for step in 0..steps {
        let hunger: Vec<f32> = shoal.fish().iter().map(|fish| fish.hunger).collect();
        shoal.step(&around);
        courses.push_back(shoal.fish().iter().map(|fish| fish.course).collect());
        let before = (courses.len() > TURN).then(|| courses.pop_front()).flatten();
        let settled = step as f64 * DT > SETTLING;
        for (i, fish) in shoal.fish().iter().enumerate() {
            let kind = &shoal.kinds()[fish.kind as usize];
            let at = fish.position;
            let out = (at - DVec3::new(0.0, -5.0, 0.0)).abs() - half;
            seen.beyond = seen.beyond.max(out.max_element());
            if let Some(before) = &before {
                let rate = f64::from(fish.course.angle_between(before[i])) / (TURN as f64 * DT);
                seen.turning = seen.turning.max(rate / kind.gait.fastest_turn());
            }
            seen.caught += u32::from(!kind.prey.is_empty() && fish.hunger < 0.5 * hunger[i]);
            let low = around.bed.map_or(f64::INFINITY, |bed| at.y - f64::from(bed.height(at.x, at.z)));
            let gap = around.obstacles.iter().map(|rock| off(rock, at)).fold(low, f64::min);
            longest(&mut inside[i], gap < 0.0, &mut seen.stuck);
            for (j, other) in shoal.fish().iter().take(i).enumerate() {
                let widths = kind.plan.body().width() * fish.size
                    + shoal.kinds()[other.kind as usize].plan.body().width() * other.size;
                let near = at.distance(other.position) < 0.5 * widths;
                longest(&mut touching[i * count + j], near, &mut seen.touching);
            }
            if let (true, Some(home)) = (settled, shoal.home(i)) {
                let leaves = kind.mind.home * kind.length() * fish.size;
                seen.strayed = seen.strayed.max(at.distance(home) / leaves);
            }
        }
        if settled {
            let own: Vec<_> = shoal.fish().iter().filter(|fish| fish.kind == 0).collect();
            let middle = own.iter().map(|fish| fish.position).sum::<DVec3>() / own.len() as f64;
            let squares = own.iter().map(|fish| fish.position.distance_squared(middle)).sum::<f64>();
            let spread = (squares / own.len() as f64).sqrt();
            seen.spread = [seen.spread[0].min(spread), seen.spread[1].max(spread)];
            let courses = own.iter().map(|fish| fish.course).sum::<Vec3>();
            seen.polarisation += f64::from(courses.length()) / own.len() as f64;
            counted += 1.0;
        }
    }
    seen.polarisation /= counted;
    seen
}

/// Counts the time for which something holds without a pause [s].
fn longest(time: &mut f64, holds: bool, most: &mut f64) {
    *time = if holds { *time + DT } else { 0.0 };
    *most = most.max(*time);
}

/// How far a place is off a capsule's skin [m].
fn off(rock: &Obstacle, at: DVec3) -> f64 {
    let (from, delta) = (DVec3::from(rock.from), Vec3::from(rock.delta).as_dvec3());
    let along = ((at - from).dot(delta) / delta.length_squared().max(1e-9)).clamp(0.0, 1.0);
    at.distance(from + delta * along) - f64::from(rock.radius)
}
