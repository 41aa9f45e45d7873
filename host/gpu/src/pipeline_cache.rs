//! Compiled pipelines, kept on disk between runs.

use std::path::{Path, PathBuf};

use ash::vk;
use reef_files::{bounded, cache};

use super::{device::DeviceInfo, instance::Instance};

/// A cache larger than this is not read: something is wrong with it.
const MOST_BYTES: u64 = 256 << 20;

/// The driver's cache and the file that it is kept in.
pub(crate) struct PipelineCache {
    pub(crate) raw: vk::PipelineCache,
    file: Option<PathBuf>,
}

impl PipelineCache {
    /// Makes the cache from the file of this device and driver, or empty. A cache that cannot be had costs
    /// time only.
    pub(crate) fn load(
        device: &ash::Device,
        instance: &Instance,
        info: &DeviceInfo,
        folder: Option<&Path>,
    ) -> PipelineCache {
        // SAFETY: the physical device belongs to the instance.
        let properties = unsafe { instance.raw.get_physical_device_properties(info.raw) };
        let uuid = properties.pipeline_cache_uuid;
        let file = folder.map(|folder| {
            let uuid: String = uuid.iter().map(|byte| format!("{byte:02x}")).collect();
            folder.join(format!("pipelines-{:x}-{:x}-{uuid}.bin", properties.vendor_id, properties.device_id))
        });
        let mut data = file.as_deref().and_then(read).unwrap_or_default();
        if !data.is_empty() && !header_fits(&data, properties.vendor_id, properties.device_id, &uuid) {
            tracing::warn!("the pipeline cache is not this driver's: it is made anew");
            data.clear();
        }
        let create = vk::PipelineCacheCreateInfo::default().initial_data(&data);
        // SAFETY: the header was checked; the driver checks the rest.
        let raw = unsafe { device.create_pipeline_cache(&create, None) };
        let raw = raw.unwrap_or_else(|result| {
            tracing::warn!("no pipeline cache: {result}");
            vk::PipelineCache::null()
        });
        PipelineCache { raw, file }
    }

    /// Writes the cache to its file and destroys it; the device is idle.
    pub(crate) fn save_and_destroy(&self, device: &ash::Device) {
        if self.raw == vk::PipelineCache::null() {
            return;
        }
        if let Some(file) = &self.file {
            // SAFETY: the cache is alive and no pipeline is being made.
            match unsafe { device.get_pipeline_cache_data(self.raw) } {
                Ok(data) => {
                    if let Err(error) = cache::keep(file, &data) {
                        tracing::warn!("{}: the pipeline cache was not kept: {error}", file.display());
                    }
                }
                Err(result) => tracing::warn!("vkGetPipelineCacheData: {result}"),
            }
        }
        // SAFETY: the device is idle; the context is ending.
        unsafe { device.destroy_pipeline_cache(self.raw, None) };
    }
}

fn read(file: &Path) -> Option<Vec<u8>> {
    bounded::read(file, MOST_BYTES).ok()
}

/// Whether data begins with the header of version one, of this vendor, device and driver.
fn header_fits(data: &[u8], vendor: u32, device: u32, uuid: &[u8; 16]) -> bool {
    let word = |at: usize| -> Option<u32> {
        let bytes = data.get(at..at + 4)?;
        Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    };
    word(0).is_some_and(|length| length >= 32)
        && word(4) == Some(1)
        && word(8) == Some(vendor)
        && word(12) == Some(device)
        && data.get(16..32) == Some(uuid)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header() -> Vec<u8> {
        let mut data = Vec::new();
        for word in [32u32, 1, 7, 8] {
            data.extend(word.to_le_bytes());
        }
        data.extend([9; 16]);
        data
    }

    #[test]
    fn only_a_cache_of_the_same_driver_is_used() {
        assert!(header_fits(&header(), 7, 8, &[9; 16]));
        assert!(!header_fits(&header(), 6, 8, &[9; 16]));
        assert!(!header_fits(&header(), 7, 9, &[9; 16]));
        assert!(!header_fits(&header(), 7, 8, &[1; 16]));
        for length in 0..header().len() {
            assert!(!header_fits(&header()[..length], 7, 8, &[9; 16]), "cut to {length} bytes");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_cache_that_is_no_file_is_none_and_nobody_waits_for_it() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let [pipe, zero] = ["pipe", "zero"].map(|name| folder.path().join(name));
        let name = std::ffi::CString::new(pipe.to_str().expect("UTF-8")).expect("no NUL");
        // SAFETY: the path is null-terminated.
        assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
        std::os::unix::fs::symlink("/dev/zero", &zero).expect("a link");
        for file in [&pipe, &zero] {
            assert_eq!(read(file), None, "{}", file.display());
            cache::keep(file, &[5]).expect("replaced");
            assert_eq!(read(file), Some(vec![5]));
        }
    }
}
