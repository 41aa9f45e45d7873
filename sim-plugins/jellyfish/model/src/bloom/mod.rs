//! Animals in the sea: currents and waves carry each with its own water, parallel over animals.

mod animal;
mod jet;
mod state;

use glam::DVec3;
use reef_flow::{Field, Level};
use reef_sdk::{
    Chunks, Parts, Workers,
    abi::{DrawVertex, Flow, MeshVertex, Wave},
};

use crate::{
    slice::{FARTHEST, Slice},
    species::Species,
};
use animal::Animal;

pub use jet::{Fit, fit};
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
    /// Length of the step [s].
    pub dt: f64,
    /// Instruction set.
    pub level: Level,
    /// Who works.
    pub workers: Workers<'a>,
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
    flows: Vec<Flow>,
    /// Where the vertices of each animal begin.
    bounds: Vec<usize>,
}

impl Bloom {
    /// Animals at rest. `density` [kg/m³] and `viscosity` (kinematic, m²/s) are the sea's.
    ///
    /// # Errors
    /// Which animal, what is wrong with it or its species, and what is allowed.
    pub fn new(species: &[Species], births: &[Birth], density: f64, viscosity: f64) -> Result<Self, String> {
        let mut animals = Vec::with_capacity(births.len());
        let mut bounds = vec![0];
        for (i, birth) in births.iter().enumerate() {
            let own = species.get(birth.species).ok_or_else(|| {
                format!("animals[{i}].species: must be below {}, is {}", species.len(), birth.species)
            })?;
            if !(birth.size.is_finite() && birth.size > 0.0 && birth.yaw.is_finite()) {
                return Err(format!("animals[{i}]: size must be above 0 and finite, yaw must be finite"));
            }
            if !within_reach(birth.place) {
                return Err(format!(
                    "animals[{i}].place: must be within {FARTHEST} m along each axis, is {}",
                    birth.place
                ));
            }
            let animal = Animal::new(own, birth, density, viscosity)
                .map_err(|problem| format!("animals[{i}]: {problem}"))?;
            bounds.push(bounds[i] + animal.vertices().iter().sum::<usize>());
            animals.push(animal);
        }
        let flows = Vec::with_capacity(animals.len());
        Ok(Self { animals, field: Field::new(), flows, bounds })
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
        let field = &self.field;
        around.workers.for_each_part(Chunks::new(&mut self.animals, 1), |_, animal| {
            animal[0].step(around, field);
        });
        self.flows.clear();
        self.flows.extend(self.animals.iter().map(|animal| animal.flow));
    }

    /// What they emitted in the last step: one primitive each.
    pub fn flows(&self) -> &[Flow] {
        &self.flows
    }

    /// What the primitive of an animal missed of its water's speed in the last step, as a share.
    pub fn fit_error(&self, animal: usize) -> Option<f64> {
        Some(self.animals.get(animal)?.fit_error)
    }

    /// Middle of a bell [m, world].
    pub fn place(&self, animal: usize) -> Option<DVec3> {
        Some(self.animals.get(animal)?.place())
    }

    /// The slice of an animal.
    pub fn slice(&self, animal: usize) -> Option<&Slice<f32>> {
        Some(&self.animals.get(animal)?.slice)
    }

    /// Steers an animal toward a direction of the world, as far as its slice's plane goes.
    pub fn steer(&mut self, animal: usize, aim: DVec3) {
        if let Some(animal) = self.animals.get_mut(animal) {
            animal.steer(aim);
        }
    }

    /// Meshes of an animal: bell, tentacles, arms. A part that it does not have is empty.
    pub fn meshes(&self, animal: usize) -> Option<[PartMesh; 3]> {
        let (bell, tentacles, arms) = self.animals.get(animal)?.parts();
        let form = bell.form();
        Some([
            PartMesh { vertices: form.bell_mesh(), indices: form.bell_indices() },
            PartMesh { vertices: tentacles.mesh(), indices: tentacles.indices(0) },
            PartMesh { vertices: arms.mesh(), indices: arms.indices(0) },
        ])
    }

    /// Vertices of an animal's bell, tentacles and arms: so they follow one another in [`Bloom::write`].
    pub fn vertices(&self, animal: usize) -> Option<[usize; 3]> {
        Some(self.animals.get(animal)?.vertices())
    }

    /// Vertices of all.
    pub fn vertex_count(&self) -> usize {
        self.bounds.last().copied().unwrap_or(0)
    }

    /// Makes the vertices of all, [`Bloom::vertex_count`] of them, animal after animal, each relative to
    /// [`Bloom::place`], at a time [s] of the sea.
    pub fn write(&mut self, level: Level, workers: Workers<'_>, time: f64, into: &mut [DrawVertex]) {
        let Self { animals, bounds, .. } = self;
        let split = (Chunks::new(animals, 1), Parts::new(into, bounds));
        workers.for_each_part(split, |_, (animal, into)| animal[0].write(level, time, into));
    }
}
