//! Chores around Reef, reached as `cargo xtask NAME`: one door, nothing to install before it.

mod artifacts;
mod contract;
mod demo;
mod packages;
mod shaders;
mod steps;
mod textures;
mod watch;

use std::{
    env,
    io::Write,
    path::{Path, PathBuf},
    process::{Command, ExitCode},
};

use steps::Steps;

/// What went wrong, in one sentence, with the exit code that `reef` would use for it.
#[derive(Debug)]
struct Failure {
    code: u8,
    message: String,
}

impl Failure {
    fn check(message: impl Into<String>) -> Self {
        Self { code: 1, message: message.into() }
    }

    fn usage(message: impl Into<String>) -> Self {
        Self { code: 2, message: message.into() }
    }

    fn machine(message: impl Into<String>) -> Self {
        Self { code: 3, message: message.into() }
    }
}

type Outcome = Result<(), Failure>;

const HELP: &str = "\
Chores around Reef.

cargo xtask demo [SCENE] [OPTIONS]  set up, build, and show the sea: in a window, or as a picture where there is no display
cargo xtask watch PLUGIN [SCENE]    show the sea, and build the plugin anew whenever its sources are saved
cargo xtask test                    set up, build, and pass every test, the golden pictures included
cargo xtask faults [COUNT]          strike a plugin so often (1000) with every fault in every call: all must be survived
cargo xtask fuzz TARGET [OPTIONS]   give a reader of foreign files inputs that nobody would write; --minutes N (10)
cargo xtask lint                    formatting and clippy over the whole tree
cargo xtask shaders [--all]         compile the shaders that changed; needs shaderc
cargo xtask textures                paint assets/textures anew; the same pixels every time
cargo xtask contract                write the header's hash anew after a change of reef_sim.h
cargo xtask help                    this page";

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let rest = arguments.get(1..).unwrap_or_default();
    let outcome = match arguments.first().map(String::as_str) {
        Some("demo") => demo::demo(rest),
        Some("watch") => watch::watch(rest),
        Some("test") => test(rest),
        Some("faults") => faults(rest),
        Some("fuzz") => fuzz(rest),
        Some("lint") => lint(),
        Some("shaders") => shaders::shaders(rest),
        Some("textures") => textures::textures(rest),
        Some("contract") => contract::bless(&root()),
        None | Some("help" | "--help" | "-h") => {
            // A reader that went away read enough.
            let _ = writeln!(std::io::stdout().lock(), "{HELP}");
            Ok(())
        }
        Some(other) => Err(Failure::usage(format!("there is no chore `{other}`\n\n{HELP}"))),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("xtask: {}", failure.message);
            ExitCode::from(failure.code)
        }
    }
}

/// The workspace's folder: two above this package's.
fn root() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().and_then(Path::parent).unwrap_or(package).to_path_buf()
}

/// The cargo that runs this program.
fn cargo() -> Command {
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root());
    command
}

/// Runs a command to its end and turns a bad exit into a failure that names it.
fn run(command: &mut Command, what: &str) -> Outcome {
    let status = command.status().map_err(|error| Failure::machine(format!("{what}: {error}")))?;
    if status.success() { Ok(()) } else { Err(Failure::check(format!("{what} failed ({status})"))) }
}

/// Sets up what the tests need, then runs them all; none of them may be skipped.
fn test(arguments: &[String]) -> Outcome {
    let formatted = artifacts::has_component("fmt");
    let mut steps = Steps::of(5 + usize::from(formatted));
    steps.take("look for what the tests need", || {
        packages::require(&["run", "window", "validate", "window-tests", "compilers", "translators", "video"])
    })?;
    if formatted {
        steps.take("look at the formatting", || {
            run(cargo().args(["fmt", "--all", "--check"]), "cargo fmt --check")
        })?;
    }
    let built = steps.take("build the program and its plugins", artifacts::build)?;
    // Quiet runs of tests would hide the progress of what they build.
    steps.take("build the tests", || {
        run(cargo().args(["test", "--workspace", "--no-run"]), "cargo test --no-run")
    })?;
    steps.take("run the tests", || {
        run(
            cargo().env("REEF_REQUIRE", "all").args(["test", "--workspace", "--quiet"]).args(arguments),
            "cargo test",
        )
    })?;
    steps.take("compare all scenes with their golden pictures", || {
        let mut validate = Command::new(&built.program);
        validate.current_dir(root()).arg("--plugin-dir").arg(&built.plugins).arg("validate");
        run(&mut validate, "reef validate")
    })?;
    steps.end();
    Ok(())
}

/// Which targets there are, it says itself.
fn fuzz(arguments: &[String]) -> Outcome {
    let mut command = cargo();
    command.args(["run", "--quiet", "--package", "reef-fuzz", "--"]).args(arguments);
    run(&mut command, "reef-fuzz")
}

/// The test of strikes with a count of its own: as many processes as it takes, about a quarter of an hour for
/// a thousand.
fn faults(arguments: &[String]) -> Outcome {
    let count = match arguments {
        [] => 1000,
        [count] => count
            .parse::<u32>()
            .map_err(|_| Failure::usage(format!("COUNT is a whole number, not `{count}`")))?,
        _ => return Err(Failure::usage("cargo xtask faults [COUNT]")),
    };
    run(
        cargo()
            .env("REEF_FAULTS", count.to_string())
            .args(["test", "--quiet", "--package", "reef-tests", "--test", "reload", "--"])
            .args(["strikes::every_fault", "--nocapture"]),
        "the test of strikes",
    )
}

/// Formatting, and clippy without a warning.
fn lint() -> Outcome {
    run(cargo().args(["fmt", "--all", "--check"]), "cargo fmt --check")?;
    run(cargo().args(["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]), "cargo clippy")
}
