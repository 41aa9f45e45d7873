//! What the guards know of one generation: its threads, its text, whether a call runs and was asked to stop.

use std::sync::{
    Arc, Mutex, MutexGuard, PoisonError,
    atomic::{AtomicBool, AtomicU8, AtomicU32, AtomicU64, Ordering},
};

use super::{
    Text,
    machine::{self, Stranded, Taken, Thread},
};

/// Which limit a call has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Watch {
    /// A step's.
    Step,
    /// That of everything else.
    Other,
    /// That of what runs when something ends: `destroy`, `close`, destructors.
    End,
}

impl Watch {
    /// Of a call with this name.
    pub(crate) fn of(call: &str) -> Self {
        match call {
            "step" => Self::Step,
            "destroy" | "close" | "unload" => Self::End,
            _ => Self::Other,
        }
    }

    const fn to_byte(self) -> u8 {
        self as u8
    }

    const fn from_byte(byte: u8) -> Self {
        match byte {
            0 => Self::Step,
            1 => Self::Other,
            _ => Self::End,
        }
    }
}

/// How far a runaway's end has come.
pub(super) mod stage {
    /// It is not being stopped.
    pub(crate) const NONE: u32 = 0;
    /// Its text may not be executed any more.
    pub(crate) const DENIED: u32 = 1;
    /// It does not come back to its text: it is left wherever it is.
    pub(crate) const LEAVE: u32 = 2;
}

/// One generation, as the guards see it.
#[derive(Debug)]
pub(crate) struct Fate {
    generation: u64,
    /// Begins and ends of watched calls: odd while one runs.
    pub(super) call: AtomicU64,
    /// The running call's `Watch`.
    watch: AtomicU8,
    /// The value of `call` whose call is asked to stop.
    pub(super) asked: AtomicU64,
    /// `stage::*`.
    pub(super) stage: AtomicU32,
    quarantined: AtomicBool,
    /// Executable memory of the library; None: it is linked into the program, not loaded yet, or closed.
    text: Mutex<Option<Text>>,
    threads: Mutex<Vec<Thread>>,
    /// What one of its threads did at its end, in the place of ending.
    pub(super) stranded: Stranded,
    /// What its code took from the guards, seen on workers, and what was told of that already.
    pub(super) taken: Taken,
    pub(super) told: Taken,
}

impl Fate {
    /// Of a generation that was not at fault yet.
    pub(crate) fn new(generation: u64) -> Arc<Self> {
        let fate = Arc::new(Self {
            generation,
            call: AtomicU64::new(0),
            watch: AtomicU8::new(Watch::Other.to_byte()),
            asked: AtomicU64::new(0),
            stage: AtomicU32::new(stage::NONE),
            quarantined: AtomicBool::new(false),
            text: Mutex::new(None),
            threads: Mutex::default(),
            stranded: Stranded::default(),
            taken: Taken::default(),
            told: Taken::default(),
        });
        machine::watch(&fate);
        fate
    }

    /// Number of the generation.
    #[inline(always)]
    pub(crate) fn generation(&self) -> u64 {
        self.generation
    }

    /// Runs a call on the control thread while the watchdog looks at it.
    pub(crate) fn watched<R>(&self, watch: Watch, call: impl FnOnce() -> R) -> R {
        // Only the control thread writes these: plain stores will do. Should the watchdog see the end of a
        // call late and condemn the next one, it condemns the right generation.
        let number = self.call.load(Ordering::Relaxed);
        self.watch.store(watch.to_byte(), Ordering::Relaxed);
        self.call.store(number + 1, Ordering::Release);
        machine::wake_watchdog();
        let result = call();
        self.call.store(number + 2, Ordering::Release);
        result
    }

    /// Which limit the running call has.
    pub(super) fn watch(&self) -> Watch {
        Watch::from_byte(self.watch.load(Ordering::Relaxed))
    }

    /// Should the running call return soon?
    pub(crate) fn asked_to_stop(&self) -> bool {
        self.asked.load(Ordering::Relaxed) == self.call.load(Ordering::Relaxed)
    }

    /// Its code may never run again.
    pub(crate) fn is_quarantined(&self) -> bool {
        self.quarantined.load(Ordering::Acquire)
    }

    /// Its code must never run again; all of its threads have left it.
    pub(crate) fn quarantine(&self) {
        self.quarantined.store(true, Ordering::Release);
        // The system runs what is left of it when the program ends (destructors of the C runtime): executable
        // again.
        if let Some(text) = self.text().take() {
            text.allow();
        }
        machine::end_without_destructors();
    }

    /// Where the code is that may be taken away from a runaway.
    pub(crate) fn set_text(&self, text: Option<Text>) {
        *self.text() = text;
    }

    pub(super) fn text(&self) -> MutexGuard<'_, Option<Text>> {
        self.text.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn threads(&self) -> MutexGuard<'_, Vec<Thread>> {
        self.threads.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
