//! States from before a parameter was there: the parameter has its default, all others what they had.

use reef_plugin::envelope::Envelope;
use reef_sea::scene::{self, Scene};
use reef_tests::{
    artifacts::{artifacts, workspace},
    own,
    sea::{Sea, set_param},
};

use crate::load;

/// Bytes of a state's beginning and of a field's: what comes before the values.
const HEAD: usize = 16;
const FIELD: usize = 24;

/// A state of the SDK's, which begins with the ids and the values of all parameters, without those of one.
fn without(payload: &[u8], param: usize) -> Vec<u8> {
    let mut made = payload[..HEAD].to_vec();
    let mut rest = &payload[HEAD..];
    for size in [size_of::<u32>(), size_of::<f64>()] {
        let count = u64::from_le_bytes(rest[FIELD - 8..FIELD].try_into().expect("eight bytes")) as usize;
        let (field, after) = rest.split_at(FIELD + (count * size).next_multiple_of(8));
        let values = &field[FIELD..FIELD + count * size];
        made.extend_from_slice(&field[..FIELD - 8]);
        made.extend_from_slice(&(count as u64 - 1).to_le_bytes());
        made.extend_from_slice(&values[..param * size]);
        made.extend_from_slice(&values[(param + 1) * size..]);
        made.resize(made.len().next_multiple_of(8), 0);
        rest = after;
    }
    made.extend_from_slice(rest);
    made
}

/// The default sea, which has all modules.
fn sea() -> Scene {
    let plugins = own::registry(1);
    let assets = workspace().join("assets");
    scene::load(&assets.join("scenes/reef.toml"), &assets, &plugins).expect("a sound scene")
}

#[test]
fn a_state_that_lacks_a_parameter_loads_and_has_its_default() {
    let sea = sea();
    for own in own::modules() {
        let module = sea.modules.iter().find(|module| module.plugin == own.id).expect("all modules");
        let text = module.create_json(&sea, 1);
        let plugin = load(artifacts().plugin(own.library), 2);
        let params = plugin.info().params.clone();
        let mut instance = plugin.create(&text).expect("an instance");
        let events: Vec<_> = params.iter().map(|param| set_param(param.id, param.maximum)).collect();
        assert_eq!(instance.step(&Sea::default().input(0), &events).message, None, "{}", own.id);
        let state = instance.save().expect("a state");
        let envelope = Envelope::open(&state).expect("its own");
        let mut other = plugin.create(&text).expect("an instance");
        for (at, missing) in params.iter().enumerate() {
            let payload = without(envelope.payload, at);
            other.load(&Envelope { payload: &payload, ..envelope }.seal()).expect("an older state");
            for param in &params {
                let is = other.param(param.id).expect("a parameter");
                let was = if param.id == missing.id { param.default } else { param.maximum };
                assert_eq!(is, was, "{}: {} without {}", own.id, param.key, missing.key);
            }
        }
    }
}
