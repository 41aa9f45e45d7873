//! Vulkan: device, swapchain, memory, frames in flight, pipelines, barriers. Nothing of the sea.
