//! The mark of a context that the host handed out. A plugin that calls a service with something else is at
//! fault, and does not get as far as the host's memory.

use std::sync::atomic::{AtomicU64, Ordering};

/// What a mark is made of, with the address where it stands.
const SEAL: u64 = 0x5245_4546_5f43_5458;

/// A mark. What it marks does not move once it is set.
#[derive(Debug, Default)]
pub(crate) struct Tag(AtomicU64);

impl Tag {
    /// Sets the mark here.
    pub(crate) fn set(&self) {
        self.0.store(SEAL ^ self.address(), Ordering::Relaxed);
    }

    /// From here on this is no context any more.
    pub(crate) fn clear(&self) {
        self.0.store(0, Ordering::Relaxed);
    }

    /// Is the mark here? A copy of it elsewhere is none.
    pub(crate) fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed) == SEAL ^ self.address()
    }

    fn address(&self) -> u64 {
        (&raw const self.0) as u64
    }
}

impl Drop for Tag {
    fn drop(&mut self) {
        self.clear();
    }
}

/// What the host hands out as a context, marked.
pub(crate) trait Tagged {
    /// Where the mark is in it [bytes].
    const AT: usize;
}

/// Is this a context of this kind that the host handed out?
///
/// # Safety
/// NULL, misaligned, or memory that can be read: only the mark is read. Where that is not so, whoever calls
/// it is at fault by the marker.
pub(crate) unsafe fn is_ours<T: Tagged>(context: *const T) -> bool {
    // SAFETY: the caller's promise.
    !context.is_null() && context.is_aligned() && unsafe { (*context.byte_add(T::AT).cast::<Tag>()).is_set() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_holds_where_it_was_set_and_nowhere_else() {
        let [here, there] = [Box::new(Tag::default()), Box::new(Tag::default())];
        assert!(!here.is_set());
        here.set();
        there.0.store(here.0.load(Ordering::Relaxed), Ordering::Relaxed);
        assert!(here.is_set() && !there.is_set());
        here.clear();
        assert!(!here.is_set());
    }

    #[test]
    fn a_context_is_known_by_its_mark_and_whatever_else_is_none() {
        #[derive(Default)]
        struct Context {
            before: u64,
            tag: Tag,
        }
        impl Tagged for Context {
            const AT: usize = std::mem::offset_of!(Self, tag);
        }
        let context = Box::new(Context::default());
        let here: *const Context = &raw const *context;
        // SAFETY: NULL, misaligned, or the context itself.
        let ours = |p: *const Context| unsafe { is_ours(p) };
        assert!(!ours(here));
        context.tag.set();
        assert!(ours(here) && !ours(std::ptr::null()) && !ours(here.wrapping_byte_add(1)));
        assert_eq!(context.before, 0);
    }
}
