//! Texts of others — plugins, scenes, names of files — on their way to a terminal: what would steer it is
//! written out.

use std::fmt::{self, Display, Write};

/// Shows a text without control characters: each is written as `\u001b`, which JSON reads as the same
/// character.
#[derive(Clone, Copy, Debug)]
pub struct Plain<T>(pub T);

impl<T: Display> Display for Plain<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(Escaping(f), "{}", self.0)
    }
}

/// Hands on what is harmless and escapes the rest.
pub(crate) struct Escaping<W>(pub(crate) W);

impl<W: Write> Write for Escaping<W> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut rest = text;
        while let Some(at) = rest.find(steers) {
            self.0.write_str(&rest[..at])?;
            let mut after = rest[at..].chars();
            if let Some(character) = after.next() {
                write!(self.0, "\\u{:04x}", u32::from(character))?;
            }
            rest = after.as_str();
        }
        self.0.write_str(rest)
    }
}

/// Whether a terminal does something else with it than to show it: control characters but the ends of lines
/// and tabs, and those that turn the direction of what follows.
fn steers(character: char) -> bool {
    match character {
        '\n' | '\t' => false,
        '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => true,
        _ => character.is_control(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_steers_a_terminal_is_written_out_and_the_rest_stays() {
        for harmless in ["", "plain", "zwei\n\tZeilen, größer, 海 🌊"] {
            assert_eq!(Plain(harmless).to_string(), harmless);
        }
        for (text, shown) in [
            ("\x1b]0;title\x07", "\\u001b]0;title\\u0007"),
            ("a\rb\u{8}c\u{7f}", "a\\u000db\\u0008c\\u007f"),
            ("\u{9b}31m", "\\u009b31m"),
            ("\u{202e}txt", "\\u202etxt"),
        ] {
            assert_eq!(Plain(text).to_string(), shown);
        }
    }

    #[test]
    fn a_string_of_json_stays_the_same_string() {
        let value = serde_json::json!({ "text": "\x1b[31m \u{9b} \u{202e} \u{7f} \"\\" });
        let read: serde_json::Value = serde_json::from_str(&Plain(&value).to_string()).expect("JSON");
        assert_eq!(read, value);
    }
}
