//! `reef bench contract`: what a call through the contract costs — the guard around it, and the way from the
//! host's thread to a plugin's code and back — beside the same model without any of it.

use std::{
    hint::black_box,
    path::Path,
    sync::atomic::{AtomicU64, Ordering},
    time::{Duration, Instant},
};

use reef_anemone_model::Anemones;
use reef_command::{Common, open};
use reef_fish_model::Fish;
use reef_plugin::{Registry, generation::Generation};
use reef_report::failure::Failure;
use reef_sdk::prelude::*;
use reef_sea::{Options, World};

use super::{
    cells::times_of,
    fibre::running,
    measure::{best, median},
    report::{Bar, Report},
};

/// The paper's 36 anemones.
const FIGURE_13: &str = "anemone-fig13-36-anemones";
/// Calls of a turn, and turns.
const CALLS: u32 = 100_000;
const TURNS: usize = 60;
/// Steps before anything counts, and those that count, of each of the two seas in turn.
const WARM_STEPS: usize = 100;
const STEPS: usize = 1500;

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let mut report = Report::default();
    let [plain, guarded] = guard()?;
    report.figure("a plain call", 1e9 * plain, "ns");
    report.figure("the same, guarded", 1e9 * guarded, "ns");
    report.judged("the guard", 1e9 * (guarded - plain), "ns a call", Bar::AtMost(10.0));

    let steps = steps(common)?;
    let middle = |of: fn(&Step) -> f64| median(steps.iter().map(of).collect());
    let own = middle(|step| step.own);
    let way = middle(|step| step.way);
    report.figure("figure 13, one worker: the model's own step", 1e3 * own, "ms");
    report.judged(
        "the contract around it, in the same step",
        100.0 * middle(|step| (step.linked - step.own) / step.own),
        "% more",
        Bar::AtMost(1.0),
    );
    report.figure(
        "in its library, over linked",
        100.0 * (middle(|step| step.library / step.linked) - 1.0),
        "% more",
    );
    report.figure("to the library's own thread and back", 1e6 * way, "µs");
    report.figure("the same, of the model's own step", 100.0 * way / own, "%");
    report.figure("the host's look at what came out", 1e6 * middle(|step| step.check), "µs");
    report.note(format!(
        "A guarded call: {TURNS} turns of {CALLS} calls of an empty function; each one's best turn counts. Steps: medians of {STEPS} \
         of two seas that take turns, one with the model in its library, one with it linked into the program and a clock around \
         the model's own step: what the contract adds is tables, arguments and jobs in C. The way to a thread of the library's own \
         is what keeps a library from pinning itself, and the look at outputs is a host's that trusts nobody: a model that is linked \
         takes and gets both, too."
    ));
    Ok(report)
}

/// Seconds of a plain and of a guarded call.
fn guard() -> Result<[f64; 2], Failure> {
    let generation =
        Generation::new(1).map_err(|error| Failure::machine(miette::miette!("a thread: {error}")))?;
    let mut turns = Vec::with_capacity(TURNS);
    for _ in 0..TURNS {
        let time = |calls: &(dyn Fn() + Sync)| {
            let began = Instant::now();
            calls();
            began.elapsed().as_secs_f64() / f64::from(CALLS)
        };
        // Both on the control thread: the way there is not the guard's.
        turns.push(generation.run(|| {
            let plain = time(&|| (0..CALLS).for_each(|number| empty(black_box(number))));
            let guarded = time(&|| generation.guarded_calls(CALLS, empty));
            vec![plain, guarded]
        }));
    }
    Ok([best(&turns, 0), best(&turns, 1)])
}

#[inline(never)]
fn empty(number: u32) {
    black_box(number);
}

/// Seconds of one step of each sea.
struct Step {
    /// The model's own step, without the contract.
    own: f64,
    /// The call of that very step through the contract.
    linked: f64,
    /// The call of the step in the library.
    library: f64,
    /// From the host's thread to the library's and back.
    way: f64,
    /// The host's look at the library's outputs.
    check: f64,
}

fn steps(common: &Common) -> Result<Vec<Step>, Failure> {
    // One worker: on a machine of two cores the other is the host's own.
    let common = &Common { workers: Some(1), ..common.clone() };
    let scene = Path::new(FIGURE_13);
    let mut library = open::world(common, scene, Options::default())?;
    let mut plugins = Registry::new();
    plugins
        .add_linked(reef_sdk::entry::<Timed>(), open::workers(common))
        .and_then(|()| plugins.add_linked(reef_sdk::entry::<Fish>(), open::workers(common)))
        .map_err(|refusal| Failure::check(miette::miette!("the linked model: {refusal}")))?;
    let scene = open::scene(common, scene, &plugins)?;
    let mut linked = World::new(scene, &plugins, &Options::default()).map_err(Failure::input)?;
    let times = |world: &World| times_of(world, Anemones::ID).unwrap_or_default();
    let mut steps = Vec::with_capacity(STEPS);
    for number in 0..WARM_STEPS + STEPS {
        linked.step();
        library.step();
        if number >= WARM_STEPS {
            let through = times(&library);
            steps.push(Step {
                own: Duration::from_nanos(OWN.load(Ordering::Relaxed)).as_secs_f64(),
                linked: times(&linked).code.as_secs_f64(),
                library: through.code.as_secs_f64(),
                way: through.way.as_secs_f64(),
                check: through.check.as_secs_f64(),
            });
        }
    }
    running(&mut library)?;
    running(&mut linked)?;
    Ok(steps)
}

/// Nanoseconds of the timed model's last step.
static OWN: AtomicU64 = AtomicU64::new(0);

/// The anemones with a clock around their step.
struct Timed(Anemones);

impl Plugin for Timed {
    const ID: &'static str = Anemones::ID;
    const NAME: &'static str = Anemones::NAME;
    const VERSION: &'static str = Anemones::VERSION;
    const VENDOR: &'static str = Anemones::VENDOR;
    const DESCRIPTION: &'static str = Anemones::DESCRIPTION;
    const STATE_VERSION: u32 = Anemones::STATE_VERSION;
    const STATE_MIN_VERSION: u32 = Anemones::STATE_MIN_VERSION;
    type Config = <Anemones as Plugin>::Config;

    fn params() -> &'static [Param] {
        Anemones::params()
    }

    fn create(host: &Host, scene: &SceneInfo, config: Self::Config) -> Result<Self, ConfigError> {
        Anemones::create(host, scene, config).map(Self)
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        let began = Instant::now();
        let status = self.0.step(input, output);
        let own = u64::try_from(began.elapsed().as_nanos()).unwrap_or(u64::MAX);
        OWN.store(own, Ordering::Relaxed);
        status
    }

    fn save(&self, state: &mut StateWriter) {
        self.0.save(state);
    }

    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
        self.0.load(state)
    }
}
