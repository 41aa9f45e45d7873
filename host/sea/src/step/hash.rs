//! One hash a step over all that a step leaves behind, each chained to the one before: two runs with the same
//! last hash were the same in every step.

use reef_plugin::PluginError;

use super::world::World;

/// A hash [BLAKE3].
pub type Digest = [u8; 32];

/// The chain of hashes of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Chain {
    /// The newest.
    pub digest: Digest,
}

impl Chain {
    /// Adds the world's present step: all streams but those that are emitted on request only (debug lines,
    /// traces), the flow that the step felt, and all states.
    pub fn add(&mut self, world: &mut World) -> Result<Digest, PluginError> {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.digest);
        let frame = world.frame().clone();
        hasher.update(&frame.step.to_le_bytes());
        hasher.update(&frame.time.to_le_bytes());
        hasher.update(bytemuck::bytes_of(&world.camera().raw(&frame.camera)));
        list(&mut hasher, frame.flow.len(), bytemuck::cast_slice(&frame.flow));
        for (number, outputs) in frame.outputs.iter().enumerate() {
            hasher.update(&(number as u64).to_le_bytes());
            for (_, count, bytes) in outputs.all_bytes().filter(|(stream, ..)| stream.is_wanted(0)) {
                list(&mut hasher, count, bytes);
            }
        }
        for state in world.save_members()? {
            hasher.update(&(state.len() as u64).to_le_bytes());
            hasher.update(&state);
        }
        self.digest = *hasher.finalize().as_bytes();
        Ok(self.digest)
    }
}

/// Count and bytes of a stream: without the count, elements could move from one stream to the next unnoticed.
fn list(hasher: &mut blake3::Hasher, count: usize, bytes: &[u8]) {
    hasher.update(&(count as u64).to_le_bytes());
    hasher.update(bytes);
}

/// A hash as people compare it.
pub fn hex(digest: &Digest) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The reverse of [`hex`].
pub fn unhex(text: &str) -> Option<Digest> {
    if text.len() != 64 || !text.is_ascii() {
        return None;
    }
    let mut digest = [0; 32];
    for (at, byte) in digest.iter_mut().enumerate() {
        *byte = u8::from_str_radix(&text[2 * at..2 * at + 2], 16).ok()?;
    }
    Some(digest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hash_written_is_the_hash_read() {
        let mut digest = [0; 32];
        digest.iter_mut().zip(100..).for_each(|(byte, value)| *byte = value);
        assert_eq!(unhex(&hex(&digest)), Some(digest));
        assert_eq!(unhex("0g"), None);
        assert_eq!(unhex(&"zz".repeat(32)), None);
    }
}
