//! Of what a picture on its way is made.

use ash::vk;

/// Format of scene light.
pub const LIGHT: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
/// Format of what the display shows, in which low quality draws at once.
pub const SHOWN: vk::Format = vk::Format::R8G8B8A8_UNORM;
/// Format of depth: 1 at the near plane, 0 infinitely far away.
pub const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
