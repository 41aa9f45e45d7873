//! What another language makes of the header: Python's cffi reads it after the preprocessor.

use std::{env, fs, path::Path, process::Command};

use tempfile::TempDir;

use crate::{TEXT, compiler, header::Header};

/// The layout as Python's cffi sees it; None (with a printed reason) where there is none.
pub fn cffi(header: &Header) -> Option<String> {
    let python = ["python3", "/usr/bin/python3"].into_iter().find(|python| {
        Command::new(python).args(["-c", "import cffi"]).output().is_ok_and(|output| output.status.success())
    });
    let (Some(python), Some(compiler)) = (python, compiler::find(&compiler::C11)) else {
        compiler::skip("no Python with cffi, or no C compiler before it");
        return None;
    };
    let folder = tempfile::tempdir().expect("a folder for what it reads");
    let declarations = preprocessed(&compiler, &folder);
    let constants = folder.path().join("constants");
    fs::write(&constants, defines(header)).expect("the constants are written");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/layout/layout.py");
    let output = Command::new(python).arg(script).args([&declarations, &constants]).output();
    let output = output.expect("Python starts");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "cffi refused the header:\n{told}");
    Some(String::from_utf8(output.stdout).expect("Python prints text"))
}

/// The header after the preprocessor, without the system's headers: cffi knows their types.
fn preprocessed(compiler: &str, folder: &TempDir) -> std::path::PathBuf {
    for name in ["stddef.h", "stdint.h"] {
        fs::write(folder.path().join(name), "").expect("an empty header is written");
    }
    let output = Command::new(compiler)
        .args(["-E", "-P", "-nostdinc", "-DREEF_NO_ASSERTS", "-DREEF_EXPORT=", "-I"])
        .arg(folder.path())
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("reef_sim.h"))
        .output()
        .expect("the compiler starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let file = folder.path().join("declarations");
    fs::write(&file, output.stdout).expect("the declarations are written");
    file
}

/// The lines that define constants, as they stand in the header but for their comments.
fn defines(header: &Header) -> String {
    let lines = TEXT.lines().filter_map(|line| {
        let name = line.strip_prefix("#define ")?.split_whitespace().next()?;
        let constant = header.constants.iter().any(|(constant, _)| constant == name);
        constant.then(|| line.split("/*").next().unwrap_or(line).trim_end().to_owned() + "\n")
    });
    lines.collect()
}
