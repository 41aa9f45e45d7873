//! A step allocates nothing once it is warm.

use glam::DVec3;
use reef_flow::Level;
use reef_jellyfish_model::{
    bloom::{Birth, Bloom, Surroundings},
    species::Species,
};
use reef_sdk::{
    Workers,
    abi::{self, DrawVertex, FibreNode, Flow},
};

#[global_allocator]
static ALLOCATOR: reef_counting::Counting = reef_counting::Counting;

#[test]
fn a_step_and_its_surface_allocate_nothing_once_warm() {
    let mut species = Species::default();
    species.arms.count = 8;
    (species.grid.cells, species.grid.bells) = (50, 5.0);
    let birth = |i: u64| Birth {
        species: 0,
        place: DVec3::new(i as f64, -3.0, 0.0),
        yaw: 0.0,
        size: 1.0,
        seed: i,
        id: i + 1,
        ..Birth::default()
    };
    let mut bloom = Bloom::new(&[species], &[birth(0), birth(1)]).expect("a bloom");
    let mut vertices = vec![DrawVertex::default(); bloom.vertex_count()];
    let current =
        Flow { kind: abi::FLOW_DIRECTIONAL, axis: [1.0, 0.0, 0.0], strength: 0.1, ..Flow::default() };
    let mut nodes = vec![FibreNode::default(); bloom.node_count()];
    let mut flow = Vec::with_capacity(16);
    flow.push(current);
    let mut counts = 0;
    for step in 0..120 {
        let around = Surroundings { flow: &flow, ..Surroundings::default() };
        let before = reef_counting::of_this_thread();
        bloom.step(&around);
        let into = (&mut vertices[..], &mut nodes[..]);
        bloom.write(Level::best(), Workers::inline(), f64::from(step) / 60.0, into);
        if step >= 20 {
            counts += reef_counting::of_this_thread() - before;
        }
        flow.truncate(1);
        flow.extend_from_slice(bloom.flows());
    }
    assert!(reef_counting::of_this_thread() > 0, "nothing counts");
    assert_eq!(counts, 0);
}
