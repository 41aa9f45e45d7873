//! What a sea that changes while it runs has to say of that.

use std::time::Instant;

/// How grave a piece of news is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gravity {
    /// For information.
    Info,
    /// A build or a scene was refused, or a module stands still.
    Trouble,
}

/// Something that people should know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice {
    /// How grave.
    pub gravity: Gravity,
    /// The sea's step.
    pub step: u64,
    /// In words.
    pub text: String,
}

/// What [`super::Live::tend`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tended {
    /// Instances took others' places: the next step is theirs.
    pub swapped: bool,
    /// An edited scene was taken up: what was read from the world may be different now.
    pub edited: bool,
}

/// What has happened so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Newer builds that were taken.
    pub reloads: u64,
    /// Builds that were refused.
    pub refusals: u64,
    /// Older builds that took over.
    pub takeovers: u64,
    /// Edited scenes that were taken up.
    pub scenes: u64,
}

/// When a newer build came.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// It was seen to be whole.
    pub seen: Instant,
    /// It was loaded.
    pub loaded: Instant,
    /// Its instances took the others' places.
    pub taken: Instant,
}
