//! What a camera has in view, and how far away (Coulais et al. 2005, §3.3.2 and §4.4.2).

use glam::{DQuat, DVec3};
use reef_abi::Camera;

use crate::math::cos_sin_f64;

/// The planes of the frustum: left, right, below, above, and the eye's own, across its view.
pub const PLANES: usize = 5;

/// What a camera sees, without a far end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// [m, world]
    pub eye: DVec3,
    /// Unit normals of planes through the eye, inward.
    pub normals: [DVec3; PLANES],
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
    pub fn sees_ball(&self, center: DVec3, radius: f64) -> bool {
        let from_eye = center - self.eye;
        self.normals.iter().all(|normal| normal.dot(from_eye) >= -radius)
    }

    /// Whether something of a box may be seen: it reaches nearer than `far` [m] and, grown by `margin` [m],
    /// into the frustum.
    pub fn sees_box(&self, center: DVec3, half: DVec3, far: f64, margin: f64) -> bool {
        let from_eye = center - self.eye;
        self.box_distance(center, half) < far
            && self.normals.iter().all(|normal| normal.dot(from_eye) + normal.abs().dot(half) >= -margin)
    }

    /// Distance of a box from the eye [m]: of its nearest point.
    pub fn box_distance(&self, center: DVec3, half: DVec3) -> f64 {
        ((center - self.eye).abs() - half).max(DVec3::ZERO).length()
    }

    /// The same relative to a box's middle, in f32 for kernels.
    pub fn local(&self, center: DVec3) -> Local {
        let from_eye = center - self.eye;
        Local {
            eye: (-from_eye).as_vec3().to_array(),
            planes: self.normals.map(|n| {
                let n32 = n.as_vec3().to_array();
                [n32[0], n32[1], n32[2], n.dot(from_eye) as f32]
            }),
        }
    }
}

/// A view relative to a box's middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// [m]
    pub eye: [f32; 3],
    /// Normal, and the plane's height over the box's middle [m]: n·p + d is how far p is inside.
    pub planes: [[f32; 4]; PLANES],
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            position: [1.0, -2.0, 3.0],
            rotation: [0.0, 0.0, 0.0, 1.0],
            fov_y: core::f32::consts::FRAC_PI_2,
            width: 200,
            height: 100,
            ..Camera::default()
        }
    }

    #[test]
    fn boxes_beside_behind_and_beyond_are_not_seen() {
        let view = View::new(&camera(), 0.0);
        let sees = |x: f64, y: f64, z: f64| {
            view.sees_box(view.eye + DVec3::new(x, y, z), DVec3::splat(0.5), 20.0, 0.0)
        };
        assert!(sees(0.0, 0.0, -5.0));
        // 90 degrees upward, and twice as wide.
        assert!(sees(0.0, 5.2, -5.0) && !sees(0.0, 6.2, -5.0));
        assert!(sees(10.2, 0.0, -5.0) && !sees(12.0, 0.0, -5.0));
        assert!(!sees(0.0, 0.0, 1.0));
        assert!(sees(0.0, 0.0, -20.4) && !sees(0.0, 0.0, -20.6));
    }

    #[test]
    fn balls_beside_behind_and_above_are_not_seen() {
        let view = View::new(&camera(), 0.0);
        let sees = |x: f64, y: f64, z: f64| view.sees_ball(view.eye + DVec3::new(x, y, z), 0.5);
        assert!(sees(0.0, 0.0, -5.0) && sees(0.0, 5.4, -5.0) && sees(10.4, 0.0, -5.0));
        assert!(!sees(0.0, 6.2, -5.0) && !sees(12.0, 0.0, -5.0) && !sees(0.0, 0.0, 1.0));
        assert!(View::new(&camera(), 0.5).sees_ball(view.eye + DVec3::new(0.0, 7.5, -5.0), 0.5));
    }

    #[test]
    fn the_local_view_is_the_same_view() {
        let view = View::new(&camera(), 0.1);
        let center = DVec3::new(3.0, -4.0, -2.0);
        let local = view.local(center);
        for p in [DVec3::ZERO, DVec3::new(0.5, -0.25, 1.0)] {
            for (normal, [x, y, z, d]) in view.normals.iter().zip(local.planes) {
                let inside = normal.dot(center + p - view.eye);
                let here = f64::from(x) * p.x + f64::from(y) * p.y + f64::from(z) * p.z + f64::from(d);
                assert!((inside - here).abs() < 1e-5);
            }
        }
    }
}
