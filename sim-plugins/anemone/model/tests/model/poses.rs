//! What the species do in the default sea's swell and currents: how far they lean, and how their tips swing.

use std::f64::consts::TAU;

use glam::DVec3;
use reef_anemone_model::{
    bed::Bed,
    config::{Anemone, Config},
};
use reef_flow::waves::dispersion;
use reef_sdk::{SceneInfo, abi::Flow};
use serde_json::Map;

use crate::common::current;
use crate::scene::{grow, run, species_table, toml};

const DT: f64 = 1.0 / 60.0;
/// Steps between two looks.
const LOOK: usize = 6;

/// The greatest speed [m/s] that the default sea's swell and currents reach together at the bed, and the
/// period [s] of the strongest train.
fn default_current() -> (f64, f64) {
    let scene = toml("scenes/reef.toml");
    let number = |table: &serde_json::Value, key: &str| table[key].as_f64().expect("a number");
    let depth = number(&scene["water"], "depth");
    // Amplitude and frequency of the orbits at the bed.
    let trains = scene["wave"].as_array().expect("a swell").iter().map(|wave| {
        let k = TAU / number(wave, "wavelength");
        (number(wave, "amplitude") / (k * depth).sinh(), dispersion::frequency(k, depth))
    });
    let (mut speed, mut strongest) = (0.0, (0.0, 0.0));
    for (amplitude, frequency) in trains {
        speed += amplitude * frequency;
        if amplitude * frequency > strongest.0 {
            strongest = (amplitude * frequency, TAU / frequency);
        }
    }
    let flows = scene["flow"].as_array().expect("flows");
    let currents = flows.iter().filter(|flow| flow["kind"] == "directional");
    (speed + currents.map(|flow| number(flow, "speed")).sum::<f64>(), strongest.1)
}

/// Five plants of a species, from small to large, a metre apart.
fn bed_of(species: &str) -> Bed {
    let table = (species.to_owned(), species_table(species, &Map::new()).into());
    let info = SceneInfo {
        name: "test".into(),
        seed: 5,
        scale: 1.0,
        dt: DT,
        species: [table].into_iter().collect(),
    };
    let plant = |i: u32| Anemone {
        species: species.to_owned(),
        position: [f64::from(i), 0.0, 0.0],
        scale: 0.8 + 0.25 * f64::from(i),
        yaw: 40.0 * f64::from(i),
        seed: Some(i),
    };
    grow(&info, &Config { anemones: (0..5).map(plant).collect(), ..Config::default() })
}

/// Nodes of every fibre but the feet, root first.
fn fibres(bed: &Bed) -> Vec<Vec<DVec3>> {
    let mut all: Vec<(Vec<DVec3>, f32)> = Vec::new();
    for node in bed.trace() {
        if node.node == 0 {
            all.push((Vec::new(), node.radius));
        }
        all.last_mut().expect("a root comes first").0.push(DVec3::from(node.position));
    }
    let tentacles = all.into_iter().filter(|(_, radius)| *radius < 0.02);
    tentacles.map(|(nodes, _)| nodes).collect()
}

fn tip_direction(nodes: &[DVec3]) -> DVec3 {
    (nodes[nodes.len() - 1] - nodes[nodes.len() - 2]).normalize()
}

/// Angle from the vertical of the line from root to tip [deg].
fn lean(nodes: &[DVec3]) -> f64 {
    (nodes[nodes.len() - 1] - nodes[0]).angle_between(DVec3::Y).to_degrees()
}

/// The value that a share of all stays below.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share) as usize]
}

/// The default current as it swings at a moment [s].
fn swinging(at: f64) -> Flow {
    let (speed, period) = default_current();
    current(DVec3::X * (speed * (TAU * at / period).sin()))
}

#[test]
fn seagrass_leans_by_about_35_degrees_at_most_in_the_default_current() {
    let (speed, _) = default_current();
    assert!((0.1..0.2).contains(&speed), "the default sea's water: {speed} m/s");
    for species in ["seagrass", "turtlegrass"] {
        for along in [DVec3::X, DVec3::Z, DVec3::NEG_X] {
            let mut bed = bed_of(species);
            run(&mut bed, &[current(along * speed)], DT, 1200);
            let leans: Vec<f64> = fibres(&bed).iter().map(|nodes| lean(nodes)).collect();
            let [half, most] = [0.5, 0.9].map(|share| quantile(leans.clone(), share));
            // No stand is a lawn: it does lean, and some blades are longer than others.
            assert!(
                (18.0..35.0).contains(&half) && most < 42.0,
                "{species} along {along}: {half} and {most}"
            );
        }
    }
}

#[test]
fn seagrass_takes_its_time_to_lean_with_the_surge() {
    let (_, period) = default_current();
    let mut bed = bed_of("seagrass");
    let mut last = fibres(&bed);
    let mut fastest = 0.0_f64;
    let looks = (2.0 * period / DT) as usize / LOOK;
    for look in 0..looks {
        for step in 0..LOOK {
            run(&mut bed, &[swinging((look * LOOK + step + 1) as f64 * DT)], DT, 1);
        }
        let now = fibres(&bed);
        let turn = |(a, b): (&Vec<DVec3>, &Vec<DVec3>)| tip_direction(a).angle_between(tip_direction(b));
        let turns: Vec<f64> = last.iter().zip(&now).map(|pair| turn(pair).to_degrees()).collect();
        fastest = fastest.max(quantile(turns, 0.5) / (LOOK as f64 * DT));
        last = now;
    }
    // To and fro by 35 degrees within 6 s is 37 degrees a second at most.
    assert!(fastest < 45.0, "{fastest} degrees a second");
}

/// How much later the tip of a blade comes than its first joint where the default current swings [deg]: the
/// phases of both directions along the current, by sums with the current's sine and cosine over a period.
fn lags(bed: &mut Bed) -> Vec<f64> {
    let (_, period) = default_current();
    let steps = (period / DT).round() as usize;
    let phase = |sums: &[f64; 2]| sums[1].atan2(sums[0]);
    let mut sums = vec![[[0.0; 2]; 2]; fibres(bed).len()];
    for step in 0..3 * steps {
        run(bed, &[swinging((step + 1) as f64 * DT)], DT, 1);
        if step < 2 * steps {
            continue;
        }
        let (sine, cosine) = (TAU * (step + 1) as f64 * DT / period).sin_cos();
        for (sums, nodes) in sums.iter_mut().zip(fibres(bed)) {
            for (sums, direction) in sums.iter_mut().zip([nodes[1] - nodes[0], tip_direction(&nodes)]) {
                sums[0] += direction.x * sine;
                sums[1] += direction.x * cosine;
            }
        }
    }
    sums.iter().map(|[base, tip]| (phase(base) - phase(tip)).to_degrees()).collect()
}

#[test]
fn tips_of_seagrass_come_after_their_bases_in_the_surge() {
    for species in ["seagrass", "turtlegrass"] {
        let lag = quantile(lags(&mut bed_of(species)), 0.5);
        assert!((20.0..60.0).contains(&lag), "{species}: its tips come {lag} degrees after its bases");
    }
    // All joints of a tentacle with one time constant answer together.
    let lag = quantile(lags(&mut bed_of("actinia-fragacea")), 0.5);
    assert!(lag.abs() < 5.0, "{lag}");
}

#[test]
fn tentacles_swing_by_about_25_degrees_about_a_pose_that_stays_open() {
    let (_, period) = default_current();
    for (species, swings) in [
        ("host-anemone", 18.0..30.0),
        ("actinia-fragacea", 18.0..30.0),
        ("stomphia-coccinea", 18.0..30.0),
        ("anthothoe-chilensis", 18.0..32.0),
        ("anthopleura-xanthogrammica", 8.0..22.0),
    ] {
        let mut bed = bed_of(species);
        run(&mut bed, &[], DT, 1);
        let rest: Vec<DVec3> = fibres(&bed).iter().map(|nodes| tip_direction(nodes)).collect();
        let mut seen: Vec<Vec<DVec3>> = vec![Vec::new(); rest.len()];
        let looks = (2.0 * period / DT) as usize / LOOK;
        for look in 0..looks {
            for step in 0..LOOK {
                run(&mut bed, &[swinging((look * LOOK + step + 1) as f64 * DT)], DT, 1);
            }
            if look >= looks / 2 {
                for (seen, nodes) in seen.iter_mut().zip(fibres(&bed)) {
                    seen.push(tip_direction(&nodes));
                }
            }
        }
        let mean: Vec<DVec3> = seen.iter().map(|seen| seen.iter().sum::<DVec3>().normalize()).collect();
        let farthest = |(seen, mean): (&Vec<DVec3>, &DVec3)| {
            seen.iter().map(|d| d.angle_between(*mean)).fold(0.0, f64::max).to_degrees()
        };
        let swung: Vec<f64> = seen.iter().zip(&mean).map(farthest).collect();
        let [swing, most] = [0.5, 0.9].map(|share| quantile(swung.clone(), share));
        assert!(swings.contains(&swing), "{species}: its tips swing by {swing} degrees");
        assert!(most < 45.0, "{species}: some of its tips swing by {most} degrees");
        // The pose that they swing about is nearly the one at rest: the crown is as open as in still water.
        let away = rest.iter().zip(&mean).map(|(a, b)| a.angle_between(*b).to_degrees()).collect();
        let away = quantile(away, 0.9);
        assert!(away < 10.0, "{species}: {away} degrees from the pose at rest");
    }
}
