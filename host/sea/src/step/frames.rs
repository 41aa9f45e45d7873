//! The newest frame, and older ones whose memory is used again.

use std::sync::Arc;

use reef_streams::{Outputs, frame::Frame};

/// Frames that are kept for reuse.
const SPARE_FRAMES: usize = 4;

/// The newest frame and a pool of others.
#[derive(Debug)]
pub(crate) struct Frames {
    newest: Arc<Frame>,
    spare: Vec<Arc<Frame>>,
}

impl Frames {
    /// With this frame alone.
    pub(crate) fn new(first: Frame) -> Self {
        Self { newest: Arc::new(first), spare: Vec::new() }
    }

    /// The newest.
    pub(crate) fn newest(&self) -> &Arc<Frame> {
        &self.newest
    }

    /// Makes a frame, with these outputs, the newest; the memory of one that nobody holds any more is used
    /// again.
    pub(crate) fn publish(&mut self, mut frame: Frame, outputs: impl Iterator<Item = Arc<Outputs>>) {
        let mut free = None;
        for at in 0..self.spare.len() {
            if Arc::get_mut(&mut self.spare[at]).is_some() {
                free = Some(self.spare.swap_remove(at));
                break;
            }
        }
        let next = match free {
            Some(mut old) => {
                if let Some(old) = Arc::get_mut(&mut old) {
                    let mut list: Vec<Arc<Outputs>> = std::mem::take(&mut old.outputs);
                    list.clear();
                    list.extend(outputs);
                    frame.outputs = list;
                    *old = frame;
                }
                old
            }
            None => {
                frame.outputs = outputs.collect();
                Arc::new(frame)
            }
        };
        let old = std::mem::replace(&mut self.newest, next);
        if self.spare.len() < SPARE_FRAMES {
            self.spare.push(old);
        }
        // The outputs of a frame that only we hold go back to their modules at once.
        for spare in &mut self.spare {
            if let Some(spare) = Arc::get_mut(spare) {
                spare.outputs.clear();
                spare.flow = self.newest.flow.clone();
            }
        }
    }
}
