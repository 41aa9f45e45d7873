//! A generation's workers: `parallel_for` in about two microseconds. Idle workers watch for new work for a
//! short while, then sleep; the caller works along, so a worker that wakes late costs nothing.

use std::{
    ffi::c_void,
    io,
    sync::{
        Arc, Condvar, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicPtr, AtomicU32, AtomicU64, Ordering},
    },
    thread::{self, JoinHandle, Thread},
    time::{Duration, Instant},
};

use reef_abi as abi;

use super::{
    guard::{self, Fate, Fault, Resident},
    marker,
};

/// Stack of every thread that runs a plugin's code [bytes].
pub(crate) const STACK: usize = 16 << 20;

/// How long an idle thread watches before it sleeps: longer than the gaps between the loops of one step.
const WATCH: Duration = Duration::from_micros(40);

/// One job of the contract.
type JobFn = unsafe extern "C" fn(user: *mut c_void, index: u32, worker: u32);

/// The threads besides the control thread.
#[derive(Debug)]
pub(crate) struct Pool {
    shared: Arc<Shared>,
    workers: u32,
    threads: Mutex<Vec<JoinHandle<()>>>,
}

#[derive(Debug)]
struct Shared {
    fate: Arc<Fate>,
    /// Which jobs nobody has taken. A successful exchange that takes one is the right to run that job of just
    /// that loop, which cannot end before that job did.
    claim: AtomicU64,
    /// Jobs of the present loop that are not done.
    pending: AtomicU32,
    /// The present loop: what the jobs' numbers begin with. Written before `claim`, read after a successful
    /// exchange on it.
    first: AtomicU32,
    job: AtomicPtr<c_void>,
    user: AtomicPtr<c_void>,
    /// A job of the present loop ended in a fault: the others are skipped.
    failed: AtomicBool,
    /// The fault of the lowest index.
    fault: Mutex<Option<(u32, Fault)>>,
    /// The caller sleeps until `pending` is 0.
    caller: Mutex<Option<Thread>>,
    caller_sleeps: AtomicBool,
    sleepers: AtomicU32,
    sleep: Mutex<()>,
    wake: Condvar,
    quit: AtomicBool,
}

/// The jobs of a loop that nobody has taken, in one word: the loop's number, and a range of jobs.
#[derive(Clone, Copy)]
struct Claim {
    number: u32,
    begin: u16,
    end: u16,
}

impl Claim {
    fn of(word: u64) -> Self {
        Self { number: (word >> 32) as u32, begin: (word >> 16) as u16, end: word as u16 }
    }

    fn word(self) -> u64 {
        u64::from(self.number) << 32 | u64::from(self.begin) << 16 | u64::from(self.end)
    }

    fn is_empty(self) -> bool {
        self.begin >= self.end
    }

    /// Takes a job: every second worker from the end. So two workers get about the same jobs in each step,
    /// and each finds what it wrote in the step before in its own caches.
    fn take(&mut self, worker: u32) -> Option<u16> {
        if self.is_empty() {
            return None;
        }
        if worker.is_multiple_of(2) {
            self.begin += 1;
            return Some(self.begin - 1);
        }
        self.end -= 1;
        Some(self.end)
    }
}

/// Most jobs in one claim.
const MOST_JOBS: u32 = u16::MAX as u32;

impl Pool {
    /// Starts `workers - 1` threads: the caller of [`Pool::run`] is worker 0.
    pub(crate) fn new(fate: &Arc<Fate>, workers: u32) -> io::Result<Self> {
        let generation = fate.generation();
        let shared = Arc::new(Shared {
            fate: fate.clone(),
            claim: AtomicU64::new(0),
            pending: AtomicU32::new(0),
            first: AtomicU32::new(0),
            job: AtomicPtr::default(),
            user: AtomicPtr::default(),
            failed: AtomicBool::new(false),
            fault: Mutex::new(None),
            caller: Mutex::new(None),
            caller_sleeps: AtomicBool::new(false),
            sleepers: AtomicU32::new(0),
            sleep: Mutex::new(()),
            wake: Condvar::new(),
            quit: AtomicBool::new(false),
        });
        let pool = Self { shared, workers: workers.max(1), threads: Mutex::default() };
        for worker in 1..workers {
            let shared = pool.shared.clone();
            // On failure, `pool` is dropped and joins those that run already.
            let thread = thread::Builder::new()
                .name(format!("reef-{generation}-{worker}"))
                .stack_size(STACK)
                .spawn(move || {
                    let _resident = Resident::new(&shared.fate);
                    shared.work(worker);
                })?;
            pool.threads.lock().unwrap_or_else(PoisonError::into_inner).push(thread);
        }
        Ok(pool)
    }

    /// Workers, the caller included.
    pub(crate) fn workers(&self) -> u32 {
        self.workers
    }

    /// Calls `job(user, i, worker)` for each `i` below `count`; returns when all are done. A job that ends in
    /// a fault lets those that began end, skips the others, and comes back.
    ///
    /// # Safety
    /// `job` may be called with `user` from several threads at once. Only one thread (the generation's
    /// control thread) calls this, and no job does: nested loops run inline, see `services`.
    pub(crate) unsafe fn run(&self, count: u32, job: JobFn, user: *mut c_void) -> Option<Fault> {
        let shared = &*self.shared;
        if count <= 1 || self.workers == 1 {
            for index in 0..count {
                // SAFETY: the caller's promise.
                unsafe { shared.call(job, user, index, 0) };
            }
            return shared.take_fault();
        }
        // More than a claim holds go one part after the other.
        for first in (0..count).step_by(MOST_JOBS as usize) {
            // SAFETY: the caller's promise.
            unsafe { shared.run_part(first, (count - first).min(MOST_JOBS), job, user) };
            if shared.failed.load(Ordering::Relaxed) {
                break;
            }
        }
        shared.take_fault()
    }
}

/// Work of the host's own on its way to the workers.
struct HostWork<'a> {
    generation: u64,
    job: &'a (dyn Fn(usize) + Sync),
}

/// # Safety
/// `user` leads to a `HostWork` that lives until the loop ends.
unsafe extern "C" fn host_job(user: *mut c_void, index: u32, _: u32) {
    // SAFETY: the caller's promise.
    let work = unsafe { &*user.cast_const().cast::<HostWork<'_>>() };
    marker::in_service(work.generation, || (work.job)(index as usize));
}

impl Pool {
    /// Shares work of the host's own: calls `job` for each number below `count`, in any order, and returns
    /// when all are done. For the control thread, between a plugin's calls. What goes wrong in a job is the
    /// host's fault.
    pub(crate) fn share(&self, count: usize, job: &(dyn Fn(usize) + Sync)) {
        let work = HostWork { generation: self.shared.fate.generation(), job };
        if self.workers > 1
            && let Ok(count) = u32::try_from(count)
        {
            // SAFETY: `host_job` is made for that work, which outlives the loop; the control thread calls
            // this, in no job.
            let fault = unsafe { self.run(count, host_job, (&raw const work).cast_mut().cast()) };
            if fault.is_none() {
                return;
            }
        }
        (0..count).for_each(job);
    }
}

impl Pool {
    /// Lets the threads end, and hands them over. No loop may be started afterwards. Threads of a quarantined
    /// generation are left to sleep for ever: their end would run thread-local destructors of its library.
    pub(crate) fn dismiss(&self) -> Vec<JoinHandle<()>> {
        if self.shared.fate.is_quarantined() {
            return Vec::new();
        }
        self.shared.quit.store(true, Ordering::SeqCst);
        {
            let _guard = self.shared.sleep.lock().unwrap_or_else(PoisonError::into_inner);
            self.shared.wake.notify_all();
        }
        self.threads.lock().unwrap_or_else(PoisonError::into_inner).drain(..).collect()
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        // A pool of its own, or one that could not start all of its threads: no plugin's code ran on them.
        let _ = guard::join(&self.shared.fate, self.dismiss());
    }
}

impl Shared {
    /// Runs `count` jobs from `first` on, [`MOST_JOBS`] at most, with the workers' help.
    ///
    /// # Safety
    /// That of [`Pool::run`].
    unsafe fn run_part(&self, first: u32, count: u32, job: JobFn, user: *mut c_void) {
        self.first.store(first, Ordering::Relaxed);
        self.job.store(job as *mut c_void, Ordering::Relaxed);
        self.user.store(user, Ordering::Relaxed);
        self.pending.store(count, Ordering::Relaxed);
        let last = Claim::of(self.claim.load(Ordering::Relaxed));
        let claim = Claim { number: last.number.wrapping_add(1), begin: 0, end: count as u16 };
        // Sequentially consistent with the sleepers' count: either they see the work, or we see them.
        self.claim.store(claim.word(), Ordering::SeqCst);
        if self.sleepers.load(Ordering::SeqCst) > 0 {
            let _guard = self.sleep.lock().unwrap_or_else(PoisonError::into_inner);
            self.wake.notify_all();
        }
        while self.take_one(0) {}
        self.wait_for_the_rest();
    }

    /// # Safety
    /// `job` and `user` are those of a loop that cannot end before this call did.
    unsafe fn call(&self, job: JobFn, user: *mut c_void, index: u32, worker: u32) {
        if self.failed.load(Ordering::Relaxed) {
            return;
        }
        let done = marker::in_job(worker, || {
            // SAFETY: the caller's promise.
            guard::guarded(&self.fate, || unsafe { job(user, index, worker) })
        });
        if let Err(fault) = done {
            self.fail(index, fault);
        }
    }

    #[cold]
    fn fail(&self, index: u32, fault: Fault) {
        let mut lowest = self.fault.lock().unwrap_or_else(PoisonError::into_inner);
        if lowest.as_ref().is_none_or(|(first, _)| index < *first) {
            *lowest = Some((index, Fault { job: Some(index), ..fault }));
        }
        self.failed.store(true, Ordering::Relaxed);
    }

    /// The fault of the loop that has just ended.
    fn take_fault(&self) -> Option<Fault> {
        // Only jobs set it, and the loop's end has ordered them before us.
        if !self.failed.load(Ordering::Relaxed) {
            return None;
        }
        self.failed.store(false, Ordering::Relaxed);
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).take().map(|(_, fault)| fault)
    }

    /// Runs one job, if one is left.
    fn take_one(&self, worker: u32) -> bool {
        let mut word = self.claim.load(Ordering::Acquire);
        loop {
            let mut claim = Claim::of(word);
            let Some(taken) = claim.take(worker) else { return false };
            match self.claim.compare_exchange_weak(word, claim.word(), Ordering::AcqRel, Ordering::Acquire) {
                Ok(_) => {
                    let index = self.first.load(Ordering::Relaxed) + u32::from(taken);
                    let job = self.job.load(Ordering::Relaxed);
                    let user = self.user.load(Ordering::Relaxed);
                    // SAFETY: `run_part` stored a JobFn there before it published the claim that we took; the
                    // loop does not end before `pending` falls to 0, which needs us.
                    unsafe {
                        let job = std::mem::transmute::<*mut c_void, JobFn>(job);
                        self.call(job, user, index, worker);
                    }
                    if self.pending.fetch_sub(1, Ordering::SeqCst) == 1
                        && self.caller_sleeps.load(Ordering::SeqCst)
                        && let Some(caller) = &*self.caller.lock().unwrap_or_else(PoisonError::into_inner)
                    {
                        caller.unpark();
                    }
                    return true;
                }
                Err(now) => word = now,
            }
        }
    }

    /// Returns when `pending` is 0.
    fn wait_for_the_rest(&self) {
        let done = || self.pending.load(Ordering::SeqCst) == 0;
        if watch(done) {
            return;
        }
        *self.caller.lock().unwrap_or_else(PoisonError::into_inner) = Some(thread::current());
        self.caller_sleeps.store(true, Ordering::SeqCst);
        while !done() {
            thread::park();
        }
        self.caller_sleeps.store(false, Ordering::SeqCst);
    }

    /// A worker's life.
    fn work(&self, worker: u32) {
        let something =
            || !Claim::of(self.claim.load(Ordering::SeqCst)).is_empty() || self.quit.load(Ordering::SeqCst);
        loop {
            let mut ran = false;
            while self.take_one(worker) {
                ran = true;
            }
            // At once: by the time that nothing more comes, the last call may be over.
            if ran {
                guard::put_back_jobs(&self.fate);
            }
            if self.quit.load(Ordering::SeqCst) {
                return;
            }
            if watch(something) {
                continue;
            }
            let mut guard = self.sleep.lock().unwrap_or_else(PoisonError::into_inner);
            self.sleepers.fetch_add(1, Ordering::SeqCst);
            while !something() {
                guard = self.wake.wait(guard).unwrap_or_else(PoisonError::into_inner);
            }
            self.sleepers.fetch_sub(1, Ordering::SeqCst);
        }
    }
}

/// Looks again and again for a short while; true as soon as the condition holds.
pub(super) fn watch(condition: impl Fn() -> bool) -> bool {
    let start = Instant::now();
    loop {
        for _ in 0..32 {
            if condition() {
                return true;
            }
            std::hint::spin_loop();
        }
        if start.elapsed() > WATCH {
            return false;
        }
        // Whoever has work goes first.
        thread::yield_now();
    }
}

/// A job pointer of the contract that is not NULL.
pub(crate) fn job_of(job: abi::Job) -> Option<JobFn> {
    job
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Hits {
        hits: Vec<AtomicU32>,
        workers: u32,
    }

    unsafe extern "C" fn hit(user: *mut c_void, index: u32, worker: u32) {
        // SAFETY: the test passes its `Hits`, which outlives the loop.
        let hits = unsafe { &*user.cast_const().cast::<Hits>() };
        assert!(worker < hits.workers);
        hits.hits[index as usize].fetch_add(1, Ordering::Relaxed);
    }

    #[test]
    fn every_index_runs_exactly_once_in_each_of_many_loops() {
        for workers in [1, 2, 4] {
            let pool = Pool::new(&Fate::new(0), workers).unwrap();
            for round in 0..4000_u32 {
                let count = round % 67;
                let hits = Hits { hits: (0..count).map(|_| AtomicU32::new(0)).collect(), workers };
                // SAFETY: `hit` is made for `Hits`; only this thread runs loops.
                let fault = unsafe { pool.run(count, hit, (&raw const hits).cast_mut().cast()) };
                assert_eq!(fault, None);
                assert!(hits.hits.iter().all(|h| h.load(Ordering::Relaxed) == 1), "round {round}");
                if round % 1000 == 0 {
                    thread::sleep(Duration::from_millis(2)); // Let the workers fall asleep.
                }
            }
        }
    }

    #[test]
    fn more_jobs_than_a_claim_holds_run_once_each() {
        let pool = Pool::new(&Fate::new(0), 2).unwrap();
        let count = 2 * MOST_JOBS + 3;
        let hits = Hits { hits: (0..count).map(|_| AtomicU32::new(0)).collect(), workers: 2 };
        // SAFETY: `hit` is made for `Hits`; only this thread runs loops.
        let fault = unsafe { pool.run(count, hit, (&raw const hits).cast_mut().cast()) };
        assert_eq!(fault, None);
        assert!(hits.hits.iter().all(|h| h.load(Ordering::Relaxed) == 1));
    }

    #[test]
    fn two_workers_take_jobs_from_both_ends() {
        let mut claim = Claim { number: 7, begin: 0, end: 3 };
        assert_eq!([claim.take(0), claim.take(1), claim.take(1)], [Some(0), Some(2), Some(1)]);
        assert_eq!((claim.take(0), claim.take(1)), (None, None));
        assert!(claim.is_empty() && Claim::of(claim.word()).number == 7);
    }

    #[test]
    fn a_caller_that_runs_out_of_work_sleeps_until_the_last_job_is_done() {
        unsafe extern "C" fn slow(user: *mut c_void, _: u32, worker: u32) {
            // SAFETY: the test passes an AtomicU32 that outlives the loop.
            let done = unsafe { &*user.cast_const().cast::<AtomicU32>() };
            thread::sleep(Duration::from_millis(if worker == 0 { 1 } else { 20 }));
            done.fetch_add(1, Ordering::Relaxed);
        }
        let pool = Pool::new(&Fate::new(0), 3).unwrap();
        for _ in 0..5 {
            let done = AtomicU32::new(0);
            // SAFETY: `slow` is made for an AtomicU32; only this thread runs loops.
            let fault = unsafe { pool.run(8, slow, (&raw const done).cast_mut().cast()) };
            assert_eq!(fault, None);
            assert_eq!(done.load(Ordering::Relaxed), 8);
        }
    }
}
