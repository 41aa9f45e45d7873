//! Shapes that are there already: an instance that is made beside another of the same table, as for a load,
//! does not grow them again.

use std::convert::Infallible;

use reef_sdk::{Held, Kept};

use super::{AGES, Shape, shape};
use crate::{modelled, paint, skeleton::Skeleton, sow::Form, species::Species};

/// What somebody has.
static KNOWN: Kept<Stock> = Kept::new();

/// The shapes of a species at all ages.
#[derive(Debug)]
pub(crate) struct Stock {
    species: Species,
    form: Form,
    shapes: Vec<Shape>,
    /// Age by age; none where blades are too narrow for one.
    pictures: Vec<Vec<u8>>,
    /// Whether some picture has holes.
    torn: bool,
}

impl Stock {
    pub(crate) fn of(species: &Species, skeleton: &Skeleton, form: &Form) -> Held<Self> {
        let grow = || {
            let shapes = match form {
                Form::Grown(limbs) => (0..AGES).map(|age| shape(species, skeleton, limbs, age)).collect(),
                Form::Modelled(model) => vec![modelled::shape(model, species, skeleton)],
            };
            let ages = if paint::is_painted(species) { AGES } else { 0 };
            let pictures: Vec<Vec<u8>> = (0..ages).map(|age| paint::paint(species, age)).collect();
            let torn = pictures.iter().flat_map(|picture| picture.chunks_exact(4)).any(|texel| texel[3] == 0);
            Ok::<_, Infallible>(Self { species: species.clone(), form: form.clone(), shapes, pictures, torn })
        };
        let Ok(stock) = KNOWN.get(|stock| stock.species == *species && stock.form == *form, grow);
        stock
    }

    /// Texels of the blades, [`paint::SIZE`], age by age; empty where they are too narrow for any.
    pub(crate) fn pictures(&self) -> &[Vec<u8>] {
        &self.pictures
    }

    /// Whether some picture has holes.
    pub(crate) fn torn(&self) -> bool {
        self.torn
    }

    /// Age by age; a single one is that of all ages.
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
        let form = Form::Grown(limbs);
        let count = || KNOWN.count(|stock| stock.species == species);
        let one = Stock::of(&species, &skeleton, &form);
        let two = Stock::of(&species, &skeleton, &form);
        assert_eq!((one.shapes().len(), one.shapes().as_ptr()), (AGES, two.shapes().as_ptr()));
        drop(one);
        assert_eq!((two.shapes().len(), count()), (AGES, 1));
        drop(two);
        assert_eq!(count(), 0);
    }
}
