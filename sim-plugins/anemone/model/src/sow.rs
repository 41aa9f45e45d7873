//! From a configuration to plants: what stands where, before the sea bed is known.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use reef_flow::{
    color::linear_rgb,
    random::{Random, mix},
};
use reef_sdk::{
    ConfigError, SceneInfo,
    abi::{self, Material, fnv1a_32},
};

use crate::{
    config::{Anemone, Config, FibreGrid, MOST_FIBRES, MOST_NODES, MOST_PLANTS, Scatter, Tuft},
    frame::Frame,
    math, phyllotaxis,
    plant::{Follower, Plant, Strand, split},
    shape::FibreShape,
    species::{PatternKind, Species, Surface},
    wide::{Drag, Place},
};

/// One plant on its way into the bed.
#[derive(Clone, Debug)]
pub(crate) struct Seedling {
    /// Foot and fibres.
    pub(crate) plant: Plant,
    /// x, y, z [m]; y counts from the sea bed where `grounded` and there is one.
    pub(crate) position: DVec3,
    /// Over a sea bed, y counts from it, and the stand leans with it.
    pub(crate) grounded: bool,
    /// Turn about y [rad].
    pub(crate) yaw: f64,
    /// What the drag numbers of its fibres mean.
    pub(crate) drag: Drag,
    /// Weight of each node, downward [N].
    pub(crate) weight: f64,
    /// Materials of the foot and of the fibres.
    pub(crate) materials: [u32; 2],
    /// Sides of the rings of the foot and of the fibres.
    pub(crate) sides: [u32; 2],
    /// Thickness over width of the fibres; 1: round.
    pub(crate) flatness: f32,
    /// FNV-1a (32 bits) of the species' name; 0: a bare fibre, which nobody perceives.
    pub(crate) species: u32,
}

/// Everything that a configuration asks for.
#[derive(Clone, Debug, Default)]
pub(crate) struct Harvest {
    pub(crate) seedlings: Vec<Seedling>,
    pub(crate) materials: Vec<Material>,
    /// What the person who wrote the scene should know.
    pub(crate) remarks: Vec<String>,
    /// How many seedlings are known to be within reach.
    looked_at: usize,
}

/// What a species looks like in the streams.
struct Kind {
    species: Species,
    materials: [u32; 2],
    hash: u32,
}

/// Reads the species and grows every plant.
pub(crate) fn sow(scene: &SceneInfo, config: &Config) -> Result<Harvest, ConfigError> {
    let plants = config.anemones.len() as u64
        + config.scatter.iter().map(|s| u64::from(s.count)).sum::<u64>()
        + config.fibres.iter().map(|g| u64::from(g.count[0]) * u64::from(g.count[1]) / 64).sum::<u64>()
        + config.tufts.len() as u64;
    if plants > MOST_PLANTS {
        return Err(ConfigError::new("", format!("asks for {plants} plants; the limit is {MOST_PLANTS}")));
    }
    let mut harvest = Harvest::default();
    let mut kinds: BTreeMap<String, Kind> = BTreeMap::new();
    let mut count = Count::default();
    for (i, anemone) in config.anemones.iter().enumerate() {
        let path = format!("anemones[{i}]");
        let named = format!("{path}.species");
        let kind = kind_of(scene, &anemone.species, &named, &mut kinds, &mut harvest)?;
        count.add(&kind.species, 1, &path)?;
        let seedling = one(scene, anemone, i, kind);
        remark(&mut harvest, &seedling, &path, &anemone.species);
        harvest.seedlings.push(seedling);
        within_reach(&mut harvest, &path)?;
    }
    for (i, scatter) in config.scatter.iter().enumerate() {
        let path = format!("scatter[{i}]");
        if scatter.species.is_empty() {
            return Err(ConfigError::new(format!("{path}.species"), "must name at least one species"));
        }
        if scatter.scale[0] > scatter.scale[1] {
            return Err(ConfigError::new(format!("{path}.scale"), "the least size is above the greatest"));
        }
        for (k, name) in scatter.species.iter().enumerate() {
            let named = format!("{path}.species[{k}]");
            let kind = kind_of(scene, name, &named, &mut kinds, &mut harvest)?;
            count.add(&kind.species, u64::from(scatter.count), &path)?;
        }
        scattered(scene, scatter, i, &path, &kinds, &mut harvest);
        within_reach(&mut harvest, &path)?;
    }
    for (i, grid) in config.fibres.iter().enumerate() {
        count.fibres(
            u64::from(grid.count[0]) * u64::from(grid.count[1]),
            grid.nodes,
            &format!("fibres[{i}]"),
        )?;
        fibre_grid(grid, &format!("fibres[{i}]"), &mut harvest)?;
        within_reach(&mut harvest, &format!("fibres[{i}]"))?;
    }
    for (i, tuft) in config.tufts.iter().enumerate() {
        count.fibres(u64::from(tuft.fibres.max(tuft.guides)), tuft.nodes, &format!("tufts[{i}]"))?;
        let seedling = self::tuft(scene, tuft, &format!("tufts[{i}]"), &mut harvest)?;
        harvest.seedlings.push(seedling);
        within_reach(&mut harvest, &format!("tufts[{i}]"))?;
    }
    Ok(harvest)
}

/// Farthest that a plant may stand from the middle of the world, and farthest that it may reach [m]: what
/// streams take, less what the ground adds.
const FARTHEST: f64 = 5e5;
const LONGEST: f64 = 5e4;

/// Refuses plants that no stream takes among those since the last look, which stand at `path`.
fn within_reach(harvest: &mut Harvest, path: &str) -> Result<(), ConfigError> {
    let new = std::mem::replace(&mut harvest.looked_at, harvest.seedlings.len());
    for seedling in &harvest.seedlings[new..] {
        let (far, long) = (seedling.position.abs().max_element(), seedling.plant.reach);
        let within = far <= FARTHEST && long <= LONGEST;
        if !within {
            let problem = format!(
                "puts a plant of {long:.0} m {far:.0} m from the middle of the world; the limits are {LONGEST} and {FARTHEST} m"
            );
            return Err(ConfigError::new(path, problem));
        }
    }
    Ok(())
}

/// Fibres and nodes asked for so far.
#[derive(Default)]
struct Count {
    fibres: u64,
    nodes: u64,
}

impl Count {
    fn add(&mut self, species: &Species, plants: u64, path: &str) -> Result<(), ConfigError> {
        let tentacles = &species.tentacles;
        let nodes = u64::from(tentacles.count) * u64::from(tentacles.nodes) + u64::from(species.foot.nodes);
        self.check((u64::from(tentacles.count) + 1) * plants, nodes * plants, path)
    }

    fn fibres(&mut self, fibres: u64, nodes: u32, path: &str) -> Result<(), ConfigError> {
        self.check(fibres, fibres * u64::from(nodes), path)
    }

    fn check(&mut self, fibres: u64, nodes: u64, path: &str) -> Result<(), ConfigError> {
        self.fibres += fibres;
        self.nodes += nodes;
        if self.fibres > MOST_FIBRES {
            let problem = format!("brings the scene to {} fibres; the limit is {MOST_FIBRES}", self.fibres);
            return Err(ConfigError::new(path, problem));
        }
        if self.nodes > MOST_NODES {
            let problem = format!("brings the scene to {} nodes; the limit is {MOST_NODES}", self.nodes);
            return Err(ConfigError::new(path, problem));
        }
        Ok(())
    }
}

fn kind_of<'a>(
    scene: &SceneInfo,
    name: &str,
    path: &str,
    kinds: &'a mut BTreeMap<String, Kind>,
    harvest: &mut Harvest,
) -> Result<&'a Kind, ConfigError> {
    if !kinds.contains_key(name) {
        let species: Species = scene.species_at(name, path)?;
        reef_sdk::ranges::check(&species).map_err(|error| error.within(&format!("species.{name}")))?;
        species
            .check()
            .map_err(|(key, problem)| ConfigError::new(format!("species.{name}.{key}"), problem))?;
        let foot = material(&species.look.foot);
        let tentacles = material(&species.look.tentacles);
        let first = harvest.materials.len() as u32;
        harvest.materials.extend([foot, tentacles]);
        let kind = Kind { species, materials: [first, first + 1], hash: fnv1a_32(name.as_bytes()) };
        kinds.insert(name.to_owned(), kind);
    }
    kinds.get(name).ok_or_else(|| ConfigError::new(path, format!("unknown species `{name}`")))
}

/// A surface in the stream's terms. Its colours were checked; white stands in for one that was not.
fn material(surface: &Surface) -> Material {
    let rgb = |text: &str| linear_rgb(text).unwrap_or([1.0; 3]);
    let four = |[r, g, b]: [f32; 3], a: f64| [r, g, b, a as f32];
    Material {
        base: four(rgb(&surface.base), 1.0),
        tip: four(rgb(&surface.tip), surface.tip_start),
        accent: four(rgb(&surface.accent), surface.accent_share),
        pattern: match surface.pattern {
            PatternKind::None => abi::PATTERN_NONE,
            PatternKind::Spots => abi::PATTERN_SPOTS,
            PatternKind::Bands => abi::PATTERN_BANDS,
            PatternKind::Stripes => abi::PATTERN_STRIPES,
            PatternKind::Blotches => abi::PATTERN_BLOTCHES,
        },
        pattern_scale: surface.pattern_scale as f32,
        pattern_softness: surface.softness as f32,
        translucency: surface.translucency as f32,
        wrap: 0.5,
        rim: 0.3,
        roughness: 0.8,
        specular: 0.0003,
        ..Material::default()
    }
}

fn seedling(kind: &Kind, position: DVec3, scale: f64, yaw: f64, seed: u64) -> Seedling {
    let species = &kind.species;
    Seedling {
        plant: Plant::grow(species, scale, seed),
        position,
        grounded: true,
        yaw,
        drag: Drag::Area { coefficient: species.tentacles.drag_coefficient as f32 },
        weight: 0.0,
        materials: kind.materials,
        sides: [species.foot.sides, species.tentacles.sides],
        flatness: species.tentacles.flatness as f32,
        species: kind.hash,
    }
}

fn one(scene: &SceneInfo, anemone: &Anemone, number: usize, kind: &Kind) -> Seedling {
    let seed = mix(scene.seed ^ mix(anemone.seed.map_or(number as u64, |s| u64::from(s) << 32)));
    let position = DVec3::from(anemone.position);
    seedling(kind, position, anemone.scale, anemone.yaw.to_radians(), seed)
}

fn remark(harvest: &mut Harvest, seedling: &Seedling, path: &str, name: &str) {
    let (got, wanted) = (seedling.plant.tentacles(), seedling.plant.wanted);
    if (got as u64) < u64::from(wanted) && harvest.remarks.len() < 20 {
        harvest
            .remarks
            .push(format!("{path}: the disc of `{name}` has room for {got} of {wanted} tentacles"));
    }
}

fn scattered(
    scene: &SceneInfo,
    scatter: &Scatter,
    number: usize,
    path: &str,
    kinds: &BTreeMap<String, Kind>,
    harvest: &mut Harvest,
) {
    let seed = scatter.seed.map_or(scene.seed, u64::from) ^ mix(number as u64 + 77);
    let mut random = Random::new(seed, 2);
    let places = match scatter.grid {
        Some(grid) => grid_places(scatter, grid),
        None => random_places(scatter, &mut random),
    };
    if places.len() < scatter.count as usize && harvest.remarks.len() < 20 {
        let (got, wanted) = (places.len(), scatter.count);
        harvest.remarks.push(format!("{path}: there is room for {got} of {wanted} plants at their spacing"));
    }
    for place in places {
        let at = (random.bits() % scatter.species.len().max(1) as u64) as usize;
        let name = &scatter.species[at];
        let scale = random.between(scatter.scale[0], scatter.scale[1]);
        let yaw = random.between(0.0, std::f64::consts::TAU);
        let plant_seed = random.bits();
        let Some(kind) = kinds.get(name) else { continue };
        let seedling = seedling(kind, DVec3::new(place.x, 0.0, place.y), scale, yaw, plant_seed);
        remark(harvest, &seedling, path, name);
        harvest.seedlings.push(seedling);
    }
}

fn grid_places(scatter: &Scatter, [columns, rows]: [u32; 2]) -> Vec<DVec2> {
    let step = |size: f64, count: u32, i: u32| size * ((f64::from(i) + 0.5) / f64::from(count) - 0.5);
    (0..rows)
        .flat_map(|row| (0..columns).map(move |column| (row, column)))
        .take(scatter.count as usize)
        .map(|(row, column)| {
            DVec2::from(scatter.center)
                + DVec2::new(step(scatter.size[0], columns, column), step(scatter.size[1], rows, row))
        })
        .collect()
}

/// Tries a place 30 times before it gives one plant up.
fn random_places(scatter: &Scatter, random: &mut Random) -> Vec<DVec2> {
    let mut places: Vec<DVec2> = Vec::new();
    let half = DVec2::from(scatter.size) * 0.5;
    for _ in 0..scatter.count {
        for _ in 0..30 {
            let offset = DVec2::new(half.x * random.signed(), half.y * random.signed());
            let place = DVec2::from(scatter.center) + offset;
            let apart = scatter.spacing * scatter.spacing;
            if scatter.spacing == 0.0 || places.iter().all(|other| other.distance_squared(place) >= apart) {
                places.push(place);
                break;
            }
        }
    }
    places
}

/// A material of two colours for bare fibres.
fn plain(colors: &[String; 2], path: &str, harvest: &mut Harvest) -> Result<u32, ConfigError> {
    for (i, color) in colors.iter().enumerate() {
        if linear_rgb(color).is_none() {
            let problem = format!("must be a colour like \"#A8182A\", is {color:?}");
            return Err(ConfigError::new(format!("{path}.colors[{i}]"), problem));
        }
    }
    let surface = Surface {
        base: colors[0].clone(),
        tip: colors[1].clone(),
        tip_start: 0.0,
        translucency: 0.2,
        ..Surface::default()
    };
    harvest.materials.push(material(&surface));
    Ok(harvest.materials.len() as u32 - 1)
}

/// A plant of fibres that stand on the ground by themselves.
fn footless(guides: Vec<Strand>, followers: Vec<Follower>, spread: f64) -> Plant {
    let longest = guides
        .iter()
        .chain(followers.iter().map(|(strand, ..)| strand))
        .map(|strand| strand.shape.length() + strand.shape.root_radius)
        .fold(0.0, f64::max);
    let wanted = (guides.len() + followers.len()) as u32;
    Plant { foot: None, guides, followers, wanted, reach: spread + longest, middle: 0.0, crown: spread }
}

/// Rows and columns of a grid that are one object: they fill a batch, and their positions stay near its
/// origin.
const PATCH: usize = 8;

fn fibre_grid(grid: &FibreGrid, path: &str, harvest: &mut Harvest) -> Result<(), ConfigError> {
    let material = plain(&grid.colors, path, harvest)?;
    let segments = grid.nodes as usize - 1;
    let [root, tip] = grid.radius;
    let mut shape = FibreShape::straight(grid.nodes as usize, grid.length, root, tip, 1.0, 0.0);
    for i in 0..segments {
        let share = (i + 1) as f64 / segments as f64;
        shape.radii[i] = root * math::pow(tip / root, share);
        shape.drag[i] = grid.drag.unwrap_or(shape.radii[i] * grid.length);
    }
    let bend = grid.curve.to_radians() / (segments.max(2) - 1) as f64;
    for rest in shape.rest.iter_mut().skip(1) {
        *rest = DVec2::new(bend.clamp(-1.5, 1.5), 0.0);
    }
    let drag = if grid.drag.is_some() { Drag::Given } else { Drag::Area { coefficient: 0.5 } };
    let (s, c) = math::sin_cos(grid.lean.to_radians());
    let strand = Strand {
        shape,
        place: Place {
            offset: DVec3::ZERO,
            frame: Frame { x: DVec3::new(c, 0.0, -s), y: DVec3::Y, z: DVec3::new(s, 0.0, c) },
        },
        stiffness: (grid.stiffness, grid.exponent),
        relaxation: grid.relaxation,
        break_force: grid.break_force.unwrap_or(f64::INFINITY),
        // Equal fibres look alike.
        variation: 0x0080_8080,
    };
    let [columns, rows] = grid.count;
    let offset = |i: u32, count: u32| (f64::from(i) - 0.5 * f64::from(count - 1)) * grid.spacing;
    for (from_row, from_column) in
        (0..rows).step_by(PATCH).flat_map(|row| (0..columns).step_by(PATCH).map(move |column| (row, column)))
    {
        let corner = DVec3::new(offset(from_column, columns), 0.0, offset(from_row, rows));
        let mut strands = Vec::with_capacity(PATCH * PATCH);
        for row in (from_row..rows).take(PATCH) {
            for column in (from_column..columns).take(PATCH) {
                let place = DVec3::new(offset(column, columns), 0.0, offset(row, rows)) - corner;
                let mut strand = strand.clone();
                // The stand's axes: x, the other way along z, up.
                strand.place.offset = DVec3::new(place.x, -place.z, 0.0);
                strands.push(strand);
            }
        }
        let spread = strands.iter().map(|s| s.place.offset.length()).fold(root, f64::max);
        harvest.seedlings.push(Seedling {
            plant: footless(strands, Vec::new(), spread),
            position: DVec3::from(grid.position) + corner,
            grounded: false,
            yaw: 0.0,
            drag,
            weight: 0.0,
            materials: [material; 2],
            sides: [grid.sides; 2],
            flatness: 1.0,
            species: 0,
        });
    }
    Ok(())
}

fn tuft(scene: &SceneInfo, tuft: &Tuft, path: &str, harvest: &mut Harvest) -> Result<Seedling, ConfigError> {
    if tuft.fibres < tuft.guides {
        let problem = format!("must be at least as many as the guides ({}), is {}", tuft.guides, tuft.fibres);
        return Err(ConfigError::new(format!("{path}.fibres"), problem));
    }
    let material = plain(&tuft.colors, path, harvest)?;
    let mut random = Random::new(scene.seed, fnv1a_32(path.as_bytes()).into());
    let strands = (0..tuft.fibres)
        .map(|number| {
            // A sunflower's head: even over the disc, in the order of phyllotaxis.
            let out = ((f64::from(number) + 0.5) / f64::from(tuft.fibres)).sqrt();
            let (s, c) = math::sin_cos(f64::from(number) * phyllotaxis::GOLDEN_ANGLE);
            let radial = DVec3::new(c, s, 0.0);
            let (ls, lc) = math::sin_cos(tuft.lean.to_radians() * out);
            let frame = Frame {
                x: radial * lc - DVec3::Z * ls,
                y: DVec3::new(-s, c, 0.0),
                z: radial * ls + DVec3::Z * lc,
            };
            let mut shape = FibreShape::straight(
                tuft.nodes as usize,
                tuft.length,
                tuft.radius[0],
                tuft.radius[1],
                1.0,
                0.0,
            );
            shape.drag = vec![tuft.drag; shape.segments()];
            Strand {
                shape,
                place: Place { offset: radial * (out * tuft.spread), frame },
                stiffness: (tuft.stiffness, tuft.exponent),
                relaxation: tuft.relaxation,
                break_force: f64::INFINITY,
                variation: random.bits() as u32,
            }
        })
        .collect();
    let (guides, followers) = split(strands, tuft.guides as usize);
    Ok(Seedling {
        plant: footless(guides, followers, tuft.spread),
        position: DVec3::from(tuft.position),
        grounded: true,
        yaw: 0.0,
        drag: Drag::Given,
        weight: tuft.weight,
        materials: [material; 2],
        sides: [tuft.sides; 2],
        flatness: 1.0,
        species: 0,
    })
}
