//! Which barrier has to stand before a use of a resource: derived from the uses before it, without Vulkan.
//!
//! Each resource carries a [`State`]: the last write (a layout's change counts as one), which stages can
//! already see it, and which stages have read since. A pass's declared accesses are merged into one [`Use`] a
//! resource, and [`State::transition`] says what has to be waited for:
//!
//! - read after write: the write is made available and visible, once for each stage and kind of access;
//! - write after read: the readers are waited for, nothing is flushed;
//! - write after write: the first is made available before the second;
//! - read after read: nothing;
//! - another layout: a write of its own, after everything before it.
//!
//! All work goes to one queue in order, so that a state holds across frames as it does across passes.

use ash::vk::{AccessFlags2 as A, ImageLayout as L, PipelineStageFlags2 as S};

use super::access::Use;

/// The barrier of one resource; layouts are those of an image, equal where it keeps its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Barrier {
    /// Stages that are waited for.
    pub src_stages: S,
    /// Writes that are made available.
    pub src_accesses: A,
    /// Stages that wait.
    pub dst_stages: S,
    /// Accesses that the writes are made visible to.
    pub dst_accesses: A,
    /// The layout before.
    pub old_layout: L,
    /// The layout afterwards.
    pub new_layout: L,
}

/// What has happened to one resource so far.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct State {
    layout: L,
    /// Stages of the last write, and what of it a reader still has to have made available.
    write_stages: S,
    write_accesses: A,
    /// Which single stages can see the last write, and for which accesses.
    visible: Vec<(S, A)>,
    /// Stages that have read since the last write.
    read_stages: S,
}

/// Two accesses of one pass that want an image in two layouts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("one pass cannot have an image in two layouts ({0:?} and {1:?})")]
pub struct LayoutConflict(pub L, pub L);

/// Merges what one pass does with one resource.
pub fn merge(uses: &[Use], image: bool) -> Result<Use, LayoutConflict> {
    let mut merged = Use { stages: S::NONE, accesses: A::NONE, layout: L::UNDEFINED, writes: false };
    for (i, u) in uses.iter().enumerate() {
        if image && i > 0 && u.layout != merged.layout {
            return Err(LayoutConflict(merged.layout, u.layout));
        }
        merged.stages |= u.stages;
        merged.accesses |= u.accesses;
        merged.layout = if image { u.layout } else { L::UNDEFINED };
        merged.writes |= u.writes;
    }
    Ok(merged)
}

impl Default for State {
    fn default() -> Self {
        State::NEW
    }
}

impl State {
    /// A resource that nothing has touched yet; an image's content is undefined.
    pub const NEW: State = State {
        layout: L::UNDEFINED,
        write_stages: S::NONE,
        write_accesses: A::NONE,
        visible: Vec::new(),
        read_stages: S::NONE,
    };

    /// An image that the window system handed over: its content is undefined, and work on it has to wait for
    /// the stage at which the submission waits for the semaphore.
    pub fn acquired(wait_stage: S) -> State {
        State { write_stages: wait_stage, ..State::NEW }
    }

    /// A resource whose uses so far have been waited for by the program: nothing of them is a hazard, and an
    /// image keeps its layout and content.
    pub fn settled(layout: L) -> State {
        State { layout, ..State::NEW }
    }

    /// The layout that an image is in after the last pass.
    pub fn layout(&self) -> L {
        self.layout
    }

    /// Records that the resource is used so next, and says which barrier has to come before.
    pub fn transition(&mut self, next: Use) -> Option<Barrier> {
        let changes_layout = next.layout != L::UNDEFINED && next.layout != self.layout;
        if next.writes || changes_layout { self.write(next, changes_layout) } else { self.read(next) }
    }

    /// Like [`State::transition`], when what the image held before is not wanted.
    pub fn transition_discarding(&mut self, next: Use) -> Option<Barrier> {
        self.layout = L::UNDEFINED;
        self.transition(next)
    }

    fn read(&mut self, next: Use) -> Option<Barrier> {
        self.read_stages |= next.stages;
        let written = self.write_stages != S::NONE;
        if !written || single_stages(next.stages).all(|stage| self.sees(stage, next.accesses)) {
            return None;
        }
        let barrier = Barrier {
            src_stages: self.write_stages,
            src_accesses: self.write_accesses,
            dst_stages: next.stages,
            dst_accesses: next.accesses,
            old_layout: self.layout,
            new_layout: self.layout,
        };
        self.show(next);
        Some(barrier)
    }

    fn write(&mut self, next: Use, changes_layout: bool) -> Option<Barrier> {
        let read_since = self.read_stages != S::NONE;
        let src_stages = if read_since { self.read_stages | self.unread_write() } else { self.write_stages };
        let barrier = (src_stages != S::NONE || changes_layout).then_some(Barrier {
            src_stages,
            // Readers had the write made available already; one that nobody has read has to be now.
            src_accesses: if read_since { A::NONE } else { self.write_accesses },
            dst_stages: next.stages,
            dst_accesses: next.accesses,
            old_layout: self.layout,
            new_layout: if changes_layout { next.layout } else { self.layout },
        });
        if changes_layout {
            self.layout = next.layout;
        }
        self.write_stages = next.stages;
        self.write_accesses = if next.writes { writes_of(next.accesses) } else { A::NONE };
        self.visible.clear();
        self.read_stages = S::NONE;
        if !next.writes {
            // The change of layout wrote, and its barrier made that visible to the reader that asked for it.
            self.show(next);
            self.read_stages = next.stages;
        }
        barrier
    }

    /// Stages of a write that no reader waited for: none as soon as one did, because waiting is transitive.
    fn unread_write(&self) -> S {
        if self.visible.is_empty() { self.write_stages } else { S::NONE }
    }

    fn sees(&self, stage: S, accesses: A) -> bool {
        self.visible.iter().any(|(seen, how)| *seen == stage && how.contains(accesses))
    }

    fn show(&mut self, next: Use) {
        for stage in single_stages(next.stages) {
            match self.visible.iter_mut().find(|(seen, _)| *seen == stage) {
                Some((_, how)) => *how |= next.accesses,
                None => self.visible.push((stage, next.accesses)),
            }
        }
    }
}

/// The accesses that write.
fn writes_of(accesses: A) -> A {
    accesses
        & (A::SHADER_STORAGE_WRITE
            | A::COLOR_ATTACHMENT_WRITE
            | A::DEPTH_STENCIL_ATTACHMENT_WRITE
            | A::TRANSFER_WRITE
            | A::HOST_WRITE)
}

/// Each bit by itself.
fn single_stages(stages: S) -> impl Iterator<Item = S> {
    let raw = stages.as_raw();
    (0..u64::BITS).map(|bit| 1 << bit).filter(move |bit| raw & bit != 0).map(S::from_raw)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::Access;

    fn buffer(access: Access) -> Use {
        merge(&[access.describe(false)], false).expect("buffers have no layout")
    }

    fn image(access: Access) -> Use {
        merge(&[access.describe(false)], true).expect("one access has one layout")
    }

    #[test]
    fn a_first_use_of_a_buffer_waits_for_nothing() {
        for access in [Access::ComputeWrite, Access::VertexRead, Access::TransferDst] {
            let mut state = State::NEW;
            assert_eq!(state.transition(buffer(access)), None);
        }
    }

    #[test]
    fn a_read_after_a_write_waits_and_sees_it() {
        let mut state = State::NEW;
        state.transition(buffer(Access::ComputeWrite));
        let barrier = state.transition(buffer(Access::IndirectRead)).expect("a hazard");
        assert_eq!(barrier.src_stages, S::COMPUTE_SHADER);
        assert_eq!(barrier.src_accesses, A::SHADER_STORAGE_WRITE);
        assert_eq!(barrier.dst_stages, S::DRAW_INDIRECT);
        assert_eq!(barrier.dst_accesses, A::INDIRECT_COMMAND_READ);
    }

    #[test]
    fn a_second_read_by_the_same_stage_needs_no_barrier_and_one_by_another_stage_does() {
        let mut state = State::NEW;
        state.transition(buffer(Access::ComputeWrite));
        assert!(state.transition(buffer(Access::VertexRead)).is_some());
        assert_eq!(state.transition(buffer(Access::VertexRead)), None);
        let other =
            state.transition(buffer(Access::FragmentRead)).expect("the fragment stage has not seen it");
        assert_eq!(other.src_stages, S::COMPUTE_SHADER);
        assert_eq!(other.dst_stages, S::FRAGMENT_SHADER);
    }

    #[test]
    fn the_same_stage_with_another_kind_of_access_needs_its_own_barrier() {
        let mut state = State::NEW;
        state.transition(buffer(Access::ComputeWrite));
        assert!(state.transition(buffer(Access::ComputeRead)).is_some());
        let indexed = Use { accesses: A::SHADER_SAMPLED_READ, ..buffer(Access::ComputeRead) };
        assert!(state.transition(indexed).is_some());
        assert_eq!(state.transition(indexed), None);
    }

    #[test]
    fn reads_after_reads_need_no_barrier() {
        let mut state = State::NEW;
        for access in [Access::VertexRead, Access::ComputeRead, Access::IndexRead, Access::TransferSrc] {
            assert_eq!(state.transition(buffer(access)), None);
        }
    }

    #[test]
    fn a_write_after_reads_waits_for_all_readers_and_flushes_nothing() {
        let mut state = State::NEW;
        state.transition(buffer(Access::VertexRead));
        state.transition(buffer(Access::IndexRead));
        let barrier = state.transition(buffer(Access::TransferDst)).expect("a hazard");
        assert_eq!(barrier.src_stages, S::VERTEX_SHADER | S::INDEX_INPUT);
        assert_eq!(barrier.src_accesses, A::NONE);
        assert_eq!(barrier.dst_stages, S::ALL_TRANSFER);
    }

    #[test]
    fn a_write_after_a_write_is_ordered_and_made_available() {
        let mut state = State::NEW;
        state.transition(buffer(Access::TransferDst));
        let barrier = state.transition(buffer(Access::ComputeWrite)).expect("a hazard");
        assert_eq!((barrier.src_stages, barrier.src_accesses), (S::ALL_TRANSFER, A::TRANSFER_WRITE));
        assert_eq!((barrier.dst_stages, barrier.dst_accesses), (S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE));
    }

    #[test]
    fn a_new_write_has_to_be_seen_anew() {
        let mut state = State::NEW;
        state.transition(buffer(Access::ComputeWrite));
        state.transition(buffer(Access::VertexRead));
        state.transition(buffer(Access::ComputeWrite));
        let barrier =
            state.transition(buffer(Access::VertexRead)).expect("the second write is not visible yet");
        assert_eq!(barrier.src_accesses, A::SHADER_STORAGE_WRITE);
    }

    #[test]
    fn a_frame_after_the_other_waits_for_the_readers_of_the_one_before() {
        let mut state = State::NEW;
        let frame = |state: &mut State| {
            [Access::ComputeWrite, Access::AttributeRead].map(|access| state.transition(buffer(access)))
        };
        let [first, _] = frame(&mut state);
        assert_eq!(first, None);
        let second = frame(&mut state);
        let third = frame(&mut state);
        assert_eq!(second, third, "every frame after the first has the same barriers");
        assert_eq!(second[0].expect("write after read").src_stages, S::VERTEX_ATTRIBUTE_INPUT);
        assert_eq!(second[1].expect("read after write").src_stages, S::COMPUTE_SHADER);
    }

    #[test]
    fn an_image_goes_from_undefined_into_the_layout_of_its_first_use() {
        let mut state = State::NEW;
        let barrier = state.transition(image(Access::ColorAttachment)).expect("a change of layout");
        assert_eq!((barrier.old_layout, barrier.new_layout), (L::UNDEFINED, L::COLOR_ATTACHMENT_OPTIMAL));
        assert_eq!(barrier.src_stages, S::NONE);
        assert_eq!(state.layout(), L::COLOR_ATTACHMENT_OPTIMAL);
    }

    #[test]
    fn an_image_that_was_drawn_is_sampled_after_one_barrier_with_its_layout() {
        let mut state = State::NEW;
        state.transition(image(Access::ColorAttachment));
        let barrier = state.transition(image(Access::FragmentSampled)).expect("read after write");
        assert_eq!(barrier.src_stages, S::COLOR_ATTACHMENT_OUTPUT);
        assert_eq!(barrier.src_accesses, A::COLOR_ATTACHMENT_WRITE);
        assert_eq!(
            (barrier.old_layout, barrier.new_layout),
            (L::COLOR_ATTACHMENT_OPTIMAL, L::SHADER_READ_ONLY_OPTIMAL)
        );
        assert_eq!(state.transition(image(Access::FragmentSampled)), None);
        let compute = state.transition(image(Access::ComputeSampled)).expect("another stage");
        assert_eq!(compute.src_stages, S::FRAGMENT_SHADER, "it chains to the change of layout");
        assert_eq!(compute.src_accesses, A::NONE);
        assert_eq!(compute.old_layout, compute.new_layout);
    }

    #[test]
    fn two_readers_in_two_layouts_are_ordered() {
        let mut state = State::NEW;
        state.transition(image(Access::TransferDst));
        state.transition(image(Access::FragmentSampled));
        let barrier = state.transition(image(Access::TransferSrc)).expect("a change of layout");
        assert_eq!(barrier.src_stages, S::FRAGMENT_SHADER);
        assert_eq!(
            (barrier.old_layout, barrier.new_layout),
            (L::SHADER_READ_ONLY_OPTIMAL, L::TRANSFER_SRC_OPTIMAL)
        );
    }

    #[test]
    fn content_that_is_not_wanted_is_not_kept_but_still_waited_for() {
        let mut state = State::NEW;
        state.transition(image(Access::ColorAttachment));
        state.transition(image(Access::FragmentSampled));
        let barrier =
            state.transition_discarding(image(Access::ColorAttachment)).expect("a change of layout");
        assert_eq!(barrier.old_layout, L::UNDEFINED);
        assert_eq!(barrier.src_stages, S::FRAGMENT_SHADER);
    }

    #[test]
    fn an_acquired_image_waits_for_the_stage_of_its_semaphore_and_ends_presentable() {
        let mut state = State::acquired(S::COLOR_ATTACHMENT_OUTPUT);
        let first = state.transition(image(Access::ColorAttachment)).expect("a change of layout");
        assert_eq!((first.src_stages, first.old_layout), (S::COLOR_ATTACHMENT_OUTPUT, L::UNDEFINED));
        let last = state.transition(image(Access::Present)).expect("a change of layout");
        assert_eq!(last.src_accesses, A::COLOR_ATTACHMENT_WRITE);
        assert_eq!((last.dst_stages, last.new_layout), (S::NONE, L::PRESENT_SRC_KHR));
    }

    #[test]
    fn a_pass_that_reads_and_writes_a_buffer_waits_for_both() {
        let both = merge(&[Access::ComputeRead.describe(false), Access::ComputeWrite.describe(false)], false)
            .expect("buffers have no layout");
        let mut state = State::NEW;
        state.transition(both);
        let again = state.transition(both).expect("write after write");
        assert!(again.dst_accesses.contains(A::SHADER_STORAGE_READ | A::SHADER_STORAGE_WRITE));
        assert_eq!(again.src_accesses, A::SHADER_STORAGE_WRITE);
    }

    #[test]
    fn a_pass_cannot_have_one_image_in_two_layouts() {
        let uses = [Access::FragmentSampled.describe(false), Access::ColorAttachment.describe(false)];
        assert!(merge(&uses, true).is_err());
        assert!(merge(&uses, false).is_ok(), "a buffer has no layout");
        let depth = [Access::FragmentSampled.describe(true), Access::DepthAttachmentRead.describe(true)];
        assert!(merge(&depth, true).is_ok(), "depth is tested and sampled in one read-only layout");
    }
}
