//! A TOML file as a tree that still knows where each value stands in the text.

use std::{fmt, ops::Range};

use serde_json::{Map, Number};
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

/// Bytes in a file's text, from the first up to but not including the last.
pub type Span = Range<usize>;

/// A value and its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Where it stands.
    pub span: Span,
    /// What it is.
    pub value: Value,
}

/// TOML without dates, and with finite numbers only.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// A finite number.
    Float(f64),
    /// Text.
    String(String),
    /// A list.
    Array(Vec<Node>),
    /// A table, its entries in the order of the file.
    Table(Vec<Entry>),
}

/// One key of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The key.
    pub key: String,
    /// Where the key stands.
    pub key_span: Span,
    /// What it says.
    pub node: Node,
}

/// One step from a value to a part of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Segment {
    /// Into a table.
    Key(String),
    /// Into an array.
    Index(usize),
}

/// The way from the top of a file to a value: `flow[2].position`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Path(pub Vec<Segment>);

impl Path {
    /// This path and a key.
    pub fn key(&self, key: &str) -> Self {
        let mut path = self.clone();
        path.0.push(Segment::Key(key.to_owned()));
        path
    }

    /// This path and an index.
    pub fn index(&self, index: usize) -> Self {
        let mut path = self.clone();
        path.0.push(Segment::Index(index));
        path
    }

    /// This path and another after it.
    pub fn join(&self, tail: &Self) -> Self {
        Self(self.0.iter().chain(&tail.0).cloned().collect())
    }

    /// Reads `anemones[3].species`; None where the text is no path.
    pub fn parse(text: &str) -> Option<Self> {
        let mut segments = Vec::new();
        for (number, part) in text.trim().split('.').enumerate() {
            let (key, mut rest) = match part.find('[') {
                Some(at) => part.split_at(at),
                None => (part, ""),
            };
            if key.is_empty() {
                if number > 0 || rest.is_empty() {
                    return None;
                }
            } else if key.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-') {
                segments.push(Segment::Key(key.to_owned()));
            } else {
                return None;
            }
            while !rest.is_empty() {
                let inner = rest.strip_prefix('[')?;
                let end = inner.find(']')?;
                segments.push(Segment::Index(inner[..end].parse().ok()?));
                rest = &inner[end + 1..];
            }
        }
        Some(Self(segments))
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, segment) in self.0.iter().enumerate() {
            match segment {
                Segment::Key(key) if at == 0 => write!(f, "{key}")?,
                Segment::Key(key) => write!(f, ".{key}")?,
                Segment::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

/// A value of a TOML file that Reef does not take, whatever the key.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// Where it stands.
    pub span: Span,
    /// Under which key.
    pub path: Path,
    /// What is wrong with it.
    pub problem: String,
    /// What would be right.
    pub help: String,
}

/// Magnitude above which no number of a scene makes sense; keeps products of a few of them finite.
pub const LARGEST_NUMBER: f64 = 1e15;

impl Node {
    /// The tree of a parsed file. Dates, NaN, infinities and numbers that do not fit are refused.
    pub fn from_toml(table: &Spanned<DeTable<'_>>) -> Result<Self, Refused> {
        let value = table_entries(table.get_ref(), &Path::default())?;
        Ok(Self { span: table.span(), value })
    }

    /// The entries of a table; none of anything else.
    pub fn entries(&self) -> &[Entry] {
        match &self.value {
            Value::Table(entries) => entries,
            _ => &[],
        }
    }

    /// The elements of an array; none of anything else.
    pub fn elements(&self) -> &[Node] {
        match &self.value {
            Value::Array(elements) => elements,
            _ => &[],
        }
    }

    /// The entry of a table with this key.
    pub fn entry(&self, key: &str) -> Option<&Entry> {
        self.entries().iter().find(|entry| entry.key == key)
    }

    /// The value under a key of a table.
    pub fn get(&self, key: &str) -> Option<&Node> {
        self.entry(key).map(|entry| &entry.node)
    }

    /// The text of a string.
    pub fn as_str(&self) -> Option<&str> {
        match &self.value {
            Value::String(text) => Some(text),
            _ => None,
        }
    }

    /// The place of what a path leads to, or of the last thing on the way that exists.
    pub fn locate(&self, path: &Path) -> Span {
        let mut node = self;
        let mut span = self.span.clone();
        for segment in &path.0 {
            let next = match segment {
                Segment::Key(key) => match node.entry(key) {
                    Some(entry) => {
                        // A table's own span is its header or its first dotted key: the key is what people
                        // look for.
                        let whole = matches!(entry.node.value, Value::Table(_));
                        span = if whole { entry.key_span.clone() } else { entry.node.span.clone() };
                        Some(&entry.node)
                    }
                    None => None,
                },
                Segment::Index(index) => node.elements().get(*index).inspect(|element| {
                    span = element.span.clone();
                }),
            };
            match next {
                Some(next) => node = next,
                None => break,
            }
        }
        span
    }

    /// Whether a path leads to something.
    pub fn has(&self, path: &Path) -> bool {
        let mut node = Some(self);
        for segment in &path.0 {
            node = match (node, segment) {
                (Some(node), Segment::Key(key)) => node.get(key),
                (Some(node), Segment::Index(index)) => node.elements().get(*index),
                (None, _) => None,
            };
        }
        node.is_some()
    }

    /// The same value as JSON.
    pub fn to_json(&self) -> serde_json::Value {
        match &self.value {
            Value::Bool(value) => (*value).into(),
            Value::Integer(value) => (*value).into(),
            // Only finite numbers get into a tree.
            Value::Float(value) => Number::from_f64(*value).map_or(serde_json::Value::Null, Into::into),
            Value::String(value) => value.clone().into(),
            Value::Array(elements) => elements.iter().map(Node::to_json).collect(),
            Value::Table(entries) => {
                let pairs = entries.iter().map(|entry| (entry.key.clone(), entry.node.to_json()));
                pairs.collect::<Map<_, _>>().into()
            }
        }
    }

    /// What kind of value it is, for people.
    pub fn kind(&self) -> &'static str {
        match &self.value {
            Value::Bool(_) => "a switch (true or false)",
            Value::Integer(_) => "a whole number",
            Value::Float(_) => "a number",
            Value::String(_) => "text",
            Value::Array(_) => "a list",
            Value::Table(_) => "a table",
        }
    }
}

fn table_entries(table: &DeTable<'_>, path: &Path) -> Result<Value, Refused> {
    let mut entries = Vec::with_capacity(table.len());
    for (key, value) in table {
        let name = key.get_ref().as_ref();
        let node = convert(value, &path.key(name))?;
        entries.push(Entry { key: name.to_owned(), key_span: key.span(), node });
    }
    entries.sort_by_key(|entry| entry.key_span.start);
    Ok(Value::Table(entries))
}

fn convert(value: &Spanned<DeValue<'_>>, path: &Path) -> Result<Node, Refused> {
    let span = value.span();
    let refused = |problem: String, help: &str| Refused {
        span: span.clone(),
        path: path.clone(),
        problem,
        help: help.to_owned(),
    };
    let value = match value.get_ref() {
        DeValue::Boolean(value) => Value::Bool(*value),
        DeValue::Integer(value) => {
            Value::Integer(i64::from_str_radix(value.as_str(), value.radix()).map_err(|_| {
                refused(
                    format!("{value} does not fit into 64 bits"),
                    "whole numbers go from -9223372036854775808 to 9223372036854775807",
                )
            })?)
        }
        DeValue::Float(value) => {
            let number: f64 = value
                .as_str()
                .parse()
                .map_err(|_| refused(format!("{value} is not a number"), "write it like 0.25 or 2.5e-3"))?;
            if !number.is_finite() {
                return Err(refused(
                    format!("{value} is not a finite number"),
                    "NaN and infinities are never allowed",
                ));
            }
            if number.abs() > LARGEST_NUMBER {
                return Err(refused(
                    format!("{value} is beyond every sensible size"),
                    "the limit is 1e15 either way",
                ));
            }
            Value::Float(number)
        }
        DeValue::String(value) => Value::String(value.to_string()),
        DeValue::Datetime(_) => {
            return Err(refused(
                "a date or time of day has no meaning here".to_owned(),
                "write times in seconds from the scene's start",
            ));
        }
        DeValue::Array(elements) => {
            let elements = elements.iter().enumerate().map(|(at, element)| convert(element, &path.index(at)));
            Value::Array(elements.collect::<Result<_, _>>()?)
        }
        DeValue::Table(table) => table_entries(table, path)?,
    };
    Ok(Node { span, value })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(text: &str) -> Result<Node, Refused> {
        Node::from_toml(&DeTable::parse(text).expect("test input parses"))
    }

    #[test]
    fn a_path_written_is_the_path_read() {
        for text in ["a", "a.b", "a[3].b", "a[0][1].c-d", "anemones[12].species"] {
            assert_eq!(Path::parse(text).expect(text).to_string(), text);
        }
        for text in ["", "a..b", "a[", "a[x]", "a b", "a: b"] {
            assert_eq!(Path::parse(text), None, "{text}");
        }
    }

    #[test]
    fn entries_keep_the_order_of_the_file() {
        let node = tree("zebra = 1\n[modules.b]\nx = 1\n[modules.a]\nx = 2\n").unwrap();
        let names: Vec<_> = node.get("modules").unwrap().entries().iter().map(|e| e.key.as_str()).collect();
        assert_eq!(names, ["b", "a"]);
    }

    #[test]
    fn a_path_leads_to_the_text_of_its_value() {
        let text = "[[flow]]\nkind = 'source'\n[[flow]]\nposition = [1, 2.5, 3]\n";
        let node = tree(text).unwrap();
        assert_eq!(&text[node.locate(&Path::parse("flow[1].position[1]").unwrap())], "2.5");
        assert_eq!(&text[node.locate(&Path::parse("flow[0].kind").unwrap())], "'source'");
    }

    #[test]
    fn numbers_that_are_none_are_refused_with_their_key() {
        for (text, path) in
            [("a = nan", "a"), ("b = [1, inf]", "b[1]"), ("c = {d = -inf}", "c.d"), ("e = 1e40", "e")]
        {
            assert_eq!(tree(text).unwrap_err().path.to_string(), path, "{text}");
        }
        assert!(tree("a = 1e300000").is_err() || DeTable::parse("a = 1e300000").is_err());
    }
}
