//! From a configuration to fish where they begin. What there is depends on the seed and the table alone.

use std::collections::BTreeMap;

use glam::DVec3;
use reef_flow::random::{Even, Random, mix};
use reef_sdk::{ConfigError, Held, SceneInfo, ranges};

use crate::{
    breed::Breed,
    config::{Config, Group, MOST_FISH},
    shoal::{Habitat, Kind, Shoal, Start},
    species::Species,
};

/// What stands in a configuration.
#[derive(Debug)]
pub struct Stock {
    /// Species, in the order of their names.
    pub breeds: Vec<(String, Held<Breed>)>,
    /// All fish where they begin.
    pub shoal: Shoal,
}

impl Stock {
    /// Reads the species and places the fish.
    ///
    /// # Errors
    /// A number out of its range, a species that is unknown or wrong, a box without room, too many fish: with
    /// the place.
    pub fn new(scene: &SceneInfo, config: &Config) -> Result<Self, ConfigError> {
        ranges::check(config)?;
        let mut breeds: BTreeMap<String, Held<Breed>> = BTreeMap::new();
        let mut count = 0;
        for (i, group) in config.groups.iter().enumerate() {
            check(group, &format!("groups[{i}]"))?;
            count += u64::from(group.count);
            if count > MOST_FISH {
                let problem = format!("brings the scene to {count} fish; the limit is {MOST_FISH}");
                return Err(ConfigError::new(format!("groups[{i}].count"), problem));
            }
            if !breeds.contains_key(&group.species) {
                let breed = read(scene, &group.species, &format!("groups[{i}].species"))?;
                breeds.insert(group.species.clone(), breed);
            }
        }
        let breeds: Vec<(String, Held<Breed>)> = breeds.into_iter().collect();
        let number = |name: &str| breeds.iter().position(|(known, _)| known == name);
        let kind = |(_, breed): &(String, Held<Breed>)| {
            // A species that is not here is nobody's prey.
            let prey = breed
                .species()
                .mind
                .prey
                .iter()
                .filter_map(|name| number(name))
                .map(|prey| prey as u32)
                .collect();
            Kind::made(breed.species(), breed.plan().clone(), breed.gait().clone(), prey)
        };
        let kinds = breeds.iter().map(kind).collect();
        let habitats = config.groups.iter().map(habitat).collect();
        let mut starts = Vec::with_capacity(count as usize);
        for (i, group) in config.groups.iter().enumerate() {
            let Some(kind) = number(&group.species) else { continue };
            let seed = mix(group.seed.map_or(scene.seed, u64::from) ^ mix(i as u64));
            let variation = breeds[kind].1.species().variation;
            place(group, [kind as u32, i as u32], seed, variation, &mut starts);
        }
        let shoal =
            Shoal::new(kinds, habitats, &starts).map_err(|problem| ConfigError::new("groups", problem))?;
        Ok(Self { breeds, shoal })
    }
}

fn habitat(group: &Group) -> Habitat {
    Habitat { low: group.low.into(), high: group.high.into() }
}

fn check(group: &Group, path: &str) -> Result<(), ConfigError> {
    let refuse = |key: &str, problem: String| Err(ConfigError::new(format!("{path}.{key}"), problem));
    let Habitat { low, high } = habitat(group);
    if !low.cmplt(high).all() {
        let problem = format!("must be above `low`, {:?}, along x, y and z; is {:?}", group.low, group.high);
        return refuse("high", problem);
    }
    let [least, most] = group.scale;
    if least > most {
        return refuse("scale", format!("the least, {least}, is above the greatest, {most}"));
    }
    if let Some(position) = group.position {
        let at = DVec3::from(position);
        if !(low.cmplt(at).all() && at.cmplt(high).all()) {
            let problem = format!("must lie between `low` and `high`, is {position:?}");
            return refuse("position", problem);
        }
    }
    Ok(())
}

/// The fish of a group, of a kind, in a habitat.
fn place(group: &Group, [kind, number]: [u32; 2], seed: u64, variation: f64, starts: &mut Vec<Start>) {
    let Habitat { low, high } = habitat(group);
    let even = Even::new(seed);
    for i in 0..group.count {
        let mut random = Random::new(seed, u64::from(i) + 1);
        let position = match group.position {
            None => even.place(i, group.low, group.high).into(),
            Some(at) => {
                // All over the ball: the greatest of three is spread as the cube's root is.
                let mut own = Random::new(mix(seed), u64::from(i));
                let far = own.unit().max(own.unit()).max(own.unit()) * group.around;
                let up = own.signed();
                let (cos, sin) = reef_flow::math::cos_sin_f64(core::f64::consts::PI * own.signed());
                let level = (1.0 - up * up).sqrt();
                let off = DVec3::new(level * cos, up, level * sin) * far;
                (DVec3::from(at) + off).max(low.lerp(high, 1e-3)).min(high.lerp(low, 1e-3))
            }
        };
        let turn = 360.0 * random.unit();
        let size = random.between(group.scale[0], group.scale[1]) * (1.0 + variation * random.signed());
        let homes = &group.homes;
        let home = homes.get(i as usize % homes.len().max(1)).map(|home| DVec3::from(*home));
        starts.push(Start {
            kind,
            position,
            heading: group.heading.unwrap_or(turn).to_radians(),
            size,
            habitat: number,
            home,
            seed: random.bits(),
        });
    }
}

fn read(scene: &SceneInfo, name: &str, path: &str) -> Result<Held<Breed>, ConfigError> {
    let species: Species = scene.species_at(name, path)?;
    let at = |key: &str, problem: String| ConfigError::new(format!("species.{name}.{key}"), problem);
    species.check(name).map_err(|error| at(&error.key, error.problem))?;
    Breed::of(&species).map_err(|error| at(&error.key, error.problem))
}
