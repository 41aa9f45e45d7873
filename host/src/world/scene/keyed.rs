//! A value that is fixed, or changes along keyframes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Most keyframes of one value.
pub const MOST_KEYS: usize = 10_000;

/// A fixed value, or keyframes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Keyed<T> {
    /// Always the same.
    Fixed(T),
    /// Changes with time.
    Keys(Keys<T>),
}

/// A value at several times, and what happens between them. Before the first key and after the last the value stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Keys<T> {
    /// The keyframes, in the order of time.
    #[schemars(length(min = 1, max = 10000))]
    pub keys: Vec<Key<T>>,
    /// What happens between two keys.
    #[serde(default)]
    pub interpolation: Interpolation,
    /// Begin again after the last key, whose value should be the first's.
    #[serde(default)]
    pub repeat: bool,
}

/// A value at a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Key<T> {
    /// When, from the scene's start.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub time: f64,
    /// What.
    pub value: T,
}

/// What happens between two keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Interpolation {
    /// The value jumps at each key.
    Step,
    /// Straight lines.
    Linear,
    /// Starts and stops softly at each key.
    #[default]
    Smooth,
    /// A smooth path that does not stop at the keys.
    Spline,
}

/// What can stand between two keys.
pub trait Blend: Copy {
    /// `a·x + b·y`, component by component.
    fn combine(a: f64, x: Self, b: f64, y: Self) -> Self;
}

impl Blend for f64 {
    fn combine(a: f64, x: Self, b: f64, y: Self) -> Self {
        a * x + b * y
    }
}

impl Blend for [f64; 3] {
    fn combine(a: f64, x: Self, b: f64, y: Self) -> Self {
        [0, 1, 2].map(|i| a * x[i] + b * y[i])
    }
}

impl<T: Default> Default for Keyed<T> {
    fn default() -> Self {
        Self::Fixed(T::default())
    }
}

impl<T: Blend> Keyed<T> {
    /// The value at a time [s].
    pub fn at(&self, time: f64) -> T {
        match self {
            Self::Fixed(value) => *value,
            Self::Keys(keys) => keys.at(time),
        }
    }

    /// The same with every value changed.
    pub fn map<U>(&self, change: impl Fn(T) -> U) -> Keyed<U> {
        match self {
            Self::Fixed(value) => Keyed::Fixed(change(*value)),
            Self::Keys(keys) => Keyed::Keys(Keys {
                keys: keys.keys.iter().map(|key| Key { time: key.time, value: change(key.value) }).collect(),
                interpolation: keys.interpolation,
                repeat: keys.repeat,
            }),
        }
    }

    /// All values that stand in the file.
    pub fn values(&self) -> impl Iterator<Item = T> + '_ {
        let (one, many) = match self {
            Self::Fixed(value) => (Some(*value), [].as_slice()),
            Self::Keys(keys) => (None, keys.keys.as_slice()),
        };
        one.into_iter().chain(many.iter().map(|key| key.value))
    }

    /// The index of the first key that is not after the one before it.
    pub fn first_out_of_order(&self) -> Option<usize> {
        match self {
            Self::Fixed(_) => None,
            Self::Keys(keys) => {
                keys.keys.windows(2).position(|pair| pair[1].time <= pair[0].time).map(|at| at + 1)
            }
        }
    }
}

impl<T: Blend> Keys<T> {
    fn at(&self, time: f64) -> T {
        let keys = &self.keys;
        let (first, last) = (&keys[0], &keys[keys.len() - 1]);
        let mut time = time;
        if self.repeat && last.time > first.time && time > first.time {
            time = first.time + (time - first.time) % (last.time - first.time);
        }
        if time <= first.time {
            return first.value;
        }
        if time >= last.time {
            return last.value;
        }
        // The last key at or before the time; the checks above leave one after it.
        let left = keys.partition_point(|key| key.time <= time) - 1;
        let (a, b) = (&keys[left], &keys[left + 1]);
        let span = b.time - a.time;
        let s = (time - a.time) / span;
        match self.interpolation {
            Interpolation::Step => a.value,
            Interpolation::Linear => T::combine(1.0 - s, a.value, s, b.value),
            Interpolation::Smooth => {
                let s = s * s * (3.0 - 2.0 * s);
                T::combine(1.0 - s, a.value, s, b.value)
            }
            Interpolation::Spline => {
                let (u, v) = (self.slope(left), self.slope(left + 1));
                let (s2, s3) = (s * s, s * s * s);
                let points = T::combine(2.0 * s3 - 3.0 * s2 + 1.0, a.value, 3.0 * s2 - 2.0 * s3, b.value);
                let slopes = T::combine((s3 - 2.0 * s2 + s) * span, u, (s3 - s2) * span, v);
                T::combine(1.0, points, 1.0, slopes)
            }
        }
    }

    /// Slope of the spline at a key: the parabola through the key and its neighbours; at the ends of a path that does not
    /// repeat, the straight line to the neighbour.
    fn slope(&self, at: usize) -> T {
        let keys = &self.keys;
        let last = keys.len() - 1;
        let length = keys[last].time - keys[0].time;
        let line = |from: &Key<T>, to: &Key<T>, dt: f64| T::combine(1.0 / dt, to.value, -1.0 / dt, from.value);
        let (before, after) = match (at, self.repeat && last > 1) {
            (0, true) => ((&keys[last - 1], keys[last - 1].time - length), (&keys[1], keys[1].time)),
            (at, true) if at == last => ((&keys[last - 1], keys[last - 1].time), (&keys[1], keys[1].time + length)),
            (0, false) => return line(&keys[0], &keys[1], keys[1].time - keys[0].time),
            (at, false) if at == last => {
                return line(&keys[last - 1], &keys[last], keys[last].time - keys[last - 1].time);
            }
            (at, _) => ((&keys[at - 1], keys[at - 1].time), (&keys[at + 1], keys[at + 1].time)),
        };
        let (left, right) = (keys[at].time - before.1, after.1 - keys[at].time);
        let (down, up) = (line(before.0, &keys[at], left), line(&keys[at], after.0, right));
        T::combine(right / (left + right), down, left / (left + right), up)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(interpolation: Interpolation, repeat: bool, pairs: &[(f64, f64)]) -> Keyed<f64> {
        let keys = pairs.iter().map(|&(time, value)| Key { time, value }).collect();
        Keyed::Keys(Keys { keys, interpolation, repeat })
    }

    #[test]
    fn every_interpolation_meets_its_keys_and_stands_outside_them() {
        use Interpolation::*;
        for interpolation in [Step, Linear, Smooth, Spline] {
            let curve = keys(interpolation, false, &[(1.0, 2.0), (2.0, -1.0), (4.0, 5.0)]);
            for (time, value) in [(0.0, 2.0), (1.0, 2.0), (2.0, -1.0), (4.0, 5.0), (9.0, 5.0)] {
                assert!((curve.at(time) - value).abs() < 1e-12, "{interpolation:?} at {time}");
            }
        }
    }

    #[test]
    fn a_spline_does_not_stop_at_a_key_and_does_not_break_there() {
        let curve = keys(Interpolation::Spline, false, &[(0.0, 0.0), (1.0, 1.0), (3.0, 3.0)]);
        for time in [0.3, 1.0, 1.7, 2.9] {
            assert!((curve.at(time) - time).abs() < 1e-12, "a line stays a line at {time}");
        }
        let bent = keys(Interpolation::Spline, true, &[(0.0, 0.0), (1.0, 2.0), (2.5, -1.0), (4.0, 0.0)]);
        for key in [1.0, 2.5, 4.0] {
            let h = 1e-5;
            let (left, right) = ((bent.at(key) - bent.at(key - h)) / h, (bent.at(key + h) - bent.at(key)) / h);
            // The curve's second derivative is below 20 here: one-sided slopes differ by less than 20 h.
            assert!((left - right).abs() < 20.0 * h, "kink at {key}: {left} and {right}");
        }
    }

    #[test]
    fn a_repeated_curve_comes_round() {
        let curve = keys(Interpolation::Linear, true, &[(1.0, 0.0), (2.0, 4.0), (3.0, 0.0)]);
        assert_eq!(curve.at(1.5), curve.at(5.5));
        assert_eq!(curve.at(0.0), 0.0);
    }

    #[test]
    fn keys_out_of_order_are_found() {
        assert_eq!(keys(Interpolation::Step, false, &[(0.0, 1.0), (2.0, 1.0), (2.0, 1.0)]).first_out_of_order(), Some(2));
        assert_eq!(keys(Interpolation::Step, false, &[(0.0, 1.0), (2.0, 1.0)]).first_out_of_order(), None);
    }
}
