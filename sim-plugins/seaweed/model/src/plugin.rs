//! The plugin: configuration in, streams out.

use glam::DVec3;
use reef_flow::{Level, stronger};
use reef_sdk::prelude::*;

use crate::{
    bed::{Bed, Drawing, JointPose, State, Surroundings, Wear, id_of},
    config::Config,
    debug::{self, Shown},
    levels::{Levels, Method},
    looks::{self, Dress},
    mesh::{AGES, Stock},
    paint,
    sow::{Floor, Footing, Garden, Plan},
};

/// Seaweeds.
#[derive(Debug)]
pub struct Seaweeds {
    plan: Plan,
    /// None before the first step: where plants stand depends on the sea bed.
    stand: Option<Stand>,
    /// What the elements name: they live as long as the plants do.
    _meshes: Vec<Mesh>,
    _pictures: Vec<Texture>,
    /// What they are made of, for an instance that is made beside this one.
    _stocks: Vec<Held<Stock>>,
    /// Species by species, age by age.
    wears: Vec<Wear>,
    materials: Vec<abi::Material>,
    /// Of all joints, where a recording or debug lines ask for them.
    poses: Vec<JointPose>,
    /// What the plants emit, at the panel's strength.
    flows: Vec<abi::Flow>,
}

/// All plants where they stand.
#[derive(Debug)]
struct Stand {
    bed: Bed,
    footings: Vec<Footing>,
    dresses: Vec<Dress>,
}

impl Stand {
    fn new(garden: Garden) -> Self {
        let dress = |(plant, traits): (&crate::bed::Plant, _)| {
            Dress::new(plant.kind, &garden.species[plant.kind], traits)
        };
        let dresses = garden.plants.iter().zip(&garden.traits).map(dress).collect();
        Self { bed: Bed::new(garden.kinds, garden.plants), footings: garden.footings, dresses }
    }
}

/// Numbers of the parameters: they never change, not even when one is removed.
mod id {
    pub(super) const SEGMENTS: u32 = 1;
    pub(super) const NEAR: u32 = 2;
    pub(super) const FAR: u32 = 3;
    pub(super) const METHOD: u32 = 4;
    pub(super) const BLEND: u32 = 5;
    pub(super) const WHOLE: u32 = 6;
    pub(super) const VISIBLE: u32 = 7;
    pub(super) const MARGIN: u32 = 8;
    pub(super) const TRAINS: u32 = 9;
    pub(super) const THRESHOLD: u32 = 10;
    pub(super) const WAVES: u32 = 11;
    pub(super) const SOURCES: u32 = 12;
    pub(super) const SHELTER: u32 = 13;
    pub(super) const CONTACT: u32 = 14;
    pub(super) const LINES: u32 = 15;
}

/// What can change while the sea runs.
pub const PARAMS: &[Param] = &[
    Param::switch(id::SEGMENTS, "segments")
        .label("Fewer segments farther away")
        .group("Levels of detail")
        .default(1.0)
        .help("Computes the lower half of each branch beyond ND, its first segment beyond FD; the rest goes along."),
    Param::float(id::NEAR, "near")
        .label("Near up to")
        .group("Levels of detail")
        .unit("m")
        .range(0.0, 1000.0)
        .default(5.0)
        .help("ND: nearer plants have all segments computed. Plants longer than 2 m count as so many times nearer."),
    Param::float(id::FAR, "far")
        .label("Far from")
        .group("Levels of detail")
        .unit("m")
        .range(0.0, 1000.0)
        .default(20.0)
        .help("FD: of farther plants the first segment of each branch is computed, by the procedural method."),
    Param::choice(id::METHOD, "method", &["auto", "physical", "procedural"])
        .label("Method")
        .group("Levels of detail")
        .help("auto: physical, and procedural far away; or one of them everywhere."),
    Param::float(id::BLEND, "blend")
        .label("Going over")
        .group("Levels of detail")
        .unit("s")
        .range(0.0, 10.0)
        .default(1.0)
        .help("Time in which a plant goes over from one level or method to the next."),
    Param::switch(id::WHOLE, "whole")
        .label("Far plants as a whole")
        .group("Levels of detail")
        .default(1.0)
        .help("One joint moves a far plant's mesh; else all joints do, near and far."),
    Param::switch(id::VISIBLE, "visible")
        .label("Only what is in view")
        .group("Levels of detail")
        .default(1.0)
        .help("Leaves plants as they are while nobody sees them; they catch up when they come into view."),
    Param::float(id::MARGIN, "margin")
        .label("Margin of the view")
        .group("Levels of detail")
        .range(0.0, 4.0)
        .default(0.15)
        .help("How much wider than the scene's viewport counts as in view: for windows of another shape."),
    Param::switch(id::TRAINS, "trains")
        .label("Choose wave trains")
        .group("Levels of detail")
        .default(1.0)
        .help("Leaves out wave trains that move a plant by less than the threshold all together."),
    Param::float(id::THRESHOLD, "threshold")
        .label("Threshold of trains")
        .group("Levels of detail")
        .unit("px")
        .range(0.01, 100.0)
        .default(0.5)
        .logarithmic()
        .help("A_min: what wave trains that are left out may move water by, in the scene's viewport."),
    Param::float(id::WAVES, "waves")
        .label("Waves")
        .group("Water")
        .range(0.0, 10.0)
        .default(1.0)
        .help("Factor on the waves' motion that plants feel; 0 leaves them out."),
    Param::float(id::SOURCES, "sources")
        .label("Sources")
        .group("Water")
        .range(0.0, 10.0)
        .default(1.0)
        .help("Factor on how much plants that move push the water around them; 0: they do not."),
    Param::float(id::SHELTER, "shelter")
        .label("Shelter")
        .group("Water")
        .range(0.0, 1.0)
        .default(1.0)
        .help("Factor on how much dense beds calm the water behind them; 0: they do not."),
    Param::float(id::CONTACT, "contact")
        .label("Contact")
        .group("Water")
        .unit("N/m")
        .range(0.0, 10_000.0)
        .default(60.0)
        .help("Stiffness of ground, rocks and obstacles that plants touch; 0 lets plants pass."),
    Param::choice(id::LINES, "lines", &["both", "skeletons", "flows"])
        .label("Lines")
        .group("Figures")
        .help("What debug lines show: segments in the colours of their levels, sources and shelters, or both."),
];

impl Seaweeds {
    /// The plants; None before the first step.
    pub fn bed(&self) -> Option<&Bed> {
        self.stand.as_ref().map(|stand| &stand.bed)
    }

    fn levels(input: &StepInput) -> Levels {
        let on = |id| input.param(id) >= 0.5;
        Levels {
            segments: on(id::SEGMENTS),
            near: input.param(id::NEAR),
            far: input.param(id::FAR),
            visible: on(id::VISIBLE),
            margin: input.param(id::MARGIN),
            trains: on(id::TRAINS),
            threshold: input.param(id::THRESHOLD),
            method: match input.param(id::METHOD) as u32 {
                1 => Method::Physical,
                2 => Method::Procedural,
                _ => Method::Auto,
            },
            waves: input.param(id::WAVES),
            contact: input.param(id::CONTACT),
            blend: input.param(id::BLEND),
        }
    }

    /// What the plants emit, at the panel's strength.
    fn scale_flows(flows: &mut Vec<abi::Flow>, bed: &Bed, input: &StepInput) {
        let [sources, shelter] = [id::SOURCES, id::SHELTER].map(|id| input.param(id) as f32);
        flows.clear();
        flows.extend(bed.flows().iter().filter_map(|flow| {
            let share = if flow.kind == abi::FLOW_SHELTER { shelter } else { sources };
            (share > 0.0).then(|| stronger(flow, share))
        }));
    }

    /// The nodes of all plants, for recordings.
    fn trace(stand: &Stand, poses: &[JointPose], room: &mut [abi::Trace]) {
        let bed = &stand.bed;
        let mut room = room.iter_mut();
        for (number, plant) in bed.plants().iter().enumerate() {
            let segments = bed.kinds()[plant.kind].skeleton.segments();
            let radii =
                segments.first().into_iter().chain(segments).map(|segment| segment.radius * plant.size);
            for ((node, position), (radius, slot)) in
                (0..).zip(bed.nodes(number, poses)).zip(radii.zip(&mut room))
            {
                *slot = abi::Trace {
                    object: id_of(number) - 1,
                    position: position.to_array(),
                    radius: radius as f32,
                    node,
                    kind: 0,
                    ..abi::Trace::default()
                };
            }
        }
    }
}

impl Plugin for Seaweeds {
    const ID: &'static str = "reef.seaweed";
    const NAME: &'static str = "Seaweeds";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const VENDOR: &'static str = "Reef";
    const DESCRIPTION: &'static str =
        "Seaweeds as branching skeletons that feel waves and currents (Coulais et al. 2005, section 4).";
    const STATE_VERSION: u32 = 1;
    const STATE_MIN_VERSION: u32 = 1;
    const LOADS_OVER: bool = true;
    type Config = Config;

    fn traces() -> &'static [&'static str] {
        &["seaweed"]
    }

    fn params() -> &'static [Param] {
        PARAMS
    }

    fn create(host: &Host, scene: &SceneInfo, config: Config) -> Result<Self, ConfigError> {
        let plan = Plan::new(scene, &config, &|name| Ok(host.asset(name)?))?;
        let (mut meshes, mut wears, mut materials) = (Vec::new(), Vec::new(), Vec::new());
        let (mut stocks, mut pictures) = (Vec::new(), Vec::new());
        for (name, sort) in plan.sorts() {
            let stock = Stock::of(&sort.species, &sort.kind.skeleton, &sort.form);
            let mut mesh = 0;
            for age in 0..AGES {
                if let Some(shape) = stock.shapes().get(age) {
                    let torn = stock.torn() && (age == AGES - 1 || stock.shapes().len() == 1);
                    let own = shape.upload(host, &format!("{name} {age}"), torn)?;
                    mesh = own.id();
                    meshes.push(own);
                }
                let mut texture = 0;
                if let Some(texels) = stock.pictures().get(age) {
                    let own =
                        host.texture(&format!("{name} {age}"), TextureFormat::Srgb, paint::SIZE, texels)?;
                    texture = own.id();
                    pictures.push(own);
                }
                wears.push(Wear { mesh, material: materials.len() as u32 });
                materials.push(looks::material(&sort.species, age, texture));
            }
            stocks.push(stock);
        }
        let (poses, flows) = (Vec::new(), Vec::new());
        Ok(Self {
            plan,
            stand: None,
            _meshes: meshes,
            _pictures: pictures,
            _stocks: stocks,
            wears,
            materials,
            poses,
            flows,
        })
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        let levels = Self::levels(input);
        let around = Surroundings {
            flow: input.flow(),
            waves: input.waves(),
            depth: input.water().depth.into(),
            density: input.water().density.into(),
            obstacles: input.obstacles(),
            camera: input.camera(),
            dt: input.dt(),
            level: Level::at_most(input.simd_level()),
            workers: input.workers(),
        };
        let plan = &self.plan;
        let stand = self.stand.get_or_insert_with(|| {
            Stand::new(plan.grow(&Floor { ground: input.heightfield(), rocks: around.obstacles }))
        });
        let bed = &mut stand.bed;
        let work = bed.step(&around, &levels);

        let whole = input.param(id::WHOLE) >= 0.5;
        let (plants, joints) = (bed.plants().len(), bed.plan_joints(whole));
        let objects = bed.object_count();
        bed.write_objects(around.workers, output.reserve::<abi::Object>(objects)?);
        output.commit::<abi::Object>(objects)?;
        if !input.is_unseen() {
            let room = (output.reserve::<abi::Skinned>(plants)?, output.reserve::<abi::Joint>(joints)?);
            let drawing = Drawing { dresses: &stand.dresses, wears: &self.wears, whole };
            bed.draw(around.level, around.workers, &drawing, room);
            output.commit::<abi::Skinned>(plants)?;
            output.commit::<abi::Joint>(joints)?;
        }
        output.emit(&self.materials)?;
        Self::scale_flows(&mut self.flows, bed, input);
        output.emit(&self.flows)?;

        let host = input.host();
        host.figure("plants stepped", work.plants as f64);
        host.figure("joints computed in a step", work.joints as f64);
        host.figure("water evaluations in a step", work.evaluations as f64);
        host.figure("joints drawn", joints as f64);
        host.figure("bytes a joint", bed.bytes() as f64 / bed.joint_count().max(1) as f64);
        if input.wants_trace() || input.wants_debug() {
            self.poses.resize(bed.joint_count(), JointPose::default());
            bed.write_poses(around.level, around.workers, &mut self.poses);
        }
        if input.wants_trace() {
            let nodes = bed.joint_count() + plants;
            Self::trace(stand, &self.poses, output.reserve::<abi::Trace>(nodes)?);
            output.commit::<abi::Trace>(nodes)?;
        }
        if input.wants_debug() {
            let shown = match input.param(id::LINES) as u32 {
                1 => Shown::Skeletons,
                2 => Shown::Flows,
                _ => Shown::Both,
            };
            output.emit(&debug::lines(&stand.bed, &self.poses, &self.flows, shown))?;
        }
        Ok(Status::Ok)
    }

    fn save(&self, state: &mut StateWriter) {
        state.put(PLANTED, &[u32::from(self.stand.is_some())]);
        let Some(stand) = &self.stand else { return };
        let places: Vec<u64> = stand.footings.iter().map(|footing| footing.place).collect();
        let heights: Vec<f64> = stand.footings.iter().map(|footing| footing.height).collect();
        let normals: Vec<f64> = stand
            .footings
            .iter()
            .flat_map(|footing| footing.normal.unwrap_or(DVec3::ZERO).to_array())
            .collect();
        state.put("places", &places);
        state.put("heights", &heights);
        state.put("normals", &normals);
        stand.bed.save().write(state);
    }

    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
        self.stand = None;
        if state.get::<u32>(PLANTED)?.first().is_none_or(|planted| *planted == 0) {
            return Ok(());
        }
        let places = state.get::<u64>("places")?;
        let (heights, normals) = (state.get::<f64>("heights")?, state.get::<f64>("normals")?);
        let refused = |problem: String| StateError::Refused(format!("the saved state {problem}"));
        if heights.len() != places.len() || normals.len() != 3 * places.len() {
            return Err(refused(format!("has {} places and other numbers of footings", places.len())));
        }
        let footing = |((place, height), normal): ((u64, f64), &[f64])| {
            let normal = DVec3::from_slice(normal);
            Footing { place, height, normal: (normal != DVec3::ZERO).then_some(normal) }
        };
        let footings: Vec<Footing> =
            places.into_iter().zip(heights).zip(normals.chunks_exact(3)).map(footing).collect();
        let mut stand = Stand::new(self.plan.regrow(&footings).map_err(refused)?);
        stand.bed.load(&State::read(state)?).map_err(refused)?;
        self.stand = Some(stand);
        Ok(())
    }
}

/// The field of a saved state that tells whether plants stand already: they do from the first step on.
const PLANTED: &str = "planted";
