//! How far a pose is from satisfying eq. (10) to (13), node by node. Built on positions alone, so that it
//! judges the pose of any solver, and on the equations as they are printed: F_T against the current segment,
//! tan α = F_T/(k L).

use glam::{DVec2, DVec3};

use crate::{
    frame::Frame,
    math,
    reference::{bends_of, directions_between, loads_of},
    shape::{DragLaw, FibreShape},
};

/// For each segment, the angle [rad] between the bend that the pose shows and the one that eq. (10) asks for.
pub fn residual(
    shape: &FibreShape,
    root_frame: &Frame,
    nodes: &[DVec3],
    law: &DragLaw,
    velocity: &dyn Fn(DVec3) -> DVec3,
) -> Vec<f64> {
    let directions = directions_between(nodes);
    let loads = loads_of(shape, root_frame, nodes, &directions, law, &|_, at| velocity(at));
    bends_of(shape, root_frame, &directions)
        .iter()
        .enumerate()
        .map(|(i, (rest, bend))| {
            let (d, force) = (directions[i], loads[i + 1].net);
            let across = force - d * force.dot(d);
            let angle = math::atan2(across.length() / (shape.stiffness[i] * shape.lengths[i]), 1.0);
            // The joint bends in the plane of its rest direction and the force.
            let toward = rest.to_local(force).truncate().normalize_or_zero();
            // Where the force runs along the rest direction, the plane is free and the bend zero.
            let asked = if toward == DVec2::ZERO { DVec2::ZERO } else { toward * angle };
            (*bend - asked).length()
        })
        .collect()
}

/// The greatest residual of a pose [rad].
pub fn worst(residuals: &[f64]) -> f64 {
    residuals.iter().copied().fold(0.0, f64::max)
}
