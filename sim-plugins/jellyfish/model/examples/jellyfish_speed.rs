//! Where the time of a step goes on one core: `cargo run -p reef-jellyfish-model --example jellyfish_speed
//! [LEVEL]`, the paper's animal on 50 × 50 and 100 × 100 cells of 4 mm, by part, beside the bare kernels; and
//! what its surface costs. LEVEL: the least `REEF_SIMD_*` that is measured.

use std::time::Instant;

use glam::DVec2;
use reef_flow::Level;
use reef_jellyfish_model::{
    bare::Bare,
    slice::{Build, Slice},
    surface::{Bell, Disc, Form, Frame, Fringe, FringeForm},
    water::Grid,
};
use reef_sdk::abi::DrawVertex;

const DT: f64 = 0.005;

/// The shortest time of many runs [ms].
fn best(mut run: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    let begin = Instant::now();
    while begin.elapsed().as_secs_f64() < 0.4 {
        let start = Instant::now();
        for _ in 0..10 {
            run();
        }
        best = best.min(start.elapsed().as_secs_f64() / 10.0);
    }
    best * 1e3
}

/// The paper's animal after a second of swimming.
fn animal(n: usize, level: Level) -> Slice<f32> {
    let grid = Grid { n, cell: 0.004, density: 1000.0, viscosity: 1.304e-6 };
    let mut slice = Slice::new(Build::default(), grid).expect("the paper's animal");
    (0..200).for_each(|_| slice.step(level, DT));
    slice
}

fn main() {
    let least: u32 = std::env::args().nth(1).map_or(u32::MAX, |text| text.parse().expect("a level"));
    for level in
        Level::all().into_iter().filter(|level| level.code() >= least || level.code() == Level::best().code())
    {
        for n in [50, 100] {
            let mut slice = animal(n, level);
            let mut water = slice.water().clone();
            let mut bare = Bare::new(n);
            let [advect, transform, solve] =
                [best(|| bare.advect(level)), best(|| bare.transform(level)), best(|| bare.solve(level))];
            let ceiling = advect + transform + solve;
            let step = best(|| slice.step(level, DT));
            println!(
                "{}, {n} x {n}: {step:.4} ms a step, the bare kernels are {:.0} % of it",
                level.name(),
                100.0 * ceiling / step
            );
            println!(
                "  bare: advection {advect:.4}, transforms {transform:.4} ({:.1} G multiply-adds/s), solve {solve:.4} ms",
                bare.transform_products() as f64 / transform * 1e-6
            );
            println!(
                "  whole: advection {:.4}, projection {:.4}, viscosity {:.4}, springs and spreading {:.4} ms",
                best(|| water.advect(level, DT)),
                best(|| water.project(level)),
                best(|| water.diffuse(level, DT)),
                best(|| slice.push(DT)),
            );
        }
        surface(level);
    }
}

fn surface(level: Level) {
    let slice = animal(100, level);
    let chain: Vec<DVec2> = slice.chain().collect();
    let mut bell = Bell::new(Form::default(), 0.004, (&chain, 1), 1).expect("a form");
    let mut vertices = vec![DrawVertex::default(); bell.form().bell_vertices()];
    let frame = Frame::default();
    let time = best(|| bell.write(level, [(slice.chain(), slice.place(), frame)], 1.0, &mut vertices));
    println!("  bell of {} vertices: {time:.4} ms", vertices.len());
    let points = slice.strand(0).len();
    let mut fringe = Fringe::new(FringeForm::default(), points, 1).expect("a fringe");
    let mut vertices = vec![DrawVertex::default(); fringe.vertices()];
    let near =
        |side: usize, k: usize| (slice.strand(side).nth(k).unwrap_or_default() - slice.place()).as_vec2();
    let time = best(|| {
        let discs = (0..points).map(|k| Disc::turned([near(1, k), near(0, k)], &frame));
        fringe.hang(discs);
        fringe.write(level, &mut vertices);
    });
    println!("  tentacles of {} vertices: {time:.4} ms", vertices.len());
}
