//! Animals with two slices at right angles.

use core::f32::consts::TAU;

use crate::sea::{birth, usual, vertices};
use glam::{DVec3, Vec2, Vec3};
use reef_jellyfish_model::{
    bloom::{Birth, Bloom, PRIMITIVES, Surroundings, Tuning},
    slice::Slice,
    surface::{Disc, Frame},
};

fn bloom(births: &[Birth]) -> Bloom {
    Bloom::new(&[usual()], births).expect("a bloom")
}

/// One animal with so many slices, whose own slice lies along x.
fn animal(slices: usize, aim: DVec3) -> Bloom {
    bloom(&[Birth { slices, yaw: 0.0, aim, ..birth(0) }])
}

fn swim(bloom: &mut Bloom, seconds: f64) {
    let around = Surroundings::default();
    (0..(seconds / around.dt) as usize).for_each(|_| bloom.step(&around));
}

#[test]
fn a_disc_goes_through_the_pairs_of_both_slices() {
    let pair = |x: f32, y: f32| [Vec2::new(x, y), Vec2::new(-0.7 * x, 0.4 * y)];
    let pairs = [pair(0.3, 0.1), pair(0.2, -0.05)];
    let frames = [Frame::default(), Frame { x: Vec3::Z, y: Vec3::Y, z: Vec3::NEG_X }];
    let disc = Disc::crossed(pairs, [&frames[0], &frames[1]]);
    let at = |angle: f32| {
        let (sin, cos) = angle.sin_cos();
        disc.centre + disc.half * cos + disc.side * sin + disc.twist * (2.0 * angle).cos()
    };
    let wanted = [(0, 0, 0.0), (1, 0, 0.25), (0, 1, 0.5), (1, 1, 0.75)];
    for (slice, end, share) in wanted {
        let point: Vec2 = pairs[slice][end];
        let there = frames[slice].x * point.x + frames[slice].y * point.y;
        assert!(at(share * TAU).distance(there) < 1e-6, "{slice} {end}: {there}");
    }
}

#[test]
fn upright_it_swims_as_one_slice_does() {
    let [mut one, mut two] = [1, 2].map(|slices| animal(slices, DVec3::Y));
    swim(&mut one, 1.5);
    swim(&mut two, 1.5);
    // Arms drift as they will; bells are alike, as long as eddies have not made rounding grow.
    let [arms, _] = two.vertices(0).expect("an animal");
    let [bell, bell_too] = [vertices(&mut one), vertices(&mut two)];
    let off = bell[arms..].iter().zip(&bell_too[arms..]);
    let off = off.map(|(a, b)| Vec3::from(a.position).distance(b.position.into())).fold(0.0, f32::max);
    assert!(off > 0.0 && off < 0.005 * usual().bell.diameter as f32, "{off}");
    swim(&mut one, 4.5);
    swim(&mut two, 4.5);
    let places = [&one, &two].map(|bloom| bloom.place(0).expect("a place"));
    let way = places[0].y - birth(0).place.y;
    assert!(way > 0.05 && places[0].distance(places[1]) < 0.03 * way, "{places:?}");
    // Both slices do the same.
    let chain = |slice: Option<&Slice<f32>>| {
        let slice = slice.expect("a slice");
        slice.chain().map(|point| point - slice.place()).collect::<Vec<_>>()
    };
    let [own, across] = [chain(two.slice(0)), chain(two.slice_across(0))];
    let off = own.iter().zip(&across).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(off < 0.01 * usual().bell.diameter, "{off}");
}

#[test]
fn with_two_slices_it_swims_to_any_side() {
    let aim = DVec3::new(0.5, 0.4, 0.75).normalize();
    for slices in [1, 2] {
        let mut swimming = animal(slices, aim);
        swim(&mut swimming, 6.0);
        let half = swimming.place(0).expect("a place");
        swim(&mut swimming, 10.0);
        let way = swimming.place(0).expect("a place") - half;
        let cos = way.normalize().dot(aim);
        println!("{slices}: {way}, {cos}");
        if slices == 2 {
            let axis = swimming.seen(0).expect("an animal").axis.as_dvec3();
            assert!(way.length() > 0.03 && cos > 0.9 && axis.dot(aim) > 0.9, "{way} {cos} {axis}");
        } else {
            assert!(way.z == 0.0 && cos < 0.8, "{way} {cos}");
        }
    }
}

#[test]
fn slices_of_one_bell_keep_pace() {
    let mut swimming = animal(2, DVec3::new(0.3, 1.0, 0.8));
    let around = Surroundings::default();
    let (mut ways, mut most) = ([0.0; 2], 0.0_f64);
    for _ in 0..960 {
        swimming.step(&around);
        let (own, across) =
            (swimming.slice(0).expect("a slice"), swimming.slice_across(0).expect("another slice"));
        let speeds = [own.velocity().dot(own.axis()), across.velocity().y];
        most = most.max((speeds[0] - speeds[1]).abs());
        ways.iter_mut().zip(speeds).for_each(|(way, speed)| *way += speed * around.dt);
    }
    println!("{ways:?} m, most {most} m/s apart");
    assert!((ways[0] - ways[1]).abs() < 0.1 * ways[0].abs(), "{ways:?}");
}

#[test]
fn two_slices_share_what_the_sea_feels() {
    let [mut one, mut two] = [1, 2].map(|slices| animal(slices, DVec3::Y));
    swim(&mut one, 1.0);
    swim(&mut two, 1.0);
    assert_eq!((one.flows().len(), two.flows().len()), (PRIMITIVES, 2 * PRIMITIVES));
    // On the axis, where both planes meet, the sum is what one slice alone says.
    let place = one.place(0).expect("a place") - DVec3::Y * 0.08;
    let felt = |bloom: &Bloom| reef_flow::reference::velocity(bloom.flows(), place.to_array(), 0)[1];
    let (alone, both) = (felt(&one), felt(&two));
    assert!(alone.abs() > 1e-4 && (alone - both).abs() < 1e-3 * alone.abs(), "{alone} {both}");
}

#[test]
fn two_slices_go_on_from_a_saved_state_alike() {
    let births =
        [1, 2, 2].map(|slices| Birth { slices, aim: DVec3::new(0.2, 1.0, 0.7), ..birth(slices as u64) });
    let mut first = bloom(&births);
    swim(&mut first, 1.0);
    let state = first.save();
    let mut second = bloom(&births);
    second.load(&state).expect("its own state");
    swim(&mut first, 1.0);
    swim(&mut second, 1.0);
    assert!(first.save() == second.save());
    assert!(vertices(&mut first) == vertices(&mut second));
    let refused = bloom(&[1, 1, 2].map(|slices| Birth { slices, ..birth(slices as u64) })).load(&state);
    assert!(refused.as_ref().is_err_and(|text| text.contains("5 slices; here are 3 with 4")), "{refused:?}");
    let none = Bloom::new(&[usual()], &[Birth { slices: 3, ..birth(0) }]).expect_err("refused");
    assert!(none.contains("animals[0].slices: must be 1 or 2, is 3"), "{none}");
}

#[test]
fn two_slices_take_another_grid_and_come_apart_in_nothing() {
    let mut swimming = animal(2, DVec3::new(0.0, 1.0, 1.0));
    swim(&mut swimming, 1.0);
    let tuning = Tuning { cells: 0.8, ..Tuning::default() };
    let around = Surroundings { tuning, ..Surroundings::default() };
    (0..120).for_each(|_| swimming.step(&around));
    let place = swimming.place(0).expect("a place");
    let far = swimming.chain(0).map(|point| point.distance(place)).fold(0.0, f64::max);
    assert!(far < usual().bell.diameter, "{far}");
    let finite = vertices(&mut swimming).iter().all(|vertex| Vec3::from(vertex.position).is_finite());
    assert!(finite);
}

#[test]
fn jets_and_lines_lie_where_the_skin_leans() {
    let mut swimming = animal(2, DVec3::new(0.4, 0.5, 0.9));
    swim(&mut swimming, 8.0);
    let seen = swimming.seen(0).expect("an animal");
    assert!(seen.axis.z > 0.3 && seen.axis.x > 0.1, "it leans to both: {}", seen.axis);
    let (place, axis) = (seen.place, seen.axis.as_dvec3());
    // The apex of the chain stands where the axis points.
    let chain: Vec<DVec3> = swimming.chain(0).collect();
    let apex = (chain[chain.len() / 2] - place).normalize();
    assert!(apex.dot(axis) > 0.97, "{apex} {axis}");
    // Whirlwinds of one slice turn about one axis, and stand in a plane across it that the bell's axis lies
    // in.
    let (own, across) = swimming.flows().split_at(PRIMITIVES);
    for flows in [own, across] {
        let whirls: Vec<_> = flows.iter().filter(|flow| flow.axis != [0.0; 3]).collect();
        let Some(first) = whirls.first() else { continue };
        let normal = Vec3::from(first.axis).as_dvec3();
        assert!(normal.dot(axis).abs() < 1e-5, "{normal} {axis}");
        for flow in flows {
            let off = (DVec3::from(flow.position) - place).dot(normal);
            assert!(off.abs() < 1e-6, "{off}");
        }
    }
}
