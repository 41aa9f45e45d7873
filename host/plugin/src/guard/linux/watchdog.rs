//! Calls that do not end: asked to stop, then stopped. A thread of the host's own looks at all generations
//! every few milliseconds while one of them runs.

use std::{
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use crate::guard::{Fate, Watch, fate::stage, limits};

/// How often the watchdog looks while a call runs.
const TICK: Duration = Duration::from_millis(10);
/// After so long without a call it sleeps until one begins.
const IDLE: Duration = Duration::from_secs(1);
/// How much slower the clock counts than processor time: a call that waits, or a machine with other work.
const WAITING: u32 = 8;
/// A call that waits for longer than both this and its limit waits for nothing that will come [clock].
const LONGEST_WAIT: Duration = Duration::from_secs(60);
/// How long a call may take to come back to its text after that was taken away [processor time].
const RETURN: Duration = Duration::from_millis(40);
/// The same, for one that waits in the system and was interrupted there [clock]. The clock stands where a
/// thread could go on and has no processor: it may be about to leave the C library, with a lock of it in its
/// hands.
const RETURN_WAITING: Duration = Duration::from_millis(400);

/// Threads of a generation for whose times there is room before its first step, which would otherwise be seen
/// to allocate.
const MOST_THREADS: usize = 16;

/// A generation under watch.
struct Watched {
    fate: Weak<Fate>,
    /// The running call, by its number; even: none.
    call: u64,
    began: Instant,
    /// Each thread's processor time when the call was first seen [ns].
    before: Vec<Option<u64>>,
    /// What it had used when it was asked to stop.
    asked: Option<Duration>,
    /// What it had used when its text was taken away.
    denied: Option<Duration>,
    /// For how long all of its threads were seen to wait in the system, since then.
    asleep: Duration,
}

#[derive(Default)]
struct Kennel {
    watched: Vec<Watched>,
    running: bool,
}

static KENNEL: Mutex<Option<Kennel>> = Mutex::new(None);
static BELL: Condvar = Condvar::new();
static ASLEEP: AtomicBool = AtomicBool::new(false);

fn kennel() -> MutexGuard<'static, Option<Kennel>> {
    KENNEL.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Watches a generation until it is dropped. The first one starts the watchdog.
pub(crate) fn watch(fate: &Arc<Fate>) {
    let mut kennel = kennel();
    let kennel = kennel.get_or_insert_default();
    // Those that are gone make room now, not with the watchdog's next look.
    kennel.watched.retain(|watched| watched.fate.strong_count() > 0);
    kennel.watched.push(Watched {
        fate: Arc::downgrade(fate),
        call: 0,
        began: Instant::now(),
        before: Vec::with_capacity(MOST_THREADS),
        asked: None,
        denied: None,
        asleep: Duration::ZERO,
    });
    if !kennel.running {
        let started = thread::Builder::new().name("reef-watchdog".into()).spawn(keep_watch);
        kennel.running = started.is_ok();
        if let Err(error) = started {
            tracing::warn!("plugins that do not end are not stopped: no thread for the watchdog: {error}");
        }
    }
}

/// A call begins: where the watchdog sleeps, it wakes. One that is missed is seen when it wakes by itself.
pub(crate) fn wake() {
    if ASLEEP.load(Ordering::Relaxed) {
        BELL.notify_all();
    }
}

/// The watchdog's life, which is the program's.
fn keep_watch() {
    let mut last_call = Instant::now();
    loop {
        let mut guard = kennel();
        if let Some(kennel) = guard.as_mut() {
            kennel.watched.retain_mut(|watched| match watched.fate.upgrade() {
                Some(fate) => {
                    if watched.look(&fate) {
                        last_call = Instant::now();
                    }
                    true
                }
                None => false,
            });
        }
        if last_call.elapsed() < IDLE {
            drop(guard);
            thread::sleep(TICK);
        } else {
            ASLEEP.store(true, Ordering::Relaxed);
            drop(BELL.wait_timeout(guard, IDLE));
            ASLEEP.store(false, Ordering::Relaxed);
        }
    }
}

impl Watched {
    /// Does what is due; true while a call runs.
    fn look(&mut self, fate: &Fate) -> bool {
        let call = fate.call.load(Ordering::Acquire);
        if call != self.call {
            self.call = call;
            self.began = Instant::now();
            self.asked = None;
            self.denied = None;
            self.asleep = Duration::ZERO;
            self.before.clear();
            if call % 2 == 1 {
                self.before.extend(fate.threads().iter().map(|thread| thread.processor_time()));
            }
            return true;
        }
        if call.is_multiple_of(2) {
            return false;
        }
        let limits = limits();
        if limits.step.is_zero() {
            return true;
        }
        let limit = limits.of(fate.watch());
        let (busiest, used) = self.used(fate, limit);
        match (self.asked, self.denied) {
            (None, _) if used >= limit => {
                self.asked = Some(used);
                fate.asked.store(call, Ordering::Relaxed);
            }
            (Some(asked), None) if used.saturating_sub(asked) >= limits.grace => self.deny(fate, busiest),
            (Some(_), Some(before)) => {
                // Interrupted in the system, it comes back to its text; if it does not, it is left where it
                // is. That is not done at once: it might hold a lock of the C library, which every thread
                // would then wait for.
                let asleep = fate.threads().iter().all(super::stack::Thread::is_asleep);
                if asleep {
                    self.asleep += TICK;
                }
                let late = busiest.saturating_sub(before) >= RETURN || self.asleep >= RETURN_WAITING;
                if late {
                    fate.stage.store(stage::LEAVE, Ordering::Relaxed);
                }
                // Whoever was woken and found no processor yet needs no second word.
                if late || asleep {
                    fate.threads().iter().for_each(super::stack::Thread::nudge);
                }
            }
            _ => {}
        }
        true
    }

    /// Processor time of the busiest thread in this call, and what counts: that, or an eighth of the clock
    /// (all of it after [`LONGEST_WAIT`]).
    fn used(&self, fate: &Fate, limit: Duration) -> (Duration, Duration) {
        let threads = fate.threads();
        // A thread that began after the call was first seen has spent all of its time in it.
        let before = self.before.iter().copied().chain(std::iter::repeat(Some(0)));
        let times = threads
            .iter()
            .zip(before)
            .filter_map(|(thread, before)| Some(thread.processor_time()?.saturating_sub(before?)));
        let waited = self.began.elapsed();
        match times.max() {
            Some(busiest) => {
                let busiest = Duration::from_nanos(busiest);
                // Nobody waits for long while something ends.
                let slowly = waited < limit.max(LONGEST_WAIT) && fate.watch() != Watch::End;
                let clock = if slowly { waited / WAITING } else { waited };
                // A thread that could go on, and has no processor, is no fault of its own, however long that
                // takes.
                let waits = clock >= limit && threads.iter().all(super::stack::Thread::is_asleep);
                (busiest, if waits { busiest.max(clock) } else { busiest })
            }
            None => (waited, waited),
        }
    }

    /// Takes the text away, unless the call has just ended.
    fn deny(&mut self, fate: &Fate, busiest: Duration) {
        let text = fate.text();
        // With the lock held the library is not closed; a library linked into the program has no text of its
        // own.
        if let Some(text) = text.as_ref()
            && fate.call.load(Ordering::Acquire) == self.call
        {
            fate.stage.store(stage::DENIED, Ordering::Relaxed);
            if text.deny() {
                self.denied = Some(busiest);
            } else {
                fate.stage.store(stage::NONE, Ordering::Relaxed);
            }
        }
    }
}
