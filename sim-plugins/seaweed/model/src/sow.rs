//! From a configuration to plants: what is checked before the sea bed is known ([`Plan::new`]), and where
//! everything stands on it ([`Plan::grow`]).
//!
//! A bed is a lattice of places, one for each plant that its density allows, each moved a little by chance; a
//! place that is too steep, too deep, or not on what the plants stand on stays empty. What is there depends
//! on the seed and the place alone.
//!
//! No two neighbours are alike: size, hue, phase, yaw, age and stiffness come from a rank-1 lattice each, in
//! which places up to two apart along both axes differ by a tenth of the whole range or more, less a little
//! chance.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3, Vec3};
use reef_flow::random::{Random, mix};
use reef_sdk::{ConfigError, Heightfield, SceneInfo, abi::Obstacle, ranges};

use crate::{
    bed::{Kind, Plant, ground_at},
    config::{BedTable, Config, MOST_JOINTS, MOST_PLANTS, On, Single},
    grow,
    species::Species,
};

/// What makes an individual, beside its place. Each from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traits {
    /// From the smallest to the largest.
    pub size: f64,
    /// Over its species' range of hues.
    pub hue: f64,
    /// Of what differs along blades by itself: ruffles.
    pub phase: f64,
    /// Of a whole turn.
    pub yaw: f64,
    /// From young to old.
    pub age: f64,
    /// From soft to stiff.
    pub stiffness: f64,
}

/// Two numbers a trait. Up to twice the one plus up to twice the other, of either sign, is 0.11 or more off
/// any whole number.
const RANKS: [[f64; 2]; 6] =
    [[0.89, 0.665], [0.67, 0.11], [0.665, 0.445], [0.445, 0.335], [0.11, 0.67], [0.555, 0.335]];
/// Chance on top of the lattice, ±.
const CHANCE: f64 = 0.02;

impl Traits {
    /// Those of a place of a lattice.
    pub fn of(seed: u64, [i, j]: [i64; 2]) -> Self {
        let mut random = Random::new(seed, place_hash([i, j]));
        let mut start = Random::new(seed, 0x7ea1);
        let [size, hue, phase, yaw, age, stiffness] = RANKS.map(|[a, b]| {
            let value = start.unit() + a * i as f64 + b * j as f64 + CHANCE * random.signed();
            value - value.floor()
        });
        Self { size, hue, phase, yaw, age, stiffness }
    }
}

fn place_hash([i, j]: [i64; 2]) -> u64 {
    mix(mix(i as u64) ^ (j as u64).rotate_left(32))
}

/// A species and what grows from it.
#[derive(Clone, Debug)]
struct Sort {
    species: Species,
    kind: Kind,
}

/// A checked configuration.
#[derive(Clone, Debug)]
pub struct Plan {
    config: Config,
    names: Vec<String>,
    sorts: Vec<Sort>,
    seed: u64,
}

/// All plants of a configuration where they stand.
#[derive(Clone, Debug, Default)]
pub struct Garden {
    /// Species, in the order of their names.
    pub kinds: Vec<Kind>,
    /// Their tables.
    pub species: Vec<Species>,
    /// Plants: single ones, then bed by bed.
    pub plants: Vec<Plant>,
    /// What makes each of them.
    pub traits: Vec<Traits>,
}

/// What plants stand on.
#[derive(Clone, Copy, Debug)]
pub struct Floor<'a> {
    /// The sea bed; None: the level y = 0.
    pub ground: Option<Heightfield<'a>>,
    /// Rocks as capsules.
    pub rocks: &'a [Obstacle],
}

impl Plan {
    /// Reads the species, and counts.
    ///
    /// # Errors
    /// A number out of its range, a species that is unknown or wrong, too many plants or segments: with the
    /// place.
    pub fn new(scene: &SceneInfo, config: &Config) -> Result<Self, ConfigError> {
        ranges::check(config)?;
        let mut sorts: BTreeMap<String, Sort> = BTreeMap::new();
        let mut count = Count::default();
        for (i, single) in config.plants.iter().enumerate() {
            let path = format!("plants[{i}]");
            let sort = read(scene, &single.species, &format!("{path}.species"), &mut sorts)?;
            count.add(1, sort.kind.skeleton.len() as u64, &path)?;
        }
        for (i, bed) in config.beds.iter().enumerate() {
            let path = format!("beds[{i}]");
            check_bed(bed, &path)?;
            let mut longest = 0;
            for (k, name) in bed.species.iter().enumerate() {
                let sort = read(scene, name, &format!("{path}.species[{k}]"), &mut sorts)?;
                longest = longest.max(sort.kind.skeleton.len() as u64);
            }
            let [columns, rows] = Lattice::of(bed).places;
            count.add(columns.saturating_mul(rows), longest, &format!("{path}.density"))?;
        }
        let (names, sorts) = sorts.into_iter().unzip();
        Ok(Self { config: config.clone(), names, sorts, seed: scene.seed })
    }

    /// Everything where it stands.
    pub fn grow(&self, floor: &Floor<'_>) -> Garden {
        let mut garden = Garden {
            kinds: self.sorts.iter().map(|sort| sort.kind.clone()).collect(),
            species: self.sorts.iter().map(|sort| sort.species.clone()).collect(),
            ..Garden::default()
        };
        for (i, single) in self.config.plants.iter().enumerate() {
            self.single(single, i, floor, &mut garden);
        }
        for (i, bed) in self.config.beds.iter().enumerate() {
            self.bed(bed, i, floor, &mut garden);
        }
        garden
    }

    fn number(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }

    fn single(&self, single: &Single, place: usize, floor: &Floor<'_>, garden: &mut Garden) {
        let Some(kind) = self.number(&single.species) else { return };
        let seed = mix(self.seed ^ mix(single.seed.map_or(place as u64 | 1 << 40, u64::from)));
        let traits = Traits::of(seed, [0, 0]);
        let [x, y, z] = single.position;
        let mut root = DVec3::new(x, y, z);
        let mut normal = None;
        if floor.ground.is_some() {
            let footing = Footing::at(floor, x, z);
            root.y += footing.height;
            normal = Some(footing.normal);
        }
        let plant = self.individual(kind, seed, &traits, root, normal);
        garden.plants.push(Plant { yaw: single.yaw.to_radians(), size: single.scale, ..plant });
        garden.traits.push(traits);
    }

    fn bed(&self, bed: &BedTable, place: usize, floor: &Floor<'_>, garden: &mut Garden) {
        let seed = mix(bed.seed.map_or(self.seed, u64::from) ^ mix(place as u64));
        let lattice = Lattice::of(bed);
        let kinds: Vec<usize> = bed.species.iter().filter_map(|name| self.number(name)).collect();
        for at in lattice.all() {
            let mut random = Random::new(seed, place_hash(at) ^ 0x11);
            let [x, z] = lattice.place(at, [random.signed(), random.signed()]);
            let footing = Footing::at(floor, x, z);
            if !footing.suits(bed) {
                continue;
            }
            let traits = Traits::of(seed, at);
            let kind = kinds[(random.unit() * kinds.len() as f64) as usize % kinds.len()];
            let scale = bed.scale[0] + (bed.scale[1] - bed.scale[0]) * random.unit();
            let root = DVec3::new(x, footing.height, z);
            let normal = (floor.ground.is_some() || footing.on_rock).then_some(footing.normal);
            let plant = self.individual(kind, random.bits(), &traits, root, normal);
            garden.plants.push(Plant { size: scale * plant.size, ..plant });
            garden.traits.push(traits);
        }
    }

    fn individual(
        &self,
        kind: usize,
        seed: u64,
        traits: &Traits,
        root: DVec3,
        ground: Option<DVec3>,
    ) -> Plant {
        let variation = &self.sorts[kind].species.variation;
        let around_one = |share: f64, spread: f64| 1.0 + spread * (2.0 * share - 1.0);
        Plant {
            kind,
            root,
            // Plants grow toward the light, and a little away from the slope.
            up: DVec3::Y.lerp(ground.unwrap_or(DVec3::Y), SLOPE_SHARE).normalize_or(DVec3::Y),
            yaw: traits.yaw * core::f64::consts::TAU,
            size: around_one(traits.size, variation.size),
            stiff: around_one(traits.stiffness, variation.stiffness),
            bend: variation.bend.to_radians(),
            seed,
            ground,
        }
    }
}

/// How much of the ground's slope a plant leans with.
const SLOPE_SHARE: f64 = 0.35;

/// What lies at a place.
#[derive(Clone, Copy, Debug)]
struct Footing {
    height: f64,
    normal: DVec3,
    on_rock: bool,
}

impl Footing {
    fn at(floor: &Floor<'_>, x: f64, z: f64) -> Self {
        let (height, normal) = floor.ground.map_or((0.0, DVec3::Y), |ground| ground_at(&ground, x, z));
        let mut footing = Self { height, normal, on_rock: false };
        for rock in floor.rocks {
            let (from, delta) = (DVec3::from(rock.from), Vec3::from(rock.delta).as_dvec3());
            let radius = f64::from(rock.radius);
            // The highest point of the capsule over (x, z): over one of its ends, or over its axis.
            let flat2 = delta.x * delta.x + delta.z * delta.z;
            let along = ((x - from.x) * delta.x + (z - from.z) * delta.z) / flat2.max(1e-12);
            for t in [0.0, along.clamp(0.0, 1.0), 1.0] {
                let center = from + delta * t;
                let (dx, dz) = (x - center.x, z - center.z);
                let rise2 = radius * radius - dx * dx - dz * dz;
                if rise2 > 0.0 && center.y + rise2.sqrt() > footing.height {
                    let height = center.y + rise2.sqrt();
                    let normal = (DVec3::new(x, height, z) - center) / radius;
                    footing = Self { height, normal, on_rock: true };
                }
            }
        }
        footing
    }

    fn suits(&self, bed: &BedTable) -> bool {
        let within = |[least, most]: [f64; 2], value: f64| (least..=most).contains(&value);
        let kind = match bed.on {
            On::Both => true,
            On::Ground => !self.on_rock,
            On::Rock => self.on_rock,
        };
        kind && within(bed.slope, self.slope()) && within(bed.depth, -self.height)
    }

    /// [deg], the same bytes on every machine.
    fn slope(&self) -> f64 {
        let n = self.normal;
        DVec2::new(n.y, (n.x * n.x + n.z * n.z).sqrt()).to_angle().to_degrees()
    }
}

/// The places of a bed, counted from its low corner: they share its rectangle evenly.
#[derive(Clone, Copy, Debug)]
struct Lattice {
    corner: [f64; 2],
    /// How many there are along x and along z.
    places: [u64; 2],
    /// From one place to the next along x and along z [m].
    step: [f64; 2],
}

impl Lattice {
    /// As many places as the density asks for, rounded along each side, and one at least.
    fn of(bed: &BedTable) -> Self {
        let corner = [bed.center[0] - 0.5 * bed.size[0], bed.center[1] - 0.5 * bed.size[1]];
        let pitch = 1.0 / bed.density.sqrt();
        let places = bed.size.map(|size| (size / pitch).round().max(1.0));
        let step = core::array::from_fn(|axis| bed.size[axis] / places[axis]);
        Self { corner, places: places.map(|count| count as u64), step }
    }

    fn all(self) -> impl Iterator<Item = [i64; 2]> {
        let [columns, rows] = self.places.map(|count| count as i64);
        (0..rows).flat_map(move |j| (0..columns).map(move |i| [i, j]))
    }

    /// x and z of a place, moved by a share of the way to its neighbours.
    fn place(self, at: [i64; 2], moved: [f64; 2]) -> [f64; 2] {
        core::array::from_fn(|axis| {
            self.corner[axis] + self.step[axis] * (at[axis] as f64 + 0.5 + 0.35 * moved[axis])
        })
    }
}

fn check_bed(bed: &BedTable, path: &str) -> Result<(), ConfigError> {
    if bed.species.is_empty() {
        return Err(ConfigError::new(format!("{path}.species"), "must name at least one species"));
    }
    for (key, [least, most]) in [("slope", bed.slope), ("depth", bed.depth), ("scale", bed.scale)] {
        if least > most {
            let problem = format!("the least, {least}, is above the greatest, {most}");
            return Err(ConfigError::new(format!("{path}.{key}"), problem));
        }
    }
    Ok(())
}

/// Plants and segments asked for so far.
#[derive(Default)]
struct Count {
    plants: u64,
    joints: u64,
}

impl Count {
    fn add(&mut self, plants: u64, segments: u64, path: &str) -> Result<(), ConfigError> {
        self.plants = self.plants.saturating_add(plants);
        self.joints = self.joints.saturating_add(plants.saturating_mul(segments));
        let refuse = |problem: String| Err(ConfigError::new(path, problem));
        if self.plants > MOST_PLANTS {
            return refuse(format!("brings the scene to {} plants; the limit is {MOST_PLANTS}", self.plants));
        }
        if self.joints > MOST_JOINTS {
            return refuse(format!(
                "brings the scene to {} segments; the limit is {MOST_JOINTS}",
                self.joints
            ));
        }
        Ok(())
    }
}

fn read<'a>(
    scene: &SceneInfo,
    name: &str,
    path: &str,
    sorts: &'a mut BTreeMap<String, Sort>,
) -> Result<&'a Sort, ConfigError> {
    if !sorts.contains_key(name) {
        // Errors inside of a species keep their own path; an unknown name is a fault of the key that names
        // it.
        let species: Species = scene.species(name).map_err(|error| {
            if error.path.is_empty() { ConfigError::new(path, error.message) } else { error }
        })?;
        let inside = format!("species.{name}");
        ranges::check(&species).map_err(|error| error.within(&inside))?;
        let at = |key: &str, problem: String| ConfigError::new(format!("{inside}.{key}"), problem);
        species.check().map_err(|(key, problem)| at(key, problem))?;
        let skeleton = grow::skeleton(&species).map_err(|error| match error.segment {
            None => at(error.key, error.problem),
            // No key of the table is wrong by itself: what they make together is.
            Some(number) => {
                let problem = format!("grows segment {number} whose {} {}", error.key, error.problem);
                ConfigError::new(inside.clone(), problem)
            }
        })?;
        let kind = Kind { skeleton, lag: species.motion.lag, disturbance: species.motion.disturbance };
        sorts.insert(name.to_owned(), Sort { species, kind });
    }
    sorts.get(name).ok_or_else(|| ConfigError::new(path, format!("unknown species `{name}`")))
}
