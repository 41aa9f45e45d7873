//! Whatever a schema allows gets an answer with a place, or is a sea of finite numbers.

use std::time::{Duration, Instant};

use reef_fuzz::{
    random::{Choose, seeded},
    ranges::{Case, Subject, subjects},
};

/// Cases of each subject in every run of the tests.
const CASES: usize = 20;

/// Tries cases; returns what is wrong, each kind once.
fn attempt(subject: &Subject, cases: impl Iterator<Item = Case>) -> Vec<String> {
    let mut wrong = Vec::new();
    for case in cases {
        let began = Instant::now();
        if let Err(problem) = subject.attempt(&case) {
            eprintln!("{problem}");
            wrong.push(problem);
        }
        if began.elapsed() > Duration::from_secs(5) {
            eprintln!("{}: {:?}", subject.words(&case), began.elapsed());
        }
    }
    wrong
}

#[test]
fn numbers_at_the_ends_of_their_ranges_are_answered_or_a_finite_sea() {
    let mut wrong = Vec::new();
    let mut random = seeded(18);
    for subject in subjects() {
        let singles = subject.singles(false);
        let cases: Vec<Case> = (0..CASES)
            .filter_map(|at| match at % 2 {
                0 => random.one(&singles).cloned(),
                _ => Some(subject.some(&mut random)),
            })
            .collect();
        wrong.extend(attempt(&subject, cases.into_iter()));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_kind_of_number_is_found_in_the_schemas() {
    let subjects = subjects();
    assert!(subjects.iter().all(|subject| !subject.leaves.is_empty()));
    // What the numbers are put into is a sea, or all answers would be of something else.
    for subject in &subjects {
        let world = reef_fuzz::sea::world(&subject.text(&Vec::new()));
        assert!(world.is_ok_and(|world| world.is_some()), "{}", subject.name);
    }
}

#[test]
fn two_numbers_of_one_table_are_both_in_the_text() {
    let subjects = subjects();
    let scene = subjects.iter().find(|subject| subject.name == "scene").expect("a subject");
    let at = |name: &str| scene.leaves.iter().position(|leaf| leaf.name() == name).expect(name);
    let text = |names: [&str; 2]| scene.text(&names.map(|name| (at(name), 0.375)).to_vec());
    // A table that a scene may leave out, in either order; and two choices, of which the last counts.
    for names in [["waves(0).wind", "waves(0).direction"], ["waves(0).direction", "waves(0).wind"]] {
        assert_eq!(text(names).matches("0.375").count(), 2, "{}", text(names));
    }
    let keyed = text(["camera.position(0)[0]", "camera.position(1).keys[0].time"]);
    assert_eq!(keyed.matches("0.375").count(), 1, "{keyed}");
}

#[test]
fn numbers_that_once_overflowed_are_answered() {
    let subjects = subjects();
    for (name, leaf, value) in [
        ("scene", "terrain(0).relief_length", 1e-9),
        ("scene", "terrain(0).cell", 4_294_967_295.0),
        ("scene", "terrain(0).cell", 1e14),
        ("reef.anemone", "tufts[0].length", 1e-300),
        ("reef.fish species", "material.mass", 1e-30),
    ] {
        let subject = subjects.iter().find(|known| known.name == name).expect("a subject");
        let at = subject.leaves.iter().position(|known| known.name() == leaf).expect(leaf);
        subject.attempt(&vec![(at, value)]).unwrap_or_else(|problem| panic!("{problem}"));
    }
}

/// All of it takes many minutes: `cargo test -p reef-fuzz --test ranges -- --ignored`.
#[test]
#[ignore = "many minutes"]
fn all_numbers_at_all_ends_and_many_pairs() {
    let mut wrong = Vec::new();
    let mut random = seeded(99);
    for subject in subjects() {
        let began = Instant::now();
        let singles = subject.singles(true);
        let count = singles.len();
        wrong.extend(attempt(&subject, singles.into_iter()));
        let pairs: Vec<Case> = (0..count).map(|_| subject.some(&mut random)).collect();
        wrong.extend(attempt(&subject, pairs.into_iter()));
        eprintln!("{}: {count} ends and as many pairs in {:?}", subject.name, began.elapsed());
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
