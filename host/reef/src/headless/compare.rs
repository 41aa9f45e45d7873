//! Comparing a picture with its golden one, and drawing the difference.

use reef_gpu::Picture;

/// A channel may differ by this much: what another instruction set's rounding does.
pub const TOLERANCE: u8 = 2;

/// What may be beyond [`TOLERANCE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowance {
    /// This share of the pixels may be.
    pub exceptions: f64,
    /// No channel may differ by more than this.
    pub limit: u8,
}

/// For a picture by the driver that made the golden one.
pub const SAME_DRIVER: Allowance = Allowance { exceptions: 0.001, limit: 16 };
/// For a picture by another driver: Vulkan leaves it to them where in a pixel the samples are, which pixels a
/// thin line takes, and how many bits interpolation has, so what differs are the edges of what is thin. (Seen
/// on hardware: up to 0.23 % of the pixels, by up to 30.)
pub const OTHER_DRIVER: Allowance = Allowance { exceptions: 0.005, limit: 64 };

/// How two pictures differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Pixels in which a channel differs by more than [`TOLERANCE`].
    pub exceptions: usize,
    /// Pixels in all.
    pub pixels: usize,
    /// The greatest difference of a channel.
    pub greatest: u8,
    /// The sizes are not the same; nothing else was compared.
    pub other_size: bool,
}

impl Difference {
    /// Whether the pictures count as the same.
    pub fn passes(&self, allowance: Allowance) -> bool {
        !self.other_size
            && self.greatest <= allowance.limit
            && self.exceptions as f64 <= allowance.exceptions * self.pixels as f64
    }
}

/// Compares colour channels pixel by pixel.
pub fn compare(expected: &Picture, actual: &Picture) -> Difference {
    let pixels = actual.rgba.len() / 4;
    let same_size = (expected.width, expected.height, expected.rgba.len())
        == (actual.width, actual.height, actual.rgba.len());
    if !same_size || pixels == 0 {
        return Difference { exceptions: pixels, pixels, greatest: 255, other_size: true };
    }
    let mut difference = Difference { exceptions: 0, pixels, greatest: 0, other_size: false };
    for (a, b) in expected.rgba.chunks_exact(4).zip(actual.rgba.chunks_exact(4)) {
        let d = pixel_difference(a, b);
        difference.greatest = difference.greatest.max(d);
        difference.exceptions += usize::from(d > TOLERANCE);
    }
    difference
}

fn pixel_difference(a: &[u8], b: &[u8]) -> u8 {
    (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0)
}

/// The difference as a picture: the expected one in dim grey, what differs in yellow to red.
pub fn difference_picture(expected: &Picture, actual: &Picture) -> Picture {
    let mut rgba = Vec::with_capacity(actual.rgba.len());
    for (i, b) in actual.rgba.chunks_exact(4).enumerate() {
        let a = expected.rgba.get(i * 4..i * 4 + 4).unwrap_or(&[0, 0, 0, 255]);
        let d = pixel_difference(a, b);
        if d > TOLERANCE {
            let strong = ((f32::from(d) / 32.0).min(1.0) * 255.0) as u8;
            rgba.extend([255, 255 - strong, 0, 255]);
        } else {
            let grey = ((u16::from(a[0]) + u16::from(a[1]) + u16::from(a[2])) / 12) as u8;
            rgba.extend([grey, grey, grey, 255]);
        }
    }
    Picture { width: actual.width, height: actual.height, rgba }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waves(shift: u32) -> Picture {
        let mut rgba = Vec::new();
        for y in 0..90_u32 {
            for x in 0..160_u32 {
                let v = ((x + shift) * 5 % 256) as u8;
                rgba.extend([v, (y * 2) as u8, 90, 255]);
            }
        }
        Picture { width: 160, height: 90, rgba }
    }

    #[test]
    fn a_picture_is_the_same_as_itself_and_as_one_with_rounding_noise() {
        let mut noisy = waves(0);
        for v in noisy.rgba.iter_mut().step_by(7) {
            *v = v.saturating_add(TOLERANCE);
        }
        assert!(compare(&waves(0), &waves(0)).passes(SAME_DRIVER));
        assert!(compare(&waves(0), &noisy).passes(SAME_DRIVER));
    }

    #[test]
    fn a_picture_that_is_shifted_by_one_pixel_fails() {
        assert!(!compare(&waves(0), &waves(1)).passes(SAME_DRIVER));
        assert!(!compare(&waves(0), &waves(1)).passes(OTHER_DRIVER));
    }

    #[test]
    fn one_missing_spot_fails_and_a_few_small_exceptions_pass() {
        let mut spot = waves(0);
        spot.rgba[4000] = spot.rgba[4000].wrapping_add(SAME_DRIVER.limit + 1);
        assert!(!compare(&waves(0), &spot).passes(SAME_DRIVER), "one pixel beyond the limit");
        let mut few = waves(0);
        for i in 0..14 {
            few.rgba[i * 400 + 1] += 5;
        }
        assert!(compare(&waves(0), &few).passes(SAME_DRIVER), "14 of 14 400 pixels");
        few.rgba[15 * 400 + 1] += 5;
        assert!(!compare(&waves(0), &few).passes(SAME_DRIVER), "15 of 14 400 pixels are more than 0.1 %");
        assert!(compare(&waves(0), &few).passes(OTHER_DRIVER));
    }

    #[test]
    fn another_size_fails() {
        let mut low = waves(0);
        low.height = 89;
        low.rgba.truncate(160 * 89 * 4);
        let difference = compare(&waves(0), &low);
        assert!(difference.other_size && !difference.passes(SAME_DRIVER));
    }

    #[test]
    fn the_difference_shows_where() {
        let mut spot = waves(0);
        spot.rgba[4000] = spot.rgba[4000].wrapping_add(100);
        let shown = difference_picture(&waves(0), &spot);
        assert_eq!(&shown.rgba[4000..4003], &[255, 0, 0]);
        assert_eq!(shown.rgba[0], shown.rgba[1]);
    }
}
