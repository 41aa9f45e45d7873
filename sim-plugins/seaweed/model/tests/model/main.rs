//! What must hold of the model, by properties and closed forms.

#[path = "../common/mod.rs"]
mod common;

mod equations;
mod motion;
