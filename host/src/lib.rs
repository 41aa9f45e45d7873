//! Reef: a Vulkan-native sea that loads its simulation modules as dynamic libraries behind a stable C contract.
//!
//! The data flow, in the order of the modules: [`world`] reads a scene and steps the sea; [`plugin`] holds the host's
//! side of the contract; [`live`] lets both change while the sea runs; [`render`] turns two steps into a picture with what [`gpu`] offers; [`app`] is the window,
//! [`headless`] everything that needs none; [`cli`] is the door to both.

pub mod app;
pub mod cli;
pub mod headless;
