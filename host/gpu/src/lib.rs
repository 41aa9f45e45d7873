//! Vulkan: device, swapchain, memory, frames in flight, pipelines, barriers. Nothing of the sea.
//!
//! A frame from top to bottom:
//!
//! 1. [`Frames::begin`] waits for the frame that used the same place before, and gives a [`Frame`];
//! 2. [`Frame::upload`] takes what changes every frame;
//! 3. [`Frame::pass`] declares what a pass reads and writes, and records it: [`graph`] derives the barriers;
//! 4. [`Frame::submit`] gives it to the device.
//!
//! What is dropped meanwhile is destroyed when no frame uses it any more; what is left when the context is
//! closed is reported as leaked, to the [`Canary`] like every message of the validation layers.

pub mod access;
pub mod advice;
pub mod barriers;
mod buffer;
mod canary;
mod commands;
#[cfg(feature = "shaderc")]
mod compile;
mod context;
mod data;
mod device;
mod embedded;
mod error;
mod fault;
mod frames;
mod garbage;
pub mod graph;
mod heap;
mod image;
mod instance;
mod machine;
mod offscreen;
pub mod packages;
mod pipeline_cache;
mod pipelines;
mod record;
mod reflect;
#[cfg(feature = "shaderc")]
mod reload;
mod ring;
mod samplers;
pub mod self_test;
pub mod shader_sources;
mod shaders;
mod swapchain;
mod timestamps;
mod transfer;

#[cfg(test)]
mod branch_tests;
#[cfg(test)]
mod device_tests;
#[cfg(test)]
mod swapchain_tests;

pub use access::Access;
pub use buffer::{Buffer, BufferDesc, Memory, TEXEL_BYTES};
pub use canary::{Canary, Message, SUPPRESSIONS, Suppression};
pub use commands::Cmd;
#[cfg(feature = "shaderc")]
pub use compile::Compiler;
pub use context::{Gpu, GpuOptions};
pub use data::{Data, Resource};
pub use device::{DeviceInfo, Optional};
pub use error::{GpuError, Result};
pub use fault::{Fault, VARIABLE as FAULT_VARIABLE};
pub use frames::{Frame, Frames, Signals};
pub use graph::{DepthLoad, Load, Pass, Touched};
pub use image::{Image, ImageDesc};
pub use instance::{Layer, Surface, Validation};
pub use machine::{Machine, inspect_machine};
pub use offscreen::{Picture, Readback};
pub use pipelines::{Blend, DepthDesc, GraphicsDesc, Pipeline, VertexDesc};
pub use record::{Layout, Member, Record, ShaderRecord, shader_records, size_of_member};
#[cfg(feature = "shaderc")]
pub use reload::ShaderWatch;
pub use ring::Upload;
pub use samplers::SamplerDesc;
pub use shaders::{ShaderFailure, ShaderStore};
pub use swapchain::{Acquired, Swapchain};
pub use timestamps::{PassTime, Timings};
