//! The kernels against the equations in f64, conservation laws, and bytes.

use glam::DVec3;
use reef_fish_model::{
    material::{Beat, Drive, Material, Method},
    tank::{Stepping, Swimmer, Tank},
};
use reef_flow::Level;
use reef_sdk::Workers;

use crate::*;

/// Greatest distance of a fish's nodes from those of the reference after `steps` of the thesis's sub-steps,
/// over its length.
fn error(method: Method, beat: &Beat, drive: Drive, water: DVec3, steps: usize) -> f64 {
    let material = Material::default();
    let mut reference = reference(&material, beat);
    let mut tank = one(plan(&material, beat), drive);
    tank.swimmers_mut()[0].water = water;
    let stepping = thesis(method);
    for _ in 0..steps {
        (0..10).for_each(|_| reference.step(0.004, method, &drive, water));
        step(&mut tank, THESIS_DT, &stepping);
    }
    let apart =
        nodes(&tank, 0).iter().zip(&reference.positions).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
    apart / body().length()
}

#[test]
fn the_kernels_follow_the_equations_in_f64() {
    let steered = Drive { yaw: 0.05, pitch: 0.03, ..drive(2.0, 0.2) };
    let water = DVec3::new(0.05, 0.02, -0.04);
    for method in [Method::Implicit, Method::Symplectic] {
        for beat in [Beat::default(), Beat { upright: true, lag: 0.2, edge: 1.0 }] {
            // A second: 250 sub-steps in f32.
            let error = error(method, &beat, steered, water, 25);
            assert!(error < 2e-5, "{method:?} {beat:?}: {error:e}");
        }
    }
}

#[test]
fn a_jump_in_place_of_an_edge_is_followed_too() {
    let error =
        error(Method::Implicit, &Beat { edge: 0.0, ..Beat::default() }, drive(2.0, 0.2), DVec3::ZERO, 12);
    assert!(error < 2e-5, "{error:e}");
}

/// Σ m v and Σ |m v| of one fish, over the mass of a node.
fn momenta(velocities: &[[f32; 3]]) -> [f64; 2] {
    let v = || velocities.iter().map(|v| glam::Vec3::from(*v).as_dvec3());
    [v().sum::<DVec3>().length(), v().map(DVec3::length).sum()]
}

#[test]
fn without_water_and_damping_momentum_stays_zero() {
    let material = Material { water: 0.0, damping: 0.0, ..Material::default() };
    let beat = Beat::default();
    let mut reference = reference(&material, &beat);
    for _ in 0..500 {
        reference.step(0.004, Method::Implicit, &drive(2.0, 0.2), DVec3::ZERO);
    }
    assert!(reference.velocities.iter().any(|v| v.length() > 0.01), "it moves");
    assert!(reference.momentum().length() <= 1e-10, "{}", reference.momentum());
    let mut tank = one(plan(&material, &beat), drive(2.0, 0.2));
    for _ in 0..50 {
        step(&mut tank, THESIS_DT, &thesis(Method::Implicit));
        let [sum, all] = momenta(tank.velocities(0));
        assert!(sum <= 1e-5 * all, "{sum:e} of {all}");
    }
    // Its centre has not moved.
    assert!(tank.center(0).length() < 1e-5, "{}", tank.center(0));
}

#[test]
fn with_water_it_gains_momentum() {
    let mut tank = one(usual(), drive(2.0, 0.2));
    (0..100).for_each(|_| step(&mut tank, THESIS_DT, &thesis(Method::Implicit)));
    let [sum, all] = momenta(tank.velocities(0));
    assert!(sum > 0.05 * all, "{sum} of {all}");
}

#[test]
fn at_rest_it_stays_as_it_is_for_ever() {
    for method in [Method::Implicit, Method::Symplectic] {
        let mut tank = one(usual(), drive(2.0, 0.0));
        let before = tank.positions(0).to_vec();
        (0..3000).for_each(|_| step(&mut tank, DT, &Stepping { method, ..implicit() }));
        assert!(tank.positions(0) == before, "{method:?}");
    }
}

#[test]
fn at_rest_and_turned_it_moves_by_no_more_than_rounding() {
    let swimmer = Swimmer::at(DVec3::new(1000.0, -5.0, 3.0));
    let mut tank = Tank::new(usual(), vec![swimmer], &[1.0]);
    let before = nodes(&tank, 0);
    (0..3600).for_each(|_| step(&mut tank, DT, &implicit()));
    let apart = nodes(&tank, 0).iter().zip(&before).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
    assert!(apart < 1e-6 * body().length(), "{apart:e}");
}

/// Seventeen fish that differ, after a while: in groups and at levels of choice.
fn school(level: Level, groups: usize) -> Vec<u32> {
    let place = |i: usize| Swimmer {
        size: 1.0 + 0.05 * i as f64,
        phase: 0.05 * i as f32,
        drive: Drive { yaw: 0.01 * i as f64, ..drive(1.0 + 0.2 * i as f64, 0.2) },
        water: DVec3::X * 0.01 * i as f64,
        ..Swimmer::at(DVec3::X * i as f64)
    };
    let mut tank = Tank::new(usual(), (0..17).map(place).collect(), &[0.1, 0.7, 2.0]);
    let all: Vec<u32> = (0..17).collect();
    for _ in 0..20 {
        for who in all.chunks(groups) {
            tank.step(who, DT, &implicit(), level, Workers::inline());
        }
    }
    let all = (0..17).flat_map(|i| tank.positions(i).to_vec());
    all.flatten().map(f32::to_bits).collect()
}

#[test]
fn any_split_and_any_level_give_the_same_bytes() {
    let best = school(Level::best(), 17);
    for groups in [1, 3, 8, 16] {
        assert!(school(Level::best(), groups) == best, "groups of {groups}");
    }
    for level in Level::all() {
        assert!(school(level, 17) == best, "{}", level.name());
    }
}

#[test]
fn a_fish_of_another_size_swims_the_same_lengths() {
    let swim = |size: f64| {
        let mut tank = one(usual(), drive(2.0, 0.2));
        tank.swimmers_mut()[0].size = size;
        (0..120).for_each(|_| step(&mut tank, DT, &implicit()));
        tank.center(0) / size
    };
    assert!((swim(3.0) - swim(1.0)).length() < 1e-6);
    assert!(swim(1.0).length() > 0.1);
}
