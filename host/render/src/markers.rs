//! What has no body of its own, drawn for people: singularities of the flow as balls (a source green, a hole
//! red, a whirlwind yellow with its axis, whatever an object carries white), and rings where they end and
//! around bounding spheres.
//!
//! Markers are made from a finished frame, for one picture: the sea knows nothing of them.

use std::f32::consts::TAU;

use ash::vk;
use glam::{DVec3, Vec3};
use reef_abi as abi;
use reef_gpu::{Blend, DepthDesc, DepthLoad, Frame as GpuFrame, Gpu, GraphicsDesc, Load, Result, Upload};
use reef_streams::frame::{Frame, bounding_sphere};

use super::{
    formats::{DEPTH, LIGHT},
    gather::GpuLine,
    quality::{ByQuality, Quality},
    targets::Targets,
    view::Lens,
};

/// Quads around a ball or an arrow, and along it.
pub(crate) const BODY_SIDES: u32 = 28;
pub(crate) const BODY_RINGS: u32 = 14;
const VERTICES: u32 = BODY_SIDES * BODY_RINGS * 6;
/// Sides of a ring.
const SIDES: usize = 96;
/// Least and greatest radius of a ball, as a share of its distance from the eye.
const SIZES: [f32; 2] = [0.011, 0.03];
/// Length of a whirlwind's axis to either side, and radius of the ring that shows its turn, in radii of its
/// ball.
const AXIS: f32 = 5.0;
const TURN: f32 = 2.4;

/// Colours, sRGB 0xAABBGGRR.
const SOURCE: u32 = 0xff3c_a81e;
const HOLE: u32 = 0xff2a_2ad8;
const WHIRLWIND: u32 = 0xff12_b8f0;
const CARRIED: u32 = 0xfff6_f6f6;
const SHELTER: u32 = 0xffb4_967a;
/// Bounding spheres that no singularity reaches, and those that one does.
const ASLEEP: u32 = 0xffee_e6dc;
const AWAKE: u32 = 0xff20_90f8;

/// What is drawn of what has no body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Markers {
    /// Sources, holes, whirlwinds and shelters.
    pub singularities: bool,
    /// Where they end, and the bounding spheres of the objects that have fibres or meshes.
    pub bounds: bool,
    /// Joints of meshes, in the colours of their levels of detail.
    pub joints: bool,
}

reef_gpu::record! {
    /// `Marker` of `shaders/marker.vert`.
    pub struct GpuMarker = "Marker" {
        /// A ball's middle or an arrow's tail relative to the eye [m].
        pub from: [f32; 3],
        /// Radius of the ball or of the arrow's shaft [m].
        pub radius: f32,
        /// From the arrow's tail to its point [m]; zero: a ball.
        pub along: [f32; 3],
        /// sRGB 0xAABBGGRR.
        pub color: u32,
    }
}

/// The markers of one picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marked {
    /// Balls and arrows.
    pub bodies: Vec<GpuMarker>,
    /// Rings.
    pub lines: Vec<GpuLine>,
}

/// What is marked between two steps. `alpha`: 0 shows the step before, 1 this one.
pub fn mark(previous: &Frame, current: &Frame, alpha: f32, lens: &Lens, wanted: Markers) -> Marked {
    let mut marked = Marked::default();
    if wanted == Markers::default() {
        return marked;
    }
    // Those of the step before are partners where they are as many of the same kinds.
    let same = previous.flow.iter().map(|flow| flow.kind).eq(current.flow.iter().map(|flow| flow.kind));
    for (at, flow) in current.flow.iter().enumerate().filter(|(_, flow)| is_local(flow)) {
        let now = DVec3::from(flow.position);
        let before = if same { DVec3::from(previous.flow[at].position) } else { now };
        let center = (before.lerp(now, f64::from(alpha.clamp(0.0, 1.0))) - lens.eye).as_vec3();
        if wanted.singularities {
            marked.singularity(flow, center);
        }
        if wanted.bounds && flow.reach > 0.0 {
            marked.sphere(center, flow.reach, color(flow), false);
            marked.sphere(center, flow.reach * flow.fade, color(flow), true);
        }
    }
    if wanted.bounds {
        marked.bounds(current, lens);
    }
    marked
}

fn is_local(flow: &abi::Flow) -> bool {
    matches!(flow.kind, abi::FLOW_SOURCE | abi::FLOW_HOLE | abi::FLOW_WHIRLWIND | abi::FLOW_SHELTER)
}

/// By what it does: a source of negative strength is a hole.
fn color(flow: &abi::Flow) -> u32 {
    match flow.kind {
        abi::FLOW_SHELTER => SHELTER,
        _ if flow.owner != 0 => CARRIED,
        abi::FLOW_WHIRLWIND => WHIRLWIND,
        kind if (kind == abi::FLOW_HOLE) == (flow.strength >= 0.0) => HOLE,
        _ => SOURCE,
    }
}

impl Marked {
    fn singularity(&mut self, flow: &abi::Flow, center: Vec3) {
        let distance = center.length();
        let radius = flow.core.clamp(SIZES[0] * distance, SIZES[1] * distance);
        let color = color(flow);
        self.bodies.push(GpuMarker { from: center.to_array(), radius, along: [0.0; 3], color });
        if flow.kind == abi::FLOW_WHIRLWIND {
            let axis = Vec3::from(flow.axis).normalize_or(Vec3::Y);
            let half = axis * (AXIS * radius);
            let shaft = radius * 0.22;
            self.bodies.push(GpuMarker {
                from: (center - half).to_array(),
                radius: shaft,
                along: (half * 2.0).to_array(),
                color,
            });
            // The water goes along (p − C) × R, against it where the strength is negative.
            self.turn(center, if flow.strength < 0.0 { -axis } else { axis }, TURN * radius, color);
        }
    }

    /// Bounding spheres: those that a singularity reaches in another colour, because there its field is
    /// evaluated. An object does not feel what it emits itself.
    fn bounds(&mut self, frame: &Frame, lens: &Lens) {
        for (module, outputs) in frame.outputs.iter().enumerate() {
            let mut has_body = vec![false; outputs.objects.len()];
            let fibres = outputs.fibres.iter().map(|fibre| fibre.object);
            let skinned = outputs.skinned.iter().map(|mesh| mesh.object);
            let draws = outputs.mesh_draws.iter().map(|mesh| mesh.object);
            for object in fibres.chain(skinned).chain(draws) {
                has_body[object as usize] = true;
            }
            for (object, _) in outputs.objects.iter().zip(has_body).filter(|(_, has_body)| *has_body) {
                let (center, radius) = bounding_sphere(object);
                let id = frame.tags.get(module).map_or(object.id, |tag| tag.foreign(object.id));
                let reached = frame.flow.iter().any(|flow| {
                    let near = f64::from(flow.reach) + radius;
                    let reaches = flow.reach == 0.0 || center.distance(DVec3::from(flow.position)) < near;
                    is_local(flow) && flow.strength != 0.0 && reaches && (flow.owner == 0 || flow.owner != id)
                });
                let color = if reached { AWAKE } else { ASLEEP };
                self.sphere((center - lens.eye).as_vec3(), radius as f32, color, false);
            }
        }
    }

    /// A sphere as its outline from the eye and its equator; `dashed` leaves every other piece out, and the
    /// equator.
    fn sphere(&mut self, center: Vec3, radius: f32, color: u32, dashed: bool) {
        let distance = center.length();
        if radius < distance {
            let share = radius / distance;
            let outline = center * (1.0 - share * share);
            self.ring(outline, center / distance, radius * (1.0 - share * share).sqrt(), color, dashed);
        }
        if !dashed {
            self.ring(center, Vec3::Y, radius, faint(color), false);
        }
    }

    fn ring(&mut self, center: Vec3, axis: Vec3, radius: f32, color: u32, dashed: bool) {
        let (side, across) = axis.any_orthonormal_pair();
        let at = |n: usize| {
            let (sin, cos) = (n as f32 * TAU / SIDES as f32).sin_cos();
            center + (side * cos + across * sin) * radius
        };
        for n in (0..SIDES).filter(|n| !dashed || n % 2 == 0) {
            self.line(at(n), at(n + 1), color);
        }
    }

    /// A ring with heads of arrows along p × axis.
    fn turn(&mut self, center: Vec3, axis: Vec3, radius: f32, color: u32) {
        self.ring(center, axis, radius, color, false);
        let (side, across) = axis.any_orthonormal_pair();
        for quarter in [side, across, -side, -across] {
            let (tip, along) = (center + quarter * radius, quarter.cross(axis));
            let back = tip - along * (0.45 * radius);
            self.line(tip, back + quarter * (0.2 * radius), color);
            self.line(tip, back - quarter * (0.3 * radius), color);
        }
    }

    fn line(&mut self, from: Vec3, to: Vec3, color: u32) {
        self.lines.push(GpuLine { from: from.to_array(), color, to: to.to_array() });
    }
}

/// The same colour with a third of its cover.
fn faint(color: u32) -> u32 {
    color & 0x00ff_ffff | 0x5500_0000
}

/// The pass that draws balls and arrows; rings go with the debug lines.
pub struct Bodies {
    pipeline: ByQuality,
}

impl Bodies {
    /// Compiles the pipeline now.
    pub fn prepare(&self, quality: Quality) -> Result<()> {
        self.pipeline.prepare(quality)
    }

    /// Describes the pipeline.
    pub fn new(gpu: &Gpu) -> Self {
        let desc = GraphicsDesc {
            color: &[(LIGHT, Blend::Replace)],
            depth: Some(DepthDesc { format: DEPTH, compare: vk::CompareOp::GREATER, write: true }),
            ..GraphicsDesc::new("markers", "marker.vert", "marker.frag")
        };
        Self { pipeline: ByQuality::new(gpu, &desc) }
    }

    /// The pass.
    pub fn draw(
        &self,
        frame: &mut GpuFrame<'_>,
        view: Upload,
        bodies: &[GpuMarker],
        quality: Quality,
        targets: &Targets<'_>,
    ) -> Result<()> {
        if bodies.is_empty() {
            return Ok(());
        }
        let count = bodies.len() as u32;
        let bodies = frame.upload(bodies)?;
        frame
            .pass("markers")
            .color(targets.light, Load::Keep)
            .depth(targets.depth, DepthLoad::Keep)
            .bind(self.pipeline.get(quality), &[(0, view.into()), (1, bodies.into())])
            .run(|cmd| {
                cmd.pipeline(self.pipeline.get(quality))?;
                cmd.draw(0..VERTICES, 0..count);
                Ok(())
            })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use reef_streams::identity::ModuleTag;

    use super::*;
    use crate::sample;
    use reef_streams::Outputs;

    fn lens() -> Lens {
        Lens::new(&sample::looking_at(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO), [64, 36], 60.0)
    }

    fn flow(kind: u32, strength: f32) -> abi::Flow {
        abi::Flow { kind, strength, peak: 1.0, core: 0.05, axis: [0.0, 1.0, 0.0], ..abi::Flow::default() }
    }

    fn frame(flow: Vec<abi::Flow>, outputs: Outputs) -> Frame {
        let camera = sample::looking_at(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO);
        Frame { flow: Arc::new(flow), ..sample::frame(1, camera, outputs) }
    }

    const ALL: Markers = Markers { singularities: true, bounds: true, joints: false };

    fn marked(flow: Vec<abi::Flow>) -> Marked {
        let frame = frame(flow, Outputs::default());
        mark(&frame, &frame, 1.0, &lens(), ALL)
    }

    #[test]
    fn each_kind_has_its_colour_by_what_it_does() {
        let carried = abi::Flow { owner: 7, ..flow(abi::FLOW_HOLE, 1.0) };
        for (flow, color) in [
            (flow(abi::FLOW_SOURCE, 1.0), SOURCE),
            (flow(abi::FLOW_SOURCE, -1.0), HOLE),
            (flow(abi::FLOW_HOLE, 1.0), HOLE),
            (flow(abi::FLOW_HOLE, -1.0), SOURCE),
            (flow(abi::FLOW_WHIRLWIND, -1.0), WHIRLWIND),
            (carried, CARRIED),
        ] {
            assert_eq!(marked(vec![flow]).bodies[0].color, color, "{flow:?}");
        }
        assert_eq!(marked(vec![flow(abi::FLOW_DIRECTIONAL, 1.0)]), Marked::default());
        let source = frame(vec![flow(abi::FLOW_SOURCE, 1.0)], Outputs::default());
        let none = Markers::default();
        assert_eq!(mark(&source, &source, 1.0, &lens(), none), Marked::default(), "nobody asked");
    }

    #[test]
    fn a_whirlwinds_arrows_go_as_its_water_goes() {
        for strength in [1.0, -1.0] {
            let whirl = flow(abi::FLOW_WHIRLWIND, strength);
            let marked = marked(vec![whirl]);
            assert_eq!(marked.bodies.len(), 2, "a ball and its axis");
            // The first line after the ring is half of an arrow's head: it begins at the point.
            let head = marked.lines[SIDES];
            let (point, back) = (Vec3::from(head.from), Vec3::from(head.to));
            let place = (point + lens().eye.as_vec3()).as_dvec3();
            let water = reef_flow::reference::velocity(&[whirl], place.to_array(), 0);
            assert!(DVec3::from(water).dot((point - back).as_dvec3()) > 0.0, "{strength}: {water:?}");
        }
    }

    #[test]
    fn an_outline_touches_the_views_cone() {
        let reach = abi::Flow { reach: 0.5, fade: 1.0, ..flow(abi::FLOW_SOURCE, 1.0) };
        let marked = marked(vec![reach]);
        // A ray to the outline touches the sphere: the sine of its angle is radius over distance.
        let outline = Vec3::from(marked.lines[0].from);
        let sine = outline.normalize().cross(Vec3::NEG_Z).length();
        assert!((sine - 0.5 / 4.0).abs() < 1e-5, "{sine}");
    }

    #[test]
    fn a_bounding_sphere_lights_up_where_a_singularity_reaches_it() {
        let object = |id: u64, x: f64| abi::Object {
            id,
            origin: [x, 0.0, 0.0],
            bounds_radius: 0.2,
            ..abi::Object::default()
        };
        let outputs = Outputs {
            objects: vec![object(1, 0.0), object(2, 1.0), object(3, 5.0)],
            fibres: [0, 1].map(|object| abi::Fibre { object, ..abi::Fibre::default() }).to_vec(),
            ..Outputs::default()
        };
        let source = abi::Flow { reach: 0.3, ..flow(abi::FLOW_SOURCE, 1.0) };
        let frame = frame(vec![source], outputs);
        let only = Markers { singularities: false, ..ALL };
        let marked = mark(&frame, &frame, 1.0, &lens(), only);
        let count = |color: u32| marked.lines.iter().filter(|line| line.color == color).count();
        assert_eq!((count(AWAKE), count(ASLEEP)), (SIDES, SIDES), "the third has no fibres");
        assert!(marked.bodies.is_empty());
    }

    #[test]
    fn what_an_object_emits_itself_does_not_light_up_its_sphere() {
        let object = abi::Object { id: 1, bounds_radius: 0.2, ..abi::Object::default() };
        let outputs =
            Outputs { objects: vec![object], fibres: vec![abi::Fibre::default()], ..Outputs::default() };
        let only = Markers { singularities: false, ..ALL };
        let tags = ModuleTag::all(&["its module", "another"]);
        for (owner, color) in [(tags[0].foreign(1), ASLEEP), (tags[1].foreign(1), AWAKE)] {
            let mut frame = frame(vec![abi::Flow { owner, ..flow(abi::FLOW_SOURCE, 1.0) }], outputs.clone());
            frame.tags = tags.clone().into();
            let marked = mark(&frame, &frame, 1.0, &lens(), only);
            assert_eq!(marked.lines[0].color, color, "{owner}");
        }
    }

    #[test]
    fn a_moving_singularity_is_drawn_between_its_steps() {
        let at = |x: f64| {
            let moved = abi::Flow { position: [x, 0.0, 0.0], ..flow(abi::FLOW_SOURCE, 1.0) };
            frame(vec![moved], Outputs::default())
        };
        let between = |alpha: f32| mark(&at(0.0), &at(1.0), alpha, &lens(), ALL).bodies[0].from[0];
        assert_eq!([0.0, 0.25, 1.0].map(between), [0.0, 0.25, 1.0]);
    }
}
