//! The sea as a whole, with a small plugin that is linked in: the same bytes whatever the workers, saves,
//! loads and replays.

use std::{fs, path::PathBuf};

use reef_plugin::Registry;
use reef_sdk::{Chunks, prelude::*};
use reef_sea::{
    Options, Timeline, World,
    scene::{self, reference},
    step::{
        hash::{Chain, Digest},
        journal::Journal,
        record,
        water::Poke,
    },
};
use reef_streams::frame::CameraPose;

/// Bodies that drift with the water, push it themselves, and follow the actors that they hear of.
struct Drifters {
    positions: Vec<[f64; 3]>,
    pulled: Vec<f64>,
    age: f64,
    fails_at: Option<u64>,
}

#[derive(serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Config {
    /// How many.
    #[schemars(range(min = 1, max = 1000))]
    count: u32,
    /// Fails in this step.
    #[serde(default)]
    fails_at: Option<u64>,
    /// Says that its configuration is wrong.
    #[serde(default)]
    wrong: Option<bool>,
}

const GAIN: u32 = 7;

impl Plugin for Drifters {
    const ID: &'static str = "test.drifters";
    const NAME: &'static str = "Drifters";
    const VERSION: &'static str = "1.0.0";
    const VENDOR: &'static str = "Test";
    const DESCRIPTION: &'static str = "Bodies that drift.";
    const STATE_VERSION: u32 = 1;
    const STATE_MIN_VERSION: u32 = 1;
    type Config = Config;

    fn traces() -> &'static [&'static str] {
        &["fish"]
    }

    fn params() -> &'static [Param] {
        const PARAMS: &[Param] =
            &[Param::float(GAIN, "gain").range(0.0, 4.0).default(1.0).help("How much they drift.")];
        PARAMS
    }

    fn create(_: &Host, scene: &SceneInfo, config: Config) -> Result<Self, ConfigError> {
        if config.wrong == Some(true) {
            return Err(ConfigError::new("wrong", "this is wrong, indeed"));
        }
        let place = |at: u32| {
            let spread = f64::from(at.wrapping_mul(2_654_435_761) ^ scene.seed as u32) / f64::from(u32::MAX);
            [spread, -2.0 - 0.01 * f64::from(at), 1.0 - spread]
        };
        let positions: Vec<_> = (0..config.count).map(place).collect();
        Ok(Self { pulled: vec![0.0; positions.len()], positions, age: 0.0, fails_at: config.fails_at })
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        if self.fails_at == Some(input.step()) {
            panic!("asked to fail");
        }
        let dt = input.dt();
        let gain = input.param(GAIN);
        self.age += dt;
        let pokes = input.events().iter().filter(|event| event.kind == abi::EVENT_POKE).count() as f64;
        let (flow, actors) = (input.flow(), input.actors());
        let parts = (Chunks::new(&mut self.positions, 4), Chunks::new(&mut self.pulled, 4));
        input.workers().for_each_part(parts, |chunk, (positions, pulled)| {
            for (at, (position, pulled)) in positions.iter_mut().zip(pulled).enumerate() {
                let own = (chunk * 4 + at) as u64 + 1;
                for flow in flow.iter().filter(|flow| flow.owner != own) {
                    let square: f64 = (0..3).map(|i| (position[i] - flow.position[i]).powi(2)).sum();
                    let push = f64::from(flow.strength) / (0.1 + square);
                    for ((x, center), axis) in position.iter_mut().zip(flow.position).zip(flow.axis) {
                        *x += dt * gain * (push * (*x - center) + 0.1 * f64::from(axis));
                    }
                }
                for actor in actors.iter().filter(|actor| actor.id != own) {
                    *pulled += dt * (actor.position[0] - position[0]) + pokes;
                }
                position[1] = position[1].clamp(-8.0, 0.0);
            }
        });
        let count = self.positions.len();
        let objects = output.reserve::<abi::Object>(count)?;
        for (at, object) in objects.iter_mut().enumerate() {
            let radius = 1.0;
            *object = abi::Object {
                id: at as u64 + 1,
                origin: self.positions[at],
                bounds_radius: radius,
                ..Default::default()
            };
        }
        output.commit::<abi::Object>(count)?;
        let flows: Vec<abi::Flow> = (0..count.min(5))
            .map(|at| abi::Flow {
                owner: at as u64 + 1,
                kind: abi::FLOW_SOURCE,
                position: self.positions[at],
                axis: [0.0, 1.0, 0.0],
                strength: 0.01 + 0.001 * self.pulled[at].sin().abs() as f32,
                peak: 1.0,
                ..Default::default()
            })
            .collect();
        output.emit(&flows)?;
        let actors: Vec<abi::Actor> = (0..count.min(3))
            .map(|at| abi::Actor {
                id: at as u64 + 1,
                position: self.positions[at],
                radius: 0.1,
                ..Default::default()
            })
            .collect();
        output.emit(&actors)?;
        if input.wants_trace() {
            let trace: Vec<abi::Trace> = (0..count)
                .map(|at| abi::Trace {
                    object: at as u64,
                    position: self.positions[at],
                    radius: 0.25,
                    node: 0,
                    kind: 0,
                    spare: 0,
                })
                .collect();
            output.emit(&trace)?;
        }
        Ok(Status::Ok)
    }

    fn save(&self, state: &mut StateWriter) {
        state.put("positions", self.positions.as_flattened());
        state.put("pulled", &self.pulled);
        state.put_one("age", self.age);
    }

    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
        let flat: Vec<f64> = state.get("positions")?;
        self.positions = flat.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        self.pulled = state.get("pulled")?;
        self.age = state.get_one("age")?;
        Ok(())
    }
}

const SCENE: &str = r#"
[scene]
name = "Test"
seed = 5
dt = 0.02

[camera]
orbit = { center = [0, -3, 0], radius = 4, period = 3 }

[terrain]
size = [8, 8]
cell = 0.5
rocks = { count = 3, clearing = 0.5 }

[[flow]]
kind = "whirlwind"
strength = { keys = [{ time = 0, value = 0.1 }, { time = 1, value = -0.2 }] }
position = [0, -2, 0]

[[flow]]
kind = "source"
strength = 0.03
attach = { module = "crowd", object = 2 }

[[flow]]
kind = "directional"
direction = [1, 0, 0]
speed = 0.1
modulation = 0.5
wavelength = 2

[modules.crowd]
use = "test.drifters"
count = 40
params = { gain = 0.5 }

[modules.pair]
use = "test.drifters"
count = 2
"#;

fn registry(workers: usize) -> Registry {
    let mut registry = Registry::new();
    registry.add_linked(reef_sdk::entry::<Drifters>(), workers).expect("the linked plugin is sound");
    registry
}

struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn world(&self, text: &str, workers: usize, trace: bool) -> World {
        let path = self.file("test.toml");
        fs::write(&path, text).expect("a file");
        let registry = registry(workers);
        let scene = scene::load(&path, self.0.path(), &registry).expect("a good scene");
        World::new(scene, &registry, &Options { trace, ..Options::default() }).expect("a good world")
    }
}

fn poke(x: f64) -> Poke {
    Poke {
        point: [x, -2.0, 0.0],
        object: 0,
        motion: [0.5, 0.0, 0.0],
        view: [0.0, 0.0, -1.0],
        speed: 0.8,
        reach: 1.0,
    }
}

/// Steps, with somebody's hands in the water between steps 10 and 40.
fn run(world: &mut World, chain: &mut Chain, steps: u64, hands: bool) -> Digest {
    for _ in 0..steps {
        if hands {
            match world.clock().step {
                10 => assert!(world.set_param(0, GAIN, 2.5)),
                12 | 20 => assert!(world.poke(poke(0.1))),
                25 => world.set_camera(Some(CameraPose { fov_y: 0.8, ..world.frame().camera })),
                40 => world.set_camera(None),
                _ => {}
            }
        }
        world.step();
        chain.add(world).expect("a state can be saved");
    }
    chain.digest
}

fn hash(world: &mut World, steps: u64) -> Digest {
    run(world, &mut Chain::default(), steps, false)
}

#[test]
fn one_worker_and_many_give_the_same_bytes_twice() {
    let place = Place::new();
    let first = hash(&mut place.world(SCENE, 1, false), 60);
    assert_eq!(first, hash(&mut place.world(SCENE, 2, false), 60));
    assert_eq!(first, hash(&mut place.world(SCENE, 5, false), 60));
    assert_eq!(first, hash(&mut place.world(SCENE, 1, true), 60), "recording changes nothing");
    assert_ne!(first, hash(&mut place.world(&SCENE.replace("seed = 5", "seed = 6"), 1, false), 60));
    assert_ne!(first, hash(&mut place.world(&SCENE.replace("0.03", "0.031"), 1, false), 60));
}

#[test]
fn a_save_and_load_in_the_middle_changes_nothing() {
    let place = Place::new();
    let mut whole = Chain::default();
    run(&mut place.world(SCENE, 2, false), &mut whole, 60, true);
    let mut first = place.world(SCENE, 1, false);
    let mut chain = Chain::default();
    // In the middle of a poke, with a camera by hand and a changed parameter.
    run(&mut first, &mut chain, 30, true);
    let file = place.file("state");
    first.save_to(&file, Some(&chain)).expect("a state");
    let mut second = place.world(SCENE, 2, false);
    run(&mut second, &mut Chain::default(), 7, false);
    let mut continued = second.load_from(&file).expect("the state fits").expect("it carries its chain");
    assert_eq!(second.clock().step, 30);
    assert_eq!(second.param(0, GAIN), Some(2.5));
    assert_eq!(run(&mut second, &mut continued, 30, true), whole.digest);
}

#[test]
fn a_journal_replayed_gives_the_same_bytes() {
    let place = Place::new();
    let mut chain = Chain::default();
    let file = place.file("journal");
    let mut world = place.world(SCENE, 1, false);
    world.write_journal_to(&file).expect("a journal");
    run(&mut world, &mut chain, 60, true);
    world.flush_journal().expect("a journal");
    let journal = Journal::read(&file).expect("a journal");
    fs::remove_file(&file).expect("it is there");
    drop(world);
    assert!(!file.exists(), "it was written to its end before");
    assert_eq!((journal.entries.len(), journal.end), (5, 60));
    let mut again = place.world(SCENE, 2, false);
    again.replay(journal.clone()).expect("the same run");
    assert_eq!(hash(&mut again, 60), chain.digest);
    assert_ne!(hash(&mut place.world(SCENE, 2, false), 60), chain.digest, "the hands were felt");
    let mut other = place.world(&SCENE.replace("seed = 5", "seed = 6"), 1, false);
    let told = other.replay(journal).expect_err("another seed");
    assert_eq!(told, "the journal is of the seed 5, this run is of the seed 6");
}

#[test]
fn a_reset_is_a_fresh_start() {
    let place = Place::new();
    let mut world = place.world(SCENE, 2, false);
    run(&mut world, &mut Chain::default(), 33, true);
    world.reset();
    assert_eq!(world.clock().step, 0);
    assert_eq!(world.param(0, GAIN), Some(0.5), "what the scene sets holds again");
    assert_eq!(hash(&mut world, 60), hash(&mut place.world(SCENE, 1, false), 60));
}

#[test]
fn a_state_that_does_not_fit_is_refused_and_changes_nothing() {
    let place = Place::new();
    let mut world = place.world(SCENE, 1, false);
    hash(&mut world, 20);
    let good = world.save(None).expect("a state");
    let before = world.save(None).expect("a state");
    assert_eq!(good, before, "saving changes nothing");
    for at in (0..good.len()).step_by(good.len() / 97 + 1) {
        let mut changed = good.clone();
        changed[at] ^= 0x40;
        assert!(world.load(&changed).is_err(), "byte {at}");
        assert!(world.load(&good[..at]).is_err(), "cut to {at}");
    }
    assert_eq!(world.save(None).expect("a state"), before);
    for (from, to, wanted) in [
        ("seed = 5", "seed = 6", "its seed is 5, this run's is 6"),
        ("dt = 0.02", "dt = 0.01", "its steps are 0.02 s long"),
        ("modules.pair", "modules.duo", "its modules are crowd (test.drifters), pair (test.drifters)"),
        ("name = \"Test\"", "name = \"Rest\"", "it is of the scene \"Test\", not \"Rest\""),
    ] {
        let mut other = place.world(&SCENE.replace(from, to), 1, false);
        let told = other.load(&good).expect_err("it does not fit").to_string();
        assert!(told.contains(wanted), "{told}");
    }
}

/// A saved sea with another header and other sections, and a hash that fits.
fn forged(state: &[u8], change: impl FnOnce(&mut serde_json::Value, &mut Vec<u8>)) -> Vec<u8> {
    let length = u32::from_le_bytes(state[12..16].try_into().expect("four bytes")) as usize;
    let mut header = serde_json::from_slice(&state[16..16 + length]).expect("the header is JSON");
    let mut sections = state[16 + length..state.len() - 32].to_vec();
    change(&mut header, &mut sections);
    let header = serde_json::to_vec(&header).expect("JSON");
    let mut forged = state[..12].to_vec();
    forged.extend_from_slice(&(header.len() as u32).to_le_bytes());
    forged.extend_from_slice(&header);
    forged.extend_from_slice(&sections);
    let hash = blake3::hash(&forged);
    forged.extend_from_slice(hash.as_bytes());
    forged
}

#[test]
fn what_a_forged_state_says_is_looked_at_before_modules_hear_it() {
    let place = Place::new();
    let mut world = place.world(SCENE, 1, false);
    hash(&mut world, 20);
    let good = world.save(None).expect("a state");
    assert_eq!(forged(&good, |_, _| ()), good);
    let put = |at: usize, bytes: &[u8]| {
        let bytes = bytes.to_vec();
        move |_: &mut serde_json::Value, sections: &mut Vec<u8>| {
            sections[at..at + bytes.len()].copy_from_slice(&bytes);
        }
    };
    // The first module's five flows stand first, then its three actors and its objects.
    let actors = 5 * size_of::<abi::Flow>();
    let objects = actors + 3 * size_of::<abi::Actor>();
    let flow = |field: usize| size_of::<abi::Flow>() + field;
    for (bytes, wanted) in [
        (
            forged(&good, |header, _| header["step"] = u64::MAX.into()),
            "its step 18446744073709551615 is beyond",
        ),
        (
            forged(&good, put(flow(16), &f64::NAN.to_le_bytes())),
            "crowd: stream flow, element 1: position is NaN",
        ),
        (forged(&good, put(flow(12), &7_u32.to_le_bytes())), "crowd: stream flow, element 1: flags is 0x7"),
        (
            forged(&good, put(actors + 16, &1e9_f64.to_le_bytes())),
            "stream actor, element 0: position is 1000000000",
        ),
        (forged(&good, put(objects, &[0; 8])), "stream object, element 0: id is 0"),
        (
            forged(&good, put(objects + 8, &f64::INFINITY.to_le_bytes())),
            "stream object, element 0: origin is inf",
        ),
        (
            forged(&good, |header, _| header["modules"][0]["flows"] = (1_u64 << 40).into()),
            "stream flow has 1099511627776 elements; the limit is",
        ),
    ] {
        let told = world.load(&bytes).expect_err("it makes no sense").to_string();
        assert!(told.contains(wanted), "{told}");
        assert_eq!(world.save(None).expect("a state"), good, "{told}: nothing changed");
    }
    world.load(&good).expect("its own state");
}

#[test]
fn a_state_that_is_loaded_after_a_jump_back_has_a_future_of_its_own() {
    let place = Place::new();
    let path = place.file("test.toml");
    fs::write(&path, SCENE).expect("a file");
    let registry = registry(1);
    let sea = || {
        let scene = scene::load(&path, place.0.path(), &registry).expect("a good scene");
        let options = Options { history: 1 << 20, trace: false, ..Options::default() };
        World::new(scene, &registry, &options).expect("a good world")
    };
    let mut world = sea();
    hash(&mut world, 5);
    let five = world.save(None).expect("a state");
    // Hands between steps 10 and 40, which a jump back would live through again.
    run(&mut world, &mut Chain::default(), 30, true);
    world.go_to(3).expect("a jump");
    world.load(&five).expect("its own state");
    let mut other = sea();
    other.load(&five).expect("a state of the same sea");
    assert_eq!(hash(&mut world, 40), hash(&mut other, 40));
}

#[test]
fn a_module_that_fails_stands_still_and_the_sea_goes_on() {
    let place = Place::new();
    let text = format!("{SCENE}fails_at = 5\n");
    let mut world = place.world(&text, 1, false);
    hash(&mut world, 4);
    let frame = world.frame().clone();
    for _ in 0..4 {
        world.step();
    }
    let messages = world.take_messages();
    assert_eq!(messages.len(), 1, "it is told once: {messages:?}");
    assert_eq!((messages[0].step, messages[0].module.as_str()), (5, "pair"));
    assert!(messages[0].text.contains("asked to fail"), "{}", messages[0].text);
    let now = world.frame();
    assert_eq!(now.outputs[1].objects, frame.outputs[1].objects, "the last good outputs stand");
    assert_ne!(now.outputs[0].objects, frame.outputs[0].objects, "the others move");
}

#[test]
fn modules_hear_of_one_another_one_step_later_in_the_scenes_order() {
    let place = Place::new();
    let mut world = place.world(SCENE, 1, false);
    assert_eq!(world.frame().flow.len(), 2, "before anything was emitted, what is attached is absent");
    world.step();
    let (flow, tags) = (&world.frame().flow, &world.frame().tags);
    assert_eq!(flow.len(), 3 + 5 + 2);
    assert_eq!(flow[1].owner, tags[0].foreign(2), "the attached source belongs to its object");
    let owners: Vec<u64> = flow[3..].iter().map(|flow| flow.owner).collect();
    let wanted: Vec<u64> =
        (1..=5).map(|id| tags[0].foreign(id)).chain((1..=2).map(|id| tags[1].foreign(id))).collect();
    assert_eq!(owners, wanted);
}

#[test]
fn what_a_plugin_refuses_is_told_at_its_place_in_the_scene() {
    let place = Place::new();
    let path = place.file("test.toml");
    fs::write(&path, "[modules.pair]\nuse = \"test.drifters\"\ncount = 2\nwrong = true\n").expect("a file");
    let registry = registry(1);
    let scene = scene::load(&path, place.0.path(), &registry).expect("the schema allows it");
    let told =
        World::new(scene, &registry, &Options::default()).expect_err("the plugin does not").to_string();
    assert!(told.ends_with("test.toml:4:9: modules.pair.wrong: this is wrong, indeed"), "{told}");
    fs::write(&path, "[modules.pair]\nuse = \"test.drifters\"\ncount = 2000\n").expect("a file");
    let told = scene::load(&path, place.0.path(), &registry).expect_err("too many").to_string();
    assert!(
        told.ends_with(
            "test.toml:3:9: modules.pair.count: is 2000, but must be a whole number from 1 to 1000"
        ),
        "{told}"
    );
}

#[test]
fn a_recording_has_its_columns_step_zero_and_what_the_filter_takes() {
    let place = Place::new();
    let mut world = place.world(SCENE, 1, true);
    let mut all = Vec::new();
    record::write(&world, &record::Filter::default(), &mut all).expect("memory takes everything");
    world.step();
    let filter =
        record::Filter { plugins: vec!["pair".into()], streams: vec!["fish".into()], objects: vec![1] };
    let mut one = Vec::new();
    record::write(&world, &filter, &mut one).expect("memory takes everything");
    let all = String::from_utf8(all).expect("UTF-8");
    assert_eq!(all.lines().count(), 40 + 2 + 2);
    let columns = record::COLUMNS.split(',').count();
    assert!(all.lines().all(|line| line.split(',').count() == columns && line.starts_with("0,0,")));
    assert!(all.lines().last().is_some_and(|line| line.starts_with("0,0,host,flow,1,0,")));
    let one = String::from_utf8(one).expect("UTF-8");
    let fields: Vec<&str> = one.trim_end().split(',').collect();
    assert_eq!(fields[..6], ["1", "0.02", "test.drifters/pair", "fish", "1", "0"]);
    assert_eq!(fields[9], "0.25");
    let x: f64 = fields[6].parse().expect("a number");
    let there = world.frame().outputs[1].objects[1].origin[0];
    assert!((x - there).abs() <= there.abs() * 5e-12, "{x} and {there}");
}

#[test]
fn parameters_outside_of_their_range_and_pokes_without_sense_are_not_taken() {
    let place = Place::new();
    let mut world = place.world(SCENE, 1, false);
    assert!(!world.set_param(0, GAIN, 4.5));
    assert!(!world.set_param(0, GAIN, f64::NAN));
    assert!(!world.set_param(0, 99, 1.0));
    assert!(!world.set_param(9, GAIN, 1.0));
    assert!(!world.poke(Poke { reach: 0.0, ..poke(0.0) }));
    world.step();
    assert!(world.journal().entries.is_empty());
    assert!(world.set_param(0, GAIN, 1.5) && world.set_param(0, GAIN, 1.75));
    assert_eq!(world.param(0, GAIN), Some(1.75), "a change shows at once");
    world.step();
    assert_eq!(world.journal().entries.len(), 1, "only the last word of a step counts");
}

#[test]
fn a_slow_machine_makes_a_slower_sea_and_says_so() {
    let place = Place::new();
    let mut timeline = Timeline::new(place.world(SCENE, 1, false));
    assert_eq!(timeline.advance(0.05), 2);
    let blend = timeline.blend();
    assert_eq!((blend.previous.step, blend.current.step), (1, 2));
    assert!((blend.alpha - 0.5).abs() < 1e-6, "0.01 of 0.02 s are left: {}", blend.alpha);
    assert_eq!(timeline.behind(), None);
    assert_eq!(timeline.advance(1.0), 8);
    let behind = timeline.behind().expect("it is behind");
    // 8 steps of 0.02 s where 1.01 s were wanted.
    assert!((behind - 0.16 / 1.01).abs() < 1e-3, "{behind}");
    assert!(timeline.blend().alpha < 1.0);
    timeline.paused = true;
    assert_eq!(timeline.advance(1.0), 0);
    timeline.single_step();
    assert_eq!(timeline.world.clock().step, 11);
    assert_eq!(timeline.blend().previous.step, 11);
    timeline.paused = false;
    timeline.set_speed(0.5);
    assert_eq!(timeline.advance(0.04), 1);
    timeline.reset();
    assert_eq!((timeline.world.clock().step, timeline.blend().current.step), (0, 0));
}

#[test]
fn the_frames_that_somebody_holds_never_change() {
    let place = Place::new();
    let mut world = place.world(SCENE, 1, false);
    world.step();
    let held = world.frame().clone();
    let copy = (held.step, held.outputs[0].objects.clone(), held.flow.to_vec());
    for _ in 0..50 {
        world.step();
    }
    assert_eq!((held.step, held.outputs[0].objects.clone(), held.flow.to_vec()), copy);
}

#[test]
fn the_example_of_the_reference_runs() {
    let place = Place::new();
    let mut world = place.world(reference::EXAMPLE, 1, false);
    hash(&mut world, 30);
    assert!(world.take_messages().is_empty());
    assert_eq!(world.frame().flow.len(), 2);
    assert!(world.environment().terrain.as_ref().is_some_and(|terrain| terrain.rocks.len() == 12));
}
