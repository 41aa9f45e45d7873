//! All boxes of a module, stepped together.
//!
//! A step goes in two waves over fixed chunks of at most 1024 particles: first all centres drift, and each
//! chunk lists which of its particles may be in view; then, when it is known how many sprites there are,
//! those ride on the waves and write their sprites, each chunk into its own part of the stream. Between the
//! two, those who left their box are settled.

mod prepare;
mod state;

use glam::DVec3;
use reef_flow::{
    Field, Level, Packed, Sphere,
    view::View,
    waves::{Choice, Steady, Trains},
};
use reef_sdk::{
    Chunks, Parts, Workers,
    abi::{Billboard, Camera, Flow, Object, Trace, Wave},
};

use crate::{
    config::BoxPlan,
    drift::{self, MOST_MEMBERS, SLOT, SLOTS, Sight, Slots, Tally, WORDS},
    fog::{Fog, Show},
    group::Groups,
    inflow::Water,
    lasting::Lasting,
    levels::Levels,
    looks::Looks,
    reenter::{self, Leavers},
    ride::{self, Follow, Listed, Room, Work},
    seed,
};

pub use state::State;

/// What surrounds the particles in one step.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// All primitives, in the host's order.
    pub flow: &'a [Flow],
    /// All wave trains, greatest first.
    pub waves: &'a [Wave],
    /// Of the water [m].
    pub depth: f64,
    /// Who looks.
    pub camera: &'a Camera,
    /// Length of the step [s]; 0: only emit.
    pub dt: f64,
    /// Number of the step.
    pub step: u64,
    /// Instruction set.
    pub level: Level,
    /// Who shares the work.
    pub workers: Workers<'a>,
    /// All particles are asked for, not only those in view.
    pub trace: bool,
}

/// How many elements a step emits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Sprites, local fog included.
    pub sprites: usize,
    /// Points of the trace, when it is asked for.
    pub trace: usize,
}

/// One box.
#[derive(Clone, Debug)]
struct Swarm {
    plan: BoxPlan,
    looks: Looks,
    fog: Fog,
    /// Middle [m, world] and half extent [m].
    center: DVec3,
    half: DVec3,
    /// The box's extent in 2⁻³² [m].
    unit: [f32; 3],
    /// What uniform currents have moved all centres by, in extents of the box, 0..1.
    turns: [f64; 3],
    /// Its chunks.
    pieces: core::ops::Range<usize>,
    packed: Packed,
    /// Sources and holes that last.
    sources: Packed,
    trains: Trains,
    leavers: Leavers,
    choice: Choice,
    /// How far orbits reach [m]: at the box's bottom, and from there to its top.
    reach: [f64; 2],
    now: Now,
}

/// What holds for a box in the present step.
#[derive(Clone, Copy, Debug, Default)]
struct Now {
    /// More than uniform currents act.
    flowing: bool,
    uniform: [f32; 3],
    /// dt over the extent [s/m].
    turns: [f32; 3],
    half_step: f32,
    /// This step's.
    chance: u64,
    dt: f32,
    still: bool,
    all: bool,
    before: [i32; 3],
    after: [i32; 3],
    sight: Option<Sight>,
    eye: [f32; 3],
    ahead: [f32; 4],
    follow: Option<Follow>,
}

/// A chunk of a box.
#[derive(Clone, Copy, Debug)]
struct Piece {
    swarm: u32,
    /// Number of its first particle in the box.
    first: u64,
    alive: [u16; MOST_MEMBERS],
}

/// All boxes.
#[derive(Clone, Debug)]
pub struct Cloud {
    swarms: Vec<Swarm>,
    pieces: Vec<Piece>,
    members: usize,
    groups: usize,
    /// Offsets of all centres without what all drift alike [2⁻³² of the extent], chunk by chunk.
    at: [Vec<i32>; 3],
    seen: Vec<u16>,
    crossed: Vec<u16>,
    /// What jumped in the last step that had a length, a set a chunk.
    jumped: Vec<[u64; WORDS]>,
    /// Length of that step [s].
    last_dt: f64,
    tallies: Vec<Tally>,
    work: Vec<Work>,
    fog: Vec<Billboard>,
    sprite_bounds: Vec<usize>,
    trace_bounds: Vec<usize>,
    field: Field,
    lasting: Lasting,
    /// What [`Swarm::reach`] was found for.
    reached: Steady,
    /// The step's trains as a box meets them that drifts with its uniform current.
    met: Vec<Wave>,
    /// Whether the step's trains are chosen by distance.
    choosing: bool,
    levels: Levels,
    /// Where each chunk is, when more than uniform currents act on it.
    spheres: Vec<Sphere>,
    /// Of each worker.
    currents: Vec<Packed>,
    scratch: Vec<Scratch>,
}

/// Work on fewer particles than this is done before another worker has woken up.
const FEW: usize = 512;
/// The same where a particle's step is an addition and a look: nothing but uniform currents act.
const FEW_THAT_DRIFT: usize = 8192;

/// What a worker needs for a chunk. What is in it from others changes nothing.
#[derive(Clone, Debug, Default)]
struct Scratch {
    packed: Packed,
    room: Room,
}

/// Where a chunk is that was not looked at.
const UNKNOWN: Sphere = Sphere { center: [0.0; 3], radius: 0.0 };

/// A box with its pictures.
#[derive(Clone, Debug)]
pub struct Dressed {
    /// What it is.
    pub plan: BoxPlan,
    /// What its particles look like.
    pub looks: Looks,
    /// What stands for them from afar.
    pub fog: Fog,
}

impl Cloud {
    /// Fills the boxes. `slaves` follow each master.
    pub fn new(boxes: Vec<Dressed>, slaves: usize) -> Self {
        let members = (slaves + 1).min(MOST_MEMBERS);
        // A power of two: a particle's group and member are bits of its slot. At least a block: 16 members
        // have 64.
        let groups = 1 << (SLOTS / members).ilog2();
        let mut cloud = Self {
            swarms: Vec::new(),
            pieces: Vec::new(),
            members,
            groups,
            at: Default::default(),
            seen: Vec::new(),
            crossed: Vec::new(),
            jumped: Vec::new(),
            last_dt: 0.0,
            tallies: Vec::new(),
            work: Vec::new(),
            fog: Vec::new(),
            sprite_bounds: Vec::new(),
            trace_bounds: Vec::new(),
            field: Field::new(),
            lasting: Lasting::default(),
            reached: Steady::default(),
            met: Vec::new(),
            choosing: false,
            levels: Levels::default(),
            spheres: Vec::new(),
            currents: Vec::new(),
            scratch: Vec::new(),
        };
        for (number, dressed) in (0..).zip(boxes) {
            cloud.add(number, dressed);
        }
        let slots = cloud.pieces.len() * cloud.slots();
        cloud.seen = vec![0; slots];
        cloud.crossed = vec![0; slots];
        cloud.tallies = vec![Tally::default(); cloud.pieces.len()];
        cloud.work = vec![Work::default(); cloud.pieces.len()];
        cloud.spheres = vec![UNKNOWN; cloud.pieces.len()];
        cloud.jumped = vec![[0; WORDS]; cloud.pieces.len()];
        let cells = cloud.swarms.iter().map(|swarm| swarm.fog.cells()).sum();
        cloud.fog.reserve(cells);
        cloud
    }

    fn add(&mut self, number: u32, Dressed { plan, looks, fog }: Dressed) {
        let count = u64::from(plan.count);
        let places: Vec<[i32; 3]> = match plan.grid {
            Some(grid) => (0..count).map(|i| seed::grid_place(grid, i)).collect(),
            None => {
                let mut places: Vec<_> = (0..count).map(|i| seed::place(plan.seed, i)).collect();
                let groups = Groups {
                    extent: plan.extent,
                    members: self.members,
                    chunk: self.groups,
                    range: plan.follow,
                    seed: plan.seed,
                };
                groups.form(&mut places);
                places
            }
        };
        let first_piece = self.pieces.len();
        let slots = self.slots();
        for first in (0..count).step_by(slots) {
            let alive = reenter::alive(count - first, self.members, self.groups);
            self.pieces.push(Piece { swarm: number, first, alive });
        }
        let first_slot = first_piece * slots;
        for (axis, at) in self.at.iter_mut().enumerate() {
            at.resize(self.pieces.len() * slots, 0);
            for (i, place) in places.iter().enumerate() {
                at[first_slot + slot_of(i, self.members, self.groups)] = place[axis];
            }
        }
        self.swarms.push(Swarm {
            center: DVec3::from(plan.center),
            half: 0.5 * DVec3::from(plan.extent),
            unit: plan.extent.map(|e| (e / 4_294_967_296.0) as f32),
            turns: [0.0; 3],
            pieces: first_piece..self.pieces.len(),
            packed: Packed::new(),
            sources: Packed::new(),
            trains: Trains::new(),
            leavers: Leavers::new(plan.extent, 64 + plan.count as usize / 8),
            choice: Choice::default(),
            reach: [0.0; 2],
            now: Now::default(),
            plan,
            looks,
            fog,
        });
    }

    /// Slots of a chunk: particles, where it is full.
    fn slots(&self) -> usize {
        self.groups * self.members
    }

    /// Boxes.
    pub fn box_count(&self) -> usize {
        self.swarms.len()
    }

    /// Particles of a box.
    pub fn particles(&self, number: usize) -> usize {
        self.swarms.get(number).map_or(0, |swarm| swarm.plan.count as usize)
    }

    /// A box as it was planned.
    pub fn plan(&self, number: usize) -> Option<&BoxPlan> {
        self.swarms.get(number).map(|swarm| &swarm.plan)
    }

    /// The centre P₀ of a particle's orbit, relative to the middle of its box [m]: within half of its extent.
    pub fn center(&self, number: usize, particle: usize) -> Option<DVec3> {
        let swarm = self.swarms.get(number).filter(|swarm| particle < swarm.plan.count as usize)?;
        let slot = swarm.pieces.start * self.slots() + slot_of(particle, self.members, self.groups);
        let now = whole(swarm.turns);
        let along = |axis: usize| {
            let offset = self.at[axis].get(slot)?.wrapping_add(now[axis]);
            Some(f64::from(offset) / 4_294_967_296.0 * swarm.plan.extent[axis])
        };
        Some(DVec3::new(along(0)?, along(1)?, along(2)?))
    }

    /// One object a box.
    pub fn objects(&self) -> impl Iterator<Item = Object> + '_ {
        (0..).zip(&self.swarms).map(|(number, swarm)| Object {
            id: id_of(number),
            origin: swarm.plan.center,
            bounds_radius: (swarm.half.length() + swarm.reach[1] + swarm.plan.size[1]) as f32,
            ..Object::default()
        })
    }

    /// Lets all centres drift, and says how much there is to emit.
    pub fn advance(&mut self, around: &Surroundings<'_>, levels: &Levels) -> Counts {
        self.levels = *levels;
        self.prepare(around);
        self.drift(around);
        if around.dt > 0.0 {
            self.settle(around);
        }
        self.show_fog(around);
        self.sprite_bounds.clear();
        self.sprite_bounds.push(0);
        let mut sprites = 0;
        for tally in &self.tallies {
            sprites += tally.in_view as usize;
            self.sprite_bounds.push(sprites);
        }
        self.trace_bounds.clear();
        self.trace_bounds.push(0);
        let mut trace = 0;
        for piece in &self.pieces {
            if around.trace {
                trace += piece.alive.iter().map(|count| usize::from(*count)).sum::<usize>();
            }
            self.trace_bounds.push(trace);
        }
        Counts { sprites: sprites + self.fog.len(), trace }
    }

    fn drift(&mut self, around: &Surroundings<'_>) {
        let slots = self.slots();
        let (members, groups) = (self.members, self.groups);
        let workers = around.workers.count();
        if self.scratch.len() < workers {
            self.scratch.resize_with(workers, Scratch::default);
            self.currents.resize_with(workers, Packed::new);
        }
        // Who has which chunk is a matter of chance: one who has had none yet must not need memory then.
        let scratch = self.scratch.iter_mut().map(|scratch| &mut scratch.packed);
        scratch.chain(&mut self.currents).for_each(|packed| packed.make_room(&self.field));
        let Self {
            swarms,
            pieces,
            at: [x, y, z],
            seen,
            crossed,
            jumped,
            tallies,
            field,
            currents,
            spheres,
            ..
        } = self;
        let (swarms, pieces, field) = (&*swarms, &*pieces, &*field);
        let few = pieces.len() * slots <= FEW_THAT_DRIFT && swarms.iter().all(|swarm| !swarm.now.flowing);
        let workers = if few { Workers::inline() } else { around.workers };
        let split = (
            Chunks::new(x, slots),
            Chunks::new(y, slots),
            Chunks::new(z, slots),
            Chunks::new(seen, slots),
            Chunks::new(crossed, slots),
            Chunks::new(jumped, 1),
            Chunks::new(tallies, 1),
            Chunks::new(spheres, 1),
        );
        workers.for_each_part_with(currents, split, |packed, i, part| {
            let (x, y, z, seen, crossed, jumped, tally, sphere) = part;
            let piece = &pieces[i];
            let Some(swarm) = swarms.get(piece.swarm as usize) else { return };
            let now = &swarm.now;
            let idle = !now.flowing && now.sight.is_none() && !now.all;
            // Neighbours in the water are in one chunk: few of the sea's primitives reach them.
            let near = now.flowing.then(|| {
                // A step without length finds everything as the last one left it.
                if !now.still || sphere[0] == UNKNOWN {
                    sphere[0] = swarm.around([&*x, &*y, &*z], &piece.alive[..members], groups);
                }
                fill(packed, field, sphere[0], &swarm.plan, id_of(piece.swarm));
                &*packed
            });
            if idle && !now.still {
                jumped[0] = [0; WORDS];
            }
            let jumped = &mut jumped[0];
            let turn = (around.step + i as u64).is_multiple_of(drift::LOOK_STEPS);
            let slots = Slots {
                at: [x, y, z],
                seen,
                crossed,
                jumped,
                alive: &piece.alive,
                members,
                groups,
                first: piece.first,
                turn,
            };
            tally[0] =
                if idle { Tally::default() } else { drift::drift(around.level, &swarm.drift(near), slots) };
        });
    }

    /// Those who left their box, and those whose water vanished.
    fn settle(&mut self, around: &Surroundings<'_>) {
        let slots = self.slots();
        let Self { swarms, at, crossed, jumped, tallies, members, groups, .. } = self;
        for swarm in swarms {
            if !swarm.packed.is_singular() {
                continue;
            }
            swarm.leavers.clear();
            swarm.leavers.make_room(swarm.sources.source_count());
            for piece in swarm.pieces.clone() {
                let left = &crossed[piece * slots..][..tallies[piece].crossed as usize];
                for entry in left {
                    let slot = (piece - swarm.pieces.start) * slots + usize::from(entry & SLOT);
                    swarm.leavers.push(slot as u32, entry >> drift::AXIS_SHIFT);
                }
            }
            if swarm.leavers.is_empty() {
                continue;
            }
            let (first, last) = (swarm.pieces.start * slots, swarm.pieces.end * slots);
            let mut own = at.each_mut().map(|axis| &mut axis[first..last]).into_iter();
            let (Some(x), Some(y), Some(z)) = (own.next(), own.next(), own.next()) else { continue };
            let mut chunks = reenter::Chunks {
                at: [x, y, z],
                slots,
                members: *members,
                groups: *groups,
                now: swarm.now.after,
                count: u64::from(swarm.plan.count),
                range: swarm.plan.follow,
                jumped: &mut jumped[swarm.pieces.clone()],
            };
            let water = Water {
                packed: &swarm.packed,
                sources: &swarm.sources,
                unit: swarm.unit,
                dt: swarm.now.dt,
                level: around.level,
            };
            swarm.leavers.settle(&water, &mut chunks, swarm.now.chance);
        }
    }

    fn show_fog(&mut self, around: &Surroundings<'_>) {
        self.fog.clear();
        if !self.levels.fog {
            return;
        }
        let view = View::new(around.camera, self.levels.margin);
        for (object, swarm) in (0_u32..).zip(&mut self.swarms) {
            let reach = swarm.reach[1];
            let nearest = view.box_distance(swarm.center, swarm.half);
            let farthest = ((swarm.center - view.eye).abs() + swarm.half).length();
            let begin = f64::from(self.levels.fog_band().from);
            let seen = nearest <= self.levels.visibility && farthest >= begin;
            if !seen {
                continue;
            }
            let top = (swarm.center.y + swarm.half.y) as f32;
            let trains = if self.choosing { swarm.choice.count(top, begin as f32) } else { usize::MAX };
            let show = Show {
                view: &view,
                levels: &self.levels,
                trains: &swarm.trains,
                count: trains,
                center: swarm.center,
                reach,
                object,
                level: around.level,
            };
            swarm.fog.show(&show, &mut self.fog);
        }
    }

    /// Writes what [`Cloud::advance`] counted.
    pub fn emit(&mut self, around: &Surroundings<'_>, sprites: &mut [Billboard], trace: &mut [Trace]) {
        let slots = self.slots();
        let listed: usize = self.tallies.iter().map(|tally| tally.seen as usize).sum();
        let workers = if listed < FEW { Workers::inline() } else { around.workers };
        let singles = self.sprite_bounds.last().copied().unwrap_or(0).min(sprites.len());
        let (singles, fog) = sprites.split_at_mut(singles);
        for (sprite, cell) in fog.iter_mut().zip(&self.fog) {
            *sprite = *cell;
        }
        let (members, groups, levels) = (self.members, self.groups, self.levels);
        let choosing = self.choosing;
        let Self {
            swarms,
            pieces,
            at,
            seen,
            jumped,
            tallies,
            field,
            spheres,
            scratch,
            sprite_bounds,
            trace_bounds,
            work,
            ..
        } = self;
        let (field, spheres, jumped) = (&*field, &*spheres, &*jumped);
        let (swarms, pieces, seen, tallies) = (&*swarms, &*pieces, &*seen, &*tallies);
        let at = at.each_ref().map(|axis| axis.as_slice());
        let split =
            (Parts::new(singles, sprite_bounds), Parts::new(trace, trace_bounds), Chunks::new(work, 1));
        workers.for_each_part_with(scratch, split, |scratch, i, (sprites, trace, work)| {
            work[0] = Work::default();
            let piece = &pieces[i];
            let Some(swarm) = swarms.get(piece.swarm as usize) else { return };
            if tallies[i].seen == 0 {
                return;
            }
            let first = i * slots;
            let listed = Listed {
                at: at.map(|axis| &axis[first..first + slots]),
                seen: &seen[first..first + tallies[i].seen as usize],
                jumped: &jumped[i],
                members,
                groups,
                first: piece.first,
            };
            let Scratch { packed, room } = scratch;
            let near = swarm.now.flowing.then(|| {
                fill(packed, field, spheres[i], &swarm.plan, id_of(piece.swarm));
                &*packed
            });
            let ride = swarm.ride(piece.swarm, &levels, choosing, near);
            work[0] = ride::ride(around.level, &ride, &listed, room, sprites, trace);
        });
    }

    /// Orbits that the last step computed, and the wave trains in all of them.
    pub fn work(&self) -> [u64; 2] {
        let sum = |of: fn(&Work) -> u32| self.work.iter().map(|work| u64::from(of(work))).sum();
        [sum(|work| work.orbits), sum(|work| work.trains)]
    }
}

/// The object that a box is, by its number.
fn id_of(number: u32) -> u64 {
    u64::from(number) + 1
}

/// Packs the water in a part of a box, the object `id`, as it is there for all of its particles: without what
/// moves with the box itself.
fn fill(packed: &mut Packed, field: &Field, part: Sphere, plan: &BoxPlan, id: u64) {
    packed.fill_near(field, part, plan.center, id);
    packed.fit(plan.extent);
}

/// Where in its box's slots a particle is.
fn slot_of(particle: usize, members: usize, groups: usize) -> usize {
    let slots = members * groups;
    let (chunk, rest) = (particle / slots, particle % slots);
    chunk * slots + (rest % members) * groups + rest / members
}

/// A share of the extent in 2⁻³² of it.
fn whole(turns: [f64; 3]) -> [i32; 3] {
    // A share is in 0..1; what rounds to 1 is 0 once around.
    turns.map(|turns| (turns * 4_294_967_296.0).round() as u64 as u32 as i32)
}
