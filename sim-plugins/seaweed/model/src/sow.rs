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

use std::{collections::BTreeMap, sync::Arc};

use glam::{DVec2, DVec3, Vec3};
use reef_flow::random::{Random, mix};
use reef_sdk::{ConfigError, Heightfield, SceneInfo, abi::Obstacle, ranges};

use crate::{
    bed::{Kind, Plant, ground_at},
    config::{BedTable, Config, MOST_PLANTS, MOST_SEGMENTS, On, Single},
    grow::{self, Limb, MOST_GROWN},
    modelled::{Model, Unmodelled},
    skeleton::Skeleton,
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
pub(crate) struct Sort {
    pub(crate) species: Species,
    pub(crate) kind: Kind,
    pub(crate) form: Form,
}

/// What a mesh is made around.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Form {
    /// Limbs that grow from the table.
    Grown(Vec<Limb>),
    /// A mesh from a file.
    Modelled(Arc<Model>),
}

/// Gives the bytes of a file of the module's own, by its name.
pub type Read<'a> = dyn Fn(&str) -> Result<Vec<u8>, ConfigError> + 'a;

/// A checked configuration.
#[derive(Clone, Debug)]
pub struct Plan {
    config: Config,
    names: Vec<String>,
    sorts: Vec<Sort>,
    /// Places of single plants, and after each bed.
    places: Vec<u64>,
    seed: u64,
}

/// Where a plant found its footing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footing {
    /// Its place among all places of the configuration: single plants, then bed by bed.
    pub place: u64,
    /// Height of its root [m, world].
    pub height: f64,
    /// Normal of what it stands on, unit; None: it stands free.
    pub normal: Option<DVec3>,
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
    /// Where each of them found its footing.
    pub footings: Vec<Footing>,
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
    pub fn new(scene: &SceneInfo, config: &Config, files: &Read<'_>) -> Result<Self, ConfigError> {
        ranges::check(config)?;
        let mut sorts: BTreeMap<String, Sort> = BTreeMap::new();
        let mut count = Count::default();
        for (i, single) in config.plants.iter().enumerate() {
            let path = format!("plants[{i}]");
            let sort = read(scene, &single.species, &format!("{path}.species"), files, &mut sorts)?;
            count.add(1, sort.kind.skeleton.len() as u64, &path)?;
        }
        for (i, bed) in config.beds.iter().enumerate() {
            let path = format!("beds[{i}]");
            check_bed(bed, &path)?;
            let mut longest = 0;
            for (k, name) in bed.species.iter().enumerate() {
                let sort = read(scene, name, &format!("{path}.species[{k}]"), files, &mut sorts)?;
                longest = longest.max(sort.kind.skeleton.len() as u64);
            }
            let [columns, rows] = Lattice::of(bed).places;
            count.add(columns.saturating_mul(rows), longest, &format!("{path}.density"))?;
        }
        let (names, sorts) = sorts.into_iter().unzip();
        let mut places = vec![config.plants.len() as u64];
        for bed in &config.beds {
            let [columns, rows] = Lattice::of(bed).places;
            places.push(places[places.len() - 1] + columns * rows);
        }
        Ok(Self { config: config.clone(), names, sorts, places, seed: scene.seed })
    }

    /// What was read of the species, in the order of their names.
    pub(crate) fn sorts(&self) -> impl Iterator<Item = (&str, &Sort)> {
        self.names.iter().map(String::as_str).zip(&self.sorts)
    }

    /// Everything where it stands.
    pub fn grow(&self, floor: &Floor<'_>) -> Garden {
        let mut garden = self.fallow();
        for (place, single) in self.config.plants.iter().enumerate() {
            let [x, y, z] = single.position;
            let mut footing = Footing { place: place as u64, height: y, normal: None };
            if floor.ground.is_some() {
                let found = Found::at(floor, x, z);
                footing.height += found.height;
                footing.normal = Some(found.normal);
            }
            self.single(single, footing, &mut garden);
        }
        for (i, bed) in self.config.beds.iter().enumerate() {
            let lattice = Lattice::of(bed);
            for (place, at) in (self.places[i]..).zip(lattice.all()) {
                let seedling = self.seedling(bed, i, &lattice, at);
                let found = Found::at(floor, seedling.x, seedling.z);
                if found.suits(bed) {
                    let normal = (floor.ground.is_some() || found.on_rock).then_some(found.normal);
                    self.sow(bed, seedling, Footing { place, height: found.height, normal }, &mut garden);
                }
            }
        }
        garden
    }

    /// The plants that found these footings, wherever the ground is now.
    ///
    /// # Errors
    /// What is wrong with them: they are not of this configuration, or no place that a plant may have.
    pub fn regrow(&self, footings: &[Footing]) -> Result<Garden, String> {
        let mut garden = self.fallow();
        let grow = footings.windows(2).all(|pair| pair[0].place < pair[1].place);
        let all = self.places[self.places.len() - 1];
        if !grow || footings.last().is_some_and(|last| last.place >= all) {
            return Err(format!(
                "has plants whose places do not grow, or are not among the {all} of this scene"
            ));
        }
        for footing in footings {
            let lies = footing.height.abs() <= FARTHEST;
            if !lies
                || footing
                    .normal
                    .is_some_and(|normal| (normal.length() - 1.0).abs() > 1e-6 || normal.is_nan())
            {
                return Err(format!("has a plant at place {} without a footing", footing.place));
            }
            let bed = self.places.partition_point(|end| *end <= footing.place);
            match bed.checked_sub(1) {
                None => self.single(&self.config.plants[footing.place as usize], *footing, &mut garden),
                Some(i) => {
                    let bed = &self.config.beds[i];
                    let lattice = Lattice::of(bed);
                    let at = lattice.number(footing.place - self.places[i]);
                    self.sow(bed, self.seedling(bed, i, &lattice, at), *footing, &mut garden);
                }
            }
        }
        Ok(garden)
    }

    /// A garden without plants.
    fn fallow(&self) -> Garden {
        Garden {
            kinds: self.sorts.iter().map(|sort| sort.kind.clone()).collect(),
            species: self.sorts.iter().map(|sort| sort.species.clone()).collect(),
            ..Garden::default()
        }
    }

    fn number(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }

    fn single(&self, single: &Single, footing: Footing, garden: &mut Garden) {
        let Some(kind) = self.number(&single.species) else { return };
        let seed = mix(self.seed ^ mix(single.seed.map_or(footing.place | 1 << 40, u64::from)));
        let traits = Traits::of(seed, [0, 0]);
        let [x, _, z] = single.position;
        let plant = self.individual(kind, seed, &traits, DVec3::new(x, footing.height, z), footing.normal);
        garden.plants.push(Plant { yaw: single.yaw.to_radians(), size: single.scale, ..plant });
        garden.traits.push(traits);
        garden.footings.push(footing);
    }

    /// What grows at a place of a bed, if anything does.
    fn seedling(&self, bed: &BedTable, number: usize, lattice: &Lattice, at: [i64; 2]) -> Seedling {
        let seed = mix(bed.seed.map_or(self.seed, u64::from) ^ mix(number as u64));
        let mut random = Random::new(seed, place_hash(at) ^ 0x11);
        let [x, z] = lattice.place(at, [random.signed(), random.signed()]);
        Seedling { x, z, traits: Traits::of(seed, at), random }
    }

    fn sow(&self, bed: &BedTable, seedling: Seedling, footing: Footing, garden: &mut Garden) {
        let Seedling { x, z, traits, mut random } = seedling;
        let kinds = bed.species.iter().filter_map(|name| self.number(name));
        let chosen = (random.unit() * bed.species.len() as f64) as usize % bed.species.len();
        let Some(kind) = kinds.clone().nth(chosen) else { return };
        let scale = bed.scale[0] + (bed.scale[1] - bed.scale[0]) * random.unit();
        let root = DVec3::new(x, footing.height, z);
        let plant = self.individual(kind, random.bits(), &traits, root, footing.normal);
        garden.plants.push(Plant { size: scale * plant.size, ..plant });
        garden.traits.push(traits);
        garden.footings.push(footing);
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

/// No plant stands higher or lower than this [m].
const FARTHEST: f64 = 2e5;

/// What may grow at a place.
struct Seedling {
    x: f64,
    z: f64,
    traits: Traits,
    /// What is drawn next.
    random: Random,
}

/// What lies at a place.
#[derive(Clone, Copy, Debug)]
struct Found {
    height: f64,
    normal: DVec3,
    on_rock: bool,
}

impl Found {
    fn at(floor: &Floor<'_>, x: f64, z: f64) -> Self {
        let (height, normal) = floor.ground.map_or((0.0, DVec3::Y), |ground| ground_at(&ground, x, z));
        let mut found = Self { height, normal, on_rock: false };
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
                if rise2 > 0.0 && center.y + rise2.sqrt() > found.height {
                    let height = center.y + rise2.sqrt();
                    let normal = (DVec3::new(x, height, z) - center) / radius;
                    found = Self { height, normal, on_rock: true };
                }
            }
        }
        found
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

    /// A place by its number in [`Lattice::all`].
    fn number(self, number: u64) -> [i64; 2] {
        [(number % self.places[0]) as i64, (number / self.places[0]) as i64]
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
    segments: u64,
}

impl Count {
    fn add(&mut self, plants: u64, segments: u64, path: &str) -> Result<(), ConfigError> {
        self.plants = self.plants.saturating_add(plants);
        self.segments = self.segments.saturating_add(plants.saturating_mul(segments));
        let refuse = |problem: String| Err(ConfigError::new(path, problem));
        if self.plants > MOST_PLANTS {
            return refuse(format!("brings the scene to {} plants; the limit is {MOST_PLANTS}", self.plants));
        }
        if self.segments > MOST_SEGMENTS {
            return refuse(format!(
                "brings the scene to {} segments; the limit is {MOST_SEGMENTS}",
                self.segments
            ));
        }
        Ok(())
    }
}

fn read<'a>(
    scene: &SceneInfo,
    name: &str,
    path: &str,
    files: &Read<'_>,
    sorts: &'a mut BTreeMap<String, Sort>,
) -> Result<&'a Sort, ConfigError> {
    if !sorts.contains_key(name) {
        let species: Species = scene.species_at(name, path)?;
        let inside = format!("species.{name}");
        ranges::check(&species).map_err(|error| error.within(&inside))?;
        let at = |key: &str, problem: String| ConfigError::new(format!("{inside}.{key}"), problem);
        species.check().map_err(|(key, problem)| at(key, problem))?;
        let (skeleton, form) = match species.skeleton.as_str() {
            "" => {
                let (skeleton, limbs) = grow::grow(&species).map_err(|error| match error.segment {
                    None => at(error.key, error.problem),
                    // No key of the table is wrong by itself: what they make together is.
                    Some(number) => {
                        let problem = format!("grows segment {number} whose {} {}", error.key, error.problem);
                        ConfigError::new(inside.clone(), problem)
                    }
                })?;
                (skeleton, Form::Grown(limbs))
            }
            file => model(&species, &files(file)?, &at)?,
        };
        let kind = Kind::new(skeleton, species.motion.lag, species.motion.disturbance);
        sorts.insert(name.to_owned(), Sort { species, kind, form });
    }
    sorts.get(name).ok_or_else(|| ConfigError::new(path, format!("unknown species `{name}`")))
}

/// A plant from the bytes of a file. `at`: an error at a key of its table.
fn model(
    species: &Species,
    bytes: &[u8],
    at: &dyn Fn(&str, String) -> ConfigError,
) -> Result<(Skeleton, Form), ConfigError> {
    let (model, segments) = Model::read(bytes, species).map_err(|error| match error {
        Unmodelled::File(fault) => at("skeleton", format!("{}: {fault}", species.skeleton)),
        Unmodelled::Table(key, problem) => at(&key, problem),
    })?;
    if segments.len() as u64 > MOST_GROWN {
        let problem = format!("makes {} segments; at most {MOST_GROWN} are allowed", segments.len());
        return Err(at("skeleton", format!("{}: {problem}", species.skeleton)));
    }
    let skeleton =
        Skeleton::new(&segments).map_err(|error| at("skeleton", format!("{}: {error}", species.skeleton)))?;
    Ok((skeleton, Form::Modelled(Arc::new(model))))
}
