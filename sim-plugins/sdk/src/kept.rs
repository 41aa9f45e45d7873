//! What is worked out once and shared by all that need it at a time: an instance that is made beside another
//! of the same table, as for a load, does not work it out again. A library that is unloaded leaves nothing
//! behind.

use std::{
    ops::Deref,
    sync::{Arc, Mutex, MutexGuard, PoisonError, Weak},
};

/// All things of a kind that somebody holds; for a `static`.
#[derive(Debug)]
pub struct Kept<T: 'static>(Mutex<Vec<Weak<T>>>);

/// One of them, shared. When nobody holds it any more, it is gone.
#[derive(Debug)]
pub struct Held<T: 'static> {
    // Dropped in this order: who leaves last finds the thing gone.
    thing: Arc<T>,
    leave: Leave<T>,
}

#[derive(Debug)]
struct Leave<T: 'static>(&'static Kept<T>);

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T> Kept<T> {
    /// Nothing.
    pub const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Weak<T>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The one of which `is` says so, or else what `make` makes, or its error. Two that ask at the same time
    /// get the same.
    pub fn get<E>(
        &'static self,
        is: impl Fn(&T) -> bool,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Held<T>, E> {
        let mut known = self.lock();
        let thing = match known.iter().filter_map(Weak::upgrade).find(|thing| is(thing)) {
            Some(there) => there,
            None => {
                let made = Arc::new(make()?);
                known.push(Arc::downgrade(&made));
                made
            }
        };
        Ok(Held { thing, leave: Leave(self) })
    }

    /// How many are held of which `is` says so.
    pub fn count(&self, is: impl Fn(&T) -> bool) -> usize {
        self.lock().iter().filter_map(Weak::upgrade).filter(|thing| is(thing)).count()
    }
}

impl<T> Deref for Held<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.thing
    }
}

impl<T> Clone for Held<T> {
    fn clone(&self) -> Self {
        Self { thing: self.thing.clone(), leave: Leave(self.leave.0) }
    }
}

impl<T> Drop for Leave<T> {
    fn drop(&mut self) {
        let mut known = self.0.lock();
        known.retain(|thing| thing.strong_count() > 0);
        if known.is_empty() {
            *known = Vec::new();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    #[test]
    fn a_thing_is_made_once_while_somebody_has_it_and_then_gone() {
        static KNOWN: Kept<u32> = Kept::new();
        let get = |wanted: u32| KNOWN.get(|thing| *thing == wanted, || Ok::<_, Infallible>(wanted)).unwrap();
        let (one, two, other) = (get(1), get(1), get(2));
        assert!(std::ptr::eq(&*one, &*two) && *other == 2);
        drop((one, other));
        assert_eq!((KNOWN.count(|thing| *thing == 1), KNOWN.lock().len()), (1, 1));
        let three = two.clone();
        drop(two);
        assert_eq!((*three, KNOWN.count(|_| true)), (1, 1));
        drop(three);
        assert_eq!(KNOWN.lock().capacity(), 0, "a library that is unloaded leaves nothing behind");
        assert_eq!(KNOWN.get(|_| true, || Err::<u32, _>("no")).map(|held| *held), Err("no"));
        assert_eq!(KNOWN.lock().len(), 0);
    }
}
