//! `reef bench fibre`: node-steps a second of the anemones' fibres, through a scene as every other scene runs
//! — file, world, dynamic library, streams — beside a bare kernel over hot data in the same rounds.

use std::path::Path;

use glam::{DVec3, Vec3};
use reef_abi::{self as abi, Flow};
use reef_anemone_model::{
    Anemones,
    bare::{Bare, Scalar},
    frame::Frame,
    shape::FibreShape,
    wide::{self, Chunk, Contacts, Drag, Lane, Place, StepConstants},
};
use reef_command::{Common, open};
use reef_flow::{Level, Packed, waves::spectrum::DEFAULT_TRAINS};
use reef_plugin::{Health, Registry};
use reef_report::failure::Failure;
use reef_sea::{Options, World, scene::wave_tables::WavesTable};

use super::{
    allocations,
    measure::{Work, best, rounds},
    report::{Bar, Report},
};

/// The load: fibres under three singularities and a whirlwind.
const LOAD: &str = "bench-fibre";
/// Anemones of a species that varies, so that no two fibres are alike.
const BED: &str = "bench-bed";
/// Plants in the beds: what caches hold, and what they do not.
const BEDS: [usize; 3] = [36, 360, 1000];
/// Distance between them, about [m].
const BED_SPACING: f64 = 0.25;
const BED_ROUNDS: usize = 40;
/// The paper's 36 anemones.
const FIGURE_13: &str = "anemone-fig13-36-anemones";
/// Frames a second that the paper reached with them (§5.1).
const PAPERS_RATE: f64 = 17.0;

/// The wind whose waves sway the load [m/s].
const WIND: f64 = 6.0;

/// Rounds in which everything takes its turn.
const ROUNDS: usize = 150;
/// Segments of a fibre, as in the load's scene.
const SEGMENTS: usize = 10;
/// Steps before allocations are counted, and while they are.
const WARM_STEPS: usize = 300;
const COUNTED_STEPS: usize = 200;

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let level = Level::best();
    let packed = packed();
    let mut bare = Bare::new(2, SEGMENTS);
    let mut scalar = Scalar::new(64, SEGMENTS);
    let mut chunk = chunk()?;
    let constants = StepConstants::default();
    let contacts = Contacts::default();
    let mut one = world(common, LOAD, 1)?;
    let mut two = world(common, LOAD, 2)?;
    let mut figure = world(common, FIGURE_13, open::workers(common))?;
    let mut swaying = swaying(common)?;
    let nodes = [
        bare.nodes() as f64,
        scalar.nodes() as f64,
        (chunk.count() * chunk.segments()) as f64,
        moving_nodes(&one),
        moving_nodes(&two),
    ];
    let things: Vec<Work<'_>> = vec![
        Box::new(|| bare.step(level, &packed)),
        Box::new(|| scalar.step(&packed)),
        Box::new(|| wide::step(level, &mut chunk, &packed, &contacts, &constants)),
        Box::new(|| one.step()),
        Box::new(|| two.step()),
        Box::new(|| figure.step()),
        Box::new(|| swaying.step()),
    ];
    let seen = rounds(things, ROUNDS);
    running(&mut one)?;
    running(&mut two)?;
    running(&mut figure)?;
    running(&mut swaying)?;

    let beds = beds(common, level, &packed)?;

    let mut report = Report::default();
    let rate = |column: usize| nodes[column] / best(&seen, column) / 1e6;
    // How many times as many node-steps a second the first makes as the second.
    let faster = |a: usize, b: usize| rate(a) / rate(b);
    const UNIT: &str = "M node-steps/s";
    report.figure(format!("bare kernel, one core, {}: the ceiling", level.name()), rate(0), UNIT);
    report.figure("the same in plain scalar code", rate(1), UNIT);
    report.figure("the model's kernel alone", rate(2), UNIT);
    report.figure("through the scene, one worker", rate(3), UNIT);
    report.figure("through the scene, two workers", rate(4), UNIT);
    report.judged("the scene's share of the ceiling", 100.0 * faster(3, 0), "%", Bar::AtLeast(45.0));
    report.figure("the scene over scalar code", faster(3, 1), "×");
    report.two_workers(faster(4, 3));
    let share = 100.0 * best(&seen, 3) / best(&seen, 6);
    report.judged("its speed under 30 wave trains, over that without", share, "%", Bar::AtLeast(88.0));
    for (plants, bed) in BEDS.iter().zip(&beds) {
        report.figure(format!("a bed of {plants} Actinia, one worker"), bed.rate / 1e6, UNIT);
        report.judged("its share of the ceiling", 100.0 * bed.share, "%", Bar::AtLeast(35.0));
    }
    report.figure("a step of figure 13", 1e3 * best(&seen, 5), "ms");
    let multiple = 1.0 / PAPERS_RATE / best(&seen, 5);
    report.judged("the paper's frame over it", multiple, "×", Bar::AtLeast(50.0));
    for (name, world) in [("the load", &one), ("figure 13", &figure)] {
        for (what, value) in world.instance(0).map(|instance| instance.figures()).unwrap_or_default() {
            report.figure(format!("{name}: {what}"), value / 1e3, "k");
        }
    }
    match allocations_a_step(common)? {
        Some(count) => report.judged("allocations a step", count, "", Bar::AtMost(0.0)),
        None => report.note("Allocations are counted by the program reef alone; this one has no counter."),
    }
    report.note(format!(
        "A node-step: one node that moves, for one step, under 3 singularities and 1 whirlwind. {ROUNDS} short \
         rounds in which all take turns of some steps; each one's best counts."
    ));
    report.note(
        "The bare kernel has no contacts, no rest shape, no exact equilibrium: the printed equations alone. Allocations \
         are counted with the same model linked into the program: a library that is loaded has an allocator of its own.",
    );
    Ok(report)
}

/// What a bed of Actinia did on one core.
struct BedFigures {
    /// Node-steps a second.
    rate: f64,
    /// Over the bare kernel's in the same rounds.
    share: f64,
}

/// The beds of [`BEDS`], beside the bare kernel.
fn beds(common: &Common, level: Level, packed: &Packed) -> Result<Vec<BedFigures>, Failure> {
    let mut bare = Bare::new(2, SEGMENTS);
    let mut worlds = Vec::new();
    for plants in BEDS {
        worlds.push(bed(common, plants)?);
    }
    let nodes: Vec<f64> =
        core::iter::once(bare.nodes() as f64).chain(worlds.iter().map(moving_nodes)).collect();
    let mut things: Vec<Work<'_>> = vec![Box::new(|| bare.step(level, packed))];
    for world in &mut worlds {
        things.push(Box::new(|| world.step()));
    }
    let seen = rounds(things, BED_ROUNDS);
    for world in &mut worlds {
        running(world)?;
    }
    let rate = |column: usize| nodes[column] / best(&seen, column);
    Ok((1..nodes.len()).map(|at| BedFigures { rate: rate(at), share: rate(at) / rate(0) }).collect())
}

/// The bed's scene with `plants` plants as near to each other as its own.
fn bed(common: &Common, plants: usize) -> Result<World, Failure> {
    let common = Common { workers: Some(1), ..common.clone() };
    let plugins = open::plugins(&common)?;
    let mut scene = open::scene(&common, Path::new(BED), &plugins)?;
    let scatter = scene.modules.first_mut().and_then(|module| module.config.pointer_mut("/scatter/0"));
    let Some(scatter) = scatter.and_then(|scatter| scatter.as_object_mut()) else {
        return Err(Failure::check(miette::miette!("the scene {BED} scatters no anemones")));
    };
    let side = BED_SPACING * (plants as f64).sqrt();
    scatter.insert("count".into(), plants.into());
    scatter.insert("size".into(), vec![side, side].into());
    World::new(scene, &plugins, &Options::default()).map_err(Failure::input)
}

/// The load under the waves of a wind, on one thread.
fn swaying(common: &Common) -> Result<World, Failure> {
    let common = Common { workers: Some(1), ..common.clone() };
    let plugins = open::plugins(&common)?;
    let mut scene = open::scene(&common, Path::new(LOAD), &plugins)?;
    scene.file.waves = Some(WavesTable { wind: WIND, direction: 0.0, trains: DEFAULT_TRAINS });
    World::new(scene, &plugins, &Options::default()).map_err(Failure::input)
}

/// A scene's world on `workers` threads, with plugins from their libraries.
fn world(common: &Common, scene: &str, workers: usize) -> Result<World, Failure> {
    let common = Common { workers: Some(workers), ..common.clone() };
    open::world(&common, Path::new(scene), Options::default())
}

/// A figure of a module that stands still would be a lie.
pub(super) fn running(world: &mut World) -> Result<(), Failure> {
    let modules = world.modules().len();
    let all = (0..modules)
        .all(|at| world.instance(at).is_some_and(|instance| *instance.health() == Health::Running));
    if all && modules > 0 {
        return Ok(());
    }
    let messages: Vec<String> = world.take_messages().into_iter().map(|message| message.text).collect();
    Err(Failure::check(miette::miette!(
        "{}: a module failed while it was measured: {}",
        world.scene().name,
        messages.join("; ")
    )))
}

/// Nodes that a step moves: all but the roots.
fn moving_nodes(world: &World) -> f64 {
    let outputs = &world.frame().outputs;
    outputs.iter().map(|output| output.fibre_nodes.len() - output.fibres.len()).sum::<usize>() as f64
}

/// Allocations of the load's step once it is warm, of the host and of the model, on all workers.
fn allocations_a_step(common: &Common) -> Result<Option<f64>, Failure> {
    let mut plugins = Registry::new();
    plugins
        .add_linked(reef_sdk::entry::<Anemones>(), open::workers(common))
        .map_err(|refusal| Failure::check(miette::miette!("the linked model: {refusal}")))?;
    let scene = open::scene(common, Path::new(LOAD), &plugins)?;
    let mut world = World::new(scene, &plugins, &Options::default()).map_err(Failure::input)?;
    for _ in 0..WARM_STEPS {
        world.step();
    }
    let count = allocations::count(|| {
        for _ in 0..COUNTED_STEPS {
            world.step();
        }
    });
    running(&mut world)?;
    Ok(count.map(|count| count as f64 / COUNTED_STEPS as f64))
}

/// What acts on the kernels: the load's flow.
fn packed() -> Packed {
    let local = |kind, position| Flow {
        kind,
        position,
        axis: [0.0, 1.0, 0.0],
        strength: 0.02,
        peak: 1.0,
        core: 0.01,
        ..Flow::default()
    };
    let mut packed = Packed::new();
    packed.fill(
        &[
            local(abi::FLOW_SOURCE, [-0.4, 0.1, 0.0]),
            local(abi::FLOW_SOURCE, [0.4, 0.1, 0.1]),
            local(abi::FLOW_HOLE, [0.0, 0.2, -0.4]),
            local(abi::FLOW_WHIRLWIND, [0.5, 0.0, 0.5]),
        ],
        [0.0; 3],
        0,
    );
    packed
}

/// The model's own fibres, as the load's scene has them, over hot data.
fn chunk() -> Result<Chunk, Failure> {
    let shape = FibreShape::straight(SEGMENTS + 1, 0.006, 0.003, 0.0012, 4.2, 1.0);
    let lanes: Vec<Lane> = (0..wide::MOST_FIBRES)
        .map(|i| Lane {
            shape: shape.clone(),
            place: Place {
                offset: 0.012 * DVec3::new((i % 8) as f64, 0.0, (i / 8) as f64),
                frame: Frame::upright(0.0),
            },
            offset: Vec3::ZERO,
            relaxation: 0.3,
            break_force: f64::INFINITY,
        })
        .collect();
    let stiffness = vec![(4.2, 1.0); lanes.len()];
    let mut chunk = Chunk::new(&lanes, Drag::Area { coefficient: 0.5 }, &stiffness)
        .ok_or_else(|| Failure::check(miette::miette!("the bench's own fibres do not fit into a chunk")))?;
    let upright = Frame { x: DVec3::X, y: DVec3::Y, z: DVec3::Z };
    wide::carry(Level::best(), &mut chunk, DVec3::ZERO, &upright);
    wide::rebuild(Level::best(), &mut chunk);
    chunk.set_gain(1.0 / 60.0, 1.0);
    Ok(chunk)
}
