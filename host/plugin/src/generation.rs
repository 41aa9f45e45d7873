//! The threads on which one loaded library's code runs: a control thread and workers, all joinable, never the
//! program's main thread.

use std::{
    any::Any,
    io,
    mem::MaybeUninit,
    panic::{self, AssertUnwindSafe},
    sync::{
        Arc, Condvar, Mutex, OnceLock, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
        mpsc,
    },
    thread::{self, JoinHandle, ThreadId},
};

use super::{
    guard::{self, Called, Fate, Fault, Resident, Watch},
    health::Health,
    pool::{self, Pool, STACK},
};

/// One loading of one library, with its threads.
#[derive(Debug)]
pub struct Generation {
    fate: Arc<Fate>,
    /// What became of its instances, when one of its calls ended in a fault.
    quarantine: OnceLock<Health>,
    control: Arc<Control>,
    control_thread: Option<JoinHandle<()>>,
    control_id: ThreadId,
    pool: Arc<Pool>,
    /// For the program's last words.
    called: Called,
}

/// A task of [`Generation::run`] on its way to the control thread.
struct Task(*mut (dyn FnMut() + 'static));

// SAFETY: `run` accepts tasks that may be sent, and keeps them alive until they are done.
unsafe impl Send for Task {}

impl Task {
    /// A task without its lifetime.
    ///
    /// # Safety
    /// It lives until the control thread is done with it.
    unsafe fn of<'a>(task: &'a mut (dyn FnMut() + Send + 'a)) -> Self {
        let task: *mut (dyn FnMut() + Send + 'a) = task;
        // SAFETY: only the lifetime and the word that it may be sent change; the caller's promise.
        Self(unsafe {
            std::mem::transmute::<*mut (dyn FnMut() + Send + 'a), *mut (dyn FnMut() + 'static)>(task)
        })
    }
}

enum Slot {
    Empty,
    Waiting(Task),
    Running,
    Done(Option<Box<dyn Any + Send>>),
    Quit,
}

struct Control {
    slot: Mutex<Slot>,
    /// A task waits in the slot, or the end does: an idle control thread watches this for a short while
    /// before it sleeps, because a sea that does not wait for a clock has its next call soon.
    asked: AtomicBool,
    changed: Condvar,
}

impl std::fmt::Debug for Control {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Control")
    }
}

impl Generation {
    /// Starts the threads: one that controls, and `workers - 1` that help.
    pub fn new(workers: usize) -> io::Result<Self> {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let workers = workers.clamp(1, MAX_WORKERS) as u32;
        let fate = Fate::new(number);
        let pool = Arc::new(Pool::new(&fate, workers)?);
        let control = Arc::new(Control {
            slot: Mutex::new(Slot::Empty),
            asked: AtomicBool::new(false),
            changed: Condvar::new(),
        });
        let thread = {
            let (control, fate) = (control.clone(), fate.clone());
            thread::Builder::new().name(format!("reef-{number}-0")).stack_size(STACK).spawn(move || {
                let _resident = Resident::new(&fate);
                control.serve();
            })?
        };
        let control_id = thread.thread().id();
        let (quarantine, called) = (OnceLock::new(), Called::default());
        let control_thread = Some(thread);
        Ok(Self { fate, quarantine, control, control_thread, control_id, pool, called })
    }

    /// Number of the generation; never used again.
    pub fn number(&self) -> u64 {
        self.fate.generation()
    }

    pub(crate) fn fate(&self) -> &Arc<Fate> {
        &self.fate
    }

    /// In what state all of its instances are since one of its calls ended in a fault. Its code is never
    /// called again.
    pub(crate) fn quarantine(&self) -> Option<&Health> {
        self.quarantine.get()
    }

    /// Threads that share the jobs of `parallel_for`.
    pub fn workers(&self) -> u32 {
        self.pool.workers()
    }

    pub(crate) fn pool(&self) -> &Arc<Pool> {
        &self.pool
    }

    /// Is this the control thread?
    pub(crate) fn is_control(&self) -> bool {
        thread::current().id() == self.control_id
    }

    /// Runs `task` on the control thread and returns its result; calls from several threads take turns. A
    /// panic of `task` (the host's own fault) goes on here.
    pub fn run<R: Send>(&self, task: impl FnOnce() -> R + Send) -> R {
        if self.is_control() {
            return task();
        }
        let mut result = MaybeUninit::uninit();
        let mut task = Some(task);
        let mut call = || {
            if let Some(task) = task.take() {
                result.write(task());
            }
        };
        // SAFETY: this function does not return before the control thread is done with it.
        let call = unsafe { Task::of(&mut call) };
        self.control.hand_over(call);
        if let Some(panic) = self.control.wait() {
            panic::resume_unwind(panic);
        }
        // SAFETY: the control thread called `call` once, to its end: else there was a panic. Its first call
        // writes the result.
        unsafe { result.assume_init() }
    }

    /// Runs `task` on the control thread, and `meanwhile` here; returns when both are done. Where `meanwhile`
    /// does the same with other generations, their numbers have to grow: so two threads that do this never
    /// wait for each other. A panic of either (the host's own fault) goes on here.
    pub(crate) fn run_beside(&self, task: &mut (dyn FnMut() + Send), meanwhile: impl FnOnce()) {
        if self.is_control() {
            task();
            return meanwhile();
        }
        // SAFETY: this function does not return before the control thread is done with it, however
        // `meanwhile` ends.
        self.control.hand_over(unsafe { Task::of(task) });
        let here = panic::catch_unwind(AssertUnwindSafe(meanwhile));
        if let Some(panic) = self.control.wait().or(here.err()) {
            panic::resume_unwind(panic);
        }
    }

    /// Runs a call into the library on the control thread, watched and guarded. A fault comes back as its
    /// message, and is the last that the library did: it is not called again.
    pub(crate) fn enter<R: Send>(
        &self,
        plugin: &str,
        call: &'static str,
        code: impl FnOnce() -> R + Send,
    ) -> Result<R, String> {
        self.enter_then(plugin, call, code, |result| result)
    }

    /// As [`Generation::enter`]; when the call has returned, `then` looks at its result: the host's own code,
    /// on the control thread, too, but neither watched nor guarded.
    pub(crate) fn enter_then<R: Send, T: Send>(
        &self,
        plugin: &str,
        call: &'static str,
        code: impl FnOnce() -> R + Send,
        then: impl FnOnce(R) -> T + Send,
    ) -> Result<T, String> {
        if let Some(Health::Faulty(message) | Health::Stopped(message)) = self.quarantine() {
            return Err(message.clone());
        }
        let watch = Watch::of(call);
        self.called.enters(plugin);
        let outcome = self.run(|| {
            if watch != Watch::Step {
                guard::put_in_place();
            }
            let outcome = self.fate.watched(watch, || guard::guarded(&self.fate, code));
            tell_taken(&self.fate, plugin, call);
            outcome.map(then)
        });
        outcome.map_err(|fault| self.condemn(&fault, plugin, call))
    }

    /// The generation's code is never called again, because of this fault. Returns the message.
    fn condemn(&self, fault: &Fault, plugin: &str, call: &'static str) -> String {
        let message = fault.describe(plugin, call);
        self.fate.quarantine();
        // A second fault cannot come before the first was noted: calls take turns, and this one's caller
        // waits.
        let _ = self.quarantine.set(Health::Faulty(message.clone()));
        message
    }
}

/// A guarded call is over: what it took from the guards is put back, and told.
fn tell_taken(fate: &Fate, plugin: &str, call: &str) {
    if let Some(taken) = guard::put_back(fate) {
        tracing::warn!("plugin `{plugin}`: {call} {taken}; the host's own is back in place");
    }
}

impl Generation {
    /// Runs `code` so often on the control thread, each time through a guard of its own, to measure what a
    /// guard costs.
    pub fn guarded_calls(&self, count: u32, code: impl Fn(u32) + Sync) {
        self.run(|| {
            for number in 0..count {
                if guard::guarded(&self.fate, || code(number)).is_err() {
                    break;
                }
            }
        });
    }
}

/// No generation has more workers than this.
pub const MAX_WORKERS: usize = 256;

impl Control {
    fn lock(&self) -> std::sync::MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait_until(&self, until: fn(&Slot) -> bool) -> std::sync::MutexGuard<'_, Slot> {
        self.changed.wait_while(self.lock(), |slot| !until(slot)).unwrap_or_else(PoisonError::into_inner)
    }

    /// Hands over a task, as soon as nobody else's is there. [`Control::wait`] follows.
    fn hand_over(&self, task: Task) {
        let mut slot = self.wait_until(|slot| matches!(slot, Slot::Empty));
        *slot = Slot::Waiting(task);
        self.asked.store(true, Ordering::Release);
        // Who wakes up finds the lock free, and need not sleep again.
        drop(slot);
        self.changed.notify_all();
    }

    /// Waits until the task that was handed over is done, and returns what it panicked with.
    fn wait(&self) -> Option<Box<dyn Any + Send>> {
        let mut slot = self.wait_until(|slot| matches!(slot, Slot::Done(_)));
        let done = std::mem::replace(&mut *slot, Slot::Empty);
        drop(slot);
        self.changed.notify_all();
        match done {
            Slot::Done(panic) => panic,
            _ => None,
        }
    }

    /// The control thread's life.
    fn serve(&self) {
        loop {
            let mut slot = self
                .changed
                .wait_while(self.lock(), |slot| !matches!(slot, Slot::Waiting(_) | Slot::Quit))
                .unwrap_or_else(PoisonError::into_inner);
            self.asked.store(false, Ordering::Relaxed);
            let Slot::Waiting(task) = std::mem::replace(&mut *slot, Slot::Running) else { return };
            drop(slot);
            // SAFETY: `Generation::run` keeps the closure alive until the slot says `Done`.
            let outcome = panic::catch_unwind(AssertUnwindSafe(|| unsafe { (*task.0)() }));
            *self.lock() = Slot::Done(outcome.err());
            self.changed.notify_all();
            pool::watch(|| self.asked.load(Ordering::Acquire));
        }
    }
}

impl Generation {
    /// Ends the threads and waits for them. Nothing may run on them afterwards. Threads of a quarantined
    /// generation are left to sleep for ever: their end would run thread-local destructors of its library.
    /// Err: what one of these did.
    fn join(&mut self) -> Result<(), Fault> {
        if self.fate.is_quarantined() {
            self.control_thread = None;
            return Ok(());
        }
        let mut threads = self.pool.dismiss();
        *self.control.lock() = Slot::Quit;
        self.control.asked.store(true, Ordering::Release);
        self.control.changed.notify_all();
        threads.extend(self.control_thread.take());
        guard::join(&self.fate, threads)
    }

    /// The library's end: its threads' (thread-local destructors would keep it mapped), then, on one more
    /// thread, watched and guarded, `destructors`. Err, with the message: it must stay as it is.
    pub(crate) fn end(
        &mut self,
        library: &str,
        destructors: impl FnOnce() + Send + 'static,
    ) -> Result<(), String> {
        const CALL: &str = "unload";
        self.called.enters(library);
        let ended = self.join().and_then(|()| {
            let (fate, library) = (self.fate.clone(), library.to_owned());
            let (tell, told) = mpsc::sync_channel(1);
            let work = move || {
                let resident = Resident::new(&fate);
                let outcome = fate.watched(Watch::End, || guard::guarded(&fate, destructors));
                // What the ends of the library's threads took is seen here, too.
                tell_taken(&fate, &library, CALL);
                let failed = outcome.is_err();
                drop(resident);
                // The other end waits for it.
                let _ = tell.send(outcome);
                if failed {
                    // Its end would run destructors of what was at fault.
                    loop {
                        thread::park();
                    }
                }
            };
            let name = "reef-unload".to_owned();
            // Where there is no room for a thread, nothing is run: what the library has to do at its end is
            // left out.
            let Ok(thread) = thread::Builder::new().name(name).stack_size(STACK).spawn(work) else {
                return Ok(());
            };
            told.recv().unwrap_or(Ok(()))?;
            guard::join(&self.fate, vec![thread])
        });
        ended.map_err(|fault| self.condemn(&fault, library, CALL))
    }
}

impl Drop for Generation {
    fn drop(&mut self) {
        if let Err(fault) = self.join() {
            let message = self.condemn(&fault, "linked", "unload");
            tracing::warn!("{message}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_run_on_the_one_control_thread_and_never_on_the_callers() {
        let generation = Generation::new(1).unwrap();
        let first = generation.run(|| thread::current().id());
        assert_ne!(first, thread::current().id());
        thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for i in 0..200 {
                        let (id, value) = generation.run(|| (thread::current().id(), i * 2));
                        assert_eq!((id, value), (first, i * 2));
                    }
                });
            }
        });
        assert!(generation.run(|| generation.run(|| generation.is_control())));
    }

    #[test]
    fn tasks_of_several_generations_run_at_the_same_time() {
        let [first, second] = [1, 1].map(|workers| Generation::new(workers).unwrap());
        let (met, other) = (std::sync::Barrier::new(3), thread::current().id());
        // Each waits for both others: in turn they would wait for ever.
        let mut meet = [(); 2].map(|()| {
            || {
                assert_ne!(thread::current().id(), other);
                met.wait();
            }
        });
        let [one, two] = &mut meet;
        first.run_beside(one, || {
            second.run_beside(two, || {
                met.wait();
            });
        });
    }

    #[test]
    fn whoever_panics_the_other_tasks_end_first() {
        let [first, second] = [1, 1].map(|workers| Generation::new(workers).unwrap());
        let done = AtomicBool::new(false);
        let mut slow = || {
            thread::sleep(std::time::Duration::from_millis(50));
            done.store(true, Ordering::Release);
        };
        let mut fail = || panic::panic_any(7_u32);
        let caught = panic::catch_unwind(AssertUnwindSafe(|| {
            first.run_beside(&mut slow, || second.run_beside(&mut fail, || ()));
        }));
        assert_eq!(caught.unwrap_err().downcast_ref(), Some(&7_u32));
        assert!(done.load(Ordering::Acquire));
        assert_eq!(first.run(|| second.run(|| 3)), 3);
    }

    #[test]
    fn a_panic_of_a_task_reaches_its_caller_and_the_thread_lives_on() {
        let generation = Generation::new(2).unwrap();
        let caught = panic::catch_unwind(AssertUnwindSafe(|| generation.run(|| panic::panic_any(7_u32))));
        assert_eq!(caught.unwrap_err().downcast_ref(), Some(&7_u32));
        assert_eq!(generation.run(|| 3), 3);
    }
}
