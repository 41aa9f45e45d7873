//! The page that `reef validate --report` writes: expected, actual, difference, side by side.

use std::fmt::Write;

/// One picture's row.
pub struct Entry {
    /// Its name.
    pub name: String,
    /// Whether nothing was wrong.
    pub passed: bool,
    /// How the pictures differ.
    pub figures: String,
    /// What was wrong.
    pub lines: Vec<String>,
    /// File names of expected, actual, difference.
    pub pictures: [Option<String>; 3],
}

/// The whole page.
pub fn page(device: &str, entries: &[Entry], last_words: &[String]) -> String {
    let mut html = String::from(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>reef validate</title>\n<style>\
         body{background:#0e1a20;color:#dfe8ea;font:15px/1.5 system-ui,sans-serif;margin:2rem}\
         h2{margin:2rem 0 .3rem}.ok{color:#7fd6a0}.fail{color:#ff8f7a}\
         .row{display:flex;gap:12px;flex-wrap:wrap}figure{margin:0}figcaption{color:#8fa6ad}\
         img{width:480px;height:auto;border-radius:4px;background:#000}pre{white-space:pre-wrap;color:#ffb4a5}\
         </style></head><body>\n<h1>reef validate</h1>\n",
    );
    let passed = entries.iter().filter(|e| e.passed).count();
    // Writing into a String does not fail.
    let _ = writeln!(html, "<p>{} — {passed} of {} pictures passed</p>", escape(device), entries.len());
    for entry in entries {
        let (class, mark) = if entry.passed { ("ok", "passed") } else { ("fail", "failed") };
        let _ = writeln!(html, "<h2>{} <span class=\"{class}\">{mark}</span></h2>", escape(&entry.name));
        if !entry.figures.is_empty() {
            let _ = writeln!(html, "<p>{}</p>", escape(&entry.figures));
        }
        let _ = writeln!(html, "<div class=\"row\">");
        for (what, file) in ["expected", "actual", "difference"].iter().zip(&entry.pictures) {
            if let Some(file) = file {
                let file = escape(file);
                let _ = writeln!(
                    html,
                    "<figure><img src=\"{file}\" alt=\"{what}\"><figcaption>{what}</figcaption></figure>"
                );
            }
        }
        let _ = writeln!(html, "</div>");
        lines(&mut html, &entry.lines);
    }
    if !last_words.is_empty() {
        html.push_str("<h2 class=\"fail\">When the device was closed</h2>\n");
        lines(&mut html, last_words);
    }
    html.push_str("</body></html>\n");
    html
}

fn lines(html: &mut String, lines: &[String]) {
    if !lines.is_empty() {
        let _ = writeln!(html, "<pre>{}</pre>", escape(&lines.join("\n")));
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_shows_what_failed_and_escapes_what_it_quotes() {
        let entry = Entry {
            name: "a<b".into(),
            passed: false,
            figures: String::new(),
            lines: vec!["x & y".into()],
            pictures: [None, Some("a-actual.png".into()), None],
        };
        let page = page("device", &[entry], &["leak".into()]);
        assert!(page.contains("a&lt;b") && page.contains("x &amp; y") && page.contains("failed"));
        assert!(page.contains("a-actual.png") && !page.contains("alt=\"expected\""));
        assert!(page.contains("leak"));
    }
}
