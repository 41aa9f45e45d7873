//! What modules tell one another: flow and actors of the step before, in an order that depends on the scene
//! only.

use std::sync::Arc;

use reef_abi as abi;
use reef_streams::{Outputs, identity::foreign_id};

use super::water::{Attached, Objects};

/// Ids and origins of a module's objects.
#[derive(Clone, Debug)]
pub(crate) enum Listed {
    /// As a saved state lists them.
    Loaded(Vec<(u64, [f64; 3])>),
    /// As they were emitted: there may be many, and hardly anybody asks for them.
    Emitted(Arc<Outputs>),
}

impl Listed {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Loaded(list) => list.len(),
            Self::Emitted(outputs) => outputs.objects.len(),
        }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (u64, [f64; 3])> {
        let (loaded, emitted) = match self {
            Self::Loaded(list) => (list.as_slice(), [].as_slice()),
            Self::Emitted(outputs) => ([].as_slice(), outputs.objects.as_slice()),
        };
        loaded.iter().copied().chain(emitted.iter().map(|object| (object.id, object.origin)))
    }
}

impl Default for Listed {
    fn default() -> Self {
        Self::Loaded(Vec::new())
    }
}

/// What one module emitted in the last step and others may know.
#[derive(Clone, Debug, Default)]
pub(crate) struct Said {
    pub(crate) flows: Vec<abi::Flow>,
    pub(crate) actors: Vec<abi::Actor>,
    pub(crate) objects: Listed,
}

/// Everything that was said in the last step, and what of it each module hears.
#[derive(Debug, Default)]
pub(crate) struct Exchange {
    pub(crate) said: Vec<Said>,
    /// The scene's own primitives, then all modules', by foreign ids.
    all: Arc<Vec<abi::Flow>>,
    retired: Vec<Arc<Vec<abi::Flow>>>,
    /// The retired one whose memory `begin` handed out.
    shell: Option<Arc<Vec<abi::Flow>>>,
    /// What of the scene's own moves with an object.
    attached: Vec<Attached>,
    /// Where each module's begin in `all`, and an end.
    starts: Vec<usize>,
    actors: Vec<abi::Actor>,
    actor_starts: Vec<usize>,
    /// `all` with one module's own ids, for those modules that emitted flow or carry some of the scene's.
    heard: Vec<Vec<abi::Flow>>,
    actors_heard: Vec<Vec<abi::Actor>>,
}

impl Exchange {
    pub(crate) fn new(modules: usize) -> Self {
        Self {
            said: vec![Said::default(); modules],
            heard: vec![Vec::new(); modules],
            actors_heard: vec![Vec::new(); modules],
            ..Self::default()
        }
    }

    /// Nothing was said.
    pub(crate) fn clear(&mut self) {
        for said in &mut self.said {
            said.flows.clear();
            said.actors.clear();
            said.objects = Listed::default();
        }
    }

    /// Empty lists for the scene's own primitives, and for what of them moves with objects.
    pub(crate) fn begin(&mut self) -> (Vec<abi::Flow>, Vec<Attached>) {
        let mut list = Vec::new();
        for at in 0..self.retired.len() {
            if let Some(old) = Arc::get_mut(&mut self.retired[at]) {
                list = std::mem::take(old);
                self.shell = Some(self.retired.swap_remove(at));
                break;
            }
        }
        list.clear();
        self.attached.clear();
        (list, std::mem::take(&mut self.attached))
    }

    /// Adds what the modules said in the step before to the scene's own primitives, and makes everyone's
    /// lists.
    pub(crate) fn share(&mut self, mut flow: Vec<abi::Flow>, attached: Vec<Attached>) {
        self.attached = attached;
        self.starts.clear();
        self.actor_starts.clear();
        self.actors.clear();
        for (module, said) in self.said.iter().enumerate() {
            self.starts.push(flow.len());
            self.actor_starts.push(self.actors.len());
            flow.extend(
                said.flows.iter().map(|flow| abi::Flow { owner: foreign_id(module, flow.owner), ..*flow }),
            );
            self.actors.extend(said.actors.iter().map(|actor| abi::Actor {
                id: foreign_id(module, actor.id),
                parent: foreign_id(module, actor.parent),
                ..*actor
            }));
        }
        self.starts.push(flow.len());
        self.actor_starts.push(self.actors.len());
        for (module, said) in self.said.iter().enumerate() {
            let heard = &mut self.heard[module];
            heard.clear();
            let mut carried = self.attached.iter().filter(|attached| attached.module == module).peekable();
            if self.starts[module] < self.starts[module + 1] || carried.peek().is_some() {
                heard.extend_from_slice(&flow);
                heard[self.starts[module]..self.starts[module + 1]].copy_from_slice(&said.flows);
                for attached in carried {
                    heard[attached.flow].owner = attached.object;
                }
            }
            let heard = &mut self.actors_heard[module];
            heard.clear();
            if !said.actors.is_empty() {
                heard.extend_from_slice(&self.actors);
                heard[self.actor_starts[module]..self.actor_starts[module + 1]].copy_from_slice(&said.actors);
            }
        }
        let mut next = self.shell.take().unwrap_or_default();
        match Arc::get_mut(&mut next) {
            Some(list) => *list = flow,
            None => next = Arc::new(flow),
        }
        let old = std::mem::replace(&mut self.all, next);
        if self.retired.len() < 8 {
            self.retired.push(old);
        }
    }

    /// The sea's flow as a module hears it.
    pub(crate) fn flow_for(&self, module: usize) -> &[abi::Flow] {
        match self.heard.get(module) {
            Some(heard) if !heard.is_empty() => heard,
            _ => &self.all,
        }
    }

    /// The actors as a module hears of them.
    pub(crate) fn actors_for(&self, module: usize) -> &[abi::Actor] {
        match self.actors_heard.get(module) {
            Some(heard) if !heard.is_empty() => heard,
            _ => &self.actors,
        }
    }

    /// What a module heard in its own words; empty where it heard the same as all.
    pub(crate) fn own_flow(&self, module: usize) -> &[abi::Flow] {
        self.heard.get(module).map_or(&[], Vec::as_slice)
    }

    /// The same for actors.
    pub(crate) fn own_actors(&self, module: usize) -> &[abi::Actor] {
        self.actors_heard.get(module).map_or(&[], Vec::as_slice)
    }

    /// What modules hear that said nothing themselves.
    pub(crate) fn common_flow(&self) -> &[abi::Flow] {
        &self.all
    }

    /// The same for actors.
    pub(crate) fn common_actors(&self) -> &[abi::Actor] {
        &self.actors
    }

    /// The sea's flow, as the last step felt it.
    pub(crate) fn all(&self) -> Arc<Vec<abi::Flow>> {
        self.all.clone()
    }

    /// Remembers what the modules said in this step.
    pub(crate) fn take<'a>(&mut self, outputs: impl Iterator<Item = &'a Arc<Outputs>>) {
        for (said, outputs) in self.said.iter_mut().zip(outputs) {
            said.flows.clear();
            said.flows.extend_from_slice(&outputs.flows);
            said.actors.clear();
            said.actors.extend_from_slice(&outputs.actors);
            said.objects = Listed::Emitted(outputs.clone());
        }
    }
}

impl Objects for Exchange {
    fn find(&self, module: usize, object: u64) -> Option<([f64; 3], u64)> {
        let objects = &self.said.get(module)?.objects;
        let (_, origin) = objects.iter().find(|(id, _)| *id == object)?;
        Some((origin, foreign_id(module, object)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use reef_streams::identity::own_id;

    fn flow(owner: u64, strength: f32) -> abi::Flow {
        abi::Flow { owner, strength, ..abi::Flow::default() }
    }

    #[test]
    fn a_module_knows_its_own_ids_and_never_takes_a_strangers_for_its_own() {
        let mut exchange = Exchange::new(3);
        exchange.said[0].flows = vec![flow(1, 10.0)];
        exchange.said[1].flows = vec![flow(1, 20.0), flow(2, 21.0)];
        let (mut own, attached) = exchange.begin();
        own.push(flow(0, 1.0));
        exchange.share(own, attached);
        for module in 0..3 {
            let heard: Vec<f32> = exchange.flow_for(module).iter().map(|flow| flow.strength).collect();
            assert_eq!(heard, [1.0, 10.0, 20.0, 21.0], "the order is the same for all");
        }
        let owners =
            |module: usize| exchange.flow_for(module).iter().map(|flow| flow.owner).collect::<Vec<_>>();
        assert_eq!(owners(0), [0, 1, foreign_id(1, 1), foreign_id(1, 2)]);
        assert_eq!(owners(1), [0, foreign_id(0, 1), 1, 2]);
        assert_eq!(owners(2), [0, foreign_id(0, 1), foreign_id(1, 1), foreign_id(1, 2)]);
        assert_ne!(foreign_id(0, 1), foreign_id(1, 1));
        for module in 0..3 {
            assert_eq!(own_id(module, foreign_id(module, 7)), 7);
            assert_eq!(own_id(module, foreign_id(module + 1, 7)), foreign_id(module + 1, 7));
            assert_eq!(own_id(module, 0), 0);
        }
    }

    #[test]
    fn what_the_scene_attaches_belongs_to_the_object_in_its_modules_own_words() {
        // An id of all 64 bits: the module's number cannot be read back from it.
        let id = 0xfedc_ba98_7654_3210;
        let mut exchange = Exchange::new(3);
        exchange.said[2].flows = vec![flow(5, 20.0)];
        for (object, module) in [(id, 0), (7, 1), (9, 2)] {
            let (mut own, mut attached) = exchange.begin();
            own.extend([flow(0, 1.0), flow(foreign_id(module, object), 2.0)]);
            attached.push(Attached { flow: 1, module, object });
            exchange.share(own, attached);
            for hearer in 0..3 {
                let heard = exchange.flow_for(hearer)[1].owner;
                let wanted = if hearer == module { object } else { foreign_id(module, object) };
                assert_eq!(heard, wanted, "what {hearer} hears of {module}'s");
            }
            let last = exchange.flow_for(2)[2].owner;
            assert_eq!((last, exchange.flow_for(0)[2].owner), (5, foreign_id(2, 5)));
        }
    }

    #[test]
    fn objects_are_found_by_module_and_id() {
        let mut exchange = Exchange::new(2);
        exchange.said[1].objects = Listed::Loaded(vec![(7, [1.0, 2.0, 3.0])]);
        assert_eq!(exchange.find(1, 7), Some(([1.0, 2.0, 3.0], foreign_id(1, 7))));
        assert_eq!(exchange.find(0, 7), None);
        assert_eq!(exchange.find(9, 7), None);
    }
}
