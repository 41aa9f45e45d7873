//! What the program tells while it runs: to standard error, and to the window's panel.

use std::{
    collections::VecDeque,
    fmt::Write as _,
    sync::{Mutex, PoisonError},
};

use crate::plain::Escaping;
use tracing::{
    Level,
    field::{Field, Visit},
};
use tracing_subscriber::{
    Layer,
    field::MakeExt,
    filter::{LevelFilter, Targets},
    fmt::format::{Writer, debug_fn},
    layer::Context,
    layer::SubscriberExt,
    util::SubscriberInitExt,
};

/// How many lines wait for the panel at most; the oldest go first.
const KEPT: usize = 200;

static WAITING: Mutex<VecDeque<Line>> = Mutex::new(VecDeque::new());

/// One thing that was told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// How grave.
    pub level: Level,
    /// In words.
    pub text: String,
}

/// Begins to listen: warnings and errors go to standard error (the variable `REEF_LOG` asks for more or less,
/// in `tracing`'s notation), Reef's own news to the panel. Later calls change nothing.
pub fn init() {
    let asked = std::env::var("REEF_LOG").ok().and_then(|targets| targets.parse::<Targets>().ok());
    let filter = asked.unwrap_or_else(|| {
        Targets::new().with_default(LevelFilter::WARN).with_target("winit", LevelFilter::ERROR)
    });
    // It would tell standard error that standard error cannot be written, and panic.
    let stderr = tracing_subscriber::fmt::layer()
        .log_internal_errors(false)
        .with_writer(std::io::stderr)
        .fmt_fields(
            debug_fn(|out: &mut Writer<'_>, field, value| without_control(out, field, value)).delimited(" "),
        )
        .with_ansi(crate::diagnostic::has_colors())
        .without_time()
        .with_target(false);
    // A second subscriber in one process is a test's own affair.
    let _ = tracing_subscriber::registry().with(stderr.with_filter(filter)).with(ForPanel).try_init();
}

/// Takes what was told since the last call, oldest first.
pub fn take() -> Vec<Line> {
    WAITING.lock().unwrap_or_else(PoisonError::into_inner).drain(..).collect()
}

struct ForPanel;

impl<S: tracing::Subscriber> Layer<S> for ForPanel {
    fn on_event(&self, event: &tracing::Event<'_>, _: Context<'_, S>) {
        let (level, target) = (*event.metadata().level(), event.metadata().target());
        if level > Level::INFO || !is_ours(target) {
            return;
        }
        let mut text = Text::default();
        event.record(&mut text);
        keep(Line { level, text: text.0 });
    }
}

/// Does it come from one of Reef's own crates, `reef` and `reef_*`?
fn is_ours(target: &str) -> bool {
    let name = target.split("::").next().unwrap_or_default();
    name == "reef" || name.starts_with("reef_")
}

fn keep(line: Line) {
    let mut waiting = WAITING.lock().unwrap_or_else(PoisonError::into_inner);
    if waiting.len() == KEPT {
        waiting.pop_front();
    }
    waiting.push_back(line);
}

#[derive(Default)]
struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        if field.name() != "message" {
            self.0.push(' ');
        }
        // Writing to a String does not fail.
        let _ = without_control(&mut self.0, field, value);
    }
}

/// One field of a line; texts of others reach the terminal without control characters.
fn without_control(
    mut out: &mut dyn std::fmt::Write,
    field: &Field,
    value: &dyn std::fmt::Debug,
) -> std::fmt::Result {
    match field.name() {
        "message" => write!(Escaping(out), "{value:?}"),
        name => {
            write!(out, "{name}=")?;
            write!(Escaping(&mut out), "{value:?}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_panel_hears_news_and_faults_but_no_chatter() {
        take();
        let subscriber = tracing_subscriber::registry().with(ForPanel);
        tracing::subscriber::with_default(subscriber, || {
            tracing::error!(target: "reef::test", "broken {}", 7);
            tracing::info!(target: "reef_sea::reload", count = 3, "loaded");
            tracing::warn!(target: "reef::test", name = "\u{9b}", "a \x1b[2J");
            tracing::debug!(target: "reef::test", "chatter");
            tracing::info!(target: "winit", "chatter of others");
            tracing::warn!(target: "winit", "trouble of others");
            tracing::warn!(target: "reefs::test", "trouble of others");
        });
        let told: Vec<_> = take().into_iter().map(|line| (line.level, line.text)).collect();
        for (level, text) in [
            (Level::ERROR, "broken 7"),
            (Level::INFO, "loaded count=3"),
            (Level::WARN, "a \\u001b[2J name=\"\\u{9b}\""),
        ] {
            assert!(told.contains(&(level, text.to_owned())), "{told:?}");
        }
        let other = |(_, text): &(Level, String)| text.contains("chatter") || text.contains("others");
        assert!(!told.iter().any(other), "{told:?}");
    }
}
