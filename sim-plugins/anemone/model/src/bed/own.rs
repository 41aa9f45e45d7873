//! What a plant emits itself does not act on it (`reef_flow.owner`): on all of the plant, since its foot and
//! its fibres are one object.
//!
//! Fibres that ride on one foot have a batch of their own, whose flow then simply lacks what the plant emits.
//! Where a batch has fibres of several plants, those of a plant that emits are stepped once more, from the
//! same pose in the water that they feel, and their lanes take the place of the first ones. A sea in which no
//! plant emits anything pays nothing for it.

use reef_sdk::abi::Flow;

use crate::wide::Chunk;

/// The object that a plant is, by its place in the bed.
pub(crate) fn id_of(plant: u32) -> u64 {
    u64::from(plant) + 1
}

/// Lists the plants, of `count`, that emit some of this flow, ascending. Reuses `emitters`.
pub(super) fn list_emitters(flow: &[Flow], count: usize, emitters: &mut Vec<u32>) {
    emitters.clear();
    let ours = |owner: u64| owner.checked_sub(1).filter(|plant| *plant < count as u64);
    // A bed has far fewer plants than 2³².
    emitters.extend(flow.iter().filter_map(|flow| ours(flow.owner)).map(|plant| plant as u32));
    emitters.sort_unstable();
    emitters.dedup();
}

/// Room to step some plants of a batch apart from the others.
#[derive(Clone, Debug)]
pub(super) struct Apart {
    before: Chunk,
    own: Chunk,
    nodes: Vec<[f32; 4]>,
}

/// Steps a batch, whose fibres belong to `plants`, each plant in the water without what it emits itself.
/// `step` steps a chunk in the flow without what an object (0: nobody) emits, and writes its nodes, where
/// there is room for them.
pub(super) fn step(
    chunk: &mut Chunk,
    plants: &[u32],
    emitters: &[u32],
    apart: &mut Option<Box<Apart>>,
    nodes: &mut [[f32; 4]],
    mut step: impl FnMut(&mut Chunk, u64, &mut [[f32; 4]]),
) {
    let emits = |plant: &u32| emitters.binary_search(plant).is_ok();
    let Some(first) = plants.first().filter(|_| !emitters.is_empty() && plants.iter().any(emits)) else {
        return step(chunk, 0, nodes);
    };
    if plants.iter().all(|plant| plant == first) {
        return step(chunk, id_of(*first), nodes);
    }
    let fresh = || Box::new(Apart { before: chunk.clone(), own: chunk.clone(), nodes: Vec::new() });
    let Apart { before, own, nodes: own_nodes } = &mut **apart.get_or_insert_with(fresh);
    // None in a step that nobody looks at.
    own_nodes.resize(nodes.len(), [0.0; 4]);
    before.become_like(chunk);
    step(chunk, 0, nodes);
    let long = chunk.segments() + 1;
    let mut fibre = 0;
    for fibres in plants.chunk_by(|a, b| a == b) {
        let here = fibre..fibre + fibres.len();
        fibre = here.end;
        let Some(plant) = fibres.first().filter(|plant| emits(plant)) else { continue };
        own.become_like(before);
        step(own, id_of(*plant), own_nodes);
        for fibre in here.clone() {
            chunk.take_fibre(fibre, own);
        }
        let here = here.start * long..here.end * long;
        if let (Some(into), Some(from)) = (nodes.get_mut(here.clone()), own_nodes.get(here)) {
            into.copy_from_slice(from);
        }
    }
}
