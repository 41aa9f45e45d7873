//! A plugin's parameter as a scene's file sets it.

use reef_plugin::{ParamInfo, ParamKind};

use super::{
    bounds::Bounds,
    document::{Node, Value},
    unit::{Unit, suffix, to_metres},
};

/// A parameter in a scene whose lengths are in units of `scale` metres.
#[derive(Clone, Copy)]
pub(super) struct Param<'a> {
    pub(super) info: &'a ParamInfo,
    pub(super) scale: f64,
}

impl Param<'_> {
    /// The number that the contract has for a value of the file; `Err`: what would be allowed.
    pub(super) fn value_of(self, node: &Node) -> Result<f64, String> {
        let value = match (self.info.kind, &node.value) {
            (ParamKind::Float, Value::Float(value)) => Some(*value),
            (ParamKind::Float | ParamKind::Int, Value::Integer(value)) => Some(*value as f64),
            (ParamKind::Switch, Value::Bool(value)) => Some(f64::from(u8::from(*value))),
            (ParamKind::Choice, Value::String(text)) => {
                self.info.choices.iter().position(|name| name == text).map(|at| at as f64)
            }
            _ => None,
        };
        let inside = |value: &f64| self.bounds().allow(*value, self.power(), self.scale);
        let value = value.filter(inside).map(|value| self.in_metres(value));
        value.ok_or_else(|| format!("is {}, but must be {}", node.to_json(), self.words()))
    }

    /// Number and value of its default, as near as the range allows; None where the plugin's own is just
    /// that.
    pub(super) fn scaled_default(self) -> Option<(u32, f64)> {
        let value = self.in_metres(self.info.default);
        (self.power() != 0 && value != self.info.default).then_some((self.info.id, value))
    }

    /// A value in metres, within the range.
    fn in_metres(self, value: f64) -> f64 {
        let metres = self.bounds().nearest(to_metres(value, self.power(), self.scale));
        if self.info.kind == ParamKind::Int { metres.round() } else { metres }
    }

    /// The power by which its unit goes with the length.
    fn power(self) -> i32 {
        Unit::read(&self.info.unit).power
    }

    fn bounds(self) -> Bounds {
        match self.info.kind {
            ParamKind::Float | ParamKind::Int => Bounds {
                minimum: Some(self.info.minimum),
                maximum: Some(self.info.maximum),
                ..Bounds::default()
            },
            ParamKind::Switch | ParamKind::Choice => Bounds::default(),
        }
    }

    /// What it takes, in words.
    fn words(self) -> String {
        let range = self.bounds().from_metres(self.power(), self.scale).words();
        let unit = suffix(&self.info.unit, self.scale);
        match self.info.kind {
            ParamKind::Float => format!("a number {range}{unit}"),
            ParamKind::Int => format!("a whole number {range}{unit}"),
            ParamKind::Switch => "true or false".to_owned(),
            ParamKind::Choice => format!("one of {}", self.info.choices.join(", ")),
        }
    }
}
