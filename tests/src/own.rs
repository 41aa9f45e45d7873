//! Reef's own plugins in Rust, in one place: what is listed here is built for the tests and held to the contract.

/// One of Reef's own plugins.
#[derive(Clone, Copy, Debug)]
pub struct Own {
    /// Its package.
    pub package: &'static str,
    /// Its library's target.
    pub library: &'static str,
    /// A module's table that gives it something to do, as JSON; None: it has something to do without.
    pub config: Option<&'static str>,
}

/// All of them.
pub const OWN: &[Own] = &[
    Own {
        package: "reef-anemone",
        library: "reef_anemone",
        config: Some(
            r#"{
                "anemones": [{"species": "actinia-fragacea"}, {"species": "seagrass", "position": [0.5, 0.0, 0.2]}],
                "fibres": [{"position": [0.0, -4.0, 1.0], "count": [3, 2], "spacing": 0.1}]
            }"#,
        ),
    },
    Own {
        package: "reef-particles",
        library: "reef_particles",
        config: Some(
            r#"{"boxes": [
                {"low": [-3.0, -4.0, -3.0], "high": [3.0, -2.0, 3.0], "count": 2000},
                {"kind": "sand", "low": [-1.0, -5.0, -1.0], "high": [1.0, -4.0, 1.0], "concentration": 50.0}
            ]}"#,
        ),
    },
    Own { package: "reef-example-rust", library: "reef_example_rust", config: None },
];
