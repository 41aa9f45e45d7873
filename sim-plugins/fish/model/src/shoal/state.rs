//! What a later step depends on, as plain numbers.

use glam::{DVec3, Vec3};
use reef_sdk::{StateError, StateReader, StateWriter};

use super::{Home, Shoal};

/// Everything that moves, fish by fish in the order of their numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Time that has gone [s].
    pub time: f64,
    /// Nodes of each fish.
    pub nodes: Vec<u32>,
    /// Centre, origin of the nodes and water that its body felt [m, m, m/s]: nine numbers a fish.
    pub places: Vec<f64>,
    /// Course, speed, water, phase, time since it is a point, two biases, hunger, love, fright, reach:
    /// fifteen.
    pub minds: Vec<f32>,
    /// Whether its body is stepped.
    pub near: Vec<u8>,
    /// Position and velocity of each node, and what it is off the gait: nine numbers [m, m/s, m].
    pub bodies: Vec<f32>,
    /// Ids of the anemones that they live in; 0: none.
    pub homes: Vec<u64>,
    /// Where those are: three numbers a fish [m, world].
    pub home_places: Vec<f64>,
}

const OF_PLACE: usize = 9;
const OF_MIND: usize = 15;
const OF_NODE: usize = 9;
const OF_HOME: usize = 3;

impl State {
    /// Into the plugin's state, version 1.
    pub fn write(&self, state: &mut StateWriter) {
        state.put_one("time", self.time);
        state.put("nodes", &self.nodes);
        state.put("places", &self.places);
        state.put("minds", &self.minds);
        state.put("near", &self.near);
        state.put("bodies", &self.bodies);
        state.put("homes", &self.homes);
        state.put("home_places", &self.home_places);
    }

    /// Out of it.
    ///
    /// # Errors
    /// Something is missing or of another type.
    pub fn read(state: &mut StateReader) -> Result<Self, StateError> {
        let nodes: Vec<u32> = state.get("nodes")?;
        // Older states know of no homes.
        let (homes, home_places) = if state.has("homes") {
            (state.get("homes")?, state.get("home_places")?)
        } else {
            (vec![0; nodes.len()], vec![0.0; OF_HOME * nodes.len()])
        };
        Ok(Self {
            time: state.get_one("time")?,
            nodes,
            places: state.get("places")?,
            minds: state.get("minds")?,
            near: state.get("near")?,
            bodies: state.get("bodies")?,
            homes,
            home_places,
        })
    }
}

impl Shoal {
    /// The present state.
    pub fn save(&self) -> State {
        let mut state = State { time: self.time, ..State::default() };
        for fish in &self.fish {
            let (tank, slot) = (&self.tanks[fish.kind as usize], fish.slot as usize);
            let swimmer = &tank.swimmers()[slot];
            let count = tank.positions(slot).len();
            state.nodes.push(count as u32);
            state.near.push(u8::from(fish.near));
            state.homes.push(fish.home.map_or(0, |home| home.id));
            state.home_places.extend(fish.home.map_or([0.0; OF_HOME], |home| home.place.to_array()));
            for place in [fish.position, swimmer.origin, swimmer.water] {
                state.places.extend(place.to_array());
            }
            state.minds.extend(fish.course.to_array());
            state.minds.push(fish.speed);
            state.minds.extend(fish.water.to_array());
            state.minds.extend([swimmer.phase, fish.since]);
            state.minds.extend(fish.bias);
            state.minds.extend([fish.hunger, fish.love, fish.fright, fish.reach]);
            let offsets = &self.offsets[fish.kind as usize][slot * count..(slot + 1) * count];
            for ((x, v), offset) in tank.positions(slot).iter().zip(tank.velocities(slot)).zip(offsets) {
                state.bodies.extend(x.iter().chain(v).chain(&offset.to_array()));
            }
        }
        state
    }

    /// Takes back what [`Shoal::save`] gave.
    ///
    /// # Errors
    /// What is wrong with it; then nothing has changed.
    pub fn load(&mut self, state: &State) -> Result<(), String> {
        let own = |fish: &super::Fish| self.kinds[fish.kind as usize].plan.body().nodes().len() as u32;
        let nodes: Vec<u32> = self.fish.iter().map(own).collect();
        if state.nodes != nodes {
            return Err(format!(
                "is of {} fish with other bodies; here are {}",
                state.nodes.len(),
                nodes.len()
            ));
        }
        let all: usize = nodes.iter().map(|count| *count as usize).sum();
        let lengths = [
            ("places", state.places.len(), OF_PLACE * nodes.len()),
            ("minds", state.minds.len(), OF_MIND * nodes.len()),
            ("near", state.near.len(), nodes.len()),
            ("bodies", state.bodies.len(), OF_NODE * all),
            ("homes", state.homes.len(), nodes.len()),
            ("home_places", state.home_places.len(), OF_HOME * nodes.len()),
        ];
        if let Some((name, is, must)) = lengths.iter().find(|(_, is, must)| is != must) {
            return Err(format!("`{name}` has {is} numbers in place of {must}"));
        }
        let finite = state.time.is_finite()
            && state.places.iter().chain(&state.home_places).all(|x| x.is_finite())
            && state.minds.iter().chain(&state.bodies).all(|x| x.is_finite());
        if !finite {
            return Err("has a number that is not finite".into());
        }
        let mut bodies = state.bodies.as_chunks::<OF_NODE>().0.iter();
        self.time = state.time;
        let parts = state.places.as_chunks::<OF_PLACE>().0.iter().zip(state.minds.as_chunks::<OF_MIND>().0);
        let homes = state.homes.iter().zip(state.home_places.as_chunks::<OF_HOME>().0);
        for (fish, (id, place)) in self.fish.iter_mut().zip(homes) {
            fish.home = (*id != 0).then(|| Home { id: *id, place: (*place).into() });
        }
        for ((fish, near), (place, mind)) in self.fish.iter_mut().zip(&state.near).zip(parts) {
            let slot = fish.slot as usize;
            let tank = &mut self.tanks[fish.kind as usize];
            fish.near = *near != 0;
            fish.position = DVec3::from_slice(&place[..3]);
            fish.course = Vec3::from_slice(&mind[..3]);
            fish.speed = mind[3];
            fish.water = Vec3::from_slice(&mind[4..7]);
            fish.since = mind[8];
            fish.bias = [mind[9], mind[10]];
            [fish.hunger, fish.love, fish.fright, fish.reach] = [mind[11], mind[12], mind[13], mind[14]];
            let swimmer = &mut tank.swimmers_mut()[slot];
            swimmer.origin = DVec3::from_slice(&place[3..6]);
            swimmer.water = DVec3::from_slice(&place[6..]);
            swimmer.phase = mind[7];
            let (positions, velocities) = tank.nodes_mut(slot);
            let count = positions.len();
            let offsets = &mut self.offsets[fish.kind as usize][slot * count..(slot + 1) * count];
            for (((x, v), offset), from) in
                positions.iter_mut().zip(velocities).zip(offsets).zip(bodies.by_ref())
            {
                x.copy_from_slice(&from[..3]);
                v.copy_from_slice(&from[3..6]);
                *offset = Vec3::from_slice(&from[6..]);
            }
        }
        Ok(())
    }
}
