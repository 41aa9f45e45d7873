//! The plants among the waves: where each feels them, and what it feels there.
//!
//! A plant is small beside the waves that reach it: all of it feels the velocity and the gradient at one
//! place, halfway up ([`reef_flow::waves::surge`]). Bare fibres that stand far apart have places of their
//! own. What a plant feels depends on the plant, the waves and who looks, not on the other plants.

use glam::DVec3;
use reef_flow::waves::{Places, Surges, Sway, surge::LANES};
use reef_sdk::Chunks;

use super::{Batch, Settings, Standing, Surroundings};
use crate::wide::lanes;

/// A plant without a foot that reaches farther than this times a fibre's length is a patch of fibres far
/// apart.
const SPARSE: f64 = 4.0;
/// Sixteens of places in a job.
const JOB: usize = 16;

/// Where plants feel the waves, and what they feel.
#[derive(Clone, Debug, Default)]
pub(super) struct Swaying {
    count: usize,
    places: Vec<Places>,
    surges: Vec<Surges>,
    sway: Sway,
}

impl Swaying {
    /// Notes where a plant, or one fibre of it, is: the middle of a length [m] along a direction from its
    /// root.
    fn add(&mut self, root: DVec3, up: DVec3, length: f64, origin: DVec3) -> u32 {
        let (block, lane) = (self.count / LANES, self.count % LANES);
        if lane == 0 {
            self.places.push(Places::default());
            self.surges.push(Surges::default());
        }
        let middle = root + up * (0.5 * length);
        self.places[block].set(lane, middle.to_array(), 0.5 * length, origin.to_array());
        self.count += 1;
        self.count as u32 - 1
    }

    /// Notes all plants, then each batch's fibres: when all plants stand.
    pub(super) fn place<'a>(&mut self, plants: &[Standing], batches: impl Iterator<Item = &'a mut Batch>) {
        *self = Self { sway: core::mem::take(&mut self.sway), ..Self::default() };
        for plant in plants {
            self.add(plant.origin, plant.stand.z, plant.reach, plant.origin);
        }
        for batch in batches {
            let blocks = if batch.is_riding() { 1 } else { batch.chunk.count().div_ceil(LANES) };
            batch.surges = vec![Surges::default(); blocks];
            let fibres = if batch.is_riding() { 1 } else { batch.chunk.count() };
            batch.spots = (0..fibres).map(|fibre| self.spot(plants, batch, fibre)).collect();
        }
    }

    /// Where a fibre feels the waves.
    fn spot(&mut self, plants: &[Standing], batch: &Batch, fibre: usize) -> u32 {
        let number = batch.plants.get(fibre).copied().unwrap_or_default();
        let Some(plant) = plants.get(number as usize).filter(|_| !batch.is_riding()) else { return number };
        let length = batch.chunk.shape(fibre).length();
        if plant.foot.is_some() || plant.reach <= SPARSE * length {
            return number;
        }
        let root = plant.origin + batch.chunk.node(fibre, 0).as_dvec3();
        self.add(root, batch.chunk.root_frame(fibre).z, length, plant.origin)
    }

    /// Works out what all of them feel in a step; nothing where there are no waves.
    pub(super) fn feel(&mut self, around: &Surroundings<'_>, settings: &Settings) -> &[Surges] {
        let Self { places, surges: felt, sway, .. } = self;
        let camera = around.camera.filter(|_| settings.trains);
        sway.fill(around.waves, around.depth, settings.waves, camera);
        if sway.is_still() {
            return &[];
        }
        let (level, places, sway) = (around.level, &*places, &*sway);
        around.workers.for_each_part(Chunks::new(felt, JOB), |index, felt| {
            sway.feel(level, places.get(index * JOB..).unwrap_or_default(), felt);
        });
        felt
    }
}

impl Batch {
    /// Takes what its fibres feel of the waves out of what all places do.
    pub(super) fn feel(&mut self, felt: &[Surges]) {
        let of = |spot: u32| (felt.get(spot as usize / LANES), spot as usize % LANES);
        if let ([spot], [own]) = (&self.spots[..], &mut self.surges[..])
            && let (Some(felt), lane) = of(*spot)
        {
            *own = Surges::all(felt, lane);
            return;
        }
        for (group, at, fibre) in lanes(self.spots.len()) {
            if let (Some(felt), lane) = of(self.spots[fibre]) {
                self.surges[group].take(at, felt, lane);
            }
        }
    }

    /// What the waves do to a fibre at `p` [m, relative to its plant's origin] in the last step [m/s].
    pub(crate) fn surge(&self, fibre: usize, p: DVec3) -> DVec3 {
        let group = (fibre / LANES).min(self.surges.len().saturating_sub(1));
        self.surges
            .get(group)
            .map_or(DVec3::ZERO, |surges| surges.velocity_of(fibre % LANES, p.to_array()).into())
    }
}
