//! What plants do to the water: a source of each that moves (§4.3.4), and shelter behind dense beds.

use std::collections::BTreeMap;

use glam::DVec3;
use reef_flow::{Sphere, velocity8};
use reef_sdk::abi::{self, Flow};

use super::{BED, Bed, Kind, Pack, Plant, Surroundings, id_of};
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
/// A source that is slower than this [m/s] at a quarter of its reach is none.
const LEAST_SPEED: f32 = 0.01;
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
        self.disturbing();
        for i in 0..self.strongest.len() {
            let source = self.source(self.strongest[i]);
            self.flows.push(source);
        }
        self.shelters(around);
    }

    /// Who disturbs the water: those whose sources are the strongest, in the order of their numbers.
    fn disturbing(&mut self) {
        let Self { strongest, packs, .. } = self;
        strongest.clear();
        for pack in packs.iter() {
            let disturbs = pack.strength.iter().zip(pack.numbers).filter(|(strength, _)| **strength > 0.0);
            strongest.extend(disturbs.map(|(strength, plant)| (*strength, plant)));
        }
        if strongest.len() > MOST_SOURCES {
            strongest
                .select_nth_unstable_by(MOST_SOURCES - 1, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            strongest.truncate(MOST_SOURCES);
        }
        strongest.sort_unstable_by_key(|(_, plant)| *plant);
    }

    /// One source at the centre of gravity of a plant, by its acceleration, that reaches as far as its box.
    fn source(&self, (strength, plant): (f32, u32)) -> Flow {
        let [pack, lane] = self.places[plant as usize];
        let pack = &self.packs[pack as usize];
        let of =
            |lanes: &[Lane; 3]| DVec3::from(lanes.each_ref().map(|lanes| f64::from(lanes.0[lane as usize])));
        let reach = pack.half_box(lane as usize);
        Flow {
            owner: id_of(plant as usize),
            kind: abi::FLOW_SOURCE,
            position: (self.cells[pack.cell()].anchor() + of(&pack.stand.gravity)).to_array(),
            axis: [0.0, 1.0, 0.0],
            strength: strength.min(10.0),
            peak: speed(strength, reach).clamp(1e-4, 2.0),
            core: 0.25 * reach,
            reach,
            fade: 0.5,
            ..Flow::default()
        }
    }

    /// Dense squares calm the water behind them: what their plants take from the current's momentum on its
    /// way through.
    fn shelters(&mut self, around: &Surroundings<'_>) {
        let owner = BED;
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

/// Φ of a plant's source [m³/s]; 0 where that is too slow to be one.
pub(super) fn strength(pack: &Pack, kind: &Kind, lane: usize) -> f32 {
    let [x, y, z] = pack.stand.push.each_ref().map(|lanes| lanes.0[lane]);
    let size = pack.stand.size.0[lane];
    let strength = kind.disturbance as f32 * size * size * (x * x + y * y + z * z).sqrt();
    if speed(strength, pack.half_box(lane)) >= LEAST_SPEED { strength } else { 0.0 }
}

/// How fast a source is at a quarter of its reach [m/s].
fn speed(strength: f32, reach: f32) -> f32 {
    16.0 * strength / (reach * reach)
}

/// e to the power of x, the same bytes on every machine.
fn exp(x: f64) -> f64 {
    glam::DVec2::new(x, 0.0).exp().x
}
