//! `reef bench jellyfish`: what an animal and its water cost, by part and beside the bare kernels; 64 animals
//! on one worker and on two; their surfaces, their memory, and what their jets miss.

use glam::{DVec2, DVec3};
use reef_abi::DrawVertex;
use reef_command::{Common, open};
use reef_flow::Level;
use reef_jellyfish_model::{
    bare::Bare,
    bloom::{Birth, Bloom, Choice, Surroundings},
    slice::{Build, Slice},
    species::Species,
    surface::{Bell, Form, Frame},
    water::Grid,
};
use reef_report::failure::Failure;
use reef_sea::World;

use super::{
    cells::{set, warm, world},
    churn::Held,
    fibre::running,
    measure::{Work, best, rounds},
    report::{Bar, Report},
};

/// 64 animals of four species.
const SCENE: &str = "jellyfish-bloom";
const ANIMALS: u64 = 64;
/// Rounds in which everything takes its turn.
const ROUNDS: usize = 40;
/// Steps of the sea in which animals of one and of two slices swim.
const SWUM: usize = 960;
/// Steps before anything is measured.
const WARM_STEPS: usize = 60;
/// Cells along a side, and the step of a slice [s].
const CELLS: usize = 100;
const STEP: f64 = 1.0 / 120.0;
/// A step of the sea [ms].
const FRAME: f64 = 1000.0 / 60.0;
/// Vertices of the bell whose surface is measured, about.
const VERTICES: usize = 6000;

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let level = Level::best();
    let mut report = Report::default();
    parts(level, &mut report)?;
    surface(level, &mut report)?;
    jet(level, &mut report)?;
    slices(level, &mut report)?;
    memory(&mut report)?;
    bloom(common, &mut report)?;
    report.note(format!(
        "One animal: the paper's, on {CELLS} × {CELLS} cells, steps of 1/120 s, {}. The bare kernels: where the water was and \
         the clamped bicubic there, transforms and tridiagonal systems, over hot data, without walls, viscosity and \
         animal. {ROUNDS} short rounds in which all take turns; each one's best counts.",
        level.name()
    ));
    Ok(report)
}

fn refused(problem: String) -> Failure {
    Failure::check(miette::miette!("{problem}"))
}

/// The paper's animal after two seconds of swimming.
fn animal(level: Level) -> Result<Slice<f32>, Failure> {
    let build = Build::default();
    let cell = 10.0 * build.diameter / CELLS as f64;
    let grid = Grid { n: CELLS, cell, density: 1000.0, viscosity: 1.304e-6 };
    let mut slice = Slice::new(build, grid).map_err(refused)?;
    (0..240).for_each(|_| slice.step(level, STEP));
    Ok(slice)
}

fn parts(level: Level, report: &mut Report) -> Result<(), Failure> {
    let mut slice = animal(level)?;
    let [mut advected, mut projected, mut diffused] = [(); 3].map(|()| slice.water().clone());
    let mut pushed = slice.clone();
    let [mut advect, mut transform, mut solve] = [(); 3].map(|()| Bare::new(CELLS));
    let things: Vec<Work<'_>> = vec![
        Box::new(|| slice.step(level, STEP)),
        Box::new(|| advected.advect(level, STEP)),
        Box::new(|| projected.project(level)),
        Box::new(|| diffused.diffuse(level, STEP)),
        Box::new(|| pushed.push(STEP)),
        Box::new(|| advect.advect(level)),
        Box::new(|| transform.transform(level)),
        Box::new(|| solve.solve(level)),
    ];
    let seen = rounds(things, ROUNDS);
    let time = |column: usize| 1e3 * best(&seen, column);
    for (name, column) in [
        ("a step of one animal and its water", 0),
        ("of it advection", 1),
        ("of it projection", 2),
        ("of it viscosity", 3),
        ("of it springs and spreading", 4),
    ] {
        report.figure(name, time(column), "ms");
    }
    let bare = time(5) + time(6) + time(7);
    report.figure("bare advection, transforms and solve", bare, "ms");
    report.judged("the bare kernels' share of a step", 100.0 * bare / time(0), "%", Bar::AtLeast(75.0));
    Ok(())
}

fn surface(level: Level, report: &mut Report) -> Result<(), Failure> {
    let slice = animal(level)?;
    let chain: Vec<DVec2> = slice.chain().collect();
    let form = Form { rings: (VERTICES / Form::default().around) & !1, ..Form::default() };
    let mut bell = Bell::new(form, slice.build().thickness, (&chain, 1), 1).map_err(refused)?;
    let mut vertices = vec![DrawVertex::default(); bell.form().bell_vertices()];
    let count = vertices.len();
    let frame = Frame::default();
    let (chain, place) = (&chain, slice.place());
    let seen = rounds(
        vec![Box::new(|| bell.write(level, [(chain.iter().copied(), place, frame)], 1.0, &mut vertices))],
        ROUNDS,
    );
    let name = format!("surface of a bell of {count} vertices");
    report.judged(name, 1e3 * best(&seen, 0), "ms", Bar::AtMost(0.05));
    Ok(())
}

fn jet(level: Level, report: &mut Report) -> Result<(), Failure> {
    let mut slice = animal(level)?;
    let choice = Choice::default();
    let [mut all, mut missed] = [0.0; 2];
    for _ in 0..600 {
        slice.step(level, STEP);
        let [own_all, own_missed] = choice.fit(&slice).squares;
        (all, missed) = (all + own_all, missed + own_missed);
    }
    let seen = rounds(
        vec![Box::new(|| {
            std::hint::black_box(choice.fit(&slice));
        })],
        ROUNDS,
    );
    report.figure("what the jet's primitives miss of the speed around", 100.0 * (missed / all).sqrt(), "%");
    report.figure("to fit them", 1e3 * best(&seen, 0), "ms");
    Ok(())
}

/// Two slices at right angles beside one: how far they swim upward and aslant, and what they cost.
fn slices(level: Level, report: &mut Report) -> Result<(), Failure> {
    let around = Surroundings { level, ..Surroundings::default() };
    let swim = |slices: usize, aim: DVec3| -> Result<(Bloom, DVec3), Failure> {
        let birth = Birth { place: DVec3::Y * -5.0, slices, aim, ..Birth::default() };
        let mut bloom = Bloom::new(&[Species::default()], &[birth]).map_err(refused)?;
        (0..SWUM).for_each(|_| bloom.step(&around));
        let way = bloom.place(0).unwrap_or(birth.place) - birth.place;
        Ok((bloom, way))
    };
    let aslant = DVec3::new(0.6, 0.5, 0.6).normalize();
    let ((mut one, up), (mut two, up_too)) = (swim(1, DVec3::Y)?, swim(2, DVec3::Y)?);
    let (in_plane, to_side) = (swim(1, aslant)?.1, swim(2, aslant)?.1);
    report.figure(format!("way of one slice upward in {:.0} s", SWUM as f64 / 60.0), up.length(), "m");
    report.figure("of two slices", up_too.length(), "m");
    report.figure("way of one slice along an aim out of its plane", in_plane.dot(aslant), "m");
    report.figure("of two slices", to_side.dot(aslant), "m");
    let seen = rounds(vec![Box::new(|| one.step(&around)), Box::new(|| two.step(&around))], ROUNDS);
    report.figure("cost of two slices over that of one", best(&seen, 1) / best(&seen, 0), "x");
    Ok(())
}

fn memory(report: &mut Report) -> Result<(), Failure> {
    let births: Vec<Birth> = (0..ANIMALS)
        .map(|i| Birth { place: DVec3::new(i as f64, -3.0, 0.0), seed: i, id: i + 1, ..Birth::default() })
        .collect();
    let before = Held::now("none").resident;
    let mut bloom = Bloom::new(&[Species::default()], &births).map_err(refused)?;
    (0..2).for_each(|_| bloom.step(&Surroundings::default()));
    let bytes = Held::now("none").resident.saturating_sub(before) as f64 / births.len() as f64;
    report.judged("memory of an animal", bytes / 1e6, "MB", Bar::AtMost(1.0));
    Ok(())
}

fn bloom(common: &Common, report: &mut Report) -> Result<(), Failure> {
    let mut one = sea(common, 1, false)?;
    let mut two = sea(common, 2, false)?;
    let mut levels = sea(common, 2, true)?;
    let things: Vec<Work<'_>> =
        vec![Box::new(|| one.step()), Box::new(|| two.step()), Box::new(|| levels.step())];
    let seen = rounds(things, ROUNDS);
    for world in [&mut one, &mut two, &mut levels] {
        running(world)?;
    }
    let time = |column: usize| 1e3 * best(&seen, column);
    report.figure("64 animals in full, each at the steps of its frequency, one worker", time(0), "ms");
    report.judged("the same, two workers", time(1), "ms", Bar::AtMost(FRAME));
    report.judged("the scene's 64 with levels of detail, two workers", time(2), "ms", Bar::AtMost(FRAME));
    report.two_workers(best(&seen, 0) / best(&seen, 1));
    Ok(())
}

/// The scene's sea on `workers` threads.
fn sea(common: &Common, workers: usize, levels: bool) -> Result<World, Failure> {
    let common = Common { workers: Some(workers), ..common.clone() };
    let plugins = open::plugins(&common)?;
    let mut world = world(&common, &plugins, SCENE, |_| ())?;
    set(&mut world, |_, key| (key == "detail" && !levels).then_some(0.0));
    warm(&mut world, WARM_STEPS)?;
    Ok(world)
}
