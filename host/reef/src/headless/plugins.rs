//! `reef plugin`: what is found, what it says of itself, and what was refused; the doors to the checker and
//! the scaffold.

use std::fmt::Write;

use reef_command::Common;
use reef_plugin::{ParamInfo, ParamKind, PluginInfo, Registry};
use reef_report::{
    failure::{Failure, Outcome},
    say::{say, shown},
};
use serde_json::{Value, json};

use crate::headless::scaffold;
#[cfg(target_os = "linux")]
use reef_conformance as check;

/// Options of `reef plugin`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Subcommands of `reef plugin`.
#[derive(clap::Subcommand, Clone, Debug)]
pub enum Command {
    /// Lists the plugins that are found, with their parameters, and the files that were refused.
    List,
    /// Checks whether a plugin keeps to the contract.
    #[cfg(target_os = "linux")]
    Check(check::Args),
    /// Makes a folder with a plugin that builds and moves.
    New(scaffold::Args),
    /// Loads libraries whose paths come on standard input, each in a process of its own, and says what is in
    /// them.
    #[cfg(target_os = "linux")]
    #[command(hide = true)]
    Probe,
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &Args) -> Outcome {
    match &args.command {
        Command::List => list(common),
        #[cfg(target_os = "linux")]
        Command::Check(args) => check::run(common, args),
        Command::New(args) => scaffold::run(common, args),
        #[cfg(target_os = "linux")]
        Command::Probe => reef_plugin::probe::serve(),
    }
}

/// Fails when a file in a folder that somebody named is refused: it was meant to be a plugin.
fn list(common: &Common) -> Outcome {
    // One worker: nothing is stepped.
    let registry = Registry::find_all(&common.plugin_dir, 1);
    if common.json {
        say(format_args!("{:#}", to_json(&registry)));
    } else {
        say(to_text(&registry).trim_end());
    }
    let unwanted = registry.refused().len();
    match unwanted {
        0 => Ok(()),
        1 => Err(Failure::input(miette::miette!("one file is not used as a plugin: see above"))),
        n => Err(Failure::input(miette::miette!("{n} files are not used as plugins: see above"))),
    }
}

fn to_json(registry: &Registry) -> Value {
    let refused: Vec<Value> = registry
        .refused()
        .iter()
        .map(|refused| json!({"path": shown(&refused.path), "reason": refused.reason.to_string()}))
        .collect();
    let notes: Vec<Value> =
        registry.notes().iter().map(|(path, note)| json!({"path": shown(path), "note": note})).collect();
    let plugins: Vec<&PluginInfo> = registry.infos().map(AsRef::as_ref).collect();
    json!({"plugins": plugins, "refused": refused, "notes": notes})
}

fn to_text(registry: &Registry) -> String {
    let mut text = String::new();
    for info in registry.infos() {
        // Writing to a String cannot fail.
        let _ = write_plugin(&mut text, info);
    }
    if registry.plugins().is_empty() {
        text.push_str("No plugins: neither beside the program nor in a --plugin-dir.\n");
    }
    for (path, note) in registry.notes() {
        let _ = writeln!(text, "note: {} {note}", path.display());
    }
    for refused in registry.refused() {
        let _ = writeln!(text, "refused: {} {}", refused.path.display(), refused.reason);
    }
    text
}

fn write_plugin(text: &mut String, info: &PluginInfo) -> std::fmt::Result {
    writeln!(text, "{}  {} {}, {}", info.id, info.name, info.version, info.vendor)?;
    writeln!(text, "  {}", info.description)?;
    match &info.path {
        Some(path) => writeln!(text, "  file      {}", path.display())?,
        None => writeln!(text, "  file      none: linked into the program")?,
    }
    writeln!(text, "  contract  reef_sim.h {}", info.contract)?;
    writeln!(
        text,
        "  state     writes version {}, reads from {}",
        info.state_version, info.state_min_version
    )?;
    if let Some(keys) = schema_keys(info.config_schema.as_ref()) {
        writeln!(text, "  config    {keys}")?;
    }
    let mut group = None;
    for param in &info.params {
        if group != Some(&param.group) {
            writeln!(text, "  parameters{}{}", if param.group.is_empty() { "" } else { " · " }, param.group)?;
            group = Some(&param.group);
        }
        writeln!(text, "    {:<20} {:<32} {}", param.key, range(param), param.help)?;
    }
    writeln!(text)
}

/// Range, unit and default of a parameter.
fn range(param: &ParamInfo) -> String {
    let unit = if param.unit.is_empty() { String::new() } else { format!(" {}", param.unit) };
    match param.kind {
        ParamKind::Switch => format!("on/off (default {})", if param.default == 0.0 { "off" } else { "on" }),
        ParamKind::Choice => {
            let default = param.choices.get(param.default as usize).map_or("?", String::as_str);
            format!("{} (default {default})", param.choices.join("/"))
        }
        ParamKind::Float | ParamKind::Int => {
            format!("{} to {}{unit} (default {})", param.minimum, param.maximum, param.default)
        }
    }
}

/// The keys of a module's table, those that must be there marked.
fn schema_keys(schema: Option<&Value>) -> Option<String> {
    let schema = schema?;
    let properties = schema.get("properties")?.as_object()?;
    let required: Vec<&str> = schema
        .get("required")
        .and_then(Value::as_array)
        .into_iter()
        .flatten()
        .filter_map(Value::as_str)
        .collect();
    let keys: Vec<String> = properties
        .keys()
        .map(|key| if required.contains(&key.as_str()) { format!("{key} (required)") } else { key.clone() })
        .collect();
    (!keys.is_empty()).then(|| keys.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_schema_is_summed_up_by_its_keys() {
        let schema = json!({"properties": {"count": {}, "species": {}}, "required": ["species"]});
        assert_eq!(schema_keys(Some(&schema)).as_deref(), Some("count, species (required)"));
        assert_eq!(schema_keys(Some(&json!({}))), None);
        assert_eq!(schema_keys(None), None);
    }

    #[test]
    fn an_empty_registry_says_so() {
        assert!(to_text(&Registry::new()).starts_with("No plugins"));
        assert_eq!(to_json(&Registry::new()), json!({"plugins": [], "refused": [], "notes": []}));
    }
}
