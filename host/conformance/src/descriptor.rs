//! What a library says of its plugins.

use serde_json::Value;

use super::{
    sea::Sea,
    subject::{Subject, WORKERS, run},
    table::{Check, Of, Rule::Header},
    verdict::{Not, Outcome, broken, must},
};
use reef_abi as abi;
use reef_plugin::{
    bare::survey::{Descriptor, Text},
    info::{MOST_TRACES, is_trace_name},
};

const STRINGS: &str = "`const char *` alone is NUL-terminated and valid until close()";

/// Without these the host takes no descriptor.
pub(super) const SOUND: &[&str] = &[
    "descriptor-id",
    "descriptor-ids",
    "descriptor-texts",
    "descriptor-schema",
    "descriptor-states",
    "descriptor-create",
    "descriptor-spare",
    "descriptor-traces",
    "param-present",
    "param-id",
    "param-key",
    "param-kind",
    "param-range",
    "param-default",
    "param-choices",
    "param-log",
    "param-texts",
    "param-spare",
];

pub(super) const CHECKS: &[Check] = &[
    Check {
        name: "descriptor-count",
        about: "The library has 1 to 64 plugins.",
        rule: Header("1..64"),
        needs: &["load-open"],
        of: Of::Library,
        run: count,
    },
    Check {
        name: "descriptor-pointers",
        about: "Every pointer of its descriptors leads somewhere.",
        rule: Header("NULL only where [opt]."),
        needs: &["descriptor-count"],
        of: Of::Library,
        run: pointers,
    },
    Check {
        name: "descriptor-size",
        about: "Each descriptor says as many bytes as this version of it has.",
        rule: Header("begin with `uint32_t size` and only ever get fields appended."),
        needs: &["descriptor-pointers"],
        of: Of::Library,
        run: size,
    },
    Check {
        name: "descriptor-id",
        about: "Ids are of the form vendor.name.",
        rule: Header("\"reef.anemone\": reverse-domain or vendor.name; stable"),
        needs: &["descriptor-pointers"],
        of: Of::Library,
        run: id,
    },
    Check {
        name: "descriptor-ids",
        about: "No two plugins of the library have one id.",
        rule: Header("\"reef.anemone\": reverse-domain or vendor.name; stable"),
        needs: &["descriptor-pointers"],
        of: Of::Library,
        run: ids,
    },
    Check {
        name: "descriptor-texts",
        about: "Name, version, vendor and description are there, in UTF-8.",
        rule: Header("UTF-8."),
        needs: &["descriptor-pointers"],
        of: Of::Library,
        run: texts,
    },
    Check {
        name: "descriptor-version",
        about: "The plugin's version is of the form 1.2.3.",
        rule: Header("of the plugin: \"1.2.3\""),
        needs: &["descriptor-texts"],
        of: Of::Library,
        run: version,
    },
    Check {
        name: "descriptor-schema",
        about: "The schema of the configuration is a JSON Schema of an object.",
        rule: Header(
            "JSON Schema of the module's table in a scene file: what does not fit never gets to create()",
        ),
        needs: &["descriptor-pointers"],
        of: Of::Library,
        run: schema,
    },
    Check {
        name: "descriptor-states",
        about: "The oldest state version that it reads is not above the one that it writes.",
        rule: Header("the oldest that load_state reads"),
        needs: &["descriptor-pointers"],
        of: Of::Library,
        run: states,
    },
    Check {
        name: "descriptor-create",
        about: "Each descriptor has a create().",
        rule: Header("NULL only where [opt]."),
        needs: &["descriptor-pointers"],
        of: Of::Library,
        run: create,
    },
    Check {
        name: "descriptor-spare",
        about: "Flags and spare fields of descriptors are zero.",
        rule: Header("of everything are zero"),
        needs: &["descriptor-pointers"],
        of: Of::Library,
        run: spare,
    },
    Check {
        name: "descriptor-traces",
        about: "Traces have names of their own, which recordings can write.",
        rule: Header("lower_case_words */ uint32_t trace_count; /* at most 16"),
        needs: &["descriptor-pointers"],
        of: Of::Library,
        run: traces,
    },
    Check {
        name: "descriptor-constant",
        about: "What descriptors say does not change until close().",
        rule: Header(STRINGS),
        needs: &["descriptor-pointers"],
        of: Of::Library,
        run: constant,
    },
];

fn count(subject: &Subject) -> Outcome {
    let count = subject.open(1)?.descriptor_count();
    must!((1..=64).contains(&count), "it has {count} plugins; allowed is 1 to 64");
    Ok(None)
}

fn pointers(subject: &Subject) -> Outcome {
    let surveyed = subject.open(1)?.survey().map_err(Not::Kept)?;
    match surveyed.iter().position(Option::is_none) {
        Some(at) => broken!("descriptor {at} is NULL or misaligned"),
        None => Ok(None),
    }
}

/// Each descriptor must do: `problem` says what is wrong with one.
pub(super) fn each(subject: &Subject, problem: impl Fn(&Descriptor) -> Option<String>) -> Outcome {
    let all = subject.descriptors()?;
    match all.iter().find_map(|descriptor| Some((descriptor, problem(descriptor)?))) {
        Some((descriptor, problem)) => {
            broken!("{}: {problem}", descriptor.id.good().unwrap_or("a plugin without an id"))
        }
        None => Ok(None),
    }
}

fn size(subject: &Subject) -> Outcome {
    let known = size_of::<abi::Descriptor>() as u32;
    each(subject, |d| {
        (d.size != known)
            .then(|| format!("its size is {}; reef_descriptor of this version has {known} bytes", d.size))
    })
}

fn id(subject: &Subject) -> Outcome {
    each(subject, |d| match &d.id {
        Text::Null => Some("its id is NULL".into()),
        Text::NotUtf8(id) => Some(format!("its id {id:?} is not UTF-8")),
        Text::Good(id) => {
            let good = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '_' | '-');
            let parts = id.split('.').all(|part| !part.is_empty() && part.chars().all(good));
            let fits = parts && id.contains('.');
            (!fits)
                .then(|| format!("its id {id:?} must be like `vendor.name`, of a-z, 0-9, `.`, `_` and `-`"))
        }
    })
}

fn ids(subject: &Subject) -> Outcome {
    let all = subject.descriptors()?;
    for (at, descriptor) in all.iter().enumerate() {
        if let Some(first) = all[..at].iter().position(|other| other.id == descriptor.id) {
            broken!("descriptors {first} and {at} have the same id {:?}", descriptor.id.good().unwrap_or(""));
        }
    }
    Ok(None)
}

/// What is wrong with a text that must say something.
pub(super) fn missing(what: &str, text: &Text) -> Option<String> {
    match text {
        Text::Null => Some(format!("its {what} is NULL")),
        Text::NotUtf8(text) => Some(format!("its {what} {text:?} is not UTF-8")),
        Text::Good(text) => text.trim().is_empty().then(|| format!("its {what} is empty")),
    }
}

fn texts(subject: &Subject) -> Outcome {
    each(subject, |d| {
        let texts = [
            ("name", &d.name),
            ("version", &d.version),
            ("vendor", &d.vendor),
            ("description", &d.description),
        ];
        texts.iter().find_map(|(what, text)| missing(what, text))
    })
}

fn version(subject: &Subject) -> Outcome {
    each(subject, |d| {
        let version = d.version.good()?;
        let core = version.split(['-', '+']).next().unwrap_or("");
        let numbers: Vec<&str> = core.split('.').collect();
        let fits = numbers.len() == 3 && numbers.iter().all(|number| number.parse::<u64>().is_ok());
        (!fits).then(|| format!("its version is {version:?}, which is not like \"1.2.3\""))
    })
}

fn schema(subject: &Subject) -> Outcome {
    each(subject, |d| match &d.config_schema {
        Text::Null => None, // [opt]
        Text::NotUtf8(_) => Some("its config_schema is not UTF-8".into()),
        Text::Good(text) => match serde_json::from_str::<Value>(text) {
            Err(error) => Some(format!("its config_schema is no JSON: {error}")),
            Ok(Value::Bool(true)) => None,
            Ok(Value::Object(schema)) => match schema.get("type") {
                None => None,
                Some(kind) if kind == "object" => None,
                Some(kind) => {
                    Some(format!("its config_schema is of type {kind}; a module's table is an object"))
                }
            },
            Ok(_) => Some("its config_schema is no JSON Schema: neither an object nor true".into()),
        },
    })
}

fn states(subject: &Subject) -> Outcome {
    each(subject, |d| {
        (d.state_min_version > d.state_version).then(|| {
            format!(
                "its state_min_version {} is above its state_version {}",
                d.state_min_version, d.state_version
            )
        })
    })
}

fn create(subject: &Subject) -> Outcome {
    each(subject, |d| (!d.has_create).then(|| "its create is NULL".into()))
}

fn spare(subject: &Subject) -> Outcome {
    each(subject, |d| {
        (d.flags != 0 || d.spare != [0; 2])
            .then(|| format!("its flags are {:#x} and its spare fields are {:?}", d.flags, d.spare))
    })
}

fn traces(subject: &Subject) -> Outcome {
    each(subject, |d| {
        let Some(traces) = &d.traces else { return Some("its traces are NULL".into()) };
        if d.trace_count > MOST_TRACES {
            return Some(format!("its trace_count is {}, allowed is 0 to {MOST_TRACES}", d.trace_count));
        }
        let wrong = traces.iter().find(|name| !name.good().is_some_and(is_trace_name));
        let wrong = wrong.map(|name| format!("the trace {name:?} is no word of a-z, 0-9 and `_`"));
        let twice = || (1..traces.len()).find(|at| traces[..*at].contains(&traces[*at]));
        wrong.or_else(|| twice().map(|at| format!("two of its traces are {:?}", traces[at])))
    })
}

fn constant(subject: &Subject) -> Outcome {
    let Ok(plugin) = subject.load(WORKERS) else {
        return Err(Not::There("no instance can be made".into()));
    };
    let before = plugin.library().survey().map_err(Not::Kept)?;
    let Ok(mut instance) = subject.create(&plugin) else {
        return Err(Not::There("no instance can be made".into()));
    };
    let same = |when: &str| {
        must!(
            plugin.library().survey().map_err(Not::Kept)? == before,
            "the descriptors say something else {when}"
        );
        Ok(())
    };
    same("after create()")?;
    // Whether it steps at all is for another check.
    let _ = run(&mut instance, &Sea::usual(), 0..10);
    same("after some steps")?;
    if instance.destroy().is_ok() {
        same("after destroy()")?;
    }
    Ok(None)
}
