//! How fish follow their wishes: far ones by the gait, near ones by their muscles, and how one goes over into
//! the other.

use glam::{DVec3, Mat3, Vec3};

use reef_sdk::{Chunks, Parts};

use super::{
    BodyId, Fish, Kind, Shoal, Surroundings, Wish,
    decide::{CAUGHT, CROWDED, FRIGHTENED, MATED},
    steer,
    turn::TURNING,
};
use crate::{
    frames::{axes, base},
    gait::{Gait, Moment},
    lanes::WIDTH,
    material::Drive,
    tank::Tank,
};

/// How long a fish that has become a point takes into the gait's pose [s].
pub(super) const BLEND: f32 = 0.5;
/// A body goes over into a point this much farther than where points get bodies.
const SLACK: f64 = 1.15;
/// A body's muscles' bias follows in a share of a beat.
const BIAS: f32 = 0.5;
/// Hunger and love come up in these times [s].
const HUNGRY: f32 = 60.0;
const LONELY: f32 = 120.0;
/// In which time its reach changes in a crowd [s], and to how little at most, in lengths.
const CROWDING: f32 = 2.0;
const NEAREST: f32 = 1.5;
/// Step between two phases by which the gait's velocities are found [beats].
const PHASE: f32 = 1.0 / 64.0;

/// Fish that one job moves.
pub(super) const CHUNK: usize = 256;

impl Shoal {
    /// Moves all fish by what they want.
    pub(super) fn act(&mut self, around: &Surroundings<'_>) {
        let dt = around.dt as f32;
        let (crowd, alone) = (left(dt, CROWDING), 1.0 / left(dt, CROWDING));
        let Self { fish, kinds, grids, firsts, wishes, called, .. } = self;
        let (kinds, grids, firsts, wishes) = (&*kinds, &*grids, &*firsts, &*wishes);
        let split = (Chunks::new(fish, CHUNK), Chunks::new(called, 1));
        around.workers.for_each_part(split, |_, (fish, called)| {
            called[0] = false;
            for fish in fish {
                let number = fish.kind as usize;
                let place = grids[number].place(fish.slot as usize);
                let wish = &wishes[firsts[number] as usize + place];
                feel(fish, &kinds[number], wish, dt, [crowd, alone]);
                fish.water = wish.water;
                fish.called = fish.near || fish.position.distance(around.eye) < around.near;
                if !fish.called {
                    glide(fish, wish, dt);
                }
                called[0] |= fish.called || fish.has_faded();
            }
        });
        self.change(around, dt);
        for number in 0..self.kinds.len() {
            self.swim(number, around, dt);
        }
    }

    /// Points that have come near get bodies, bodies that have gone far become points.
    fn change(&mut self, around: &Surroundings<'_>, dt: f32) {
        self.stepped.iter_mut().for_each(Vec::clear);
        for chunk in 0..self.called.len() {
            if !self.called[chunk] {
                continue;
            }
            let all = chunk * CHUNK..self.fish.len().min((chunk + 1) * CHUNK);
            for at in all {
                let fish = &self.fish[at];
                let kind = fish.kind as usize;
                if !fish.called {
                    if fish.has_faded() {
                        self.pools[kind].give_back(fish.body);
                        self.fish[at].body = BodyId::NONE;
                    }
                    continue;
                }
                if !fish.near {
                    self.embody(at);
                } else if fish.position.distance(around.eye) > around.near * SLACK {
                    self.disembody(at);
                    let fish = &mut self.fish[at];
                    // What it wished for is a body's: in this step it goes on as it does.
                    let beat = self.kinds[kind].gait.beat(f64::from(fish.speed) / fish.size);
                    let beats = beat as f32 * dt;
                    let wish = Wish { way: fish.course, speed: fish.speed, beats, ..Wish::default() };
                    glide(fish, &wish, dt);
                    continue;
                }
                self.stepped[kind].push(at as u32 - self.firsts[kind]);
            }
        }
    }

    /// The bodies of a kind ask their muscles.
    fn swim(&mut self, number: usize, around: &Surroundings<'_>, dt: f32) {
        let Self { fish, kinds, grids, pools, firsts, stepped, orders, swimming, wishes, eights, .. } = self;
        let (kind, grid, tank, stepped) =
            (&kinds[number], &grids[number], &mut pools[number].tank, &stepped[number]);
        if stepped.is_empty() {
            return;
        }
        let first = firsts[number] as usize;
        let (fish, wishes) = (&mut fish[first..first + grid.len()], &wishes[first..]);
        eights.clear();
        eights.extend(stepped.chunks(WIDTH).map(|eight| eight[0] as usize));
        eights[0] = 0;
        eights.push(fish.len());
        let eights = &*eights;
        let of = |part: usize| stepped[part * WIDTH..stepped.len().min((part + 1) * WIDTH)].iter();
        orders.clear();
        orders.resize(stepped.len(), Order::default());
        let split = (Parts::new(fish, eights), Chunks::new(orders, WIDTH));
        around.workers.for_each_part(split, |part, (fish, orders)| {
            for (at, order) in of(part).zip(orders) {
                let fish = &mut fish[*at as usize - eights[part]];
                let wish = &wishes[grid.place(fish.slot as usize)];
                *order = Order { water: wish.water, drive: drive(fish, kind, wish, dt) };
            }
        });
        swimming.clear();
        for (at, order) in stepped.iter().zip(orders) {
            let Some(body) = fish[*at as usize].body.number() else { continue };
            swimming.push(body as u32);
            let swimmer = &mut tank.swimmers_mut()[body];
            (swimmer.water, swimmer.drive) = (order.water.as_dvec3(), order.drive);
        }
        swimming.sort_unstable();
        tank.step(swimming, around.dt, &kind.gait.stepping, around.level, around.workers);
        let tank = &*tank;
        around.workers.for_each_part(Parts::new(fish, eights), |part, fish| {
            for at in of(part) {
                follow(&mut fish[*at as usize - eights[part]], kind, tank, dt);
            }
        });
    }

    /// A point gets a body: in the pose that is shown, with the gait's velocities.
    fn embody(&mut self, at: usize) {
        let fish = &mut self.fish[at];
        let kind = &self.kinds[fish.kind as usize];
        let pool = &mut self.pools[fish.kind as usize];
        if fish.body == BodyId::NONE {
            fish.body = pool.take(fish.size);
            pool.offsets_mut(fish.body).1.fill(Vec3::ZERO);
        }
        let Some(body) = fish.body.number() else { return };
        let pose = Pose::of(fish, &kind.gait);
        let beat = kind.gait.beat(f64::from(fish.speed) / fish.size) as f32;
        let next = Pose::later(fish, &kind.gait, PHASE);
        let carried = (fish.course * fish.speed + fish.water) / fish.size as f32;
        let (positions, velocities, offsets) = pool.body_mut(body);
        for (node, ((x, v), offset)) in positions.iter_mut().zip(velocities).zip(offsets).enumerate() {
            let at = pose.node(node);
            *x = (at + pose.turned(*offset) * pose.fade).to_array();
            *v = (carried + (next.node(node) - at) * (beat / PHASE)).to_array();
        }
        let swimmer = &mut pool.tank.swimmers_mut()[body];
        (swimmer.origin, swimmer.phase) = (fish.position, fish.phase);
        fish.near = true;
    }

    /// A body becomes a point: what its pose is off the gait's is kept, and fades.
    fn disembody(&mut self, at: usize) {
        let fish = &mut self.fish[at];
        let kind = &self.kinds[fish.kind as usize];
        let Some(body) = fish.body.number() else { return };
        let (tank, offsets) = self.pools[fish.kind as usize].offsets_mut(fish.body);
        let swimmer = &tank.swimmers()[body];
        let pose = Pose::of(fish, &kind.gait);
        let origin = ((swimmer.origin - fish.position) / fish.size).as_vec3();
        for (node, (offset, at)) in offsets.iter_mut().zip(tank.positions(body)).enumerate() {
            *offset = pose.turned_back(Vec3::from(*at) + origin - pose.node(node));
        }
        fish.near = false;
        fish.since = 0.0;
    }
}

/// A far fish's pose by its gait, around its centre at the species' size.
#[derive(Clone, Copy)]
pub(super) struct Pose<'a> {
    base: Mat3,
    gait: &'a Gait,
    moment: Moment,
    /// How much of what it was off the gait is left.
    pub(super) fade: f32,
}

impl<'a> Pose<'a> {
    pub(super) fn of(fish: &Fish, gait: &'a Gait) -> Self {
        Self::later(fish, gait, 0.0)
    }

    /// After so many beats more.
    fn later(fish: &Fish, gait: &'a Gait, beats: f32) -> Self {
        let [x, y, z] = base(fish.course, Vec3::Y);
        let left = 1.0 - (fish.since / BLEND).min(1.0);
        Self {
            base: Mat3::from_cols(x, y, z),
            gait,
            moment: gait.moment(fish.phase + beats, fish.speed / fish.size as f32),
            fade: left * left * (3.0 - 2.0 * left),
        }
    }

    pub(super) fn node(&self, node: usize) -> Vec3 {
        self.base * self.gait.node(node, &self.moment)
    }

    pub(super) fn turned(&self, v: Vec3) -> Vec3 {
        self.base * v
    }

    fn turned_back(&self, v: Vec3) -> Vec3 {
        self.base.transpose() * v
    }
}

/// Fright, hunger and love come and go; and in a crowd a fish looks less far, alone farther again: by what is
/// left of its reach in a step then.
fn feel(fish: &mut Fish, kind: &Kind, wish: &Wish, dt: f32, [crowd, alone]: [f32; 2]) {
    let is = |flag: u32| wish.is & flag != 0;
    fish.fright = if is(FRIGHTENED) { steer::FRIGHT } else { (fish.fright - dt).max(0.0) };
    let change = if is(CROWDED) { crowd } else { alone };
    fish.reach = (fish.reach * change).clamp(least_reach(kind), kind.range());
    fish.hunger = match (kind.mind.hunger, is(CAUGHT)) {
        (true, true) => 0.0,
        (true, false) => (fish.hunger + dt / HUNGRY).min(1.0),
        (false, _) => 1.0,
    };
    fish.love = match (kind.mind.mating, is(MATED)) {
        (true, true) => 0.0,
        (true, false) => (fish.love + dt / LONELY).min(1.0),
        (false, _) => 0.0,
    };
}

/// How far a fish takes note of its own kind in a crowd [lengths]: no less than what it keeps from others.
pub(super) fn least_reach(kind: &Kind) -> f32 {
    NEAREST.max(kind.mind.apart as f32).min(kind.range())
}

/// What is left of a lag after `dt` [s] with a time constant [s].
pub(super) fn left(dt: f32, time: f32) -> f32 {
    let power = glam::DVec2::new(-f64::from(dt / time.max(1e-6)), 0.0).exp().x;
    power as f32
}

impl Fish {
    /// It holds a body, and needs none: it is a point, and moves by the gait alone.
    fn has_faded(&self) -> bool {
        !self.near && self.since >= BLEND && self.body != BodyId::NONE
    }
}

/// What a body is asked for.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Order {
    /// Velocity of the water around it [m/s].
    water: Vec3,
    drive: Drive,
}

/// Moves a point: its wish is what it does.
fn glide(fish: &mut Fish, wish: &Wish, dt: f32) {
    (fish.course, fish.speed) = (wish.way, wish.speed);
    fish.phase += wish.beats;
    fish.phase -= fish.phase.floor();
    let velocity = fish.course * fish.speed + fish.water;
    fish.position += velocity.as_dvec3() * f64::from(dt);
    fish.since = (fish.since + dt).min(BLEND);
}

/// What a near fish tells its muscles.
fn drive(fish: &mut Fish, kind: &Kind, wish: &Wish, dt: f32) -> Drive {
    let gait = &kind.gait;
    let beat = gait.top_beat() as f32;
    let [x, y, z] = wish.way.to_array();
    let [cx, cy, cz] = fish.course.to_array();
    // Angle to the left of its course, in the horizontal plane; and how much steeper it wants to swim, as the
    // difference of the sines.
    let aside = glam::Vec2::new(cx, -cz).angle_to(glam::Vec2::new(x, -z));
    let steeper = y - cy;
    let rate = beat / TURNING;
    let most = gait.turn as f32;
    let wanted = [aside * rate / gait.yaw_rate as f32, steeper * rate / gait.pitch_rate as f32];
    let share = 1.0 - left(dt, BIAS / beat);
    for (bias, wanted) in fish.bias.iter_mut().zip(wanted) {
        let wanted = if wanted.is_finite() { wanted.clamp(-most, most) } else { 0.0 };
        *bias += (wanted - *bias) * share;
    }
    let beat = gait.beat(f64::from(wish.speed) / fish.size);
    Drive {
        speed: beat,
        force: gait.force * gait.effort(beat),
        yaw: f64::from(fish.bias[0]),
        pitch: f64::from(fish.bias[1]),
    }
}

/// Takes a near fish's place, course and speed from its body; the beat is smoothed away.
fn follow(fish: &mut Fish, kind: &Kind, tank: &Tank, dt: f32) {
    let Some(body) = fish.body.number() else { return };
    let beat = tank.swimmers()[body].drive.speed as f32;
    fish.phase = tank.swimmers()[body].phase;
    let [forward, ..] = axes(&kind.plan, tank.positions(body));
    let share = 1.0 - left(dt, 0.5 / beat.max(1e-3));
    fish.course = (fish.course + (forward - fish.course) * share).normalize_or(forward);
    fish.position = tank.center(body);
    let through: DVec3 = tank.velocity(body) - fish.water.as_dvec3();
    let speed = through.as_vec3().dot(fish.course);
    fish.speed += (speed - fish.speed) * share;
}
