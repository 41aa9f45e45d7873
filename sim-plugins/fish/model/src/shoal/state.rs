//! What a later step depends on, as plain numbers.

use glam::{DVec3, Vec3};
use reef_sdk::{StateError, StateReader, StateWriter};

use super::{
    FASTEST_WATER, Fish, Home, Kind, Shoal,
    act::{BLEND, least_reach},
    steer::{CARRIES, FRIGHT},
};

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
/// How far off 1 the squared length of a course may be, and by which share rounding passes a bound.
const UNIT: f32 = 1e-3;
const ROUNDED: f64 = 1e-5;
/// No fish comes so far from its habitat: it takes the fastest water eleven days [m].
const FARTHEST: f64 = 1e7;
/// No body moves by itself so fast, nor is it torn apart so far [lengths a second, lengths].
const FASTEST: f32 = 1e3;
const EXTENT: f32 = 10.0;

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
            state.minds.extend([fish.phase, fish.since]);
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
        let own = |fish: &Fish| self.kinds[fish.kind as usize].plan.body().nodes().len() as u32;
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
        self.check(state)?;
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
            (swimmer.phase, fish.phase) = (mind[7], mind[7]);
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

    /// Refuses, by its name, a number that no step writes.
    fn check(&self, state: &State) -> Result<(), String> {
        if !(0.0..f64::INFINITY).contains(&state.time) {
            return Err(format!("is of the time {} s; allowed: 0 and more", state.time));
        }
        let parts = state.places.as_chunks::<OF_PLACE>().0.iter().zip(state.minds.as_chunks::<OF_MIND>().0);
        let homes = state.home_places.as_chunks::<OF_HOME>().0;
        let mut bodies = state.bodies.as_chunks::<OF_NODE>().0.iter();
        for (number, (((fish, nodes), near), (place, mind))) in
            self.fish.iter().zip(&state.nodes).zip(&state.near).zip(parts).enumerate()
        {
            let kind = &self.kinds[fish.kind as usize];
            let bounds = Bounds::of(fish, kind);
            let refuse = |problem: String| Err(format!("has a fish, {number}, {problem}"));
            if *near > 1 {
                return refuse(format!("whose body is stepped: {near}; allowed: 0 and 1"));
            }
            let habitat = &self.habitats[fish.habitat as usize];
            let at = |from: usize| DVec3::from_slice(&place[from..from + 3]);
            let off = |at: DVec3| at.distance(at.clamp(habitat.low, habitat.high));
            let [course, water] = [0, 4].map(|from| Vec3::from_slice(&mind[from..from + 3]));
            let unit = course.length_squared();
            let lengths = [
                ("is away from its habitat [m]", off(at(0)), FARTHEST),
                ("has its origin away from its habitat [m]", off(at(3)), FARTHEST),
                ("has a body in water of [m/s]", at(6).length(), bounds.water),
                ("is in water of [m/s]", f64::from(water.length()), bounds.water),
            ];
            for (what, is, most) in lengths {
                if !(0.0..=most).contains(&is) {
                    return refuse(format!("that {what} {is}; allowed: 0 to {most}"));
                }
            }
            let (id, home) = (state.homes[number], DVec3::from(homes[number]));
            if id == 0 && home != DVec3::ZERO || id != 0 && !fish.lives_in_anemones(kind) {
                return refuse(format!("with a home that it has not: {id:#x} at {home}"));
            }
            if id != 0 && !(0.0..=FARTHEST).contains(&off(home)) {
                return refuse(format!("whose home is away from its habitat: {home}"));
            }
            if !(1.0 - UNIT..=1.0 + UNIT).contains(&unit) {
                return refuse(format!("with a course of length {}; allowed: 1", unit.sqrt()));
            }
            let turn = bounds.turn;
            let numbers = [
                ("speed", mind[3], [-bounds.speed, bounds.speed]),
                ("phase", mind[7], [0.0, 1.0]),
                ("time as a point", mind[8], [0.0, BLEND]),
                ("bias to its side", mind[9], [-turn, turn]),
                ("bias upward", mind[10], [-turn, turn]),
                ("hunger", mind[11], [0.0, 1.0]),
                ("love", mind[12], [0.0, 1.0]),
                ("fright", mind[13], [0.0, FRIGHT]),
                ("reach", mind[14], bounds.reach),
            ];
            for (name, is, [least, most]) in numbers {
                if !(least..=most).contains(&is) {
                    return refuse(format!("whose {name} is {is}; allowed: {least} to {most}"));
                }
            }
            for (node, from) in bodies.by_ref().take(*nodes as usize).enumerate() {
                let kinds = [
                    ("place", 0, bounds.extent),
                    ("velocity", 3, bounds.velocity),
                    ("way off the gait", 6, bounds.extent),
                ];
                for (name, first, most) in kinds {
                    let is = Vec3::from_slice(&from[first..first + 3]).length();
                    if !(0.0..=most).contains(&is) {
                        return refuse(format!(
                            "whose node {node} has a {name} of {is}; allowed: 0 to {most}"
                        ));
                    }
                }
            }
        }
        Ok(())
    }
}

/// What the numbers of a fish's state are at most.
struct Bounds {
    /// [m/s]
    water: f64,
    speed: f32,
    turn: f32,
    /// Least and greatest.
    reach: [f32; 2],
    /// Of nodes, at the species' own size [m, m/s].
    extent: f32,
    velocity: f32,
}

impl Bounds {
    fn of(fish: &Fish, kind: &Kind) -> Self {
        let (size, length) = (fish.size as f32, kind.length() as f32);
        let water = f64::from(FASTEST_WATER) + f64::from(2.0 * CARRIES * size * length);
        // Bodies are given the water's velocity, and their own on top.
        let speed = 2.0 * water as f32 + FASTEST * size * length;
        Self {
            water: water * (1.0 + ROUNDED),
            speed,
            turn: kind.gait.turn as f32 * (1.0 + ROUNDED as f32),
            reach: [least_reach(kind), kind.range()],
            extent: EXTENT * length,
            velocity: speed / size,
        }
    }
}
