//! What the tests of the particles share.
#![allow(dead_code, reason = "each test crate uses its part")]

use glam::{DQuat, DVec3};
use reef_flow::{
    Level,
    waves::{Train, WindSea},
};
use reef_particles_model::{Cloud, Levels, Particles, Surroundings, config::Config};
use reef_sdk::{
    ConfigError, SceneInfo, Workers,
    abi::{self, Billboard, Camera, Flow, Trace, Wave},
};

/// Of all tests.
pub const DT: f64 = 1.0 / 60.0;

/// The boxes of a configuration in TOML.
pub fn cloud(text: &str) -> Cloud {
    try_cloud(text).expect("a good configuration")
}

/// The same, or what is wrong with it.
pub fn try_cloud(text: &str) -> Result<Cloud, ConfigError> {
    let config: Config = toml::from_str(text).map_err(|error| ConfigError::new("", error.to_string()))?;
    let scene = SceneInfo { name: "test".into(), seed: 5, scale: 1.0, dt: DT, ..SceneInfo::default() };
    Particles::fill(&scene, &config)
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

/// A camera that sees nothing.
pub fn blind() -> Camera {
    camera(DVec3::new(0.0, 1e4, 0.0), DVec3::new(1.0, 2e4, 0.0))
}

/// Pixels of a point in a camera's picture, and its distance along the view; None behind the eye.
pub fn project(camera: &Camera, p: DVec3) -> Option<(f64, f64, f64)> {
    let [x, y, z, w] = camera.rotation.map(f64::from);
    let d = DQuat::from_xyzw(x, y, z, w).inverse() * (p - DVec3::from(camera.position));
    let focal = 0.5 * f64::from(camera.height) / (0.5 * f64::from(camera.fov_y)).tan();
    (d.z < -0.02).then(|| {
        let scale = focal / -d.z;
        (0.5 * f64::from(camera.width) + d.x * scale, 0.5 * f64::from(camera.height) - d.y * scale, -d.z)
    })
}

/// Whether pixels lie in a camera's picture.
pub fn inside(camera: &Camera, (x, y, _): (f64, f64, f64)) -> bool {
    (0.0..=f64::from(camera.width)).contains(&x) && (0.0..=f64::from(camera.height)).contains(&y)
}

/// A wind sea's trains at a time.
pub fn sea(wind: f64, depth: f64, time: f64) -> Vec<Wave> {
    let sea = WindSea { wind, heading: 0.4, depth, trains: 30 };
    let mut next = 0.123;
    let mut random = || {
        next = (next * 97.13_f64 + 0.317).fract();
        next
    };
    let mut trains: Vec<Train> = sea.trains(&mut random).expect("a sea");
    trains.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
    trains.iter().map(|train| train.at(time)).collect()
}

/// A uniform current.
pub fn current(velocity: DVec3) -> Flow {
    let axis = velocity.normalize_or(DVec3::X).as_vec3().to_array();
    Flow { kind: abi::FLOW_DIRECTIONAL, axis, strength: velocity.length() as f32, ..Flow::default() }
}

/// A singularity.
pub fn local(kind: u32, position: DVec3, strength: f32, peak: f32) -> Flow {
    Flow {
        kind,
        position: position.to_array(),
        axis: [0.0, 1.0, 0.0],
        strength,
        peak,
        core: 0.05,
        ..Flow::default()
    }
}

/// What surrounds particles in still water that nobody looks at.
pub fn around<'a>(flow: &'a [Flow], waves: &'a [Wave], camera: &'a Camera) -> Surroundings<'a> {
    Surroundings {
        flow,
        waves,
        depth: 50.0,
        camera,
        dt: DT,
        step: 1,
        level: Level::best(),
        workers: Workers::inline(),
        trace: false,
    }
}

/// One step: its sprites and, if asked for, its trace.
pub fn step(cloud: &mut Cloud, around: &Surroundings<'_>, levels: &Levels) -> (Vec<Billboard>, Vec<Trace>) {
    let counts = cloud.advance(around, levels);
    let mut sprites = vec![Billboard::default(); counts.sprites];
    let mut trace = vec![Trace::default(); counts.trace];
    cloud.emit(around, &mut sprites, &mut trace);
    (sprites, trace)
}

/// Many steps that nobody looks at.
pub fn run(cloud: &mut Cloud, flow: &[Flow], steps: u64) {
    run_on(cloud, flow, 0..steps);
}

/// The steps after the first of these, up to the last. Currents that travel do so in 6 s.
pub fn run_on(cloud: &mut Cloud, flow: &[Flow], steps: core::ops::Range<u64>) {
    let camera = blind();
    let mut flow = flow.to_vec();
    for number in steps.start + 1..=steps.end {
        for flow in flow.iter_mut().filter(|flow| flow.modulation != 0.0) {
            flow.phase = -((number % 360) as f32 / 360.0 * core::f32::consts::TAU);
        }
        let around = Surroundings { step: number, ..around(&flow, &[], &camera) };
        cloud.advance(&around, &Levels::default());
    }
}

/// All centres of a box.
pub fn centers(cloud: &Cloud, number: usize) -> Vec<DVec3> {
    (0..cloud.particles(number)).map(|i| cloud.center(number, i).expect("a particle")).collect()
}

/// Everything off.
pub fn no_levels() -> Levels {
    Levels { trains: false, visible: false, masters: false, fog: false, ..Levels::default() }
}
