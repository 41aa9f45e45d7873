//! What a step hands to the renderer: an object, the elements of arms and bell, and the tentacles of each
//! animal.

use glam::Vec3;
use reef_flow::{color::linear_rgb, random::mix};
use reef_sdk::{
    Host, Mesh, MeshDesc, MeshError,
    abi::{self, Actor, Fibre, FibreNode, Material, MeshDraw, MeshVertex, Object, fnv1a_32},
};

use crate::{
    bloom::{Bloom, PartMesh, Seen},
    paint::{DENSEST, Paint},
    species::Look,
};

/// Materials of a species: of arms, bell and tentacles.
pub(crate) const MATERIALS: usize = 3;
/// Hues of individuals differ by ± this [rad], and their lightness by ± this share.
const HUE: f32 = 0.05;
const VALUE: f32 = 0.06;
/// How much of what is behind them arms hide at their root and at their tip.
const ARMS: [f32; 2] = [0.8, 0.35];
/// Sides of a tentacle.
const SIDES: u32 = 6;
/// Of what makes light: how bright, what is left of its colours, and the width and softness of the wave that
/// runs over it, as shares of its length.
const GLOW: f32 = 5.0;
const DARK: f32 = 0.05;
const WAVE: f32 = 0.16;
const SOFT: f32 = 0.5;
/// How much light tentacles and arms make, as a share of the bell's, and of its colour at their tips.
const FAINT: f32 = 0.3;
const DIM: f32 = 0.4;
/// Share of the period in which the wave runs from the apex to the margin.
const OUTWARD: f64 = 0.35;

/// What the renderer knows a species by.
#[derive(Clone, Debug)]
pub(crate) struct Wear {
    /// Arms and bell, near and far; None: it has no arms.
    meshes: [[Option<u32>; 2]; 2],
    /// Among the materials, the first of its own.
    material: u32,
    /// Of its name.
    hash: u32,
}

impl Wear {
    /// Uploads the meshes of a species of which `animal` is one. `material`: its first.
    pub(crate) fn new(
        host: &Host,
        name: &str,
        paint: &Paint,
        (bloom, animal): (&Bloom, usize),
        material: usize,
        kept: &mut Vec<Mesh>,
    ) -> Result<Self, MeshError> {
        let mut meshes = [[None; 2]; 2];
        for (far, own) in meshes.iter_mut().enumerate() {
            for (part, (mut mesh, id)) in
                bloom.meshes(animal, far == 1).into_iter().flatten().zip(own).enumerate()
            {
                if mesh.vertices.is_empty() {
                    continue;
                }
                for vertex in &mut mesh.vertices {
                    tint(vertex, part, paint);
                }
                let uploaded = upload(host, &format!("{name} {part} {far}"), &mesh)?;
                *id = Some(uploaded.id());
                kept.push(uploaded);
            }
        }
        Ok(Self { meshes, material: material as u32, hash: fnv1a_32(name.as_bytes()) })
    }
}

fn upload(host: &Host, name: &str, mesh: &PartMesh) -> Result<Mesh, MeshError> {
    host.mesh(&MeshDesc { name, vertices: &mesh.vertices, indices: &mesh.indices, ..MeshDesc::default() })
}

/// The opacity of a vertex of arms (0) or bell (1).
fn tint(vertex: &mut MeshVertex, part: usize, paint: &Paint) {
    let [u, v] = vertex.uv.map(f64::from);
    let share = if part == 0 {
        let [root, tip] = ARMS;
        f64::from(root + (tip - root) * vertex.uv[1]) / DENSEST
    } else {
        paint.opacity(u, v) / DENSEST
    };
    let alpha = (share.clamp(0.0, 1.0) * 255.0).round() as u32;
    vertex.color = 0x00ff_ffff | (alpha << 24);
}

fn rgba(text: &str, alpha: f32) -> [f32; 4] {
    let [r, g, b] = linear_rgb(text).unwrap_or([0.5; 3]);
    [r, g, b, alpha]
}

/// The materials of a species whose bell has a picture.
pub(crate) fn materials(look: &Look, picture: u32, glows: bool) -> [Material; MATERIALS] {
    let tissue = Material {
        translucency: look.translucency as f32,
        wrap: 0.5,
        rim: 0.3,
        specular: 0.0003,
        roughness: 1.0,
        ..Material::default()
    };
    // What hides everything is no veil.
    let opacity = if look.opacity < 1.0 { DENSEST as f32 } else { 1.0 };
    let [arms, bell] = [&look.arms, &look.bell].map(|text| rgba(text, opacity));
    let tentacle = rgba(&look.tentacles, 1.0);
    let mut made = [
        Material { base: arms, tip: arms, ..tissue },
        Material { base: bell, tip: bell, texture: picture, ..tissue },
        Material { base: tentacle, tip: [tentacle[0], tentacle[1], tentacle[2], 0.3], ..tissue },
    ];
    if glows {
        let dark = |[r, g, b, a]: [f32; 4]| [DARK * r, DARK * g, DARK * b, a];
        let light = rgba(&look.glow, WAVE);
        for (part, material) in made.iter_mut().enumerate() {
            (material.base, material.tip) = (dark(material.base), dark(material.tip));
            material.glow = GLOW;
            if part == 1 {
                material.texture = 0;
                material.pattern = abi::PATTERN_BANDS;
                (material.accent, material.pattern_scale, material.pattern_softness) = (light, 1.0, SOFT);
            } else {
                material.glow *= FAINT;
                let [r, g, b, _] = light;
                material.tip = [DIM * r, DIM * g, DIM * b, material.tip[3]];
            }
        }
    }
    made
}

/// Where the wave of light is on the bell, from the outer apex (0) over the margin (1/2) to the inner one: it
/// is at the margin when the contraction ends.
fn wave(phase: f64) -> f64 {
    if phase < OUTWARD { 0.5 * phase / OUTWARD } else { 0.5 + 0.5 * (phase - OUTWARD) / (1.0 - OUTWARD) }
}

/// What one animal's elements share.
struct Own {
    seen: Seen,
    hue: f32,
    value: f32,
}

fn own(bloom: &Bloom, animal: usize) -> Option<Own> {
    let seen = bloom.seen(animal)?;
    let chance = mix(seen.id);
    let part = |shift: u32| ((chance >> shift) & 0xffff) as f32 / 32767.5 - 1.0;
    Some(Own { seen, hue: HUE * part(0), value: VALUE * part(16) })
}

/// Objects of all.
pub(crate) fn objects(bloom: &Bloom, into: &mut [Object]) {
    for (seen, object) in (0..bloom.len()).filter_map(|i| bloom.seen(i)).zip(into) {
        *object = Object {
            id: seen.id,
            origin: seen.place.to_array(),
            bounds_radius: seen.reach,
            ..Object::default()
        };
    }
}

/// How many elements [`draws`] writes.
pub(crate) fn draw_count(bloom: &Bloom, wears: &[Wear]) -> usize {
    let parts = |seen: Seen| wears[seen.species].meshes[usize::from(seen.far)].iter().flatten().count();
    (0..bloom.len()).filter_map(|i| bloom.seen(i)).map(parts).sum()
}

/// Elements of arms and bells. `fade`: which share of the skin is not there.
pub(crate) fn draws(bloom: &Bloom, wears: &[Wear], fade: f32, into: &mut [MeshDraw]) {
    let mut room = into.iter_mut();
    let mut first = 0;
    for (i, counts) in (0..bloom.len()).filter_map(|i| Some((i, bloom.vertices(i)?))) {
        let Some(own) = own(bloom, i) else { continue };
        let wear = &wears[own.seen.species];
        let meshes = wear.meshes[usize::from(own.seen.far)];
        for ((part, mesh), count) in (0..).zip(meshes).zip(counts) {
            if let (Some(mesh), Some(slot)) = (mesh, if mesh.is_some() { room.next() } else { None }) {
                *slot = MeshDraw {
                    object: i as u32,
                    mesh,
                    material: wear.material + part,
                    first_vertex: first,
                    vertex_count: count as u32,
                    phase: (1.0 - wave(own.seen.phase)).clamp(0.0, 1.0) as f32,
                    hue: own.hue,
                    value: own.value,
                    fade,
                    ..MeshDraw::default()
                };
            }
            first += count as u32;
        }
    }
}

/// Tentacles of all.
pub(crate) fn fibre_count(bloom: &Bloom) -> usize {
    (0..bloom.len()).filter_map(|i| bloom.tentacles(i)).map(|[count, _]| count).sum()
}

/// Tentacles of all, whose nodes are known.
pub(crate) fn fibres(bloom: &Bloom, wears: &[Wear], nodes: &[FibreNode], into: &mut [Fibre]) {
    let mut room = into.iter_mut();
    let mut first = 0;
    for (i, [count, points]) in (0..bloom.len()).filter_map(|i| Some((i, bloom.tentacles(i)?))) {
        let Some(seen) = bloom.seen(i) else { continue };
        for tube in 0..count {
            let place = |k: usize| Vec3::from(nodes[first + k].position);
            let along = (place(1) - place(0)).normalize_or(Vec3::NEG_Y);
            if let Some(fibre) = room.next() {
                *fibre = Fibre {
                    object: i as u32,
                    first_node: first as u32,
                    node_count: points as u32,
                    material: wears[seen.species].material + 2,
                    sides: SIDES,
                    variation: mix(seen.id ^ ((tube as u64) << 32)) as u32,
                    flatness: 1.0,
                    normal: along.any_orthonormal_vector().to_array(),
                    ..Fibre::default()
                };
            }
            first += points;
        }
    }
}

/// What others perceive of each.
pub(crate) fn actors(bloom: &Bloom, wears: &[Wear], into: &mut [Actor]) {
    for (seen, actor) in (0..bloom.len()).filter_map(|i| bloom.seen(i)).zip(into) {
        *actor = Actor {
            id: seen.id,
            position: seen.place.to_array(),
            velocity: seen.velocity.to_array(),
            radius: (0.5 * seen.diameter) as f32,
            forward: seen.axis.to_array(),
            species: wears[seen.species].hash,
            ..Actor::default()
        };
    }
}
