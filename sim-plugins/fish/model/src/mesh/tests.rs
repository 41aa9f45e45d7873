use super::*;
use crate::look::Look;

fn grown(species: &Species) -> (Shape, Plan) {
    let plan = species.plan().expect("a body");
    (shape(species, &plan), plan)
}

#[test]
fn weights_sum_to_one_and_name_joints_that_are_there() {
    let (shape, plan) = grown(&Species::default());
    assert_eq!(shape.rest.len(), plan.body().segments().len());
    assert_eq!(shape.joints.len(), BONES * shape.vertices.len());
    for (joints, weights) in shape.joints.chunks(BONES).zip(shape.weights.chunks(BONES)) {
        assert!(joints.iter().all(|joint| (*joint as usize) < shape.rest.len()));
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5, "{weights:?}");
    }
}

#[test]
fn weights_go_over_without_a_step_from_joint_to_joint() {
    let count = 7;
    let of = |station: f64| {
        let (joints, weights) = bones(station, count);
        let mut all = [0.0_f32; 7];
        joints.iter().zip(weights).for_each(|(joint, weight)| all[*joint as usize] += weight);
        all
    };
    // No weight changes faster than the linear one, but for a third where one goes over into the other.
    for i in 0..600 {
        let (a, b) = (of(f64::from(i) * 0.01), of(f64::from(i) * 0.01 + 0.01));
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.0135), "{i}: {a:?} {b:?}");
    }
    assert!(of(3.0)[3] > 0.66 && of(0.0)[0] == 1.0 && of(6.0)[6] == 1.0);
}

#[test]
fn levels_are_coarser_one_after_the_other_and_say_how_far_they_stray() {
    let (shape, _) = grown(&Species::default());
    assert_eq!(shape.levels.len(), LEVELS.len());
    for pair in shape.levels.windows(2) {
        assert!(pair[1].index_count * 2 < pair[0].index_count && pair[1].error > pair[0].error);
    }
    let length = Species::default().plan().expect("a body").body().length() as f32;
    let errors: Vec<f32> = shape.levels.iter().map(|level| level.error / length).collect();
    let counts: Vec<u32> = shape.levels.iter().map(|level| level.vertex_count).collect();
    println!("{errors:?} {counts:?}");
    let most = [1e-6, 0.01, 0.02, 0.05, 0.2];
    assert!(errors.iter().zip(most).all(|(error, most)| *error < most), "{errors:?}");
    assert!(errors[1] > 5e-4 && counts[4] <= 40, "{errors:?} {counts:?}");
}

#[test]
fn the_skin_holds_the_sections_and_its_normals_look_outward() {
    let species = Species { look: Look { height: 1.5, width: 1.5, ..Look::default() }, ..Species::default() };
    let (shape, plan) = grown(&species);
    let outline = Outline::new(&species);
    // The corners of every section lie within the skin's ellipse there.
    for (joint, nodes) in plan.body().segments().enumerate().filter(|(_, nodes)| nodes.len() == 4) {
        for node in nodes {
            let at = plan.body().nodes()[node];
            let v = (outline.nose - at.x) / outline.length;
            let [height, width] = outline.extent(v);
            assert!((at.y / height).powi(2) + (at.z / width).powi(2) < 1.0, "{at}");
            assert!((outline.station(at.x) - joint as f64).abs() < 1e-9);
        }
    }
    // The body's are the first vertices of the finest level.
    let body = ((LEVELS[0].body[0] + 1) * (LEVELS[0].body[1] + 1)) as usize;
    for triangle in shape.indices.chunks(3).take(2 * (LEVELS[0].body[0] * LEVELS[0].body[1]) as usize) {
        assert!(triangle.iter().all(|i| (*i as usize) < body));
        let [a, b, c] = [0, 1, 2].map(|i| glam::Vec3::from(shape.vertices[triangle[i] as usize].position));
        let normal = (b - a).cross(c - a);
        let middle = (a + b + c) / 3.0;
        let out = glam::Vec3::new(0.0, middle.y, middle.z);
        // At the stalk's end both sides meet.
        assert!(normal.dot(out) >= -1e-3 * normal.length() * out.length(), "{middle}");
    }
}

#[test]
fn a_fin_of_no_height_is_left_out() {
    let bare = |height: f64| {
        let mut species = Species::default();
        species.look.dorsal.height = height;
        grown(&species).0.vertices.len()
    };
    let with = LEVELS.iter().filter(|fine| fine.fin[0] > 0);
    let fin: u32 = with.map(|fine| (fine.fin[0] + 1) * (fine.fin[1] + 1)).sum();
    // Front and back.
    assert_eq!(bare(0.1) - bare(0.0), 2 * fin as usize);
}
