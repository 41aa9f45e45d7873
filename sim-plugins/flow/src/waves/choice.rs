//! Which of a step's wave trains matter for objects between two heights, and in which order they are counted
//! (§3.3.1). Particles and whatever is soft choose alike.

use reef_abi::Wave;

use super::select::{self, Lens, Rule, Selection};

/// What stays the same of the wave trains while time goes on.
#[derive(Clone, Debug, Default)]
pub struct Steady {
    depth: f64,
    /// Amplitude and wave number of each.
    trains: Vec<[f32; 2]>,
}

impl Steady {
    /// Whether they are these, over this depth.
    pub fn are(&self, waves: &[Wave], depth: f64) -> bool {
        let same = |(known, wave): (&[f32; 2], &Wave)| *known == [wave.amplitude, wave.wave_number];
        self.depth == depth && self.trains.len() == waves.len() && self.trains.iter().zip(waves).all(same)
    }

    /// From now on they are.
    pub fn become_these(&mut self, waves: &[Wave], depth: f64) {
        self.depth = depth;
        self.trains.clear();
        self.trains.extend(waves.iter().map(|wave| [wave.amplitude, wave.wave_number]));
    }
}

/// What the wave trains' list means for what is between two heights. Made anew when something of it changes,
/// not each step.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    key: Key,
    selection: Option<Selection>,
    trains: Steady,
    /// The trains, those that move the water most first.
    order: Vec<u16>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Key {
    focal: f64,
    corner: f64,
    threshold: f64,
    rule: Rule,
    heights: [f64; 2],
}

impl Choice {
    /// Looks at a step's trains over the depth [m] through a lens. `threshold`: A_min [px]; heights: the
    /// lowest and the highest centre [m, world].
    pub fn update(
        &mut self,
        waves: &[Wave],
        depth: f64,
        lens: Lens,
        threshold: f64,
        rule: Rule,
        heights: [f64; 2],
    ) {
        let key = Key { focal: lens.focal, corner: lens.corner, threshold, rule, heights };
        if key == self.key && self.selection.is_some() && self.trains.are(waves, depth) {
            return;
        }
        self.key = key;
        self.trains.become_these(waves, depth);
        self.order.clear();
        self.order.extend((0..).take(waves.len()));
        if rule == Rule::Sum {
            // Short waves hardly reach down: what matters least there comes last.
            let middle = 0.5 * (heights[0] + heights[1]);
            let axis = |number: &u16| select::axis(&waves[usize::from(*number)], depth, middle);
            self.order.sort_by(|a, b| axis(b).total_cmp(&axis(a)));
        }
        let ordered: Vec<Wave> = self.in_order(waves).copied().collect();
        self.selection = Some(Selection::new(&ordered, depth, lens, threshold, rule, heights));
    }

    /// Chooses nothing any more: all trains matter, in their own order.
    pub fn forget(&mut self) {
        self.selection = None;
        self.order.clear();
    }

    /// The step's trains, in the order in which [`Choice::count`] counts them.
    pub fn in_order<'a>(&self, waves: &'a [Wave]) -> impl Iterator<Item = &'a Wave> + use<'a, '_> {
        let place = |number: usize| self.order.get(number).map_or(number, |place| usize::from(*place));
        (0..waves.len()).filter_map(move |number| waves.get(place(number)))
    }

    /// How many trains matter for orbits at the height `y` [m, world] at a distance [m] from the eye.
    pub fn count(&self, y: f32, distance: f32) -> usize {
        self.selection.as_ref().map_or(usize::MAX, |selection| selection.count(y, distance))
    }

    /// The table for many.
    pub fn selection(&self) -> Option<&Selection> {
        self.selection.as_ref()
    }
}
