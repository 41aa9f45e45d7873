//! What a step may read, as the world holds it; [`StepInput::raw`] spells it for the contract.

use reef_abi as abi;
use reef_streams::environment::Heightfield;

/// One step's input, the same for every instance.
#[derive(Clone, Copy, Debug)]
pub struct StepInput<'a> {
    /// `abi::STEP_*`.
    pub flags: u32,
    /// Number of this step, from 1; 0: the state before the first.
    pub step: u64,
    /// Time at the end of this step [s].
    pub time: f64,
    /// Length of the step [s]; 0: emit the present state, change nothing.
    pub dt: f64,
    /// Seed of everything random.
    pub seed: u64,
    /// `abi::SIMD_*`.
    pub simd_level: u32,
    /// The scene's camera, with its nominal viewport.
    pub camera: &'a abi::Camera,
    /// Density, viscosity, depth.
    pub water: &'a abi::Water,
    /// The sea bed, where there is one.
    pub heightfield: Option<Heightfield<'a>>,
    /// The scene's primitives, then what instances emitted in the step before, in fixed order.
    pub flow: &'a [abi::Flow],
    /// Greatest amplitude first.
    pub waves: &'a [abi::Wave],
    /// What instances let others perceive in the step before, in fixed order.
    pub actors: &'a [abi::Actor],
    /// Capsules that nothing should enter.
    pub obstacles: &'a [abi::Obstacle],
}

impl StepInput<'_> {
    /// The heightfield as the contract spells it.
    pub(crate) fn raw_heightfield(&self) -> Option<abi::Heightfield> {
        let field = self.heightfield.as_ref()?;
        (field.heights.len() == field.columns as usize * field.rows as usize).then_some(abi::Heightfield {
            heights: field.heights.as_ptr(),
            origin: field.origin,
            cell: field.cell,
            columns: field.columns,
            rows: field.rows,
            spare: 0,
        })
    }

    /// The step as the contract spells it. Valid as long as its arguments stay where they are.
    pub(crate) fn raw(&self, heightfield: Option<&abi::Heightfield>, events: &[abi::Event]) -> abi::Step {
        abi::Step {
            size: size_of::<abi::Step>() as u32,
            flags: self.flags,
            step: self.step,
            time: self.time,
            dt: self.dt,
            seed: self.seed,
            simd_level: self.simd_level,
            flow_count: self.flow.len() as u32,
            wave_count: self.waves.len() as u32,
            actor_count: self.actors.len() as u32,
            obstacle_count: self.obstacles.len() as u32,
            event_count: events.len() as u32,
            camera: self.camera,
            water: self.water,
            heightfield: heightfield.map_or(std::ptr::null(), std::ptr::from_ref),
            flow: self.flow.as_ptr(),
            waves: self.waves.as_ptr(),
            actors: self.actors.as_ptr(),
            obstacles: self.obstacles.as_ptr(),
            events: events.as_ptr(),
        }
    }
}
