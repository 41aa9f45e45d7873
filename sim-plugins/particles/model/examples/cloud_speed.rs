//! Where the time of a step goes on one core: `cargo run -p reef-particles-model --example cloud_speed`; with `table`: of the
//! paper's table 1.

use std::time::Instant;

use reef_flow::{
    Level,
    waves::{Rule, Train, WindSea},
};
use reef_particles_model::{
    Levels, Particles, Surroundings,
    config::{BoxTable, Config},
};
use reef_sdk::{
    SceneInfo, Workers,
    abi::{self, Billboard, Camera, Flow},
};

/// The paper's table 1, without other levels of detail than the choice of trains.
fn table() {
    let table: BoxTable =
        serde_json::from_str(r#"{"low": [-5.0, -1.5, -5.0], "high": [5.0, -0.5, 5.0], "count": 4000}"#)
            .expect("a good box");
    let config = Config { boxes: vec![table], ..Config::default() };
    let scene = SceneInfo { seed: 5, scale: 1.0, ..SceneInfo::default() };
    let mut cloud = Particles::fill(&scene, &config).expect("a good configuration");
    let trains = trains(5.0, 60.0);
    let mut sprites = vec![Billboard::default(); 4000];
    let none = Levels { trains: false, visible: false, masters: false, fog: false, ..Levels::default() };
    for distance in [0.0, 3.0, 6.0, 9.0, 12.0] {
        let rules = [(true, Rule::Sum), (true, Rule::Each), (false, Rule::Sum)];
        for (levels, waves) in rules
            .map(|(trains, selection)| (Levels { trains, selection, ..none }, 30))
            .into_iter()
            .chain([(none, 0)])
        {
            let camera = Camera {
                position: [0.3, -1.0, 5.0 + distance],
                rotation: [0.0, 0.0, 0.0, 1.0],
                fov_y: 0.96,
                width: 1280,
                height: 720,
                ..Camera::default()
            };
            let (mut advance, mut emit) = (f64::INFINITY, f64::INFINITY);
            for step in 1..400 {
                let waves: Vec<_> =
                    trains[..waves].iter().map(|train| train.at(step as f64 / 60.0)).collect();
                let around = Surroundings {
                    flow: &[],
                    waves: &waves,
                    depth: 60.0,
                    camera: &camera,
                    dt: 1.0 / 60.0,
                    step,
                    level: Level::best(),
                    workers: Workers::inline(),
                    trace: false,
                };
                let start = Instant::now();
                let counts = cloud.advance(&around, &levels);
                let middle = Instant::now();
                cloud.emit(&around, &mut sprites[..counts.sprites], &mut []);
                advance = advance.min((middle - start).as_secs_f64());
                emit = emit.min(middle.elapsed().as_secs_f64());
            }
            let [orbits, evaluated] = cloud.work();
            println!(
                "{distance} m, {} of {waves} trains {:?}: {:.1} a particle, drift {:.0} us, ride and emit {:.0} us",
                if levels.trains { "some" } else { "all" },
                levels.selection,
                evaluated as f64 / orbits as f64,
                1e6 * advance,
                1e6 * emit
            );
        }
    }
}

fn trains(wind: f64, depth: f64) -> Vec<Train> {
    let mut chance = 0.1;
    let mut random = || {
        chance = (chance * 97.13_f64 + 0.317).fract();
        chance
    };
    WindSea { wind, heading: 0.3, depth, trains: 30 }.trains(&mut random).expect("a sea")
}

fn main() {
    if std::env::args().nth(1).is_some_and(|argument| argument == "table") {
        return table();
    }
    let table: BoxTable =
        serde_json::from_str(r#"{"low": [-16.0, -4.9, -26.0], "high": [16.0, -0.2, 6.0], "count": 100000}"#)
            .expect("a good box");
    let config = Config { boxes: vec![table], ..Config::default() };
    let scene = SceneInfo { seed: 5, scale: 1.0, ..SceneInfo::default() };
    let mut cloud = Particles::fill(&scene, &config).expect("a good configuration");
    let camera = Camera {
        position: [0.0, -4.4, 1.7],
        rotation: [0.0, 0.0, 0.0, 1.0],
        fov_y: 0.98,
        width: 1280,
        height: 720,
        ..Camera::default()
    };
    let surge = Flow {
        kind: abi::FLOW_DIRECTIONAL,
        axis: [1.0, 0.0, 0.0],
        strength: 0.1,
        modulation: 1.0,
        wave_vector: [0.7, 0.0, 0.1],
        ..Flow::default()
    };
    let eddy = Flow {
        kind: abi::FLOW_WHIRLWIND,
        position: [0.5, -4.6, 0.1],
        axis: [0.0, 1.0, 0.0],
        strength: 0.03,
        peak: 0.09,
        core: 0.15,
        reach: 2.5,
        fade: 0.4,
        ..Flow::default()
    };
    let mut flow = vec![surge, surge, eddy];
    if let Some(n) = std::env::args().nth(1) {
        flow.truncate(n.parse().expect("a number"));
    }
    let trains = trains(3.0, 5.0);
    let mut sprites = vec![Billboard::default(); 110_000];
    for (name, levels) in [
        ("levels of detail", Levels::default()),
        ("none", Levels { trains: false, visible: false, masters: false, fog: false, ..Levels::default() }),
    ] {
        if name == "none" && std::env::args().nth(2).is_some() {
            continue;
        }
        let (mut advance, mut emit, mut count) = (f64::INFINITY, f64::INFINITY, 0);
        for step in 1..400 {
            let waves: Vec<_> = trains.iter().map(|train| train.at(step as f64 / 60.0)).collect();
            let around = Surroundings {
                flow: &flow,
                waves: &waves,
                depth: 5.0,
                camera: &camera,
                dt: 1.0 / 60.0,
                step,
                level: std::env::args()
                    .nth(3)
                    .map_or(Level::best(), |l| Level::at_most(l.parse().expect("a level"))),
                workers: Workers::inline(),
                trace: false,
            };
            let start = Instant::now();
            let counts = cloud.advance(&around, &levels);
            let middle = Instant::now();
            cloud.emit(&around, &mut sprites[..counts.sprites], &mut []);
            advance = advance.min((middle - start).as_secs_f64());
            emit = emit.min(middle.elapsed().as_secs_f64());
            count = counts.sprites;
        }
        println!(
            "{name}: drift {:.0} us, ride and emit {:.0} us, {count} sprites",
            1e6 * advance,
            1e6 * emit
        );
    }
}
