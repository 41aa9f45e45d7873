//! What a plugin says of its parameters: the panel, scene files and the journal are made from it.

use reef_abi as abi;
use reef_plugin::bare::survey::{Descriptor, Param, Text};

use super::{
    descriptor::missing,
    subject::Subject,
    table::{Check, Of, Rule::Header},
    verdict::{Not, Outcome, broken},
};

pub(super) const CHECKS: &[Check] = &[
    check("param-present", "As many parameters are there as are declared.", "[opt]", present),
    check(
        "param-id",
        "Ids of parameters are not 0, and no two are equal.",
        "stable for ever; not an index; not 0",
        id,
    ),
    check(
        "param-key",
        "Keys are lower_case_words, and no two are equal.",
        "in scene files: lower_case_words",
        key,
    ),
    check(
        "param-kind",
        "Kinds are those of the header, and no flag is unknown.",
        "flags: a logarithmic slider",
        kind,
    ),
    check(
        "param-range",
        "Ranges are finite, and those that their kind has.",
        "REEF_PARAM_SWITCH 3u /* 0 or 1",
        range,
    ),
    check("param-default", "Defaults are values that the parameter can take.", "REEF_PARAM_INT 2u", default),
    check(
        "param-choices",
        "A choice has a name for each of its values.",
        "[opt] choice_count names",
        choices,
    ),
    check("param-log", "A logarithmic slider has a range above 0.", "flags: a logarithmic slider", log),
    check("param-texts", "Label and help say something; group and unit are there.", "one sentence", texts),
    check("param-spare", "Spare fields of parameters are zero.", "of everything are zero", spare),
];

const fn check(
    name: &'static str,
    about: &'static str,
    rule: &'static str,
    run: fn(&Subject) -> Outcome,
) -> Check {
    Check { name, about, rule: Header(rule), needs: &["descriptor-size"], of: Of::Library, run }
}

/// Each plugin's parameters must do: `problem` says what is wrong with one, given those before it.
fn each(subject: &Subject, problem: impl Fn(&Param, &[Param]) -> Option<String>) -> Outcome {
    let all = subject.descriptors()?;
    if all.iter().all(|descriptor| descriptor.params.is_empty()) {
        return Err(Not::There("there are no parameters".into()));
    }
    for Descriptor { id, params, .. } in &all {
        for (at, param) in params.iter().enumerate() {
            if let Some(problem) = problem(param, &params[..at]) {
                let plugin = id.good().unwrap_or("a plugin without an id");
                let key = param.key.good().map_or_else(|| format!("number {at}"), |key| format!("`{key}`"));
                broken!("{plugin}, parameter {key}: {problem}");
            }
        }
    }
    Ok(None)
}

fn present(subject: &Subject) -> Outcome {
    for d in subject.descriptors()? {
        let count = d.param_count;
        let plugin = d.id.good().unwrap_or("a plugin without an id");
        if d.params_missing {
            broken!("{plugin}: it declares {count} parameters, and its params are NULL or misaligned");
        }
        if count as usize != d.params.len() {
            broken!("{plugin}: it declares {count} parameters; the limit is {}", d.params.len());
        }
    }
    Ok(None)
}

fn id(subject: &Subject) -> Outcome {
    each(subject, |param, before| match before.iter().find(|other| other.id == param.id) {
        _ if param.id == 0 => Some("its id is 0".into()),
        Some(other) => {
            Some(format!("its id {} is that of `{}`, too", param.id, other.key.good().unwrap_or("?")))
        }
        None => None,
    })
}

fn key(subject: &Subject) -> Outcome {
    each(subject, |param, before| {
        if let Some(problem) = missing("key", &param.key) {
            return Some(problem);
        }
        let key = param.key.good()?;
        let good = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        if !key.starts_with(|c: char| c.is_ascii_lowercase()) || !key.chars().all(good) {
            return Some("its key is not made of lower_case_words".into());
        }
        before.iter().any(|other| other.key == param.key).then(|| "an earlier one has the same key".into())
    })
}

fn kind(subject: &Subject) -> Outcome {
    each(subject, |param, _| {
        if !(abi::PARAM_FLOAT..=abi::PARAM_CHOICE).contains(&param.kind) {
            return Some(format!("its kind is {}, allowed is 1 to 4", param.kind));
        }
        let unknown = param.flags & !abi::PARAM_LOG;
        (unknown != 0).then(|| format!("its flags have unknown bits {unknown:#x}"))
    })
}

fn range(subject: &Subject) -> Outcome {
    each(subject, |param, _| {
        let (low, high) = (param.minimum, param.maximum);
        if !low.is_finite() || !high.is_finite() || low > high {
            return Some(format!("its range is {low} to {high}"));
        }
        let whole = low.fract() == 0.0 && high.fract() == 0.0;
        match param.kind {
            abi::PARAM_SWITCH if (low, high) != (0.0, 1.0) => {
                Some(format!("a switch is 0 or 1, and its range is {low} to {high}"))
            }
            abi::PARAM_INT if !whole => Some(format!("whole numbers, and its range is {low} to {high}")),
            _ => None,
        }
    })
}

fn default(subject: &Subject) -> Outcome {
    each(subject, |param, _| {
        let value = param.default;
        let whole = param.kind == abi::PARAM_FLOAT || value.fract() == 0.0;
        // An order of the range that makes no sense is for another check.
        let inside = value.is_finite() && (param.minimum > param.maximum || takes(param, value));
        (!inside || !whole)
            .then(|| format!("its default {value} is no value of {} to {}", param.minimum, param.maximum))
    })
}

/// Is a value within the range? A range that is no number says nothing.
fn takes(param: &Param, value: f64) -> bool {
    !(value < param.minimum || value > param.maximum)
}

fn choices(subject: &Subject) -> Outcome {
    each(subject, |param, _| match (param.kind, &param.choices) {
        (abi::PARAM_CHOICE, None) => Some("a choice, and its names are NULL".into()),
        (abi::PARAM_CHOICE, Some(names)) => {
            let count = param.choice_count;
            if count == 0 || names.len() != count as usize {
                return Some(format!("a choice of {count} names"));
            }
            if (param.minimum, param.maximum) != (0.0, f64::from(count - 1)) {
                return Some(format!(
                    "a choice of {count} names, and its range is {} to {}",
                    param.minimum, param.maximum
                ));
            }
            names.iter().enumerate().find_map(|(at, name)| missing(&format!("name of choice {at}"), name))
        }
        (_, _) if param.choice_count != 0 => {
            Some(format!("no choice, and it has {} names", param.choice_count))
        }
        _ => None,
    })
}

fn log(subject: &Subject) -> Outcome {
    each(subject, |param, _| {
        let wrong = param.flags & abi::PARAM_LOG != 0 && param.minimum <= 0.0;
        wrong.then(|| format!("a logarithmic slider, and its range begins at {}", param.minimum))
    })
}

fn texts(subject: &Subject) -> Outcome {
    each(subject, |param, _| {
        let there = |what: &str, text: &Text| match text {
            Text::Good(_) => None,
            other => missing(what, other),
        };
        missing("label", &param.label)
            .or_else(|| missing("help", &param.help))
            .or_else(|| there("group", &param.group))
            .or_else(|| there("unit", &param.unit))
    })
}

fn spare(subject: &Subject) -> Outcome {
    each(subject, |param, _| {
        (param.spare != [0; 2]).then(|| format!("its spare fields are {:?}", param.spare))
    })
}
