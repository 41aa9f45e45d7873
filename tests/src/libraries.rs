//! Places in the bytes of a library, for tests that spoil a copy.

use reef_abi as abi;

/// Where the entry's head (magic, size, version) stands.
///
/// # Panics
/// When it is not there, or more than once.
pub fn entry_at(bytes: &[u8]) -> usize {
    let mut head = abi::MAGIC.to_ne_bytes().to_vec();
    head.extend((size_of::<abi::Entry>() as u32).to_ne_bytes());
    head.extend(abi::VERSION.to_ne_bytes());
    let places: Vec<usize> =
        bytes.windows(head.len()).enumerate().filter(|(_, w)| *w == head).map(|(i, _)| i).collect();
    assert_eq!(places.len(), 1, "one entry is in the library");
    places[0]
}
