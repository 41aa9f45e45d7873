//! The timeline: where the sea is, a handle that takes it to any other moment, and what is remembered for
//! that.

use egui::{Align, Button, Layout, ProgressBar, Slider, Ui};

use super::{
    model::{Action, TimelineView},
    style, time,
};

/// Bytes of a megabyte.
const MB: usize = 1 << 20;

/// Draws it. `now`: the sea's step.
pub fn show(ui: &mut Ui, view: &mut TimelineView, now: u64, actions: &mut Vec<Action>) {
    let TimelineView { dt, duration, memory, way, held } = *view;
    // While a way leads back, its end is where the handle is.
    let goal = way.map_or(now, |way| way.to);
    let last = memory.to.max(duration).max(goal).max(1);
    let mut step = held.unwrap_or(goal);
    ui.horizontal(|ui| {
        ui.spacing_mut().slider_width = ui.available_width() - 8.0;
        let slider = ui.add(Slider::new(&mut step, 0..=last).show_value(false));
        let dragged = slider.dragged();
        view.held = dragged.then_some(step);
        if slider.changed() || slider.drag_stopped() {
            actions.push(Action::GoTo { step, held: dragged });
        }
        let help = format!(
            "Go to any moment: {} of {}. Near ones come at once, others are played",
            time(step as f64 * dt),
            time(last as f64 * dt)
        );
        if !dragged {
            slider.on_hover_text(help);
        }
    });
    ui.horizontal(|ui| match way {
        Some(way) => {
            let share = now.saturating_sub(way.from) as f32 / (way.to - way.from).max(1) as f32;
            let text = format!("on the way to {}", time(way.to as f64 * dt));
            ui.add(ProgressBar::new(share).desired_width(ui.available_width() - 64.0).text(text));
            if ui.add(Button::new("Stop")).on_hover_text("Stay here").clicked() {
                actions.push(Action::Stop);
            }
        }
        None => {
            let from = memory.from.map_or_else(
                || "nothing remembered yet".to_owned(),
                |from| format!("remembered from {} on", time(from as f64 * dt)),
            );
            style::faint(ui, &from);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                style::faint(ui, &format!("{} of {} MB", memory.used.div_ceil(MB), memory.most / MB))
                    .on_hover_text("Memory of states in the past (--remember MB)");
            });
        }
    });
}
