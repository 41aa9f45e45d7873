//! Which anemone is whose home.
//!
//! A fish whose species lives in anemones takes one of those that the sea shows, and keeps it. It knows it by
//! its id and by where it stands, so neither a saved state nor another order of modules gives it another.

use glam::DVec3;

use super::{Everybody, Fish, Habitat, Host, Kind, Shoal};

/// An anemone that a fish has taken for its home.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Home {
    /// The host's id of it.
    pub id: u64,
    /// Where it was in the last step in which it was seen [m, world].
    pub place: DVec3,
}

/// Where a fish whose species has homes is at home.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lodging {
    /// A home that is given by hand [m, world].
    given: Option<DVec3>,
    /// The anemone that it lives in.
    pub(super) home: Option<Home>,
}

impl Lodging {
    /// A home by hand, or none yet.
    pub(super) fn given(given: Option<DVec3>) -> Self {
        Self { given, home: None }
    }

    /// Whether a fish of this kind takes an anemone for its home.
    pub(super) fn is_in_anemones(&self, kind: &Kind) -> bool {
        self.given.is_none() && !kind.lives_in.is_empty()
    }

    /// Where it is [m, world]: what is given by hand comes first.
    pub(super) fn place(&self) -> Option<DVec3> {
        self.given.or(self.home.map(|home| home.place))
    }
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
        let Self { fish, kept, firsts, kinds, habitats, lodgings, register, .. } = self;
        let lives = |kind: &Kind, lodging: &Lodging| lodging.is_in_anemones(kind);
        let mut all = kinds.iter().zip(&*lodgings);
        if hosts.is_empty() || !all.any(|(kind, own)| own.iter().any(|lodging| lives(kind, lodging))) {
            return;
        }
        register.fill(hosts);
        let take = |register: &mut Register, lodging: &mut Lodging, found: Option<usize>| {
            lodging.home = found.map(|index| Home { id: hosts[index].id, place: hosts[index].position });
            if let Some(index) = found {
                register.tenants[index] += 1;
            }
        };
        for (kind, lodgings) in kinds.iter().zip(&mut *lodgings) {
            for lodging in lodgings.iter_mut().filter(|lodging| lives(kind, lodging)) {
                if let Some(home) = lodging.home {
                    let found = register.find(hosts, kind, &home);
                    take(register, lodging, found);
                }
            }
        }
        // Whoever finds none finds none for all of its kind in its habitat.
        let mut none = None;
        let everybody = Everybody::new(fish, kept);
        for ((kind, lodgings), first) in kinds.iter().zip(lodgings).zip(firsts) {
            let homeless = |lodging: &Lodging| lives(kind, lodging) && lodging.home.is_none();
            for (slot, lodging) in lodgings.iter_mut().enumerate().filter(|(_, lodging)| homeless(lodging)) {
                let own = everybody.one(*first as usize + slot);
                let who = Some((own.kind, own.habitat));
                if none == who {
                    continue;
                }
                let found = register.choose(hosts, kind, own, &habitats[own.habitat as usize]);
                if found.is_none() {
                    none = who;
                }
                take(register, lodging, found);
            }
        }
    }

    /// Where a fish of a species that has homes is at home.
    pub(super) fn lodging(&self, number: usize) -> Option<&Lodging> {
        let fish = self.one(number);
        self.lodgings[fish.kind as usize].get(fish.slot as usize)
    }
}
