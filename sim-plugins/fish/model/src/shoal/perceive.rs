//! What fish perceive of others: those within their range, all around but for the 60 degrees behind them (Tu
//! and Terzopoulos 1994, §5; thesis, chapter 2). Lanes go over eight fish of a kind that are near each other;
//! whom any of them may see is found once for all eight, and each takes those in their order.

use fearless_simd::{Select, Simd, SimdMask, f32x8, mask32x8, prelude::*};
use glam::Vec3;
use reef_flow::simd::{mul_add, neg_mul_add, splat};

use super::{
    grid::{Grid, Run, Runs},
    habits::Habits,
};
use crate::lanes::{Vector, WIDTH, add_scaled, dot, scale, select, sub, sub_scaled};

/// Square of the cosine of the angle from its course beyond which a fish sees nothing: 150 degrees.
const BEHIND2: f32 = 0.75;
/// Within how many widths of both the water between two fish carries them apart.
const CROWDED: f32 = 2.0;
/// A fish keeps from others at least so many of both their widths.
const WIDTHS: f32 = 1.5;
/// A fish keeps off whoever is nearer than a tenth of the way that it keeps as if they were that far.
const STRONGEST: f32 = 10.0;
/// Two nearer than this are in the same place [m].
const SAME: f32 = 1e-6;
/// Of so many of its own kind at most a fish takes note: in a dense shoal it looks less far.
pub(super) const NOTED: f32 = 24.0;
/// Farther than everybody [m²].
const NOBODY: f32 = f32::INFINITY;

/// Eight fish of a kind. Lanes without a fish of their own hold the first.
#[derive(Clone, Copy)]
pub(super) struct Eight<S: Simd> {
    /// Centres [m] and courses.
    pub(super) at: Vector<S>,
    pub(super) course: Vector<S>,
    /// [m]
    pub(super) length: f32x8<S>,
    /// Places in the order of their kind, and slots in it, as numbers.
    pub(super) place: f32x8<S>,
    pub(super) slot: f32x8<S>,
    /// 1 for those that look for a mate.
    pub(super) courts: f32x8<S>,
}

/// Who is nearest.
#[derive(Clone, Copy)]
pub(super) struct Nearest<S: Simd> {
    /// Square of how far that is [m²]; infinite: nobody is there.
    pub(super) squared: f32x8<S>,
    /// The way there [m].
    pub(super) way: Vector<S>,
}

/// What others do to eight fish.
#[derive(Clone, Copy)]
pub(super) struct Sight<S: Simd> {
    /// Away from those that are too near, the more the nearer.
    pub(super) apart: Vector<S>,
    /// Sums over their own kind: courses, ways to them [m], and how many there are.
    pub(super) courses: Vector<S>,
    pub(super) ways: Vector<S>,
    pub(super) count: f32x8<S>,
    /// Who hunts them, whom they hunt, and who is like-minded.
    pub(super) threat: Nearest<S>,
    pub(super) prey: Nearest<S>,
    pub(super) mate: Nearest<S>,
    /// The way that the water between them and their neighbours carries them, 1 where two touch.
    pub(super) push: Vector<S>,
    /// How much is right in front of them, 0..1.
    pub(super) blocked: f32x8<S>,
}

/// Fish that are looked through between two looks at those that are near, and how many are listed at most.
const PART: usize = 128;
const LISTED: usize = 512;

/// Room for one worker: who is near any of eight, and who of those is too near.
#[derive(Clone, Debug)]
pub(super) struct Lists {
    near: [u32; LISTED],
    close: [u32; LISTED],
}

impl Default for Lists {
    fn default() -> Self {
        Self { near: [0; LISTED], close: [0; LISTED] }
    }
}

/// Goes through all fish of a grid within reach of any of eight.
struct Search<'a, S: Simd> {
    grid: &'a Grid,
    runs: Runs<'a>,
    run: Run,
    /// The box around the eight [m], and the square of how far the one looks that looks farthest [m²].
    low: Vector<S>,
    high: Vector<S>,
    farthest2: f32x8<S>,
}

impl<'a, S: Simd> Search<'a, S> {
    /// Of fish within `reach` [m] of any of the eight.
    #[inline(always)]
    fn new(simd: S, grid: &'a Grid, eight: &Eight<S>, reach: f32x8<S>) -> Self {
        let bounds = |lanes: f32x8<S>| {
            let lanes: [f32; 8] = lanes.into();
            lanes[1..].iter().fold((lanes[0], lanes[0]), |(low, high), x| (x.min(low), x.max(high)))
        };
        let farthest = bounds(reach).1;
        let first = Vec3::from(eight.at.map(|at| bounds(at - reach).0));
        let last = Vec3::from(eight.at.map(|at| bounds(at + reach).1));
        Self {
            grid,
            runs: if grid.reaches(first, last) { grid.runs(first, last) } else { grid.no_runs() },
            run: 0..0,
            low: eight.at.map(|at| splat(simd, bounds(at).0)),
            high: eight.at.map(|at| splat(simd, bounds(at).1)),
            farthest2: splat(simd, farthest * farthest),
        }
    }

    /// The next of them, by their places; None: there are no more.
    #[inline(always)]
    fn more(&mut self, simd: S, eight: &Eight<S>, reach2: f32x8<S>, list: &mut [u32; LISTED]) -> usize {
        let mut count = 0;
        while count <= LISTED - PART {
            if self.run.is_empty() {
                match self.runs.next() {
                    Some(run) => self.run = run,
                    None => break,
                }
            }
            let part = self.run.start..self.run.end.min(self.run.start + PART);
            self.run.start = part.end;
            // Behind the last there is room for a vector.
            for first in part.clone().step_by(WIDTH) {
                let mut squared = splat(simd, 0.0);
                for axis in 0..3 {
                    let at = f32x8::from_slice(simd, &self.grid.at[axis][first..first + WIDTH]);
                    let off = (self.low[axis] - at).max(at - self.high[axis]).max(splat(simd, 0.0));
                    squared = mul_add(off, off, squared);
                }
                let mut near = squared.simd_le(self.farthest2).to_bitmask();
                near &= u64::MAX >> (64 - (part.end - first).min(WIDTH));
                while near != 0 {
                    let other = first + near.trailing_zeros() as usize;
                    let way = sub(place_of(simd, self.grid, other), eight.at);
                    list[count] = other as u32;
                    count += usize::from(dot(way, way).simd_le(reach2).any_true());
                    near &= near - 1;
                }
            }
        }
        count
    }
}

/// A fish of a grid, eight times.
#[inline(always)]
fn place_of<S: Simd>(simd: S, grid: &Grid, at: usize) -> Vector<S> {
    [splat(simd, grid.at[0][at]), splat(simd, grid.at[1][at]), splat(simd, grid.at[2][at])]
}

impl<S: Simd> Nearest<S> {
    #[inline(always)]
    fn nobody(simd: S) -> Self {
        Self { squared: splat(simd, NOBODY), way: [splat(simd, 0.0); 3] }
    }

    /// Who is there.
    #[inline(always)]
    pub(super) fn is_there(&self, simd: S) -> mask32x8<S> {
        self.squared.simd_lt(splat(simd, NOBODY))
    }

    #[inline(always)]
    pub(super) fn take(&mut self, way: Vector<S>, squared: f32x8<S>) {
        let nearer = squared.simd_lt(self.squared);
        self.squared = nearer.select(squared, self.squared);
        self.way = select(nearer, way, self.way);
    }

    /// The same of those within a mask.
    #[inline(always)]
    fn take_of(&mut self, simd: S, mask: mask32x8<S>, way: Vector<S>, squared: f32x8<S>) {
        self.take(way, mask.select(squared, splat(simd, NOBODY)));
    }
}

impl<S: Simd> Sight<S> {
    #[inline(always)]
    pub(super) fn none(simd: S) -> Self {
        let zero = splat(simd, 0.0);
        let (none, nobody) = ([zero; 3], Nearest::nobody(simd));
        Self {
            apart: none,
            courses: none,
            ways: none,
            count: zero,
            threat: nobody,
            prey: nobody,
            mate: nobody,
            push: none,
            blocked: zero,
        }
    }
}

/// Whether what is `ahead` along the course and so far off is not behind.
pub(super) fn sees(ahead: f32, squared: f32) -> bool {
    ahead * ahead.abs() + squared * BEHIND2 >= 0.0
}

/// The same for eight.
#[inline(always)]
fn seen<S: Simd>(simd: S, ahead: f32x8<S>, squared: f32x8<S>) -> mask32x8<S> {
    mul_add(ahead, ahead.abs(), squared * splat(simd, BEHIND2)).simd_ge(splat(simd, 0.0))
}

/// Takes note of those of their own kind within `reach` [m].
#[inline(always)]
pub(super) fn own<S: Simd>(
    simd: S,
    (grid, habits): (&Grid, &Habits),
    eight: &Eight<S>,
    reach: f32x8<S>,
    lists: &mut Lists,
    sight: &mut Sight<S>,
) {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let reach2 = reach * reach;
    let close = close(simd, habits, eight, habits.width * grid.longest(), true);
    let close2 = close * close;
    // Each sees itself, too.
    sight.count -= one;
    sight.courses = sub(sight.courses, eight.course);
    let courting = habits.mating && eight.courts.simd_gt(zero).any_true();
    let keeps = keeps(simd, habits, eight);
    let mut search = Search::new(simd, grid, eight, reach);
    loop {
        let Lists { near, close } = &mut *lists;
        let count = search.more(simd, eight, reach2, near);
        if count == 0 {
            break;
        }
        let mut too_near = 0;
        for number in &near[..count] {
            let other = *number as usize;
            let way = sub(place_of(simd, grid, other), eight.at);
            let squared = dot(way, way);
            let here = squared.simd_le(reach2);
            let counts = (here & seen(simd, dot(way, eight.course), squared)).select(one, zero);
            let [x, y, z] = &grid.course;
            let course = [splat(simd, x[other]), splat(simd, y[other]), splat(simd, z[other])];
            sight.count += counts;
            sight.courses = add_scaled(sight.courses, course, counts);
            sight.ways = add_scaled(sight.ways, way, counts);
            close[too_near] = *number;
            too_near += usize::from(squared.simd_lt(close2).any_true());
        }
        let them = Others { habits, width: habits.width, avoids: true, same: true, before: false };
        for number in &close[..too_near] {
            keep_off(simd, grid, &them, eight, reach2, *number as usize, keeps, sight);
        }
        if courting {
            for number in &near[..count] {
                let other = *number as usize;
                let way = sub(place_of(simd, grid, other), eight.at);
                let squared = dot(way, way);
                let odd = |slot: f32x8<S>| slot - splat(simd, 2.0) * (slot * splat(simd, 0.5)).floor();
                // Those of even numbers court those of odd ones.
                let apart = odd(eight.slot).simd_ne(splat(simd, (grid.slots[other] % 2) as f32));
                let courts = (eight.courts * splat(simd, grid.courts[other])).simd_gt(zero);
                let seen = seen(simd, dot(way, eight.course), squared);
                sight.mate.take_of(simd, squared.simd_le(reach2) & seen & apart & courts, way, squared);
            }
        }
    }
}

/// Looks for the nearest of another kind within `range` [m].
#[inline(always)]
pub(super) fn nearest<S: Simd>(
    simd: S,
    grid: &Grid,
    eight: &Eight<S>,
    range: f32x8<S>,
    lists: &mut Lists,
    into: &mut Nearest<S>,
) {
    let range2 = range * range;
    let mut search = Search::new(simd, grid, eight, range);
    loop {
        let count = search.more(simd, eight, range2, &mut lists.near);
        if count == 0 {
            break;
        }
        for number in &lists.near[..count] {
            let way = sub(place_of(simd, grid, *number as usize), eight.at);
            let squared = dot(way, way);
            let seen = seen(simd, dot(way, eight.course), squared);
            into.take_of(simd, squared.simd_le(range2) & seen, way, squared);
        }
    }
}

/// Those that eight fish keep off.
pub(super) struct Others<'a> {
    /// Of the eight.
    pub(super) habits: &'a Habits,
    /// Of the others, in lengths.
    pub(super) width: f32,
    /// They are avoided, and not only not touched.
    pub(super) avoids: bool,
    /// They are of the same kind; else, whether they come before.
    pub(super) same: bool,
    pub(super) before: bool,
}

/// How far off others matter at most that are at most so wide [m].
#[inline(always)]
fn close<S: Simd>(simd: S, habits: &Habits, eight: &Eight<S>, widest: f32, avoids: bool) -> f32x8<S> {
    let touching = mul_add(eight.length, splat(simd, habits.width), splat(simd, widest)) * splat(simd, 0.5);
    let keep = eight.length * splat(simd, if avoids { habits.apart } else { 0.0 });
    keep.max(touching * splat(simd, CROWDED))
}

/// Keeps off another kind.
#[inline(always)]
pub(super) fn strangers<S: Simd>(
    simd: S,
    grid: &Grid,
    them: &Others<'_>,
    eight: &Eight<S>,
    reach: f32x8<S>,
    lists: &mut Lists,
    sight: &mut Sight<S>,
) {
    let reach = close(simd, them.habits, eight, them.width * grid.longest(), them.avoids).min(reach);
    let reach2 = reach * reach;
    let keeps = keeps(simd, them.habits, eight);
    let mut search = Search::new(simd, grid, eight, reach);
    loop {
        let count = search.more(simd, eight, reach2, &mut lists.near);
        if count == 0 {
            break;
        }
        for number in &lists.near[..count] {
            keep_off(simd, grid, them, eight, reach2, *number as usize, keeps, sight);
        }
    }
}

/// How far eight fish keep from others that are not wider [m], and one over it.
#[inline(always)]
fn keeps<S: Simd>(simd: S, habits: &Habits, eight: &Eight<S>) -> (f32x8<S>, f32x8<S>) {
    let keep = eight.length * splat(simd, habits.apart);
    (keep, splat(simd, 1.0) / keep)
}

/// Keeps off one other fish within a reach.
#[inline(always)]
fn keep_off<S: Simd>(
    simd: S,
    grid: &Grid,
    them: &Others<'_>,
    eight: &Eight<S>,
    reach2: f32x8<S>,
    other: usize,
    keeps: (f32x8<S>, f32x8<S>),
    sight: &mut Sight<S>,
) {
    let (zero, one, half) = (splat(simd, 0.0), splat(simd, 1.0), splat(simd, 0.5));
    let way = sub(place_of(simd, grid, other), eight.at);
    let squared = dot(way, way);
    let mut here = squared.simd_le(reach2);
    if them.same {
        here &= eight.place.simd_ne(splat(simd, other as f32));
    }
    let distance = squared.sqrt();
    let inverse = one / distance.max(splat(simd, SAME));
    let toward = scale(way, inverse);
    let wide = splat(simd, them.width * grid.length[other]);
    let touching = mul_add(eight.length, splat(simd, them.habits.width), wide) * half;
    let crowded = touching * splat(simd, CROWDED);
    let pushed = here & distance.simd_lt(crowded);
    if pushed.any_true() {
        let amount = ((crowded - distance) / (crowded - touching)).min(splat(simd, CROWDED));
        let amount = pushed.select(amount, zero);
        // Two in the same place go apart by their numbers.
        let before = if them.same {
            eight.slot.simd_lt(splat(simd, grid.slots[other] as f32)).select(one, -one)
        } else {
            splat(simd, if them.before { -1.0 } else { 1.0 })
        };
        let apart = distance.simd_gt(splat(simd, SAME));
        let aside =
            [apart.select(toward[0], before), apart.select(toward[1], zero), apart.select(toward[2], zero)];
        sight.push = sub_scaled(sight.push, aside, amount);
    }
    if them.avoids {
        let ahead = dot(way, eight.course);
        let (mut keep, mut per) = keeps;
        let wide = touching * splat(simd, WIDTHS);
        if wide.simd_gt(keep).any_true() {
            keep = keep.max(wide);
            per = one / keep;
        }
        let avoided = here & seen(simd, ahead, squared) & distance.simd_lt(keep);
        let strength = (keep * inverse).min(splat(simd, STRONGEST)) - one;
        sight.apart = sub_scaled(sight.apart, toward, avoided.select(strength, zero));
        let blocked = ahead * inverse * neg_mul_add(distance, per, one);
        sight.blocked = sight.blocked.max(avoided.select(blocked, zero));
    }
}
