//! What a plugin may ask for by name (`get_extension`): tables that the contract has not taken up as fields
//! of its own.

use std::{ffi::c_void, ptr, sync::LazyLock};

use reef_abi as abi;

use super::{
    meshes::MOST_MESHES,
    saved::LARGEST_STATE,
    scratch,
    streams::{STREAMS, Stream},
    textures::MOST_TEXTURES,
};

/// Longest id that is read [bytes]; none is that long.
pub(super) const LONGEST_ID: usize = 64;

/// Most elements of each stream in a step, by its number; 0 for those that are not taken.
static OF_STREAMS: [u64; abi::STREAM_COUNT as usize] = {
    let mut limits = [0; abi::STREAM_COUNT as usize];
    let mut at = 0;
    while at < STREAMS.len() {
        let Stream { number, limit, .. } = STREAMS[at];
        limits[number as usize] = match limit {
            Some(limit) => limit,
            None => 0,
        };
        at += 1;
    }
    limits
};

/// A table of constants.
struct Table<T>(T);

// SAFETY: its pointers lead to constants.
unsafe impl<T> Send for Table<T> {}
// SAFETY: as above.
unsafe impl<T> Sync for Table<T> {}

static LIMITS: LazyLock<Table<abi::Limits>> = LazyLock::new(|| {
    Table(abi::Limits {
        size: size_of::<abi::Limits>() as u32,
        stream_count: OF_STREAMS.len() as u32,
        streams: OF_STREAMS.as_ptr(),
        state_bytes: LARGEST_STATE as u64,
        scratch_bytes: scratch::LIMIT,
        textures: MOST_TEXTURES as u32,
        meshes: MOST_MESHES as u32,
    })
});

/// The table of an extension; NULL: there is none with this id.
pub(super) fn find(id: &[u8]) -> *const c_void {
    if id == abi::EXTENSION_LIMITS.to_bytes() { (&raw const LIMITS.0).cast() } else { ptr::null() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limits_are_those_that_steps_are_held_to() {
        let limits = find(b"draft/limits").cast::<abi::Limits>();
        // SAFETY: the table, which is a constant.
        let limits = unsafe { limits.as_ref() }.expect("it is there");
        // SAFETY: so many constants.
        let streams = unsafe { std::slice::from_raw_parts(limits.streams, limits.stream_count as usize) };
        for stream in &STREAMS {
            assert_eq!(streams[stream.number as usize], stream.limit.unwrap_or(0), "{}", stream.name);
        }
        assert_eq!((streams[0], streams.len()), (0, STREAMS.len() + 1));
        assert!(find(b"draft/limit").is_null() && find(b"draft/limits2").is_null() && find(b"").is_null());
    }
}
