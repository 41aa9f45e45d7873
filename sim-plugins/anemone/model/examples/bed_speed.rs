//! Node-steps a second of a scene's plants, one core, with 3 sources and 1 whirlwind, in still water and
//! under the 30 trains of a wind of 8 m/s:
//! `cargo run -p reef-anemone-model --example bed_speed [SPECIES [PLANTS [LEVEL [TRAINS]]]]`; LEVEL: the
//! least `REEF_SIMD_*` that is measured.

use std::{path::Path, time::Instant};

use reef_anemone_model::{
    Anemones,
    bed::{Settings, Surroundings},
    config::{Anemone, Config},
};
use reef_flow::{
    Level,
    waves::{Train, WindSea},
};
use reef_sdk::{
    SceneInfo,
    abi::{self, Flow},
};

/// Depth of the water, and height of the plants' feet [m].
const DEPTH: f64 = 5.0;
const BOTTOM: f64 = -4.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "actinia-fragacea".into());
    let count: usize = arguments.next().map_or(Ok(36), |text| text.parse())?;
    let least: u32 = arguments.next().map_or(Ok(0), |text| text.parse())?;
    let trains: u32 = arguments.next().map_or(Ok(30), |text| text.parse())?;
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../../assets/species/{name}.toml"));
    let mut species: serde_json::Map<_, _> = toml::from_str(&std::fs::read_to_string(file)?)?;
    species["tentacles"]["count"] = 40.into();
    let mut scene = SceneInfo { seed: 1, scale: 1.0, dt: 1.0 / 60.0, ..SceneInfo::default() };
    scene.species.insert(name.clone(), species.into());
    let anemones = (0..count)
        .map(|i| Anemone {
            species: name.clone(),
            position: [(i % 6) as f64 * 0.2, BOTTOM, (i / 6) as f64 * 0.2],
            scale: 1.0,
            yaw: 0.0,
            seed: None,
        })
        .collect();
    let (mut bed, _) = Anemones::plant(&scene, &Config { anemones, ..Config::default() })?;
    let local = |kind, position: [f64; 3], strength| Flow {
        kind,
        position: [position[0], position[1] + BOTTOM, position[2]],
        axis: [0.0, 1.0, 0.0],
        strength,
        peak: 0.5,
        core: 0.01,
        ..Flow::default()
    };
    let flow = [
        local(abi::FLOW_SOURCE, [-0.3, 0.1, 0.2], 2e-3),
        local(abi::FLOW_SOURCE, [0.5, 0.2, 0.5], 1e-3),
        local(abi::FLOW_HOLE, [1.2, 0.1, 0.7], 2e-3),
        local(abi::FLOW_WHIRLWIND, [0.4, 0.0, -0.3], 3e-3),
    ];
    let mut chance = 0.0;
    let sea = WindSea { wind: 8.0, heading: 0.0, depth: DEPTH, trains };
    let trains = sea.trains(&mut || {
        chance = (chance + 0.618_033_988_749_895_f64).fract();
        chance
    })?;
    let waves: Vec<abi::Wave> = trains.iter().map(|train: &Train| train.at(0.0)).collect();
    let mut nodes = vec![[0.0_f32; 4]; bed.node_count()];
    for level in Level::all().into_iter().filter(|level| level.code() >= least) {
        let still = Surroundings { flow: &flow, level, depth: DEPTH, ..Surroundings::default() };
        let swaying = Surroundings { waves: &waves, ..still };
        let mut best = [f64::INFINITY; 2];
        for _ in 0..60 {
            for (around, best) in [still, swaying].iter().zip(&mut best) {
                let start = Instant::now();
                for _ in 0..5 {
                    bed.step(around, &Settings::default(), &mut nodes);
                }
                *best = best.min(start.elapsed().as_secs_f64() / 5.0);
            }
        }
        println!(
            "{}: {:.1} M node-steps/s, {:.3} ms a step of {} nodes; under waves {:.1} % more",
            level.name(),
            nodes.len() as f64 / best[0] * 1e-6,
            best[0] * 1e3,
            nodes.len(),
            (best[1] / best[0] - 1.0) * 100.0
        );
    }
    Ok(())
}
