//! A sea in real time, step by step at the pace of its clock, tended to between them.

use std::time::{Duration, Instant};

use super::{Live, sleep_until};
use crate::World;

/// How late steps begin [s], by when they were due.
#[derive(Clone, Debug, Default)]
pub struct Lateness {
    /// The latest.
    pub worst: f64,
    /// Steps that began more than one step's length after they were due.
    pub late: u64,
}

/// Steps a world at the pace of its clock until `steps` are made, tending to what changes between them.
/// `after` is called after each step with the world, what is live, and whether the step was the first of
/// newer instances.
pub fn pace(
    live: &mut Live,
    world: &mut World,
    steps: u64,
    mut after: impl FnMut(&mut Live, &mut World, bool) -> bool,
) -> Lateness {
    let dt = Duration::from_secs_f64(world.clock().dt);
    let mut lateness = Lateness::default();
    let mut due = Instant::now() + dt;
    let mut swapped = false;
    for _ in 0..steps {
        loop {
            swapped |= live.tend(world).swapped;
            if Instant::now() >= due {
                break;
            }
            sleep_until(due);
        }
        let late = due.elapsed().as_secs_f64();
        lateness.worst = lateness.worst.max(late);
        if late > dt.as_secs_f64() {
            lateness.late += 1;
            // What is lost is lost: a slow machine shows a slow sea.
            due = Instant::now();
        }
        world.step();
        if !after(live, world, std::mem::take(&mut swapped)) {
            break;
        }
        due += dt;
    }
    lateness
}
