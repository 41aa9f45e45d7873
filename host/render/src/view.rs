//! What every pass knows of one picture: the Rust mirror of `shaders/view.glsl`.

use bytemuck::Zeroable;
use glam::{DVec3, Mat4, Vec3, Vec4};
use reef_streams::{environment::Environment, frame::CameraPose};

use crate::water::{CausticTrain, Caustics, SURFACE_WAVES, Surface, SurfaceTrain, WAVES};

/// Distance of the near plane [m].
pub const NEAR: f32 = 0.02;
/// Depth of the bed where there is none [m].
const NO_BED: f32 = 1e4;

reef_gpu::record! {
    /// The uniform block `View`. Positions are relative to the eye, axes are the world's.
    pub struct View = "View" {
        /// Clip space (reverse depth, y down) from eye space, column by column.
        pub clip_from_eye: [[f32; 4]; 4],
        /// Unit.
        pub right: [f32; 3],
        /// Tangent of half the horizontal field of view.
        pub tangent_x: f32,
        /// Unit.
        pub up: [f32; 3],
        /// Tangent of half the vertical field of view.
        pub tangent_y: f32,
        /// Unit.
        pub forward: [f32; 3],
        /// Distance of the near plane [m].
        pub near: f32,
        /// Width and height of the picture [px].
        pub size: [f32; 2],
        /// At a distance of 1 m.
        pub pixels_per_metre: f32,
        /// Farthest distance that is drawn [m].
        pub far: f32,
        /// World position of the eye [m].
        pub eye: [f32; 3],
        /// Wave number of the sand's ripples [rad/m].
        pub ripple_number: f32,
        /// Height of the sand's ripples [m].
        pub ripple_height: f32,
        /// Unit: along which the surge goes, x and z.
        pub surge: [f32; 2],
        /// Unit: toward the refracted sun.
        pub sun: [f32; 3],
        /// Strength of caustics, 0 to 1.
        pub caustics: f32,
        /// Just below the surface.
        pub sun_color: [f32; 3],
        /// Just below the surface.
        pub ambient: [f32; 3],
        /// c [1/m].
        pub beam: [f32; 3],
        /// 1 with a plain background, 0 in the sea.
        pub diagram: f32,
        /// Kd [1/m].
        pub downwelling: [f32; 3],
        /// Brightness of the picture; 1 is the scene's own.
        pub exposure: f32,
        /// W0.
        pub scattered: [f32; 3],
        /// y of the surface [m].
        pub surface_height: f32,
        /// Plain background.
        pub plain: [f32; 3],
        /// x, z of the height that `nearest` names, relative to the eye [m].
        pub terrain_origin: [f32; 2],
        /// [m].
        pub terrain_cell: f32,
        /// y of height 0 relative to the eye [m].
        pub terrain_zero: f32,
        /// Columns and rows.
        pub terrain_size: [f32; 2],
        /// 1 over the extent of the contact map in x and z [1/m].
        pub contact_scale: [f32; 2],
        /// x, z of the contact map's corner relative to the eye [m].
        pub contact_origin: [f32; 2],
        /// Mean depth of the bed below the surface [m], very great without one: `Terrain::describe` sets it.
        pub bed_depth: f32,
        /// How far the eye is over the highest ground or under the lowest [m].
        pub aloof: f32,
        /// Column and row of the height nearest to the eye, which may lie outside of the field.
        pub nearest: [f32; 2],
        /// Mean gain of the raw caustics at 1, 2, 4 and 8 m.
        pub caustic_mean: [f32; 4],
        /// Trains that focus light.
        pub caustic: [CausticTrain; WAVES],
        /// Trains of the surface as it is seen.
        pub surface: [SurfaceTrain; SURFACE_WAVES],
    }
}

/// A camera with its picture's size: what culling and levels of detail need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Eye [m].
    pub eye: DVec3,
    /// Unit vectors of the camera in world axes.
    pub right: Vec3,
    /// See `right`.
    pub up: Vec3,
    /// See `right`.
    pub forward: Vec3,
    /// Tangents of half the fields of view, horizontal and vertical.
    pub tangent: [f32; 2],
    /// Width and height [px].
    pub size: [u32; 2],
    /// Farthest distance that is drawn [m].
    pub far: f32,
}

impl Lens {
    /// The lens of a pose and a picture's size. Degenerate sizes count as one pixel, so that a window of zero
    /// height gives no infinities.
    pub fn new(pose: &CameraPose, size: [u32; 2], far: f32) -> Self {
        let size = size.map(|n| n.max(1));
        let vertical = (pose.fov_y.clamp(0.02, 3.0) * 0.5).tan();
        let horizontal = vertical * size[0] as f32 / size[1] as f32;
        Self {
            eye: pose.position,
            right: pose.rotation * Vec3::X,
            up: pose.rotation * Vec3::Y,
            forward: pose.rotation * Vec3::NEG_Z,
            tangent: [horizontal, vertical],
            size,
            far,
        }
    }

    /// Size of 1 m at 1 m [px].
    pub fn pixels_per_metre(&self) -> f32 {
        self.size[1] as f32 * 0.5 / self.tangent[1]
    }

    /// The same for the sprites.
    pub fn sprites(&self) -> crate::sprites::Eye {
        crate::sprites::Eye {
            place: self.eye,
            right: self.right,
            up: self.up,
            forward: self.forward,
            tangent: self.tangent,
            pixels: self.pixels_per_metre(),
            depths: [NEAR, self.far],
        }
    }

    /// Clip space from eye space: reverse depth with the far plane at infinity, y down as Vulkan has it.
    pub fn clip_from_eye(&self) -> Mat4 {
        let x = self.right / self.tangent[0];
        let y = -self.up / self.tangent[1];
        let w = self.forward;
        Mat4::from_cols(
            Vec4::new(x.x, y.x, 0.0, w.x),
            Vec4::new(x.y, y.y, 0.0, w.y),
            Vec4::new(x.z, y.z, 0.0, w.z),
            Vec4::new(0.0, 0.0, NEAR, 0.0),
        )
    }

    /// Whether a sphere in eye space is surely outside of the picture.
    pub fn culls(&self, center: Vec3, radius: f32) -> bool {
        let c = Vec3::new(center.dot(self.right), center.dot(self.up), center.dot(self.forward));
        let side = |t: f32| (1.0 + t * t).sqrt() * radius;
        c.z < -radius + NEAR
            || c.x.abs() > c.z * self.tangent[0] + side(self.tangent[0])
            || c.y.abs() > c.z * self.tangent[1] + side(self.tangent[1])
            || c.z - radius > self.far
    }
}

/// A pose between two others: `alpha` 0 is the first, 1 the second.
pub fn between(a: &CameraPose, b: &CameraPose, alpha: f32) -> CameraPose {
    CameraPose {
        position: a.position.lerp(b.position, f64::from(alpha)),
        rotation: a.rotation.slerp(b.rotation, alpha),
        fov_y: a.fov_y + (b.fov_y - a.fov_y) * alpha,
    }
}

/// Beyond this distance less than 1/512 of a thing's light is left [m].
pub fn visibility(environment: &Environment) -> f32 {
    if environment.plain_background.is_some() {
        return 1e4;
    }
    let clearest = environment.optics.beam.iter().copied().fold(f32::INFINITY, f32::min).max(1e-3);
    (6.24 / clearest).clamp(5.0, 400.0)
}

/// The parts of [`View`] that follow from camera, water and light alone.
pub fn view(
    lens: &Lens,
    environment: &Environment,
    (surface, caustics): (&Surface, &Caustics),
    time: f64,
    high: bool,
) -> View {
    let plain = environment.plain_background;
    let mut view = View::zeroed();
    view.clip_from_eye = lens.clip_from_eye().to_cols_array_2d();
    view.right = lens.right.to_array();
    view.up = lens.up.to_array();
    [view.tangent_x, view.tangent_y] = lens.tangent;
    view.forward = lens.forward.to_array();
    view.near = NEAR;
    view.size = lens.size.map(|n| n as f32);
    view.pixels_per_metre = lens.pixels_per_metre();
    view.far = lens.far;
    view.eye = lens.eye.as_vec3().to_array();
    view.sun = environment.sun.direction.normalize_or(Vec3::Y).to_array();
    view.caustics = if plain.is_some() { 0.0 } else { 1.0 };
    view.sun_color = environment.sun.color;
    view.ambient = environment.sun.ambient;
    view.beam = environment.optics.beam;
    view.diagram = if plain.is_some() { 1.0 } else { 0.0 };
    view.downwelling = environment.optics.downwelling;
    view.exposure = 1.0;
    view.scattered = environment.optics.scattered;
    view.plain = plain.unwrap_or_default();
    view.caustic_mean = caustics.mean(high);
    view.caustic = caustics.at(lens.eye, time);
    view.surface = surface.at(lens.eye, time);
    view.bed_depth = NO_BED;
    view
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;

    fn lens() -> Lens {
        let pose = CameraPose { position: DVec3::new(1.0, -3.0, 2.0), rotation: Quat::IDENTITY, fov_y: 1.0 };
        Lens::new(&pose, [640, 360], 60.0)
    }

    #[test]
    fn what_lies_ahead_is_in_the_middle_of_the_picture_and_nearer_things_have_greater_depth() {
        let m = lens().clip_from_eye();
        let near = m * Vec4::new(0.0, 0.0, -1.0, 1.0);
        let far = m * Vec4::new(0.0, 0.0, -50.0, 1.0);
        assert_eq!((near.x, near.y), (0.0, 0.0));
        assert!(near.z / near.w > far.z / far.w);
        assert!((m * Vec4::new(0.0, 0.0, -NEAR, 1.0)).z / NEAR <= 1.0 + 1e-6);
        let above = m * Vec4::new(0.0, 0.3, -1.0, 1.0);
        assert!(above.y < 0.0, "up in the world is up in the picture, where y grows downward");
    }

    #[test]
    fn a_sphere_is_culled_only_when_no_part_of_it_can_be_seen() {
        let lens = lens();
        assert!(!lens.culls(Vec3::new(0.0, 0.0, -5.0), 0.1));
        assert!(lens.culls(Vec3::new(0.0, 0.0, 5.0), 0.1), "behind");
        assert!(!lens.culls(Vec3::new(0.0, 0.0, 0.05), 0.1), "around the eye");
        let edge = lens.tangent[0] * 5.0;
        assert!(!lens.culls(Vec3::new(edge + 0.05, 0.0, -5.0), 0.1), "over the edge");
        assert!(lens.culls(Vec3::new(edge + 0.5, 0.0, -5.0), 0.1), "beyond the edge");
        assert!(lens.culls(Vec3::new(0.0, 0.0, -80.0), 0.1), "beyond what the water lets through");
    }

    #[test]
    fn a_pose_between_two_is_at_its_share_of_the_way_and_of_the_turn() {
        let turned = |angle: f32| CameraPose {
            position: DVec3::new(f64::from(angle), 0.0, 0.0),
            rotation: Quat::from_rotation_y(angle),
            fov_y: 1.0 + angle,
        };
        let (a, b) = (turned(0.2), turned(1.0));
        assert_eq!((between(&a, &b, 0.0).position, between(&a, &b, 1.0).position), (a.position, b.position));
        let seen = between(&a, &b, 0.25);
        let wanted = turned(0.4);
        assert!(seen.position.distance(wanted.position) < 1e-7 && (seen.fov_y - wanted.fov_y).abs() < 1e-6);
        assert!(seen.rotation.angle_between(wanted.rotation) < 1e-3 && seen.rotation.is_normalized());
    }

    #[test]
    fn a_window_without_height_gives_a_finite_lens() {
        let pose = CameraPose { position: DVec3::ZERO, rotation: Quat::IDENTITY, fov_y: 1.0 };
        let lens = Lens::new(&pose, [0, 0], 60.0);
        assert!(lens.clip_from_eye().to_cols_array().iter().all(|v| v.is_finite()));
    }
}
