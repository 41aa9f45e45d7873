//! A journal's file while its run goes on. It is a whole journal after each write, with its last line written
//! over by what is new: a run that ends in the middle leaves one that can be replayed.

use std::{
    fs::File,
    io::{self, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use reef_files::{WriteError, Writing};
use reef_plugin::Noted;

use super::journal::{Entry, Header, Journal};

/// A file that holds a journal.
#[derive(Debug)]
pub(crate) struct Kept {
    path: PathBuf,
    place: Place,
    /// What is in the file.
    entries: usize,
    last: Option<Entry>,
    header: Header,
    end: u64,
    /// What the program's last words say of a file that is a whole journal before the run's end.
    _noted: Option<Noted>,
}

#[derive(Debug)]
enum Place {
    /// The file, and where the line of its end begins [bytes].
    File(File, u64),
    /// A device or a pipe gets all at the end.
    Straight(Writing),
}

impl Kept {
    /// Begins a file with this journal.
    pub(crate) fn begin(path: &Path, journal: &Journal) -> Result<Self, WriteError> {
        let place = if path.exists() && !path.is_file() {
            Place::Straight(Writing::create(path)?)
        } else {
            let (file, end) = whole(path, journal)?;
            Place::File(file, end)
        };
        let told = || Noted::new(format!("The journal {} holds all inputs.", path.display()));
        let noted = matches!(place, Place::File(..)).then(told);
        Ok(Self {
            path: path.to_owned(),
            place,
            entries: journal.entries.len(),
            last: journal.entries.last().cloned(),
            header: journal.header.clone(),
            end: journal.end,
            _noted: noted,
        })
    }

    fn holds(&mut self, journal: &Journal) {
        self.entries = journal.entries.len();
        self.last = journal.entries.last().cloned();
        self.header.clone_from(&journal.header);
        self.end = journal.end;
    }

    /// Whether inputs came that are not in the file.
    pub(crate) fn lacks_inputs(&self, journal: &Journal) -> bool {
        self.entries != journal.entries.len()
    }

    /// Brings the file up to date: by what is new, or anew where the past is another.
    pub(crate) fn update(&mut self, journal: &Journal) -> Result<(), WriteError> {
        let Place::File(file, end) = &mut self.place else { return Ok(()) };
        let continues = journal.header == self.header
            && self.end <= journal.end
            && self.entries <= journal.entries.len()
            && self.entries.checked_sub(1).map(|last| &journal.entries[last]) == self.last.as_ref();
        if continues {
            let new = journal.lines_from(self.entries);
            let written = write_over(file, *end, &(new.clone() + &journal.last_line()));
            written.map_err(|error| WriteError { path: self.path.clone(), problem: error.to_string() })?;
            *end += new.len() as u64;
        } else {
            (*file, *end) = whole(&self.path, journal)?;
        }
        self.holds(journal);
        Ok(())
    }

    /// Writes the journal to the end of its run, whole.
    pub(crate) fn finish(self, journal: &Journal) -> Result<(), WriteError> {
        match self.place {
            Place::File(..) => journal.write(&self.path),
            Place::Straight(mut writing) => {
                let written = writing.write_all(journal.text().as_bytes());
                written.map_err(|error| writing.error(&error))?;
                writing.finish()
            }
        }
    }
}

/// Writes a whole journal in the place of what was there. Returns the file and where its last line begins.
fn whole(path: &Path, journal: &Journal) -> Result<(File, u64), WriteError> {
    journal.write(path)?;
    let opened = File::options().write(true).open(path).and_then(|file| Ok((file.metadata()?.len(), file)));
    match opened {
        Ok((length, file)) => Ok((file, length.saturating_sub(journal.last_line().len() as u64))),
        Err(error) => Err(WriteError { path: path.to_owned(), problem: error.to_string() }),
    }
}

/// One call, so that no end of the program leaves half of it. The line of a later end is never shorter.
fn write_over(file: &mut File, at: u64, text: &str) -> io::Result<()> {
    file.seek(SeekFrom::Start(at))?;
    file.write_all(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::journal::{Input, ParamInput};

    fn param(step: u64, value: f64) -> Entry {
        let param = ParamInput { module: "a".into(), key: "k".into(), id: 3, value };
        Entry { step, input: Input::Param(param) }
    }

    #[test]
    fn the_file_is_the_whole_journal_after_every_update() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.journal");
        let mut journal = Journal::new("Sea", 7, 0.01, 0);
        let mut kept = Kept::begin(&path, &journal).unwrap();
        for step in 1..200 {
            journal.end = step;
            if step % 7 == 0 {
                journal.entries.extend([param(step, 0.5), param(step, 1.0 / step as f64)]);
            }
            kept.update(&journal).unwrap();
            assert_eq!(Journal::read(&path).unwrap(), journal, "step {step}");
        }
        // Jumps back: to after the last input, to before some, and to before all.
        for end in [1000, 198, 100, 5] {
            journal.entries.retain(|entry| entry.step <= end);
            journal.end = end;
            kept.update(&journal).unwrap();
            assert_eq!(Journal::read(&path).unwrap(), journal, "back at {end}");
        }
        journal.entries.extend((6..20).map(|step| param(step, 2.0)));
        journal.end = 20;
        kept.update(&journal).unwrap();
        // Another future of the same length.
        journal.entries.truncate(10);
        journal.end = journal.entries[9].step;
        kept.update(&journal).unwrap();
        assert_eq!(Journal::read(&path).unwrap(), journal);
        journal.entries.push(param(journal.end + 1, 3.0));
        journal.end += 1;
        kept.update(&journal).unwrap();
        assert_eq!(Journal::read(&path).unwrap(), journal);
        // A state was loaded.
        journal = Journal::new("Sea", 7, 0.01, 90);
        kept.update(&journal).unwrap();
        assert_eq!(Journal::read(&path).unwrap(), journal);
        // The scene was edited: the same steps without inputs, of another length.
        for dt in [0.02, 0.03] {
            journal = Journal::new("Sea", 7, dt, 0);
            journal.end = 60;
            kept.update(&journal).unwrap();
            assert_eq!(Journal::read(&path).unwrap(), journal, "{dt}");
        }
        // Somebody took the file away: the end brings it back.
        std::fs::remove_file(&path).unwrap();
        kept.finish(&journal).unwrap();
        assert_eq!(Journal::read(&path).unwrap(), journal);
    }
}
