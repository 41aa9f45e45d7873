//! Frames of segments, and lines.

use glam::{Quat, Vec3};
use reef_fish_model::frames::{axes, sections};
use reef_sdk::abi::Joint;

use crate::{
    DT, drive, implicit, one,
    shoal::{around, shoal},
    step, usual,
};

fn frames(plan: &reef_fish_model::Plan, positions: &[[f32; 3]], size: f32) -> Vec<Joint> {
    let mut frames = vec![Joint::default(); plan.body().segments().len()];
    sections(plan, positions, size, &mut frames);
    frames
}

#[test]
fn at_rest_all_frames_look_forward_from_the_middles_of_segments() {
    let plan = usual();
    let rest: Vec<[f32; 3]> = plan.body().nodes().iter().map(|at| at.as_vec3().to_array()).collect();
    let frames = frames(&plan, &rest, 2.0);
    assert_eq!(frames.len(), 7);
    for (frame, nodes) in frames.iter().zip(plan.body().segments()) {
        let turn = Quat::from_array(frame.rotation);
        assert!((turn * Vec3::X - Vec3::X).length() < 1e-6 && (turn * Vec3::Y - Vec3::Y).length() < 1e-6);
        let middle = plan.body().nodes()[nodes.clone()].iter().sum::<glam::DVec3>() / nodes.len() as f64;
        assert!((Vec3::from(frame.translation) - 2.0 * middle.as_vec3()).length() < 1e-6);
        assert_eq!(frame.scale, 2.0);
    }
}

#[test]
fn frames_turn_with_a_fish_that_is_squeezed() {
    let plan = usual();
    let turn = Quat::from_rotation_y(0.7) * Quat::from_rotation_z(0.3);
    let moved: Vec<[f32; 3]> = plan
        .body()
        .nodes()
        .iter()
        .map(|at| (turn * (at.as_vec3() * Vec3::new(1.0, 1.2, 0.9))).to_array())
        .collect();
    for (i, frame) in frames(&plan, &moved, 1.0).iter().enumerate() {
        let own = Quat::from_array(frame.rotation);
        assert!((own * Vec3::X - turn * Vec3::X).length() < 1e-5, "{i}");
        assert!((own * Vec3::Y - turn * Vec3::Y).length() < 1e-5, "{i}");
    }
}

#[test]
fn a_swimming_fish_keeps_its_frames_unit_and_bends_them() {
    let plan = usual();
    let mut tank = one(usual(), drive(2.0, 0.2));
    let mut most: f32 = 0.0;
    for _ in 0..(3.0 / DT) as usize {
        step(&mut tank, DT, &implicit());
        let frames = frames(&plan, tank.positions(0), 1.0);
        let [forward, up, right] = axes(&plan, tank.positions(0));
        assert!(forward.dot(up).abs() < 1e-5 && (forward.cross(up) - right).length() < 1e-5);
        let way = |i: usize| Quat::from_array(frames[i].rotation) * Vec3::X;
        assert!((0..7).all(|i| (Quat::from_array(frames[i].rotation).length() - 1.0).abs() < 1e-5));
        most = most.max(way(1).angle_between(way(5)));
        // The tail fin's corners are its nodes.
        let fin = frames[6];
        for node in [21, 22] {
            let at = |node: usize| plan.body().nodes()[node].as_vec3();
            let rest = at(node) - 0.5 * (at(21) + at(22));
            let corner = Vec3::from(fin.translation) + fin.scale * (Quat::from_array(fin.rotation) * rest);
            assert!(corner.distance(Vec3::from(tank.positions(0)[node])) < 1e-6, "{corner}");
        }
    }
    println!("bends by up to {most:.2} rad");
    assert!(most > 0.1);
}

#[test]
fn lines_show_every_spring_and_colour_muscles_by_contraction() {
    let mut shoal = shoal(1, 8.0);
    let mut colours = std::collections::BTreeSet::new();
    for _ in 0..120 {
        shoal.step(&around(1e9));
        let mut lines = Vec::new();
        shoal.lines(0, &mut lines);
        assert_eq!(lines.len(), 91);
        assert_eq!(lines.iter().filter(|line| line.channel == 1).count(), 12);
        colours.extend(lines.iter().filter(|line| line.channel == 1).map(|line| line.color));
    }
    assert!(colours.len() > 20);
}
