//! Where fish want to go, and how fast: Reynolds' (1987) separation, alignment and cohesion, under what Tu
//! and Terzopoulos (1994) put first: not to bump into anything, then fear, hunger and love. Eight fish at
//! once.

use fearless_simd::{Select, Simd, f32x8, mask32x8, prelude::*};
use reef_flow::{
    random::mix,
    simd::{clamp, mul_add, splat},
};

use super::{
    habits::Habits,
    perceive::{Eight, NOTED, Sight},
};
use crate::lanes::{Lane, Vector, add, add_scaled, at_most, dot, load, load3, scale, select, sub, unit_or};

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
/// How far from home, over how far it leaves it, a fish begins to turn back; and how strongly at most.
const HOMESICK: f32 = 0.7;
const MOST_HOMESICK: f32 = 1.5;
/// Who is behind the others hurries, who is ahead of them takes its time: shares of its speed.
const HURRY: f32 = 0.3;
const HURRIES: [f32; 2] = [0.7, 1.4];
/// By which share a fish slows down when its way is blocked.
const BRAKES: f32 = 0.6;
/// How much more than other fish walls push.
const WALL: f32 = 2.0;
/// What is farther from a fish's course than this cosine is turned to by the side.
const ABOUT: f32 = -0.9;
/// How near a prey or a mate is reached, in lengths.
const REACHED: f32 = 0.6;
/// A fish swims on while it is frightened, after it has lost sight of what frightened it [s].
pub(super) const FRIGHT: f32 = 2.0;

/// What eight fish know of themselves.
#[derive(Clone, Debug, Default)]
pub(super) struct Own {
    pub(super) seed: [u64; 8],
    /// Places of homes relative to the fish [m], and 1 for those that have one.
    pub(super) home: [Lane; 3],
    pub(super) has_home: Lane,
    pub(super) hunger: Lane,
    pub(super) fright: Lane,
    /// How far they take note of their own kind, in lengths.
    pub(super) reach: Lane,
    /// Through the water [m/s].
    pub(super) speed: Lane,
}

/// What eight fish make up their minds to do.
#[derive(Clone, Copy)]
pub(super) struct Wishes<S: Simd> {
    /// Unit.
    pub(super) way: Vector<S>,
    /// Through the water [m/s].
    pub(super) speed: f32x8<S>,
    /// Of the water that carries them off what they touch [m/s].
    pub(super) push: Vector<S>,
    /// Something to eat is within reach, or a mate.
    pub(super) caught: mask32x8<S>,
    pub(super) mated: mask32x8<S>,
    pub(super) frightened: mask32x8<S>,
    /// They see more of their own kind than they take note of.
    pub(super) crowded: mask32x8<S>,
}

/// Weighs everything up. `avoid` and `touch`: the way off what stands around, and what it pushes.
#[inline(always)]
pub(super) fn wish<S: Simd>(
    simd: S,
    habits: &Habits,
    eight: &Eight<S>,
    own: &Own,
    sight: &Sight<S>,
    [avoid, touch]: [Vector<S>; 2],
    whims: &Whims,
) -> Wishes<S> {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let none = [zero; 3];
    let (length, course) = (eight.length, eight.course);
    let top = length * splat(simd, habits.top);
    let mut speed = top * splat(simd, habits.cruise);
    let mut urge = add_scaled(course, sight.apart, splat(simd, habits.separation));
    let share = sight.count.simd_gt(zero).select(one / sight.count.max(one), zero);
    let middle = scale(sight.ways, share);
    let aligned = sight.count.simd_gt(zero).select(splat(simd, habits.alignment), zero);
    urge = add_scaled(urge, sub(scale(sight.courses, share), course), aligned);
    let cohesion = splat(simd, habits.cohesion) / (length * splat(simd, 0.5 * habits.range));
    urge = add_scaled(urge, middle, cohesion);
    let behind = dot(middle, course) / (length * splat(simd, habits.apart));
    let hurry = mul_add(behind, splat(simd, HURRY), one);
    speed *= clamp(hurry, splat(simd, HURRIES[0]), splat(simd, HURRIES[1]));
    urge = add_scaled(urge, whims.of(simd, &own.seed), splat(simd, habits.wander));

    let prey = sight.prey.is_there(simd) & load(simd, &own.hunger).simd_ge(one);
    let mate = sight.mate.is_there(simd) & !prey;
    let threat = sight.threat.is_there(simd);
    urge = add_scaled(urge, unit_or(simd, sight.prey.way, none), prey.select(splat(simd, HUNT), zero));
    urge = add_scaled(urge, unit_or(simd, sight.mate.way, none), mate.select(splat(simd, LOVE), zero));
    urge = add_scaled(urge, unit_or(simd, sight.threat.way, none), threat.select(splat(simd, -FEAR), zero));
    let within = |squared: f32x8<S>, lengths: f32| {
        let reach = length * splat(simd, lengths);
        squared.simd_lt(reach * reach)
    };
    let caught = prey & within(sight.prey.squared, REACHED);
    let mated = mate & within(sight.mate.squared, REACHED + habits.apart);
    let afraid = threat | load(simd, &own.fright).simd_gt(zero);
    speed = (prey | afraid).select(top, speed);
    if habits.home > 0.0 {
        let (home, has_home) = (load3(simd, &own.home), load(simd, &own.has_home).simd_gt(zero));
        let leaves = (length * splat(simd, habits.home)).max(splat(simd, f32::MIN_POSITIVE));
        let far = dot(home, home).sqrt() / leaves;
        let sick = clamp(far - splat(simd, HOMESICK), zero, splat(simd, MOST_HOMESICK));
        let strength = splat(simd, HOME) * has_home.select(afraid.select(one, sick), zero);
        urge = add_scaled(urge, unit_or(simd, home, none), strength);
        // At home it slows down.
        let slow = mul_add(far.min(one), splat(simd, 0.5), splat(simd, 0.5));
        speed *= has_home.select(slow, one);
    }
    speed *= one - splat(simd, BRAKES) * sight.blocked.min(one);
    // Whims do not lead into walls.
    urge = add(urge, avoid);
    let carries = length * splat(simd, CARRIES);
    let push = scale(add_scaled(sight.push, touch, splat(simd, WALL)), carries);
    Wishes {
        way: level(simd, around(simd, unit_or(simd, urge, course), course, &own.seed), course),
        speed: speed.min(top),
        push: at_most(simd, push, carries * splat(simd, 2.0)),
        caught,
        mated,
        frightened: threat,
        crowded: sight.count.simd_gt(splat(simd, NOTED)),
    }
}

/// A way to the side for what is right behind: to which one, each fish's seed says.
#[inline(always)]
fn around<S: Simd>(simd: S, way: Vector<S>, course: Vector<S>, seeds: &[u64; 8]) -> Vector<S> {
    let about = dot(way, course).simd_lt(splat(simd, ABOUT));
    if !about.any_true() {
        return way;
    }
    let mut sides = Lane::default();
    for (side, seed) in sides.0.iter_mut().zip(seeds) {
        *side = if mix(*seed) & 1 == 0 { 1.0 } else { -1.0 };
    }
    let turned = unit_or(simd, add_scaled(way, aside(simd, course), load(simd, &sides)), course);
    select(about, turned, way)
}

/// The level direction across a course, unit.
#[inline(always)]
pub(super) fn aside<S: Simd>(simd: S, [x, _, z]: Vector<S>) -> Vector<S> {
    let zero = splat(simd, 0.0);
    unit_or(simd, [-z, zero, x], [zero, zero, splat(simd, 1.0)])
}

/// No steeper than fish swim.
#[inline(always)]
fn level<S: Simd>(simd: S, way: Vector<S>, course: Vector<S>) -> Vector<S> {
    let y = clamp(way[1], splat(simd, -STEEPEST), splat(simd, STEEPEST));
    unit_or(simd, [way[0], y, way[2]], course)
}

/// What fish wander by at a time: directions that change smoothly, mostly level, each fish's own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Whims {
    /// Share of the present whim of a fish whose whims begin with time, and hashes of its number and the next
    /// two.
    share: f64,
    hashes: [u64; 3],
}

impl Whims {
    /// At a time [s].
    pub(super) fn at(time: f64) -> Self {
        let at = time / WHIM;
        let whole = at.floor();
        Self { share: at - whole, hashes: [0.0, 1.0, 2.0].map(|next| mix((whole + next) as i64 as u64)) }
    }

    #[inline(always)]
    fn of<S: Simd>(&self, simd: S, seeds: &[u64; 8]) -> Vector<S> {
        let (mut from, mut to) = ([Lane::default(); 3], [Lane::default(); 3]);
        let mut share = Lane::default();
        for (lane, seed) in seeds.iter().copied().enumerate() {
            let at = self.share + (mix(seed) >> 40) as f64 / f64::from(1 << 24);
            let later = usize::from(at >= 1.0);
            share.0[lane] = (at - later as f64) as f32;
            for (into, hash) in [(&mut from, self.hashes[later]), (&mut to, self.hashes[later + 1])] {
                let bits = mix(seed ^ hash);
                for (axis, into) in into.iter_mut().enumerate() {
                    into.0[lane] = ((bits >> (16 * axis)) & 0xffff) as f32;
                }
            }
        }
        let share = load(simd, &share);
        let smooth = share * share * (splat(simd, 3.0) - splat(simd, 2.0) * share);
        let (from, to) = (load3(simd, &from), load3(simd, &to));
        let mut whim = add_scaled(from, sub(to, from), smooth);
        for (axis, along) in whim.iter_mut().enumerate() {
            let signed = *along * splat(simd, 1.0 / 32_768.0) - splat(simd, 1.0);
            *along = if axis == 1 { signed * splat(simd, LEVEL) } else { signed };
        }
        whim
    }
}

/// Whims are mostly level.
const LEVEL: f32 = 0.4;
