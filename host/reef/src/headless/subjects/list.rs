//! What there is to be seen in a scene, thing by thing, and how each is taken out.

use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
};

use reef_render::{Settings, markers::Markers};
use reef_report::failure::Failure;
use reef_sea::{
    World,
    scene::{Scene, format::SceneFile},
};
use reef_streams::environment::Environment;
use serde_json::Value as Json;

use super::{super::show::Show, changed};

/// Something that a scene shows.
pub struct Subject {
    /// Its key in the file.
    pub name: String,
    /// How it is taken out.
    pub without: Without,
}

/// How something is taken out.
pub enum Without {
    /// What this module emitted is not drawn.
    Module(usize),
    /// What belongs to these objects of a module is not drawn.
    Objects(usize, HashSet<u64>),
    /// Ground and rocks are others.
    Setting(Box<Environment>),
    /// Something is switched off.
    Switch(fn(&Settings) -> Settings),
    /// A sea that never had it, which runs beside the whole one.
    Anew(Box<Show>),
}

/// Makes the sea of a scene.
type Make<'a> = &'a dyn Fn(Scene) -> Result<World, Failure>;

/// Everything that a scene holds. `world`: its sea before the first step.
pub fn subjects(scene: &Scene, world: &World, make: Make<'_>) -> Result<Vec<Subject>, Failure> {
    let mut found = Vec::new();
    let mut add = |name: String, without: Without| found.push(Subject { name, without });
    for (at, module) in scene.modules.iter().enumerate() {
        add(format!("modules.{}", module.name), Without::Module(at));
        let groups = groups(scene, at, world, make)?;
        // One thing alone is the module.
        if groups.len() > 1 {
            for (name, ids) in groups {
                add(format!("modules.{}.{name}", module.name), Without::Objects(at, ids));
            }
        }
    }
    ground(scene, world, &mut add);
    let table = &scene.file.scene;
    if table.debug {
        add("scene.debug".into(), Without::Switch(|settings| Settings { debug_channels: 0, ..*settings }));
    }
    if table.singularities {
        let hide = |settings: &Settings| Settings {
            markers: Markers { singularities: false, ..settings.markers },
            ..*settings
        };
        add("scene.singularities".into(), Without::Switch(hide));
    }
    if table.bounds {
        let hide = |settings: &Settings| Settings {
            markers: Markers { bounds: false, ..settings.markers },
            ..*settings
        };
        add("scene.bounds".into(), Without::Switch(hide));
    }
    for (name, other) in motion(scene) {
        add(name, Without::Anew(Box::new(Show::new(make(other)?))));
    }
    Ok(found)
}

fn ground(scene: &Scene, world: &World, add: &mut dyn FnMut(String, Without)) {
    let (Some(table), Some(terrain)) = (&scene.file.terrain, &world.environment().terrain) else { return };
    let bare =
        |change: &dyn Fn(&mut Environment)| Without::Setting(changed(world.environment(), |e| change(e)));
    add("terrain".into(), bare(&|environment| environment.terrain = None));
    // The listed rocks come before the scattered ones.
    let listed = table.rock.len();
    for (name, gone) in [("terrain.rock", 0..listed), ("terrain.rocks", listed..terrain.rocks.len())] {
        if !gone.is_empty() {
            let mut other = (**terrain).clone();
            other.rocks.drain(gone);
            let other = Arc::new(other);
            add(name.into(), bare(&|environment| environment.terrain = Some(other.clone())));
        }
    }
}

/// What is seen by what it moves — waves, flows, obstacles — and the scene without each.
fn motion(scene: &Scene) -> Vec<(String, Scene)> {
    let file = &scene.file;
    let mut scenes = Vec::new();
    let mut add = |name: String, edit: &dyn Fn(&mut SceneFile)| {
        let mut other = scene.clone();
        edit(&mut other.file);
        scenes.push((name, other));
    };
    if file.waves.is_some() {
        add("waves".into(), &|file| file.waves = None);
    }
    if !file.wave.is_empty() {
        add("wave".into(), &|file| file.wave.clear());
    }
    if !file.obstacle.is_empty() {
        add("obstacle".into(), &|file| file.obstacle.clear());
    }
    for at in 0..file.flow.len() {
        add(format!("flow[{at}]"), &|file| {
            file.flow.remove(at);
        });
    }
    scenes
}

/// The objects of each kind of thing in a module's lists: those of one `kind` or `species`, else of each
/// element.
fn groups(
    scene: &Scene,
    module: usize,
    world: &World,
    make: Make<'_>,
) -> Result<Vec<(String, HashSet<u64>)>, Failure> {
    let mut groups: Vec<(String, HashSet<u64>)> = Vec::new();
    let Some(config) = scene.modules[module].config.as_object() else { return Ok(groups) };
    let lists = config.iter().filter_map(|(key, list)| Some((key, list.as_array()?)));
    let lists: Vec<_> =
        lists.filter(|(_, list)| list.iter().all(Json::is_object) && !list.is_empty()).collect();
    if lists.iter().map(|(_, list)| list.len()).sum::<usize>() < 2 {
        return Ok(groups);
    }
    let whole = objects(world, module);
    for (key, list) in lists {
        let mut before = objects_with(scene, module, key, 0, make)?;
        for (at, element) in list.iter().enumerate() {
            let after = if at + 1 == list.len() {
                whole.clone()
            } else {
                objects_with(scene, module, key, at + 1, make)?
            };
            let name = format!("{key}{}", label(element, at));
            let ids = added(&before, &after, &whole)
                .ok_or_else(|| Failure::check(miette::miette!("{name}: its objects cannot be told apart")))?;
            match groups.iter_mut().find(|(known, _)| *known == name) {
                Some((_, known)) => known.extend(ids),
                None => groups.push((name, ids)),
            }
            before = after;
        }
    }
    Ok(groups)
}

/// What a thing in a list is called: by its kind, its species, or its place.
fn label(element: &Json, at: usize) -> String {
    let texts = |value: &Json| -> Vec<String> {
        let list = value.as_array().map_or(std::slice::from_ref(value), Vec::as_slice);
        list.iter().filter_map(Json::as_str).map(str::to_owned).collect()
    };
    for key in ["kind", "species"] {
        if let Some(value) = element.get(key) {
            return format!(" with {key} {}", texts(value).join(", "));
        }
    }
    format!("[{at}]")
}

/// Id and origin of each object of a module.
type Listed = Vec<(u64, [f64; 3])>;

fn objects(world: &World, module: usize) -> Listed {
    let outputs = world.frame().outputs.get(module);
    let objects = outputs.map(|outputs| outputs.objects.as_slice()).unwrap_or_default();
    objects.iter().map(|object| (object.id, object.origin)).collect()
}

/// The same in a scene of this module alone, in which a list ends after `count` elements.
fn objects_with(
    scene: &Scene,
    module: usize,
    key: &str,
    count: usize,
    make: Make<'_>,
) -> Result<Listed, Failure> {
    let mut scene = scene.clone();
    scene.modules = vec![scene.modules.swap_remove(module)];
    if let Some(list) = scene.modules[0].config.get_mut(key).and_then(Json::as_array_mut) {
        list.truncate(count);
    }
    Ok(objects(&make(scene)?, 0))
}

/// The ids in the whole scene of what a longer list adds: things begin in the same places, however many
/// others there are. None: they do not.
fn added(before: &Listed, after: &Listed, whole: &Listed) -> Option<HashSet<u64>> {
    let place = |origin: &[f64; 3]| origin.map(f64::to_bits);
    let mut known: HashMap<[u64; 3], usize> = HashMap::new();
    for (_, origin) in before {
        *known.entry(place(origin)).or_default() += 1;
    }
    let mut ids = HashSet::new();
    let mut seen: HashMap<[u64; 3], usize> = HashMap::new();
    for (_, origin) in after {
        let place = place(origin);
        let number = seen.entry(place).or_default();
        *number += 1;
        // Of those in one place, the first were there before.
        if *number > known.get(&place).copied().unwrap_or(0) {
            let mut there = whole.iter().filter(|(_, at)| at.map(f64::to_bits) == place);
            ids.insert(there.nth(*number - 1)?.0);
        }
    }
    (ids.len() + before.len() == after.len()).then_some(ids)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn listed(places: &[f64]) -> Listed {
        (1..).zip(places).map(|(id, x)| (id, [*x, 0.0, 0.0])).collect()
    }

    #[test]
    fn what_a_longer_list_adds_is_found_in_the_whole_scene() {
        let whole = listed(&[1.0, 2.0, 3.0, 8.0, 9.0]);
        // Two of three elements of the first list; the second list's objects come after them.
        let ids = added(&listed(&[1.0, 8.0, 9.0]), &listed(&[1.0, 2.0, 8.0, 9.0]), &whole);
        assert_eq!(ids, Some(HashSet::from([2])));
        let boxes = listed(&[4.0, 4.0]);
        assert_eq!(added(&listed(&[4.0]), &boxes, &boxes), Some(HashSet::from([2])), "in the same place");
        let sorted = listed(&[3.0, 1.0, 2.0]);
        let ids = added(&listed(&[1.0]), &listed(&[3.0, 1.0]), &sorted);
        assert_eq!(ids, Some(HashSet::from([1])), "in another order");
        let moved = listed(&[1.0, 7.0, 8.0, 9.0]);
        assert_eq!(added(&listed(&[1.0, 8.0, 9.0]), &moved, &whole), None, "others are where they were");
    }

    #[test]
    fn things_are_called_by_their_kind_species_or_place() {
        assert_eq!(label(&json!({ "kind": "sand" }), 3), " with kind sand");
        assert_eq!(label(&json!({ "species": ["a", "b"] }), 3), " with species a, b");
        assert_eq!(label(&json!({ "nodes": 7 }), 3), "[3]");
    }
}
