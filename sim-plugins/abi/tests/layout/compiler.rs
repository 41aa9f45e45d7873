//! Compiles a program that prints the header's layout, as C11 and as C++11, and runs it.

use std::{env, fmt::Write, fs, path::Path, process::Command};

use crate::header::Header;

pub struct Language {
    pub name: &'static str,
    /// Environment variable that names the compiler, and the names to try without it.
    variable: &'static str,
    compilers: &'static [&'static str],
    standard: &'static str,
    file: &'static str,
}

pub const C11: Language = Language {
    name: "C11",
    variable: "CC",
    compilers: &["cc", "gcc", "clang"],
    standard: "-std=c11",
    file: "layout.c",
};
pub const CPP11: Language = Language {
    name: "C++11",
    variable: "CXX",
    compilers: &["c++", "g++", "clang++"],
    standard: "-std=c++11",
    file: "layout.cpp",
};

/// The report of the compiled program; None (with a printed reason) where there is no compiler.
pub fn report(language: &Language, header: &Header) -> Option<String> {
    let Some(compiler) = find(language) else {
        skip(&format!(
            "no {} compiler (tried {:?} and ${})",
            language.name, language.compilers, language.variable
        ));
        return None;
    };
    let folder = tempfile::tempdir().expect("a folder for the program");
    let source = folder.path().join(language.file);
    let program = folder.path().join("layout");
    fs::write(&source, program_text(header)).expect("the program is written");
    let include = Path::new(env!("CARGO_MANIFEST_DIR"));
    let output = Command::new(&compiler)
        .args([language.standard, "-Wall", "-Wextra", "-Wpadded", "-Werror", "-I"])
        .arg(include)
        .arg(&source)
        .arg("-o")
        .arg(&program)
        .output()
        .expect("the compiler starts");
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{compiler} ({}) refused the header:\n{messages}", language.name);
    let output = Command::new(&program).output().expect("the program starts");
    assert!(output.status.success(), "the compiled program failed");
    Some(String::from_utf8(output.stdout).expect("the program prints text"))
}

/// Prints the reason why a test is skipped; fails where everything is required.
pub fn skip(reason: &str) {
    let required = env::var("REEF_REQUIRE").is_ok_and(|value| value == "all");
    assert!(!required, "REEF_REQUIRE=all, but there is {reason}");
    println!("skipped: {reason}");
}

/// A compiler of this language that runs.
pub fn find(language: &Language) -> Option<String> {
    let works =
        |name: &String| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success());
    let named = env::var(language.variable).ok();
    named.into_iter().chain(language.compilers.iter().map(|c| (*c).to_owned())).find(works)
}

/// The entry is only declared by the header; the program defines one, as a plugin does.
fn program_text(header: &Header) -> String {
    let mut text = String::from(
        "#include \"reef_sim.h\"\n#include <stdio.h>\n\
         static const reef_descriptor *const none[1] = {NULL};\n\
         const reef_entry reef_sim_entry = {\n  REEF_MAGIC, sizeof(reef_entry), \
         REEF_VERSION, REEF_HEADER_HASH, 1, 0, none, NULL, NULL};\n\
         typedef unsigned long long wide;\nint main(void) {\n",
    );
    let mut line = |format: &str, arguments: &[String]| {
        // Writing to a String cannot fail.
        let _ = write!(text, "  printf(\"{format}\\n\"");
        for argument in arguments {
            let _ = write!(text, ", (wide)({argument})");
        }
        text.push_str(");\n");
    };
    for (name, _) in &header.constants {
        line(&format!("{name} %llu"), std::slice::from_ref(name));
    }
    for s in &header.structs {
        let name = &s.name;
        line(&format!("{name} %llu %llu"), &[format!("sizeof({name})"), format!("__alignof__({name})")]);
        for f in &s.fields {
            let field = &f.name;
            let value = format!("(({name} *)0)->{field}");
            line(
                &format!("{name}.{field} %llu %llu %llu"),
                &[
                    format!("offsetof({name}, {field})"),
                    format!("sizeof({value})"),
                    format!("__alignof__({value})"),
                ],
            );
        }
    }
    text.push_str("  return 0;\n}\n");
    text
}
