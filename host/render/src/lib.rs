//! From two steps of the sea to a picture. [`Renderer::record`] is the order of a frame's passes, one file
//! each:
//!
//! 1. `fibres` (compute): blend the steps, cull, choose detail, skin;
//!    `meshes` (compute, draw): the same of meshes, and what of them is solid;
//! 2. `rocks`, 3. `terrain`: what stands still, the nearer first;
//! 4. `sky`: the background, where nothing was drawn;
//! 5. `fibres` (draw): over the background, because their thin tips let it through;
//!    `meshes` (draw): what is thin, then what light comes through, each from far to near;
//! 6. `markers`: balls for what has no body, when asked for;
//! 7. `shafts`: sunlight in the water, at high quality;
//! 8. `billboards`: what floats in the water, from far to near;
//! 9. `lines`: forces, moments, and the markers' rings, when asked for;
//! 10. `tone`: tone curve and dither into the target; at low quality the materials have done that themselves.
//!
//! [`Studio`] does all this without a window; [`pictures`] are what it leaves as files.
//!
//! Fog is part of every material's shader (`shaders/water.glsl`), so that thin things fade into fogged water.

#[cfg(test)]
mod billboard_tests;
pub mod billboards;
pub mod boulder;
pub mod contact;
#[cfg(test)]
mod device_tests;
pub mod fibre_records;
#[cfg(test)]
mod fibre_tests;
pub mod fibres;
mod formats;
pub mod gather;
pub mod layers;
#[cfg(test)]
mod leaf_tests;
#[cfg(test)]
mod light_tests;
mod lines;
pub mod lod;
pub mod markers;
pub mod matched;
pub mod meshes;
pub mod noise;
pub mod pictures;
mod quality;
mod rocks;
pub mod sample;
mod sand;
mod shafts;
pub mod shared;
mod sky;
#[cfg(test)]
mod sprite_tests;
pub mod sprites;
#[cfg(test)]
mod step_tests;
pub mod steps;
mod studio;
mod sunlit;
mod targets;
mod terrain;
#[cfg(test)]
mod texture_tests;
#[cfg(test)]
mod tile_tests;
pub mod tiles;
mod tone;
pub mod twin;
mod variant;
pub mod view;
pub mod water;

use std::sync::Arc;

use ash::vk;
use bytemuck::Zeroable;
use reef_abi as abi;
use reef_gpu as gpu;
use reef_gpu::{Gpu, Image, Load, Result};
use reef_streams::{
    environment::{Environment, Terrain},
    frame::{CameraPose, Frame},
};

use billboards::Billboards;
use fibres::Fibres;
use gather::Gathered;
use layers::Layers;
use lod::Thresholds;
use markers::Markers;
use meshes::Meshes;
pub use quality::Quality;
use steps::Steps;
pub use studio::Studio;
use view::{Lens, View};
use water::{Caustics, Surface};

/// What a picture shows and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How much work it may be.
    pub quality: Quality,
    /// Levels of detail and culling; without them everything is drawn in full (for comparison).
    pub detail: Option<Thresholds>,
    /// Bits of the channels of debug lines that are shown.
    pub debug_channels: u32,
    /// What is drawn of what has no body.
    pub markers: Markers,
    /// Width of debug lines [px].
    pub line_width: f32,
    /// Brightness of the picture; 1 is the scene's own.
    pub exposure: f32,
    /// Shafts of sunlight, where the quality has them.
    pub shafts: bool,
    /// Samples along each side of a pixel, 1 to 4: 2 makes smooth edges for four times the work.
    pub samples: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            quality: Quality::High,
            detail: Some(Thresholds::default()),
            debug_channels: u32::MAX,
            markers: Markers::default(),
            line_width: 2.5,
            exposure: 1.0,
            shafts: true,
            samples: 1,
        }
    }
}

impl Settings {
    /// What a quality means for all of them.
    pub fn of(quality: Quality) -> Self {
        Self { quality, detail: Some(Thresholds::of(quality)), ..Self::default() }
    }

    /// For pictures that nobody waits for: smooth edges.
    pub fn fine() -> Self {
        Self { samples: 2, ..Self::default() }
    }
}

/// One picture's subject.
#[derive(Clone, Copy)]
pub struct Shot<'a> {
    /// The step before.
    pub previous: &'a Frame,
    /// The present step.
    pub current: &'a Frame,
    /// Between them: 0 is the step before, 1 the present one.
    pub alpha: f32,
    /// From where: the scene's camera or the window's.
    pub camera: CameraPose,
    /// What stands still.
    pub environment: &'a Environment,
}

/// The sea's passes and what they keep between frames.
pub struct Renderer {
    gpu: Gpu,
    gathered: Gathered,
    steps: Steps,
    fibres: Fibres,
    meshes: Meshes,
    terrain: terrain::Terrain,
    rocks: rocks::Rocks,
    sky: sky::Sky,
    shafts: shafts::Shafts,
    billboards: Billboards,
    layers: Layers,
    lines: lines::Lines,
    bodies: markers::Bodies,
    tone: tone::Tone,
    textures: terrain::GroundTextures,
    attachments: Option<targets::Attachments>,
    /// The bed and the waves that the passes were made ready for.
    bed: Option<Arc<Terrain>>,
    waves: Option<Vec<abi::Wave>>,
    water: Option<(Surface, Caustics)>,
}

impl Renderer {
    /// Describes the passes. Pipelines are compiled when they are first used, or by [`Renderer::prepare`].
    pub fn new(gpu: &Gpu) -> Result<Self> {
        Ok(Self {
            gpu: gpu.clone(),
            gathered: Gathered::default(),
            steps: Steps::default(),
            fibres: Fibres::new(gpu),
            meshes: Meshes::new(gpu),
            terrain: terrain::Terrain::new(gpu)?,
            rocks: rocks::Rocks::new(gpu)?,
            sky: sky::Sky::new(gpu),
            shafts: shafts::Shafts::new(gpu)?,
            billboards: Billboards::new(gpu)?,
            layers: Layers::new(gpu)?,
            lines: lines::Lines::new(gpu),
            bodies: markers::Bodies::new(gpu),
            tone: tone::Tone::new(gpu)?,
            textures: terrain::GroundTextures::new(gpu)?,
            attachments: None,
            bed: None,
            waves: None,
            water: None,
        })
    }

    /// Compiles the pipelines of a quality now, so that the first frame does not have to.
    pub fn prepare(&self, quality: Quality) -> Result<()> {
        self.fibres.prepare()?;
        self.terrain.prepare(quality)?;
        self.rocks.prepare(quality)?;
        self.sky.prepare(quality)?;
        if quality == Quality::High {
            self.shafts.prepare()?;
        }
        self.billboards.prepare(quality)?;
        self.bodies.prepare(quality)?;
        self.lines.prepare(quality)
    }

    /// Records all passes of a picture into `target` (a colour attachment of 8 bits a channel). Whatever
    /// `target` held before is gone; the panel may be drawn over it afterwards.
    pub fn record(
        &mut self,
        frame: &mut gpu::Frame<'_>,
        shot: &Shot<'_>,
        settings: &Settings,
        target: &Image,
    ) -> Result<()> {
        let environment = shot.environment;
        let new_bed = self.follow(environment)?;
        let most =
            self.gpu.info().limits.max_image_dimension2_d / target.size().0.max(target.size().1).max(1);
        let samples = settings.samples.clamp(1, 4).min(most.max(1));
        let size = (target.size().0 * samples, target.size().1 * samples);
        let lens = Lens::new(&shot.camera, [size.0, size.1], view::visibility(environment));
        let steps = [shot.previous, shot.current];
        let mut gathered = std::mem::take(&mut self.gathered);
        let new_steps = !self.steps.show(steps) || gathered.generation == 0;
        if new_steps {
            gathered.match_steps(shot.previous, shot.current);
            if gathered.is_textured() {
                self.layers.update(shot.current)?;
                gathered.find_textures(shot.current, self.layers.catalogue());
            }
        }
        gathered.look(shot.previous, shot.current, shot.alpha, &lens, settings.debug_channels);
        let marked = markers::mark(shot.previous, shot.current, shot.alpha, &lens, settings.markers);
        gathered.lines.extend_from_slice(&marked.lines);
        if new_steps || new_bed {
            self.meshes.stand(shot, &gathered.matched)?;
        }
        if let Some(terrain) = &environment.terrain {
            if settings.quality == Quality::Low {
                self.textures.lay_sand(&self.gpu, &terrain.ripples)?;
            }
            if new_steps || new_bed {
                let mut standers = gather::standers(shot.current);
                standers.extend(self.meshes.standers());
                self.textures.update(&self.gpu, environment, &standers)?;
            }
        }
        let quality = settings.quality;
        let attachments =
            targets::Attachments::fit(self.attachments.take(), &self.gpu, size, quality, target)?;
        let targets = attachments.targets(target);
        let time = shot.previous.time
            + (shot.current.time - shot.previous.time) * f64::from(shot.alpha.clamp(0.0, 1.0));
        let view = frame.upload(&[self.view(environment, &lens, time, settings)])?;

        self.steps.update(&self.gpu, steps, &gathered)?;
        let objects = frame.upload(&gathered.objects)?;
        let Some(shown) = self.steps.shown(objects) else { return Ok(()) };
        self.fibres.skin(frame, view, (&gathered, shown), settings.detail.as_ref(), quality)?;
        let looked = (&gathered, shown, &lens);
        self.meshes.skin(frame, view, shot, looked, settings.detail.as_ref(), quality)?;
        if settings.markers.joints {
            let joints = self.meshes.lines(shot, &gathered, &lens, (settings.detail.as_ref(), quality));
            gathered.lines.extend(joints);
        }
        // The background covers what nothing else does.
        frame
            .pass("clear")
            .color(targets.light, Load::Discard)
            .depth(targets.depth, gpu::DepthLoad::Clear(0.0))
            .run(|_| Ok(()))?;
        self.fibres.draw_solid(frame, &targets)?;
        self.meshes.draw_solid(frame, (view, shown.materials), &self.layers, &targets)?;
        self.rocks.draw(frame, view, &lens, quality, &self.textures, &targets)?;
        self.terrain.draw(frame, view, &lens, quality, &self.textures, &targets)?;
        self.sky.draw(frame, view, quality, &targets)?;
        self.fibres.draw(frame, (view, shown.materials), &self.layers, &targets)?;
        self.meshes.draw_thin(frame, (view, shown.materials), &self.layers, &targets)?;
        self.meshes.draw_veils(frame, (view, shown.materials), &self.layers, &targets)?;
        self.bodies.draw(frame, view, &marked.bodies, quality, &targets)?;
        if let (Some((_, caustics)), true, Quality::High) = (&self.water, settings.shafts, quality) {
            self.shafts.draw(frame, view, environment, (caustics, time), &lens, &targets)?;
        }
        let dt = (shot.current.time - shot.previous.time) as f32;
        let back = dt * (1.0 - shot.alpha.clamp(0.0, 1.0));
        let how = (&lens, samples, quality);
        self.billboards.draw(frame, view, (shot.current, back), how, &mut self.layers, &targets)?;
        let width = settings.line_width * samples as f32;
        self.lines.draw(frame, view, &gathered.lines, width, quality, &targets)?;
        if let Some(light) = attachments.unfinished() {
            let diagram = environment.plain_background.is_some();
            let shown = quality == Quality::Low;
            let finish = tone::Finish { exposure: settings.exposure, samples, diagram, shown };
            self.tone.draw(frame, light, finish, target)?;
        }
        self.attachments = Some(attachments);
        self.gathered = gathered;
        Ok(())
    }

    /// The fibre passes, for tests and benches.
    pub fn fibres(&self) -> &Fibres {
        &self.fibres
    }

    /// What was brought of the steps' streams for the last picture [bytes].
    pub fn brought(&self) -> u64 {
        self.steps.brought
    }

    /// The mesh passes, for tests and benches.
    pub fn meshes(&self) -> &Meshes {
        &self.meshes
    }

    /// The pass of what floats, for tests and benches.
    pub fn billboards(&self) -> &Billboards {
        &self.billboards
    }

    /// Makes the passes ready for this scene, if it is not the one before; whether its bed is another.
    fn follow(&mut self, environment: &Environment) -> Result<bool> {
        let same_bed = match (&self.bed, &environment.terrain) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        if !same_bed {
            self.terrain.set(&self.gpu, environment.terrain.as_ref())?;
            self.rocks.set(&self.gpu, environment.terrain.as_deref(), environment.sun.direction)?;
            self.textures.forget();
            self.bed = environment.terrain.clone();
        }
        if self.waves.as_ref() != Some(&environment.waves) {
            self.water = Some((Surface::new(environment), Caustics::new(environment)));
            self.waves = Some(environment.waves.clone());
        }
        Ok(!same_bed)
    }

    fn view(&self, environment: &Environment, lens: &Lens, time: f64, settings: &Settings) -> View {
        let Some((surface, caustics)) = &self.water else { return View::zeroed() };
        let mut view =
            view::view(lens, environment, (surface, caustics), time, settings.quality == Quality::High);
        view.exposure = settings.exposure;
        self.terrain.describe(&mut view, lens);
        self.textures.describe(&mut view, lens);
        view
    }
}

/// Format and use of a picture that is rendered without a window.
pub fn offscreen_image(gpu: &Gpu, size: (u32, u32)) -> Result<Image> {
    use vk::ImageUsageFlags as U;
    let usage = U::COLOR_ATTACHMENT | U::TRANSFER_SRC;
    Image::new(gpu, &gpu::ImageDesc::new("picture", size, vk::Format::R8G8B8A8_UNORM, usage))
}
