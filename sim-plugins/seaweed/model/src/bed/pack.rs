//! Eight plants of one species that stand near one another: what they are, and their part of a step.

use glam::{DQuat, DVec3, Quat};
use reef_flow::{
    random::Random,
    view::View,
    waves::{Choice, Trains},
};
use reef_sdk::abi::Wave;

use super::{
    CATCH_UP, Group, Kind, Pass, Plant, Room, Spacing, Stand, Surroundings, Work, catch_up_end, cell::Cell,
    flows, spacing,
};
use crate::{
    kernel::{self, Row},
    lanes::{Lane, WIDTH},
    levels::{Levels, toward, upright_distance},
    skeleton::STATIONS,
    water::Water,
};

/// Nobody.
pub(super) const EMPTY: u32 = u32::MAX;

/// Eight plants.
#[derive(Clone, Debug)]
pub(super) struct Pack {
    kind: u32,
    cell: u32,
    pub(super) numbers: [u32; WIDTH],
    pub(super) stand: Stand,
    /// The turn of each plant's base: x, y, z, w.
    pub(super) turn: [Lane; 4],
    /// How long each has not been stepped [s]; [`NEVER`]: it has not been yet.
    pub(super) paused: [f32; WIDTH],
    /// Bit by bit: who was stepped in the last step, and who made up for others in it.
    stepped: u8,
    jumped: u8,
    /// No step has come yet.
    pub(super) fresh: bool,
    /// Φ of each one's source in the last step [m³/s]; 0: it is none.
    pub(super) strength: [f32; WIDTH],
    /// No part of each comes farther from its root than this [m].
    reach: [f32; WIDTH],
    /// No part of any comes higher than this over the anchor [m].
    highest: f32,
    /// No plant in here is larger, see [`size_class`].
    largest: f64,
    /// How far up they reach, see [`spacing::band`].
    band: usize,
    work: Work,
}

/// What a worker needs for a pack. What is in it from others changes nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    room: Room,
    trains: Trains,
}

impl Scratch {
    /// Makes room for the longest plant and all trains, so that no step needs memory later.
    pub(super) fn fit(&mut self, segments: usize, trains: usize) {
        self.room.fit(segments);
        self.trains.make_room(trains);
    }
}

/// What is around a pack in one step.
#[derive(Clone, Copy)]
pub(super) struct Sea<'a> {
    pub(super) around: &'a Surroundings<'a>,
    pub(super) levels: &'a Levels,
    pub(super) view: &'a View,
    pub(super) cell: &'a Cell,
    pub(super) kind: &'a Kind,
    pub(super) choice: &'a Choice,
    pub(super) spacing: &'a Spacing,
    /// No water is raised higher by the waves that they feel [m].
    pub(super) raised: f32,
    /// The trains some time ago.
    pub(super) before: &'a [Vec<Wave>],
}

impl Pack {
    pub(super) fn new(
        group: &Group,
        cell: usize,
        numbers: &[u32],
        plants: &[&Plant],
        anchor: DVec3,
        what: &Kind,
        rows: &mut [Row],
    ) -> Self {
        let mut stand = Stand { size: Lane::all(1.0), stiff: Lane::all(1.0), ..Stand::default() };
        stand.x[0] = Lane::all(1.0);
        stand.y[1] = Lane::all(1.0);
        stand.normal[1] = Lane::all(1.0);
        stand.ground = Lane::all(NO_GROUND);
        let mut turn = Quat::IDENTITY.to_array().map(Lane::all);
        let mut all = [EMPTY; WIDTH];
        let mut reach = [0.0; WIDTH];
        let mut highest = f32::MIN;
        for (lane, (number, plant)) in numbers.iter().zip(plants).enumerate() {
            all[lane] = *number;
            reach[lane] = (what.skeleton.reach() * plant.size) as f32;
            let base = set(&mut stand, lane, plant, anchor).as_quat().normalize().to_array();
            highest = highest.max(stand.origin[1].0[lane] + reach[lane]);
            turn.iter_mut().zip(base).for_each(|(lanes, value)| lanes.0[lane] = value);
            let mut random = Random::new(plant.seed, 0x5ea7);
            for (row, segment) in rows.iter_mut().zip(what.skeleton.segments()) {
                let mut rest = |angle: f64| (angle + plant.bend * random.signed()) as f32;
                let [theta, phi] = [rest(segment.theta), rest(segment.phi)];
                (row.theta.0[lane], row.theta_rest.0[lane]) = (theta, theta);
                (row.phi.0[lane], row.phi_rest.0[lane]) = (phi, phi);
            }
        }
        Self {
            kind: group.kind as u32,
            cell: cell as u32,
            numbers: all,
            stand,
            turn,
            paused: [0.0; WIDTH],
            stepped: 0,
            jumped: 0,
            fresh: true,
            strength: [0.0; WIDTH],
            reach,
            highest,
            largest: group.size as f64 * CLASS,
            band: group.band,
            work: Work::default(),
        }
    }

    pub(super) fn kind(&self) -> usize {
        self.kind as usize
    }

    pub(super) fn cell(&self) -> usize {
        self.cell as usize
    }

    /// Plants in here.
    pub(super) fn lanes(&self) -> impl Iterator<Item = (usize, u32)> + use<'_> {
        self.numbers.iter().copied().enumerate().filter(|(_, number)| *number != EMPTY)
    }

    pub(super) fn work(&self) -> Work {
        self.work
    }

    pub(super) fn detail(&self, lane: usize) -> [f32; 2] {
        [self.stand.detail.0[lane], self.stand.lagged.0[lane]]
    }

    pub(super) fn stepped(&self, lane: usize) -> bool {
        self.stepped >> lane & 1 != 0
    }

    pub(super) fn jumped(&self, lane: usize) -> bool {
        self.jumped >> lane & 1 != 0
    }

    /// No part of a plant comes farther from its root than this [m].
    pub(super) fn reach(&self, lane: usize) -> f32 {
        self.reach[lane]
    }

    /// Half of the diagonal of the box around a plant's joints [m].
    pub(super) fn half_box(&self, lane: usize) -> f32 {
        let size = [0, 1, 2].map(|i| self.stand.high[i].0[lane] - self.stand.low[i].0[lane]);
        (0.5 * (size[0] * size[0] + size[1] * size[1] + size[2] * size[2]).sqrt()).max(0.05)
    }

    /// Centre of gravity, its velocity and acceleration.
    pub(super) fn gravity(&self, lane: usize, anchor: DVec3) -> [DVec3; 3] {
        let of = |lanes: &[Lane; 3]| DVec3::from([0, 1, 2].map(|i| f64::from(lanes[i].0[lane])));
        [anchor + of(&self.stand.gravity), of(&self.stand.drift), of(&self.stand.push)]
    }

    pub(super) fn step(&mut self, sea: &Sea<'_>, rows: &mut [Row], scratch: &mut Scratch) {
        let dt = sea.around.dt as f32;
        let mut steps = [0.0; WIDTH];
        (self.stepped, self.jumped) = (0, 0);
        self.strength = [0.0; WIDTH];
        self.work = Work::default();
        let (fresh, mut late) = (core::mem::take(&mut self.fresh), false);
        for (lane, steps) in steps.iter_mut().enumerate() {
            if self.numbers[lane] == EMPTY {
                continue;
            }
            let [x, y, z] = [0, 1, 2].map(|i| f64::from(self.stand.origin[i].0[lane]));
            let root = sea.cell.anchor() + DVec3::new(x, y, z);
            let reach = f64::from(self.reach[lane]);
            let in_view = sea.cell.visible && (!sea.levels.visible || sea.view.sees_ball(root, reach));
            if !in_view {
                self.paused[lane] = if fresh { NEVER } else { self.paused[lane] + dt };
                continue;
            }
            *steps = dt;
            self.stepped |= 1 << lane;
            // What is large is seen from far away: its distance counts in its own lengths.
            let distance = match sea.levels.segments {
                true => upright_distance(sea.view.eye, root, reach) / (reach / USUAL).max(1.0),
                false => 0.0,
            };
            let wanted = sea.levels.wanted(distance);
            let [detail, lagged] = [&mut self.stand.detail.0[lane], &mut self.stand.lagged.0[lane]];
            if fresh && wanted[0] > 0.0 {
                // What its level does not compute would stay as it grew, whatever the water does.
                self.paused[lane] = NEVER;
            }
            if fresh || self.paused[lane] > 0.0 {
                // Nobody saw what it was before.
                [*detail, *lagged] = wanted;
                // Before the first step there is no picture that it could jump from.
                self.jumped |= u8::from(!fresh) << lane;
                late |= self.paused[lane] > 0.0;
            } else {
                let pace = sea.levels.pace(sea.around.dt);
                *detail = toward(*detail, wanted[0], pace);
                *lagged = toward(*lagged, wanted[1], pace);
            }
            self.count(sea.kind, lane);
        }
        if self.stepped == 0 {
            return;
        }
        if late {
            self.catch_up(sea, rows, scratch, &steps);
        }
        let pass = self.pass(sea, &sea.cell.trains, Lane(steps));
        kernel::step(sea.around.level, &pass, &mut self.stand, rows, &mut scratch.room);
        for lane in 0..WIDTH {
            // What made up for steps did not move, and far away nobody sees what it disturbs.
            if self.stepped(lane) && !self.jumped(lane) && self.detail(lane)[0] < 2.0 {
                self.strength[lane] = flows::strength(self, sea.kind, lane);
            }
        }
    }

    /// Adds what a plant's step takes.
    fn count(&mut self, kind: &Kind, lane: usize) {
        let detail = self.stand.detail.0[lane];
        let level = if detail < 1.0 { 0 } else { u8::from(detail >= 2.0) + 1 };
        self.work.joints += kind.skeleton.computed(level) as u64;
        self.work.evaluations += kind.skeleton.evaluated(level) as u64;
        self.work.plants += 1;
    }

    /// Lets those that come into view make up for the steps since they left it: the last few seconds of them,
    /// in a few long ones, in the waves of these times. Who has never been stepped does so with all segments.
    fn catch_up(&mut self, sea: &Sea<'_>, rows: &mut [Row], scratch: &mut Scratch, steps: &[f32; WIDTH]) {
        let (detail, lagged) = (self.stand.detail, self.stand.lagged);
        for lane in (0..WIDTH).filter(|lane| steps[*lane] > 0.0 && self.paused[*lane] >= NEVER) {
            [self.stand.detail.0[lane], self.stand.lagged.0[lane]] = sea.levels.wanted(0.0);
        }
        let anchor = sea.cell.anchor().to_array();
        for (i, waves) in sea.before.iter().enumerate() {
            let (begin, end) = (CATCH_UP[i] as f32, catch_up_end(i) as f32);
            let mut long = self.paused.map(|paused| (paused.min(begin) - end).max(0.0));
            for (long, step) in long.iter_mut().zip(steps) {
                *long = if *step > 0.0 { *long } else { 0.0 };
            }
            if long == [0.0; WIDTH] {
                continue;
            }
            if sea.levels.waves > 0.0 {
                scratch.trains.fill(waves, sea.around.depth, anchor);
            } else {
                scratch.trains.fill(&[], sea.around.depth, anchor);
            }
            let pass = self.pass(sea, &scratch.trains, Lane(long));
            kernel::step(sea.around.level, &pass, &mut self.stand, rows, &mut scratch.room);
        }
        for (paused, step) in self.paused.iter_mut().zip(steps) {
            *paused = if *step > 0.0 { 0.0 } else { *paused };
        }
        (self.stand.detail, self.stand.lagged) = (detail, lagged);
    }

    fn pass<'a>(&self, sea: &Sea<'a>, trains: &'a Trains, dt: Lane) -> Pass<'a> {
        let anchor = sea.cell.anchor();
        let highest = self.highest + anchor.y as f32 + sea.raised;
        // A plant may bend up, or toward the eye, out of its cell.
        let reach = sea.kind.skeleton.reach() * self.largest;
        let top = (anchor.y + 0.5 * super::cell::SIZE + reach).min(spacing::top(self.band));
        let distance = (sea.cell.distance(sea.view.eye) - reach).max(0.0);
        let count = sea.choice.count(top as f32, distance as f32);
        let farthest = f64::from(sea.spacing.farthest(self.band, count)) / self.largest;
        Pass {
            joints: &sea.kind.skeleton.joints,
            water: Water { currents: &sea.cell.currents, trains, count, share: sea.levels.waves as f32 },
            level: anchor.y as f32,
            capsules: &sea.cell.capsules,
            dt,
            lag: sea.kind.lag as f32,
            contact: sea.levels.contact as f32,
            deep: highest < -2.0 * kernel::SKIN,
            stations: STATIONS.iter().position(|apart| *apart <= farthest).filter(|_| !trains.is_empty()),
        }
    }
}

/// The size that waves are chosen and evaluated with for a plant, in halves: one and a half for most of them,
/// the next half for larger ones.
pub(super) fn size_class(plant: &Plant) -> u64 {
    (plant.size / CLASS).max(3.0).ceil() as u64
}

/// Between two classes of size.
const CLASS: f64 = 0.5;

/// Plants that are larger than this [m] count as so much nearer.
const USUAL: f64 = 2.0;

/// Longer than anything goes on [s].
const NEVER: f32 = f32::MAX;

/// Lower than anything.
const NO_GROUND: f32 = -1e30;

/// Puts a plant on its place; returns how its base is turned.
fn set(stand: &mut Stand, lane: usize, plant: &Plant, anchor: DVec3) -> DQuat {
    let up = plant.up.normalize_or(DVec3::Y);
    let turn = DQuat::from_rotation_arc(DVec3::Y, up) * DQuat::from_rotation_y(plant.yaw);
    let put = |lanes: &mut [Lane; 3], value: DVec3| {
        for (into, value) in lanes.iter_mut().zip(value.to_array()) {
            into.0[lane] = value as f32;
        }
    };
    put(&mut stand.origin, plant.root - anchor);
    put(&mut stand.x, turn * DVec3::X);
    put(&mut stand.y, turn * DVec3::Y);
    put(&mut stand.gravity, plant.root - anchor);
    put(&mut stand.low, plant.root - anchor);
    put(&mut stand.high, plant.root - anchor);
    stand.size.0[lane] = plant.size as f32;
    stand.stiff.0[lane] = plant.stiff as f32;
    if let Some(normal) = plant.ground {
        put(&mut stand.normal, normal);
        stand.ground.0[lane] = normal.dot(plant.root - anchor) as f32;
    }
    turn
}
