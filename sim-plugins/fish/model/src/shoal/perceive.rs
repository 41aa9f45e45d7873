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

/// Looks around.
pub(super) fn perceive(grid: &Grid, kinds: &[Kind], own: &Seen) -> Sight {
    let kind = &kinds[own.kind as usize];
    let range = kind.range() * own.length;
    let keep = kind.mind.apart as f32 * own.length;
    let mut sight = Sight::default();
    grid.near(own.at, range, |other| {
        if other.number == own.number {
            return;
        }
        let way = other.at - own.at;
        let squared = way.length_squared();
        if squared > range * range {
            return;
        }
        // glam's own length takes its root in software.
        let distance = squared.sqrt();
        // Two in the same place go apart by their numbers.
        let toward = if distance > 1e-6 {
            way / distance
        } else {
            Vec3::X * if own.number < other.number { 1.0 } else { -1.0 }
        };
        let touching = 0.5 * (own.width + other.width);
        let crowded = CROWDED * touching;
        if distance < crowded {
            sight.push -= toward * ((crowded - distance) / (crowded - touching)).min(CROWDED);
        }
        let ahead = toward.dot(own.course);
        if ahead < BEHIND {
            return;
        }
        let other_kind = &kinds[other.kind as usize];
        let nearer = |known: Option<Vec3>| known.is_none_or(|known| squared < known.length_squared());
        if other_kind.prey.contains(&own.kind) {
            if nearer(sight.threat) {
                sight.threat = Some(way);
            }
            return;
        }
        if kind.prey.contains(&other.kind) {
            if nearer(sight.prey) {
                sight.prey = Some(way);
            }
            return;
        }
        let keep = keep.max(1.5 * touching);
        if distance < keep {
            sight.apart -= toward * (keep / distance.max(0.1 * keep) - 1.0);
            sight.blocked = sight.blocked.max((ahead * (1.0 - distance / keep)).max(0.0));
        }
        if other.kind == own.kind {
            sight.count += 1;
            sight.courses += other.course;
            sight.ways += way;
            // Those of even numbers court those of odd ones.
            if own.courts && other.courts && (own.number ^ other.number) & 1 == 1 && nearer(sight.mate) {
                sight.mate = Some(way);
            }
        }
    });
    sight
}
