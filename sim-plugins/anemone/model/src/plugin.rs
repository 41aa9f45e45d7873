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
    /// The retained materials were committed.
    dressed: bool,
}

/// What can change while the sea runs.
pub const PARAMS: &[Param] = &[
    Param::float(1, "stiffness")
        .label("Stiffness")
        .group("Fibres")
        .range(0.01, 100.0)
        .default(1.0)
        .logarithmic()
        .help("Factor on the stiffness K of every fibre."),
    Param::float(2, "exponent")
        .label("Exponent, added")
        .group("Fibres")
        .range(-5.0, 20.0)
        .default(0.0)
        .help("Added to the exponent n of every fibre: more bends nearer to the tip."),
    Param::float(3, "damping")
        .label("Damping")
        .group("Fibres")
        .range(0.0, 10.0)
        .default(1.0)
        .help("Factor on the time in which fibres follow the water; 0 lets them jump to equilibrium."),
    Param::choice(4, "force", &["linear", "quadratic"])
        .label("Force")
        .group("Water")
        .help("Linear in the velocity, or with the drag coefficient of a cylinder."),
    Param::float(5, "drag")
        .label("Drag")
        .group("Water")
        .range(0.0, 20.0)
        .default(1.0)
        .help("Factor on the force that the flow exerts."),
    Param::float(6, "current")
        .label("Current")
        .group("Water")
        .range(0.0, 10.0)
        .default(1.0)
        .help("Factor on the velocity that the fibres feel."),
    Param::float(7, "contact")
        .label("Contact")
        .group("Water")
        .range(0.0, 20.0)
        .default(4.0)
        .help("Stiffness of rocks and ground over that of the fibre that touches them; 0 lets fibres pass."),
    Param::switch(8, "rigid")
        .label("Hold still")
        .group("Figures")
        .help("Works out forces and moments without bending the fibres."),
    Param::choice(9, "arrows", &["both", "forces", "moments"]).label("Arrows").group("Figures").help(
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
            stiffness: input.param(1),
            exponent: input.param(2),
            damping: input.param(3),
            force: if input.param(4) >= 0.5 { Force::Quadratic } else { Force::Linear },
            drag: input.param(5) as f32,
            current: input.param(6) as f32,
            contact: input.param(7) as f32,
            rigid: input.param(8) >= 0.5,
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
    type Config = Config;

    fn params() -> &'static [Param] {
        PARAMS
    }

    fn create(host: &Host, scene: &SceneInfo, config: Config) -> Result<Self, ConfigError> {
        let (bed, remarks) = Self::plant(scene, &config)?;
        for remark in remarks {
            host.log(reef_sdk::Level::Warn, &remark);
        }
        Ok(Self { bed, dressed: false })
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        let settings = Self::settings(input);
        let bed = &mut self.bed;
        let around = Surroundings {
            flow: input.flow(),
            obstacles: input.obstacles(),
            ground: input.heightfield(),
            density: input.water().density,
            viscosity: input.water().viscosity,
            dt: input.dt(),
            level: Level::at_most(input.simd_level()),
            workers: input.workers(),
        };
        let count = bed.node_count();
        let nodes = output.reserve::<abi::FibreNode>(count)?;
        bed.step(&around, &settings, bytemuck::cast_slice_mut(nodes));
        output.commit::<abi::FibreNode>(count)?;
        let count = bed.write_fibres(around.workers, output.reserve(bed.fibre_count())?);
        output.commit::<abi::Fibre>(count)?;
        bed.write_objects(around.workers, output.reserve(bed.plant_count())?);
        output.commit::<abi::Object>(bed.plant_count())?;
        let count = fill(output, bed.perceived_count(), bed.actors())?;
        output.commit::<abi::Actor>(count)?;
        if !self.dressed || input.is_trial() {
            let count = fill(output, bed.materials().len(), bed.materials().iter().copied())?;
            output.commit::<abi::Material>(count)?;
            self.dressed = !input.is_trial();
        }
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
            let shown = match input.param(9) as u32 {
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
        state.put("fibres", &self.bed.save());
    }

    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
        let fibres = state.get::<f32>("fibres")?;
        self.bed.load(&fibres).map_err(|problem| StateError::Refused(format!("field `fibres` {problem}")))
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
