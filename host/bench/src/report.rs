//! What a bench found: figures, some of them with a bar.

use std::fmt::Write;

use serde_json::{Value, json};

/// What a figure has to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bar {
    /// The figure or more.
    AtLeast(f64),
    /// The figure or less.
    AtMost(f64),
}

/// One measured figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// What was measured, for people and as the key in JSON.
    pub name: String,
    /// In `unit`.
    pub value: f64,
    /// "M node-steps/s", "×", "%".
    pub unit: &'static str,
    /// None: for information.
    pub bar: Option<Bar>,
}

impl Figure {
    /// Whether the bar is reached. A figure that is no number reaches none.
    pub fn passes(&self) -> bool {
        match self.bar {
            None => true,
            Some(Bar::AtLeast(bar)) => self.value >= bar,
            Some(Bar::AtMost(bar)) => self.value <= bar,
        }
    }

    fn bar_text(&self) -> String {
        match self.bar {
            None => String::new(),
            Some(Bar::AtLeast(bar)) => format!("at least {}", number(bar)),
            Some(Bar::AtMost(bar)) => format!("at most {}", number(bar)),
        }
    }
}

/// All that one bench found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// In the order in which they are printed.
    pub figures: Vec<Figure>,
    /// How it was measured, and what it does not say.
    pub notes: Vec<String>,
}

impl Report {
    /// Adds a figure for information.
    pub fn figure(&mut self, name: impl Into<String>, value: f64, unit: &'static str) {
        self.figures.push(Figure { name: name.into(), value, unit, bar: None });
    }

    /// Adds a figure that has to reach a bar.
    pub fn judged(&mut self, name: impl Into<String>, value: f64, unit: &'static str, bar: Bar) {
        self.figures.push(Figure { name: name.into(), value, unit, bar: Some(bar) });
    }

    /// How much faster two workers are than one, where the machine has two cores.
    pub fn two_workers(&mut self, ratio: f64) {
        const NAME: &str = "two workers over one";
        if std::thread::available_parallelism().map_or(1, usize::from) >= 2 {
            self.judged(NAME, ratio, "×", Bar::AtLeast(1.8));
        } else {
            self.figure(NAME, ratio, "×");
            self.note("This machine has one core: two workers have no bar.");
        }
    }

    /// Adds a remark.
    pub fn note(&mut self, text: impl Into<String>) {
        self.notes.push(text.into());
    }

    /// Figures that miss their bar, in words.
    pub fn missed(&self) -> impl Iterator<Item = String> {
        self.figures.iter().filter(|figure| !figure.passes()).map(|figure| {
            format!("{} is {} {} ({})", figure.name, number(figure.value), figure.unit, figure.bar_text())
        })
    }

    /// For people.
    pub fn table(&self, name: &str, about: &str) -> String {
        let width = self.figures.iter().map(|figure| figure.name.chars().count()).max().unwrap_or(0);
        let unit_width = self.figures.iter().map(|figure| figure.unit.chars().count()).max().unwrap_or(0);
        let mut text = format!("{name}: {about}\n");
        for figure in &self.figures {
            let _ = write!(
                text,
                "  {:<width$}  {:>10} {:<unit_width$}",
                figure.name,
                number(figure.value),
                figure.unit
            );
            if figure.bar.is_some() {
                let verdict = if figure.passes() { "pass" } else { "MISSED" };
                let _ = write!(text, "  {verdict} ({})", figure.bar_text());
            }
            text.truncate(text.trim_end().len());
            text.push('\n');
        }
        for note in &self.notes {
            let _ = writeln!(text, "  {note}");
        }
        text
    }

    /// For programs.
    pub fn json(&self, name: &str) -> Value {
        let figures: Vec<Value> = self
            .figures
            .iter()
            .map(|figure| {
                let (at_least, at_most) = match figure.bar {
                    None => (None, None),
                    Some(Bar::AtLeast(bar)) => (Some(bar), None),
                    Some(Bar::AtMost(bar)) => (None, Some(bar)),
                };
                json!({
                    "name": figure.name,
                    "value": figure.value,
                    "unit": figure.unit,
                    "at_least": at_least,
                    "at_most": at_most,
                    "pass": figure.passes(),
                })
            })
            .collect();
        json!({ "bench": name, "figures": figures, "notes": self.notes })
    }
}

/// Three or four digits that matter.
fn number(value: f64) -> String {
    let size = value.abs();
    if (size == size.trunc() && size < 1e6) || size >= 100.0 {
        format!("{value:.0}")
    } else if size >= 10.0 {
        format!("{value:.1}")
    } else {
        format!("{value:.2}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> Report {
        let mut report = Report::default();
        report.figure("ceiling", 254.31, "M node-steps/s");
        report.judged("share", 45.2, "%", Bar::AtLeast(40.0));
        report.judged("allocations", 3.0, "a step", Bar::AtMost(0.0));
        report.judged("broken", f64::NAN, "x", Bar::AtLeast(1.0));
        report.note("measured at night");
        report
    }

    #[test]
    fn a_missed_bar_is_told_and_a_figure_that_is_no_number_misses_every_bar() {
        let missed: Vec<String> = report().missed().collect();
        assert_eq!(missed.len(), 2, "{missed:?}");
        assert!(missed[0].starts_with("allocations is 3 a step"), "{missed:?}");
        assert!(missed[1].starts_with("broken"), "{missed:?}");
    }

    #[test]
    fn table_and_json_say_the_same() {
        let table = report().table("fibre", "about");
        assert!(table.contains("share") && table.contains("45.2 %"), "{table}");
        assert!(table.contains("MISSED (at most 0)") && table.contains("pass (at least 40)"), "{table}");
        assert!(table.contains("measured at night"));
        let json = report().json("fibre");
        assert_eq!(json["figures"][1]["at_least"], 40.0);
        assert_eq!(json["figures"][1]["pass"], true);
        assert_eq!(json["figures"][2]["pass"], false);
    }
}
