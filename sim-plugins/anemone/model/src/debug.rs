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
/// Channel and colour of the flow's forces A·V.
const FORCES: (u32, u32) = (0, 0xff2a_c8ff);
/// Channel and colour of the transmitted moments.
const MOMENTS: (u32, u32) = (1, 0xff3a_5af0);
/// The longest line, in segments of its fibre.
const LONGEST: f64 = 3.0;

/// Forces of the flow at the nodes, as arrows along the force; moduli of the transmitted moments, as bars across the fibre.
/// Each kind is scaled so that its greatest is three segments long.
pub(crate) fn lines(
    bed: &Bed,
    flow: &[Flow],
    settings: &Settings,
    density: f64,
    viscosity: f64,
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
                DVec3::from(v) * f64::from(settings.current)
            };
            for (i, load) in
                loads_of(&shape, &frame, &nodes, &directions, &law, &velocity).into_iter().enumerate().skip(1)
            {
                if loads.len() * 2 >= MOST_LINES {
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
    loads
        .iter()
        .flat_map(|(at, direction, _, load)| {
            let across = direction.cross(load.moment).normalize_or_zero() * -load.moment.length();
            [(FORCES, load.flow * force_scale), (MOMENTS, across * moment_scale)].map(
                |((channel, color), delta)| DebugLine {
                    from: at.to_array(),
                    delta: delta.as_vec3().to_array(),
                    color,
                    channel,
                    ..DebugLine::default()
                },
            )
        })
        .filter(|line| line.delta.iter().all(|v| v.is_finite()))
        .collect()
}
