//! What all fish of a kind have in common, as numbers that a step needs.

use reef_sdk::abi::fnv1a_32;

use super::Kind;

/// Of a kind, for fish of all sizes: lengths and speeds are over the fish's own length.
#[derive(Clone, Debug)]
pub(super) struct Habits {
    /// Greatest extents from left to right and from top to bottom, in lengths.
    pub(super) width: f32,
    pub(super) height: f32,
    /// Fastest, in lengths a second; its beat then [Hz], and its fastest turn [rad/s].
    pub(super) top: f32,
    pub(super) beat: f32,
    pub(super) turn: f32,
    /// How its beat rises with its speed, from none.
    pub(super) beats: Vec<Rise>,
    /// How far it sees, in lengths.
    pub(super) range: f32,
    /// See [`crate::species::Mind`].
    pub(super) apart: f32,
    pub(super) separation: f32,
    pub(super) alignment: f32,
    pub(super) cohesion: f32,
    pub(super) wander: f32,
    pub(super) cruise: f32,
    pub(super) home: f32,
    pub(super) mating: bool,
    /// Species of other modules that frighten it, by the hashes of their names.
    pub(super) fears: Vec<u32>,
    /// Kinds that it hunts, and kinds that hunt it.
    pub(super) prey: Vec<u32>,
    pub(super) hunters: Vec<u32>,
}

/// How much faster a fish beats for each length a second between two speeds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rise {
    /// Lengths a second.
    pub(super) from: f32,
    pub(super) until: f32,
    /// [1]
    pub(super) slope: f32,
}

impl Rise {
    /// Between two known pairs of a beat [Hz] and a speed [m/s].
    fn of(pair: &[[f64; 2]], length: f64) -> Self {
        let [[slow, from], [fast, until]] = [pair[0], pair[1]];
        let slope = (fast - slow) / (until - from) * length;
        Self { from: (from / length) as f32, until: (until / length) as f32, slope: slope as f32 }
    }
}

impl Habits {
    /// Of all kinds.
    pub(super) fn of(kinds: &[Kind]) -> Vec<Self> {
        let hunters = |number: usize| {
            let hunt = |kind: &Kind| kind.prey.contains(&(number as u32));
            (0..).zip(kinds).filter(|(_, kind)| hunt(kind)).map(|(hunter, _)| hunter).collect()
        };
        kinds.iter().enumerate().map(|(number, kind)| Self::one(kind, hunters(number))).collect()
    }

    fn one(kind: &Kind, hunters: Vec<u32>) -> Self {
        let (length, mind) = (kind.length(), &kind.mind);
        Self {
            width: (kind.plan.body().width() / length) as f32,
            height: (kind.height() / length) as f32,
            top: (kind.gait.top_speed() / length) as f32,
            beat: kind.gait.top_beat() as f32,
            turn: kind.gait.fastest_turn() as f32,
            beats: kind.gait.speeds().windows(2).map(|pair| Rise::of(pair, length)).collect(),
            range: kind.range(),
            apart: mind.apart as f32,
            separation: mind.separation as f32,
            alignment: mind.alignment as f32,
            cohesion: mind.cohesion as f32,
            wander: mind.wander as f32,
            cruise: mind.cruise as f32,
            home: mind.home as f32,
            mating: mind.mating,
            fears: mind.fears.iter().map(|name| fnv1a_32(name.as_bytes())).collect(),
            prey: kind.prey.clone(),
            hunters,
        }
    }

    /// Whether one of two kinds hunts the other.
    pub(super) fn at_odds(&self, other: u32) -> bool {
        self.prey.contains(&other) || self.hunters.contains(&other)
    }
}
