//! What was found, for people and for programs.

use std::{fmt::Write, path::Path};

use reef_report::say::shown;
use serde_json::{Value, json};

use super::{
    judge::Judgement,
    table::{self, Rule},
    verdict::Verdict,
};

/// Room for the names of checks.
const WIDTH: usize = 26;

/// One check's line, and below it what was wrong.
pub(super) fn line(judgement: &Judgement, several: bool) -> String {
    let name = match &judgement.plugin {
        Some(plugin) if several => format!("{} of {plugin}", judgement.check.name),
        _ => judgement.check.name.to_owned(),
    };
    match &judgement.verdict {
        Verdict::Passed(None) => format!("  pass  {name}"),
        Verdict::Passed(Some(note)) => format!("  pass  {name:<WIDTH$} {note}"),
        Verdict::Skipped(why) => format!("  skip  {name:<WIDTH$} {why}"),
        Verdict::Unconfigured(why) => format!("  skip  {name:<WIDTH$} no instance: {why}"),
        Verdict::Failed(why) => {
            let rule = judgement.check.rule;
            format!(
                "  FAIL  {name:<WIDTH$} {}\n        {why}\n        {} says: \"{}\"",
                judgement.check.about,
                rule.place(),
                rule.words()
            )
        }
    }
}

/// How many passed, failed, and were skipped.
fn counts(judgements: &[Judgement]) -> [usize; 3] {
    let count =
        |of: fn(&Verdict) -> bool| judgements.iter().filter(|judgement| of(&judgement.verdict)).count();
    [
        count(|verdict| matches!(verdict, Verdict::Passed(_))),
        count(|verdict| matches!(verdict, Verdict::Failed(_))),
        count(|verdict| matches!(verdict, Verdict::Skipped(_) | Verdict::Unconfigured(_))),
    ]
}

/// The last line.
pub(super) fn sum(judgements: &[Judgement]) -> String {
    let [passed, failed, skipped] = counts(judgements);
    format!("{} checks: {passed} passed, {failed} failed, {skipped} skipped", judgements.len())
}

/// All of it.
pub(super) fn json(path: &Path, judgements: &[Judgement]) -> Value {
    let [passed, failed, skipped] = counts(judgements);
    let checks: Vec<Value> = judgements
        .iter()
        .map(|judgement| {
            let (result, message) = match &judgement.verdict {
                Verdict::Passed(note) => ("pass", note.as_deref()),
                Verdict::Failed(why) => ("fail", Some(why.as_str())),
                Verdict::Skipped(why) | Verdict::Unconfigured(why) => ("skip", Some(why.as_str())),
            };
            let rule = judgement.check.rule;
            json!({
                "name": judgement.check.name,
                "plugin": judgement.plugin,
                "about": judgement.check.about,
                "result": result,
                "message": message,
                "rule": rule.words(),
                "rule_of": place(rule),
                "seconds": judgement.time.as_secs_f64(),
            })
        })
        .collect();
    json!({
        "path": shown(path),
        "checks": checks,
        "passed": passed,
        "failed": failed,
        "skipped": skipped,
        "pass": failed == 0,
    })
}

/// The file that a rule stands in.
fn place(rule: Rule) -> &'static str {
    match rule {
        Rule::Header(_) => "reef_sim.h",
        Rule::Guide(_) => "sim-plugins/README.md",
    }
}

/// Names of all checks.
pub(super) fn list(as_json: bool) -> String {
    if as_json {
        let checks: Vec<Value> = table::all()
            .map(|check| {
                json!({
                    "name": check.name,
                    "about": check.about,
                    "rule": check.rule.words(),
                    "rule_of": place(check.rule),
                    "needs": check.needs,
                })
            })
            .collect();
        return format!("{:#}", json!({ "checks": checks }));
    }
    let mut text = String::new();
    for check in table::all() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{:<WIDTH$} {}", check.name, check.about);
    }
    text
}
