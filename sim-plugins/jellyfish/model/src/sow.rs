//! From a configuration to animals where they begin. What there is depends on the seed and the table alone.

use std::collections::BTreeMap;

use glam::DVec3;
use reef_flow::random::{Even, Random, mix};
use reef_sdk::{ConfigError, SceneInfo, ranges};

use crate::{
    bloom::{Birth, Home},
    config::{Config, Group, MOST_ANIMALS},
    species::Species,
};

/// What stands in a configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Stock {
    /// Species by name, in the order of their names.
    pub species: Vec<(String, Species)>,
    /// All animals: those of the groups first, then those that are placed one by one.
    pub births: Vec<Birth>,
}

impl Stock {
    /// Reads the species and places the animals.
    ///
    /// # Errors
    /// A number out of its range, a species that is unknown or wrong, a box without room, too many animals:
    /// with the place.
    pub fn new(scene: &SceneInfo, config: &Config) -> Result<Self, ConfigError> {
        ranges::check(config)?;
        let mut known = BTreeMap::new();
        let groups =
            config.groups.iter().enumerate().map(|(i, group)| (&group.species, format!("groups[{i}]")));
        let placed =
            config.animals.iter().enumerate().map(|(i, one)| (&one.species, format!("animals[{i}]")));
        for (name, path) in groups.chain(placed) {
            if !known.contains_key(name) {
                known.insert(name.clone(), read(scene, name, &format!("{path}.species"))?);
            }
        }
        let species: Vec<(String, Species)> = known.into_iter().collect();
        let number = |name: &str| species.iter().position(|(known, _)| known == name).unwrap_or(0);
        let mut births = Vec::new();
        let refuse = |path: String, problem: String| Err(ConfigError::new(path, problem));
        for (i, group) in config.groups.iter().enumerate() {
            let (path, kind) = (format!("groups[{i}]"), number(&group.species));
            check(group, &path)?;
            fits(&species[kind].1, &group.scale, &path)?;
            let count = births.len() as u64 + u64::from(group.count);
            if count > MOST_ANIMALS {
                let problem = format!("brings the scene to {count} animals; the limit is {MOST_ANIMALS}");
                return refuse(format!("groups[{i}].count"), problem);
            }
            let seed = mix(group.seed.map_or(scene.seed, u64::from) ^ mix(i as u64));
            place(group, kind, seed, &mut births);
        }
        for (i, own) in config.animals.iter().enumerate() {
            if births.len() as u64 >= MOST_ANIMALS {
                return refuse(
                    format!("animals[{i}]"),
                    format!("is one too many; the limit is {MOST_ANIMALS}"),
                );
            }
            if own.aim == [0.0; 3] {
                return refuse(format!("animals[{i}].aim"), "must be a direction, is [0, 0, 0]".to_owned());
            }
            fits(&species[number(&own.species)].1, &[own.scale], &format!("animals[{i}]"))?;
            let chance = own.seed.map_or(mix(scene.seed ^ mix(i as u64)), u64::from);
            births.push(Birth {
                species: number(&own.species),
                place: own.position.into(),
                yaw: own.heading.to_radians(),
                size: own.scale,
                seed: chance,
                id: births.len() as u64 + 1,
                frequency: own.frequency,
                phase: own.phase,
                aim: own.aim.into(),
                home: None,
                tracers: own.tracers as usize,
                slices: own.slices as usize,
            });
        }
        Ok(Self { species, births })
    }
}

fn check(group: &Group, path: &str) -> Result<(), ConfigError> {
    if !DVec3::from(group.low).cmplt(group.high.into()).all() {
        let problem = format!("must be above `low`, {:?}, along x, y and z; is {:?}", group.low, group.high);
        return Err(ConfigError::new(format!("{path}.high"), problem));
    }
    let [least, most] = group.scale;
    if least > most {
        let problem = format!("the least, {least}, is above the greatest, {most}");
        return Err(ConfigError::new(format!("{path}.scale"), problem));
    }
    Ok(())
}

/// The animals of a group.
fn place(group: &Group, species: usize, seed: u64, births: &mut Vec<Birth>) {
    let (low, high) = (DVec3::from(group.low), DVec3::from(group.high));
    let even = Even::new(seed);
    for i in 0..group.count {
        let mut random = Random::new(seed, u64::from(i) + 1);
        births.push(Birth {
            species,
            place: even.place(i, group.low, group.high).into(),
            yaw: core::f64::consts::TAU * random.unit(),
            size: random.between(group.scale[0], group.scale[1]),
            seed: random.bits(),
            id: births.len() as u64 + 1,
            home: Some(Home { low, high }),
            slices: group.slices as usize,
            ..Birth::default()
        });
    }
}

fn read(scene: &SceneInfo, name: &str, path: &str) -> Result<Species, ConfigError> {
    let species: Species = scene.species_at(name, path)?;
    species.check().map_err(|problem| {
        // The message begins with the key.
        let (key, problem) = problem.split_once(": ").unwrap_or(("", &problem));
        ConfigError::new(format!("species.{name}.{key}"), problem)
    })?;
    Ok(species)
}

/// Whether individuals of these sizes can be made of a species.
fn fits(species: &Species, sizes: &[f64], path: &str) -> Result<(), ConfigError> {
    for size in sizes {
        species.sized(*size).check_sizes().map_err(|problem| {
            ConfigError::new(format!("{path}.scale"), format!("at a size of {size} is wrong: {problem}"))
        })?;
    }
    Ok(())
}
