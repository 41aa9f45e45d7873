//! The plugin: configuration in, streams out.

use glam::DVec3;
use reef_flow::{Level, stronger, waves::Lens};
use reef_sdk::prelude::*;

use crate::{
    bloom::{Bloom, BloomState, Shown, Surroundings, Tuning},
    breed::Breed,
    config::Config,
    draw::{self, MATERIALS, Wear},
    paint,
    sow::Stock,
};

/// Lines at most: more would hide everything.
const MOST_LINES: usize = 60_000;

/// Jellyfish.
#[derive(Debug)]
pub struct Jellyfish {
    bloom: Bloom,
    /// What the elements name: they live as long as the animals do.
    _meshes: Vec<Mesh>,
    _pictures: Vec<Texture>,
    /// What they are made of, for an instance that is made beside this one.
    _breeds: Vec<Held<Breed>>,
    wears: Vec<Wear>,
    /// Species by species, without light of their own and with it.
    materials: [Vec<abi::Material>; 2],
    /// What the animals do to the water, at the panel's strength.
    flows: Vec<abi::Flow>,
}

/// Numbers of the parameters: they never change, not even when one is removed.
mod id {
    pub(super) const FREQUENCY: u32 = 1;
    pub(super) const STRENGTH: u32 = 2;
    pub(super) const TILT: u32 = 3;
    pub(super) const IDLE: u32 = 4;
    pub(super) const EXCESS: u32 = 5;
    pub(super) const DUSK: u32 = 6;
    pub(super) const GLOW: u32 = 7;
    pub(super) const GRID: u32 = 8;
    pub(super) const STEPS: u32 = 9;
    pub(super) const DETAIL: u32 = 10;
    pub(super) const JET: u32 = 11;
    pub(super) const SKIN: u32 = 12;
    pub(super) const LINES: u32 = 13;
    pub(super) const APART: u32 = 14;
}

/// What can change while the sea runs.
pub const PARAMS: &[Param] = &[
    Param::float(id::FREQUENCY, "frequency")
        .label("Frequency")
        .group("Swimming")
        .range(0.1, 5.0)
        .default(1.0)
        .logarithmic()
        .help("Factor on how often they contract; each contracts 0.05 to 5 times a second."),
    Param::float(id::STRENGTH, "strength")
        .label("Strength")
        .group("Swimming")
        .range(0.0, 1.0)
        .default(1.0)
        .help("Factor on how far they contract; 0: they idle."),
    Param::float(id::TILT, "tilt")
        .label("Tilt")
        .group("Swimming")
        .unit("deg")
        .range(-120.0, 120.0)
        .default(0.0)
        .help("By how much they lean from their way, in the plane of their slices: they turn there by uneven contractions."),
    Param::float(id::IDLE, "idle")
        .label("Idling")
        .group("Swimming")
        .range(0.0, 1.0)
        .default(0.0)
        .help("Share of its periods in which each of them does not contract."),
    Param::float(id::EXCESS, "sinking")
        .label("Sinking")
        .group("Swimming")
        .unit("kg/m³")
        .range(-20.0, 20.0)
        .default(0.0)
        .help("How much denser their tissue is than their species says: what idles sinks by it."),
    Param::switch(id::DUSK, "dusk")
        .label("Dusk")
        .group("Swimming")
        .default(0.0)
        .help("They rise to the uppermost third of their boxes, and stay there."),
    Param::float(id::APART, "apart")
        .label("Apart")
        .group("Swimming")
        .range(0.0, 4.0)
        .default(1.0)
        .help("Factor on the distance of their middles at which they hold each other off, the mean of their widths; 0: they swim through each other."),
    Param::switch(id::GLOW, "glow")
        .label("Glow")
        .group("Looks")
        .default(0.0)
        .help("Light runs over their bells with the contraction: for dark seas."),
    Param::float(id::GRID, "grid")
        .label("Grid")
        .group("Accuracy")
        .range(0.16, 2.0)
        .default(1.0)
        .help("Factor on the cells along a side of their water; 16 to 256 cells. A change puts their water to rest."),
    Param::int(id::STEPS, "steps")
        .label("Steps")
        .group("Accuracy")
        .range(1.0, 8.0)
        .default(2.0)
        .help("Least steps of an animal and its water in 1/60 s: those that contract often have more, those that are drawn coarsely half as many."),
    Param::float(id::DETAIL, "detail")
        .label("Coarse below")
        .group("Accuracy")
        .unit("px")
        .range(0.0, 4000.0)
        .default(60.0)
        .help("Bells that are narrower in the scene's viewport have fewer vertices, tentacles and steps."),
    Param::float(id::JET, "jet")
        .label("Jet")
        .group("Water")
        .range(0.0, 10.0)
        .default(1.0)
        .help("Factor on what they do to the water around them; 0: nothing."),
    Param::float(id::SKIN, "skin")
        .label("Skin")
        .group("Figures")
        .range(0.0, 1.0)
        .default(1.0)
        .help("Share of the skin that is there: with less, debug lines show the slice inside. Below a half there are no tentacles."),
    Param::choice(id::LINES, "lines", &["all", "springs", "water", "dye"])
        .label("Lines")
        .group("Figures")
        .help("What debug lines show: springs, muscles and dye, the water's velocity, or all of that."),
];

impl Jellyfish {
    fn tuning(input: &StepInput) -> Tuning {
        Tuning {
            frequency: input.param(id::FREQUENCY),
            strength: input.param(id::STRENGTH),
            tilt: input.param(id::TILT).to_radians(),
            idle: input.param(id::IDLE),
            excess_density: input.param(id::EXCESS),
            dusk: input.param(id::DUSK) >= 0.5,
            apart: input.param(id::APART),
            cells: input.param(id::GRID),
            steps: input.param(id::STEPS) as usize,
            detail: input.param(id::DETAIL),
        }
    }

    fn swim(&mut self, input: &StepInput) {
        let (camera, water) = (input.camera(), input.water());
        let density = f64::from(water.density);
        self.bloom.step(&Surroundings {
            flow: input.flow(),
            waves: input.waves(),
            depth: water.depth.into(),
            bed: input.heightfield(),
            eye: DVec3::from(camera.position),
            pixels: Lens::new(camera).focal,
            density,
            viscosity: f64::from(water.viscosity) / density,
            tuning: Self::tuning(input),
            time: input.time() - input.dt(),
            dt: input.dt(),
            level: Level::at_most(input.simd_level()),
            workers: input.workers(),
        });
    }

    fn draw(&mut self, input: &StepInput, output: &mut Output) -> Result<(), StepError> {
        let Self { bloom, wears, .. } = self;
        let skin = input.param(id::SKIN) as f32;
        let (vertices, nodes) = (bloom.vertex_count(), bloom.node_count());
        let (into, strands) =
            (output.reserve::<abi::DrawVertex>(vertices)?, output.reserve::<abi::FibreNode>(nodes)?);
        let level = Level::at_most(input.simd_level());
        bloom.write(level, input.workers(), input.time(), (into, &mut *strands));
        let count = draw::draw_count(bloom, wears);
        draw::draws(bloom, wears, 1.0 - skin, output.reserve::<abi::MeshDraw>(count)?);
        output.commit::<abi::DrawVertex>(vertices)?;
        output.commit::<abi::MeshDraw>(count)?;
        if skin >= 0.5 {
            let fibres = draw::fibre_count(bloom);
            draw::fibres(bloom, wears, strands, output.reserve::<abi::Fibre>(fibres)?);
            output.commit::<abi::FibreNode>(nodes)?;
            output.commit::<abi::Fibre>(fibres)?;
        }
        Ok(())
    }

    /// The points of all slices, for recordings.
    fn trace(&self, room: &mut [abi::Trace]) {
        let mut room = room.iter_mut();
        for animal in 0..self.bloom.len() {
            for ((node, position), slot) in (0..).zip(self.bloom.chain(animal)).zip(&mut room) {
                *slot = abi::Trace {
                    object: animal as u64,
                    position: position.to_array(),
                    node,
                    kind: 0,
                    ..abi::Trace::default()
                };
            }
        }
    }
}

impl Plugin for Jellyfish {
    const ID: &'static str = "reef.jellyfish";
    const NAME: &'static str = "Jellyfish";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const VENDOR: &'static str = "Reef";
    const DESCRIPTION: &'static str =
        "Jellyfish that swim in water of their own: elastic slices in a grid (Rudolf and Mould 2009).";
    const STATE_VERSION: u32 = 1;
    const STATE_MIN_VERSION: u32 = 1;
    const LOADS_OVER: bool = true;
    type Config = Config;

    fn traces() -> &'static [&'static str] {
        &["jellyfish"]
    }

    fn params() -> &'static [Param] {
        PARAMS
    }

    fn create(host: &Host, scene: &SceneInfo, config: Config) -> Result<Self, ConfigError> {
        let Stock { species, births } = Stock::new(scene, &config)?;
        let tables: Vec<_> = species.iter().map(|(_, table)| table.clone()).collect();
        let bloom = Bloom::new(&tables, &births).map_err(|problem| ConfigError::new("", problem))?;
        let (mut meshes, mut pictures) = (Vec::new(), Vec::new());
        let (mut wears, mut breeds) = (Vec::new(), Vec::new());
        let mut materials = [Vec::new(), Vec::new()];
        for (number, (name, table)) in species.iter().enumerate() {
            let breed = Breed::of(&table.look);
            let animal = births.iter().position(|birth| birth.species == number).unwrap_or(0);
            wears.push(Wear::new(
                host,
                name,
                breed.paint(),
                (&bloom, animal),
                wears.len() * MATERIALS,
                &mut meshes,
            )?);
            let picture = host.texture(name, TextureFormat::Srgb, paint::SIZE, breed.texels())?;
            for (own, glows) in materials.iter_mut().zip([false, true]) {
                own.extend(draw::materials(breed.look(), picture.id(), glows));
            }
            pictures.push(picture);
            breeds.push(breed);
        }
        let flows = Vec::with_capacity(bloom.flows().len());
        Ok(Self { bloom, _meshes: meshes, _pictures: pictures, _breeds: breeds, wears, materials, flows })
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        self.swim(input);
        if !input.is_unseen() {
            self.draw(input, output)?;
        }
        let animals = self.bloom.len();
        draw::objects(&self.bloom, output.reserve::<abi::Object>(animals)?);
        output.commit::<abi::Object>(animals)?;
        let [plain, glowing] = &self.materials;
        output.emit(if input.param(id::GLOW) >= 0.5 { glowing } else { plain })?;
        draw::actors(&self.bloom, &self.wears, output.reserve::<abi::Actor>(animals)?);
        output.commit::<abi::Actor>(animals)?;
        let jet = input.param(id::JET) as f32;
        self.flows.clear();
        if jet > 0.0 {
            self.flows.extend(self.bloom.flows().iter().map(|flow| stronger(flow, jet)));
        }
        output.emit(&self.flows)?;

        let seen = || (0..animals).filter_map(|animal| self.bloom.seen(animal));
        input.host().figure("animals", animals as f64);
        input.host().figure("drawn coarsely", seen().filter(|seen| seen.far).count() as f64);
        input.host().figure("idling", seen().filter(|seen| seen.idles).count() as f64);
        if input.wants_debug() {
            let shown = match input.param(id::LINES) as u32 {
                1 => Shown::Springs,
                2 => Shown::Water,
                3 => Shown::Dye,
                _ => Shown::All,
            };
            let mut lines = Vec::new();
            (0..animals).for_each(|animal| self.bloom.lines(animal, shown, MOST_LINES, &mut lines));
            output.emit(&lines)?;
        }
        if input.wants_trace() {
            let slices = (0..animals).filter_map(|animal| self.bloom.slice(animal));
            let nodes = slices.map(|slice| slice.chain().len()).sum();
            self.trace(output.reserve::<abi::Trace>(nodes)?);
            output.commit::<abi::Trace>(nodes)?;
        }
        Ok(Status::Ok)
    }

    fn save(&self, state: &mut StateWriter) {
        self.bloom.save_to(state);
    }

    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
        let problem = |problem: String| StateError::Refused(format!("the saved state {problem}"));
        self.bloom.load(&BloomState::read(state)?).map_err(problem)
    }
}
