//! A minimal plugin to copy: a row of reeds that lean with the water.
//!
//! Each reed's lean follows the flow at its tip with a time constant, and its nodes stand on a parabola:
//! x(t) = lean · t², y(t) = height · t for t from 0 at the root to 1 at the tip.

#![deny(unsafe_code)]

use reef_sdk::prelude::*;

/// Nodes of a reed.
const NODES: usize = 8;
/// Reeds that one job moves.
const CHUNK: usize = 64;
/// Most reeds of one module.
const MOST: u32 = 100_000;

/// The parameter `lean`: its id never changes.
const LEAN: u32 = 1;
/// The parameter `delay`.
const DELAY: u32 = 2;

static PARAMS: &[Param] = &[
    Param::float(LEAN, "lean")
        .label("Lean")
        .group("Reeds")
        .unit("s")
        .range(0.0, 10.0)
        .default(1.0)
        .help("How far a tip is displaced per speed of the water."),
    Param::float(DELAY, "delay")
        .label("Delay")
        .group("Reeds")
        .unit("s")
        .range(0.01, 10.0)
        .default(0.3)
        .logarithmic()
        .help("How slowly a reed follows the water."),
];

/// The module's table in a scene file.
#[derive(serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Config {
    /// How many reeds stand in the row.
    count: u32,
    /// Height of a reed [m].
    height: f32,
    /// Distance between two reeds [m].
    spacing: f32,
    /// Where the row begins [m].
    position: [f64; 3],
}

impl Default for Config {
    fn default() -> Self {
        Self { count: 10, height: 0.3, spacing: 0.05, position: [0.0; 3] }
    }
}

/// A row of reeds.
struct Reeds {
    config: Config,
    /// Tips relative to the row's origin at rest [m], one vector an axis.
    tips: [Vec<f32>; 3],
    /// Velocity of the water at the tips [m/s].
    water: [Vec<f32>; 3],
    /// Displacement of the tips along x and z [m].
    lean: Vec<[f32; 2]>,
}

impl Plugin for Reeds {
    const ID: &'static str = "example.reeds";
    const NAME: &'static str = "Reeds";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const VENDOR: &'static str = "Reef";
    const DESCRIPTION: &'static str = "A row of reeds that lean with the water.";
    const STATE_VERSION: u32 = 1;
    const STATE_MIN_VERSION: u32 = 1;
    type Config = Config;

    fn params() -> &'static [Param] {
        PARAMS
    }

    fn create(_host: &Host, _scene: &SceneInfo, config: Config) -> Result<Self, ConfigError> {
        if config.count > MOST {
            return Err(ConfigError::new("count", format!("is {}, allowed is 0 to {MOST}", config.count)));
        }
        if !(config.height > 0.0 && config.height <= 100.0) {
            return Err(ConfigError::new(
                "height",
                format!("is {}, allowed is above 0 to 100 m", config.height),
            ));
        }
        let count = config.count as usize;
        let x = (0..count).map(|i| i as f32 * config.spacing).collect();
        let still = || vec![0.0; count];
        Ok(Self {
            tips: [x, vec![config.height; count], still()],
            water: [still(), still(), still()],
            lean: vec![[0.0; 2]; count],
            config,
        })
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        let [x, y, z] = &self.tips;
        let [vx, vy, vz] = &mut self.water;
        input.sample_flow(self.config.position, 0, [x, y, z], [vx, vy, vz])?;

        let count = self.lean.len();
        let nodes = output.reserve::<abi::FibreNode>(count * NODES)?;
        let dt = input.dt() as f32;
        let (lean, delay) = (input.param(LEAN) as f32, input.param(DELAY) as f32);
        let share = dt / (delay + dt); // An implicit step: stable at any length, exactly still for dt = 0.
        let (x, water, height) = (&self.tips[0], &self.water, self.config.height);
        input.workers().for_each_part(
            (Chunks::new(&mut self.lean, CHUNK), Chunks::new(nodes, CHUNK * NODES)),
            |chunk, (leans, nodes)| {
                for (i, (now, nodes)) in leans.iter_mut().zip(nodes.chunks_exact_mut(NODES)).enumerate() {
                    let reed = chunk * CHUNK + i;
                    now[0] += share * (lean * water[0][reed] - now[0]);
                    now[1] += share * (lean * water[2][reed] - now[1]);
                    for (k, node) in nodes.iter_mut().enumerate() {
                        let t = k as f32 / (NODES - 1) as f32;
                        *node = abi::FibreNode {
                            position: [x[reed] + now[0] * t * t, height * t, now[1] * t * t],
                            radius: 0.004 - 0.003 * t,
                        };
                    }
                }
            },
        );
        output.commit::<abi::FibreNode>(count * NODES)?;

        let length = self.config.spacing * count as f32;
        output.emit(&[abi::Object {
            id: 1,
            origin: self.config.position,
            bounds_center: [length / 2.0, height / 2.0, 0.0],
            bounds_radius: length + height,
            ..Default::default()
        }])?;
        output.emit(&[abi::Material {
            base: [0.05, 0.2, 0.05, 1.0],
            tip: [0.3, 0.5, 0.1, 0.5],
            roughness: 0.8,
            ..Default::default()
        }])?;
        let fibres = output.reserve::<abi::Fibre>(count)?;
        for (reed, fibre) in fibres.iter_mut().enumerate() {
            *fibre = abi::Fibre {
                first_node: (reed * NODES) as u32,
                node_count: NODES as u32,
                sides: 6,
                variation: reed as u32,
                flatness: 1.0,
                normal: [0.0, 0.0, 1.0],
                ..Default::default()
            };
        }
        output.commit::<abi::Fibre>(count)?;
        Ok(Status::Ok)
    }

    fn save(&self, state: &mut StateWriter) {
        state.put("lean", self.lean.as_flattened());
    }

    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
        state.fill("lean", self.lean.as_flattened_mut())
    }
}

reef_sdk::export!(Reeds);
