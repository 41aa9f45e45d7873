//! One animal in the sea.

use core::f64::consts::TAU;

use fearless_simd::{Simd, f32x8};
use glam::{DVec2, DVec3, Vec2, Vec3};
use reef_flow::{
    Level, Packed, Sphere,
    math::cos_sin_f64,
    random::Random,
    simd::splat,
    velocity8,
    waves::{Trains, orbit},
};
use reef_sdk::abi::{DrawVertex, Flow};

use super::{Birth, Surroundings, jet};
use crate::{
    slice::{Gait, Slice},
    species::Species,
    surface::{Bell, Frame, Fringe},
    trail::Trail,
};

/// Longest step of a slice [s]: two for a step of 1/60 s.
const STEP: f64 = 1.0 / 120.0;
/// Links of a trail.
const LINKS: usize = 16;
/// How fast trails sink, in lengths of their own a second.
const SINK: f64 = 0.1;
/// No current or wave carries an animal faster [m/s].
const FASTEST: f32 = 100.0;
/// Where arms stand around the mouth, and how far apart their tips drift, in widths of the bell.
const MOUTH: f64 = 0.04;
const ARM_SPREAD: f64 = 0.12;

/// An animal with its water, its surface and its place.
#[derive(Clone, Debug)]
pub(super) struct Animal {
    id: u64,
    pub(super) slice: Slice<f32>,
    /// Where the slice's first place stands in the world [m].
    pub(super) base: DVec3,
    /// That place in the slice.
    first: DVec2,
    frame: Frame,
    /// Of the tentacles on both sides, and of the arms.
    pub(super) trails: [Trail; 3],
    bell: Bell,
    tentacles: Fringe,
    arms: Fringe,
    packed: Packed,
    trains: Trains,
    pub(super) flow: Flow,
    pub(super) fit_error: f64,
    diameter: f64,
}

impl Animal {
    pub(super) fn new(
        species: &Species,
        birth: &Birth,
        density: f64,
        viscosity: f64,
    ) -> Result<Self, String> {
        let species = species.sized(birth.size);
        species.check()?;
        let mut slice = Slice::<f32>::new(species.build(), species.water(density, viscosity))?;
        let mut random = Random::new(birth.seed, u64::from_le_bytes(*b"swimming"));
        let usual = species.gait();
        let frequency = usual.frequency * (1.0 + species.motion.variation * random.signed());
        let [lowest, highest] = crate::slice::FREQUENCIES;
        slice.set_gait(Gait { frequency: frequency.clamp(lowest, highest), ..usual })?;
        slice.set_phase(random.unit());
        let chain: Vec<DVec2> = slice.chain().collect();
        let bell = Bell::new(species.form(), species.bell.thickness, &chain, birth.seed)?;
        let trail = |leader: DVec2, length: f64| Trail::new(leader, LINKS, length, SINK * length);
        let tip = |side: usize| slice.strand(side).last().unwrap_or(chain[0]);
        let hanging = (species.tentacles.length - species.bell.strand).max(0.01 * species.bell.diameter);
        let trails = [
            trail(tip(0), hanging),
            trail(tip(1), hanging),
            trail(mouth(&slice), species.arms.length.max(0.01 * species.bell.diameter)),
        ];
        let strand = slice.strand(0).len();
        let (cos, sin) = cos_sin_f64(birth.yaw.rem_euclid(TAU));
        let x = Vec3::new(cos as f32, 0.0, sin as f32);
        Ok(Self {
            id: birth.id,
            first: slice.place(),
            base: birth.place,
            frame: Frame { x, y: Vec3::Y, z: x.cross(Vec3::Y) },
            tentacles: Fringe::new(species.tentacle_form(), strand + LINKS, birth.seed)?,
            arms: Fringe::new(species.arm_form(), LINKS + 1, birth.seed)?,
            trails,
            bell,
            packed: Packed::new(),
            trains: Trains::new(),
            flow: Flow::default(),
            fit_error: 0.0,
            diameter: species.bell.diameter,
            slice,
        })
    }

    /// A point of the slice in the world [m].
    pub(super) fn world(&self, point: DVec2) -> DVec3 {
        let way = point - self.first;
        self.base + self.frame.x.as_dvec3() * way.x + self.frame.y.as_dvec3() * way.y
    }

    /// Middle of the bell [m, world].
    pub(super) fn place(&self) -> DVec3 {
        self.world(self.slice.place())
    }

    /// Points its slice so that it can swim along a direction of the world, and steers it there.
    pub(super) fn steer(&mut self, aim: DVec3) {
        let x = self.frame.x.as_dvec3();
        self.slice.steer(DVec2::new(aim.dot(x), aim.y));
    }

    pub(super) fn step(&mut self, around: &Surroundings<'_>, field: &reef_flow::Field) {
        let place = self.place().to_array();
        let bounds = Sphere { center: place, radius: self.diameter };
        self.packed.fill_near(field, bounds, place, self.id);
        self.trains.fill(around.waves, around.depth, place);
        let drift = reef_flow::dispatch!(around.level, simd => felt(simd, &self.packed, &self.trains));
        self.base += DVec3::from(drift.map(f64::from)) * around.dt;
        let parts = (around.dt / STEP - 1e-9).ceil().max(1.0);
        let dt = around.dt / parts;
        for _ in 0..parts as usize {
            self.slice.step(around.level, dt);
            let leaders = self.leaders();
            let corner = self.slice.corner();
            for (trail, leader) in self.trails.iter_mut().zip(leaders) {
                trail.step(self.slice.water(), corner, leader, dt);
            }
        }
        let fit = jet::fit(&self.slice, 0.5 * self.diameter);
        let middle = self.world(fit.place);
        self.flow = jet::flow(&fit, self.id, middle, self.diameter);
        self.fit_error = fit.error;
    }

    /// What the trails follow.
    fn leaders(&self) -> [DVec2; 3] {
        let mouth = mouth(&self.slice);
        let tip = |side: usize| self.slice.strand(side).last().unwrap_or(mouth);
        [tip(0), tip(1), mouth]
    }

    /// Vertices of its bell, its tentacles and its arms.
    pub(super) fn vertices(&self) -> [usize; 3] {
        [self.bell.form().bell_vertices(), self.tentacles.vertices(), self.arms.vertices()]
    }

    /// What of its meshes never changes: the bell's, the tentacles' and the arms'.
    pub(super) fn parts(&self) -> (&Bell, &Fringe, &Fringe) {
        (&self.bell, &self.tentacles, &self.arms)
    }

    /// All of its vertices, relative to its place.
    pub(super) fn write(&mut self, level: Level, time: f64, into: &mut [DrawVertex]) {
        let [bell, tentacles, _] = self.vertices();
        let (into_bell, rest) = into.split_at_mut(bell);
        let (into_tentacles, into_arms) = rest.split_at_mut(tentacles);
        let Self { slice, frame, trails, bell, tentacles, arms, .. } = self;
        let origin = slice.place();
        let near = |point: DVec2| (point - origin).as_vec2();
        let [left, right] =
            [0, 1].map(|side| slice.strand(side).chain(trails[side].points().iter().copied()));
        let pairs = right.zip(left).map(|(right, left)| [near(right), near(left)]);
        tentacles.write(level, pairs, frame, into_tentacles);
        // Arms hang from the mouth, and drift apart toward their tips.
        let mouth = mouth(slice);
        let hanging = core::iter::once(&mouth).chain(trails[2].points()).enumerate();
        let pairs = hanging.map(|(k, point)| {
            let spread = MOUTH + ARM_SPREAD * k as f64 / LINKS as f64;
            let aside = Vec2::new((spread * slice.build().diameter) as f32, 0.0);
            [near(*point) + aside, near(*point) - aside]
        });
        arms.write(level, pairs, frame, into_arms);
        bell.write(level, slice.chain(), origin, frame, time, into_bell);
    }
}

/// Where the arms hang: the inner apex.
fn mouth(slice: &Slice<f32>) -> DVec2 {
    let chain = slice.chain();
    let middle = chain.len() / 2;
    slice.chain().nth(middle).unwrap_or_default()
}

/// Currents and orbital velocity at the packed forms' own origin [m/s].
#[inline(always)]
fn felt<S: Simd>(simd: S, currents: &Packed, trains: &Trains) -> [f32; 3] {
    let zero = splat(simd, 0.0);
    let mut velocity = velocity8(simd, currents, zero, zero, zero);
    if !trains.is_empty() {
        let orbit = orbit(simd, trains, trains.len(), [zero; 3]);
        for (velocity, own) in velocity.iter_mut().zip(orbit.velocity) {
            *velocity += own;
        }
    }
    velocity.map(|v: f32x8<S>| {
        let lane = v[0];
        if lane.is_nan() { 0.0 } else { lane.clamp(-FASTEST, FASTEST) }
    })
}
