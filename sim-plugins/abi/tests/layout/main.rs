//! Holds `reef_sim.h` and its Rust mirror together: every constant, struct and field of the header is in the
//! mirror, and lies where the header puts it — by the header's text, and by what C and C++ compilers make of
//! it.

mod compiler;
mod header;
mod mirror;
mod translators;

use std::collections::BTreeMap;

use header::Header;
use reef_abi as abi;

const TEXT: &str = include_str!("../../reef_sim.h");

/// Where a field lies: offset, size, alignment.
type Place = (usize, usize, usize);

#[test]
fn every_struct_and_field_of_the_header_is_in_the_mirror_and_the_other_way_round() {
    let header = Header::parse(TEXT);
    let mirror = mirror::structs();
    let names = |structs: &BTreeMap<String, Vec<String>>| {
        let lines: Vec<String> = structs.iter().map(|(name, fields)| format!("{name} {fields:?}")).collect();
        lines.join("\n")
    };
    let of_header: BTreeMap<String, Vec<String>> = header
        .structs
        .iter()
        .map(|s| (s.name.clone(), s.fields.iter().map(|f| f.name.clone()).collect()))
        .collect();
    let of_mirror: BTreeMap<String, Vec<String>> = mirror
        .iter()
        .map(|s| (s.name.to_owned(), s.fields.iter().map(|f| f.0.to_owned()).collect()))
        .collect();
    assert!(of_header.len() > 30, "the header was not understood: {}", names(&of_header));
    assert_same_lines(&names(&of_header), &names(&of_mirror), "the header");
}

#[test]
fn the_mirror_lies_as_the_headers_text_says() {
    let header = Header::parse(TEXT);
    for of_mirror in mirror::structs() {
        let of_header = header.structs.iter().find(|s| s.name == of_mirror.name).expect("see the test above");
        let (places, size, align) = of_header.layout();
        assert_eq!((of_mirror.size, of_mirror.align), (size, align), "{}", of_mirror.name);
        for ((name, place), expected) in of_mirror.fields.iter().zip(places) {
            assert_eq!(*place, expected, "{}.{name}", of_mirror.name);
        }
        let asserted = header.asserted.get(of_mirror.name);
        assert_eq!(asserted, Some(&(size, align)), "REEF_ASSERT_LAYOUT of {}", of_mirror.name);
    }
}

#[test]
fn every_constant_of_the_header_is_in_the_mirror_with_its_value() {
    let header = Header::parse(TEXT);
    let of_mirror: BTreeMap<String, u64> =
        mirror::constants().into_iter().map(|(name, value)| (format!("REEF_{name}"), value)).collect();
    let of_header: BTreeMap<String, u64> = header.constants.iter().cloned().collect();
    assert!(of_header.len() > 60, "the header was not understood: {of_header:#?}");
    let lines = |constants: &BTreeMap<String, u64>| {
        let lines: Vec<String> = constants.iter().map(|(name, value)| format!("{name} {value}")).collect();
        lines.join("\n")
    };
    assert_same_lines(&lines(&of_header), &lines(&of_mirror), "the header");
}

#[test]
fn each_stream_is_made_of_what_the_header_says_beside_its_number() {
    // `#define REEF_STREAM_FIBRE 3u /* reef_fibre: … */`
    let said: BTreeMap<u32, String> = TEXT
        .lines()
        .filter_map(|line| line.strip_prefix("#define REEF_STREAM_")?.split_once("/* "))
        .map(|(define, comment)| {
            let number = define.split_whitespace().nth(1).and_then(|n| n.trim_end_matches('u').parse().ok());
            let element = comment.split([' ', ':', ',']).next().expect("a comment has a word");
            (number.expect("a stream has a number"), in_rust(element))
        })
        .collect();
    let mirror: BTreeMap<u32, String> =
        abi::ELEMENTS.iter().map(|(stream, element)| (*stream, (*element).to_owned())).collect();
    assert_eq!(said, mirror, "the header's element of each stream, and the mirror's");
}

/// `reef_fibre_node` is `FibreNode`, `uint32_t` is `u32`.
fn in_rust(name: &str) -> String {
    let Some(name) = name.strip_prefix("reef_") else { return name.replace("uint", "u").replace("_t", "") };
    name.split('_').map(|word| word[..1].to_uppercase() + &word[1..]).collect()
}

#[test]
fn the_headers_hash_is_true() {
    let line = "#define REEF_HEADER_HASH";
    let rest: Vec<&str> = TEXT.split('\n').filter(|l| !l.starts_with(line)).collect();
    assert_eq!(rest.len() + 1, TEXT.split('\n').count(), "exactly one line defines the hash");
    let hash = abi::fnv1a_64(rest.join("\n").as_bytes());
    assert_eq!(
        abi::HEADER_HASH,
        hash,
        "reef_sim.h changed: `cargo xtask contract` writes {hash:016x} into the header and its mirror"
    );
}

#[test]
fn c_and_cpp_compilers_accept_the_header_without_a_warning_and_agree_with_the_mirror() {
    let header = Header::parse(TEXT);
    let expected = mirror::report();
    for language in [compiler::C11, compiler::CPP11] {
        let Some(report) = compiler::report(&language, &header) else { continue };
        assert_same_lines(&report, &expected, language.name);
    }
}

#[test]
fn pythons_cffi_reads_the_header_and_agrees_with_the_mirror() {
    let Some(report) = translators::cffi(&Header::parse(TEXT)) else { return };
    assert_same_lines(&report, &mirror::report(), "cffi");
}

/// Shows only the lines that differ.
fn assert_same_lines(found: &str, mirror: &str, whose: &str) {
    let only = |a: &str, b: &str| {
        let lines: Vec<&str> = a.lines().filter(|line| !b.lines().any(|other| other == *line)).collect();
        lines.join("\n")
    };
    let (theirs, ours) = (only(found, mirror), only(mirror, found));
    assert!(theirs.is_empty() && ours.is_empty(), "{whose} says\n{theirs}\nthe mirror says\n{ours}");
    assert_eq!(found.lines().count(), mirror.lines().count());
}
