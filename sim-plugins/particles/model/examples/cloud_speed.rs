//! Where the time of a step goes on one core:
//! `cargo run -p reef-particles-model --example cloud_speed [FLOWS [X [LEVEL]]]`, the default sea's detritus
//! under the first so many flows, with X only with levels of detail; with `table`: of the paper's table 1.

use std::time::Instant;

use reef_flow::{
    Level,
    waves::{Rule, Train, WindSea},
};
use reef_particles_model::{
    Cloud, Levels, Particles, Surroundings,
    config::{BoxTable, Config},
};
use reef_sdk::{
    SceneInfo, Workers,
    abi::{self, Billboard, Camera, Flow},
};

/// No level of detail.
fn none() -> Levels {
    Levels { trains: false, visible: false, masters: false, fog: false, ..Levels::default() }
}

/// The particles of one box.
fn filled(json: &str) -> Cloud {
    let table: BoxTable = serde_json::from_str(json).expect("a good box");
    let config = Config { boxes: vec![table], ..Config::default() };
    let scene = SceneInfo { seed: 5, scale: 1.0, ..SceneInfo::default() };
    Particles::fill(&scene, &config).expect("a good configuration")
}

/// A camera that looks along -z.
fn camera(position: [f64; 3], fov_y: f32) -> Camera {
    let rotation = [0.0, 0.0, 0.0, 1.0];
    Camera { position, rotation, fov_y, width: 1280, height: 720, ..Camera::default() }
}

/// The shortest times [s] of a few hundred steps, and the sprites of the last.
struct Times {
    advance: f64,
    emit: f64,
    sprites: usize,
}

fn measure(cloud: &mut Cloud, trains: &[Train], around: &Surroundings<'_>, levels: &Levels) -> Times {
    let mut sprites = vec![Billboard::default(); 110_000];
    let mut times = Times { advance: f64::INFINITY, emit: f64::INFINITY, sprites: 0 };
    for step in 1..400 {
        let waves: Vec<_> = trains.iter().map(|train| train.at(step as f64 / 60.0)).collect();
        let around = Surroundings { waves: &waves, step, ..*around };
        let start = Instant::now();
        let counts = cloud.advance(&around, levels);
        let middle = Instant::now();
        cloud.emit(&around, &mut sprites[..counts.sprites], &mut []);
        times.advance = times.advance.min((middle - start).as_secs_f64());
        times.emit = times.emit.min(middle.elapsed().as_secs_f64());
        times.sprites = counts.sprites;
    }
    times
}

fn around<'a>(flow: &'a [Flow], depth: f64, camera: &'a Camera, level: Level) -> Surroundings<'a> {
    Surroundings {
        flow,
        waves: &[],
        depth,
        camera,
        dt: 1.0 / 60.0,
        step: 0,
        level,
        workers: Workers::inline(),
        trace: false,
    }
}

/// The paper's table 1, without other levels of detail than the choice of trains.
fn table() {
    let mut cloud = filled(r#"{"low": [-5.0, -1.5, -5.0], "high": [5.0, -0.5, 5.0], "count": 4000}"#);
    let trains = trains(5.0, 60.0);
    for distance in [0.0, 3.0, 6.0, 9.0, 12.0] {
        let camera = camera([0.3, -1.0, 5.0 + distance], 0.96);
        let around = around(&[], 60.0, &camera, Level::best());
        let rules =
            [(true, Rule::Sum, 30), (true, Rule::Each, 30), (false, Rule::Sum, 30), (false, Rule::Sum, 0)];
        for (chosen, selection, waves) in rules {
            let levels = Levels { trains: chosen, selection, ..none() };
            let times = measure(&mut cloud, &trains[..waves], &around, &levels);
            let [orbits, evaluated] = cloud.work();
            println!(
                "{distance} m, {} of {waves} trains {:?}: {:.1} a particle, drift {:.0} us, ride and emit {:.0} us",
                if levels.trains { "some" } else { "all" },
                levels.selection,
                evaluated as f64 / orbits as f64,
                1e6 * times.advance,
                1e6 * times.emit
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
    let argument = |at: usize| std::env::args().nth(at);
    if argument(1).is_some_and(|argument| argument == "table") {
        return table();
    }
    let mut cloud = filled(r#"{"low": [-16.0, -4.9, -26.0], "high": [16.0, -0.2, 6.0], "count": 100000}"#);
    let camera = camera([0.0, -4.4, 1.7], 0.98);
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
    if let Some(n) = argument(1) {
        flow.truncate(n.parse().expect("a number"));
    }
    let level = argument(3).map_or(Level::best(), |level| Level::at_most(level.parse().expect("a level")));
    let around = around(&flow, 5.0, &camera, level);
    let trains = trains(3.0, 5.0);
    let all = [("levels of detail", Levels::default()), ("none", none())];
    for (name, levels) in &all[..if argument(2).is_some() { 1 } else { 2 }] {
        let times = measure(&mut cloud, &trains, &around, levels);
        println!(
            "{name}: drift {:.0} us, ride and emit {:.0} us, {} sprites",
            1e6 * times.advance,
            1e6 * times.emit,
            times.sprites
        );
    }
}
