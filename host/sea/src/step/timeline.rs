//! Real time against the sea's: how many steps a picture needs, and between which two steps it lies; and the
//! way to another moment, over as many pictures as it takes.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use reef_plugin::PluginError;
use reef_streams::frame::Frame;

use super::world::World;

/// Most steps between two pictures; a machine that needs more shows a slower sea.
pub const MOST_STEPS: u32 = 8;
/// Slowest and fastest speed.
pub const SPEEDS: (f64, f64) = (0.05, 8.0);
/// How long a picture waits for steps on the way to another moment, at least and at most: as long as the one
/// before it took, so that half of the time goes into the way where pictures are slow.
const WAIT: [Duration; 2] = [Duration::from_millis(30), Duration::from_millis(250)];

/// A way to another moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Way {
    /// The step at which it began.
    pub from: u64,
    /// The step that is to be reached.
    pub to: u64,
}

/// A world and the two newest of its frames.
#[derive(Debug)]
pub struct Timeline {
    /// The sea.
    pub world: World,
    /// Whether it stands still.
    pub paused: bool,
    speed: f64,
    previous: Arc<Frame>,
    current: Arc<Frame>,
    /// Time of the sea that has passed since the newest step [s].
    surplus: f64,
    /// Share of the wanted speed that was reached, while it is not all.
    behind: Option<f64>,
    way: Option<Way>,
    /// Each step on a way emits all, for who looks at it; else only those do that a picture shows.
    pub whole: bool,
}

/// What one picture shows.
#[derive(Clone, Debug)]
pub struct Blend {
    /// The older of two steps.
    pub previous: Arc<Frame>,
    /// The newer.
    pub current: Arc<Frame>,
    /// Where between them, 0 to 1.
    pub alpha: f32,
}

impl Timeline {
    /// A sea at its present step.
    pub fn new(world: World) -> Self {
        let frame = world.frame().clone();
        Self {
            world,
            paused: false,
            speed: 1.0,
            previous: frame.clone(),
            current: frame,
            surplus: 0.0,
            behind: None,
            way: None,
            whole: false,
        }
    }

    /// Sets out for another moment, which the next pictures reach ([`Timeline::advance`]); the sea goes on
    /// from there.
    ///
    /// # Errors
    /// See [`World::go_to`].
    pub fn go_to(&mut self, step: u64) -> Result<(), PluginError> {
        if self.way.is_some_and(|way| way.to == step) {
            return Ok(());
        }
        let gone = self.world.go_to(step);
        let from = self.world.clock().step;
        self.jump();
        self.way = (gone.is_ok() && from < step).then_some(Way { from, to: step });
        gone
    }

    /// The way that is not at its end yet.
    pub fn way(&self) -> Option<Way> {
        self.way
    }

    /// Stays where the way has led so far; `seen` gets the world after the step that this may take.
    pub fn stop(&mut self, seen: impl FnOnce(&mut World)) {
        // A state that was loaded shows with the step that follows it.
        if self.way.take().is_some() && self.world.frame().step != self.world.clock().step {
            self.world.step();
            seen(&mut self.world);
            self.jump();
        }
    }

    /// Times real time.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Changes the speed, within [`SPEEDS`].
    pub fn set_speed(&mut self, speed: f64) {
        if speed.is_finite() {
            self.speed = speed.clamp(SPEEDS.0, SPEEDS.1);
        }
    }

    /// Share of the wanted speed that the last pictures reached; None: all of it.
    pub fn behind(&self) -> Option<f64> {
        self.behind
    }

    /// Lets real time pass [s]; returns how many steps were made.
    pub fn advance(&mut self, seconds: f64) -> u32 {
        self.advance_with(seconds, |_| {})
    }

    /// Like [`Timeline::advance`], looking at the world after each step.
    pub fn advance_with(&mut self, seconds: f64, mut seen: impl FnMut(&mut World)) -> u32 {
        if let Some(way) = self.way {
            self.behind = None;
            let wait = Duration::from_secs_f64(seconds.clamp(0.0, 1.0)).clamp(WAIT[0], WAIT[1]);
            return self.walk(way, wait, seen);
        }
        if self.paused {
            self.behind = None;
            return 0;
        }
        let dt = self.world.clock().dt;
        let wanted = seconds.max(0.0) * self.speed;
        self.surplus += wanted;
        let mut steps = 0;
        while self.surplus >= dt && steps < MOST_STEPS {
            self.surplus -= dt;
            self.step();
            seen(&mut self.world);
            steps += 1;
        }
        if self.surplus >= dt {
            // What is lost is lost: the sea runs slower and never catches up in a rush.
            let made = f64::from(steps) * dt;
            self.behind = Some((made / (made + self.surplus)).clamp(0.0, 1.0));
            self.surplus %= dt;
        } else {
            self.behind = None;
        }
        steps
    }

    /// Steps toward another moment for as long as a picture waits.
    fn walk(&mut self, way: Way, wait: Duration, mut seen: impl FnMut(&mut World)) -> u32 {
        let (began, mut steps) = (Instant::now(), 0);
        let mut shown = false;
        while self.world.clock().step < way.to && !shown {
            // The picture shows the last of these steps.
            shown = self.world.clock().step + 1 == way.to || began.elapsed() >= wait;
            if shown || self.whole {
                self.world.step();
            } else {
                self.world.step_unseen();
            }
            seen(&mut self.world);
            steps += 1;
        }
        self.jump();
        self.way = (self.world.clock().step < way.to).then_some(way);
        steps
    }

    /// One step, paused or not.
    pub fn step(&mut self) {
        self.world.step();
        self.previous = std::mem::replace(&mut self.current, self.world.frame().clone());
    }

    /// One step while paused: the picture then shows just that step.
    pub fn single_step(&mut self) {
        self.step();
        self.surplus = 0.0;
        self.previous = self.current.clone();
    }

    /// Back to the start.
    pub fn reset(&mut self) {
        self.world.reset();
        self.jump();
    }

    /// The world was changed from outside (a loaded state): forget what was before.
    pub fn jump(&mut self) {
        self.way = None;
        self.current = self.world.frame().clone();
        self.previous = self.current.clone();
        self.surplus = 0.0;
    }

    /// Modules took others' places while the sea stands still: the newest picture is theirs.
    pub fn show_newest(&mut self) {
        self.current = self.world.frame().clone();
        self.previous = self.current.clone();
    }

    /// What a picture shows now.
    pub fn blend(&self) -> Blend {
        let alpha = (self.surplus / self.world.clock().dt).clamp(0.0, 1.0) as f32;
        Blend { previous: self.previous.clone(), current: self.current.clone(), alpha }
    }
}
