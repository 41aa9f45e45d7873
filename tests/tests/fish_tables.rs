//! Tables of fish that are wrong: the check of a scene tells each with its place, and what is allowed.

use std::{fs, process::Command};

use reef_tests::artifacts::{artifacts, workspace};

#[test]
fn no_wrong_table_of_a_fish_gets_through_the_check() {
    let program = artifacts().side_by_side(&["reef_fish"]);
    let folder = tempfile::tempdir().expect("a folder");
    let many = format!("[{}]", vec!["0.01"; 10_000].join(", "));
    let tables = [
        (
            "body = { lengths = [0.03], half_widths = [0.01], half_heights = [0.01] }".to_owned(),
            "odd.toml:2:20: species.odd.body.lengths: has 1 elements, but must have at least 2",
        ),
        (
            format!("body = {{ lengths = {many}, half_widths = {many}, half_heights = {many} }}"),
            "odd.toml:2:20: species.odd.body.lengths: has 10000 elements; the limit is 64",
        ),
        (
            "body = { lengths = [0.03, 0.03, 0.03], half_widths = [0.01, 0.01], half_heights = [0.01, 0.01, 0.01] }"
                .to_owned(),
            "odd.toml:2:20: species.odd.body.lengths: has 3 numbers; half_widths has 2",
        ),
        (
            "material = { long = -38.0 }".to_owned(),
            "odd.toml:2:21: species.odd.material.long: is -38, but must be a number above 0 and at most 1000000000 [N/m]",
        ),
        (
            "material = { mass = 0.0 }".to_owned(),
            "odd.toml:2:21: species.odd.material.mass: is 0, but must be a number from 0.000001 to 1000000 [kg]",
        ),
        (
            "mind = { prey = [\"silverside\", \"odd\"] }".to_owned(),
            "odd.toml:2:32: species.odd.mind.prey[1]: `odd` must not hunt itself",
        ),
    ];
    let path = folder.path().join("odd.toml");
    let path = path.to_str().expect("UTF-8");
    for (table, problem) in tables {
        let group = "species = \"odd\"\nlow = [-1.0, -4.0, -1.0]\nhigh = [1.0, -2.0, 1.0]\n";
        let text = format!(
            "[species.odd]\n{table}\n[modules.fish]\nuse = \"reef.fish\"\n[[modules.fish.groups]]\n{group}"
        );
        fs::write(path, text).expect("a scene");
        let output = Command::new(program.path().join("reef"))
            .args(["--assets".as_ref(), workspace().join("assets").as_os_str()])
            .args(["scene", "check", path])
            .env_remove("REEF_LOG")
            .output()
            .expect("the program runs");
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(!told.contains("panicked"), "{told}");
        assert!(told.contains(problem), "{told}");
    }
}
