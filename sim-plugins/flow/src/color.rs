//! sRGB, the same bytes on every machine.

use glam::DVec2;

/// The linear value, 0 to 1, of a byte in sRGB.
pub fn linear(byte: u8) -> f64 {
    let x = f64::from(byte) / 255.0;
    if x <= 0.040_45 { x / 12.92 } else { DVec2::splat((x + 0.055) / 1.055).powf(2.4).x }
}

/// The byte in sRGB of a linear value, which is cut to 0..1.
pub fn byte(linear: f64) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let curve = if x <= 0.003_130_8 { x * 12.92 } else { 1.055 * DVec2::splat(x).powf(1.0 / 2.4).x - 0.055 };
    (curve * 255.0).round() as u8
}

/// Linear red, green, blue of a colour like "#A8182A"; None where it is written in another way.
pub fn linear_rgb(text: &str) -> Option<[f32; 3]> {
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii())?;
    let mut rgb = [0.0; 3];
    for (channel, at) in rgb.iter_mut().zip([0, 2, 4]) {
        *channel = linear(u8::from_str_radix(&digits[at..at + 2], 16).ok()?) as f32;
    }
    Some(rgb)
}

/// Texels of a picture of so many across and along, four bytes each, row after row. `at` tells what is in a
/// texel's middle: u from the left (0) to the right (1), v from the last row (0) up (1).
pub fn texels([width, height]: [u32; 2], mut at: impl FnMut(f64, f64) -> [u8; 4]) -> Vec<u8> {
    let middle = |number: u32, count: u32| (f64::from(number) + 0.5) / f64::from(count);
    let mut texels = Vec::with_capacity(4 * width as usize * height as usize);
    for row in 0..height {
        let v = 1.0 - middle(row, height);
        for column in 0..width {
            texels.extend(at(middle(column, width), v));
        }
    }
    texels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_back_from_linear_light() {
        assert!((0..=255).all(|b| byte(linear(b)) == b));
    }

    #[test]
    fn pictures_are_asked_for_at_the_middles_of_texels_from_the_top() {
        let mut asked = Vec::new();
        let texels = texels([2, 4], |u, v| {
            asked.push([u, v]);
            [asked.len() as u8; 4]
        });
        assert_eq!(texels, [1, 2, 3, 4, 5, 6, 7, 8].map(|number| [number; 4]).concat());
        assert_eq!(asked[..3], [[0.25, 0.875], [0.75, 0.875], [0.25, 0.625]]);
        assert_eq!(asked[7], [0.75, 0.125]);
    }

    #[test]
    fn colours_are_read_as_srgb() {
        assert_eq!(linear_rgb("#000000"), Some([0.0; 3]));
        assert_eq!(linear_rgb("#FFffFF"), Some([1.0; 3]));
        // 0x80 is 0.2159 in linear light, by the definition of sRGB.
        assert!((linear_rgb("#800000").unwrap_or_default()[0] - 0.215_86).abs() < 1e-4);
        for bad in ["", "red", "#12345", "#1234567", "#12345g", "#é2345"] {
            assert_eq!(linear_rgb(bad), None, "{bad}");
        }
    }
}
