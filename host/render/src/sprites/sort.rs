//! From far to near: keys of sixteen bits, in two passes over their bytes, each keeping the order of equals.

use super::Kind;

/// The bit of a key that tells specks from quads of the same slice.
const SPECK: u16 = 1 << 9;

/// Sorts from far to near: a slice of the distance, the kind, the distance within the slice. The bits of a
/// float grow with it.
pub fn key(square: f32, kind: Kind) -> u16 {
    let least = (0.5_f32).powi(10);
    let bits = square.clamp(least, 262_143.0).to_bits() - least.to_bits();
    // 28 octaves of 1024 steps.
    let far_first = 0x7fff - (bits >> 13) as u16;
    let speck = if kind == Kind::Speck { SPECK } else { 0 };
    (far_first >> 9) << 10 | speck | (far_first & 511)
}

/// The kind in a key.
pub fn kind(key: u16) -> Kind {
    if key & SPECK == 0 { Kind::Quad } else { Kind::Speck }
}

/// Keys with what they belong to, side by side: the upper half of a word is the key.
#[derive(Debug, Default)]
pub struct Order {
    entries: Vec<u64>,
    spare: Vec<u64>,
}

impl Order {
    /// Forgets all.
    pub fn begin(&mut self) {
        self.entries.clear();
    }

    /// Adds keys, whose numbers begin with `first`.
    pub fn add(&mut self, keys: &[u16], first: u32) {
        self.entries.extend((first..).zip(keys).map(|(index, key)| u64::from(*key) << 32 | u64::from(index)));
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Keys and numbers.
    pub fn iter(&self) -> impl Iterator<Item = (u16, u32)> + '_ {
        self.entries.iter().map(|entry| ((entry >> 32) as u16, *entry as u32))
    }

    /// Brings them into order.
    pub fn sort(&mut self) {
        let Self { entries, spare } = self;
        spare.resize(entries.len(), 0);
        let mut counts = [[0_u32; 256]; 2];
        for entry in entries.iter() {
            counts[0][(entry >> 32) as usize & 255] += 1;
            counts[1][(entry >> 40) as usize & 255] += 1;
        }
        for (shift, mut places) in [32, 40].into_iter().zip(counts) {
            let mut sum = 0;
            for place in &mut places {
                let count = *place;
                *place = sum;
                sum += count;
            }
            for entry in entries.iter() {
                let place = &mut places[(entry >> shift) as usize & 255];
                spare[*place as usize] = *entry;
                *place += 1;
            }
            std::mem::swap(entries, spare);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_sort_from_far_to_near_and_quads_before_specks_of_the_same_slice() {
        let mut last = u16::MAX;
        for i in 0..400 {
            let distance = 0.04_f32 * 1.024_f32.powi(i);
            let key = key(distance * distance, Kind::Quad);
            assert!(key <= last, "{distance} m");
            last = key;
        }
        assert!(key(4.0, Kind::Quad) < key(4.1, Kind::Speck));
        assert!(key(4.0, Kind::Speck) > key(8.1, Kind::Speck), "another slice");
        assert_eq!(key(0.0, Kind::Quad), key(1e-9, Kind::Quad));
        assert_eq!(key(f32::INFINITY, Kind::Quad), key(3e5, Kind::Quad));
    }

    #[test]
    fn the_order_is_that_of_a_stable_sort() {
        let mut word = 1_u32;
        let keys: Vec<u16> = (0..5000)
            .map(|_| {
                word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                // Few, so that many are equal.
                (word >> 24) as u16 * 257
            })
            .collect();
        let mut expected: Vec<(u16, u32)> = keys.iter().copied().zip(0..).collect();
        expected.sort_by_key(|(key, _)| *key);
        let mut order = Order::default();
        for _ in 0..2 {
            order.begin();
            order.add(&keys[..3000], 0);
            order.add(&keys[3000..], 3000);
            order.sort();
            assert!(order.iter().eq(expected.iter().copied()));
        }
    }
}
