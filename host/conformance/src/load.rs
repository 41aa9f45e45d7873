//! Loading and opening: constructors, open(), and what they do to the thread.

use super::{
    entry,
    subject::{Subject, WORKERS},
    table::{
        Check, Of,
        Rule::{Guide, Header},
    },
    verdict::{Not, Outcome},
};

pub(super) const CHECKS: &[Check] = &[
    Check {
        name: "load-open",
        about: "The library loads, and open() returns REEF_OK.",
        rule: Header("Once, before anything else; `host` stays valid until close() returns."),
        needs: entry::SOUND,
        of: Of::Library,
        run: open,
    },
    Check {
        name: "load-twice",
        about: "It can be open twice at once, as during a reload.",
        rule: Guide("makes your instances anew beside the running ones"),
        needs: &["load-open", "file-unique"],
        of: Of::Library,
        run: twice,
    },
    Check {
        name: "load-again",
        about: "After it was closed it can be loaded again.",
        rule: Guide("Keep nothing in statics that a newer build would need"),
        needs: &["load-open", "file-unique"],
        of: Of::Library,
        run: again,
    },
];

fn open(subject: &Subject) -> Outcome {
    subject.open(WORKERS)?;
    Ok(None)
}

fn twice(subject: &Subject) -> Outcome {
    let first = subject.open(1)?;
    let second = subject.open(1).map_err(|not| besides(not, "while it was open"))?;
    drop(second);
    drop(first);
    Ok(None)
}

fn again(subject: &Subject) -> Outcome {
    for turn in 0..3 {
        let library = subject
            .open(1)
            .map_err(|not| if turn == 0 { not } else { besides(not, "after it was closed") })?;
        drop(library);
    }
    Ok(None)
}

/// Says when it was.
fn besides(not: Not, when: &str) -> Not {
    match not {
        Not::Kept(why) => Not::Kept(format!("{when}: {why}")),
        other => other,
    }
}
