//! Making instances.

use std::{ffi::CStr, mem::size_of};

use reef_abi as abi;
use reef_plugin::{PluginError, bare::pages::Pages};

use super::{
    descriptor,
    subject::{Subject, WORKERS},
    table::{Check, Of, Rule::Header},
    verdict::{Not, Outcome, broken, must},
};

pub(super) const CHECKS: &[Check] = &[
    Check {
        name: "create-works",
        about: "create() makes an instance of the configuration that is given.",
        rule: Header("makes instances with create() and calls step() once per simulation step"),
        needs: descriptor::SOUND,
        of: Of::Plugin,
        run: works,
    },
    Check {
        name: "destroy-fresh",
        about: "An instance that never stepped can be destroyed.",
        rule: Header("valid until destroy() returned, or create() returned a failure."),
        needs: &["create-works"],
        of: Of::Plugin,
        run: destroy,
    },
    Check {
        name: "create-table",
        about: "create() fills the whole table of the instance's functions.",
        rule: Header("Filled by create(), up to the size that the host put there."),
        needs: &["destroy-fresh"],
        of: Of::Plugin,
        run: table,
    },
    Check {
        name: "create-garbage",
        about: "A configuration that makes no sense is taken, or refused with REEF_BAD_INPUT.",
        rule: Header("create: the configuration is wrong; the message names the JSON path"),
        needs: &["create-works"],
        of: Of::Plugin,
        run: garbage,
    },
    Check {
        name: "create-message",
        about: "A configuration is refused with a message.",
        rule: Header("Every failure carries a message: call reef_host.set_error first."),
        needs: &["create-works"],
        of: Of::Plugin,
        run: message,
    },
    Check {
        name: "create-copies",
        about: "The configuration's text is not used after create() returned.",
        rule: Header(
            "(pointer, length) pairs are not NUL-terminated and valid during the call. The receiver copies what it keeps.",
        ),
        needs: &["create-works"],
        of: Of::Plugin,
        run: copies,
    },
    Check {
        name: "create-many",
        about: "Many instances can be alive at once.",
        rule: Header("`host` is this instance's own: valid until destroy() returned"),
        needs: &["create-works"],
        of: Of::Plugin,
        run: many,
    },
    Check {
        name: "create-extensions",
        about: "An extension that it does not have is NULL.",
        rule: Header(
            "[opt] The table of an extension, which lives as long as the instance; NULL: it does not have it.",
        ),
        needs: &["create-works"],
        of: Of::Plugin,
        run: extensions,
    },
];

/// Ids that nobody gives anything.
const NOBODYS: [&CStr; 3] = [c"draft/reef.nothing", c"", c"reef.nothing"];

fn extensions(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let instance = subject.create(&plugin)?;
    for id in NOBODYS {
        let there = instance.has_extension(id)?;
        must!(there != Some(true), "get_extension({id:?}) gives a table for a name that nobody knows");
        if there.is_none() {
            return Ok(Some("it has none".into()));
        }
    }
    Ok(None)
}

fn works(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    match subject.create(&plugin) {
        Ok(_) => Ok(None),
        Err(Not::Configured(problem)) if subject.config.is_given() => Err(Not::Configured(problem)),
        Err(Not::Configured(problem)) => Err(Not::Configured(format!("without a configuration, {problem}"))),
        Err(not) => Err(not),
    }
}

fn table(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let text = subject.create_text(&plugin)?;
    let known = size_of::<abi::Instance>() as u32;
    let filled = plugin.create_sized(&text, known)?;
    let missing: Vec<&str> =
        filled.functions.iter().filter(|(_, there)| !there).map(|(name, _)| *name).collect();
    must!(missing.is_empty(), "the instance has no {}", missing.join(", "));
    must!(filled.size == known, "the size of the instance is {}; it was given {known} bytes", filled.size);
    Ok(None)
}

/// Configurations that the host would never let through.
const GARBAGE: [&str; 9] = [
    "",
    "not JSON",
    "[]",
    "{}",
    "{\"config\": 7}",
    "{\"scene\": [], \"species\": 1, \"config\": {}}",
    "{\"config\": {\"no such key\": {\"a\": [1, 2, {}]}}}",
    "{\"config\": {\"\\u0000\": \"\\ud83d\\ude00\"}}",
    "{\"config\": {\"a\": 1e999}}",
];

/// Tries all of them in one library.
fn each(subject: &Subject, problem: impl Fn(&PluginError) -> Option<String>) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let mut refused = 0;
    for text in GARBAGE {
        if let Err(error) = plugin.create(text) {
            refused += 1;
            if let Some(problem) = problem(&error) {
                broken!("given {text:?}: {problem}");
            }
        }
    }
    Ok(Some(format!("{refused} of {} refused", GARBAGE.len())))
}

fn garbage(subject: &Subject) -> Outcome {
    each(subject, |error| match error {
        PluginError::Config { .. } => None,
        PluginError::Call { status, .. } if status == "REEF_BAD_INPUT" || status == "REEF_NO_SPACE" => None,
        error => Some(error.to_string()),
    })
}

fn message(subject: &Subject) -> Outcome {
    each(subject, |error| {
        error.to_string().ends_with("it gave no reason").then(|| "create() failed without a message".into())
    })
}

fn copies(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let text = subject.create_text(&plugin)?;
    let mut pages =
        Pages::new(text.len()).map_err(|error| Not::There(format!("the machine has no memory: {error}")))?;
    let mut instance = plugin.create(pages.text(&text))?;
    pages.take_away();
    for number in 0..3 {
        let report = instance.step(&super::sea::Sea::usual().input(number), &[]);
        if let reef_plugin::Health::Faulty(message) = instance.health() {
            broken!("{}", report.message.as_ref().unwrap_or(message));
        }
    }
    Ok(None)
}

fn destroy(subject: &Subject) -> Outcome {
    let (_plugin, instance) = subject.fresh()?;
    instance.destroy()?;
    Ok(None)
}

fn many(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let mut instances = Vec::new();
    for number in 1..=16 {
        match subject.create(&plugin) {
            Ok(instance) => instances.push(instance),
            Err(Not::Kept(why) | Not::Configured(why)) => broken!("instance {number} was not made: {why}"),
            Err(not) => return Err(not),
        }
    }
    Ok(None)
}
