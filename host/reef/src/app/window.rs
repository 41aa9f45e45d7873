//! The window's life: winit's events in, frames out, and an orderly end.

use std::{
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};

use reef_render::Shot;
use reef_report::{failure::Failure, log};
use reef_streams::frame::CameraPose;
use winit::{
    application::ApplicationHandler,
    dpi::{LogicalSize, PhysicalSize, Size},
    event::{ElementState, MouseScrollDelta, WindowEvent},
    event_loop::{ActiveEventLoop, ControlFlow},
    keyboard::PhysicalKey,
    platform::x11::WindowAttributesExtX11,
    window::{Fullscreen, Window, WindowId},
};

use super::{
    camera::{CameraControl, Limits, view_ray},
    gui::Gui,
    input::{Command, Input, Stir},
    panel::model::{Action, Level, PanelModel},
    pick::{self, Ray},
    sea::Sea,
    stage::Stage,
    stir::{Stirring, Touch},
};

/// How often the sea moves on while nothing is drawn.
const UNSEEN: Duration = Duration::from_millis(100);
/// Pixels of a touch pad's scrolling that count as one notch of a wheel.
const PIXELS_PER_NOTCH: f64 = 40.0;
/// What is stirred when nothing is under the cursor lies this far away [m].
const STIR_DISTANCE: f64 = 2.0;
/// The eye keeps this distance from the ground and the surface [m].
const CLEARANCE: f64 = 0.06;

/// What the window was asked for on the command line.
#[derive(Clone, Debug, Default)]
pub struct Wishes {
    /// Close after this many frames.
    pub frames: Option<u64>,
    /// Size of the content [px].
    pub size: Option<[u32; 2]>,
    /// Vulkan device.
    pub device: Option<String>,
}

/// The program while its window is open.
pub struct Shell {
    wishes: Wishes,
    sea: Sea,
    model: PanelModel,
    camera: CameraControl,
    input: Input,
    stirring: Stirring,
    open: Option<Open>,
    started: Instant,
    last: Instant,
    frames: u64,
    wants_picture: bool,
    failure: Option<Failure>,
}

/// What exists only with a window. Fields are dropped in order: everything on the device before the window.
struct Open {
    stage: Stage,
    gui: Gui,
    window: Arc<Window>,
    view: CameraPose,
    size: PhysicalSize<u32>,
    occluded: bool,
}

impl Open {
    fn is_seen(&self, wishes: &Wishes) -> bool {
        // A run of a fixed number of frames draws them even where another window lies on top.
        self.size.width > 0 && self.size.height > 0 && (!self.occluded || wishes.frames.is_some())
    }
}

impl Shell {
    /// Ready for [`winit::event_loop::EventLoop::run_app`].
    pub fn new(wishes: Wishes, sea: Sea) -> Self {
        let now = Instant::now();
        Self {
            wishes,
            sea,
            model: PanelModel::default(),
            camera: CameraControl::new(),
            input: Input::default(),
            stirring: Stirring::default(),
            open: None,
            started: now,
            last: now,
            frames: 0,
            wants_picture: false,
            failure: None,
        }
    }

    /// After the loop has ended: the sea with its journal, how many frames were shown, and what went wrong.
    pub fn finish(self) -> (Sea, u64, Option<Failure>) {
        (self.sea, self.frames, self.failure)
    }

    fn create(&mut self, event_loop: &ActiveEventLoop) -> Result<Open, Failure> {
        let size = match self.wishes.size {
            Some([width, height]) => Size::Physical(PhysicalSize::new(width, height)),
            None => Size::Logical(LogicalSize::new(1280.0, 720.0)),
        };
        let attributes = Window::default_attributes()
            .with_title(self.title())
            .with_inner_size(size)
            .with_name("reef", "reef");
        let window = event_loop.create_window(attributes).map_err(|error| super::no_window(&error))?;
        let window = Arc::new(window);
        let size = window.inner_size();
        let stage = Stage::new(&window, self.wishes.device.clone())?;
        let gui = Gui::new(&window, Some(stage.largest_texture()));
        self.input.resized(size.width, size.height);
        stage.describe(&mut self.model.view);
        self.sea.describe(&mut self.model);
        self.last = Instant::now();
        Ok(Open { stage, gui, window, view: self.sea.camera(), size, occluded: false })
    }

    fn title(&self) -> String {
        format!("Reef – {}", self.sea.name())
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, failure: Failure) {
        self.failure.get_or_insert(failure);
        event_loop.exit();
    }

    /// One frame: hands, panel, sea, camera, picture.
    fn frame(&mut self, event_loop: &ActiveEventLoop) -> Result<(), Failure> {
        let dt = self.tick();
        let Some(open) = &mut self.open else { return Ok(()) };
        for line in log::take() {
            let level = match line.level {
                tracing::Level::ERROR => Level::Error,
                tracing::Level::WARN => Level::Warning,
                _ => Level::Info,
            };
            self.model.messages.push(level, line.text);
        }
        self.model.camera = Some(self.camera.mode());
        open.stage.measure(&mut self.model.timing);
        if self.sea.tend() {
            self.sea.describe(&mut self.model);
        }
        self.sea.measure(&mut self.model);

        let touched = self.input.take_touched();
        let (actions, painted) = open.gui.run(&open.window, event_loop, &mut self.model, dt, touched);
        open.stage.paint(open.gui.context(), painted);
        for action in actions {
            self.act(action)?;
        }
        match self.input.take_stir() {
            Some(stir) => self.stir(&stir, dt),
            None if !self.input.is_stirring() => self.stirring.stop(),
            None => {}
        }
        self.sea.advance(dt);

        let Some(open) = &mut self.open else { return Ok(()) };
        let scene = self.sea.camera();
        let limits = limits(&self.sea, &open.view);
        let ahead = distance_ahead(&self.sea, &open.view);
        open.view = self.camera.update(dt, &self.input.take_motion(), &scene, ahead, limits);
        let picture = std::mem::take(&mut self.wants_picture);
        let blend = self.sea.blend();
        let shot = Shot {
            previous: &blend.previous,
            current: &blend.current,
            alpha: blend.alpha,
            camera: open.view,
            environment: self.sea.environment(),
        };
        let drawn = open.stage.draw(&shot, &self.model.view, picture)?;
        if let Some(saved) = drawn.picture {
            match saved.save(Path::new("."), self.sea.name()) {
                Ok(path) => self.model.messages.push(Level::Info, format!("Saved {}", path.display())),
                Err(error) => self.model.messages.push(Level::Error, error.to_string()),
            }
        }
        if drawn.shown {
            self.frames += 1;
            self.model.timing.push_frame((dt * 1000.0) as f32);
            if self.wishes.frames.is_some_and(|frames| self.frames >= frames) {
                event_loop.exit();
            }
        }
        Ok(())
    }

    /// Time since the last call [s].
    fn tick(&mut self) -> f64 {
        let now = Instant::now();
        let dt = now.duration_since(self.last).as_secs_f64();
        self.last = now;
        dt
    }

    fn act(&mut self, action: Action) -> Result<(), Failure> {
        match action {
            Action::Pause(paused) => self.sea.pause(paused),
            Action::StepOnce => self.sea.step_once(),
            Action::Speed(speed) => self.sea.set_speed(speed),
            Action::SetParam { instance, id, value } => self.sea.set_param(instance, id, value),
            Action::Reset => {
                self.sea.reset()?;
                self.sea.describe(&mut self.model);
            }
            Action::GoTo { step, held } => {
                self.sea.go_to(step, held);
                self.sea.describe(&mut self.model);
            }
            Action::Stop => self.sea.stop(),
            Action::Retry(module) => self.sea.retry(module),
            Action::OpenScene(path) => self.open_scene(&path),
            Action::Camera(mode) => {
                let Some(open) = &self.open else { return Ok(()) };
                let ahead = distance_ahead(&self.sea, &open.view);
                self.camera.choose(mode, &self.sea.camera(), ahead);
            }
            Action::Debug(on) => {
                self.model.view.debug_present = 0;
                self.sea.set_debug(on);
            }
            Action::Screenshot => self.wants_picture = true,
            Action::ClearMessages => self.model.messages.clear(),
        }
        Ok(())
    }

    /// Another scene, in the same window. A scene that is refused changes nothing.
    fn open_scene(&mut self, path: &Path) {
        match self.sea.open(path) {
            Ok(()) => {
                self.camera.restart();
                self.model.view.asked = None;
                self.sea.describe(&mut self.model);
                let title = self.title();
                if let Some(open) = &mut self.open {
                    open.view = self.sea.camera();
                    open.window.set_title(&title);
                }
            }
            Err(failure) => self.model.messages.push(Level::Error, failure.to_string()),
        }
    }

    fn command(&mut self, event_loop: &ActiveEventLoop, command: Command) -> Result<(), Failure> {
        let Some(open) = &mut self.open else { return Ok(()) };
        match command {
            Command::TogglePanel => open.gui.toggle(),
            Command::ShowHint => open.gui.show_hint(),
            Command::ToggleFullScreen => {
                let full = open.window.fullscreen().is_none();
                open.window.set_fullscreen(full.then_some(Fullscreen::Borderless(None)));
            }
            Command::LeaveFullScreen => open.window.set_fullscreen(None),
            Command::Screenshot => self.wants_picture = true,
            Command::TogglePause => self.sea.pause(!self.sea.is_paused()),
            Command::StepOnce => {
                self.sea.pause(true);
                self.sea.step_once();
            }
            Command::Focus(point) => {
                let ray = ray(open, point);
                let frame = self.sea.newest();
                let hit = pick::nearest_thing(&ray, pick::spheres(frame))
                    .or_else(|| pick::nearest(&ray, frame, self.sea.terrain()))
                    .or_else(|| pick::meant_thing(&ray, pick::spheres(frame)));
                if let Some(hit) = hit {
                    self.camera.focus(hit.centre, hit.radius, &self.sea.camera());
                }
            }
            Command::Release => self.camera.release(&self.sea.camera()),
            Command::Quit => event_loop.exit(),
        }
        Ok(())
    }

    /// Pushes the water where the cursor is.
    fn stir(&mut self, stir: &Stir, dt: f64) {
        let Some(open) = &self.open else { return };
        let (from, to) = (ray(open, stir.from), ray(open, stir.to));
        let hit = pick::nearest(&to, self.sea.newest(), self.sea.terrain());
        // A hand in a thing is in its middle rather than on the sphere round it.
        let distance = hit.map_or(STIR_DISTANCE, |hit| match hit.object {
            0 => hit.distance,
            _ => (hit.centre - to.origin).dot(to.direction),
        });
        let point = to.origin + to.direction * distance;
        let way = point - (from.origin + from.direction * distance);
        let object = hit.map_or(0, |hit| hit.object);
        let touch = Touch { point, way, view: to.direction, distance, object };
        if let Some(poke) = self.stirring.go_on(&touch, dt) {
            self.sea.poke(poke);
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, event: &WindowEvent) -> Result<(), Failure> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let free = open.gui.hear(&open.window, event);
        let mut command = None;
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::RedrawRequested if open.is_seen(&self.wishes) => self.frame(event_loop)?,
            WindowEvent::Resized(size) => {
                open.size = *size;
                open.stage.resized((size.width, size.height));
                self.input.resized(size.width, size.height);
            }
            WindowEvent::ScaleFactorChanged { .. } => {
                let size = open.window.inner_size();
                open.size = size;
                open.stage.resized((size.width, size.height));
                self.input.resized(size.width, size.height);
            }
            WindowEvent::Occluded(occluded) => open.occluded = *occluded,
            WindowEvent::Focused(false) => self.input.focus_lost(),
            WindowEvent::KeyboardInput { event, is_synthetic: false, .. } => {
                if let PhysicalKey::Code(key) = event.physical_key {
                    let pressed = event.state == ElementState::Pressed;
                    if free.keyboard {
                        command = self.input.key(key, pressed, event.repeat);
                    } else {
                        self.input.keyboard_taken();
                    }
                }
            }
            WindowEvent::CursorMoved { position, .. } => self.input.cursor_moved(position.x, position.y),
            WindowEvent::MouseInput { state, button, .. } => {
                let time = self.started.elapsed().as_secs_f64();
                command = self.input.button(*button, *state == ElementState::Pressed, free.pointer, time);
            }
            WindowEvent::MouseWheel { delta, .. } if free.pointer => self.input.wheel(match delta {
                MouseScrollDelta::LineDelta(_, lines) => f64::from(*lines),
                MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_PER_NOTCH,
            }),
            _ => {}
        }
        match command {
            Some(command) => self.command(event_loop, command),
            None => Ok(()),
        }
    }
}

impl ApplicationHandler for Shell {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.open.is_some() {
            return;
        }
        match self.create(event_loop) {
            Ok(open) => self.open = Some(open),
            Err(failure) => self.fail(event_loop, failure),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if let Err(failure) = Shell::window_event(self, event_loop, &event) {
            self.fail(event_loop, failure);
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(open) = &self.open else { return };
        if open.is_seen(&self.wishes) {
            event_loop.set_control_flow(ControlFlow::Poll);
            open.window.request_redraw();
            return;
        }
        // Nothing to draw into: the sea goes on, a few times a second.
        if self.last.elapsed() >= UNSEEN {
            let dt = self.tick();
            if self.sea.tend() {
                self.sea.describe(&mut self.model);
            }
            self.sea.advance(dt);
        }
        event_loop.set_control_flow(ControlFlow::WaitUntil(self.last + UNSEEN));
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        let Some(Open { stage, gui, window, .. }) = self.open.take() else { return };
        drop(gui);
        if let Err(failure) = stage.close() {
            self.failure.get_or_insert(failure);
        }
        drop(window);
    }
}

fn ray(open: &Open, point: [f64; 2]) -> Ray {
    let aspect = f64::from(open.size.width.max(1)) / f64::from(open.size.height.max(1));
    Ray { origin: open.view.position, direction: view_ray(&open.view, point, aspect) }
}

/// Distance [m] to what stands in the middle of the view.
fn distance_ahead(sea: &Sea, view: &CameraPose) -> f64 {
    let ray = Ray { origin: view.position, direction: view_ray(view, [0.5, 0.5], 1.0) };
    pick::nearest(&ray, sea.newest(), sea.terrain()).map_or(3.0, |hit| match hit.object {
        0 => hit.distance,
        _ => hit.centre.distance(view.position),
    })
}

/// The eye stays in the water, above the ground; scenes without ground are open everywhere.
fn limits(sea: &Sea, view: &CameraPose) -> Limits {
    match sea.terrain() {
        Some(terrain) => Limits {
            floor: pick::ground(terrain, view.position.x, view.position.z) + CLEARANCE,
            ceiling: -CLEARANCE,
        },
        None => Limits::NONE,
    }
}
