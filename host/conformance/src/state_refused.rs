//! Bytes that are no state of this plugin: refused, and the instance is as it was.

use reef_abi as abi;
use reef_plugin::{
    Instance, Plugin, PluginError,
    bare::calls::{Bare, status},
};

use super::{
    sea::Sea,
    state::{BYTES, kept},
    subject::{Subject, difference, payload, run},
    table::{Check, Of, Rule::Header},
    verdict::{Not, Outcome, broken, must},
};

const ALL_OR_NOTHING: &str = "All or nothing: anything but REEF_OK leaves the instance as it was.";
const UNREADABLE: &str = "load_state: not readable; the instance is untouched";
const VERSIONS: &str = "A state_version below state_min_version or above state_version is REEF_BAD_STATE.";

pub(super) const CHECKS: &[Check] = &[
    check("state-empty", "No bytes at all are refused.", UNREADABLE, empty),
    check("state-truncated", "A state that is cut anywhere is refused.", UNREADABLE, truncated),
    check("state-longer", "A state with bytes behind its end is refused.", UNREADABLE, longer),
    check("state-random", "Random bytes are refused.", UNREADABLE, random),
    check("state-foreign", "A state of another plugin is refused.", UNREADABLE, foreign),
    check(
        "state-flipped",
        "A state with one wrong bit is read or refused, without harm.",
        UNREADABLE,
        flipped,
    ),
    check("state-newer", "A state of a newer version is refused.", VERSIONS, newer),
    check("state-older", "A state of a version that is too old is refused.", VERSIONS, older),
    Check {
        needs: &["state-bytes", "step-storm"],
        ..check(
            "state-untouched",
            "An instance that refused a state is as it was.",
            ALL_OR_NOTHING,
            untouched,
        )
    },
    check("state-status", "What cannot be read is REEF_BAD_STATE.", UNREADABLE, bad_state),
    check(
        "state-message",
        "A state is refused with a message.",
        "Every failure carries a message: call reef_host.set_error first.",
        message,
    ),
];

const fn check(
    name: &'static str,
    about: &'static str,
    rule: &'static str,
    run: fn(&Subject) -> Outcome,
) -> Check {
    Check { name, about, rule: Header(rule), needs: BYTES, of: Of::Plugin, run }
}

/// An instance with a state, whose bytes it gave.
struct Saved {
    instance: Instance,
    bytes: Vec<u8>,
    version: u32,
    plugin: Plugin,
}

/// Err: there is no state to speak of.
fn saved(subject: &Subject) -> Result<Saved, Not> {
    let (plugin, mut instance) = kept(subject)?;
    let bytes = payload(&mut instance)?;
    if bytes.is_empty() {
        return Err(Not::There("its state has no bytes".into()));
    }
    Ok(Saved { instance, bytes, version: plugin.info().state_version, plugin })
}

impl Saved {
    /// These bytes must be refused; Err names them.
    fn refuses(&mut self, bytes: &[u8], what: &str) -> Result<(), Not> {
        match self.instance.load_bare(Bare::new(bytes, self.version)) {
            Ok(()) => broken!("{what}: load_state() returned REEF_OK"),
            Err((_, fault @ PluginError::Fault { .. })) => broken!("{what}: {fault}"),
            Err(_) => Ok(()),
        }
    }

    /// Bytes that every plugin with a state must refuse, in different places of its reading.
    fn unreadable(&self) -> Vec<(String, Vec<u8>)> {
        let bytes = &self.bytes;
        let mut all = vec![("no bytes".to_owned(), Vec::new())];
        for length in [bytes.len() / 3, bytes.len() / 2, bytes.len() - 1] {
            all.push((format!("{length} of {} bytes", bytes.len()), bytes[..length].to_vec()));
        }
        all.push(("bytes behind its end".into(), [bytes, &b"more"[..]].concat()));
        all.push(("random bytes".into(), noise(1, bytes.len())));
        all
    }
}

/// Bytes of chance, the same each time.
fn noise(seed: u64, length: usize) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 32) as u8
    };
    (0..length).map(|_| next()).collect()
}

fn empty(subject: &Subject) -> Outcome {
    saved(subject)?.refuses(&[], "no bytes")?;
    Ok(None)
}

fn truncated(subject: &Subject) -> Outcome {
    let mut saved = saved(subject)?;
    let whole = saved.bytes.clone();
    // Every length of a small state, a few hundred of a large one.
    let stride = whole.len() / 300 + 1;
    for length in (1..whole.len()).step_by(stride).chain([whole.len() - 1]) {
        saved.refuses(&whole[..length], &format!("cut to {length} of {} bytes", whole.len()))?;
    }
    Ok(None)
}

fn longer(subject: &Subject) -> Outcome {
    let mut saved = saved(subject)?;
    for more in [&b"\0"[..], b"more", &[0; 64]] {
        let longer = [&saved.bytes[..], more].concat();
        saved.refuses(&longer, &format!("with {} bytes behind its end", more.len()))?;
    }
    Ok(None)
}

fn random(subject: &Subject) -> Outcome {
    let mut saved = saved(subject)?;
    let length = saved.bytes.len();
    for (seed, length) in [1, 8, 64, length, length, length + 1, 4096].into_iter().enumerate() {
        saved.refuses(&noise(seed as u64 + 1, length), &format!("{length} random bytes"))?;
    }
    // As well begun as its own.
    let own = saved.bytes.len().min(8);
    let begun = [&saved.bytes[..own], &noise(9, 200)[..]].concat();
    saved.refuses(&begun, "its own first 8 bytes, and random ones behind them")?;
    Ok(None)
}

/// A sound state of the SDK's format with one field that nobody knows.
fn strangers() -> Vec<u8> {
    let mut bytes = b"REEFSTAT".to_vec();
    bytes.extend(1_u32.to_le_bytes());
    bytes.extend([0; 4]);
    bytes.extend(abi::fnv1a_64(b"nobody.knows.this").to_le_bytes());
    bytes.extend(7_u32.to_le_bytes()); // f64
    bytes.extend([0; 4]);
    bytes.extend(2_u64.to_le_bytes());
    bytes.extend([1.0_f64, 2.0].map(f64::to_le_bytes).concat());
    bytes
}

fn foreign(subject: &Subject) -> Outcome {
    saved(subject)?.refuses(&strangers(), "a sound state of another plugin")?;
    Ok(None)
}

fn flipped(subject: &Subject) -> Outcome {
    let mut saved = saved(subject)?;
    let stride = saved.bytes.len() / 200 + 1;
    let (mut read, mut refused) = (0, 0);
    for at in (0..saved.bytes.len()).step_by(stride) {
        let mut bytes = saved.bytes.clone();
        bytes[at] ^= 1 << (at % 8);
        match saved.instance.load_bare(Bare::new(&bytes, saved.version)) {
            Ok(()) => read += 1,
            Err((_, fault @ PluginError::Fault { .. })) => {
                broken!("with bit {} of byte {at} flipped: {fault}", at % 8)
            }
            Err((abi::FATAL, error)) => broken!("with bit {} of byte {at} flipped: {error}", at % 8),
            Err(_) => refused += 1,
        }
    }
    let Saved { mut instance, bytes, version, .. } = saved;
    instance.load_bare(Bare::new(&bytes, version)).map_err(|(_, error)| error)?;
    run(&mut instance, &Sea::usual(), 22..25)?;
    Ok(Some(format!("{read} read, {refused} refused")))
}

/// The right bytes of a version that it does not read.
fn of_version(mut saved: Saved, version: u32) -> Outcome {
    let bytes = saved.bytes.clone();
    match saved.instance.load_bare(Bare::new(&bytes, version)) {
        Ok(()) => broken!("load_state() returned REEF_OK for a state of version {version}"),
        Err((_, fault @ PluginError::Fault { .. })) => broken!("given a state of version {version}: {fault}"),
        Err((abi::BAD_STATE, _)) => Ok(None),
        Err((other, _)) => {
            broken!("load_state() returned {} for a state of version {version}", status(other))
        }
    }
}

fn newer(subject: &Subject) -> Outcome {
    let saved = saved(subject)?;
    match saved.plugin.info().state_version.checked_add(1) {
        Some(version) => of_version(saved, version),
        None => Err(Not::There("no version is newer".into())),
    }
}

fn older(subject: &Subject) -> Outcome {
    let saved = saved(subject)?;
    match saved.plugin.info().state_min_version.checked_sub(1) {
        Some(version) => of_version(saved, version),
        None => Err(Not::There("it reads every older version".into())),
    }
}

fn untouched(subject: &Subject) -> Outcome {
    let mut saved = saved(subject)?;
    // Loaded into one that is somewhere else: what is taken over by halves would be seen.
    run(&mut saved.instance, &Sea::storm(), 22..52)?;
    let before = payload(&mut saved.instance)?;
    for (what, bytes) in saved.unreadable() {
        let result = saved.instance.load_bare(Bare::new(&bytes, saved.version));
        if let Err((_, fault @ PluginError::Fault { .. })) = &result {
            broken!("{what}: {fault}");
        }
        if result.is_err()
            && let Some(difference) = difference(&before, &payload(&mut saved.instance)?)
        {
            broken!("given {what}, it refused them, and its state is another: {difference}");
        }
        saved.instance.load_bare(Bare::new(&before, saved.version)).map_err(|(_, error)| error)?;
    }
    Ok(None)
}

fn bad_state(subject: &Subject) -> Outcome {
    each_refusal(subject, |found, _| {
        (found != abi::BAD_STATE).then(|| format!("load_state() returned {}", status(found)))
    })
}

fn message(subject: &Subject) -> Outcome {
    each_refusal(subject, |_, error| {
        error
            .to_string()
            .ends_with("it gave no reason")
            .then(|| "load_state() failed without a message".into())
    })
}

fn each_refusal(subject: &Subject, problem: impl Fn(i32, &PluginError) -> Option<String>) -> Outcome {
    let mut saved = saved(subject)?;
    let mut refused = 0;
    for (what, bytes) in saved.unreadable() {
        if let Err((status, error)) = saved.instance.load_bare(Bare::new(&bytes, saved.version)) {
            refused += 1;
            if let Some(problem) = problem(status, &error) {
                broken!("given {what}: {problem}");
            }
        }
    }
    must!(refused > 0, "it took everything that it was given");
    Ok(None)
}
