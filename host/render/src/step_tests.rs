//! What of two steps is brought to the device, and when.

use std::sync::Arc;

use glam::DVec3;
use reef_abi as abi;
use reef_streams::{Outputs, frame::Frame};

use super::{Quality, Settings, Shot, device_tests::open, gather, meshes::sample::Models, sample};
use crate::studio::Studio;

/// Fibres, skinned meshes and one that is drawn anew.
fn sea(step: u64, sway: f32) -> Frame {
    let camera = sample::looking_at(DVec3::new(0.15, -3.45, 1.5), DVec3::new(0.0, -3.62, 0.0));
    let mut frame = sample::frame(step, camera, sample::garden(&sample::environment(), sway));
    let models = Models::default();
    let mut outputs = models.empty();
    models.fish(&mut outputs, [0.2, -3.4, 0.0], 0.0, sway);
    models.bell(&mut outputs, [-0.3, -3.3, 0.0], 0.5, sway);
    frame.outputs.push(Arc::new(outputs));
    frame
}

/// Bytes of the streams that a step has by itself.
fn own(frame: &Frame) -> usize {
    let of = |o: &Arc<Outputs>| {
        size_of_val(&o.fibre_nodes[..]) + size_of_val(&o.joints[..]) + size_of_val(&o.draw_vertices[..])
    };
    frame.outputs.iter().map(of).sum()
}

/// Bytes of what is gathered from two steps.
fn shared(frame: &Frame) -> usize {
    let of = |o: &Arc<Outputs>| {
        o.fibres.len() * size_of::<gather::GpuFibre>() + o.materials.len() * size_of::<abi::Material>()
    };
    frame.outputs.iter().map(of).sum()
}

#[test]
fn a_step_is_brought_once_however_many_pictures_show_it() {
    let Some(gpu) = open() else { return };
    let environment = sample::environment();
    let steps = [0.0, 0.1, 0.2].map(|sway| sea(1 + (sway * 10.0) as u64, sway));
    let mut studio = Studio::new(&gpu, (160, 90)).expect("a studio");
    let mut brought = |[previous, current]: [&Frame; 2], alpha: f32, x: f64, quality: Quality| {
        let camera = sample::looking_at(DVec3::new(x, -3.45, 1.5), DVec3::new(0.0, -3.62, 0.0));
        let shot = Shot { previous, current, alpha, camera, environment: &environment };
        studio.run(&shot, &Settings::of(quality)).expect("a picture");
        studio.renderer().brought() as usize
    };
    let [a, b, c] = &steps;
    assert!(own(a) > 10_000 && shared(a) > 10_000, "{} and {}", own(a), shared(a));
    assert_eq!(brought([a, b], 0.2, 0.1, Quality::Low), own(a) + own(b) + shared(b));
    // Another moment, another place, another quality.
    assert_eq!(brought([a, b], 0.7, 0.3, Quality::Low), 0);
    assert_eq!(brought([a, b], 1.0, 0.3, Quality::High), 0);
    // The next step alone.
    assert_eq!(brought([b, c], 0.1, 0.3, Quality::Low), own(c) + shared(c));
    assert_eq!(brought([b, c], 0.9, 0.1, Quality::Low), 0);
    // Steps that stand still, and one that no picture showed for a while: it was let go.
    assert_eq!(brought([c, c], 0.5, 0.1, Quality::Low), shared(c));
    assert_eq!(brought([a, c], 0.5, 0.1, Quality::Low), own(a) + shared(c));
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn a_module_that_was_not_there_before_stands_where_it_is() {
    let Some(gpu) = open() else { return };
    let environment = sample::environment();
    let mut studio = Studio::new(&gpu, (160, 90)).expect("a studio");
    // What is new has fibres, and the module before it none.
    let mut current = sea(2, 0.2);
    current.outputs.reverse();
    let mut previous = current.clone();
    previous.outputs.truncate(1);
    let camera = current.camera;
    let mut picture = |previous: &Frame, quality: Quality| {
        let shot = Shot { previous, current: &current, alpha: 0.3, camera, environment: &environment };
        studio.shoot(&shot, &Settings::of(quality)).expect("a picture").rgba
    };
    for quality in [Quality::Low, Quality::High] {
        let [new, old] = [&previous, &current].map(|previous| picture(previous, quality));
        let off = new.iter().zip(&old).map(|(a, b)| a.abs_diff(*b)).max();
        let many = new.iter().zip(&old).filter(|(a, b)| a.abs_diff(**b) > 1).count();
        println!("{quality:?}: {off:?}, {many}");
        assert!(off <= Some(1), "{quality:?}: {off:?}");
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}
