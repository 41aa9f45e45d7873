//! What is wrong with a scene, where, and what would be right.

use std::{fmt, path::Path as FilePath, sync::Arc};

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};

use super::document::{Path, Span};

/// A text file that was read.
#[derive(Clone, Debug)]
pub struct Source {
    /// As messages call it.
    pub name: Arc<str>,
    /// What it says.
    pub text: Arc<str>,
}

impl Source {
    /// Line and column, from 1, of a byte. Columns count characters.
    pub fn line_column(&self, byte: usize) -> (usize, usize) {
        let mut end = byte.min(self.text.len());
        while !self.text.is_char_boundary(end) {
            end -= 1;
        }
        let before = &self.text[..end];
        let line = before.matches('\n').count() + 1;
        let start = before.rfind('\n').map_or(0, |at| at + 1);
        (line, before[start..].chars().count() + 1)
    }
}

/// One thing that is wrong at one place of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// The place.
    pub span: Span,
    /// The key; empty for the whole file.
    pub path: Path,
    /// What is wrong, and what is allowed.
    pub problem: String,
    /// Nearest spelling, or a way out.
    pub help: Option<String>,
}

/// Why a scene was refused. Its text is `file:line:column: key: problem`; the printed report shows the line,
/// too.
#[derive(Debug)]
pub struct SceneError(Box<Told>);

#[derive(Debug)]
struct Told {
    text: String,
    help: Option<String>,
    /// None: the file could not be read at all.
    place: Option<(NamedSource<Arc<str>>, Span)>,
    related: Vec<SceneError>,
}

impl SceneError {
    /// Something is wrong with the file as a whole.
    pub fn file(path: &FilePath, problem: impl fmt::Display, help: Option<&str>) -> Self {
        let text = format!("{}: {problem}", path.display());
        Self::told(text, help.map(str::to_owned), None)
    }

    /// Something is wrong that has no place in a file (a plugin is missing, say).
    pub fn plain(problem: impl fmt::Display, help: Option<String>) -> Self {
        Self::told(problem.to_string(), help, None)
    }

    fn told(text: String, help: Option<String>, place: Option<(NamedSource<Arc<str>>, Span)>) -> Self {
        Self(Box::new(Told { text, help, place, related: Vec::new() }))
    }

    /// Something is wrong at a place.
    pub fn at(source: &Source, fault: Fault) -> Self {
        let (line, column) = source.line_column(fault.span.start);
        let key = if fault.path.0.is_empty() { String::new() } else { format!(" {}:", fault.path) };
        let length = source.text.len();
        let start = fault.span.start.min(length);
        let span = start..fault.span.end.clamp(start, length);
        let text = format!("{}:{line}:{column}:{key} {}", source.name, fault.problem);
        let shown = NamedSource::new(source.name.as_ref(), source.text.clone()).with_language("TOML");
        Self::told(text, fault.help, Some((shown, span)))
    }

    /// All of a file's faults as one error, the first in front. None where there are none.
    pub fn all(source: &Source, faults: Vec<Fault>) -> Option<Self> {
        let mut errors = faults.into_iter().map(|fault| Self::at(source, fault));
        let mut first = errors.next()?;
        first.0.related = errors.collect();
        Some(first)
    }

    /// The help of the first fault.
    pub fn help_text(&self) -> Option<&str> {
        self.0.help.as_deref()
    }

    /// How many faults it tells.
    pub fn count(&self) -> usize {
        1 + self.0.related.len()
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.text)
    }
}

impl std::error::Error for SceneError {}

impl Diagnostic for SceneError {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.0.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.0.place.as_ref().map(|(source, _)| source as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let (_, span) = self.0.place.as_ref()?;
        let label = LabeledSpan::new(Some("here".to_owned()), span.start, span.len());
        Some(Box::new(std::iter::once(label)))
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
        if self.0.related.is_empty() {
            return None;
        }
        Some(Box::new(self.0.related.iter().map(|error| error as &dyn Diagnostic)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters_and_lines_start_at_one() {
        let source = Source { name: "x".into(), text: "ä = 1\nöö = 2\n".into() };
        assert_eq!(source.line_column(0), (1, 1));
        assert_eq!(source.line_column("ä = ".len()), (1, 5));
        assert_eq!(source.line_column("ä = 1\nöö".len()), (2, 3));
        assert_eq!(source.line_column(10_000), (3, 1));
    }
}
