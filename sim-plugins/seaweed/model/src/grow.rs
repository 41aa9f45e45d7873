//! From a species' table to its skeleton, and to the limbs that its mesh is made of.

use core::{f64::consts, ops::Range};

use glam::DVec2;
use reef_flow::waves::GRAVITY;

use crate::{
    skeleton::{Segment, Skeleton, SkeletonError},
    species::{Species, Tissue},
};

/// Most segments that a species may grow: as many joints move a mesh.
pub const MOST_GROWN: u64 = 256;

/// Turns any number of stems evenly around a holdfast [rad].
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// What a limb is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// It stands in the ground.
    Stem,
    /// It goes on where another ends, beside its twin.
    Fork,
    /// It hangs on a stem.
    Blade,
}

/// A row of segments, each on the one before.
#[derive(Clone, Debug, PartialEq)]
pub struct Limb {
    /// What it is.
    pub part: Part,
    /// Its segments, by their numbers in the skeleton.
    pub segments: Range<usize>,
    /// The segment that it stands on; None: the ground.
    pub on: Option<usize>,
    /// Its length [m].
    pub length: f64,
    /// Lift of the bladder at its base [N].
    pub bladder: f64,
    /// Whether forks go on at its end.
    pub goes_on: bool,
    /// Which one of its kind on what it stands on.
    pub number: u32,
}

/// The skeleton of a species at a size of 1.
///
/// # Errors
/// More segments than a plant may have.
pub fn skeleton(species: &Species) -> Result<Skeleton, SkeletonError> {
    Ok(grow(species)?.0)
}

/// The skeleton of a species at a size of 1, and the limbs that it is made of.
///
/// # Errors
/// More segments than a plant may have.
pub fn grow(species: &Species) -> Result<(Skeleton, Vec<Limb>), SkeletonError> {
    let count = segments(species);
    if count > MOST_GROWN {
        let problem = format!("makes {count} with all branches; at most {MOST_GROWN} are allowed");
        return Err(SkeletonError { segment: None, key: "stem.segments", problem });
    }
    let room = Vec::with_capacity(count as usize);
    let mut plant = Growing { species, segments: room, turns: Vec::new(), limbs: Vec::new() };
    for number in 0..species.stem.count {
        plant.stem(number);
    }
    // Parents grow before what stands on them: the skeleton keeps the order, and with it the limbs' numbers.
    Ok((Skeleton::new(&plant.segments)?, plant.limbs))
}

/// How many segments a species has.
pub fn segments(species: &Species) -> u64 {
    let branches = (1_u64 << (species.forks.times + 1)) - 2;
    let forks = branches * u64::from(species.forks.segments);
    let blades = u64::from(species.blades.count) * u64::from(species.blades.segments);
    u64::from(species.stem.count) * (u64::from(species.stem.segments) + forks + blades)
}

/// A plant on its way.
struct Growing<'a> {
    species: &'a Species,
    segments: Vec<Segment>,
    /// How far the base of each is turned about the plant's axis [rad].
    turns: Vec<f64>,
    limbs: Vec<Limb>,
}

/// Where a branch begins, and how.
#[derive(Clone, Copy)]
struct Branch<'a> {
    part: Part,
    number: u32,
    goes_on: bool,
    /// On which segment, how high on it [m]; None: on the ground.
    on: Option<(usize, f64)>,
    /// Turn about the plant's axis, and lean from what it stands on [rad].
    azimuth: f64,
    lean: f64,
    /// Further bend at rest to its tip [rad], in the direction of its lean.
    curve: f64,
    /// Turn of each of its segments [rad].
    twist: f64,
    count: u32,
    length: f64,
    tissue: &'a Tissue,
    /// Lift at its first segment [N].
    bladder: f64,
}

impl<'a> Growing<'a> {
    fn stem(&mut self, number: u32) {
        let species = self.species;
        let stem = &species.stem;
        // The first stands in the middle.
        let azimuth = f64::from(number) * GOLDEN_ANGLE;
        let out = (f64::from(number) / f64::from(stem.count.max(2) - 1)).sqrt();
        let own = self.branch(&Branch {
            part: Part::Stem,
            number,
            goes_on: species.forks.times > 0,
            on: None,
            azimuth,
            lean: stem.spread.to_radians() * out,
            curve: stem.curve.to_radians(),
            twist: stem.twist.to_radians(),
            count: stem.segments,
            length: stem.length,
            tissue: &stem.tissue,
            bladder: 0.0,
        });
        self.blades(own.clone());
        if species.forks.times > 0 {
            self.fork(own.end - 1, azimuth, species.forks.length, species.forks.times);
        }
    }

    /// Adds a branch; returns its segments.
    fn branch(&mut self, branch: &Branch<'a>) -> Range<usize> {
        let first = self.segments.len();
        let length = branch.length / f64::from(branch.count);
        let bend = branch.curve / f64::from(branch.count);
        for i in 0..branch.count {
            let (parent, height) = match branch.on {
                Some((parent, height)) if i == 0 => (Some(parent), height),
                None if i == 0 => (None, 0.0),
                _ => (Some(self.segments.len() - 1), length),
            };
            let before = parent.map_or(0.0, |parent| self.turns[parent]);
            let turn = if i == 0 { branch.azimuth } else { before + branch.twist };
            // Two successive segments bend about two axes: each takes its part of the way there.
            let along = 2.0 * bend * DVec2::from_angle(turn - branch.azimuth).x;
            let phi = if i == 0 { branch.lean + bend } else { along };
            let up = (f64::from(i) + 0.5) / f64::from(branch.count);
            let mut segment =
                Segment { parent, height, theta: turn - before, phi, ..piece(branch.tissue, length, up) };
            if i == 0 {
                segment.lift += branch.bladder;
            }
            self.segments.push(segment);
            self.turns.push(turn);
        }
        let segments = first..self.segments.len();
        self.limbs.push(Limb {
            part: branch.part,
            segments: segments.clone(),
            on: branch.on.map(|(on, _)| on),
            length: branch.length,
            bladder: branch.bladder,
            goes_on: branch.goes_on,
            number: branch.number,
        });
        segments
    }

    /// The blades of a stem.
    fn blades(&mut self, stem: Range<usize>) {
        let species = self.species;
        let blades = &species.blades;
        let each = species.stem.length / stem.len() as f64;
        for i in 0..blades.count {
            let share = f64::from(i) / f64::from(blades.count.max(2) - 1);
            let place = (blades.first + (1.0 - blades.first) * share) * species.stem.length;
            let on = ((place / each) as usize).min(stem.len() - 1);
            // Below the segment's end: a blade there would be the stem itself that goes on.
            let height = (place - on as f64 * each).clamp(0.0, 0.99 * each);
            self.branch(&Branch {
                part: Part::Blade,
                number: i,
                goes_on: false,
                on: Some((stem.start + on, height)),
                azimuth: f64::from(i) * blades.spiral.to_radians(),
                lean: blades.angle.to_radians(),
                curve: 0.0,
                twist: consts::FRAC_PI_2,
                count: blades.segments,
                length: blades.length * (1.0 + (blades.tip_length - 1.0) * share),
                tissue: &blades.tissue,
                bladder: blades.bladder,
            });
        }
    }

    /// Forks a branch in two, and these again.
    fn fork(&mut self, on: usize, azimuth: f64, length: f64, times: u32) {
        let species = self.species;
        let forks = &species.forks;
        let height = self.segments[on].length;
        for (number, side) in [(0, 0.0), (1, consts::PI)] {
            let own = self.branch(&Branch {
                part: Part::Fork,
                number,
                goes_on: times > 1,
                on: Some((on, height)),
                azimuth: azimuth + side,
                lean: forks.angle.to_radians(),
                curve: 0.0,
                twist: consts::FRAC_PI_2,
                count: forks.segments,
                length,
                tissue: &species.stem.tissue,
                bladder: forks.bladder,
            });
            if times > 1 {
                let next = azimuth + side + forks.turn.to_radians();
                self.fork(own.end - 1, next, length * forks.shrink, times - 1);
            }
        }
    }
}

/// A piece of tissue of a length [m] at a share of its branch's length.
pub(crate) fn piece(tissue: &Tissue, length: f64, up: f64) -> Segment {
    let rigidity = tissue.rigidity * (1.0 + (tissue.tip_rigidity - 1.0) * up);
    let stiffness = rigidity / length;
    let (mass, added) = (tissue.mass * length, tissue.added_mass * length);
    // The water that it takes the place of weighs as much as it does and what lifts it.
    let displaced = mass + tissue.lift * length / GRAVITY;
    Segment {
        length,
        stiffness,
        damping: tissue.damping * stiffness,
        mass: mass + added,
        carried: displaced.max(0.0) + added,
        drag: tissue.drag * length,
        lift: tissue.lift * length,
        weight: mass * GRAVITY,
        radius: 0.5 * tissue.thickness.max(0.2 * tissue.width),
        ..Segment::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        reference::Reference,
        species::{Blades, Forks, Stem},
    };

    #[test]
    fn a_species_grows_the_segments_that_its_table_counts() {
        let species = Species {
            stem: Stem { count: 2, segments: 5, ..Stem::default() },
            forks: Forks { times: 2, segments: 3, ..Forks::default() },
            blades: Blades { count: 4, segments: 2, ..Blades::default() },
            ..Species::default()
        };
        // Two stems of 5, each with 4 × 2 of blades and (2 + 4) × 3 of branches.
        assert_eq!(segments(&species), 2 * (5 + 8 + 18));
        let grown = skeleton(&species).unwrap();
        assert_eq!(grown.len(), 62);
        // Stem, blades, and one of each pair of forks: the other goes on where its parent ends.
        assert_eq!(grown.computed(2), 2 * (1 + 4 + 3));
    }

    #[test]
    fn too_many_segments_are_refused_by_their_key() {
        let stem = Stem { count: 64, segments: 256, ..Stem::default() };
        let error = skeleton(&Species { stem, ..Species::default() }).unwrap_err();
        assert_eq!(
            error.to_string(),
            "stem.segments: makes 16384 with all branches; at most 256 are allowed"
        );
    }

    #[test]
    fn a_curve_at_rest_leads_where_the_branch_leans() {
        let stem = Stem { segments: 40, curve: 90.0, ..Stem::default() };
        let grown = skeleton(&Species { stem, ..Species::default() }).unwrap();
        let tip = Reference::new(&grown).ends()[39];
        // A quarter of a circle of 1 m: 2/π up and as much toward the lean, which φ > 0 turns toward +z.
        assert!(tip.x.abs() < 0.03, "{tip}");
        assert!((tip.y - 0.637).abs() < 0.04 && (tip.z - 0.637).abs() < 0.04, "{tip}");
    }
}
