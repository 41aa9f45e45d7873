//! The passes of a frame, one file each, in the order in which a frame runs them.

pub mod boulder;
pub mod contact;
pub mod gather;
pub mod lod;
pub mod noise;
pub mod sample;
pub mod tiles;
pub mod twin;
pub mod view;
pub mod water;
