//! What is wrong with an element of each stream, and what else the host knows about it.

use std::{fmt::Display, ops::RangeInclusive};

use crate::{
    Outputs, glance,
    identity::GREATEST_ID,
    textures::{self, TextureList},
};
use reef_abi as abi;

use super::{Emitted, Fault, PIECE, Unknown};

/// Farthest that anything may be from the origin of the world [m].
pub const FARTHEST: f64 = 1e6;
/// Farthest that an element may be from its object's origin [m].
pub const FARTHEST_LOCAL: f32 = 1e5;
/// How far the squared length of a unit vector may be from 1: several roundings of an f32 normalisation
/// (1e-7), and room for a vector that was carried along many segments.
pub(super) const UNIT_TOLERANCE: f32 = 1e-3;
/// All flags that a fibre may have, and how many vertices a ring of it.
pub(crate) const FIBRE_FLAGS: u32 = abi::FLAG_NO_BLEND | abi::FIBRE_CAP | abi::FIBRE_BLADE;
pub(crate) const SIDES: RangeInclusive<u32> = 3..=64;
/// All flags that a sprite may have.
const BILLBOARD_FLAGS: u32 = abi::FLAG_NO_BLEND | abi::BILLBOARD_FACING;

pub(super) type Checked = Result<(), Fault>;

#[cold]
pub(super) fn fault(field: &'static str, problem: impl Into<String>) -> Checked {
    Err(Fault { field, problem: problem.into() })
}

fn finite<const N: usize, T: Copy + Display + Into<f64>>(field: &'static str, values: [T; N]) -> Checked {
    match values.into_iter().find(|v| !(*v).into().is_finite()) {
        Some(value) => fault(field, format!("is {value}")),
        None => Ok(()),
    }
}

#[inline(always)]
pub(super) fn within(field: &'static str, value: f32, low: f32, high: f32) -> Checked {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    fault(field, format!("is {value}, allowed is {low} to {high}"))
}

#[inline(always)]
pub(super) fn at_least(field: &'static str, value: f32, low: f32) -> Checked {
    if value.is_finite() && value >= low {
        return Ok(());
    }
    fault(field, format!("is {value}, allowed is {low} and more"))
}

#[inline(always)]
pub(super) fn above(field: &'static str, value: f32, low: f32) -> Checked {
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
pub(super) fn index(field: &'static str, value: u32, count: usize, of: &str) -> Checked {
    if (value as usize) < count {
        return Ok(());
    }
    fault(field, format!("is {value}, there are {count} {of}"))
}

/// Flags of which no bit has a meaning.
#[inline(always)]
fn no_flags(value: u32) -> Checked {
    match value {
        0 => Ok(()),
        flags => fault("flags", format!("is {flags:#x}, allowed is 0")),
    }
}

/// A texture that the instance has, or the host's own.
fn texture(id: u32, textures: &TextureList) -> Checked {
    if textures::known(textures, id) {
        return Ok(());
    }
    fault("texture", format!("is {id}, which texture_create did not hand out, or which was destroyed"))
}

/// The id of an object of the instance's own.
#[inline(always)]
fn own_id(field: &'static str, id: u64) -> Checked {
    if id == 0 {
        return fault(field, "is 0");
    }
    if id > GREATEST_ID {
        return fault(field, format!("is {id:#x}, allowed is up to {GREATEST_ID:#x}"));
    }
    Ok(())
}

impl Emitted for abi::Object {
    const PIECE: Option<usize> = Some(PIECE);

    fn check(&self, _: &Outputs) -> Checked {
        own_id("id", self.id)?;
        world("origin", self.origin)?;
        finite("bounds_center", self.bounds_center)?;
        at_least("bounds_radius", self.bounds_radius, 0.0)
    }

    fn unknown(&self) -> Option<Unknown> {
        Unknown::bits(self.flags, abi::FLAG_NO_BLEND)
    }

    fn id(&self) -> Option<u64> {
        Some(self.id)
    }

    fn object(&self) -> Option<u32> {
        None
    }

    fn spare_is_zero(&self) -> bool {
        self.spare == 0
    }

    fn glance(part: &[Self], before: u64, _: &Outputs) -> (bool, bool) {
        glance::objects(part, before)
    }
}

impl Emitted for abi::Material {
    const PIECE: Option<usize> = None;

    fn check(&self, outputs: &Outputs) -> Checked {
        for (field, color) in [("base", self.base), ("tip", self.tip), ("accent", self.accent)] {
            color.into_iter().try_for_each(|value| within(field, value, 0.0, 1.0))?;
        }
        texture(self.texture, &outputs.textures)?;
        at_least("pattern_scale", self.pattern_scale, 0.0)?;
        within("pattern_softness", self.pattern_softness, 0.0, 1.0)?;
        within("translucency", self.translucency, 0.0, 1.0)?;
        within("wrap", self.wrap, 0.0, 1.0)?;
        at_least("rim", self.rim, 0.0)?;
        at_least("glow", self.glow, 0.0)?;
        within("roughness", self.roughness, 0.0, 1.0)?;
        within("specular", self.specular, 0.0, 1.0)
    }

    fn unknown(&self) -> Option<Unknown> {
        (self.pattern > abi::PATTERN_BLOTCHES).then_some(Unknown { field: "pattern", value: self.pattern })
    }

    fn id(&self) -> Option<u64> {
        None
    }

    fn object(&self) -> Option<u32> {
        None
    }

    fn spare_is_zero(&self) -> bool {
        self.spare.iter().all(|value| value.to_bits() == 0)
    }
}

impl Emitted for abi::Fibre {
    const PIECE: Option<usize> = Some(PIECE);

    fn check(&self, outputs: &Outputs) -> Checked {
        index("object", self.object, outputs.objects.len(), "objects")?;
        index("material", self.material, outputs.materials.len(), "materials")?;
        if self.node_count < 2 {
            return fault("node_count", format!("is {}, allowed is 2 and more", self.node_count));
        }
        let nodes = outputs.fibre_nodes.len();
        let end = u64::from(self.first_node) + u64::from(self.node_count);
        if end > nodes as u64 {
            return fault("first_node", format!("and node_count end at {end}, there are {nodes} nodes"));
        }
        if !SIDES.contains(&self.sides) {
            return fault("sides", format!("is {}, allowed is 3 to 64", self.sides));
        }
        above("flatness", self.flatness, 0.0)?;
        within("flatness", self.flatness, 0.0, 1.0)?;
        unit("normal", self.normal)
    }

    fn unknown(&self) -> Option<Unknown> {
        Unknown::bits(self.flags, FIBRE_FLAGS)
    }

    fn id(&self) -> Option<u64> {
        None
    }

    fn object(&self) -> Option<u32> {
        Some(self.object)
    }

    fn spare_is_zero(&self) -> bool {
        self.spare.iter().all(|value| value.to_bits() == 0)
    }

    fn glance(part: &[Self], _: u64, outputs: &Outputs) -> (bool, bool) {
        let counts = (outputs.objects.len(), outputs.materials.len(), outputs.fibre_nodes.len());
        (glance::fibres(part, counts.0, counts.1, counts.2), true)
    }
}

impl Emitted for abi::FibreNode {
    const PIECE: Option<usize> = Some(4 * PIECE);

    fn check(&self, _: &Outputs) -> Checked {
        for value in self.position {
            within("position", value, -FARTHEST_LOCAL, FARTHEST_LOCAL)?;
        }
        above("radius", self.radius, 0.0)?;
        within("radius", self.radius, 0.0, FARTHEST_LOCAL)
    }

    fn id(&self) -> Option<u64> {
        None
    }

    fn object(&self) -> Option<u32> {
        None
    }

    fn spare_is_zero(&self) -> bool {
        true
    }

    fn glance(part: &[Self], _: u64, _: &Outputs) -> (bool, bool) {
        (glance::nodes(part), true)
    }
}

impl Emitted for abi::Billboard {
    const PIECE: Option<usize> = Some(PIECE);

    fn check(&self, outputs: &Outputs) -> Checked {
        for value in self.position {
            within("position", value, -FARTHEST_LOCAL, FARTHEST_LOCAL)?;
        }
        for value in self.velocity {
            within("velocity", value, -FARTHEST_LOCAL, FARTHEST_LOCAL)?;
        }
        above("size", self.size, 0.0)?;
        within("size", self.size, 0.0, FARTHEST_LOCAL)?;
        within("opacity", self.opacity, 0.0, 1.0)?;
        finite("roll", [self.roll])?;
        index("object", self.object, outputs.objects.len(), "objects")?;
        texture(self.texture, &outputs.textures)?;
        match self.flags & abi::BILLBOARD_FACING {
            0 => unit("axis", self.axis),
            _ => Ok(()),
        }
    }

    fn unknown(&self) -> Option<Unknown> {
        Unknown::bits(self.flags, BILLBOARD_FLAGS)
    }

    fn id(&self) -> Option<u64> {
        None
    }

    fn object(&self) -> Option<u32> {
        Some(self.object)
    }

    fn spare_is_zero(&self) -> bool {
        true
    }

    fn glance(part: &[Self], _: u64, outputs: &Outputs) -> (bool, bool) {
        let objects = outputs.objects.len();
        // Neighbours share a texture: the list is looked through only where it changes.
        let mut last = 0;
        let mut known = |id: u32| {
            id == last || (textures::known(&outputs.textures, id) && std::mem::replace(&mut last, id) != id)
        };
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
        (part.iter().fold(true, |all, billboard| all & good(billboard)), true)
    }
}

impl Emitted for abi::Flow {
    const PIECE: Option<usize> = None;

    fn check(&self, _: &Outputs) -> Checked {
        if self.owner != 0 {
            own_id("owner", self.owner)?;
        }
        world("position", self.position)?;
        finite("strength", [self.strength])?;
        at_least("core", self.core, 0.0)?;
        at_least("reach", self.reach, 0.0)?;
        within("fade", self.fade, 0.0, 1.0)?;
        within("modulation", self.modulation, 0.0, 1.0)?;
        finite("phase", [self.phase])?;
        finite("wave_vector", self.wave_vector)?;
        finite("gradient", [self.gradient])?;
        finite("level", [self.level])?;
        finite("axis", self.axis)?;
        no_flags(self.flags)?;
        match self.kind {
            abi::FLOW_SOURCE | abi::FLOW_HOLE => above("peak", self.peak, 0.0),
            abi::FLOW_WHIRLWIND => {
                above("peak", self.peak, 0.0)?;
                unit("axis", self.axis)
            }
            abi::FLOW_DIRECTIONAL => unit("axis", self.axis),
            abi::FLOW_SHELTER => within("strength", self.strength, 0.0, 1.0),
            // Whoever knows it reads it; the others pass it by.
            _ => Ok(()),
        }
    }

    fn unknown(&self) -> Option<Unknown> {
        let known = abi::FLOW_SOURCE..=abi::FLOW_SHELTER;
        (!known.contains(&self.kind)).then_some(Unknown { field: "kind", value: self.kind })
    }

    fn id(&self) -> Option<u64> {
        None
    }

    fn object(&self) -> Option<u32> {
        None
    }

    fn spare_is_zero(&self) -> bool {
        self.spare == [0; 7]
    }
}

impl Emitted for abi::Actor {
    const PIECE: Option<usize> = None;

    fn check(&self, _: &Outputs) -> Checked {
        own_id("id", self.id)?;
        world("position", self.position)?;
        finite("velocity", self.velocity)?;
        at_least("radius", self.radius, 0.0)?;
        no_flags(self.flags)?;
        if self.forward == [0.0; 3] {
            return Ok(());
        }
        unit("forward", self.forward)
    }

    fn id(&self) -> Option<u64> {
        Some(self.id)
    }

    fn object(&self) -> Option<u32> {
        None
    }

    fn spare_is_zero(&self) -> bool {
        self.spare == [0; 7]
    }
}

impl Emitted for abi::DebugLine {
    const PIECE: Option<usize> = None;

    fn check(&self, _: &Outputs) -> Checked {
        world("from", self.from)?;
        finite("delta", self.delta)?;
        index("channel", self.channel, 32, "channels")
    }

    fn id(&self) -> Option<u64> {
        None
    }

    fn object(&self) -> Option<u32> {
        None
    }

    fn spare_is_zero(&self) -> bool {
        self.spare == 0
    }
}

impl Emitted for abi::Trace {
    const PIECE: Option<usize> = None;

    fn check(&self, outputs: &Outputs) -> Checked {
        world("position", self.position)?;
        at_least("radius", self.radius, 0.0)?;
        index("kind", self.kind, outputs.trace_kinds as usize, "names of traces in the descriptor")
    }

    fn id(&self) -> Option<u64> {
        None
    }

    fn object(&self) -> Option<u32> {
        None
    }

    fn spare_is_zero(&self) -> bool {
        self.spare == 0
    }
}
