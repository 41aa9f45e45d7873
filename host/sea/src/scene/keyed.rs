//! A value that is fixed, or changes along keyframes, as a scene file writes it.

use reef_flow::keyframe::{self, Animate, Track, TrackError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A fixed value, or keyframes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Keyed<T> {
    /// Always the same.
    Fixed(T),
    /// Changes with time.
    Keys(Keys<T>),
}

/// A value at several times, and what happens between them. Before the first key and after the last the value
/// stands.
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
    /// A curve without kinks that never swings past a key and rests before the first and after the last.
    #[default]
    Smooth,
}

impl<T: Default> Default for Keyed<T> {
    fn default() -> Self {
        Self::Fixed(T::default())
    }
}

impl<T: Animate> Keyed<T> {
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

    /// The curve through the keys.
    pub fn track(&self) -> Result<Track<T>, TrackError> {
        let keys = match self {
            Self::Fixed(value) => return Ok(Track::constant(*value)),
            Self::Keys(keys) => keys,
        };
        let list: Vec<_> =
            keys.keys.iter().map(|key| keyframe::Key { time: key.time, value: key.value }).collect();
        let length = list.last().map_or(0.0, |last| last.time - list[0].time);
        let track = Track::new(list, keys.interpolation.into())?;
        Ok(if keys.repeat { track.repeating(length) } else { track })
    }
}

impl From<Interpolation> for keyframe::Interpolation {
    fn from(interpolation: Interpolation) -> Self {
        match interpolation {
            Interpolation::Step => Self::Step,
            Interpolation::Linear => Self::Linear,
            Interpolation::Smooth => Self::Smooth,
        }
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
        for interpolation in [Step, Linear, Smooth] {
            let curve = keys(interpolation, false, &[(1.0, 2.0), (2.0, -1.0), (4.0, 5.0)]).track().unwrap();
            for (time, value) in [(0.0, 2.0), (1.0, 2.0), (2.0, -1.0), (4.0, 5.0), (9.0, 5.0)] {
                assert!((curve.at(time) - value).abs() < 1e-12, "{interpolation:?} at {time}");
            }
        }
    }

    #[test]
    fn a_repeated_curve_comes_round_after_its_last_key() {
        let curve = keys(Interpolation::Linear, true, &[(1.0, 0.0), (2.0, 4.0), (3.0, 0.0)]).track().unwrap();
        assert_eq!(curve.at(1.5), 2.0);
        assert_eq!(curve.at(1.5), curve.at(5.5));
    }

    #[test]
    fn keys_out_of_order_make_no_curve() {
        let wrong = keys(Interpolation::Step, false, &[(0.0, 1.0), (2.0, 1.0), (2.0, 1.0)]);
        assert_eq!(wrong.track().unwrap_err(), TrackError::Order { key: 2 });
    }
}
