//! One line that says how to look around, for a few seconds.

use egui::{Align2, Color32, RichText};

use super::style;

/// Shown wholly for this long [s] ...
const SHOWN: f64 = 9.0;
/// ... or this long [s] after somebody began to steer; then it fades.
const AFTER_TOUCH: f64 = 2.5;
/// Length of the fading [s].
const FADE: f64 = 1.2;

/// The hint's clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hint {
    age: f64,
    end: Option<f64>,
}

impl Hint {
    /// From the start again.
    pub fn restart(&mut self) {
        *self = Self::default();
    }

    /// Time goes on by `dt` [s]; `touched`: somebody steered.
    pub fn advance(&mut self, dt: f64, touched: bool) {
        self.age += dt.max(0.0);
        let end = self.end.get_or_insert(SHOWN);
        if touched {
            *end = end.min(self.age + AFTER_TOUCH);
        }
    }

    /// 1: wholly there, 0: gone.
    pub fn opacity(&self) -> f32 {
        let end = self.end.unwrap_or(SHOWN);
        (1.0 - (self.age - end) / FADE).clamp(0.0, 1.0) as f32
    }
}

/// Draws the line at the bottom of the window, in the middle of what the panel (this wide) leaves.
pub fn show(ctx: &egui::Context, hint: &Hint, panel: f32) {
    let opacity = hint.opacity();
    let room = ctx.content_rect().width() - panel;
    if opacity <= 0.0 || room < 240.0 {
        return;
    }
    let text = "Drag to look around  ·  wheel to come closer  ·  W A S D to swim  ·  right-drag to stir the water  ·  \
                Tab: panel";
    egui::Area::new(egui::Id::new("hint"))
        .anchor(Align2::CENTER_BOTTOM, [-panel / 2.0, -18.0])
        .interactable(false)
        .show(ctx, |ui| {
            ui.set_opacity(opacity);
            let fill = Color32::from_rgba_premultiplied(4, 13, 20, 176);
            style::frame().fill(fill).show(ui, |ui| {
                ui.set_max_width((room - 60.0).min(760.0));
                ui.label(RichText::new(text).size(14.0).color(style::TEXT));
            });
        });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hint_stays_a_while_then_fades_and_goes() {
        let mut hint = Hint::default();
        assert_eq!(hint.opacity(), 1.0);
        hint.advance(SHOWN - 0.1, false);
        assert_eq!(hint.opacity(), 1.0);
        hint.advance(0.1 + FADE / 2.0, false);
        assert!((hint.opacity() - 0.5).abs() < 1e-6);
        hint.advance(FADE, false);
        assert_eq!(hint.opacity(), 0.0);
    }

    #[test]
    fn steering_ends_the_hint_early_and_never_makes_it_longer() {
        let mut hint = Hint::default();
        hint.advance(1.0, true);
        hint.advance(AFTER_TOUCH + FADE, true);
        assert_eq!(hint.opacity(), 0.0);
        hint.restart();
        hint.advance(0.0, false);
        assert_eq!(hint.opacity(), 1.0);
    }
}
