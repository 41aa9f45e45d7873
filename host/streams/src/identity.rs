//! By which ids modules know one another's objects.
//!
//! An object's id is unique within its module, and below 2⁴⁸. What one module hears of another's objects
//! carries the module's tag in the 16 bits above, so that no object takes a stranger's flow for its own; its
//! own ids come back as it gave them. Tags follow from the modules' names alone: what is known of a stranger
//! stays true over a save, and when a scene lists its modules in another order or has one more.

/// Bits of an id below the module's tag.
const BITS: u32 = 48;

pub use reef_abi::GREATEST_ID;

const _: () = assert!(GREATEST_ID == (1 << BITS) - 1);

/// Whose objects they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ModuleTag(u16);

impl ModuleTag {
    /// The tags of the modules of a scene with these names, which differ. Where two names ask for one tag,
    /// which hardly happens, the name that sorts later takes the next.
    pub fn all(names: &[&str]) -> Vec<Self> {
        let mut sorted: Vec<usize> = (0..names.len()).collect();
        sorted.sort_unstable_by_key(|module| names[*module]);
        let mut tags = vec![Self(0); names.len()];
        for module in sorted {
            let hash = reef_abi::fnv1a_64(names[module].as_bytes());
            let mut tag = (hash ^ hash >> 32 ^ hash >> 16) as u16;
            // 0 is of no module.
            while tag == 0 || tags.contains(&Self(tag)) {
                tag = tag.wrapping_add(1);
            }
            tags[module] = Self(tag);
        }
        tags
    }

    /// The id by which other modules know one of this module's objects; what it calls by a stranger's id is
    /// that stranger's.
    pub fn foreign(self, object: u64) -> u64 {
        if object == 0 || object > GREATEST_ID { object } else { object | u64::from(self.0) << BITS }
    }

    /// The id that the module itself gave an object which others know by `object`; a stranger's as it is.
    pub fn own(self, object: u64) -> u64 {
        if object >> BITS == u64::from(self.0) { object & GREATEST_ID } else { object }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_follow_from_names_and_differ() {
        let tags = ModuleTag::all(&["anemones", "fish", "shoal"]);
        assert_eq!(ModuleTag::all(&["shoal", "kelp", "anemones", "fish"])[2], tags[0]);
        assert!(tags[0] != tags[1] && tags[1] != tags[2] && tags[0] != tags[2]);
        // More names than tags that are likely to differ.
        let names: Vec<String> = (0..2000).map(|i| format!("module {i}")).collect();
        let tags = ModuleTag::all(&names.iter().map(String::as_str).collect::<Vec<_>>());
        let mut numbers: Vec<u16> = tags.iter().map(|tag| tag.0).collect();
        numbers.sort_unstable();
        numbers.dedup();
        assert!(numbers.len() == names.len() && numbers[0] != 0);
    }

    #[test]
    fn an_id_comes_back_as_it_was_given_and_a_strangers_stays_one() {
        let [mine, other] = ModuleTag::all(&["mine", "other"])[..] else { unreachable!() };
        for id in [1, 7, GREATEST_ID] {
            assert_eq!((mine.own(mine.foreign(id)), mine.own(id)), (id, id));
            let stranger = other.foreign(id);
            assert_ne!(stranger, mine.foreign(id));
            assert_eq!((mine.own(stranger), mine.foreign(stranger)), (stranger, stranger));
        }
        assert_eq!((mine.foreign(0), mine.own(0)), (0, 0));
    }
}
