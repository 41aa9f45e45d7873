//! A sea that jumps in time is, byte for byte, where playing would have brought it: for every module, and
//! with what came from outside in between.

use std::fs;

use reef_plugin::{ParamKind, Registry};
use reef_sea::{
    Options, Timeline, World, scene,
    step::{
        hash::{Chain, Digest},
        water::Poke,
    },
};
use reef_tests::{artifacts::workspace, own};

/// Steps that are played.
const LAST: u64 = 150;

/// A sea of one of Reef's scenes that remembers this much [bytes].
fn sea(name: &str, plugins: &Registry, history: usize) -> World {
    let assets = workspace().join("assets");
    let path = assets.join("scenes").join(format!("{name}.toml"));
    let scene = scene::load(&path, &assets, plugins).expect("a sound scene");
    World::new(scene, plugins, &Options { history, ..Options::default() }).expect("a sea")
}

/// Sets some parameter of each module to this place in its range.
fn set(world: &mut World, share: f64) {
    let count = world.modules().len();
    for module in 0..count {
        let params = &world.instance(module).expect("a module").info().params;
        let found = params.iter().find(|param| param.kind == ParamKind::Float);
        let Some(param) = found else { continue };
        let (id, value) = (param.id, param.minimum + share * (param.maximum - param.minimum));
        assert!(world.set_param(module, id, value));
    }
}

/// What comes from outside for the step after the present one.
fn come(world: &mut World) {
    match world.clock().step {
        20 => set(world, 0.3),
        33 | 34 => {
            let at = world.frame().camera;
            let [x, y, z] = at.position.to_array();
            let poke = Poke {
                point: [x, y - 0.1, z - 0.8],
                object: 0,
                motion: [0.4, 0.0, 0.1],
                view: [0.0, 0.0, -1.0],
                speed: 0.5,
                reach: 0.6,
            };
            assert!(world.poke(poke));
        }
        64 => {
            let mut camera = world.frame().camera;
            camera.position.x += 1.0;
            world.set_camera(Some(camera));
        }
        90 => set(world, 0.6),
        _ => {}
    }
}

fn hash(world: &mut World) -> Digest {
    Chain::default().add(world).expect("all modules give their states")
}

/// Plays to a step; the hashes of all steps from the present one on.
fn play(world: &mut World, to: u64) -> Vec<Digest> {
    let mut hashes = vec![hash(world)];
    while world.clock().step < to {
        come(world);
        world.step();
        hashes.push(hash(world));
    }
    hashes
}

fn jump(world: &mut World, to: u64) {
    world.go_to(to).expect("all modules run");
    world.step_to(to);
}

/// One scene of each module, and one of several.
fn scenes() -> Vec<String> {
    let entries = fs::read_dir(workspace().join("assets/scenes")).expect("scenes");
    let mut all: Vec<String> =
        entries.filter_map(|entry| Some(entry.ok()?.path().file_stem()?.to_str()?.to_owned())).collect();
    all.sort();
    let of = |own: &own::Own| {
        let begin = own.id.trim_start_matches("reef.");
        all.iter().rfind(|name| name.starts_with(begin)).expect("a scene of each module").clone()
    };
    own::modules().map(of).chain(["reef".to_owned()]).collect()
}

#[test]
fn a_jump_ends_where_playing_ends_for_every_module() {
    let plugins = own::registry(2);
    for scene in scenes() {
        let mut world = sea(&scene, &plugins, 256 << 20);
        let played = play(&mut world, LAST);
        let journal = world.journal().clone();
        assert!(world.memory().states > 1, "{scene}: {:?}", world.memory());
        for to in [140, 3, 139, 0, 1, LAST, 77, 91, 90, 65, 21, 20, 149] {
            jump(&mut world, to);
            assert!(hash(&mut world) == played[to as usize], "{scene}: step {to}");
        }
        assert_eq!(world.memory().to, LAST, "{scene}");
        jump(&mut world, LAST);
        assert_eq!(*world.journal(), journal, "{scene}");
    }
}

#[test]
fn what_comes_after_a_jump_back_begins_another_future() {
    let plugins = own::registry(2);
    let mut world = sea("reef", &plugins, 256 << 20);
    play(&mut world, LAST);
    jump(&mut world, 60);
    set(&mut world, 0.8);
    world.step();
    assert_eq!(world.memory().to, 61);
    for to in [100, 62, 120] {
        jump(&mut world, to);
    }
    let mut other = sea("reef", &plugins, 0);
    play(&mut other, 60);
    set(&mut other, 0.8);
    while other.clock().step < 120 {
        other.step();
    }
    assert!(hash(&mut world) == hash(&mut other));
    assert_eq!(world.journal().entries, other.journal().entries);
    // What waits for the next step when the sea jumps belongs to where it was.
    jump(&mut world, 30);
    set(&mut world, 0.1);
    jump(&mut world, 10);
    jump(&mut world, 40);
    let mut other = sea("reef", &plugins, 0);
    play(&mut other, 30);
    set(&mut other, 0.1);
    jump(&mut other, 40);
    assert!(hash(&mut world) == hash(&mut other));
}

#[test]
fn memory_for_the_past_is_bounded_and_jumps_are_the_same_without_any() {
    let plugins = own::registry(2);
    let mut world = sea("reef", &plugins, 6 << 20);
    let played = play(&mut world, LAST);
    let memory = world.memory();
    assert!(memory.states > 0 && memory.used <= memory.most, "{memory:?}");
    let mut none = sea("reef", &plugins, 0);
    play(&mut none, LAST);
    assert_eq!(none.memory().states, 0);
    for to in [149, 25] {
        for world in [&mut world, &mut none] {
            jump(world, to);
            assert!(hash(world) == played[to as usize], "step {to}");
        }
    }
}

#[test]
fn a_way_is_walked_picture_by_picture_and_stops_when_asked() {
    let plugins = own::registry(2);
    let mut world = sea("reef", &plugins, 256 << 20);
    let played = play(&mut world, LAST);
    let mut timeline = Timeline::new(world);
    timeline.paused = true;
    timeline.go_to(70).expect("all modules run");
    let from = timeline.way().expect("it is on the way").from;
    assert!((1..70).contains(&from), "{from}");
    while timeline.way().is_some() {
        assert!(timeline.advance(0.0) > 0);
    }
    assert!(hash(&mut timeline.world) == played[70]);
    assert_eq!(timeline.blend().current.step, 70);
    timeline.go_to(LAST + 5000).expect("all modules run");
    timeline.advance(0.0);
    timeline.stop(|_| ());
    let here = timeline.world.clock().step;
    assert!((71..LAST + 5000).contains(&here));
    assert_eq!(timeline.advance(1.0), 0, "it stands still, as before");
    assert_eq!(timeline.world.clock().step, here);
}
