//! Where the time goes: the graph of frame times, the passes on the GPU, the step of the sea.

use egui::{Color32, Pos2, Rect, RichText, Sense, Stroke, Ui};

use super::{
    model::{ClockView, HISTORY, Timing},
    style,
};

/// Height of the graph in points.
const GRAPH: f32 = 46.0;

/// The section's content.
pub fn show(ui: &mut Ui, timing: &Timing, clock: &ClockView) {
    if let Some(ms) = timing.mean_ms() {
        ui.horizontal(|ui| {
            ui.label(
                RichText::new(format!("{:.0} fps", 1000.0 / ms.max(0.001))).size(16.0).color(style::ACCENT),
            );
            style::faint(ui, &format!("{ms:.1} ms a frame"));
        });
    }
    graph(ui, timing);
    if timing.step_ms > 0.0 {
        let multiple = timing.real_time_multiple().unwrap_or_default();
        style::faint(
            ui,
            &format!("Sea: {} a step, {} real time", milliseconds(timing.step_ms), times(multiple)),
        )
        .on_hover_text(
            "How long the simulation of one step takes, and how many times faster than real time that is.",
        );
    }
    if let Some(multiple) = clock.behind {
        let text =
            format!("This machine does not keep up: the sea runs at {} speed.", times(multiple as f32));
        ui.label(RichText::new(text).color(style::WARNING).small());
    }
    passes(ui, timing);
}

/// Frame times, newest at the right, with lines at 60 and 30 frames a second.
fn graph(ui: &mut Ui, timing: &Timing) {
    let (response, painter) = ui.allocate_painter(egui::vec2(ui.available_width(), GRAPH), Sense::hover());
    let rect = response.rect;
    painter.rect_filled(rect, 4.0, ui.visuals().extreme_bg_color);
    let slowest = timing.frames().fold(0.0f32, f32::max);
    let top = (slowest * 1.15).max(20.0);
    let y = |ms: f32| rect.bottom() - (ms / top).min(1.0) * rect.height();
    let width = rect.width() / HISTORY as f32;
    let skipped = HISTORY - timing.frames().len().min(HISTORY);
    for (index, ms) in timing.frames().enumerate() {
        let x = rect.left() + (skipped + index) as f32 * width;
        let bar = Rect::from_min_max(Pos2::new(x, y(ms)), Pos2::new(x + width, rect.bottom()));
        painter.rect_filled(bar, 0.0, shade(ms));
    }
    for (ms, name) in [(1000.0 / 60.0, "60"), (1000.0 / 30.0, "30"), (100.0, "10")] {
        // Only lines that can be told apart.
        if ms < top && ms > top * 0.18 {
            let line = Stroke::new(1.0, Color32::from_rgba_unmultiplied(222, 236, 240, 46));
            painter.hline(rect.x_range(), y(ms), line);
            let place = Pos2::new(rect.left() + 3.0, y(ms));
            painter.text(
                place,
                egui::Align2::LEFT_BOTTOM,
                name,
                egui::FontId::proportional(9.0),
                style::FAINT,
            );
        }
    }
    response.on_hover_text(format!(
        "Time of each of the last {} frames; the slowest took {}.",
        timing.frames().len(),
        milliseconds(slowest)
    ));
}

fn shade(ms: f32) -> Color32 {
    match ms {
        ms if ms <= 18.0 => style::ACCENT,
        ms if ms <= 36.0 => Color32::from_rgb(70, 140, 190),
        ms if ms <= 70.0 => Color32::from_rgb(190, 150, 84),
        _ => Color32::from_rgb(200, 104, 92),
    }
}

/// The passes, each as a bar of its share of the picture's time.
fn passes(ui: &mut Ui, timing: &Timing) {
    let total: f32 = timing.passes.iter().map(|(_, ms)| ms).sum();
    if timing.passes.is_empty() {
        return;
    }
    egui::CollapsingHeader::new(format!("Picture: {} on the GPU", milliseconds(total)))
        .id_salt("passes")
        .default_open(false)
        .show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 1.0;
            for (name, ms) in &timing.passes {
                let (response, painter) =
                    ui.allocate_painter(egui::vec2(ui.available_width(), 15.0), Sense::hover());
                let rect = response.rect.shrink2(egui::vec2(0.0, 1.0));
                let mut bar = rect;
                bar.set_width(rect.width() * (ms / total.max(1e-6)).clamp(0.0, 1.0));
                painter.rect_filled(bar, 2.0, Color32::from_rgb(18, 62, 76));
                let font = egui::FontId::proportional(10.5);
                let (left, right) = (rect.left_center() + egui::vec2(4.0, 0.0), rect.right_center());
                painter.text(left, egui::Align2::LEFT_CENTER, name, font.clone(), style::TEXT);
                painter.text(right, egui::Align2::RIGHT_CENTER, milliseconds(*ms), font, style::FAINT);
            }
        });
}

fn milliseconds(ms: f32) -> String {
    match ms {
        ms if ms < 0.1 => format!("{:.0} µs", ms * 1000.0),
        ms if ms < 1.0 => format!("{ms:.2} ms"),
        ms if ms < 100.0 => format!("{ms:.1} ms"),
        ms => format!("{ms:.0} ms"),
    }
}

fn times(multiple: f32) -> String {
    if multiple < 10.0 { format!("{multiple:.2}×") } else { format!("{multiple:.0}×") }
}
