//! Keyframes: what a scene moves by itself (Aliaga & Larboulette 2009, §5.2) — a singularity's position, its
//! intensity (whose sign may change, figure 15), its axis, a camera. Time is f64 seconds.

/// A value that keys can hold: some numbers, each of which moves by itself.
pub trait Animate: Copy {
    /// The value whose every component is `f` of the same component of four values.
    fn combine(values: [Self; 4], f: impl Fn([f64; 4]) -> f64) -> Self;
}

impl Animate for f64 {
    fn combine(values: [Self; 4], f: impl Fn([f64; 4]) -> f64) -> Self {
        f(values)
    }
}

impl<const N: usize> Animate for [f64; N] {
    fn combine(values: [Self; 4], f: impl Fn([f64; 4]) -> f64) -> Self {
        core::array::from_fn(|i| f(values.map(|value| value[i])))
    }
}

/// How a track passes from one key to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Stays at a key until the next.
    Step,
    /// Straight lines.
    #[default]
    Linear,
    /// Cubic without a kink, the track's rest before the first and after the last key included. Between two
    /// keys every component stays between their values: nothing swings past a key (Steffen 1990).
    Smooth,
}

/// A value at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key<T> {
    /// [s]
    pub time: f64,
    /// What the track is worth then.
    pub value: T,
}

/// Why keys make no track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TrackError {
    /// A track needs one key at least.
    Empty,
    /// This key's time is not finite, or not after the key before it.
    Order {
        /// Number of the key, from 0.
        key: usize,
    },
}

impl core::fmt::Display for TrackError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Empty => write!(f, "a track needs at least one key"),
            Self::Order { key } => {
                write!(f, "key {key}: its time must be finite and later than that of the key before it")
            }
        }
    }
}

impl std::error::Error for TrackError {}

/// Keys in order of time. Before the first and after the last the track stands still; or it starts anew after
/// [`Track::repeating`]'s period.
#[derive(Clone, Debug, PartialEq)]
pub struct Track<T> {
    keys: Vec<Key<T>>,
    interpolation: Interpolation,
    period: Option<f64>,
}

impl<T: Animate> Track<T> {
    /// The same for ever.
    pub fn constant(value: T) -> Self {
        Self { keys: vec![Key { time: 0.0, value }], interpolation: Interpolation::Step, period: None }
    }

    /// A track through keys whose times grow.
    pub fn new(keys: Vec<Key<T>>, interpolation: Interpolation) -> Result<Self, TrackError> {
        if keys.is_empty() {
            return Err(TrackError::Empty);
        }
        for (i, key) in keys.iter().enumerate() {
            if !key.time.is_finite() || (i > 0 && key.time <= keys[i - 1].time) {
                return Err(TrackError::Order { key: i });
            }
        }
        Ok(Self { keys, interpolation, period: None })
    }

    /// Starts anew every `period` seconds, counted from the first key. A period that is not a positive number
    /// is none.
    #[must_use]
    pub fn repeating(mut self, period: f64) -> Self {
        self.period = (period.is_finite() && period > 0.0).then_some(period);
        self
    }

    /// The keys.
    pub fn keys(&self) -> &[Key<T>] {
        &self.keys
    }

    /// Whether the track never changes.
    pub fn is_constant(&self) -> bool {
        self.keys.len() == 1
    }

    /// What the track is worth at a time [s].
    pub fn at(&self, time: f64) -> T {
        let first = self.keys[0];
        let time = match self.period {
            Some(period) => first.time + (time - first.time).rem_euclid(period),
            None => time,
        };
        // The first key that is later.
        let next = self.keys.partition_point(|key| key.time <= time);
        if next == 0 {
            return first.value;
        }
        let from = self.keys[next - 1];
        let Some(&to) = self.keys.get(next) else { return from.value };
        let t = (time - from.time) / (to.time - from.time);
        match self.interpolation {
            Interpolation::Step => from.value,
            Interpolation::Linear => {
                T::combine([from.value, to.value, to.value, to.value], |[a, b, ..]| a * (1.0 - t) + b * t)
            }
            Interpolation::Smooth => self.smooth(next - 1, t),
        }
    }
    /// Between keys `i` and `i + 1`, at the share `t` of the way.
    fn smooth(&self, i: usize, t: f64) -> T {
        let keys = &self.keys;
        let (from, to) = (keys[i], keys[i + 1]);
        // Beyond the ends the track stands still: a neighbour of equal value makes the slope there zero.
        let before = if i > 0 { keys[i - 1] } else { Key { time: from.time - 1.0, value: from.value } };
        let after = keys.get(i + 2).copied().unwrap_or(Key { time: to.time + 1.0, value: to.value });
        let (h0, h1, h2) = (from.time - before.time, to.time - from.time, after.time - to.time);
        T::combine([before.value, from.value, to.value, after.value], |[a, b, c, d]| {
            let slopes = [(b - a) / h0, (c - b) / h1, (d - c) / h2];
            let m0 = steffen(slopes[0], slopes[1], h0, h1) * h1;
            let m1 = steffen(slopes[1], slopes[2], h1, h2) * h1;
            // Hermite's form around the nearer key, so that both keys are met exactly.
            let s = 1.0 - t;
            b * (s * s * (1.0 + 2.0 * t)) + c * (t * t * (1.0 + 2.0 * s)) + m0 * (t * s * s)
                - m1 * (t * t * s)
        })
    }
}

/// Slope at a key between two intervals of slopes `s0`, `s1` and lengths `h0`, `h1`: that of the parabola
/// through the three keys, no steeper than keeps both intervals monotone; zero at an extreme.
fn steffen(s0: f64, s1: f64, h0: f64, h1: f64) -> f64 {
    if s0 * s1 <= 0.0 {
        return 0.0;
    }
    let parabola = (s0 * h1 + s1 * h0) / (h0 + h1);
    let steepest = 2.0 * s0.abs().min(s1.abs());
    parabola.abs().min(steepest).copysign(s0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn track(keys: &[(f64, f64)], interpolation: Interpolation) -> Track<f64> {
        let keys = keys.iter().map(|&(time, value)| Key { time, value }).collect();
        Track::new(keys, interpolation).expect("keys in order")
    }

    const KEYS: [(f64, f64); 5] = [(-1.0, 2.0), (0.5, 3.0), (1.0, -4.0), (3.0, -4.0), (10.0, 0.25)];

    #[test]
    fn every_interpolation_meets_its_keys_exactly_and_rests_outside_of_them() {
        for interpolation in [Interpolation::Step, Interpolation::Linear, Interpolation::Smooth] {
            let track = track(&KEYS, interpolation);
            for (time, value) in KEYS {
                assert_eq!(track.at(time), value, "{interpolation:?} at {time}");
            }
            assert_eq!(track.at(-100.0), 2.0);
            assert_eq!(track.at(100.0), 0.25);
        }
    }

    #[test]
    fn a_step_waits_for_its_key_and_a_line_is_straight() {
        assert_eq!(track(&KEYS, Interpolation::Step).at(0.999), 3.0);
        assert_eq!(track(&KEYS, Interpolation::Linear).at(0.75), -0.5);
        assert_eq!(track(&KEYS, Interpolation::Linear).at(2.0), -4.0);
    }

    #[test]
    fn a_smooth_track_has_no_kink() {
        let track = track(&KEYS, Interpolation::Smooth);
        let h = 1e-6;
        for i in -2000..12_000 {
            let time = f64::from(i) * 1e-3;
            let (left, right) =
                ((track.at(time) - track.at(time - h)) / h, (track.at(time + h) - track.at(time)) / h);
            // The slope itself changes by at most its steepest rate, 7/0.5² · 6 per second, over 2e-6 s.
            assert!((left - right).abs() < 4e-4, "at {time}: {left} {right}");
        }
    }

    #[test]
    fn an_intensity_keyed_from_source_to_hole_changes_sign_once() {
        let track = track(&[(0.0, 10_000.0), (4.0, -10_000.0)], Interpolation::Smooth);
        let values: Vec<f64> = (0..=400).map(|i| track.at(f64::from(i) * 0.01)).collect();
        assert_eq!(values.windows(2).filter(|w| w[0] > 0.0 && w[1] <= 0.0).count(), 1);
        assert!(values.windows(2).all(|w| w[1] <= w[0]));
    }

    #[test]
    fn a_repeating_track_starts_anew() {
        let track = track(&[(1.0, 0.0), (2.0, 1.0)], Interpolation::Linear).repeating(4.0);
        assert_eq!(track.at(1.25), 0.25);
        assert_eq!(track.at(1.25 + 4.0 * 1e6), 0.25);
        assert_eq!(track.at(0.5), 1.0);
        assert_eq!(track.clone().repeating(f64::NAN).at(0.5), 0.0);
    }

    #[test]
    fn keys_out_of_order_are_refused_by_their_number() {
        let key = |time| Key { time, value: 0.0 };
        assert_eq!(Track::<f64>::new(vec![], Interpolation::Linear), Err(TrackError::Empty));
        let twice = vec![key(0.0), key(1.0), key(1.0)];
        assert_eq!(Track::new(twice, Interpolation::Linear), Err(TrackError::Order { key: 2 }));
        assert_eq!(Track::new(vec![key(f64::NAN)], Interpolation::Step), Err(TrackError::Order { key: 0 }));
    }

    proptest! {
        #[test]
        fn a_smooth_track_stays_between_neighbouring_keys(
            gaps in prop::collection::vec((0.01..5.0_f64, -10.0..10.0_f64), 2..8), share in 0.0..1.0_f64
        ) {
            let mut time = 0.0;
            let keys: Vec<Key<[f64; 1]>> = gaps.iter().map(|&(gap, value)| {
                time += gap;
                Key { time, value: [value] }
            }).collect();
            let track = Track::new(keys.clone(), Interpolation::Smooth).expect("in order");
            for pair in keys.windows(2) {
                let [value] = track.at(pair[0].time + share * (pair[1].time - pair[0].time));
                let (low, high) = (pair[0].value[0].min(pair[1].value[0]), pair[0].value[0].max(pair[1].value[0]));
                // Rounding of values up to 10.
                prop_assert!(value >= low - 1e-14 && value <= high + 1e-14);
            }
        }
    }
}
