//! egui beside winit: who gets an event, and one run of the panel a frame.

use egui_winit::winit;
use winit::{event::WindowEvent, event_loop::ActiveEventLoop, window::Window};

use super::panel::{
    self,
    hint::{self, Hint},
    model::{Action, PanelModel},
};

/// The panel's side of the window.
pub struct Gui {
    ctx: egui::Context,
    state: egui_winit::State,
    /// The pointer, in points.
    pointer: Option<egui::Pos2>,
    shown: bool,
    hint: Hint,
}

/// What an event is left for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Free {
    /// The pointer is over the sea.
    pub pointer: bool,
    /// Nobody types into a field of the panel.
    pub keyboard: bool,
}

impl Gui {
    /// For this window.
    pub fn new(window: &Window, largest_texture: Option<usize>) -> Self {
        let ctx = egui::Context::default();
        panel::apply_style(&ctx);
        let scale = window.scale_factor() as f32;
        let state = egui_winit::State::new(
            ctx.clone(),
            egui::ViewportId::ROOT,
            window,
            Some(scale),
            None,
            largest_texture,
        );
        Self { ctx, state, pointer: None, shown: true, hint: Hint::default() }
    }

    /// egui's context.
    pub fn context(&self) -> &egui::Context {
        &self.ctx
    }

    /// Hides or shows the panel.
    pub fn toggle(&mut self) {
        self.shown = !self.shown;
    }

    /// The hint line from the start again.
    pub fn show_hint(&mut self) {
        self.hint.restart();
    }

    /// Gives an event to the panel, and says for whom else it is. Keys go to the panel only while somebody
    /// types there: else the space bar would press whatever button was clicked last.
    pub fn hear(&mut self, window: &Window, event: &WindowEvent) -> Free {
        let typing = self.ctx.text_edit_focused();
        if typing || !matches!(event, WindowEvent::KeyboardInput { .. }) {
            // Its wish to be painted again is granted anyway: every frame is painted.
            let _ = self.state.on_window_event(window, event);
        }
        match event {
            WindowEvent::CursorMoved { position, .. } => {
                let scale = egui_winit::pixels_per_point(&self.ctx, window);
                self.pointer = Some(egui::pos2(position.x as f32 / scale, position.y as f32 / scale));
            }
            WindowEvent::CursorLeft { .. } => self.pointer = None,
            _ => {}
        }
        Free { pointer: !self.is_over_panel(), keyboard: !typing }
    }

    /// Where the pointer is now, not where it was when the panel was painted: a press may follow a leap of
    /// the pointer within one frame.
    fn is_over_panel(&self) -> bool {
        let layer = self.pointer.and_then(|pointer| self.ctx.layer_id_at(pointer));
        self.ctx.egui_is_using_pointer() || layer.is_some_and(|layer| layer.order != egui::Order::Background)
    }

    /// One run: what was asked for, and what is to be painted.
    pub fn run(
        &mut self,
        window: &Window,
        event_loop: &ActiveEventLoop,
        model: &mut PanelModel,
        dt: f64,
        touched: bool,
    ) -> (Vec<Action>, egui::FullOutput) {
        self.hint.advance(dt, touched);
        let input = self.state.take_egui_input(window);
        let mut actions = Vec::new();
        let (shown, hint) = (self.shown, self.hint);
        let mut output = self.ctx.run_ui(input, |ui| {
            // egui may run this twice for one frame; what counts is the last time.
            actions.clear();
            if shown {
                panel::show(ui.ctx(), model, &mut actions);
            }
            hint::show(ui.ctx(), &hint, if shown { panel::width(ui.ctx()) } else { 0.0 });
        });
        let platform = std::mem::take(&mut output.platform_output);
        self.state.handle_platform_output_with_event_loop(window, event_loop, platform);
        (actions, output)
    }
}
