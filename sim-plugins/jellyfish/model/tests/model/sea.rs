//! Animals in the sea, and their species.

use glam::DVec3;
use reef_flow::Level;
use reef_jellyfish_model::{
    bloom::{Birth, Bloom, BloomState, PRIMITIVES, Surroundings},
    species::Species,
};
use reef_model_tests::species as tables;
use reef_sdk::{
    StateReader, StateWriter, Workers,
    abi::{self, DrawVertex, FibreNode, Flow},
};

const DT: f64 = 1.0 / 60.0;
/// Jellyfish in assets: what has a `bell`.
pub(crate) fn names() -> Vec<String> {
    tables::names(|table| table.get("bell").is_some())
}

pub(crate) fn read(name: &str) -> Species {
    serde_json::from_value(tables::table(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The paper's animal on fewer cells; nothing but their section holds its strands.
pub(crate) fn usual() -> Species {
    let mut species = Species::default();
    (species.grid.cells, species.grid.bells) = (50, 5.0);
    species.bell.strand_stretch = 100.0;
    species.arms.count = 8;
    species
}

pub(crate) fn birth(number: u64) -> Birth {
    Birth {
        species: 0,
        place: DVec3::new(1e3 + number as f64, -3.0, -1e3),
        yaw: number as f64,
        size: 1.0,
        seed: number,
        id: number + 1,
        ..Birth::default()
    }
}

fn bloom(births: &[Birth]) -> Bloom {
    Bloom::new(&[usual()], births).expect("a bloom")
}

fn around<'a>(flow: &'a [Flow], waves: &'a [abi::Wave]) -> Surroundings<'a> {
    Surroundings { flow, waves, ..Surroundings::default() }
}

fn current(velocity: [f32; 3]) -> Flow {
    let strength = velocity.iter().map(|v| v * v).sum::<f32>().sqrt();
    Flow { kind: abi::FLOW_DIRECTIONAL, axis: velocity.map(|v| v / strength), strength, ..Flow::default() }
}

pub(crate) fn vertices(bloom: &mut Bloom) -> Vec<DrawVertex> {
    written(bloom).0
}

/// Vertices, and nodes of tentacles.
pub(crate) fn written(bloom: &mut Bloom) -> (Vec<DrawVertex>, Vec<FibreNode>) {
    let mut vertices = vec![DrawVertex::default(); bloom.vertex_count()];
    let mut nodes = vec![FibreNode::default(); bloom.node_count()];
    bloom.write(Level::best(), Workers::inline(), 3.0, (&mut vertices, &mut nodes));
    (vertices, nodes)
}

#[test]
fn an_animal_alone_is_as_it_is_among_many() {
    let births: Vec<Birth> = (0..5).map(birth).collect();
    let flow = [current([0.1, 0.0, 0.02])];
    let (mut many, mut alone) = (bloom(&births), bloom(&births[3..4]));
    for _ in 0..40 {
        many.step(&around(&flow, &[]));
        alone.step(&around(&flow, &[]));
    }
    assert!(
        many.place(3) == alone.place(0) && many.flows()[3 * PRIMITIVES..4 * PRIMITIVES] == *alone.flows()
    );
    let (all, own) = (vertices(&mut many), vertices(&mut alone));
    assert!(all[3 * own.len()..4 * own.len()] == own);
    // And no two are alike.
    assert!(all[..own.len()] != own);
}

#[test]
fn a_current_carries_it_along_with_its_water() {
    let (mut still, mut carried) = (bloom(&[birth(0)]), bloom(&[birth(0)]));
    let flow = [current([0.3, -0.1, 0.2])];
    for _ in 0..60 {
        still.step(&around(&[], &[]));
        carried.step(&around(&flow, &[]));
    }
    let way = carried.place(0).expect("a place") - still.place(0).expect("a place");
    assert!(way.distance(DVec3::new(0.3, -0.1, 0.2)) < 1e-6, "{way}");
    assert!(vertices(&mut still) == vertices(&mut carried));
}

#[test]
fn waves_carry_it_to_and_fro() {
    let sea = reef_flow::waves::WindSea { wind: 4.0, heading: 0.0, depth: 10.0, trains: 4 };
    let mut random = reef_flow::random::Random::new(1, 1);
    let trains = sea.trains(&mut || random.unit()).expect("a sea");
    let (mut still, mut carried) = (bloom(&[birth(0)]), bloom(&[birth(0)]));
    let mut most = 0.0_f64;
    for step in 0..240 {
        let waves: Vec<_> = trains.iter().map(|train| train.at(f64::from(step) * DT)).collect();
        still.step(&around(&[], &[]));
        carried.step(&around(&[], &waves));
        let way = carried.place(0).expect("a place") - still.place(0).expect("a place");
        most = most.max(way.length());
    }
    assert!(most > 1e-3 && most < 1.0, "{most}");
}

#[test]
fn its_jet_is_that_of_its_water_and_it_does_not_feel_it_itself() {
    let mut bloom = bloom(&[birth(0)]);
    let [mut all, mut missed] = [0.0; 2];
    for _ in 0..240 {
        let emitted = bloom.flows().to_vec();
        let mut other = bloom.clone();
        bloom.step(&around(&emitted, &[]));
        other.step(&around(&[], &[]));
        assert_eq!(bloom.place(0), other.place(0));
        assert_eq!(bloom.flows().len(), PRIMITIVES);
        for flow in bloom.flows() {
            assert!(flow.strength.is_finite() && flow.peak > 0.0 && flow.owner == 1, "{flow:?}");
        }
        let fit = bloom.fit(0).expect("a fit");
        all += fit.squares[0];
        missed += fit.squares[1];
    }
    let error = (missed / all).sqrt();
    println!("the primitives miss {:.0} % of the speed", 100.0 * error);
    assert!(error < 0.8, "{error}");
}

/// How alike the velocities of the sea and those of a slice are around its aperture, as a cosine: at places
/// `off` by so many radians from those at which the fit looks, so many widths of the bell away.
fn likeness(off: f64, width: f64) -> f64 {
    let mut bloom = bloom(&[birth(0)]);
    let (mut along, mut own, mut sea) = (0.0, 0.0, 0.0);
    for step in 0..240 {
        bloom.step(&around(&[], &[]));
        if step < 60 {
            continue;
        }
        let slice = bloom.slice(0).expect("a slice");
        let fit = bloom.fit(0).expect("a fit");
        let base = bloom.place(0).expect("a place") - slice.place().extend(0.0);
        for k in 0..16 {
            let angle = core::f64::consts::TAU * (f64::from(k) + 0.5) / 16.0 + off;
            let (cos, sin) = reef_flow::math::cos_sin_f64(angle);
            let way = (fit.axis * sin - fit.axis.perp() * cos) * width * slice.build().diameter;
            let there = fit.place + way;
            let wanted = slice.water().velocity((there - slice.corner()).to_array());
            // The first animal's slice lies in the plane of x and y.
            let felt =
                reef_flow::reference::velocity(bloom.flows(), (base + there.extend(0.0)).to_array(), 0);
            along += wanted[0] * felt[0] + wanted[1] * felt[1];
            own += wanted[0] * wanted[0] + wanted[1] * wanted[1];
            sea += felt[0] * felt[0] + felt[1] * felt[1];
        }
    }
    along / (own * sea).sqrt()
}

#[test]
fn its_jet_moves_the_water_of_the_sea_as_its_own_slice_moves() {
    let half = core::f64::consts::TAU / 32.0;
    let alike = likeness(0.0, 0.9);
    println!("{alike}; between the places of the fit {} {}", likeness(half, 0.9), likeness(half, 0.75));
    assert!(alike > 0.5, "{alike}");
}

fn bytes(state: &BloomState) -> Vec<u8> {
    let mut writer = StateWriter::new();
    state.write(&mut writer);
    writer.finish().expect("a state")
}

#[test]
fn a_saved_bloom_goes_on_and_a_wrong_state_changes_nothing() {
    let births: Vec<Birth> = (0..2).map(birth).collect();
    let mut first = bloom(&births);
    (0..60).for_each(|_| first.step(&around(&[], &[])));
    let saved = bytes(&first.save());
    let state = BloomState::read(&mut StateReader::parse(1, &saved).expect("bytes")).expect("a state");
    let mut second = bloom(&births);
    second.load(&state).expect("loads");
    for bloom in [&mut first, &mut second] {
        (0..20).for_each(|_| bloom.step(&around(&[], &[])));
    }
    assert!(first.save() == second.save() && vertices(&mut first) == vertices(&mut second));
    let before = first.save();
    let change = |with: &dyn Fn(&mut BloomState)| {
        let mut state = before.clone();
        with(&mut state);
        state
    };
    let wrong = [
        change(&|s| s.counts.truncate(3)),
        change(&|s| s.counts[0] += 2),
        change(&|s| s.points[5] = f64::INFINITY),
        change(&|s| s.faces[9] = f32::NAN),
        change(&|s| s.faces.push(0.0)),
        change(&|s| s.trails[1] = f64::NAN),
        change(&|s| s.places[2] = f64::NAN),
        change(&|s| s.offsets.push(0)),
        change(&|s| s.places[4] = 1e300),
        change(&|s| s.offsets[2] = i64::MIN),
    ];
    for (i, state) in wrong.iter().enumerate() {
        assert!(first.load(state).is_err() && first.save() == before, "{i}");
    }
    let message = first.load(&wrong[6]).expect_err("refused");
    assert!(message.starts_with("animal 0 is at") && message.contains("must be within"), "{message}");
    // What is wrong with one of them names it.
    let last = before.trails.len() - 1;
    for state in [change(&|s| s.trails[last] = f64::NAN), wrong[8].clone(), wrong[9].clone()] {
        let message = first.load(&state).expect_err("refused");
        assert!(message.starts_with("animal 1"), "{message}");
    }
}

#[test]
fn an_animal_beyond_all_places_is_refused() {
    for place in [DVec3::new(1e300, 0.0, 0.0), DVec3::new(0.0, f64::NAN, 0.0)] {
        let births = [birth(0), Birth { place, ..birth(1) }];
        let message = Bloom::new(&[usual()], &births).expect_err("refused");
        assert!(message.contains("animals[1].place") && message.contains("10000000 m"), "{message}");
    }
}

#[test]
fn every_species_of_the_assets_swims() {
    let names = names();
    assert_eq!(names, ["box-jelly", "comb-jelly", "moon-jelly", "sea-nettle"]);
    for name in &names {
        let species = read(name);
        species.check().unwrap_or_else(|e| panic!("{name}: {e}"));
        let mut bloom = Bloom::new(std::slice::from_ref(&species), &[birth(1)]).expect(name);
        let start = bloom.place(0).expect("a place");
        let seconds = 4.0 / species.motion.frequency;
        for _ in 0..(seconds / DT) as usize {
            bloom.step(&around(&[], &[]));
        }
        let way = bloom.place(0).expect("a place") - start;
        let slice = bloom.slice(0).expect("a slice");
        println!("{name}: {:.2} diameters in 4 cycles", way.y / species.bell.diameter);
        assert!(way.y > 0.3 * species.bell.diameter, "{name}: {way}");
        assert!(slice.water().fastest() < 1.5, "{name}: {}", slice.water().fastest());
        assert!(vertices(&mut bloom).iter().all(|v| v.position.iter().all(|x| x.is_finite())));
        for (mesh, count) in
            bloom.meshes(0, false).expect("meshes").iter().zip(bloom.vertices(0).expect("counts"))
        {
            assert!(mesh.vertices.len() == count && mesh.indices.iter().all(|i| (*i as usize) < count));
        }
    }
}

#[test]
fn a_wrong_species_is_refused_by_its_key() {
    let change = |with: &dyn Fn(&mut Species)| {
        let mut species = usual();
        with(&mut species);
        species.check().expect_err("refused")
    };
    type Change<'a> = &'a dyn Fn(&mut Species);
    let cases: [(Change<'_>, &str); 9] = [
        (&|s| s.grid.cells = 3, "grid.cells"),
        (&|s| s.bell.stiffness = -1.0, "bell.stiffness"),
        (&|s| s.motion.frequency = 0.0, "motion.frequency"),
        (&|s| s.motion.frequency = 1e3, "motion.frequency"),
        (&|s| s.bell.strand = 1.0, "grid.bells"),
        (&|s| s.surface.around = 70, "surface.around"),
        (&|s| s.surface.structures = 40, "surface.structures"),
        (&|s| s.tentacles.count = 9, "tentacles.count"),
        (&|s| s.look.bell = "blue".into(), "look.bell"),
    ];
    for (with, key) in cases {
        let message = change(with);
        assert!(message.contains(key), "{key}: {message}");
    }
    let unknown = toml::from_str::<Species>("[bell]\nsize = 1.0").expect_err("refused").to_string();
    assert!(unknown.contains("size") && unknown.contains("diameter"), "{unknown}");
    let message = Bloom::new(&[usual()], &[Birth { species: 7, ..birth(0) }]).expect_err("refused");
    assert!(message.contains("animals[0].species"), "{message}");
}

#[test]
fn an_individual_of_another_size_swims_alike() {
    // Ten times as large, at a tenth of the frequency: the same speed in diameters a period.
    let way = |size: f64, frequency: f64| {
        let mut species = usual().sized(size);
        species.motion.frequency = frequency;
        species.motion.variation = 0.0;
        let mut bloom = Bloom::new(&[species], &[birth(0)]).expect("a bloom");
        let start = bloom.place(0).expect("a place");
        // The same steps in shares of a period.
        let dt = DT / 2.0 * 0.7 / frequency;
        for _ in 0..180 {
            bloom.step(&Surroundings { dt, viscosity: 0.0, ..around(&[], &[]) });
        }
        (bloom.place(0).expect("a place") - start).y / size
    };
    let (small, large) = (way(1.0, 0.7), way(0.5, 1.4));
    assert!((small / large - 1.0).abs() < 0.05 && small > 0.005, "{small} {large}");
}
