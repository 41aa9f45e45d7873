//! What animals in the sea do by themselves, and what is set while they swim.

use glam::DVec3;
use reef_jellyfish_model::bloom::{Birth, Bloom, Home, Surroundings, Tuning};

use crate::sea::{birth, usual, written};

const SECOND: usize = 60;

fn run(bloom: &mut Bloom, seconds: usize, tuning: Tuning) {
    for step in 0..seconds * SECOND {
        let time = step as f64 / SECOND as f64;
        bloom.step(&Surroundings { tuning, time, eye: DVec3::splat(1e3), ..Surroundings::default() });
    }
}

fn bloom(births: &[Birth]) -> Bloom {
    Bloom::new(&[usual()], births).expect("a bloom")
}

#[test]
fn one_that_is_steered_swims_there_and_back() {
    let mut bloom = bloom(&[birth(0)]);
    let start = bloom.place(0).expect("a place");
    bloom.steer(0, DVec3::new(1.0, 0.3, 0.0));
    run(&mut bloom, 12, Tuning::default());
    let there = bloom.place(0).expect("a place");
    bloom.steer(0, DVec3::ZERO);
    bloom.steer(0, DVec3::new(-1.0, 0.3, 0.0));
    run(&mut bloom, 24, Tuning::default());
    let back = bloom.place(0).expect("a place");
    assert!(there.x - start.x > 0.04 && there.x - back.x > 0.04, "{start} {there} {back}");
}

#[test]
fn a_tilt_leans_all_of_them_and_strength_0_keeps_them_where_they_are() {
    let births = [0, 1].map(|i| Birth { yaw: 0.0, ..birth(i) });
    let [mut tilted, mut idle] = [(); 2].map(|()| bloom(&births));
    run(&mut tilted, 8, Tuning { tilt: 1.2, ..Tuning::default() });
    run(&mut idle, 8, Tuning { strength: 0.0, ..Tuning::default() });
    for (i, birth) in births.iter().enumerate() {
        let way = tilted.place(i).expect("a place") - birth.place;
        assert!(way.x > 0.02, "{way}");
        let way = idle.place(i).expect("a place") - birth.place;
        assert!(way.length() < 1e-3, "{way}");
    }
}

#[test]
fn dense_animals_rise_in_their_box_and_sink_again_and_stay_up_at_dusk() {
    let mut species = usual();
    species.bell.excess_density = 4.0;
    let home = Home { low: DVec3::new(-0.2, -3.2, -0.2), high: DVec3::new(0.2, -2.8, 0.2) };
    let own = Birth { place: DVec3::new(0.0, -3.0, 0.0), home: Some(home), ..birth(3) };
    let mut bloom = Bloom::new(&[species], &[own]).expect("a bloom");
    let range = |bloom: &mut Bloom, seconds: usize, dusk: bool| {
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        for _ in 0..seconds {
            run(bloom, 1, Tuning { dusk, ..Tuning::default() });
            let y = bloom.place(0).expect("a place").y;
            (low, high) = (low.min(y), high.max(y));
        }
        (low, high)
    };
    let (low, high) = range(&mut bloom, 120, false);
    assert!(low < -3.1 && low > -3.3 && high > -2.9 && high < -2.7, "{low} {high}");
    range(&mut bloom, 40, true);
    let (low, high) = range(&mut bloom, 60, true);
    assert!(low > -3.0 && high < -2.7, "{low} {high}");
}

#[test]
fn a_share_of_the_periods_is_idle() {
    let births: Vec<Birth> = (0..6).map(birth).collect();
    let mut bloom = bloom(&births);
    let (mut idle, mut seen) = (0, 0);
    for _ in 0..60 {
        run(&mut bloom, 1, Tuning { idle: 0.5, frequency: 3.0, cells: 0.4, ..Tuning::default() });
        for animal in 0..births.len() {
            idle += usize::from(bloom.seen(animal).expect("an animal").idles);
            seen += 1;
        }
    }
    let share = idle as f64 / seen as f64;
    assert!((0.25..0.75).contains(&share), "{share}");
}

#[test]
fn another_grid_leaves_an_animal_where_it_is_and_its_state_has_it() {
    let mut bloom = bloom(&[birth(0), birth(1)]);
    run(&mut bloom, 2, Tuning::default());
    let before = bloom.place(1).expect("a place");
    let coarse = Tuning { cells: 0.5, ..Tuning::default() };
    bloom.step(&Surroundings { tuning: coarse, eye: DVec3::splat(1e3), ..Surroundings::default() });
    let after = bloom.place(1).expect("a place");
    assert_eq!(bloom.slice(1).expect("a slice").water().grid().n, 25);
    assert!(after.distance(before) < 2e-3, "{before} {after}");
    let state = bloom.save();
    let mut second = Bloom::new(&[usual()], &[birth(0), birth(1)]).expect("a bloom");
    second.load(&state).expect("loads");
    for bloom in [&mut bloom, &mut second] {
        run(bloom, 1, coarse);
    }
    assert!(bloom.save() == second.save() && written(&mut bloom) == written(&mut second));
    let mut wrong = state;
    wrong.modes[0] = 3;
    let message = second.load(&wrong).expect_err("refused");
    assert!(message.starts_with("animal 0 has 3 cells"), "{message}");
}

#[test]
fn far_animals_have_fewer_vertices_and_change_with_a_margin() {
    let mut bloom = bloom(&[birth(0)]);
    let place = bloom.place(0).expect("a place");
    let fine = bloom.vertex_count();
    let mut far = |pixels: f64| {
        let eye = place + DVec3::new(0.0, 0.0, 0.04);
        let tuning = Tuning { detail: 60.0, ..Tuning::default() };
        bloom.step(&Surroundings { tuning, eye, pixels, ..Surroundings::default() });
        (bloom.seen(0).expect("an animal").far, bloom.vertex_count())
    };
    // A bell of 0.04 m at 0.04 m is as wide as `pixels`.
    let seen = [80.0, 58.0, 40.0, 62.0, 80.0].map(&mut far);
    assert_eq!(seen.map(|(far, _)| far), [false, false, true, true, false]);
    assert!(seen[2].1 * 3 < fine && seen[4].1 == fine, "{seen:?} {fine}");
}

#[test]
fn two_in_one_place_go_on_and_so_does_one_between_surface_and_bed() {
    let same = |i: u64| Birth { place: DVec3::new(0.0, -0.001, 0.0), ..birth(i) };
    let mut bloom = bloom(&[same(0), same(1)]);
    for _ in 0..120 {
        let flow = bloom.flows().to_vec();
        bloom.step(&Surroundings { flow: &flow, depth: 0.02, ..Surroundings::default() });
    }
    for i in 0..2 {
        let place = bloom.place(i).expect("a place");
        assert!(place.is_finite() && place.y < 0.0, "{place}");
    }
}
