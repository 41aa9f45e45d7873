//! After the first steps, a step allocates nothing: neither the host nor the SDK. A program of its own,
//! because it counts every allocation of the process.

use std::{sync::Arc, time::Duration};

use reef_plugin::{Library, StepStatus};
use reef_sdk::prelude::*;
use reef_streams::Outputs;
use reef_tests::sea::{Sea, config};

#[global_allocator]
static ALLOCATOR: reef_counting::Counting = reef_counting::Counting;

/// Uses every service of a step.
struct Busy;

#[derive(serde::Deserialize, schemars::JsonSchema)]
struct Nothing {}

const POINTS: usize = 1000;

impl Plugin for Busy {
    const ID: &'static str = "test.busy";
    const NAME: &'static str = "Busy";
    const VERSION: &'static str = "1.0.0";
    const VENDOR: &'static str = "Reef's tests";
    const DESCRIPTION: &'static str = "Uses every service of a step.";
    const STATE_VERSION: u32 = 1;
    const STATE_MIN_VERSION: u32 = 1;
    type Config = Nothing;

    fn create(_: &Host, _: &SceneInfo, _: Nothing) -> Result<Self, ConfigError> {
        Ok(Self)
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        let [x, v] = [input.scratch::<f32>(POINTS)?, input.scratch::<f32>(3 * POINTS)?];
        let (vx, rest) = v.split_at_mut(POINTS);
        let (vy, vz) = rest.split_at_mut(POINTS);
        input.sample_flow([0.0; 3], 0, [x, x, x], [vx, vy, vz])?;
        let nodes = output.reserve::<abi::FibreNode>(2 * POINTS)?;
        input.workers().for_each_part((Chunks::new(vx, 50), Chunks::new(nodes, 100)), |_, (vx, nodes)| {
            for (vx, nodes) in vx.iter().zip(nodes.chunks_exact_mut(2)) {
                for (k, node) in nodes.iter_mut().enumerate() {
                    *node = abi::FibreNode { position: [*vx * k as f32, k as f32, 0.0], radius: 0.1 };
                }
            }
        });
        output.commit::<abi::FibreNode>(2 * POINTS)?;
        output.emit(&[abi::Object { id: 1, ..Default::default() }])?;
        output.emit(&[abi::Material::default()])?;
        let fibres = output.reserve::<abi::Fibre>(POINTS)?;
        for (i, fibre) in fibres.iter_mut().enumerate() {
            *fibre = abi::Fibre {
                first_node: 2 * i as u32,
                node_count: 2,
                sides: 8,
                flatness: 1.0,
                normal: [1.0, 0.0, 0.0],
                ..Default::default()
            };
        }
        output.commit::<abi::Fibre>(POINTS)?;
        Ok(Status::Ok)
    }

    fn save(&self, _: &mut StateWriter) {}

    fn load(&mut self, _: &mut StateReader) -> Result<(), StateError> {
        Ok(())
    }
}

#[test]
fn after_the_first_steps_a_step_allocates_nothing() {
    let (_, plugins) = Library::from_entry(reef_sdk::entry::<Busy>(), 2).unwrap();
    let mut instance = plugins[0].create(&config("{}")).unwrap();
    let sea = Sea::default();
    // As the renderer does: the last two outputs are held while the next ones are made.
    let mut held: [Arc<Outputs>; 2] = Default::default();
    let mut step = |number| {
        assert_eq!(instance.step(&sea.input(number), &[]).status, StepStatus::Ok);
        held.swap(0, 1);
        held[1] = instance.outputs().clone();
    };
    // Ten steps take less than a busy machine may need to begin the worker's thread, which allocates: that is
    // waited for.
    let mut number = 0;
    let mut steps = |count: u64| {
        let before = reef_counting::of_all_threads();
        (0..count).for_each(|_| {
            number += 1;
            step(number);
        });
        reef_counting::of_all_threads() - before
    };
    assert!(steps(10) > 0, "nothing counts");
    let quiet = (0..100).find(|_| {
        std::thread::sleep(Duration::from_millis(20));
        steps(100) == 0
    });
    assert!(quiet.is_some(), "a hundred steps allocate, however often they are made");
    assert_eq!(steps(2000), 0, "allocations in 2000 steps");
    assert_eq!(held[1].fibres.len(), POINTS);
}
