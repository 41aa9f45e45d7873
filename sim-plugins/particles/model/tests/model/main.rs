//! What must hold for the particles, in one program: linking takes longer than most of it.

mod bad_input;
#[path = "../common/mod.rs"]
mod common;
mod drift;
mod groups;
mod levels;
mod repeatable;
