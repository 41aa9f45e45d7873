//! Plugins that were found and that nobody has asked for yet, in a process of its own: builds are tried by
//! another one first, from then on.

use std::{
    fs, slice, thread,
    time::{Duration, Instant},
};

use reef_plugin::{
    Registry,
    probe::{self, Probe},
};
use reef_sea::{
    Options, World,
    reload::{Live, Setup},
    scene,
};
use reef_tests::{
    artifacts::{artifacts, workspace},
    child,
};

const ID: &str = "example.kelp-rust";

#[test]
fn what_a_newer_build_replaced_is_not_loaded_any_more() {
    let ended = child::run("dormant::child_that_replaces", "run", Duration::from_secs(60));
    assert!(ended.status.is_some_and(|status| status.success()), "{}", ended.text);
}

#[test]
#[ignore = "in a process of its own"]
fn child_that_replaces() {
    if child::task().is_none() {
        return;
    }
    probe::offer(Probe { program: artifacts().reef().to_owned(), known: None, patience: None });
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path().join(format!("libkelp{}", std::env::consts::DLL_SUFFIX));
    fs::copy(artifacts().plugin("reef_example_rust"), &library).unwrap();
    let mut registry = Registry::new();
    registry.load_folder(folder.path(), 1, true);
    assert!(registry.plugins().is_empty(), "it is dormant");
    assert_eq!(registry.ids().collect::<Vec<_>>(), [ID]);
    let newer = crate::load(&library, 1);
    assert!(registry.replace(slice::from_ref(&newer)).is_empty(), "none was loaded");
    assert_eq!((registry.ids().collect::<Vec<_>>(), registry.paths()), (vec![ID], vec![&*library]));
    registry.wake();
    assert_eq!(registry.plugins().len(), 1);
}

#[test]
fn a_new_build_that_nobody_uses_is_loaded_when_a_scene_asks() {
    let ended = child::run("dormant::child_that_watches", "run", Duration::from_secs(120));
    assert!(ended.status.is_some_and(|status| status.success()), "{}", ended.text);
}

#[test]
#[ignore = "in a process of its own"]
fn child_that_watches() {
    if child::task().is_none() {
        return;
    }
    probe::offer(Probe { program: artifacts().reef().to_owned(), known: None, patience: None });
    let folder = tempfile::tempdir().unwrap();
    let (plugins, path) = (folder.path().join("plugins"), folder.path().join("sea.toml"));
    fs::create_dir(&plugins).unwrap();
    let text = "[scene]\nname = \"Watched\"\n";
    fs::write(&path, text).unwrap();
    let (registry, assets) = (Registry::new(), workspace().join("assets"));
    let scene = scene::load(&path, &assets, &registry).unwrap();
    let mut world = World::new(scene, &registry, &Options::default()).unwrap();
    let folders = vec![plugins.clone()];
    let setup = Setup { plugins: registry, folders, workers: 1, seed: None, assets };
    let mut live = Live::new(setup, &world).unwrap();
    let news = |live: &mut Live, world: &mut World| {
        let end = Instant::now() + Duration::from_secs(40);
        while Instant::now() < end {
            live.tend(world);
            if let Some(notice) = live.take_notices().pop() {
                return notice.text;
            }
            thread::sleep(Duration::from_millis(5));
        }
        String::new()
    };
    let library = plugins.join(format!("libkelp{}", std::env::consts::DLL_SUFFIX));
    fs::copy(artifacts().plugin("reef_example_rust"), &library).unwrap();
    let told = news(&mut live, &mut world);
    assert!(told.contains(ID) && told.contains("no module of this scene uses it"), "{told}");
    assert!(live.plugins().plugins().is_empty(), "it is not loaded");
    assert_eq!(live.plugins().ids().collect::<Vec<_>>(), [ID]);
    fs::write(&path, format!("{text}[modules.kelp]\nuse = \"{ID}\"\n")).unwrap();
    let told = news(&mut live, &mut world);
    assert!(told.contains("began anew") && told.contains("kelp"), "{told}");
    assert_eq!((world.modules().len(), live.plugins().plugins().len()), (1, 1));
}
