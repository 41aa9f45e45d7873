//! `reef plugin new`: a folder with a plugin that builds, is found, and shows something moving.

mod name;

use std::{
    env::consts::{DLL_PREFIX, DLL_SUFFIX},
    fs,
    path::{Path, PathBuf},
};

use reef_command::Common;
use reef_files as files;
use reef_report::{
    failure::{Failure, Outcome},
    say::{say, shown},
};
use serde_json::json;

/// Options of `reef plugin new`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// Name of the plugin, and of the folder that is made for it: lower-case letters, digits and `-`. A path
    /// makes the folder there.
    #[arg(value_name = "NAME")]
    pub folder: PathBuf,
    /// The language of its source.
    #[arg(long, value_enum, default_value_t = Language::Rust)]
    pub lang: Language,
    /// Folder of the crate reef-sdk, for --lang rust; found in the checkout without it.
    #[arg(long, value_name = "DIR")]
    pub sdk: Option<PathBuf>,
}

/// A language that there is a scaffold in.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// On reef-sdk: one trait to implement, no `unsafe`.
    Rust,
    /// Against reef_sim.h and reef_state.h alone, which are copied into the folder.
    C,
}

/// The contract that this program keeps; plugins in C get a copy.
const HEADER: &str = include_str!("../../../../../sim-plugins/abi/reef_sim.h");
const STATE_HEADER: &str = include_str!("../../../../../sim-plugins/abi/reef_state.h");

/// Makes the folder, whole or not at all.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let name = name::of(&args.folder).map_err(Failure::input)?;
    if fs::symlink_metadata(&args.folder).is_ok() {
        let there = args.folder.display();
        return Err(Failure::input(miette::miette!(
            help = "choose another name, or remove it first: nothing is ever written over",
            "{there} is there already"
        )));
    }
    let parent =
        args.folder.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let files = match args.lang {
        Language::Rust => rust(&name, &sdk(parent, args.sdk.as_deref())?)?,
        Language::C => c(&name),
    };
    write(&args.folder, &files).map_err(|problem| {
        Failure::input(miette::miette!("{} cannot be made: {problem}", args.folder.display()))
    })?;

    let (build, plugins) = match args.lang {
        Language::Rust => ("cargo build", "target/debug"),
        Language::C => ("make", "."),
    };
    let folder = args.folder.display();
    let commands = [
        format!("cd {folder}"),
        build.to_owned(),
        format!("reef plugin check {plugins}/{}", library(args.lang, &name)),
        format!("reef scene.toml --plugin-dir {plugins}"),
    ];
    if common.json {
        let files: Vec<&str> = files.iter().map(|(path, _)| *path).collect();
        say(json!({ "folder": shown(&args.folder), "id": id(&name), "files": files, "commands": commands }));
        return Ok(());
    }
    say(format_args!("{folder}: the plugin {}, and a scene that shows it. Next:", id(&name)));
    for command in commands {
        say(format_args!("  {command}"));
    }
    Ok(())
}

/// The plugin's id until its author has a vendor's name for it.
fn id(name: &str) -> String {
    format!("my.{name}")
}

/// The file that a build makes.
fn library(language: Language, name: &str) -> String {
    let stem = match language {
        Language::Rust => name.replace('-', "_"),
        Language::C => name.to_owned(),
    };
    format!("{DLL_PREFIX}{stem}{DLL_SUFFIX}")
}

/// Files of a scaffold: path in the folder, content.
type Files = Vec<(&'static str, String)>;

/// Fills a template in.
fn filled(template: &str, name: &str) -> String {
    let mut title = name.replace('-', " ");
    title[..1].make_ascii_uppercase(); // A name begins with an ASCII letter.
    template
        .replace("@name@", name)
        .replace("@title@", &title)
        .replace("@id@", &id(name))
        .replace("@library@", &library(Language::C, name))
        .replace("@crate-library@", &library(Language::Rust, name))
}

fn c(name: &str) -> Files {
    vec![
        ("plugin.c", filled(include_str!("templates/plugin.c.in"), name)),
        ("Makefile", filled(include_str!("templates/Makefile.in"), name)),
        ("scene.toml", filled(include_str!("templates/scene.toml.in"), name)),
        ("README.md", filled(include_str!("templates/README-c.md.in"), name)),
        ("reef_sim.h", HEADER.to_owned()),
        ("reef_state.h", STATE_HEADER.to_owned()),
    ]
}

fn rust(name: &str, sdk: &Path) -> Result<Files, Failure> {
    let Some(path) = sdk.to_str() else {
        return Err(Failure::input(miette::miette!(
            "{}: a Cargo.toml cannot name this path, which is not UTF-8",
            sdk.display()
        )));
    };
    let path = toml::Value::String(path.to_owned()).to_string();
    let mut files = vec![
        ("Cargo.toml", filled(include_str!("templates/Cargo.toml.in"), name).replace("@sdk@", &path)),
        ("src/lib.rs", filled(include_str!("templates/lib.rs.in"), name)),
        ("scene.toml", filled(include_str!("templates/scene.toml.in"), name)),
        ("README.md", filled(include_str!("templates/README-rust.md.in"), name)),
        (".gitignore", "/target/\n".to_owned()),
    ];
    // The checkout's versions of what the SDK needs: the same ones, and already downloaded. Cargo drops the
    // rest.
    if let Ok(lock) = fs::read_to_string(sdk.join("../../Cargo.lock")) {
        files.push(("Cargo.lock", lock));
    }
    Ok(files)
}

/// The crate reef-sdk: where somebody says, else in the checkout around the new folder, the program or the
/// working folder.
fn sdk(parent: &Path, wanted: Option<&Path>) -> Result<PathBuf, Failure> {
    let is_one = |folder: &Path| {
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap_or_default();
        manifest.lines().any(|line| line.replace(' ', "") == "name=\"reef-sdk\"")
    };
    let found = match wanted {
        Some(wanted) if is_one(wanted) => fs::canonicalize(wanted).ok(),
        Some(wanted) => {
            return Err(Failure::input(miette::miette!(
                help = "in a checkout of Reef it is sim-plugins/sdk",
                "--sdk {}: there is no crate reef-sdk in this folder",
                wanted.display()
            )));
        }
        None => {
            let starts = [
                fs::canonicalize(parent).ok(),
                reef_files::program().ok().and_then(|program| fs::canonicalize(program).ok()),
            ];
            let mut folders = starts.iter().flatten().flat_map(|start| start.ancestors());
            folders.find_map(|folder| {
                let sdk = folder.join("sim-plugins/sdk");
                is_one(&sdk).then_some(sdk)
            })
        }
    };
    let Some(found) = found else {
        return Err(Failure::input(miette::miette!(
            help = "name it with --sdk DIR (in a checkout: sim-plugins/sdk), or use --lang c, which needs no SDK",
            "a plugin in Rust depends on the crate reef-sdk by its path, and no checkout of Reef lies around the new \
             folder or the program"
        )));
    };
    // A plugin of another contract would be refused when it is loaded: better now, with the reason.
    let theirs = fs::read_to_string(found.join("../abi/reef_sim.h")).unwrap_or_default();
    if theirs.lines().ne(HEADER.lines()) {
        return Err(Failure::input(miette::miette!(
            help = "build reef from that checkout, or name the SDK that fits with --sdk DIR",
            "{}: this SDK is made for another reef_sim.h than this program",
            found.display()
        )));
    }
    Ok(found)
}

/// Makes the folder with these files in it; `Err`: why not.
fn write(folder: &Path, content: &Files) -> Result<(), String> {
    let out = files::Folder::create(folder).map_err(|error| error.problem)?;
    for (path, text) in content {
        let path = out.part().join(path);
        let made = path.parent().map_or(Ok(()), fs::create_dir_all).and_then(|()| fs::write(&path, text));
        made.map_err(|error| error.to_string())?;
    }
    out.finish().map_err(|error| error.problem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_placeholder_is_left_in_any_file() {
        let sdk = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../sim-plugins/sdk");
        for (path, content) in rust("two-words", &sdk).unwrap().into_iter().chain(c("two-words")) {
            let left: Vec<&str> = content.split('@').skip(1).step_by(2).collect();
            assert!(
                !left
                    .iter()
                    .any(|word| ["name", "title", "id", "sdk", "library", "crate-library"].contains(word)),
                "{path}: {left:?}"
            );
        }
        assert!(c("two-words")[0].1.contains("\"Two words\""));
    }

    #[test]
    fn a_folder_is_made_whole_or_not_at_all() {
        let parent = tempfile::tempdir().unwrap();
        let names = || fs::read_dir(parent.path()).unwrap().count();
        let bad: Files = vec![("a", String::new()), ("a/b", String::new())];
        assert!(write(&parent.path().join("new"), &bad).is_err());
        assert_eq!(names(), 0);
        write(&parent.path().join("new"), &c("new")).unwrap();
        assert_eq!((names(), fs::read_dir(parent.path().join("new")).unwrap().count()), (1, 6));
        let missing = parent.path().join("no/such");
        assert!(write(&missing.join("new"), &bad).unwrap_err().contains("there is no folder"));
    }
}
