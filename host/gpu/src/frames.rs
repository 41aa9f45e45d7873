//! Frames in flight: while the device draws one, the program records the next.
//!
//! A fence for each frame says when its command buffer, upload ring and timestamps may be used again, and
//! when what was dropped meanwhile can be destroyed. (Timeline semaphores would do the same; validation
//! layers stall on them.)

use std::sync::Arc;

use ash::vk;

use super::{
    context::{Gpu, Shared},
    error::{Call, GpuError, Result},
    ring::{Ring, Upload},
    timestamps::{Timestamps, Timings},
};

/// After this the device is taken for lost: nothing that Reef draws takes nearly so long.
const PATIENCE_NS: u64 = 60_000_000_000;

struct Slot {
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    /// The number of the frame that the fence belongs to, while it is in flight.
    in_flight: Option<u64>,
    ring: Ring,
    timestamps: Timestamps,
    passes: Vec<String>,
}

/// The frames of one renderer. Record one at a time.
pub struct Frames {
    shared: Arc<Shared>,
    slots: Vec<Slot>,
    next: usize,
    timings: Timings,
    id: u64,
}

impl Frames {
    /// Frames of which `count` (1 to 4) can be on the way at the same time.
    pub fn new(gpu: &Gpu, count: usize) -> Result<Frames> {
        let shared = gpu.shared.clone();
        let id = shared.register("frames", "frames in flight");
        let mut frames = Frames { shared, slots: Vec::new(), next: 0, timings: Timings::default(), id };
        for _ in 0..count.clamp(1, 4) {
            let slot = frames.slot()?;
            frames.slots.push(slot);
        }
        Ok(frames)
    }

    fn slot(&self) -> Result<Slot> {
        let shared = &self.shared;
        let timestamps = Timestamps::new(shared)?;
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(shared.info.family);
        // SAFETY: the device lives, here and below; what was made is destroyed when a later call fails.
        let pool = unsafe { shared.device.create_command_pool(&info, None) }.call("vkCreateCommandPool")?;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        // SAFETY: as above.
        let commands =
            unsafe { shared.device.allocate_command_buffers(&info) }.call("vkAllocateCommandBuffers");
        // SAFETY: as above.
        let fence = unsafe { shared.device.create_fence(&vk::FenceCreateInfo::default(), None) }
            .call("vkCreateFence");
        match (commands, fence) {
            (Ok(commands), Ok(fence)) => {
                shared.name(commands[0], "frame");
                shared.name(fence, "frame");
                Ok(Slot {
                    pool,
                    commands: commands[0],
                    fence,
                    in_flight: None,
                    ring: Ring::new(shared),
                    timestamps,
                    passes: Vec::new(),
                })
            }
            (commands, fence) => {
                // SAFETY: nothing uses them.
                unsafe {
                    shared.device.destroy_command_pool(pool, None);
                    if let Ok(fence) = fence {
                        shared.device.destroy_fence(fence, None);
                    }
                }
                commands?;
                fence?;
                Err(GpuError::Resource {
                    name: "frame".to_owned(),
                    reason: "it could not be made".to_owned(),
                })
            }
        }
    }

    /// How many frames can be on the way at the same time.
    pub fn count(&self) -> usize {
        self.slots.len()
    }

    /// Begins to record the next frame; waits for the one that used its place before.
    pub fn begin(&mut self) -> Result<Frame<'_>> {
        let index = self.next;
        self.retire(index)?;
        let shared = self.shared.clone();
        let slot = &mut self.slots[index];
        slot.ring.reset()?;
        slot.passes.clear();
        // SAFETY: the frame that used the pool has ended.
        unsafe { shared.device.reset_command_pool(slot.pool, vk::CommandPoolResetFlags::empty()) }
            .call("vkResetCommandPool")?;
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer is in its initial state.
        unsafe { shared.device.begin_command_buffer(slot.commands, &info) }.call("vkBeginCommandBuffer")?;
        slot.timestamps.reset(slot.commands);
        shared.shaders.take_offered();
        let serial = shared.bin.begin();
        let commands = slot.commands;
        Ok(Frame { frames: self, shared, commands, index, serial })
    }

    /// Waits until the frame of this number has ended.
    pub fn wait(&mut self, serial: u64) -> Result<()> {
        for index in 0..self.slots.len() {
            if self.slots[index].in_flight.is_some_and(|s| s <= serial) {
                self.retire(index)?;
            }
        }
        Ok(())
    }

    /// Waits until all frames have ended.
    pub fn wait_all(&mut self) -> Result<()> {
        self.wait(u64::MAX)
    }

    /// Times of the newest frame that has ended.
    pub fn timings(&self) -> &Timings {
        &self.timings
    }

    fn retire(&mut self, index: usize) -> Result<()> {
        let slot = &mut self.slots[index];
        let Some(serial) = slot.in_flight else { return Ok(()) };
        // SAFETY: the fence belongs to a submission.
        let waited = unsafe { self.shared.device.wait_for_fences(&[slot.fence], true, PATIENCE_NS) };
        match waited {
            Ok(()) => {}
            Err(vk::Result::ERROR_DEVICE_LOST | vk::Result::TIMEOUT) => {
                return Err(GpuError::DeviceLost { passes: slot.passes.join(", ") });
            }
            Err(result) => return Err(GpuError::Vulkan { call: "vkWaitForFences", result }),
        }
        // SAFETY: the fence is signalled, and no submission uses it.
        unsafe { self.shared.device.reset_fences(&[slot.fence]) }.call("vkResetFences")?;
        slot.in_flight = None;
        if let Some(timings) = slot.timestamps.read(serial)
            && timings.serial > self.timings.serial
        {
            self.timings = timings;
        }
        // One queue: all frames before this one have ended, too.
        self.shared.bin.collect(&self.shared, serial);
        Ok(())
    }
}

impl Drop for Frames {
    fn drop(&mut self) {
        if !self.shared.unregister(self.id) {
            return;
        }
        if let Err(error) = self.wait_all() {
            tracing::error!("{error}");
        }
        for slot in self.slots.drain(..) {
            // SAFETY: no frame is in flight any more.
            unsafe {
                self.shared.device.destroy_fence(slot.fence, None);
                self.shared.device.destroy_command_pool(slot.pool, None);
            }
        }
    }
}

/// What a submission waits for and signals besides its fence.
#[derive(Clone, Copy, Debug, Default)]
pub struct Signals {
    /// A semaphore that is waited for, and the stages that wait.
    pub wait: Option<(vk::Semaphore, vk::PipelineStageFlags2)>,
    /// A semaphore that is signalled when everything has ended.
    pub signal: Option<vk::Semaphore>,
}

/// A frame that is being recorded. Dropped without [`Frame::submit`], nothing of it is drawn.
pub struct Frame<'f> {
    pub(crate) frames: &'f mut Frames,
    pub(crate) shared: Arc<Shared>,
    pub(crate) commands: vk::CommandBuffer,
    index: usize,
    serial: u64,
}

impl Frame<'_> {
    /// The frame's number: greater than those of all frames before.
    pub fn serial(&self) -> u64 {
        self.serial
    }

    /// Which of the frames in flight this is: 0 to [`Frames::count`] − 1.
    pub fn index(&self) -> usize {
        self.index
    }

    /// The command buffer, for what this module does not wrap.
    pub fn commands(&self) -> vk::CommandBuffer {
        self.commands
    }

    /// Copies data to where the device can read it during this frame.
    pub fn upload<T: bytemuck::NoUninit>(&mut self, data: &[T]) -> Result<Upload> {
        self.slot().ring.push(bytemuck::cast_slice(data))
    }

    /// Ends the recording and gives the frame to the device. Returns its number, for [`Frames::wait`].
    pub fn submit(mut self, signals: Signals) -> Result<u64> {
        let shared = self.shared.clone();
        // SAFETY: the command buffer is being recorded, outside of rendering: passes end what they begin.
        unsafe { shared.device.end_command_buffer(self.commands) }.call("vkEndCommandBuffer")?;
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let wait: Vec<_> = signals
            .wait
            .iter()
            .map(|&(semaphore, stages)| {
                vk::SemaphoreSubmitInfo::default().semaphore(semaphore).stage_mask(stages)
            })
            .collect();
        let signal: Vec<_> = signals
            .signal
            .iter()
            .map(|&semaphore| {
                vk::SemaphoreSubmitInfo::default()
                    .semaphore(semaphore)
                    .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            })
            .collect();
        let info = vk::SubmitInfo2::default()
            .command_buffer_infos(&commands)
            .wait_semaphore_infos(&wait)
            .signal_semaphore_infos(&signal);
        let fence = self.slot().fence;
        {
            let queue = shared.queue();
            // SAFETY: the queue is held, the fence is unsignalled and unused, the command buffer is complete.
            unsafe { shared.device.queue_submit2(*queue, &[info], fence) }.call("vkQueueSubmit2")?;
        }
        let serial = self.serial;
        self.slot().in_flight = Some(serial);
        self.frames.next = (self.index + 1) % self.frames.slots.len();
        Ok(serial)
    }

    pub(crate) fn timestamps(&mut self) -> &mut Timestamps {
        &mut self.slot().timestamps
    }

    pub(crate) fn note_pass(&mut self, name: &str) {
        self.slot().passes.push(name.to_owned());
    }

    fn slot(&mut self) -> &mut Slot {
        &mut self.frames.slots[self.index]
    }
}

impl Drop for Frame<'_> {
    fn drop(&mut self) {
        self.shared.bin.end();
    }
}

/// Records commands outside of any frame, and waits until the device has run them: for what happens once.
pub(crate) fn run_once(shared: &Arc<Shared>, record: impl FnOnce(vk::CommandBuffer)) -> Result<()> {
    let device = &shared.device;
    let info = vk::CommandPoolCreateInfo::default()
        .flags(vk::CommandPoolCreateFlags::TRANSIENT)
        .queue_family_index(shared.info.family);
    // SAFETY: the device lives; pool and fence are destroyed below, whatever happens between.
    let pool = unsafe { device.create_command_pool(&info, None) }.call("vkCreateCommandPool")?;
    // SAFETY: as above.
    let fence = unsafe { device.create_fence(&vk::FenceCreateInfo::default(), None) }.call("vkCreateFence");
    let done = fence.and_then(|fence| {
        let ran = submit_and_wait(shared, pool, fence, record);
        // SAFETY: the submission has ended, or the device is lost.
        unsafe { device.destroy_fence(fence, None) };
        ran
    });
    // SAFETY: as above.
    unsafe { device.destroy_command_pool(pool, None) };
    if done.is_ok() {
        shared.bin.collect_idle(shared);
    }
    done
}

fn submit_and_wait(
    shared: &Arc<Shared>,
    pool: vk::CommandPool,
    fence: vk::Fence,
    record: impl FnOnce(vk::CommandBuffer),
) -> Result<()> {
    let device = &shared.device;
    let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
    // SAFETY: the pool is ours alone.
    let commands = unsafe { device.allocate_command_buffers(&info) }.call("vkAllocateCommandBuffers")?[0];
    let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    // SAFETY: the command buffer is new.
    unsafe { device.begin_command_buffer(commands, &info) }.call("vkBeginCommandBuffer")?;
    // After and before everything else on the queue: whoever comes next needs to wait for nothing.
    let everything = [vk::MemoryBarrier2::default()
        .src_stage_mask(super::access::ALL_STAGES)
        .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
        .dst_stage_mask(super::access::ALL_STAGES)
        .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)];
    let barrier = vk::DependencyInfo::default().memory_barriers(&everything);
    // SAFETY: the command buffer is being recorded.
    unsafe { device.cmd_pipeline_barrier2(commands, &barrier) };
    record(commands);
    // SAFETY: as above.
    unsafe { device.cmd_pipeline_barrier2(commands, &barrier) };
    // SAFETY: as above.
    unsafe { device.end_command_buffer(commands) }.call("vkEndCommandBuffer")?;
    let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
    let submit = vk::SubmitInfo2::default().command_buffer_infos(&buffers);
    let queue = shared.queue();
    // SAFETY: the queue is held, the fence is new, the command buffer is complete.
    unsafe { device.queue_submit2(*queue, &[submit], fence) }.call("vkQueueSubmit2")?;
    drop(queue);
    // SAFETY: the fence belongs to the submission.
    unsafe { device.wait_for_fences(&[fence], true, PATIENCE_NS) }.call("vkWaitForFences")
}
