//! The plugin: configuration in, streams out.

use glam::DVec3;
use reef_flow::{Level, color::linear_rgb, stronger};
use reef_sdk::{abi::fnv1a_32, prelude::*};

use crate::{
    breed::Breed,
    config::Config,
    draw::{Brush, Wear},
    look::Look,
    paint,
    shoal::{Host as Anemone, Shoal, State, Stranger, Surroundings, Waves, id_of},
    sow::Stock,
};

/// Lines at most: more would hide everything.
const MOST_LINES: usize = 20_000;

/// Fish.
#[derive(Debug)]
pub struct Fish {
    shoal: Shoal,
    brush: Brush,
    /// What the elements name: they live as long as the fish do.
    _meshes: Vec<Mesh>,
    _pictures: Vec<Texture>,
    /// What they are made of, for an instance that is made beside this one.
    _breeds: Vec<Held<Breed>>,
    /// Species by species.
    wears: Vec<Wear>,
    materials: Vec<abi::Material>,
    /// Of the names of the species that feel what fish carry.
    hosts: Vec<u32>,
    /// Those of them that are there.
    anemones: Vec<Anemone>,
    /// Who else is there, of other modules.
    strangers: Vec<Stranger>,
    /// What the fish carry, at the panel's strength.
    flows: Vec<abi::Flow>,
    /// Room for the nodes of a fish, where a recording asks for them.
    nodes: Vec<[f32; 3]>,
}

/// Numbers of the parameters: they never change, not even when one is removed.
mod id {
    pub(super) const NEAR: u32 = 1;
    pub(super) const CARRIED: u32 = 2;
    pub(super) const SKIN: u32 = 3;
    pub(super) const WAVES: u32 = 4;
    pub(super) const SPRINGS: u32 = 5;
    pub(super) const STRANGERS: u32 = 6;
}

/// What can change while the sea runs.
pub const PARAMS: &[Param] = &[
    Param::float(id::NEAR, "near")
        .label("Bodies up to")
        .group("Levels of detail")
        .unit("m")
        .range(0.0, 1000.0)
        .default(8.0)
        .help("Fish nearer to the camera move by their muscles and the water; farther ones by the gait of the same body."),
    Param::float(id::CARRIED, "carried")
        .label("Sources and holes")
        .group("Water")
        .range(0.0, 10.0)
        .default(1.0)
        .help("Factor on what fish carry to the water near anemones; 0: nothing."),
    Param::float(id::WAVES, "waves")
        .label("Waves")
        .group("Water")
        .range(0.0, 10.0)
        .default(1.0)
        .help("Factor on the orbital velocity with which the waves carry fish; 0 leaves them out."),
    Param::switch(id::STRANGERS, "strangers")
        .label("Heed others")
        .group("Behaviour")
        .default(1.0)
        .help("They keep off others of other modules, and flee from who is large and fast, or feared."),
    Param::float(id::SKIN, "skin")
        .label("Skin")
        .group("Figures")
        .range(0.0, 1.0)
        .default(1.0)
        .help("Share of the skin that is there: with less, debug lines show the springs inside."),
    Param::switch(id::SPRINGS, "springs")
        .label("Springs")
        .group("Figures")
        .default(1.0)
        .help("Springs and muscles are among the debug lines, where these are shown."),
];

/// Of scales that mirror all that they can: reflectance, and how narrow it is; and of skin without.
const MIRROR: [f32; 2] = [0.0003, 0.02];
const ROUGH: [f32; 2] = [1.0, 0.42];

fn material(look: &Look, picture: u32) -> abi::Material {
    let [r, g, b] = linear_rgb(&look.side).unwrap_or([0.5; 3]);
    let sheen = look.sheen as f32;
    let between = |[none, all]: [f32; 2]| none + (all - none) * sheen;
    abi::Material {
        base: [r, g, b, 1.0],
        tip: [r, g, b, 1.0],
        texture: picture,
        translucency: 0.45,
        wrap: 0.4,
        rim: 0.3,
        specular: between(MIRROR),
        roughness: between(ROUGH),
        ..abi::Material::default()
    }
}

impl Fish {
    /// Where the nodes of all fish are, for recordings.
    fn trace(&mut self, room: &mut [abi::Trace]) {
        let Self { shoal, nodes, .. } = self;
        let mut room = room.iter_mut();
        for (number, fish) in shoal.fish().iter().enumerate() {
            let kind = &shoal.kinds()[fish.kind as usize];
            let count = kind.plan.body().nodes().len();
            nodes.resize(count, [0.0; 3]);
            let origin = shoal.nodes(number, nodes);
            for ((node, at), slot) in (0..).zip(nodes.iter()).zip(&mut room) {
                *slot = abi::Trace {
                    object: id_of(number) - 1,
                    position: (origin + glam::Vec3::from(*at).as_dvec3()).to_array(),
                    node,
                    kind: 0,
                    ..abi::Trace::default()
                };
            }
        }
    }

    fn node_count(&self) -> usize {
        let count = |kind: u32| self.shoal.kinds()[kind as usize].plan.body().nodes().len();
        self.shoal.fish().iter().map(|fish| count(fish.kind)).sum()
    }
}

impl Plugin for Fish {
    const ID: &'static str = "reef.fish";
    const NAME: &'static str = "Fish";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const VENDOR: &'static str = "Reef";
    const DESCRIPTION: &'static str = "Fish of springs and muscles that swim, shoal, hunt and hide (Gritt 2010 after Tu and Terzopoulos 1994).";
    const STATE_VERSION: u32 = 2;
    const STATE_MIN_VERSION: u32 = 1;
    const LOADS_OVER: bool = true;
    type Config = Config;

    fn traces() -> &'static [&'static str] {
        &["fish"]
    }

    fn params() -> &'static [Param] {
        PARAMS
    }

    fn create(host: &Host, scene: &SceneInfo, config: Config) -> Result<Self, ConfigError> {
        let Stock { breeds: named, shoal } = Stock::new(scene, &config)?;
        let (mut meshes, mut pictures) = (Vec::new(), Vec::new());
        let (mut wears, mut materials, mut breeds) = (Vec::new(), Vec::new(), Vec::new());
        for (name, breed) in named {
            let mesh = breed.shape().upload(host, &name)?;
            let picture = host.texture(&name, TextureFormat::Srgb, paint::SIZE, &breed.picture().texels)?;
            wears.push(Wear::new(&name, mesh.id(), materials.len() as u32, breed.shape().radius));
            materials.push(material(&breed.species().look, picture.id()));
            meshes.push(mesh);
            pictures.push(picture);
            breeds.push(breed);
        }
        let mut hosts: Vec<u32> = config.hosts.iter().map(|name| fnv1a_32(name.as_bytes())).collect();
        hosts.extend(shoal.kinds().iter().flat_map(|kind| &kind.lives_in));
        Ok(Self {
            brush: Brush::new(&shoal),
            flows: Vec::with_capacity(shoal.fish().len()),
            shoal,
            _meshes: meshes,
            _pictures: pictures,
            _breeds: breeds,
            wears,
            materials,
            hosts,
            anemones: Vec::new(),
            strangers: Vec::new(),
            nodes: Vec::new(),
        })
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        let heeds = input.param(id::STRANGERS) >= 0.5;
        self.anemones.clear();
        self.strangers.clear();
        for actor in input.actors() {
            if self.hosts.contains(&actor.species) {
                self.anemones.push(Anemone {
                    id: actor.id,
                    species: actor.species,
                    position: DVec3::from(actor.position),
                    radius: actor.radius.into(),
                });
            } else if heeds && actor.id > abi::GREATEST_ID {
                // Ids of other modules' actors have a tag above those that a module may give.
                self.strangers.push(Stranger::from(actor));
            }
        }
        self.shoal.step(&Surroundings {
            flow: input.flow(),
            bed: input.heightfield(),
            waves: Waves {
                trains: input.waves(),
                depth: input.water().depth.into(),
                factor: input.param(id::WAVES) as f32,
                camera: Some(input.camera()),
            },
            obstacles: input.obstacles(),
            strangers: &self.strangers,
            surface: 0.0,
            hosts: &self.anemones,
            eye: DVec3::from(input.camera().position),
            near: input.param(id::NEAR),
            dt: input.dt(),
            level: Level::at_most(input.simd_level()),
            workers: input.workers(),
        });

        let (shoal, fish) = (&self.shoal, self.shoal.fish().len());
        Brush::objects(shoal, &self.wears, output.reserve::<abi::Object>(fish)?);
        output.commit::<abi::Object>(fish)?;
        if !input.is_unseen() {
            let joints = self.brush.joints();
            let room = (output.reserve::<abi::Skinned>(fish)?, output.reserve::<abi::Joint>(joints)?);
            let fade = 1.0 - input.param(id::SKIN) as f32;
            self.brush.draw(shoal, &self.wears, fade, input.workers(), room);
            output.commit::<abi::Skinned>(fish)?;
            output.commit::<abi::Joint>(joints)?;
        }
        output.emit(&self.materials)?;
        Brush::actors(shoal, &self.wears, output.reserve::<abi::Actor>(fish)?);
        output.commit::<abi::Actor>(fish)?;
        let carried = input.param(id::CARRIED) as f32;
        self.flows.clear();
        if carried > 0.0 {
            self.flows.extend(shoal.flows().iter().map(|flow| stronger(flow, carried)));
        }
        output.emit(&self.flows)?;

        let near = shoal.fish().iter().filter(|fish| fish.near).count();
        input.host().figure("fish", fish as f64);
        input.host().figure("bodies stepped", near as f64);
        if input.wants_debug() && input.param(id::SPRINGS) >= 0.5 {
            let mut lines = Vec::new();
            for (number, own) in shoal.fish().iter().enumerate() {
                let springs = shoal.kinds()[own.kind as usize].plan.body().springs().len();
                if lines.len() + springs > MOST_LINES {
                    break;
                }
                shoal.lines(number, &mut lines);
            }
            output.emit(&lines)?;
        }
        if input.wants_trace() {
            let nodes = self.node_count();
            self.trace(output.reserve::<abi::Trace>(nodes)?);
            output.commit::<abi::Trace>(nodes)?;
        }
        Ok(Status::Ok)
    }

    fn save(&self, state: &mut StateWriter) {
        self.shoal.save().write(state);
    }

    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
        let problem = |problem: String| StateError::Refused(format!("the saved state {problem}"));
        self.shoal.load(&State::read(state)?).map_err(problem)
    }
}
