//! From a species and a seed to one individual: the foot, and the fibres on its disc (§3.1).

use glam::{DVec2, DVec3};

use crate::{
    frame::Frame,
    math,
    phyllotaxis::{self, Seat},
    shape::FibreShape,
    species::Species,
    wide::{Blend, Place},
};
use reef_flow::random::Random;

/// One fibre of a plant.
#[derive(Clone, Debug)]
pub struct Strand {
    /// At rest.
    pub shape: FibreShape,
    /// On what carries it: the plant's stand for the foot, the foot's top for the others.
    pub place: Place,
    /// K [N/m] and n of eq. (11).
    pub stiffness: (f64, f64),
    /// τ [s].
    pub relaxation: f64,
    /// Force at the root that breaks it off [N]; infinite: never.
    pub break_force: f64,
    /// A hash: small differences of hue.
    pub variation: u32,
}

/// A fibre that follows three guides: their numbers among the plant's guides, and how much each counts.
pub type Follower = (Strand, [u32; 3], [f32; 3]);

/// One individual.
#[derive(Clone, Debug)]
pub struct Plant {
    /// The wide fibre; None: the others stand on the ground.
    pub foot: Option<Strand>,
    /// The fibres that are simulated.
    pub guides: Vec<Strand>,
    /// The fibres between them, and which guides they follow: numbers in `guides` and weights.
    pub followers: Vec<Follower>,
    /// Fibres that the species asks for; the disc may have had room for fewer.
    pub wanted: u32,
    /// Radius of a sphere around [`Plant::middle`] that no node ever leaves [m].
    pub reach: f64,
    /// Middle of that sphere above the plant's origin [m].
    pub middle: f64,
    /// Radius of the crown at rest [m].
    pub crown: f64,
}

/// How far below its disc's surface a tentacle is rooted, in radii of its root.
const SUNK: f64 = 0.6;

impl Plant {
    /// An individual of `species`, `scale` times its size, with the differences that `seed` gives it.
    pub fn grow(species: &Species, scale: f64, seed: u64) -> Self {
        let mut random = Random::new(seed, 1);
        let size = scale * (1.0 + species.variation.size * random.signed());
        let foot = species.has_foot().then(|| foot(species, size, &mut random));
        let seats = seats(species, size, seed);
        let strands: Vec<Strand> =
            seats.iter().map(|seat| tentacle(species, size, seat, foot.is_some(), seed)).collect();
        let (guides, followers) = split(strands, species.tentacles.guides as usize);
        let longest = guides
            .iter()
            .chain(followers.iter().map(|(strand, ..)| strand))
            .map(|strand| strand.shape.length() + strand.shape.root_radius)
            .fold(0.0, f64::max);
        let disc = species.foot.disc_radius * size;
        let height = foot.as_ref().map_or(0.0, |foot| foot.shape.length());
        // A foot may lean anywhere around its base; the disc's rim and the longest fibre go on top.
        let reach = height + disc.max(species.foot.base_radius * size) + longest;
        Self {
            foot,
            guides,
            followers,
            wanted: species.tentacles.count,
            reach,
            middle: 0.0,
            crown: disc + 0.7 * longest,
        }
    }

    /// Fibres without the foot.
    pub fn tentacles(&self) -> usize {
        self.guides.len() + self.followers.len()
    }
}

fn foot(species: &Species, size: f64, random: &mut Random) -> Strand {
    let spec = &species.foot;
    let segments = (spec.nodes as usize).max(2) - 1;
    let length = spec.height * size / segments as f64;
    let mut shape = FibreShape::straight(spec.nodes as usize, length, 1.0, 1.0, 1.0, 0.0);
    shape.root_radius = species.foot_radius(0.0) * size;
    for i in 0..segments {
        shape.radii[i] = species.foot_radius((i + 1) as f64 / segments as f64) * size;
        shape.drag[i] = shape.radii[i] * length;
    }
    // Nobody stands quite straight.
    let lean = 0.05 * species.variation.lean.to_radians();
    for rest in shape.rest.iter_mut().skip(1) {
        *rest = DVec2::new(lean * random.signed(), lean * random.signed());
    }
    let upright = Frame { x: DVec3::X, y: DVec3::Y, z: DVec3::Z };
    Strand {
        shape,
        place: Place { offset: DVec3::ZERO, frame: upright },
        stiffness: (spec.stiffness * size, spec.exponent),
        relaxation: spec.relaxation * (1.0 + species.variation.motion * random.signed()).max(0.05),
        break_force: f64::INFINITY,
        variation: random.bits() as u32,
    }
}

fn seats(species: &Species, size: f64, seed: u64) -> Vec<Seat> {
    let spec = &species.tentacles;
    let radius = spec.root_radius * size;
    let spread = 0.25 * species.variation.length;
    phyllotaxis::seats(
        spec.count,
        species.foot.mouth_radius * size,
        species.foot.disc_radius * size,
        |number| radius * (1.0 - spread * Random::new(seed, 1000 + u64::from(number)).unit()),
    )
}

/// Height of the oral disc over its rim's circle, in radii of the disc, at a distance from the axis (1: the
/// rim). The renderer closes the foot with this surface: a rounded lip, a shallow bowl, the mouth's small
/// mound.
pub fn disc_height(distance: f64) -> f64 {
    let q = (1.0 - distance).clamp(0.0, 1.0);
    let step = |from: f64, to: f64| {
        let u = ((q - from) / (to - from)).clamp(0.0, 1.0);
        u * u * (3.0 - 2.0 * u)
    };
    let lip = math::sin_cos((q * 5.0).min(std::f64::consts::FRAC_PI_2)).0;
    0.16 * lip - 0.20 * step(0.1, 0.7) + 0.16 * step(0.62, 0.82) - 0.22 * step(0.86, 1.0)
}

fn tentacle(species: &Species, size: f64, seat: &Seat, on_foot: bool, seed: u64) -> Strand {
    let spec = &species.tentacles;
    let vary = &species.variation;
    let mut random = Random::new(seed, 100_000 + u64::from(seat.number));
    let mouth = species.foot.mouth_radius * size;
    let rim = species.foot.disc_radius * size;
    // 0 at the mouth, 1 at the rim.
    let out = ((seat.distance - mouth) / (rim - mouth).max(1e-9)).clamp(0.0, 1.0);
    let share = spec.inner_length + (1.0 - spec.inner_length) * out;
    let length = spec.length * size * share * (1.0 + vary.length * random.signed());
    let segments = (spec.nodes as usize).max(2) - 1;
    let mut shape = FibreShape::straight(
        spec.nodes as usize,
        length / segments as f64,
        seat.radius,
        seat.radius,
        1.0,
        0.0,
    );
    let thickness = seat.radius / spec.root_radius;
    shape.root_radius = species.tentacle_radius(0.0) * thickness;
    for i in 0..segments {
        shape.radii[i] = species.tentacle_radius((i + 1) as f64 / segments as f64) * thickness;
        shape.drag[i] = shape.radii[i] * shape.lengths[i];
    }
    let wobble = 0.5 * vary.lean.to_radians() / segments as f64;
    for (rest, own) in shape.rest.iter_mut().zip(species.rest_bends(segments)) {
        *rest = own + DVec2::new(wobble * random.signed(), 2.0 * wobble * random.signed());
    }
    shape.rest[0] = DVec2::ZERO;
    shape.set_lag(spec.lag);
    let lean = (spec.inner_lean + (spec.outer_lean - spec.inner_lean) * out).to_radians();
    let (ls, lc) = math::sin_cos(lean);
    let (s, c) = math::sin_cos(seat.angle);
    let radial = DVec3::new(c, s, 0.0);
    let frame =
        Frame { x: radial * lc - DVec3::Z * ls, y: DVec3::new(-s, c, 0.0), z: radial * ls + DVec3::Z * lc };
    let jitter = vary.lean.to_radians();
    let frame = frame.bent(DVec2::new(jitter * random.signed(), jitter * random.signed()));
    let surface = if on_foot { rim * disc_height(seat.distance / rim) } else { 0.0 };
    let motion = |random: &mut Random| (1.0 + vary.motion * random.signed()).max(0.05);
    Strand {
        shape,
        place: Place { offset: radial * seat.distance + DVec3::Z * (surface - SUNK * seat.radius), frame },
        // A bigger animal of the same species bends by the same angles.
        stiffness: (spec.stiffness * size * motion(&mut random), spec.exponent),
        relaxation: spec.relaxation * motion(&mut random),
        break_force: spec.break_force.unwrap_or(f64::INFINITY),
        variation: random.bits() as u32,
    }
}

/// Chooses `guides` of the strands, spread evenly over their numbers (0, or as many as there are: all), and
/// finds the nearest three guides of each of the others (§5.4).
pub fn split(strands: Vec<Strand>, guides: usize) -> (Vec<Strand>, Vec<Follower>) {
    let count = strands.len();
    if guides == 0 || guides >= count {
        return (strands, Vec::new());
    }
    let chosen = |i: usize| i * guides / count != (i + 1) * guides / count;
    let roots: Vec<DVec3> =
        strands.iter().enumerate().filter(|(i, _)| chosen(*i)).map(|(_, s)| s.place.offset).collect();
    let (mut leading, mut following) = (Vec::with_capacity(guides), Vec::with_capacity(count - guides));
    for (i, strand) in strands.into_iter().enumerate() {
        if chosen(i) {
            leading.push(strand);
        } else {
            let (nearest, weights) = nearest_three(&roots, strand.place.offset);
            following.push((strand, nearest, weights));
        }
    }
    (leading, following)
}

/// The nearest three of `roots`, and weights by inverse square distance that sum to 1.
fn nearest_three(roots: &[DVec3], at: DVec3) -> ([u32; 3], [f32; 3]) {
    let mut best = [(f64::INFINITY, 0_u32); 3];
    for (i, root) in (0_u32..).zip(roots) {
        let candidate = (root.distance_squared(at), i);
        if candidate.0 < best[2].0 {
            best[2] = candidate;
            best.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
    }
    let weight = |d2: f64| if d2.is_finite() { 1.0 / (d2 + 1e-12) } else { 0.0 };
    let sum: f64 = best.iter().map(|(d2, _)| weight(*d2)).sum();
    (best.map(|(_, i)| i), best.map(|(d2, _)| (weight(d2) / sum) as f32))
}

/// A follower's guides as places in the chunks that the guides were packed into.
pub fn blend(guides: [u32; 3], weights: [f32; 3], place: impl Fn(u32) -> (u32, u32)) -> Blend {
    Blend { guides: guides.map(place), weights }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_grows_the_same_plant_and_another_seed_another() {
        let species = Species::default();
        let describe = |seed| {
            let plant = Plant::grow(&species, 1.0, seed);
            plant.guides.iter().map(|s| (s.shape.clone(), s.place.offset, s.variation)).collect::<Vec<_>>()
        };
        assert_eq!(describe(5), describe(5));
        assert_ne!(describe(5), describe(6));
    }

    #[test]
    fn a_plant_says_when_its_disc_had_no_room() {
        let mut species = Species::default();
        species.tentacles.count = 4000;
        let plant = Plant::grow(&species, 1.0, 1);
        assert!(plant.tentacles() < 4000 && plant.wanted == 4000);
        assert!(plant.tentacles() > 50, "{}", plant.tentacles());
    }

    #[test]
    fn bases_of_a_grown_plant_never_overlap() {
        for seed in 0..20 {
            let plant = Plant::grow(&Species::default(), 1.3, seed);
            for (i, a) in plant.guides.iter().enumerate() {
                for b in &plant.guides[..i] {
                    let apart = (a.place.offset.truncate() - b.place.offset.truncate()).length();
                    // Rounding of sine and cosine, and the radius profile's 1e-12.
                    assert!(apart >= (a.shape.root_radius + b.shape.root_radius) * (1.0 - 1e-9));
                }
            }
        }
    }

    #[test]
    fn tentacles_lean_and_arch_outward_at_rest() {
        let plant = Plant::grow(&Species::default(), 1.0, 3);
        let outward = plant.guides.iter().filter(|strand| {
            let nodes = strand.shape.rest_nodes(strand.place.offset, &strand.place.frame);
            let (root, tip) = (nodes[0].truncate(), nodes[nodes.len() - 1].truncate());
            tip.length() > root.length()
        });
        assert!(outward.count() * 10 > plant.guides.len() * 9);
    }

    #[test]
    fn followers_name_their_nearest_guides_and_their_weights_sum_to_one() {
        let mut species = Species::default();
        species.tentacles.guides = 20;
        let plant = Plant::grow(&species, 1.0, 3);
        assert_eq!(plant.guides.len(), 20);
        assert_eq!(plant.tentacles(), Plant::grow(&Species::default(), 1.0, 3).tentacles());
        for (strand, guides, weights) in &plant.followers {
            assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            let d = |i: u32| plant.guides[i as usize].place.offset.distance(strand.place.offset);
            assert!(d(guides[0]) <= d(guides[1]) && d(guides[1]) <= d(guides[2]));
            let nearest = (0..20).map(d).fold(f64::INFINITY, f64::min);
            assert_eq!(d(guides[0]), nearest);
        }
    }

    #[test]
    fn seagrass_stands_without_a_foot() {
        let mut species = Species::default();
        species.foot.height = 0.0;
        assert!(Plant::grow(&species, 1.0, 1).foot.is_none());
    }
}
