//! The textures of what floats in the sea, painted by code: the same pixels on every machine, because only
//! additions, products, quotients and square roots go into them.
//!
//! Each is [`SIDE`] by [`SIDE`] texels, sRGB with straight alpha, as PNG files are. Colours are light, so
//! that a sprite's own colour can tint them.

pub mod canvas;
pub mod specks;

use std::io::Write;

use canvas::{Canvas, Texel};

/// Texels along a side.
pub const SIDE: usize = 64;

/// What paints a texture.
pub type Painter = fn() -> Canvas;

/// A texture by its name: the file is `assets/textures/NAME.png`.
pub const TEXTURES: [(&str, Painter); 6] = [
    ("sand", specks::sand),
    ("clay", specks::clay),
    ("phytoplankton", specks::phytoplankton),
    ("detritus", specks::detritus),
    ("plankton", specks::plankton),
    ("fog", specks::fog),
];

/// The texels as files have them: four bytes each, sRGB and straight alpha.
pub fn bytes(texels: &[Texel]) -> Vec<u8> {
    texels.iter().flat_map(|texel| texel.encode()).collect()
}

/// Writes a PNG file.
pub fn write_png(out: impl Write, rgba: &[u8]) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(out, SIDE as u32, SIDE as u32);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgba)?;
    writer.finish()
}
