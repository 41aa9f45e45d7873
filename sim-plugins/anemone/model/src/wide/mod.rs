//! The equations of [`crate::reference`], sixteen fibres a vector: one register of AVX-512, two of AVX2, four
//! below. Two registers' worth of independent work hides much of what the roots and quotients of one fibre
//! wait for.
//!
//! Lanes are independent fibres with the same number of segments, so the width never reorders a sum; every
//! operation is exact by IEEE 754 or a fused multiply-add, so all instruction sets give the same bytes.
//! Nothing here allocates after a [`Chunk`] was made.

mod chunk;
mod contact;
mod emit;
mod kernel;
mod pace;
mod pose;

pub(crate) use chunk::lanes;
pub use chunk::{Blend, Chunk, Drag, Lane, MOST_FIBRES, Place};
pub use contact::{Capsule, Contacts, Ground};
pub use kernel::{Force, StepConstants};

use glam::DVec3;
use reef_flow::{Level, Packed, simd::Ahead, waves::Surges};

use crate::frame::Frame;

/// Fibres in a vector.
pub const LANES: usize = 16;

/// One number of each of sixteen fibres.
pub type Sixteen = [f32; LANES];

/// The water that moves a chunk's fibres.
#[derive(Clone, Copy, Debug)]
pub struct Water<'a> {
    /// The flow, relative to the chunk's anchor.
    pub flow: &'a Packed,
    /// What the waves add, relative to the plants' origins: one for each sixteen fibres, or one for all;
    /// nothing where there are none.
    pub surges: &'a [Surges],
}

/// One step of all fibres of a chunk without waves: eq. (13) down the chain, then the bends up again.
/// `packed` is the flow relative to the chunk's anchor. Set the gain ([`Chunk::set_gain`]) and the roots
/// ([`carry`]) first.
pub fn step(
    level: Level,
    chunk: &mut Chunk,
    packed: &Packed,
    contacts: &Contacts,
    constants: &StepConstants,
) {
    let water = Water { flow: packed, surges: &[] };
    step_into(level, chunk, water, contacts, constants, &mut [], &mut Ahead::none());
}

/// As [`step`] in any water, then [`emit`]: the same bytes, in less time, since each node is written where it
/// is worked out. `ahead`: what will be needed next.
pub fn step_into(
    level: Level,
    chunk: &mut Chunk,
    water: Water<'_>,
    contacts: &Contacts,
    constants: &StepConstants,
    into: &mut [[f32; 4]],
    ahead: &mut Ahead,
) {
    reef_flow::dispatch!(level, simd => kernel::step(simd, chunk, water, contacts, constants, into, ahead));
}

/// Puts each root where its carrier is: `origin` [m] relative to the plant's origin.
pub fn carry(level: Level, chunk: &mut Chunk, origin: DVec3, carrier: &Frame) {
    let (origin, carrier) = (origin.as_vec3().to_array(), [carrier.x, carrier.y, carrier.z]);
    let carrier = carrier.map(|axis| axis.as_vec3().to_array());
    reef_flow::dispatch!(level, simd => pose::carry(simd, chunk, origin, carrier));
}

/// Places the nodes by the bends as they are: after a start, a loaded state, or a root that was moved.
pub fn rebuild(level: Level, chunk: &mut Chunk) {
    reef_flow::dispatch!(level, simd => pose::rebuild(simd, chunk));
}

/// Writes the nodes of all fibres, one fibre after the other, root to tip: x, y, z, radius. Works out
/// [`Chunk::normal`]. With nothing in `into` it does nothing.
pub fn emit(level: Level, chunk: &mut Chunk, into: &mut [[f32; 4]]) {
    if into.is_empty() {
        return;
    }
    reef_flow::dispatch!(level, simd => emit::emit(simd, chunk, into));
}

/// Gives interpolated fibres (§5.4) the weighted bends of their guides, and places their nodes. All lengths
/// hold, because bends are blended, not positions. `guides` finds the chunks that the blends name, of as many
/// segments as this one.
pub fn follow<'a>(
    level: Level,
    chunk: &mut Chunk,
    blends: &[Blend],
    guides: impl Fn(u32) -> Option<&'a Chunk>,
) {
    pose::blend(chunk, blends, guides);
    rebuild(level, chunk);
}
