//! What a fish must do, as properties and closed forms.

mod body;
mod carry;
mod equations;
mod extremes;
mod frames;
mod homes;
mod library;
mod mind;
mod poses;
mod shoal;
mod species;
mod strangers;
mod swimming;
mod waves;

use glam::DVec3;
use reef_fish_model::{
    Plan,
    body::{Body, Profile},
    material::{Beat, Drive, Material, Method},
    reference::Reference,
    tank::{Stepping, Swimmer, Tank},
};
use reef_flow::Level;
use reef_sdk::Workers;

/// A picture's time [s], and that of the thesis.
pub(crate) const DT: f64 = 1.0 / 60.0;
pub(crate) const THESIS_DT: f64 = 0.04;

pub(crate) fn body() -> Body {
    Body::new(&Profile::default()).expect("the default body")
}

pub(crate) fn plan(material: &Material, beat: &Beat) -> Plan {
    Plan::new(&body(), material, beat).expect("a plan")
}

pub(crate) fn usual() -> Plan {
    plan(&Material::default(), &Beat::default())
}

pub(crate) fn drive(speed: f64, force: f64) -> Drive {
    Drive { speed, force, ..Drive::default() }
}

/// One fish of this plan.
pub(crate) fn one(plan: Plan, drive: Drive) -> Tank {
    Tank::new(plan, vec![Swimmer { drive, ..Swimmer::at(DVec3::ZERO) }], &[])
}

pub(crate) fn implicit() -> Stepping {
    Stepping::default()
}

/// The thesis's ten sub-steps of 4 ms.
pub(crate) fn thesis(method: Method) -> Stepping {
    Stepping { method, longest: 0.004 }
}

pub(crate) fn step(tank: &mut Tank, dt: f64, stepping: &Stepping) {
    tank.step_all(dt, stepping, Level::best(), Workers::inline());
}

/// Nodes of a fish [m, world], in f64.
pub(crate) fn nodes(tank: &Tank, fish: usize) -> Vec<DVec3> {
    let origin = tank.swimmers()[fish].origin;
    tank.positions(fish).iter().map(|at| origin + glam::Vec3::from(*at).as_dvec3()).collect()
}

/// Greatest length of a spring over that at rest.
pub(crate) fn longest(plan: &Plan, nodes: &[DVec3]) -> f64 {
    let rest = plan.body().nodes();
    let stretch = |[a, b]: [usize; 2]| (nodes[b] - nodes[a]).length() / (rest[b] - rest[a]).length();
    plan.body().springs().iter().map(|link| stretch(link.ends)).fold(0.0, f64::max)
}

/// A fish of the reference at rest.
pub(crate) fn reference(material: &Material, beat: &Beat) -> Reference {
    Reference::new(&body(), material, beat)
}
