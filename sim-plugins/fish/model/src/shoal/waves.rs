//! The waves' orbits carry fish as currents do: a fish is small beside the waves that reach it, so all of it
//! feels the velocity at its centre ([`reef_flow::waves::surge`]).

use glam::Vec3;
use reef_flow::{
    Level,
    waves::{
        Choice, Lens, Places, Rule, Surges, Swell,
        surge::{LANES, Seen, surges},
    },
};
use reef_sdk::abi;

use super::{CHUNK, Fish};

/// A_min [px]: what trains that are left out may move a fish by, in the scene's viewport.
const LEAST_SEEN: f64 = 0.5;
/// For nobody in particular: all trains matter.
const CLOSEST: Lens = Lens { focal: f64::INFINITY, corner: 1.0 };
/// Sixteens of a chunk of fish.
pub(super) const BLOCKS: usize = CHUNK.div_ceil(LANES);

/// The wave trains of a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Waves<'a> {
    /// All of them, greatest first.
    pub trains: &'a [abi::Wave],
    /// Depth of the water [m].
    pub depth: f64,
    /// Factor on their motion that fish feel; with 0 there is none.
    pub factor: f32,
    /// Who looks: how many trains matter follows from it. None: all do.
    pub camera: Option<&'a abi::Camera>,
}

/// The trains that matter, as fish take them.
#[derive(Clone, Debug, Default)]
pub(super) struct Swaying {
    swell: Swell,
    choice: Choice,
    still: bool,
}

/// Room for one chunk of fish.
#[derive(Clone, Debug)]
pub(super) struct Sixteens {
    places: [Places; BLOCKS],
    surges: [Surges; BLOCKS],
}

impl Default for Sixteens {
    fn default() -> Self {
        Self { places: [Places::default(); BLOCKS], surges: [Surges::default(); BLOCKS] }
    }
}

impl Swaying {
    /// Takes up a step's trains.
    pub(super) fn fill(&mut self, waves: &Waves<'_>) {
        self.still = waves.trains.is_empty() || waves.factor == 0.0;
        if self.still {
            return;
        }
        let lens = waves.camera.map_or(CLOSEST, Lens::new);
        // The whole height of the water: what is chosen for one fish does not depend on where the others are.
        self.choice.update(waves.trains, waves.depth, lens, LEAST_SEEN, Rule::Sum, [-waves.depth, 0.0]);
        self.swell.fill(self.choice.in_order(waves.trains), waves.depth);
        self.still = self.swell.is_still();
    }

    /// Whether no train moves fish.
    pub(super) fn is_still(&self) -> bool {
        self.still
    }

    /// Works out what the waves do to a chunk of fish of these lengths [m].
    pub(super) fn feel<'a>(
        &self,
        waves: &Waves<'_>,
        level: Level,
        fish: impl ExactSizeIterator<Item = (&'a Fish, f64)>,
        room: &mut Sixteens,
    ) {
        if self.still {
            return;
        }
        let blocks = fish.len().div_ceil(LANES);
        for (number, (fish, length)) in fish.enumerate() {
            let at = fish.position.to_array();
            room.places[number / LANES].set(number % LANES, at, 0.5 * length, at);
        }
        let seen = self.choice.selection().zip(waves.camera);
        let seen = seen.map(|(selection, camera)| Seen { selection, eye: camera.position });
        let Sixteens { places, surges: felt } = room;
        surges(level, &self.swell, seen, waves.factor, &places[..blocks], &mut felt[..blocks]);
    }

    /// What they do to one of the chunk [m/s].
    pub(super) fn of(&self, room: &Sixteens, number: usize) -> Vec3 {
        let velocity = room.surges[number / LANES].velocity_of(number % LANES, [0.0; 3]);
        Vec3::from(velocity.map(|v| v as f32))
    }
}
