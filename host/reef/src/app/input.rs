//! Hands to intentions: keys, buttons and the wheel become camera motion, commands and stirring. Knows no
//! window, so that every gesture can be tested.

use winit::{event::MouseButton, keyboard::KeyCode};

use super::camera::Motion;

/// Two presses within this time [s] and distance (in picture heights) are a double click.
const DOUBLE_CLICK: (f64, f64) = (0.4, 0.012);

/// A wish that is fulfilled once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Tab: the panel appears or goes.
    TogglePanel,
    /// F1 or H: the hint line again.
    ShowHint,
    /// F11.
    ToggleFullScreen,
    /// Escape: leaves full screen.
    LeaveFullScreen,
    /// F12.
    Screenshot,
    /// Space.
    TogglePause,
    /// Full stop: one step while paused.
    StepOnce,
    /// F or a double click: orbit what is at this point of the picture (0..1, y down).
    Focus([f64; 2]),
    /// R: back to the scene's path.
    Release,
    /// Ctrl+Q.
    Quit,
}

/// One frame of pushing the water: the cursor went from one point of the picture to another (0..1, y down).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stir {
    /// Where it was.
    pub from: [f64; 2],
    /// Where it is.
    pub to: [f64; 2],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Drag {
    Look,
    Stir,
}

/// What is held, and what was gathered since the last frame.
#[derive(Clone, Debug, Default)]
pub struct Input {
    held: [bool; SWIM_KEYS.len()],
    shift: bool,
    control: bool,
    /// In pixels.
    cursor: Option<[f64; 2]>,
    stir_from: Option<[f64; 2]>,
    drag: Option<Drag>,
    gathered: Motion,
    last_press: Option<(f64, [f64; 2])>,
    size: [f64; 2],
    touched: bool,
}

/// Swim keys with the axis (right, up, forward) and sense.
const SWIM_KEYS: [(KeyCode, usize, f64); 6] = [
    (KeyCode::KeyD, 0, 1.0),
    (KeyCode::KeyA, 0, -1.0),
    (KeyCode::KeyE, 1, 1.0),
    (KeyCode::KeyQ, 1, -1.0),
    (KeyCode::KeyW, 2, 1.0),
    (KeyCode::KeyS, 2, -1.0),
];

impl Input {
    /// The window's content is now this large [px].
    pub fn resized(&mut self, width: u32, height: u32) {
        self.size = [f64::from(width.max(1)), f64::from(height.max(1))];
    }

    /// A key went down or up. `repeat`: the keyboard repeats it.
    pub fn key(&mut self, key: KeyCode, pressed: bool, repeat: bool) -> Option<Command> {
        match key {
            KeyCode::ShiftLeft | KeyCode::ShiftRight => self.shift = pressed,
            KeyCode::ControlLeft | KeyCode::ControlRight => self.control = pressed,
            _ => {}
        }
        if let Some(index) = SWIM_KEYS.iter().position(|(code, ..)| *code == key) {
            if key == KeyCode::KeyQ && self.control {
                return (pressed && !repeat).then_some(Command::Quit);
            }
            self.held[index] = pressed && !self.control;
            self.touched |= pressed;
            return None;
        }
        if !pressed || repeat {
            return None;
        }
        Some(match key {
            KeyCode::Tab => Command::TogglePanel,
            KeyCode::F1 | KeyCode::KeyH => Command::ShowHint,
            KeyCode::F11 => Command::ToggleFullScreen,
            KeyCode::F12 => Command::Screenshot,
            KeyCode::Escape => Command::LeaveFullScreen,
            KeyCode::Space => Command::TogglePause,
            KeyCode::Period => Command::StepOnce,
            KeyCode::KeyR => Command::Release,
            KeyCode::KeyF => Command::Focus(self.cursor_in_picture().unwrap_or([0.5, 0.5])),
            _ => return None,
        })
    }

    /// The cursor is now at this pixel.
    pub fn cursor_moved(&mut self, x: f64, y: f64) {
        let now = [x, y];
        if let (Some(Drag::Look), Some(last)) = (self.drag, self.cursor) {
            self.gathered.drag[0] += (now[0] - last[0]) / self.size[1].max(1.0);
            self.gathered.drag[1] += (now[1] - last[1]) / self.size[1].max(1.0);
            self.touched = true;
        }
        self.cursor = Some(now);
    }

    /// A mouse button went down or up at `time` [s]. Over the panel, presses belong to the panel: `free` is
    /// false.
    pub fn button(&mut self, button: MouseButton, pressed: bool, free: bool, time: f64) -> Option<Command> {
        if !pressed {
            if matches!(button, MouseButton::Left | MouseButton::Right) {
                self.drag = None;
                self.stir_from = None;
            }
            return None;
        }
        if !free {
            return None;
        }
        match button {
            MouseButton::Left if self.shift => self.begin_stir(),
            MouseButton::Right => self.begin_stir(),
            MouseButton::Left => {
                self.drag = Some(Drag::Look);
                return self.double_click(time);
            }
            _ => {}
        }
        None
    }

    /// The wheel turned; positive notches: away from the hand, nearer to the thing.
    pub fn wheel(&mut self, notches: f64) {
        if notches.is_finite() {
            self.gathered.zoom += notches.clamp(-20.0, 20.0);
            self.touched = true;
        }
    }

    /// The window lost the keyboard: nothing is held any more.
    pub fn focus_lost(&mut self) {
        self.held = [false; SWIM_KEYS.len()];
        (self.shift, self.control) = (false, false);
        (self.drag, self.stir_from) = (None, None);
        self.gathered = Motion::default();
    }

    /// The panel's text field took the keyboard: swim keys are let go.
    pub fn keyboard_taken(&mut self) {
        self.held = [false; SWIM_KEYS.len()];
    }

    /// What the camera should do in this frame; what was gathered starts anew.
    pub fn take_motion(&mut self) -> Motion {
        let mut motion = std::mem::take(&mut self.gathered);
        for ((_, axis, sense), held) in SWIM_KEYS.iter().zip(self.held) {
            if held {
                motion.swim[*axis] += sense;
            }
        }
        motion.fast = self.shift;
        motion
    }

    /// How the water is pushed in this frame, while a stirring button is held.
    pub fn take_stir(&mut self) -> Option<Stir> {
        if self.drag != Some(Drag::Stir) {
            return None;
        }
        let to = self.cursor_in_picture()?;
        let from = self.stir_from.replace(to)?;
        Some(Stir { from, to })
    }

    /// Whether a stirring button is held.
    pub fn is_stirring(&self) -> bool {
        self.drag == Some(Drag::Stir)
    }

    /// Whether somebody has steered since this was asked last: the hint may go.
    pub fn take_touched(&mut self) -> bool {
        std::mem::take(&mut self.touched)
    }

    /// The cursor in the picture (0..1, y down).
    pub fn cursor_in_picture(&self) -> Option<[f64; 2]> {
        let [x, y] = self.cursor?;
        Some([x / self.size[0].max(1.0), y / self.size[1].max(1.0)])
    }

    fn begin_stir(&mut self) {
        self.drag = Some(Drag::Stir);
        self.stir_from = self.cursor_in_picture();
        self.touched = true;
    }

    fn double_click(&mut self, time: f64) -> Option<Command> {
        let at = self.cursor?;
        let last = self.last_press.replace((time, at));
        let (when, place) = last?;
        let apart = (at[0] - place[0]).hypot(at[1] - place[1]) / self.size[1].max(1.0);
        if time - when > DOUBLE_CLICK.0 || apart > DOUBLE_CLICK.1 {
            return None;
        }
        self.last_press = None;
        self.cursor_in_picture().map(Command::Focus)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input() -> Input {
        let mut input = Input::default();
        input.resized(1000, 500);
        input.cursor_moved(500.0, 250.0);
        input
    }

    #[test]
    fn a_left_drag_is_gathered_in_window_heights_and_taken_once() {
        let mut input = input();
        input.button(MouseButton::Left, true, true, 0.0);
        input.cursor_moved(550.0, 250.0);
        input.cursor_moved(600.0, 200.0);
        let motion = input.take_motion();
        assert_eq!(motion.drag, [0.2, -0.1]);
        assert_eq!(input.take_motion(), Motion::default());
        input.button(MouseButton::Left, false, true, 0.1);
        input.cursor_moved(0.0, 0.0);
        assert_eq!(input.take_motion(), Motion::default());
    }

    #[test]
    fn a_press_on_the_panel_moves_neither_camera_nor_water() {
        let mut input = input();
        input.button(MouseButton::Left, true, false, 0.0);
        input.cursor_moved(550.0, 250.0);
        assert_eq!(input.take_motion(), Motion::default());
        input.button(MouseButton::Right, true, false, 0.0);
        input.cursor_moved(560.0, 250.0);
        assert_eq!(input.take_stir(), None);
    }

    #[test]
    fn right_drag_and_shift_drag_stir_instead_of_turning() {
        for (shift, button) in [(false, MouseButton::Right), (true, MouseButton::Left)] {
            let mut input = input();
            input.key(KeyCode::ShiftLeft, shift, false);
            input.button(button, true, true, 0.0);
            input.cursor_moved(600.0, 250.0);
            assert_eq!(input.take_stir(), Some(Stir { from: [0.5, 0.5], to: [0.6, 0.5] }));
            assert_eq!(input.take_stir(), Some(Stir { from: [0.6, 0.5], to: [0.6, 0.5] }));
            assert_eq!(input.take_motion().drag, [0.0; 2]);
            input.button(button, false, true, 0.0);
            assert_eq!(input.take_stir(), None);
        }
    }

    #[test]
    fn swim_keys_add_up_and_losing_focus_lets_them_go() {
        let mut input = input();
        input.key(KeyCode::KeyW, true, false);
        input.key(KeyCode::KeyA, true, false);
        input.key(KeyCode::ShiftLeft, true, false);
        let motion = input.take_motion();
        assert_eq!((motion.swim, motion.fast), ([-1.0, 0.0, 1.0], true));
        input.key(KeyCode::KeyD, true, false);
        assert_eq!(input.take_motion().swim, [0.0, 0.0, 1.0]);
        input.focus_lost();
        assert_eq!(input.take_motion(), Motion::default());
    }

    #[test]
    fn two_quick_clicks_in_one_place_focus_and_two_slow_or_distant_ones_do_not() {
        let mut fast = input();
        assert_eq!(fast.button(MouseButton::Left, true, true, 1.0), None);
        assert_eq!(fast.button(MouseButton::Left, true, true, 1.2), Some(Command::Focus([0.5, 0.5])));
        assert_eq!(
            fast.button(MouseButton::Left, true, true, 1.3),
            None,
            "a third click is no second double click"
        );
        let mut slow = input();
        slow.button(MouseButton::Left, true, true, 1.0);
        assert_eq!(slow.button(MouseButton::Left, true, true, 1.6), None);
        let mut apart = input();
        apart.button(MouseButton::Left, true, true, 1.0);
        apart.cursor_moved(540.0, 250.0);
        assert_eq!(apart.button(MouseButton::Left, true, true, 1.2), None);
    }

    #[test]
    fn commands_come_once_however_long_the_key_is_held() {
        let mut input = input();
        assert_eq!(input.key(KeyCode::Tab, true, false), Some(Command::TogglePanel));
        assert_eq!(input.key(KeyCode::Tab, true, true), None);
        assert_eq!(input.key(KeyCode::Tab, false, false), None);
        assert_eq!(input.key(KeyCode::KeyF, true, false), Some(Command::Focus([0.5, 0.5])));
        assert_eq!(input.key(KeyCode::KeyQ, true, false), None);
        assert_eq!(input.take_motion().swim, [0.0, -1.0, 0.0]);
        input.key(KeyCode::KeyQ, false, false);
        input.key(KeyCode::ControlLeft, true, false);
        assert_eq!(input.key(KeyCode::KeyQ, true, false), Some(Command::Quit));
    }

    #[test]
    fn the_hint_learns_that_somebody_steered() {
        let mut input = input();
        assert!(!input.take_touched());
        input.wheel(1.0);
        assert!(input.take_touched());
        assert!(!input.take_touched());
    }
}
