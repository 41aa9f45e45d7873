//! What all commands share: the options that every one understands, and the way from these to plugins, a
//! scene and its sea.

mod common;
pub mod open;

pub use common::{Common, Past, REMEMBER};
