//! Shapes that are there already: an instance that is made beside another of the same table, as for a load,
//! does not grow them again.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::{AGES, Shape, shape};
use crate::{grow::Limb, skeleton::Skeleton, species::Species};

type Shapes = [Shape; AGES];

/// What somebody has.
static KNOWN: Mutex<Vec<(Species, Weak<Shapes>)>> = Mutex::new(Vec::new());

/// The shapes of a species at all ages. What nobody has any more is gone.
#[derive(Debug)]
pub(crate) struct Stock {
    shapes: Option<Arc<Shapes>>,
}

impl Stock {
    pub(crate) fn new(species: &Species, skeleton: &Skeleton, limbs: &[Limb]) -> Self {
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let there = known.iter().find(|(other, _)| other == species).and_then(|(_, shapes)| shapes.upgrade());
        let shapes = there.unwrap_or_else(|| {
            let grown = Arc::new(core::array::from_fn(|age| shape(species, skeleton, limbs, age)));
            known.push((species.clone(), Arc::downgrade(&grown)));
            grown
        });
        Self { shapes: Some(shapes) }
    }

    /// Age by age.
    pub(crate) fn shapes(&self) -> &[Shape] {
        self.shapes.as_deref().map_or(&[], |shapes| shapes)
    }
}

impl Drop for Stock {
    fn drop(&mut self) {
        self.shapes = None;
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        known.retain(|(_, shapes)| shapes.strong_count() > 0);
        if known.is_empty() {
            // A library that is unloaded leaves nothing behind.
            *known = Vec::new();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grow::grow;

    #[test]
    fn shapes_are_shared_while_somebody_has_them_and_then_gone() {
        let species = Species { title: "of this test alone".into(), ..Species::default() };
        let (skeleton, limbs) = grow(&species).unwrap();
        let count = || KNOWN.lock().unwrap().iter().filter(|(other, _)| *other == species).count();
        let one = Stock::new(&species, &skeleton, &limbs);
        let two = Stock::new(&species, &skeleton, &limbs);
        assert_eq!((one.shapes().len(), one.shapes().as_ptr()), (AGES, two.shapes().as_ptr()));
        drop(one);
        assert_eq!((two.shapes().len(), count()), (AGES, 1));
        drop(two);
        assert_eq!(count(), 0);
    }
}
