//! The waves as soft and small things feel them all over the sea: plants that stand, fish that are carried.

use reef_abi::{Camera, Wave};

use super::{
    Choice, Lens, Places, Rule, Surges, Swell,
    surge::{Seen, surges},
};
use crate::Level;

/// A_min [px]: what trains that are left out may move the water by, in the scene's viewport. The tip of a
/// soft blade goes twice as far as the water at most, so nobody sees them missing; and it follows with its
/// relaxation time, so none of them pops.
const LEAST_SEEN: f64 = 0.5;
/// For nobody in particular: all trains matter.
const CLOSEST: Lens = Lens { focal: f64::INFINITY, corner: 1.0 };

/// The trains of a step that matter from where somebody looks. What is felt at a place depends on the place,
/// the trains and who looks, not on the other places.
#[derive(Clone, Debug, Default)]
pub struct Sway {
    swell: Swell,
    choice: Choice,
    factor: f32,
    /// Where they are looked at from [m, world].
    eye: Option<[f64; 3]>,
    still: bool,
}

impl Sway {
    /// Takes a step's trains over the depth [m], and a factor on their motion. `camera`: who looks, from
    /// which follows how many of them matter; None: all do. Allocates nothing while trains, depth and lens
    /// stay.
    pub fn fill(&mut self, waves: &[Wave], depth: f64, factor: f32, camera: Option<&Camera>) {
        self.still = waves.is_empty() || factor == 0.0;
        if self.still {
            return;
        }
        (self.factor, self.eye) = (factor, camera.map(|camera| camera.position));
        let lens = camera.map_or(CLOSEST, Lens::new);
        // The whole height of the water: what is chosen for one place does not depend on where others are.
        self.choice.update(waves, depth, lens, LEAST_SEEN, Rule::Sum, [-depth, 0.0]);
        self.swell.fill(self.choice.in_order(waves), depth);
        self.still = self.swell.is_still();
    }

    /// Whether no train moves anything.
    pub fn is_still(&self) -> bool {
        self.still
    }

    /// Works out what is felt at each of the places; leaves `felt` as it is where nothing moves.
    pub fn feel(&self, level: Level, places: &[Places], felt: &mut [Surges]) {
        if self.still {
            return;
        }
        let seen = self.choice.selection().zip(self.eye);
        let seen = seen.map(|(selection, eye)| Seen { selection, eye });
        surges(level, &self.swell, seen, self.factor, places, felt);
    }
}
