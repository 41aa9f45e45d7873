//! Which physical devices there are, what each lacks, and which one is taken.

use ash::{khr, vk};

use super::{
    advice,
    error::{Call, GpuError, Result},
    instance::{Instance, Surface, name_of, version_text},
    packages,
};

/// A physical device, as `reef doctor` shows it.
#[derive(Clone, Debug, serde::Serialize)]
pub struct DeviceInfo {
    /// Its place in the loader's list, which `--device` understands.
    pub index: usize,
    /// Its name, of which `--device` understands a part.
    pub name: String,
    /// `discrete`, `integrated`, `virtual`, `cpu` or `other`.
    pub kind: &'static str,
    /// The driver's name and version.
    pub driver: String,
    /// The Vulkan version that it speaks.
    pub api: String,
    /// What Reef needs and it lacks; empty: it can run Reef.
    pub missing: Vec<String>,
    #[serde(skip)]
    pub(crate) raw: vk::PhysicalDevice,
    #[serde(skip)]
    pub(crate) family: u32,
    #[serde(skip)]
    pub(crate) timestamp_bits: u32,
    #[serde(skip)]
    pub(crate) extensions: Vec<Vec<u8>>,
    /// What of everything it can have at most.
    #[serde(skip)]
    pub limits: vk::PhysicalDeviceLimits,
    /// What it can do beyond what is needed.
    pub optional: Optional,
}

/// What Reef uses where it is there.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct Optional {
    /// Indirect draws whose number is counted on the device.
    pub draw_indirect_count: bool,
    /// Samplers look sharper at flat angles.
    pub anisotropy: bool,
    /// Fragment shaders may write storage buffers.
    pub fragment_stores: bool,
    /// Vertex shaders may write storage buffers.
    pub vertex_stores: bool,
    /// `gl_BaseInstance` and `gl_DrawID` in shaders.
    pub draw_parameters: bool,
    /// Points of more than one pixel.
    pub large_points: bool,
    /// Lines as polygons' edges.
    pub wireframe: bool,
}

impl std::fmt::Display for DeviceInfo {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {} ({}, {}, Vulkan {})", self.index, self.name, self.kind, self.driver, self.api)
    }
}

impl DeviceInfo {
    /// Pixels that an image may have along one side.
    pub fn max_image_size(&self) -> u32 {
        self.limits.max_image_dimension2_d
    }

    pub(crate) fn has_extension(&self, name: &std::ffi::CStr) -> bool {
        self.extensions.iter().any(|extension| extension == name.to_bytes())
    }
}

/// Everything about every device. `surface`: leave out queues that cannot present to it.
pub(crate) fn enumerate(instance: &Instance, surface: Option<&Surface>) -> Result<Vec<DeviceInfo>> {
    // SAFETY: the instance lives.
    let devices = unsafe { instance.raw.enumerate_physical_devices() }.map_err(|result| match result {
        vk::Result::ERROR_INITIALIZATION_FAILED | vk::Result::ERROR_INCOMPATIBLE_DRIVER => {
            advice::no_driver()
        }
        result => GpuError::Vulkan { call: "vkEnumeratePhysicalDevices", result },
    })?;
    devices.iter().enumerate().map(|(index, &raw)| inspect(instance, surface, index, raw)).collect()
}

fn inspect(
    instance: &Instance,
    surface: Option<&Surface>,
    index: usize,
    raw: vk::PhysicalDevice,
) -> Result<DeviceInfo> {
    let vulkan = &instance.raw;
    // SAFETY: `raw` came from this instance, here and below.
    let plain = unsafe { vulkan.get_physical_device_properties(raw) };
    let mut missing = Vec::new();
    // SAFETY: as above.
    let extensions: Vec<Vec<u8>> = unsafe { vulkan.enumerate_device_extension_properties(raw) }
        .call("vkEnumerateDeviceExtensionProperties")?
        .iter()
        .filter_map(|e| e.extension_name_as_c_str().ok())
        .map(|name| name.to_bytes().to_vec())
        .collect();
    let mut optional = Optional::default();
    let mut driver = plain.driver_version.to_string();

    if plain.api_version < vk::API_VERSION_1_3 {
        missing.push("Vulkan 1.3".to_owned());
    } else {
        let mut driver_properties = vk::PhysicalDeviceDriverProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver_properties);
        // SAFETY: the chain lives until the call returns.
        unsafe { vulkan.get_physical_device_properties2(raw, &mut properties) };
        driver = format!(
            "{} {}",
            name_of(driver_properties.driver_name_as_c_str()),
            name_of(driver_properties.driver_info_as_c_str())
        )
        .trim()
        .to_owned();

        let mut f11 = vk::PhysicalDeviceVulkan11Features::default();
        let mut f12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut f13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut features = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut f11)
            .push_next(&mut f12)
            .push_next(&mut f13);
        // SAFETY: the chain lives until the call returns.
        unsafe { vulkan.get_physical_device_features2(raw, &mut features) };
        let f10 = features.features;
        let required = [
            (f13.dynamic_rendering, "dynamicRendering"),
            (f13.synchronization2, "synchronization2"),
            (f13.maintenance4, "maintenance4"),
            (f12.scalar_block_layout, "scalarBlockLayout"),
            (f10.multi_draw_indirect, "multiDrawIndirect"),
            (f10.draw_indirect_first_instance, "drawIndirectFirstInstance"),
        ];
        missing.extend(
            required.iter().filter(|(has, _)| *has == vk::FALSE).map(|(_, name)| format!("feature {name}")),
        );
        optional = Optional {
            draw_indirect_count: f12.draw_indirect_count == vk::TRUE,
            anisotropy: f10.sampler_anisotropy == vk::TRUE,
            fragment_stores: f10.fragment_stores_and_atomics == vk::TRUE,
            vertex_stores: f10.vertex_pipeline_stores_and_atomics == vk::TRUE,
            draw_parameters: f11.shader_draw_parameters == vk::TRUE,
            large_points: f10.large_points == vk::TRUE,
            wireframe: f10.fill_mode_non_solid == vk::TRUE,
        };
    }

    let mut required = vec![khr::push_descriptor::NAME];
    if surface.is_some() {
        required.push(khr::swapchain::NAME);
    }
    for name in required {
        if !extensions.iter().any(|extension| extension == name.to_bytes()) {
            missing.push(format!("extension {}", name.to_string_lossy()));
        }
    }

    // SAFETY: as above.
    let families = unsafe { vulkan.get_physical_device_queue_family_properties(raw) };
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    let mut family = None;
    for (i, properties) in families.iter().enumerate() {
        let i = i as u32;
        let presents = match surface {
            None => true,
            Some(surface) => {
                // SAFETY: the surface belongs to this instance and `i` is one of the device's families.
                let answer =
                    unsafe { surface.functions.get_physical_device_surface_support(raw, i, surface.raw) };
                answer.unwrap_or(false)
            }
        };
        if properties.queue_flags.contains(wanted) && properties.queue_count > 0 && presents {
            family = Some((i, properties.timestamp_valid_bits));
            break;
        }
    }
    if family.is_none() {
        let window = if surface.is_some() { " and presents to the window" } else { "" };
        missing.push(format!("a queue that draws, computes{window}"));
    }
    let (family, timestamp_bits) = family.unwrap_or((0, 0));

    Ok(DeviceInfo {
        index,
        name: name_of(plain.device_name_as_c_str()),
        kind: match plain.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => "discrete",
            vk::PhysicalDeviceType::INTEGRATED_GPU => "integrated",
            vk::PhysicalDeviceType::VIRTUAL_GPU => "virtual",
            vk::PhysicalDeviceType::CPU => "cpu",
            _ => "other",
        },
        driver,
        api: version_text(plain.api_version),
        missing,
        raw,
        family,
        timestamp_bits,
        extensions,
        limits: plain.limits,
        optional,
    })
}

/// Takes the device that `wanted` names (by index, or by a part of its name), or the best one.
pub(crate) fn choose(devices: Vec<DeviceInfo>, wanted: Option<&str>) -> Result<DeviceInfo> {
    if devices.is_empty() {
        return Err(advice::no_driver());
    }
    let mut candidates: Vec<DeviceInfo> = match wanted {
        None => devices,
        Some(wanted) => {
            let list: Vec<String> = devices.iter().map(ToString::to_string).collect();
            let index: Option<usize> = wanted.trim().parse().ok();
            let part = wanted.trim().to_lowercase();
            let found: Vec<DeviceInfo> = devices
                .into_iter()
                .filter(|device| match index {
                    Some(index) => device.index == index,
                    None => !part.is_empty() && device.name.to_lowercase().contains(&part),
                })
                .collect();
            if found.is_empty() {
                return Err(GpuError::NoSuchDevice { wanted: wanted.to_owned(), devices: list.join("\n") });
            }
            found
        }
    };
    let rank = |device: &DeviceInfo| match device.kind {
        "discrete" => 0,
        "integrated" => 1,
        "virtual" => 2,
        "cpu" => 3,
        _ => 4,
    };
    // A stable sort: of two equal devices, the loader's first.
    candidates.sort_by_key(rank);
    match candidates.iter().position(|device| device.missing.is_empty()) {
        Some(best) => Ok(candidates.swap_remove(best)),
        None => Err(GpuError::Unsuitable {
            reasons: candidates
                .iter()
                .map(|device| format!("{device} lacks {}", device.missing.join(", ")))
                .collect::<Vec<_>>()
                .join("\n"),
            help: format!("update the driver, or draw on the processor: {}", packages::advice(&["run"])),
        }),
    }
}

/// Makes the device with the features that are needed, and those optional ones that are there.
pub(crate) fn create(instance: &Instance, info: &DeviceInfo, with_swapchain: bool) -> Result<ash::Device> {
    let mut extensions = vec![khr::push_descriptor::NAME.as_ptr()];
    if with_swapchain {
        extensions.push(khr::swapchain::NAME.as_ptr());
    }
    // A device that only nearly is Vulkan (as on macOS) demands to be told that we know.
    let portability = c"VK_KHR_portability_subset";
    if info.has_extension(portability) {
        extensions.push(portability.as_ptr());
    }
    let o = &info.optional;
    let f10 = vk::PhysicalDeviceFeatures::default()
        .robust_buffer_access(true)
        .multi_draw_indirect(true)
        .draw_indirect_first_instance(true)
        .sampler_anisotropy(o.anisotropy)
        .fragment_stores_and_atomics(o.fragment_stores)
        .vertex_pipeline_stores_and_atomics(o.vertex_stores)
        .large_points(o.large_points)
        .fill_mode_non_solid(o.wireframe);
    let mut f11 = vk::PhysicalDeviceVulkan11Features::default().shader_draw_parameters(o.draw_parameters);
    let mut f12 = vk::PhysicalDeviceVulkan12Features::default()
        .scalar_block_layout(true)
        .draw_indirect_count(o.draw_indirect_count);
    let mut f13 = vk::PhysicalDeviceVulkan13Features::default()
        .dynamic_rendering(true)
        .synchronization2(true)
        .maintenance4(true);
    let queue = vk::DeviceQueueCreateInfo::default().queue_family_index(info.family).queue_priorities(&[1.0]);
    let queues = [queue];
    let create = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .enabled_features(&f10)
        .push_next(&mut f11)
        .push_next(&mut f12)
        .push_next(&mut f13);
    // SAFETY: everything that `create` points to lives until the call returns.
    unsafe { instance.raw.create_device(info.raw, &create, None) }.call("vkCreateDevice")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device(index: usize, name: &str, kind: &'static str, missing: &[&str]) -> DeviceInfo {
        DeviceInfo {
            index,
            name: name.to_owned(),
            kind,
            driver: "driver".to_owned(),
            api: "1.3.0".to_owned(),
            missing: missing.iter().map(|s| (*s).to_owned()).collect(),
            raw: vk::PhysicalDevice::null(),
            family: 0,
            timestamp_bits: 64,
            extensions: Vec::new(),
            limits: vk::PhysicalDeviceLimits::default(),
            optional: Optional::default(),
        }
    }

    fn machine() -> Vec<DeviceInfo> {
        vec![
            device(0, "llvmpipe (LLVM 15)", "cpu", &[]),
            device(1, "Old Card", "discrete", &["feature dynamicRendering"]),
            device(2, "Laptop Graphics", "integrated", &[]),
        ]
    }

    #[test]
    fn the_best_device_that_can_run_reef_is_taken() {
        assert_eq!(choose(machine(), None).expect("there is one").index, 2);
    }

    #[test]
    fn an_index_or_a_part_of_the_name_overrides_the_choice() {
        assert_eq!(choose(machine(), Some("0")).expect("by index").index, 0);
        assert_eq!(choose(machine(), Some("LLVMpipe")).expect("by name").index, 0);
    }

    #[test]
    fn a_device_that_is_not_there_is_refused_with_the_list() {
        for wanted in ["7", "voodoo", "", " "] {
            match choose(machine(), Some(wanted)) {
                Err(GpuError::NoSuchDevice { devices, .. }) => assert!(devices.contains("Laptop Graphics")),
                other => panic!("{wanted:?}: {other:?}"),
            }
        }
    }

    #[test]
    fn a_device_that_lacks_something_is_refused_with_what_it_lacks() {
        match choose(machine(), Some("1")) {
            Err(GpuError::Unsuitable { reasons, .. }) => assert!(reasons.contains("dynamicRendering")),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_machine_without_devices_is_told_what_to_install() {
        assert!(matches!(choose(Vec::new(), None), Err(GpuError::NoDriver { .. })));
    }
}
