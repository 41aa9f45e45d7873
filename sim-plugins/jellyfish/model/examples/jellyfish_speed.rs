//! Where the time of a step goes on one core.
use reef_flow::{Level, random::Random};
use reef_jellyfish_model::water::{Grid, Water};
use std::time::Instant;

fn best(mut run: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..60 {
        let start = Instant::now();
        for _ in 0..10 {
            run();
        }
        best = best.min(start.elapsed().as_secs_f64() / 10.0);
    }
    best * 1e3
}

fn main() {
    {
        use reef_jellyfish_model::{
            slice::{Build, Slice},
            surface::{Bell, Form, Frame},
        };
        let grid = Grid { n: 100, cell: 0.004, density: 1000.0, viscosity: 1.304e-6 };
        let mut slice = Slice::<f32>::new(Build::default(), grid).unwrap();
        let chain: Vec<_> = slice.chain().collect();
        let mut bell = Bell::new(Form::default(), 0.004, &chain, 1).unwrap();
        for _ in 0..300 {
            slice.step(Level::best(), 0.005);
        }
        println!("step {:.4} ms", best(|| slice.step(Level::best(), 0.005)));
        println!("push {:.4} ms", best(|| slice.push(0.005)));
        let mut into = vec![Default::default(); bell.form().bell_vertices()];
        println!(
            "{} vertices {:.4} ms",
            into.len(),
            best(|| bell.write(
                Level::best(),
                slice.chain(),
                slice.place(),
                &Frame::default(),
                0.0,
                &mut into
            ))
        );
    }

    for n in [50, 100] {
        let mut water =
            Water::<f32>::new(Grid { n, cell: 0.4 / n as f64, density: 1000.0, viscosity: 1.304e-6 })
                .unwrap();
        let mut random = Random::new(7, n as u64);
        let faces: Vec<f32> = (0..2 * n * (n + 1)).map(|_| 0.05 * random.signed() as f32).collect();
        water.set_faces(&faces).unwrap();
        let level = Level::best();
        water.project(level);
        println!("{n} diffuse {:.4} ms", best(|| water.diffuse(level, 0.005)));
        println!("{n} project {:.4} ms", best(|| water.project(level)));
        println!("{n} advect {:.4} ms", best(|| water.advect(level, 0.005)));
    }
}
