//! What instances made and their elements name by ids: textures, meshes. It stays with the instance that made
//! it, in the program's memory: the outputs of each step carry the list, and a renderer that looks at them
//! brings it to its device. So a sea without a renderer has it, too, and it goes with the last outputs that
//! name it, however the instance ended.

use std::sync::Arc;

/// Longest name that is kept [bytes].
const LONGEST_NAME: usize = 200;

/// Something that an instance made.
pub trait Retained {
    /// What it is, for messages.
    const WHAT: &'static str;
    /// In the plural.
    const MANY: &'static str;
    /// Most of them that one instance may have at a time.
    const MOST: usize;
    /// What elements call it. What is made again while it is there has the same id, so that an instance that
    /// takes up a saved state, and makes its things anew for that, emits the same bytes. Never used for
    /// anything else.
    fn id(&self) -> u32;
    /// For messages and debuggers.
    fn name(&self) -> &str;
    /// Of its content: what is the same has the same.
    fn hash(&self) -> &[u8; 32];
}

/// Why things were refused: the first reason of each kind.
#[derive(Clone, Debug, Default)]
pub struct Refused {
    /// It is none that can be made, or was asked for where none is.
    pub unfit: Option<String>,
    /// One more than there may be.
    pub too_many: Option<String>,
    /// One was to be destroyed that is not there.
    pub missing: Option<String>,
}

/// The things of one kind of one instance, in the order of their ids.
pub type List<T> = Arc<Vec<Arc<T>>>;

/// Those that one instance has now.
#[derive(Debug)]
pub struct Store<T> {
    /// What was refused so far.
    pub refused: Refused,
    list: List<T>,
    /// How often each was made and not destroyed.
    holders: Vec<u64>,
    last: u32,
}

impl<T> Default for Store<T> {
    fn default() -> Self {
        Self { refused: Refused::default(), list: Arc::default(), holders: Vec::new(), last: 0 }
    }
}

impl<T: Retained> Store<T> {
    /// Those that there are.
    pub fn list(&self) -> &List<T> {
        &self.list
    }

    /// The id of what has this name and content: one more holder, or what `make` makes with an id and the
    /// name as it is kept.
    pub(crate) fn hold(
        &mut self,
        name: &str,
        hash: &[u8; 32],
        make: impl FnOnce(u32, String) -> T,
    ) -> Result<u32, String> {
        let name = shortened(name);
        if let Some(at) = self.place(&name, hash) {
            self.holders[at] += 1;
            return Ok(self.list[at].id());
        }
        if self.list.len() >= T::MOST || self.last == u32::MAX {
            let (most, many) = (T::MOST, T::MANY);
            return Err(self.no_room(format!("`{name}`: the instance has {most} {many}, which is the limit")));
        }
        self.last += 1;
        Arc::make_mut(&mut self.list).push(Arc::new(make(self.last, name)));
        self.holders.push(1);
        Ok(self.last)
    }

    /// Whether what has this name and content is there.
    pub(crate) fn has(&self, name: &str, hash: &[u8; 32]) -> bool {
        self.place(&shortened(name), hash).is_some()
    }

    /// Where it is in the list. `name`: as it is kept.
    fn place(&self, name: &str, hash: &[u8; 32]) -> Option<usize> {
        self.list.iter().position(|made| made.hash() == hash && made.name() == name)
    }

    /// Remembers that there was no room.
    pub(crate) fn no_room(&mut self, reason: String) -> String {
        self.refused.too_many.get_or_insert_with(|| reason.clone());
        reason
    }

    /// Forgets one, once it was destroyed as often as made.
    pub fn remove(&mut self, id: u32) -> Result<(), String> {
        let Some(at) = self.list.iter().position(|made| made.id() == id) else {
            let reason = format!("the instance has no {} {id}", T::WHAT);
            self.refused.missing.get_or_insert_with(|| reason.clone());
            return Err(reason);
        };
        self.holders[at] -= 1;
        if self.holders[at] == 0 {
            self.holders.remove(at);
            Arc::make_mut(&mut self.list).remove(at);
        }
        Ok(())
    }
}

/// The one with this id.
pub fn find<T: Retained>(list: &[Arc<T>], id: u32) -> Option<&Arc<T>> {
    list.binary_search_by_key(&id, |made| made.id()).ok().map(|at| &list[at])
}

fn shortened(name: &str) -> String {
    let mut end = name.len().min(LONGEST_NAME);
    while !name.is_char_boundary(end) {
        end -= 1;
    }
    name[..end].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Thing(u32, String);

    impl Retained for Thing {
        const WHAT: &'static str = "thing";
        const MANY: &'static str = "things";
        const MOST: usize = 4;

        fn id(&self) -> u32 {
            self.0
        }

        fn name(&self) -> &str {
            &self.1
        }

        fn hash(&self) -> &[u8; 32] {
            &[7; 32]
        }
    }

    #[test]
    fn what_has_a_long_name_is_there_under_it() {
        let mut store = Store::default();
        let name = "long".repeat(100);
        assert!(!store.has(&name, &[7; 32]));
        assert_eq!(store.hold(&name, &[7; 32], Thing), Ok(1));
        assert!(store.has(&name, &[7; 32]) && !store.has(&name, &[8; 32]) && !store.has("long", &[7; 32]));
        assert_eq!(store.hold(&name, &[7; 32], Thing), Ok(1));
    }

    #[test]
    fn a_long_name_is_cut_between_two_characters() {
        assert_eq!(shortened(&"é".repeat(150)).chars().count(), 100);
    }
}
