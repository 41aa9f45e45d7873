//! What a later step depends on, as plain numbers.

use glam::{DVec3, Vec3};
use reef_sdk::{StateError, StateReader, StateWriter};

use super::{
    BodyId, FASTEST_WATER, Fish, Home, Kind, Pool, Shoal,
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
    /// Centres: three numbers a fish [m, world].
    pub places: Vec<f64>,
    /// Course, speed, water, phase, time since it is a point, two biases, hunger, love, fright, reach:
    /// fifteen.
    pub minds: Vec<f32>,
    /// Each a point (0), a body that is stepped (1), or a point whose pose still fades into the gait's (2).
    pub near: Vec<u8>,
    /// Origin of its nodes, and water that it felt, of each body that is stepped: six numbers [m, m/s].
    pub origins: Vec<f64>,
    /// Of bodies that are stepped position and velocity of each node: six numbers [m, m/s]. Of points that
    /// fade what each node is off the gait: three [m].
    pub bodies: Vec<f32>,
    /// Ids of the anemones that they live in; 0: none.
    pub homes: Vec<u64>,
    /// Where those are: three numbers a fish [m, world].
    pub home_places: Vec<f64>,
}

const OF_PLACE: usize = 3;
const OF_MIND: usize = 15;
const OF_ORIGIN: usize = 6;
/// Numbers of a node, by what its fish is.
const OF_NODE: [usize; 3] = [0, 6, 3];
/// What a fish is.
const POINT: u8 = 0;
const BODY: u8 = 1;
const FADING: u8 = 2;
/// Where `since` stands among the numbers of `minds`.
const SINCE: usize = 8;
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
    /// Into the plugin's state, version 2.
    pub fn write(&self, state: &mut StateWriter) {
        state.put_one("time", self.time);
        state.put("nodes", &self.nodes);
        state.put("places", &self.places);
        state.put("minds", &self.minds);
        state.put("near", &self.near);
        state.put("origins", &self.origins);
        state.put("bodies", &self.bodies);
        state.put("homes", &self.homes);
        state.put("home_places", &self.home_places);
    }

    /// Out of it. Version 1 held a body for each fish.
    ///
    /// # Errors
    /// Something is missing, of another type, or, in version 1, not as many numbers as its fish need.
    pub fn read(state: &mut StateReader) -> Result<Self, StateError> {
        let nodes: Vec<u32> = state.get("nodes")?;
        // Older states know of no homes.
        let (homes, home_places) = if state.has("homes") {
            (state.get("homes")?, state.get("home_places")?)
        } else {
            (vec![0; nodes.len()], vec![0.0; OF_HOME * nodes.len()])
        };
        let saved = Self {
            time: state.get_one("time")?,
            nodes,
            places: state.get("places")?,
            minds: state.get("minds")?,
            near: state.get("near")?,
            origins: if state.version() > 1 { state.get("origins")? } else { Vec::new() },
            bodies: state.get("bodies")?,
            homes,
            home_places,
        };
        if state.version() > 1 { Ok(saved) } else { saved.without_idle_bodies() }
    }

    /// Of version 1, which had for each fish the origin and the water of a body beside its centre, and for
    /// each node position, velocity, and what it is off the gait.
    fn without_idle_bodies(mut self) -> Result<Self, StateError> {
        let refused = |name: &str| {
            Err(StateError::Refused(format!("the saved state has not as many `{name}` as its fish need")))
        };
        let nodes = self.nodes.iter().map(|count| *count as usize).sum::<usize>();
        let (places, rest) = self.places.as_chunks::<{ OF_PLACE + OF_ORIGIN }>();
        if places.len() != self.nodes.len() || !rest.is_empty() {
            return refused("places");
        }
        let (minds, rest) = self.minds.as_chunks::<OF_MIND>();
        if minds.len() != self.nodes.len() || !rest.is_empty() {
            return refused("minds");
        }
        if self.near.len() != self.nodes.len() {
            return refused("near");
        }
        // Which points fade was in their times alone.
        if let Some((number, near)) = self.near.iter().enumerate().find(|(_, near)| **near > BODY) {
            return Err(StateError::Refused(format!(
                "the saved state has a fish, {number}, that is {near}; allowed in version 1: 0 and 1"
            )));
        }
        let (bodies, rest) = self.bodies.as_chunks::<9>();
        if bodies.len() != nodes || !rest.is_empty() {
            return refused("bodies");
        }
        let (mut centres, mut kept, mut bodies) = (Vec::new(), Vec::new(), bodies.iter());
        for ((place, mind), (near, count)) in
            places.iter().zip(minds).zip(self.near.iter_mut().zip(&self.nodes))
        {
            let (centre, origin) = place.split_at(OF_PLACE);
            centres.extend_from_slice(centre);
            if *near == POINT && mind[SINCE] < BLEND {
                *near = FADING;
            }
            if *near == BODY {
                self.origins.extend_from_slice(origin);
            }
            for node in bodies.by_ref().take(*count as usize) {
                match *near {
                    BODY => kept.extend_from_slice(&node[..6]),
                    FADING => kept.extend_from_slice(&node[6..]),
                    _ => {}
                }
            }
        }
        (self.places, self.bodies) = (centres, kept);
        Ok(self)
    }
}

impl Shoal {
    /// The present state.
    pub fn save(&self) -> State {
        let mut state = State { time: self.time, ..State::default() };
        for (number, fish) in self.fish().iter().enumerate() {
            let pool = &self.pools[fish.kind as usize];
            state.nodes.push(self.kinds[fish.kind as usize].plan.body().nodes().len() as u32);
            let home = self.lodging(number).and_then(|lodging| lodging.home);
            state.homes.push(home.map_or(0, |home| home.id));
            state.home_places.extend(home.map_or([0.0; OF_HOME], |home| home.place.to_array()));
            state.places.extend(fish.position.to_array());
            state.minds.extend(fish.course.to_array());
            state.minds.push(fish.speed);
            state.minds.extend(fish.water.to_array());
            state.minds.extend([fish.phase, fish.since]);
            state.minds.extend(fish.bias);
            state.minds.extend([fish.hunger, fish.love, fish.fright, fish.reach]);
            let fades = !fish.near && fish.since < BLEND;
            let Some(body) = fish.body.number().filter(|_| fish.near || fades) else {
                state.near.push(POINT);
                continue;
            };
            state.near.push(if fish.near { BODY } else { FADING });
            if fades {
                state.bodies.extend(pool.offsets(fish.body).iter().flat_map(|offset| offset.to_array()));
                continue;
            }
            let swimmer = &pool.tank.swimmers()[body];
            state.origins.extend(swimmer.origin.to_array());
            state.origins.extend(swimmer.water.to_array());
            for (x, v) in pool.tank.positions(body).iter().zip(pool.tank.velocities(body)) {
                state.bodies.extend(x.iter().chain(v));
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
        let nodes: Vec<u32> = self.fish().iter().map(own).collect();
        if state.nodes != nodes {
            return Err(format!(
                "is of {} fish with other bodies; here are {}",
                state.nodes.len(),
                nodes.len()
            ));
        }
        if let Some((number, near)) = state.near.iter().enumerate().find(|(_, near)| **near > FADING) {
            return Err(format!("has a fish, {number}, that is {near}; allowed: 0, 1 and 2"));
        }
        let each = nodes.iter().zip(&state.near);
        let all: usize = each.map(|(count, near)| *count as usize * OF_NODE[*near as usize]).sum();
        let stepped = state.near.iter().filter(|near| **near == BODY).count();
        let lengths = [
            ("places", state.places.len(), OF_PLACE * nodes.len()),
            ("minds", state.minds.len(), OF_MIND * nodes.len()),
            ("near", state.near.len(), nodes.len()),
            ("origins", state.origins.len(), OF_ORIGIN * stepped),
            ("bodies", state.bodies.len(), all),
            ("homes", state.homes.len(), nodes.len()),
            ("home_places", state.home_places.len(), OF_HOME * nodes.len()),
        ];
        if let Some((name, is, must)) = lengths.iter().find(|(_, is, must)| is != must) {
            return Err(format!("`{name}` has {is} numbers in place of {must}"));
        }
        self.check(state)?;
        let mut bodies = state.bodies.as_chunks::<3>().0.iter();
        let mut origins = state.origins.as_chunks::<OF_ORIGIN>().0.iter();
        self.time = state.time;
        self.pools.iter_mut().for_each(Pool::clear);
        let parts = state.places.as_chunks::<OF_PLACE>().0.iter().zip(state.minds.as_chunks::<OF_MIND>().0);
        let homes = state.homes.iter().zip(state.home_places.as_chunks::<OF_HOME>().0);
        for (number, (id, place)) in homes.enumerate() {
            let fish = self.one(number);
            let (kind, slot) = (fish.kind as usize, fish.slot as usize);
            if let Some(lodging) = self.lodgings[kind].get_mut(slot) {
                lodging.home = (*id != 0).then(|| Home { id: *id, place: (*place).into() });
            }
        }
        for ((at, near), (place, mind)) in self.kept.iter().zip(&state.near).zip(parts) {
            let fish = &mut self.fish[*at as usize];
            fish.near = *near == BODY;
            fish.position = DVec3::from_slice(&place[..3]);
            fish.course = Vec3::from_slice(&mind[..3]);
            fish.speed = mind[3];
            fish.water = Vec3::from_slice(&mind[4..7]);
            fish.since = mind[SINCE];
            fish.bias = [mind[9], mind[10]];
            [fish.hunger, fish.love, fish.fright, fish.reach] = [mind[11], mind[12], mind[13], mind[14]];
            fish.phase = mind[7];
            fish.body = BodyId::NONE;
            if *near == POINT {
                continue;
            }
            let pool = &mut self.pools[fish.kind as usize];
            fish.body = pool.take(fish.size);
            let Some(body) = fish.body.number() else { continue };
            if *near == FADING {
                let (_, offsets) = pool.offsets_mut(fish.body);
                offsets.iter_mut().zip(bodies.by_ref()).for_each(|(offset, from)| *offset = (*from).into());
                continue;
            }
            let swimmer = &mut pool.tank.swimmers_mut()[body];
            swimmer.phase = fish.phase;
            if let Some(origin) = origins.next() {
                swimmer.origin = DVec3::from_slice(&origin[..3]);
                swimmer.water = DVec3::from_slice(&origin[3..]);
            }
            let (positions, velocities, _) = pool.body_mut(body);
            for (x, v) in positions.iter_mut().zip(velocities) {
                for into in [x, v] {
                    into.copy_from_slice(bodies.next().unwrap_or(&[0.0; 3]));
                }
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
        let mut bodies = state.bodies.as_chunks::<3>().0.iter();
        let mut origins = state.origins.as_chunks::<OF_ORIGIN>().0.iter();
        for (number, (((fish, nodes), near), (place, mind))) in
            self.fish().iter().zip(&state.nodes).zip(&state.near).zip(parts).enumerate()
        {
            let kind = &self.kinds[fish.kind as usize];
            let bounds = Bounds::of(fish, kind);
            let refuse = |problem: String| Err(format!("has a fish, {number}, {problem}"));
            let faded = mind[SINCE] >= BLEND;
            if *near == POINT && !faded || *near == FADING && faded {
                return refuse(format!("that is {near} after {} s as a point", mind[SINCE]));
            }
            let habitat = &self.habitats[fish.habitat as usize];
            let origin = if *near == BODY { origins.next() } else { None };
            let off = |at: DVec3| at.distance(at.clamp(habitat.low, habitat.high));
            let [course, water] = [0, 4].map(|from| Vec3::from_slice(&mind[from..from + 3]));
            let unit = course.length_squared();
            let lengths = [
                ("is away from its habitat [m]", off(DVec3::from_slice(place)), FARTHEST),
                ("is in water of [m/s]", f64::from(water.length()), bounds.water),
            ];
            let of_body = origin.map(|origin| {
                let [at, felt] = [0, 3].map(|from| DVec3::from_slice(&origin[from..from + 3]));
                let reach = fish.size * f64::from(bounds.extent);
                [
                    ("has its origin away from its place [m]", at.distance(DVec3::from_slice(place)), reach),
                    ("has a body in water of [m/s]", felt.length(), bounds.water),
                ]
            });
            let lengths = lengths.into_iter().chain(of_body.into_iter().flatten());
            for (what, is, most) in lengths {
                if !(0.0..=most).contains(&is) {
                    return refuse(format!("that {what} {is}; allowed: 0 to {most}"));
                }
            }
            let (id, home) = (state.homes[number], DVec3::from(homes[number]));
            if id == 0 && home != DVec3::ZERO
                || id != 0 && !self.lodging(number).is_some_and(|lodging| lodging.is_in_anemones(kind))
            {
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
                ("time as a point", mind[SINCE], [0.0, BLEND]),
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
            let kinds: &[_] = match *near {
                BODY => &[("place", bounds.extent), ("velocity", bounds.velocity)],
                FADING => &[("way off the gait", bounds.extent)],
                _ => &[],
            };
            for node in 0..*nodes {
                for ((name, most), from) in kinds.iter().zip(bodies.by_ref()) {
                    let is = Vec3::from(*from).length();
                    if !(0.0..=*most).contains(&is) {
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
