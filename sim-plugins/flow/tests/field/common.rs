//! What the flow's tests share: primitives to start from, and points one at a time through the wide kernel.

use reef_abi::{self as abi, Flow};
use reef_flow::{
    Level, Packed,
    sample::{Points, Velocities, sample},
};

/// A primitive as the paper prints it: no core, no reach.
pub fn flow(kind: u32, position: [f64; 3], strength: f32, peak: f32) -> Flow {
    Flow { kind, position, axis: [0.0, 1.0, 0.0], strength, peak, ..Flow::default() }
}

pub fn source(position: [f64; 3], strength: f32, peak: f32) -> Flow {
    flow(abi::FLOW_SOURCE, position, strength, peak)
}

pub fn hole(position: [f64; 3], strength: f32, peak: f32) -> Flow {
    flow(abi::FLOW_HOLE, position, strength, peak)
}

pub fn whirlwind(position: [f64; 3], axis: [f32; 3], strength: f32, peak: f32) -> Flow {
    Flow { axis, ..flow(abi::FLOW_WHIRLWIND, position, strength, peak) }
}

pub fn directional(axis: [f32; 3], strength: f32) -> Flow {
    Flow { axis, ..flow(abi::FLOW_DIRECTIONAL, [0.0; 3], strength, 1.0) }
}

pub fn shelter(position: [f64; 3], strength: f32, reach: f32, fade: f32) -> Flow {
    Flow { reach, fade, ..flow(abi::FLOW_SHELTER, position, strength, 1.0) }
}

/// Velocities at points, through the wide kernel.
pub fn velocities(level: Level, packed: &Packed, points: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let axis = |i: usize| points.iter().map(|p| p[i]).collect::<Vec<f32>>();
    let (x, y, z) = (axis(0), axis(1), axis(2));
    let mut v = [vec![0.0; x.len()], vec![0.0; x.len()], vec![0.0; x.len()]];
    let [vx, vy, vz] = &mut v;
    sample(level, packed, Points { x: &x, y: &y, z: &z }, Velocities { x: vx, y: vy, z: vz });
    (0..x.len()).map(|i| [v[0][i], v[1][i], v[2][i]]).collect()
}

/// Velocity at one point, around the world's origin.
pub fn at(flows: &[Flow], point: [f32; 3]) -> [f32; 3] {
    let mut packed = Packed::new();
    packed.fill(flows, [0.0; 3], 0);
    velocities(Level::best(), &packed, &[point])[0]
}

pub fn length(v: [f32; 3]) -> f32 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

pub fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn unit(v: [f32; 3]) -> [f32; 3] {
    v.map(|c| c / length(v))
}

pub fn difference(a: [f32; 3], b: [f32; 3]) -> f32 {
    length([a[0] - b[0], a[1] - b[1], a[2] - b[2]])
}

/// A repeatable number in 0..1 (SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub fn point(&mut self, half: f64) -> [f64; 3] {
        core::array::from_fn(|_| self.within(-half, half))
    }

    pub fn direction(&mut self) -> [f32; 3] {
        loop {
            let v = self.point(1.0).map(|c| c as f32);
            let l = length(v);
            if l > 0.1 && l <= 1.0 {
                return unit(v);
            }
        }
    }
}

/// Primitives of every kind and form within `half` metres of `around`.
pub fn sea(seed: u64, count: usize, around: [f64; 3], half: f64) -> Vec<Flow> {
    let mut random = Random(seed);
    (0..count)
        .map(|i| {
            let offset = random.point(half);
            let kind = [
                abi::FLOW_SOURCE,
                abi::FLOW_HOLE,
                abi::FLOW_WHIRLWIND,
                abi::FLOW_DIRECTIONAL,
                abi::FLOW_SHELTER,
                abi::FLOW_SOURCE,
                abi::FLOW_WHIRLWIND,
            ][i % 7];
            let limited = i % 3 != 0 || kind == abi::FLOW_SHELTER;
            Flow {
                owner: (i % 4) as u64,
                kind,
                position: core::array::from_fn(|i| around[i] + offset[i]),
                axis: random.direction(),
                strength: if kind == abi::FLOW_SHELTER {
                    random.within(0.0, 1.0) as f32
                } else {
                    random.within(-0.3, 0.3) as f32
                },
                peak: random.within(0.05, 3.0) as f32,
                core: if i % 2 == 0 { 0.02 } else { 0.0 },
                reach: if limited { random.within(0.1, 1.0) as f32 * half as f32 } else { 0.0 },
                fade: random.within(0.0, 1.0) as f32,
                modulation: if i % 4 == 0 { random.unit() as f32 } else { 0.0 },
                phase: random.within(0.0, std::f64::consts::TAU) as f32,
                wave_vector: if i % 8 == 0 { random.point(3.0).map(|k| k as f32) } else { [0.0; 3] },
                gradient: if i % 5 == 0 { random.within(-0.5, 0.5) as f32 } else { 0.0 },
                level: (around[1] + random.within(-1.0, 1.0)) as f32,
                ..Flow::default()
            }
        })
        .collect()
}
