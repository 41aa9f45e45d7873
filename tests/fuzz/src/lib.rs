//! Inputs that nobody would write. [`mod@run`] changes what is in `corpus` at random ([`mutate`]) and gives
//! it to a [`targets::Target`]; [`ranges`] walks through all numbers of the schemas. An answer is fine, and
//! so is a sea that goes on with finite numbers; a panic, a module that fails or a refusal without a place is
//! a finding.
//!
//! The models are linked into the program, so a fault of theirs takes it down with the input kept in a file.

pub mod mutate;
pub mod random;
pub mod ranges;
pub mod run;
pub mod sea;
pub mod targets;
