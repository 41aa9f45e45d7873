//! What fish perceive, want and, as points, do, eight fish of a kind at once.

use fearless_simd::{Select, Simd, SimdMask, f32x8, mask32x8, prelude::*};
use glam::{DVec3, Vec3};
use reef_flow::{
    Field, Level, Packed, Sphere,
    simd::{prefetch, splat},
    velocity8,
    waves::Sway,
};

use super::{
    Everybody, FASTEST_WATER, Lodging, NOBODY, Surroundings,
    grid::Grid,
    habits::Habits,
    perceive::{self, Eight, Lists, Others, Sight},
    steer::{self, Own, Whims, Wishes},
    strangers::{Near, Standing},
    turn::Pace,
    walls::{self, Body, Off},
    waves::Sixteens,
};
use crate::lanes::{Lane, Vector, add, at_most, eight_of, load, load3, store3, sub};

/// Side of the cells that share their water and their rocks [m].
const CELL: f32 = 4.0;

/// What a fish makes up its mind to do in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Wish {
    /// Where a body wants to go; the course of a point after the step. Unit.
    pub(super) way: Vec3,
    /// Through the water, in the same sense [m/s].
    pub(super) speed: f32,
    /// Of the water around it, and of that which carries it off what it touches [m/s].
    pub(super) water: Vec3,
    /// By how much of a beat a point goes on.
    pub(super) beats: f32,
    /// Of what follows.
    pub(super) is: u32,
}

/// Something to eat is within its reach, or a mate; it sees who hunts it; there are too many around it.
pub(super) const CAUGHT: u32 = 1;
pub(super) const MATED: u32 = 2;
pub(super) const FRIGHTENED: u32 = 4;
pub(super) const CROWDED: u32 = 8;

/// What all workers share in a step.
pub(super) struct Scene<'a> {
    pub(super) around: &'a Surroundings<'a>,
    pub(super) everybody: Everybody<'a>,
    /// Of each kind that has homes, by slots.
    pub(super) lodgings: &'a [Vec<Lodging>],
    /// Of all kinds.
    pub(super) habits: &'a [Habits],
    pub(super) grids: &'a [Grid],
    pub(super) paces: &'a [Pace],
    /// Number of each kind's first fish.
    pub(super) firsts: &'a [u32],
    /// Corners of habitats, relative to the anchor [m].
    pub(super) boxes: &'a [[Vec3; 2]],
    pub(super) anchor: DVec3,
    pub(super) field: &'a Field,
    pub(super) sway: &'a Sway,
    pub(super) standing: &'a Standing,
    pub(super) whims: Whims,
    /// The highest of the bed [m, world].
    pub(super) bed_top: f64,
    /// Length of the longest fish, and how far the one sees that sees farthest [m].
    pub(super) longest: f64,
    pub(super) farthest: f64,
}

/// Room for one worker: lists, and water and rocks of the cell that it is in.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    lists: Lists,
    own: Own,
    cell: Option<[i32; 3]>,
    water: Packed,
    standing: Near,
    waves: Sixteens,
}

impl Scratch {
    /// Makes room for a step; nothing of an earlier one is left.
    pub(super) fn begin(&mut self, field: &Field, standing: &Standing) {
        self.cell = None;
        self.water.make_room(field);
        self.standing.reserve(standing);
    }

    /// Takes up water and rocks of a cell: what they are depends on the cell alone.
    fn enter(&mut self, cell: [i32; 3], scene: &Scene<'_>) {
        if self.cell == Some(cell) {
            return;
        }
        self.cell = Some(cell);
        let center = scene.anchor + center(cell).as_dvec3();
        let radius = 0.5 * f64::from(CELL) * 3.0_f64.sqrt();
        let bounds = Sphere { center: center.to_array(), radius };
        self.water.fill_near(scene.field, bounds, center.to_array(), NOBODY);
        self.standing.fill(scene.standing, center, radius, [scene.longest, scene.farthest]);
    }
}

/// The middle of a cell, relative to the anchor [m].
fn center(cell: [i32; 3]) -> Vec3 {
    Vec3::from(cell.map(|along| along as f32 * CELL))
}

impl Scene<'_> {
    /// Decides for fish of a kind from a place of its order on.
    pub(super) fn decide(
        &self,
        level: Level,
        scratch: &mut Scratch,
        (kind, first): (usize, usize),
        wishes: &mut [Wish],
    ) {
        let grid = &self.grids[kind];
        let places = first..first + wishes.len();
        let own = grid.slots[places.clone()].iter().zip(&grid.length[places]);
        let fish = |slot: &u32| self.everybody.one((self.firsts[kind] + slot) as usize);
        let own = own.map(|(slot, length)| (fish(slot), f64::from(*length)));
        scratch.waves.feel(self.sway, level, own);
        reef_flow::dispatch!(level, simd => decide(simd, self, scratch, kind, first, wishes));
    }
}

#[inline(always)]
fn decide<S: Simd>(
    simd: S,
    scene: &Scene<'_>,
    scratch: &mut Scratch,
    kind: usize,
    first: usize,
    wishes: &mut [Wish],
) {
    for (eight, wishes) in wishes.chunks_mut(8).enumerate() {
        eight_wishes(simd, scene, scratch, kind, (first, 8 * eight), wishes);
    }
}

#[inline(always)]
fn eight_wishes<S: Simd>(
    simd: S,
    scene: &Scene<'_>,
    scratch: &mut Scratch,
    kind: usize,
    (chunk, within): (usize, usize),
    wishes: &mut [Wish],
) {
    let first = chunk + within;
    let (grid, habits) = (&scene.grids[kind], &scene.habits[kind]);
    let places = first..first + wishes.len();
    let eight = gathered(simd, grid, first, wishes.len());
    let numbers = scene.firsts[kind];
    // Fish are not quite where their places say: those of the next eight are asked for.
    for slot in grid.slots.iter().skip(places.end).take(8) {
        prefetch(core::slice::from_ref(scene.everybody.one((numbers + slot) as usize)));
    }
    let mut bounds = [[Lane::default(); 3]; 2];
    let mut point = Lane::default();
    for lane in 0..8 {
        let at = if lane < places.len() { first + lane } else { first };
        let slot = grid.slots[at];
        let fish = scene.everybody.one((numbers + slot) as usize);
        let own = &mut scratch.own;
        own.seed[lane] = fish.seed;
        own.hunger.0[lane] = fish.hunger;
        own.fright.0[lane] = fish.fright;
        own.reach.0[lane] = fish.reach;
        own.speed.0[lane] = fish.speed;
        point.0[lane] = f32::from(u8::from(!fish.near));
        if habits.home > 0.0 {
            let home = scene.lodgings[kind][slot as usize].place();
            own.has_home.0[lane] = f32::from(u8::from(home.is_some()));
            let home = home.map_or(Vec3::ZERO, |home| (home - fish.position).as_vec3());
            (0..3).for_each(|axis| own.home[axis].0[lane] = home[axis]);
        }
        let corners = &scene.boxes[fish.habitat as usize];
        for (into, corner) in bounds.iter_mut().zip(corners) {
            for axis in 0..3 {
                into[axis].0[lane] = corner[axis];
            }
        }
    }
    let mut sight = look(simd, scene, scratch, kind, &eight);
    let (mut water, off) = stand(simd, scene, scratch, (&eight, &mut sight), habits, places.len());
    if let Some(swell) = swell(simd, scene, scratch, within, places.len()) {
        water = add(water, swell);
    }
    water = at_most(simd, water, splat(simd, FASTEST_WATER));
    let surface = splat(simd, (scene.around.surface - scene.anchor.y) as f32);
    let top = surface - eight.length * splat(simd, 0.5 * habits.height);
    let bounds = [load3(simd, &bounds[0]), load3(simd, &bounds[1])];
    let walls = walls::boxed(simd, eight.at, bounds, top, eight.length);
    let off = [add(off[0], walls[0]), add(off[1], walls[1])];
    let own = &scratch.own;
    let wish = steer::wish(simd, habits, &eight, own, &sight, off, &scene.whims);
    let pace = &scene.paces[kind];
    let point = load(simd, &point).simd_gt(splat(simd, 0.0));
    let is = load(simd, &own.speed);
    let speed = point.select(pace.speed(simd, is, wish.speed), wish.speed);
    let turned = pace.course(simd, eight.course, wish.way);
    let way = crate::lanes::select(point, turned, wish.way);
    let beats = pace.beats(simd, habits, eight.length, speed);
    scatter(&wish, (way, add(wish.push, water)), [speed, beats], wishes);
}

/// What the waves do to eight fish from a place of their chunk on, of whom `count` are there [m/s]; None:
/// there are none.
#[inline(always)]
fn swell<S: Simd>(
    simd: S,
    scene: &Scene<'_>,
    scratch: &Scratch,
    within: usize,
    count: usize,
) -> Option<Vector<S>> {
    if scene.sway.is_still() {
        return None;
    }
    let mut swell = [Lane::default(); 3];
    for lane in 0..count {
        let felt = scratch.waves.of(within + lane);
        (0..3).for_each(|axis| swell[axis].0[lane] = felt[axis]);
    }
    Some(load3(simd, &swell))
}

/// Eight fish from a place on, of whom `count` are there.
#[inline(always)]
pub(super) fn gathered<S: Simd>(simd: S, grid: &Grid, first: usize, count: usize) -> Eight<S> {
    let of = |values: &[f32]| eight_of(simd, &values[first..first + count]);
    let (mut place, mut slot) = (Lane::default(), Lane::default());
    for lane in 0..8 {
        let at = if lane < count { first + lane } else { first };
        place.0[lane] = at as f32;
        slot.0[lane] = grid.slots[at] as f32;
    }
    Eight {
        at: [of(&grid.at[0]), of(&grid.at[1]), of(&grid.at[2])],
        course: [of(&grid.course[0]), of(&grid.course[1]), of(&grid.course[2])],
        length: of(&grid.length),
        place: load(simd, &place),
        slot: load(simd, &slot),
        courts: of(&grid.courts),
    }
}

/// Whom they see.
#[inline(always)]
fn look<S: Simd>(
    simd: S,
    scene: &Scene<'_>,
    scratch: &mut Scratch,
    kind: usize,
    eight: &Eight<S>,
) -> Sight<S> {
    let habits = &scene.habits[kind];
    let mut sight = Sight::none(simd);
    let reach = load(simd, &scratch.own.reach) * eight.length;
    let lists = &mut scratch.lists;
    perceive::own(simd, (&scene.grids[kind], habits), eight, reach, lists, &mut sight);
    for (other, grid) in scene.grids.iter().enumerate() {
        if other != kind && grid.len() > 0 {
            let them = Others {
                habits,
                width: scene.habits[other].width,
                avoids: !habits.at_odds(other as u32),
                same: false,
                before: other < kind,
            };
            perceive::strangers(simd, grid, &them, eight, reach, lists, &mut sight);
        }
    }
    let range = eight.length * splat(simd, habits.range);
    for hunter in &habits.hunters {
        perceive::nearest(simd, &scene.grids[*hunter as usize], eight, range, lists, &mut sight.threat);
    }
    let hungry = load(simd, &scratch.own.hunger).simd_ge(splat(simd, 1.0));
    if !habits.prey.is_empty() && hungry.any_true() {
        for prey in &habits.prey {
            perceive::nearest(simd, &scene.grids[*prey as usize], eight, range, lists, &mut sight.prey);
        }
    }
    sight
}

/// The water around them [m/s], and the way off the bed, rocks and strangers and what those push. Strangers
/// that frighten them come into their sight.
#[inline(always)]
fn stand<S: Simd>(
    simd: S,
    scene: &Scene<'_>,
    scratch: &mut Scratch,
    (eight, sight): (&Eight<S>, &mut Sight<S>),
    habits: &Habits,
    count: usize,
) -> (Vector<S>, [Vector<S>; 2]) {
    let mut water = [splat(simd, 0.0); 3];
    let still = scene.field.flows().is_empty();
    let (around, none) = (scene.around, [Lane::default(); 3]);
    // Whoever frightens somebody is among the obstacles, too.
    let free = scene.standing.obstacles.is_empty();
    if still && free && around.bed.is_none() {
        return (water, [water; 2]);
    }
    let (mut urge, mut push) = (none, none);
    let mut at = none;
    store3(&mut at, eight.at);
    let (mut threat, mut squared) = (none, Lane([f32::INFINITY; 8]));
    if !still || !free {
        let mut done = 0_u64;
        for lane in 0..count {
            if done >> lane & 1 == 1 {
                continue;
            }
            let cell_of = |lane: usize| [0, 1, 2].map(|axis: usize| (at[axis].0[lane] / CELL).round() as i32);
            let cell = cell_of(lane);
            scratch.enter(cell, scene);
            let here = (lane..count).filter(|other| cell_of(*other) == cell);
            let here = here.fold(0, |mask, lane| mask | 1_u64 << lane);
            done |= here;
            if !scratch.water.is_still() {
                let middle = center(cell);
                let middle = [splat(simd, middle.x), splat(simd, middle.y), splat(simd, middle.z)];
                let [x, y, z] = sub(eight.at, middle);
                let moving = velocity8(simd, &scratch.water, x, y, z);
                water = crate::lanes::select(mask32x8::from_bitmask(simd, here), moving, water);
            }
            let near = &scratch.standing;
            if near.obstacles.is_empty() && near.frightening.is_empty() {
                continue;
            }
            for lane in (0..count).filter(|lane| here >> lane & 1 == 1) {
                let body = body(scene, eight, habits, lane);
                let mut off = Off::default();
                for number in &near.obstacles {
                    body.rock(&scene.standing.obstacles[*number as usize], &mut off);
                }
                add_off(&off, lane, [&mut urge, &mut push]);
                let sees = |way: Vec3| perceive::sees(way.dot(body.course), way.length_squared());
                let who = (body.at, body.length as f32);
                if let Some((way, gap)) = near.threat(scene.standing, habits, who, sees) {
                    (0..3).for_each(|axis| threat[axis].0[lane] = way[axis]);
                    squared.0[lane] = gap;
                }
            }
        }
    }
    sight.threat.take(load3(simd, &threat), load(simd, &squared));
    if let Some(bed) = &around.bed {
        for lane in 0..count {
            let body = body(scene, eight, habits, lane);
            if body.at.y - scene.bed_top < body.over() {
                let mut off = Off::default();
                body.bed(bed, &mut off);
                add_off(&off, lane, [&mut urge, &mut push]);
            }
        }
    }
    (water, [load3(simd, &urge), load3(simd, &push)])
}

#[inline(always)]
fn body<S: Simd>(scene: &Scene<'_>, eight: &Eight<S>, habits: &Habits, lane: usize) -> Body {
    let one = |lanes: f32x8<S>| {
        let all: [f32; 8] = lanes.into();
        all[lane]
    };
    let [at, course] = [eight.at, eight.course].map(|[x, y, z]| Vec3::new(one(x), one(y), one(z)));
    let length = f64::from(one(eight.length));
    Body { at: scene.anchor + at.as_dvec3(), course, length, height: f64::from(habits.height) * length }
}

fn add_off(off: &Off, lane: usize, [urge, push]: [&mut [Lane; 3]; 2]) {
    for axis in 0..3 {
        urge[axis].0[lane] += off.urge[axis] as f32;
        push[axis].0[lane] += off.push[axis] as f32;
    }
}

#[inline(always)]
fn scatter<S: Simd>(
    wish: &Wishes<S>,
    (way, water): (Vector<S>, Vector<S>),
    [speed, beats]: [f32x8<S>; 2],
    wishes: &mut [Wish],
) {
    let (mut ways, mut waters) = ([Lane::default(); 3], [Lane::default(); 3]);
    let [speed, beats]: [[f32; 8]; 2] = [speed.into(), beats.into()];
    store3(&mut ways, way);
    store3(&mut waters, water);
    let flags = [
        (wish.caught.to_bitmask(), CAUGHT),
        (wish.mated.to_bitmask(), MATED),
        (wish.frightened.to_bitmask(), FRIGHTENED),
        (wish.crowded.to_bitmask(), CROWDED),
    ];
    for (lane, into) in wishes.iter_mut().enumerate() {
        let of = |lanes: &[Lane; 3]| Vec3::new(lanes[0].0[lane], lanes[1].0[lane], lanes[2].0[lane]);
        let is = flags.iter().filter(|(bits, _)| bits >> lane & 1 == 1).map(|(_, flag)| flag).sum();
        let (speed, beats) = (speed[lane], beats[lane]);
        *into = Wish { way: of(&ways), speed, water: of(&waters), beats, is };
    }
}
