//! What can go wrong between Reef and the graphics card, each with the way out where there is one.

use ash::vk;

use crate::failure::Failure;

/// Result of everything in [`crate::gpu`].
pub type Result<T> = std::result::Result<T, GpuError>;

/// A failure of Vulkan, its loader, its driver, or of how it was asked.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum GpuError {
    /// The loader (libvulkan) is not there.
    #[error("no Vulkan loader was found: {reason}")]
    #[diagnostic(code(reef::gpu::no_loader), help("{help}"))]
    NoLoader {
        /// What the dynamic linker said.
        reason: String,
        /// The command that installs it.
        help: String,
    },
    /// The loader is there, but it knows no driver.
    #[error("the Vulkan loader found no driver")]
    #[diagnostic(code(reef::gpu::no_driver), help("{help}"))]
    NoDriver {
        /// The command that installs one.
        help: String,
    },
    /// `--device` names none of the devices.
    #[error("no Vulkan device matches `{wanted}`")]
    #[diagnostic(code(reef::gpu::no_such_device), help("the devices are:\n{devices}"))]
    NoSuchDevice {
        /// What was asked for.
        wanted: String,
        /// One line a device.
        devices: String,
    },
    /// No device has what Reef needs.
    #[error("no Vulkan device can run Reef:\n{reasons}")]
    #[diagnostic(code(reef::gpu::unsuitable), help("{help}"))]
    Unsuitable {
        /// One line a device: what it lacks.
        reasons: String,
        /// The way out.
        help: String,
    },
    /// Validation was asked for and the layer is not installed.
    #[error("validation was asked for, but VK_LAYER_KHRONOS_validation is not loaded")]
    #[diagnostic(code(reef::gpu::no_layer), help("{help}"))]
    NoLayer {
        /// The command that installs it.
        help: String,
    },
    /// A call failed.
    #[error("{call} failed: {result}")]
    #[diagnostic(code(reef::gpu::call))]
    Vulkan {
        /// The function's name.
        call: &'static str,
        /// What it returned.
        result: vk::Result,
    },
    /// The device stopped answering.
    #[error("the graphics device was lost; it was running: {passes}")]
    #[diagnostic(
        code(reef::gpu::device_lost),
        help("a crashed or reset driver: see the system's log; `reef doctor` shows the devices")
    )]
    DeviceLost {
        /// The passes of the frame that did not end.
        passes: String,
    },
    /// Memory could not be had.
    #[error("no graphics memory for `{name}` ({bytes} bytes): {reason}")]
    #[diagnostic(code(reef::gpu::memory))]
    Memory {
        /// The resource's name.
        name: String,
        /// Its size.
        bytes: u64,
        /// What the allocator said.
        reason: String,
    },
    /// A shader that does not exist, or that is no usable SPIR-V.
    #[error("shader `{name}`: {reason}")]
    #[diagnostic(code(reef::gpu::shader))]
    Shader {
        /// The shader's file name in `shaders/`.
        name: String,
        /// Why not.
        reason: String,
    },
    /// A pass declared something that cannot be, or used what it did not declare.
    #[error("pass `{pass}`: {reason}")]
    #[diagnostic(code(reef::gpu::pass))]
    Pass {
        /// The pass's name.
        pass: String,
        /// Why not.
        reason: String,
    },
    /// A resource that cannot be made or used so.
    #[error("`{name}`: {reason}")]
    #[diagnostic(code(reef::gpu::resource))]
    Resource {
        /// The resource's name.
        name: String,
        /// Why not.
        reason: String,
    },
    /// The window system refuses.
    #[error("the window's surface cannot be drawn to: {reason}")]
    #[diagnostic(code(reef::gpu::surface))]
    Surface {
        /// Why not.
        reason: String,
    },
}

impl From<GpuError> for Failure {
    /// Everything here is the machine's doing, except a device that was named wrongly.
    fn from(error: GpuError) -> Self {
        match error {
            GpuError::NoSuchDevice { .. } => Failure::input(error),
            other => Failure::machine(other),
        }
    }
}

/// Names the Vulkan function whose result is looked at.
pub(crate) trait Call<T> {
    /// Turns a Vulkan result into ours.
    fn call(self, name: &'static str) -> Result<T>;
}

impl<T> Call<T> for ash::prelude::VkResult<T> {
    fn call(self, name: &'static str) -> Result<T> {
        self.map_err(|result| match result {
            vk::Result::ERROR_DEVICE_LOST => GpuError::DeviceLost { passes: format!("({name})") },
            result => GpuError::Vulkan { call: name, result },
        })
    }
}
