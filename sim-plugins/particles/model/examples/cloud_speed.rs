//! Where the time of a step goes on one core: `cargo run -p reef-particles-model --example cloud_speed`.

use std::time::Instant;

use reef_flow::{
    Level,
    waves::{Train, WindSea},
};
use reef_particles_model::{
    Levels, Particles, Surroundings,
    config::{BoxTable, Config},
};
use reef_sdk::{
    SceneInfo, Workers,
    abi::{self, Billboard, Camera, Flow},
};

fn main() {
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
    let mut chance = 0.1;
    let trains: Vec<Train> = WindSea { wind: 3.0, heading: 0.3, depth: 5.0, trains: 30 }
        .trains(&mut || {
            chance = (chance * 97.13_f64 + 0.317).fract();
            chance
        })
        .expect("a sea");
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
