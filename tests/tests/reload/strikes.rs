//! Every kind of fault in every call, again and again: a build is taken up and fails, the sound one takes over, and the sea
//! is what it would be had there never been another. A few of each by default; `REEF_FAULTS=1000` (`cargo xtask faults`)
//! makes a thousand.

use std::{
    env,
    fmt::Write as _,
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
    thread,
    time::Duration,
};

use reef::{
    plugin::{Health, Library, Limits, Plugin, image::Image, set_limits},
    world::{
        World,
        hash::{Chain, Digest},
        swap::{Job, Purpose, Swap},
    },
};
use reef_tests::child;

use crate::{another, builds, sea_of};

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

/// How many of each.
fn wanted() -> usize {
    env::var("REEF_FAULTS").ok().and_then(|count| count.parse().ok()).unwrap_or(2)
}

#[test]
fn every_fault_in_every_call_is_survived_and_the_sea_is_as_with_the_sound_build() {
    for features in ["", "striking"] {
        builds(features); // Before the children look for them.
    }
    let cells: Vec<(String, String)> = STRIKES
        .iter()
        .flat_map(|strike| {
            CALLS.iter().map(move |call| (format!("strike = \"{strike}\""), (*call).to_owned()))
        })
        .chain(OUTPUTS.iter().map(|outputs| (format!("outputs = \"{outputs}\""), "step".to_owned())))
        .collect();
    let count = wanted();
    let next = AtomicUsize::new(0);
    let lines = Mutex::new(String::new());
    let failures = Mutex::new(String::new());
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some((fault, call)) = cells.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let mut survived = 0;
                    while survived < count {
                        let some = (count - survived).min(OF_A_PROCESS);
                        let task = format!("{some}\n{fault}\nwhere = \"{call}\"\n");
                        let limit = Duration::from_secs(60 + some as u64);
                        let ended = child::run("strikes::child_that_is_struck", &task, limit);
                        if !ended.status.is_some_and(|status| status.success()) {
                            let text = format!("{fault} in {call}, after {survived}: {ended:#?}\n");
                            failures.lock().unwrap().push_str(&text);
                            break;
                        }
                        survived += some;
                    }
                    let _ = writeln!(lines.lock().unwrap(), "{survived} of {count}: {fault} in {call}");
                }
            });
        }
    });
    println!("{}", lines.into_inner().unwrap());
    let failures = failures.into_inner().unwrap();
    assert!(failures.is_empty(), "{failures}");
}

#[test]
#[ignore = "in a process of its own"]
fn child_that_is_struck() {
    let Some(task) = child::task() else { return };
    let (count, table) = task.split_once('\n').unwrap();
    let limit = Duration::from_millis(20);
    set_limits(Limits { step: limit, other: limit, grace: Duration::from_millis(10) });
    Struck::new(table).strike(count.parse().unwrap());
}

/// Two seas of the same two modules; strange builds come to one of them.
struct Struck {
    world: World,
    reference: World,
    sound: Plugin,
    striking: Vec<u8>,
    jobs: mpsc::Sender<Arc<Job>>,
}

impl Struck {
    fn new(table: &str) -> Self {
        let scene = format!(
            "[scene]\nname = \"Struck\"\n\n[modules.first]\nuse = \"fixture.growing\"\n{table}\n\
             [modules.second]\nuse = \"fixture.growing\"\nheight = 2.0\n{table}"
        );
        let (world, sound) = sea_of(&builds(""), &scene, 1);
        let (reference, _) = sea_of(&builds(""), &scene, 1);
        let (jobs, given) = mpsc::channel::<Arc<Job>>();
        thread::spawn(move || given.iter().for_each(|job| job.work(|| {})));
        Self { world, reference, sound, striking: builds("striking"), jobs }
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
        let path = std::path::Path::new("libstriking.so");
        let (library, plugins) =
            Library::load_image(path, &Image::whole(&another(self.striking.clone())), 2).unwrap();
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
        job.wait(self.world.clock().step, Duration::from_secs(10));
        self.world.swap(job)
    }
}

/// A hash of all that the sea shows and would save.
fn digest(world: &mut World) -> Digest {
    Chain::default().add(world).expect("a sound sea gives its state")
}
