//! Only with the feature `shaderc`: names the libraries that the system's shaderc was built without.
//!
//! Debian's and Fedora's libshaderc leaves glslang and SPIRV-Tools to whoever links it. Their archives differ
//! from release to release, so that those which are there are linked, and those which are not belong to
//! another.

use std::{env, path::Path};

/// In the order in which the linker has to see them.
const ARCHIVES: [&str; 9] = [
    "glslang",
    "MachineIndependent",
    "GenericCodeGen",
    "OGLCompiler",
    "OSDependent",
    "SPIRV",
    "glslang-default-resource-limits",
    "SPIRV-Tools-opt",
    "SPIRV-Tools",
];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=SHADERC_LIB_DIR");
    if env::var_os("CARGO_FEATURE_SHADERC").is_none() {
        return;
    }
    let Ok(folder) = env::var("SHADERC_LIB_DIR") else {
        println!("cargo::warning=build shaders with `cargo xtask shaders`: it sets SHADERC_LIB_DIR");
        return;
    };
    println!("cargo::rustc-link-search=native={folder}");
    for archive in ARCHIVES {
        if Path::new(&folder).join(format!("lib{archive}.a")).is_file() {
            println!("cargo::rustc-link-lib=static:-bundle={archive}");
        }
    }
    println!("cargo::rustc-link-lib=dylib=stdc++");
}
