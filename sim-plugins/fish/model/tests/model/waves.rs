//! Fish among the waves.

use std::f64::consts::TAU;

use glam::DVec3;
use reef_fish_model::{
    shoal::{Kind, Shoal, Start, Surroundings, Waves},
    species::Species,
};
use reef_flow::waves::dispersion;
use reef_sdk::abi::Wave;

use crate::{
    DT,
    shoal::{around, habitat},
};

const DEPTH: f64 = 12.0;
const LENGTH: f64 = 30.0;
const AMPLITUDE: f64 = 0.3;

/// A train along x at a time [s], and its ω [rad/s].
fn train(time: f64) -> (Wave, f64) {
    let k = TAU / LENGTH;
    let omega = dispersion::frequency(k, DEPTH);
    let wave = Wave {
        amplitude: AMPLITUDE as f32,
        wave_number: k as f32,
        frequency: omega as f32,
        phase: (-omega * time).rem_euclid(TAU) as f32,
        direction: [1.0, 0.0],
        ..Wave::default()
    };
    (wave, omega)
}

fn still() -> Shoal {
    let mut species = Species::default();
    species.mind.wander = 0.0;
    species.mind.cruise = 0.05;
    let kind = Kind::new(&species, Vec::new()).expect("a kind");
    let start = |i: u32| Start {
        kind: 0,
        position: DVec3::new(1.7 * f64::from(i), -4.0, 0.0),
        // Across the waves.
        heading: 0.5 * std::f64::consts::PI,
        size: 1.0,
        habitat: 0,
        home: None,
        seed: 1,
    };
    let starts: Vec<Start> = (0..3).map(start).collect();
    Shoal::new(vec![kind], vec![habitat(60.0)], &starts).expect("a shoal")
}

#[test]
fn the_water_around_a_fish_is_that_of_linear_theory() {
    let (wave, omega) = train(0.4);
    let k = TAU / LENGTH;
    for factor in [1.0, 0.5, 0.0] {
        let mut shoal = still();
        let at: Vec<DVec3> = shoal.fish().iter().map(|fish| fish.position).collect();
        let waves = Waves { trains: &[wave], depth: DEPTH, factor, camera: None };
        shoal.step(&Surroundings { waves, ..around(0.0) });
        for (fish, at) in shoal.fish().iter().zip(at) {
            let psi = k * at.x - omega * 0.4;
            let scale = f64::from(factor) * AMPLITUDE * omega / (k * DEPTH).sinh();
            let expected = DVec3::new(
                scale * (k * (at.y + DEPTH)).cosh() * psi.sin(),
                -scale * (k * (at.y + DEPTH)).sinh() * psi.cos(),
                0.0,
            );
            let off = (fish.water.as_dvec3() - expected).length();
            assert!(off < 1e-5, "{} for {expected}", fish.water);
            assert!(factor == 0.0 || expected.length() > 0.02);
        }
    }
}

#[test]
fn waves_carry_points_and_bodies_to_and_fro() {
    let (_, omega) = train(0.0);
    let extent = AMPLITUDE * (-TAU / LENGTH * 4.0).exp();
    for near in [0.0, 1e9] {
        let mut shoal = still();
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let period = (TAU / omega / DT) as usize;
        for step in 0..6 * period {
            let (wave, _) = train(step as f64 * DT);
            let waves = Waves { trains: &[wave], depth: DEPTH, factor: 1.0, camera: None };
            shoal.step(&Surroundings { waves, ..around(near) });
            if step >= 5 * period {
                low = low.min(shoal.fish()[0].position.x);
                high = high.max(shoal.fish()[0].position.x);
            }
        }
        println!("{near}: {:.3} m to and fro, the water {:.3} m", high - low, 2.0 * extent);
        let share = (high - low) / (2.0 * extent);
        // A body follows the water with a lag; Stokes's drift is a few hundredths.
        assert!(share > 0.7 && share < 1.15, "{share}");
    }
}
