//! Collision-based spiral phyllotaxis (Fowler, Prusinkiewicz and Battjes 1992), as the paper uses it in §3.1.

use std::f64::consts::PI;

use crate::math;

/// Angle between one tentacle and the next [rad]: 137.50776°.
pub const GOLDEN_ANGLE: f64 = 137.507_76 * PI / 180.0;

/// Where one tentacle stands on the disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seat {
    /// n: the tentacle's number, which gives its angle n · [`GOLDEN_ANGLE`].
    pub number: u32,
    /// Distance of its centre from the plant's axis [m].
    pub distance: f64,
    /// Its angle about the axis [rad], not reduced.
    pub angle: f64,
    /// Radius of its base [m].
    pub radius: f64,
}

impl Seat {
    /// Its centre in the disc's plane [m].
    pub fn center(&self) -> [f64; 2] {
        let (s, c) = math::sin_cos(self.angle);
        [self.distance * c, self.distance * s]
    }
}

/// Seats up to `count` tentacles between the mouth and the rim: number n at its angle, as close to the mouth
/// as its base `radius(n)` [m] allows without touching an earlier one. No two ever overlap. A number that
/// finds no room is left out; when as many in a row as the whole plant wanted were left out (at least 24),
/// the disc is full, and fewer come back.
pub fn seats(count: u32, mouth: f64, rim: f64, radius: impl Fn(u32) -> f64) -> Vec<Seat> {
    let mut seats: Vec<Seat> = Vec::with_capacity(count as usize);
    let mut blocked: Vec<[f64; 2]> = Vec::new();
    let mut failures = 0;
    let mut number = 0;
    while seats.len() < count as usize && failures < count.max(24) {
        let seat = seat_of(number, mouth, rim, radius(number), &seats, &mut blocked);
        match seat {
            Some(seat) => {
                seats.push(seat);
                failures = 0;
            }
            None => failures += 1,
        }
        number += 1;
    }
    seats
}

/// The nearest free distance along the ray of one number.
fn seat_of(
    number: u32,
    mouth: f64,
    rim: f64,
    radius: f64,
    seats: &[Seat],
    blocked: &mut Vec<[f64; 2]>,
) -> Option<Seat> {
    let angle = f64::from(number) * GOLDEN_ANGLE;
    blocked.clear();
    for earlier in seats {
        let (s, c) = math::sin_cos(angle - earlier.angle);
        let (along, off) = (earlier.distance * c, earlier.distance * s);
        let reach = earlier.radius + radius;
        let inside = reach * reach - off * off;
        if inside > 0.0 {
            let half = inside.sqrt();
            if along + half > 0.0 {
                blocked.push([along - half, along + half]);
            }
        }
    }
    blocked.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut distance = mouth + radius;
    for [from, to] in blocked.iter() {
        if *to > distance {
            if *from >= distance {
                break;
            }
            // A hair outside, so that rounding never makes two bases overlap.
            distance = to * (1.0 + 1e-12);
        }
    }
    (distance + radius <= rim).then_some(Seat { number, distance, angle, radius })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn overlap(seats: &[Seat]) -> f64 {
        let mut worst = f64::NEG_INFINITY;
        for (i, a) in seats.iter().enumerate() {
            for b in &seats[..i] {
                let ([ax, ay], [bx, by]) = (a.center(), b.center());
                let distance = ((ax - bx) * (ax - bx) + (ay - by) * (ay - by)).sqrt();
                worst = worst.max((a.radius + b.radius - distance) / (a.radius + b.radius));
            }
        }
        worst
    }

    proptest! {
        #[test]
        fn bases_never_overlap_and_stay_between_mouth_and_rim(
            count in 1_u32..200,
            mouth in 0.0_f64..0.03,
            ring in 0.005_f64..0.1,
            base in 0.001_f64..0.008,
            spread in 0.0_f64..0.5,
        ) {
            let rim = mouth + ring;
            let seats = seats(count, mouth, rim, |n| base * (1.0 + spread * f64::from(n % 7) / 7.0));
            prop_assert!(seats.len() <= count as usize);
            // The centres come from sine and cosine: 1e-9 of a radius covers their rounding.
            prop_assert!(overlap(&seats) <= 1e-9, "{}", overlap(&seats));
            for seat in &seats {
                prop_assert!(seat.distance >= mouth + seat.radius - 1e-15);
                prop_assert!(seat.distance + seat.radius <= rim);
                prop_assert_eq!(seat.angle, f64::from(seat.number) * GOLDEN_ANGLE);
            }
        }
    }

    #[test]
    fn each_tentacle_stands_as_close_to_the_mouth_as_the_earlier_ones_allow() {
        let seats = seats(60, 0.01, 0.08, |_| 0.004);
        assert_eq!(seats.len(), 60);
        assert!((seats[0].distance - 0.014).abs() < 1e-15, "the first touches the mouth");
        for (i, seat) in seats.iter().enumerate() {
            // A hundredth of a radius nearer it would touch the mouth or an earlier one.
            let nearer = Seat { distance: seat.distance - 0.01 * seat.radius, ..*seat };
            let mut pushed = seats[..i].to_vec();
            pushed.push(nearer);
            assert!(nearer.distance < 0.014 || overlap(&pushed) > 0.0, "tentacle {i} had room");
        }
    }

    #[test]
    fn a_full_disc_gives_fewer_tentacles_than_wanted() {
        let seats = seats(500, 0.005, 0.03, |_| 0.003);
        assert!(seats.len() < 120 && seats.len() > 40, "{}", seats.len());
        assert!(overlap(&seats) <= 1e-9);
    }

    #[test]
    fn a_disc_without_room_gives_none() {
        assert!(seats(10, 0.02, 0.021, |_| 0.003).is_empty());
    }
}
