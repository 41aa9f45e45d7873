//! The ground as modules get it: heights in pages that nobody can write to.

use std::sync::Arc;

use reef_plugin::frozen::Frozen;
use reef_streams::environment::{Environment, Heightfield};

/// What is lent of an environment.
#[derive(Debug)]
pub(crate) struct Ground {
    environment: Arc<Environment>,
    heights: Frozen,
}

impl Ground {
    /// Of this environment.
    pub(crate) fn new(environment: &Arc<Environment>) -> Arc<Self> {
        let heights = environment.heightfield().map_or(&[][..], |field| field.heights);
        Arc::new(Self { heights: Frozen::new(heights), environment: environment.clone() })
    }

    /// The ground as modules read it.
    pub(crate) fn heightfield(&self) -> Option<Heightfield<'_>> {
        Some(Heightfield { heights: &self.heights, ..self.environment.heightfield()? })
    }
}
