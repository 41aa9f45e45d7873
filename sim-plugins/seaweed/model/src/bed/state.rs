//! What a later step depends on, as plain numbers.

use reef_sdk::{StateError, StateReader, StateWriter};

use super::Bed;
use crate::lanes::Lane;

/// Everything that moves, plant by plant in the order of their numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Segments of each plant.
    pub segments: Vec<u32>,
    /// θ, φ, angular velocity and velocity of each segment: eight numbers [rad, rad/s, m/s].
    pub joints: Vec<f32>,
    /// Level of detail, share of the procedural method, how long it was not stepped [s] (the greatest number:
    /// it never was; −1: no step has come), and the velocity of the centre of gravity [m/s]: six numbers
    /// a plant.
    pub plants: Vec<f32>,
}

/// Numbers of a joint, and of a plant.
const OF_JOINT: usize = 8;
const OF_PLANT: usize = 6;

/// In the place of a time: no step has come yet.
const FRESH: f32 = -1.0;

impl State {
    /// Into the plugin's state, version 1.
    pub fn write(&self, state: &mut StateWriter) {
        state.put("segments", &self.segments);
        state.put("joints", &self.joints);
        state.put("plants", &self.plants);
    }

    /// Out of it.
    ///
    /// # Errors
    /// Something is missing or of another type.
    pub fn read(state: &mut StateReader) -> Result<Self, StateError> {
        Ok(Self {
            segments: state.get("segments")?,
            joints: state.get("joints")?,
            plants: state.get("plants")?,
        })
    }
}

impl Bed {
    /// The present state.
    pub fn save(&self) -> State {
        let mut state = State::default();
        for (plant, [pack, lane]) in self.plants.iter().zip(&self.places) {
            state.segments.push(self.kinds.get(plant.kind).map_or(0, |kind| kind.skeleton.len() as u32));
            let Some(pack_at) = self.packs.get(*pack as usize) else { continue };
            let (lane, rows) =
                (*lane as usize, self.row_bounds[*pack as usize]..self.row_bounds[*pack as usize + 1]);
            for row in &self.rows[rows] {
                let lanes = [&row.theta, &row.phi].into_iter().chain(&row.omega).chain(&row.speed);
                state.joints.extend(lanes.map(|values| values.0[lane]));
            }
            let stand = &pack_at.stand;
            let paused = if pack_at.fresh { FRESH } else { pack_at.paused[lane] };
            state.plants.extend([stand.detail.0[lane], stand.lagged.0[lane], paused]);
            state.plants.extend(stand.drift.iter().map(|values| values.0[lane]));
        }
        state
    }

    /// Takes back what [`Bed::save`] gave.
    ///
    /// # Errors
    /// What is wrong with it; then nothing has changed.
    pub fn load(&mut self, state: &State) -> Result<(), String> {
        let own: Vec<u32> =
            self.plants.iter().map(|plant| self.kinds[plant.kind].skeleton.len() as u32).collect();
        if state.segments != own {
            return Err(format!(
                "is of {} plants with {} segments; here are {} with {}",
                state.segments.len(),
                state.segments.iter().map(|count| u64::from(*count)).sum::<u64>(),
                own.len(),
                own.iter().map(|count| u64::from(*count)).sum::<u64>()
            ));
        }
        let joints: usize = own.iter().map(|count| *count as usize).sum();
        if state.joints.len() != OF_JOINT * joints || state.plants.len() != OF_PLANT * own.len() {
            return Err("has not as many numbers as its segments need".to_owned());
        }
        if !state.joints.iter().chain(&state.plants).all(|value| value.is_finite()) {
            return Err("has a number that is not finite".to_owned());
        }
        for plant in state.plants.chunks_exact(OF_PLANT) {
            let within = (0.0..=2.0).contains(&plant[0])
                && (0.0..=1.0).contains(&plant[1])
                && (plant[2] >= 0.0 || plant[2] == FRESH);
            if !within {
                return Err(
                    "has a level of detail that is not from 0 to 2, or a share not from 0 to 1".to_owned()
                );
            }
        }
        self.packs.iter_mut().for_each(|pack| pack.fresh = false);
        let mut joints = state.joints.chunks_exact(OF_JOINT);
        for (plant, [pack, lane]) in state.plants.chunks_exact(OF_PLANT).zip(&self.places) {
            let lane = *lane as usize;
            let rows = self.row_bounds[*pack as usize]..self.row_bounds[*pack as usize + 1];
            for (row, joint) in self.rows[rows].iter_mut().zip(&mut joints) {
                let lanes =
                    [&mut row.theta, &mut row.phi].into_iter().chain(&mut row.omega).chain(&mut row.speed);
                lanes.zip(joint).for_each(|(values, value): (&mut Lane, &f32)| values.0[lane] = *value);
            }
            let pack = &mut self.packs[*pack as usize];
            pack.stand.detail.0[lane] = plant[0];
            pack.stand.lagged.0[lane] = plant[1];
            pack.fresh |= plant[2] == FRESH;
            pack.paused[lane] = plant[2].max(0.0);
            pack.stand.drift.iter_mut().zip(&plant[3..]).for_each(|(values, value)| values.0[lane] = *value);
        }
        Ok(())
    }
}
