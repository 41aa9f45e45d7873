//! Frames along a chain, and the bends between them.

use glam::{DVec2, DVec3};

use crate::math;

/// Three orthonormal, right-handed axes: `z` runs along a segment, `x` and `y` across it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Across: for a root on a plant, away from the plant's axis.
    pub x: DVec3,
    /// Across: z × x.
    pub y: DVec3,
    /// Along the segment.
    pub z: DVec3,
}

impl Frame {
    /// Standing upright, turned by `yaw` [rad] about y.
    pub fn upright(yaw: f64) -> Self {
        let (s, c) = math::sin_cos(yaw);
        let x = DVec3::new(c, 0.0, -s);
        Self { x, y: DVec3::Y.cross(x), z: DVec3::Y }
    }

    /// Along `z`, with `x` as near to `hint` as it goes.
    pub fn along(z: DVec3, hint: DVec3) -> Self {
        let z = z.normalize_or(DVec3::Y);
        let x = (hint - z * hint.dot(z)).try_normalize().unwrap_or_else(|| z.any_orthonormal_vector());
        Self { x, y: z.cross(x), z }
    }

    /// From this frame's axes to the world's.
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        self.x * local.x + self.y * local.y + self.z * local.z
    }

    /// From the world's axes to this frame's.
    pub fn to_local(&self, world: DVec3) -> DVec3 {
        DVec3::new(self.x.dot(world), self.y.dot(world), self.z.dot(world))
    }

    /// `inner`, which is given in this frame's axes, in the world's.
    pub fn compose(&self, inner: &Self) -> Self {
        Self { x: self.to_world(inner.x), y: self.to_world(inner.y), z: self.to_world(inner.z) }
    }

    /// Turned so that `z` points to the unit vector `direction`, by the smallest turn that does it: no twist
    /// comes in. `direction` must not be −z.
    pub fn turned_to(&self, direction: DVec3) -> Self {
        let half = self.z + direction;
        let w = 1.0 / (1.0 + self.z.dot(direction));
        Self {
            x: self.x - half * (self.x.dot(direction) * w),
            y: self.y - half * (self.y.dot(direction) * w),
            z: direction,
        }
    }

    /// Turned by a bend (see [`bend_direction`]).
    pub fn bent(&self, bend: DVec2) -> Self {
        self.turned_to(self.to_world(bend_direction(bend)))
    }
}

/// Where a bend turns the z axis to, in the frame that it starts from. A bend is (angle [rad]) · (unit vector
/// across): the z axis turns by that angle toward that vector.
pub fn bend_direction(bend: DVec2) -> DVec3 {
    let angle = bend.length();
    if angle == 0.0 {
        return DVec3::Z;
    }
    let (s, c) = math::sin_cos(angle);
    (bend * (s / angle)).extend(c)
}

/// The bend that turns the z axis to a unit vector, given in the frame that the bend starts from.
pub fn bend_to(direction: DVec3) -> DVec2 {
    let across = direction.truncate();
    let sine = across.length();
    if sine == 0.0 { DVec2::ZERO } else { across * (math::atan2(sine, direction.z) / sine) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bend_and_its_direction_are_each_others_inverse() {
        for bend in [DVec2::ZERO, DVec2::new(0.3, -0.2), DVec2::new(1e-9, 0.0), DVec2::new(-1.2, 0.9)] {
            let back = bend_to(bend_direction(bend));
            assert!((back - bend).length() < 1e-15, "{bend} {back}");
        }
    }

    #[test]
    fn bending_keeps_frames_orthonormal_and_adds_no_twist() {
        let frame = Frame::upright(0.4);
        let bent = frame.bent(DVec2::new(0.5, 0.25));
        for (a, b, dot) in
            [(bent.x, bent.x, 1.0), (bent.y, bent.y, 1.0), (bent.x, bent.y, 0.0), (bent.x, bent.z, 0.0)]
        {
            assert!((a.dot(b) - dot).abs() < 1e-15);
        }
        assert!((bent.x.cross(bent.y) - bent.z).length() < 1e-15);
        // The axis of the smallest turn stays where it is.
        let axis = frame.z.cross(bent.z).normalize();
        assert!((frame.to_local(axis) - bent.to_local(axis)).length() < 1e-15);
    }

    #[test]
    fn an_upright_frame_turns_about_y() {
        let frame = Frame::upright(std::f64::consts::FRAC_PI_2);
        assert!((frame.x - DVec3::NEG_Z).length() < 1e-15);
        assert!((frame.x.cross(frame.y) - frame.z).length() < 1e-15);
    }
}
