//! Where the time of a step goes on one core: `cargo run -p reef-seaweed-model --example seaweed_speed
//! [PLANTS [LEVEL]]`, blades of the model's defaults on the paper's 40 × 10 m, in a current and in a wind
//! sea, with and without levels of detail, beside the bare kernel. LEVEL: the least `REEF_SIMD_*` that is
//! measured. With `large`: 10 000 plants of 100 segments.

use std::time::Instant;

use glam::DVec3;
use reef_flow::{
    Level,
    waves::{Train, WindSea},
};
use reef_sdk::{
    Workers,
    abi::{self, Camera, Flow},
};
use reef_seaweed_model::{
    bare::Bare,
    bed::{Bed, JointPose, Kind, Plant, Surroundings, Work},
    levels::{Levels, Method},
    skeleton::{Segment, Skeleton},
};

const DT: f64 = 1.0 / 60.0;

/// A blade of so many segments.
fn blade(count: usize, length: f64) -> Skeleton {
    let segment = |i: usize| Segment {
        parent: i.checked_sub(1),
        height: if i == 0 { 0.0 } else { length },
        length,
        theta: core::f64::consts::FRAC_PI_2,
        ..Segment::default()
    };
    Skeleton::new(&(0..count).map(segment).collect::<Vec<_>>()).expect("a blade")
}

/// Plants over 40 × 10 m, or as much more as there are more of them.
fn bed(count: usize, skeleton: Skeleton, far: f64) -> Bed {
    let kind = Kind::new(skeleton, 0.3, 0.01);
    let plants = (0..count).map(|i| {
        let place = |factor: f64, size: f64| ((i as f64 * factor).fract() - 0.5) * size;
        let root = DVec3::new(place(0.754_877_666, 0.25 * far), -4.0, place(0.569_840_291, far));
        let ground = Some(DVec3::Y);
        let (up, yaw) = (DVec3::Y, i as f64);
        Plant { kind: 0, root, up, yaw, size: 1.0, stiff: 1.0, bend: 0.05, seed: i as u64, ground }
    });
    Bed::new(vec![kind], plants.collect())
}

fn sea(trains: u32) -> Vec<Train> {
    let mut chance = 0.1;
    let mut random = || {
        chance = (chance * 97.13_f64 + 0.317).fract();
        chance
    };
    WindSea { wind: 5.0, heading: 0.3, depth: 5.0, trains: trains as _ }.trains(&mut random).expect("a sea")
}

/// The shortest time of some steps [s], and what a step takes.
fn measure(bed: &mut Bed, trains: &[Train], level: Level, levels: &Levels, far: f64) -> (f64, Work) {
    let camera = Camera {
        position: [0.0, -3.2, 0.5 * far + 1.0],
        rotation: [0.0, 0.0, 0.0, 1.0],
        fov_y: 0.96,
        width: 1280,
        height: 720,
        ..Camera::default()
    };
    let current =
        Flow { kind: abi::FLOW_DIRECTIONAL, axis: [1.0, 0.0, 0.0], strength: 0.1, ..Flow::default() };
    let (mut best, mut work) = (f64::INFINITY, Work::default());
    for step in 0..80 {
        let waves: Vec<_> = trains.iter().map(|train| train.at(f64::from(step) * DT)).collect();
        let around = Surroundings {
            flow: &[current],
            waves: &waves,
            depth: 5.0,
            density: 1025.0,
            obstacles: &[],
            camera: &camera,
            dt: DT,
            level,
            workers: Workers::inline(),
        };
        let start = Instant::now();
        work = bed.step(&around, levels);
        let time = start.elapsed().as_secs_f64();
        if step > 20 {
            best = best.min(time);
        }
    }
    (best, work)
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let first = arguments.next();
    let large = first.as_deref() == Some("large");
    let count = if large { 10_000 } else { first.map_or(300, |text| text.parse().expect("a number")) };
    let least: u32 = arguments.next().map_or(0, |text| text.parse().expect("a level"));
    let (segments, far) = if large { (100, 150.0) } else { (10, 40.0) };
    let skeleton = blade(segments, 1.0 / segments as f64);
    for level in
        Level::all().into_iter().filter(|level| level.code() >= least || level.code() == Level::best().code())
    {
        let mut bare = Bare::new(segments);
        let start = Instant::now();
        let mut runs = 0;
        let mut ceiling = f64::INFINITY;
        while start.elapsed().as_secs_f64() < 0.3 {
            let one = Instant::now();
            for _ in 0..100 {
                bare.step(level);
            }
            ceiling = ceiling.min(one.elapsed().as_secs_f64() / 100.0);
            runs += 1;
        }
        let bare_speed = bare.joints() as f64 / ceiling;
        println!("{}: bare kernel {:.1} M joint-steps/s ({runs} runs)", level.name(), bare_speed * 1e-6);
        let without = Levels { visible: false, ..Levels::none() };
        let rows = [
            ("current, no levels", 0, without),
            ("current, procedural", 0, Levels { method: Method::Procedural, blend: 0.0, ..without }),
            ("current, levels", 0, Levels::default()),
            ("12 trains, no levels", 12, without),
            ("30 trains, no levels", 30, without),
            ("30 trains, levels", 30, Levels::default()),
        ];
        for (name, trains, levels) in rows {
            let mut bed = bed(count, skeleton.clone(), far);
            let (time, work) = measure(&mut bed, &sea(30)[..trains], level, &levels, far);
            let all = bed.joint_count() as f64;
            println!(
                "  {name}: {:.3} ms a step of {all} joints, {} computed, {} evaluations; {:.1} M joint-steps/s, {:.0} % of the bare kernel",
                time * 1e3,
                work.joints,
                work.evaluations,
                work.joints as f64 / time * 1e-6,
                100.0 * work.joints as f64 / time / bare_speed
            );
        }
        let mut bed = bed(count, skeleton.clone(), far);
        let mut poses = vec![JointPose::default(); bed.joint_count()];
        let mut best = f64::INFINITY;
        for _ in 0..20 {
            let start = Instant::now();
            bed.write_poses(level, Workers::inline(), &mut poses);
            best = best.min(start.elapsed().as_secs_f64());
        }
        println!(
            "  poses: {:.3} ms, {:.1} M joints/s; {} bytes a joint",
            best * 1e3,
            poses.len() as f64 / best * 1e-6,
            bed.bytes() / poses.len()
        );
    }
}
