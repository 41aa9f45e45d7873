//! The same code loaded anew in the middle of a run changes no byte.

use std::process::Command;

use reef_tests::artifacts::{artifacts, workspace};

#[test]
fn a_reload_of_the_same_code_changes_no_hash() {
    let installed = artifacts().side_by_side(&["reef_anemone"]);
    let hash = |more: &[&str]| {
        let output = Command::new(installed.path().join("reef"))
            .args(["sim", "anemone-fig12-singularities", "--steps", "40", "--hash", "--assets"])
            .arg(workspace().join("assets"))
            .args(more)
            .output()
            .expect("reef runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8_lossy(&output.stdout);
        text.lines().filter(|line| line.starts_with("step ")).map(String::from).collect::<Vec<_>>()
    };
    let plain = hash(&[]);
    assert_eq!(plain.len(), 40);
    for at in ["1", "17", "40"] {
        assert_eq!(hash(&["--reload-at", at]), plain, "reloaded at step {at}");
    }
}
