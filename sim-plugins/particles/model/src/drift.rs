//! Where the currents take the centres, eq. (3): P₀(t + dt) = P₀(t) + V dt, and which of them may be in view.
//!
//! Where sources, holes or whirlwinds act, V is the sea's velocity half a step further on (the midpoint
//! rule): with the velocity at P₀ itself every turn of an eddy would throw centres outward, and after some
//! minutes its middle would be empty.

use fearless_simd::{Simd, f32x8, f32x16, prelude::*};
use reef_flow::{
    Level, Packed, divergence,
    random::mix,
    simd::{Lanes, mul_add},
    velocity,
    view::{Local, PLANES},
};

use crate::inflow::share;

/// Groups (a master and its slaves) that are looked at together, at every level: what they share does not
/// depend on the width of a vector.
pub const BLOCK: usize = 16;
/// Most members of a group.
pub const MOST_MEMBERS: usize = 16;
/// Most slots of a chunk.
pub const SLOTS: usize = 1024;

/// Bits of an entry of `seen`: the slot, and what is to be known of it.
pub const SLOT: u16 = 0x3ff;
/// It may be in view (others are in the list because a recording asks for all).
pub const IN_VIEW: u16 = 0x4000;
/// Words of a set of slots.
pub const WORDS: usize = SLOTS / 64;
/// Where the axes begin of an entry of `crossed`: bit 12 + axis.
pub const AXIS_SHIFT: u32 = 12;

/// Each chunk's turn comes once in so many steps.
pub const LOOK_STEPS: u64 = 32;
/// Water that vanishes by this share in a step vanishes fast: it is looked at in every step.
const FAST: f32 = 1.0 / 256.0;

/// Greatest speed at which a centre drifts [m/s]: keeps what follows finite, whatever the sea's primitives
/// add up to.
const FASTEST: f32 = 1e4;
/// The largest f32 below 2³¹.
const MOST: f32 = 2_147_483_520.0;

/// What a box does with its chunks in one step.
#[derive(Clone, Copy, Debug)]
pub struct Drift<'a> {
    /// The sea's velocity over the box; None: the same everywhere.
    pub packed: Option<&'a Packed>,
    /// What it is where nothing but uniform currents act [m/s]: in `before` and `now` already.
    pub uniform: [f32; 3],
    /// dt over the box's extent [s/m].
    pub turns: [f32; 3],
    /// Half of dt [s].
    pub half_step: f32,
    /// The box's extent in 2⁻³² [m].
    pub unit: [f32; 3],
    /// What all centres have drifted alike, before and after this step [2⁻³² of the extent].
    pub before: [i32; 3],
    /// As `before`, after it.
    pub now: [i32; 3],
    /// Who looks; None: nobody sees any of the box.
    pub view: Option<Sight>,
    /// List all, whether they are in view or not.
    pub all: bool,
    /// The step is one of no length: nothing moves.
    pub still: bool,
    /// Sources and holes that last, over the box: what vanishes takes its particles along.
    pub sources: Option<&'a Packed>,
    /// Length of the step [s].
    pub dt: f32,
    /// This step's chance, for this box.
    pub chance: u64,
}

/// How a box's particles are held against a view.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// The view, relative to the box's middle.
    pub local: Local,
    /// Leave out what is beside or behind the frustum.
    pub cull: bool,
    /// Nobody sees a particle whose centre is at this distance or beyond [m].
    pub far: f32,
    /// How far an orbit reaches, and half a sprite, at the box's middle [m], and its growth with height
    /// [m/m].
    pub margin: [f32; 2],
}

/// One chunk of a box: its slots hold member j of group g at j · groups + g.
#[derive(Debug)]
pub struct Slots<'a> {
    /// Offsets of the centres, without what all drift alike [2⁻³² of the extent].
    pub at: [&'a mut [i32]; 3],
    /// Slots that are looked at further.
    pub seen: &'a mut [u16],
    /// Slots that left through a wall, with the axes, or (no axis) with water that vanished.
    pub crossed: &'a mut [u16],
    /// The same as a set: what jumped in the last step of any length.
    pub jumped: &'a mut [u64; WORDS],
    /// Groups with a member j, for each j.
    pub alive: &'a [u16; MOST_MEMBERS],
    /// Members of a group.
    pub members: usize,
    /// Groups of a chunk.
    pub groups: usize,
    /// Number of the chunk's first particle in its box.
    pub first: u64,
    /// It is the chunk's turn: water that vanishes slowly is looked at.
    pub turn: bool,
}

/// How many entries the lists of a chunk have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Entries of `seen`.
    pub seen: u32,
    /// Those of them that are in view.
    pub in_view: u32,
    /// Entries of `crossed`.
    pub crossed: u32,
}

/// Lets a chunk drift and lists who is in view.
pub fn drift(level: Level, drift: &Drift<'_>, slots: Slots<'_>) -> Tally {
    reef_flow::dispatch!(level, simd => {
        if matches!(simd.level(), fearless_simd::Level::Avx512(_)) {
            wide::<_, f32x16<_>, 16>(simd, drift, slots)
        } else {
            wide::<_, f32x8<_>, 8>(simd, drift, slots)
        }
    })
}

#[inline(always)]
fn wide<S: Simd, V: Lanes<S>, const WIDTH: usize>(simd: S, drift: &Drift<'_>, slots: Slots<'_>) -> Tally {
    let mut tally = Tally::default();
    let Slots { at: [ax, ay, az], seen, crossed, jumped, alive, members, groups, first: number, turn } =
        slots;
    if !drift.still {
        *jumped = [0; WORDS];
    }
    let [bx, by, bz] = splat3::<S, V>(simd, drift.before);
    let [nx, ny, nz] = splat3::<S, V>(simd, drift.now);
    let unit = [V::splat(simd, drift.unit[0]), V::splat(simd, drift.unit[1]), V::splat(simd, drift.unit[2])];
    let most = usize::from(alive[0]).next_multiple_of(BLOCK).min(groups);
    let lanes: u64 = (1 << WIDTH) - 1;
    let mut block = 0;
    while block < most {
        for (member, &living) in alive.iter().enumerate().take(members) {
            let mut first = block;
            while first < block + BLOCK {
                let living = usize::from(living).saturating_sub(first);
                let there = if living >= WIDTH { lanes } else { (1_u64 << living) - 1 };
                let slot = member * groups + first;
                let here = slot..slot + WIDTH;
                let own = [
                    V::Int::from_slice(simd, &ax[here.clone()]),
                    V::Int::from_slice(simd, &ay[here.clone()]),
                    V::Int::from_slice(simd, &az[here.clone()]),
                ];
                let old = [own[0] + bx, own[1] + by, own[2] + bz];
                let mut new = old;
                if !drift.still {
                    let mut gone = 0;
                    if let Some(packed) = drift.packed {
                        let (step, middle) = increment::<S, V>(simd, drift, packed, old, unit);
                        if let Some(sources) = drift.sources {
                            let draw = |lane: u32| {
                                let group = first as u64 + u64::from(lane);
                                mix(drift.chance ^ mix(number + group * members as u64 + member as u64))
                            };
                            gone = vanish::<S, V, WIDTH>(simd, drift, sources, middle, turn, there, draw);
                        }
                        let own = [own[0] + step[0], own[1] + step[1], own[2] + step[2]];
                        own[0].store_slice(&mut ax[here.clone()]);
                        own[1].store_slice(&mut ay[here.clone()]);
                        own[2].store_slice(&mut az[here.clone()]);
                        new = [own[0] + nx, own[1] + ny, own[2] + nz];
                    } else {
                        new = [own[0] + nx, own[1] + ny, own[2] + nz];
                    }
                    let out = [
                        overflow::<S, V>(simd, old[0], new[0]) & there,
                        overflow::<S, V>(simd, old[1], new[1]) & there,
                        overflow::<S, V>(simd, old[2], new[2]) & there,
                    ];
                    let mut rest = out[0] | out[1] | out[2] | gone;
                    jumped[slot / 64] |= rest << (slot % 64);
                    while rest != 0 {
                        let lane = rest.trailing_zeros();
                        rest &= rest - 1;
                        let axes =
                            (out[0] >> lane & 1) | (out[1] >> lane & 1) << 1 | (out[2] >> lane & 1) << 2;
                        let axes = if gone >> lane & 1 == 0 { axes } else { 0 };
                        crossed[tally.crossed as usize] =
                            (slot + lane as usize) as u16 | (axes as u16) << AXIS_SHIFT;
                        tally.crossed += 1;
                    }
                }
                let in_view = match &drift.view {
                    None => 0,
                    Some(sight) => {
                        let p = [
                            V::from_int(new[0]) * unit[0],
                            V::from_int(new[1]) * unit[1],
                            V::from_int(new[2]) * unit[2],
                        ];
                        look::<S, V>(simd, sight, p) & there
                    }
                };
                let mut rest = if drift.all { there } else { in_view };
                while rest != 0 {
                    let lane = rest.trailing_zeros();
                    rest &= rest - 1;
                    let mut entry = (slot + lane as usize) as u16;
                    if in_view >> lane & 1 != 0 {
                        entry |= IN_VIEW;
                    }
                    seen[tally.seen as usize] = entry;
                    tally.seen += 1;
                }
                tally.in_view += in_view.count_ones();
                first += WIDTH;
            }
        }
        block += BLOCK;
    }
    tally
}

/// Lanes whose water vanishes, by chance, among those that are `there`: −∇·V of it in a second.
#[inline(always)]
fn vanish<S: Simd, V: Lanes<S>, const WIDTH: usize>(
    simd: S,
    drift: &Drift<'_>,
    sources: &Packed,
    [x, y, z]: [V; 3],
    turn: bool,
    there: u64,
    draw: impl Fn(u32) -> u64,
) -> u64 {
    let lost = divergence(simd, sources, x, y, z) * V::splat(simd, -drift.dt);
    let least = if turn { 0.0 } else { FAST };
    let mut rest = lost.simd_gt(V::splat(simd, least)).to_bitmask() & there;
    if rest == 0 {
        return 0;
    }
    let mut lanes = [0.0; WIDTH];
    lost.store_slice(&mut lanes);
    let mut gone = 0;
    while rest != 0 {
        let lane = rest.trailing_zeros();
        rest &= rest - 1;
        let lost = lanes[lane as usize];
        let lost = if lost > FAST { lost.min(1e6) } else { lost * LOOK_STEPS as f32 };
        // 1 − e^(−lost): what is left of one that shrinks all the time.
        let grown = 1.0 + lost * (1.0 + 0.5 * lost * (1.0 + lost / 3.0 * (1.0 + 0.25 * lost)));
        if share(draw(lane)) * grown < grown - 1.0 {
            gone |= 1 << lane;
        }
    }
    gone
}

/// How far centres move beside the uniform currents in this step [2⁻³² of the extent], and where they are
/// half-way [m].
#[inline(always)]
fn increment<S: Simd, V: Lanes<S>>(
    simd: S,
    drift: &Drift<'_>,
    packed: &Packed,
    old: [V::Int; 3],
    unit: [V; 3],
) -> ([V::Int; 3], [V; 3]) {
    let mut p = [V::from_int(old[0]) * unit[0], V::from_int(old[1]) * unit[1], V::from_int(old[2]) * unit[2]];
    let mut v = bounded(simd, velocity(simd, packed, p[0], p[1], p[2]));
    if packed.is_singular() {
        let half = V::splat(simd, drift.half_step);
        p = [mul_add(v[0], half, p[0]), mul_add(v[1], half, p[1]), mul_add(v[2], half, p[2])];
        v = bounded(simd, velocity(simd, packed, p[0], p[1], p[2]));
    }
    let step = [
        whole(simd, v[0], drift.uniform[0], drift.turns[0]),
        whole(simd, v[1], drift.uniform[1], drift.turns[1]),
        whole(simd, v[2], drift.uniform[2], drift.turns[2]),
    ];
    (step, p)
}

/// A velocity that no sum of primitives makes infinite.
#[inline(always)]
pub(crate) fn bounded<S: Simd, V: Lanes<S>>(simd: S, v: [V; 3]) -> [V; 3] {
    let (low, high) = (V::splat(simd, -FASTEST), V::splat(simd, FASTEST));
    [v[0].max(low).min(high), v[1].max(low).min(high), v[2].max(low).min(high)]
}

/// A way along one axis in 2⁻³² of the extent, at most half of it.
#[inline(always)]
fn whole<S: Simd, V: Lanes<S>>(simd: S, v: V, uniform: f32, turns: f32) -> V::Int {
    let way = (v - V::splat(simd, uniform)) * V::splat(simd, turns * 4_294_967_296.0);
    let way = way.max(V::splat(simd, -MOST)).min(V::splat(simd, MOST));
    way.round_ties_even().to_int()
}

/// Lanes in which the way from `old` to `new`, the shorter one around, leads through the wall.
#[inline(always)]
fn overflow<S: Simd, V: Lanes<S>>(simd: S, old: V::Int, new: V::Int) -> u64 {
    let way = new - old;
    ((old ^ new) & (way ^ new)).simd_lt(V::Int::splat(simd, 0)).to_bitmask()
}

/// Lanes in which something of the particle may be seen.
#[inline(always)]
fn look<S: Simd, V: Lanes<S>>(simd: S, sight: &Sight, p: [V; 3]) -> u64 {
    let d = [
        p[0] - V::splat(simd, sight.local.eye[0]),
        p[1] - V::splat(simd, sight.local.eye[1]),
        p[2] - V::splat(simd, sight.local.eye[2]),
    ];
    let distance2 = mul_add(d[2], d[2], mul_add(d[1], d[1], d[0] * d[0]));
    let far = V::splat(simd, sight.far);
    let near = distance2.simd_lt(far * far).to_bitmask();
    if !sight.cull {
        return near;
    }
    let margin = mul_add(p[1], V::splat(simd, sight.margin[1]), V::splat(simd, sight.margin[0]));
    let mut least = height(simd, &sight.local.planes[0], p);
    for plane in 1..PLANES {
        least = least.min(height(simd, &sight.local.planes[plane], p));
    }
    near & least.simd_ge(-margin).to_bitmask()
}

/// How far points are inside of a plane [m].
#[inline(always)]
fn height<S: Simd, V: Lanes<S>>(simd: S, plane: &[f32; 4], p: [V; 3]) -> V {
    let sum = mul_add(p[0], V::splat(simd, plane[0]), V::splat(simd, plane[3]));
    mul_add(p[2], V::splat(simd, plane[2]), mul_add(p[1], V::splat(simd, plane[1]), sum))
}

#[inline(always)]
fn splat3<S: Simd, V: Lanes<S>>(simd: S, [x, y, z]: [i32; 3]) -> [V::Int; 3] {
    [V::Int::splat(simd, x), V::Int::splat(simd, y), V::Int::splat(simd, z)]
}
