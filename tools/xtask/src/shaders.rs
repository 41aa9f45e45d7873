//! `cargo xtask shaders`: GLSL to the SPIR-V that is committed and embedded.
//!
//! The compiler is shaderc, behind a feature of the program: nobody who only builds Reef needs it. This chore
//! finds the system's shaderc, builds the program with it, lets it compile what changed, and has the result
//! looked at by spirv-val.

use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use crate::{Failure, Outcome, cargo, packages, root, run};

/// Compiles what changed; all with `--all`.
pub fn shaders(arguments: &[String]) -> Outcome {
    if let Some(unknown) = arguments.iter().find(|argument| *argument != "--all") {
        return Err(Failure::usage(format!("cargo xtask shaders [--all]: `{unknown}` is neither")));
    }
    packages::require(&["shaders"])?;
    let folder = library_folder()?;
    println!("Building the program with the shader compiler …");
    let mut reef = cargo();
    reef.env("SHADERC_LIB_DIR", &folder)
        .args(["run", "--quiet", "--package", "reef", "--features", "shaderc", "--", "shaders"])
        .arg(root().join("shaders"))
        .arg(root().join("host/gpu/src/embedded.rs"))
        .args(arguments);
    run(&mut reef, "reef shaders")?;
    validate(&root().join("shaders/spv"))
}

/// Has every SPIR-V file looked at.
fn validate(folder: &Path) -> Outcome {
    let entries =
        folder.read_dir().map_err(|error| Failure::check(format!("{}: {error}", folder.display())))?;
    let mut files: Vec<PathBuf> =
        entries.flatten().map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "spv")).collect();
    files.sort();
    for file in &files {
        let mut command = Command::new("spirv-val");
        command.args(["--target-env", "vulkan1.3", "--scalar-block-layout"]).arg(file);
        run(&mut command, &format!("spirv-val {}", file.display()))?;
    }
    println!("spirv-val agrees with all {}", files.len());
    Ok(())
}

/// Where the system keeps libshaderc.
fn library_folder() -> Result<PathBuf, Failure> {
    if let Some(given) = std::env::var_os("SHADERC_LIB_DIR") {
        return Ok(PathBuf::from(given));
    }
    // The C compiler knows which of the folders is this machine's.
    let triple = Command::new("cc").arg("-print-multiarch").stderr(Stdio::null()).output().ok();
    let triple = triple.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    let multiarch = triple.filter(|t| !t.is_empty()).map(|t| PathBuf::from("/usr/lib").join(t));
    let others =
        ["/usr/lib64", "/usr/lib", "/usr/local/lib", "/opt/homebrew/lib"].into_iter().map(PathBuf::from);
    multiarch
        .into_iter()
        .chain(others)
        .find(|folder| {
            ["libshaderc_combined.a", "libshaderc.a"].iter().any(|name| folder.join(name).is_file())
        })
        .ok_or_else(|| {
            Failure::machine(
                "libshaderc_combined.a is not where libraries are: set SHADERC_LIB_DIR to its folder",
            )
        })
}
