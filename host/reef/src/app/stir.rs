//! A hand in the water: the cursor's way while it stirs becomes pokes, a few a second.

use glam::DVec3;
use reef_sea::step::water::{MOST_POKES, POKE_TIME, Poke};

/// Between two pokes [s]: as many as can be felt at once, and no more.
const PACE: f64 = POKE_TIME / (MOST_POKES - 1) as f64;
/// A hand that rests pushes this fast [m/s].
const PUSH: f64 = 0.35;
/// Water follows a moving hand at this share of its speed, within these limits [m/s].
const FOLLOWS: f64 = 0.6;
const SPEEDS: (f64, f64) = (0.2, 2.0);
/// A hand slower than this rests [m/s].
const RESTS: f64 = 0.02;
/// How far a poke is felt, as a share of the distance from the eye, within these limits [m]: what is pushed
/// looks equally large from near and far.
const REACH: f64 = 0.16;
const REACHES: (f64, f64) = (0.06, 1.5);

/// Where the hand is in the water.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    /// Now [m].
    pub point: DVec3,
    /// Way since the last frame [m].
    pub way: DVec3,
    /// Unit vector from the eye.
    pub view: DVec3,
    /// From the eye [m].
    pub distance: f64,
    /// What is under the hand; 0: nothing.
    pub object: u64,
}

/// Gathers a hand's way between two pokes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stirring {
    way: DVec3,
    time: f64,
    begun: bool,
}

impl Stirring {
    /// The hand has left the water.
    pub fn stop(&mut self) {
        *self = Self::default();
    }

    /// The hand was in the water for another `dt` seconds; the poke that this makes, if it is time for one.
    pub fn go_on(&mut self, touch: &Touch, dt: f64) -> Option<Poke> {
        self.way += touch.way;
        self.time += dt.clamp(0.0, 1.0);
        // The first poke follows the press at once.
        if self.begun && self.time < PACE {
            return None;
        }
        let motion = self.way / self.time.max(1e-3);
        (self.way, self.time, self.begun) = (DVec3::ZERO, 0.0, true);
        let hand = motion.length();
        let (motion, speed) = match hand > RESTS {
            true => (motion, (hand * FOLLOWS).clamp(SPEEDS.0, SPEEDS.1)),
            false => (DVec3::ZERO, PUSH),
        };
        let reach = (touch.distance * REACH).clamp(REACHES.0, REACHES.1);
        let poke = Poke {
            point: touch.point.to_array(),
            object: touch.object,
            motion: motion.to_array(),
            view: touch.view.to_array(),
            speed,
            reach,
        };
        poke.is_sound().then_some(poke)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touch(way: f64) -> Touch {
        let point = DVec3::new(0.0, -2.0, 0.0);
        Touch { point, way: DVec3::X * way, view: DVec3::NEG_Z, distance: 2.0, object: 7 }
    }

    #[test]
    fn a_long_stir_never_makes_more_pokes_than_can_be_felt() {
        for dt in [0.005, 0.016, 0.1, 0.5] {
            let mut stirring = Stirring::default();
            let frames = (10.0 / dt) as usize;
            let made = (0..frames).filter(|_| stirring.go_on(&touch(0.01), dt).is_some()).count();
            assert!(made as f64 <= 1.0 + 10.0 / PACE, "{made} at {dt}");
            assert!(made >= 10, "{made} at {dt}");
        }
    }

    #[test]
    fn the_press_is_felt_at_once_and_again_after_a_stop() {
        let mut stirring = Stirring::default();
        assert!(stirring.go_on(&touch(0.0), 0.01).is_some());
        assert!(stirring.go_on(&touch(0.0), 0.01).is_none());
        stirring.stop();
        assert!(stirring.go_on(&touch(0.0), 0.01).is_some());
    }

    #[test]
    fn a_moving_hand_stirs_with_its_mean_speed_and_a_resting_one_pushes() {
        let mut stirring = Stirring::default();
        stirring.go_on(&touch(0.0), 0.01);
        let poke = (0..100).find_map(|_| stirring.go_on(&touch(0.01), 0.01)).unwrap();
        assert!((poke.motion[0] - 1.0).abs() < 1e-9, "{poke:?}");
        assert!((poke.speed - FOLLOWS).abs() < 1e-9);
        let rest = (0..100).find_map(|_| stirring.go_on(&touch(0.0), 0.01)).unwrap();
        assert_eq!((rest.motion, rest.speed), ([0.0; 3], PUSH));
    }

    #[test]
    fn nonsense_makes_no_poke() {
        let mut stirring = Stirring::default();
        let lost = Touch { point: DVec3::NAN, ..touch(0.0) };
        assert_eq!(stirring.go_on(&lost, 0.1), None);
    }
}
