//! Which sources and holes stay: the water that those make or take brings particles with it, or takes them
//! along.
//!
//! One that moves along, as a fish does, pushes the particles and lets them go: behind it the water closes
//! again. So what a source or hole does to the number of particles around it counts the less, the farther it
//! moves in [`PASSING`], against its size a: by 1 / (1 + (v τ / a)²).

use reef_flow::Field;
use reef_sdk::abi::{self, Flow};

/// τ: what stays in its own place for so long stays [s].
const PASSING: f64 = 10.0;
/// A share that is none.
const NOTHING: f64 = 1e-4;

/// Sources and holes as they count.
#[derive(Clone, Debug, Default)]
pub struct Lasting {
    /// Where each source and hole was in the last step that had a length [m, world], in the host's order.
    places: Vec<[f64; 3]>,
    flows: Vec<Flow>,
    field: Field,
}

impl Lasting {
    /// Takes a step's primitives, in the host's order. `dt`: its length [s].
    pub fn refill(&mut self, flows: &[Flow], dt: f64) {
        self.flows.clear();
        let mut number = 0;
        for flow in flows {
            match flow.kind {
                abi::FLOW_SHELTER => self.flows.push(*flow),
                abi::FLOW_SOURCE | abi::FLOW_HOLE => {
                    let before = self.places.get(number).copied().unwrap_or(flow.position);
                    self.count(flow, before, dt);
                    if dt > 0.0 {
                        match self.places.get_mut(number) {
                            Some(place) => *place = flow.position,
                            None => self.places.push(flow.position),
                        }
                    }
                    number += 1;
                }
                _ => {}
            }
        }
        if dt > 0.0 {
            self.places.truncate(number);
        }
        self.field.refill(&self.flows);
    }

    fn count(&mut self, flow: &Flow, before: [f64; 3], dt: f64) {
        let way: f64 = (0..3).map(|axis| (flow.position[axis] - before[axis]).powi(2)).sum();
        let (softening, core, reach) =
            ((flow.strength.abs() / flow.peak).sqrt(), flow.core.abs(), flow.reach.max(0.0));
        let size = f64::from(softening + core + reach);
        let moved = if dt > 0.0 { way * (PASSING / (dt * size)).powi(2) } else { 0.0 };
        let share = 1.0 / (1.0 + moved);
        // What is no number is none.
        if share > NOTHING {
            let share = share as f32;
            // Both: |Φ|/Φ_max, the shape of its field, stays.
            self.flows.push(Flow { strength: flow.strength * share, peak: flow.peak * share, ..*flow });
        }
    }

    /// All of them.
    pub fn field(&self) -> &Field {
        &self.field
    }

    /// Where the sources and holes were [m, world]: a later step depends on it.
    pub fn places(&self) -> &[[f64; 3]] {
        &self.places
    }

    /// Takes back what [`Lasting::places`] gave.
    pub fn restore(&mut self, places: &[[f64; 3]]) {
        self.places.clear();
        self.places.extend_from_slice(places);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stays_counts_wholly_and_what_passes_hardly() {
        let hole = |x: f64| Flow {
            kind: abi::FLOW_HOLE,
            position: [x, 0.0, 0.0],
            strength: 0.1,
            peak: 0.4,
            ..Flow::default()
        };
        let mut lasting = Lasting::default();
        lasting.refill(&[hole(1.0)], 0.1);
        lasting.refill(&[hole(1.0)], 0.1);
        assert_eq!(lasting.flows, [hole(1.0)]);
        // Half a metre in size, at half a metre a second: ten times its size in τ.
        lasting.refill(&[hole(1.05)], 0.1);
        let share = lasting.flows[0].strength / 0.1;
        assert!((share * 101.0 - 1.0).abs() < 1e-3, "{share}");
        // A step of no length changes nothing.
        lasting.refill(&[hole(1.05)], 0.0);
        assert_eq!(lasting.places(), [[1.05, 0.0, 0.0]]);
    }
}
