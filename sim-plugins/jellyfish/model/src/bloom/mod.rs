//! Animals in the sea: currents and waves carry each with its own water, parallel over animals.

mod animal;
mod apart;
mod jet;
mod lines;
mod section;
mod skin;
mod stance;
mod state;

use std::sync::Arc;

use glam::DVec3;
use reef_flow::{Field, Level};
use reef_sdk::{
    Chunks, Heightfield, Parts, Workers,
    abi::{DrawVertex, FibreNode, Flow, MeshVertex, Wave},
};

use crate::{
    slice::{FARTHEST, Slice},
    species::Species,
};
use animal::Animal;
use apart::Crowd;

pub use jet::{Choice, Fit, PRIMITIVES};
pub use lines::Shown;
pub use state::BloomState;

/// Where an animal begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Birth {
    /// Which of the species.
    pub species: usize,
    /// Middle of the bell [m, world].
    pub place: DVec3,
    /// Direction of its slice around the vertical [rad].
    pub yaw: f64,
    /// Size over that of the species, above 0.
    pub size: f64,
    /// Everything that is by chance.
    pub seed: u64,
    /// Its object's id: it does not feel what it emits itself. Not 0.
    pub id: u64,
    /// Contractions a second [Hz]; None: its species', with its own variation.
    pub frequency: Option<f64>,
    /// Share of the period at which it begins; None: by chance.
    pub phase: Option<f64>,
    /// Where it swims: a direction of the world, as far as its slice's plane goes.
    pub aim: DVec3,
    /// The box that it stays in; None: it swims on.
    pub home: Option<Home>,
    /// Specks of dye in its water.
    pub tracers: usize,
    /// Its slices: 1, or 2 at right angles, which cost twice as much and turn it to any side.
    pub slices: usize,
}

impl Default for Birth {
    fn default() -> Self {
        Self {
            species: 0,
            place: DVec3::ZERO,
            yaw: 0.0,
            size: 1.0,
            seed: 0,
            id: 1,
            frequency: None,
            phase: None,
            aim: DVec3::Y,
            home: None,
            tracers: 0,
            slices: 1,
        }
    }
}

/// A box that an animal stays in: it swims up until it is near the top, then idles and sinks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Home {
    /// Corner of least coordinates [m, world].
    pub low: DVec3,
    /// Corner of greatest coordinates [m, world].
    pub high: DVec3,
}

/// What is set for all of them while they swim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuning {
    /// Factor on the frequency.
    pub frequency: f64,
    /// Factor on how far muscles contract.
    pub strength: f64,
    /// By how much they lean from their way toward positive x of their slices [rad].
    pub tilt: f64,
    /// Share of the periods in which they idle, 0..1.
    pub idle: f64,
    /// How much denser their tissue is than that of their species [kg/m³].
    pub excess_density: f64,
    /// They rise to the top of their homes.
    pub dusk: bool,
    /// Factor on the cells of their grids.
    pub cells: f64,
    /// Steps of a near slice in 1/60 s, at the least: what contracts often has more.
    pub steps: usize,
    /// Factor on the distance that they keep from each other; 0: none.
    pub apart: f64,
    /// Bells that look narrower are drawn coarsely and stepped as seldom as they bear [px].
    pub detail: f64,
}

impl Default for Tuning {
    fn default() -> Self {
        Self {
            frequency: 1.0,
            strength: 1.0,
            tilt: 0.0,
            idle: 0.0,
            excess_density: 0.0,
            dusk: false,
            cells: 1.0,
            steps: 2,
            apart: 1.0,
            detail: 0.0,
        }
    }
}

/// What acts on all of them in a step.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// The sea's flow.
    pub flow: &'a [Flow],
    /// Wave trains.
    pub waves: &'a [Wave],
    /// Depth of the sea [m].
    pub depth: f64,
    /// The bed; None: it is level.
    pub bed: Option<Heightfield<'a>>,
    /// Where the camera is [m, world].
    pub eye: DVec3,
    /// Width in the picture of what is as wide as it is far [px].
    pub pixels: f64,
    /// ρ of the water [kg/m³].
    pub density: f64,
    /// ν of the water [m²/s].
    pub viscosity: f64,
    /// What is set for all.
    pub tuning: Tuning,
    /// Time at the beginning of the step [s].
    pub time: f64,
    /// Length of the step [s].
    pub dt: f64,
    /// Instruction set.
    pub level: Level,
    /// Who works.
    pub workers: Workers<'a>,
}

impl Default for Surroundings<'_> {
    /// Still water of 10 m, and a step of 1/60 s by one worker.
    fn default() -> Self {
        Self {
            flow: &[],
            waves: &[],
            depth: 10.0,
            bed: None,
            eye: DVec3::ZERO,
            pixels: 1000.0,
            density: 1025.0,
            viscosity: 1.2e-6,
            tuning: Tuning::default(),
            time: 0.0,
            dt: 1.0 / 60.0,
            level: Level::best(),
            workers: Workers::inline(),
        }
    }
}

/// What never changes of one part of an animal's surface.
#[derive(Clone, Debug, PartialEq)]
pub struct PartMesh {
    /// Texture coordinates of each vertex.
    pub vertices: Vec<MeshVertex>,
    /// Three a triangle, counter-clockwise from outside.
    pub indices: Vec<u32>,
}

/// Whether an animal may be at a place of the world [m]: not where one of its coordinates is no number.
fn within_reach(place: DVec3) -> bool {
    place.abs().to_array().iter().all(|way| *way <= FARTHEST)
}

/// All animals.
#[derive(Clone, Debug)]
pub struct Bloom {
    animals: Vec<Animal>,
    field: Field,
    crowd: Crowd,
    choice: Arc<Choice>,
    flows: Vec<Flow>,
    /// Where the vertices, and the tentacles' nodes, of each animal begin.
    bounds: [Vec<usize>; 2],
}

impl Bloom {
    /// Animals at rest.
    ///
    /// # Errors
    /// Which animal, what is wrong with it or its species, and what is allowed.
    pub fn new(species: &[Species], births: &[Birth]) -> Result<Self, String> {
        let mut animals = Vec::with_capacity(births.len());
        let choice = Arc::new(Choice::default());
        for table in species {
            table.check()?;
        }
        for (i, birth) in births.iter().enumerate() {
            let own = species.get(birth.species).ok_or_else(|| {
                format!("animals[{i}].species: must be below {}, is {}", species.len(), birth.species)
            })?;
            if !(birth.size.is_finite() && birth.size > 0.0 && birth.yaw.is_finite()) {
                return Err(format!("animals[{i}]: size must be above 0 and finite, yaw must be finite"));
            }
            let aims = birth.aim.is_finite() && birth.aim.length_squared() > 0.0;
            if !aims || birth.phase.is_some_and(|phase| !phase.is_finite()) {
                return Err(format!("animals[{i}]: aim must be finite and not 0, phase must be finite"));
            }
            if !(1..=2).contains(&birth.slices) {
                return Err(format!("animals[{i}].slices: must be 1 or 2, is {}", birth.slices));
            }
            if !within_reach(birth.place) {
                return Err(format!(
                    "animals[{i}].place: must be within {FARTHEST} m along each axis, is {}",
                    birth.place
                ));
            }
            let animal =
                Animal::new(own, birth, &choice).map_err(|problem| format!("animals[{i}]: {problem}"))?;
            animals.push(animal);
        }
        let flows = Vec::with_capacity(2 * PRIMITIVES * animals.len());
        let bounds = [(); 2].map(|()| vec![0; animals.len() + 1]);
        let mut made = Self { animals, field: Field::new(), crowd: Crowd::default(), choice, flows, bounds };
        made.gather();
        Ok(made)
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.animals.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.animals.is_empty()
    }

    /// One step of all.
    pub fn step(&mut self, around: &Surroundings<'_>) {
        if around.dt.is_nan() || around.dt <= 0.0 {
            return;
        }
        self.field.refill(around.flow);
        self.crowd.fill(self.animals.iter().map(Animal::body));
        let (field, crowd, choice) = (&self.field, &self.crowd, &self.choice);
        around.workers.for_each_part(Chunks::new(&mut self.animals, 1), |i, animal| {
            animal[0].step(around, field, (crowd, i), choice);
        });
        self.gather();
    }

    /// What all of them emit, and where the vertices and the nodes of each begin.
    fn gather(&mut self) {
        self.flows.clear();
        self.flows.extend(self.animals.iter().flat_map(Animal::flows));
        let [vertices, nodes] = &mut self.bounds;
        for (i, animal) in self.animals.iter().enumerate() {
            vertices[i + 1] = vertices[i] + animal.vertices().iter().sum::<usize>();
            let [count, points] = animal.tentacles();
            nodes[i + 1] = nodes[i] + count * points;
        }
    }

    /// What they do to the water: [`PRIMITIVES`] each, and as many more of those with two slices.
    pub fn flows(&self) -> &[Flow] {
        &self.flows
    }

    /// The primitives that an animal emits, and what they miss of its water.
    pub fn fit(&self, animal: usize) -> Option<Fit> {
        Some(self.animals.get(animal)?.fit)
    }

    /// Middle of a bell [m, world].
    pub fn place(&self, animal: usize) -> Option<DVec3> {
        Some(self.animals.get(animal)?.place())
    }

    /// The points of an animal's bell from one side of the margin to the other [m, world].
    pub fn chain(&self, animal: usize) -> impl Iterator<Item = DVec3> + '_ {
        let animal = self.animals.get(animal);
        animal.into_iter().flat_map(|animal| animal.own.slice.chain().map(animal.world()))
    }

    /// What others see of an animal.
    pub fn seen(&self, animal: usize) -> Option<Seen> {
        let own = self.animals.get(animal)?;
        Some(Seen {
            id: own.id,
            species: own.species,
            place: own.place(),
            velocity: own.velocity.as_vec3(),
            axis: own.axis(),
            diameter: own.diameter,
            reach: own.reach,
            far: own.far,
            phase: own.own.slice.phase(),
            idles: own.idles,
        })
    }

    /// The slice of an animal along its heading.
    pub fn slice(&self, animal: usize) -> Option<&Slice<f32>> {
        Some(&self.animals.get(animal)?.own.slice)
    }

    /// The slice across that one, of an animal with two.
    pub fn slice_across(&self, animal: usize) -> Option<&Slice<f32>> {
        Some(&self.animals.get(animal)?.cross.as_ref()?.slice)
    }

    /// Steers an animal toward a direction of the world from now on, of one slice as far as its plane
    /// goes; a way that is none changes nothing.
    pub fn steer(&mut self, animal: usize, aim: DVec3) {
        if let Some(animal) = self.animals.get_mut(animal)
            && aim.is_finite()
            && aim.length_squared() > 0.0
        {
            animal.aim = aim;
        }
    }

    /// Meshes of an animal's arms and its bell, near or far. A part that it does not have is empty.
    pub fn meshes(&self, animal: usize, far: bool) -> Option<[PartMesh; 2]> {
        let (arms, bell) = self.animals.get(animal)?.parts(far);
        let form = bell.form();
        Some([
            PartMesh { vertices: arms.mesh(), indices: arms.indices() },
            PartMesh { vertices: form.bell_mesh(), indices: form.bell_indices() },
        ])
    }

    /// Vertices of an animal's arms and its bell, as it is drawn now: so they follow one another in
    /// [`Bloom::write`].
    pub fn vertices(&self, animal: usize) -> Option<[usize; 2]> {
        Some(self.animals.get(animal)?.vertices())
    }

    /// Tentacles of an animal, and nodes of each, as it is drawn now.
    pub fn tentacles(&self, animal: usize) -> Option<[usize; 2]> {
        Some(self.animals.get(animal)?.tentacles())
    }

    /// Vertices of all.
    pub fn vertex_count(&self) -> usize {
        self.bounds[0].last().copied().unwrap_or(0)
    }

    /// Nodes of all tentacles.
    pub fn node_count(&self) -> usize {
        self.bounds[1].last().copied().unwrap_or(0)
    }

    /// Makes the vertices of all, [`Bloom::vertex_count`] of them, animal after animal, and the nodes of
    /// their tentacles, [`Bloom::node_count`], tentacle after tentacle from root to tip; each relative to
    /// [`Bloom::place`], at a time [s] of the sea.
    pub fn write(
        &mut self,
        level: Level,
        workers: Workers<'_>,
        time: f64,
        (vertices, nodes): (&mut [DrawVertex], &mut [FibreNode]),
    ) {
        let Self { animals, bounds: [of_vertices, of_nodes], .. } = self;
        let split = (Chunks::new(animals, 1), Parts::new(vertices, of_vertices), Parts::new(nodes, of_nodes));
        workers.for_each_part(split, |_, (animal, vertices, nodes)| {
            animal[0].write(level, time, vertices, nodes);
        });
    }
}

/// What others see of an animal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Its object's id.
    pub id: u64,
    /// Its species' number.
    pub species: usize,
    /// Middle of its bell [m, world].
    pub place: DVec3,
    /// [m/s]
    pub velocity: glam::Vec3,
    /// Where its apex points.
    pub axis: glam::Vec3,
    /// Width of its bell at rest [m].
    pub diameter: f64,
    /// A radius around its place that all of it is within [m], whether it is written or not.
    pub reach: f32,
    /// It is drawn coarsely.
    pub far: bool,
    /// Share of its present period.
    pub phase: f64,
    /// It does not contract in this period.
    pub idles: bool,
}
