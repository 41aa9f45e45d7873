//! Deferred destruction: what is dropped while frames are in flight lives until the last of them has ended.

use std::{
    collections::VecDeque,
    sync::{Mutex, MutexGuard, PoisonError},
};

use ash::vk;
use gpu_allocator::vulkan::Allocation;

use super::context::Shared;

/// Something that waits for its end.
pub(crate) enum Garbage {
    Buffer(vk::Buffer, vk::BufferView, Allocation),
    Image(vk::Image, vk::ImageView, Allocation),
    Pipeline(vk::Pipeline, vk::PipelineLayout, vk::DescriptorSetLayout),
}

#[derive(Default)]
struct Contents {
    /// Number of the frame that was begun last.
    serial: u64,
    /// Whether that frame is still being recorded.
    recording: bool,
    waiting: VecDeque<(u64, Garbage)>,
}

/// Collects what was dropped, with the frame that may still use it.
#[derive(Default)]
pub(crate) struct Bin {
    contents: Mutex<Contents>,
}

impl Bin {
    /// A frame begins to be recorded: its number.
    pub(crate) fn begin(&self) -> u64 {
        let mut contents = self.lock();
        contents.serial += 1;
        contents.recording = true;
        contents.serial
    }

    /// The frame was submitted, or given up.
    pub(crate) fn end(&self) {
        self.lock().recording = false;
    }

    pub(crate) fn push(&self, garbage: Garbage) {
        let mut contents = self.lock();
        let serial = contents.serial;
        contents.waiting.push_back((serial, garbage));
    }

    /// The frame `serial` and all before it have ended on the device.
    pub(crate) fn collect(&self, shared: &Shared, serial: u64) {
        let mut ended = Vec::new();
        {
            let mut contents = self.lock();
            while contents.waiting.front().is_some_and(|(used, _)| *used <= serial) {
                ended.extend(contents.waiting.pop_front());
            }
        }
        ended.into_iter().for_each(|(_, garbage)| destroy(shared, garbage));
    }

    /// The queue is idle: all that no unfinished recording uses can go.
    pub(crate) fn collect_idle(&self, shared: &Shared) {
        let recording = self.lock().recording;
        if !recording {
            self.empty(shared);
        }
    }

    /// The device is idle and will stay so: everything goes.
    pub(crate) fn empty(&self, shared: &Shared) {
        self.collect(shared, u64::MAX);
    }

    fn lock(&self) -> MutexGuard<'_, Contents> {
        self.contents.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn destroy(shared: &Shared, garbage: Garbage) {
    let allocation = match garbage {
        Garbage::Buffer(buffer, view, allocation) => {
            // SAFETY: no frame uses them any more, and their only owner gave them up; no view is null.
            unsafe {
                shared.device.destroy_buffer_view(view, None);
                shared.device.destroy_buffer(buffer, None);
            }
            allocation
        }
        Garbage::Image(image, view, allocation) => {
            // SAFETY: as above.
            unsafe {
                shared.device.destroy_image_view(view, None);
                shared.device.destroy_image(image, None);
            }
            allocation
        }
        Garbage::Pipeline(pipeline, layout, sets) => {
            // SAFETY: as above.
            unsafe {
                shared.device.destroy_pipeline(pipeline, None);
                shared.device.destroy_pipeline_layout(layout, None);
                shared.device.destroy_descriptor_set_layout(sets, None);
            }
            return;
        }
    };
    free(shared, allocation);
}

/// Gives memory back.
pub(crate) fn free(shared: &Shared, allocation: Allocation) {
    let Ok(allocator) = shared.allocator() else { return };
    let freed = allocator.lock().unwrap_or_else(PoisonError::into_inner).free(allocation);
    if let Err(error) = freed {
        tracing::error!("memory could not be given back: {error}");
    }
}
