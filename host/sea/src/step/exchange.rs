//! What modules tell one another: flow and actors of the step before, in an order that depends on the scene
//! only.

use std::sync::Arc;

use reef_abi as abi;
use reef_streams::{Outputs, identity::ModuleTag};

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
    /// By which modules know one another's objects, module by module.
    tags: Arc<[ModuleTag]>,
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
    /// `all` with one module's own ids, for those modules that emitted flow or carry some of the scene's.
    heard: Vec<Vec<abi::Flow>>,
    actors_heard: Vec<Vec<abi::Actor>>,
}

impl Exchange {
    /// Of modules with these tags.
    pub(crate) fn new(tags: Arc<[ModuleTag]>) -> Self {
        Self {
            said: vec![Said::default(); tags.len()],
            heard: vec![Vec::new(); tags.len()],
            actors_heard: vec![Vec::new(); tags.len()],
            tags,
            ..Self::default()
        }
    }

    /// By which modules know one another's objects, module by module.
    pub(crate) fn tags(&self) -> &Arc<[ModuleTag]> {
        &self.tags
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
    pub(crate) fn pass_on(&mut self, mut flow: Vec<abi::Flow>, attached: Vec<Attached>) {
        self.attached = attached;
        self.starts.clear();
        self.actors.clear();
        for (said, tag) in self.said.iter().zip(&*self.tags) {
            self.starts.push(flow.len());
            flow.extend(said.flows.iter().map(|flow| abi::Flow { owner: tag.foreign(flow.owner), ..*flow }));
            self.actors.extend(said.actors.iter().map(|actor| abi::Actor {
                id: tag.foreign(actor.id),
                parent: tag.foreign(actor.parent),
                ..*actor
            }));
        }
        self.starts.push(flow.len());
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
            let tag = self.tags[module];
            let is_own =
                |actor: &abi::Actor| tag.own(actor.id) != actor.id || tag.own(actor.parent) != actor.parent;
            if self.actors.iter().any(is_own) {
                heard.extend(self.actors.iter().map(|actor| abi::Actor {
                    id: tag.own(actor.id),
                    parent: tag.own(actor.parent),
                    ..*actor
                }));
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
        Some((origin, self.tags.get(module)?.foreign(object)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tags(modules: usize) -> Arc<[ModuleTag]> {
        let names = ["anemones", "fish", "kelp"];
        ModuleTag::all(&names[..modules]).into()
    }

    fn flow(owner: u64, strength: f32) -> abi::Flow {
        abi::Flow { owner, strength, ..abi::Flow::default() }
    }

    #[test]
    fn a_module_knows_its_own_ids_and_never_takes_a_strangers_for_its_own() {
        let mut exchange = Exchange::new(tags(3));
        exchange.said[0].flows = vec![flow(1, 10.0)];
        exchange.said[1].flows = vec![flow(1, 20.0), flow(2, 21.0)];
        let (mut own, attached) = exchange.begin();
        own.push(flow(0, 1.0));
        exchange.pass_on(own, attached);
        for module in 0..3 {
            let heard: Vec<f32> = exchange.flow_for(module).iter().map(|flow| flow.strength).collect();
            assert_eq!(heard, [1.0, 10.0, 20.0, 21.0], "the order is the same for all");
        }
        let owners =
            |module: usize| exchange.flow_for(module).iter().map(|flow| flow.owner).collect::<Vec<_>>();
        let [a, b, _] = [0, 1, 2].map(|module| tags(3)[module]);
        assert_eq!(owners(0), [0, 1, b.foreign(1), b.foreign(2)]);
        assert_eq!(owners(1), [0, a.foreign(1), 1, 2]);
        assert_eq!(owners(2), [0, a.foreign(1), b.foreign(1), b.foreign(2)]);
    }

    #[test]
    fn an_actor_may_ride_on_a_strangers_object_which_its_module_knows() {
        let mut exchange = Exchange::new(tags(3));
        let [anemones, fish, _] = [0, 1, 2].map(|module| tags(3)[module]);
        // The anemones emit no actors, but know their own when the fish name them.
        let host = anemones.foreign(5);
        exchange.said[1].actors = vec![abi::Actor { id: 1, parent: host, ..abi::Actor::default() }];
        let (own, attached) = exchange.begin();
        exchange.pass_on(own, attached);
        let heard = |module: usize| exchange.actors_for(module).iter().map(|a| (a.id, a.parent)).next();
        assert_eq!(heard(0), Some((fish.foreign(1), 5)));
        assert_eq!(heard(1), Some((1, host)));
        assert_eq!(heard(2), Some((fish.foreign(1), host)));
    }

    #[test]
    fn what_the_scene_attaches_belongs_to_the_object_in_its_modules_own_words() {
        let mut exchange = Exchange::new(tags(3));
        exchange.said[2].flows = vec![flow(5, 20.0)];
        for (object, module) in [(6, 0), (7, 1), (9, 2)] {
            let (mut own, mut attached) = exchange.begin();
            let foreign = tags(3)[module].foreign(object);
            own.extend([flow(0, 1.0), flow(foreign, 2.0)]);
            attached.push(Attached { flow: 1, module, object });
            exchange.pass_on(own, attached);
            for hearer in 0..3 {
                let heard = exchange.flow_for(hearer)[1].owner;
                let wanted = if hearer == module { object } else { foreign };
                assert_eq!(heard, wanted, "what {hearer} hears of {module}'s");
            }
            let last = exchange.flow_for(2)[2].owner;
            assert_eq!((last, exchange.flow_for(0)[2].owner), (5, tags(3)[2].foreign(5)));
        }
    }

    #[test]
    fn objects_are_found_by_module_and_id() {
        let mut exchange = Exchange::new(tags(2));
        exchange.said[1].objects = Listed::Loaded(vec![(7, [1.0, 2.0, 3.0])]);
        assert_eq!(exchange.find(1, 7), Some(([1.0, 2.0, 3.0], tags(2)[1].foreign(7))));
        assert_eq!(exchange.find(0, 7), None);
        assert_eq!(exchange.find(9, 7), None);
    }
}
