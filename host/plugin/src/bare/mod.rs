//! What only the conformance checker does to a plugin: reading its descriptors as they stand, calls that the
//! host itself never makes, memory that is taken away behind its back, watching what it calls, and what it
//! leaves in the process.
//!
//! Everything runs through the same guards, threads and services as in a sea.

pub mod calls;
pub mod imports;
pub mod pages;
pub mod process;
pub mod survey;
