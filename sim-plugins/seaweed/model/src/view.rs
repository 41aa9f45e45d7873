//! What is in view (§4.4.2), and how far away.

use glam::{DQuat, DVec3};
use reef_flow::math::cos_sin_f64;
use reef_sdk::abi::Camera;

/// What a camera sees, without a far end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// [m, world]
    pub eye: DVec3,
    /// Unit normals of planes through the eye, inward: left, right, below, above, and across its view.
    pub normals: [DVec3; 5],
}

impl View {
    /// The frustum of a camera with its nominal viewport, wider by a share `margin` to all sides: windows of
    /// another shape see more than the viewport.
    pub fn new(camera: &Camera, margin: f64) -> Self {
        let [width, height] = [camera.width, camera.height].map(|size| f64::from(size.max(1)));
        let (cosine, sine) = cos_sin_f64(0.5 * f64::from(camera.fov_y));
        let up = sine / cosine * (1.0 + margin);
        let aside = up * width / height;
        let [x, y, z, w] = camera.rotation.map(f64::from);
        let turn = DQuat::from_xyzw(x, y, z, w).normalize();
        let normal = |v: DVec3| turn * v.normalize();
        Self {
            eye: DVec3::from(camera.position),
            normals: [
                normal(DVec3::new(1.0, 0.0, -aside)),
                normal(DVec3::new(-1.0, 0.0, -aside)),
                normal(DVec3::new(0.0, 1.0, -up)),
                normal(DVec3::new(0.0, -1.0, -up)),
                normal(DVec3::new(0.0, 0.0, -1.0)),
            ],
        }
    }

    /// Whether something of a ball may be seen.
    pub fn sees(&self, center: DVec3, radius: f64) -> bool {
        let from_eye = center - self.eye;
        self.normals.iter().all(|normal| normal.dot(from_eye) >= -radius)
    }

    /// Distance of the nearest point of a line of length `long` [m] that stands upright on `foot` [m].
    pub fn distance(&self, foot: DVec3, long: f64) -> f64 {
        let nearest = DVec3::new(foot.x, self.eye.y.clamp(foot.y, foot.y + long), foot.z);
        nearest.distance(self.eye)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn balls_beside_behind_and_above_are_not_seen() {
        let camera = Camera {
            position: [1.0, -2.0, 3.0],
            rotation: [0.0, 0.0, 0.0, 1.0],
            fov_y: core::f32::consts::FRAC_PI_2,
            width: 200,
            height: 100,
            ..Camera::default()
        };
        let view = View::new(&camera, 0.0);
        let sees = |x: f64, y: f64, z: f64| view.sees(view.eye + DVec3::new(x, y, z), 0.5);
        assert!(sees(0.0, 0.0, -5.0) && sees(0.0, 5.4, -5.0) && sees(10.4, 0.0, -5.0));
        assert!(!sees(0.0, 6.2, -5.0) && !sees(12.0, 0.0, -5.0) && !sees(0.0, 0.0, 1.0));
        assert!(View::new(&camera, 0.5).sees(view.eye + DVec3::new(0.0, 7.5, -5.0), 0.5));
        // The eye is 1 m over the foot: beside a line of 2 m, over one of 0.5 m.
        let foot = DVec3::new(4.0, -3.0, 7.0);
        assert!((view.distance(foot, 2.0) - 5.0).abs() < 1e-12);
        assert!((view.distance(foot, 0.5) - 25.25_f64.sqrt()).abs() < 1e-12);
    }
}
