//! The window's camera: the scene's own path until somebody takes over, then orbiting a thing or flying
//! freely.
//!
//! Pure: it knows neither window nor clock. Every motion is the exact solution of a first-order lag over the
//! given time, so two half frames give the same view as one whole. What it shows never reaches the
//! simulation.

use glam::{DQuat, DVec3, EulerRot, Quat};
use reef_streams::frame::CameraPose;

/// Lag of turning and zooming [s]: short enough to feel attached to the hand, long enough to hide uneven
/// frames.
const HAND_LAG: f64 = 0.06;
/// Lag of the glide toward a thing that was focused, and back to the scene's path [s].
const GLIDE_LAG: f64 = 0.22;
/// Lag of the swimmer's speed [s].
const SWIM_LAG: f64 = 0.18;
/// Swimming speed [m/s], and its factor while shift is held.
const SWIM_SPEED: f64 = 0.9;
const SWIM_FAST: f64 = 4.0;
/// Steepest view up or down [rad].
const PITCH_LIMIT: f64 = 1.54;
/// Shortest and longest distance to what is orbited [m].
const ARM: (f64, f64) = (0.03, 60.0);
/// Zoom of one notch of the wheel: the distance shrinks by this logarithm.
const ZOOM_NOTCH: f64 = 0.16;
/// Turn of a drag over one window height [rad].
const TURN_PER_HEIGHT: f64 = 2.6;

/// Who moves the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The scene's keyframes.
    Scene,
    /// Round a point.
    Orbit,
    /// From the eye, like a swimmer.
    Fly,
}

/// Where the eye may be.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Lowest y at the eye's place [m].
    pub floor: f64,
    /// Highest y [m].
    pub ceiling: f64,
}

impl Limits {
    /// Anywhere.
    pub const NONE: Self = Self { floor: f64::NEG_INFINITY, ceiling: f64::INFINITY };
}

/// A view without roll: the eye sits `exp(log_arm)` behind the anchor (orbit), or at it (fly).
#[derive(Clone, Copy, Debug)]
struct Rig {
    anchor: DVec3,
    yaw: f64,
    pitch: f64,
    log_arm: f64,
}

impl Rig {
    fn rotation(&self) -> DQuat {
        DQuat::from_rotation_y(self.yaw) * DQuat::from_rotation_x(self.pitch)
    }

    fn forward(&self) -> DVec3 {
        self.rotation() * DVec3::NEG_Z
    }

    fn arm(&self, mode: Mode) -> f64 {
        if mode == Mode::Orbit { self.log_arm.exp() } else { 0.0 }
    }

    fn eye(&self, mode: Mode) -> DVec3 {
        self.anchor - self.forward() * self.arm(mode)
    }

    /// The same view, with the anchor where the other mode wants it.
    fn converted(mut self, from: Mode, to: Mode) -> Self {
        let eye = self.eye(from);
        self.anchor = eye + self.forward() * self.arm(to);
        self
    }

    fn from_pose(pose: &CameraPose, distance: f64, mode: Mode) -> Self {
        let (yaw, pitch, _roll) = pose.rotation.as_dquat().normalize().to_euler(EulerRot::YXZ);
        let log_arm = distance.clamp(ARM.0, ARM.1).ln();
        let mut rig =
            Self { anchor: pose.position, yaw, pitch: pitch.clamp(-PITCH_LIMIT, PITCH_LIMIT), log_arm };
        rig.anchor += rig.forward() * rig.arm(mode);
        rig
    }
}

/// What still separates the shown view from the one that the mode asks for; it fades, so that no change of
/// mode jumps.
#[derive(Clone, Copy, Debug)]
struct Residual {
    offset: DVec3,
    turn: DQuat,
}

impl Residual {
    const NONE: Self = Self { offset: DVec3::ZERO, turn: DQuat::IDENTITY };

    fn between(shown: &CameraPose, asked: &CameraPose) -> Self {
        Self {
            offset: shown.position - asked.position,
            turn: (shown.rotation.as_dquat() * asked.rotation.as_dquat().inverse()).normalize(),
        }
    }

    fn fade(&mut self, keep: f64) {
        self.offset *= keep;
        self.turn = DQuat::IDENTITY.slerp(self.turn, keep).normalize();
        if self.offset.length_squared() < 1e-14 && self.turn.w.abs() > 1.0 - 1e-13 {
            *self = Self::NONE;
        }
    }
}

/// What hands did since the last frame, and what they hold.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Drag of the left button in window heights, x right, y down.
    pub drag: [f64; 2],
    /// Notches of the wheel; positive: nearer.
    pub zoom: f64,
    /// Swim keys held: right, up, forward, each −1..1.
    pub swim: [f64; 3],
    /// Shift is held.
    pub fast: bool,
}

impl Motion {
    fn is_rest(&self) -> bool {
        self.drag == [0.0; 2] && self.zoom == 0.0 && self.swim == [0.0; 3]
    }
}

/// The camera's state between two frames.
#[derive(Clone, Debug)]
pub struct CameraControl {
    mode: Mode,
    asked: Rig,
    shown: Rig,
    velocity: DVec3,
    residual: Residual,
    lag: f64,
    last: Option<CameraPose>,
}

impl Default for CameraControl {
    fn default() -> Self {
        Self::new()
    }
}

impl CameraControl {
    /// On the scene's path.
    pub fn new() -> Self {
        let rig = Rig { anchor: DVec3::ZERO, yaw: 0.0, pitch: 0.0, log_arm: 0.0 };
        Self {
            mode: Mode::Scene,
            asked: rig,
            shown: rig,
            velocity: DVec3::ZERO,
            residual: Residual::NONE,
            lag: HAND_LAG,
            last: None,
        }
    }

    /// Who moves the camera now.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Moves on by `dt` seconds and returns the view. `scene` is the scene's camera now, `distance` the
    /// distance [m] to what stands in the middle of the view (the pivot, should somebody take over in this
    /// very frame).
    pub fn update(
        &mut self,
        dt: f64,
        motion: &Motion,
        scene: &CameraPose,
        distance: f64,
        limits: Limits,
    ) -> CameraPose {
        let dt = if dt.is_finite() { dt.clamp(0.0, 1.0) } else { 0.0 };
        if !motion.is_rest() {
            self.take_over(motion, scene, distance);
        }
        match self.mode {
            Mode::Scene => {}
            Mode::Orbit | Mode::Fly => self.steer(dt, motion),
        }
        self.residual.fade((-dt / GLIDE_LAG).exp());
        let mut pose = self.asked_pose(scene);
        if self.mode != Mode::Scene {
            self.hold_inside(&mut pose, limits);
        }
        pose.position += self.residual.offset;
        pose.rotation = (self.residual.turn * pose.rotation.as_dquat()).normalize().as_quat();
        self.last = Some(pose);
        pose
    }

    /// Goes to a sphere and orbits it.
    pub fn focus(&mut self, centre: DVec3, radius: f64, scene: &CameraPose) {
        if !(centre.is_finite() && radius.is_finite()) {
            return;
        }
        let from = self.last.unwrap_or(*scene);
        let distance = from.position.distance(centre).max(ARM.0);
        self.enter(Mode::Orbit, scene, distance);
        // The sphere fills about half of the picture's height.
        let half = f64::from(scene.fov_y.clamp(0.05, 3.0)) * 0.5;
        let arm = (radius.max(0.02) * 2.0 / half.tan()).clamp(ARM.0, ARM.1);
        self.asked.anchor = centre;
        self.asked.log_arm = arm.ln();
        self.lag = GLIDE_LAG;
    }

    /// Back to the scene's path, gliding.
    pub fn release(&mut self, scene: &CameraPose) {
        if let Some(last) = self.last {
            self.residual = Residual::between(&last, scene);
        }
        self.mode = Mode::Scene;
        self.velocity = DVec3::ZERO;
    }

    /// Forgets everything: another scene was opened.
    pub fn restart(&mut self) {
        *self = Self::new();
    }

    /// Takes the mode that the panel asks for, from where the view is.
    pub fn choose(&mut self, mode: Mode, scene: &CameraPose, distance: f64) {
        match mode {
            Mode::Scene => self.release(scene),
            Mode::Orbit | Mode::Fly => self.enter(mode, scene, distance),
        }
    }

    fn take_over(&mut self, motion: &Motion, scene: &CameraPose, distance: f64) {
        self.lag = HAND_LAG;
        let swims = motion.swim != [0.0; 3];
        if swims && self.mode != Mode::Fly {
            self.enter(Mode::Fly, scene, distance);
        } else if self.mode == Mode::Scene {
            self.enter(Mode::Orbit, scene, distance);
        }
    }

    fn enter(&mut self, mode: Mode, scene: &CameraPose, distance: f64) {
        match (self.mode, mode) {
            (from, to) if from == to => {}
            (Mode::Scene, to) => {
                let from = self.last.unwrap_or(*scene);
                let rig = Rig::from_pose(&from, distance, to);
                (self.asked, self.shown) = (rig, rig);
                self.mode = to;
                // A roll of the scene's camera cannot be kept by hand: it fades.
                self.residual = Residual::NONE;
                self.residual = Residual::between(&from, &self.asked_pose(scene));
            }
            (from, to) => {
                if to == Mode::Orbit {
                    let log_arm = distance.clamp(ARM.0, ARM.1).ln();
                    (self.asked.log_arm, self.shown.log_arm) = (log_arm, log_arm);
                }
                self.asked = self.asked.converted(from, to);
                self.shown = self.shown.converted(from, to);
                self.mode = to;
            }
        }
        self.velocity = DVec3::ZERO;
    }

    fn steer(&mut self, dt: f64, motion: &Motion) {
        self.asked.yaw -= motion.drag[0] * TURN_PER_HEIGHT;
        self.asked.pitch -= motion.drag[1] * TURN_PER_HEIGHT;
        self.asked.pitch = self.asked.pitch.clamp(-PITCH_LIMIT, PITCH_LIMIT);
        match self.mode {
            Mode::Orbit => {
                let log_arm = self.asked.log_arm - motion.zoom * ZOOM_NOTCH;
                self.asked.log_arm = log_arm.clamp(ARM.0.ln(), ARM.1.ln());
            }
            Mode::Fly | Mode::Scene => self.asked.anchor += self.asked.forward() * motion.zoom * 0.25,
        }

        let keep = (-dt / self.lag).exp();
        self.shown.yaw = self.asked.yaw + (self.shown.yaw - self.asked.yaw) * keep;
        self.shown.pitch = self.asked.pitch + (self.shown.pitch - self.asked.pitch) * keep;
        self.shown.log_arm = self.asked.log_arm + (self.shown.log_arm - self.asked.log_arm) * keep;
        self.shown.anchor = self.asked.anchor + (self.shown.anchor - self.asked.anchor) * keep;

        // The swimmer's speed follows the keys with a lag; the way is that lag's exact integral.
        let rotation = self.shown.rotation();
        let wish = DVec3::new(motion.swim[0], 0.0, -motion.swim[2]);
        let wish = rotation * wish + DVec3::Y * motion.swim[1];
        let wish = wish.clamp_length_max(1.0) * SWIM_SPEED * if motion.fast { SWIM_FAST } else { 1.0 };
        let keep = (-dt / SWIM_LAG).exp();
        let way = wish * dt + (self.velocity - wish) * SWIM_LAG * (1.0 - keep);
        self.velocity = wish + (self.velocity - wish) * keep;
        self.asked.anchor += way;
        self.shown.anchor += way;
    }

    fn asked_pose(&self, scene: &CameraPose) -> CameraPose {
        match self.mode {
            Mode::Scene => *scene,
            mode => CameraPose {
                position: self.shown.eye(mode),
                rotation: self.shown.rotation().as_quat(),
                fov_y: scene.fov_y,
            },
        }
    }

    /// Keeps the eye between the ground and the surface; what was flown into is slid along, not stored up.
    fn hold_inside(&mut self, pose: &mut CameraPose, limits: Limits) {
        let floor = limits.floor.min(limits.ceiling);
        let y = pose.position.y.clamp(floor, limits.ceiling);
        if y == pose.position.y {
            return;
        }
        pose.position.y = y;
        if self.mode == Mode::Fly {
            self.shown.anchor.y = y;
            self.asked.anchor.y = self.asked.anchor.y.clamp(floor, limits.ceiling);
            self.velocity.y = 0.0;
        } else {
            // An orbit that is cut off by the ground still looks at its pivot.
            *pose = look_at(pose.position, self.shown.anchor, pose.fov_y);
        }
    }
}

/// Unit vector of the view ray through a point of the picture (0..1, y down).
pub fn view_ray(pose: &CameraPose, point: [f64; 2], aspect: f64) -> DVec3 {
    let half = (f64::from(pose.fov_y) * 0.5).tan();
    let x = (point[0] * 2.0 - 1.0) * half * aspect;
    let y = (1.0 - point[1] * 2.0) * half;
    (pose.rotation.as_dquat() * DVec3::new(x, y, -1.0)).normalize_or(DVec3::NEG_Z)
}

/// A camera at `position` that looks at `target`, y up.
pub fn look_at(position: DVec3, target: DVec3, fov_y: f32) -> CameraPose {
    let to = (target - position).normalize_or(DVec3::NEG_Z);
    let yaw = (-to.x).atan2(-to.z);
    let pitch = to.y.clamp(-1.0, 1.0).asin();
    let rotation = Quat::from_rotation_y(yaw as f32) * Quat::from_rotation_x(pitch as f32);
    CameraPose { position, rotation, fov_y }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> CameraPose {
        look_at(DVec3::new(0.0, -2.0, 3.0), DVec3::new(0.0, -2.5, 0.0), 1.0)
    }

    fn angle(a: Quat, b: Quat) -> f64 {
        let d = a.as_dquat().normalize().dot(b.as_dquat().normalize()).abs().min(1.0);
        2.0 * d.acos()
    }

    fn drag(x: f64, y: f64) -> Motion {
        Motion { drag: [x, y], ..Motion::default() }
    }

    /// f32 quaternions: one rounding is 6e-8, `acos` near 1 doubles its digits to some 1e-3.
    const TURN_TOLERANCE: f64 = 2e-3;

    #[test]
    fn the_scenes_path_is_shown_until_somebody_takes_over() {
        let mut camera = CameraControl::new();
        for i in 0..10 {
            let pose = CameraPose { position: DVec3::new(f64::from(i), -2.0, 3.0), ..scene() };
            let shown = camera.update(0.016, &Motion::default(), &pose, 3.0, Limits::NONE);
            assert_eq!(shown.position, pose.position);
            assert!(angle(shown.rotation, pose.rotation) < TURN_TOLERANCE);
        }
        assert_eq!(camera.mode(), Mode::Scene);
    }

    #[test]
    fn taking_over_does_not_jump() {
        for motion in [drag(1e-9, 0.0), Motion { swim: [0.0, 0.0, 1e-9], ..Motion::default() }] {
            let mut camera = CameraControl::new();
            let before = camera.update(0.016, &Motion::default(), &scene(), 3.0, Limits::NONE);
            let after = camera.update(1e-6, &motion, &scene(), 3.0, Limits::NONE);
            assert_ne!(camera.mode(), Mode::Scene);
            assert!(before.position.distance(after.position) < 1e-5, "{:?}", after.position);
            assert!(angle(before.rotation, after.rotation) < TURN_TOLERANCE);
        }
    }

    #[test]
    fn a_rolled_scene_camera_is_taken_over_without_a_jump_and_rights_itself() {
        let mut camera = CameraControl::new();
        let tilted = CameraPose { rotation: scene().rotation * Quat::from_rotation_z(0.4), ..scene() };
        camera.update(0.016, &Motion::default(), &tilted, 3.0, Limits::NONE);
        let first = camera.update(1e-6, &drag(1e-9, 0.0), &tilted, 3.0, Limits::NONE);
        assert!(angle(first.rotation, tilted.rotation) < TURN_TOLERANCE);
        let mut last = first;
        for _ in 0..200 {
            last = camera.update(0.05, &Motion::default(), &tilted, 3.0, Limits::NONE);
        }
        let right = last.rotation * glam::Vec3::X;
        assert!(right.y.abs() < 1e-5, "still rolled: {right:?}");
    }

    #[test]
    fn orbiting_keeps_the_distance_to_the_pivot() {
        let mut camera = CameraControl::new();
        let start = camera.update(0.016, &Motion::default(), &scene(), 3.0, Limits::NONE);
        let pivot = start.position + (start.rotation * glam::Vec3::NEG_Z).as_dvec3() * 3.0;
        for _ in 0..40 {
            let pose = camera.update(0.016, &drag(0.05, 0.01), &scene(), 3.0, Limits::NONE);
            assert!((pose.position.distance(pivot) - 3.0).abs() < 1e-5);
            let ahead = (pose.rotation * glam::Vec3::NEG_Z).as_dvec3();
            assert!(ahead.dot((pivot - pose.position).normalize()) > 0.9999);
        }
    }

    #[test]
    fn one_long_frame_shows_what_many_short_ones_show() {
        let run = |frames: u32| {
            let mut camera = CameraControl::new();
            camera.update(0.0, &drag(0.2, 0.1), &scene(), 2.0, Limits::NONE);
            let swim = Motion { swim: [0.3, 0.2, 1.0], ..Motion::default() };
            // Swim with the head already at rest: while it turns, the way depends on when the keys act.
            for _ in 0..frames {
                camera.update(2.0 / f64::from(frames), &Motion::default(), &scene(), 2.0, Limits::NONE);
            }
            let mut pose = scene();
            for _ in 0..frames {
                pose = camera.update(0.5 / f64::from(frames), &swim, &scene(), 2.0, Limits::NONE);
            }
            pose
        };
        // 2 s of 0.06 s lag leave e^-33; `dt` is clamped at 1 s, so two frames are the longest pair.
        let (few, many) = (run(2), run(240));
        assert!(few.position.distance(many.position) < 1e-9, "{:?} {:?}", few.position, many.position);
        assert!(angle(few.rotation, many.rotation) < TURN_TOLERANCE);
        assert!(few.position.distance(scene().position) > 0.2, "it did not move at all");
    }

    #[test]
    fn the_wheel_zooms_by_the_same_factor_at_every_distance() {
        let arms: Vec<f64> = [0.5, 5.0]
            .iter()
            .map(|distance| {
                let mut camera = CameraControl::new();
                let start = camera.update(0.0, &Motion::default(), &scene(), *distance, Limits::NONE);
                let pivot = start.position + (start.rotation * glam::Vec3::NEG_Z).as_dvec3() * *distance;
                camera.update(
                    0.016,
                    &Motion { zoom: 2.0, ..Motion::default() },
                    &scene(),
                    *distance,
                    Limits::NONE,
                );
                let mut pose = start;
                for _ in 0..10 {
                    pose = camera.update(0.5, &Motion::default(), &scene(), *distance, Limits::NONE);
                }
                pose.position.distance(pivot) / distance
            })
            .collect();
        assert!((arms[0] - arms[1]).abs() < 1e-6);
        assert!((arms[0] - (-2.0 * ZOOM_NOTCH).exp()).abs() < 1e-6);
    }

    #[test]
    fn focus_ends_with_the_thing_in_the_middle_of_the_picture() {
        let mut camera = CameraControl::new();
        camera.update(0.016, &Motion::default(), &scene(), 3.0, Limits::NONE);
        let thing = DVec3::new(1.5, -3.0, -2.0);
        camera.focus(thing, 0.1, &scene());
        let mut pose = scene();
        for _ in 0..60 {
            pose = camera.update(0.1, &Motion::default(), &scene(), 3.0, Limits::NONE);
        }
        let ahead = (pose.rotation * glam::Vec3::NEG_Z).as_dvec3();
        assert!(ahead.dot((thing - pose.position).normalize()) > 0.99999);
        // Radius over distance is half of the half view's tangent: the sphere fills half of the height.
        let share = 0.1 / pose.position.distance(thing) / 0.5f64.tan();
        assert!((share - 0.5).abs() < 1e-3, "{share}");
    }

    #[test]
    fn release_glides_back_to_the_moving_path() {
        let mut camera = CameraControl::new();
        camera.update(0.016, &Motion::default(), &scene(), 3.0, Limits::NONE);
        for _ in 0..50 {
            camera.update(0.016, &drag(0.03, -0.01), &scene(), 3.0, Limits::NONE);
        }
        let away = camera.update(0.0, &Motion::default(), &scene(), 3.0, Limits::NONE);
        camera.release(&scene());
        let first = camera.update(0.0, &Motion::default(), &scene(), 3.0, Limits::NONE);
        assert!(first.position.distance(away.position) < 1e-6, "it jumped");
        let mut last = first;
        for _ in 0..200 {
            last = camera.update(0.05, &Motion::default(), &scene(), 3.0, Limits::NONE);
        }
        assert_eq!(camera.mode(), Mode::Scene);
        assert!(last.position.distance(scene().position) < 1e-6);
    }

    #[test]
    fn the_eye_stays_above_ground_and_below_the_surface() {
        let limits = Limits { floor: -3.0, ceiling: -0.2 };
        for up in [1.0, -1.0] {
            let mut camera = CameraControl::new();
            let swim = Motion { swim: [0.0, up, 0.0], fast: true, ..Motion::default() };
            let mut pose = scene();
            for _ in 0..300 {
                pose = camera.update(0.016, &swim, &scene(), 3.0, limits);
                assert!(pose.position.y >= limits.floor && pose.position.y <= limits.ceiling);
            }
            // And nothing was stored up: the way back begins at once.
            let back = Motion { swim: [0.0, -up, 0.0], ..Motion::default() };
            for _ in 0..30 {
                camera.update(0.016, &back, &scene(), 3.0, limits);
            }
            let after = camera.update(0.016, &back, &scene(), 3.0, limits);
            assert!((after.position.y - pose.position.y).abs() > 0.1);
        }
    }

    #[test]
    fn a_drag_to_the_right_swings_the_eye_left_in_orbit_and_looks_right_in_fly() {
        let mut orbit = CameraControl::new();
        let mut pose = scene();
        for _ in 0..30 {
            pose = orbit.update(0.016, &drag(0.01, 0.0), &scene(), 3.0, Limits::NONE);
        }
        assert!(pose.position.x < -0.1, "{:?}", pose.position);
        let mut fly = CameraControl::new();
        fly.choose(Mode::Fly, &scene(), 3.0);
        for _ in 0..30 {
            pose = fly.update(0.016, &drag(0.01, 0.0), &scene(), 3.0, Limits::NONE);
        }
        assert!((pose.rotation * glam::Vec3::NEG_Z).x > 0.1);
    }

    #[test]
    fn nonsense_times_and_places_do_not_poison_the_camera() {
        let mut camera = CameraControl::new();
        for dt in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
            let pose = camera.update(dt, &drag(0.1, 0.1), &scene(), f64::NAN.max(1.0), Limits::NONE);
            assert!(pose.position.is_finite() && pose.rotation.is_finite());
        }
        camera.focus(DVec3::NAN, 1.0, &scene());
        let pose = camera.update(0.1, &Motion::default(), &scene(), 1.0, Limits::NONE);
        assert!(pose.position.is_finite());
    }

    #[test]
    fn the_ray_through_the_middle_is_the_view_direction() {
        let pose = scene();
        let ahead = (pose.rotation * glam::Vec3::NEG_Z).as_dvec3();
        assert!(view_ray(&pose, [0.5, 0.5], 1.7).dot(ahead) > 1.0 - 1e-6);
        let right = view_ray(&pose, [1.0, 0.5], 1.7).dot((pose.rotation * glam::Vec3::X).as_dvec3());
        assert!(right > 0.0);
        let up = view_ray(&pose, [0.5, 0.0], 1.7);
        assert!(up.y > ahead.y);
    }
}
