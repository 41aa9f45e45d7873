//! The CPU's twin of the mesh passes (`shaders/mesh_pose.comp`, `mesh_skin.comp`, `mesh_index.comp`): tests
//! compare what the GPU wrote with what stands here. Pictures use it for lines that show joints and levels
//! alone.

use glam::{Mat3, Quat, Vec2, Vec3, Vec4};
use reef_abi as abi;
use reef_streams::frame as sea;

use super::{
    gather::Subject,
    library::Shelf,
    records::{
        BAND, BIN_LIT, BIN_LIT_THIN, BIN_LIT_VEIL, BIN_PIXEL, BIN_THIN, BIN_VEIL, DRAWN_ANEW, DUAL, FAR_SIDE,
        GpuInstance, GpuLevel, LIT_VEIL, NO_ROW, PLAIN, RIGID, SMOOTH, SMOOTH_LIT, THIN_HALF, TWO_SIDED,
        VEIL,
    },
    rows::GpuRow,
};
use crate::{
    gather::{self, GpuObject},
    lod::{EDGE, LIT_EDGE, Thresholds},
    quality::Quality,
    steps::joined,
    twin::pixel_at,
    view::{Lens, NEAR},
};

/// A vertex as the draw reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Clip space.
    pub clip: Vec4,
    /// Unit, in eye space.
    pub normal: Vec3,
    /// Tissue [cm].
    pub thickness_cm: f32,
    /// Of what is thin: how far it is from its row's middle, as a share of the way to the edge, and half its
    /// row's width [px].
    pub across: [f32; 2],
}

/// An instance at one level of detail.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// In all levels of the shelf.
    pub level: u32,
    /// What it needs of the device.
    pub bin: usize,
    /// Of the pixels: from, to.
    pub shares: [f32; 2],
    /// Those of its level; empty where another instance has them.
    pub vertices: Vec<Vertex>,
    /// Relative to the first vertex of its level; what is left out is three times the same.
    pub indices: Vec<u32>,
}

/// A similarity: x → scale · turn x + shift.
#[derive(Clone, Copy, Debug)]
struct Frame {
    turn: Quat,
    shift: Vec3,
    scale: f32,
}

impl Frame {
    fn apply(self, v: Vec3) -> Vec3 {
        self.scale * (self.turn * v) + self.shift
    }
}

/// What two steps brought, as it lies on the device.
pub struct Brought {
    joints: [Vec<abi::Joint>; 2],
    vertices: [Vec<abi::DrawVertex>; 2],
}

impl Brought {
    /// Of the step before and of this step.
    pub fn new(previous: &sea::Frame, current: &sea::Frame) -> Self {
        Self {
            joints: [previous, current].map(|frame| joined(frame, |o| &o.joints)),
            vertices: [previous, current].map(|frame| joined(frame, |o| &o.draw_vertices)),
        }
    }
}

/// One instance with all that belongs to it.
struct Twin<'a> {
    brought: &'a Brought,
    shelf: &'a Shelf,
    instance: &'a GpuInstance,
    base: Vec3,
    lens: &'a Lens,
}

/// How wide the instances of two steps are in the picture [px].
pub fn sizes(previous: &sea::Frame, current: &sea::Frame, lens: &Lens) -> Vec<f32> {
    let mut shelf = Shelf::default();
    current.outputs.iter().flat_map(|outputs| outputs.meshes.iter()).for_each(|mesh| shelf.add(mesh));
    let gather::Gathered { objects, matched, .. } = gather::gather(previous, current, 1.0, lens, 0);
    let subject = super::gather::gather([previous, current], &matched, 1.0, lens, Quality::Low, &shelf);
    let brought = Brought::new(previous, current);
    let size = |instance| {
        let twin = Twin::new(&brought, (&shelf, &objects), instance, lens);
        let (center, radius, _) = twin.bounds(&twin.frames());
        2.0 * radius * lens.pixels_per_metre() / center.dot(lens.forward).max(NEAR)
    };
    subject.instances.iter().map(size).collect()
}

/// Where an instance stands, for lines that show it.
pub struct Stand {
    /// Of its finer level; None: it is not drawn.
    pub level: Option<u32>,
    /// Middle of what is drawn, in eye space [m].
    pub center: Vec3,
    /// Of what is drawn [m].
    pub radius: f32,
    /// Its joints in eye space.
    pub joints: Vec<(Vec3, Quat)>,
}

/// Where an instance stands.
pub fn stand(
    (subject, brought): (&Subject, &Brought),
    (shelf, objects): (&Shelf, &[GpuObject]),
    index: usize,
    lens: &Lens,
    limits: Option<&Thresholds>,
) -> Stand {
    let instance = &subject.instances[index];
    let twin = Twin::new(brought, (shelf, objects), instance, lens);
    let frames = twin.frames();
    let (center, radius, _) = twin.bounds(&frames);
    let [finer, _] = twin.choose(&frames, limits);
    let joints = (0..instance.joints).map(|j| {
        let (turn, place) = twin.joint(j);
        (twin.base + place.truncate(), turn)
    });
    Stand {
        level: finer.map(|(level, ..)| level - twin.mesh().first_level),
        center,
        radius,
        joints: joints.collect(),
    }
}

/// The two parts of an instance: None where one is not drawn. `limits` None: everything at its finest level,
/// nothing culled.
pub fn parts(
    (subject, brought): (&Subject, &Brought),
    (shelf, objects): (&Shelf, &[GpuObject]),
    index: usize,
    lens: &Lens,
    limits: Option<&Thresholds>,
) -> [Option<Part>; 2] {
    let instance = &subject.instances[index];
    let twin = Twin::new(brought, (shelf, objects), instance, lens);
    let frames = twin.frames();
    let choices = twin.choose(&frames, limits);
    let own = instance.vertices_of as usize == index;
    choices.map(|choice| {
        let (level, bin, shares) = choice?;
        let of = shelf.levels[level as usize];
        let vertices: Vec<Vertex> =
            (0..of.vertices).map(|i| twin.vertex(&frames, (of, bin), of.first_vertex + i)).collect();
        let indices = twin.indices(of, bin, &vertices);
        Some(Part { level, bin, shares, vertices: if own { vertices } else { Vec::new() }, indices })
    })
}

impl<'a> Twin<'a> {
    fn new(
        brought: &'a Brought,
        (shelf, objects): (&'a Shelf, &[GpuObject]),
        instance: &'a GpuInstance,
        lens: &'a Lens,
    ) -> Self {
        let object = &objects[instance.object as usize];
        let base = Vec3::from(object.previous).lerp(Vec3::from(object.current), instance.blend);
        Self { brought, shelf, instance, base, lens }
    }

    fn flag(&self, flag: u32) -> bool {
        self.instance.flags & flag != 0
    }

    fn mesh(&self) -> &super::records::GpuMesh {
        &self.shelf.meshes[self.instance.mesh as usize]
    }

    /// A joint between the steps: rotation; translation and scale.
    fn joint(&self, j: u32) -> (Quat, Vec4) {
        let joint = |joints: &[abi::Joint], at: u32| {
            let joint = joints[at as usize];
            (Quat::from_array(joint.rotation), Vec3::from(joint.translation).extend(joint.scale))
        };
        let instance = self.instance;
        let (qb, b) = joint(&self.brought.joints[1], instance.current + j);
        if instance.blend >= 1.0 {
            return (qb, b);
        }
        let (qa, a) = joint(&self.brought.joints[0], instance.previous + j);
        let qb = if qa.dot(qb) < 0.0 { -qb } else { qb };
        let q = Quat::from_vec4(Vec4::from(qa).lerp(Vec4::from(qb), instance.blend)).normalize();
        (q, a.lerp(b, instance.blend))
    }

    /// Where the instance's joints bring the mesh at rest.
    fn frames(&self) -> Vec<Frame> {
        let instance = self.instance;
        let of = |j: u32| {
            let (q, place) = self.joint(j);
            if self.flag(RIGID) {
                return Frame { turn: q, shift: place.truncate(), scale: place.w * instance.scale };
            }
            let rest = &self.shelf.rests[(self.mesh().first_rest + j) as usize];
            let at_rest = Vec3::from(rest.translation);
            let turn = q * Quat::from_array(rest.rotation).conjugate();
            let scale = place.w / rest.scale * instance.scale;
            Frame { turn, shift: place.truncate() - scale * (turn * at_rest), scale }
        };
        (0..instance.joints).map(of).collect()
    }

    /// Middle and radius of what is drawn in eye space, and how much greater than at rest it is.
    fn bounds(&self, frames: &[Frame]) -> (Vec3, f32, f32) {
        if self.flag(DRAWN_ANEW) {
            return (self.base + Vec3::from(self.instance.center), self.instance.radius, 1.0);
        }
        let (mut low, mut high, mut stretch) = (Vec3::splat(1e30), Vec3::splat(-1e30), 0.0_f32);
        for (j, frame) in frames.iter().enumerate() {
            let rest = self.shelf.rests.get(self.mesh().first_rest as usize + j);
            let (middle, reach) = match rest.filter(|_| !self.flag(RIGID)) {
                Some(rest) => (frame.apply(Vec3::from(rest.translation)), rest.reach),
                None => (frame.apply(Vec3::from(self.mesh().center)), self.mesh().radius),
            };
            low = low.min(middle - reach * frame.scale);
            high = high.max(middle + reach * frame.scale);
            stretch = stretch.max(frame.scale);
        }
        let bulge = if self.mesh().flags & DUAL != 0 { 1.1 } else { 1.0 };
        (self.base + 0.5 * (low + high), 0.5 * low.distance(high) * bulge, stretch)
    }

    fn choose(&self, frames: &[Frame], limits: Option<&Thresholds>) -> [Option<(u32, usize, [f32; 2])>; 2] {
        let (center, radius, stretch) = self.bounds(frames);
        let mesh = self.mesh();
        if self.instance.fade >= 1.0 || limits.is_some() && self.lens.culls(center, radius) {
            return [None, None];
        }
        let nearest = (center.dot(self.lens.forward) - radius).max(NEAR);
        let pixels = self.lens.pixels_per_metre() / nearest;
        let error = |l: u32| self.shelf.levels[(mesh.first_level + l) as usize].error * stretch * pixels;
        let Thresholds { mesh_error, lit_mesh, .. } = limits.copied().unwrap_or_default();
        let fits = |l: &u32| limits.is_some() && error(*l) <= mesh_error;
        let chosen = (1..mesh.level_count).filter(fits).max().unwrap_or(0);
        let next = (chosen + 1).min(mesh.level_count - 1);
        let toward = (BAND * mesh_error - error(next)) / ((BAND - 1.0) * mesh_error);
        let coarser = if limits.is_some() && next != chosen { toward.clamp(0.0, 1.0) } else { 0.0 };
        let there = 1.0 - self.instance.fade;
        let most = if self.flag(SMOOTH) { SMOOTH_LIT * lit_mesh } else { lit_mesh };
        let lit = 2.0 * radius * pixels < most && limits.is_some() && self.flag(PLAIN);
        let two_sided = usize::from(mesh.flags & TWO_SIDED != 0);
        let leaf = two_sided == 1 && !self.flag(DRAWN_ANEW);
        let bin = |l: u32| {
            let slim = self.shelf.levels[(mesh.first_level + l) as usize].slim * stretch * pixels;
            match (self.flag(VEIL), lit) {
                (true, _) if self.flag(LIT_VEIL) => BIN_LIT_VEIL,
                (true, _) => BIN_VEIL,
                (false, true) if leaf && slim < THIN_HALF => BIN_LIT_THIN,
                (false, false) if leaf && slim < THIN_HALF => BIN_THIN,
                (false, true) => BIN_LIT + two_sided,
                (false, false) => BIN_PIXEL + two_sided,
            }
        };
        [
            Some((mesh.first_level + chosen, bin(chosen), [coarser * there, there])),
            (coarser > 0.0).then_some((mesh.first_level + next, bin(next), [0.0, coarser * there])),
        ]
    }

    fn vertex(&self, frames: &[Frame], (level, bin): (GpuLevel, usize), vertex: u32) -> Vertex {
        let mesh = self.mesh();
        let mut across = [0.0, NO_ROW];
        let rest = &self.shelf.vertices[(mesh.first_vertex + vertex) as usize];
        let (p, n, thickness) = if self.flag(DRAWN_ANEW) {
            let at = |vertices: &[abi::DrawVertex], first: u32| vertices[(first + vertex) as usize];
            let b = at(&self.brought.vertices[1], self.instance.current);
            let blend = self.instance.blend;
            let a = if blend < 1.0 { at(&self.brought.vertices[0], self.instance.previous) } else { b };
            let p = Vec3::from(a.position).lerp(Vec3::from(b.position), blend);
            let n = unpacked_normal(a.normal).lerp(unpacked_normal(b.normal), blend);
            (p, n, a.thickness + (b.thickness - a.thickness) * blend)
        } else {
            let first = (mesh.first_bone + vertex * mesh.influences) as usize;
            let own = [0xffff_0000];
            let bones = if self.flag(RIGID) {
                &own[..]
            } else {
                &self.shelf.bones[first..first + level.influences as usize]
            };
            let weighted = bones
                .iter()
                .map(|bone| (frames[(bone & 0xffff) as usize], (bone >> 16) as f32 / 65535.0))
                .collect::<Vec<_>>();
            let (v, n) = (Vec3::from(rest.position), unpacked_normal(rest.normal));
            let blend = if mesh.flags & DUAL != 0 { dual } else { linear };
            let (mut p, n) = blend(&weighted, v, n);
            if bin >= BIN_THIN {
                let row = self.shelf.rows[(mesh.first_vertex + vertex) as usize];
                let [axis, wide] =
                    [row.axis, row.wide].map(|way| blend(&weighted, v, unpacked_normal(way)).1);
                let sum: f32 = weighted.iter().map(|(_, weight)| weight).sum();
                let scale = match mesh.flags & DUAL {
                    0 => wide.length() / sum,
                    _ => weighted.iter().map(|(frame, weight)| weight * frame.scale).sum::<f32>() / sum,
                };
                let edge = if bin == BIN_LIT_THIN { LIT_EDGE } else { EDGE };
                let ways = [axis.normalize(), wide.normalize()];
                across = self.widen(&mut p, (row, ways, scale), edge);
            }
            (p, n, rest.thickness * self.instance.scale)
        };
        Vertex {
            clip: self.lens.clip_from_eye() * (self.base + p).extend(1.0),
            normal: n.normalize(),
            thickness_cm: (thickness * 100.0).min(1000.0),
            across,
        }
    }

    /// Moves a vertex of a thin mesh as `widened` of `shaders/mesh_skin.comp` does.
    fn widen(
        &self,
        p: &mut Vec3,
        (row, [axis, wide], scale): (GpuRow, [Vec3; 2], f32),
        edge: f32,
    ) -> [f32; 2] {
        let place = self.base + *p;
        let side = axis.cross(-place);
        let halves = |packed: u32| Vec2::new(from_half(packed), from_half(packed >> 16));
        let (extent, at) = (halves(row.half), halves(row.place));
        if side.length_squared() <= 1e-16 || extent.x <= 0.0 {
            return [0.0, NO_ROW];
        }
        let side = side.normalize();
        let ways = Vec2::new(wide.dot(side), axis.cross(wide).normalize_or_zero().dot(side));
        let half_width = (extent * ways).length().max(1e-5) * scale;
        let off = at.dot(ways) * extent.x * scale;
        let share = (off / half_width).clamp(-1.0, 1.0);
        let pixel = pixel_at(place, self.lens);
        *p += side * (share * (half_width + edge * pixel) - off);
        let half_px = (half_width / pixel).min(NO_ROW);
        [share, if extent.y < 0.0 { -half_px } else { half_px }]
    }

    fn indices(&self, level: GpuLevel, bin: usize, vertices: &[Vertex]) -> Vec<u32> {
        let all = &self.shelf.indices[level.first_index as usize..][..3 * level.triangles as usize];
        let triangles = all.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|i| i - level.first_vertex));
        let seen = |t: [u32; 3]| {
            if bin != BIN_VEIL && bin != BIN_LIT_VEIL {
                return t;
            }
            let [a, b, c] = t.map(|i| {
                let clip = vertices[i as usize].clip;
                Vec3::new(clip.x, clip.y, clip.w)
            });
            let away = Mat3::from_cols(a, b, c).determinant() > 0.0;
            if away == self.flag(FAR_SIDE) { t } else { [t[0]; 3] }
        };
        triangles.flat_map(seen).collect()
    }
}

/// What a half float stands for: no less than 6e-5, or 0.
fn from_half(packed: u32) -> f32 {
    let (sign, size) = (packed & 0x8000, packed & 0x7fff);
    if size == 0 { 0.0 } else { f32::from_bits(sign << 16 | ((size << 13) + (112 << 23))) }
}

/// The header's linear blend.
fn linear(weighted: &[(Frame, f32)], v: Vec3, n: Vec3) -> (Vec3, Vec3) {
    let sum: f32 = weighted.iter().map(|(_, weight)| weight).sum();
    let p = weighted.iter().map(|(frame, weight)| *weight * frame.apply(v)).sum::<Vec3>() / sum;
    (p, weighted.iter().map(|(frame, weight)| *weight * frame.scale * (frame.turn * n)).sum())
}

/// The header's blend of dual quaternions.
fn dual(weighted: &[(Frame, f32)], v: Vec3, n: Vec3) -> (Vec3, Vec3) {
    let sum: f32 = weighted.iter().map(|(_, weight)| weight).sum();
    let side = weighted[0].0.turn;
    let (mut real, mut half, mut scale) = (Vec4::ZERO, Vec4::ZERO, 0.0);
    for (frame, weight) in weighted {
        let signed = if side.dot(frame.turn) < 0.0 { -weight } else { *weight };
        let shift = Quat::from_xyzw(frame.shift.x, frame.shift.y, frame.shift.z, 0.0);
        real += signed * Vec4::from(frame.turn);
        half += signed * 0.5 * Vec4::from(product(shift, frame.turn));
        scale += weight * frame.scale;
    }
    let length = real.length();
    let turn = Quat::from_vec4(real / length);
    let half = Quat::from_vec4(half / length);
    let shift = 2.0 * Vec4::from(product(half, turn.conjugate())).truncate();
    (turn * (v * (scale / sum)) + shift, turn * n)
}

/// Hamilton's product of quaternions that need not be of unit length.
fn product(a: Quat, b: Quat) -> Quat {
    let (va, vb) = (Vec3::new(a.x, a.y, a.z), Vec3::new(b.x, b.y, b.z));
    let v = a.w * vb + b.w * va + va.cross(vb);
    Quat::from_xyzw(v.x, v.y, v.z, a.w * b.w - va.dot(vb))
}

/// The unit vector on an octahedron.
pub fn unpacked_normal(packed: u32) -> Vec3 {
    let half = |v: u32| (f32::from(v as u16 as i16) / 32767.0).max(-1.0);
    let (a, b) = (half(packed), half(packed >> 16));
    let z = 1.0 - a.abs() - b.abs();
    let sign = |v: f32| if v < 0.0 { -1.0 } else { 1.0 };
    let (x, y) = if z < 0.0 { ((1.0 - b.abs()) * sign(a), (1.0 - a.abs()) * sign(b)) } else { (a, b) };
    Vec3::new(x, y, z).normalize()
}
