//! The nodes as recordings have them: in f64 from the world's origin on, so that lengths and distances that
//! the model keeps are kept in a recording, too. The streams' nodes are these, rounded on the way along each
//! chain to f32.

use glam::DVec3;
use reef_sdk::abi::Trace;

use super::{Batch, Bed, Standing};
use crate::frame::Frame;

impl Bed {
    /// Every node of every fibre that is not broken off. A foot and each of its tentacles are objects of
    /// their own, in that order; what breaks off keeps its number and has no more nodes.
    pub fn trace(&self) -> impl Iterator<Item = Trace> + '_ {
        self.plants.iter().flat_map(move |plant| {
            let carrier = self.carrier(plant);
            plant.fibres.clone().flat_map(move |number| {
                let spot = self.listed.get(number).map(|fibre| fibre.spot);
                let found = spot.and_then(|spot| Some((self.batch(&spot)?, usize::from(spot.lane))));
                let whole = found.filter(|(batch, lane)| !batch.chunk.is_broken(*lane));
                whole.into_iter().flat_map(move |(batch, lane)| {
                    let carrier = if batch.is_riding() { carrier } else { (plant.origin, plant.stand) };
                    (0..).zip(batch.chain(lane, carrier)).map(move |(node, position)| Trace {
                        object: number as u64,
                        position: position.to_array(),
                        radius: batch.chunk.radius(lane, node as usize),
                        node,
                        kind: 0,
                        ..Trace::default()
                    })
                })
            })
        })
    }

    /// Nodes in [`Self::trace`] at most.
    pub fn trace_len(&self) -> usize {
        self.nodes
    }

    /// What a plant's fibres ride on: the top of its foot [m, world], or the plant's stand.
    fn carrier(&self, plant: &Standing) -> (DVec3, Frame) {
        let foot = plant.foot.and_then(|spot| Some((self.batch(&spot)?, usize::from(spot.lane))));
        let top = foot.and_then(|(feet, lane)| feet.chain(lane, (plant.origin, plant.stand)).last());
        top.map_or((plant.origin, plant.stand), |top| (top, plant.top.1))
    }
}

impl Batch {
    /// The nodes of a fibre on a carrier, root first [m, world]: its own lengths along its directions.
    fn chain(&self, lane: usize, (origin, frame): (DVec3, Frame)) -> impl Iterator<Item = DVec3> + '_ {
        let root = origin + frame.to_world(self.chunk.place(lane).offset);
        let segments = self.chunk.segments();
        let lengths = self.lengths.iter().skip(lane * segments).take(segments).enumerate();
        let ends = lengths.scan(root, move |node, (segment, length)| {
            let direction = self.chunk.direction(lane, segment).as_dvec3().normalize_or_zero();
            *node += direction * *length;
            Some(*node)
        });
        core::iter::once(root).chain(ends)
    }
}
