//! `reef sim --at`: the sea at moments in any order.

use std::time::Instant;

use reef_files::InOrder;
use reef_plugin::PluginError;
use reef_report::{
    failure::Failure,
    say::{self, say},
};
use reef_sea::{
    World,
    step::{
        hash::{Chain, hex},
        state::StateError,
    },
};

/// A moment of the sea.
#[derive(Debug, serde::Serialize)]
pub struct Moment {
    /// When it is [s].
    pub time: f64,
    /// Its step.
    pub step: u64,
    /// Of this step alone: two runs that have the same are in the same state, and emit the same.
    pub hash: String,
    /// How long the way took [ms].
    pub milliseconds: f64,
}

fn failed(error: PluginError) -> Failure {
    Failure::check(StateError::from(error))
}

/// Goes to each of these times in turn [s], until it is asked to end; `seen` gets the sea after each step.
pub fn visit(
    world: &mut World,
    times: &[f64],
    plain: bool,
    in_order: &InOrder,
    mut seen: impl FnMut(&mut World),
) -> Result<Vec<Moment>, Failure> {
    let mut moments = Vec::new();
    for time in times {
        let step = world.clock().steps_to(*time);
        let began = Instant::now();
        world.go_to(step).map_err(failed)?;
        let bar = say::progress(step - world.clock().step, "steps", plain);
        while world.clock().step < step && in_order.asked().is_none() {
            world.step_toward(step);
            seen(world);
            bar.inc(1);
        }
        bar.finish_and_clear();
        if in_order.asked().is_some() {
            break;
        }
        let milliseconds = began.elapsed().as_secs_f64() * 1e3;
        let hash = hex(&Chain::default().add(world).map_err(failed)?);
        moments.push(Moment { time: world.clock().time(), step, hash, milliseconds });
    }
    Ok(moments)
}

/// Says what was found, for people.
pub fn tell(world: &World, moments: &[Moment]) {
    for Moment { time, step, hash, milliseconds } in moments {
        say(format_args!("{time:.3} s, step {step}: {hash} ({milliseconds:.1} ms)"));
    }
    if !moments.is_empty() {
        let memory = world.memory();
        let mb = |bytes: usize| bytes as f64 / f64::from(1 << 20);
        say(format_args!(
            "remembered: {} states, {:.1} of {:.0} MB",
            memory.states,
            mb(memory.used),
            mb(memory.most)
        ));
    }
}
