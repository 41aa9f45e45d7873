//! `cargo xtask textures`: paints the textures anew.

use std::{
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

fn main() -> ExitCode {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/textures");
    let folder = std::env::args_os().nth(1).map_or(folder, PathBuf::from);
    match write_all(&folder) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("textures: {message}");
            ExitCode::FAILURE
        }
    }
}

/// Each file is written beside its place and renamed: it is there whole or not at all.
fn write_all(folder: &Path) -> Result<(), String> {
    let failed = |path: &Path, error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    fs::create_dir_all(folder).map_err(|error| failed(folder, &error))?;
    for (name, paint) in reef_textures::TEXTURES {
        let path = folder.join(name).with_extension("png");
        let beside = path.with_extension("png.new");
        let mut bytes = Vec::new();
        reef_textures::write_png(&mut bytes, &reef_textures::bytes(&paint().texels))
            .map_err(|error| failed(&path, &error))?;
        fs::write(&beside, &bytes).map_err(|error| failed(&beside, &error))?;
        fs::rename(&beside, &path).map_err(|error| failed(&path, &error))?;
        println!("{} ({} bytes)", path.display(), bytes.len());
    }
    Ok(())
}
