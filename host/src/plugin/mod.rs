//! The host's side of the contract: finding, checking and loading libraries, calling them on threads of their own, and
//! taking over what they emit.

pub mod streams;
