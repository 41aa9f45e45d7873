//! What the tests of several models share.

pub mod species;
pub mod threads;
