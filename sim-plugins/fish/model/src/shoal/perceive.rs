//! What a fish perceives of others: those within its range, all around but for the 60 degrees behind it (Tu
//! and Terzopoulos 1994, §5; thesis, chapter 2).

use glam::Vec3;

use super::{
    Kind,
    grid::{Grid, Seen},
};

/// Cosine of the angle from its course beyond which a fish sees nothing: 150 degrees.
const BEHIND: f32 = -0.866_025_4;
/// Within how many widths of both the water between two fish carries them apart.
const CROWDED: f32 = 2.0;

/// What others do to a fish.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sight {
    /// Away from those that are too near, the more the nearer.
    pub(super) apart: Vec3,
    /// Sums over its own kind: courses, and ways to them [m].
    pub(super) courses: Vec3,
    pub(super) ways: Vec3,
    pub(super) count: u32,
    /// Ways to the nearest predator, prey and mate [m].
    pub(super) threat: Option<Vec3>,
    pub(super) prey: Option<Vec3>,
    pub(super) mate: Option<Vec3>,
    /// The way that the water between it and its neighbours carries it, 1 where two touch.
    pub(super) push: Vec3,
    /// How much is right in front of it, 0..1.
    pub(super) blocked: f32,
}

/// Of so many of its own kind at most a fish takes note: in a dense shoal it looks less far.
pub(super) const NOTED: u32 = 24;

/// Looks around.
pub(super) fn perceive(grid: &Grid, kinds: &[Kind], own: &Seen) -> Sight {
    let kind = &kinds[own.kind as usize];
    let mut sight = Sight::default();
    among(grid, kinds, own, &mut sight);
    let range = kind.range() * own.length;
    for hunter in grid.hunters() {
        if kinds[hunter.kind as usize].prey.contains(&own.kind)
            && let Some((way, ..)) = seen(own, hunter, range)
        {
            sight.threat = nearer(sight.threat, way);
        }
    }
    if !kind.prey.is_empty() {
        grid.near(own.at, range, |other| {
            if kind.prey.contains(&other.kind)
                && let Some((way, ..)) = seen(own, other, range)
            {
                sight.prey = nearer(sight.prey, way);
            }
        });
    }
    sight
}

/// The way to another that a fish sees within a range [m], how far that is, and the cosine of where it is.
fn seen(own: &Seen, other: &Seen, range: f32) -> Option<(Vec3, f32, f32)> {
    let way = other.at - own.at;
    let squared = way.length_squared();
    if squared > range * range || other.number == own.number {
        return None;
    }
    // glam's own length takes its root in software.
    let distance = squared.sqrt();
    let ahead = way.dot(own.course) / distance.max(f32::MIN_POSITIVE);
    (ahead >= BEHIND).then_some((way, distance, ahead))
}

/// The shorter way.
fn nearer(known: Option<Vec3>, way: Vec3) -> Option<Vec3> {
    match known {
        Some(known) if known.length_squared() <= way.length_squared() => Some(known),
        _ => Some(way),
    }
}

/// What the others around do to a fish, but for those that it hunts or flees.
fn among(grid: &Grid, kinds: &[Kind], own: &Seen, sight: &mut Sight) {
    let kind = &kinds[own.kind as usize];
    let range = own.reach * own.length;
    let keep = kind.mind.apart as f32 * own.length;
    grid.near(own.at, range, |other| {
        let way = other.at - own.at;
        let squared = way.length_squared();
        if squared > range * range || other.number == own.number {
            return;
        }
        let touching = 0.5 * (own.width + other.width);
        let crowded = CROWDED * touching;
        if squared < crowded * crowded {
            let distance = squared.sqrt();
            // Two in the same place go apart by their numbers.
            let toward = if distance > 1e-6 {
                way / distance
            } else {
                Vec3::X * if own.number < other.number { 1.0 } else { -1.0 }
            };
            sight.push -= toward * ((crowded - distance) / (crowded - touching)).min(CROWDED);
        }
        let other_kind = &kinds[other.kind as usize];
        if other_kind.prey.contains(&own.kind) || kind.prey.contains(&other.kind) {
            return;
        }
        let Some((way, distance, ahead)) = seen(own, other, range) else { return };
        let keep = keep.max(1.5 * touching);
        if distance < keep {
            let toward = way / distance.max(f32::MIN_POSITIVE);
            sight.apart -= toward * (keep / distance.max(0.1 * keep) - 1.0);
            sight.blocked = sight.blocked.max((ahead * (1.0 - distance / keep)).max(0.0));
        }
        if other.kind == own.kind {
            sight.count += 1;
            sight.courses += other.course;
            sight.ways += way;
            // Those of even numbers court those of odd ones.
            if own.courts && other.courts && (own.number ^ other.number) & 1 == 1 {
                sight.mate = nearer(sight.mate, way);
            }
        }
    });
}
