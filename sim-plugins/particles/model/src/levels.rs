//! The levels of detail's switches and borders (§3.3), and the blending across them.

use fearless_simd::Simd;
use reef_flow::{
    simd::{Lanes, mul_add},
    waves::{Rule, select},
};
use reef_sdk::abi::Wave;

/// What a person may change while the sea runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    /// Leave out wave trains that nobody sees the work of (§3.3.1).
    pub trains: bool,
    /// Which of them those are.
    pub selection: Rule,
    /// Leave out orbits and sprites of what is not in view (§3.3.2).
    pub visible: bool,
    /// Let slaves follow their masters beyond D_m (§3.3.3).
    pub masters: bool,
    /// Let a local fog stand for what is beyond D_M (§3.3.3).
    pub fog: bool,
    /// A_min [px].
    pub threshold: f64,
    /// D_m [m].
    pub master_distance: f64,
    /// D_M [m].
    pub fog_distance: f64,
    /// What is farther is not there [m].
    pub visibility: f64,
    /// How much wider than the camera's picture is counted as in view.
    pub margin: f64,
    /// Factor on every diameter.
    pub size: f64,
    /// Factor on every opacity.
    pub opacity: f64,
}

impl Default for Levels {
    fn default() -> Self {
        Self {
            trains: true,
            selection: Rule::Sum,
            visible: true,
            masters: true,
            fog: true,
            threshold: 1.0,
            master_distance: 2.0,
            fog_distance: 12.0,
            visibility: 30.0,
            margin: 0.1,
            size: 1.0,
            opacity: 1.0,
        }
    }
}

/// Where something begins to matter, and where it does so wholly [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// 0 up to here.
    pub from: f32,
    /// 1 / width [1/m].
    pub steepness: f32,
}

impl Band {
    /// From `from` to `to` [m]; a step where they are the same.
    pub fn new(from: f64, to: f64) -> Self {
        Self { from: from as f32, steepness: (1.0 / (to - from).max(1e-4)) as f32 }
    }

    /// 0 before the band, 1 behind it, smooth in between.
    #[inline(always)]
    pub fn ramp<S: Simd, V: Lanes<S>>(self, simd: S, x: V) -> V {
        let u = (x - V::splat(simd, self.from)) * V::splat(simd, self.steepness);
        let u = u.max(V::splat(simd, 0.0)).min(V::splat(simd, 1.0));
        u * u * mul_add(u, V::splat(simd, -2.0), V::splat(simd, 3.0))
    }

    /// The same for one number.
    pub fn at(self, x: f32) -> f32 {
        let u = ((x - self.from) * self.steepness).clamp(0.0, 1.0);
        u * u * (3.0 - 2.0 * u)
    }
}

/// Nearer than this a particle fades away: it would fill the picture.
const NEAR: [f64; 2] = [0.04, 0.2];

impl Levels {
    /// Over which slaves come to follow: from D_m on, over a quarter of it.
    pub fn master_band(&self) -> Band {
        Band::new(self.master_distance, 1.25 * self.master_distance)
    }

    /// Over which the fog takes over: the last sixth before D_M, where the last single particle is gone.
    pub fn fog_band(&self) -> Band {
        Band::new(self.fog_distance * (5.0 / 6.0), self.fog_distance)
    }

    /// Over which everything ends: the last sixth of the visibility.
    pub fn end_band(&self) -> Band {
        Band::new(self.visibility * (5.0 / 6.0), self.visibility)
    }

    /// Over which particles appear before the eye.
    pub fn near_band() -> Band {
        Band::new(NEAR[0], NEAR[1])
    }

    /// Beyond this no single particle is seen [m].
    pub fn farthest_particle(&self) -> f64 {
        if self.fog { self.fog_distance.min(self.visibility) } else { self.visibility }
    }
}

/// How far orbits reach over a box's height [m]: at its bottom, and from there to its top. The reach is
/// convex in y, so what is linear between the two is never too little.
pub fn reach(waves: &[Wave], depth: f64, bottom: f64, top: f64) -> [f64; 2] {
    let most = select::reach(waves, depth, top);
    // Above still water nothing is convex any more.
    if top > 0.0 { [most, most] } else { [select::reach(waves, depth, bottom), most] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_blend_from_nothing_to_all() {
        let band = Levels::default().fog_band();
        assert_eq!([band.at(0.0), band.at(10.0), band.at(12.0), band.at(1e9)], [0.0, 0.0, 1.0, 1.0]);
        assert!((band.at(11.0) - 0.5).abs() < 1e-6);
        let step = Band::new(0.0, 0.0);
        assert_eq!([step.at(0.0), step.at(1e-3)], [0.0, 1.0]);
    }
}
