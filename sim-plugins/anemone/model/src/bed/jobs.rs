//! Batches in jobs of a few, which the workers share.

use reef_flow::simd::Ahead;
use reef_sdk::{Chunks, Parts, Workers};

use super::Batch;

/// A wave's batches in jobs of a few.
#[derive(Clone, Debug, Default)]
pub(super) struct Jobs {
    /// Batches in a job.
    pub(super) batches: usize,
    /// Where each job's nodes begin, one more at the end; from the wave's first node.
    pub(super) nodes: Vec<usize>,
}

/// Gives each batch with its nodes (none, where `nodes` is empty) to `work`, and what the one after it needs,
/// so that it is near by then. Who takes which batches changes nothing.
pub(super) fn each_batch(
    workers: Workers<'_>,
    batches: &mut [Batch],
    nodes: &mut [[f32; 4]],
    jobs: &Jobs,
    work: impl Fn(&mut Batch, &mut [[f32; 4]], &mut Ahead) + Sync,
) {
    let all = |batches: &mut [Batch], mut nodes: &mut [[f32; 4]]| {
        for at in 0..batches.len() {
            let (batch, after) = batches[at..].split_at_mut(1);
            let (batch, next) = (&mut batch[0], after.first());
            let count = batch.chunk.nodes().min(nodes.len());
            let (own, rest) = core::mem::take(&mut nodes).split_at_mut(count);
            let mut ahead = Ahead::none();
            if let Some(next) = next {
                next.chunk.needs(&batch.chunk, &mut ahead);
                ahead.add(&rest[..next.chunk.nodes().min(rest.len())]);
            }
            work(batch, own, &mut ahead);
            nodes = rest;
        }
    };
    let batches = Chunks::new(batches, jobs.batches);
    if nodes.is_empty() {
        workers.for_each_part(batches, |_, batches| all(batches, &mut []));
    } else {
        let parts = (batches, Parts::new(nodes, &jobs.nodes));
        workers.for_each_part(parts, |_, (batches, nodes)| all(batches, nodes));
    }
}
