//! What plants do to the water: a source of each that moves (§4.3.4), and shelter behind dense beds.

use std::collections::BTreeMap;

use glam::DVec3;
use reef_flow::{Sphere, velocity8};
use reef_sdk::abi::{self, Flow};

use super::{Bed, Kind, Plant, Surroundings, bed_id, id_of};
use crate::lanes::{Lane, WIDTH};

/// Side of the squares [m] whose plants shelter together what is behind them.
const PATCH: f64 = 8.0;

/// Plants of one square.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Patch {
    /// Mean root [m, world] and height of the plants [m].
    root: DVec3,
    height: f64,
    /// Drag of all of them [N·s/m].
    drag: f64,
    count: u32,
}

/// The squares that plants stand in, in the order of the first plant of each.
pub(super) fn patches(kinds: &[Kind], plants: &[Plant]) -> Vec<Patch> {
    let mut numbers = BTreeMap::new();
    let mut patches: Vec<Patch> = Vec::new();
    for plant in plants {
        let Some(kind) = kinds.get(plant.kind) else { continue };
        let key = plant.root.to_array().map(|x| (x / PATCH).round() as i64);
        let number = *numbers.entry(key).or_insert_with(|| {
            patches.push(Patch::default());
            patches.len() - 1
        });
        let patch = &mut patches[number];
        let drag: f64 = kind.skeleton.segments().iter().map(|segment| segment.drag).sum();
        patch.drag += drag * plant.size * plant.size;
        patch.count += 1;
        let share = 1.0 / f64::from(patch.count);
        patch.root += (plant.root - patch.root) * share;
        patch.height += (kind.skeleton.reach() * plant.size - patch.height) * share;
    }
    patches
}

/// Most sources: those of the plants that disturb the water most.
pub const MOST_SOURCES: usize = 64;
/// A source below this Φ [m³/s] is none.
const LEAST_SOURCE: f32 = 1e-5;
/// A shelter below this strength is none.
const LEAST_SHELTER: f64 = 0.1;
/// No bed calms the water by more than this share.
const MOST_SHELTER: f64 = 0.85;
/// Added to the speed of the water [m/s], so that a bed calms slack water by a share, too.
const SLACK: f64 = 0.05;

impl Bed {
    /// Lists what the plants emit after a step.
    pub(super) fn emit(&mut self, around: &Surroundings<'_>) {
        self.flows.clear();
        self.sources();
        self.flows.sort_unstable_by(|a, b| b.strength.total_cmp(&a.strength).then(a.owner.cmp(&b.owner)));
        self.flows.truncate(MOST_SOURCES);
        self.flows.sort_unstable_by_key(|flow| flow.owner);
        self.shelters(around);
    }

    /// One source at the centre of gravity of each plant, by its acceleration, that reaches as far as its box.
    fn sources(&mut self) {
        for pack in &self.packs {
            let kind = &self.kinds[pack.kind()];
            let anchor = self.cells[pack.cell()].anchor();
            for (lane, number) in pack.lanes() {
                // What made up for steps did not move, and far away nobody sees what it disturbs.
                if !pack.stepped(lane) || pack.jumped(lane) || pack.detail(lane)[0] >= 2.0 {
                    continue;
                }
                let of = |lanes: &[Lane; 3]| [0, 1, 2].map(|i| lanes[i].0[lane]);
                let [x, y, z] = of(&pack.stand.push);
                let size = pack.stand.size.0[lane];
                let push = (x * x + y * y + z * z).sqrt();
                let strength = kind.disturbance as f32 * size * size * push;
                if strength < LEAST_SOURCE {
                    continue;
                }
                let (low, high) = (of(&pack.stand.low), of(&pack.stand.high));
                let half = 0.5 * (DVec3::from(high.map(f64::from)) - DVec3::from(low.map(f64::from))).length();
                let reach = half.max(0.05) as f32;
                self.flows.push(Flow {
                    owner: id_of(number as usize),
                    kind: abi::FLOW_SOURCE,
                    position: (anchor + DVec3::from(of(&pack.stand.gravity).map(f64::from))).to_array(),
                    axis: [0.0, 1.0, 0.0],
                    strength: strength.min(10.0),
                    // As fast as the source is at a quarter of its reach.
                    peak: (16.0 * strength / (reach * reach)).clamp(1e-4, 2.0),
                    core: 0.25 * reach,
                    reach,
                    fade: 0.5,
                    ..Flow::default()
                });
            }
        }
    }

    /// Dense cells calm the water behind them: what their plants take from the current's momentum on its way through.
    fn shelters(&mut self, around: &Surroundings<'_>) {
        let owner = bed_id(self.plants.len());
        for patch in &self.patches {
            let height = patch.height.max(0.1);
            // Share of its momentum that water of 1 m/s loses on its way through the square.
            let thickness = patch.drag / (PATCH * height * around.density.max(1.0));
            if 1.0 - exp(-thickness / SLACK) < LEAST_SHELTER {
                continue;
            }
            let center = patch.root + DVec3::Y * (0.5 * height);
            let near = Sphere { center: center.to_array(), radius: 0.1 };
            self.ambient.fill_near(&self.field, near, center.to_array(), owner);
            let ambient = &self.ambient;
            let water: [f32; 3] = reef_flow::dispatch!(reef_flow::Level::scalar(), simd => {
                let zero = reef_flow::simd::splat(simd, 0.0);
                let v = velocity8(simd, ambient, zero, zero, zero);
                let lane = |lanes: reef_flow::fearless_simd::f32x8<_>| {
                    let eight: [f32; WIDTH] = lanes.into();
                    eight[0]
                };
                [lane(v[0]), lane(v[1]), lane(v[2])]
            });
            let flat = DVec3::new(f64::from(water[0]), 0.0, f64::from(water[2]));
            let speed = flat.length();
            let strength = (1.0 - exp(-thickness / (speed + SLACK))).min(MOST_SHELTER);
            if strength < LEAST_SHELTER {
                continue;
            }
            // From the square's middle downstream; in slack water around it.
            let reach = (0.75 * PATCH).max(0.5 * height);
            let behind = flat * (reach / (speed + SLACK));
            self.flows.push(Flow {
                owner,
                kind: abi::FLOW_SHELTER,
                position: (center + behind).to_array(),
                axis: [0.0, 1.0, 0.0],
                strength: strength as f32,
                reach: reach as f32,
                fade: 0.3,
                ..Flow::default()
            });
        }
    }
}

/// e to the power of x, the same bytes on every machine.
fn exp(x: f64) -> f64 {
    glam::DVec2::new(x, 0.0).exp().x
}
