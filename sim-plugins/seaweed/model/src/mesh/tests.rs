use core::f32;

use glam::Vec3;

use super::*;
use crate::{
    grow::grow,
    species::{Blades, Forks, Look, Stem, Tissue as Matter},
};

fn kelp() -> Species {
    Species {
        stem: Stem { tissue: Matter { width: 0.2, ..Matter::default() }, ..Stem::default() },
        look: Look { ruffle: 0.2, ruffles: 6.0, midrib: 0.2, stipe: 0.1, holdfast: 0.05, ..Look::default() },
        ..Species::default()
    }
}

/// A stipe with bladders and blades, a bush of straps, a feather, a tuft of ribbons.
fn others() -> Vec<Species> {
    let round = Matter { width: 0.01, thickness: 0.008, ..Matter::default() };
    let blades = Blades { count: 6, bladder: 0.2, ..Blades::default() };
    let thin = Blades { count: 6, tissue: Matter { width: 0.002, ..round.clone() }, ..Blades::default() };
    let forks = Forks { times: 2, bladder: 0.01, ..Forks::default() };
    vec![
        Species { stem: Stem { tissue: round.clone(), ..Stem::default() }, blades, ..Species::default() },
        Species { forks, ..Species::default() },
        Species {
            stem: Stem { tissue: round, count: 2, ..Stem::default() },
            blades: thin,
            look: Look { teeth: 5, tooth: 0.03, ..Look::default() },
            ..Species::default()
        },
        Species {
            stem: Stem { count: 5, spread: 15.0, curve: 20.0, ..Stem::default() },
            ..Species::default()
        },
    ]
}

fn mesh_of(species: &Species, age: usize) -> Shape {
    let (skeleton, limbs) = grow(species).unwrap();
    shape(species, &skeleton, &limbs, age)
}

fn triangles(shape: &Shape, level: &MeshLevel) -> Vec<[Vec3; 3]> {
    let indices = &shape.indices[level.first_index as usize..][..level.index_count as usize];
    let place = |i: u32| Vec3::from(shape.vertices[i as usize].position);
    indices.chunks_exact(3).map(|t| [place(t[0]), place(t[1]), place(t[2])]).collect()
}

/// From corners and middles of some triangles to the nearest place on others, at most.
fn farthest(from: &[[Vec3; 3]], to: &[[Vec3; 3]]) -> f32 {
    // By a walk over the triangle that halves its step: no formula in common with the code.
    let walk = |p: Vec3, [a, b, c]: &[Vec3; 3]| {
        let at = |u: f32, v: f32| p.distance(*a + (*b - *a) * u + (*c - *a) * v);
        let (mut best, mut u, mut v, mut step) = (at(0.3, 0.3), 0.3_f32, 0.3_f32, 0.5_f32);
        while step > 1e-2 {
            let around = [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step), (step, -step), (-step, step)];
            let moved = around.map(|(du, dv)| {
                let (u, v) = ((u + du).max(0.0), (v + dv).max(0.0));
                let sum = (u + v).max(1.0);
                (at(u / sum, v / sum), u / sum, v / sum)
            });
            match moved.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some(least) if least.0 < best => (best, u, v) = least,
                _ => step *= 0.5,
            }
        }
        best
    };
    let near = |p: Vec3| {
        to.iter().fold(f32::MAX, |best, triangle| {
            let size = triangle[0].distance(triangle[1]).max(triangle[0].distance(triangle[2]));
            if p.distance(triangle[0]) - size < best { best.min(walk(p, triangle)) } else { best }
        })
    };
    from.iter().flat_map(|[a, b, c]| [*a, *b, *c, (*a + *b + *c) / 3.0]).map(near).fold(0.0, f32::max)
}

#[test]
fn no_level_strays_farther_from_the_finest_than_it_says() {
    for (number, species) in others().iter().chain([&kelp()]).enumerate() {
        let shape = mesh_of(species, 1);
        let finest = triangles(&shape, &shape.levels[0]);
        assert!(shape.levels[0].error == 0.0 && (3..=4).contains(&shape.levels.len()));
        for (level, pair) in shape.levels.windows(2).enumerate() {
            let own = triangles(&shape, &pair[1]);
            let strays = farthest(&finest, &own).max(farthest(&own, &finest));
            let said = pair[1].error;
            assert!(strays <= 1.05 * said, "species {number}, level {}: {strays} of {said}", level + 1);
            assert!(strays > 0.3 * said, "species {number}, level {}: {strays} of {said}", level + 1);
            assert!(pair[1].error > pair[0].error && pair[1].index_count < pair[0].index_count);
        }
    }
}

#[test]
fn every_vertex_hangs_on_joints_that_are_there_and_near() {
    for species in others().iter().chain([&kelp()]) {
        let shape = mesh_of(species, 0);
        assert!(shape.indices.iter().all(|i| (*i as usize) < shape.vertices.len()));
        for ((vertex, joints), weights) in
            shape.vertices.iter().zip(shape.joints.chunks_exact(4)).zip(shape.weights.chunks_exact(4))
        {
            assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5, "{weights:?}");
            for (joint, weight) in joints.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
                let at = Vec3::from(shape.rest[*joint as usize].translation);
                let far = at.distance(Vec3::from(vertex.position));
                assert!(far < 0.45, "weight {weight} of a joint that is {far} m away");
            }
            assert!(
                vertex.thickness > 0.0 && vertex.uv.iter().all(|x| (0.0..=1.0).contains(x)),
                "{vertex:?}"
            );
        }
    }
}

#[test]
fn blades_are_as_wide_as_their_table_says_and_old_ones_are_torn() {
    let width = |age: usize| {
        let shape = mesh_of(&kelp(), age);
        let level = shape.levels[0];
        let own = &shape.vertices[..level.vertex_count as usize];
        let across = own.iter().map(|v| v.position[0]).fold(f32::MIN, f32::max);
        let top = own.iter().map(|v| v.position[1]).fold(f32::MIN, f32::max);
        (across, top)
    };
    let ((young, high), (old, low)) = (width(0), width(AGES - 1));
    assert!((young - 0.1).abs() < 0.025 && (old - 0.1).abs() < 0.03, "{young} {old}");
    assert!((high - 1.0).abs() < 0.05, "{high}");
    assert!(low < high - 0.05 && low > 0.75, "{low}");
}

#[test]
fn bladders_hold_the_air_that_their_lift_takes() {
    let species = &others()[0];
    let shape = mesh_of(species, 0);
    // The finest level's first bladder: the widest ring of the first blade's first tube, 1.5 cm over 0.2 N.
    let (skeleton, limbs) = grow(species).unwrap();
    let blade = &limbs[1];
    let spine = Spine::new(&skeleton, &skeleton.rest(), blade, false);
    let first = blade.segments.start as u32;
    let ring =
        shape.vertices.iter().zip(shape.joints.chunks_exact(4)).filter(|(_, joints)| joints[0] == first);
    let middle = spine.at(0.045).place.as_vec3();
    let near = ring.map(|(v, _)| Vec3::from(v.position).distance(middle)).fold(f32::MAX, f32::min);
    let volume = 0.2 / (1025.0 * 9.80665);
    let radius = (volume * 0.75 / (f32::consts::PI * 2.2)).powf(1.0 / 3.0);
    assert!((near - radius).abs() < 0.35 * radius, "{near} for {radius}");
}
