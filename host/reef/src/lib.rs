//! Reef: a Vulkan-native sea that loads its simulation modules as dynamic libraries behind a stable C
//! contract.
//!
//! The program: [`cli`] is the door, [`app`] the window, [`headless`] everything that needs none. What they
//! stand on are crates of their own: `reef_sea` reads a scene and steps the sea, `reef_plugin` holds the
//! host's side of the contract, `reef_render` turns two steps into a picture with what `reef_gpu` offers.

pub mod app;
pub mod cli;
pub mod headless;
