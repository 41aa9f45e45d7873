//! Reading text files that people wrote: size, kind and encoding are checked first.

use std::{
    io::{ErrorKind, Read},
    path::Path,
};

use reef_files::bounded;
use toml::de::DeTable;

use super::{
    document::{self, Node},
    error::{Fault, SceneError, Source},
    words::{did_you_mean, nearest},
};

/// Largest scene or species file that is read.
pub const LARGEST_FILE: u64 = 4 << 20;

/// Reads a file's text. `what` is how messages call it: "scene", "species".
pub fn read(path: &Path, what: &str) -> Result<Source, SceneError> {
    let unreadable = |error: std::io::Error| {
        if error.kind() == ErrorKind::NotFound {
            let help = neighbour(path);
            SceneError::file(path, format!("there is no such {what} file"), help.as_deref())
        } else {
            SceneError::file(path, format!("the {what} file cannot be read: {error}"), None)
        }
    };
    let data = std::fs::metadata(path).map_err(unreadable)?;
    if !data.is_file() {
        let kind = if data.is_dir() { "a folder" } else { "no regular file" };
        return Err(SceneError::file(path, format!("this is {kind}, not a {what} file"), None));
    }
    let too_large = |size: String| {
        let problem = format!("the {what} file has {size}; the limit is {} MiB", LARGEST_FILE >> 20);
        SceneError::file(path, problem, None)
    };
    if data.len() > LARGEST_FILE {
        return Err(too_large(format!("{:.1} MiB", data.len() as f64 / f64::from(1 << 20))));
    }
    let mut bytes = Vec::new();
    let file = bounded::open(path).map_err(unreadable)?;
    file.take(LARGEST_FILE + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(too_large("grown while it was read".to_owned()));
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..at].iter().filter(|byte| **byte == b'\n').count() + 1;
        let problem = format!("the {what} file is not UTF-8 text: byte {at}, line {line}");
        SceneError::file(path, problem, Some("save it as UTF-8"))
    })?;
    // Some editors begin a file with a byte order mark; it is no column of the first line.
    let text = bounded::without_mark(text);
    if text.trim().is_empty() {
        let help = "assets/scenes/README.md shows a small complete scene";
        return Err(SceneError::file(path, format!("the {what} file is empty"), Some(help)));
    }
    Ok(Source { name: path.display().to_string().into(), text: text.into() })
}

/// Parses a file's text into a tree with places.
pub fn parse(source: &Source) -> Result<Node, SceneError> {
    let table = DeTable::parse(&source.text).map_err(|error| {
        let span = error.span().unwrap_or(0..0);
        let problem = format!("this is not TOML: {}", error.message());
        SceneError::at(source, Fault { span, path: document::Path::default(), problem, help: None })
    })?;
    Node::from_toml(&table).map_err(|refused| {
        let document::Refused { span, path, problem, help } = refused;
        SceneError::at(source, Fault { span, path, problem, help: Some(help) })
    })
}

/// The most similar name in the folder where a missing file was looked for.
fn neighbour(path: &Path) -> Option<String> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let wanted = path.file_name()?.to_str()?;
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| name.ends_with(".toml"))
        .collect();
    names.sort();
    nearest(wanted, names.iter().map(String::as_str)).map(did_you_mean)
}
