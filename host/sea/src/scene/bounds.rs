//! The numbers that a schema allows: in metres, in a scene's own unit of length, and in words.

use serde_json::Value as Json;

use super::unit::{from_metres, to_metres};

/// The numbers that a schema allows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Allowed and everything above.
    pub minimum: Option<f64>,
    /// Allowed and everything below.
    pub maximum: Option<f64>,
    /// Everything above is allowed, this is not.
    pub above: Option<f64>,
    /// Everything below is allowed, this is not.
    pub below: Option<f64>,
}

impl Bounds {
    /// The bounds that a schema names; None where it names none.
    pub fn of(schema: &Json) -> Option<Self> {
        let number = |key: &str| schema.get(key).and_then(Json::as_f64);
        let format = match schema.get("format").and_then(Json::as_str) {
            Some("uint32") => Some(f64::from(u32::MAX)),
            Some("uint16") => Some(f64::from(u16::MAX)),
            Some("int32") => Some(f64::from(i32::MAX)),
            _ => None,
        };
        let bounds = Self {
            minimum: number("minimum"),
            maximum: number("maximum").or(format),
            above: number("exclusiveMinimum"),
            below: number("exclusiveMaximum"),
        };
        (bounds != Self::default()).then_some(bounds)
    }

    /// The same bounds for numbers in units of `scale` metres, of a unit that goes with the length by
    /// `power`.
    pub fn from_metres(&self, power: i32, scale: f64) -> Self {
        let own = |bound: Option<f64>| bound.map(|bound| from_metres(bound, power, scale));
        Self {
            minimum: own(self.minimum),
            maximum: own(self.maximum),
            above: own(self.above),
            below: own(self.below),
        }
    }

    /// The nearest value between minimum and maximum.
    pub fn nearest(&self, value: f64) -> f64 {
        let value = self.minimum.map_or(value, |bound| value.max(bound));
        self.maximum.map_or(value, |bound| value.min(bound))
    }

    /// Whether they allow a value.
    pub fn contain(&self, value: f64) -> bool {
        self.minimum.is_none_or(|bound| value >= bound)
            && self.maximum.is_none_or(|bound| value <= bound)
            && self.above.is_none_or(|bound| value > bound)
            && self.below.is_none_or(|bound| value < bound)
    }

    /// Whether they, in metres, allow a number in units of `scale` metres: rounding refuses nothing that
    /// their words allow.
    pub fn allow(&self, value: f64, power: i32, scale: f64) -> bool {
        self.contain(to_metres(value, power, scale)) || self.from_metres(power, scale).contain(value)
    }

    /// "from 0 to 1", "above 0", "at most 5".
    pub fn words(&self) -> String {
        match (self.minimum, self.maximum, self.above, self.below) {
            (Some(low), Some(high), None, None) => format!("from {low} to {high}"),
            (low, high, above, below) => {
                let mut parts = Vec::new();
                parts.extend(low.map(|bound| format!("at least {bound}")));
                parts.extend(above.map(|bound| format!("above {bound}")));
                parts.extend(high.map(|bound| format!("at most {bound}")));
                parts.extend(below.map(|bound| format!("below {bound}")));
                parts.join(" and ")
            }
        }
    }
}
