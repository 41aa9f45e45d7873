//! Reads as much of C as the header uses: `#define NAME value`, `typedef struct NAME { fields } NAME;`.

use std::collections::BTreeMap;

use crate::Place;

/// What the header declares.
pub struct Header {
    pub structs: Vec<Struct>,
    pub constants: Vec<(String, u64)>,
    /// Size and alignment by `REEF_ASSERT_LAYOUT`.
    pub asserted: BTreeMap<String, (usize, usize)>,
}

pub struct Struct {
    pub name: String,
    pub fields: Vec<Field>,
}

pub struct Field {
    pub name: String,
    /// Of one element [bytes]; all types of the header are as aligned as they are large.
    pub element: usize,
    pub count: usize,
}

impl Struct {
    /// Places of the fields, size and alignment of the whole, by C's rules.
    pub fn layout(&self) -> (Vec<Place>, usize, usize) {
        let mut end = 0_usize;
        let mut align = 1;
        let mut places = Vec::new();
        for field in &self.fields {
            let start = end.next_multiple_of(field.element);
            end = start + field.element * field.count;
            align = align.max(field.element);
            places.push((start, field.element * field.count, field.element));
        }
        (places, end.next_multiple_of(align), align)
    }
}

impl Header {
    pub fn parse(text: &str) -> Self {
        let text = without_comments(text);
        let constants = constants(&text);
        let mut structs = Vec::new();
        let mut rest = text.as_str();
        while let Some(start) = rest.find("typedef struct ") {
            rest = &rest[start + "typedef struct ".len()..];
            let (name, after) = rest.split_once('{').expect("a struct has a body");
            let (body, after) = after.split_once('}').expect("a struct's body ends");
            let (tail, after) = after.split_once(';').expect("a typedef ends");
            assert_eq!(tail.trim(), name.trim(), "tag and type have one name");
            let fields = body.split(';').filter(|f| !f.trim().is_empty()).flat_map(field);
            structs.push(Struct { name: name.trim().to_owned(), fields: fields.collect() });
            rest = after;
        }
        let asserted = text
            .lines()
            .filter_map(|line| line.strip_prefix("REEF_ASSERT_LAYOUT(")?.strip_suffix(");"))
            .map(|arguments| {
                let parts: Vec<&str> = arguments.split(',').map(str::trim).collect();
                (parts[0].to_owned(), (number(parts[1]), number(parts[2])))
            })
            .collect();
        Self { structs, constants, asserted }
    }
}

fn number(text: &str) -> usize {
    text.parse().unwrap_or_else(|_| panic!("`{text}` is no number"))
}

fn without_comments(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("/*") {
        out.push_str(before);
        rest = after.split_once("*/").expect("a comment ends").1;
    }
    out + rest
}

/// `float base[4]`, `const float *x, *y, *z`, `int32_t (*step)(void *ctx, …)`.
fn field(declaration: &str) -> Vec<Field> {
    let declaration = declaration.split_whitespace().collect::<Vec<_>>().join(" ");
    if let Some((_, after)) = declaration.split_once("(*") {
        let name = after.split_once(')').expect("a function pointer has a name").0;
        return vec![Field { name: name.to_owned(), element: 8, count: 1 }];
    }
    let declarators: Vec<&str> = declaration.split(',').collect();
    let kind = declaration.trim_start_matches("const ").split([' ', '*']).next().expect("a field has a type");
    declarators
        .iter()
        .map(|declarator| {
            let pointer = declarator.contains('*');
            let last = declarator.rsplit([' ', '*']).next().expect("a field has a name");
            let (name, count) = match last.split_once('[') {
                Some((name, count)) => (name, number(count.trim_end_matches(']'))),
                None => (last, 1),
            };
            let element = match kind {
                _ if pointer => 8,
                "uint64_t" | "double" => 8,
                "uint32_t" | "int32_t" | "float" => 4,
                other => panic!("the header uses the type `{other}`, which this test does not know"),
            };
            Field { name: name.to_owned(), element, count }
        })
        .collect()
}

/// All `#define REEF_… value` whose value is a number; macros with arguments, texts and `REEF_EXPORT` are
/// none.
fn constants(text: &str) -> Vec<(String, u64)> {
    let mut known: Vec<(String, u64)> = Vec::new();
    for line in text.lines() {
        let Some(rest) = line.trim().strip_prefix("#define ") else { continue };
        let Some((name, value)) = rest.split_once(' ') else { continue };
        let plain = value.trim();
        let is_text = plain.starts_with('"');
        if name.contains('(') || name == "REEF_EXPORT" || is_text || !name.starts_with("REEF_") {
            continue;
        }
        let value = literal(plain).unwrap_or_else(|| panic!("{name}: `{plain}` is no number"));
        known.push((name.to_owned(), value));
    }
    known
}

fn literal(text: &str) -> Option<u64> {
    let text = text.trim_end_matches("ull").trim_end_matches('u');
    if let Some(hex) = text.strip_prefix("0x") {
        return u64::from_str_radix(hex, 16).ok();
    }
    if let Some(positive) = text.strip_prefix('-') {
        return positive.parse::<i64>().ok().map(|value| (-value) as u64);
    }
    text.parse().ok()
}
