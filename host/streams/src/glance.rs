//! The first look at the streams that are long: whether all of it is sound, sixteen words of memory at a time
//! and without a word to say.
//!
//! A rule allows a 32-bit word one range, once some of its bits are masked out. Indices, counts and flags are
//! that by themselves; so are numbers, because the bits of a float grow with its size, and infinities and NaN
//! lie above all others. A glance may doubt what is allowed (−0 where 0 is the least, the very bound of the
//! world); it never passes what is not.

use reef_abi as abi;
use reef_flow::{
    Level, dispatch,
    fearless_simd::{Simd, mask32x16, prelude::*, u32x16},
    simd::blocks,
};

use crate::{
    check::{FARTHEST, FARTHEST_LOCAL, FIBRE_FLAGS, SIDES, is_unit},
    identity::GREATEST_ID,
};

/// Words that are looked at at once: a cache line of them.
const WORDS: usize = 16;
type Line = [u32; WORDS];

/// What one word may be: ((word & mask) − least) < room, without signs.
#[derive(Clone, Copy)]
struct Word {
    mask: u32,
    least: u32,
    room: u32,
}

impl Word {
    const ANY: Self = Self { mask: 0, least: 0, room: 1 };
    const ZERO: Self = Self { mask: u32::MAX, least: 0, room: 1 };
    /// A float without its sign.
    const SIZE: u32 = 0x7fff_ffff;
    const FINITE: Self = Self { mask: Self::SIZE, least: 0, room: f32::INFINITY.to_bits() };
    /// A float of 0 and more.
    const POSITIVE_OR_ZERO: Self = Self { mask: u32::MAX, least: 0, room: f32::INFINITY.to_bits() };
    /// The high half of a coordinate in the world.
    const WORLD: Self = Self { mask: Self::SIZE, least: 0, room: (FARTHEST.to_bits() >> 32) as u32 };

    /// A float from −`most` to `most`.
    const fn within(most: f32) -> Self {
        Self { mask: Self::SIZE, least: 0, room: most.to_bits() + 1 }
    }

    /// A float above 0, up to `most`.
    const fn above_zero(most: f32) -> Self {
        Self { mask: u32::MAX, least: 1, room: most.to_bits() }
    }

    /// None but these bits.
    const fn flags(known: u32) -> Self {
        Self { mask: !known, least: 0, room: 1 }
    }

    /// From `least` to below `end`.
    const fn range(least: u32, end: u32) -> Self {
        Self { mask: u32::MAX, least, room: end.saturating_sub(least) }
    }

    /// An index into `count` elements.
    fn index(count: usize) -> Self {
        Self::range(0, u32::try_from(count).unwrap_or(u32::MAX))
    }
}

/// What the words of a line may be.
struct Rule {
    mask: Line,
    least: Line,
    room: Line,
}

impl Rule {
    fn new(words: [Word; WORDS]) -> Self {
        Self { mask: words.map(|w| w.mask), least: words.map(|w| w.least), room: words.map(|w| w.room) }
    }

    /// Whether all lines follow the rule. `more` looks at what no rule says: it gets each block of lines
    /// while that is near.
    fn holds(&self, lines: &[Line], mut more: impl FnMut(&[Line]) -> bool) -> bool {
        dispatch!(Level::best(), simd => hold(simd, self, lines, &mut more))
    }
}

#[inline(always)]
fn hold<S: Simd>(simd: S, rule: &Rule, lines: &[Line], more: &mut impl FnMut(&[Line]) -> bool) -> bool {
    let mask = u32x16::simd_from(simd, rule.mask);
    let least = u32x16::simd_from(simd, rule.least);
    let room = u32x16::simd_from(simd, rule.room);
    let mut good = mask32x16::splat(simd, true);
    let mut rest = true;
    for block in blocks(lines) {
        for line in block {
            let word = u32x16::simd_from(simd, *line);
            good &= ((word & mask) - least).simd_lt(room);
        }
        rest &= more(block);
    }
    good.all_true() & rest
}

/// Whether all objects are sound but for what their ids have to do with each other, and whether the ids grow,
/// the first one from `before`.
pub(crate) fn objects(objects: &[abi::Object], before: u64) -> (bool, bool) {
    let [any, world] = [Word::ANY, Word::WORLD];
    let rule = Rule::new([
        // id: low and high halves, parent
        any,
        Word::range(0, (GREATEST_ID >> 32) as u32 + 1),
        any,
        any,
        // origin: low and high halves
        any,
        world,
        any,
        world,
        any,
        world,
        // bounds_center, bounds_radius
        Word::FINITE,
        Word::FINITE,
        Word::FINITE,
        Word::POSITIVE_OR_ZERO,
        Word::flags(abi::FLAG_NO_BLEND),
        Word::ZERO,
    ]);
    let (mut last, mut named, mut grow) = (before, true, true);
    let sound = rule.holds(bytemuck::cast_slice(objects), |lines| {
        for line in lines {
            let id = u64::from(line[0]) | u64::from(line[1]) << 32;
            named &= id != 0;
            grow &= id > last;
            last = id;
        }
        true
    });
    (sound & named, grow)
}

/// Whether all fibres are sound, in streams of so many objects, materials and nodes.
pub(crate) fn fibres(fibres: &[abi::Fibre], objects: usize, materials: usize, nodes: usize) -> bool {
    let any = Word::ANY;
    let rule = Rule::new([
        Word::index(objects),
        // first_node, node_count: see below
        any,
        Word::range(2, u32::MAX),
        Word::index(materials),
        Word::flags(FIBRE_FLAGS),
        Word::range(*SIDES.start(), *SIDES.end() + 1),
        // variation
        any,
        Word::above_zero(1.0),
        // normal: see below
        any,
        any,
        any,
        Word::ZERO,
        Word::ZERO,
        Word::ZERO,
        Word::ZERO,
        Word::ZERO,
    ]);
    rule.holds(bytemuck::cast_slice(fibres), |lines| {
        bytemuck::cast_slice(lines).iter().fold(true, |good, fibre: &abi::Fibre| {
            let end = u64::from(fibre.first_node) + u64::from(fibre.node_count);
            good & (end <= nodes as u64) & is_unit(fibre.normal)
        })
    })
}

/// Whether all nodes are sound.
pub(crate) fn nodes(nodes: &[abi::FibreNode]) -> bool {
    let position = Word::within(FARTHEST_LOCAL);
    let node = [position, position, position, Word::above_zero(FARTHEST_LOCAL)];
    let rule = Rule::new(std::array::from_fn(|i| node[i % node.len()]));
    let (lines, rest) = nodes.as_chunks::<{ WORDS / 4 }>();
    // A line that is not full is filled with its first node.
    let last = rest.first().map(|first| std::array::from_fn(|i| *rest.get(i).unwrap_or(first)));
    let last: &[[abi::FibreNode; WORDS / 4]] = last.as_slice();
    rule.holds(bytemuck::cast_slice(lines), |_| true) && rule.holds(bytemuck::cast_slice(last), |_| true)
}
