//! The CPU's twin of the fibre passes (`shaders/fibre_rings.comp`, `fibre_scan.comp`, `fibre_skin.comp`, and
//! the shape of `fibre_ribbon.comp`, whose light is compared with that of the tubes by pictures): tests
//! compare what the GPU wrote with what stands here. Not used for pictures.

use glam::{Mat4, Vec2, Vec3, Vec4};
use reef_abi as abi;

use super::{
    gather::{BLADE, CAP, Gathered, GpuFibre},
    lod::{
        Detail, EDGE, LIT_EDGE, RIBBON, RING_LEVELS, THIN_RADIUS, Thresholds, polygon_scale, ring_position,
        side_count,
    },
    view::{Lens, NEAR},
};

/// A ring of a skinned fibre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Centre in eye space [m].
    pub center: Vec3,
    /// Radius that is drawn [m].
    pub radius: f32,
    /// Unit, angle 0.
    pub normal: Vec3,
    /// True over drawn width.
    pub coverage: f32,
    /// Unit, along the fibre.
    pub tangent: Vec3,
    /// 0 root, 1 last node, 2 end of the cap.
    pub along: f32,
    /// Shares of tangent and radial direction in the surface's normal.
    pub slope: Vec2,
}

/// A vertex as the draw reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Clip space.
    pub clip: Vec4,
    /// Unit, in eye space.
    pub normal: Vec3,
    /// Position along the fibre, 0 to 2.
    pub along: f32,
    /// Cosine and sine of its angle around the fibre.
    pub circle: Vec2,
    /// True radius [cm].
    pub radius_cm: f32,
    /// Half the true width of a ribbon; half of what a tube covers of a pixel, one at most [px].
    pub half_px: f32,
    /// Distance from the middle of a ribbon, [`EDGE`] more than its half width; 0: a tube [px].
    pub edge_px: f32,
}

/// A skinned fibre: None where it is culled.
#[derive(Clone, Debug, PartialEq)]
pub struct Skinned {
    /// What was chosen.
    pub detail: Detail,
    /// Ring by ring.
    pub vertices: Vec<Vertex>,
    /// Relative to the fibre's first vertex.
    pub indices: Vec<u32>,
}

impl Skinned {
    /// Whether two vertices make a ring.
    pub fn is_ribbon(&self) -> bool {
        self.vertices.len() as u32 == self.detail.rings() * RIBBON
    }
}

/// A lit ribbon's strip.
#[derive(Clone, Debug, PartialEq)]
pub struct Strip {
    /// Somewhere thinner than [`THIN_RADIUS`].
    pub thin: bool,
    /// Clip space and true over drawn width, 1 where nothing fades; left and right take turns, the first and
    /// the last stand twice.
    pub vertices: Vec<(Vec4, f32)>,
}

struct Chain<'a> {
    fibre: &'a GpuFibre,
    gathered: &'a Gathered,
    base: Vec3,
    blend: f32,
    count: usize,
}

impl<'a> Chain<'a> {
    fn new(gathered: &'a Gathered, fibre: &'a GpuFibre) -> Self {
        let object = &gathered.objects[fibre.object as usize];
        let blend = fibre.blend(gathered.alpha);
        let base = Vec3::from(object.previous).lerp(Vec3::from(object.current), blend);
        Self { fibre, gathered, base, blend, count: (fibre.nodes_flags & 0xffff) as usize }
    }

    fn node(&self, i: usize) -> (Vec3, f32) {
        let unpack = |n: &abi::FibreNode| Vec3::from(n.position).extend(n.radius);
        let b = unpack(&self.gathered.current_nodes[self.fibre.current_node as usize + i]);
        let n = if self.blend < 1.0 {
            unpack(&self.gathered.previous_nodes[self.fibre.previous_node as usize + i]).lerp(b, self.blend)
        } else {
            b
        };
        (n.truncate() + self.base, n.w)
    }

    fn tangent(&self, i: usize) -> Vec3 {
        let a = self.node(i.saturating_sub(1)).0;
        let b = self.node((i + 1).min(self.count - 1)).0;
        (b - a).normalize_or_zero()
    }
}

/// Rotates `n`, a unit vector across `from`, by the least rotation that turns `from` into `to`.
pub fn transport(n: Vec3, from: Vec3, to: Vec3) -> Vec3 {
    let d = (1.0 + from.dot(to)).max(1e-4);
    let n = n - (from + to) * (n.dot(to) / d);
    (n - to * n.dot(to)).normalize_or_zero()
}

/// Skins one fibre. `limits` None: everything at full detail, nothing culled.
pub fn skin(gathered: &Gathered, index: usize, lens: &Lens, limits: Option<&Thresholds>) -> Option<Skinned> {
    let fibre = &gathered.fibres[index];
    let (detail, rings) = rings(gathered, fibre, lens, limits)?;
    let flatness = if fibre.nodes_flags >> 16 & BLADE != 0 { fibre.flatness } else { 1.0 };
    let clip = lens.clip_from_eye();
    let sides = detail.sides(fibre.sides);
    let mut vertices = Vec::new();
    for ring in &rings {
        for side in 0..sides {
            vertices.push(vertex(ring, side, &detail, (fibre.sides, flatness), lens, &clip));
        }
    }
    let quads = if sides == RIBBON { 1 } else { sides };
    let mut indices = Vec::new();
    for ring in 0..detail.rings() - 1 {
        for side in 0..quads {
            let next = if side + 1 == sides { 0 } else { side + 1 };
            let (a, b) = (ring * sides, (ring + 1) * sides);
            indices.extend([a + side, a + next, b + next, a + side, b + next, b + side]);
        }
    }
    Some(Skinned { detail, vertices, indices })
}

/// The strip of one fibre, where it is a lit ribbon.
pub fn strip(gathered: &Gathered, index: usize, lens: &Lens, limits: &Thresholds) -> Option<Strip> {
    let fibre = &gathered.fibres[index];
    let chain = Chain::new(gathered, fibre);
    let bounds = bounds(&chain);
    let far = bounds.center.length() + bounds.reach;
    let radius_px = bounds.radius * lens.pixels_per_metre() / (far - 2.0 * bounds.reach).max(NEAR);
    if fibre.plain == 0 || radius_px >= limits.lit_ribbon {
        return None;
    }
    let (_, rings) = rings(gathered, fibre, lens, Some(limits))?;
    let clip = lens.clip_from_eye();
    let tip = chain.node(chain.count - 1).1;
    let thin = bounds.thinnest < THIN_RADIUS * far / lens.pixels_per_metre();
    let mut vertices = Vec::new();
    for (k, ring) in rings.iter().enumerate() {
        // The end is round from wherever it is seen: it rises across the line of sight, not along the fibre.
        let rise = if ring.along > 1.0 { tip / ring.coverage * ring.slope.x } else { 0.0 };
        let place = ring.center - ring.tangent * rise;
        let side = ring.tangent.cross(-place).normalize_or(lens.right);
        let rise = if k == 0 { -ring.radius } else { rise };
        let center = place + side.cross(place).normalize_or_zero() * rise;
        // What is thin is drawn wider on both sides, where it fades.
        let half = ring.radius * ring.coverage;
        let width = if thin { half + LIT_EDGE * pixel_at(center, lens) } else { ring.radius };
        let filled = if thin { half / width } else { 1.0 };
        let edge = |sign: f32| (clip * (center + side * (sign * width)).extend(1.0), filled);
        vertices.extend([edge(-1.0), edge(1.0)]);
    }
    vertices.insert(0, *vertices.first()?);
    vertices.push(*vertices.last()?);
    Some(Strip { thin, vertices })
}

/// The level of detail and the rings of one fibre; None where it is culled.
pub fn rings(
    gathered: &Gathered,
    fibre: &GpuFibre,
    lens: &Lens,
    limits: Option<&Thresholds>,
) -> Option<(Detail, Vec<Ring>)> {
    let chain = Chain::new(gathered, fibre);
    let cap = fibre.nodes_flags >> 16 & CAP != 0;
    let detail = match limits {
        None => Detail::FULL,
        Some(limits) => detail_of(&chain, lens, limits, cap)?,
    };

    let mut tangent = chain.tangent(0);
    let mut normal =
        Vec3::from(fibre.previous_normal).lerp(Vec3::from(fibre.normal), fibre.blend(gathered.alpha));
    normal -= tangent * normal.dot(tangent);
    if normal.length_squared() < 1e-8 {
        normal = tangent.cross(if tangent.x.abs() < 0.7 { Vec3::X } else { Vec3::Y });
    }
    normal = normal.normalize_or_zero();
    let mut at = 0;
    let top_radius = chain.node(chain.count - 1).1;
    let rings = (0..detail.rings())
        .map(|k| {
            let mut w = ring_position(detail.ring_level, k, cap);
            if detail.ring_level + 1 < RING_LEVELS {
                w += (ring_position(detail.ring_level + 1, k >> 1, cap) - w) * detail.ring_morph;
            }
            let along = w.min(1.0) * (chain.count - 1) as f32;
            let segment = (along as usize).min(chain.count - 2);
            while at < segment {
                at += 1;
                let next = chain.tangent(at);
                normal = transport(normal, tangent, next);
                tangent = next;
            }
            let frame = (tangent, normal);
            ring(&chain, lens, frame, segment, along - segment as f32, w, cap.then_some(top_radius))
        })
        .collect();
    Some((detail, rings))
}

/// A sphere around a fibre, and its extremes [m].
struct Bounds {
    center: Vec3,
    reach: f32,
    length: f32,
    radius: f32,
    thinnest: f32,
}

fn bounds(chain: &Chain<'_>) -> Bounds {
    let (first, mut radius) = chain.node(0);
    let (mut low, mut high, mut last, mut length, mut thinnest) = (first, first, first, 0.0, radius);
    for i in 1..chain.count {
        let (p, r) = chain.node(i);
        low = low.min(p);
        high = high.max(p);
        radius = radius.max(r);
        thinnest = r.min(thinnest);
        length += p.distance(last);
        last = p;
    }
    let reach = low.distance(high) * 0.5 + radius * 1.5;
    Bounds { center: (low + high) * 0.5, reach, length, radius, thinnest }
}

fn detail_of(chain: &Chain<'_>, lens: &Lens, limits: &Thresholds, cap: bool) -> Option<Detail> {
    let Bounds { center, reach, length, radius, .. } = bounds(chain);
    if lens.culls(center, reach) {
        return None;
    }
    let pixels = lens.pixels_per_metre() / (center.length() - reach).max(NEAR);
    Some(Detail::choose(length * pixels, radius * pixels, chain.fibre.sides, cap, limits))
}

/// Ring at `t` of a segment; `frame`: tangent and normal at the segment's first node.
fn ring(
    chain: &Chain<'_>,
    lens: &Lens,
    frame: (Vec3, Vec3),
    segment: usize,
    t: f32,
    w: f32,
    disc: Option<f32>,
) -> Ring {
    let (a, ra) = chain.node(segment);
    let (b, rb) = chain.node(segment + 1);
    let span = a.distance(b);
    let ta = frame.0 * span;
    let tb = chain.tangent(segment + 1) * span;
    let (t2, t3) = (t * t, t * t * t);
    let mut p = a * (2.0 * t3 - 3.0 * t2 + 1.0)
        + ta * (t3 - 2.0 * t2 + t)
        + b * (3.0 * t2 - 2.0 * t3)
        + tb * (t3 - t2);
    let d = (a - b) * (6.0 * t2 - 6.0 * t) + ta * (3.0 * t2 - 4.0 * t + 1.0) + tb * (3.0 * t2 - 2.0 * t);
    let d = d.normalize_or_zero();
    let r = ra + (rb - ra) * t;
    let pixel = pixel_at(p, lens);
    let drawn = r.max(0.5 * pixel);
    let taper = (ra - rb) / span.max(1e-9);
    let bevel = 1.0 / (1.0 + taper * taper).sqrt();
    let mut slope = Vec2::new(taper * bevel, bevel);
    let mut factor = 1.0;
    if w > 1.0 {
        let q = w - 1.0;
        let rise = if let Some(top) = disc {
            factor = 1.0 - q;
            let rise = top * disc_profile(q);
            let ahead = top * disc_profile(q + 0.02);
            slope = Vec2::new(1.0, (ahead - rise) / (0.02 * top)).normalize_or_zero();
            rise
        } else {
            let (sin, cos) = (q * std::f32::consts::FRAC_PI_2).sin_cos();
            factor = cos;
            slope = Vec2::new(sin, cos);
            drawn * sin
        };
        p += d * rise;
    }
    Ring {
        center: p,
        radius: drawn * factor.max(0.0),
        normal: transport(frame.1, frame.0, d),
        coverage: r / drawn,
        tangent: d,
        along: w,
        slope,
    }
}

/// Height of the oral disc over its rim, in radii; q: 0 at the rim, 1 in the mouth.
pub fn disc_profile(q: f32) -> f32 {
    let smooth = |a: f32, b: f32| {
        let t = ((q - a) / (b - a)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    0.16 * (q * 5.0).min(std::f32::consts::FRAC_PI_2).sin() - 0.20 * smooth(0.1, 0.7)
        + 0.16 * smooth(0.62, 0.82)
        - 0.22 * smooth(0.86, 1.0)
}

fn vertex(
    ring: &Ring,
    side: u32,
    detail: &Detail,
    (full_sides, flatness): (u32, f32),
    lens: &Lens,
    clip: &Mat4,
) -> Vertex {
    let sides = detail.sides(full_sides);
    let coarser = side_count(full_sides, detail.side_level + 1);
    let across = ring.tangent.cross(ring.normal);
    let (offset, normal, circle);
    let (mut half_px, mut edge_px) = (0.5 * ring.coverage, 0.0);
    if sides == RIBBON {
        let s = ring.tangent.cross(-ring.center);
        let size = s.length_squared();
        let s = if size > 1e-16 { s / size.sqrt() } else { ring.normal };
        let sign = if side == 0 { -1.0 } else { 1.0 };
        let (a, b) = (s.dot(ring.normal), s.dot(across));
        let pixel = pixel_at(ring.center, lens);
        let half = (a * a + b * b * flatness * flatness).sqrt() * ring.radius * ring.coverage;
        half_px = half / pixel;
        edge_px = sign * (half_px + EDGE);
        offset = s * (sign * (half + EDGE * pixel));
        let facing = s.cross(ring.tangent);
        let along_face = sign * 0.8 * a + 0.6 * flatness * facing.dot(ring.normal);
        let off_face = sign * 0.8 * b * flatness + 0.6 * facing.dot(across);
        normal = (ring.normal * (along_face * flatness) + across * off_face).normalize_or_zero();
        circle = Vec2::new(a, b) * sign;
    } else {
        let fine = side as f32 / sides as f32;
        let coarse = (side >> 1) as f32 / coarser.max(1) as f32;
        let angle = std::f32::consts::TAU * (fine + (coarse - fine) * detail.side_morph);
        circle = Vec2::new(angle.cos(), angle.sin());
        let wide = polygon_scale(sides);
        let scale = wide + (polygon_scale(coarser) - wide) * detail.side_morph;
        let radial = ring.normal * circle.x + across * circle.y;
        offset = radial * (ring.radius * scale);
        normal = radial * ring.slope.y + ring.tangent * ring.slope.x;
    }
    Vertex {
        clip: *clip * (ring.center + offset).extend(1.0),
        normal,
        along: ring.along,
        circle,
        radius_cm: ring.radius * ring.coverage * 100.0,
        half_px,
        edge_px,
    }
}

/// How wide a pixel is at a place in eye space [m].
pub(crate) fn pixel_at(place: Vec3, lens: &Lens) -> f32 {
    place.dot(lens.forward).max(NEAR) / lens.pixels_per_metre()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{gather::gather, sample};

    fn bent(angle: f32) -> (Gathered, Lens) {
        let camera = sample::looking_at(DVec3::new(0.0, 0.05, 0.5), DVec3::new(0.0, 0.05, 0.0));
        let lens = Lens::new(&camera, [640, 360], 60.0);
        let mut outputs = sample::tentacles(
            &sample::Bed { count: 1, spacing: 0.1, per_row: 1, y: 0.0, length: 0.1, radius: 0.004 },
            0.0,
        );
        let mut p = Vec3::ZERO;
        for (i, node) in outputs.fibre_nodes.iter_mut().enumerate() {
            node.position = p.to_array();
            let a = angle * i as f32;
            p += 0.01 * Vec3::new(a.sin(), a.cos(), 0.3 * a.sin());
        }
        let frame = sample::frame(1, camera, outputs);
        (gather(&frame, &frame, 1.0, &lens, 0), lens)
    }

    #[test]
    fn rings_are_perpendicular_keep_their_radius_and_pass_through_the_nodes_at_any_bend() {
        for angle in [0.0, 0.1, 0.3, 0.6] {
            let (gathered, lens) = bent(angle);
            let (_, rings) = rings(&gathered, &gathered.fibres[0], &lens, None).expect("nothing is culled");
            for ring in &rings {
                // Rounding of a few f32 operations on unit vectors.
                assert!(ring.normal.dot(ring.tangent).abs() < 1e-5);
                assert!((ring.normal.length() - 1.0).abs() < 1e-5);
            }
            let eye = lens.eye.as_vec3();
            let root = Vec3::from(gathered.current_nodes[0].position);
            let tip = Vec3::from(gathered.current_nodes[9].position);
            assert!((rings[0].center + eye).distance(root) < 1e-6);
            assert!(
                (rings[12].center + eye).distance(tip) < 1e-6,
                "the chain's last ring lies on its last node"
            );
            assert!((rings[0].radius - 0.004).abs() < 1e-7);
            let narrower = rings[..13].windows(2).all(|w| w[1].radius <= w[0].radius);
            assert!(narrower, "a taper stays monotone: no pinching at bends");
        }
    }

    #[test]
    fn frames_do_not_twist_in_a_plane_bend() {
        let (mut gathered, lens) = bent(0.4);
        for node in &mut gathered.current_nodes {
            node.position[2] = 0.0;
        }
        gathered.previous_nodes = gathered.current_nodes.clone();
        gathered.fibres[0].normal = [0.0, 0.0, 1.0];
        gathered.fibres[0].previous_normal = [0.0, 0.0, 1.0];
        let (_, rings) = rings(&gathered, &gathered.fibres[0], &lens, None).expect("nothing is culled");
        for ring in rings {
            // A bend in the x-y plane leaves the normal along z alone.
            assert!(ring.normal.distance(Vec3::Z) < 1e-5, "{:?}", ring.normal);
        }
    }

    #[test]
    fn the_tip_is_round_and_closed() {
        let (gathered, lens) = bent(0.2);
        let skinned = skin(&gathered, 0, &lens, None).expect("nothing is culled");
        let last = &skinned.vertices[15 * 8..];
        // cos(pi/2) in f32 leaves 4e-8 of the radius.
        assert!(last.iter().all(|v| v.clip.distance(last[0].clip) < 1e-6), "the last ring is a point");
        let before = &skinned.vertices[14 * 8..15 * 8];
        assert!(before[0].clip.distance(before[4].clip) > 1e-4, "the one before is not");
    }

    #[test]
    fn triangles_face_outward() {
        let (gathered, lens) = bent(0.25);
        let (_, rings) = rings(&gathered, &gathered.fibres[0], &lens, None).expect("nothing is culled");
        let skinned = skin(&gathered, 0, &lens, None).expect("nothing is culled");
        let inverse = lens.clip_from_eye().inverse();
        let eye: Vec<Vec3> =
            skinned.vertices.iter().map(|v| inverse * v.clip).map(|p| p.truncate() / p.w).collect();
        for (i, t) in skinned.indices.chunks(3).enumerate().filter(|(i, _)| *i < 12 * 16) {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| eye[i as usize]);
            let outward = (a + b + c) / 3.0 - rings[i / 16].center;
            assert!((b - a).cross(c - a).dot(outward) > 0.0, "triangle {i}");
        }
    }

    #[test]
    fn a_fibre_thinner_than_a_pixel_is_drawn_a_pixel_wide_and_counts_less() {
        let (gathered, _) = bent(0.2);
        let far = sample::looking_at(DVec3::new(0.0, 0.05, 30.0), DVec3::ZERO);
        let far_lens = Lens::new(&far, [640, 360], 60.0);
        let frame_gathered = Gathered {
            objects: vec![super::super::gather::GpuObject {
                previous: [0.0, 0.0, -30.0],
                current: [0.0, 0.0, -30.0],
                ..Default::default()
            }],
            ..gathered
        };
        let (detail, rings) =
            rings(&frame_gathered, &frame_gathered.fibres[0], &far_lens, Some(&Thresholds::default()))
                .expect("it is in view");
        assert_eq!(detail.sides(8), RIBBON);
        let pixel = 30.0 / far_lens.pixels_per_metre();
        assert!((rings[0].radius - 0.5 * pixel).abs() < 1e-3 * pixel);
        assert!((rings[0].coverage - 0.004 / (0.5 * pixel)).abs() < 1e-3);
    }
}
