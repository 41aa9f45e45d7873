//! Small seas to step plugins in.

use reef_abi as abi;
use reef_plugin::StepInput;
use reef_streams::environment::Heightfield;

/// What a step's input refers to.
#[derive(Clone, Debug)]
pub(super) struct Sea {
    pub(super) flags: u32,
    pub(super) simd_level: u32,
    /// Length of a step [s].
    pub(super) dt: f64,
    /// Added to the number of every step but step 0.
    pub(super) later: u64,
    pub(super) camera: abi::Camera,
    pub(super) water: abi::Water,
    pub(super) flow: Vec<abi::Flow>,
    pub(super) waves: Vec<abi::Wave>,
    pub(super) actors: Vec<abi::Actor>,
    pub(super) obstacles: Vec<abi::Obstacle>,
    /// y of the bed [m]; empty: there is no heightfield.
    pub(super) heights: Vec<f32>,
}

/// A step's length, where nothing else is said [s].
pub(super) const DT: f64 = 1.0 / 60.0;
const DEPTH: f32 = 5.0;
/// Heights along each side of the bed, a metre apart.
const BED: u32 = 33;

/// A current along x [m/s].
fn current(speed: f32) -> abi::Flow {
    abi::Flow {
        kind: abi::FLOW_DIRECTIONAL,
        axis: [1.0, 0.0, 0.0],
        strength: speed,
        peak: speed,
        ..Default::default()
    }
}

impl Sea {
    /// Nothing but water: whatever may be missing is missing.
    pub(super) fn empty() -> Self {
        Self {
            flags: 0,
            simd_level: abi::SIMD_AVX512.min(reef_flow::Level::best().code()),
            dt: DT,
            later: 0,
            camera: abi::Camera {
                position: [0.0, -4.0, 4.0],
                rotation: [0.0, 0.0, 0.0, 1.0],
                fov_y: 0.8,
                near_plane: 0.1,
                far_plane: 100.0,
                width: 640,
                height: 360,
                ..Default::default()
            },
            water: abi::Water { density: 1025.0, viscosity: 1e-3, depth: DEPTH, ..Default::default() },
            flow: Vec::new(),
            waves: Vec::new(),
            actors: Vec::new(),
            obstacles: Vec::new(),
            heights: Vec::new(),
        }
    }

    /// A current over a bed.
    pub(super) fn usual() -> Self {
        let heights = (0..BED * BED).map(|i| -DEPTH + 0.1 * (i % 7) as f32).collect();
        Self { flow: vec![current(0.2)], heights, ..Self::empty() }
    }

    /// Much of everything that a step can have.
    pub(super) fn full() -> Self {
        let mut flow = vec![current(0.2)];
        for i in 0..16_u32 {
            flow.push(abi::Flow {
                kind: [abi::FLOW_SOURCE, abi::FLOW_HOLE, abi::FLOW_WHIRLWIND, abi::FLOW_SHELTER]
                    [i as usize % 4],
                owner: if i < 8 { 0 } else { (1 << 48) | u64::from(i) },
                position: [f64::from(i) - 8.0, -4.5, f64::from(i % 5) - 2.0],
                axis: [0.0, 1.0, 0.0],
                strength: 0.1,
                peak: 1.0,
                core: 0.01,
                reach: 3.0,
                fade: 0.5,
                ..Default::default()
            });
        }
        let waves = (0..30_u32).map(|i| abi::Wave {
            amplitude: 0.3 / (1.0 + i as f32),
            wave_number: 0.2 + 0.1 * i as f32,
            frequency: (9.81 * (0.2 + 0.1 * i as f32)).sqrt(),
            phase: 0.2 * i as f32,
            direction: [1.0, 0.0],
            ..Default::default()
        });
        let actors = (0..100_u32).map(|i| abi::Actor {
            id: (2 << 48) | u64::from(i + 1),
            position: [f64::from(i % 10) - 5.0, -3.0, f64::from(i / 10) - 5.0],
            velocity: [0.1, 0.0, 0.0],
            radius: 0.1,
            forward: [1.0, 0.0, 0.0],
            species: abi::fnv1a_32(b"herring"),
            ..Default::default()
        });
        let obstacles = (0..50_u32).map(|i| abi::Obstacle {
            id: u64::from(i + 1),
            from: [f64::from(i % 7) - 3.0, -5.0, f64::from(i / 7) - 3.0],
            delta: [0.0, 0.3, 0.1],
            radius: 0.1,
        });
        Self {
            flow,
            waves: waves.collect(),
            actors: actors.collect(),
            obstacles: obstacles.collect(),
            ..Self::usual()
        }
    }

    /// A current that no diver would go into.
    pub(super) fn storm() -> Self {
        Self { flow: vec![current(5.0)], ..Self::usual() }
    }

    /// The input of step number `number`; 0 emits the state before the first.
    pub(super) fn input(&self, number: u64) -> StepInput<'_> {
        let step = if number == 0 { 0 } else { number + self.later };
        StepInput {
            flags: self.flags,
            step,
            time: step as f64 * self.dt,
            dt: if number == 0 { 0.0 } else { self.dt },
            seed: 1,
            simd_level: self.simd_level,
            camera: &self.camera,
            water: &self.water,
            heightfield: (!self.heights.is_empty()).then_some(Heightfield {
                heights: &self.heights,
                origin: [-16.0, -16.0],
                cell: 1.0,
                columns: BED,
                rows: BED,
            }),
            flow: &self.flow,
            waves: &self.waves,
            actors: &self.actors,
            obstacles: &self.obstacles,
        }
    }
}
