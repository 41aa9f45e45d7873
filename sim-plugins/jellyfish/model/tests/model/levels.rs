//! Near and far animals, and steps of any length: shapes hold, and speeds agree.

use std::path::PathBuf;

use glam::{DVec3, Vec3};
use reef_jellyfish_model::{
    bloom::{Birth, Bloom, Surroundings, Tuning},
    config::Config,
    sow::Stock,
    species::Species,
};
use reef_model_tests::threads::with_workers;
use reef_sdk::{
    SceneInfo,
    abi::{FLOW_DIRECTIONAL, Flow},
};

use crate::sea::{birth, names, read, usual, written};

/// Greatest length of a spring of the bell, and of a strand, over that at rest.
const LONGEST: f64 = 2.0;
/// A setting of `detail` that draws and steps every animal coarsely.
const ALL_FAR: f64 = 1e9;

/// What happened to the shapes and places of all animals.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// Lengths of springs of bells and strands over those at rest.
    longest: [f64; 2],
    /// [rad]
    tilt: f32,
    highest: f64,
    lowest: f64,
}

impl Seen {
    fn new() -> Self {
        Self { highest: f64::MIN, lowest: f64::MAX, ..Self::default() }
    }

    fn look(&mut self, bloom: &Bloom) {
        for i in 0..bloom.len() {
            let seen = bloom.seen(i).expect("an animal");
            for slice in [bloom.slice(i), bloom.slice_across(i)].into_iter().flatten() {
                for (own, other) in self.longest.iter_mut().zip(slice.longest()) {
                    *own = own.max(other);
                }
            }
            self.tilt = self.tilt.max(seen.axis.angle_between(Vec3::Y));
            (self.highest, self.lowest) = (self.highest.max(seen.place.y), self.lowest.min(seen.place.y));
        }
    }

    fn hold(&self, depth: f64) {
        println!("{self:?}");
        assert!(self.longest.iter().all(|length| (1.0..LONGEST).contains(length)), "{self:?}");
        assert!(self.tilt < core::f32::consts::FRAC_PI_2, "{self:?}");
        assert!(self.highest < 0.0 && self.lowest > -depth, "{self:?}");
    }
}

#[test]
fn no_spring_grows_beyond_twice_its_length_near_or_far() {
    let species: Vec<Species> = names().iter().map(|name| read(name)).collect();
    let births: Vec<Birth> =
        (0..5).map(|i| Birth { species: i % 4, slices: 1 + i / 4, ..birth(i as u64) }).collect();
    for detail in [0.0, ALL_FAR] {
        let mut bloom = Bloom::new(&species, &births).expect("a bloom");
        let (tuning, mut seen) = (Tuning { detail, ..Tuning::default() }, Seen::new());
        for _ in 0..60 * 60 {
            bloom.step(&Surroundings { tuning, ..Surroundings::default() });
            seen.look(&bloom);
        }
        seen.hold(10.0);
    }
}

/// Ten minutes of the scene of 64, whose animals are stepped coarsely where they look narrower than `detail`
/// [px].
fn ten_minutes(detail: f64) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../assets/scenes/jellyfish-bloom.toml");
    let text = std::fs::read_to_string(&path).expect("the scene");
    let mut scene: serde_json::Value = toml::from_str(&text).expect("a table");
    let eye: [f64; 3] = serde_json::from_value(scene["camera"]["position"].take()).expect("a place");
    let mut module = scene["modules"]["jellyfish"].take();
    module.as_object_mut().expect("a table").remove("use");
    let config: Config = serde_json::from_value(module).expect("a configuration");
    let table = |name: String| (name.clone(), serde_json::to_value(read(&name)).expect("plain data"));
    let info =
        SceneInfo { seed: 64, species: names().into_iter().map(table).collect(), ..SceneInfo::default() };
    let Stock { species, births } = Stock::new(&info, &config).expect("a stock");
    assert_eq!(births.len(), 64);
    let species: Vec<Species> = species.into_iter().map(|(_, table)| table).collect();
    let current = Flow { kind: FLOW_DIRECTIONAL, axis: [1.0, 0.0, 0.0], strength: 0.02, ..Flow::default() };
    let seen = with_workers(2, |workers| {
        let mut bloom = Bloom::new(&species, &births).expect("a bloom");
        let (mut flow, mut seen) = (vec![current], Seen::new());
        for step in 0..10 * 60 * 60 {
            let around = Surroundings {
                flow: &flow,
                depth: 14.0,
                eye: DVec3::from(eye),
                tuning: Tuning { detail, ..Tuning::default() },
                time: f64::from(step) / 60.0,
                workers,
                ..Surroundings::default()
            };
            bloom.step(&around);
            flow.truncate(1);
            flow.extend_from_slice(bloom.flows());
            seen.look(&bloom);
            if step % 3600 == 3599 {
                println!("minute {}: {seen:?}", (step + 1) / 3600);
            }
        }
        seen
    });
    seen.hold(14.0);
}

#[test]
#[ignore = "takes minutes: cargo test -p reef-jellyfish-model --test model ten_minutes -- --ignored"]
fn ten_minutes_of_far_animals_keep_their_shape() {
    ten_minutes(ALL_FAR);
}

#[test]
#[ignore = "takes minutes: cargo test -p reef-jellyfish-model --test model ten_minutes -- --ignored"]
fn ten_minutes_of_near_and_far_animals_keep_their_shape() {
    // The parameter's default.
    ten_minutes(60.0);
}

#[test]
fn all_of_an_animal_is_within_its_reach_and_comes_near_it() {
    let species: Vec<Species> = names().iter().map(|name| read(name)).collect();
    // Each with one slice, and with two.
    let aim = DVec3::new(0.5, 1.0, 0.7);
    let births: Vec<Birth> =
        (0..8).map(|i| Birth { species: i % 4, slices: 1 + i / 4, aim, ..birth(i as u64) }).collect();
    for detail in [0.0, ALL_FAR] {
        let mut bloom = Bloom::new(&species, &births).expect("a bloom");
        let tuning = Tuning { detail, tilt: 0.5, ..Tuning::default() };
        let current =
            Flow { kind: FLOW_DIRECTIONAL, axis: [0.8, 0.6, 0.0], strength: 0.3, ..Flow::default() };
        for step in 0..240 {
            bloom.step(&Surroundings { tuning, flow: &[current], ..Surroundings::default() });
            if step % 20 > 0 {
                continue;
            }
            let (vertices, nodes) = written(&mut bloom);
            let (mut vertices, mut nodes) = (&vertices[..], &nodes[..]);
            for (i, birth) in births.iter().enumerate() {
                let own = &species[birth.species];
                let count = bloom.vertices(i).expect("counts").iter().sum();
                let [tentacles, points] = bloom.tentacles(i).expect("counts");
                let own_vertices = vertices.split_off(..count).expect("vertices of each");
                let own_nodes = nodes.split_off(..tentacles * points).expect("nodes of each");
                let far = own_vertices.iter().map(|vertex| Vec3::from(vertex.position).length());
                let far_nodes = own_nodes.iter().map(|node| Vec3::from(node.position).length() + node.radius);
                let far = far.chain(far_nodes).fold(0.0, f32::max);
                let reach = bloom.seen(i).expect("an animal").reach;
                // Ridges and noise may rise so high, and seldom do.
                let heights = own.surface.noise + own.surface.structure + own.surface.compression;
                let slack = (2.0 + 2.0 * heights) * own.bell.thickness;
                // Rings through the pairs of two slices have a looser bound.
                let most = if birth.slices > 1 { 2.0 } else { 1.5 } * far + slack as f32;
                assert!(far <= reach && reach < most, "{i}, {step}: {far} of {reach}");
            }
        }
    }
}

/// Mean way in ten seconds of twelve animals of the paper's kind, in steps of the sea of `dt` [m].
fn way(dt: f64, detail: f64) -> f64 {
    let births: Vec<Birth> = (0..12).map(birth).collect();
    let mut bloom = Bloom::new(&[usual()], &births).expect("a bloom");
    let tuning = Tuning { detail, ..Tuning::default() };
    for _ in 0..(10.0 / dt).round() as usize {
        bloom.step(&Surroundings { dt, tuning, ..Surroundings::default() });
    }
    births
        .iter()
        .enumerate()
        .map(|(i, birth)| (bloom.place(i).expect("a place") - birth.place).y)
        .sum::<f64>()
        / 12.0
}

#[test]
fn any_length_of_the_step_swims_as_far_as_any_other() {
    // Eddies leave the mean of twelve uncertain by some hundredths.
    let lengths = [1.0 / 240.0, 1.0 / 120.0, 1.0 / 60.0, 0.01, 1.0 / 30.0, 1.0 / 20.0];
    let ways = lengths.map(|dt| way(dt, 0.0));
    let (usual, far) = (ways[2], way(lengths[2], ALL_FAR));
    println!("{ways:?} {far}");
    assert!(
        usual > 0.1 && ways.iter().chain([&far]).all(|way| (way / usual - 1.0).abs() < 0.15),
        "{ways:?} {far}"
    );
}
