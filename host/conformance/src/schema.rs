//! The schema of a plugin's configuration, and its texts, as people and editors meet them.

use serde_json::Value;

use super::{
    descriptor::each,
    subject::Subject,
    table::{Check, Of, Rule, Rule::Header},
    verdict::Outcome,
};
use reef_plugin::bare::survey::{Descriptor, Text};

const SCHEMA: Rule =
    Header("JSON Schema of the module's table in a scene file: what does not fit never gets to create()");

pub(super) const CHECKS: &[Check] = &[
    check("schema-references", "References in the schema lead somewhere.", SCHEMA, references),
    check("schema-properties", "Properties in the schema are a table of schemas.", SCHEMA, properties),
    check("schema-patterns", "Patterns in the schema are regular expressions.", SCHEMA, patterns),
    check("schema-texts", "Texts have no control characters.", Header("UTF-8."), plain),
];

const fn check(name: &'static str, about: &'static str, rule: Rule, run: fn(&Subject) -> Outcome) -> Check {
    Check { name, about, rule, needs: &["descriptor-texts", "descriptor-schema"], of: Of::Library, run }
}

/// Looks at each table of the schemas, with its root: `problem` says what is wrong with one.
fn tables(
    subject: &Subject,
    problem: impl Fn(&Value, &serde_json::Map<String, Value>) -> Option<String>,
) -> Outcome {
    each(subject, |descriptor| {
        let root: Value = serde_json::from_str(descriptor.config_schema.good()?).ok()?;
        let mut rest = vec![&root];
        while let Some(value) = rest.pop() {
            match value {
                Value::Object(table) => {
                    if let Some(problem) = problem(&root, table) {
                        return Some(problem);
                    }
                    // What is a value and no schema may look like one.
                    let is_value = |key: &str| matches!(key, "const" | "default" | "enum" | "examples");
                    rest.extend(table.iter().filter(|(key, _)| !is_value(key)).map(|(_, value)| value));
                }
                Value::Array(values) => rest.extend(values),
                _ => {}
            }
        }
        None
    })
}

fn references(subject: &Subject) -> Outcome {
    tables(subject, |root, table| {
        let target = table.get("$ref")?.as_str()?;
        let leads = target.strip_prefix('#').is_some_and(|pointer| root.pointer(pointer).is_some());
        (!leads).then(|| format!("the reference {target:?} in its config_schema leads nowhere"))
    })
}

fn properties(subject: &Subject) -> Outcome {
    tables(subject, |_, table| {
        // Where a property is called so, it stands for a schema itself.
        let properties = table.get("properties")?;
        let schema = |value: &Value| value.is_object() || value.is_boolean();
        let fits = properties.as_object().is_some_and(|all| all.values().all(schema));
        (!fits && !schema_like(properties))
            .then(|| "\"properties\" in its config_schema are no table of schemas".to_owned())
    })
}

/// Does a value say of itself that it is a schema?
fn schema_like(value: &Value) -> bool {
    value.get("type").is_some_and(Value::is_string) || value.get("$ref").is_some_and(Value::is_string)
}

fn patterns(subject: &Subject) -> Outcome {
    tables(subject, |_, table| {
        let pattern = table.get("pattern")?.as_str()?;
        unmatched(pattern).map(|why| format!("the pattern {pattern:?} in its config_schema {why}"))
    })
}

/// What no dialect of regular expressions takes.
fn unmatched(pattern: &str) -> Option<&'static str> {
    let (mut depth, mut class, mut operand) = (0_u32, false, false);
    let mut rest = pattern.chars();
    while let Some(c) = rest.next() {
        match c {
            '\\' if rest.next().is_none() => return Some("ends with an escape of nothing"),
            '\\' => operand = true,
            ']' if class => (class, operand) = (false, true),
            _ if class => {}
            '[' => class = true,
            '(' => {
                depth += 1;
                operand = false;
                // `(?:`, `(?=` and the like: no operand is asked for.
                if rest.as_str().starts_with('?') {
                    rest.next();
                }
            }
            ')' if depth == 0 => return Some("closes a group that was not opened"),
            ')' => (depth, operand) = (depth - 1, true),
            '*' | '+' | '?' if !operand => return Some("repeats nothing"),
            '|' => operand = false,
            _ => operand = true,
        }
    }
    match (class, depth) {
        (true, _) => Some("has a class that is not closed"),
        (false, 0) => None,
        (false, _) => Some("has a group that is not closed"),
    }
}

fn plain(subject: &Subject) -> Outcome {
    each(subject, |descriptor| {
        let (what, text) = texts(descriptor).find(|(_, text)| text.good().is_some_and(steers))?;
        Some(format!("its {what} {:?} has control characters", text.good().unwrap_or_default()))
    })
}

/// Would it steer a terminal, or break a line?
fn steers(text: &str) -> bool {
    text.chars().any(char::is_control)
}

/// All texts that people are shown.
fn texts(descriptor: &Descriptor) -> impl Iterator<Item = (&'static str, &Text)> {
    let own = [
        ("name", &descriptor.name),
        ("version", &descriptor.version),
        ("vendor", &descriptor.vendor),
        ("description", &descriptor.description),
    ];
    let params = descriptor.params.iter().flat_map(|param| {
        let own = [
            ("parameter's label", &param.label),
            ("parameter's group", &param.group),
            ("parameter's unit", &param.unit),
            ("parameter's help", &param.help),
        ];
        let choices = param.choices.iter().flatten().map(|choice| ("choice's name", choice));
        own.into_iter().chain(choices)
    });
    own.into_iter().chain(params)
}

#[cfg(test)]
mod tests {
    use super::unmatched;

    #[test]
    fn patterns_that_no_dialect_takes_are_seen_and_no_others() {
        for good in
            ["", "^a.b$", r"\(", "[(]", "[^]a]x", "(?:ab)+", "a|b*", "^#[0-9a-f]{6}$", "(?=x)y", r"[\]]"]
        {
            assert_eq!(unmatched(good), None, "{good}");
        }
        for bad in ["(", "a)", "[a", "*a", "a|+", "(?:a", "x\\", "(*)"] {
            assert!(unmatched(bad).is_some(), "{bad}");
        }
    }
}
