//! The plugin: configuration in, streams out.

use reef_flow::{Level, waves::Rule};
use reef_sdk::prelude::*;

use crate::{
    cloud::{Cloud, Dressed, State, Surroundings},
    config::{self, Config},
    debug,
    fog::Fog,
    kind::FOG_TEXTURE,
    levels::Levels,
    looks::Looks,
    texture::{DOT, Mean, Picture},
};

/// Suspended particles.
#[derive(Debug)]
pub struct Particles {
    cloud: Cloud,
    /// What the sprites name: they live as long as the particles do.
    _textures: Vec<Texture>,
}

/// Names of the figures of a step.
const ORBITS: &str = "orbits in a step";
const TRAINS: &str = "wave trains in them";

/// Numbers of the parameters: they never change, not even when one is removed.
mod id {
    pub(super) const TRAINS: u32 = 1;
    pub(super) const VISIBLE: u32 = 2;
    pub(super) const MASTERS: u32 = 3;
    pub(super) const FOG: u32 = 4;
    pub(super) const THRESHOLD: u32 = 5;
    pub(super) const MASTER_DISTANCE: u32 = 6;
    pub(super) const FOG_DISTANCE: u32 = 7;
    pub(super) const VISIBILITY: u32 = 8;
    pub(super) const MARGIN: u32 = 9;
    pub(super) const SIZE: u32 = 10;
    pub(super) const OPACITY: u32 = 11;
    pub(super) const SELECTION: u32 = 12;
}

/// What can change while the sea runs.
pub const PARAMS: &[Param] = &[
    Param::switch(id::TRAINS, "trains")
        .label("Choose wave trains")
        .group("Levels of detail")
        .default(1.0)
        .help("Leaves out wave trains that are too small to be seen at a particle's distance."),
    Param::choice(id::SELECTION, "selection", &["sum", "each"])
        .label("Which trains are left out")
        .group("Levels of detail")
        .help("sum: those that move a particle by less than the threshold all together, at its depth; each: the paper's rule, each that raises the surface by less."),
    Param::switch(id::VISIBLE, "visible")
        .label("Only what is in view")
        .group("Levels of detail")
        .default(1.0)
        .help("Leaves out orbits and sprites of particles that are not in view; their centres drift on."),
    Param::switch(id::MASTERS, "masters")
        .label("Masters and slaves")
        .group("Levels of detail")
        .default(1.0)
        .help("Beyond a distance, slaves are carried as their master is."),
    Param::switch(id::FOG, "fog")
        .label("Local fog")
        .group("Levels of detail")
        .default(1.0)
        .help("Beyond a distance, a fog stands for the particles: as opaque as they are, and of their colour."),
    Param::float(id::THRESHOLD, "threshold")
        .label("Threshold of trains")
        .group("Levels of detail")
        .unit("px")
        .range(0.01, 100.0)
        .default(1.0)
        .logarithmic()
        .help("A_min: what wave trains that are left out may move a particle by, in the scene's viewport."),
    Param::float(id::MASTER_DISTANCE, "master_distance")
        .label("Masters from")
        .group("Levels of detail")
        .unit("m")
        .range(0.0, 1000.0)
        .default(2.0)
        .help("D_m: distance from the eye from which on slaves follow their masters; over a quarter of it they come to."),
    Param::float(id::FOG_DISTANCE, "fog_distance")
        .label("Fog from")
        .group("Levels of detail")
        .unit("m")
        .range(0.1, 1000.0)
        .default(12.0)
        .help("D_M: distance from the eye where the last single particle is gone; in the last sixth before, the fog takes over."),
    Param::float(id::VISIBILITY, "visibility")
        .label("Visibility")
        .group("Levels of detail")
        .unit("m")
        .range(0.1, 1000.0)
        .default(30.0)
        .help("Nothing is shown beyond this distance; 60 m is clear water."),
    Param::float(id::MARGIN, "margin")
        .label("Margin of the view")
        .group("Levels of detail")
        .range(0.0, 4.0)
        .default(0.1)
        .help("How much wider than the scene's viewport counts as in view: for windows of another shape."),
    Param::float(id::SIZE, "size")
        .label("Size")
        .group("Looks")
        .range(0.1, 10.0)
        .default(1.0)
        .logarithmic()
        .help("Factor on every diameter."),
    Param::float(id::OPACITY, "opacity")
        .label("Opacity")
        .group("Looks")
        .range(0.0, 10.0)
        .default(1.0)
        .help("Factor on every opacity."),
];

impl Particles {
    /// The boxes.
    pub fn cloud(&self) -> &Cloud {
        &self.cloud
    }

    /// The boxes of a configuration, without pictures.
    pub fn fill(scene: &SceneInfo, config: &Config) -> Result<Cloud, ConfigError> {
        Self::dress(scene, config, &mut |_, _| None)
    }

    /// The boxes with their pictures. `upload` takes a picture by its name and gives its number; None: there
    /// are none here.
    fn dress(
        scene: &SceneInfo,
        config: &Config,
        upload: &mut dyn FnMut(&str, &Picture) -> Option<u32>,
    ) -> Result<Cloud, ConfigError> {
        let plans = config::plan(config, scene.seed)?;
        let mut known: Vec<(&str, (u32, Mean))> = Vec::new();
        let mut textured = |name: &'static str, bytes: &[u8]| {
            if let Some((_, texture)) = known.iter().find(|(other, _)| *other == name) {
                return *texture;
            }
            let picture = Picture::decode(bytes);
            let uploaded = picture.and_then(|picture| Some((upload(name, &picture)?, picture.mean())));
            let texture = uploaded.unwrap_or((0, DOT));
            known.push((name, texture));
            texture
        };
        let boxes = plans
            .into_iter()
            .map(|plan| {
                let (texture, mean) = plan.picture.map_or((0, DOT), |kind| {
                    let defaults = kind.defaults();
                    textured(defaults.name, defaults.texture)
                });
                let looks = Looks::new(&plan, texture, mean);
                let (texture, mean) = textured("fog", FOG_TEXTURE);
                let fog = Fog::new(&plan, &looks, texture, mean);
                Dressed { plan, looks, fog }
            })
            .collect();
        Ok(Cloud::new(boxes, config.slaves as usize))
    }

    fn levels(input: &StepInput) -> Levels {
        let on = |id| input.param(id) >= 0.5;
        Levels {
            trains: on(id::TRAINS),
            selection: if on(id::SELECTION) { Rule::Each } else { Rule::Sum },
            visible: on(id::VISIBLE),
            masters: on(id::MASTERS),
            fog: on(id::FOG),
            threshold: input.param(id::THRESHOLD),
            master_distance: input.param(id::MASTER_DISTANCE),
            fog_distance: input.param(id::FOG_DISTANCE),
            visibility: input.param(id::VISIBILITY),
            margin: input.param(id::MARGIN),
            size: input.param(id::SIZE),
            opacity: input.param(id::OPACITY),
        }
    }
}

impl Plugin for Particles {
    const ID: &'static str = "reef.particles";
    const NAME: &'static str = "Particles";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const VENDOR: &'static str = "Reef";
    const DESCRIPTION: &'static str =
        "Suspended particles on currents and wave orbits, with levels of detail (Coulais et al. 2005).";
    const STATE_VERSION: u32 = 2;
    const STATE_MIN_VERSION: u32 = 1;
    const LOADS_OVER: bool = true;
    type Config = Config;

    fn traces() -> &'static [&'static str] {
        &["particle"]
    }

    fn params() -> &'static [Param] {
        PARAMS
    }

    fn create(host: &Host, scene: &SceneInfo, config: Config) -> Result<Self, ConfigError> {
        let mut textures = Vec::new();
        let cloud = Self::dress(scene, &config, &mut |name, picture| {
            let size = [picture.width, picture.height];
            // Without textures the particles are dots.
            let texture = host.texture(name, TextureFormat::Srgb, size, &picture.texels).ok()?;
            let id = texture.id();
            textures.push(texture);
            Some(id)
        })?;
        Ok(Self { cloud, _textures: textures })
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        let around = Surroundings {
            flow: input.flow(),
            waves: input.waves(),
            depth: input.water().depth.into(),
            camera: input.camera(),
            dt: input.dt(),
            step: input.step(),
            level: Level::at_most(input.simd_level()),
            workers: input.workers(),
            trace: input.wants_trace(),
        };
        let cloud = &mut self.cloud;
        let counts = cloud.advance(&around, &Self::levels(input));
        if !input.is_unseen() || around.trace {
            let sprites = output.reserve::<abi::Billboard>(counts.sprites)?;
            let trace = if around.trace { output.reserve::<abi::Trace>(counts.trace)? } else { &mut [] };
            cloud.emit(&around, sprites, trace);
            output.commit::<abi::Billboard>(counts.sprites)?;
            let [orbits, trains] = cloud.work();
            let host = input.host();
            host.figure(ORBITS, orbits as f64);
            host.figure(TRAINS, trains as f64);
        }
        if around.trace {
            output.commit::<abi::Trace>(counts.trace)?;
        }
        let objects = output.reserve::<abi::Object>(cloud.box_count())?;
        for (slot, object) in objects.iter_mut().zip(cloud.objects()) {
            *slot = object;
        }
        output.commit::<abi::Object>(cloud.box_count())?;
        if input.wants_debug() {
            output.emit(&debug::lines(cloud, around.waves, around.depth, around.level))?;
        }
        Ok(Status::Ok)
    }

    fn save(&self, state: &mut StateWriter) {
        self.cloud.save_to(state);
    }

    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
        let saved = State::read(state)?;
        self.cloud.load(&saved).map_err(|problem| StateError::Refused(format!("the saved state {problem}")))
    }
}
