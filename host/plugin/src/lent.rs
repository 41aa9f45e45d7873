//! A step's input as one module gets it: copies of its own, so that what it writes there reaches nobody else.

use reef_abi as abi;

use super::input::StepInput;

/// The copies, used again in every step.
#[derive(Debug, Default)]
pub(crate) struct Lent {
    camera: abi::Camera,
    water: abi::Water,
    heightfield: Option<abi::Heightfield>,
    flow: Vec<abi::Flow>,
    waves: Vec<abi::Wave>,
    actors: Vec<abi::Actor>,
    obstacles: Vec<abi::Obstacle>,
    events: Vec<abi::Event>,
}

// SAFETY: the heightfield's pointer leads to what the world lends, which nobody writes.
unsafe impl Send for Lent {}
// SAFETY: as above.
unsafe impl Sync for Lent {}

impl Lent {
    /// The step as the contract spells it. Valid until the next one is lent.
    pub(crate) fn step(&mut self, input: &StepInput<'_>, events: &[abi::Event]) -> abi::Step {
        self.camera = *input.camera;
        self.water = *input.water;
        self.heightfield = input.raw_heightfield();
        renew(&mut self.flow, input.flow);
        renew(&mut self.waves, input.waves);
        renew(&mut self.actors, input.actors);
        renew(&mut self.obstacles, input.obstacles);
        renew(&mut self.events, events);
        let own = StepInput {
            camera: &self.camera,
            water: &self.water,
            flow: &self.flow,
            waves: &self.waves,
            actors: &self.actors,
            obstacles: &self.obstacles,
            ..*input
        };
        own.raw(self.heightfield.as_ref(), &self.events)
    }
}

fn renew<T: Copy>(list: &mut Vec<T>, from: &[T]) {
    list.clear();
    list.extend_from_slice(from);
}
