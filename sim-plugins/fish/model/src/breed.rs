//! All that a species is, worked out once: its body, its gait, its skin. An instance that is made beside
//! another of the same table, as for a load, does not work it out again.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use crate::{
    Plan,
    body::BodyError,
    gait::Gait,
    mesh::{Shape, outline::Outline, shape},
    paint::{Picture, paint},
    species::Species,
};

/// What somebody has.
static KNOWN: Mutex<Vec<Weak<Breed>>> = Mutex::new(Vec::new());

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
    pub fn of(species: &Species) -> Result<Arc<Self>, BodyError> {
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let there = known.iter().filter_map(Weak::upgrade).find(|breed| breed.species == *species);
        if let Some(there) = there {
            return Ok(there);
        }
        let plan = species.plan()?;
        let gait = Gait::of(species, &plan)?;
        let (shape, picture) = (shape(species, &plan), paint(&species.look, Outline::new(species).last()));
        let breed = Arc::new(Self { species: species.clone(), plan, gait, shape, picture });
        known.retain(|breed| breed.strong_count() > 0);
        known.push(Arc::downgrade(&breed));
        Ok(breed)
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

/// A library that is unloaded leaves nothing behind: to be called when breeds were given up.
pub(crate) fn forget() {
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    known.retain(|breed| breed.strong_count() > 0);
    if known.is_empty() {
        *known = Vec::new();
    }
}
