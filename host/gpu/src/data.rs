//! What passes give to shaders: bytes on the device, textures.

use ash::vk;

use super::{buffer::Buffer, image::Image, ring::Upload};

/// Bytes on the device.
#[derive(Clone, Copy)]
pub enum Data<'a> {
    /// A whole buffer.
    Whole(&'a Buffer),
    /// A buffer from an offset on, for a number of bytes.
    Part(&'a Buffer, u64, u64),
    /// A piece of the frame's upload ring.
    Upload(Upload),
}

impl<'a> From<&'a Buffer> for Data<'a> {
    fn from(buffer: &'a Buffer) -> Self {
        Data::Whole(buffer)
    }
}

impl From<Upload> for Data<'_> {
    fn from(upload: Upload) -> Self {
        Data::Upload(upload)
    }
}

impl Data<'_> {
    /// Handle, offset, size.
    pub(crate) fn place(&self) -> (vk::Buffer, u64, u64) {
        match *self {
            Data::Whole(buffer) => (buffer.raw(), 0, buffer.size()),
            Data::Part(buffer, offset, size) => (buffer.raw(), offset, size),
            Data::Upload(upload) => (upload.buffer, upload.offset, upload.size),
        }
    }

    /// The view of its texels: of all of them, wherever the data begins.
    pub(crate) fn texels(&self) -> vk::BufferView {
        match *self {
            Data::Whole(buffer) | Data::Part(buffer, ..) => buffer.texels(),
            Data::Upload(upload) => upload.texels,
        }
    }

    /// Identity and name of what a pass has to declare.
    pub(crate) fn declared(&self) -> Option<(u64, &str)> {
        match self {
            Data::Whole(buffer) | Data::Part(buffer, ..) => Some((buffer.id(), buffer.name())),
            Data::Upload(_) => None,
        }
    }

    pub(crate) fn check(&self) -> std::result::Result<(), String> {
        match *self {
            Data::Part(buffer, offset, size) if offset.saturating_add(size) > buffer.size() => Err(format!(
                "{size} bytes at {offset} reach beyond `{}` ({} bytes)",
                buffer.name(),
                buffer.size()
            )),
            _ => Ok(()),
        }
    }
}

/// Something that is bound to a shader.
#[derive(Clone, Copy)]
pub enum Resource<'a> {
    /// A storage, uniform or texel buffer, as the shader has it. Of a texel buffer the shader sees all
    /// texels.
    Buffer(Data<'a>),
    /// A texture with the way of sampling it.
    Texture(&'a Image, vk::Sampler),
    /// A storage image.
    Storage(&'a Image),
}

impl<'a, D: Into<Data<'a>>> From<D> for Resource<'a> {
    fn from(data: D) -> Self {
        Resource::Buffer(data.into())
    }
}

/// Whether such a descriptor has a buffer as bytes.
pub(crate) fn is_buffer(kind: vk::DescriptorType) -> bool {
    matches!(kind, vk::DescriptorType::STORAGE_BUFFER | vk::DescriptorType::UNIFORM_BUFFER)
}

/// Whether such a descriptor has a buffer as texels.
pub(crate) fn is_texels(kind: vk::DescriptorType) -> bool {
    matches!(kind, vk::DescriptorType::UNIFORM_TEXEL_BUFFER | vk::DescriptorType::STORAGE_TEXEL_BUFFER)
}
