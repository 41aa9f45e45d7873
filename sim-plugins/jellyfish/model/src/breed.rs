//! What is made of a look once, however many animals and instances have it: an instance that is made beside
//! another one does not paint it again.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use crate::{paint::Paint, species::Look};

/// What somebody has.
static KNOWN: Mutex<Vec<Weak<Breed>>> = Mutex::new(Vec::new());

/// A look and the picture of its bell.
#[derive(Debug)]
pub struct Breed {
    look: Look,
    paint: Paint,
    texels: Vec<u8>,
}

impl Breed {
    /// Of colours that were checked.
    pub fn of(look: &Look) -> Arc<Self> {
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(there) = known.iter().filter_map(Weak::upgrade).find(|breed| breed.look == *look) {
            return there;
        }
        let paint = Paint::new(look);
        let breed = Arc::new(Self { look: look.clone(), texels: paint.texels(), paint });
        known.retain(|breed| breed.strong_count() > 0);
        known.push(Arc::downgrade(&breed));
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

/// A library that is unloaded leaves nothing behind: to be called when breeds were given up.
pub(crate) fn forget() {
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    known.retain(|breed| breed.strong_count() > 0);
    if known.is_empty() {
        *known = Vec::new();
    }
}
