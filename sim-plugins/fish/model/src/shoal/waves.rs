//! The waves' orbits carry fish as currents do: a fish is small beside the waves that reach it, so all of it
//! feels the velocity at its centre ([`reef_flow::waves::surge`]).

use glam::Vec3;
use reef_flow::{
    Level,
    waves::{Places, Surges, Sway, surge::LANES},
};
use reef_sdk::abi;

use super::{CHUNK, Fish};

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

impl Waves<'_> {
    /// Takes up a step's trains.
    pub(super) fn fill(&self, sway: &mut Sway) {
        sway.fill(self.trains, self.depth, self.factor, self.camera);
    }
}

impl Sixteens {
    /// Works out what the waves do to a chunk of fish of these lengths [m].
    pub(super) fn feel<'a>(
        &mut self,
        sway: &Sway,
        level: Level,
        fish: impl ExactSizeIterator<Item = (&'a Fish, f64)>,
    ) {
        if sway.is_still() {
            return;
        }
        let blocks = fish.len().div_ceil(LANES);
        for (number, (fish, length)) in fish.enumerate() {
            let at = fish.position.to_array();
            self.places[number / LANES].set(number % LANES, at, 0.5 * length, at);
        }
        sway.feel(level, &self.places[..blocks], &mut self.surges[..blocks]);
    }

    /// What they do to one of the chunk [m/s].
    pub(super) fn of(&self, number: usize) -> Vec3 {
        let velocity = self.surges[number / LANES].velocity_of(number % LANES, [0.0; 3]);
        Vec3::from(velocity.map(|v| v as f32))
    }
}
