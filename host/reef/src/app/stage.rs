//! The window's side of the graphics: surface, swapchain, the sea's passes, the panel's pass, and an orderly
//! end.

use std::path::{Path, PathBuf};

use reef_gpu::{Frames, Gpu, GpuError, GpuOptions, Load, Picture, Signals, Swapchain, Validation};
use reef_render::{Quality, Renderer, Settings, Shot, lod::Thresholds, offscreen_image};
use reef_report::failure::Failure;
use winit::{
    raw_window_handle::{HasDisplayHandle, HasWindowHandle},
    window::Window,
};

use super::{
    overlay::{Overlay, Target},
    panel::model::{Timing, ViewOptions},
    screenshot,
};

/// Frames on the way at the same time: one is drawn while the next is recorded.
const FRAMES: usize = 2;
/// Set to anything but 0: the window runs under the validation layer, and one message of it fails the run
/// (exit code 1).
pub const VALIDATE: &str = "REEF_VALIDATE";

/// Presets, in the panel's order.
const QUALITIES: [(&str, Quality, u32); 3] =
    [("Fast", Quality::Low, 1), ("Full", Quality::High, 1), ("Fine", Quality::High, 2)];

/// What a call of [`Stage::draw`] has done.
#[derive(Default)]
pub struct Drawn {
    /// The window shows a new picture.
    pub shown: bool,
    /// The picture that was asked for.
    pub picture: Option<Kept>,
}

/// A picture without the panel, to be saved.
pub struct Kept(Picture);

impl Kept {
    /// Saves it as a PNG; see [`screenshot::save`].
    pub fn save(&self, folder: &Path, stem: &str) -> Result<PathBuf, screenshot::Error> {
        screenshot::save(folder, stem, [self.0.width, self.0.height], &self.0.rgba)
    }
}

/// Everything on the device. Fields are dropped in order: what draws, what it draws into, then the context.
pub struct Stage {
    #[cfg(feature = "shaderc")]
    watch: Option<reef_gpu::ShaderWatch>,
    overlay: Overlay,
    renderer: Renderer,
    swapchain: Swapchain,
    frames: Frames,
    gpu: Gpu,
}

impl Stage {
    /// Opens the device for this window, which has to outlive the stage.
    pub fn new(window: &Window, device: Option<String>) -> Result<Self, Failure> {
        let validation = match std::env::var(VALIDATE) {
            Ok(value) if !value.is_empty() && value != "0" => Validation::CoreSync,
            _ => Validation::Off,
        };
        let options = GpuOptions::from_environment(device, validation);
        let lost = |error| GpuError::Surface { reason: format!("the window has no handle: {error}") };
        let display = window.display_handle().map_err(lost)?.as_raw();
        let handle = window.window_handle().map_err(lost)?.as_raw();
        let (gpu, surface) = Gpu::open_for_window(&options, display, handle)?;
        let size = window.inner_size();
        let swapchain = Swapchain::new(&gpu, surface, (size.width, size.height), FRAMES)?;
        let frames = Frames::new(&gpu, FRAMES)?;
        let renderer = Renderer::new(&gpu)?;
        renderer.prepare(Quality::default())?;
        let target = Target {
            device: gpu.device().clone(),
            allocator: gpu.allocator()?,
            queue_family: gpu.queue_family(),
            format: swapchain.format(),
            frames: frames.count(),
        };
        let overlay = Overlay::new(&target).map_err(panel_error)?;
        #[cfg(feature = "shaderc")]
        let watch = watch_shaders(&gpu);
        Ok(Self {
            #[cfg(feature = "shaderc")]
            watch,
            overlay,
            renderer,
            swapchain,
            frames,
            gpu,
        })
    }

    /// Largest side of a texture [px].
    pub fn largest_texture(&self) -> usize {
        self.gpu.info().limits.max_image_dimension2_d as usize
    }

    /// What the panel offers: the presets; fast where the processor draws, everything at its best where a
    /// card does.
    pub fn describe(&self, view: &mut ViewOptions) {
        view.qualities = QUALITIES.iter().map(|(name, _, _)| *name).collect();
        view.quality = match self.gpu.info().kind {
            "cpu" => 0,
            "discrete" => QUALITIES.len() - 1,
            _ => 1,
        };
        view.levels_of_detail = true;
        view.debug_shown = u32::MAX;
    }

    /// Times of the passes of the newest frame that has ended.
    pub fn measure(&self, timing: &mut Timing) {
        let passes = &self.frames.timings().passes;
        timing.passes.clear();
        timing.passes.extend(passes.iter().map(|pass| (pass.name.clone(), pass.milliseconds as f32)));
    }

    /// The window's content has this size now.
    pub fn resized(&mut self, size: (u32, u32)) {
        self.swapchain.resized(size);
    }

    /// Takes what the panel painted, whether it is then drawn or not.
    pub fn paint(&mut self, ctx: &egui::Context, output: egui::FullOutput) {
        self.overlay.paint(ctx, output);
    }

    /// Draws the sea and the panel over it, and shows both. `keep`: also returns a picture of the sea alone.
    pub fn draw(&mut self, shot: &Shot<'_>, options: &ViewOptions, keep: bool) -> Result<Drawn, Failure> {
        let settings = settings(options);
        let mut drawn = Drawn::default();
        if !self.swapchain.prepare()? {
            return Ok(drawn);
        }
        if self.overlay.needs_upload() {
            self.gpu.wait_idle()?;
            let queue = self.gpu.queue();
            self.overlay.upload(*queue).map_err(panel_error)?;
        }
        let Self { overlay, renderer, swapchain, frames, .. } = self;
        let mut frame = frames.begin()?;
        let Some(acquired) = swapchain.acquire(&frame)? else { return Ok(drawn) };
        let image = swapchain.image(&acquired)?;
        renderer.record(&mut frame, shot, &settings, image)?;
        let extent = image.extent();
        frame
            .pass("panel")
            .color(image, Load::Keep)
            .run(|cmd| overlay.draw(cmd.raw(), extent).map_err(panel_error))?;
        frame.finish_for_present(image)?;
        frame.submit(swapchain.signals(&acquired))?;
        swapchain.present(acquired)?;
        drawn.shown = true;
        if keep {
            drawn.picture = Some(Kept(self.photograph(shot, &settings)?));
        }
        Ok(drawn)
    }

    /// A picture of the sea alone, as large as the window.
    fn photograph(&mut self, shot: &Shot<'_>, settings: &Settings) -> Result<Picture, GpuError> {
        let image = offscreen_image(&self.gpu, self.swapchain.size())?;
        let mut frame = self.frames.begin()?;
        self.renderer.record(&mut frame, shot, settings, &image)?;
        let picture = frame.read_back(&image)?;
        frame.submit(Signals::default())?;
        picture.finish(&mut self.frames)
    }

    /// Ends everything on the device in order. An error: the validation layer said something during the run.
    pub fn close(self) -> Result<(), Failure> {
        #[cfg(feature = "shaderc")]
        drop(self.watch);
        let Self { overlay, renderer, swapchain, frames, gpu, .. } = self;
        if let Err(error) = gpu.wait_idle() {
            tracing::warn!("{error}");
        }
        drop(overlay);
        drop(renderer);
        drop(swapchain);
        drop(frames);
        let (canary, validated) = (gpu.canary(), gpu.validation() != Validation::Off);
        for leak in gpu.close() {
            tracing::error!("{leak} was not given back");
        }
        if validated && canary.count() > 0 {
            let messages: Vec<_> = canary.messages().iter().map(ToString::to_string).collect();
            return Err(Failure::check(miette::miette!(
                "the validation layer said something {} times:\n{}",
                canary.count(),
                messages.join("\n")
            )));
        }
        Ok(())
    }
}

fn settings(options: &ViewOptions) -> Settings {
    let (_, quality, samples) =
        QUALITIES.get(options.quality).copied().unwrap_or(QUALITIES[QUALITIES.len() - 1]);
    Settings {
        quality,
        detail: options.levels_of_detail.then(|| Thresholds::of(quality)),
        debug_channels: options.debug_shown,
        markers: options.markers,
        samples,
        ..Settings::default()
    }
}

/// Reloads shaders that are edited while the window is open. Without their folder there is nothing to edit.
#[cfg(feature = "shaderc")]
fn watch_shaders(gpu: &Gpu) -> Option<reef_gpu::ShaderWatch> {
    let folder = reef_gpu::shader_sources::find_folder()?;
    reef_gpu::ShaderWatch::start(gpu, &folder)
        .inspect_err(|error| tracing::warn!("shaders are not reloaded: {error}"))
        .ok()
}

fn panel_error(error: egui_ash::RendererError) -> GpuError {
    GpuError::Resource { name: "panel".to_owned(), reason: error.to_string() }
}
