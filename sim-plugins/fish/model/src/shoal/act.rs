//! How fish follow their wishes: far ones by the gait, near ones by their muscles, and how one goes over into
//! the other.

use glam::{DVec3, Mat3, Vec3};

use super::{Fish, Kind, Shoal, Surroundings, Wish, perceive::NOTED, steer};
use crate::{
    frames::{axes, base},
    gait::Gait,
    material::Drive,
    tank::Tank,
};

/// How long a fish that has become a point takes into the gait's pose [s].
pub(super) const BLEND: f32 = 0.5;
/// A body goes over into a point this much farther than where points get bodies.
const SLACK: f64 = 1.15;
/// In which time a fish would turn all the way to where it wants to go, were it not bounded, in beats at its
/// fastest; and its muscles' bias follows in a share of it.
const TURNING: f32 = 2.0;
const BIAS: f32 = 0.5;
/// In which time its speed follows [s over its top beat].
const SPEEDING: f32 = 3.0;
/// Hunger and love come up in these times [s].
const HUNGRY: f32 = 60.0;
const LONELY: f32 = 120.0;
/// In which time its reach changes in a crowd [s], and to how little at most, in lengths.
const CROWDING: f32 = 2.0;
const NEAREST: f32 = 1.5;
/// Step between two phases by which the gait's velocities are found [beats].
const PHASE: f32 = 1.0 / 64.0;

impl Shoal {
    /// Moves all fish by what they want.
    pub(super) fn act(&mut self, around: &Surroundings<'_>) {
        let dt = around.dt as f32;
        for i in 0..self.wishes.len() {
            let wish = self.wishes[i];
            let number = wish.number as usize;
            let distance = self.fish[number].position.distance(around.eye);
            let near = self.fish[number].near;
            if !near && distance < around.near {
                self.embody(number);
            } else if near && distance > around.near * SLACK {
                self.disembody(number);
            }
            let fish = &mut self.fish[number];
            let kind = &self.kinds[fish.kind as usize];
            let swimmer = &mut self.tanks[fish.kind as usize].swimmers_mut()[fish.slot as usize];
            feel(fish, kind, &wish, dt);
            fish.water = wish.water;
            if fish.near {
                swimmer.water = wish.water.as_dvec3();
                swimmer.drive = drive(fish, kind, &wish, dt);
            } else {
                glide(fish, &kind.gait, &wish, dt);
                let beat = kind.gait.beat(f64::from(fish.speed) / fish.size) as f32;
                swimmer.phase += beat * dt;
                swimmer.phase -= swimmer.phase.floor();
            }
        }
        for ((stepped, first), tank) in self.stepped.iter_mut().zip(&self.firsts).zip(&self.tanks) {
            let first = *first as usize;
            let own = &self.fish[first..first + tank.swimmers().len()];
            stepped.clear();
            stepped.extend(own.iter().filter(|fish| fish.near).map(|fish| fish.slot));
        }
        for ((tank, kind), stepped) in self.tanks.iter_mut().zip(&self.kinds).zip(&self.stepped) {
            tank.step(stepped, around.dt, &kind.gait.stepping, around.level, around.workers);
        }
        for fish in self.fish.iter_mut().filter(|fish| fish.near) {
            let kind = &self.kinds[fish.kind as usize];
            follow(fish, kind, &self.tanks[fish.kind as usize], dt);
        }
    }

    /// A point gets a body: in the pose that is shown, with the gait's velocities.
    fn embody(&mut self, number: usize) {
        let fish = &mut self.fish[number];
        let kind = &self.kinds[fish.kind as usize];
        let tank = &mut self.tanks[fish.kind as usize];
        let slot = fish.slot as usize;
        let nodes = kind.plan.body().nodes().len();
        let offsets = &self.offsets[fish.kind as usize][slot * nodes..(slot + 1) * nodes];
        let phase = tank.swimmers()[slot].phase;
        let pose = Pose::of(fish, phase);
        let beat = kind.gait.beat(f64::from(fish.speed) / fish.size) as f32;
        let next = Pose { phase: phase + PHASE, ..pose };
        let carried = (fish.course * fish.speed + fish.water) / fish.size as f32;
        let (positions, velocities) = tank.nodes_mut(slot);
        for (node, ((x, v), offset)) in positions.iter_mut().zip(velocities).zip(offsets).enumerate() {
            let at = pose.node(&kind.gait, node);
            *x = (at + pose.turned(*offset) * pose.fade).to_array();
            *v = (carried + (next.node(&kind.gait, node) - at) * (beat / PHASE)).to_array();
        }
        tank.swimmers_mut()[slot].origin = fish.position;
        fish.near = true;
    }

    /// A body becomes a point: what its pose is off the gait's is kept, and fades.
    fn disembody(&mut self, number: usize) {
        let fish = &mut self.fish[number];
        let kind = &self.kinds[fish.kind as usize];
        let tank = &self.tanks[fish.kind as usize];
        let slot = fish.slot as usize;
        let nodes = kind.plan.body().nodes().len();
        let offsets = &mut self.offsets[fish.kind as usize][slot * nodes..(slot + 1) * nodes];
        let swimmer = &tank.swimmers()[slot];
        let pose = Pose::of(fish, swimmer.phase);
        let origin = ((swimmer.origin - fish.position) / fish.size).as_vec3();
        for (node, (offset, at)) in offsets.iter_mut().zip(tank.positions(slot)).enumerate() {
            *offset = pose.turned_back(Vec3::from(*at) + origin - pose.node(&kind.gait, node));
        }
        fish.near = false;
        fish.since = 0.0;
    }
}

/// A far fish's pose by its gait, around its centre at the species' size.
#[derive(Clone, Copy)]
pub(super) struct Pose {
    base: Mat3,
    phase: f32,
    /// At the species' size [m/s].
    speed: f32,
    /// How much of what it was off the gait is left.
    pub(super) fade: f32,
}

impl Pose {
    pub(super) fn of(fish: &Fish, phase: f32) -> Self {
        let [x, y, z] = base(fish.course, Vec3::Y);
        let left = 1.0 - (fish.since / BLEND).min(1.0);
        Self {
            base: Mat3::from_cols(x, y, z),
            phase,
            speed: fish.speed / fish.size as f32,
            fade: left * left * (3.0 - 2.0 * left),
        }
    }

    pub(super) fn node(&self, gait: &Gait, node: usize) -> Vec3 {
        self.base * gait.node(node, self.phase, self.speed)
    }

    pub(super) fn turned(&self, v: Vec3) -> Vec3 {
        self.base * v
    }

    fn turned_back(&self, v: Vec3) -> Vec3 {
        self.base.transpose() * v
    }
}

/// Fright, hunger and love come and go; and in a crowd a fish looks less far, alone farther again.
fn feel(fish: &mut Fish, kind: &Kind, wish: &Wish, dt: f32) {
    fish.fright = if wish.frightened { steer::FRIGHT } else { (fish.fright - dt).max(0.0) };
    // No less than what it keeps from others.
    let least = NEAREST.max(kind.mind.apart as f32).min(kind.range());
    let crowded = wish.count > NOTED;
    let change = if crowded { left(dt, CROWDING) } else { 1.0 / left(dt, CROWDING) };
    fish.reach = (fish.reach * change).clamp(least, kind.range());
    fish.hunger = match (kind.mind.hunger, wish.caught) {
        (true, true) => 0.0,
        (true, false) => (fish.hunger + dt / HUNGRY).min(1.0),
        (false, _) => 1.0,
    };
    fish.love = match (kind.mind.mating, wish.mated) {
        (true, true) => 0.0,
        (true, false) => (fish.love + dt / LONELY).min(1.0),
        (false, _) => 0.0,
    };
}

/// What is left of a lag after `dt` [s] with a time constant [s].
fn left(dt: f32, time: f32) -> f32 {
    let power = glam::DVec2::new(-f64::from(dt / time.max(1e-6)), 0.0).exp().x;
    power as f32
}

/// Moves a far fish by its gait: it turns and speeds up no faster than the body does.
fn glide(fish: &mut Fish, gait: &Gait, wish: &Wish, dt: f32) {
    let beat = gait.top_beat() as f32;
    let share = 1.0 - left(dt, SPEEDING / beat);
    fish.speed += (wish.speed - fish.speed) * share;
    let most = gait.fastest_turn() as f32;
    let angle = fish.course.angle_between(wish.way);
    let turned = (angle * beat / TURNING).min(most) * dt;
    if angle > 1e-6 {
        let axis = fish.course.cross(wish.way).try_normalize().unwrap_or(Vec3::Y);
        fish.course = (glam::Quat::from_axis_angle(axis, turned.min(angle)) * fish.course).normalize();
    }
    let velocity = fish.course * fish.speed + wish.water;
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
    let slot = fish.slot as usize;
    let beat = tank.swimmers()[slot].drive.speed as f32;
    let [forward, ..] = axes(&kind.plan, tank.positions(slot));
    let share = 1.0 - left(dt, 0.5 / beat.max(1e-3));
    fish.course = (fish.course + (forward - fish.course) * share).normalize_or(forward);
    fish.position = tank.center(slot);
    let through: DVec3 = tank.velocity(slot) - fish.water.as_dvec3();
    let speed = through.as_vec3().dot(fish.course);
    fish.speed += (speed - fish.speed) * share;
}
