//! What steps emit, beyond what the host looks at in every step.

use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
};

use reef_abi as abi;
use reef_streams::{Outputs, STREAMS, Stream};

use super::{
    sea::Sea,
    step::FULL,
    subject::{Subject, difference, emitted, step},
    table::{Check, Of, Rule::Header},
    verdict::{Not, Outcome, broken, must},
};

pub(super) const CHECKS: &[Check] = &[
    check(
        "output-written",
        "Every byte of every element is written.",
        "what the room holds at first is arbitrary, but initialised. [step]",
        written,
    ),
    check(
        "output-ids",
        "Objects keep their ids from step to step.",
        "stable over steps, reloads and saves; unique within the instance",
        ids,
    ),
    check(
        "output-bounds",
        "The nodes of an object's fibres lie in its bounding sphere.",
        "[m] bounding sphere, relative to origin",
        bounds,
    ),
    check(
        "output-owner",
        "What is done to the water belongs to an object of the instance, or to nobody.",
        "object that emits it; an object does not feel what it emits itself. 0: the scene",
        owner,
    ),
    check(
        "output-parent",
        "An object rides on another one that is there.",
        "id of the object that it rides on, 0: none",
        parent,
    ),
    check("output-phase", "Phases of flow are reduced.", "[rad] reduced modulo 2 pi by who emits it", phase),
    check("output-flatness", "Only blades are flat.", "1 round; below 1 with REEF_FIBRE_BLADE", flatness),
    check(
        "output-jump",
        "An object that jumps says so.",
        "do not blend with the step before (it jumped or wrapped).",
        jump,
    ),
    check(
        "output-unasked",
        "Debug lines and traces are emitted only when they are asked for.",
        "reef_trace, when reef_step.flags has REEF_STEP_TRACE; recordings read it alone",
        unasked,
    ),
];

const fn check(
    name: &'static str,
    about: &'static str,
    rule: &'static str,
    run: fn(&Subject) -> Outcome,
) -> Check {
    Check { name, about, rule: Header(rule), needs: FULL, of: Of::Plugin, run }
}

fn written(subject: &Subject) -> Outcome {
    let (plugin, mut plain) = subject.fresh()?;
    let mut soiled = subject.create(&plugin)?;
    let sea = Sea::full();
    for number in 0..20 {
        step(&mut plain, &sea.input(number), &[])?;
        step(&mut soiled, &sea.input(number), &[])?;
        let (plain, soiled_now) = (emitted(plain.outputs()), emitted(soiled.outputs()));
        if let Some(difference) = difference(&plain, &soiled_now) {
            broken!(
                "with other content in the reserved room, step {number} emits something else: {difference}"
            );
        }
        soiled.soil_outputs();
    }
    Ok(None)
}

/// Looks at what 60 steps in a full sea emit.
fn each(subject: &Subject, mut problem: impl FnMut(&Outputs) -> Option<String>) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    let sea = Sea { flags: abi::STEP_TRACE | abi::STEP_DEBUG, ..Sea::full() };
    let mut last: Option<Arc<Outputs>> = None;
    for number in 0..60 {
        step(&mut instance, &sea.input(number), &[])?;
        let outputs = instance.outputs().clone();
        if last.as_ref().is_some_and(|last| Arc::ptr_eq(last, &outputs)) {
            continue;
        }
        if let Some(problem) = problem(&outputs) {
            broken!("step {number}: {problem}");
        }
        last = Some(outputs);
    }
    match last {
        Some(_) => Ok(None),
        None => Err(Not::There("it emits nothing".into())),
    }
}

/// The first element of a stream that is not as it should be.
fn first<T>(stream: &str, elements: &[T], wrong: impl Fn(&T) -> Option<String>) -> Option<String> {
    let (at, what) = elements.iter().enumerate().find_map(|(at, element)| Some((at, wrong(element)?)))?;
    Some(format!("stream {stream}, element {at}: {what}"))
}

fn ids(subject: &Subject) -> Outcome {
    let mut before: HashSet<u64> = HashSet::new();
    each(subject, |outputs| {
        let now: HashSet<u64> = outputs.objects.iter().map(|object| object.id).collect();
        let strangers = !before.is_empty() && !now.is_empty() && before.is_disjoint(&now);
        before = now;
        strangers.then(|| "no object has an id of the step before".to_owned())
    })
}

fn bounds(subject: &Subject) -> Outcome {
    each(subject, |outputs| {
        let of_fibres = || {
            first("fibre", &outputs.fibres, |fibre| {
                let nodes = part(&outputs.fibre_nodes, fibre.first_node, fibre.node_count)?;
                outside(outputs, fibre.object, "node", nodes.iter().map(|node| node.position))
            })
        };
        let of_joints = || {
            first("skinned", &outputs.skinned, |mesh| {
                let joints = part(&outputs.joints, mesh.first_joint, mesh.joint_count)?;
                outside(outputs, mesh.object, "joint", joints.iter().map(|joint| joint.translation))
            })
        };
        let of_draws = || {
            first("mesh draw", &outputs.mesh_draws, |draw| {
                let vertices = part(&outputs.draw_vertices, draw.first_vertex, draw.vertex_count)?;
                outside(outputs, draw.object, "vertex", vertices.iter().map(|vertex| vertex.position))
            })
        };
        of_fibres().or_else(of_joints).or_else(of_draws)
    })
}

fn part<T>(elements: &[T], first: u32, count: u32) -> Option<&[T]> {
    elements.get(first as usize..)?.get(..count as usize)
}

/// The first of an element's places that is outside of its object's bounds.
fn outside(
    outputs: &Outputs,
    object: u32,
    what: &str,
    places: impl Iterator<Item = [f32; 3]>,
) -> Option<String> {
    let object = outputs.objects.get(object as usize)?;
    places.enumerate().find_map(|(at, place)| {
        let squared: f32 = place.iter().zip(object.bounds_center).map(|(p, c)| (p - c) * (p - c)).sum();
        // A thousandth for rounding.
        let outside = squared.sqrt() > object.bounds_radius * 1.001 + 1e-4;
        outside.then(|| {
            format!(
                "its {what} {at} is {:.4} m from the middle of the bounds of object {}, whose radius is {:.4} m",
                squared.sqrt(),
                object.id,
                object.bounds_radius
            )
        })
    })
}

fn owner(subject: &Subject) -> Outcome {
    each(subject, |outputs| {
        first("flow", &outputs.flows, |flow| {
            let known = flow.owner == 0 || outputs.objects.iter().any(|object| object.id == flow.owner);
            (!known).then(|| format!("its owner {} is no object of this step", flow.owner))
        })
    })
}

fn parent(subject: &Subject) -> Outcome {
    each(subject, |outputs| {
        first("object", &outputs.objects, |object| {
            let known = object.parent == 0
                || outputs.objects.iter().any(|other| other.id == object.parent && other.id != object.id);
            (!known).then(|| format!("its parent {} is no other object of this step", object.parent))
        })
    })
}

fn phase(subject: &Subject) -> Outcome {
    each(subject, |outputs| {
        first("flow", &outputs.flows, |flow| {
            // Either way round the circle, and a rounding.
            let reduced = flow.phase.abs() <= std::f32::consts::TAU + 1e-5;
            (!reduced).then(|| format!("its phase is {}", flow.phase))
        })
    })
}

fn flatness(subject: &Subject) -> Outcome {
    each(subject, |outputs| {
        first("fibre", &outputs.fibres, |fibre| {
            let flat = fibre.flatness < 1.0 && fibre.flags & abi::FIBRE_BLADE == 0;
            flat.then(|| format!("its flatness is {} without REEF_FIBRE_BLADE", fibre.flatness))
        })
    })
}

/// Farther than anything swims in a step [m].
const JUMP: f64 = 5.0;

fn jump(subject: &Subject) -> Outcome {
    let mut before: HashMap<u64, [f64; 3]> = HashMap::new();
    each(subject, |outputs| {
        let wrong = first("object", &outputs.objects, |object| {
            let from = before.get(&object.id)?;
            let way = object.origin.iter().zip(from).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
            let silent = way > JUMP && object.flags & abi::FLAG_NO_BLEND == 0;
            silent.then(|| {
                format!("object {} moved {way:.1} m in a step without REEF_FLAG_NO_BLEND", object.id)
            })
        });
        before = outputs.objects.iter().map(|object| (object.id, object.origin)).collect();
        wrong
    })
}

fn unasked(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    for number in 0..10 {
        step(&mut instance, &Sea::usual().input(number), &[])?;
        for Stream { number: stream, name, .. } in STREAMS.iter().filter(|stream| !stream.is_wanted(0)) {
            let count = instance.committed(*stream).unwrap_or(0);
            must!(
                count == 0,
                "step {number} emitted {count} elements of the stream {name}, and nobody asked"
            );
        }
    }
    Ok(None)
}
