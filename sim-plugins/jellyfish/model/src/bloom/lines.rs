//! An animal's slice as lines: springs and muscles, the velocity of its water, dye in it.

use glam::{DVec2, DVec3};
use reef_sdk::abi::DebugLine;

use super::{Bloom, animal::Animal};
use crate::slice::{CONTRACTION, Slice};

/// Which lines are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// Springs, velocities and dye.
    All,
    /// Springs and muscles.
    Springs,
    /// Velocities.
    Water,
    /// Springs and dye.
    Dye,
}

/// Channels, and colours (sRGB 0xAABBGGRR) of what has one colour.
const SPRINGS: (u32, u32) = (0, 0xff30_3030);
const MUSCLES: u32 = 1;
const WATER: u32 = 2;
const DYE: (u32, u32) = (3, 0xffe8_f8ff);
/// A muscle at rest, and one that has contracted: red, green, blue.
const SLACK: [f64; 3] = [200.0, 190.0, 180.0];
const SHORT: [f64; 3] = [230.0, 30.0, 20.0];
/// Slow and fast water.
const SLOW: [f64; 3] = [40.0, 110.0, 190.0];
const FAST: [f64; 3] = [255.0, 220.0, 60.0];
/// Arrows on a side of their square; its width, in widths of the bell.
const ARROWS: usize = 36;
const SPREAD: f64 = 4.5;
/// Velocity, in diameters of the bell a second, of an arrow that is as long as arrows are apart; the most
/// that one is longer.
const UNIT: f64 = 1.5;
const LONGEST: f64 = 1.6;
/// Slower water than this share of that has no arrow.
const STILL: f64 = 0.02;
/// Time whose way a speck of dye shows [s], and its least length in widths of the bell.
const STREAK: f64 = 0.08;
const SPECK: f64 = 0.012;

fn mixed(from: [f64; 3], to: [f64; 3], share: f64) -> u32 {
    let share = share.clamp(0.0, 1.0);
    let [r, g, b] = [0, 1, 2].map(|i| (from[i] + (to[i] - from[i]) * share) as u32);
    0xff00_0000 | (b << 16) | (g << 8) | r
}

fn between([from, to]: [DVec3; 2], color: u32, channel: u32) -> DebugLine {
    let delta = (to - from).as_vec3().to_array();
    DebugLine { from: from.to_array(), delta, color, channel, ..DebugLine::default() }
}

/// Springs and muscles of a slice.
fn springs(slice: &Slice<f32>, world: impl Fn(DVec2) -> DVec3) -> impl Iterator<Item = DebugLine> {
    slice.springs().map(move |(ends, short)| {
        let (color, channel) = match short {
            None => (SPRINGS.1, SPRINGS.0),
            Some(short) => (mixed(SLACK, SHORT, short / CONTRACTION), MUSCLES),
        };
        between(ends.map(&world), color, channel)
    })
}

impl Bloom {
    /// Adds the lines of an animal, while there are fewer than `most`.
    pub fn lines(&self, animal: usize, shown: Shown, most: usize, lines: &mut Vec<DebugLine>) {
        if let Some(animal) = self.animals.get(animal) {
            animal.lines(shown, most, lines);
        }
    }
}

impl Animal {
    fn lines(&self, shown: Shown, most: usize, lines: &mut Vec<DebugLine>) {
        let world = self.world();
        let line = |from: DVec2, to: DVec2, color: u32, channel: u32| {
            between([from, to].map(&world), color, channel)
        };
        let slice = &self.own.slice;
        let across = self.cross.iter().flat_map(|cross| springs(&cross.slice, self.world_across(cross)));
        let springs = springs(slice, &world).chain(across);
        let corner = slice.corner();
        let flow = |place: DVec2| DVec2::from(slice.water().velocity((place - corner).to_array()));
        let middle = slice.place();
        let apart = SPREAD * self.diameter / ARROWS as f64;
        let window = slice.water().grid().width();
        let water = (0..ARROWS * ARROWS).filter_map(|k| {
            let cell = DVec2::new((k % ARROWS) as f64, (k / ARROWS) as f64) + 0.5;
            let place = middle + (cell - 0.5 * ARROWS as f64) * apart;
            let inside = (place - corner).clamp(DVec2::ZERO, DVec2::splat(window)) == place - corner;
            let share = flow(place) / (UNIT * self.diameter);
            let fast = share.length();
            let way = (share * apart).clamp_length_max(LONGEST * apart);
            (inside && fast > STILL).then(|| line(place, place + way, mixed(SLOW, FAST, fast), WATER))
        });
        let dye = self.tracers.iter().map(|tracer| {
            let way = flow(*tracer) * STREAK;
            let least = DVec2::new(SPECK * self.diameter, 0.0);
            let way = if way.length_squared() < least.length_squared() { least } else { way };
            line(*tracer - way, *tracer, DYE.1, DYE.0)
        });
        let room = most.saturating_sub(lines.len());
        match shown {
            Shown::All => lines.extend(springs.chain(water).chain(dye).take(room)),
            Shown::Springs => lines.extend(springs.take(room)),
            Shown::Water => lines.extend(water.take(room)),
            Shown::Dye => lines.extend(springs.chain(dye).take(room)),
        }
    }
}
