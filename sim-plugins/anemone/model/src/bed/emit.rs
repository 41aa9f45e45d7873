//! What a bed looks like in the streams.

use reef_sdk::abi::{self, Actor, Material, Object, Trace};

use super::Bed;

impl Bed {
    /// Materials: they never change.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// One object a plant.
    pub fn objects(&self) -> impl Iterator<Item = Object> + '_ {
        (1_u64..).zip(&self.plants).map(|(id, plant)| Object {
            id,
            origin: plant.origin.to_array(),
            bounds_radius: plant.reach as f32,
            ..Object::default()
        })
    }

    /// The plants that others perceive: the crowns.
    pub fn actors(&self) -> impl Iterator<Item = Actor> + '_ {
        (1_u64..).zip(&self.plants).filter(|(_, plant)| plant.species != 0).map(|(id, plant)| Actor {
            id,
            position: (plant.origin + plant.top.0).to_array(),
            radius: plant.crown as f32,
            forward: plant.top.1.z.as_vec3().to_array(),
            species: plant.species,
            ..Actor::default()
        })
    }

    /// All fibres that are not broken off, plant by plant, the foot first.
    pub fn fibres(&self) -> impl Iterator<Item = abi::Fibre> + '_ {
        self.spots.iter().zip(&self.templates).filter_map(|(spot, template)| {
            let chunk = &self.batch(spot)?.chunk;
            let lane = spot.lane as usize;
            let normal = chunk.normal(lane).to_array();
            (!chunk.is_broken(lane)).then_some(abi::Fibre { normal, ..*template })
        })
    }

    /// Every node as recordings see it: a foot and each of its tentacles are objects of their own, in that order.
    pub fn trace(&self) -> impl Iterator<Item = Trace> + '_ {
        let all = self
            .plants
            .iter()
            .flat_map(|plant| self.spots[plant.fibres.clone()].iter().map(move |spot| (plant, spot)));
        (0_u64..).zip(all).flat_map(move |(object, (plant, spot))| {
            let chunk = self.batch(spot).map(|batch| &batch.chunk);
            let lane = spot.lane as usize;
            chunk.into_iter().flat_map(move |chunk| {
                (0..spot.nodes).map(move |node| Trace {
                    object,
                    position: (plant.origin + chunk.node(lane, node as usize).as_dvec3()).to_array(),
                    radius: chunk.radius(lane, node as usize),
                    node,
                    kind: abi::TRACE_FIBRE,
                    ..Trace::default()
                })
            })
        })
    }

    /// Nodes in [`Self::trace`].
    pub fn trace_len(&self) -> usize {
        self.nodes
    }
}
