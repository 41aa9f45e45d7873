//! Counts and shapes of bodies.

use glam::DVec3;
use reef_fish_model::{
    Plan,
    body::{Body, Profile},
    material::{Beat, Material},
};

fn of_sections(count: usize) -> Profile {
    Profile {
        lengths: vec![0.03; count],
        half_widths: vec![0.01; count],
        half_heights: vec![0.02; count],
        ..Profile::default()
    }
}

#[test]
fn five_sections_have_23_nodes_91_springs_and_12_muscles() {
    let body = Body::new(&Profile::default()).expect("a body");
    assert_eq!([body.nodes().len(), body.springs().len(), body.muscles()], [23, 91, 12]);
}

#[test]
fn counts_follow_the_number_of_sections() {
    for n in 2..=64 {
        for level_fin in [false, true] {
            let body = Body::new(&Profile { level_fin, ..of_sections(n) }).expect("a body");
            assert_eq!(body.nodes().len(), 4 * n + 3);
            // 6 of each section, 12 of each gap, 4 of the nose, 8 and 1 of the tail.
            assert_eq!(body.springs().len(), 6 * n + 12 * (n - 1) + 4 + 8 + 1);
            assert_eq!(body.muscles(), 4 * (n - 2).max(1));
            assert_eq!(body.faces().len(), 4 * (n + 1));
            assert_eq!(body.segments().len(), n + 2);
        }
    }
}

#[test]
fn no_two_springs_join_the_same_nodes() {
    let body = Body::new(&Profile::default()).expect("a body");
    let mut pairs: Vec<[usize; 2]> =
        body.springs().iter().map(|l| [l.ends[0].min(l.ends[1]), l.ends[0].max(l.ends[1])]).collect();
    pairs.sort_unstable();
    pairs.dedup();
    assert_eq!(pairs.len(), body.springs().len());
}

#[test]
fn the_skin_is_closed_and_looks_outward() {
    for level_fin in [false, true] {
        let body = Body::new(&Profile { level_fin, ..Profile::default() }).expect("a body");
        let areas: Vec<DVec3> = body.faces().iter().map(|face| face.area(body.nodes())).collect();
        assert!(areas.iter().sum::<DVec3>().length() < 1e-15, "a closed surface has no area in sum");
        for (face, area) in body.faces().iter().zip(&areas) {
            let middle =
                face.nodes().iter().map(|i| body.nodes()[*i]).sum::<DVec3>() / face.nodes().len() as f64;
            assert!(area.dot(middle * DVec3::new(0.0, 1.0, 1.0)) > 0.0, "{face:?}");
        }
    }
}

#[test]
fn muscles_are_as_many_left_as_right_and_top_as_bottom() {
    let body = Body::new(&Profile::default()).expect("a body");
    let muscles: Vec<_> = body.springs().iter().filter_map(|l| l.muscle.map(|m| (l.ends, m))).collect();
    let sum = |of: fn(&reef_fish_model::body::Muscle) -> i8| muscles.iter().map(|(_, m)| of(m)).sum::<i8>();
    assert_eq!([sum(|m| m.left), sum(|m| m.top)], [0, 0]);
    for ([a, b], muscle) in muscles {
        for end in [a, b] {
            let at = body.nodes()[end];
            assert!(at.z * f64::from(muscle.left) < 0.0 && at.y * f64::from(muscle.top) > 0.0);
        }
    }
}

#[test]
fn what_no_body_can_be_is_refused_by_its_key() {
    let refused = |profile: &Profile| Body::new(profile).expect_err("refused").to_string();
    assert!(refused(&of_sections(1)).starts_with("half_widths: has 1 sections; allowed: 2 to 64"));
    assert!(refused(&of_sections(10_000)).starts_with("half_widths: has 10000"));
    let mut uneven = Profile::default();
    uneven.lengths.pop();
    assert!(refused(&uneven).starts_with("lengths: has 4 numbers; half_widths has 5"));
    let mut flat = Profile::default();
    flat.half_heights[2] = 0.0;
    assert!(refused(&flat).starts_with("half_heights[2]: must be a length above 0"));
    assert!(refused(&Profile { tail: f64::NAN, ..Profile::default() }).starts_with("tail:"));
    let body = Body::new(&Profile::default()).expect("a body");
    let refused =
        |material: Material| Plan::new(&body, &material, &Beat::default()).expect_err("refused").to_string();
    let usual = Material::default();
    assert!(refused(Material { side: -1.0, ..usual }).starts_with("side: must be above 0, is -1"));
    assert!(refused(Material { mass: 0.0, ..usual }).starts_with("mass: must be at least 0.000001, is 0"));
    assert!(refused(Material { water: f64::INFINITY, ..usual }).starts_with("water:"));
}
