//! One worker or many: the same bytes.

use glam::DVec3;
use reef_flow::Level;
use reef_jellyfish_model::{
    bloom::{Birth, Bloom, BloomState, Surroundings},
    species::Species,
};
use reef_model_tests::threads::with_workers;
use reef_sdk::{
    Workers,
    abi::{DrawVertex, FibreNode, Flow},
};

fn run(workers: Workers<'_>) -> (BloomState, Vec<Flow>, Vec<DrawVertex>, Vec<[u32; 3]>) {
    let mut species = Species::default();
    (species.grid.cells, species.grid.bells) = (32, 5.0);
    let birth = |i: u64| Birth {
        species: 0,
        place: DVec3::new(0.2 * i as f64, -3.0, 0.0),
        yaw: i as f64,
        size: 1.0,
        seed: i,
        id: i + 1,
        ..Birth::default()
    };
    let births: Vec<Birth> = (0..7).map(birth).collect();
    let mut bloom = Bloom::new(&[species], &births).expect("a bloom");
    let mut flow = Vec::new();
    for _ in 0..40 {
        let around = Surroundings { flow: &flow, depth: 9.0, workers, ..Surroundings::default() };
        bloom.step(&around);
        flow = bloom.flows().to_vec();
    }
    let mut vertices = vec![DrawVertex::default(); bloom.vertex_count()];
    let mut nodes = vec![FibreNode::default(); bloom.node_count()];
    bloom.write(Level::best(), workers, 1.0, (&mut vertices, &mut nodes));
    let nodes = nodes.iter().map(|node| node.position.map(f32::to_bits)).collect();
    (bloom.save(), flow, vertices, nodes)
}

#[test]
fn one_worker_or_four_give_the_same_bytes() {
    let one = run(Workers::inline());
    for _ in 0..2 {
        assert!(with_workers(4, run) == one);
    }
}
