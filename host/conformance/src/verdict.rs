//! What a check finds.

use serde::{Deserialize, Serialize};

/// How a check ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Verdict {
    /// The rule is kept. Some: what was measured.
    Passed(Option<String>),
    /// The rule is broken: one sentence.
    Failed(String),
    /// There was nothing to check, and why.
    Skipped(String),
    /// No instance can be made with the configuration that was given, and why.
    Unconfigured(String),
}

impl Verdict {
    /// Why no instance can be made.
    pub(super) fn unconfigured(&self) -> Option<&str> {
        match self {
            Self::Unconfigured(why) => Some(why),
            _ => None,
        }
    }
}

/// Why a check did not pass.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Not {
    /// The rule is broken.
    Kept(String),
    /// There is nothing to check.
    There(String),
    /// The configuration does not do.
    Configured(String),
}

/// What a check's function returns: Some: what it measured.
pub(super) type Outcome = Result<Option<String>, Not>;

impl From<Outcome> for Verdict {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Ok(note) => Self::Passed(note),
            Err(Not::Kept(why)) => Self::Failed(why),
            Err(Not::There(why)) => Self::Skipped(why),
            Err(Not::Configured(why)) => Self::Unconfigured(why),
        }
    }
}

impl From<reef_plugin::PluginError> for Not {
    fn from(error: reef_plugin::PluginError) -> Self {
        Self::Kept(error.to_string())
    }
}

impl From<reef_plugin::Refusal> for Not {
    fn from(refusal: reef_plugin::Refusal) -> Self {
        Self::Kept(format!("the library {refusal}"))
    }
}

/// The rule is broken, in the words of `format!`.
macro_rules! broken {
    ($($words:tt)*) => { return Err($crate::verdict::Not::Kept(format!($($words)*))) };
}

/// Unless the condition holds, the rule is broken.
macro_rules! must {
    ($holds:expr, $($words:tt)*) => {
        let holds: bool = $holds;
        if !holds {
            return Err($crate::verdict::Not::Kept(format!($($words)*)));
        }
    };
}

pub(super) use {broken, must};
