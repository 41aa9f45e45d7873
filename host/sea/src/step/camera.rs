//! The scene's camera: along keyframes or around a point.

use std::f64::consts::TAU;

use glam::{DMat3, DQuat, DVec2, DVec3, Quat};
use reef_abi as abi;
use reef_flow::keyframe::{Track, TrackError};
use reef_streams::frame::CameraPose;

use crate::scene::format::CameraTable;

/// Where the scene is looked at from, at any time.
#[derive(Clone, Debug)]
pub struct Camera {
    path: Path,
    fov_y: f32,
    near: f32,
    far: f32,
    viewport: [u32; 2],
}

#[derive(Clone, Debug)]
enum Path {
    Keys { position: Track<[f64; 3]>, look_at: Track<[f64; 3]> },
    Orbit { center: DVec3, radius: f64, height: f64, period: f64, start: f64 },
}

impl Camera {
    /// The camera of a scene, all lengths in metres.
    pub fn new(table: &CameraTable) -> Result<Self, TrackError> {
        let path = match &table.orbit {
            Some(orbit) => Path::Orbit {
                center: DVec3::from_array(orbit.center),
                radius: orbit.radius,
                height: orbit.height,
                period: orbit.period,
                start: orbit.start.to_radians(),
            },
            None => Path::Keys { position: table.position.track()?, look_at: table.look_at.track()? },
        };
        Ok(Self {
            path,
            fov_y: table.fov.to_radians() as f32,
            near: table.near as f32,
            far: table.far as f32,
            viewport: table.viewport,
        })
    }

    /// The camera at a time [s].
    pub fn pose(&self, time: f64) -> CameraPose {
        let (position, target) = match &self.path {
            Path::Keys { position, look_at } => {
                (DVec3::from_array(position.at(time)), DVec3::from_array(look_at.at(time)))
            }
            Path::Orbit { center, radius, height, period, start } => {
                let round = if *period == 0.0 { 0.0 } else { (time / period).fract() * TAU };
                let way = DVec2::from_angle(start + round);
                (*center + DVec3::new(way.y * radius, *height, way.x * radius), *center)
            }
        };
        CameraPose { position, rotation: facing(position, target), fov_y: self.fov_y }
    }

    /// A pose as the contract spells it, with the scene's nominal viewport.
    pub fn raw(&self, pose: &CameraPose) -> abi::Camera {
        abi::Camera {
            position: pose.position.to_array(),
            rotation: pose.rotation.to_array(),
            fov_y: pose.fov_y,
            near_plane: self.near,
            far_plane: self.far,
            width: self.viewport[0],
            height: self.viewport[1],
            spare: [0; 3],
        }
    }

    /// Width and height of the nominal picture [px].
    pub fn viewport(&self) -> [u32; 2] {
        self.viewport
    }

    /// Distances between which things are drawn [m].
    pub fn range(&self) -> [f32; 2] {
        [self.near, self.far]
    }
}

/// The turn of a camera at `eye` that looks at `target`, upright. Straight up or down, −z is up in the
/// picture.
pub fn facing(eye: DVec3, target: DVec3) -> Quat {
    let forward = (target - eye).normalize_or(DVec3::NEG_Z);
    let side = forward.cross(DVec3::Y);
    let right = if side.length_squared() < 1e-12 { DVec3::X } else { side.normalize() };
    let up = right.cross(forward);
    DQuat::from_mat3(&DMat3::from_cols(right, up, -forward)).normalize().as_quat()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::{
        format::OrbitTable,
        keyed::{Interpolation, Key, Keyed, Keys},
    };

    #[test]
    fn a_camera_looks_at_its_target_and_stands_upright() {
        let eye = DVec3::new(1.0, 2.0, 3.0);
        for target in [DVec3::ZERO, DVec3::new(4.0, 2.0, -1.0), DVec3::new(1.0, -9.0, 3.0), eye + DVec3::Y] {
            let turn = facing(eye, target);
            let forward = turn * Vec3::NEG_Z;
            let wanted = (target - eye).normalize().as_vec3();
            assert!((forward - wanted).length() < 1e-6, "{target}: {forward}");
            assert!((turn * Vec3::X).y.abs() < 1e-6, "the horizon is level for {target}");
            assert!((turn * Vec3::Y).y > -1e-6);
        }
    }

    #[test]
    fn keyframes_move_the_camera_smoothly_through_their_points() {
        let key = |time, value| Key { time, value };
        let keys = vec![key(0.0, [0.0, 1.0, 5.0]), key(2.0, [4.0, 1.0, 5.0]), key(5.0, [9.0, 2.0, 1.0])];
        let position = Keyed::Keys(Keys { keys, interpolation: Interpolation::Smooth, repeat: false });
        let table =
            CameraTable { position, look_at: Keyed::Fixed([0.0, 0.0, -50.0]), ..CameraTable::default() };
        let camera = Camera::new(&table).unwrap();
        assert_eq!(camera.pose(2.0).position, DVec3::new(4.0, 1.0, 5.0));
        assert_eq!(camera.pose(99.0).position, DVec3::new(9.0, 2.0, 1.0));
        let mut before = camera.pose(0.0);
        let mut speed = 0.0;
        for step in 1..=360 {
            let now = camera.pose(f64::from(step) / 60.0);
            let next = (now.position - before.position).length() * 60.0;
            // Accelerations of this path stay below 12 m/s²: 0.2 m/s in a sixtieth.
            assert!((next - speed).abs() < 0.2, "a jerk at step {step}: {speed} to {next} m/s");
            (before, speed) = (now, next);
        }
    }

    #[test]
    fn an_orbit_comes_round_and_keeps_its_distance() {
        let orbit =
            OrbitTable { center: [1.0, -4.0, 2.0], radius: 3.0, height: 1.0, period: 8.0, start: 90.0 };
        let camera = Camera::new(&CameraTable { orbit: Some(orbit), ..CameraTable::default() }).unwrap();
        assert!((camera.pose(0.0).position - DVec3::new(4.0, -3.0, 2.0)).length() < 1e-12);
        for step in 0..80 {
            let time = f64::from(step) * 0.1;
            let (pose, again) = (camera.pose(time), camera.pose(time + 8.0 * 1000.0));
            assert!((pose.position - again.position).length() < 1e-9);
            assert!(((pose.position - DVec3::new(1.0, -3.0, 2.0)).length() - 3.0).abs() < 1e-12);
        }
    }
}
