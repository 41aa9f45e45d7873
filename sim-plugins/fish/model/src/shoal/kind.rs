//! What all fish of a species share.

use reef_sdk::abi::fnv1a_32;

use super::act::least_reach;
use crate::{
    Plan,
    body::BodyError,
    gait::Gait,
    species::{Carried, Mind, Species},
};

/// What all fish of a species share.
#[derive(Clone, Debug)]
pub struct Kind {
    /// Its body.
    pub plan: Plan,
    /// How it swims.
    pub gait: Gait,
    /// How it behaves.
    pub mind: Mind,
    /// What it carries.
    pub carries: Carried,
    /// Kinds that it hunts, by their numbers.
    pub prey: Vec<u32>,
    /// Species that it takes for its home, by the hashes of their names.
    pub lives_in: Vec<u32>,
}

impl Kind {
    /// A species that hunts those kinds.
    ///
    /// # Errors
    /// The key that is wrong, and what is allowed.
    pub fn new(species: &Species, prey: Vec<u32>) -> Result<Self, BodyError> {
        let plan = species.plan()?;
        let gait = Gait::of(species, &plan)?;
        Ok(Self::made(species, plan, gait, prey))
    }

    /// As [`Kind::new`], of what is worked out already.
    pub(crate) fn made(species: &Species, plan: Plan, gait: Gait, prey: Vec<u32>) -> Self {
        let homes = species.mind.lives_in.iter().filter(|_| species.mind.home > 0.0);
        let lives_in = homes.map(|name| fnv1a_32(name.as_bytes())).collect();
        Self { plan, gait, mind: species.mind.clone(), carries: species.carries.clone(), prey, lives_in }
    }

    /// At a size of 1 [m].
    pub fn length(&self) -> f64 {
        self.plan.body().length()
    }

    /// How far it sees, in lengths.
    pub(super) fn range(&self) -> f32 {
        self.mind.range as f32
    }

    /// Side of the cells that its fish are sorted by, in lengths: a share of how far they usually take note
    /// of each other.
    pub(super) fn cell(&self) -> f64 {
        const SHARE: f64 = 0.7;
        SHARE * f64::from(least_reach(self) * self.range()).sqrt()
    }

    /// Its greatest extent from top to bottom at a size of 1, its fin left out [m].
    pub(super) fn height(&self) -> f64 {
        let body = self.plan.body();
        let lifted = body.nodes().iter().zip(body.lift()).map(|(at, lift)| at.y * f64::from(*lift));
        2.0 * lifted.fold(0.0, f64::max)
    }
}
