//! What only the conformance checker does to a plugin: reading its descriptors as they stand, calls that the host itself
//! never makes, memory that is taken away behind its back, watching what it calls, and what it leaves in the process.
//!
//! Everything runs through the same guards, threads and services as in a sea.

pub(crate) mod calls;
pub(crate) mod imports;
pub(crate) mod pages;
pub(crate) mod process;
pub(crate) mod survey;
