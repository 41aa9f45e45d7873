//! A small sea to step plugins in: one current, no bed, no neighbours.

use reef_abi as abi;
use reef_plugin::StepInput;

/// What a step's input refers to.
#[derive(Clone, Debug)]
pub struct Sea {
    /// The scene's camera.
    pub camera: abi::Camera,
    /// Water.
    pub water: abi::Water,
    /// Flow primitives.
    pub flow: Vec<abi::Flow>,
    /// Instruction set.
    pub simd_level: u32,
    /// `abi::STEP_*`.
    pub flags: u32,
}

/// The fixed step [s].
pub const DT: f64 = 1.0 / 60.0;

impl Default for Sea {
    /// A current of 0.2 m/s along x.
    fn default() -> Self {
        let current = abi::Flow {
            kind: abi::FLOW_DIRECTIONAL,
            axis: [1.0, 0.0, 0.0],
            strength: 0.2,
            peak: 1.0,
            ..Default::default()
        };
        Self {
            camera: abi::Camera {
                rotation: [0.0, 0.0, 0.0, 1.0],
                fov_y: 0.8,
                near_plane: 0.1,
                far_plane: 100.0,
                width: 640,
                height: 360,
                ..Default::default()
            },
            water: abi::Water { density: 1025.0, viscosity: 1e-3, depth: 20.0, ..Default::default() },
            flow: vec![current],
            simd_level: abi::SIMD_AVX512,
            flags: 0,
        }
    }
}

impl Sea {
    /// The input of step number `step`; 0 emits the state before the first.
    pub fn input(&self, step: u64) -> StepInput<'_> {
        StepInput {
            flags: self.flags,
            step,
            time: step as f64 * DT,
            dt: if step == 0 { 0.0 } else { DT },
            seed: 1,
            simd_level: self.simd_level,
            camera: &self.camera,
            water: &self.water,
            heightfield: None,
            flow: &self.flow,
            waves: &[],
            actors: &[],
            obstacles: &[],
        }
    }
}

/// The event that sets a parameter.
pub fn set_param(id: u32, value: f64) -> abi::Event {
    abi::Event { kind: abi::EVENT_PARAM, param: id, value, ..Default::default() }
}

/// The configuration that `create` takes, around a module's own table.
pub fn config(table: &str) -> String {
    format!(
        r#"{{"scene": {{"name": "test", "seed": 1, "scale": 1.0, "dt": {DT}}}, "species": {{}}, "config": {table}}}"#
    )
}
