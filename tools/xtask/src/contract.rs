//! The hash of reef_sim.h, which stands in the header itself and in its Rust mirror.

use std::{fs, path::Path};

use crate::{Failure, Outcome};

const LINE: &str = "#define REEF_HEADER_HASH";

/// FNV-1a (64 bits) over the header without the line that holds the hash.
fn hash(header: &str) -> u64 {
    let rest: Vec<&str> = header.split('\n').filter(|line| !line.starts_with(LINE)).collect();
    rest.join("\n").bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// Writes the present hash into both files.
pub fn bless(root: &Path) -> Outcome {
    let header_path = root.join("sim-plugins/abi/reef_sim.h");
    let mirror_path = root.join("sim-plugins/abi/src/lib.rs");
    let header = read(&header_path)?;
    let hash = hash(&header);
    replace(&header_path, &header, LINE, &format!("{LINE} 0x{hash:016x}ull"))?;
    let mirror = read(&mirror_path)?;
    let line = "pub const HEADER_HASH: u64 =";
    replace(&mirror_path, &mirror, line, &format!("{line} 0x{hash:016x};"))?;
    println!("reef_sim.h: {hash:016x}");
    Ok(())
}

fn read(path: &Path) -> Result<String, Failure> {
    fs::read_to_string(path).map_err(|error| Failure::usage(format!("{}: {error}", path.display())))
}

/// Puts `new` in place of the one line that begins with `start`.
fn replace(path: &Path, text: &str, start: &str, new: &str) -> Outcome {
    let lines: Vec<&str> =
        text.split('\n').map(|line| if line.starts_with(start) { new } else { line }).collect();
    fs::write(path, lines.join("\n")).map_err(|error| Failure::usage(format!("{}: {error}", path.display())))
}
