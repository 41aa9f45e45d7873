//! From a scene's tables to what does not change while it runs: water, light, ground, obstacles.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use reef_abi as abi;
use reef_streams::environment::{Environment, Sun, WaterOptics};

use super::{
    camera::Camera, ground::Ground, journal::Journal, recent::Fixed, terrain, water::Water, waves::Waves,
    world::WorldError,
};
use crate::scene::{
    Scene,
    format::{LightTable, Optics, OpticsPreset, SceneFile},
    whole::parse_color,
};

/// Refractive index of sea water.
const INDEX: f64 = 1.33;

/// All of a scene that does not change from step to step.
#[derive(Debug)]
pub(crate) struct Setting {
    pub(crate) scene: Arc<Scene>,
    /// Of this run: the scene's, or one in its place.
    pub(crate) seed: u64,
    /// What the renderer needs.
    pub(crate) environment: Arc<Environment>,
    /// What modules get of it.
    pub(super) ground: Arc<Ground>,
    pub(super) rocks: Vec<abi::Obstacle>,
    pub(super) trains: Waves,
    pub(super) camera: Camera,
    pub(super) water: Water,
    pub(super) raw_water: abi::Water,
}

impl Setting {
    /// Of a scene, with this seed.
    pub(crate) fn new(scene: Scene, seed: u64) -> Result<Self, WorldError> {
        let trains = Waves::new(&scene.file, seed)?;
        let environment = Arc::new(environment(&scene.file, seed, &trains));
        Ok(Self {
            seed,
            ground: Ground::new(&environment),
            rocks: rocks(&environment),
            environment,
            trains,
            camera: Camera::new(&scene.file.camera)?,
            water: Water::new(&scene)?,
            raw_water: raw_water(&scene),
            scene: Arc::new(scene),
        })
    }

    /// What of it another instance needs to be brought to the present.
    pub(super) fn fixed(&self, simd_level: u32) -> Fixed {
        Fixed { seed: self.seed, simd_level, water: self.raw_water, ground: self.ground.clone() }
    }

    /// An empty journal that begins with this step.
    pub(super) fn journal_from(&self, step: u64) -> Journal {
        Journal::new(&self.scene.name, self.seed, self.scene.file.scene.dt, step)
    }
}

/// The still part of a scene.
fn environment(file: &SceneFile, seed: u64, waves: &Waves) -> Environment {
    let terrain = file.terrain.as_ref().map(|table| Arc::new(terrain::build(table, file.water.depth, seed)));
    Environment {
        optics: optics(&file.water.optics),
        sun: sun(&file.light),
        terrain,
        plain_background: file.scene.background.as_deref().and_then(parse_color),
        waves: waves.at(0.0),
    }
}

/// Coefficients by Jerlov water type (b and c at 620, 540, 460 nm; Kd), and a kinder water for warm colours.
/// What scatters toward the viewer goes with b / (c − b), scattering over absorption; its factor makes IB as
/// bright as the reef's blue.
fn optics(optics: &Optics) -> WaterOptics {
    let jerlov = |b: [f32; 3], c: [f32; 3], kd: [f32; 3]| {
        let scattered = [0, 1, 2].map(|i| 0.1056 * b[i] / (c[i] - b[i]));
        WaterOptics { beam: c, downwelling: kd, scattered }
    };
    let own = match optics {
        Optics::Preset(preset) => match preset {
            OpticsPreset::Reef => {
                return WaterOptics {
                    beam: [0.20, 0.115, 0.10],
                    downwelling: [0.09, 0.035, 0.025],
                    scattered: [0.035, 0.20, 0.36],
                };
            }
            OpticsPreset::IB => {
                return jerlov([0.116, 0.123, 0.133], [0.400, 0.181, 0.172], [0.301, 0.065, 0.035]);
            }
            OpticsPreset::II => {
                return jerlov([0.167, 0.178, 0.193], [0.454, 0.244, 0.252], [0.320, 0.084, 0.066]);
            }
            OpticsPreset::III => {
                return jerlov([0.275, 0.289, 0.307], [0.574, 0.372, 0.411], [0.359, 0.119, 0.128]);
            }
            OpticsPreset::OneC => {
                return jerlov([0.411, 0.430, 0.452], [0.717, 0.526, 0.590], [0.356, 0.124, 0.219]);
            }
        },
        Optics::Own(own) => own,
    };
    let narrow = |values: [f64; 3]| values.map(|value| value as f32);
    WaterOptics {
        beam: narrow(own.beam),
        downwelling: narrow(own.downwelling),
        scattered: narrow(own.scattered),
    }
}

/// The sun as it stands under water: Snell's law at a flat surface.
fn sun(light: &LightTable) -> Sun {
    let above = DVec2::from_angle(light.elevation.to_radians());
    let side = DVec2::from_angle(light.azimuth.to_radians());
    let sine = above.x / INDEX;
    let direction = DVec3::new(side.y * sine, (1.0 - sine * sine).max(0.0).sqrt(), side.x * sine);
    let narrow = |values: [f64; 3]| values.map(|value| value as f32);
    Sun {
        direction: direction.normalize_or(DVec3::Y).as_vec3(),
        color: narrow(light.color),
        ambient: narrow(light.ambient),
        shafts: light.shafts as f32,
    }
}

/// What nothing enters, still: the scene's capsules (whose motion [`super::water`] adds) and the rocks.
fn rocks(environment: &Environment) -> Vec<abi::Obstacle> {
    let rocks = environment.terrain.iter().flat_map(|terrain| &terrain.rocks);
    rocks.enumerate().map(|(number, rock)| terrain::capsule(rock, number)).collect()
}

/// The scene's water as modules read it.
fn raw_water(scene: &Scene) -> abi::Water {
    let water = &scene.file.water;
    abi::Water {
        density: water.density as f32,
        viscosity: water.viscosity as f32,
        depth: water.depth as f32,
        spare: [0.0; 5],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_water_scatters_blue_green_light_and_absorbs_red_most() {
        for preset in
            [OpticsPreset::Reef, OpticsPreset::IB, OpticsPreset::II, OpticsPreset::III, OpticsPreset::OneC]
        {
            let optics = optics(&Optics::Preset(preset));
            assert!(
                optics.beam[0] > optics.beam[1] && optics.downwelling[0] > optics.downwelling[1],
                "{preset:?}"
            );
            assert!(optics.scattered[0] < optics.scattered[2], "{preset:?}");
            assert!(optics.scattered.iter().all(|light| (0.0..0.6).contains(light)), "{preset:?}");
        }
    }

    #[test]
    fn a_low_sun_stands_at_the_edge_of_snells_window() {
        let low = sun(&LightTable { elevation: 1.0, ..LightTable::default() });
        // Half angle of the window: asin(1 / 1.33) = 48.75 degrees.
        assert!((low.direction.y - 48.75_f32.to_radians().cos()).abs() < 1e-3, "{}", low.direction);
        let high = sun(&LightTable { elevation: 90.0, ..LightTable::default() });
        assert!((high.direction.y - 1.0).abs() < 1e-6);
        let east = sun(&LightTable { elevation: 30.0, azimuth: 90.0, ..LightTable::default() });
        assert!(east.direction.x > 0.5 && east.direction.z.abs() < 1e-6);
    }
}
