//! What a plugin may be called: a name that is good for a folder, a crate, a library and an id.

use std::path::Path;

/// Longest name [bytes].
const LONGEST: usize = 40;

/// Words that no crate may be called, or that the scaffold's own crates are.
const TAKEN: [&str; 64] = [
    "abstract",
    "alloc",
    "as",
    "async",
    "await",
    "become",
    "box",
    "break",
    "const",
    "continue",
    "core",
    "crate",
    "do",
    "dyn",
    "else",
    "enum",
    "extern",
    "false",
    "final",
    "fn",
    "for",
    "gen",
    "if",
    "impl",
    "in",
    "let",
    "loop",
    "macro",
    "main",
    "match",
    "mod",
    "move",
    "mut",
    "override",
    "priv",
    "proc-macro",
    "pub",
    "ref",
    "reef",
    "reef-abi",
    "reef-sdk",
    "return",
    "schemars",
    "self",
    "serde",
    "static",
    "std",
    "struct",
    "super",
    "test",
    "trait",
    "true",
    "try",
    "type",
    "typeof",
    "union",
    "unsafe",
    "unsized",
    "use",
    "virtual",
    "where",
    "while",
    "yield",
    "nul",
];

/// The name in the last part of a path, if it is a good one.
pub(super) fn of(folder: &Path) -> miette::Result<String> {
    let Some(name) = folder.file_name() else {
        return Err(miette::miette!("{}: this path does not end in a name", folder.display()));
    };
    let name = name.to_string_lossy();
    match problem(&name) {
        None => Ok(name.into_owned()),
        Some(problem) => {
            let rule = format!(
                "a name has 2 to {LONGEST} lower-case letters, digits and single `-`, a letter first"
            );
            let help = match suggestion(&name) {
                Some(better) => format!("{rule}: `{better}`, for instance"),
                None => rule,
            };
            Err(miette::miette!(help = help, "a plugin cannot be called `{name}`: {problem}"))
        }
    }
}

/// What is wrong with a name; None: nothing.
fn problem(name: &str) -> Option<String> {
    let odd = name.chars().find(|c| !(c.is_ascii_lowercase() || c.is_ascii_digit() || *c == '-'));
    if let Some(odd) = odd {
        return Some(match odd {
            ' ' => "it has a space".to_owned(),
            odd if odd.is_uppercase() => format!("it has the capital `{odd}`"),
            odd => format!("it has `{}`", odd.escape_default()),
        });
    }
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) {
        return Some("it does not begin with a letter".to_owned());
    }
    if name.ends_with('-') || name.contains("--") {
        return Some("a `-` stands between two letters or digits".to_owned());
    }
    if name.len() < 2 || name.len() > LONGEST {
        return Some(format!("it has {} characters", name.len()));
    }
    TAKEN.contains(&name).then(|| "this word is taken".to_owned())
}

/// The nearest good name, where one is near.
fn suggestion(name: &str) -> Option<String> {
    let mut better = String::new();
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            better.push(c.to_ascii_lowercase());
        } else if !better.is_empty() && !better.ends_with('-') {
            better.push('-');
        }
    }
    let mut better =
        better.trim_start_matches(|c: char| !c.is_ascii_lowercase()).trim_end_matches('-').to_owned();
    better.truncate(LONGEST);
    if TAKEN.contains(&better.as_str()) {
        better.push_str("-plugin");
    }
    problem(&better).is_none().then_some(better)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn good_names_pass_and_the_last_part_of_a_path_counts() {
        for (path, name) in
            [("kelp", "kelp"), ("plugins/two-words", "two-words"), ("../a1", "a1"), ("x/", "x")]
        {
            let result = of(Path::new(path));
            match name {
                "x" => assert!(result.unwrap_err().to_string().contains("has 1 characters")),
                name => assert_eq!(result.unwrap(), name),
            }
        }
    }

    #[test]
    fn a_bad_name_is_told_with_its_reason_and_a_better_one() {
        for (name, reason, better) in [
            ("My Kelp", "has the capital `M`", Some("my-kelp")),
            ("my kelp", "has a space", Some("my-kelp")),
            ("my_kelp", "has `_`", Some("my-kelp")),
            ("-kelp", "does not begin with a letter", Some("kelp")),
            ("2kelp", "does not begin with a letter", Some("kelp")),
            ("kelp-", "between two letters", Some("kelp")),
            ("kelp--bed", "between two letters", Some("kelp-bed")),
            ("serde", "is taken", Some("serde-plugin")),
            ("tang-größe", "has `\\u{f6}`", Some("tang-gr-e")),
            ("a\nb", "has `\\n`", Some("a-b")),
            ("1", "does not begin with a letter", None),
        ] {
            let error = of(Path::new(name)).unwrap_err();
            assert!(error.to_string().contains(reason), "{name}: {error}");
            let help = error.help().unwrap().to_string();
            assert!(better.is_none_or(|better| help.contains(&format!("`{better}`"))), "{help}");
            assert_eq!(suggestion(name).as_deref(), better);
        }
        assert!(of(Path::new(&"k".repeat(41))).unwrap_err().to_string().contains("41 characters"));
        assert!(of(Path::new("..")).unwrap_err().to_string().contains("does not end in a name"));
    }

    #[test]
    fn every_taken_word_is_refused() {
        for word in TAKEN {
            assert!(of(Path::new(word)).is_err(), "{word}");
        }
    }
}
