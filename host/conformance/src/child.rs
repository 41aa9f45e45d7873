//! The check's own process: runs one check and leaves its verdict in a file.

use std::{
    io::Write,
    panic::{self, AssertUnwindSafe},
    path::Path,
};

use reef_command::Common;

use super::{
    Args,
    config::Config,
    group, repeat,
    subject::Subject,
    table,
    verdict::{Not, Outcome, Verdict},
};

/// Not a check: tells the ids of the library's plugins.
pub(super) const PLUGINS: &str = "plugins";

/// Runs the check, writes the verdict, and ends the process.
pub(super) fn run(common: &Common, args: &Args, path: &Path, config: Config, verdict: &Path) -> ! {
    group::bound();
    let found = judge(common, args, path, config);
    // Whole or not at all: what a plugin's code wrote there cannot be taken for half a verdict.
    let folder = verdict.parent().unwrap_or(Path::new("."));
    let written = tempfile::NamedTempFile::new_in(folder).and_then(|mut file| {
        file.write_all(&serde_json::to_vec(&found)?)?;
        file.persist(verdict)?;
        Ok(())
    });
    if let Err(error) = written {
        eprintln!("the verdict cannot be written: {error}");
    }
    group::leave()
}

fn judge(common: &Common, args: &Args, path: &Path, config: Config) -> Verdict {
    let run: fn(&Subject) -> Outcome = match args.only.first().map(String::as_str) {
        Some(PLUGINS) => plugins,
        Some(repeat::DIGEST) => repeat::digest,
        Some(name) => match table::find(name) {
            Some(check) => check.run,
            None => return Verdict::Failed(format!("there is no check {name:?}")),
        },
        None => return Verdict::Failed("no check was named".into()),
    };
    let subject = match Subject::new(common, args, path, config) {
        Ok(subject) => subject,
        Err(problem) => return Verdict::Failed(problem),
    };
    panic::catch_unwind(AssertUnwindSafe(|| Verdict::from(run(&subject))))
        .unwrap_or_else(|_| Verdict::Failed("the checker itself failed: see standard error".into()))
}

fn plugins(subject: &Subject) -> Outcome {
    let library = subject.open(1)?;
    let surveyed = library.survey().map_err(Not::Kept)?;
    let ids: Vec<&str> = surveyed.iter().flatten().filter_map(|descriptor| descriptor.id.good()).collect();
    Ok(Some(ids.join("\n")))
}
