//! The loader, the instance, its layers, and what listens to them.

use std::{ffi::CStr, sync::Arc};

use ash::{ext, khr, vk};
use raw_window_handle::{RawDisplayHandle, RawWindowHandle};

use super::{
    advice::{self, no_driver, no_layer},
    canary::{Canary, messenger_info},
    error::{Call, GpuError, Result},
    packages,
};

/// The layer that checks how Vulkan is used.
pub const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// What the validation layer is asked to check. The tiers run one at a time: together they disturb one
/// another.
///
/// There is no GPU-assisted one: version 1.3.239 of the layer, which instruments shaders for it, makes
/// pipelines with push descriptors compute wrong results on lavapipe. Buffers are accessed robustly instead.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Validation {
    /// Nothing; no layer is loaded.
    #[default]
    Off,
    /// Valid usage and synchronisation.
    CoreSync,
    /// Valid usage and habits that cost speed.
    BestPractices,
}

/// A layer that is installed.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Layer {
    /// Its name.
    pub name: String,
    /// The Vulkan version that it was written for.
    pub version: String,
}

/// The instance with its messenger. Dropped after everything that was made from it.
pub(crate) struct Instance {
    pub(crate) raw: ash::Instance,
    pub(crate) entry: ash::Entry,
    pub(crate) canary: Arc<Canary>,
    pub(crate) debug_utils: bool,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
}

/// Loads libvulkan, or says how to get it.
pub(crate) fn load() -> Result<ash::Entry> {
    // SAFETY: libvulkan is a well-behaved library: loading it runs nothing of ours.
    unsafe { ash::Entry::load() }
        .map_err(|error| GpuError::NoLoader { reason: error.to_string(), help: packages::advice(&["run"]) })
}

/// The layers that the loader knows.
pub(crate) fn layers(entry: &ash::Entry) -> Result<Vec<Layer>> {
    // SAFETY: no preconditions.
    let layers =
        unsafe { entry.enumerate_instance_layer_properties() }.call("vkEnumerateInstanceLayerProperties")?;
    Ok(layers
        .iter()
        .map(|layer| Layer {
            name: name_of(layer.layer_name_as_c_str()),
            version: version_text(layer.spec_version),
        })
        .collect())
}

/// `major.minor.patch`.
pub(crate) fn version_text(version: u32) -> String {
    format!(
        "{}.{}.{}",
        vk::api_version_major(version),
        vk::api_version_minor(version),
        vk::api_version_patch(version)
    )
}

pub(crate) fn name_of<E>(name: std::result::Result<&CStr, E>) -> String {
    name.map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

impl Instance {
    /// Makes the instance. `display`: the window system whose surfaces will be drawn to.
    pub(crate) fn new(validation: Validation, display: Option<RawDisplayHandle>) -> Result<Arc<Instance>> {
        let entry = load()?;
        let canary = Arc::new(Canary::default());

        // SAFETY: no preconditions.
        let loader_version = unsafe { entry.try_enumerate_instance_version() }
            .call("vkEnumerateInstanceVersion")?
            .unwrap_or(vk::API_VERSION_1_0);
        if loader_version < vk::API_VERSION_1_1 {
            return Err(GpuError::NoLoader {
                reason: format!("it speaks Vulkan {}", version_text(loader_version)),
                help: packages::advice(&["run"]),
            });
        }

        let mut layer_names = Vec::new();
        if validation != Validation::Off {
            // SAFETY: no preconditions.
            let layers = unsafe { entry.enumerate_instance_layer_properties() }
                .call("vkEnumerateInstanceLayerProperties")?;
            let layer = layers
                .iter()
                .find(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION_LAYER))
                .ok_or_else(no_layer)?;
            canary.set_layer_version(layer.spec_version);
            layer_names.push(VALIDATION_LAYER.as_ptr());
        }

        let offered = extensions(&entry, validation)?;
        let has = |name: &CStr| offered.iter().any(|offered| offered == name.to_bytes());
        let mut names = Vec::new();
        if let Some(display) = display {
            let required = ash_window::enumerate_required_extensions(display).map_err(|result| {
                GpuError::Surface { reason: format!("no Vulkan surface for it: {result}") }
            })?;
            for &name in required {
                // SAFETY: ash's extension names are static and null-terminated.
                let text = unsafe { CStr::from_ptr(name) };
                if !has(text) {
                    return Err(GpuError::Surface {
                        reason: format!(
                            "the Vulkan loader and its drivers lack {}\n{}",
                            text.to_string_lossy(),
                            packages::advice(&["run"])
                        ),
                    });
                }
                names.push(name);
            }
        }
        let debug_utils = has(ext::debug_utils::NAME);
        if debug_utils {
            names.push(ext::debug_utils::NAME.as_ptr());
        } else if validation != Validation::Off {
            return Err(no_layer());
        }
        let mut flags = vk::InstanceCreateFlags::empty();
        if has(khr::portability_enumeration::NAME) {
            names.push(khr::portability_enumeration::NAME.as_ptr());
            flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
        }

        let application = vk::ApplicationInfo::default()
            .application_name(c"Reef")
            .engine_name(c"Reef")
            .api_version(vk::API_VERSION_1_3);
        let mut messenger = messenger_info(&canary);
        let enabled: &[vk::ValidationFeatureEnableEXT] = match validation {
            Validation::Off => &[],
            Validation::CoreSync => &[vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION],
            Validation::BestPractices => &[vk::ValidationFeatureEnableEXT::BEST_PRACTICES],
        };
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(enabled);
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layer_names)
            .enabled_extension_names(&names)
            .flags(flags);
        if debug_utils {
            info = info.push_next(&mut messenger);
        }
        if validation != Validation::Off {
            info = info.push_next(&mut features);
        }
        // SAFETY: everything that `info` points to lives until the call returns, the canary until the
        // instance ends.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => no_driver(),
            vk::Result::ERROR_LAYER_NOT_PRESENT => no_layer(),
            _ if advice::names_no_driver() => no_driver(),
            result => GpuError::Vulkan { call: "vkCreateInstance", result },
        })?;
        let mut instance = Instance { raw, entry, canary, debug_utils, messenger: None };
        if debug_utils && validation != Validation::Off {
            let functions = ext::debug_utils::Instance::new(&instance.entry, &instance.raw);
            // SAFETY: the canary outlives the messenger: both are fields of `instance`, dropped in that
            // order.
            let messenger =
                unsafe { functions.create_debug_utils_messenger(&messenger_info(&instance.canary), None) }
                    .call("vkCreateDebugUtilsMessengerEXT")?;
            instance.messenger = Some((functions, messenger));
        }
        Ok(Arc::new(instance))
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: the device and the surfaces hold this instance, so they are gone; the canary still lives.
        unsafe {
            if let Some((functions, messenger)) = self.messenger.take() {
                functions.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

/// Names of the instance extensions of the loader, the drivers and the layer.
fn extensions(entry: &ash::Entry, validation: Validation) -> Result<Vec<Vec<u8>>> {
    let mut names = Vec::new();
    let layer = (validation != Validation::Off).then_some(VALIDATION_LAYER);
    for layer in [None, layer].into_iter().take(if layer.is_some() { 2 } else { 1 }) {
        // SAFETY: the layer's name is null-terminated.
        let found =
            unsafe { entry.enumerate_instance_extension_properties(layer) }.map_err(
                |result| match result {
                    vk::Result::ERROR_INCOMPATIBLE_DRIVER | vk::Result::ERROR_INITIALIZATION_FAILED => {
                        no_driver()
                    }
                    _ if advice::names_no_driver() => no_driver(),
                    result => GpuError::Vulkan { call: "vkEnumerateInstanceExtensionProperties", result },
                },
            )?;
        names.extend(
            found.iter().filter_map(|e| e.extension_name_as_c_str().ok()).map(|n| n.to_bytes().to_vec()),
        );
    }
    Ok(names)
}

/// A window's surface.
pub struct Surface {
    pub(crate) raw: vk::SurfaceKHR,
    pub(crate) functions: khr::surface::Instance,
    _instance: Arc<Instance>,
}

impl Surface {
    pub(crate) fn new(
        instance: &Arc<Instance>,
        display: RawDisplayHandle,
        window: RawWindowHandle,
    ) -> Result<Self> {
        // SAFETY: the instance was made with the display's extensions; the caller keeps the window alive.
        let raw =
            unsafe { ash_window::create_surface(&instance.entry, &instance.raw, display, window, None) }
                .call("vkCreate…SurfaceKHR")?;
        let functions = khr::surface::Instance::new(&instance.entry, &instance.raw);
        Ok(Self { raw, functions, _instance: instance.clone() })
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: the swapchain that used it is dropped before: it borrows the surface's owner.
        unsafe { self.functions.destroy_surface(self.raw, None) };
    }
}
