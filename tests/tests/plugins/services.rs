//! What the host lends beyond streams, as the SDK shows it: owners of points, limits, files of the module's
//! own.

use std::fs;

use reef_plugin::{Library, Plugin as Loaded, StepStatus};
use reef_sdk::prelude::*;
use reef_tests::sea::{Sea, config};

/// Asks for what it may and for what it may not.
struct Asker {
    limits: [u64; 2],
}

#[derive(serde::Deserialize, schemars::JsonSchema)]
struct Wanted {
    /// A file that it reads.
    #[serde(default)]
    file: Option<String>,
}

/// Points of which each third is of one owner, at these distances from the first source [m].
const OWNERS: [u64; 6] = [0, 0, 7, 7, 9, 0];
const X: [f32; 6] = [0.1, 0.4, 0.1, 0.4, 0.2, 5.0];

impl Plugin for Asker {
    const ID: &'static str = "test.asker";
    const NAME: &'static str = "Asker";
    const VERSION: &'static str = "1.0.0";
    const VENDOR: &'static str = "Reef's tests";
    const DESCRIPTION: &'static str = "Asks the host.";
    const STATE_VERSION: u32 = 1;
    const STATE_MIN_VERSION: u32 = 1;
    type Config = Wanted;

    fn create(host: &Host, _: &SceneInfo, config: Wanted) -> Result<Self, ConfigError> {
        let limits = host.limits().ok_or_else(|| ConfigError::new("", "no limits"))?;
        if host.extension(c"draft/nothing").is_some() {
            return Err(ConfigError::new("", "there is an extension that nobody has"));
        }
        if let Some(file) = &config.file {
            let bytes = host.asset(file)?;
            return Err(ConfigError::new("file", format!("it says {}", String::from_utf8_lossy(&bytes))));
        }
        Ok(Self { limits: [limits.of_stream(abi::STREAM_FLOW), limits.of_stream(77)] })
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        assert_eq!(self.limits, [1 << 14, 0]);
        let zeros = [0.0; X.len()];
        let ask = |owners: Option<&[u64]>, owner: u64| {
            let mut seen = [[0.0; X.len()]; 3];
            let [x, y, z] = &mut seen;
            let (points, velocities) = ([&X[..], &zeros, &zeros], [&mut x[..], y, z]);
            match owners {
                Some(owners) => input.sample_flow_of_each([0.0; 3], owners, points, velocities),
                None => input.sample_flow([0.0; 3], owner, points, velocities),
            }
            .map(|()| seen.map(|way| way.map(f32::to_bits)))
        };
        let each = ask(Some(&OWNERS), 0)?;
        for owner in [0, 7, 9] {
            let one = ask(None, owner)?;
            for at in (0..X.len()).filter(|at| OWNERS[*at] == owner) {
                assert_eq!(each.map(|way| way[at]), one.map(|way| way[at]), "point {at}");
            }
        }
        assert!(each[0][0] != each[0][2] && each[0][4] != ask(None, 0)?[0][4], "owners count");
        assert!(ask(Some(&OWNERS[1..]), 0).is_err(), "one owner too few");
        output.emit(&[abi::Object { id: abi::GREATEST_ID, ..Default::default() }])?;
        Ok(Status::Ok)
    }

    fn save(&self, _: &mut StateWriter) {}

    fn load(&mut self, _: &mut StateReader) -> Result<(), StateError> {
        Ok(())
    }
}

fn plugin() -> Loaded {
    Library::from_entry(reef_sdk::entry::<Asker>(), 2).unwrap().1.remove(0)
}

#[test]
fn points_have_owners_and_limits_are_told() {
    let mut sea = Sea::default();
    let source = |owner, x| abi::Flow {
        owner,
        kind: abi::FLOW_SOURCE,
        position: [x, 0.0, 0.0],
        strength: 0.1,
        peak: 0.5,
        reach: 2.0,
        ..Default::default()
    };
    sea.flow.extend([source(7, 0.0), source(9, 0.3)]);
    let mut instance = plugin().create(&config("{}")).unwrap();
    let report = instance.step(&sea.input(1), &[]);
    assert_eq!(report.status, StepStatus::Ok, "{report:?}");
}

#[test]
fn a_module_reads_its_own_files_and_is_told_where_one_was_looked_for() {
    let assets = tempfile::tempdir().unwrap();
    let own = assets.path().join("modules/test.asker");
    fs::create_dir_all(&own).unwrap();
    fs::write(own.join("a.txt"), "hello").unwrap();
    fs::write(assets.path().join("secret.txt"), "no").unwrap();
    let made = |file: &str| {
        let config = config(&format!(r#"{{"file": "{file}"}}"#));
        plugin().create_among(&config, assets.path()).map(|_| ()).unwrap_err().to_string()
    };
    assert!(made("a.txt").contains("it says hello"), "{}", made("a.txt"));
    let missing = made("b.txt");
    assert!(
        missing.contains("asset_read: `b.txt` is not there; looked in") && missing.contains("test.asker")
    );
    assert!(made("../../secret.txt").contains("is no name"), "{}", made("../../secret.txt"));
}
