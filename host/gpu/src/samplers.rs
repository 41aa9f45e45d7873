//! Samplers: made once for each way of sampling, owned by the context.

use std::{
    collections::HashMap,
    sync::{Mutex, PoisonError},
};

use ash::vk;

use super::{
    context::Gpu,
    error::{Call, Result},
};

/// A way of reading a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SamplerDesc {
    /// Between pixels: blend linearly, or take the nearest.
    pub linear: bool,
    /// Beyond the left and right border, and beyond the others: repeat, or hold the last pixel.
    pub repeat: [bool; 2],
    /// Look sharper at flat angles, where the device can.
    pub anisotropic: bool,
}

/// The samplers that were made so far.
#[derive(Default)]
pub(crate) struct Samplers {
    made: Mutex<HashMap<SamplerDesc, vk::Sampler>>,
}

impl Gpu {
    /// The sampler of this kind; it lives as long as the context.
    pub fn sampler(&self, desc: SamplerDesc) -> Result<vk::Sampler> {
        let shared = &self.shared;
        let mut made = shared.samplers.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(sampler) = made.get(&desc) {
            return Ok(*sampler);
        }
        let (filter, mips) = if desc.linear {
            (vk::Filter::LINEAR, vk::SamplerMipmapMode::LINEAR)
        } else {
            (vk::Filter::NEAREST, vk::SamplerMipmapMode::NEAREST)
        };
        let [across, along] = desc.repeat.map(|repeat| {
            if repeat { vk::SamplerAddressMode::REPEAT } else { vk::SamplerAddressMode::CLAMP_TO_EDGE }
        });
        let anisotropic = desc.anisotropic && shared.info.optional.anisotropy;
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .mipmap_mode(mips)
            .address_mode_u(across)
            .address_mode_v(along)
            .address_mode_w(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .anisotropy_enable(anisotropic)
            .max_anisotropy(shared.info.limits.max_sampler_anisotropy.clamp(1.0, 8.0))
            .max_lod(vk::LOD_CLAMP_NONE);
        // SAFETY: the device lives.
        let sampler = unsafe { shared.device.create_sampler(&info, None) }.call("vkCreateSampler")?;
        made.insert(desc, sampler);
        Ok(sampler)
    }
}

impl Samplers {
    /// Destroys all; the device is idle.
    pub(crate) fn destroy(&self, device: &ash::Device) {
        for (_, sampler) in self.made.lock().unwrap_or_else(PoisonError::into_inner).drain() {
            // SAFETY: the device is idle and the context is ending.
            unsafe { device.destroy_sampler(sampler, None) };
        }
    }
}
