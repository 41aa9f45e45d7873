//! What this machine has of Vulkan, as far as one gets without drawing.

use ash::vk;

use super::{
    device::{self, DeviceInfo},
    error::Result,
    instance::{self, Instance, Layer, Validation, version_text},
};

/// What was found.
#[derive(Debug)]
pub struct Machine {
    /// The loader's Vulkan version.
    pub loader: Result<String>,
    /// Its layers.
    pub layers: Vec<Layer>,
    /// Its devices, also those that cannot run Reef.
    pub devices: Result<Vec<DeviceInfo>>,
}

/// Looks at loader, layers and devices.
pub fn inspect_machine() -> Machine {
    let entry = match instance::load() {
        Ok(entry) => entry,
        Err(error) => return Machine { loader: Err(error), layers: Vec::new(), devices: Ok(Vec::new()) },
    };
    // SAFETY: no preconditions.
    let version = unsafe { entry.try_enumerate_instance_version() }.ok().flatten();
    Machine {
        loader: Ok(version_text(version.unwrap_or(vk::API_VERSION_1_0))),
        layers: instance::layers(&entry).unwrap_or_default(),
        devices: Instance::new(Validation::Off, None).and_then(|instance| device::enumerate(&instance, None)),
    }
}
