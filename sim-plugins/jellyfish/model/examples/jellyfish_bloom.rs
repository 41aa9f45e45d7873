//! A bloom of 64 for some minutes: `cargo run -p reef-jellyfish-model --example jellyfish_bloom [MINUTES]`.
//! Each minute: the greatest tilt of an animal that swims, how near the surface and how far out of its box
//! one came, the longest springs over their length at rest, the fastest water.

use glam::{DVec3, Vec3};
use reef_jellyfish_model::{
    bloom::{Birth, Bloom, Home, Surroundings, Tuning},
    species::Species,
};
use reef_model_tests::species::table;
use reef_sdk::abi::{FLOW_DIRECTIONAL, Flow};

/// Species, how many, and the corners of their box [m].
const GROUPS: [(&str, u64, DVec3, DVec3); 4] = [
    ("moon-jelly", 34, DVec3::new(-6.0, -7.5, -9.0), DVec3::new(6.0, -2.0, 1.0)),
    ("sea-nettle", 8, DVec3::new(-4.0, -6.5, -5.0), DVec3::new(4.0, -2.5, 0.0)),
    ("box-jelly", 10, DVec3::new(-1.6, -6.0, 0.2), DVec3::new(1.6, -4.2, 1.8)),
    ("comb-jelly", 12, DVec3::new(-1.4, -6.0, 0.6), DVec3::new(1.4, -4.6, 2.0)),
];

fn main() {
    let minutes: u32 = std::env::args().nth(1).map_or(10, |text| text.parse().expect("a number"));
    let species = GROUPS.map(|(name, ..)| -> Species { serde_json::from_value(table(name)).expect(name) });
    let mut births = Vec::new();
    for (number, (_, count, low, high)) in GROUPS.into_iter().enumerate() {
        let mut random = reef_flow::random::Random::new(64, number as u64);
        for _ in 0..count {
            let share = DVec3::from([(); 3].map(|()| random.unit()));
            births.push(Birth {
                species: number,
                place: low + (high - low) * share,
                yaw: core::f64::consts::TAU * random.unit(),
                seed: random.bits(),
                id: births.len() as u64 + 1,
                home: Some(Home { low, high }),
                ..Birth::default()
            });
        }
    }
    let mut bloom = Bloom::new(&species, &births).expect("a bloom");
    let current = Flow { kind: FLOW_DIRECTIONAL, axis: [1.0, 0.0, 0.0], strength: 0.02, ..Flow::default() };
    let mut flow = vec![current];
    // As far animals are stepped.
    let tuning = Tuning { detail: 1e9, ..Tuning::default() };
    let start = std::time::Instant::now();
    for minute in 0..minutes {
        let (mut tilt, mut out, mut longest, mut fastest) = ([0.0_f32; 4], 0.0_f64, [0.0_f64; 2], 0.0_f64);
        let (mut highest, mut lowest) = (f64::MIN, f64::MAX);
        for step in 0..3600 {
            let time = f64::from(minute) * 60.0 + f64::from(step) / 60.0;
            bloom.step(&Surroundings { flow: &flow, depth: 14.0, time, tuning, ..Surroundings::default() });
            flow.truncate(1);
            flow.extend_from_slice(bloom.flows());
            if step % 20 != 0 {
                continue;
            }
            for (i, birth) in births.iter().enumerate() {
                let (Some(seen), Some(slice), Some(home)) = (bloom.seen(i), bloom.slice(i), birth.home)
                else {
                    continue;
                };
                let own = &mut tilt[seen.species];
                *own = own.max(seen.axis.angle_between(Vec3::Y).to_degrees());
                let off = seen.place.clamp(home.low, home.high) - seen.place;
                out = out.max(DVec3::new(off.x, 0.0, off.z).length());
                (highest, lowest) = (highest.max(seen.place.y), lowest.min(seen.place.y));
                let [bell, strand] = slice.longest();
                longest = [longest[0].max(bell), longest[1].max(strand)];
                if step == 0 {
                    fastest = fastest.max(slice.water().fastest());
                }
            }
        }
        println!(
            "minute {}: tilt up to {tilt:.0?}° by species, y {lowest:.2} to {highest:.2} m, up to {out:.2} m beside a box, \
             springs of bells and strands up to {longest:.2?} times their length, water up to {fastest:.2} m/s; {:.1} ms a step",
            minute + 1,
            start.elapsed().as_secs_f64() * 1e3 / (3600.0 * f64::from(minute + 1))
        );
    }
}
