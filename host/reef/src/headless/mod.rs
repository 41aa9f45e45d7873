//! Everything that needs no window.

pub mod compare;
mod container;
pub mod doctor;
mod film;
mod jumps;
pub mod moments;
pub mod plugins;
pub mod render;
pub mod report;
pub mod scaffold;
pub mod scenes;
pub mod shaders;
pub mod show;
pub mod sim;
mod sink;
pub mod subjects;
pub mod validate;
pub mod watch;
