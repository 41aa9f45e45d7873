//! How an error is told to a person: what, where with the lines around it, and the way out.

use std::{
    fmt,
    io::{IsTerminal, Write as _},
};

use miette::{Diagnostic, LabeledSpan, SourceCode};

use crate::plain::Plain;

/// Prints an error to standard error. Nobody may be listening: the exit code still says it.
pub fn tell(report: &miette::Report) {
    let told = Told { diagnostic: report.as_ref(), colors: has_colors() };
    let _ = write!(std::io::stderr().lock(), "{told}");
}

/// Whether standard error shows colours: a terminal does, unless its owner wants none.
pub fn has_colors() -> bool {
    std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// An error and those that belong to it, as text.
struct Told<'a> {
    diagnostic: &'a dyn Diagnostic,
    /// With a terminal's escape sequences.
    colors: bool,
}

impl fmt::Display for Told<'_> {
    /// One line a sentence, however long: `file:line:column` must stay whole for editors and scripts.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (red, cyan, plain) = if self.colors { ("\x1b[31m", "\x1b[36m", "\x1b[0m") } else { ("", "", "") };
        let mut said = self.diagnostic.to_string();
        writeln!(f, "{red}error:{plain} {}", Plain(&said))?;
        let mut cause = self.diagnostic.source();
        while let Some(error) = cause {
            let text = error.to_string();
            // Most messages already hold what caused them.
            if !said.contains(&text) {
                writeln!(f, "  because: {}", Plain(&text))?;
            }
            said = text;
            cause = error.source();
        }
        if let (Some(source), Some(labels)) = (self.diagnostic.source_code(), self.diagnostic.labels()) {
            for label in labels {
                write_place(f, source, &label, [red, cyan, plain])?;
            }
        }
        if let Some(help) = self.diagnostic.help() {
            writeln!(f, "  {cyan}help:{plain} {}", Plain(help))?;
        }
        for diagnostic in self.diagnostic.related().into_iter().flatten() {
            write!(f, "\n{}", Told { diagnostic, colors: self.colors })?;
        }
        Ok(())
    }
}

/// Characters of a line that are shown at most.
const WIDEST: usize = 200;

/// The line in which a fault begins between its neighbours, with carets under the fault.
fn write_place(
    f: &mut fmt::Formatter<'_>,
    source: &dyn SourceCode,
    label: &LabeledSpan,
    [red, cyan, plain]: [&str; 3],
) -> fmt::Result {
    // A place that is not in the source is no reason to tell nothing.
    let Ok(around) = source.read_span(label.inner(), 1, 1) else { return Ok(()) };
    let text = String::from_utf8_lossy(around.data());
    let lines: Vec<&str> = text.lines().collect();
    let width = (around.line() + lines.len()).to_string().len();
    let mut start = around.span().offset();
    for (i, line) in lines.iter().enumerate() {
        let shown = |part: &str| Plain(part.replace('\t', " ")).to_string();
        let rest = &text[start - around.span().offset()..];
        let end = start + line.len();
        let next = end + rest[line.len()..].find('\n').map_or(0, |at| at + 1);
        let at = label.offset();
        let here = (start..next.max(end + 1)).contains(&at);
        let before = line.get(..at.saturating_sub(start)).unwrap_or(line);
        let column = if here { shown(before).chars().count() } else { 0 };
        // Of a long line what is around the fault.
        let left_out = column.saturating_sub(WIDEST / 2);
        let part: String = shown(line).chars().skip(left_out).take(WIDEST).collect();
        writeln!(f, "  {cyan}{:>width$} |{plain} {part}", around.line() + i + 1)?;
        if here {
            let marked = line.get(at - start..(at - start + label.len()).min(line.len())).unwrap_or_default();
            let column = column - left_out;
            let most = (WIDEST - column).max(1);
            let carets = "^".repeat(shown(marked).chars().count().clamp(1, most));
            writeln!(f, "  {:>width$} {cyan}|{plain} {:column$}{red}{carets}{plain}", "", "")?;
        }
        start = next;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use miette::NamedSource;

    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("file.toml: outer")]
    struct Fault {
        source: Option<std::io::Error>,
        text: NamedSource<Arc<str>>,
        place: std::ops::Range<usize>,
        related: Vec<Fault>,
    }

    impl Diagnostic for Fault {
        fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
            Some(Box::new("the way out"))
        }

        fn source_code(&self) -> Option<&dyn SourceCode> {
            Some(&self.text)
        }

        fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
            Some(Box::new(std::iter::once(LabeledSpan::new(None, self.place.start, self.place.len()))))
        }

        fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
            Some(Box::new(self.related.iter().map(|fault| fault as &dyn Diagnostic)))
        }
    }

    fn fault(text: &str, place: std::ops::Range<usize>) -> Fault {
        Fault { source: None, text: NamedSource::new("file.toml", text.into()), place, related: Vec::new() }
    }

    fn told(fault: &Fault) -> String {
        Told { diagnostic: fault, colors: false }.to_string()
    }

    #[test]
    fn a_fault_is_told_with_its_line_its_neighbours_and_the_way_out() {
        let text = "[a]\nä = 'öö'\nb = 2\nc = 3\n";
        let start = text.find("'öö'").unwrap();
        assert_eq!(
            told(&fault(text, start..start + "'öö'".len())),
            "error: file.toml: outer\n  1 | [a]\n  2 | ä = 'öö'\n    |     ^^^^\n  3 | b = 2\n  help: the way out\n"
        );
    }

    #[test]
    fn any_place_is_survived() {
        for text in ["", "a", "\n", "a\r\n\tb\r\n", "ä\nö", "ä"] {
            for start in 0..text.len() + 3 {
                for end in start..text.len() + 4 {
                    let said = told(&fault(text, start..end));
                    assert!(said.starts_with("error: file.toml: outer\n"), "{said}");
                    assert!(said.ends_with("help: the way out\n"), "{said}");
                }
            }
        }
        assert_eq!(told(&fault("a\r\n\tb\r\n", 4..5)).lines().nth(3), Some("    |  ^"));
    }

    #[test]
    fn of_a_long_line_only_what_is_around_the_fault_is_shown() {
        let text = format!("a = [{}!, 3]\nb = 4\n", "1, ".repeat(50_000));
        let start = text.find('!').unwrap();
        let said = told(&fault(&text, start..start + 1));
        let lines: Vec<&str> = said.lines().collect();
        assert!(lines.iter().all(|line| line.len() < WIDEST + 10), "{said}");
        assert_eq!(lines[1].find('!'), lines[2].find('^'), "{said}");
        let wide = told(&fault(&text, 4..start));
        assert!(wide.lines().all(|line| line.len() < WIDEST + 10) && wide.contains("^^^"), "{wide}");
    }

    #[test]
    fn causes_and_faults_that_belong_together_are_all_told() {
        let mut both = fault("x\n", 0..1);
        both.source = Some(std::io::Error::other("inner"));
        both.related.push(fault("y\n", 0..1));
        let said = told(&both);
        assert!(said.contains("  because: inner\n"), "{said}");
        assert!(said.contains("\n\nerror: file.toml: outer\n  1 | y\n    | ^\n"), "{said}");
        let odd = told(&fault("\x1b[2J = \x1b\n", 7..8));
        assert!(odd.contains("\n  1 | \\u001b[2J = \\u001b\n    |             ^^^^^^\n"), "{odd}");
        let shown = Told { diagnostic: &both, colors: true }.to_string();
        assert!(shown.contains("\x1b[31m^\x1b[0m"), "{shown:?}");
    }
}
