//! What can go wrong between Reef and the graphics card, each with the way out where there is one.

use ash::vk;
use reef_report::failure::Failure;

/// Result of everything in [`crate`].
pub type Result<T> = std::result::Result<T, GpuError>;

/// A failure of Vulkan, its loader, its driver, or of how it was asked.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// The loader (libvulkan) is not there.
    #[error("no Vulkan loader was found: {reason}")]
    NoLoader {
        /// What the dynamic linker said.
        reason: String,
        /// The command that installs it.
        help: String,
    },
    /// The loader is there, but it knows no driver.
    #[error("the Vulkan loader found no driver")]
    NoDriver {
        /// The command that installs one.
        help: String,
    },
    /// `--device` names none of the devices.
    #[error("no Vulkan device matches `{wanted}`")]
    NoSuchDevice {
        /// What was asked for.
        wanted: String,
        /// One line a device.
        devices: String,
    },
    /// No device has what Reef needs.
    #[error("no Vulkan device can run Reef:\n{reasons}")]
    Unsuitable {
        /// One line a device: what it lacks.
        reasons: String,
        /// The way out.
        help: String,
    },
    /// Validation was asked for and the layer is not installed.
    #[error("validation was asked for, but VK_LAYER_KHRONOS_validation is not loaded")]
    NoLayer {
        /// The command that installs it.
        help: String,
    },
    /// A call failed.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// The function's name.
        call: &'static str,
        /// What it returned.
        result: vk::Result,
    },
    /// The device stopped answering.
    #[error("the graphics device was lost; it was running: {passes}")]
    DeviceLost {
        /// The passes of the frame that did not end.
        passes: String,
    },
    /// Memory could not be had.
    #[error("no graphics memory for `{name}` ({bytes} bytes): {reason}")]
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
    Shader {
        /// The shader's file name in `shaders/`.
        name: String,
        /// Why not.
        reason: String,
    },
    /// A pass declared something that cannot be, or used what it did not declare.
    #[error("pass `{pass}`: {reason}")]
    Pass {
        /// The pass's name.
        pass: String,
        /// Why not.
        reason: String,
    },
    /// A resource that cannot be made or used so.
    #[error("`{name}`: {reason}")]
    Resource {
        /// The resource's name.
        name: String,
        /// Why not.
        reason: String,
    },
    /// The window system refuses.
    #[error("the window's surface cannot be drawn to: {reason}")]
    Surface {
        /// Why not.
        reason: String,
    },
}

impl miette::Diagnostic for GpuError {
    fn help<'a>(&'a self) -> Option<Box<dyn std::fmt::Display + 'a>> {
        match self {
            Self::NoLoader { help, .. }
            | Self::NoDriver { help }
            | Self::Unsuitable { help, .. }
            | Self::NoLayer { help } => Some(Box::new(help)),
            Self::NoSuchDevice { devices, .. } => Some(Box::new(format!("the devices are:\n{devices}"))),
            Self::DeviceLost { .. } => Some(Box::new(
                "a crashed or reset driver: see the system's log; `reef doctor` shows the devices",
            )),
            _ => None,
        }
    }
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
