//! What moves the water by itself: the scene's primitives along their keyframes, and what people stir up.

use std::f64::consts::TAU;

use glam::DVec3;
use reef_abi as abi;
use reef_flow::keyframe::{Track, TrackError};
use serde::{Deserialize, Serialize};

use crate::scene::{
    Scene,
    flow_tables::{AttachTable, FlowTable},
    format::ObstacleTable,
    keyed::Keyed,
};

/// Where the objects were in the step before.
pub trait Objects {
    /// Origin [m] of an object of a module, and the id by which all instances know it as an owner.
    fn find(&self, module: usize, object: u64) -> Option<([f64; 3], u64)>;
}

/// A primitive of the scene's that moves with an object: that one does not feel it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attached {
    /// Number of the primitive in the list that it stands in.
    pub flow: usize,
    /// Number of the object's module.
    pub module: usize,
    /// The object, as its module calls it.
    pub object: u64,
}

/// All primitives and moving obstacles of a scene.
#[derive(Clone, Debug)]
pub struct Water {
    primitives: Vec<Primitive>,
    obstacles: Vec<(abi::Obstacle, Track<[f64; 3]>)>,
}

#[derive(Clone, Debug)]
struct Primitive {
    /// All that does not change.
    base: abi::Flow,
    position: Track<[f64; 3]>,
    axis: Track<[f64; 3]>,
    strength: Track<f64>,
    /// Seconds a swing, and its phase at the time 0 in rounds.
    swing: Option<(f64, f64)>,
    /// Module and object.
    attach: Option<(usize, u64)>,
}

impl Water {
    /// What a scene says, all lengths in metres.
    pub fn new(scene: &Scene) -> Result<Self, TrackError> {
        let primitives =
            scene.file.flow.iter().map(|flow| primitive(flow, scene)).collect::<Result<_, _>>()?;
        let obstacles = scene.file.obstacle.iter().enumerate();
        let obstacles = obstacles.map(|(number, table)| obstacle(number, table)).collect::<Result<_, _>>()?;
        Ok(Self { primitives, obstacles })
    }

    /// The scene's primitives at a time [s], in its order. What is attached to something that is not there is
    /// left out; what is attached to something is listed in `attached`.
    pub fn flow(
        &self,
        time: f64,
        objects: &dyn Objects,
        out: &mut Vec<abi::Flow>,
        attached: &mut Vec<Attached>,
    ) {
        for primitive in &self.primitives {
            let mut flow = primitive.base;
            let mut position = primitive.position.at(time);
            if let Some((module, object)) = primitive.attach {
                let Some((origin, owner)) = objects.find(module, object) else { continue };
                position = [0, 1, 2].map(|axis| position[axis] + origin[axis]);
                flow.owner = owner;
                attached.push(Attached { flow: out.len(), module, object });
            }
            flow.position = position;
            // Between two opposite keys an axis may pass through zero: it then keeps no direction, and moves
            // nothing.
            let axis = DVec3::from_array(primitive.axis.at(time)).normalize_or_zero();
            flow.axis = axis.as_vec3().to_array();
            flow.strength = primitive.strength.at(time) as f32;
            if axis == DVec3::ZERO {
                flow.axis = [0.0, 1.0, 0.0];
                flow.strength = 0.0;
            }
            if let Some((period, start)) = primitive.swing {
                flow.phase = ((time / period + start).rem_euclid(1.0) * TAU) as f32;
            }
            out.push(flow);
        }
    }

    /// The scene's obstacles at a time [s].
    pub fn obstacles(&self, time: f64, out: &mut Vec<abi::Obstacle>) {
        for (obstacle, motion) in &self.obstacles {
            let shift = motion.at(time);
            let from = [0, 1, 2].map(|axis| obstacle.from[axis] + shift[axis]);
            out.push(abi::Obstacle { from, ..*obstacle });
        }
    }
}

fn primitive(flow: &FlowTable, scene: &Scene) -> Result<Primitive, TrackError> {
    let attached = |attach: &Option<AttachTable>| {
        let attach = attach.as_ref()?;
        let module = scene.modules.iter().position(|module| module.name == attach.module)?;
        Some((module, attach.object))
    };
    let up = || Track::constant([0.0, 1.0, 0.0]);
    let still = || Track::constant([0.0; 3]);
    let base = abi::Flow { axis: [0.0, 1.0, 0.0], peak: 1.0, ..abi::Flow::default() };
    Ok(match flow {
        FlowTable::Source(table) | FlowTable::Hole(table) => {
            let kind = if matches!(flow, FlowTable::Source(_)) { abi::FLOW_SOURCE } else { abi::FLOW_HOLE };
            Primitive {
                base: abi::Flow {
                    kind,
                    peak: table.peak as f32,
                    core: table.core as f32,
                    reach: table.reach as f32,
                    fade: table.fade as f32,
                    ..base
                },
                position: table.position.track()?,
                axis: up(),
                strength: table.strength.track()?,
                swing: None,
                attach: attached(&table.attach),
            }
        }
        FlowTable::Whirlwind(table) => Primitive {
            base: abi::Flow {
                kind: abi::FLOW_WHIRLWIND,
                peak: table.peak as f32,
                core: table.core as f32,
                reach: table.reach as f32,
                fade: table.fade as f32,
                ..base
            },
            position: table.position.track()?,
            axis: table.axis.track()?,
            strength: table.strength.track()?,
            swing: None,
            attach: attached(&table.attach),
        },
        FlowTable::Directional(table) => {
            let travel = match (table.travel, &table.direction) {
                (Some(travel), _) => travel,
                (None, Keyed::Fixed(direction)) => *direction,
                (None, keys) => keys.track()?.at(0.0),
            };
            let travel = DVec3::from_array(travel).normalize_or_zero();
            let k = if table.wavelength > 0.0 { TAU / table.wavelength } else { 0.0 };
            Primitive {
                base: abi::Flow {
                    kind: abi::FLOW_DIRECTIONAL,
                    modulation: table.modulation as f32,
                    wave_vector: (travel * -k).as_vec3().to_array(),
                    gradient: table.gradient as f32,
                    level: table.level as f32,
                    ..base
                },
                position: still(),
                axis: table.direction.track()?,
                strength: table.speed.track()?,
                swing: Some((table.period, table.phase / 360.0)),
                attach: None,
            }
        }
        FlowTable::Shelter(table) => Primitive {
            base: abi::Flow {
                kind: abi::FLOW_SHELTER,
                reach: table.reach as f32,
                fade: table.fade as f32,
                ..base
            },
            position: table.position.track()?,
            axis: up(),
            strength: table.strength.track()?,
            swing: None,
            attach: attached(&table.attach),
        },
    })
}

fn obstacle(number: usize, table: &ObstacleTable) -> Result<(abi::Obstacle, Track<[f64; 3]>), TrackError> {
    let delta = [0, 1, 2].map(|axis| (table.to[axis] - table.from[axis]) as f32);
    let id = number as u64 + 1;
    Ok((abi::Obstacle { id, from: table.from, delta, radius: table.radius as f32 }, table.motion.track()?))
}

/// Somebody touches the water.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Poke {
    /// Where [m].
    pub point: [f64; 3],
    /// Id of the object that was hit, as other modules know it; 0: none.
    pub object: u64,
    /// Which way the hand moved [m/s]; zero: a push at the spot.
    pub motion: [f64; 3],
    /// The way the person looks, of length 1: a moving hand stirs about an axis across both.
    pub view: [f64; 3],
    /// Speed of the water at the spot [m/s].
    pub speed: f64,
    /// How far it is felt [m].
    pub reach: f64,
}

/// A poke is felt for this long [s].
pub const POKE_TIME: f64 = 1.6;
/// It rises for this long [s].
const POKE_RISE: f64 = 0.25;
/// So many can be felt at once; more are not taken until one has faded.
pub const MOST_POKES: usize = 16;
/// Fastest water that a poke makes [m/s].
const FASTEST_POKE: f64 = 5.0;

impl Poke {
    /// Whether it says anything that the water could follow.
    pub fn is_sound(&self) -> bool {
        let numbers =
            self.point.iter().chain(&self.motion).chain(&self.view).chain([&self.speed, &self.reach]);
        numbers.copied().all(|x| x.is_finite() && x.abs() < 1e6) && self.speed >= 0.0 && self.reach > 0.0
    }

    /// What it does to the water when it is `age` seconds old: a source where the hand pushes, a whirl where
    /// it moves. It comes and goes smoothly.
    pub fn flow(&self, age: f64) -> Option<abi::Flow> {
        if !(0.0..POKE_TIME).contains(&age) {
            return None;
        }
        let ease = |x: f64| {
            let x = x.clamp(0.0, 1.0);
            x * x * (3.0 - 2.0 * x)
        };
        let strength = ease(age / POKE_RISE) * ease((POKE_TIME - age) / (POKE_TIME - POKE_RISE));
        let speed = self.speed.min(FASTEST_POKE) * strength;
        let axis = DVec3::from_array(self.view).cross(DVec3::from_array(self.motion)).normalize_or_zero();
        let stirs = axis != DVec3::ZERO;
        // |Φ| / (|Φ| / Φ_max + d²) is half of Φ_max at d² = |Φ| / Φ_max: a third of the reach.
        let half = self.reach / 3.0;
        Some(abi::Flow {
            kind: if stirs { abi::FLOW_WHIRLWIND } else { abi::FLOW_SOURCE },
            position: self.point,
            axis: if stirs { axis.as_vec3().to_array() } else { [0.0, 1.0, 0.0] },
            strength: (speed * half * half) as f32,
            peak: speed.max(1e-6) as f32,
            core: (self.reach * 0.15) as f32,
            reach: self.reach as f32,
            fade: 0.3,
            ..abi::Flow::default()
        })
    }
}

/// A poke and the step in which it came.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActivePoke {
    /// First step that feels it.
    pub step: u64,
    /// What was done.
    pub poke: Poke,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{AnyPlugin, error::Source, load_text};

    struct Nothing;

    impl Objects for Nothing {
        fn find(&self, _: usize, _: u64) -> Option<([f64; 3], u64)> {
            None
        }
    }

    struct Fish;

    impl Objects for Fish {
        fn find(&self, module: usize, object: u64) -> Option<([f64; 3], u64)> {
            (module == 0 && object == 7).then_some(([10.0, 0.0, 0.0], 99))
        }
    }

    fn water(text: &str) -> Water {
        let path = std::path::Path::new("test.toml");
        let source = Source { name: "test".into(), text: text.into() };
        Water::new(&load_text(path, source, path, &AnyPlugin).expect("a good scene")).expect("good keys")
    }

    fn flow_at(water: &Water, time: f64, objects: &dyn Objects) -> Vec<abi::Flow> {
        let (mut flow, mut attached) = (Vec::new(), Vec::new());
        water.flow(time, objects, &mut flow, &mut attached);
        let owned: Vec<usize> = (0..flow.len()).filter(|at| flow[*at].owner != 0).collect();
        assert_eq!(attached.iter().map(|attached| attached.flow).collect::<Vec<_>>(), owned);
        flow
    }

    #[test]
    fn a_keyed_source_becomes_a_hole_and_moves() {
        let water = water(
            "[[flow]]\nkind = 'source'\n\
             strength = { interpolation = 'linear', keys = [{ time = 0, value = 2 }, { time = 4, value = -2 }] }\n\
             position = { interpolation = 'linear', keys = [{ time = 0, value = [0, 0, 0] }, { time = 2, value = [0, 4, 0] }] }\n",
        );
        let at = |time| flow_at(&water, time, &Nothing)[0];
        assert_eq!((at(0.0).strength, at(1.0).strength, at(3.0).strength), (2.0, 1.0, -1.0));
        assert_eq!(at(1.0).position, [0.0, 2.0, 0.0]);
        assert_eq!(at(1.0).kind, abi::FLOW_SOURCE);
    }

    #[test]
    fn a_swing_travels_along_its_direction_and_its_phase_stays_small() {
        let water = water(
            "[[flow]]\nkind = 'directional'\ndirection = [2, 0, 0]\nspeed = 0.3\nmodulation = 1\nperiod = 4\nwavelength = 8\n",
        );
        let at = |time| flow_at(&water, time, &Nothing)[0];
        assert_eq!(at(0.0).axis, [1.0, 0.0, 0.0]);
        // sin(phase + k·p): what is at x at a time is at x + wavelength · (dt / period) a little later.
        let value = |time: f64, x: f64| {
            let flow = at(time);
            (f64::from(flow.phase) + f64::from(flow.wave_vector[0]) * x).sin()
        };
        assert!((value(0.3, 1.0) - value(0.3 + 0.5, 1.0 + 1.0)).abs() < 1e-6);
        let late = at(4e6 + 1.0).phase;
        assert!((late - at(1.0).phase).abs() < 1e-5 && (0.0..=TAU as f32).contains(&late), "{late}");
    }

    #[test]
    fn what_is_attached_follows_its_object_and_is_absent_without_it() {
        let water = water(
            "[modules.fish]\nuse = 'reef.fish'\n\
             [[flow]]\nkind = 'whirlwind'\nstrength = 1\nposition = [0, 1, 0]\nattach = { module = 'fish', object = 7 }\n",
        );
        assert!(flow_at(&water, 0.0, &Nothing).is_empty());
        let flow = flow_at(&water, 0.0, &Fish)[0];
        assert_eq!((flow.position, flow.owner), ([10.0, 1.0, 0.0], 99));
    }

    #[test]
    fn an_axis_that_turns_through_zero_moves_nothing_there() {
        let water = water(
            "[[flow]]\nkind = 'whirlwind'\nstrength = 1\n\
             axis = { interpolation = 'linear', keys = [{ time = 0, value = [0, 1, 0] }, { time = 2, value = [0, -1, 0] }] }\n",
        );
        let flow = flow_at(&water, 1.0, &Nothing)[0];
        assert_eq!(flow.strength, 0.0);
        assert_eq!(flow_at(&water, 2.0, &Nothing)[0].axis, [0.0, -1.0, 0.0]);
    }

    #[test]
    fn a_poke_comes_and_goes_without_a_jump() {
        let poke = Poke {
            point: [0.0; 3],
            object: 0,
            motion: [0.2, 0.0, 0.0],
            view: [0.0, 0.0, -1.0],
            speed: 0.5,
            reach: 0.4,
        };
        assert!(poke.is_sound() && !Poke { reach: f64::NAN, ..poke }.is_sound());
        let speed = |age: f64| poke.flow(age).map_or(0.0, |flow| f64::from(flow.peak));
        let mut before = 0.0;
        let mut highest: f64 = 0.0;
        for step in 0..=120 {
            let now = speed(f64::from(step) / 60.0);
            // It rises fastest in the middle of the first quarter second: 1.5 · 0.5 / 0.25 m/s² over a
            // sixtieth.
            assert!((now - before).abs() <= 0.05 + 1e-6, "a jump at {step}");
            highest = highest.max(now);
            before = now;
        }
        assert!(highest > 0.45 && before == 0.0, "{highest} {before}");
        assert_eq!(poke.flow(0.5).map(|flow| flow.kind), Some(abi::FLOW_WHIRLWIND));
        assert_eq!(Poke { motion: [0.0; 3], ..poke }.flow(0.5).map(|flow| flow.kind), Some(abi::FLOW_SOURCE));
    }
}
