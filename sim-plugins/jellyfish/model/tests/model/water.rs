//! The water alone.

use reef_flow::{Level, random::Random};
use reef_jellyfish_model::{
    Real,
    water::{Grid, Water},
};

fn grid(n: usize) -> Grid {
    Grid { n, cell: 0.4 / n as f64, density: 1000.0, viscosity: 1.304e-6 }
}

/// Water that moves by chance, up to `speed` [m/s] on each face.
fn stirred<T: Real>(n: usize, speed: f64) -> Water<T> {
    let mut water = Water::new(grid(n)).expect("a grid");
    let mut random = Random::new(7, n as u64);
    let faces: Vec<T> = (0..2 * n * (n + 1)).map(|_| T::of(speed * random.signed())).collect();
    water.set_faces(&faces).expect("as many faces");
    water
}

fn bits<T: Real>(water: &Water<T>) -> Vec<u64> {
    water.faces().map(|value| value.wide().to_bits()).collect()
}

#[test]
fn projection_leaves_no_divergence_and_nothing_across_walls() {
    for n in [16, 33, 50, 100, 101] {
        let mut exact = stirred::<f64>(n, 0.1);
        assert!(exact.divergence() > 10.0);
        exact.project(Level::best());
        assert!(exact.divergence() <= 1e-11, "{n}: {}", exact.divergence());
        assert_eq!(exact.across_walls(), 0.0);
        let mut single = stirred::<f32>(n, 0.01);
        for _ in 0..2 {
            single.project(Level::best());
        }
        assert!(single.divergence() <= 1e-4, "{n}: {}", single.divergence());
        assert_eq!(single.across_walls(), 0.0);
    }
}

#[test]
fn projection_keeps_what_has_no_divergence_and_only_takes_energy() {
    let mut water = stirred::<f64>(40, 0.1);
    let before = water.energy();
    water.project(Level::best());
    let (after, once) = (water.energy(), bits(&water));
    assert!(after < 0.9 * before && after > 0.1 * before, "{before} {after}");
    water.project(Level::best());
    let faces: Vec<f64> = water.faces().collect();
    for (a, b) in faces.iter().zip(once) {
        assert!((a - f64::from_bits(b)).abs() < 1e-14);
    }
}

/// The eddy that fills a box with free-slip walls: the only change that it knows is viscosity.
fn eddy(n: usize, viscosity: f64) -> Water<f64> {
    let mut water = Water::new(Grid { viscosity, ..grid(n) }).expect("a grid");
    let wave = |at: f64| (core::f64::consts::PI * at / n as f64).sin();
    let half = n as f64 / 2.0;
    let u = (0..n * (n + 1)).map(|k| ((k % (n + 1)) as f64, (k / (n + 1)) as f64 + 0.5));
    let v = (0..n * (n + 1)).map(|k| ((k % n) as f64 + 0.5, (k / n) as f64));
    let u = u.map(|(x, y)| 0.1 * wave(x) * wave(y + half));
    let v = v.map(|(x, y)| -0.1 * wave(x + half) * wave(y));
    water.set_faces(&u.chain(v).collect::<Vec<_>>()).expect("as many faces");
    water
}

fn steps<T: Real>(water: &mut Water<T>, level: Level, dt: f64, count: usize) {
    for _ in 0..count {
        water.diffuse(level, dt);
        water.project(level);
        water.advect(level, dt);
    }
}

#[test]
fn an_eddy_in_a_box_turns_on_and_viscosity_slows_it() {
    for n in [33, 50] {
        for viscosity in [0.0, 1e-3] {
            let mut water = eddy(n, viscosity);
            assert!(water.divergence() < 1e-12);
            let before = water.energy();
            steps(&mut water, Level::best(), 0.005, 200);
            // Each component decays with ν times the sum of both wave numbers squared; the energy twice as
            // fast.
            let rate = 4.0 * viscosity * (core::f64::consts::PI / water.grid().width()).powi(2);
            let rest = water.energy() / before / (-rate).exp();
            println!("{n} {viscosity}: {rest}");
            assert!((rest - 1.0).abs() < 0.01, "{n} {viscosity}: {rest}");
        }
    }
}

#[test]
fn steps_give_the_same_bytes_at_every_instruction_set() {
    fn run<T: Real>(level: Level) -> Vec<u64> {
        let mut water = stirred::<T>(50, 1.0);
        steps(&mut water, level, 0.02, 12);
        bits(&water)
    }
    let (single, double) = (run::<f32>(Level::scalar()), run::<f64>(Level::scalar()));
    for level in Level::all() {
        assert!(run::<f32>(level) == single && run::<f64>(level) == double, "{}", level.name());
    }
}

#[test]
fn a_spread_force_is_all_there_and_works_on_what_is_felt() {
    let mut random = Random::new(1, 2);
    let (mut water, still) = (stirred::<f64>(50, 0.1), stirred::<f64>(50, 0.0));
    water.project(Level::best());
    let (mut sum, mut size) = ([0.0; 2], 0.0);
    let mut pushed = still.clone();
    for _ in 0..50 {
        let place = [random.between(0.01, 0.39), random.between(0.01, 0.39)];
        let force = [random.signed(), random.signed()];
        pushed.push(place, force, 0.005);
        sum = [sum[0] + force[0] * 0.005, sum[1] + force[1] * 0.005];
        size += force[0].hypot(force[1]) * 0.005;
        // Half of the difference between a push and its opposite is its work on the water that was there.
        let [mut with, mut against] = [water.clone(), water.clone()];
        with.push(place, force, 0.005);
        against.push(place, [-force[0], -force[1]], 0.005);
        let felt = water.velocity(place);
        let work = 0.005 * (force[0] * felt[0] + force[1] * felt[1]);
        let energy = 0.5 * (with.energy() - against.energy());
        assert!((energy - work).abs() < 1e-9 * water.energy(), "{energy} {work}");
    }
    let all = pushed.momentum();
    assert!((0..2).all(|axis| (all[axis] - sum[axis]).abs() <= 1e-12 * size), "{all:?} {sum:?}");
}

#[test]
fn the_window_takes_the_water_along_and_new_cells_are_at_rest() {
    let n = 24;
    let water = stirred::<f64>(n, 0.1);
    let faces: Vec<f64> = water.faces().collect();
    let u = |i: usize, j: usize| faces[j * (n + 1) + i];
    for [columns, rows] in [[1, 0], [-1, 0], [0, 1], [0, -1], [3, -2]] {
        let mut moved = water.clone();
        moved.follow([columns, rows]);
        let after: Vec<f64> = moved.faces().collect();
        for j in 0..n {
            // Walls stay walls.
            for i in 1..n {
                let (from_i, from_j) = (i as isize + columns, j as isize + rows);
                let inside = (0..=n as isize).contains(&from_i) && (0..n as isize).contains(&from_j);
                let wall = from_i == 0 || from_i == n as isize;
                let expected = if inside { u(from_i as usize, from_j as usize) } else { 0.0 };
                assert!(wall || after[j * (n + 1) + i] == expected, "{columns} {rows}: {i} {j}");
            }
        }
        assert_eq!(moved.across_walls(), 0.0);
    }
}

#[test]
fn a_grid_that_cannot_be_stepped_is_refused() {
    let good = grid(50);
    let bad = [
        Grid { n: 3, ..good },
        Grid { n: 100_000, ..good },
        Grid { cell: 0.0, ..good },
        Grid { density: f64::NAN, ..good },
        Grid { viscosity: -1.0, ..good },
    ];
    for grid in bad {
        assert!(Water::<f32>::new(grid).is_err(), "{grid:?}");
    }
    let message = Water::<f32>::new(bad[0]).expect_err("refused");
    assert!(message.contains("16 to 256") && message.contains('3'), "{message}");
}
