//! What the tests of the seaweeds share.
#![allow(dead_code, reason = "each test crate uses its part")]

use glam::{DQuat, DVec3};
use reef_flow::{
    Level,
    waves::{Train, WindSea},
};
use reef_sdk::{
    ConfigError, Workers,
    abi::{self, Camera, Flow, Wave},
};
use reef_seaweed_model::{
    bed::{Bed, JointPose, Kind, Plant, Surroundings},
    levels::Levels,
    skeleton::{Segment, Skeleton},
};

/// Of most tests.
pub const DT: f64 = 1.0 / 60.0;
/// Of the sea that they are in [m].
pub const DEPTH: f64 = 12.0;

/// An upright blade of so many segments, each turned against the one below by `twist` [rad].
pub fn blade(count: usize, twist: f64, like: Segment) -> Vec<Segment> {
    (0..count)
        .map(|i| Segment {
            parent: i.checked_sub(1),
            height: if i == 0 { 0.0 } else { like.length },
            theta: if i == 0 { like.theta } else { twist },
            ..like
        })
        .collect()
}

/// The blade of the model's defaults: 10 × 0.1 m, twisted by 90° from segment to segment.
pub fn usual_blade() -> Skeleton {
    skeleton(&blade(10, core::f64::consts::FRAC_PI_2, Segment { lift: 0.0, ..Segment::default() }))
}

/// A stem with two branches, of which one has a branch of its own.
pub fn bush() -> Skeleton {
    let like = Segment { lift: 0.02, ..Segment::default() };
    let mut segments = blade(6, 1.2, like);
    for (parent, height, theta, phi, count) in
        [(2, 0.1, 0.4, 0.7, 3), (3, 0.05, 3.0, -0.6, 3), (7, 0.1, 1.0, 0.5, 2)]
    {
        for i in 0..count {
            let first = segments.len();
            let parent = if i == 0 { parent } else { first - 1 };
            let (height, phi) = if i == 0 { (height, phi) } else { (0.1, 0.1) };
            segments.push(Segment { parent: Some(parent), height, theta, phi, ..like });
        }
    }
    skeleton(&segments)
}

/// Good segments as a skeleton.
pub fn skeleton(segments: &[Segment]) -> Skeleton {
    Skeleton::new(segments).expect("good segments")
}

/// The module's own files, as the host gives them.
pub fn files(name: &str) -> Result<Vec<u8>, ConfigError> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../assets/modules/reef.seaweed");
    std::fs::read(std::path::Path::new(folder).join(name))
        .map_err(|error| ConfigError::new("", error.to_string()))
}

/// A species of a skeleton.
pub fn kind(skeleton: Skeleton) -> Kind {
    Kind::new(skeleton, 0.3, 0.01)
}

/// A plant of the first species, equal to all others, that stands free.
pub fn plant(root: DVec3) -> Plant {
    Plant { kind: 0, root, up: DVec3::Y, yaw: 0.0, size: 1.0, stiff: 1.0, bend: 0.0, seed: 0, ground: None }
}

/// Where most plants of tests stand: deep, and on no lattice point.
pub const PLACE: DVec3 = DVec3::new(0.3, -10.0, 0.2);

/// One plant.
pub fn alone(skeleton: Skeleton) -> Bed {
    Bed::new(vec![kind(skeleton)], vec![plant(PLACE)])
}

/// A camera at `eye` that looks at `at`: 55 degrees, 1280 × 720.
pub fn camera(eye: DVec3, at: DVec3) -> Camera {
    let back = (eye - at).normalize();
    let right = DVec3::Y.cross(back).normalize();
    let turn = DQuat::from_mat3(&glam::DMat3::from_cols(right, back.cross(right), back));
    Camera {
        position: eye.to_array(),
        rotation: turn.as_quat().to_array(),
        fov_y: 55_f32.to_radians(),
        near_plane: 0.02,
        far_plane: 200.0,
        width: 1280,
        height: 720,
        ..Camera::default()
    }
}

/// Pixels of a point in a camera's picture; None behind the eye.
pub fn project(camera: &Camera, p: DVec3) -> Option<[f64; 2]> {
    let [x, y, z, w] = camera.rotation.map(f64::from);
    let d = DQuat::from_xyzw(x, y, z, w).inverse() * (p - DVec3::from(camera.position));
    let focal = 0.5 * f64::from(camera.height) / (0.5 * f64::from(camera.fov_y)).tan();
    (d.z < -0.02).then(|| [focal * d.x / -d.z, focal * d.y / -d.z])
}

/// A uniform current.
pub fn current(velocity: DVec3) -> Flow {
    let axis = velocity.normalize_or(DVec3::X).as_vec3().to_array();
    Flow { kind: abi::FLOW_DIRECTIONAL, axis, strength: velocity.length() as f32, ..Flow::default() }
}

/// One train along +x with a period [s], at a time [s], over [`DEPTH`].
pub fn swell(amplitude: f64, period: f64, time: f64) -> Wave {
    let omega = core::f64::consts::TAU / period;
    let k = reef_flow::waves::dispersion::wave_number(omega, DEPTH);
    Wave {
        amplitude: amplitude as f32,
        wave_number: k as f32,
        frequency: omega as f32,
        phase: reef_flow::math::reduce_phase(-omega * time) as f32,
        direction: [1.0, 0.0],
        ..Wave::default()
    }
}

/// A wind sea's trains.
pub fn sea(wind: f64, trains: usize) -> Vec<Train> {
    let sea = WindSea { wind, heading: 0.4, depth: DEPTH, trains: trains as u32 };
    let mut next = 0.123;
    let mut random = || {
        next = (next * 97.13_f64 + 0.317).fract();
        next
    };
    let mut trains: Vec<Train> = sea.trains(&mut random).expect("a sea");
    trains.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
    trains
}

/// What surrounds plants in water of their own depth.
pub fn around<'a>(flow: &'a [Flow], waves: &'a [Wave], camera: &'a Camera) -> Surroundings<'a> {
    Surroundings {
        flow,
        waves,
        depth: DEPTH,
        density: 1025.0,
        obstacles: &[],
        camera,
        dt: DT,
        level: Level::best(),
        workers: Workers::inline(),
    }
}

/// Steps a bed without levels of detail in a steady flow.
pub fn run(bed: &mut Bed, flow: &[Flow], dt: f64, steps: usize) {
    run_with(bed, flow, dt, steps, &Levels { contact: 0.0, ..Levels::none() });
}

/// The same by a method.
pub fn run_with(bed: &mut Bed, flow: &[Flow], dt: f64, steps: usize, levels: &Levels) {
    let camera = camera(PLACE + DVec3::new(0.0, 0.5, 4.0), PLACE);
    for _ in 0..steps {
        bed.step(&Surroundings { dt, ..around(flow, &[], &camera) }, levels);
    }
}

/// Poses of all joints.
pub fn poses(bed: &mut Bed) -> Vec<JointPose> {
    let mut poses = vec![JointPose::default(); bed.joint_count()];
    bed.write_poses(Level::best(), Workers::inline(), &mut poses);
    poses
}

/// Nodes of a plant [m, world]: its root, then the end of each segment.
pub fn nodes(bed: &mut Bed, plant: usize) -> Vec<DVec3> {
    let poses = poses(bed);
    bed.nodes(plant, &poses).collect()
}

/// The tip of a plant, relative to its root.
pub fn tip(bed: &mut Bed, plant: usize) -> DVec3 {
    let nodes = nodes(bed, plant);
    *nodes.last().expect("a plant has nodes") - nodes[0]
}

/// θ and φ of all joints of a plant.
pub fn angles(bed: &Bed, plant: usize) -> Vec<[f64; 2]> {
    let state = bed.save();
    let first: u32 = state.segments[..plant].iter().sum();
    let own = first as usize..(first + state.segments[plant]) as usize;
    own.map(|i| [f64::from(state.joints[8 * i]), f64::from(state.joints[8 * i + 1])]).collect()
}

/// Kinetic energy, and that of the springs [J], of a plant of size 1.
pub fn energy(bed: &Bed, plant: usize) -> f64 {
    let state = bed.save();
    let first: u32 = state.segments[..plant].iter().sum();
    let skeleton = &bed.kinds()[bed.plants()[plant].kind].skeleton;
    let of = |(i, segment): (usize, &Segment)| {
        let j: Vec<f64> =
            state.joints[8 * (first as usize + i)..][..8].iter().map(|v| f64::from(*v)).collect();
        let spin = segment.mass * segment.length * segment.length / 12.0;
        let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
        let bent = [j[0] - segment.theta, j[1] - segment.phi];
        0.5 * (segment.stiffness * square(&bent) + spin * square(&j[2..5]) + segment.mass * square(&j[5..8]))
    };
    skeleton.segments().iter().enumerate().map(of).sum()
}
