//! The guide for plugin authors: its code stands in files that tests build, its links lead somewhere, its
//! commands exist.

use std::{collections::BTreeSet, fs, process::Command};

use reef_streams::STREAMS;
use reef_tests::artifacts::{artifacts, workspace};

fn guide() -> String {
    fs::read_to_string(workspace().join("sim-plugins/README.md")).unwrap()
}

/// The fenced blocks of a language.
fn blocks(text: &str, language: &str) -> Vec<String> {
    let mut blocks = Vec::new();
    let mut open: Option<(bool, String)> = None;
    for line in text.lines() {
        match (&mut open, line.strip_prefix("```")) {
            (None, Some(kind)) => open = Some((kind == language, String::new())),
            (Some(_), Some(_)) => {
                let closed = open.take();
                blocks.extend(closed.filter(|(wanted, _)| *wanted).map(|(_, block)| block));
            }
            (Some((_, block)), None) => {
                block.push_str(line);
                block.push('\n');
            }
            (None, None) => {}
        }
    }
    assert!(open.is_none(), "a block is not closed");
    blocks
}

#[test]
fn every_piece_of_code_stands_in_a_file_that_a_test_builds() {
    let sources = |paths: &[&str]| -> Vec<String> {
        paths.iter().map(|path| fs::read_to_string(workspace().join(path)).unwrap()).collect()
    };
    let templates = "host/reef/src/headless/scaffold/templates";
    for (language, files, least) in [
        ("rust", sources(&["sim-plugins/examples/rust/src/lib.rs", &format!("{templates}/lib.rs.in")]), 5),
        ("c", sources(&["sim-plugins/examples/c/kelp.c", &format!("{templates}/plugin.c.in")]), 6),
    ] {
        let blocks = blocks(&guide(), language);
        assert!(blocks.len() >= least, "{} blocks of {language}", blocks.len());
        for block in blocks {
            assert!(
                files.iter().any(|file| file.contains(&block)),
                "this {language} stands in none:\n{block}"
            );
        }
    }
}

#[test]
fn the_guide_lists_the_streams_that_the_host_takes() {
    let text = guide();
    let rows = text.lines().skip_while(|line| *line != "| stream | for |").skip(2);
    let names = rows.take_while(|line| line.starts_with('|')).filter_map(|row| row.split('|').nth(1));
    let listed: BTreeSet<&str> = names.flat_map(|names| names.split(',').map(str::trim)).collect();
    let taken = STREAMS.iter().filter(|stream| stream.limit.is_some()).map(|stream| stream.name);
    assert_eq!(listed, taken.collect());
}

#[test]
fn every_link_leads_to_a_file() {
    let (folder, text) = (workspace().join("sim-plugins"), guide());
    let links: Vec<&str> =
        text.split("](").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0)).collect();
    assert!(links.len() > 3, "{links:?}");
    for link in links {
        assert!(folder.join(link).exists(), "{link}");
    }
}

#[test]
fn every_command_of_reef_has_the_options_that_the_guide_gives_it() {
    let shell = blocks(&guide(), "sh").concat().replace("\\\n", " ");
    let commands: Vec<Vec<&str>> = shell
        .lines()
        .filter_map(|line| line.find("reef ").map(|at| &line[at..]))
        .filter(|line| line.starts_with("reef ") && !line.starts_with("reef scene.toml"))
        .map(|line| line.split('#').next().unwrap_or(line).split_whitespace().skip(1).collect())
        .collect();
    assert!(commands.len() >= 6, "{commands:?}");
    for words in commands {
        let subcommand: Vec<&str> =
            words.iter().take(if words[0] == "plugin" { 2 } else { 1 }).copied().collect();
        let output = Command::new(artifacts().reef()).args(&subcommand).arg("--help").output().unwrap();
        assert!(output.status.success(), "{subcommand:?}");
        let help = String::from_utf8(output.stdout).unwrap();
        for option in words.iter().filter(|word| word.starts_with("--")) {
            assert!(help.contains(option), "reef {}: there is no {option}", subcommand.join(" "));
        }
    }
}
