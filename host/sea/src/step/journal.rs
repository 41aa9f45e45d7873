//! The input journal: all that came from outside, by the step that took it. One JSON object a line:
//!
//! ```text
//! {"reef_journal":1,"scene":"Reef","seed":20,"dt":0.016666666666666666,"from_step":0}
//! {"step":12,"input":{"param":{"module":"anemones","key":"stiffness","id":3,"value":1.5}}}
//! {"step":40,"input":{"poke":{"point":[0,-4.8,0],"object":0,"motion":[0.3,0,0],"view":[0,0,-1],"speed":0.4,"reach":0.5}}}
//! {"step":41,"input":{"camera":{"position":[0,-4.2,4],"rotation":[0,0,0,1],"fov_y":0.96}}}
//! {"end":600}
//! ```

use std::path::{Path, PathBuf};

use glam::{DVec3, Quat};
use reef_files as files;
use reef_files::{WriteError, bounded};
use reef_streams::frame::CameraPose;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{clock::LATEST, water::Poke};

/// Version of the format.
const FORMAT: u32 = 1;
/// Largest journal that is read [bytes].
const LARGEST: u64 = 256 << 20;

/// Something from outside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Input {
    /// A parameter of a module changes.
    Param(ParamInput),
    /// Somebody touches the water.
    Poke(Poke),
    /// Somebody moved the camera; None: it follows the scene again.
    Camera(Option<CameraInput>),
}

/// A parameter's new value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParamInput {
    /// The module's name in the scene.
    pub module: String,
    /// The parameter's name, for readers.
    #[serde(default)]
    pub key: String,
    /// Its number, which counts.
    pub id: u32,
    /// The value.
    pub value: f64,
}

/// A camera by hand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraInput {
    /// Eye [m].
    pub position: [f64; 3],
    /// Unit quaternion x, y, z, w.
    pub rotation: [f32; 4],
    /// Vertical angle of view [rad].
    pub fov_y: f32,
}

impl From<CameraPose> for CameraInput {
    fn from(pose: CameraPose) -> Self {
        Self { position: pose.position.to_array(), rotation: pose.rotation.to_array(), fov_y: pose.fov_y }
    }
}

impl CameraInput {
    /// The pose; None where the numbers make none.
    pub fn pose(&self) -> Option<CameraPose> {
        let rotation = Quat::from_array(self.rotation);
        let sound = self.position.iter().all(|x| x.is_finite())
            && rotation.is_finite()
            && (rotation.length_squared() - 1.0).abs() < 1e-3
            && self.fov_y > 0.0
            && self.fov_y < std::f32::consts::PI;
        let position = DVec3::from_array(self.position);
        sound.then_some(CameraPose { position, rotation, fov_y: self.fov_y })
    }
}

/// An input and the step that takes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// The first step that feels it.
    pub step: u64,
    /// What came.
    pub input: Input,
}

/// Which run a journal belongs to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Version of the format.
    reef_journal: u32,
    /// Name of the scene.
    pub scene: String,
    /// Its seed.
    pub seed: u64,
    /// Length of a step [s].
    pub dt: f64,
    /// The step at which the run began (above 0 after loading a state).
    pub from_step: u64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct End {
    end: u64,
}

/// What came into one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Journal {
    /// Which run.
    pub header: Header,
    /// In the order of steps, within a step in the order of arrival.
    pub entries: Vec<Entry>,
    /// The last step that the run made.
    pub end: u64,
}

/// Why a journal cannot be read.
#[derive(Debug, Error)]
pub enum JournalError {
    /// The file itself.
    #[error("{}: the journal cannot be read: {problem}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        problem: String,
    },
    /// One line.
    #[error("{}:{line}: {problem}", path.display())]
    Line {
        /// Which file.
        path: PathBuf,
        /// Which line, from 1.
        line: usize,
        /// What is wrong.
        problem: String,
    },
}

impl miette::Diagnostic for JournalError {}

fn line(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default() + "\n"
}

impl Journal {
    /// An empty journal.
    pub fn new(scene: &str, seed: u64, dt: f64, from_step: u64) -> Self {
        let header = Header { reef_journal: FORMAT, scene: scene.to_owned(), seed, dt, from_step };
        Self { header, entries: Vec::new(), end: from_step }
    }

    /// The journal's text.
    pub fn text(&self) -> String {
        line(&self.header) + &self.lines_from(0) + &self.last_line()
    }

    /// The lines of all inputs but so many.
    pub(crate) fn lines_from(&self, first: usize) -> String {
        self.entries.iter().skip(first).map(line).collect()
    }

    /// The line of the end.
    pub(crate) fn last_line(&self) -> String {
        line(&End { end: self.end })
    }

    /// Writes it, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        files::write(path, self.text().as_bytes())
    }

    /// Reads one.
    pub fn read(path: &Path) -> Result<Self, JournalError> {
        let fail = |problem: String| JournalError::File { path: path.to_owned(), problem };
        let text = bounded::read_text(path, LARGEST).map_err(|error| fail(error.to_string()))?;
        Self::parse(path, &text)
    }

    /// Reads a journal's text; `path` is for messages.
    pub fn parse(path: &Path, text: &str) -> Result<Self, JournalError> {
        let fail = |line: usize, problem: String| JournalError::Line { path: path.to_owned(), line, problem };
        let mut lines = text.lines().enumerate();
        let first = lines.next().ok_or_else(|| fail(1, "the journal is empty".to_owned()))?.1;
        let header: Header = serde_json::from_str(first)
            .map_err(|error| fail(1, format!("this is no journal's first line: {error}")))?;
        if header.reef_journal != FORMAT {
            return Err(fail(
                1,
                format!("journal format {}; this program reads {FORMAT}", header.reef_journal),
            ));
        }
        let beyond = |step: u64| format!("step {step} is beyond the last one, {LATEST}");
        if header.from_step > LATEST {
            return Err(fail(1, beyond(header.from_step)));
        }
        let mut journal = Self { end: header.from_step, header, entries: Vec::new() };
        let mut ended = false;
        for (number, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
            let number = number + 1;
            if ended {
                return Err(fail(number, "something follows the journal's end".to_owned()));
            }
            if line.trim_start().starts_with("{\"end\"") {
                let end: End = serde_json::from_str(line).map_err(|error| fail(number, error.to_string()))?;
                if end.end > LATEST {
                    return Err(fail(number, beyond(end.end)));
                }
                journal.end = end.end;
                ended = true;
                continue;
            }
            let entry: Entry = serde_json::from_str(line).map_err(|error| fail(number, error.to_string()))?;
            let before = journal.entries.last().map_or(journal.header.from_step + 1, |before| before.step);
            if entry.step > LATEST {
                return Err(fail(number, beyond(entry.step)));
            }
            if entry.step < before {
                return Err(fail(number, format!("step {} comes after step {before}", entry.step)));
            }
            let sound = match &entry.input {
                Input::Param(param) => param.value.is_finite(),
                Input::Poke(poke) => poke.is_sound(),
                Input::Camera(camera) => camera.is_none_or(|camera| camera.pose().is_some()),
            };
            if !sound {
                return Err(fail(number, "its numbers make no sense".to_owned()));
            }
            journal.entries.push(entry);
        }
        if !ended {
            return Err(fail(text.lines().count(), "the journal has no end: it was cut".to_owned()));
        }
        Ok(journal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn journal() -> Journal {
        let mut journal = Journal::new("A \"sea\"", u64::MAX, 1.0 / 60.0, 0);
        let param = ParamInput { module: "a".into(), key: "k".into(), id: 3, value: 0.1 + 0.2 };
        let poke = Poke {
            point: [0.1, -1.0 / 3.0, 1e-17],
            object: u64::MAX,
            motion: [0.0; 3],
            view: [0.0, 0.0, -1.0],
            speed: 0.4,
            reach: 0.5,
        };
        let camera = CameraInput { position: [1.0, 2.0, 3.0], rotation: [0.0, 0.6, 0.0, 0.8], fov_y: 0.96 };
        journal.entries = vec![
            Entry { step: 3, input: Input::Param(param) },
            Entry { step: 3, input: Input::Poke(poke) },
            Entry { step: 9, input: Input::Camera(Some(camera)) },
            Entry { step: 12, input: Input::Camera(None) },
        ];
        journal.end = 600;
        journal
    }

    #[test]
    fn a_journal_read_is_the_journal_written_to_the_last_bit() {
        let journal = journal();
        assert_eq!(Journal::parse(Path::new("j"), &journal.text()).unwrap(), journal);
    }

    #[test]
    fn a_journal_that_was_cut_or_changed_is_refused_with_its_line() {
        let text = journal().text();
        let lines: Vec<&str> = text.lines().collect();
        let told = |text: &str| Journal::parse(Path::new("j"), text).unwrap_err().to_string();
        assert!(told("").starts_with("j:1: the journal is empty"));
        assert!(
            told(&lines[..3].join("\n")).starts_with("j:3: the journal has no end"),
            "{}",
            told(&lines[..3].join("\n"))
        );
        assert!(told("hello\n").starts_with("j:1: this is no journal's first line"));
        let newer = text.replace("\"reef_journal\":1", "\"reef_journal\":2");
        assert_eq!(told(&newer), "j:1: journal format 2; this program reads 1");
        let back = [lines[0], lines[3], lines[1], lines[5]].join("\n");
        assert_eq!(told(&back), "j:3: step 3 comes after step 9");
        let odd = text.replace("0.96", "9.6");
        assert_eq!(told(&odd), "j:4: its numbers make no sense");
        for (from, line) in [("\"from_step\":0", 1), ("\"step\":9", 4), ("\"end\":600", 6)] {
            let key = from.split(':').next().unwrap_or_default();
            let far = text.replace(from, &format!("{key}:{}", u64::MAX));
            assert_eq!(told(&far), format!("j:{line}: step {} is beyond the last one, {LATEST}", u64::MAX));
        }
        let unknown = text.replace("\"reach\"", "\"raech\"");
        assert!(told(&unknown).starts_with("j:3: unknown field `raech`"), "{}", told(&unknown));
    }
}
