//! Where a fish wants to go, and how fast: Reynolds' (1987) separation, alignment and cohesion, under what
//! Tu and Terzopoulos (1994) put first: not to bump into anything, then fear, hunger and love.

use glam::Vec3;
use reef_flow::random::mix;

use super::{Fish, Kind, perceive::Sight};

/// What a fish makes up its mind to do in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Wish {
    /// Number of the fish.
    pub(super) number: u32,
    /// Unit.
    pub(super) way: Vec3,
    /// Through the water [m/s].
    pub(super) speed: f32,
    /// Of the water around it, and of that which carries it off what it touches [m/s].
    pub(super) water: Vec3,
    /// Something to eat is within its reach, or a mate.
    pub(super) caught: bool,
    pub(super) mated: bool,
    pub(super) frightened: bool,
    /// How many of its own kind it takes note of.
    pub(super) count: u32,
}

/// How far a fish's pitch goes [sine].
const STEEPEST: f32 = 0.5;
/// How fast the water between two that touch carries them apart, in lengths a second.
pub(super) const CARRIES: f32 = 1.0;
/// How long a whim lasts [s].
const WHIM: f64 = 4.0;
/// Weight of fear, hunger and love beside the others.
const FEAR: f32 = 6.0;
const HUNT: f32 = 3.0;
const LOVE: f32 = 1.5;
const HOME: f32 = 3.0;
/// How near a prey or a mate is reached, in lengths.
const REACHED: f32 = 0.6;
/// A fish swims on while it is frightened, after it has lost sight of what frightened it [s].
pub(super) const FRIGHT: f32 = 2.0;

/// Weighs everything up.
pub(super) fn wish(
    kind: &Kind,
    fish: &Fish,
    sight: &Sight,
    [avoid, touch]: [Vec3; 2],
    home: Option<Vec3>,
    time: f64,
) -> Wish {
    let mind = &kind.mind;
    let length = (kind.length() * fish.size) as f32;
    let top = (kind.gait.top_speed() * fish.size) as f32;
    let mut speed = top * mind.cruise as f32;
    let mut urge = fish.course + sight.apart * mind.separation as f32;
    if sight.count > 0 {
        let share = 1.0 / sight.count as f32;
        urge += (sight.courses * share - fish.course) * mind.alignment as f32;
        let middle = sight.ways * share;
        urge += middle * (mind.cohesion as f32 / (0.5 * kind.range() * length));
        // Who is behind the others hurries.
        speed *= (1.0 + 0.3 * middle.dot(fish.course) / (mind.apart as f32 * length)).clamp(0.7, 1.4);
    }
    urge += whim(fish.seed, time) * mind.wander as f32;
    let (mut caught, mut mated) = (false, false);
    if let (Some(prey), true) = (sight.prey, fish.hunger >= 1.0) {
        urge += prey.normalize_or_zero() * HUNT;
        speed = top;
        caught = prey.length() < REACHED * length;
    } else if let Some(mate) = sight.mate {
        urge += mate.normalize_or_zero() * LOVE;
        mated = mate.length() < (REACHED + mind.apart as f32) * length;
    }
    let mut frightened = false;
    if let Some(threat) = sight.threat {
        urge -= threat.normalize_or_zero() * FEAR;
        frightened = true;
    }
    if frightened || fish.fright > 0.0 {
        speed = top;
    }
    if let Some(home) = home {
        let far = home.length() / (mind.home as f32 * length).max(f32::MIN_POSITIVE);
        let strength =
            if frightened || fish.fright > 0.0 { HOME } else { HOME * (far - 0.7).clamp(0.0, 1.5) };
        urge += home.normalize_or_zero() * strength;
        // At home it slows down.
        if far < 1.0 {
            speed *= 0.5 + 0.5 * far;
        }
    }
    speed *= 1.0 - 0.6 * sight.blocked.min(1.0);
    // Whims do not lead into walls.
    urge += avoid;
    let push = (sight.push + touch * 2.0) * (CARRIES * length);
    let mut way = urge.normalize_or(fish.course);
    // What is right behind is turned to by the side.
    if way.dot(fish.course) < -0.9 {
        let aside = fish.course.cross(Vec3::Y).normalize_or(Vec3::Z);
        way = (way + aside * if mix(fish.seed) & 1 == 0 { 1.0 } else { -1.0 }).normalize_or(fish.course);
    }
    way.y = way.y.clamp(-STEEPEST, STEEPEST);
    Wish {
        number: 0,
        way: way.normalize_or(fish.course),
        speed: speed.min(top),
        water: push.clamp_length_max(2.0 * CARRIES * length),
        caught,
        mated,
        frightened,
        count: sight.count,
    }
}

/// A direction that changes smoothly, mostly level: by the fish's seed and the time alone.
fn whim(seed: u64, time: f64) -> Vec3 {
    let at = time / WHIM + (mix(seed) >> 40) as f64 / f64::from(1 << 24);
    let (whole, share) = (at.floor(), (at - at.floor()) as f32);
    let of = |number: f64| {
        let bits = mix(seed ^ mix(number as i64 as u64));
        let signed = |shift: u32| ((bits >> shift) & 0xffff) as f32 / 32_768.0 - 1.0;
        Vec3::new(signed(0), 0.4 * signed(16), signed(32))
    };
    of(whole).lerp(of(whole + 1.0), share * share * (3.0 - 2.0 * share))
}
