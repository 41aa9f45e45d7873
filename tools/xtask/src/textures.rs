//! `cargo xtask textures`: the committed textures, painted anew by `tools/textures`.

use crate::{Failure, Outcome, cargo, run};

/// Writes assets/textures.
pub fn textures(arguments: &[String]) -> Outcome {
    if let Some(unknown) = arguments.first() {
        return Err(Failure::usage(format!("cargo xtask textures takes no `{unknown}`")));
    }
    run(cargo().args(["run", "--quiet", "--package", "reef-textures"]), "the textures' generator")
}
