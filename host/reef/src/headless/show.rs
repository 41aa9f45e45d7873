//! A scene as it runs without a window: the two steps around any moment, in order.

use std::sync::Arc;

use reef_render::{Settings, Shot, markers::Markers, view::between};
use reef_sea::{World, scene::format::SceneTable};
use reef_streams::{environment::Environment, frame::Frame};

/// A world that is shown moment by moment.
pub struct Show {
    world: World,
    environment: Arc<Environment>,
    previous: Arc<Frame>,
    current: Arc<Frame>,
    alpha: f32,
}

impl Show {
    /// A world at its present step.
    pub fn new(world: World) -> Self {
        let frame = world.frame().clone();
        Self {
            environment: world.environment().clone(),
            world,
            previous: frame.clone(),
            current: frame,
            alpha: 1.0,
        }
    }

    /// Steps to a moment [s] that is still to come.
    pub fn steps_to(&mut self, time: f64) -> u64 {
        self.world.clock().steps_to(time).saturating_sub(self.current.step)
    }

    /// Steps the world until the moment [s] lies between its last two steps. Time does not run backward.
    pub fn go_to(&mut self, time: f64) {
        self.go_to_while(time, || true);
    }

    /// The same, with a call after each step that says whether to go on.
    pub fn go_to_while(&mut self, time: f64, mut go_on: impl FnMut() -> bool) {
        let dt = self.world.clock().dt;
        let mut at = (time / dt).max(0.0);
        // Frames at the rate of the steps fall on them, whatever the rounding of their division.
        if (at - at.round()).abs() < 1e-6 * at.max(1.0) {
            at = at.round();
        }
        while (self.current.step as f64) < at {
            self.world.step();
            self.previous = std::mem::replace(&mut self.current, self.world.frame().clone());
            if !go_on() {
                break;
            }
        }
        let since = at - (self.current.step as f64 - 1.0);
        self.alpha = if self.current.step == 0 { 1.0 } else { since.clamp(0.0, 1.0) as f32 };
    }

    /// The picture of this moment from the scene's own camera.
    pub fn shot(&self) -> Shot<'_> {
        Shot {
            previous: &self.previous,
            current: &self.current,
            alpha: self.alpha,
            camera: between(&self.previous.camera, &self.current.camera, self.alpha),
            environment: &self.environment,
        }
    }

    /// Settings of a picture: smooth edges, and debug lines and markers where the scene asks for them.
    pub fn settings(&self) -> Settings {
        let scene = &self.world.scene().file.scene;
        let debug_channels = if scene.debug { u32::MAX } else { 0 };
        Settings { debug_channels, markers: markers(scene), ..Settings::fine() }
    }

    /// The world.
    pub fn world(&mut self) -> &mut World {
        &mut self.world
    }
}

/// The markers that a scene asks for.
pub fn markers(scene: &SceneTable) -> Markers {
    Markers { singularities: scene.singularities, bounds: scene.bounds, joints: false }
}
