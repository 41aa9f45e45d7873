//! What is made of a look once, however many animals and instances have it: an instance that is made beside
//! another one does not paint it again.

use std::convert::Infallible;

use reef_sdk::{Held, Kept};

use crate::{paint::Paint, species::Look};

/// What somebody has.
static KNOWN: Kept<Breed> = Kept::new();

/// A look and the picture of its bell.
#[derive(Debug)]
pub struct Breed {
    look: Look,
    paint: Paint,
    texels: Vec<u8>,
}

impl Breed {
    /// Of colours that were checked.
    pub fn of(look: &Look) -> Held<Self> {
        let paint = || {
            let paint = Paint::new(look);
            Ok::<_, Infallible>(Self { look: look.clone(), texels: paint.texels(), paint })
        };
        let Ok(breed) = KNOWN.get(|breed| breed.look == *look, paint);
        breed
    }

    /// The table of colours.
    pub fn look(&self) -> &Look {
        &self.look
    }

    /// What is where on the bell.
    pub fn paint(&self) -> &Paint {
        &self.paint
    }

    /// The picture, [`crate::paint::SIZE`] texels.
    pub fn texels(&self) -> &[u8] {
        &self.texels
    }
}
