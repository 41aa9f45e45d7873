//! What is handed to the renderer: elements, joints, and that far plants are one of them without a jump.

use glam::{DVec3, Quat, Vec3};
use reef_flow::Level;
use reef_sdk::{
    Workers,
    abi::{FLAG_NO_BLEND, Joint, Object, Skinned},
};
use reef_seaweed_model::{
    bed::{BED, Bed, Drawing, Kind, Plant, Surroundings, Wear},
    grow,
    levels::Levels,
    looks::Dress,
    mesh::{self, Shape},
};

use crate::{common::*, species_table::species};

/// What a bed hands out.
struct Drawn {
    objects: Vec<Object>,
    elements: Vec<Skinned>,
    joints: Vec<Joint>,
}

fn draw(bed: &mut Bed, whole: bool) -> Drawn {
    let dresses = vec![Dress { number: 1, ..Dress::default() }; bed.plants().len()];
    let wears = [Wear::default(), Wear { mesh: 7, material: 3 }];
    let mut drawn = Drawn {
        objects: vec![Object::default(); bed.object_count()],
        elements: vec![Skinned::default(); bed.plants().len()],
        joints: vec![Joint::default(); bed.plan_joints(whole)],
    };
    let how = Drawing { dresses: &dresses, wears: &wears, whole };
    bed.write_objects(Workers::inline(), &mut drawn.objects);
    bed.draw(Level::best(), Workers::inline(), &how, (&mut drawn.elements, &mut drawn.joints));
    drawn
}

/// Where an element puts some vertices of its mesh's finest level, blended linearly [m, world].
fn vertices(drawn: &Drawn, element: &Skinned, shape: &Shape) -> Vec<DVec3> {
    let joints = &drawn.joints[element.first_joint as usize..][..element.joint_count as usize];
    let origin = DVec3::from(drawn.objects[element.object as usize].origin);
    let moved = |joint: &Joint, rest: Option<&Joint>, v: Vec3| {
        let v = rest
            .map_or(v, |rest| Quat::from_array(rest.rotation).inverse() * (v - Vec3::from(rest.translation)));
        Vec3::from(joint.translation) + Quat::from_array(joint.rotation) * (v * element.scale)
    };
    let count = shape.levels[0].vertex_count as usize;
    (0..count)
        .step_by(7)
        .map(|i| {
            let v = Vec3::from(shape.vertices[i].position);
            let place = if joints.len() == 1 {
                moved(&joints[0], None, v)
            } else {
                (0..4).map(|k| 4 * i + k).fold(Vec3::ZERO, |sum, k| {
                    let number = shape.joints[k] as usize;
                    sum + moved(&joints[number], Some(&shape.rest[number]), v) * shape.weights[k]
                })
            };
            origin + place.as_dvec3()
        })
        .collect()
}

/// A species of assets with its mesh.
fn of_assets(name: &str) -> (Kind, Shape) {
    let species = species(name);
    let (skeleton, limbs) = grow::grow(&species).expect("a good species");
    let shape = mesh::shape(&species, &skeleton, &limbs, 1);
    (Kind::new(skeleton, species.motion.lag, species.motion.disturbance), shape)
}

#[test]
fn at_rest_a_plant_looks_like_its_mesh_whatever_its_size() {
    let (kind, shape) = of_assets("saccharina");
    for (whole, distance) in [(false, 3.0), (true, 3.0), (true, 60.0)] {
        let root = PLACE + DVec3::Y;
        let mut bed = Bed::new(vec![kind.clone()], vec![Plant { size: 0.6, ..plant(root) }]);
        // Steps so short that nothing moves; the first from near by, since who begins far away has swayed.
        for distance in [3.0, distance] {
            let camera = camera(root + DVec3::Z * distance, root);
            let around = Surroundings { dt: 2e-6, ..around(&[], &[], &camera) };
            bed.step(&around, &Levels { blend: 0.0, ..Levels::default() });
        }
        let drawn = draw(&mut bed, whole);
        let element = drawn.elements[0];
        assert_eq!(element.joint_count, if whole && distance > 20.0 { 1 } else { 14 });
        assert_eq!((element.mesh, element.material, element.object, element.flags), (7, 3, 0, 0));
        for (i, seen) in vertices(&drawn, &element, &shape).into_iter().enumerate() {
            let wanted = root + 0.6 * Vec3::from(shape.vertices[7 * i].position).as_dvec3();
            assert!(seen.distance(wanted) < 1e-5, "vertex {}: {seen}, not {wanted}", 7 * i);
        }
    }
}

#[test]
fn objects_come_in_the_order_of_the_plants_before_the_bed() {
    let plants: Vec<Plant> =
        (0..30).map(|i| plant(PLACE + DVec3::new(-7.0 * f64::from(i % 4), 0.0, f64::from(i)))).collect();
    let mut bed = Bed::new(vec![kind(usual_blade())], plants.clone());
    let drawn = draw(&mut bed, true);
    assert_eq!(drawn.objects[30].id, BED);
    for (number, (object, plant)) in drawn.objects.iter().zip(&plants).enumerate() {
        assert_eq!((object.id, object.origin), (number as u64 + 1, plant.root.to_array()));
    }
    let mut seen: Vec<u32> = drawn.elements.iter().map(|element| element.object).collect();
    seen.sort_unstable();
    assert_eq!(seen, (0..30).collect::<Vec<_>>());
}

#[test]
fn no_vertex_jumps_on_the_way_from_far_to_near_and_back() {
    for name in ["saccharina", "zostera", "fucus"] {
        let (kind, shape) = of_assets(name);
        let mut bed = Bed::new(vec![kind], vec![Plant { bend: 0.1, seed: 3, ..plant(PLACE) }]);
        let flow = [current(DVec3::new(0.12, 0.0, 0.03))];
        let (mut before, mut worst, mut counts) = (Vec::new(), 0.0_f64, Vec::new());
        for step in 0..2800 {
            let time = f64::from(step) * DT;
            // Six seconds to settle, then from 25 m to 3 m and back, at 1 m/s as the walk's scene.
            let way = (time - 6.0).clamp(0.0, 44.0);
            let distance = if way < 22.0 { 25.0 - way } else { way - 19.0 };
            let camera = camera(PLACE + DVec3::new(0.0, 0.6, distance), PLACE + DVec3::Y * 0.4);
            let waves = [swell(0.1, 6.0, time)];
            bed.step(&around(&flow, &waves, &camera), &Levels::default());
            let drawn = draw(&mut bed, true);
            let now = vertices(&drawn, &drawn.elements[0], &shape);
            for (a, b) in before.iter().zip(&now) {
                let [a, b] = [*a, *b].map(|p| project(&camera, p).expect("before the eye"));
                worst = worst.max((a[0] - b[0]).hypot(a[1] - b[1]));
            }
            before = if step > 360 { now } else { Vec::new() };
            let count = drawn.elements[0].joint_count;
            if counts.last() != Some(&count) {
                counts.push(count);
            }
        }
        let all = shape.rest.len() as u32;
        // Far, near, and far again.
        assert_eq!(counts, [1, all, 1], "{name}");
        assert!(worst < 2.0, "{name}: {worst} px");
        assert!(worst > 0.1, "{name}: nothing moved");
    }
}

#[test]
fn who_comes_into_view_is_not_blended_with_where_it_was() {
    let mut bed = alone(usual_blade());
    let toward = camera(PLACE + DVec3::new(0.0, 0.5, 4.0), PLACE);
    let away = camera(PLACE + DVec3::new(0.0, 0.5, 4.0), PLACE + DVec3::Z * 20.0);
    let mut flags = Vec::new();
    for step in 0..40 {
        let camera = if (10..30).contains(&step) { &away } else { &toward };
        bed.step(&around(&[], &[], camera), &Levels::default());
        let drawn = draw(&mut bed, true);
        assert_eq!(drawn.elements[0].joint_count, if (10..30).contains(&step) { 1 } else { 10 });
        flags.push(drawn.elements[0].flags);
        assert_eq!(drawn.objects[0].flags, drawn.elements[0].flags);
    }
    let jumps: Vec<usize> = (0..40).filter(|step| flags[*step] == FLAG_NO_BLEND).collect();
    assert_eq!(jumps, [30]);
}
