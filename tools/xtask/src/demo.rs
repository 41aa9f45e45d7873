//! `cargo xtask demo`: from a fresh clone to the sea, in a window or, where there is no display, as a
//! picture.

use std::{
    env,
    path::Path,
    process::{Command, ExitStatus},
};

use crate::{Failure, Outcome, artifacts, packages, root, steps::Steps};

/// What `reef` takes a value for, in the window and in `render`, besides the scene.
const WITH_VALUE: [&str; 13] = [
    "--frames",
    "--size",
    "--journal",
    "--out",
    "--fps",
    "--from",
    "--plugin-dir",
    "--device",
    "--workers",
    "--seed",
    "--assets",
    "--quality",
    "--patience",
];

/// Sets up what the demo needs, builds the program and its plugins, and shows the sea.
pub fn demo(arguments: &[String]) -> Outcome {
    let display =
        ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| env::var_os(name).is_some_and(|v| !v.is_empty()));
    let picture = (!display).then(|| Picture::asked_for(arguments, &root())).transpose()?;
    let mut steps = Steps::of(2);
    steps.take("look for what the demo needs", || {
        packages::require(if display { &["run", "window"] } else { &["run"] })
    })?;
    let built = steps.take("build the program and its plugins", artifacts::build)?;
    let mut reef = Command::new(&built.program);
    reef.current_dir(root()).arg("--plugin-dir").arg(&built.plugins);
    let Some(picture) = picture else {
        println!("Opening the sea in a window …");
        return show(reef.args(arguments));
    };
    println!("No display here: rendering the sea to {} …", picture.out);
    if let Some(note) = &picture.note {
        println!("{note}");
    }
    if let Some(folder) = Path::new(&picture.out).parent() {
        let made = std::fs::create_dir_all(root().join(folder));
        made.map_err(|error| {
            Failure::usage(format!("cannot make the folder {}: {error}", folder.display()))
        })?;
    }
    show(reef.args(&picture.arguments))
}

/// Runs the program to its end; its own messages say what was wrong, so only its exit code goes on.
fn show(reef: &mut Command) -> Outcome {
    let status = reef.status().map_err(|error| Failure::machine(format!("reef: {error}")))?;
    if status.success() {
        Ok(())
    } else {
        Err(Failure { code: code(status), message: format!("reef ended with {status}") })
    }
}

/// The program's exit code where it is one of those that Reef uses.
fn code(status: ExitStatus) -> u8 {
    status.code().and_then(|code| u8::try_from(code).ok()).filter(|code| (1..=3).contains(code)).unwrap_or(1)
}

/// What `reef render` is asked for in place of a window.
#[derive(Debug, PartialEq)]
struct Picture {
    arguments: Vec<String>,
    out: String,
    /// What is done differently from a window.
    note: Option<String>,
}

impl Picture {
    /// Hands on all that `reef render` understands (it refuses the rest by name), and adds what nobody chose.
    fn asked_for(arguments: &[String], root: &Path) -> Result<Self, Failure> {
        let mut scene = None;
        let mut options: Vec<String> = Vec::new();
        let mut words = arguments.iter();
        while let Some(word) = words.next() {
            let name = word.split_once('=').map_or(word.as_str(), |(name, _)| name);
            if name == "--journal" {
                return Err(Failure::usage(
                    "--journal writes down what hands do in a window, and there is no display here \
                     (neither DISPLAY nor WAYLAND_DISPLAY is set)",
                ));
            }
            if word.starts_with('-') {
                options.push(word.clone());
                if WITH_VALUE.contains(&word.as_str()) {
                    options.extend(words.next().cloned());
                }
            } else if let Some(first) = scene.replace(word.clone()) {
                return Err(Failure::usage(format!("one scene at a time: {first} or {word}")));
            }
        }
        let value = |name: &str| {
            let at =
                options.iter().rposition(|word| word == name || word.starts_with(&format!("{name}=")))?;
            match options[at].split_once('=') {
                Some((_, value)) => Some(value.to_owned()),
                None => options.get(at + 1).cloned(),
            }
        };
        let note = value("--frames").map(|frames| {
            format!("--frames {frames} ends a window after that many frames; here it renders as many, and a picture is the last")
        });
        let out = value("--out").unwrap_or_else(|| root.join("out/demo.png").display().to_string());
        let scene = scene.unwrap_or_else(|| root.join("assets/scenes/reef.toml").display().to_string());
        let defaults = [("--frames", "1"), ("--from", "6"), ("--size", "1280x720"), ("--out", &out)];
        let missing = defaults.into_iter().filter(|(name, _)| value(name).is_none());
        let missing: Vec<String> =
            missing.flat_map(|(name, value)| [name.to_owned(), value.to_owned()]).collect();
        let arguments = ["render".to_owned(), scene].into_iter().chain(options).chain(missing).collect();
        Ok(Self { arguments, out, note })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked_for(line: &str) -> Result<Picture, Failure> {
        let words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        Picture::asked_for(&words, Path::new("/reef"))
    }

    fn rendered(line: &str) -> String {
        asked_for(line).unwrap().arguments.join(" ")
    }

    #[test]
    fn without_a_wish_it_is_a_picture_of_the_default_scene() {
        assert_eq!(
            rendered(""),
            "render /reef/assets/scenes/reef.toml --frames 1 --from 6 --size 1280x720 --out /reef/out/demo.png"
        );
    }

    #[test]
    fn what_render_understands_is_handed_on_wherever_the_scene_stands() {
        for line in ["my.toml --seed 7 --size=64x36 --json", "--seed 7 --size=64x36 --json my.toml"] {
            assert_eq!(
                rendered(line),
                "render my.toml --seed 7 --size=64x36 --json --frames 1 --from 6 --out /reef/out/demo.png"
            );
        }
        let film = asked_for("--out a.mp4 --frames 60 --from 2 --size 64x36").unwrap();
        assert_eq!(film.out, "a.mp4");
        assert_eq!(
            film.arguments.join(" "),
            "render /reef/assets/scenes/reef.toml --out a.mp4 --frames 60 --from 2 --size 64x36"
        );
        let waiting = rendered("reef --patience 90 --quality low");
        assert!(waiting.starts_with("render reef --patience 90 --quality low"), "{waiting}");
        // What nobody knows is render's to refuse, by name.
        assert!(rendered("--colour red").contains(" --colour"));
    }

    #[test]
    fn what_means_something_else_than_in_a_window_is_told() {
        assert_eq!(asked_for("--size 64x36").unwrap().note, None);
        for line in ["--frames 300", "--frames=300"] {
            let picture = asked_for(line).unwrap();
            assert!(picture.arguments.join(" ").contains(line));
            assert!(picture.note.unwrap().starts_with("--frames 300 ends a window"));
        }
    }

    #[test]
    fn what_needs_a_window_is_refused() {
        for line in ["--journal F", "--journal=F", "reef --seed 1 --journal F"] {
            let failure = asked_for(line).unwrap_err();
            assert_eq!(failure.code, 2);
            assert!(
                failure.message.contains("--journal") && failure.message.contains("no display"),
                "{line}"
            );
        }
        assert_eq!(asked_for("one two").unwrap_err().code, 2);
    }
}
