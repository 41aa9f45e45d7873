//! Panics stop here: every call from the host runs in [`catch`], which keeps the message and prints nothing.

use std::{
    any::Any,
    cell::{Cell, RefCell},
    panic::{self, AssertUnwindSafe, PanicHookInfo},
    sync::Once,
};

/// Where the hook leaves the message of the call that panicked.
type Record = RefCell<Option<String>>;

thread_local! {
    /// The record of the guarded call that runs on this thread. Without a destructor: one would keep the
    /// library mapped after the host closed it.
    static RECORD: Cell<*const Record> = const { Cell::new(std::ptr::null()) };
}

/// A panic of a job, on its way up the thread that waited for the jobs.
struct Relayed(String);

/// Puts the hook in place that records a guarded call's message. Other panics (of a program into which a
/// model is linked) go to the hook that was there before. std's own hook must not see ours: it would keep the
/// library mapped.
pub(crate) fn install_hook() {
    static INSTALLED: Once = Once::new();
    INSTALLED.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            let record = RECORD.get();
            if record.is_null() {
                return before(info);
            }
            // SAFETY: `catch` on this very thread set the pointer to a value on its stack frame, which is
            // below us, and clears it before that frame ends.
            if let Ok(mut record) = unsafe { &*record }.try_borrow_mut() {
                *record = Some(describe(info));
            }
        }));
    });
}

fn describe(info: &PanicHookInfo<'_>) -> String {
    let message = info.payload_as_str().unwrap_or("a value that is no text");
    match info.location() {
        Some(place) => format!("panic at {}:{}: {message}", place.file(), place.line()),
        None => format!("panic: {message}"),
    }
}

/// Runs `call`; a panic comes back as its message.
pub(crate) fn catch<R>(call: impl FnOnce() -> R) -> Result<R, String> {
    let record = Record::default();
    let before = RECORD.replace(&record);
    let result = panic::catch_unwind(AssertUnwindSafe(call));
    RECORD.set(before);
    result.map_err(|payload| match payload.downcast::<Relayed>() {
        Ok(relayed) => relayed.0,
        Err(payload) => {
            discard(payload);
            record.take().unwrap_or_else(|| "panic without a message".into())
        }
    })
}

/// Drops a panic's payload, whose own destructor may panic.
fn discard(payload: Box<dyn Any + Send>) {
    let record = Record::default();
    let before = RECORD.replace(&record);
    if let Err(second) = panic::catch_unwind(AssertUnwindSafe(move || drop(payload))) {
        std::mem::forget(second);
    }
    RECORD.set(before);
}

/// Goes on unwinding with a message that was caught in a job.
pub(crate) fn relay(message: String) -> ! {
    panic::resume_unwind(Box::new(Relayed(message)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_comes_back_as_its_message_and_place() {
        install_hook();
        let message = catch(|| panic!("the tide is {}", "out")).unwrap_err();
        assert!(message.starts_with("panic at "), "{message}");
        assert!(message.contains("guard.rs:") && message.ends_with(": the tide is out"), "{message}");
        assert_eq!(catch(|| 7), Ok(7));
    }

    #[test]
    fn a_relayed_message_arrives_whole() {
        install_hook();
        assert_eq!(catch(|| relay("job 3: broken".into())), Err::<(), _>("job 3: broken".to_owned()));
    }

    #[test]
    fn a_payload_that_panics_when_dropped_is_survived() {
        struct Bomb;
        impl Drop for Bomb {
            fn drop(&mut self) {
                panic!("again");
            }
        }
        install_hook();
        let message = catch(|| panic::panic_any(Bomb)).unwrap_err();
        assert!(message.contains("a value that is no text"), "{message}");
    }

    #[test]
    fn guards_nest() {
        install_hook();
        let outer = catch(|| {
            assert!(catch(|| panic!("inner")).unwrap_err().ends_with("inner"));
            panic!("outer")
        });
        assert!(outer.unwrap_err().ends_with("outer"));
    }
}
