//! How points follow their wishes: they turn and speed up no faster than the body does. Eight fish at once.

use fearless_simd::{Select, Simd, f32x8, prelude::*};
use reef_flow::{
    math::sin_cos,
    simd::{clamp, mul_add, splat},
};

use super::{
    act::left,
    habits::{Habits, Rise},
    steer,
};
use crate::lanes::{Vector, add, add_scaled, dot, scale, select, sub, sub_scaled, unit_or};

/// In which time a fish would turn all the way to where it wants to go, were it not bounded, in beats at its
/// fastest.
pub(super) const TURNING: f32 = 2.0;
/// In which time its speed follows [s over its top beat].
const SPEEDING: f32 = 3.0;
/// acos(x) = √(1 − x) times this polynomial, to 2e-8 for 0 ≤ x ≤ 1 (Abramowitz and Stegun, 4.4.46).
const ACOS: [f32; 8] = [
    core::f32::consts::FRAC_PI_2,
    -0.214_598_8,
    0.088_978_99,
    -0.050_174_305,
    0.030_891_88,
    -0.017_088_126,
    0.006_670_09,
    -0.001_262_491_1,
];

/// How fast the points of a kind follow, in a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    /// Share of the wanted speed that is taken on.
    speeding: f32,
    /// Share of an angle that is turned, and the greatest turn [rad].
    turning: f32,
    most: f32,
    dt: f32,
}

impl Pace {
    /// In a step of `dt` [s].
    pub(super) fn of(habits: &Habits, dt: f32) -> Self {
        Self {
            speeding: 1.0 - left(dt, SPEEDING / habits.beat),
            turning: habits.beat / TURNING * dt,
            most: habits.turn * dt,
            dt,
        }
    }

    /// The speed after the step [m/s].
    #[inline(always)]
    pub(super) fn speed<S: Simd>(&self, simd: S, is: f32x8<S>, wanted: f32x8<S>) -> f32x8<S> {
        mul_add(wanted - is, splat(simd, self.speeding), is)
    }

    /// By how much of a beat fish go on at a speed [m/s].
    #[inline(always)]
    pub(super) fn beats<S: Simd>(
        &self,
        simd: S,
        habits: &Habits,
        length: f32x8<S>,
        speed: f32x8<S>,
    ) -> f32x8<S> {
        let (zero, lengths) = (splat(simd, 0.0), speed / length);
        let mut beat = zero;
        for Rise { from, until, slope } in &habits.beats {
            let part = clamp(lengths, splat(simd, *from), splat(simd, *until)) - splat(simd, *from);
            beat = mul_add(part, splat(simd, *slope), beat);
        }
        beat * splat(simd, self.dt)
    }

    /// The course after the step. Both are unit vectors.
    #[inline(always)]
    pub(super) fn course<S: Simd>(&self, simd: S, course: Vector<S>, way: Vector<S>) -> Vector<S> {
        let angle = angle(simd, course, way);
        let turned = (angle * splat(simd, self.turning)).min(splat(simd, self.most)).min(angle);
        // Across the course, in the plane of both; what is right behind is turned to by the side.
        let across = sub_scaled(way, course, dot(way, course));
        let across = unit_or(simd, across, steer::aside(simd, course));
        let (sine, cosine) = sin_cos(turned);
        unit_or(simd, add_scaled(scale(course, cosine), across, sine), course)
    }
}

/// The angle between unit vectors [rad].
#[inline(always)]
fn angle<S: Simd>(simd: S, a: Vector<S>, b: Vector<S>) -> f32x8<S> {
    let cosine = dot(a, b);
    let (zero, half) = (splat(simd, 0.0), splat(simd, 0.5));
    let obtuse = cosine.simd_lt(zero);
    // 1 − |cos|, which their difference, or their sum, knows better.
    let chord = select(obtuse, add(a, b), sub(a, b));
    let less = (dot(chord, chord) * half).min(splat(simd, 1.0));
    let x = splat(simd, 1.0) - less;
    let mut p = splat(simd, ACOS[7]);
    for coefficient in ACOS[..7].iter().rev() {
        p = mul_add(p, x, splat(simd, *coefficient));
    }
    let acute = less.sqrt() * p;
    obtuse.select(splat(simd, core::f32::consts::PI) - acute, acute)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use reef_flow::{Level, random::Random};

    use super::*;
    use crate::{shoal::Kind, species::Species};

    fn turned(pace: Pace, course: Vec3, way: Vec3) -> (Vec3, f32) {
        reef_flow::dispatch!(Level::best(), simd => {
            let wide = |v: Vec3| [splat(simd, v.x), splat(simd, v.y), splat(simd, v.z)];
            let one = |lanes: f32x8<_>| -> f32 { let all: [f32; 8] = lanes.into(); all[3] };
            let [x, y, z] = pace.course(simd, wide(course), wide(way));
            (Vec3::new(one(x), one(y), one(z)), one(angle(simd, wide(course), wide(way))))
        })
    }

    #[test]
    fn a_point_turns_by_its_share_of_the_angle_and_no_faster_than_its_body() {
        let mut random = Random::new(5, 5);
        let mut unit = || Vec3::from([(); 3].map(|()| random.signed() as f32)).normalize();
        let pace = Pace { speeding: 0.1, turning: 0.05, most: 0.04, dt: 0.5 };
        for i in 0..2000 {
            let course = unit();
            // Some of them are nearly where they want to go.
            let way = if i % 4 == 0 { (course + 1e-3 * unit()).normalize() } else { unit() };
            let (after, angle) = turned(pace, course, way);
            let truth = f64::from(course.cross(way).length()).atan2(f64::from(course.dot(way)));
            assert!((f64::from(angle) - truth).abs() < 1e-6, "{angle} {truth}");
            let by = f64::from(course.cross(after).length()).atan2(f64::from(course.dot(after)));
            assert!((by - (0.05 * truth).min(0.04)).abs() < 1e-6, "{by} of {truth}");
            assert!((after.length() - 1.0).abs() < 1e-6);
            // In the plane of both, toward the way.
            assert!(
                after.dot(course.cross(way).normalize()).abs() < 2e-3
                    && after.dot(way) > course.dot(way) - 1e-6
            );
        }
    }

    #[test]
    fn a_point_beats_as_its_gait_says() {
        let kind = Kind::new(&Species::default(), Vec::new()).expect("a kind");
        let (pace, length) =
            (Pace { speeding: 0.1, turning: 0.05, most: 0.04, dt: 0.5 }, 1.5 * kind.length());
        let habits = Habits::of(core::slice::from_ref(&kind)).remove(0);
        for share in [-0.1, 0.0, 0.03, 0.2, 0.5, 0.77, 1.0, 1.3] {
            let speed = share * kind.gait.top_speed();
            let beats = reef_flow::dispatch!(Level::best(), simd => {
                let (length, speed) = (splat(simd, length as f32), splat(simd, 1.5 * speed as f32));
                let all: [f32; 8] = pace.beats(simd, &habits, length, speed).into();
                all[7]
            });
            let wanted = 0.5 * kind.gait.beat(speed);
            assert!((f64::from(beats) - wanted).abs() < 1e-5, "{beats} at {speed}, not {wanted}");
        }
    }

    #[test]
    fn what_is_right_behind_is_turned_to_by_the_side() {
        let pace = Pace { speeding: 0.1, turning: 0.05, most: 0.04, dt: 0.5 };
        let (after, angle) = turned(pace, Vec3::X, -Vec3::X);
        assert!((angle - core::f32::consts::PI).abs() < 1e-6);
        assert!((after.z - 0.04_f32.sin()).abs() < 1e-6 && after.y == 0.0, "{after}");
        assert_eq!(turned(pace, Vec3::Z, Vec3::Z), (Vec3::Z, 0.0));
    }
}
