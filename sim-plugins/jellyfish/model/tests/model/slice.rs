//! The elastic slice in its water.

use glam::DVec2;
use reef_flow::{Level, random::Random};
use reef_jellyfish_model::{
    Real,
    slice::{Build, CONTRACTION, Gait, Slice},
    water::Grid,
};

/// Cells of the paper's size, as many of them as fit the time of a test.
pub(crate) fn grid(n: usize) -> Grid {
    Grid { n, cell: 0.004, density: 1000.0, viscosity: 1.304e-6 }
}

pub(crate) fn slice<T: Real>(build: Build, n: usize, gait: Gait) -> Slice<T> {
    let mut slice = Slice::new(build, grid(n)).expect("an animal");
    slice.set_gait(gait).expect("a gait");
    slice
}

const IDLE: Gait = Gait { frequency: 0.7, strength: 0.0, turn: 0.0 };
const DT: f64 = 0.005;

fn run<T: Real>(slice: &mut Slice<T>, seconds: f64, dt: f64) {
    for _ in 0..(seconds / dt).round() as usize {
        slice.step(Level::best(), dt);
    }
}

fn places<T: Real>(slice: &Slice<T>) -> Vec<DVec2> {
    slice.chain().chain(slice.strand(0)).chain(slice.strand(1)).collect()
}

#[test]
fn internal_forces_neither_push_nor_turn_the_animal() {
    let mut random = Random::new(1, 1);
    for turn in [0.0, 0.1] {
        let mut slice = slice::<f64>(Build::default(), 50, Gait { turn, ..Gait::default() });
        slice.set_phase(0.1);
        slice.displace(|_| 0.002 * DVec2::new(random.signed(), random.signed()));
        let forces = slice.forces();
        let size: f64 = forces.iter().map(|(_, force)| force.length()).sum();
        let net: DVec2 = forces.iter().map(|(_, force)| *force).sum();
        let torque: f64 = forces.iter().map(|(place, force)| place.perp_dot(*force)).sum();
        assert!(size > 1.0, "{size}");
        assert!(net.length() <= 1e-12 * size && torque.abs() <= 1e-12 * size, "{net} {torque} of {size}");
    }
}

#[test]
fn forces_are_the_slope_of_the_energy() {
    let mut random = Random::new(2, 1);
    let mut slice = slice::<f64>(Build::default(), 50, IDLE);
    slice.displace(|_| 0.001 * DVec2::new(random.signed(), random.signed()));
    let forces = slice.forces();
    let way = 1e-7;
    for at in (0..forces.len()).filter(|at| *at != 1) {
        for axis in [DVec2::X, DVec2::Y] {
            let energy = [-way, way].map(|way| {
                let mut moved = slice.clone();
                moved.displace(|i| if i == at { axis * way } else { DVec2::ZERO });
                moved.energy()
            });
            let slope = (energy[1] - energy[0]) / (2.0 * way);
            let force = forces[at].1.dot(axis);
            assert!((slope + force).abs() < 1e-5 * (1.0 + force.abs()), "{at} {axis}: {slope} {force}");
        }
    }
}

#[test]
fn an_idle_animal_stays_in_its_shape() {
    let mut slice = slice::<f64>(Build::default(), 50, IDLE);
    let before = places(&slice);
    run(&mut slice, 4.0, DT);
    let most = before.iter().zip(places(&slice)).map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
    assert!(most <= 1e-9, "{most}");
}

#[test]
fn an_idle_animal_loses_the_energy_of_a_knock() {
    let mut slice = slice::<f64>(Build::default(), 50, IDLE);
    let mut random = Random::new(3, 1);
    slice.displace(|_| 0.001 * DVec2::new(random.signed(), random.signed()));
    let before = slice.energy();
    run(&mut slice, 2.0, DT);
    println!("{before} {} {}", slice.energy(), slice.water().energy());
    assert!(before > 1e-4 && slice.energy() < 0.1 * before, "{before} {}", slice.energy());
}

#[test]
fn a_symmetric_animal_swims_straight_up() {
    let mut slice = slice::<f64>(Build::default(), 100, Gait::default());
    let start = slice.place();
    run(&mut slice, 3.0, DT);
    let tilt = slice.axis().x.asin().to_degrees();
    assert!(tilt.abs() < 1e-6, "{tilt}");
    let way = slice.place() - start;
    assert!(way.y > 0.02 && way.x.abs() < 1e-9, "{way}");
}

#[test]
fn a_bell_on_its_side_rights_itself() {
    let build = Build { righting: 1.0, ..Build::default() };
    let mut slice = slice::<f64>(build, 50, IDLE);
    let middle = slice.place();
    let turn = DVec2::from_angle(1.0);
    let points: Vec<DVec2> = slice.save().points.as_chunks::<2>().0.iter().map(|p| DVec2::from(*p)).collect();
    slice.displace(|i| turn.rotate(points[i] - middle) + middle - points[i]);
    let before = slice.axis().y;
    run(&mut slice, 4.0, DT);
    assert!((before - 1.0_f64.cos()).abs() < 1e-9 && slice.axis().y > 0.95, "{}", slice.axis());
}

#[test]
fn ten_times_as_stiff_is_still_calm_at_long_steps() {
    let usual = Build::default();
    let build = Build {
        modulus: 10.0 * usual.modulus,
        bending: 10.0 * usual.bending,
        muscle: 10.0 * usual.muscle,
        ..usual
    };
    let mut slice = slice::<f64>(build, 50, Gait::default());
    let mut fastest = 0.0_f64;
    for _ in 0..1600 {
        slice.step(Level::best(), DT);
        fastest = fastest.max(slice.water().fastest());
        assert!(slice.water().fastest() < 1.0, "{}", slice.water().fastest());
    }
    println!("fastest {fastest}");
    assert!(places(&slice).iter().all(|place| place.is_finite()));
}

#[test]
fn a_strand_is_drawn_out_as_far_as_it_may_and_no_farther() {
    let run = |strand_stretch: f64| {
        let mut slice = slice::<f32>(Build { strand_stretch, ..Build::default() }, 50, Gait::default());
        let mut longest = 0.0_f64;
        for _ in 0..1000 {
            slice.step(Level::best(), DT);
            longest = longest.max(slice.longest()[1]);
        }
        (longest, slice.save())
    };
    let [(held, _), (loose, far), (free, farther)] = [1.5, 100.0, f64::INFINITY].map(run);
    println!("{held}, free {free}");
    // It is drawn out as far as that, but for rounding.
    assert!((held - 1.5).abs() < 1e-12 && free > 3.0, "{held} {free}");
    // A limit that is not reached changes nothing.
    assert!(loose == free && far == farther);
    for strand_stretch in [0.9, f64::NAN] {
        let refused = Slice::<f32>::new(Build { strand_stretch, ..Build::default() }, grid(50)).err();
        assert!(refused.is_some_and(|text| text.starts_with("strand_stretch must not be below 1")));
    }
}

#[test]
fn a_swimming_animal_leaves_no_divergence() {
    let mut single = slice::<f32>(Build::default(), 100, Gait::default());
    let mut double = slice::<f64>(Build::default(), 100, Gait::default());
    let mut most = [0.0_f64; 2];
    for step in 0..300 {
        single.step(Level::best(), DT);
        double.step(Level::best(), DT);
        assert_eq!(single.water().across_walls().max(double.water().across_walls()), 0.0);
        if step % 10 == 0 {
            let (mut a, mut b) = (single.water().clone(), double.water().clone());
            a.project(Level::best());
            b.project(Level::best());
            most = [most[0].max(a.divergence()), most[1].max(b.divergence())];
        }
    }
    println!("{most:?}");
    assert!(most[0] <= 1e-4 && most[1] <= 1e-11, "{most:?}");
}

#[test]
fn an_animal_gives_the_same_bytes_at_every_instruction_set() {
    fn bytes<T: Real>(level: Level) -> Vec<u64> {
        let mut slice = slice::<T>(Build::default(), 50, Gait { frequency: 2.0, ..Gait::default() });
        for _ in 0..60 {
            slice.step(level, 0.01);
        }
        let state = slice.save();
        let faces = state.faces.iter().map(|value| value.wide().to_bits());
        faces.chain(state.points.iter().map(|value| value.to_bits())).collect()
    }
    let (single, double) = (bytes::<f32>(Level::scalar()), bytes::<f64>(Level::scalar()));
    for level in Level::all() {
        assert!(bytes::<f32>(level) == single && bytes::<f64>(level) == double, "{}", level.name());
    }
}

#[test]
fn a_saved_animal_goes_on_as_if_nothing_had_happened() {
    let mut slice = slice::<f32>(Build::default(), 50, Gait::default());
    run(&mut slice, 2.0, DT);
    let state = slice.save();
    let mut other = self::slice::<f32>(Build::default(), 50, Gait::default());
    other.load(&state).expect("a state");
    assert_ne!(state.offset, [0; 2]);
    run(&mut slice, 0.5, DT);
    run(&mut other, 0.5, DT);
    assert!(slice.save() == other.save());
    let before = slice.save();
    let wrong = [
        {
            let mut s = before.clone();
            s.points.pop();
            s
        },
        {
            let mut s = before.clone();
            s.points[3] = f64::NAN;
            s
        },
        {
            let mut s = before.clone();
            s.points[3] = 9.0;
            s
        },
        {
            let mut s = before.clone();
            s.faces.pop();
            s
        },
        {
            let mut s = before.clone();
            s.faces[7] = f32::INFINITY;
            s
        },
        {
            let mut s = before.clone();
            s.phase = 1.0;
            s
        },
        {
            let mut s = before.clone();
            s.offset[1] = i64::MAX;
            s
        },
    ];
    for state in wrong {
        assert!(slice.load(&state).is_err() && slice.save() == before);
    }
}

#[test]
fn what_cannot_be_built_is_refused_by_its_key() {
    let good = Build::default();
    let builds = [
        (Build { modulus: -1.0, ..good }, "modulus"),
        (Build { bending: -0.1, ..good }, "bending"),
        (Build { muscle: f64::NAN, ..good }, "muscle"),
        (Build { diameter: 0.0, ..good }, "diameter"),
        (Build { diameter: 0.3, ..good }, "larger than its window"),
        (Build { points: 30, ..good }, "points"),
        (Build { strand_segments: 1000, ..good }, "strand_segments"),
    ];
    for (build, word) in builds {
        let message = Slice::<f32>::new(build, grid(50)).expect_err("refused");
        assert!(message.contains(word), "{message}");
    }
    let message = Slice::<f32>::new(good, Grid { n: 3, ..grid(50) }).expect_err("refused");
    assert!(message.contains("16 to 256"), "{message}");
    let mut slice = Slice::<f32>::new(good, grid(50)).expect("an animal");
    for frequency in [0.0, 1e3, f64::NAN] {
        let message = slice.set_gait(Gait { frequency, ..Gait::default() }).expect_err("refused");
        assert!(message.contains("frequency") && message.contains("Hz"), "{message}");
    }
    assert_eq!(slice.gait(), Gait::default());
}

#[test]
fn muscles_shorten_fast_and_the_apex_is_back_first() {
    let gait = Gait::default();
    for place in [0.0, 0.5, 1.0] {
        let at = |phase: f64| gait.rest_length(phase, place);
        assert_eq!([at(0.0), at(0.12), at(0.2)], [1.0, 1.0 - CONTRACTION, 1.0 - CONTRACTION]);
        // Without a jump or a kink from one period to the next.
        for k in 0..1000 {
            let phase = f64::from(k) / 1000.0;
            assert!((at(phase) - at((phase + 1e-6).fract())).abs() < 2e-5, "{phase}");
            assert!((1.0 - CONTRACTION..=1.0).contains(&at(phase)));
        }
    }
    assert!(gait.rest_length(0.53, 0.0) == 1.0 && gait.rest_length(0.53, 1.0) < 0.8);
}
