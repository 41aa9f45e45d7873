//! Ten minutes of each behaviour, of points and of bodies: who leaves, who is stuck, who touches whom, how
//! sharply they turn, and how a shoal holds together. Seconds can be given as the first argument.

#[path = "../tests/common/behaviours.rs"]
mod behaviours;

use behaviours::{Behaviour, watch};

fn main() {
    let seconds = std::env::args().nth(1).and_then(|seconds| seconds.parse().ok()).unwrap_or(600.0);
    println!("{seconds} s of each");
    for behaviour in [Behaviour::Shoal, Behaviour::Hunter, Behaviour::Home, Behaviour::Wandering] {
        for bodies in [false, true] {
            let seen = watch(behaviour, bodies, seconds);
            println!(
                "{:10} {:6}  beyond {:6.3} m  in rock {:.2} s  touching {:.2} s  turning {:.2}  polarisation {:.2}  \
                 spread {:.2} … {:.2} m  strayed {:.2}  caught {}",
                format!("{behaviour:?}"),
                if bodies { "bodies" } else { "points" },
                seen.beyond,
                seen.stuck,
                seen.touching,
                seen.turning,
                seen.polarisation,
                seen.spread[0],
                seen.spread[1],
                seen.strayed,
                seen.caught,
            );
        }
    }
}
