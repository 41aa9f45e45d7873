//! What the program says to people and to other programs: answers, errors, news, and why a command ended.

pub mod diagnostic;
pub mod failure;
pub mod listen;
pub mod log;
pub mod plain;
pub mod say;
