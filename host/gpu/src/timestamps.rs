//! How long the device takes for each pass: two timestamps around it, read when the frame's fence has passed
//! anyway.

use std::sync::Arc;

use ash::vk;

use super::{
    context::Shared,
    error::{Call, Result},
};

/// Passes a frame whose time is taken; what comes after is run, but not timed.
const MOST_PASSES: u32 = 128;

/// Time of one pass on the device.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    /// The pass's name.
    pub name: String,
    /// In milliseconds.
    pub milliseconds: f64,
}

/// Times of the newest frame that has ended.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timings {
    /// The frame's number.
    pub serial: u64,
    /// In the order in which the passes ran.
    pub passes: Vec<PassTime>,
    /// From the beginning of the first to the end of the last pass, in milliseconds.
    pub milliseconds: f64,
}

/// The timestamps of one frame in flight.
pub(crate) struct Timestamps {
    shared: Arc<Shared>,
    pool: vk::QueryPool,
    names: Vec<String>,
}

impl Timestamps {
    pub(crate) fn new(shared: &Arc<Shared>) -> Result<Timestamps> {
        let mut pool = vk::QueryPool::null();
        if shared.info.timestamp_bits > 0 {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(2 * MOST_PASSES);
            // SAFETY: the device lives.
            pool = unsafe { shared.device.create_query_pool(&info, None) }.call("vkCreateQueryPool")?;
            shared.name(pool, "pass times");
        }
        Ok(Timestamps { shared: shared.clone(), pool, names: Vec::new() })
    }

    /// What the frame that used this before took. Its fence has passed.
    pub(crate) fn read(&self, serial: u64) -> Option<Timings> {
        if self.pool == vk::QueryPool::null() || self.names.is_empty() {
            return None;
        }
        let mut ticks = vec![0u64; 2 * self.names.len()];
        // SAFETY: the queries were written by a frame that has ended, and `ticks` holds as many results.
        unsafe {
            self.shared.device.get_query_pool_results(self.pool, 0, &mut ticks, vk::QueryResultFlags::TYPE_64)
        }
        .ok()?;
        let bits = self.shared.info.timestamp_bits;
        let period = f64::from(self.shared.info.limits.timestamp_period) * 1e-6;
        let span = |from: u64, to: u64| {
            let mask = if bits >= 64 { u64::MAX } else { (1 << bits) - 1 };
            (to.wrapping_sub(from) & mask) as f64 * period
        };
        let passes = self
            .names
            .iter()
            .zip(ticks.chunks_exact(2))
            .map(|(name, t)| PassTime { name: name.clone(), milliseconds: span(t[0], t[1]) })
            .collect();
        Some(Timings { serial, passes, milliseconds: span(ticks[0], ticks[ticks.len() - 1]) })
    }

    /// Forgets the frame before; recorded first into a frame.
    pub(crate) fn reset(&mut self, commands: vk::CommandBuffer) {
        self.names.clear();
        if self.pool != vk::QueryPool::null() {
            // SAFETY: the command buffer is being recorded, outside of rendering.
            unsafe { self.shared.device.cmd_reset_query_pool(commands, self.pool, 0, 2 * MOST_PASSES) };
        }
    }

    /// Before a pass; the number is for [`Timestamps::end`].
    pub(crate) fn begin(&mut self, commands: vk::CommandBuffer, name: &str) -> Option<u32> {
        let pass = self.names.len() as u32;
        if self.pool == vk::QueryPool::null() || pass >= MOST_PASSES {
            return None;
        }
        self.names.push(name.to_owned());
        self.write(commands, 2 * pass, vk::PipelineStageFlags2::BOTTOM_OF_PIPE);
        Some(pass)
    }

    /// After a pass.
    pub(crate) fn end(&self, commands: vk::CommandBuffer, pass: Option<u32>) {
        if let Some(pass) = pass {
            self.write(commands, 2 * pass + 1, vk::PipelineStageFlags2::BOTTOM_OF_PIPE);
        }
    }

    fn write(&self, commands: vk::CommandBuffer, query: u32, stage: vk::PipelineStageFlags2) {
        // SAFETY: the command buffer is being recorded, and each query is written once between two resets.
        unsafe { self.shared.device.cmd_write_timestamp2(commands, stage, self.pool, query) };
    }
}

impl Drop for Timestamps {
    fn drop(&mut self) {
        // SAFETY: the owner has waited for the frame.
        unsafe { self.shared.device.destroy_query_pool(self.pool, None) };
    }
}
