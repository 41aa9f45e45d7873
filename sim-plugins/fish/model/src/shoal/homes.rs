//! Which anemone is whose home.
//!
//! A fish whose species lives in anemones takes one of those that the sea shows, and keeps it. It knows it by
//! its id and by where it stands, so neither a saved state nor another order of modules gives it another.

use glam::DVec3;

use super::{Fish, Habitat, Host, Kind, Shoal};

/// An anemone that a fish has taken for its home.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Home {
    /// The host's id of it.
    pub id: u64,
    /// Where it was in the last step in which it was seen [m, world].
    pub place: DVec3,
}

/// In one step an anemone sways by less than this share of its radius.
const SAME: f64 = 0.5;

/// The anemones of a step, as who looks for one needs them.
#[derive(Clone, Debug, Default)]
pub(super) struct Register {
    /// Ids, rising, and where each is in the list of hosts.
    known: Vec<(u64, u32)>,
    /// How many fish live in each of the hosts.
    tenants: Vec<u32>,
}

impl Register {
    fn fill(&mut self, hosts: &[Host]) {
        self.known.clear();
        self.known.extend(hosts.iter().zip(0..).map(|(host, index)| (host.id, index)));
        self.known.sort_unstable();
        self.tenants.clear();
        self.tenants.resize(hosts.len(), 0);
    }

    /// Where a home is among the hosts: by its id, or by its place where its id has changed.
    fn find(&self, hosts: &[Host], kind: &Kind, home: &Home) -> Option<usize> {
        let same = |host: &Host| {
            kind.lives_in.contains(&host.species) && host.position.distance(home.place) <= SAME * host.radius
        };
        let known = self.known.binary_search_by_key(&home.id, |(id, _)| *id).ok();
        let known = known.map(|at| self.known[at].1 as usize).filter(|index| same(&hosts[*index]));
        known.or_else(|| best(hosts, |_, host| same(host).then(|| host.position.distance(home.place))))
    }

    /// The nearest one within its habitat; one with fish in it counts as so many times farther.
    fn choose(&self, hosts: &[Host], kind: &Kind, fish: &Fish, habitat: &Habitat) -> Option<usize> {
        best(hosts, |index, host| {
            let fits = kind.lives_in.contains(&host.species)
                && habitat.low.cmple(host.position).all()
                && host.position.cmple(habitat.high).all();
            fits.then(|| fish.position.distance(host.position) * f64::from(1 + self.tenants[index]))
        })
    }
}

/// The host with the least cost, of those that have one. Of two alike the one with the lesser place is taken,
/// in whatever order they stand.
fn best(hosts: &[Host], cost: impl Fn(usize, &Host) -> Option<f64>) -> Option<usize> {
    let costs = hosts.iter().enumerate().filter_map(|(index, host)| Some((index, cost(index, host)?)));
    let place = |index: usize| hosts[index].position.to_array();
    let by_place = |a: usize, b: usize| {
        let axes = place(a).into_iter().zip(place(b));
        axes.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(core::cmp::Ordering::Equal)
    };
    costs.min_by(|a, b| a.1.total_cmp(&b.1).then_with(|| by_place(a.0, b.0))).map(|(index, _)| index)
}

impl Shoal {
    /// Every fish that lives in anemones looks where its own is, and takes one if it has none. Where none is
    /// seen at all, it stays with the place that it knows.
    pub(super) fn settle(&mut self, hosts: &[Host]) {
        let Self { fish, kinds, habitats, register, .. } = self;
        let lives = |fish: &Fish| fish.lives_in_anemones(&kinds[fish.kind as usize]);
        if hosts.is_empty() || !fish.iter().any(lives) {
            return;
        }
        register.fill(hosts);
        let take = |register: &mut Register, fish: &mut Fish, found: Option<usize>| {
            fish.home = found.map(|index| Home { id: hosts[index].id, place: hosts[index].position });
            if let Some(index) = found {
                register.tenants[index] += 1;
            }
        };
        for own in fish.iter_mut().filter(|fish| lives(fish)) {
            if let Some(home) = own.home {
                let found = register.find(hosts, &kinds[own.kind as usize], &home);
                take(register, own, found);
            }
        }
        // Whoever finds none finds none for all of its kind in its habitat.
        let mut none = None;
        for own in fish.iter_mut().filter(|fish| lives(fish) && fish.home.is_none()) {
            let who = Some((own.kind, own.habitat));
            if none == who {
                continue;
            }
            let habitat = &habitats[own.habitat as usize];
            let found = register.choose(hosts, &kinds[own.kind as usize], own, habitat);
            if found.is_none() {
                none = who;
            }
            take(register, own, found);
        }
    }
}

impl Fish {
    /// Whether it takes an anemone for its home.
    pub(super) fn lives_in_anemones(&self, kind: &Kind) -> bool {
        self.given.is_none() && !kind.lives_in.is_empty()
    }

    /// Where its home is, if it has one [m, world]: what is given by hand comes first.
    pub fn home(&self) -> Option<DVec3> {
        self.given.or(self.home.map(|home| home.place))
    }
}
