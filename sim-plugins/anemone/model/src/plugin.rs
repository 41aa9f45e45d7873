//! The plugin: configuration in, streams out.

use reef_flow::Level;
use reef_sdk::prelude::*;

use crate::{
    bed::{Bed, Settings, Surroundings},
    config::Config,
    debug::{self, Shown},
    sow,
    wide::Force,
};

/// Sea anemones, seagrasses and bare fibres.
#[derive(Debug)]
pub struct Anemones {
    bed: Bed,
}

/// The field of a saved state that has all fibres.
const FIBRES: &str = "fibres";

/// Numbers of the parameters: they never change, not even when one is removed.
mod id {
    pub(super) const STIFFNESS: u32 = 1;
    pub(super) const EXPONENT: u32 = 2;
    pub(super) const DAMPING: u32 = 3;
    pub(super) const FORCE: u32 = 4;
    pub(super) const DRAG: u32 = 5;
    pub(super) const CURRENT: u32 = 6;
    pub(super) const CONTACT: u32 = 7;
    pub(super) const RIGID: u32 = 8;
    pub(super) const ARROWS: u32 = 9;
    pub(super) const WAVES: u32 = 10;
    pub(super) const TRAINS: u32 = 11;
}

/// What can change while the sea runs.
pub const PARAMS: &[Param] = &[
    Param::float(id::STIFFNESS, "stiffness")
        .label("Stiffness")
        .group("Fibres")
        .range(0.01, 100.0)
        .default(1.0)
        .logarithmic()
        .help("Factor on the stiffness K of every fibre."),
    Param::float(id::EXPONENT, "exponent")
        .label("Exponent, added")
        .group("Fibres")
        .range(-5.0, 20.0)
        .default(0.0)
        .help("Added to the exponent n of every fibre: more bends nearer to the tip."),
    Param::float(id::DAMPING, "damping")
        .label("Damping")
        .group("Fibres")
        .range(0.0, 10.0)
        .default(1.0)
        .help("Factor on the time in which fibres follow the water; 0 lets them jump to equilibrium."),
    Param::choice(id::FORCE, "force", &["linear", "quadratic"])
        .label("Force")
        .group("Water")
        .help("Linear in the velocity, or with the drag coefficient of a cylinder."),
    Param::float(id::DRAG, "drag")
        .label("Drag")
        .group("Water")
        .range(0.0, 20.0)
        .default(1.0)
        .help("Factor on the force that the flow exerts."),
    Param::float(id::CURRENT, "current")
        .label("Current")
        .group("Water")
        .range(0.0, 10.0)
        .default(1.0)
        .help("Factor on the velocity that the fibres feel."),
    Param::float(id::WAVES, "waves")
        .label("Waves")
        .group("Water")
        .range(0.0, 10.0)
        .default(1.0)
        .help("Factor on the orbital velocity with which the waves move the water around the fibres; 0 leaves them out."),
    Param::switch(id::TRAINS, "trains")
        .label("Choose wave trains")
        .group("Water")
        .default(1.0)
        .help("Leaves out wave trains that move the water by less than half a pixel at a plant's depth and distance."),
    Param::float(id::CONTACT, "contact")
        .label("Contact")
        .group("Water")
        .range(0.0, 20.0)
        .default(4.0)
        .help("Stiffness of rocks and ground over that of the fibre that touches them; 0 lets fibres pass."),
    Param::switch(id::RIGID, "rigid")
        .label("Hold still")
        .group("Figures")
        .help("Works out forces and moments without bending the fibres."),
    Param::choice(id::ARROWS, "arrows", &["both", "forces", "moments"]).label("Arrows").group("Figures").help(
        "What debug lines show: the flow's forces on the nodes, the moments handed down the chain, or both.",
    ),
];

impl Anemones {
    /// The plants.
    pub fn bed(&self) -> &Bed {
        &self.bed
    }

    fn settings(input: &StepInput) -> Settings {
        Settings {
            stiffness: input.param(id::STIFFNESS),
            exponent: input.param(id::EXPONENT),
            damping: input.param(id::DAMPING),
            force: if input.param(id::FORCE) >= 0.5 { Force::Quadratic } else { Force::Linear },
            drag: input.param(id::DRAG) as f32,
            current: input.param(id::CURRENT) as f32,
            waves: input.param(id::WAVES) as f32,
            trains: input.param(id::TRAINS) >= 0.5,
            contact: input.param(id::CONTACT) as f32,
            rigid: input.param(id::RIGID) >= 0.5,
        }
    }

    /// The plants of a configuration, and what its author should know.
    pub fn plant(scene: &SceneInfo, config: &Config) -> Result<(Bed, Vec<String>), ConfigError> {
        reef_sdk::ranges::check(config)?;
        let mut harvest = sow::sow(scene, config)?;
        let remarks = std::mem::take(&mut harvest.remarks);
        Ok((Bed::new(harvest), remarks))
    }
}

impl Plugin for Anemones {
    const ID: &'static str = "reef.anemone";
    const NAME: &'static str = "Anemones";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const VENDOR: &'static str = "Reef";
    const DESCRIPTION: &'static str =
        "Sea anemones and seagrasses as fibres in a flow of singularities (Aliaga and Larboulette 2009).";
    const STATE_VERSION: u32 = 2;
    const STATE_MIN_VERSION: u32 = 2;
    const LOADS_OVER: bool = true;
    type Config = Config;

    fn traces() -> &'static [&'static str] {
        &["fibre"]
    }

    fn params() -> &'static [Param] {
        PARAMS
    }

    fn create(host: &Host, scene: &SceneInfo, config: Config) -> Result<Self, ConfigError> {
        let (bed, remarks) = Self::plant(scene, &config)?;
        for remark in remarks {
            host.log(reef_sdk::Level::Warn, &remark);
        }
        Ok(Self { bed })
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        let settings = Self::settings(input);
        let bed = &mut self.bed;
        let around = Surroundings {
            flow: input.flow(),
            waves: input.waves(),
            depth: input.water().depth.into(),
            camera: Some(input.camera()),
            obstacles: input.obstacles(),
            ground: input.heightfield(),
            density: input.water().density,
            viscosity: input.water().viscosity,
            dt: input.dt(),
            level: Level::at_most(input.simd_level()),
            workers: input.workers(),
        };
        if input.is_unseen() {
            bed.step(&around, &settings, &mut []);
        } else {
            let count = bed.node_count();
            let nodes = output.reserve::<abi::FibreNode>(count)?;
            bed.step(&around, &settings, bytemuck::cast_slice_mut(nodes));
            output.commit::<abi::FibreNode>(count)?;
            let count = bed.write_fibres(around.workers, output.reserve(bed.fibre_count())?);
            output.commit::<abi::Fibre>(count)?;
        }
        bed.write_objects(around.workers, output.reserve(bed.plant_count())?);
        output.commit::<abi::Object>(bed.plant_count())?;
        let count = fill(output, bed.perceived_count(), bed.actors())?;
        output.commit::<abi::Actor>(count)?;
        output.emit(bed.materials())?;
        let (done, saved) = bed.evaluations();
        let host = input.host();
        host.figure("flow evaluations in a step", done as f64);
        host.figure("saved by bounding spheres", saved as f64);
        if input.wants_trace() {
            let count = fill(output, bed.trace_len(), bed.trace())?;
            output.commit::<abi::Trace>(count)?;
        }
        if input.wants_debug() {
            let water = input.water();
            let shown = match input.param(id::ARROWS) as u32 {
                1 => Shown::Forces,
                2 => Shown::Moments,
                _ => Shown::Both,
            };
            let water = (water.density.into(), water.viscosity.into());
            let lines = debug::lines(bed, input.flow(), &settings, water, shown);
            let count = fill(output, lines.len(), lines.iter().copied())?;
            output.commit::<abi::DebugLine>(count)?;
        }
        Ok(Status::Ok)
    }

    fn save(&self, state: &mut StateWriter) {
        state.fill(FIBRES, self.bed.state_len(), |into| self.bed.save_to(into));
    }

    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
        let fibres = state.get::<f32>(FIBRES)?;
        self.bed.load(&fibres).map_err(|problem| StateError::Refused(format!("field `{FIBRES}` {problem}")))
    }
}

/// Reserves room for `most` elements of a stream and writes what comes; returns how many that were.
fn fill<T: Element>(
    output: &mut Output,
    most: usize,
    elements: impl Iterator<Item = T>,
) -> Result<usize, StepError> {
    let room = output.reserve::<T>(most)?;
    let mut count = 0;
    for (slot, element) in room.iter_mut().zip(elements) {
        *slot = element;
        count += 1;
    }
    Ok(count)
}
