//! The example in Zig, built by a compiler at hand: `zig`, or the package `ziglang` of PyPI.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::Duration,
};

use tempfile::TempDir;

use crate::{artifacts::workspace, child};

/// The compilers that are tried.
const COMPILERS: [&[&str]; 2] = [&["zig"], &["python3", "-m", "ziglang"]];
/// Versions that the example is written for: each of Zig's breaks some of what was.
const VERSIONS: [&str; 5] = ["0.13", "0.14", "0.15", "0.16", "0.17"];
/// The longest that a call of it may take: from 0.16 on, the first one makes the translator itself.
const LIMIT: Duration = Duration::from_mins(20);

/// A library that was built in a folder of its own.
#[derive(Debug)]
pub struct Built {
    folder: TempDir,
}

impl Built {
    /// The library.
    pub fn library(&self) -> PathBuf {
        self.folder.path().join("libblade.so")
    }
}

/// Reads the header by `zig translate-c`, holds its structs and constants against the header's own words,
/// and builds the example. None: there is no compiler for it; then the reason is printed. No package of a
/// distribution is asked for, so no test requires it.
///
/// # Panics
/// When the header is not understood, or the example does not build.
pub fn blade() -> Option<Built> {
    let Some((compiler, version)) = COMPILERS.into_iter().find_map(|own| Some((own, version(own)?))) else {
        println!("skipped: there is no Zig: neither `zig` nor PyPI's `ziglang` for `python3`");
        return None;
    };
    if !VERSIONS.iter().any(|known| version.strip_prefix(known).is_some_and(|rest| rest.starts_with('.'))) {
        println!("skipped: this is Zig {version}; the example is for {VERSIONS:?}");
        return None;
    }
    let own = workspace().join("sim-plugins");
    let header = own.join("abi/reef_sim.h");
    let built = Built { folder: tempfile::tempdir().expect("a folder for the example") };
    let folder = built.folder.path();
    let translated = File::create(folder.join("reef_sim.zig")).expect("a file for the translation");
    let translate = ["translate-c", "-DREEF_NO_ASSERTS", "-DREEF_EXPORT=", &header.to_string_lossy()];
    run(compiler, folder, &translate, translated.into());
    fs::copy(own.join("examples/zig/blade.zig"), folder.join("blade.zig")).expect("the example is copied");
    let text = fs::read_to_string(&header).expect("the header");
    fs::write(folder.join("all.zig"), all(&text)).expect("the root is written");
    let build = ["build-lib", "-dynamic", "-O", "ReleaseSmall", "-femit-bin=libblade.so", "all.zig"];
    run(compiler, folder, &build, Stdio::null());
    Some(built)
}

/// What a compiler says it is; None: it does not run.
fn version(compiler: &[&str]) -> Option<String> {
    let output = Command::new(compiler[0]).args(&compiler[1..]).arg("version").output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

fn run(compiler: &[&str], folder: &Path, arguments: &[&str], into: Stdio) {
    let mut command = Command::new(compiler[0]);
    command.args(&compiler[1..]).args(arguments).current_dir(folder);
    command.env("ZIG_LOCAL_CACHE_DIR", folder.join("cache")).stdout(into).stderr(Stdio::piped());
    let output = child::wait(command.spawn().expect("zig starts"), LIMIT, "zig");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "zig {arguments:?}:\n{told}");
}

/// A root that has the example, and does not build where the translation of a struct or of a constant is
/// not what the header says.
fn all(header: &str) -> String {
    let mut text = String::from(
        "const reef = @import(\"reef_sim.zig\");\n\
         comptime {\n@setEvalBranchQuota(10000);\n_ = @import(\"blade.zig\");\n",
    );
    let mut must = |condition: String, what: &str| {
        text += &format!("if ({condition}) @compileError(\"{what}\");\n");
    };
    let (mut structs, mut constants) = (0, 0);
    for line in header.lines() {
        if let Some(layout) = line.strip_prefix("REEF_ASSERT_LAYOUT(reef_") {
            let mut parts = layout.trim_end_matches(");").split(", ");
            let mut next = || parts.next().expect("a struct, its size and its alignment");
            let (name, size, align) = (next(), next(), next());
            let own = format!("reef.reef_{name}");
            must(
                format!("@sizeOf({own}) != {size} or @alignOf({own}) != {align}"),
                &format!("layout of {own}"),
            );
            structs += 1;
        } else if let Some(define) = line.strip_prefix("#define REEF_") {
            let mut words = define.split_whitespace();
            let (name, value) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
            let value = value.trim_end_matches(['u', 'l']);
            if value.starts_with(|first: char| first == '-' || first.is_ascii_digit()) {
                must(format!("reef.REEF_{name} != {value}"), &format!("REEF_{name}"));
                constants += 1;
            }
        }
    }
    assert!(structs > 25 && constants > 60, "the header was not understood: {structs}, {constants}");
    text + "}\n"
}
