//! What acts on the fibres, as lines: figure 11.

use glam::DVec3;
use reef_sdk::abi::{DebugLine, Flow};

use crate::{
    bed::{Bed, Settings, own},
    reference::{NodeLoad, loads_of},
    shape::DragLaw,
    wide::{Drag, Force},
};

/// Lines at most: more would hide everything.
const MOST_LINES: usize = 20_000;
/// Channel and colour (sRGB 0xAABBGGRR) of the flow's forces A·V: orange.
const FORCES: (u32, u32) = (0, 0xff0a_86f0);
/// Channel and colour of the transmitted moments: crimson.
const MOMENTS: (u32, u32) = (1, 0xff52_1ebe);
/// The longest arrow, in segments of its fibre.
const LONGEST: f64 = 5.0;
/// Length of an arrow's head as a share of the arrow, and at most in segments; its half width as a share of
/// its length.
const HEAD: (f64, f64, f64) = (0.35, 0.9, 0.35);
/// Lines of an arrow.
const ARROW: usize = 5;

/// Which arrows are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    /// Forces and moments.
    Both,
    /// What the flow exerts on the nodes.
    Forces,
    /// What the nodes hand down the chain.
    Moments,
}

/// Forces of the flow at the nodes, as arrows along the force; moduli of the transmitted moments, as arrows
/// across the fibre, the way they push the node below. Each kind is scaled so that its greatest is five
/// segments long.
pub(crate) fn lines(
    bed: &Bed,
    flow: &[Flow],
    settings: &Settings,
    (density, viscosity): (f64, f64),
    shown: Shown,
) -> Vec<DebugLine> {
    let mut loads: Vec<(DVec3, DVec3, f64, NodeLoad)> = Vec::new();
    'all: for batch in &bed.fibres {
        let chunk = &batch.chunk;
        for fibre in 0..chunk.count() {
            let Some(&number) = batch.plants.get(fibre) else { continue };
            let Some(plant) = bed.plants.get(number as usize) else { continue };
            if chunk.is_broken(fibre) {
                continue;
            }
            let shape = chunk.shape(fibre);
            let frame = chunk.root_frame(fibre);
            let nodes: Vec<DVec3> = (0..=chunk.segments()).map(|n| chunk.node(fibre, n).as_dvec3()).collect();
            let directions: Vec<DVec3> =
                (0..chunk.segments()).map(|s| chunk.direction(fibre, s).as_dvec3()).collect();
            let gain = f64::from(settings.drag);
            let law = match (chunk.drag(), settings.force) {
                (Drag::Given, _) => DragLaw::Linear { factor: gain },
                (Drag::Area { coefficient }, Force::Linear) => {
                    DragLaw::linear(density * gain, f64::from(coefficient))
                }
                (Drag::Area { .. }, Force::Quadratic) => {
                    DragLaw::Quadratic { density: density * gain, reynolds: density / viscosity }
                }
            };
            let velocity = |_: usize, at: DVec3| {
                let owner = own::id_of(number);
                let v = reef_flow::reference::velocity(flow, (plant.origin + at).to_array(), owner);
                let surge = if bed.swayed() { batch.surge(fibre, at) } else { DVec3::ZERO };
                DVec3::from(v) * f64::from(settings.current) + surge
            };
            for (i, load) in
                loads_of(&shape, &frame, &nodes, &directions, &law, &velocity).into_iter().enumerate().skip(1)
            {
                if loads.len() * 2 * ARROW >= MOST_LINES {
                    break 'all;
                }
                loads.push((plant.origin + nodes[i], directions[i - 1], shape.lengths[i - 1], load));
            }
        }
    }
    let greatest = |of: &dyn Fn(&NodeLoad) -> f64| {
        loads.iter().map(|(_, _, length, load)| of(load) / length).fold(f64::MIN_POSITIVE, f64::max)
    };
    let force_scale = LONGEST / greatest(&|load| load.flow.length());
    let moment_scale = LONGEST / greatest(&|load| load.moment.length());
    let mut lines = Vec::new();
    for (at, direction, length, load) in &loads {
        let across = direction.cross(load.moment).normalize_or_zero() * -load.moment.length();
        let (force, moment) = (load.flow * force_scale, across * moment_scale);
        if shown != Shown::Moments {
            arrow(*at, force, *direction, length * HEAD.1, FORCES, &mut lines);
        }
        if shown != Shown::Forces {
            arrow(*at, moment, *direction, length * HEAD.1, MOMENTS, &mut lines);
        }
    }
    lines
}

/// A shaft, and a head of four lines, two in the plane of `side` and two across it. `head`: its greatest
/// length [m].
fn arrow(
    from: DVec3,
    delta: DVec3,
    side: DVec3,
    head: f64,
    (channel, color): (u32, u32),
    lines: &mut Vec<DebugLine>,
) {
    let size = delta.length();
    if !size.is_finite() || size == 0.0 {
        return;
    }
    let along = delta / size;
    let head = head.min(size * HEAD.0);
    let across = along.cross(side).try_normalize().unwrap_or_else(|| along.any_orthonormal_vector());
    let mut line = |from: DVec3, delta: DVec3| {
        lines.push(DebugLine {
            from: from.to_array(),
            delta: delta.as_vec3().to_array(),
            color,
            channel,
            ..DebugLine::default()
        });
    };
    line(from, delta);
    for out in [across, -across, along.cross(across), across.cross(along)] {
        line(from + delta, (out * HEAD.2 - along) * head);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arrow_ends_in_a_head_that_is_shorter_than_it() {
        let mut lines = Vec::new();
        arrow(DVec3::ONE, DVec3::new(0.0, 0.0, 2.0), DVec3::Y, 0.3, FORCES, &mut lines);
        assert_eq!(lines.len(), ARROW);
        for barb in &lines[1..] {
            assert_eq!(barb.from, [1.0, 1.0, 3.0], "a barb begins at the point");
            assert!((barb.delta[2] + 0.3).abs() < 1e-6, "and goes back: {:?}", barb.delta);
        }
        let sum: f32 = lines[1..].iter().map(|barb| barb.delta[0] + barb.delta[1]).sum();
        assert!(sum.abs() < 1e-6, "it is even");
        lines.clear();
        arrow(DVec3::ZERO, DVec3::ZERO, DVec3::Y, 0.3, FORCES, &mut lines);
        arrow(DVec3::ZERO, DVec3::NAN, DVec3::Y, 0.3, FORCES, &mut lines);
        assert!(lines.is_empty(), "no force, no arrow");
    }
}
