//! What an animal wears at one level of detail.

use glam::DVec2;

use crate::{
    species::Species,
    surface::{Bell, Form, Fringe, FringeForm},
};

/// Of what is drawn coarsely: rings of the bell, share of the tentacles, and every which point along
/// tentacles and arms.
const FAR_RINGS: usize = 24;
const FAR_TENTACLES: usize = 4;
const FAR_POINTS: usize = 3;
/// Bell, tentacles and arms at one level of detail.
#[derive(Clone, Debug)]
pub(super) struct Skin {
    pub(super) bell: Bell,
    pub(super) tentacles: Fringe,
    pub(super) arms: Fringe,
    /// Every which point of tentacles and arms it has.
    pub(super) every: usize,
}

impl Skin {
    /// `points`: of a tentacle and of an arm; a bell of one slice, or of two.
    pub(super) fn new(
        species: &Species,
        (chain, slices): (&[DVec2], usize),
        points: [usize; 2],
        seed: u64,
        far: bool,
    ) -> Result<Self, String> {
        let (mut form, mut tentacles, arms) = (species.form(), species.tentacle_form(), species.arm_form());
        let every = if far { FAR_POINTS } else { 1 };
        if far {
            form = coarse(form);
            tentacles = fewer(tentacles);
        }
        let [tentacle, arm] = points.map(|points| points.div_ceil(every));
        // Near tentacles are rounded: a point between each two.
        let tentacle = if far { tentacle } else { 2 * tentacle - 1 };
        Ok(Self {
            bell: Bell::new(form, species.bell.thickness, (chain, slices), seed)?,
            tentacles: Fringe::new(tentacles, tentacle, seed)?,
            arms: Fringe::new(arms, arm, seed)?,
            every,
        })
    }
}

fn coarse(form: Form) -> Form {
    let around = 64;
    let most = around as u32 / 4;
    Form {
        around,
        rings: form.rings.min(FAR_RINGS),
        structures: form.structures.min(most),
        compressions: form.compressions.min(most),
        ..form
    }
}

fn fewer(form: FringeForm) -> FringeForm {
    FringeForm { count: (form.count / FAR_TENTACLES).next_multiple_of(8).min(form.count), ..form }
}
