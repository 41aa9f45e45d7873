//! The levels of detail's switches and borders (§4.4), and how a plant goes over from one level, or one
//! method, to another.

use glam::DVec3;
use reef_flow::waves::{Choice, Lens, Rule};
use reef_sdk::abi::{Camera, Wave};

/// By which method plants move (§4.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// The physical one; far away, where levels of detail are on, the procedural one.
    #[default]
    Auto,
    /// The physical one at all levels.
    Physical,
    /// The procedural one at all levels.
    Procedural,
}

/// What a person may change while the sea runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    /// Compute fewer segments of plants that are farther away (§4.4.1).
    pub segments: bool,
    /// ND: nearer plants have all segments computed [m].
    pub near: f64,
    /// FD: farther plants have the first segment of each branch computed, procedurally [m].
    pub far: f64,
    /// Leave plants as they are while nobody sees them (§4.4.2).
    pub visible: bool,
    /// How much wider than the camera's picture is counted as in view.
    pub margin: f64,
    /// Leave out wave trains that nobody sees the work of (§4.4.2).
    pub trains: bool,
    /// A_min: what they may displace water by on the screen [px].
    pub threshold: f64,
    /// By which method they move.
    pub method: Method,
    /// Share of the waves that plants feel; 1: all.
    pub waves: f64,
    /// Stiffness of contacts with ground, rocks and obstacles [N/m]; 0: nothing touches.
    pub contact: f64,
    /// Time in which a plant goes over from one level or method to the next [s].
    pub blend: f64,
}

impl Default for Levels {
    fn default() -> Self {
        Self {
            segments: true,
            near: 5.0,
            far: 20.0,
            visible: true,
            margin: 0.15,
            trains: true,
            threshold: 0.5,
            method: Method::Auto,
            waves: 1.0,
            contact: 60.0,
            blend: 1.0,
        }
    }
}

impl Levels {
    /// None of them: every segment of every plant, physically, under all trains.
    pub fn none() -> Self {
        Self { segments: false, visible: false, trains: false, ..Self::default() }
    }

    /// The level that a plant at a distance [m] should have, and the procedural method's share.
    pub fn wanted(&self, distance: f64) -> [f32; 2] {
        let level = match self.segments {
            true if distance > self.far => 2.0,
            true if distance > self.near => 1.0,
            _ => 0.0,
        };
        let lagged = match self.method {
            Method::Auto => f32::from(u8::from(level == 2.0)),
            Method::Physical => 0.0,
            Method::Procedural => 1.0,
        };
        [level, lagged]
    }

    /// Chooses which of a step's trains over the depth [m] matter from how far away.
    pub(crate) fn choose(&self, choice: &mut Choice, waves: &[Wave], depth: f64, camera: &Camera) {
        if self.trains {
            // The whole height of the water: what is chosen for one plant does not depend on where the others
            // stand.
            choice.update(waves, depth, Lens::new(camera), self.threshold, Rule::Sum, [-depth, 0.0]);
        } else {
            choice.forget();
        }
    }

    /// How far a plant goes toward another level or method in a step [s].
    pub fn pace(&self, dt: f64) -> f32 {
        (dt / self.blend.max(1e-6)).min(2.0) as f32
    }
}

/// From `now` toward `wanted` by `pace` at most; exactly there when it is in reach.
pub fn toward(now: f32, wanted: f32, pace: f32) -> f32 {
    let way = wanted - now;
    if way.abs() <= pace { wanted } else { now + pace.copysign(way) }
}

/// Distance [m] from an eye of the nearest point of a line of length `long` [m] that stands upright on
/// `foot`.
pub(crate) fn upright_distance(eye: DVec3, foot: DVec3, long: f64) -> f64 {
    DVec3::new(foot.x, eye.y.clamp(foot.y, foot.y + long), foot.z).distance(eye)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_of_an_upright_line_may_be_its_middle_or_end() {
        // The eye is 1 m over the foot: beside a line of 2 m, over one of 0.5 m.
        let (eye, foot) = (DVec3::new(1.0, -2.0, 3.0), DVec3::new(4.0, -3.0, 7.0));
        assert!((upright_distance(eye, foot, 2.0) - 5.0).abs() < 1e-12);
        assert!((upright_distance(eye, foot, 0.5) - 25.25_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn levels_follow_from_the_distance() {
        let levels = Levels::default();
        assert_eq!([4.9, 5.1, 19.9, 20.1].map(|d| levels.wanted(d)[0]), [0.0, 1.0, 1.0, 2.0]);
        assert_eq!([4.9, 19.9, 20.1].map(|d| levels.wanted(d)[1]), [0.0, 0.0, 1.0]);
        assert_eq!(Levels::none().wanted(1e9), [0.0, 0.0]);
        let method = |method| Levels { method, ..levels };
        assert_eq!(method(Method::Procedural).wanted(1.0), [0.0, 1.0]);
        assert_eq!(method(Method::Physical).wanted(100.0), [2.0, 0.0]);
    }

    #[test]
    fn going_over_takes_about_a_second_and_ends_exactly() {
        let levels = Levels::default();
        let (mut now, mut steps) = (0.0, 0);
        while now != 1.0 {
            now = toward(now, 1.0, levels.pace(1.0 / 60.0));
            steps += 1;
        }
        assert!((60..=61).contains(&steps), "{steps}");
        assert_eq!(toward(2.0, 0.0, 0.25), 1.75);
    }
}
