//! Pictures without a window: fetched from an image that was drawn to, as 8-bit RGBA.

use ash::vk;

use super::{
    access::Access,
    buffer::{Buffer, BufferDesc, Memory},
    error::{GpuError, Result},
    frames::{Frame, Frames},
    image::Image,
    transfer::pixel_bytes,
};

/// A picture in the program's memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// In pixels.
    pub width: u32,
    /// In pixels.
    pub height: u32,
    /// Red, green, blue, alpha; rows from top to bottom without padding; as they were in the image.
    pub rgba: Vec<u8>,
}

impl Picture {
    /// The pixel in this column and row.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[u8; 4]> {
        let at = (y as usize * self.width as usize + x as usize) * 4;
        (x < self.width).then(|| self.rgba.get(at..at + 4)?.try_into().ok()).flatten()
    }
}

/// A picture on its way to the program.
pub struct Readback {
    landing: Buffer,
    size: (u32, u32),
    swap_red_blue: bool,
    serial: u64,
}

impl Frame<'_> {
    /// Copies an image (8 bits a channel, usage TRANSFER_SRC) to where [`Readback::finish`] takes it from.
    pub fn read_back(&mut self, image: &Image) -> Result<Readback> {
        let swap_red_blue = match image.format() {
            vk::Format::R8G8B8A8_UNORM | vk::Format::R8G8B8A8_SRGB => false,
            vk::Format::B8G8R8A8_UNORM | vk::Format::B8G8R8A8_SRGB => true,
            format => {
                let reason = format!("{format:?} is no picture of 8 bits a channel");
                return Err(GpuError::Resource { name: image.name().to_owned(), reason });
            }
        };
        let (width, height) = image.size();
        let size = u64::from(width) * u64::from(height) * pixel_bytes(image)?;
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let desc = BufferDesc { name: "read back", size, usage, memory: Memory::Readback };
        let landing = Buffer::with_shared(&self.shared, &desc)?;
        self.pass("read back")
            .read(image, Access::TransferSrc)
            .write(&landing, Access::TransferDst)
            .run(|cmd| cmd.copy_image_to_buffer(image, &landing))?;
        self.pass("hand over").read(&landing, Access::HostRead).run(|_| Ok(()))?;
        Ok(Readback { landing, size: (width, height), swap_red_blue, serial: self.serial() })
    }
}

impl Readback {
    /// The number of the frame that fetches it.
    pub fn serial(&self) -> u64 {
        self.serial
    }

    /// Waits for the frame, which must have been submitted, and takes the picture.
    pub fn finish(self, frames: &mut Frames) -> Result<Picture> {
        frames.wait(self.serial)?;
        let mut rgba = self.landing.read()?;
        if self.swap_red_blue {
            rgba.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
        }
        Ok(Picture { width: self.size.0, height: self.size.1, rgba })
    }
}
