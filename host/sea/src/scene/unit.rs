//! How units go with a scene's own length.
//!
//! The rule: a unit that is made of lengths and times goes with the lengths that it names (m, m/s, m³/s, 1/m,
//! 1/m³). One that names matter, too (kg/m³, N, N/m, Pa·s) tells a property of things, which does not depend
//! on what a scene counts in.

/// Units of length; the scene's own stands in for the metre in each.
const LENGTHS: [&str; 8] = ["m", "km", "dm", "cm", "mm", "µm", "um", "nm"];
/// Units that have to do with matter.
const MATTER: [&str; 7] = ["kg", "g", "N", "Pa", "J", "W", "K"];
/// Units that have nothing to do with a length.
const OTHERS: [&str; 14] = ["", "1", "s", "ms", "min", "h", "d", "Hz", "rad", "deg", "°", "px", "%", "dB"];

/// A unit, taken apart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unit {
    /// The power by which it goes with the length.
    pub power: i32,
    /// The first part of it that is no unit known here: it counts as one that has nothing to do with a
    /// length.
    pub unknown: Option<String>,
}

impl Unit {
    /// Reads "m", "m³/s", "1/m", "rad/m", "m^2", "kg·m/s2".
    pub fn read(text: &str) -> Self {
        let (mut power, mut matter, mut unknown) = (0, false, None);
        for (at, side) in text.split('/').enumerate() {
            for part in side.split(['·', '*', ' ']).filter(|part| !part.is_empty()) {
                let (name, exponent) = exponent(part);
                let exponent = if at == 0 { exponent } else { -exponent };
                if LENGTHS.contains(&name) {
                    power += exponent;
                } else if MATTER.contains(&name) {
                    matter = true;
                } else if !OTHERS.contains(&name) {
                    unknown.get_or_insert_with(|| name.to_owned());
                }
            }
        }
        Self { power: if matter { 0 } else { power }, unknown }
    }
}

/// " [m]", or " [m, of `scale` = 0.01]" where a scene has a length of its own; nothing for no unit.
pub fn suffix(unit: &str, scale: f64) -> String {
    match unit {
        "" => String::new(),
        unit if scale != 1.0 && Unit::read(unit).power != 0 => format!(" [{unit}, of `scale` = {scale}]"),
        unit => format!(" [{unit}]"),
    }
}

/// The name and the exponent of a unit's part: "s" and -2 of "s⁻²", "m" and 3 of "m^3" or "m3".
fn exponent(part: &str) -> (&str, i32) {
    const RAISED: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";
    let figure =
        |c: char| c.to_digit(10).or_else(|| Some(RAISED.chars().position(|raised| raised == c)? as u32));
    let sign = |c: char| c == '⁻' || c == '-';
    let name = part.trim_end_matches(|c: char| figure(c).is_some()).trim_end_matches(sign);
    let rest = &part[name.len()..];
    let name = name.trim_end_matches('^');
    // The number 1 in "1/m", not a power of something.
    let Some(value) = rest.chars().find_map(figure).filter(|_| !name.is_empty()) else { return (part, 1) };
    let value = value.min(99) as i32;
    (name, if rest.starts_with(sign) { -value } else { value })
}

/// A number in metres from one in units of `scale` metres, of a unit that goes with the length by `power`.
pub fn to_metres(value: f64, power: i32, scale: f64) -> f64 {
    let factor = (0..power.unsigned_abs()).fold(1.0, |product, _| product * scale);
    if power < 0 { value / factor } else { value * factor }
}

/// The way back, rounded to twelve digits: for people, who wrote neither more nor fewer.
pub fn from_metres(value: f64, power: i32, scale: f64) -> f64 {
    if power == 0 || scale == 1.0 {
        return value;
    }
    let exact = to_metres(value, -power, scale);
    format!("{exact:.11e}").parse().unwrap_or(exact)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_lengths_and_times_go_with_the_length_and_matter_does_not() {
        for (text, power) in [
            ("", 0),
            ("m", 1),
            ("mm", 1),
            ("m/s", 1),
            ("m/s²", 1),
            ("m²/s", 2),
            ("m2/s", 2),
            ("m^2", 2),
            ("m³/s", 3),
            ("1/m", -1),
            ("m⁻¹", -1),
            ("m^-1", -1),
            ("rad/m", -1),
            ("1/m³", -3),
            ("1/m/s", -1),
            ("s", 0),
            ("1/s", 0),
            ("px", 0),
            ("deg", 0),
            ("kg/m³", 0),
            ("N/m", 0),
            ("Pa·s", 0),
            ("kg·m/s2", 0),
        ] {
            assert_eq!(Unit::read(text), Unit { power, unknown: None }, "{text:?}");
        }
        assert_eq!(Unit::read("fish/m²"), Unit { power: -2, unknown: Some("fish".to_owned()) });
    }

    #[test]
    fn a_number_goes_to_metres_and_back() {
        for power in -3..=3 {
            for scale in [1e-6, 0.01, 0.3, 1.0, 7.0, 1e6] {
                let there = to_metres(60.0, power, scale);
                assert!((there / (60.0 * scale.powi(power)) - 1.0).abs() < 1e-15);
                assert_eq!(from_metres(there, power, scale), 60.0, "{power} {scale}");
            }
        }
        assert_eq!(from_metres(0.3, 1, 0.1), 3.0);
    }
}
