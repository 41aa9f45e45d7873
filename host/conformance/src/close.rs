//! What is left when a library is closed: nothing.

use std::{thread, time::Duration};

use reef_plugin::{
    bare::process::Held,
    guard::{self, Part},
    pinned,
};

use super::{
    sea::Sea,
    subject::{Subject, WORKERS, run},
    table::{
        Check, Of,
        Rule::{Guide, Header},
    },
    verdict::{Not, Outcome, broken, must},
};

const THREADS: &str = "Plugins never start threads.";

pub(super) const CHECKS: &[Check] = &[
    Check {
        name: "close-returns",
        about: "close() returns.",
        rule: Header("Once, after every instance is destroyed."),
        needs: &["load-open"],
        of: Of::Library,
        run: returns,
    },
    Check {
        name: "close-threads",
        about: "No thread is left.",
        rule: Header(THREADS),
        needs: &["close-returns", "load-again"],
        of: Of::Library,
        run: threads,
    },
    Check {
        name: "close-children",
        about: "No process is left that it started.",
        rule: Guide("Let nothing pin the library: threads of your own"),
        needs: &["close-returns", "load-again"],
        of: Of::Library,
        run: children,
    },
    Check {
        name: "close-thread-locals",
        about: "No key of a thread-local is left whose destructor would be called in unmapped code.",
        rule: Guide(
            "All your code runs on threads that belong to your library and are joined before it is unloaded",
        ),
        needs: &["close-returns", "load-again"],
        of: Of::Library,
        run: thread_locals,
    },
    Check {
        name: "close-files",
        about: "No file is left open.",
        rule: Header("Never crosses: what one side allocated, that side frees."),
        needs: &["close-returns", "load-again"],
        of: Of::Library,
        run: files,
    },
    Check {
        name: "close-signals",
        about: "No handler of a signal is left, or taken away.",
        rule: Guide("the call is left, the message names signal, address and place"),
        needs: &["close-returns", "load-again"],
        of: Of::Library,
        run: signals,
    },
    Check {
        name: "close-guards",
        about: "No call blocks signals of faults, or takes the stack that their handlers run on.",
        rule: Guide("the call is left, the message names signal, address and place"),
        needs: &["close-returns", "load-again"],
        of: Of::Library,
        run: guards,
    },
    Check {
        name: "close-unmaps",
        about: "The library leaves the process.",
        rule: Guide("Let nothing pin the library"),
        needs: &["close-returns", "file-unique", "file-nodelete", "close-threads"],
        of: Of::Library,
        run: unmaps,
    },
];

fn returns(subject: &Subject) -> Outcome {
    subject.open(WORKERS)?.close().map_err(Not::Kept)?;
    Ok(None)
}

/// What the process holds before and after a library's whole life: opened, a plugin of it made and stepped,
/// closed.
pub(super) fn life(subject: &Subject) -> Result<[Held; 2], Not> {
    let whole = || {
        let (_plugin, mut instance) = subject.fresh()?;
        run(&mut instance, &Sea::usual(), 0..10)?;
        Ok::<(), Not>(instance.destroy()?)
    };
    // The host's own threads and handlers are there after the first life. Where the plugin cannot be made or
    // does not step, which is for other checks, its threads sleep for ever: then opening and closing is a
    // life.
    let steps = whole().is_ok();
    subject.open(WORKERS)?;
    // A thread that was joined is there for a moment still.
    thread::sleep(Duration::from_millis(5));
    let before = Held::now();
    if steps {
        whole()?
    } else {
        drop(subject.open(WORKERS)?)
    }
    Ok([before, Held::after(&before)])
}

/// Fails with what there is more of.
fn no_more(what: &str, before: usize, after: usize) -> Outcome {
    match after.saturating_sub(before) {
        0 => Ok(None),
        1 => broken!("one {what} is left after close()"),
        more => broken!("{more} {what}s are left after close()"),
    }
}

fn threads(subject: &Subject) -> Outcome {
    let [before, after] = life(subject)?;
    no_more("thread", before.threads, after.threads)
}

fn children(subject: &Subject) -> Outcome {
    let [before, after] = life(subject)?;
    no_more("process", before.children, after.children)
}

fn thread_locals(subject: &Subject) -> Outcome {
    let [before, after] = life(subject)?;
    must!(after.key == before.key, "the key {} of pthread_key_create was not given back", before.key);
    Ok(None)
}

fn files(subject: &Subject) -> Outcome {
    let [before, after] = life(subject)?;
    no_more("file", before.files, after.files)
}

fn signals(subject: &Subject) -> Outcome {
    // The guards' own handlers come with the first thread that runs a plugin's code.
    drop(reef_plugin::generation::Generation::new(1));
    let start = Held::now().handlers;
    let [_, after] = life(subject)?;
    let changed = (0..start.len()).find(|signal| start[*signal] != after.handlers[*signal]);
    if let Some(signal) = changed {
        broken!("the handler of signal {signal} is not what it was before the library was loaded");
    }
    match guard::ever_taken(Part::Handlers) {
        Some(taken) => broken!("it {taken}"),
        None => Ok(None),
    }
}

fn guards(subject: &Subject) -> Outcome {
    life(subject)?;
    match guard::ever_taken(Part::Thread) {
        Some(taken) => broken!("it {taken}"),
        None => Ok(None),
    }
}

fn unmaps(subject: &Subject) -> Outcome {
    let before = pinned();
    life(subject)?;
    must!(
        pinned() == before,
        "the system's loader keeps the library after it was closed: a thread-local with a destructor, a handle of its own, \
         a unique symbol"
    );
    Ok(None)
}
