//! All modules of a sea in one step, or while their states are saved or loaded, at the same time: each
//! library's on the control thread of its generation, those of one library after each other. Nobody reads what
//! another emits in this step, so the bytes are those of one after the other.

use std::slice::ChunkByMut;

use reef_abi as abi;

use super::{
    error::PluginError,
    input::StepInput,
    instance::{Instance, Payload, StepReport},
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
}

/// One module's state to be saved.
#[derive(Debug)]
pub struct Saving<'a> {
    instance: &'a mut Instance,
    module: usize,
    /// The memory for it; once [`save_together`] has returned, the state.
    pub state: Result<Payload, PluginError>,
}

impl<'a> Saving<'a> {
    /// A state to be written into this memory.
    pub fn new(module: usize, instance: &'a mut Instance, memory: Vec<u8>) -> Self {
        Self { instance, module, state: Ok(Payload::in_memory(memory)) }
    }
}

/// One module's state to be taken back.
#[derive(Debug)]
pub struct Loading<'a> {
    instance: &'a mut Instance,
    module: usize,
    state: &'a Payload,
    /// How it ended, once [`load_together`] has returned.
    pub loaded: Result<(), PluginError>,
}

impl<'a> Loading<'a> {
    /// A state that an instance of the same build gave.
    pub fn new(module: usize, instance: &'a mut Instance, state: &'a Payload) -> Self {
        Self { instance, module, state, loaded: Ok(()) }
    }
}

/// What is done with a module's instance.
trait Task: Send {
    fn module(&self) -> usize;
    fn instance(&self) -> &Instance;
    fn take(&mut self);

    /// The number of the instance's generation; 0: its library is closed.
    fn generation(&self) -> u64 {
        self.instance().plugin().library().generation().map_or(0, |generation| generation.number())
    }
}

impl Task for Turn<'_> {
    fn module(&self) -> usize {
        self.module
    }

    fn instance(&self) -> &Instance {
        self.instance
    }

    fn take(&mut self) {
        self.report = Some(self.instance.step(&self.input, self.events));
    }
}

impl Task for Saving<'_> {
    fn module(&self) -> usize {
        self.module
    }

    fn instance(&self) -> &Instance {
        self.instance
    }

    fn take(&mut self) {
        let memory = std::mem::replace(&mut self.state, Ok(Payload::default()));
        self.state = self.instance.save_payload(memory.map_or_else(|_| Vec::new(), Payload::into_memory));
    }
}

impl Task for Loading<'_> {
    fn module(&self) -> usize {
        self.module
    }

    fn instance(&self) -> &Instance {
        self.instance
    }

    fn take(&mut self) {
        self.loaded = self.instance.load_payload(self.state);
    }
}

/// Makes all steps. The turns are in the order of their modules again when this returns.
pub fn step_together(turns: &mut [Turn<'_>]) {
    together(turns);
}

/// Saves all states. They are in the order of their modules again when this returns.
pub fn save_together(savings: &mut [Saving<'_>]) {
    together(savings);
}

/// Loads all states. They are in the order of their modules again when this returns.
pub fn load_together(loadings: &mut [Loading<'_>]) {
    together(loadings);
}

fn together<T: Task>(tasks: &mut [T]) {
    if let [one] = tasks {
        return one.take();
    }
    tasks.sort_unstable_by_key(|task| (task.generation(), task.module()));
    one_beside_the_others(tasks.chunk_by_mut(|a, b| a.generation() == b.generation()));
    tasks.sort_unstable_by_key(Task::module);
}

fn one_beside_the_others<T: Task>(mut groups: ChunkByMut<'_, T, impl FnMut(&T, &T) -> bool>) {
    let Some(group) = groups.next() else { return };
    let library = group.first().map(|task| task.instance().plugin().library().clone());
    let mut task = || group.iter_mut().for_each(Task::take);
    match library.as_ref().and_then(|library| library.generation()) {
        Some(generation) => generation.run_beside(&mut task, || one_beside_the_others(groups)),
        None => {
            task();
            one_beside_the_others(groups);
        }
    }
}
