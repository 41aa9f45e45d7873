//! Particles on the waves, eq. (2), and what is shown of them.
//!
//! Each particle that may be in view rides on its own orbit, unless it is a slave beyond D_m: then it is carried as its
//! master is (§3.3.3). Between the two it goes over from one to the other smoothly. Who follows at all, be it in part, is
//! d_pmin … d_pmax from its master: one that the currents took elsewhere rides by itself, and so do the slaves of a master
//! that is about to leave the box: on the other side the wave has another phase.

use fearless_simd::{Simd, f32x8, f32x16};
use reef_flow::{
    Level, Packed,
    simd::{Lanes, mul_add},
    velocity,
    waves::{Trains, orbit},
};
use reef_sdk::abi::{self, Billboard, Trace};

use crate::{
    drift::{BLOCK, IN_VIEW, SLOT, SLOTS, WORDS, bounded},
    levels::{Band, Choice},
    looks::Looks,
};

/// Nobody rides for this one: a rider that never moves.
const NOBODY: u16 = SLOTS as u16;
/// Greatest velocity of a sprite [m/s].
const FASTEST: f32 = 1e4;

/// What a box's particles ride with in one step.
#[derive(Clone, Copy, Debug)]
pub struct Ride<'a> {
    /// The sea's velocity over the box; None: the same everywhere.
    pub packed: Option<&'a Packed>,
    /// What it then is [m/s].
    pub uniform: [f32; 3],
    /// The wave trains.
    pub trains: &'a Trains,
    /// How many of them matter; None: all.
    pub choice: Option<&'a Choice>,
    /// World height of the box's middle [m].
    pub level: f32,
    /// What all centres have drifted alike [2⁻³² of the extent].
    pub now: [i32; 3],
    /// The box's extent in 2⁻³² [m].
    pub unit: [f32; 3],
    /// Half of the box's extent [m].
    pub half: [f32; 3],
    /// Who looks, relative to the box's middle [m].
    pub eye: [f32; 3],
    /// The plane through the eye across its view: normal, and height over the box's middle [m].
    pub ahead: [f32; 4],
    /// How slaves follow; None: they do not.
    pub follow: Option<Follow>,
    /// Where single particles fade; each None: nowhere.
    pub fades: Fades,
    /// Half of the last step's dt that had a length [s].
    pub half_step: f32,
    /// What they look like.
    pub looks: &'a Looks,
    /// Factor on their diameter.
    pub size: f32,
    /// Opacity of each.
    pub opacity: f32,
    /// Number of the box in the stream of objects.
    pub object: u32,
    /// The box's middle [m, world].
    pub center: [f64; 3],
}

/// Where single particles fade.
#[derive(Clone, Copy, Debug)]
pub struct Fades {
    /// Before the eye.
    pub near: Band,
    /// Where the local fog takes over.
    pub fog: Option<Band>,
    /// At the end of visibility.
    pub end: Band,
}

/// When a slave follows its master.
#[derive(Clone, Copy, Debug)]
pub struct Follow {
    /// Beyond D_m.
    pub distance: Band,
    /// Nearer to the master than this it rides by itself: d_pmin.
    pub least: Band,
    /// And farther than this: d_pmax.
    pub most: Band,
    /// The master's distance from the walls.
    pub wall: Band,
}

/// A chunk's particles that are looked at.
#[derive(Clone, Copy, Debug)]
pub struct Listed<'a> {
    /// Offsets of all centres of the chunk.
    pub at: [&'a [i32]; 3],
    /// Entries of the list.
    pub seen: &'a [u16],
    /// The set of slots that jumped.
    pub jumped: &'a [u64; WORDS],
    /// Members of a group.
    pub members: usize,
    /// Groups of a chunk: a power of two.
    pub groups: usize,
    /// Number of the chunk's first particle in its box.
    pub first: u64,
}

/// Room for one chunk's work. What is in it from other chunks changes nothing.
#[derive(Clone, Debug)]
pub struct Room {
    p: [Vec<f32>; 3],
    master: [Vec<f32>; 3],
    drift: [Vec<f32>; 3],
    distance: Vec<f32>,
    /// z²/d: a length is shown as in the picture's middle at this distance.
    shown: Vec<f32>,
    alpha: Vec<f32>,
    follow: Vec<f32>,
    own: Vec<u16>,
    leader: Vec<u16>,
    /// Who rides for each group's slaves.
    leaders: Vec<u16>,
    /// Those who ride: centre, and the least distances of those whom they carry.
    q: [Vec<f32>; 3],
    nearest: Vec<f32>,
    least_shown: Vec<f32>,
    /// How many trains matter for each, and their order: those for whom most do first.
    trains: Vec<u16>,
    order: Vec<u16>,
    /// How many riders each number of trains matters for.
    starts: Vec<u16>,
    displacement: [Vec<f32>; 3],
    speed: [Vec<f32>; 3],
}

/// What a chunk's ride took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Orbits that were computed.
    pub orbits: u32,
    /// Wave trains in all of them.
    pub trains: u32,
}

impl Default for Room {
    fn default() -> Self {
        let one = || vec![0.0; SLOTS];
        let three = || core::array::from_fn(|_| one());
        Self {
            p: three(),
            master: three(),
            drift: three(),
            distance: one(),
            shown: one(),
            alpha: one(),
            follow: one(),
            own: vec![NOBODY; SLOTS],
            leader: vec![NOBODY; SLOTS],
            leaders: vec![NOBODY; SLOTS],
            q: three(),
            nearest: one(),
            least_shown: one(),
            trains: vec![0; SLOTS],
            order: vec![0; SLOTS],
            starts: Vec::new(),
            displacement: core::array::from_fn(|_| vec![0.0; SLOTS + 1]),
            speed: core::array::from_fn(|_| vec![0.0; SLOTS + 1]),
        }
    }
}

impl Room {
    /// Makes room for so many trains, so that no later ride allocates.
    pub fn make_room(&mut self, trains: usize) {
        self.starts.reserve((trains + 1).saturating_sub(self.starts.len()));
    }
}

/// Lets the listed particles of a chunk ride, and writes the sprites of those in view, in the list's order, and (where
/// `trace` has room) where each of the chunk's particles is, in the order of their numbers.
pub fn ride(
    level: Level,
    ride: &Ride<'_>,
    listed: &Listed<'_>,
    scratch: &mut Room,
    sprites: &mut [Billboard],
    trace: &mut [Trace],
) -> Work {
    gather(ride, listed, scratch);
    let count = listed.seen.len();
    reef_flow::dispatch!(level, simd => {
        if matches!(simd.level(), fearless_simd::Level::Avx512(_)) {
            place::<_, f32x16<_>, 16>(simd, ride, scratch, count);
        } else {
            place::<_, f32x8<_>, 8>(simd, ride, scratch, count);
        }
    });
    let riders = if ride.follow.is_some() { choose(listed, scratch) } else { all_ride(scratch, count) };
    let trains = carry(level, ride, scratch, riders);
    emit(ride, listed, scratch, sprites, trace);
    Work { orbits: riders as u32, trains }
}

/// Centres of the listed particles, and (where slaves follow) of their masters, side by side.
fn gather(ride: &Ride<'_>, listed: &Listed<'_>, scratch: &mut Room) {
    let count = listed.seen.len();
    let padded = count.next_multiple_of(BLOCK);
    for axis in 0..3 {
        let (at, now, unit) = (listed.at[axis], ride.now[axis], ride.unit[axis]);
        let own = &mut scratch.p[axis];
        side_by_side(listed.seen, |entry| usize::from(entry & SLOT), at, now, unit, own);
        own[count..padded].fill(0.0);
        if ride.follow.is_some() {
            let masters = &mut scratch.master[axis];
            let group = |entry| usize::from(entry & SLOT) & (listed.groups - 1);
            side_by_side(listed.seen, group, at, now, unit, masters);
            masters[count..padded].fill(0.0);
        }
    }
}

/// Offsets of some slots in metres. `slot`: that of an entry of the list.
#[inline(always)]
fn side_by_side(seen: &[u16], slot: impl Fn(u16) -> usize, at: &[i32], now: i32, unit: f32, out: &mut [f32]) {
    let metres = |offset: i32| offset.wrapping_add(now) as f32 * unit;
    let (blocks, rest) = seen.as_chunks::<BLOCK>();
    let (out_blocks, out_rest) = out.split_at_mut(blocks.len() * BLOCK);
    for (entries, out) in blocks.iter().zip(out_blocks.as_chunks_mut::<BLOCK>().0) {
        let (first, last) = (slot(entries[0]), slot(entries[BLOCK - 1]));
        // Entries of one member ascend, and between two members lie more slots than a block has.
        if last == first + BLOCK - 1
            && let Some(own) = at.get(first..).and_then(|own| own.first_chunk::<BLOCK>())
        {
            *out = own.map(metres);
        } else {
            *out = entries.map(|entry| metres(at[slot(entry)]));
        }
    }
    for (out, entry) in out_rest.iter_mut().zip(rest) {
        *out = metres(at[slot(*entry)]);
    }
}

/// Distance from the eye, how much is seen, how far each follows its master, and the drift.
#[inline(always)]
fn place<S: Simd, V: Lanes<S>, const WIDTH: usize>(
    simd: S,
    ride: &Ride<'_>,
    scratch: &mut Room,
    count: usize,
) {
    let one = V::splat(simd, 1.0);
    let mut first = 0;
    while first < count {
        let here = first..first + WIDTH;
        let p = load::<S, V>(simd, &scratch.p, first, WIDTH);
        let eye = splat::<S, V>(simd, ride.eye);
        let distance = length(sub(p, eye));
        distance.store_slice(&mut scratch.distance[here.clone()]);
        if let Some(choice) = ride.choice {
            let [x, y, z, height] = ride.ahead;
            let along = mul_add(p[0], V::splat(simd, x), V::splat(simd, height));
            let along = mul_add(p[2], V::splat(simd, z), mul_add(p[1], V::splat(simd, y), along));
            let along = along.max(V::splat(simd, 0.0));
            // Beyond the picture's corner nobody looks.
            let corner = distance * V::splat(simd, 1.0 / choice.corner());
            let shown = (along * along / distance.max(V::splat(simd, 1e-6))).max(corner);
            shown.store_slice(&mut scratch.shown[here.clone()]);
        }
        let mut alpha = ride.fades.near.ramp(simd, distance) * (one - ride.fades.end.ramp(simd, distance));
        if let Some(fog) = ride.fades.fog {
            alpha *= one - fog.ramp(simd, distance);
        }
        alpha.store_slice(&mut scratch.alpha[here.clone()]);
        if let Some(follow) = &ride.follow {
            let master = load::<S, V>(simd, &scratch.master, first, WIDTH);
            let apart = length(sub(p, master));
            let half = splat::<S, V>(simd, ride.half);
            let walls =
                (half[0] - master[0].abs()).min(half[1] - master[1].abs()).min(half[2] - master[2].abs());
            let share = follow.distance.ramp(simd, distance)
                * follow.least.ramp(simd, apart)
                * (one - follow.most.ramp(simd, apart))
                * follow.wall.ramp(simd, walls);
            share.store_slice(&mut scratch.follow[here.clone()]);
        }
        let drift = match ride.packed {
            Some(packed) => {
                let mut v = bounded(simd, velocity(simd, packed, p[0], p[1], p[2]));
                if packed.is_singular() {
                    // Half a step ago: what the picture between two steps goes back by.
                    let half = V::splat(simd, -ride.half_step);
                    let p = [mul_add(v[0], half, p[0]), mul_add(v[1], half, p[1]), mul_add(v[2], half, p[2])];
                    v = bounded(simd, velocity(simd, packed, p[0], p[1], p[2]));
                }
                v
            }
            None => splat::<S, V>(simd, ride.uniform),
        };
        drift[0].store_slice(&mut scratch.drift[0][here.clone()]);
        drift[1].store_slice(&mut scratch.drift[1][here.clone()]);
        drift[2].store_slice(&mut scratch.drift[2][here]);
        first += WIDTH;
    }
    if ride.follow.is_none() {
        scratch.follow[..count].fill(0.0);
    }
}

/// Each rides by itself.
fn all_ride(scratch: &mut Room, count: usize) -> usize {
    for (q, p) in scratch.q.iter_mut().zip(&scratch.p) {
        q[..count].copy_from_slice(&p[..count]);
    }
    scratch.nearest[..count].copy_from_slice(&scratch.distance[..count]);
    scratch.least_shown[..count].copy_from_slice(&scratch.shown[..count]);
    for (number, own) in (0..).zip(&mut scratch.own[..count]) {
        *own = number;
    }
    scratch.leader[..count].fill(NOBODY);
    count
}

/// Who rides: each that does not follow wholly, and the master of each that follows. Returns how many.
fn choose(listed: &Listed<'_>, scratch: &mut Room) -> usize {
    let mut riders = 0;
    scratch.leaders[..listed.groups].fill(NOBODY);
    for (i, entry) in listed.seen.iter().enumerate() {
        let slot = usize::from(entry & SLOT);
        let (group, is_master) = (slot & (listed.groups - 1), slot < listed.groups);
        let (follow, distance) = (if is_master { 0.0 } else { scratch.follow[i] }, scratch.distance[i]);
        scratch.follow[i] = follow;
        scratch.own[i] = NOBODY;
        scratch.leader[i] = NOBODY;
        if is_master || follow > 0.0 {
            // One rider a master, whoever needs it first.
            let mut leader = scratch.leaders[group];
            if leader == NOBODY {
                leader = riders as u16;
                scratch.leaders[group] = leader;
                for axis in 0..3 {
                    scratch.q[axis][riders] = scratch.master[axis][i];
                }
                scratch.nearest[riders] = distance;
                scratch.least_shown[riders] = scratch.shown[i];
                riders += 1;
            }
            let at = usize::from(leader);
            scratch.nearest[at] = scratch.nearest[at].min(distance);
            scratch.least_shown[at] = scratch.least_shown[at].min(scratch.shown[i]);
            if is_master {
                scratch.own[i] = leader;
            } else {
                scratch.leader[i] = leader;
            }
        }
        if !is_master && follow < 1.0 {
            scratch.own[i] = riders as u16;
            for axis in 0..3 {
                scratch.q[axis][riders] = scratch.p[axis][i];
            }
            scratch.nearest[riders] = distance;
            scratch.least_shown[riders] = scratch.shown[i];
            riders += 1;
        }
    }
    riders
}

/// How many trains matter for each rider, and an order in which those with the same number are neighbours.
fn rank(ride: &Ride<'_>, choice: &Choice, scratch: &mut Room, riders: usize) {
    let all = u16::try_from(ride.trains.len()).unwrap_or(u16::MAX);
    let starts = &mut scratch.starts;
    starts.clear();
    starts.resize(usize::from(all) + 1, 0);
    for rider in 0..riders {
        let y = scratch.q[1][rider] + ride.level;
        let count = choice.count_at(y, scratch.nearest[rider], scratch.least_shown[rider]).min(all);
        scratch.trains[rider] = count;
        starts[usize::from(count)] += 1;
    }
    // Most first.
    let mut before = 0;
    for start in starts.iter_mut().rev() {
        (*start, before) = (before, before + *start);
    }
    for rider in 0..riders {
        let place = &mut starts[usize::from(scratch.trains[rider])];
        scratch.order[usize::from(*place)] = rider as u16;
        *place += 1;
    }
}

/// The orbits of all riders. Returns how many trains were evaluated in all.
fn carry(level: Level, ride: &Ride<'_>, scratch: &mut Room, riders: usize) -> u32 {
    if ride.trains.is_empty() {
        for axis in 0..3 {
            scratch.displacement[axis][..riders].fill(0.0);
            scratch.speed[axis][..riders].fill(0.0);
        }
        return 0;
    }
    match ride.choice {
        Some(choice) => rank(ride, choice, scratch, riders),
        None => {
            for axis in 0..3 {
                scratch.q[axis][riders..riders.next_multiple_of(BLOCK)].fill(0.0);
            }
        }
    }
    let mut trains = 0;
    let mut first = 0;
    while first < riders {
        let last = riders.min(first + BLOCK);
        // Whom most trains matter for stands first: the same for all of a block, at every level.
        let count = match ride.choice {
            Some(_) => usize::from(scratch.trains[usize::from(scratch.order[first])]),
            None => ride.trains.len(),
        };
        reef_flow::dispatch!(level, simd => {
            if matches!(simd.level(), fearless_simd::Level::Avx512(_)) {
                block::<_, f32x16<_>, 16>(simd, ride, count, scratch, first, last);
            } else {
                block::<_, f32x8<_>, 8>(simd, ride, count, scratch, first, last);
            }
        });
        trains += (count * (last - first)) as u32;
        first = last;
    }
    trains
}

#[inline(always)]
fn block<S: Simd, V: Lanes<S>, const WIDTH: usize>(
    simd: S,
    ride: &Ride<'_>,
    count: usize,
    scratch: &mut Room,
    first: usize,
    last: usize,
) {
    let sorted = ride.choice.is_some();
    let back = V::splat(simd, -ride.half_step);
    let mut out = [[[0.0; BLOCK]; 3]; 2];
    let mut own = [[0.0; BLOCK]; 3];
    if sorted {
        for (lane, rider) in scratch.order[first..last].iter().enumerate() {
            for (own, q) in own.iter_mut().zip(&scratch.q) {
                own[lane] = q[usize::from(*rider)];
            }
        }
    } else {
        for (own, q) in own.iter_mut().zip(&scratch.q) {
            own.copy_from_slice(&q[first..first + BLOCK]);
        }
    }
    let mut lane = 0;
    while lane < BLOCK {
        let here = lane..lane + WIDTH;
        let q = [
            V::from_slice(simd, &own[0][here.clone()]),
            V::from_slice(simd, &own[1][here.clone()]),
            V::from_slice(simd, &own[2][here.clone()]),
        ];
        let orbit = orbit(simd, ride.trains, count, q);
        for axis in 0..3 {
            orbit.displacement[axis].store_slice(&mut out[0][axis][here.clone()]);
            // Of the step, not of its end: what the picture between two steps goes back by.
            let velocity = mul_add(orbit.acceleration[axis], back, orbit.velocity[axis]);
            velocity.store_slice(&mut out[1][axis][here.clone()]);
        }
        lane += WIDTH;
    }
    for axis in 0..3 {
        let (displacement, speed) = (&mut scratch.displacement[axis], &mut scratch.speed[axis]);
        if sorted {
            for (lane, rider) in scratch.order[first..last].iter().enumerate() {
                displacement[usize::from(*rider)] = out[0][axis][lane];
                speed[usize::from(*rider)] = out[1][axis][lane];
            }
        } else {
            displacement[first..last].copy_from_slice(&out[0][axis][..last - first]);
            speed[first..last].copy_from_slice(&out[1][axis][..last - first]);
        }
    }
}

/// Sprites and trace.
fn emit(
    ride: &Ride<'_>,
    listed: &Listed<'_>,
    scratch: &Room,
    sprites: &mut [Billboard],
    trace: &mut [Trace],
) {
    let mut sprites = sprites.iter_mut();
    let shift = listed.groups.trailing_zeros();
    let facing = if ride.looks.facing { abi::BILLBOARD_FACING } else { 0 };
    for (i, entry) in listed.seen.iter().enumerate() {
        let slot = usize::from(entry & SLOT);
        let number = (slot & (listed.groups - 1)) * listed.members + (slot >> shift);
        let look = ride.looks.of(listed.first + number as u64);
        let follow = scratch.follow[i];
        let (own, leader) = (scratch.own[i], scratch.leader[i]);
        let mix =
            |values: &[f32]| values[usize::from(own)] * (1.0 - follow) + values[usize::from(leader)] * follow;
        let position: [f32; 3] =
            core::array::from_fn(|axis| scratch.p[axis][i] + mix(&scratch.displacement[axis]));
        if let Some(trace) = trace.get_mut(number) {
            *trace = Trace {
                object: u64::from(ride.object),
                position: core::array::from_fn(|axis| ride.center[axis] + f64::from(position[axis])),
                radius: look.size * ride.size,
                node: (listed.first + number as u64) as u32,
                kind: abi::TRACE_PARTICLE,
                spare: 0,
            };
        }
        if entry & IN_VIEW == 0 {
            continue;
        }
        let Some(sprite) = sprites.next() else { continue };
        let jumped = listed.jumped[slot / 64] >> (slot % 64) & 1 != 0;
        let jumped = if jumped { abi::FLAG_NO_BLEND } else { 0 };
        *sprite = Billboard {
            position,
            size: look.size * ride.size,
            axis: look.axis,
            opacity: (ride.opacity * scratch.alpha[i]).clamp(0.0, 1.0),
            velocity: core::array::from_fn(|axis| {
                (scratch.drift[axis][i] + mix(&scratch.speed[axis])).clamp(-FASTEST, FASTEST)
            }),
            roll: look.roll,
            object: ride.object,
            texture: ride.looks.texture,
            color: look.color,
            flags: facing | jumped,
        };
    }
}

#[inline(always)]
fn splat<S: Simd, V: Lanes<S>>(simd: S, [x, y, z]: [f32; 3]) -> [V; 3] {
    [V::splat(simd, x), V::splat(simd, y), V::splat(simd, z)]
}

#[inline(always)]
fn load<S: Simd, V: Lanes<S>>(simd: S, from: &[Vec<f32>; 3], first: usize, width: usize) -> [V; 3] {
    let here = first..first + width;
    [
        V::from_slice(simd, &from[0][here.clone()]),
        V::from_slice(simd, &from[1][here.clone()]),
        V::from_slice(simd, &from[2][here]),
    ]
}

#[inline(always)]
fn sub<S: Simd, V: Lanes<S>>(a: [V; 3], b: [V; 3]) -> [V; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn length<S: Simd, V: Lanes<S>>(d: [V; 3]) -> V {
    mul_add(d[2], d[2], mul_add(d[1], d[1], d[0] * d[0])).sqrt()
}
