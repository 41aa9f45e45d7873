//! `reef shaders`: compiles the folder of shaders into what the program embeds. For those who work on Reef
//! itself; hidden from the list of commands, and reached through `cargo xtask shaders`, which builds the
//! program with its compiler.

use std::{
    collections::BTreeMap,
    io::Write,
    path::{Path, PathBuf},
};

use reef_command::Common;
use reef_gpu::shader_sources::{self, Entry, MANIFEST, Manifest, SPIRV};
use reef_report::{
    failure::{Failure, Outcome},
    say::say,
};

/// Options of `reef shaders`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// The folder with the GLSL.
    pub folder: PathBuf,
    /// The Rust file that embeds what was compiled.
    pub embedded: PathBuf,
    /// Compile all, not only what changed.
    #[arg(long)]
    pub all: bool,
}

/// Compiles what changed, and writes SPIR-V, manifest and the list of what is embedded.
pub fn run(_common: &Common, args: &Args) -> Outcome {
    let folder = &args.folder;
    // What the shaders share with Rust comes first: they include it.
    write(&folder.join(reef_render::shared::FILE), reef_render::shared::glsl().as_bytes())?;
    let stages = shader_sources::stages(folder).map_err(input)?;
    let before = shader_sources::manifest(folder).unwrap_or_default();
    let mut manifest = Manifest::default();
    let mut broken = Vec::new();
    let compiler = compiler()?;
    for stage in &stages {
        let target = shader_sources::spirv_path(folder, &stage.name);
        let kept = std::fs::read(&target).ok().filter(|spirv| {
            !args.all
                && before.shaders.get(&stage.name).is_some_and(|entry| {
                    entry.source == stage.hash && entry.spirv == shader_sources::hash(spirv)
                })
        });
        let spirv = match kept {
            Some(spirv) => spirv,
            None => match compiler(&folder.join(&stage.name)) {
                Ok(spirv) => {
                    say(format_args!("{} ({} bytes)", stage.name, spirv.len()));
                    write(&target, &spirv)?;
                    spirv
                }
                Err(text) => {
                    broken.push(text);
                    continue;
                }
            },
        };
        let entry = Entry { source: stage.hash.clone(), spirv: shader_sources::hash(&spirv) };
        manifest.shaders.insert(stage.name.clone(), entry);
    }
    if !broken.is_empty() {
        return Err(Failure::check(miette::miette!("{}", broken.join("\n"))));
    }
    remove_orphans(folder, &manifest.shaders)?;
    let mut text = serde_json::to_vec_pretty(&manifest).map_err(|error| input_text(error.to_string()))?;
    text.push(b'\n');
    write(&folder.join(MANIFEST), &text)?;
    write(&args.embedded, embedded(manifest.shaders.keys()).as_bytes())?;
    say(format_args!("{} shaders are up to date", stages.len()));
    Ok(())
}

/// The Rust file that embeds the SPIR-V.
fn embedded<'a>(names: impl Iterator<Item = &'a String>) -> String {
    let mut text = String::from(
        "//! Every shader as SPIR-V. Written by `cargo xtask shaders`; do not edit.\n\n\
         /// File name in `shaders/` → SPIR-V.\n\
         pub(crate) const SHADERS: &[(&str, &[u8])] = &[\n",
    );
    for name in names {
        text += &format!("    ({name:?}, include_bytes!(\"../../../shaders/{SPIRV}/{name}.spv\")),\n");
    }
    text + "];\n"
}

/// SPIR-V whose source is gone.
fn remove_orphans(folder: &Path, known: &BTreeMap<String, Entry>) -> Outcome {
    let spirv = folder.join(SPIRV);
    let entries =
        std::fs::read_dir(&spirv).map_err(|error| input_text(format!("{}: {error}", spirv.display())))?;
    for path in entries.flatten().map(|entry| entry.path()) {
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        if path.extension().is_some_and(|e| e == "spv") && !known.contains_key(&stem) {
            std::fs::remove_file(&path)
                .map_err(|error| input_text(format!("{}: {error}", path.display())))?;
        }
    }
    Ok(())
}

/// Beside the file first, then in its place.
fn write(path: &Path, bytes: &[u8]) -> Outcome {
    let folder = path.parent().unwrap_or(Path::new("."));
    let written = std::fs::create_dir_all(folder).and_then(|()| {
        let mut beside = tempfile::Builder::new().permissions(permissions()).tempfile_in(folder)?;
        beside.write_all(bytes)?;
        beside.persist(path).map_err(|error| error.error)?;
        Ok(())
    });
    written.map_err(|error| input_text(format!("{}: {error}", path.display())))
}

/// What a file of a working tree has; a temporary file would be its owner's alone.
#[cfg(unix)]
fn permissions() -> std::fs::Permissions {
    std::os::unix::fs::PermissionsExt::from_mode(0o644)
}

fn input(error: shader_sources::SourceError) -> Failure {
    input_text(error.to_string())
}

fn input_text(text: String) -> Failure {
    Failure::input(miette::miette!("{text}"))
}

type Compile = dyn Fn(&Path) -> Result<Vec<u8>, String>;

#[cfg(feature = "shaderc")]
fn compiler() -> Result<Box<Compile>, Failure> {
    let compiler = reef_gpu::Compiler::new().map_err(|text| Failure::machine(miette::miette!("{text}")))?;
    Ok(Box::new(move |path| compiler.compile(path)))
}

#[cfg(not(feature = "shaderc"))]
fn compiler() -> Result<Box<Compile>, Failure> {
    Err(Failure::machine(miette::miette!(
        help = "cargo xtask shaders builds it with one",
        "this program was built without a shader compiler"
    )))
}
