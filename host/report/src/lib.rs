//! What the program says to people and to other programs: answers, errors, news, and why a command ended; and
//! what it hears from those that it starts.

pub mod diagnostic;
pub mod failure;
pub mod listen;
pub mod log;
pub mod plain;
pub mod say;
