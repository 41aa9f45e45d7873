//! What the panel shows and what it can ask for. Plain data: the panel never reaches into the sea, the window
//! carries its wishes out.

use std::{collections::VecDeque, path::PathBuf};

use reef_render::markers::Markers;
use reef_sea::step::{history::Memory, timeline::Way};

use crate::app::camera::Mode;

/// How many frames the graph of frame times goes back.
pub const HISTORY: usize = 180;
/// How many messages are kept.
const MESSAGES: usize = 100;

/// Everything that the panel shows.
#[derive(Clone, Debug, Default)]
pub struct PanelModel {
    /// What runs, and for how long.
    pub scene: SceneView,
    /// Speed and pause.
    pub clock: ClockView,
    /// Which moments there are, and the way to one.
    pub timeline: TimelineView,
    /// Where the time goes.
    pub timing: Timing,
    /// One entry an instance, in the scene's order.
    pub plugins: Vec<PluginView>,
    /// What is drawn, and how well.
    pub view: ViewOptions,
    /// Who moves the camera.
    pub camera: Option<Mode>,
    /// What happened.
    pub messages: Messages,
}

/// The scene.
#[derive(Clone, Debug, Default)]
pub struct SceneView {
    /// Its name.
    pub name: String,
    /// Its file.
    pub path: PathBuf,
    /// Steps since the start.
    pub step: u64,
    /// Time since the start [s].
    pub time: f64,
    /// Scenes that can be opened: name and file.
    pub choices: Vec<(String, PathBuf)>,
}

/// The moments of the sea.
#[derive(Clone, Copy, Debug, Default)]
pub struct TimelineView {
    /// Length of a step [s].
    pub dt: f64,
    /// Steps that the scene is made for.
    pub duration: u64,
    /// What is remembered.
    pub memory: Memory,
    /// The way to another moment, while it lasts.
    pub way: Option<Way>,
    /// Where the timeline is held.
    pub held: Option<u64>,
}

/// The clock.
#[derive(Clone, Copy, Debug)]
pub struct ClockView {
    /// The sea stands still.
    pub paused: bool,
    /// Sea seconds a second.
    pub speed: f64,
    /// The machine does not keep up: the sea runs slower than asked, at this multiple of real time.
    pub behind: Option<f64>,
}

impl Default for ClockView {
    fn default() -> Self {
        Self { paused: false, speed: 1.0, behind: None }
    }
}

/// Where the time goes.
#[derive(Clone, Debug, Default)]
pub struct Timing {
    frames: VecDeque<f32>,
    /// Passes on the GPU, in the frame's order: name, time [ms].
    pub passes: Vec<(String, f32)>,
    /// One simulation step [ms], smoothed.
    pub step_ms: f32,
    /// Length of a step [ms].
    pub dt_ms: f32,
}

impl Timing {
    /// A frame took this long [ms].
    pub fn push_frame(&mut self, ms: f32) {
        if self.frames.len() == HISTORY {
            self.frames.pop_front();
        }
        self.frames.push_back(ms.clamp(0.0, 10_000.0));
    }

    /// One step of the sea took this long [ms].
    pub fn push_step(&mut self, ms: f32) {
        self.step_ms = if self.step_ms == 0.0 { ms } else { self.step_ms + (ms - self.step_ms) * 0.05 };
    }

    /// Frame times [ms], oldest first.
    pub fn frames(&self) -> impl ExactSizeIterator<Item = f32> + '_ {
        self.frames.iter().copied()
    }

    /// Mean frame time [ms] over about the last half second.
    pub fn mean_ms(&self) -> Option<f32> {
        let (mut sum, mut count) = (0.0, 0);
        for ms in self.frames.iter().rev() {
            sum += ms;
            count += 1;
            if sum >= 500.0 {
                break;
            }
        }
        (count > 0).then(|| sum / count as f32)
    }

    /// How many times faster than real time the sea could run.
    pub fn real_time_multiple(&self) -> Option<f32> {
        (self.step_ms > 0.0 && self.dt_ms > 0.0).then(|| self.dt_ms / self.step_ms)
    }
}

/// An instance of a plugin in the scene.
#[derive(Clone, Debug, Default)]
pub struct PluginView {
    /// Number of the instance in the scene.
    pub instance: usize,
    /// As people call it.
    pub name: String,
    /// Of the plugin.
    pub version: String,
    /// How many times its library was loaded, from 1.
    pub generation: u64,
    /// How long that loading has been running [s].
    pub age: f64,
    /// The last build that was refused, or fault; None: all is well.
    pub trouble: Option<String>,
    /// It failed: its last good picture stands still.
    pub stands: bool,
    /// One sentence.
    pub description: String,
    /// In the plugin's order.
    pub params: Vec<ParamView>,
    /// What it shows of itself: name and value.
    pub figures: Vec<(String, f64)>,
}

/// What a parameter is.
#[derive(Clone, Debug, PartialEq)]
pub enum ParamKind {
    /// A number.
    Float {
        /// On a logarithmic slider.
        log: bool,
    },
    /// A whole number.
    Int,
    /// On or off.
    Switch,
    /// One of these.
    Choice(Vec<String>),
}

/// A parameter, as its plugin describes it, and its value.
#[derive(Clone, Debug)]
pub struct ParamView {
    /// Stable id.
    pub id: u32,
    /// What it is.
    pub kind: ParamKind,
    /// In the panel.
    pub label: String,
    /// Heading; empty: none.
    pub group: String,
    /// "m/s"; empty: none.
    pub unit: String,
    /// One sentence.
    pub help: String,
    /// Smallest value.
    pub minimum: f64,
    /// Greatest value.
    pub maximum: f64,
    /// The plugin's own.
    pub default_value: f64,
    /// Now.
    pub value: f64,
}

/// What is drawn, and how well.
#[derive(Clone, Debug, Default)]
pub struct ViewOptions {
    /// Names of the presets, best last.
    pub qualities: Vec<&'static str>,
    /// Index into `qualities`.
    pub quality: usize,
    /// Coarser shapes far away.
    pub levels_of_detail: bool,
    /// Modules are asked for debug lines.
    pub debug: bool,
    /// Channels of debug lines that have been seen (bit set).
    pub debug_present: u32,
    /// Channels that are drawn.
    pub debug_shown: u32,
    /// What is drawn of what has no body.
    pub markers: Markers,
    /// What the scene asked for when it was last heard; None: another scene has begun.
    pub asked: Option<Markers>,
}

impl ViewOptions {
    /// Draws what a scene asks for, unless it asked for the same before: a person's own choice stays.
    pub fn ask(&mut self, asked: Markers) {
        if self.asked.replace(asked) != Some(asked) {
            self.markers = asked;
        }
    }
}

/// How grave a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// For information.
    Info,
    /// Something is not as it should be.
    Warning,
    /// Something was refused or failed.
    Error,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// How grave.
    pub level: Level,
    /// In plain words.
    pub text: String,
    /// How many times in a row.
    pub count: u32,
}

/// The newest messages, oldest first.
#[derive(Clone, Debug, Default)]
pub struct Messages {
    entries: VecDeque<Message>,
}

impl Messages {
    /// One more; the same words again only count up.
    pub fn push(&mut self, level: Level, text: impl Into<String>) {
        let text = text.into();
        if let Some(last) = self.entries.back_mut()
            && last.level == level
            && last.text == text
        {
            last.count = last.count.saturating_add(1);
            return;
        }
        if self.entries.len() == MESSAGES {
            self.entries.pop_front();
        }
        self.entries.push_back(Message { level, text, count: 1 });
    }

    /// Oldest first.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &Message> {
        self.entries.iter()
    }

    /// Whether there is nothing to tell.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.entries.clear();
    }
}

/// What somebody asked for. What concerns the picture alone ([`ViewOptions`]) the panel changes by itself.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Stand still, or go on.
    Pause(bool),
    /// One step while standing still.
    StepOnce,
    /// Sea seconds a second.
    Speed(f64),
    /// Back to the first step.
    Reset,
    /// Another moment.
    GoTo {
        /// Its step.
        step: u64,
        /// No time passes there yet: the timeline is still held.
        held: bool,
    },
    /// Stay where the way to another moment has led so far.
    Stop,
    /// Another scene.
    OpenScene(PathBuf),
    /// A parameter of an instance.
    SetParam {
        /// Number of the instance in the scene.
        instance: usize,
        /// The parameter's id.
        id: u32,
        /// Its new value.
        value: f64,
    },
    /// Another chance for an instance that stands still.
    Retry(usize),
    /// Who moves the camera.
    Camera(Mode),
    /// Debug lines, or none.
    Debug(bool),
    /// Save a picture.
    Screenshot,
    /// Forget the messages.
    ClearMessages,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_message_again_is_counted_not_repeated() {
        let mut messages = Messages::default();
        messages.push(Level::Info, "a");
        messages.push(Level::Info, "a");
        messages.push(Level::Error, "a");
        messages.push(Level::Info, "a");
        let counts: Vec<_> = messages.iter().map(|m| (m.level, m.count)).collect();
        assert_eq!(counts, [(Level::Info, 2), (Level::Error, 1), (Level::Info, 1)]);
    }

    #[test]
    fn old_messages_and_frames_make_room() {
        let mut messages = Messages::default();
        let mut timing = Timing::default();
        for i in 0..1000 {
            messages.push(Level::Info, format!("{i}"));
            timing.push_frame(i as f32);
        }
        assert_eq!(messages.iter().count(), MESSAGES);
        assert_eq!(messages.iter().next_back().unwrap().text, "999");
        assert_eq!(timing.frames().len(), HISTORY);
        assert_eq!(timing.frames().last(), Some(999.0));
    }

    #[test]
    fn the_mean_covers_half_a_second_whatever_the_frame_rate() {
        let mut timing = Timing::default();
        assert_eq!(timing.mean_ms(), None);
        for _ in 0..100 {
            timing.push_frame(300.0);
        }
        for _ in 0..50 {
            timing.push_frame(10.0);
        }
        assert_eq!(timing.mean_ms(), Some(10.0));
    }
}
