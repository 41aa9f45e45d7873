//! Particles on the waves, eq. (2), and what is shown of them.
//!
//! Each particle that may be in view rides on its own orbit, unless it is a slave beyond D_m: then it is
//! carried as its master is (§3.3.3). Between the two it goes over from one to the other smoothly. Who
//! follows at all, be it in part, is d_pmin … d_pmax from its master: one that the currents took elsewhere
//! rides by itself, and so do the slaves of a master that is about to leave the box: on the other side the
//! wave has another phase.

use fearless_simd::{Simd, f32x8, f32x16, prelude::*};
use reef_flow::{
    Level, Packed,
    simd::{Lanes, mul_add},
    velocity,
    waves::{Selection, Trains, orbit},
};
use reef_sdk::abi::{self, Billboard, Trace};

use crate::{
    drift::{BLOCK, IN_VIEW, SLOT, SLOTS, WORDS, bounded},
    levels::Band,
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
    pub selection: Option<&'a Selection>,
    /// World height of the box's middle [m].
    pub level: f32,
    /// What all centres have drifted alike [2⁻³² of the extent].
    pub now: [i32; 3],
    /// The box's extent in 2⁻³² [m].
    pub unit: [f32; 3],
    /// Half of the box's extent [m].
    pub half: [f32; 3],
    /// The box's extent [m]: exact, for the trace.
    pub extent: [f64; 3],
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
    /// Where the table holds how many trains matter for each: for its own orbit, and for that of its master.
    cell: Vec<i32>,
    master_cell: Vec<i32>,
    alpha: Vec<f32>,
    follow: Vec<f32>,
    own: Vec<u16>,
    leader: Vec<u16>,
    /// Who rides for each group's slaves.
    leaders: Vec<u16>,
    /// Those who ride: centre, how many trains matter, displacement, velocity.
    q: [Vec<f32>; 3],
    trains: Vec<u16>,
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
            cell: vec![0; SLOTS],
            master_cell: vec![0; SLOTS],
            alpha: one(),
            follow: one(),
            own: vec![NOBODY; SLOTS],
            leader: vec![NOBODY; SLOTS],
            leaders: vec![NOBODY; SLOTS],
            q: three(),
            trains: vec![0; SLOTS],
            displacement: core::array::from_fn(|_| vec![0.0; SLOTS + 1]),
            speed: core::array::from_fn(|_| vec![0.0; SLOTS + 1]),
        }
    }
}

/// Lets the listed particles of a chunk ride, and writes the sprites of those in view, in the list's order,
/// and (where `trace` has room) where each of the chunk's particles is, in the order of their numbers.
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
    let riders =
        if ride.follow.is_some() { choose(ride, listed, scratch) } else { all_ride(ride, scratch, count) };
    let trains = carry(level, ride, scratch, riders);
    add_up(ride, scratch, count);
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

/// Offsets of some slots in metres; where they are neighbours, all of a block at once. `slot`: that of an
/// entry of the list.
#[inline(always)]
fn side_by_side(seen: &[u16], slot: impl Fn(u16) -> usize, at: &[i32], now: i32, unit: f32, out: &mut [f32]) {
    let metres = |offset: i32| offset.wrapping_add(now) as f32 * unit;
    let (blocks, rest) = seen.as_chunks::<BLOCK>();
    let (out_blocks, out_rest) = out.split_at_mut(blocks.len() * BLOCK);
    for (entries, out) in blocks.iter().zip(out_blocks.as_chunks_mut::<BLOCK>().0) {
        let first = slot(entries[0]);
        let apart = (0..BLOCK).fold(0, |apart, lane| apart | slot(entries[lane]) ^ (first + lane));
        if apart == 0
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
        if let Some(selection) = ride.selection {
            let [x, y, z, height] = ride.ahead;
            let along = mul_add(p[0], V::splat(simd, x), V::splat(simd, height));
            let along = mul_add(p[2], V::splat(simd, z), mul_add(p[1], V::splat(simd, y), along));
            let along = along.max(V::splat(simd, 0.0));
            // Beyond the picture's corner nobody looks.
            let corner = distance * V::splat(simd, 1.0 / selection.corner());
            let shown = (along * along / distance.max(V::splat(simd, 1e-6))).max(corner);
            let level = V::splat(simd, ride.level);
            let cell = selection.cell(simd, p[1] + level, distance, shown);
            cell.store_slice(&mut scratch.cell[here.clone()]);
            if ride.follow.is_some() {
                let y = V::from_slice(simd, &scratch.master[1][here.clone()]) + level;
                let cell = selection.cell(simd, y, distance, shown);
                cell.store_slice(&mut scratch.master_cell[here.clone()]);
            }
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
fn all_ride(ride: &Ride<'_>, scratch: &mut Room, count: usize) -> usize {
    for (q, p) in scratch.q.iter_mut().zip(&scratch.p) {
        q[..count].copy_from_slice(&p[..count]);
    }
    if let Some(selection) = ride.selection {
        for (trains, cell) in scratch.trains.iter_mut().zip(&scratch.cell[..count]) {
            *trains = selection.of(*cell);
        }
    }
    count
}

/// Who rides: each that does not follow wholly, and the master of each that follows. Returns how many.
fn choose(ride: &Ride<'_>, listed: &Listed<'_>, scratch: &mut Room) -> usize {
    let mut riders = 0;
    let matter = |cell: i32| ride.selection.map_or(u16::MAX, |selection| selection.of(cell));
    scratch.leaders[..listed.groups].fill(NOBODY);
    for (i, entry) in listed.seen.iter().enumerate() {
        let slot = usize::from(entry & SLOT);
        let (group, is_master) = (slot & (listed.groups - 1), slot < listed.groups);
        let follow = if is_master { 0.0 } else { scratch.follow[i] };
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
                scratch.trains[riders] = 0;
                riders += 1;
            }
            // As many as the nearest of those needs that it carries.
            let trains = &mut scratch.trains[usize::from(leader)];
            *trains = (*trains).max(matter(scratch.master_cell[i]));
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
            scratch.trains[riders] = matter(scratch.cell[i]);
            riders += 1;
        }
    }
    riders
}

/// The orbits of all riders. Returns how many trains were evaluated in all.
fn carry(level: Level, ride: &Ride<'_>, scratch: &mut Room, riders: usize) -> u32 {
    let padded = riders.next_multiple_of(BLOCK);
    for axis in 0..3 {
        scratch.q[axis][riders..padded].fill(0.0);
    }
    if ride.trains.is_empty() {
        for axis in 0..3 {
            scratch.displacement[axis][..riders].fill(0.0);
            scratch.speed[axis][..riders].fill(0.0);
        }
        return 0;
    }
    let mut trains = 0;
    let mut first = 0;
    while first < riders {
        let last = riders.min(first + BLOCK);
        // The same for all of a block, at every level: what that one needs that needs most.
        let most = scratch.trains[first..last].iter().fold(0, |a, b| a.max(*b));
        let count = if ride.selection.is_some() { usize::from(most) } else { usize::MAX };
        let count = count.min(ride.trains.len());
        reef_flow::dispatch!(level, simd => {
            if matches!(simd.level(), fearless_simd::Level::Avx512(_)) {
                block::<_, f32x16<_>, 16>(simd, ride, count, scratch, first);
            } else {
                block::<_, f32x8<_>, 8>(simd, ride, count, scratch, first);
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
    block: usize,
) {
    let back = V::splat(simd, -ride.half_step);
    let mut first = block;
    while first < block + BLOCK {
        let here = first..first + WIDTH;
        let q = load::<S, V>(simd, &scratch.q, first, WIDTH);
        let orbit = orbit(simd, ride.trains, count, q);
        for axis in 0..3 {
            orbit.displacement[axis].store_slice(&mut scratch.displacement[axis][here.clone()]);
            // Of the step, not of its end: what the picture between two steps goes back by.
            let velocity = mul_add(orbit.acceleration[axis], back, orbit.velocity[axis]);
            velocity.store_slice(&mut scratch.speed[axis][here.clone()]);
        }
        first += WIDTH;
    }
}

/// Orbits onto centres and drift, in their place; and how much is seen.
fn add_up(ride: &Ride<'_>, scratch: &mut Room, count: usize) {
    let Room { p, drift, displacement, speed, follow, own, leader, alpha, .. } = scratch;
    let bounded = |v: f32| v.clamp(-FASTEST, FASTEST);
    for axis in 0..3 {
        let (p, v) = (&mut p[axis][..count], &mut drift[axis][..count]);
        let (displacement, speed) = (&displacement[axis], &speed[axis]);
        if ride.follow.is_none() {
            p.iter_mut().zip(displacement).for_each(|(p, d)| *p += d);
            v.iter_mut().zip(speed).for_each(|(v, s)| *v = bounded(*v + s));
            continue;
        }
        for i in 0..count {
            let (own, leader, follow) = (usize::from(own[i]), usize::from(leader[i]), follow[i]);
            let mix = |values: &[f32]| values[own] * (1.0 - follow) + values[leader] * follow;
            p[i] += mix(displacement);
            v[i] = bounded(v[i] + mix(speed));
        }
    }
    alpha[..count].iter_mut().for_each(|alpha| *alpha = (ride.opacity * *alpha).clamp(0.0, 1.0));
}

/// Sprites and trace. The trace is summed in f64: a slave's place from its master's is then that of their
/// centres.
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
    let all = listed.seen.iter();
    let Room { p: [x, y, z], drift: [vx, vy, vz], alpha, .. } = scratch;
    let moving = x.iter().zip(y).zip(z).zip(vx.iter().zip(vy).zip(vz)).zip(alpha);
    for (i, (entry, ((((x, y), z), ((vx, vy), vz)), alpha))) in all.zip(moving).enumerate() {
        let slot = usize::from(entry & SLOT);
        let number = (slot & (listed.groups - 1)) * listed.members + (slot >> shift);
        let look = ride.looks.of(listed.first + number as u64);
        let position = [*x, *y, *z];
        if let Some(trace) = trace.get_mut(number) {
            *trace = Trace {
                object: u64::from(ride.object),
                position: core::array::from_fn(|axis| {
                    let moved = &scratch.displacement[axis];
                    // Where nobody follows, each rides by itself.
                    let riders = match ride.follow {
                        Some(_) => [scratch.own[i], scratch.leader[i]].map(usize::from),
                        None => [i, i],
                    };
                    let [own, leader] = riders.map(|rider| f64::from(moved[rider]));
                    let follow = f64::from(scratch.follow[i]);
                    let offset = listed.at[axis][slot].wrapping_add(ride.now[axis]);
                    let offset = f64::from(offset) / 4_294_967_296.0 * ride.extent[axis];
                    ride.center[axis] + offset + (own * (1.0 - follow) + leader * follow)
                }),
                radius: look.size * ride.size,
                node: (listed.first + number as u64) as u32,
                kind: 0,
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
            opacity: *alpha,
            velocity: [*vx, *vy, *vz],
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
