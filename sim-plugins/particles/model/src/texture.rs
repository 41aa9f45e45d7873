//! Pictures of particles: bytes of a PNG file as texels, and what they look like from afar.

use reef_flow::color::linear;

/// Eight bits a channel, sRGB, straight alpha.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Texels along a side.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row after row, red, green, blue, alpha.
    pub texels: Vec<u8>,
}

/// A picture from afar: what a sprite with it does on average over its square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// Share that is covered, 0..1.
    pub alpha: f64,
    /// Linear colour of what is covered.
    pub color: [f64; 3],
}

/// The soft round dot of texture 0: (1 − r²)² over the disc is a third of it, and the disc π/4 of its square.
pub const DOT: Mean = Mean { alpha: core::f64::consts::PI / 12.0, color: [1.0; 3] };

impl Picture {
    /// Reads an embedded PNG file of eight bits RGBA; None where it is none.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().ok()?;
        let mut texels = vec![0; reader.output_buffer_size()?];
        let info = reader.next_frame(&mut texels).ok()?;
        if (info.color_type, info.bit_depth) != (png::ColorType::Rgba, png::BitDepth::Eight) {
            return None;
        }
        texels.truncate(info.buffer_size());
        Some(Self { width: info.width, height: info.height, texels })
    }

    /// Its mean.
    pub fn mean(&self) -> Mean {
        let mut alpha = 0.0;
        let mut color = [0.0; 3];
        for texel in self.texels.chunks_exact(4) {
            let a = f64::from(texel[3]) / 255.0;
            alpha += a;
            for i in 0..3 {
                color[i] += a * linear(texel[i]);
            }
        }
        let texels = (self.texels.len() / 4).max(1) as f64;
        let covered = if alpha > 0.0 { alpha } else { 1.0 };
        Mean { alpha: alpha / texels, color: color.map(|c| c / covered) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kind::{FOG_TEXTURE, Kind};

    #[test]
    fn every_embedded_picture_is_one_that_covers_something() {
        let kinds = [Kind::Sand, Kind::Clay, Kind::Phytoplankton, Kind::Detritus, Kind::Plankton];
        for bytes in kinds.map(|kind| kind.defaults().texture).into_iter().chain([FOG_TEXTURE]) {
            let picture = Picture::decode(bytes).expect("a PNG file");
            assert_eq!((picture.width, picture.height), (64, 64));
            let mean = picture.mean();
            assert!((0.01..0.9).contains(&mean.alpha), "{mean:?}");
            assert!(mean.color.iter().all(|c| (0.05..=1.0).contains(c)), "{mean:?}");
        }
        assert_eq!(Picture::decode(b"no picture"), None);
    }
}
