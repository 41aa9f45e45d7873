//! A wind sea as a sum of wave trains: the spectrum of Pierson & Moskowitz (1964), cut into bands.
//!
//! S(ω) = α g²/ω⁵ exp(−β (ω₀/ω)⁴), ω₀ = g/U, is the energy of a sea that the wind U has blown over for so
//! long and so far that it grows no more. Its integral is closed: below ω lies the share F(ω) = exp(−β
//! (ω₀/ω)⁴) of all energy m₀ = α U⁴ / (4 β g²). So each band's train gets exactly the band's energy, r² / 2,
//! and all trains together the spectrum's significant height 4 √m₀ = 0.209 U²/g, however few they are.

use core::{
    f64::consts::{PI, TAU},
    fmt,
};

use glam::DVec2;
use reef_abi as abi;

use super::{
    GRAVITY,
    dispersion::{self, exp, ln},
};
use crate::math::reduce_phase;

/// α of the spectrum.
pub const ALPHA: f64 = 8.1e-3;
/// β of the spectrum.
pub const BETA: f64 = 0.74;
/// The paper's number of trains (§3.4).
pub const DEFAULT_TRAINS: u32 = 30;
/// Most trains of a wind sea.
pub const MOST_TRAINS: u32 = 256;
/// No wave on water is slower than this [m/s], so a weaker wind outruns none and raises none.
pub const CALM: f64 = 0.23;
/// 1 / golden ratio: its multiples modulo 1 never come near one another.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// What wind and water make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindSea {
    /// U: wind at 19.5 m over the water [m/s].
    pub wind: f64,
    /// Where the wind blows to [rad]: 0 along +x, π/2 along +z.
    pub heading: f64,
    /// h [m]: deep water where it is infinite.
    pub depth: f64,
    /// How many trains.
    pub trains: u32,
}

/// Why there are no trains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WindSeaError {
    /// The wind is negative or no number.
    Wind(f64),
    /// The heading is no number.
    Heading(f64),
    /// There is no water.
    Depth(f64),
    /// None, or too many trains.
    Trains(u32),
}

impl fmt::Display for WindSeaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Wind(wind) => write!(f, "the wind is {wind} m/s, but must be a finite number at least 0"),
            Self::Heading(to) => write!(f, "the wind's heading is {to} rad, but must be a finite number"),
            Self::Depth(depth) => write!(f, "the water is {depth} m deep, but must be deeper than 0 m"),
            Self::Trains(count) => {
                write!(f, "{count} wave trains are asked for; allowed are 1 to {MOST_TRAINS}")
            }
        }
    }
}

impl std::error::Error for WindSeaError {}

/// One wave train in f64, from which each step's [`abi::Wave`] is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Train {
    /// r [m]
    pub amplitude: f64,
    /// k [rad/m]
    pub wave_number: f64,
    /// ω [rad/s]
    pub frequency: f64,
    /// θ [rad]: 0 along +x, π/2 along +z.
    pub heading: f64,
    /// [rad] at the time 0.
    pub phase: f64,
}

impl Train {
    /// The train as plugins see it at a time [s]: its phase reduced in f64, so that a day later it is as
    /// exact.
    pub fn at(&self, time: f64) -> abi::Wave {
        let way = DVec2::from_angle(self.heading);
        abi::Wave {
            amplitude: self.amplitude as f32,
            wave_number: self.wave_number as f32,
            frequency: self.frequency as f32,
            phase: reduce_phase(self.phase - self.frequency * time) as f32,
            direction: [way.x as f32, way.y as f32],
            spare: [0.0; 2],
        }
    }
}

/// 4 √m₀ [m] of the wind U [m/s].
pub fn significant_height(wind: f64) -> f64 {
    if wind < CALM { 0.0 } else { 4.0 * energy(wind).sqrt() }
}

/// m₀ [m²].
fn energy(wind: f64) -> f64 {
    let u2 = wind * wind;
    ALPHA * u2 * u2 / (4.0 * BETA * GRAVITY * GRAVITY)
}

impl WindSea {
    /// The trains, greatest amplitude first; none in a calm ([`CALM`]). `random` gives numbers from 0 to 1, 1
    /// excluded: one for all headings, then a phase a train.
    ///
    /// A band's train has the frequency that halves its energy, which also keeps the sea from ever repeating.
    /// Headings spread as cos² over the half circle around the wind: neighbouring bands, which are alike in
    /// energy, take headings far apart, so that every part of the spectrum spreads as a whole.
    pub fn trains(&self, random: &mut impl FnMut() -> f64) -> Result<Vec<Train>, WindSeaError> {
        if !(self.wind.is_finite() && self.wind >= 0.0) {
            return Err(WindSeaError::Wind(self.wind));
        }
        if !self.heading.is_finite() {
            return Err(WindSeaError::Heading(self.heading));
        }
        if self.depth.is_nan() || self.depth <= 0.0 {
            return Err(WindSeaError::Depth(self.depth));
        }
        if !(1..=MOST_TRAINS).contains(&self.trains) {
            return Err(WindSeaError::Trains(self.trains));
        }
        if self.wind < CALM {
            return Ok(Vec::new());
        }
        let all = energy(self.wind);
        let scale = GRAVITY / self.wind;
        let first_heading = random();
        let mut below = 0.0;
        let mut trains: Vec<Train> = (0..self.trains)
            .map(|band| {
                let next = band + 1;
                let upper = if next == self.trains { 1.0 } else { share_below(edge(next, self.trains)) };
                let share = upper - below;
                let middle = 0.5 * (upper + below);
                below = upper;
                let frequency = scale * frequency_above(middle);
                let place = (first_heading + f64::from(band) * GOLDEN).fract();
                Train {
                    amplitude: (2.0 * all * share).sqrt(),
                    wave_number: dispersion::wave_number(frequency, self.depth),
                    frequency,
                    heading: self.heading + spread(place),
                    phase: TAU * random(),
                }
            })
            .collect();
        trains.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
        Ok(trains)
    }
}

/// Lower edge of a band, in multiples of ω₀: evenly spaced in the logarithm, between two ends beyond each of
/// which lies half of a train's mean share of the energy. That belongs to the outermost bands, and makes none
/// of them stand out.
fn edge(band: u32, bands: u32) -> f64 {
    let half = 0.5 / f64::from(bands);
    let [low, high] = [half, 1.0 - half].map(frequency_above);
    low * exp(ln(high / low) * f64::from(band) / f64::from(bands))
}

/// F: the share of all energy below a frequency in multiples of ω₀.
fn share_below(frequency: f64) -> f64 {
    let square = frequency * frequency;
    exp(-BETA / (square * square))
}

/// The frequency below which a share of all energy lies, in multiples of ω₀: the inverse of F.
fn frequency_above(share: f64) -> f64 {
    (BETA / -ln(share)).sqrt().sqrt()
}

/// The heading off the wind's [rad] below which the share `place` of a cos² spread lies: the root of
/// ½ + (θ + sin θ cos θ) / π = place, by bisection, because the slope is zero at both ends.
fn spread(place: f64) -> f64 {
    let [mut low, mut high] = [-0.5 * PI, 0.5 * PI];
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let way = DVec2::from_angle(middle);
        if 0.5 + (middle + way.x * way.y) / PI < place {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}
