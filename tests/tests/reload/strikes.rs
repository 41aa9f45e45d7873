//! Every kind of fault in every call, again and again: a build is taken up and fails, the sound one takes
//! over, and the sea is what it would be had there never been another. A few of each by default;
//! `REEF_FAULTS=1000` (`cargo xtask faults`) makes a thousand.

use std::{
    env, fs,
    path::Path,
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
    thread,
    time::{Duration, Instant},
};

use reef_plugin::{Health, Library, Limits, Plugin, image::Image, inspect, set_limits};
use reef_sea::{
    World,
    reload::swap::{Job, Purpose, Swap},
    step::hash::{Chain, Digest},
};
use reef_tests::child;

use crate::{build_file, sea_of};

/// What ends a plugin's code, or does not let it end.
const STRIKES: [&str; 10] = [
    "panic",
    "bad_pointer",
    "no_memory",
    "bad_instruction",
    "divide_by_zero",
    "abort",
    "stack_overflow",
    "loop",
    "allocating_loop",
    "deadlock",
];
/// In which calls; `job` on whichever thread, `worker` on none but the pool's.
const CALLS: [&str; 6] = ["create", "step", "job", "worker", "save", "load"];
/// What a step emits.
const OUTPUTS: [&str; 3] = ["not_a_number", "infinite", "too_much"];
/// Faults of one process: what is quarantined stays until its end.
const OF_A_PROCESS: usize = 100;
/// Processes side by side whose faults wait rather than work.
const WAITING: usize = 16;

/// How many of each.
fn wanted() -> usize {
    env::var("REEF_FAULTS").ok().and_then(|count| count.parse().ok()).unwrap_or(2)
}

/// A fault in a call, and how often it was survived.
struct Cell {
    fault: String,
    call: &'static str,
    survived: AtomicUsize,
    /// Time of its processes [ms].
    took: AtomicUsize,
}

#[test]
fn every_fault_in_every_call_is_survived_and_the_sea_is_as_with_the_sound_build() {
    let cell = |fault, call| Cell { fault, call, survived: AtomicUsize::new(0), took: AtomicUsize::new(0) };
    let strikes = STRIKES
        .iter()
        .flat_map(|strike| CALLS.iter().map(move |call| cell(format!("strike = \"{strike}\""), call)));
    let outputs = OUTPUTS.iter().map(|outputs| cell(format!("outputs = \"{outputs}\""), "step"));
    let cells: Vec<Cell> = strikes.chain(outputs).collect();
    // A deadlock is most of a second of waiting: many at once, beside those that keep the processors busy.
    let (waiting, working) = cells.iter().partition(|cell| cell.fault.contains("deadlock"));
    let failures = Mutex::new(String::new());
    let processors = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        scope.spawn(|| strike_all(waiting, WAITING, &failures));
        scope.spawn(|| strike_all(working, processors, &failures));
    });
    let count = wanted();
    for Cell { fault, call, survived, took } in &cells {
        let (survived, took) = (survived.load(Ordering::Relaxed), took.load(Ordering::Relaxed));
        println!("{survived} of {count}, {} ms each: {fault} in {call}", took / survived.max(1));
    }
    let failures = failures.into_inner().unwrap();
    assert!(failures.is_empty(), "{failures}");
    assert!(cells.iter().all(|cell| cell.survived.load(Ordering::Relaxed) == count));
}

/// Makes the faults of these cells, in so many processes at a time.
fn strike_all(cells: Vec<&Cell>, at_once: usize, failures: &Mutex<String>) {
    let count = wanted();
    let (sound, striking) = (build_file(""), build_file("striking"));
    let turns = (0..count).step_by(OF_A_PROCESS).flat_map(|from| cells.iter().map(move |cell| (from, *cell)));
    let turns = Mutex::new(turns);
    thread::scope(|scope| {
        for _ in 0..at_once {
            scope.spawn(|| {
                loop {
                    let Some((from, cell)) = turns.lock().unwrap().next() else { return };
                    let Cell { fault, call, survived, took } = cell;
                    let some = (count - from).min(OF_A_PROCESS);
                    let task = format!(
                        "{some}\n{}\n{}\n{fault}\nwhere = \"{call}\"\n",
                        sound.display(),
                        striking.display()
                    );
                    let began = Instant::now();
                    let limit = Duration::from_secs(60 + 2 * some as u64);
                    let ended = child::run("strikes::child_that_is_struck", &task, limit);
                    took.fetch_add(began.elapsed().as_millis() as usize, Ordering::Relaxed);
                    if ended.status.is_some_and(|status| status.success()) {
                        survived.fetch_add(some, Ordering::Relaxed);
                    } else {
                        let text = format!("{fault} in {call}, after {from}: {ended:#?}\n");
                        failures.lock().unwrap().push_str(&text);
                    }
                }
            });
        }
    });
}

#[test]
#[ignore = "in a process of its own"]
fn child_that_is_struck() {
    let Some(task) = child::task() else { return };
    let [count, sound, striking, table] = task.splitn(4, '\n').collect::<Vec<_>>()[..] else {
        panic!("no task: {task}");
    };
    let limit = Duration::from_millis(20);
    set_limits(Limits { step: limit, other: limit, grace: Duration::from_millis(10) });
    Struck::new(Path::new(sound), Path::new(striking), table).strike(count.parse().unwrap());
}

/// Two seas of the same two modules; strange builds come to one of them.
struct Struck {
    world: World,
    reference: World,
    sound: Plugin,
    striking: Image<'static>,
    jobs: mpsc::Sender<Arc<Job>>,
}

impl Struck {
    fn new(sound: &Path, striking: &Path, table: &str) -> Self {
        let scene = format!(
            "[scene]\nname = \"Struck\"\n\n[modules.first]\nuse = \"fixture.growing\"\n{table}\n\
             [modules.second]\nuse = \"fixture.growing\"\nheight = 2.0\n{table}"
        );
        let (build, striking) = (fs::read(sound).unwrap(), inspect::read(striking).unwrap());
        let (world, sound) = sea_of(&build, &scene, 1);
        let (reference, _) = sea_of(&build, &scene, 1);
        let (jobs, given) = mpsc::channel::<Arc<Job>>();
        thread::spawn(move || given.iter().for_each(|job| job.work(|| {})));
        Self { world, reference, sound, striking, jobs }
    }

    fn strike(&mut self, count: usize) {
        self.step();
        for number in 0..count {
            let taken = self.reload();
            // A fault in create or load is found before anybody sees the build; so the sea runs on as it was.
            let failed = taken
                && (0..3).any(|_| {
                    self.step();
                    self.failed()
                });
            assert_ne!(taken, !failed, "fault {number}: taken {taken}, failed {failed}");
            if failed {
                self.take_over();
            }
            self.step();
            assert!(!self.failed(), "fault {number}");
            assert_eq!(digest(&mut self.world), digest(&mut self.reference), "fault {number}");
        }
    }

    fn step(&mut self) {
        self.world.step();
        self.reference.step();
    }

    fn failed(&self) -> bool {
        (0..2).any(|module| {
            self.world.instance(module).is_some_and(|instance| *instance.health() != Health::Running)
        })
    }

    /// Offers a striking build; false: it was refused.
    fn reload(&mut self) -> bool {
        let path = Path::new("libstriking.so");
        let (library, plugins) = Library::load_image(path, &self.striking, 2).unwrap();
        let job = self.world.order_reload(&plugins).unwrap().unwrap();
        drop((library, plugins));
        match self.outcome(&job) {
            Swap::Done(_) => true,
            Swap::Failed(_) => false,
            other => panic!("the reload ended with {other:?}"),
        }
    }

    /// The sound build takes over wherever the striking one failed, and makes up for what was missed.
    fn take_over(&mut self) {
        let strange = |world: &World, sound: &Plugin| {
            (0..2).any(|module| {
                world.instance(module).is_some_and(|it| !Arc::ptr_eq(it.plugin().library(), sound.library()))
            })
        };
        while strange(&self.world, &self.sound) {
            let failed: Vec<(usize, Plugin)> = self
                .world
                .take_faults()
                .into_iter()
                .filter(|fault| fault.grave)
                .map(|fault| (fault.module, self.sound.clone()))
                .collect();
            if failed.is_empty() {
                // A fault in save is heard of in the next step, or comes to the other module later.
                self.step();
                continue;
            }
            let job = self.world.order_takeover(&failed).expect("a state to begin with");
            assert_eq!(job.purpose, Purpose::Takeover);
            match self.outcome(&job) {
                Swap::Done(former) => drop(former),
                other => panic!("the takeover ended with {other:?}"),
            }
        }
    }

    fn outcome(&mut self, job: &Arc<Job>) -> Swap {
        self.jobs.send(job.clone()).unwrap();
        job.wait(self.world.clock().step, Duration::from_secs(30));
        self.world.swap(job)
    }
}

/// A hash of all that the sea shows and would save.
fn digest(world: &mut World) -> Digest {
    Chain::default().add(world).expect("a sound sea gives its state")
}
