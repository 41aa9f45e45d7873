//! What holds for a whole box in one step.

use reef_flow::{
    Packed, Sphere,
    random::mix,
    view::{PLANES, View},
    waves::Lens,
};
use reef_sdk::abi::Wave;

use super::{Cloud, Now, Surroundings, Swarm, fill, id_of, whole};
use crate::{
    drift::{Drift, Sight},
    levels::{Band, Levels, reach},
    ride::{Fades, Follow, Ride},
};

/// Slaves of a master ride by themselves when it comes as near to a wall as this [m], or as this share of the
/// box.
const WALL: (f64, f64) = (0.2, 0.04);

/// Places that are compared side by side.
const LANES: usize = 16;
/// How far beyond where they are centres may feel the water in a step [m].
const MARGIN: f64 = 0.2;

impl Cloud {
    /// Takes in a step's water and camera.
    pub(super) fn prepare(&mut self, around: &Surroundings<'_>) {
        let levels = self.levels;
        self.field.refill(around.flow);
        self.lasting.refill(around.flow, around.dt);
        self.choosing = levels.trains && !around.waves.is_empty();
        if around.dt > 0.0 {
            self.last_dt = around.dt;
        }
        let reached = self.reached.are(around.waves, around.depth);
        if !reached {
            self.reached.become_these(around.waves, around.depth);
        }
        let view = View::new(around.camera, levels.margin);
        let lens = Lens::new(around.camera);
        for (id, swarm) in (0..).map(id_of).zip(&mut self.swarms) {
            let bounds = Sphere { center: swarm.plan.center, radius: 1.01 * swarm.half.length() };
            fill(&mut swarm.packed, &self.field, bounds, &swarm.plan, id);
            swarm.sources.fill_near(self.lasting.field(), bounds, swarm.plan.center, id);
            // Who drifts meets the crests sooner or later: ω − k·V. It turns only the velocities, not the
            // places.
            let [vx, _, vz] = swarm.packed.uniform();
            let heights = [swarm.center.y - swarm.half.y, swarm.center.y + swarm.half.y];
            if self.choosing {
                let (threshold, rule) = (levels.threshold, levels.selection);
                swarm.choice.update(around.waves, around.depth, lens, threshold, rule, heights);
            } else {
                swarm.choice.forget();
            }
            self.met.clear();
            self.met.extend(swarm.choice.in_order(around.waves).map(|wave| {
                let along = wave.direction[0] * vx + wave.direction[1] * vz;
                Wave { frequency: wave.frequency - wave.wave_number * along, ..*wave }
            }));
            swarm.trains.fill(&self.met, around.depth, swarm.plan.center);
            if !reached {
                let [bottom, top] = heights;
                swarm.reach = reach(around.waves, around.depth, bottom, top);
            }
            swarm.begin(around, &levels, &view, self.last_dt);
        }
    }
}

impl Swarm {
    fn begin(&mut self, around: &Surroundings<'_>, levels: &Levels, view: &View, last_dt: f64) {
        let extent = self.plan.extent;
        let uniform = self.packed.uniform();
        let before = whole(self.turns);
        if around.dt > 0.0 {
            for axis in 0..3 {
                let turns = self.turns[axis] + f64::from(uniform[axis]) * around.dt / extent[axis];
                let turns = turns - turns.floor();
                self.turns[axis] = if turns.is_finite() { turns } else { 0.0 };
            }
        }
        let [low, high] = self.reach;
        let local = view.local(self.center);
        let far = levels.farthest_particle();
        let sprite = 0.5 * self.plan.size[1] * levels.size;
        // What is seen of a particle depends on how far away its centre is: at `far` nothing, wherever its
        // orbit takes it.
        let seen = match levels.visible {
            true => view.sees_box(self.center, self.half, far, high + sprite),
            false => view.box_distance(self.center, self.half) < far,
        };
        let smallest = extent.into_iter().fold(f64::INFINITY, f64::min);
        let [least, most] = self.plan.follow;
        let blur = 1e-6 * self.half.max_element();
        self.now = Now {
            flowing: !self.packed.is_uniform(),
            uniform,
            turns: extent.map(|e| (around.dt / e) as f32),
            half_step: (0.5 * last_dt) as f32,
            chance: mix(self.plan.seed ^ mix(around.step)),
            dt: around.dt as f32,
            still: around.dt <= 0.0,
            all: around.trace,
            before,
            after: whole(self.turns),
            sight: seen.then(|| Sight {
                local,
                cull: levels.visible,
                far: far as f32,
                margin: [
                    (0.5 * (low + high) + sprite) as f32,
                    // Per metre of height, upward from the middle.
                    ((high - low) / extent[1]) as f32,
                ],
            }),
            eye: local.eye,
            ahead: local.planes[PLANES - 1],
            follow: (levels.masters).then(|| Follow {
                distance: levels.master_band(),
                // What f32 makes of a place in the box, and more.
                least: Band::new(1.001 * least + blur, 1.25 * least + blur),
                most: Band::new(0.85 * most - blur, 0.999 * most - blur),
                wall: Band::new(0.0, WALL.0.min(WALL.1 * smallest)),
            }),
        };
    }

    /// A sphere around the centres of a chunk before a step, and around where they may get in two.
    pub(super) fn around(&self, at: [&[i32]; 3], alive: &[u16], groups: usize) -> Sphere {
        let mut center = self.plan.center;
        let mut square = 0.0;
        for axis in 0..3 {
            let (mut low, mut high) = ([i32::MAX; LANES], [i32::MIN; LANES]);
            for (member, &living) in alive.iter().enumerate() {
                let own = &at[axis][member * groups..][..usize::from(living)];
                let (lanes, rest) = own.as_chunks::<LANES>();
                for own in lanes {
                    for lane in 0..LANES {
                        let place = own[lane].wrapping_add(self.now.before[axis]);
                        low[lane] = low[lane].min(place);
                        high[lane] = high[lane].max(place);
                    }
                }
                for own in rest {
                    let place = own.wrapping_add(self.now.before[axis]);
                    (low[0], high[0]) = (low[0].min(place), high[0].max(place));
                }
            }
            let low = low.into_iter().fold(i32::MAX, i32::min);
            let high = high.into_iter().fold(i32::MIN, i32::max);
            let [low, high] = [low, high].map(|v| f64::from(v) / 4_294_967_296.0 * self.plan.extent[axis]);
            center[axis] += 0.5 * (low + high);
            square += (0.5 * (high - low)).powi(2);
        }
        Sphere { center, radius: square.sqrt() + MARGIN }
    }

    pub(super) fn drift<'a>(&'a self, packed: Option<&'a Packed>) -> Drift<'a> {
        let now = &self.now;
        Drift {
            packed: packed.filter(|packed| !packed.is_uniform()),
            uniform: now.uniform,
            turns: now.turns,
            half_step: now.half_step,
            unit: self.unit,
            before: now.before,
            now: now.after,
            view: now.sight,
            all: now.all,
            still: now.still,
            sources: Some(&self.sources).filter(|sources| sources.has_sources()),
            dt: now.dt,
            chance: now.chance,
        }
    }

    pub(super) fn ride<'a>(
        &'a self,
        object: u32,
        levels: &Levels,
        choosing: bool,
        packed: Option<&'a Packed>,
    ) -> Ride<'a> {
        let now = &self.now;
        Ride {
            packed: packed.filter(|packed| !packed.is_uniform()),
            uniform: now.uniform,
            trains: &self.trains,
            selection: if choosing { self.choice.selection() } else { None },
            level: self.center.y as f32,
            now: now.after,
            unit: self.unit,
            half: self.half.as_vec3().to_array(),
            extent: self.plan.extent,
            eye: now.eye,
            ahead: now.ahead,
            follow: now.follow,
            fades: Fades {
                near: Levels::near_band(),
                fog: levels.fog.then(|| levels.fog_band()),
                end: levels.end_band(),
            },
            half_step: now.half_step,
            looks: &self.looks,
            size: levels.size as f32,
            opacity: (f64::from(self.looks.opacity) * levels.opacity) as f32,
            object,
            center: self.plan.center,
        }
    }
}
