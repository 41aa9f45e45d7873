//! What every pass knows of one picture: the Rust mirror of `shaders/view.glsl`.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Mat4, Vec3, Vec4};
use reef_streams::{environment::Environment, frame::CameraPose};

use crate::water::{Caustics, SURFACE_WAVES, Surface, WAVES};

/// Distance of the near plane [m].
pub const NEAR: f32 = 0.02;

/// The uniform block `View`, in the layout that std140 gives it. Positions are relative to the eye, axes are
/// the world's.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct View {
    /// Clip space (reverse depth, y down) from eye space, column by column.
    pub clip_from_eye: [[f32; 4]; 4],
    /// Unit; w: tangent of half the horizontal field of view.
    pub right: [f32; 4],
    /// Unit; w: tangent of half the vertical field of view.
    pub up: [f32; 4],
    /// Unit; w: distance of the near plane [m].
    pub forward: [f32; 4],
    /// Width, height [px], pixels per metre at 1 m, farthest distance that is drawn [m].
    pub viewport: [f32; 4],
    /// World position of the eye [m]; w: wave number of the sand ripples [rad/m].
    pub eye: [f32; 4],
    /// Toward the refracted sun; w: strength of caustics.
    pub sun: [f32; 4],
    /// Just below the surface.
    pub sun_color: [f32; 4],
    /// Just below the surface; w: time [s].
    pub ambient: [f32; 4],
    /// c [1/m]; w: 1 with a plain background.
    pub beam: [f32; 4],
    /// Kd [1/m]; w: brightness of the picture; 1 is the scene's own.
    pub downwelling: [f32; 4],
    /// W0; w: y of the surface [m].
    pub scattered: [f32; 4],
    /// Plain background; w: height of the sand's ripples [m].
    pub plain: [f32; 4],
    /// x, z of the height that `bed` names, relative to the eye [m], cell [m], y = 0 relative to the eye [m].
    pub terrain_origin: [f32; 4],
    /// Columns, rows, 1 / extent of the contact map in x and z [1/m].
    pub terrain_size: [f32; 4],
    /// x, z of the contact map's corner relative to the eye [m]; direction of the surge.
    pub contact_origin: [f32; 4],
    /// Mean gain of the raw caustics at 1, 2, 4 and 8 m.
    pub caustic_mean: [f32; 4],
    /// Caustic waves.
    pub wave: [[f32; 4]; WAVES],
    /// Waves of the surface as it is seen: wave vector [rad/m], amplitude [m], phase at the eye [rad].
    pub surface: [[f32; 4]; SURFACE_WAVES],
    /// Mean depth of the bed below the surface [m], very great without one; how far the eye is over the
    /// highest ground or under the lowest [m]; column and row of the height nearest to the eye, which may lie
    /// outside of the field.
    pub bed: [f32; 4],
    /// How the caustic waves bend the surface, see [`Caustics::focus`].
    pub focus: [[f32; 4]; WAVES],
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
    let v3 = |v: Vec3, w: f32| [v.x, v.y, v.z, w];
    let c3 = |c: [f32; 3], w: f32| [c[0], c[1], c[2], w];
    let eye = lens.eye.as_vec3();
    let plain = environment.plain_background;
    let mut view = View::zeroed();
    view.clip_from_eye = lens.clip_from_eye().to_cols_array_2d();
    view.right = v3(lens.right, lens.tangent[0]);
    view.up = v3(lens.up, lens.tangent[1]);
    view.forward = v3(lens.forward, NEAR);
    view.viewport = [lens.size[0] as f32, lens.size[1] as f32, lens.pixels_per_metre(), lens.far];
    view.eye = v3(eye, 0.0);
    let strength = if plain.is_some() { 0.0 } else { 1.0 };
    view.sun = v3(environment.sun.direction.normalize_or(Vec3::Y), strength);
    view.sun_color = c3(environment.sun.color, 0.0);
    view.ambient = c3(environment.sun.ambient, time as f32);
    view.beam = c3(environment.optics.beam, if plain.is_some() { 1.0 } else { 0.0 });
    view.downwelling = c3(environment.optics.downwelling, 1.0);
    view.scattered = c3(environment.optics.scattered, 0.0);
    view.plain = c3(plain.unwrap_or_default(), 0.0);
    view.caustic_mean = caustics.mean(high);
    view.wave = caustics.at(lens.eye, time);
    view.surface = surface.at(lens.eye, time);
    view.bed = [bed(environment), 0.0, 0.0, 0.0];
    view.focus = caustics.focus();
    view
}

/// Mean depth of the bed below the surface [m].
fn bed(environment: &Environment) -> f32 {
    let Some(terrain) = &environment.terrain else { return 1e4 };
    let sum: f64 = terrain.heights.iter().map(|height| f64::from(*height)).sum();
    (-sum / terrain.heights.len().max(1) as f64).max(0.1) as f32
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
    fn a_window_without_height_gives_a_finite_lens() {
        let pose = CameraPose { position: DVec3::ZERO, rotation: Quat::IDENTITY, fov_y: 1.0 };
        let lens = Lens::new(&pose, [0, 0], 60.0);
        assert!(lens.clip_from_eye().to_cols_array().iter().all(|v| v.is_finite()));
    }
}
