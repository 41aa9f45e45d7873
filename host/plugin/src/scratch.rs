//! Memory that a plugin borrows for one step. After the first steps it is one block, and nothing is
//! allocated.

use std::{
    alloc::{self, Layout},
    ptr::NonNull,
};

use super::streams::SOIL;

/// Greatest alignment that a plugin may ask for [bytes].
pub(crate) const MAX_ALIGN: u64 = 4096;
/// Most scratch memory of one instance in one step [bytes].
pub(crate) const LIMIT: u64 = 1 << 30;
/// What lies behind each piece, and is looked at when the step is over [bytes].
const FENCE: usize = 256;
const FENCE_BYTE: u8 = 0xc5;
/// Least size of a block [bytes].
const BLOCK: usize = 1 << 16;

/// A bump allocator over blocks.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    blocks: Vec<Block>,
    /// Bytes used in the last block.
    used: usize,
    /// Bytes in all blocks but the last.
    full: usize,
    /// What was lent in this step: where each piece ends, and its size.
    lent: Vec<(NonNull<u8>, usize)>,
}

#[derive(Debug)]
struct Block {
    start: NonNull<u8>,
    layout: Layout,
}

// SAFETY: a block is plain memory that nobody else refers to.
unsafe impl Send for Block {}
// SAFETY: `lent` points into the blocks.
unsafe impl Send for Scratch {}

impl Block {
    /// Zeroed, so that it is initialised memory from the start.
    fn new(size: usize) -> Option<Self> {
        let layout = Layout::from_size_align(size, MAX_ALIGN as usize).ok()?;
        // SAFETY: the size is not 0: callers ask for BLOCK at least.
        let start = NonNull::new(unsafe { alloc::alloc_zeroed(layout) })?;
        Some(Self { start, layout })
    }
}

impl Drop for Block {
    fn drop(&mut self) {
        // SAFETY: allocated in `new` with this layout.
        unsafe { alloc::dealloc(self.start.as_ptr(), self.layout) }
    }
}

impl Scratch {
    /// A new step begins: what was lent is free. Several blocks become one that is large enough for all.
    pub(crate) fn begin_step(&mut self) {
        if self.blocks.len() > 1 {
            let all = self.blocks.iter().map(|block| block.layout.size()).sum::<usize>();
            self.blocks.clear();
            self.blocks.extend(Block::new(all.next_power_of_two()));
        }
        self.used = 0;
        self.full = 0;
        self.lent.clear();
    }

    /// The size of a piece behind which something was written; None: all are as they were lent.
    pub(crate) fn overrun(&self) -> Option<usize> {
        let written = |end: &NonNull<u8>| {
            // SAFETY: `take` left room for the fence behind the piece, within its block, and wrote it.
            let fence = unsafe { std::slice::from_raw_parts(end.as_ptr(), FENCE) };
            fence.iter().any(|byte| *byte != FENCE_BYTE)
        };
        self.lent.iter().find(|(end, _)| written(end)).map(|(_, bytes)| *bytes)
    }

    /// Fills everything that was lent with nonsense: the step is over.
    pub(crate) fn soil(&mut self) {
        for block in &self.blocks {
            // SAFETY: the block's own memory, which nobody may use between two steps.
            unsafe { block.start.as_ptr().write_bytes(SOIL, block.layout.size()) };
        }
    }

    /// `bytes` at a multiple of `align` (a power of two up to [`MAX_ALIGN`]); None: above [`LIMIT`], or no
    /// memory.
    pub(crate) fn take(&mut self, bytes: u64, align: u64) -> Option<NonNull<u8>> {
        if bytes > LIMIT || !align.is_power_of_two() || align > MAX_ALIGN {
            return None;
        }
        let (bytes, align) = (bytes as usize, align as usize);
        let start = self.used.next_multiple_of(align);
        let fits = self.blocks.last().is_some_and(|block| start + bytes + FENCE <= block.layout.size());
        let start = if fits {
            start
        } else {
            let full = self.full + self.blocks.last().map_or(0, |block| block.layout.size());
            if (full + bytes) as u64 > LIMIT {
                return None;
            }
            self.blocks.push(Block::new((bytes + FENCE).max(BLOCK).next_power_of_two())?);
            self.full = full;
            0
        };
        self.used = start + bytes + FENCE;
        let block = self.blocks.last()?;
        // SAFETY: piece and fence are inside the block.
        let (piece, end) = unsafe { (block.start.add(start), block.start.add(start + bytes)) };
        // SAFETY: as above.
        unsafe { end.as_ptr().write_bytes(FENCE_BYTE, FENCE) };
        self.lent.push((end, bytes));
        Some(piece)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_aligned_and_never_overlap() {
        let mut scratch = Scratch::default();
        for _ in 0..3 {
            scratch.begin_step();
            let mut pieces: Vec<(usize, usize)> = Vec::new();
            for (i, align) in [1_u64, 8, 64, 4096, 4, 16].into_iter().cycle().take(60).enumerate() {
                let bytes = 1 + 997 * i;
                let piece = scratch.take(bytes as u64, align).unwrap().as_ptr() as usize;
                assert_eq!(piece % align as usize, 0);
                assert!(pieces.iter().all(|(s, e)| piece + bytes <= *s || *e <= piece));
                pieces.push((piece, piece + bytes));
            }
        }
        assert_eq!(scratch.blocks.len(), 1, "the third step needs one block only");
    }

    #[test]
    fn what_is_written_behind_a_piece_is_seen() {
        let mut scratch = Scratch::default();
        for written in [0, 99, 100, 355] {
            scratch.begin_step();
            let piece = scratch.take(100, 16).unwrap();
            scratch.take(5000, 64).unwrap();
            // SAFETY: within the block.
            unsafe { piece.add(written).write(1) };
            assert_eq!(scratch.overrun(), (written >= 100).then_some(100), "{written}");
        }
    }

    #[test]
    fn too_much_and_odd_alignments_are_refused() {
        let mut scratch = Scratch::default();
        assert!(scratch.take(LIMIT + 1, 8).is_none());
        assert!(scratch.take(8, 3).is_none());
        assert!(scratch.take(8, 8192).is_none());
        assert!(scratch.take(u64::MAX, 8).is_none());
        assert!(scratch.take(0, 1).is_some());
    }
}
