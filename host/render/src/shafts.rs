//! Shafts of sunlight: tall sprites along the refracted sun, added to the water before what they stand in
//! front of. Where they stand is fixed in the world; how bright each is follows the long waves of the
//! caustics, slowly.

use ash::vk;
use glam::{DVec2, Vec2};
use reef_gpu::{
    Blend, DepthDesc, DepthLoad, Frame, Gpu, GraphicsDesc, Load, Pipeline, Resource, Result, SamplerDesc,
    Upload,
};
use reef_streams::environment::Environment;

use super::{
    formats::{DEPTH, LIGHT},
    targets::Targets,
    view::Lens,
    water::Caustics,
};

/// Cells along a side of the square in which there are shafts, one a cell. Those near its edge have faded:
/// about 16 are seen.
const CELLS: i64 = 5;
/// Side of a cell [m].
const CELL: f64 = 2.1;
/// The square's middle lies so far before the eye [m].
const AHEAD: f64 = 3.4;

reef_gpu::record! {
    /// `Shaft` of `shaders/shaft.vert`.
    pub struct GpuShaft = "Shaft" {
        /// x and z where it enters the water, relative to the eye [m].
        pub place: [f32; 2],
        /// Width [m].
        pub width: f32,
        /// How bright: fades where shafts come and go with the eye's cell.
        pub strength: f32,
    }
}

/// The pass that draws shafts.
pub struct Shafts {
    pipeline: Pipeline,
    sampler: vk::Sampler,
}

impl Shafts {
    /// Describes the pipeline.
    pub fn new(gpu: &Gpu) -> Result<Self> {
        let desc = GraphicsDesc {
            color: &[(LIGHT, Blend::Add)],
            depth: Some(DepthDesc { format: DEPTH, compare: vk::CompareOp::GREATER_OR_EQUAL, write: false }),
            ..GraphicsDesc::new("shafts", "shaft.vert", "shaft.frag")
        };
        let sampler = gpu.sampler(SamplerDesc { linear: false, repeat: [false; 2], anisotropic: false })?;
        Ok(Self { pipeline: Pipeline::graphics(gpu, &desc), sampler })
    }

    /// Compiles the pipeline now.
    pub fn prepare(&self) -> Result<()> {
        self.pipeline.prepare()
    }

    /// The pass: for water that is looked at from below its surface, at a time [s].
    pub fn draw(
        &self,
        frame: &mut Frame<'_>,
        view: Upload,
        environment: &Environment,
        (caustics, time): (&Caustics, f64),
        lens: &Lens,
        targets: &Targets<'_>,
    ) -> Result<()> {
        if environment.plain_background.is_some() || lens.eye.y >= 0.0 {
            return Ok(());
        }
        let bright = environment.sun.shafts;
        if bright <= 0.0 {
            return Ok(());
        }
        let ahead = DVec2::new(f64::from(lens.forward.x), f64::from(lens.forward.z)) * AHEAD;
        let eye = DVec2::new(lens.eye.x, lens.eye.z);
        let mut shafts = around(eye + ahead, eye);
        for shaft in &mut shafts {
            let place = eye + Vec2::from(shaft.place).as_dvec2();
            shaft.strength *= bright * caustics.shaft(place, time);
        }
        let count = shafts.len() as u32;
        let shafts = frame.upload(&shafts)?;
        frame
            .pass("shafts")
            .color(targets.light, Load::Keep)
            .depth(targets.depth, DepthLoad::ReadOnly)
            .bind(
                &self.pipeline,
                &[(0, view.into()), (1, shafts.into()), (2, Resource::Texture(targets.depth, self.sampler))],
            )
            .run(|cmd| {
                cmd.pipeline(&self.pipeline)?;
                cmd.draw(0..count * 6, 0..1);
                Ok(())
            })
    }
}

/// The shafts around a middle, relative to an eye (both x, z).
pub fn around(middle: DVec2, eye: DVec2) -> Vec<GpuShaft> {
    let home = (middle / CELL).floor();
    let half = CELLS / 2;
    let cells = (-half..=half).flat_map(|x| (-half..=half).map(move |z| (x, z)));
    cells
        .map(|(x, z)| {
            let cell = home + DVec2::new(x as f64, z as f64);
            let unit = |salt: u32| f64::from(hash(cell, salt) >> 8) / f64::from(1_u32 << 24);
            let place = (cell + DVec2::new(0.15 + 0.7 * unit(1), 0.15 + 0.7 * unit(2))) * CELL;
            // All of the square's edge is at least two cells away from its middle.
            let away = (place.distance(middle) / (2.0 * CELL)).min(1.0) as f32;
            let place = (place - eye).as_vec2();
            GpuShaft {
                place: place.to_array(),
                width: (0.3 + 0.8 * unit(3) * unit(4)) as f32,
                strength: (1.0 - away * away * away) * nearness(place),
            }
        })
        .filter(|shaft| shaft.strength > 0.0)
        .collect()
}

/// A shaft that the eye stands in is not seen.
fn nearness(place: Vec2) -> f32 {
    ((place.length() - 0.4) / 0.9).clamp(0.0, 1.0)
}

fn hash(cell: DVec2, salt: u32) -> u32 {
    let mix = |h: u32, v: i64| (h ^ v as u32).wrapping_mul(0x9e37_79b1).rotate_left(13);
    let h = mix(mix(salt.wrapping_mul(0x85eb_ca6b), cell.x as i64), cell.y as i64);
    let h = (h ^ h >> 15).wrapping_mul(0x2c1b_3c6d);
    h ^ h >> 13
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shafts_stand_still_in_the_world_and_come_and_go_without_a_jump() {
        let ahead = DVec2::new(2.0, -2.7);
        let moved = DVec2::new(0.02, -0.013);
        let mut before = around(ahead, DVec2::ZERO);
        for i in 1..400 {
            let eye = moved * f64::from(i);
            let now = around(eye + ahead, eye);
            assert!((8..=24).contains(&now.len()), "{}", now.len());
            for (there, here, way) in [(&before, &now, -moved.as_vec2()), (&now, &before, moved.as_vec2())] {
                for shaft in there {
                    let place = Vec2::from(shaft.place) + way;
                    let twin = here.iter().find(|other| Vec2::from(other.place).distance(place) < 1e-4);
                    let strength = twin.map_or(0.0, |twin| twin.strength);
                    // 24 mm of a slope of 1/.9 m, or of 3/4.2 m.
                    assert!((strength - shaft.strength).abs() < 0.03, "{} {strength}", shaft.strength);
                }
            }
            before = now;
        }
    }
}
