//! The trains that a wind sea is cut into, and seas that make no sense.

use core::f64::consts::TAU;

use reef_flow::{
    Level,
    waves::{
        GRAVITY, Trains, WindSea, WindSeaError, dispersion,
        spectrum::{CALM, MOST_TRAINS, significant_height},
    },
};

use super::{at, carried, orbits, wind_sea};

#[test]
fn the_significant_height_is_that_of_pierson_and_moskowitz_for_any_number_of_trains() {
    for wind in [1.0, 5.0, 10.0, 25.0] {
        let printed = 0.209 * wind * wind / GRAVITY;
        for count in [1, 2, 10, 30, 100, MOST_TRAINS] {
            let trains = wind_sea(wind, 5000.0, count, 1);
            assert_eq!(trains.len(), count as usize);
            let energy: f64 = trains.iter().map(|t| 0.5 * t.amplitude * t.amplitude).sum();
            let height = 4.0 * energy.sqrt();
            assert!((height / printed - 1.0).abs() < 0.02, "{wind} m/s, {count}: {height} {printed}");
            assert!((height / significant_height(wind) - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn the_trains_follow_the_spectrum_band_by_band() {
    // With many trains, energy below each frequency is the integral that they were cut from; the peak is at
    // 0.877 g/U.
    let wind = 8.0;
    let trains = wind_sea(wind, 1e5, 200, 4);
    let all: f64 = trains.iter().map(|t| t.amplitude * t.amplitude).sum();
    for omega in [0.9, 1.1, 1.3, 1.6, 2.0, 2.6] {
        let below: f64 =
            trains.iter().filter(|t| t.frequency < omega).map(|t| t.amplitude * t.amplitude).sum();
        let printed = (-0.74 * (GRAVITY / wind / omega).powi(4)).exp();
        // A band holds up to 2 % at the peak.
        assert!((below / all - printed).abs() < 0.02, "{omega}: {} {printed}", below / all);
    }
    let peak = trains.iter().max_by(|a, b| a.amplitude.total_cmp(&b.amplitude)).expect("trains");
    assert!(trains.windows(2).all(|w| w[0].amplitude >= w[1].amplitude), "greatest first");
    // Bands are even in the logarithm: their energy is greatest where ω S is, at 1.057 of the peak.
    assert!((peak.frequency / (1.057 * 0.877 * GRAVITY / wind) - 1.0).abs() < 0.02, "{}", peak.frequency);
}

#[test]
fn headings_spread_as_cos_squared_around_the_winds() {
    let mut sums = [0.0; 3];
    for seed in 0..40 {
        for train in wind_sea(9.0, 100.0, 30, seed) {
            let off = train.heading - 0.4;
            assert!(off.abs() <= 0.25 * TAU);
            let energy = train.amplitude * train.amplitude;
            sums = [sums[0] + energy, sums[1] + energy * off, sums[2] + energy * off * off];
        }
    }
    let mean = sums[1] / sums[0];
    let variance = sums[2] / sums[0] - mean * mean;
    // A cos² law over the half circle has the variance π²/12 − ½ = 0.3225.
    assert!(mean.abs() < 0.03, "{mean}");
    assert!((variance - 0.3225).abs() < 0.02, "{variance}");
}

#[test]
fn the_dispersion_relation_holds_to_a_millionth_in_all_depths() {
    for i in 0..400 {
        let omega = 0.01 * 1.02_f64.powi(i);
        for depth in [1e-3, 0.05, 1.0, 5.0, 60.0, 11_000.0, f64::INFINITY] {
            let k = dispersion::wave_number(omega, depth);
            let truth = omega * omega / GRAVITY;
            let residual = k * (k * depth).tanh() / truth - 1.0;
            assert!(residual.abs() < 1e-12, "ω {omega} h {depth}: {residual:e}");
            assert!((dispersion::frequency(k, depth) / omega - 1.0).abs() < 1e-12);
        }
    }
    // What plugins see, in f32.
    for depth in [0.5, 3.0, 50.0] {
        for wave in at(&wind_sea(2.0, depth, 30, 2), 0.0) {
            let (k, omega) = (f64::from(wave.wave_number), f64::from(wave.frequency));
            assert!((omega * omega / (GRAVITY * k * (k * depth).tanh()) - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn without_wind_nothing_moves() {
    for wind in [0.0, 0.5 * CALM] {
        assert_eq!(wind_sea(wind, 5.0, 30, 1), []);
        assert_eq!(significant_height(wind), 0.0);
    }
    for d in orbits(Level::best(), &[], 5.0, [0.0; 3], &[[1.0, -2.0, 3.0]; 11]) {
        assert_eq!(d, [[0.0; 3]; 3]);
    }
    let (x, y, z) = (vec![0.3; 21], vec![-1.0; 21], vec![7.5; 21]);
    let moved = carried(Level::best(), &Trains::new(), usize::MAX, [&x, &y, &z]);
    assert_eq!(moved[..3], [x, y, z]);
    assert!(moved[3..].iter().flatten().all(|v| *v == 0.0));
}

#[test]
fn a_wind_sea_that_makes_no_sense_is_refused_by_name() {
    let sound = WindSea { wind: 5.0, heading: 0.0, depth: 5.0, trains: 30 };
    let refused = |sea: WindSea| sea.trains(&mut || 0.5).expect_err("no such sea");
    assert_eq!(refused(WindSea { wind: -1.0, ..sound }), WindSeaError::Wind(-1.0));
    assert!(matches!(refused(WindSea { wind: f64::NAN, ..sound }), WindSeaError::Wind(_)));
    assert!(matches!(refused(WindSea { heading: f64::INFINITY, ..sound }), WindSeaError::Heading(_)));
    assert_eq!(refused(WindSea { depth: 0.0, ..sound }), WindSeaError::Depth(0.0));
    assert_eq!(refused(WindSea { depth: -3.0, ..sound }), WindSeaError::Depth(-3.0));
    assert_eq!(refused(WindSea { trains: 0, ..sound }), WindSeaError::Trains(0));
    let told = refused(WindSea { trains: 100_000, ..sound }).to_string();
    assert!(told.contains("100000") && told.contains("1 to 256"), "{told}");
}
