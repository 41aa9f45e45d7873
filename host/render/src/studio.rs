//! A renderer without a window: shots in, pictures out.

use reef_gpu::{Frames, Gpu, Image, Picture, Result, Signals, Timings};

use crate::{Renderer, Settings, Shot, offscreen_image};

/// A renderer with a picture of one size to draw into.
pub struct Studio {
    renderer: Renderer,
    frames: Frames,
    picture: Image,
}

impl Studio {
    /// Makes the renderer; pipelines are compiled with the first shot.
    pub fn new(gpu: &Gpu, size: (u32, u32)) -> Result<Self> {
        Ok(Self {
            renderer: Renderer::new(gpu)?,
            frames: Frames::new(gpu, 2)?,
            picture: offscreen_image(gpu, size)?,
        })
    }

    /// Renders a shot and fetches the picture.
    pub fn shoot(&mut self, shot: &Shot<'_>, settings: &Settings) -> Result<Picture> {
        let mut frame = self.frames.begin()?;
        self.renderer.record(&mut frame, shot, settings, &self.picture)?;
        let readback = frame.read_back(&self.picture)?;
        frame.submit(Signals::default())?;
        readback.finish(&mut self.frames)
    }

    /// Renders a shot and waits for it, without fetching the picture: for benches.
    pub fn run(&mut self, shot: &Shot<'_>, settings: &Settings) -> Result<()> {
        let mut frame = self.frames.begin()?;
        self.renderer.record(&mut frame, shot, settings, &self.picture)?;
        let serial = frame.submit(Signals::default())?;
        self.frames.wait(serial)
    }

    /// Hands a shot over to the device, as the window does: waits only for the shot before the last.
    pub fn submit(&mut self, shot: &Shot<'_>, settings: &Settings) -> Result<()> {
        let mut frame = self.frames.begin()?;
        self.renderer.record(&mut frame, shot, settings, &self.picture)?;
        frame.submit(Signals::default()).map(drop)
    }

    /// Waits for all shots that were handed over.
    pub fn wait(&mut self) -> Result<()> {
        self.frames.wait_all()
    }

    /// Renders a shot a number of times with frames in flight, and waits for the last: for benches.
    pub fn stream(&mut self, shot: &Shot<'_>, settings: &Settings, count: usize) -> Result<()> {
        (0..count).try_for_each(|_| self.submit(shot, settings))?;
        self.wait()
    }

    /// The renderer.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// The renderer, to change what only tests do.
    #[cfg(test)]
    pub(crate) fn renderer_mut(&mut self) -> &mut Renderer {
        &mut self.renderer
    }

    /// Times of the passes of the last picture.
    pub fn timings(&self) -> &Timings {
        self.frames.timings()
    }
}
