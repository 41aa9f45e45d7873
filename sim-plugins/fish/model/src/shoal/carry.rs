//! The singularity that each fish carries (Aliaga and Larboulette 2009, figures 1, 13 to 16): it rises as the
//! fish comes near an anemone, and with its speed, and falls the same way.

use reef_sdk::abi::{self, Flow};

use super::{Everybody, Shoal, Surroundings, id_of};
use crate::species::Singularity;

/// A primitive below this share of its strength is none.
const LEAST: f64 = 1e-3;
/// At rest a fish's primitive has this share of its strength at top speed.
const AT_REST: f64 = 0.4;

impl Shoal {
    /// Lists what the fish emit after a step, in the order of their numbers.
    pub(super) fn carry(&mut self, around: &Surroundings<'_>) {
        self.flows.clear();
        if self.kinds.iter().all(|kind| kind.carries.kind == Singularity::None) {
            return;
        }
        for (number, fish) in Everybody::new(&self.fish, &self.kept).iter().enumerate() {
            let kind = &self.kinds[fish.kind as usize];
            let flow_kind = match kind.carries.kind {
                Singularity::None => continue,
                Singularity::Source => abi::FLOW_SOURCE,
                Singularity::Hole => abi::FLOW_HOLE,
            };
            let reach = kind.carries.reach * kind.length() * fish.size;
            let gaps = around.hosts.iter().map(|host| host.position.distance(fish.position) - host.radius);
            let near = smooth(1.0 - gaps.fold(f64::INFINITY, f64::min) / reach);
            let fast = smooth(f64::from(fish.speed) / (kind.gait.top_speed() * fish.size));
            let share = near * (AT_REST + (1.0 - AT_REST) * fast);
            if share < LEAST {
                continue;
            }
            // From nothing at the least share on: no primitive comes or goes with a jump.
            let strength = kind.carries.strength * (share - LEAST) / (1.0 - LEAST);
            self.flows.push(Flow {
                owner: id_of(number),
                kind: flow_kind,
                position: fish.position.to_array(),
                axis: [0.0, 1.0, 0.0],
                strength: strength as f32,
                // As fast as the primitive is at a quarter of its reach.
                peak: (16.0 * kind.carries.strength / (reach * reach)).clamp(1e-4, 2.0) as f32,
                core: (0.25 * reach) as f32,
                reach: reach as f32,
                fade: 0.5,
                ..Flow::default()
            });
        }
    }
}

/// 0 up to u = 0, 1 from u = 1 on, smooth in between.
fn smooth(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * (3.0 - 2.0 * u)
}
