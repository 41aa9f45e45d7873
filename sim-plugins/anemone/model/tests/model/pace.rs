//! Steps that are as long as the load allows: what a singularity has caught rests, and what swings is not
//! held.

use glam::DVec3;
use reef_anemone_model::{
    frame::Frame,
    residual,
    wide::{Drag, StepConstants},
};
use reef_flow::Level;
use reef_sdk::abi::{self, Flow};

use crate::common::*;

const AREA: Drag = Drag::Area { coefficient: 0.5 };
/// Length of a segment of [`tentacle`] [m].
const SEGMENT: f64 = 0.006;

/// Singularities that catch the tip of an upright tentacle at the origin.
fn traps() -> Vec<(&'static str, Vec<Flow>)> {
    let near = DVec3::new(-0.006, 0.05, -0.006);
    let whirlwind = |strength, core| local(abi::FLOW_WHIRLWIND, near, strength, 1.0, core);
    vec![
        ("whirlwind", vec![whirlwind(0.005, 0.01)]),
        ("strong whirlwind", vec![whirlwind(0.02, 0.01)]),
        ("hole", vec![local(abi::FLOW_HOLE, DVec3::new(0.02, 0.04, 0.005), 2e-2, 3.0, 1e-2)]),
        ("source", vec![local(abi::FLOW_SOURCE, DVec3::new(0.004, 0.045, 0.0), 5e-3, 1.0, 1e-2)]),
        (
            "a hole in a current",
            vec![
                local(abi::FLOW_HOLE, DVec3::new(0.03, 0.04, 0.0), 5e-3, 1.0, 1e-2),
                current(DVec3::new(0.05, 0.0, 0.1)),
            ],
        ),
    ]
}

fn settled(flows: &[Flow], tau: f64, dt: f64, seconds: f64) -> Vec<DVec3> {
    let mut chunk = chunk_of(&tentacle(), &[(DVec3::ZERO, Frame::upright(0.0))], AREA, tau);
    run(Level::best(), &mut chunk, flows, &StepConstants::default(), dt, (seconds / dt) as usize);
    nodes(&chunk, 0)
}

#[test]
fn a_caught_tip_rests_in_one_pose_at_every_time_step() {
    for (name, flows) in traps() {
        let limit = settled(&flows, 0.3, 1.0 / 480.0, 30.0);
        for (tau, dt) in
            [(0.3, 0.05), (0.3, 1.0 / 30.0), (0.3, DT), (0.3, 1.0 / 120.0), (1.0, 0.05), (1.0, DT)]
        {
            let pose = settled(&flows, tau, dt, 60.0 * f64::max(tau, 0.5));
            let apart = apart(&pose, &limit);
            assert!(apart < 1e-4 * SEGMENT, "{name}, dt {dt}, τ {tau}: {} L", apart / SEGMENT);
        }
        let left = residual::residual(&tentacle(), &Frame::upright(0.0), &limit, &drag(), &velocity(&flows));
        // The directions of f32 nodes, in a flow that changes by 100 /s.
        assert!(residual::worst(&left) < 2e-5, "{name}: {left:?}");
    }
}

/// Half the way between the ends of the tip's swing [m] in a current along x that swings wholly.
fn swing(period: f64, dt: f64) -> f64 {
    let mut chunk = chunk_of(&tentacle(), &[(DVec3::ZERO, Frame::upright(0.0))], AREA, 0.3);
    let steps = (8.0 * period.max(0.5) / dt) as usize;
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for step in 0..steps {
        let mut flow = current(DVec3::X * 0.2);
        flow.modulation = 1.0;
        let turn = std::f64::consts::TAU;
        flow.phase = (turn * step as f64 * dt / period).rem_euclid(turn) as f32;
        run(Level::best(), &mut chunk, &[flow], &StepConstants::default(), dt, 1);
        if step > steps / 2 {
            let x = nodes(&chunk, 0)[9].x;
            (least, most) = (least.min(x), most.max(x));
        }
    }
    0.5 * (most - least)
}

#[test]
fn a_current_that_swings_swings_the_tip_as_in_the_limit_of_small_steps() {
    for period in [0.25, 1.0 / 3.0, 0.5, 1.0] {
        let limit = swing(period, 1e-3);
        // The least of them is 4.9 mm: a swing that is seen.
        assert!(limit > 4e-3, "{period} s: {limit} m");
        for (dt, allowed) in [(DT, 0.05), (1.0 / 30.0, 0.2)] {
            let error = (swing(period, dt) / limit - 1.0).abs();
            assert!(error < allowed, "period {period} s at dt {dt}: {error}");
        }
    }
}

#[test]
fn fibres_beside_random_singularities_come_to_rest() {
    let mut random = reef_flow::random::Random::new(11, 3);
    let kinds = [abi::FLOW_SOURCE, abi::FLOW_HOLE, abi::FLOW_WHIRLWIND];
    for trial in 0..45 {
        let place =
            DVec3::new(random.between(-0.03, 0.03), random.between(0.0, 0.07), random.between(-0.03, 0.03));
        let flow = [local(
            kinds[trial % 3],
            place,
            random.between(1e-3, 1e-2) as f32,
            random.between(0.3, 1.5) as f32,
            random.between(5e-3, 2e-2) as f32,
        )];
        let mut chunk = chunk_of(&tentacle(), &[(DVec3::ZERO, Frame::upright(0.0))], AREA, 0.3);
        run(Level::best(), &mut chunk, &flow, &StepConstants::default(), 0.05, 3000);
        let before = nodes(&chunk, 0);
        run(Level::best(), &mut chunk, &flow, &StepConstants::default(), 0.05, 1);
        let moved = apart(&before, &nodes(&chunk, 0));
        assert!(moved < 1e-4 * SEGMENT, "trial {trial}: {} L a step, {flow:?}", moved / SEGMENT);
    }
}
