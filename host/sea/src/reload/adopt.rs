//! An edited scene in the place of the running one. Modules whose name, plugin and configuration are the same
//! go on as they are; the others begin anew. All that takes time is made beforehand, beside the sea.

use std::path::PathBuf;

use reef_plugin::{Asset, Instance, Registry};
use reef_streams::identity::ModuleTag;

use crate::{
    scene::Scene,
    step::{
        exchange::Exchange,
        journal::{Input, ParamInput},
        member::{Member, instance_of},
        setting::Setting,
        world::{World, WorldError},
    },
};

/// What an edited scene is compared with.
#[derive(Clone, Debug)]
pub struct Before {
    serial: u64,
    modules: Vec<Known>,
}

#[derive(Clone, Debug)]
struct Known {
    name: String,
    plugin: String,
    config: String,
    /// What its instance read.
    assets: Vec<Asset>,
}

impl Known {
    /// Whether its instance can go on as `new`, whose files nobody has read yet.
    fn goes_on_as(&self, new: &Self) -> bool {
        let same = (&self.name, &self.plugin, &self.config) == (&new.name, &new.plugin, &new.config);
        same && !self.assets.iter().any(Asset::has_changed)
    }
}

/// An edited scene, ready to be taken up.
#[derive(Debug)]
pub struct Edition {
    serial: u64,
    setting: Setting,
    /// One a module: a new instance, or the number of the one that goes on.
    places: Vec<Place>,
}

#[derive(Debug)]
enum Place {
    GoesOn(usize),
    Anew(Box<Instance>),
}

/// What taking up an edited scene did.
#[derive(Debug)]
pub struct Adopted {
    /// Modules that go on.
    pub carried: Vec<String>,
    /// Modules that began anew.
    pub anew: Vec<String>,
    /// Instances that nobody needs any more.
    pub former: Vec<Instance>,
}

fn known(scene: &Scene, seed: u64) -> Vec<Known> {
    let known = |module: &crate::scene::Module| Known {
        name: module.name.clone(),
        plugin: module.plugin.clone(),
        config: module.create_json(scene, seed),
        assets: Vec::new(),
    };
    scene.modules.iter().map(known).collect()
}

impl Edition {
    /// Makes all that is new in a scene. `seed`: in place of the scene's own.
    pub fn new(
        scene: Scene,
        seed: Option<u64>,
        before: &Before,
        plugins: &Registry,
    ) -> Result<Self, WorldError> {
        let seed = seed.unwrap_or(scene.file.scene.seed);
        let mut places = Vec::new();
        for (module, new) in scene.modules.iter().zip(known(&scene, seed)) {
            places.push(match before.modules.iter().position(|old| old.goes_on_as(&new)) {
                Some(at) => Place::GoesOn(at),
                None => Place::Anew(Box::new(instance_of(module, &new.config, &scene.assets, plugins)?)),
            });
        }
        Ok(Self { serial: before.serial, setting: Setting::new(scene, seed)?, places })
    }

    /// The files that its new instances read.
    pub(crate) fn assets(&self) -> Vec<PathBuf> {
        let read = |place: &Place| match place {
            Place::Anew(instance) => instance.assets(),
            Place::GoesOn(_) => Vec::new(),
        };
        self.places.iter().flat_map(read).map(|asset| asset.path).collect()
    }
}

impl World {
    /// What an edited scene is to be compared with.
    pub fn before(&self) -> Before {
        let mut modules = known(&self.setting.scene, self.setting.seed);
        for (module, member) in modules.iter_mut().zip(&self.members) {
            module.assets = member.instance.assets();
        }
        Before { serial: self.serial, modules }
    }

    /// Takes up an edited scene; where no module goes on, the sea begins at its first moment. `Err`: it was
    /// made for another sea than this one is now.
    pub fn adopt(&mut self, edition: Edition) -> Result<Adopted, Box<Edition>> {
        if edition.serial != self.serial {
            return Err(Box::new(edition));
        }
        self.serial += 1;
        let Edition { setting, places, .. } = edition;
        let scene = setting.scene.clone();
        let mut old: Vec<Option<Member>> = std::mem::take(&mut self.members).into_iter().map(Some).collect();
        let names: Vec<&str> = scene.modules.iter().map(|module| module.name.as_str()).collect();
        let exchange = Exchange::new(ModuleTag::all(&names).into());
        let (mut carried, mut anew, mut heard) = (Vec::new(), Vec::new(), Vec::new());
        let mut wanted = Vec::new();
        for (at, (place, module)) in places.into_iter().zip(&scene.modules).enumerate() {
            let goes_on = match &place {
                Place::GoesOn(former) => old.get_mut(*former).and_then(Option::take).map(|m| (*former, m)),
                Place::Anew(_) => None,
            };
            let member = match (goes_on, place) {
                (Some((former, mut member)), _) => {
                    heard.push((at, std::mem::take(&mut self.exchange.said[former])));
                    carried.push(module.name.clone());
                    wanted.extend(member.changed_params(&module.params).map(|change| (at, change)));
                    member.go_on(&module.params);
                    member
                }
                (None, Place::Anew(instance)) => {
                    anew.push(module.name.clone());
                    Member::new(&module.name, &module.params, *instance)
                }
                // Two modules cannot have one name, so each goes on once.
                (None, Place::GoesOn(_)) => continue,
            };
            self.members.push(member);
        }
        if carried.is_empty() || self.clock.dt != scene.file.scene.dt {
            self.clock.step = 0;
            self.hands.let_go();
        }
        self.clock.dt = scene.file.scene.dt;
        self.install(setting, exchange);
        self.refresh_after(heard, World::refresh_new);
        for (at, (id, value)) in wanted {
            let member = &self.members[at];
            let param = member.instance.info().params.iter().find(|param| param.id == id);
            let key = param.map_or_else(String::new, |param| param.key.clone());
            let input = ParamInput { module: member.name.clone(), key, id, value };
            self.ask(Input::Param(input));
        }
        let former = old.into_iter().flatten().map(|member| member.instance).collect();
        Ok(Adopted { carried, anew, former })
    }
}
