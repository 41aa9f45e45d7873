//! The examples in C and C++, built by their own Makefiles with the compilers at hand.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use tempfile::TempDir;

use crate::{artifacts::workspace, skip};

/// A language other than Rust that a plugin is written in.
#[derive(Clone, Copy, Debug)]
pub struct Language {
    /// For people.
    pub name: &'static str,
    /// Folder of the example below sim-plugins/examples, and the end of its plugin's id.
    pub folder: &'static str,
    source: &'static str,
    /// Make's variable of the compiler, and where to look for one without it.
    compiler: &'static str,
    compilers: &'static [&'static str],
    /// Make's variable of more flags.
    flags: &'static str,
}

/// C11.
pub const C: Language = Language {
    name: "C",
    folder: "c",
    source: "kelp.c",
    compiler: "CC",
    compilers: &["cc", "gcc", "clang"],
    flags: "CFLAGS",
};

/// C++17.
pub const CPP: Language = Language {
    name: "C++",
    folder: "cpp",
    source: "kelp.cpp",
    compiler: "CXX",
    compilers: &["c++", "g++"],
    flags: "CXXFLAGS",
};

/// A library that was built in a folder of its own, alone there.
#[derive(Debug)]
pub struct Built {
    tree: TempDir,
    folder: PathBuf,
}

impl Built {
    /// The folder for --plugin-dir.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The library.
    pub fn library(&self) -> PathBuf {
        self.folder.join("libkelp.so")
    }

    /// A folder of this build's to write to.
    pub fn root(&self) -> &Path {
        self.tree.path()
    }
}

fn works(name: &str) -> bool {
    Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success())
}

impl Language {
    /// A compiler that is there, and `make`; else the reason is printed (and fails where everything is
    /// required).
    pub fn compiler(&self) -> Option<String> {
        let named = env::var(self.compiler).ok();
        let mut names = named.into_iter().chain(self.compilers.iter().map(|name| (*name).to_owned()));
        let Some(compiler) = names.find(|name| works(name)) else {
            skip(&format!(
                "there is no {} compiler (tried ${}, {:?})",
                self.name, self.compiler, self.compilers
            ));
            return None;
        };
        if !works("make") {
            skip("there is no `make`");
            return None;
        }
        Some(compiler)
    }

    /// Makes the example in a copy of its folder, every warning an error; `id`: under this id in place of its
    /// own.
    ///
    /// # Panics
    /// When it does not build.
    pub fn kelp(&self, id: Option<&str>) -> Option<Built> {
        let compiler = self.compiler()?;
        let tree = tempfile::tempdir().expect("a folder for the example");
        let folder = tree.path().join("sim-plugins/examples").join(self.folder);
        let header = tree.path().join("sim-plugins/abi");
        for new in [&folder, &header] {
            fs::create_dir_all(new).expect("a folder for the example");
        }
        let from = workspace().join("sim-plugins");
        for file in ["reef_sim.h", "reef_state.h"] {
            copy(&from.join("abi").join(file), &header.join(file));
        }
        for file in ["Makefile", self.source] {
            copy(&from.join("examples").join(self.folder).join(file), &folder.join(file));
        }
        let id = id.map(|id| format!(" -DKELP_ID='\"{id}\"'")).unwrap_or_default();
        let output = Command::new("make")
            .current_dir(&folder)
            .arg(format!("{}={compiler}", self.compiler))
            .arg(format!("{}=-Wall -Wextra -Wshadow -Werror{id}", self.flags))
            .output()
            .expect("make starts");
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{} with {compiler}:\n{told}", self.source);
        Some(Built { folder, tree })
    }
}

fn copy(from: &Path, to: &Path) {
    fs::copy(from, to).unwrap_or_else(|error| panic!("{}: {error}", from.display()));
}
