//! How fast an uneven contraction turns the animal: `cargo run -p reef-jellyfish-model --example
//! jellyfish_turn [SECONDS]`. Degrees a second by the angle by which each joint of the bell bends to one
//! side, without and with the righting couple.

use reef_flow::Level;
use reef_jellyfish_model::{
    slice::{Build, Gait, Slice},
    water::Grid,
};

fn main() {
    let seconds = std::env::args().nth(1).map_or(4.0, |text| text.parse().expect("a number"));
    let grid = Grid { n: 100, cell: 0.004, density: 1000.0, viscosity: 1.304e-6 };
    for righting in [0.0, 0.1] {
        for turn in [-0.1, -0.05, -0.02, 0.0, 0.02, 0.05, 0.1, 0.15, 0.2] {
            let build = Build { righting, ..Build::default() };
            let mut slice = Slice::<f64>::new(build, grid).expect("the paper's animal");
            slice.set_gait(Gait { turn, ..Gait::default() }).expect("a gait");
            let start = slice.place();
            let dt = 0.005;
            let (mut angle, mut before, mut most) = (0.0, slice.axis(), 0.0_f64);
            for _ in 0..(seconds / dt) as usize {
                slice.step(Level::best(), dt);
                angle -= before.angle_to(slice.axis()).to_degrees();
                before = slice.axis();
                most = if angle.abs() > most.abs() { angle } else { most };
            }
            let way = slice.place() - start;
            println!(
                "righting {righting} N/m, {turn:5.2} rad: {:6.1}°/s, most {most:6.1}°, travel {:6.3} {:6.3} m",
                angle / seconds,
                way.x,
                way.y
            );
        }
    }
}
