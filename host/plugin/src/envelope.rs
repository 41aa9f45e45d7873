//! The envelope of a saved instance: whose bytes these are, of which version, how many, and their hash.
//!
//! ```text
//! "REEFINST" · format u32 (1) · state version u32 · id length u32 · spare u32 · payload length u64 ·
//! BLAKE3 of all else (32 bytes) · id · payload          (little-endian)
//! ```

/// First bytes of an envelope.
const MAGIC: &[u8; 8] = b"REEFINST";
const FORMAT: u32 = 1;
const HEADER: usize = 64;
const HASH: std::ops::Range<usize> = 32..64;

/// An opened envelope.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Envelope<'a> {
    /// The plugin that wrote the payload.
    pub plugin: &'a str,
    /// Its state version.
    pub state_version: u32,
    /// What it wrote.
    pub payload: &'a [u8],
}

impl<'a> Envelope<'a> {
    /// Wraps the payload.
    pub fn seal(self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER + self.plugin.len() + self.payload.len());
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&FORMAT.to_le_bytes());
        bytes.extend_from_slice(&self.state_version.to_le_bytes());
        bytes.extend_from_slice(&(self.plugin.len() as u32).to_le_bytes());
        bytes.extend_from_slice(&[0; 4]);
        bytes.extend_from_slice(&(self.payload.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&[0; 32]);
        bytes.extend_from_slice(self.plugin.as_bytes());
        bytes.extend_from_slice(self.payload);
        let hash = hash(&bytes);
        bytes[HASH].copy_from_slice(&hash);
        bytes
    }

    /// Opens an envelope; the message says what is wrong with it.
    pub fn open(bytes: &'a [u8]) -> Result<Self, String> {
        if bytes.len() < HEADER || &bytes[..8] != MAGIC {
            return Err("these bytes are no saved instance".into());
        }
        let number = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        if number(8) != FORMAT {
            return Err(format!("envelope format {}, this host reads {FORMAT}", number(8)));
        }
        let id = number(16) as usize;
        let payload = (u64::from(number(28)) << 32) | u64::from(number(24));
        let expected = (HEADER + id) as u64 + payload.min(u64::MAX / 2);
        if bytes.len() as u64 != expected {
            return Err(format!("it has {} bytes in place of {expected}: cut or grown", bytes.len()));
        }
        if bytes[HASH] != hash(bytes) {
            return Err("its hash does not fit its bytes: damaged".into());
        }
        let plugin = std::str::from_utf8(&bytes[HEADER..HEADER + id])
            .map_err(|_| "the plugin's id in it is not UTF-8".to_owned())?;
        Ok(Self { plugin, state_version: number(12), payload: &bytes[HEADER + id..] })
    }
}

/// BLAKE3 of everything but the hash itself.
fn hash(bytes: &[u8]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&bytes[..HASH.start]);
    hasher.update(&bytes[HASH.end..]);
    *hasher.finalize().as_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_envelope_gives_back_what_was_put_in() {
        let envelope = Envelope { plugin: "reef.test", state_version: 7, payload: b"angles" };
        assert_eq!(Envelope::open(&envelope.seal()), Ok(envelope));
        let empty = Envelope { plugin: "", state_version: 0, payload: b"" };
        assert_eq!(Envelope::open(&empty.seal()), Ok(empty));
    }

    #[test]
    fn an_envelope_cut_grown_or_changed_anywhere_is_refused() {
        let bytes = Envelope { plugin: "reef.test", state_version: 7, payload: b"angles" }.seal();
        for length in 0..bytes.len() {
            assert!(Envelope::open(&bytes[..length]).is_err(), "cut to {length}");
        }
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 0x10;
            assert!(Envelope::open(&changed).is_err(), "byte {at}");
        }
        let mut longer = bytes;
        longer.push(0);
        assert!(Envelope::open(&longer).unwrap_err().contains("cut or grown"));
    }
}
