//! A step allocates nothing once it is warm.

#[path = "common/scene.rs"]
mod scene;

use glam::DVec3;
use reef_sdk::{
    Workers,
    abi::{self, Fibre, Flow, Object},
};

#[global_allocator]
static ALLOCATOR: reef_counting::Counting = reef_counting::Counting;

fn around(flow: &[Flow]) -> reef_anemone_model::bed::Surroundings<'_> {
    reef_anemone_model::bed::Surroundings {
        flow,
        obstacles: &[],
        ground: None,
        density: 1000.0,
        viscosity: 1.15e-3,
        dt: 1.0 / 60.0,
        level: reef_flow::Level::best(),
        workers: reef_sdk::Workers::inline(),
    }
}

#[test]
fn a_step_of_36_anemones_or_a_grid_allocates_nothing_once_warm() {
    for path in ["scenes/anemone-fig13-36-anemones.toml", "scenes/anemone-fig12-singularities.toml"] {
        let mut bed = scene::bed(path);
        let mut fish: Vec<Flow> = (0..12)
            .map(|i| Flow {
                kind: abi::FLOW_SOURCE,
                position: [0.1 * f64::from(i), 0.1, 0.0],
                strength: 1e-3,
                peak: 0.5,
                reach: 0.4,
                fade: 0.6,
                ..Flow::default()
            })
            .collect();
        scene::run(&mut bed, &fish, 1.0 / 60.0, 5);
        let mut nodes = vec![[0.0; 4]; bed.node_count()];
        let mut fibres = vec![Fibre::default(); bed.fibre_count()];
        let mut objects = vec![Object::default(); bed.plant_count()];
        let mut swim = |bed: &mut reef_anemone_model::bed::Bed| {
            for step in 0..100 {
                for fish in &mut fish {
                    fish.position[2] = DVec3::splat(0.01 * f64::from(step)).z;
                }
                bed.step(&around(&fish), &Default::default(), &mut nodes);
            }
            bed.write_objects(Workers::inline(), &mut objects);
            bed.write_fibres(Workers::inline(), &mut fibres) + bed.actors().count() + bed.trace().count()
        };
        // The fish's whole way once: every buffer grows to its greatest size.
        assert!(reef_counting::of_this_thread() > 0, "nothing counts");
        swim(&mut bed);
        let before = reef_counting::of_this_thread();
        swim(&mut bed);
        assert_eq!(reef_counting::of_this_thread() - before, 0, "{path}");
    }
}
