//! The graphics context: one device with one queue, its memory, and the watch over what is left behind.

use std::{
    collections::BTreeMap,
    path::PathBuf,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
};

use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use raw_window_handle::{RawDisplayHandle, RawWindowHandle};

use super::{
    canary::Canary,
    device::{self, DeviceInfo},
    error::{Call, GpuError, Result},
    fault::Fault,
    garbage::{Bin, Garbage},
    heap,
    instance::{Instance, Surface, Validation},
    pipeline_cache::PipelineCache,
    samplers::Samplers,
    shaders::ShaderStore,
};

/// How the context is opened.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// Index or part of the name of the device; the best one without it.
    pub device: Option<String>,
    /// What the validation layer checks.
    pub validation: Validation,
    /// A fault to plant; heeded only with validation. [`GpuOptions::from_environment`] reads it.
    pub fault: Option<Fault>,
    /// Where compiled pipelines are kept between runs; nowhere without it.
    pub cache_dir: Option<PathBuf>,
}

impl GpuOptions {
    /// The options of a command: the device that was asked for, the user's cache folder, the planted fault.
    pub fn from_environment(device: Option<String>, validation: Validation) -> Self {
        Self {
            device,
            validation,
            fault: if validation == Validation::Off { None } else { Fault::from_environment() },
            cache_dir: reef_files::cache::folder(),
        }
    }
}

/// The graphics context. Cheap to clone: all clones are the same context.
#[derive(Clone)]
pub struct Gpu {
    pub(crate) shared: Arc<Shared>,
}

/// What all resources share. Destroyed by [`Gpu::close`], or with the last of them.
pub(crate) struct Shared {
    pub(crate) device: ash::Device,
    pub(crate) info: DeviceInfo,
    pub(crate) push_descriptor: khr::push_descriptor::Device,
    pub(crate) swapchain: Option<khr::swapchain::Device>,
    pub(crate) shaders: Arc<ShaderStore>,
    pub(crate) samplers: Samplers,
    pub(crate) pipeline_cache: PipelineCache,
    pub(crate) bin: Bin,
    pub(crate) validation: Validation,
    pub(crate) fault: Option<Fault>,
    debug: Option<ext::debug_utils::Device>,
    queue: Mutex<vk::Queue>,
    allocator: Mutex<Option<Arc<Mutex<Allocator>>>>,
    living: Mutex<BTreeMap<u64, (&'static str, String)>>,
    next_id: AtomicU64,
    closed: AtomicBool,
    pub(crate) instance: Arc<Instance>,
}

impl Gpu {
    /// Opens a context that draws into pictures only.
    pub fn open(options: &GpuOptions) -> Result<Gpu> {
        let instance = Instance::new(options.validation, None)?;
        Self::with_instance(instance, None, options)
    }

    /// Opens a context for a window, with the window's surface. The window has to outlive the surface.
    pub fn open_for_window(
        options: &GpuOptions,
        display: RawDisplayHandle,
        window: RawWindowHandle,
    ) -> Result<(Gpu, Surface)> {
        let instance = Instance::new(options.validation, Some(display))?;
        let surface = Surface::new(&instance, display, window)?;
        let gpu = Self::with_instance(instance, Some(&surface), options)?;
        Ok((gpu, surface))
    }

    fn with_instance(
        instance: Arc<Instance>,
        surface: Option<&Surface>,
        options: &GpuOptions,
    ) -> Result<Gpu> {
        let devices = device::enumerate(&instance, surface)?;
        let info = device::choose(devices, options.device.as_deref())?;
        tracing::info!("drawing on {info}");
        if info.kind == "cpu" {
            heap::keep();
        }
        let raw = device::create(&instance, &info, surface.is_some())?;
        // SAFETY: the family was asked for with one queue.
        let queue = unsafe { raw.get_device_queue(info.family, 0) };
        // Leaks are reported by our own list, which knows names.
        let mut settings = gpu_allocator::AllocatorDebugSettings::default();
        settings.log_leaks_on_shutdown = false;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: raw.clone(),
            physical_device: info.raw,
            debug_settings: settings,
            buffer_device_address: false,
            allocation_sizes: gpu_allocator::AllocationSizes::default(),
        });
        let allocator = match allocator {
            Ok(allocator) => allocator,
            Err(error) => {
                // SAFETY: nothing was made from the device yet.
                unsafe { raw.destroy_device(None) };
                return Err(GpuError::Memory {
                    name: "allocator".to_owned(),
                    bytes: 0,
                    reason: error.to_string(),
                });
            }
        };
        let debug = instance.debug_utils.then(|| ext::debug_utils::Device::new(&instance.raw, &raw));
        let shared = Shared {
            push_descriptor: khr::push_descriptor::Device::new(&instance.raw, &raw),
            swapchain: surface.map(|_| khr::swapchain::Device::new(&instance.raw, &raw)),
            shaders: Arc::new(ShaderStore::embedded()),
            samplers: Samplers::default(),
            pipeline_cache: PipelineCache::load(&raw, &instance, &info, options.cache_dir.as_deref()),
            bin: Bin::default(),
            validation: options.validation,
            fault: if options.validation == Validation::Off { None } else { options.fault },
            debug,
            queue: Mutex::new(queue),
            allocator: Mutex::new(Some(Arc::new(Mutex::new(allocator)))),
            living: Mutex::new(BTreeMap::new()),
            next_id: AtomicU64::new(1),
            closed: AtomicBool::new(false),
            device: raw,
            info,
            instance,
        };
        let gpu = Gpu { shared: Arc::new(shared) };
        if gpu.shared.fault == Some(Fault::Leak) {
            use super::buffer::{Buffer, BufferDesc, Memory};
            let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
            let desc = BufferDesc { name: "planted leak", size: 64, usage, memory: Memory::Device };
            std::mem::forget(Buffer::new(&gpu, &desc)?);
        }
        Ok(gpu)
    }

    /// The device that is drawn on.
    pub fn info(&self) -> &DeviceInfo {
        &self.shared.info
    }

    /// Vulkan's own handle, for what this module does not wrap.
    pub fn device(&self) -> &ash::Device {
        &self.shared.device
    }

    /// The instance's handle, likewise.
    pub fn instance(&self) -> &ash::Instance {
        &self.shared.instance.raw
    }

    /// The physical device's handle, likewise.
    pub fn physical_device(&self) -> vk::PhysicalDevice {
        self.shared.info.raw
    }

    /// The queue; nobody submits to it while the guard lives.
    pub fn queue(&self) -> MutexGuard<'_, vk::Queue> {
        self.shared.queue()
    }

    /// The family of the queue.
    pub fn queue_family(&self) -> u32 {
        self.shared.info.family
    }

    /// The memory allocator, for libraries that bring their own resources. They drop it before
    /// [`Gpu::close`].
    pub fn allocator(&self) -> Result<Arc<Mutex<Allocator>>> {
        self.shared.allocator()
    }

    /// What listens to the validation layers; it may be asked after the context was closed.
    pub fn canary(&self) -> Arc<Canary> {
        self.shared.instance.canary.clone()
    }

    /// What the validation layers check.
    pub fn validation(&self) -> Validation {
        self.shared.validation
    }

    /// The shaders, embedded or reloaded.
    pub fn shaders(&self) -> &ShaderStore {
        &self.shared.shaders
    }

    /// Waits until the device has nothing left to do.
    pub fn wait_idle(&self) -> Result<()> {
        let _queue = self.shared.queue();
        // SAFETY: the queue is held, so that nobody else submits.
        unsafe { self.shared.device.device_wait_idle() }.call("vkDeviceWaitIdle")
    }

    /// Ends the context: waits for the device, destroys what was dropped, and reports what was not as leaked,
    /// to the log and to the canary. Returns the leaked resources.
    pub fn close(self) -> Vec<String> {
        self.shared.close()
    }
}

impl Shared {
    pub(crate) fn queue(&self) -> MutexGuard<'_, vk::Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn allocator(&self) -> Result<Arc<Mutex<Allocator>>> {
        self.allocator.lock().unwrap_or_else(PoisonError::into_inner).clone().ok_or_else(|| {
            GpuError::Resource { name: "allocator".to_owned(), reason: "the context is closed".to_owned() }
        })
    }

    /// Enters a resource into the list of the living; the number tells it from all others.
    pub(crate) fn register(&self, kind: &'static str, name: &str) -> u64 {
        let id = self.next_id.fetch_add(1, Ordering::Relaxed);
        self.living().insert(id, (kind, name.to_owned()));
        id
    }

    /// Takes a resource from the list; false where the context is closed and there is nothing left to
    /// destroy.
    pub(crate) fn unregister(&self, id: u64) -> bool {
        self.living().remove(&id);
        !self.closed.load(Ordering::Acquire)
    }

    fn living(&self) -> MutexGuard<'_, BTreeMap<u64, (&'static str, String)>> {
        self.living.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Destroys something as soon as no frame uses it any more.
    pub(crate) fn discard(&self, garbage: Garbage) {
        self.bin.push(garbage);
    }

    /// Gives a Vulkan object a name for messages and debuggers.
    pub(crate) fn name<H: vk::Handle>(&self, handle: H, name: &str) {
        let Some(debug) = &self.debug else { return };
        let name: Vec<u8> = name.bytes().filter(|&b| b != 0).chain([0]).collect();
        let Ok(name) = std::ffi::CStr::from_bytes_with_nul(&name) else { return };
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(name);
        // SAFETY: the handle is alive and belongs to this device. A name that is refused is no loss.
        let _ = unsafe { debug.set_debug_utils_object_name(&info) };
    }

    pub(crate) fn begin_label(&self, commands: vk::CommandBuffer, name: &std::ffi::CStr) {
        if let Some(debug) = &self.debug {
            let label = vk::DebugUtilsLabelEXT::default().label_name(name);
            // SAFETY: the command buffer is being recorded.
            unsafe { debug.cmd_begin_debug_utils_label(commands, &label) };
        }
    }

    pub(crate) fn end_label(&self, commands: vk::CommandBuffer) {
        if let Some(debug) = &self.debug {
            // SAFETY: the command buffer is being recorded, within a label.
            unsafe { debug.cmd_end_debug_utils_label(commands) };
        }
    }

    fn close(&self) -> Vec<String> {
        if self.closed.load(Ordering::Acquire) {
            return Vec::new();
        }
        {
            let _queue = self.queue();
            // SAFETY: the queue is held. An error here means that the device is lost: then it is idle, too.
            if let Err(result) = unsafe { self.device.device_wait_idle() } {
                tracing::warn!("vkDeviceWaitIdle: {result}");
            }
        }
        self.bin.empty(self);
        self.samplers.destroy(&self.device);
        self.pipeline_cache.save_and_destroy(&self.device);
        self.closed.store(true, Ordering::Release);
        let leaks: Vec<String> = std::mem::take(&mut *self.living())
            .into_values()
            .map(|(kind, name)| format!("{kind} `{name}`"))
            .collect();
        for leak in &leaks {
            self.instance.canary.report("REEF-leak", format!("{leak} was not given back"));
        }
        drop(self.allocator.lock().unwrap_or_else(PoisonError::into_inner).take());
        if leaks.is_empty() || self.validation != Validation::Off {
            // SAFETY: the device is idle. With validation on, what leaked is left for the layer to see.
            unsafe { self.device.destroy_device(None) };
        } else {
            // The device stays for what leaked, and an instance must not go before its device: drivers have
            // threads of their own that would find it gone.
            std::mem::forget(self.instance.clone());
        }
        leaks
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        self.close();
    }
}
