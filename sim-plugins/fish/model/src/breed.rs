//! All that a species is, worked out once: its body, its gait, its skin. An instance that is made beside
//! another of the same table, as for a load, does not work it out again.

use reef_sdk::{Held, Kept};

use crate::{
    Plan,
    body::BodyError,
    gait::Gait,
    mesh::{Shape, outline::Outline, shape},
    paint::{Picture, paint},
    species::Species,
};

/// What somebody has.
static KNOWN: Kept<Breed> = Kept::new();

/// A species and all that is made from its table.
#[derive(Debug)]
pub struct Breed {
    species: Species,
    plan: Plan,
    gait: Gait,
    shape: Shape,
    picture: Picture,
}

impl Breed {
    /// Of a table that was checked.
    ///
    /// # Errors
    /// The key that is wrong, and what is allowed.
    pub fn of(species: &Species) -> Result<Held<Self>, BodyError> {
        KNOWN.get(
            |breed| breed.species == *species,
            || {
                let plan = species.plan()?;
                let gait = Gait::of(species, &plan)?;
                let shape = shape(species, &plan);
                let picture = paint(&species.look, Outline::new(species).last());
                Ok(Self { species: species.clone(), plan, gait, shape, picture })
            },
        )
    }

    /// Its table.
    pub fn species(&self) -> &Species {
        &self.species
    }

    /// Its body.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// How it swims.
    pub fn gait(&self) -> &Gait {
        &self.gait
    }

    /// Its skin at a size of 1.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// What is on its skin.
    pub fn picture(&self) -> &Picture {
        &self.picture
    }
}
