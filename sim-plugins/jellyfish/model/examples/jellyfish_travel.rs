//! Distance over frequency, as figure 5 has it, and how well the sea's primitives fit the animal's water:
//! `cargo run -p reef-jellyfish-model --example jellyfish_travel [CELLS [STEP_MS [SECONDS]]]`.

use reef_flow::Level;
use reef_jellyfish_model::{
    bloom::Choice,
    slice::{Build, Gait, Slice},
    water::Grid,
};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut next = |usual: f64| arguments.next().map_or(usual, |text| text.parse().expect("a number"));
    let choice = Choice::default();
    let (n, dt, seconds) = (next(100.0) as usize, next(5.0) * 1e-3, next(20.0));
    println!("{n} x {n} cells, steps of {} ms; metres after seconds:", dt * 1e3);
    for frequency in [0.4, 0.7, 1.0, 1.5, 2.0] {
        let build = Build::default();
        let grid = Grid { n, cell: 10.0 * build.diameter / n as f64, density: 1000.0, viscosity: 1.304e-6 };
        let mut slice = Slice::<f32>::new(build, grid).expect("the paper's animal");
        slice.set_gait(Gait { frequency, ..Gait::default() }).expect("a gait");
        let start = slice.place();
        let (mut all, mut missed, mut strongest) = (0.0, 0.0, 0.0_f64);
        let (mut line, mut fastest, mut divergence) = (String::new(), 0.0_f64, 0.0_f64);
        let steps = (seconds / dt).round() as usize;
        for step in 1..=steps {
            slice.step(Level::best(), dt);
            let jet = choice.fit(&slice);
            (all, missed) = (all + jet.squares[0], missed + jet.squares[1]);
            strongest = strongest.max(jet.chosen[0].1.abs());
            if step % 40 == 0 {
                fastest = fastest.max(slice.water().fastest());
                let mut water = slice.water().clone();
                water.project(Level::best());
                divergence = divergence.max(water.divergence());
            }
            if step * 10 % steps < 10 {
                line += &format!(" {:.3}", (slice.place() - start).y);
            }
        }
        let tilt = slice.axis().x.asin().to_degrees();
        println!(
            "{frequency} Hz:{line}; fastest {fastest:.2} m/s, divergence {divergence:.1e} 1/s, tilt {tilt:.1}°; \
             jet up to {strongest:.1e} m³/s, misses {:.0} % of the water's speed",
            100.0 * (missed / all).sqrt()
        );
    }
}
