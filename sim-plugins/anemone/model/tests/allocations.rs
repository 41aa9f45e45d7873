//! A step allocates nothing once it is warm.

#[path = "common/scene.rs"]
mod scene;

use glam::DVec3;
use reef_anemone_model::bed::{Bed, Settings, Surroundings};
use reef_sdk::{
    Workers,
    abi::{self, Camera, Fibre, Flow, Object, Wave},
};

#[global_allocator]
static ALLOCATOR: reef_counting::Counting = reef_counting::Counting;

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
        let train = |i: u8| Wave {
            amplitude: 0.05 / f32::from(i + 1),
            wave_number: 0.2 * f32::from(i + 1),
            frequency: 1.2,
            direction: [0.8, 0.6],
            ..Wave::default()
        };
        let mut waves: Vec<Wave> = (0..30).map(train).collect();
        let mut eye = Camera { fov_y: 0.9, width: 640, height: 360, ..Camera::default() };
        let mut swim = |bed: &mut Bed| {
            for step in 0..100 {
                for fish in &mut fish {
                    fish.position[2] = DVec3::splat(0.01 * f64::from(step)).z;
                }
                waves.iter_mut().for_each(|wave| wave.phase = 0.05 * step as f32);
                eye.position[2] = 0.2 * f64::from(step);
                let around = Surroundings {
                    flow: &fish,
                    waves: &waves,
                    camera: Some(&eye),
                    ..Surroundings::default()
                };
                bed.step(&around, &Settings::default(), &mut nodes);
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
