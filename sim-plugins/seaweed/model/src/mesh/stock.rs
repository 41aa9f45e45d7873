//! Shapes that are there already: an instance that is made beside another of the same table, as for a load,
//! does not grow them again.

use std::convert::Infallible;

use reef_sdk::{Held, Kept};

use super::{AGES, Shape, shape};
use crate::{grow::Limb, skeleton::Skeleton, species::Species};

/// What somebody has.
static KNOWN: Kept<Stock> = Kept::new();

/// The shapes of a species at all ages.
#[derive(Debug)]
pub(crate) struct Stock {
    species: Species,
    shapes: [Shape; AGES],
}

impl Stock {
    pub(crate) fn of(species: &Species, skeleton: &Skeleton, limbs: &[Limb]) -> Held<Self> {
        let grow = || {
            let shapes = core::array::from_fn(|age| shape(species, skeleton, limbs, age));
            Ok::<_, Infallible>(Self { species: species.clone(), shapes })
        };
        let Ok(stock) = KNOWN.get(|stock| stock.species == *species, grow);
        stock
    }

    /// Age by age.
    pub(crate) fn shapes(&self) -> &[Shape] {
        &self.shapes
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
        let count = || KNOWN.count(|stock| stock.species == species);
        let one = Stock::of(&species, &skeleton, &limbs);
        let two = Stock::of(&species, &skeleton, &limbs);
        assert_eq!((one.shapes().len(), one.shapes().as_ptr()), (AGES, two.shapes().as_ptr()));
        drop(one);
        assert_eq!((two.shapes().len(), count()), (AGES, 1));
        drop(two);
        assert_eq!(count(), 0);
    }
}
