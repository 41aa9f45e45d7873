//! All modules of a sea in one step, at the same time: each library's on the control thread of its generation,
//! those of one library after each other. Nobody reads what another emits in this step, so the bytes are those
//! of one after the other.

use std::slice::ChunkByMut;

use reef_abi as abi;

use super::{
    input::StepInput,
    instance::{Instance, StepReport},
};

/// One module's step.
#[derive(Debug)]
pub struct Turn<'a> {
    instance: &'a mut Instance,
    input: StepInput<'a>,
    events: &'a [abi::Event],
    /// Its number among the modules, for whoever asked.
    pub module: usize,
    /// How it ended, once [`step_together`] has returned.
    pub report: Option<StepReport>,
}

impl<'a> Turn<'a> {
    /// A step to be made.
    pub fn new(
        module: usize,
        instance: &'a mut Instance,
        input: StepInput<'a>,
        events: &'a [abi::Event],
    ) -> Self {
        Self { instance, input, events, module, report: None }
    }

    fn take(&mut self) {
        self.report = Some(self.instance.step(&self.input, self.events));
    }

    /// The number of the instance's generation; 0: its library is closed.
    fn generation(&self) -> u64 {
        self.instance.plugin().library().generation().map_or(0, |generation| generation.number())
    }
}

/// Makes all steps. The turns are in the order of their modules again when this returns.
pub fn step_together(turns: &mut [Turn<'_>]) {
    if let [one] = turns {
        return one.take();
    }
    turns.sort_unstable_by_key(|turn| (turn.generation(), turn.module));
    one_beside_the_others(turns.chunk_by_mut(|a, b| a.generation() == b.generation()));
    turns.sort_unstable_by_key(|turn| turn.module);
}

fn one_beside_the_others<'t, 'a>(
    mut groups: ChunkByMut<'t, Turn<'a>, impl FnMut(&Turn<'a>, &Turn<'a>) -> bool>,
) {
    let Some(group) = groups.next() else { return };
    let library = group.first().map(|turn| turn.instance.plugin().library().clone());
    let mut task = || group.iter_mut().for_each(Turn::take);
    match library.as_ref().and_then(|library| library.generation()) {
        Some(generation) => generation.run_beside(&mut task, || one_beside_the_others(groups)),
        None => {
            task();
            one_beside_the_others(groups);
        }
    }
}
