//! The surface in 3D.

use std::collections::BTreeMap;

use glam::{DVec2, Vec3};
use reef_flow::Level;
use reef_jellyfish_model::{
    slice::{Build, Gait, Slice},
    surface::{Bell, Disc, Form, Frame, Fringe, FringeForm},
    trail::Trail,
};
use reef_sdk::abi::DrawVertex;

use crate::slice::slice;

const SMOOTH: Form = Form {
    around: 64,
    rings: 92,
    margin_thickness: 0.3,
    structure: 0.0,
    structures: 8,
    lobes: false,
    compression: 0.0,
    compressions: 16,
    noise: 0.0,
};

fn animal() -> Slice<f32> {
    slice(Build::default(), 50, Gait::default())
}

fn bell(form: Form, rest: &Slice<f32>, seed: u64) -> Bell {
    let chain: Vec<DVec2> = rest.chain().collect();
    Bell::new(form, rest.build().thickness, (&chain, 1), seed).expect("a form")
}

fn vertices(bell: &mut Bell, slice: &Slice<f32>, time: f64) -> Vec<DrawVertex> {
    let mut vertices = vec![DrawVertex::default(); bell.form().bell_vertices()];
    let frame = Frame::default();
    bell.write(Level::best(), [(slice.chain(), slice.place(), frame)], time, &mut vertices);
    vertices
}

fn normal(vertex: &DrawVertex) -> Vec3 {
    let half = |v: u32| f32::from(v as u16 as i16) / 32767.0;
    let (a, b) = (half(vertex.normal), half(vertex.normal >> 16));
    let z = 1.0 - a.abs() - b.abs();
    let sign = |v: f32| if v < 0.0 { -1.0 } else { 1.0 };
    let (x, y) = if z < 0.0 { ((1.0 - b.abs()) * sign(a), (1.0 - a.abs()) * sign(b)) } else { (a, b) };
    Vec3::new(x, y, z).normalize()
}

fn place(vertex: &DrawVertex) -> Vec3 {
    Vec3::from(vertex.position)
}

/// Signed volume within a closed surface [m³].
fn volume(indices: &[u32], vertices: &[DrawVertex]) -> f64 {
    let triangles = indices.as_chunks::<3>().0.iter();
    triangles
        .map(|triangle| {
            let [a, b, c] = triangle.map(|i| place(&vertices[i as usize]).as_dvec3());
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}

/// The smallest cosine between a triangle and the normals of its corners.
fn worst(indices: &[u32], vertices: &[DrawVertex]) -> f32 {
    let triangles = indices.as_chunks::<3>().0.iter();
    triangles.fold(1.0_f32, |worst, triangle| {
        let [a, b, c] = triangle.map(|i| place(&vertices[i as usize]));
        let face = (b - a).cross(c - a).normalize_or_zero();
        triangle.iter().fold(worst, |worst, i| worst.min(face.dot(normal(&vertices[*i as usize]))))
    })
}

#[test]
fn the_surface_is_closed() {
    for form in [Form::default(), Form { around: 128, rings: 8, ..Form::default() }] {
        let indices = form.bell_indices();
        let mut edges = BTreeMap::new();
        for [a, b, c] in indices.as_chunks::<3>().0 {
            for edge in [(*a, *b), (*b, *c), (*c, *a)] {
                assert!(edges.insert(edge, ()).is_none(), "{edge:?} is there twice");
            }
        }
        assert!(edges.keys().all(|(a, b)| edges.contains_key(&(*b, *a))));
        // Euler: a sphere.
        let (v, e, f) = (form.bell_vertices(), edges.len() / 2, indices.len() / 3);
        assert_eq!(v + f, e + 2);
        assert_eq!(form.bell_mesh().len(), v);
    }
}

#[test]
fn normals_stand_outward_through_whole_cycles() {
    // One that turns: its sides are not alike.
    let mut slice = slice::<f32>(Build::default(), 50, Gait { turn: 0.05, ..Gait::default() });
    let rest = animal();
    for form in [SMOOTH, Form::default(), Form { lobes: true, structures: 4, ..Form::default() }] {
        let mut bell = bell(form, &rest, 5);
        let indices = form.bell_indices();
        let mut least = 1.0_f32;
        for step in 0..600 {
            slice.step(Level::best(), 0.005);
            if step % 10 == 0 {
                let vertices = vertices(&mut bell, &slice, f64::from(step) * 0.2);
                assert!(volume(&indices, &vertices) > 1e-6, "{}", volume(&indices, &vertices));
                assert!(vertices.iter().all(|vertex| place(vertex).is_finite() && vertex.thickness > 0.0));
                least = least.min(worst(&indices, &vertices));
            }
        }
        println!("least cosine {least}");
        assert!(least > 0.0, "{form:?}: {least}");
    }
}

/// An animal whose points have come nearer to its axis, by this share.
fn squeezed(share: f64) -> Slice<f32> {
    let mut slice = animal();
    let middle = slice.place();
    let points: Vec<f64> = slice.save().points.as_chunks::<2>().0.iter().map(|p| p[0] - middle.x).collect();
    slice.displace(|i| DVec2::new(-share * points[i], 0.0));
    slice
}

#[test]
fn a_circle_gives_a_surface_of_revolution() {
    // Once as it rests, and once contracted and evenly thicker.
    let thicker = Form { compression: 0.25, compressions: 0, ..SMOOTH };
    for (form, slice) in [(SMOOTH, animal()), (thicker, squeezed(0.5))] {
        let vertices = vertices(&mut bell(form, &animal(), 1), &slice, 0.0);
        let size = slice.build().diameter as f32;
        for ring in vertices[..92 * 64].chunks_exact(64) {
            let [x, y, z] = ring[0].position;
            let (radius, height) = (x.hypot(z), y);
            for vertex in ring {
                let [x, y, z] = vertex.position;
                assert!((x.hypot(z) - radius).abs() < 1e-6 * size && (y - height).abs() < 1e-6 * size);
                // And its normals lie in planes through the axis.
                let normal = normal(vertex);
                assert!((normal.x * z - normal.z * x).abs() < 1e-4 * radius.max(1e-3), "{normal} {x} {z}");
            }
        }
    }
}

#[test]
fn the_exumbrella_stands_off_by_the_thickness() {
    let rest = animal();
    let mut bell = bell(SMOOTH, &rest, 1);
    let vertices = vertices(&mut bell, &rest, 0.0);
    let [outer, inner] = [92 * 64, 92 * 64 + 1].map(|i| place(&vertices[i]));
    assert!(((outer - inner).y - 0.004).abs() < 1e-6, "{outer} {inner}");
    assert_eq!(vertices[92 * 64].thickness, 0.004);
    // Nearer to the margin it is thinner, and so are the places of both sides.
    let apart = place(&vertices[38 * 64]).distance(place(&vertices[(91 - 38) * 64]));
    assert!(
        (apart / vertices[38 * 64].thickness - 1.0).abs() < 0.1,
        "{apart} {}",
        vertices[38 * 64].thickness
    );
    assert!(apart < 0.0025, "{apart}");
    // At the margin 0.3 of it.
    assert!((vertices[45 * 64].thickness - 0.0012).abs() < 1e-4, "{}", vertices[45 * 64].thickness);
}

/// The bell with and without something, relaxed and contracted: how far vertices moved [m], ring by ring.
fn moved(form: Form, contracted: bool) -> Vec<Vec<f32>> {
    let (slice, rest) = (if contracted { squeezed(0.54) } else { animal() }, animal());
    let [with, without] = [form, SMOOTH].map(|form| vertices(&mut bell(form, &rest, 3), &slice, 40.0));
    let way = |(a, b): (&DrawVertex, &DrawVertex)| place(a).distance(place(b));
    let all: Vec<f32> = with.iter().zip(&without).map(way).collect();
    all[..92 * 64].chunks_exact(64).map(<[f32]>::to_vec).collect()
}

fn most(rings: &[Vec<f32>]) -> f32 {
    rings.iter().flatten().fold(0.0, |most, value| most.max(*value))
}

#[test]
fn compression_wrinkles_the_contracted_exumbrella_alone() {
    let form = Form { compression: 0.25, ..SMOOTH };
    // What is left is the rounding of the lengths at rest.
    assert!(most(&moved(form, false)) < 1e-7);
    let rings = moved(form, true);
    assert_eq!(most(&rings[46..]), 0.0);
    // Fully contracted, a ring halfway down is thicker by η to η + κ of a quarter of its thickness.
    let ring = &rings[23];
    let thickness = 0.004 * (0.3 + 0.7 * (1.0 - (2.0_f32 * 24.0 / 93.0).powi(2)));
    let (low, high) = ring.iter().fold((1.0_f32, 0.0_f32), |(low, high), v| (low.min(*v), high.max(*v)));
    assert!((low / (0.25 * thickness) - 0.34).abs() < 0.05, "{low}");
    assert!((high / (0.25 * thickness) - 0.51).abs() < 0.08, "{high}");
}

#[test]
fn structures_and_noise_move_both_sides_and_leave_the_apex() {
    for form in [Form { structure: 0.375, ..SMOOTH }, Form { noise: 2.25, ..SMOOTH }] {
        let rings = moved(form, false);
        let [outer, inner] = [&rings[30], &rings[92 - 1 - 30]];
        assert!(most(&rings) > 5e-4 && most(&rings[..1]) < 0.1 * most(&rings), "{form:?}");
        for (a, b) in outer.iter().zip(inner) {
            assert!((a - b).abs() < 1e-6, "{form:?}: {a} {b}");
        }
    }
    // Figure 11's scale: 0.375 ϑ.
    let rings = moved(Form { structure: 0.375, ..SMOOTH }, false);
    assert!((most(&rings[30..46]) / (0.375 * 0.004) - 1.0).abs() < 0.02, "{}", most(&rings[30..46]));
}

#[test]
fn noise_closes_around_the_bell_and_differs_from_animal_to_animal() {
    let (rest, form) = (animal(), Form { noise: 2.25, ..SMOOTH });
    let at = |seed: u64, time: f64| vertices(&mut bell(form, &rest, seed), &rest, time);
    let smooth = vertices(&mut bell(SMOOTH, &rest, 0), &rest, 0.0);
    for seed in 0..8 {
        // How far it moved each vertex of a ring changes no faster from the last to the first than elsewhere.
        let noisy = at(seed, 0.0);
        let moved = |j: usize| place(&noisy[40 * 64 + j % 64]) - place(&smooth[40 * 64 + j % 64]);
        let step = |j: usize| moved(j).distance(moved(j + 1));
        let longest = (0..63).map(step).fold(0.0, f32::max);
        assert!(step(63) <= 1.2 * longest, "{seed}: {} {longest}", step(63));
    }
    let vertices = at(3, 0.0);
    let apart = |a: &[DrawVertex], b: &[DrawVertex]| {
        a.iter().zip(b).map(|(a, b)| place(a).distance(place(b))).fold(0.0, f32::max)
    };
    assert!(apart(&vertices, &at(4, 0.0)) > 1e-3);
    // It wanders in the course of minutes, without a jump.
    assert!(apart(&vertices, &at(3, 60.0)) > 3e-4);
    assert!(apart(&at(3, 99.99), &at(3, 100.01)) < 1e-5);
}

#[test]
fn a_surface_gives_the_same_bytes_at_every_instruction_set() {
    let (mut slice, rest) = (animal(), animal());
    (0..40).for_each(|_| slice.step(Level::best(), 0.005));
    let of = |level: Level| {
        let mut vertices = vec![DrawVertex::default(); Form::default().bell_vertices()];
        let mut bell = bell(Form::default(), &rest, 9);
        bell.write(level, [(slice.chain(), slice.place(), Frame::default())], 1.0, &mut vertices);
        vertices
    };
    let first = of(Level::scalar());
    for level in Level::all() {
        assert!(of(level) == first, "{}", level.name());
    }
}

#[test]
fn a_form_that_cannot_be_made_is_refused_by_its_key() {
    let forms = [
        (Form { around: 60, ..SMOOTH }, "around"),
        (Form { rings: 7, ..SMOOTH }, "rings"),
        (Form { margin_thickness: 0.0, ..SMOOTH }, "margin_thickness"),
        (Form { noise: f64::NAN, ..SMOOTH }, "noise"),
        (Form { structures: 17, ..SMOOTH }, "structures"),
    ];
    let chain: Vec<DVec2> = animal().chain().collect();
    for (form, key) in forms {
        let message = Bell::new(form, 0.004, (&chain, 1), 0).expect_err("refused");
        assert!(message.contains(key), "{message}");
    }
}

#[test]
fn tentacles_hang_from_the_margin_all_around_it() {
    let rest = animal();
    let chain: Vec<DVec2> = rest.chain().collect();
    let origin = rest.place();
    for sides in [1.0, 0.6] {
        // The second bell is uneven.
        let pairs = |k: usize| {
            let [left, right] = [0, 1].map(|side| rest.strand(side).nth(k).expect("a point") - origin);
            [DVec2::new(right.x, right.y * sides), left].map(|point| point.as_vec2())
        };
        let points = rest.strand(0).len();
        let form = FringeForm { count: 16, variation: 0.0, ..FringeForm::default() };
        let mut fringe = Fringe::new(form, points, 1).expect("a fringe");
        let mut vertices = vec![DrawVertex::default(); fringe.vertices()];
        let discs = (0..points).map(|k| Disc::turned(pairs(k), &Frame::default()));
        fringe.hang(discs);
        fringe.write(Level::best(), &mut vertices);
        let indices = fringe.indices();
        assert!(indices.iter().all(|i| (*i as usize) < vertices.len()));
        assert!(worst(&indices, &vertices) > 0.3, "{}", worst(&indices, &vertices));
        for (tube, vertices) in vertices.chunks_exact(points * 4).enumerate() {
            let root = vertices[..4].iter().map(place).sum::<Vec3>() / 4.0;
            let angle = core::f32::consts::TAU * (tube as f32 + 0.5) / 16.0;
            let margin = (chain[30] - origin).as_vec2();
            assert!((root.z - margin.x * angle.sin()).abs() < 0.15 * margin.x, "{root}");
            if sides == 1.0 {
                let expected = Vec3::new(margin.x * angle.cos(), margin.y, margin.x * angle.sin());
                assert!(root.distance(expected) < 1e-6, "{root} {expected}");
            }
            let tip = vertices[points * 4 - 4..].iter().map(place).sum::<Vec3>() / 4.0;
            assert!(tip.y < root.y - 0.01, "{tip} {root}");
        }
    }
    for form in [
        FringeForm { count: 7, ..FringeForm::default() },
        FringeForm { taper: -1.0, ..FringeForm::default() },
    ] {
        assert!(Fringe::new(form, 5, 1).is_err(), "{form:?}");
    }
}

#[test]
fn a_trail_keeps_its_length_behind_its_leader() {
    let mut slice = animal();
    let leader = |slice: &Slice<f32>| slice.strand(0).last().expect("a tip");
    let mut trail = Trail::new(leader(&slice), 12, 0.06, 0.002);
    for _ in 0..800 {
        slice.step(Level::best(), 0.005);
        trail.step(slice.water(), slice.corner(), leader(&slice), 0.005);
        let mut before = leader(&slice);
        for point in trail.points() {
            assert!((before.distance(*point) - 0.005).abs() < 1e-12);
            before = *point;
        }
    }
    // It swam away from where the trail began, and the trail hangs behind.
    assert!(slice.corner().y > 0.0 && trail.points()[11].y < leader(&slice).y - 0.02);
}
