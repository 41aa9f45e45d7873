//! What tests across crates share: the program and the plugins of this very build, libraries to spoil, and a
//! still sea to step plugins in.

pub mod artifacts;
pub mod child;
pub mod hostile;
pub mod languages;
pub mod libraries;
pub mod own;
pub mod sea;
pub mod zig;

/// Is a test that lacks something to fail (`REEF_REQUIRE=all`), or to be skipped with its reason printed?
///
/// Prints the reason; panics where everything is required.
pub fn skip(reason: &str) {
    let required = std::env::var("REEF_REQUIRE").is_ok_and(|value| value == "all");
    assert!(!required, "REEF_REQUIRE=all, but {reason}");
    println!("skipped: {reason}");
}
