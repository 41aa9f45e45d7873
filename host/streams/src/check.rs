//! Looks at everything that a step emitted before the host uses any of it. A message names stream, index and field.

use std::{
    fmt::Display,
    ops::{Range, RangeInclusive},
    sync::atomic::{AtomicBool, Ordering},
};

use crate::{
    Outputs, glance,
    textures::{self, TextureList},
};
use reef_abi as abi;

pub(crate) mod meshes;

/// Farthest that anything may be from the origin of the world [m].
pub const FARTHEST: f64 = 1e6;
/// Farthest that an element may be from its object's origin [m].
pub const FARTHEST_LOCAL: f32 = 1e5;
/// How far the squared length of a unit vector may be from 1: several roundings of an f32 normalisation (1e-7), and room
/// for a vector that was carried along many segments.
const UNIT_TOLERANCE: f32 = 1e-3;
/// All flags that a fibre may have, and how many vertices a ring of it.
pub(crate) const FIBRE_FLAGS: u32 = abi::FLAG_NO_BLEND | abi::FIBRE_CAP | abi::FIBRE_BLADE;
pub(crate) const SIDES: RangeInclusive<u32> = 3..=64;
/// All flags that a sprite may have.
const BILLBOARD_FLAGS: u32 = abi::FLAG_NO_BLEND | abi::BILLBOARD_FACING;

/// Elements that one job looks at.
const NODES: usize = 8192;
const ELEMENTS: usize = 2048;

/// Who shares the work: calls the job once for each number below the count, and returns when all are done.
pub type Share<'a> = &'a dyn Fn(usize, &(dyn Fn(usize) + Sync));

/// Nobody shares it: one job after the other.
pub fn alone(count: usize, job: &(dyn Fn(usize) + Sync)) {
    (0..count).for_each(job);
}

/// Reusable memory of the checks.
#[derive(Debug, Default)]
pub struct Checker {
    ids: Vec<u64>,
}

/// Whether what all jobs of a check looked at is sound, and in the order that proves ids to be unique.
struct Verdict {
    sound: AtomicBool,
    object_ids_grow: AtomicBool,
    actor_ids_grow: AtomicBool,
}

impl Verdict {
    fn note(flag: &AtomicBool, holds: bool) {
        if !holds {
            flag.store(false, Ordering::Relaxed);
        }
    }
}

/// What is wrong with one element.
pub(crate) struct Fault {
    field: &'static str,
    problem: String,
}

impl Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.field, self.problem)
    }
}

type Checked = Result<(), Fault>;

#[cold]
fn fault(field: &'static str, problem: impl Into<String>) -> Checked {
    Err(Fault { field, problem: problem.into() })
}

fn finite<const N: usize, T: Copy + Display + Into<f64>>(field: &'static str, values: [T; N]) -> Checked {
    match values.into_iter().find(|v| !(*v).into().is_finite()) {
        Some(value) => fault(field, format!("is {value}")),
        None => Ok(()),
    }
}

#[inline(always)]
fn within(field: &'static str, value: f32, low: f32, high: f32) -> Checked {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    fault(field, format!("is {value}, allowed is {low} to {high}"))
}

#[inline(always)]
fn at_least(field: &'static str, value: f32, low: f32) -> Checked {
    if value.is_finite() && value >= low {
        return Ok(());
    }
    fault(field, format!("is {value}, allowed is {low} and more"))
}

#[inline(always)]
fn above(field: &'static str, value: f32, low: f32) -> Checked {
    if value.is_finite() && value > low {
        return Ok(());
    }
    fault(field, format!("is {value}, allowed is above {low}"))
}

#[inline(always)]
fn world(field: &'static str, position: [f64; 3]) -> Checked {
    match position.into_iter().find(|v| !v.is_finite() || v.abs() > FARTHEST) {
        Some(value) => fault(field, format!("is {value}, allowed is within {FARTHEST} m")),
        None => Ok(()),
    }
}

#[inline(always)]
pub(crate) fn is_unit([x, y, z]: [f32; 3]) -> bool {
    ((x * x + y * y + z * z) - 1.0).abs() <= UNIT_TOLERANCE
}

fn unit(field: &'static str, v: [f32; 3]) -> Checked {
    if is_unit(v) {
        return Ok(());
    }
    fault(field, format!("is ({}, {}, {}), which is no unit vector", v[0], v[1], v[2]))
}

#[inline(always)]
fn index(field: &'static str, value: u32, count: usize, of: &str) -> Checked {
    if (value as usize) < count {
        return Ok(());
    }
    fault(field, format!("is {value}, there are {count} {of}"))
}

#[inline(always)]
fn flags(value: u32, known: u32) -> Checked {
    match value & !known {
        0 => Ok(()),
        unknown => fault("flags", format!("has unknown bits {unknown:#x}")),
    }
}

/// Checks each element of a stream; the message names the first that is wrong.
fn each<T>(stream: &str, elements: &[T], check: impl Fn(&T) -> Checked) -> Result<(), String> {
    for (i, element) in elements.iter().enumerate() {
        if let Err(fault) = check(element) {
            return Err(format!("stream {stream}, element {i}: {fault}"));
        }
    }
    Ok(())
}

impl Checker {
    /// Checks all streams, each against those that it refers to.
    ///
    /// Nearly always everything is sound. So jobs first look at that alone, without a word to say (`glance.rs`); only when
    /// something seems wrong, a second pass finds the first wrong element and its message.
    pub fn check(&mut self, outputs: &Outputs, share: Share<'_>) -> Result<(), String> {
        let verdict = Verdict {
            sound: AtomicBool::new(true),
            object_ids_grow: AtomicBool::new(true),
            actor_ids_grow: AtomicBool::new(true),
        };
        let pieces = [
            outputs.objects.len().div_ceil(ELEMENTS),
            outputs.fibres.len().div_ceil(ELEMENTS),
            outputs.billboards.len().div_ceil(ELEMENTS),
            outputs.fibre_nodes.len().div_ceil(NODES),
            outputs.joints.len().div_ceil(NODES),
            outputs.draw_vertices.len().div_ceil(NODES),
        ];
        // The last job looks at all that is short in most seas.
        share(pieces.iter().sum::<usize>() + 1, &|at| look(outputs, at, pieces, &verdict));
        if !verdict.sound.into_inner() {
            self.find(outputs)?;
        }
        if !verdict.object_ids_grow.into_inner() {
            self.unique("object", outputs.objects.iter().map(|o| o.id))?;
        }
        if !verdict.actor_ids_grow.into_inner() {
            self.unique("actor", outputs.actors.iter().map(|a| a.id))?;
        }
        Ok(())
    }

    /// The first element that is wrong.
    fn find(&mut self, outputs: &Outputs) -> Result<(), String> {
        let objects = outputs.objects.len();
        each("object", &outputs.objects, object)?;
        self.unique("object", outputs.objects.iter().map(|o| o.id))?;
        each("material", &outputs.materials, |m| material(m, &outputs.textures))?;
        each("fibre node", &outputs.fibre_nodes, node)?;
        each("fibre", &outputs.fibres, |f| {
            fibre(f, objects, outputs.materials.len(), outputs.fibre_nodes.len())
        })?;
        meshes::find(outputs)?;
        each("billboard", &outputs.billboards, |b| billboard(b, objects, &outputs.textures))?;
        each("flow", &outputs.flows, flow)?;
        each("actor", &outputs.actors, actor)?;
        each("debug line", &outputs.debug_lines, debug_line)?;
        each("trace", &outputs.trace, trace)
    }

    fn unique(&mut self, stream: &str, ids: impl Iterator<Item = u64>) -> Result<(), String> {
        self.ids.clear();
        self.ids.extend(ids);
        self.ids.sort_unstable();
        match self.ids.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(format!("stream {stream}: two elements have the id {}", pair[0])),
            None => Ok(()),
        }
    }
}

fn object(object: &abi::Object) -> Checked {
    if object.id == 0 {
        return fault("id", "is 0");
    }
    world("origin", object.origin)?;
    finite("bounds_center", object.bounds_center)?;
    at_least("bounds_radius", object.bounds_radius, 0.0)?;
    flags(object.flags, abi::FLAG_NO_BLEND)
}

/// A texture that the instance has, or the host's own.
fn texture(id: u32, textures: &TextureList) -> Checked {
    if textures::known(textures, id) {
        return Ok(());
    }
    fault("texture", format!("is {id}, which texture_create did not hand out, or which was destroyed"))
}

fn material(material: &abi::Material, textures: &TextureList) -> Checked {
    for (field, color) in [("base", material.base), ("tip", material.tip), ("accent", material.accent)] {
        color.into_iter().try_for_each(|value| within(field, value, 0.0, 1.0))?;
    }
    if material.pattern > abi::PATTERN_BLOTCHES {
        return fault("pattern", format!("is {}, allowed is 0 to 4", material.pattern));
    }
    texture(material.texture, textures)?;
    at_least("pattern_scale", material.pattern_scale, 0.0)?;
    within("pattern_softness", material.pattern_softness, 0.0, 1.0)?;
    within("translucency", material.translucency, 0.0, 1.0)?;
    within("wrap", material.wrap, 0.0, 1.0)?;
    at_least("rim", material.rim, 0.0)?;
    at_least("glow", material.glow, 0.0)?;
    within("roughness", material.roughness, 0.0, 1.0)?;
    within("specular", material.specular, 0.0, 1.0)
}

/// One job of a check: piece `at` of the objects, fibres, sprites and nodes in turn, then everything else.
fn look(outputs: &Outputs, mut at: usize, pieces: [usize; 6], verdict: &Verdict) {
    if at < pieces[0] {
        let part = piece(outputs.objects.len(), at, ELEMENTS);
        let before = part.start.checked_sub(1).map_or(0, |last| outputs.objects[last].id);
        let (sound, grow) = glance::objects(&outputs.objects[part], before);
        Verdict::note(&verdict.sound, sound);
        Verdict::note(&verdict.object_ids_grow, grow);
        return;
    }
    at -= pieces[0];
    if at < pieces[1] {
        let fibres = &outputs.fibres[piece(outputs.fibres.len(), at, ELEMENTS)];
        let counts = (outputs.objects.len(), outputs.materials.len(), outputs.fibre_nodes.len());
        Verdict::note(&verdict.sound, glance::fibres(fibres, counts.0, counts.1, counts.2));
        return;
    }
    at -= pieces[1];
    if at < pieces[2] {
        let part = &outputs.billboards[piece(outputs.billboards.len(), at, ELEMENTS)];
        Verdict::note(&verdict.sound, billboards(part, outputs.objects.len(), &outputs.textures));
        return;
    }
    at -= pieces[2];
    if at < pieces[3] {
        Verdict::note(
            &verdict.sound,
            glance::nodes(&outputs.fibre_nodes[piece(outputs.fibre_nodes.len(), at, NODES)]),
        );
        return;
    }
    at -= pieces[3];
    if at < pieces[4] {
        let part = &outputs.joints[piece(outputs.joints.len(), at, NODES)];
        Verdict::note(&verdict.sound, part.iter().fold(true, |all, joint| all & meshes::sound(joint)));
        return;
    }
    at -= pieces[4];
    if at < pieces[5] {
        let part = &outputs.draw_vertices[piece(outputs.draw_vertices.len(), at, NODES)];
        Verdict::note(&verdict.sound, part.iter().fold(true, |all, v| all & meshes::sound_vertex(v)));
        return;
    }
    let sound = all(&outputs.materials, |m| material(m, &outputs.textures))
        && all(&outputs.flows, flow)
        && all(&outputs.actors, actor)
        && all(&outputs.debug_lines, debug_line)
        && all(&outputs.trace, trace)
        && meshes::elements(outputs).is_ok();
    Verdict::note(&verdict.sound, sound);
    Verdict::note(&verdict.actor_ids_grow, outputs.actors.is_sorted_by(|a, b| a.id < b.id));
}

/// Piece `at` of `length` elements.
fn piece(length: usize, at: usize, size: usize) -> Range<usize> {
    at * size..((at + 1) * size).min(length)
}

fn all<T>(elements: &[T], check: impl Fn(&T) -> Checked) -> bool {
    elements.iter().all(|element| check(element).is_ok())
}

fn node(node: &abi::FibreNode) -> Checked {
    for value in node.position {
        within("position", value, -FARTHEST_LOCAL, FARTHEST_LOCAL)?;
    }
    above("radius", node.radius, 0.0)?;
    within("radius", node.radius, 0.0, FARTHEST_LOCAL)
}

fn debug_line(line: &abi::DebugLine) -> Checked {
    world("from", line.from)?;
    finite("delta", line.delta)?;
    index("channel", line.channel, 32, "channels")
}

fn trace(trace: &abi::Trace) -> Checked {
    world("position", trace.position)?;
    at_least("radius", trace.radius, 0.0)?;
    match trace.kind {
        abi::TRACE_FIBRE..=abi::TRACE_JELLYFISH => Ok(()),
        kind => fault("kind", format!("is {kind}, allowed is 1 to 5")),
    }
}

fn fibre(fibre: &abi::Fibre, objects: usize, materials: usize, nodes: usize) -> Checked {
    index("object", fibre.object, objects, "objects")?;
    index("material", fibre.material, materials, "materials")?;
    if fibre.node_count < 2 {
        return fault("node_count", format!("is {}, allowed is 2 and more", fibre.node_count));
    }
    let end = u64::from(fibre.first_node) + u64::from(fibre.node_count);
    if end > nodes as u64 {
        return fault("first_node", format!("and node_count end at {end}, there are {nodes} nodes"));
    }
    flags(fibre.flags, FIBRE_FLAGS)?;
    if !SIDES.contains(&fibre.sides) {
        return fault("sides", format!("is {}, allowed is 3 to 64", fibre.sides));
    }
    above("flatness", fibre.flatness, 0.0)?;
    within("flatness", fibre.flatness, 0.0, 1.0)?;
    unit("normal", fibre.normal)
}

/// Whether all sprites are sound: they are many, too.
fn billboards(billboards: &[abi::Billboard], objects: usize, textures: &TextureList) -> bool {
    // Neighbours share a texture: the list is looked through only where it changes.
    let mut last = 0;
    let mut known =
        |id: u32| id == last || (textures::known(textures, id) && std::mem::replace(&mut last, id) != id);
    let mut good = |billboard: &abi::Billboard| {
        let near = |[x, y, z]: [f32; 3]| {
            (x.abs() <= FARTHEST_LOCAL) & (y.abs() <= FARTHEST_LOCAL) & (z.abs() <= FARTHEST_LOCAL)
        };
        near(billboard.position)
            & near(billboard.velocity)
            & (billboard.size > 0.0)
            & (billboard.size <= FARTHEST_LOCAL)
            & (billboard.opacity >= 0.0)
            & (billboard.opacity <= 1.0)
            & billboard.roll.is_finite()
            & (is_unit(billboard.axis) | (billboard.flags & abi::BILLBOARD_FACING != 0))
            & ((billboard.object as usize) < objects)
            & known(billboard.texture)
            & (billboard.flags & !BILLBOARD_FLAGS == 0)
    };
    billboards.iter().fold(true, |all, billboard| all & good(billboard))
}

fn billboard(billboard: &abi::Billboard, objects: usize, textures: &TextureList) -> Checked {
    for value in billboard.position {
        within("position", value, -FARTHEST_LOCAL, FARTHEST_LOCAL)?;
    }
    for value in billboard.velocity {
        within("velocity", value, -FARTHEST_LOCAL, FARTHEST_LOCAL)?;
    }
    above("size", billboard.size, 0.0)?;
    within("size", billboard.size, 0.0, FARTHEST_LOCAL)?;
    within("opacity", billboard.opacity, 0.0, 1.0)?;
    finite("roll", [billboard.roll])?;
    index("object", billboard.object, objects, "objects")?;
    texture(billboard.texture, textures)?;
    flags(billboard.flags, BILLBOARD_FLAGS)?;
    match billboard.flags & abi::BILLBOARD_FACING {
        0 => unit("axis", billboard.axis),
        _ => Ok(()),
    }
}

fn flow(flow: &abi::Flow) -> Checked {
    world("position", flow.position)?;
    finite("strength", [flow.strength])?;
    at_least("core", flow.core, 0.0)?;
    at_least("reach", flow.reach, 0.0)?;
    within("fade", flow.fade, 0.0, 1.0)?;
    within("modulation", flow.modulation, 0.0, 1.0)?;
    finite("phase", [flow.phase])?;
    finite("wave_vector", flow.wave_vector)?;
    finite("gradient", [flow.gradient])?;
    finite("level", [flow.level])?;
    finite("axis", flow.axis)?;
    match flow.kind {
        abi::FLOW_SOURCE | abi::FLOW_HOLE => above("peak", flow.peak, 0.0),
        abi::FLOW_WHIRLWIND => {
            above("peak", flow.peak, 0.0)?;
            unit("axis", flow.axis)
        }
        abi::FLOW_DIRECTIONAL => unit("axis", flow.axis),
        abi::FLOW_SHELTER => within("strength", flow.strength, 0.0, 1.0),
        kind => fault("kind", format!("is {kind}, allowed is 1 to 5")),
    }
}

fn actor(actor: &abi::Actor) -> Checked {
    if actor.id == 0 {
        return fault("id", "is 0");
    }
    world("position", actor.position)?;
    finite("velocity", actor.velocity)?;
    at_least("radius", actor.radius, 0.0)?;
    if actor.forward == [0.0; 3] {
        return Ok(());
    }
    unit("forward", actor.forward)
}

#[cfg(test)]
mod tests;
