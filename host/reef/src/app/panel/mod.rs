//! The panel over the sea, and the hint line under it. It shows a [`PanelModel`] and returns [`Action`]s:
//! nothing here touches the sea.

pub mod hint;
pub mod model;
mod params;
mod style;
mod timeline;
mod timing;

use egui::{Align, Align2, Button, ComboBox, Layout, RichText, ScrollArea, Slider, Ui};

use self::model::{Action, Level, PanelModel};
pub use self::style::apply as apply_style;
use super::camera::Mode;

/// Width of the panel's content, in points.
const WIDTH: f32 = 292.0;
/// From the window's edge, in points.
const MARGIN: f32 = 10.0;
/// Slowest and fastest sea.
const SPEED: (f64, f64) = (0.1, 8.0);

/// How much of the window's width the panel takes, in points; nothing where it would cover everything.
pub fn width(ctx: &egui::Context) -> f32 {
    let screen = ctx.content_rect();
    let small = screen.width() < WIDTH + 4.0 * MARGIN || screen.height() < 120.0;
    if small { 0.0 } else { WIDTH + 2.0 * MARGIN + 24.0 }
}

/// Draws the panel at the right edge and gathers what was asked for.
pub fn show(ctx: &egui::Context, model: &mut PanelModel, actions: &mut Vec<Action>) {
    let screen = ctx.content_rect();
    if width(ctx) == 0.0 {
        return;
    }
    egui::Area::new(egui::Id::new("panel"))
        .anchor(Align2::RIGHT_TOP, [-MARGIN, MARGIN])
        .movable(false)
        .constrain(false)
        .show(ctx, |ui| {
            style::frame().show(ui, |ui| {
                ui.set_width(WIDTH);
                // An area starts out with a height of its own.
                ui.set_max_height(screen.height() - 2.0 * MARGIN - 20.0);
                scene(ui, model, actions);
                clock(ui, model, actions);
                timeline::show(ui, &mut model.timeline, model.scene.step, actions);
                ui.separator();
                let room = screen.bottom() - MARGIN - 10.0 - ui.cursor().top();
                ScrollArea::vertical().max_height(room.max(40.0)).auto_shrink([false, true]).show(ui, |ui| {
                    ui.set_width(ui.available_width() - 8.0);
                    sections(ui, model, actions);
                });
            });
        });
}

fn sections(ui: &mut Ui, model: &mut PanelModel, actions: &mut Vec<Action>) {
    let grave = model.messages.iter().any(|message| message.level != Level::Info);
    if grave {
        messages(ui, model, actions);
    }
    egui::CollapsingHeader::new(style::section("Speed of this machine"))
        .id_salt("timing")
        .default_open(true)
        .show_unindented(ui, |ui| timing::show(ui, &model.timing, &model.clock));
    egui::CollapsingHeader::new(style::section("View")).id_salt("view").default_open(true).show_unindented(
        ui,
        |ui| {
            camera(ui, model, actions);
            view(ui, model, actions);
        },
    );
    let one = model.plugins.len() == 1;
    for plugin in &mut model.plugins {
        params::plugin(ui, plugin, one, actions);
    }
    if !grave {
        messages(ui, model, actions);
    }
    egui::CollapsingHeader::new(style::section("Keys"))
        .id_salt("keys")
        .default_open(false)
        .show_unindented(ui, keys);
}

fn scene(ui: &mut Ui, model: &PanelModel, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let name = if model.scene.name.is_empty() { "Sea" } else { &model.scene.name };
        if model.scene.choices.len() > 1 {
            ComboBox::from_id_salt("scene").width(170.0).selected_text(RichText::new(name).strong()).show_ui(
                ui,
                |ui| {
                    for (name, path) in &model.scene.choices {
                        let here = *path == model.scene.path;
                        if ui.selectable_label(here, name).clicked() && !here {
                            actions.push(Action::OpenScene(path.clone()));
                        }
                    }
                },
            );
        } else {
            ui.label(RichText::new(name).strong());
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            style::faint(ui, &time(model.scene.time)).on_hover_text(format!("Step {}", model.scene.step));
        });
    });
}

fn clock(ui: &mut Ui, model: &mut PanelModel, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let paused = model.clock.paused;
        let text = if paused { "▶ Go on" } else { "⏸ Pause" };
        if ui.add(Button::new(text).min_size(egui::vec2(72.0, 20.0))).on_hover_text("Space").clicked() {
            actions.push(Action::Pause(!paused));
        }
        if ui.add_enabled(paused, Button::new("Step")).on_hover_text("One step of the sea  ( . )").clicked() {
            actions.push(Action::StepOnce);
        }
        if ui.button("Restart").on_hover_text("Back to the first moment of the scene").clicked() {
            actions.push(Action::Reset);
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.button("📷").on_hover_text("Save a picture  (F12)").clicked() {
                actions.push(Action::Screenshot);
            }
        });
    });
    ui.horizontal(|ui| {
        style::faint(ui, "Speed");
        ui.spacing_mut().slider_width = 150.0;
        let mut speed = model.clock.speed;
        let slider = Slider::new(&mut speed, SPEED.0..=SPEED.1).logarithmic(true).max_decimals(2).suffix("×");
        let response = ui.add(slider).on_hover_text("Seconds of the sea in one second. Double-click: 1×");
        if response.double_clicked() {
            speed = 1.0;
        }
        if speed != model.clock.speed {
            model.clock.speed = speed;
            actions.push(Action::Speed(speed));
        }
    });
}

fn camera(ui: &mut Ui, model: &PanelModel, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        style::faint(ui, "Camera");
        let choices = [
            (Mode::Scene, "Scene", "The scene's own path  (R)"),
            (
                Mode::Orbit,
                "Orbit",
                "Round a thing: drag to turn, wheel to come closer, double-click to choose it",
            ),
            (Mode::Fly, "Swim", "W A S D, Q and E for down and up, shift to be faster, drag to look around"),
        ];
        for (mode, name, help) in choices {
            let here = model.camera == Some(mode);
            if ui.selectable_label(here, name).on_hover_text(help).clicked() && !here {
                actions.push(Action::Camera(mode));
            }
        }
    });
}

fn view(ui: &mut Ui, model: &mut PanelModel, actions: &mut Vec<Action>) {
    let view = &mut model.view;
    if view.qualities.len() > 1 {
        ui.horizontal(|ui| {
            style::faint(ui, "Quality");
            for (index, name) in view.qualities.iter().enumerate() {
                ui.selectable_value(&mut view.quality, index, *name);
            }
        });
    }
    ui.checkbox(&mut view.levels_of_detail, "Levels of detail")
        .on_hover_text("Draw what is far away with fewer triangles");
    ui.horizontal_wrapped(|ui| {
        ui.checkbox(&mut view.markers.singularities, "Singularities").on_hover_text(
            "Balls where the water's motion comes from: sources green, holes red, whirlwinds yellow, what something carries \
             white",
        );
        ui.checkbox(&mut view.markers.bounds, "Bounding spheres").on_hover_text(
            "Around each plant, orange where a singularity reaches it and its field is evaluated; and where each singularity \
             ends, dashed where it begins to fade",
        );
        ui.checkbox(&mut view.markers.joints, "Joints and levels").on_hover_text(
            "Joints of meshes, in the colour of the level of detail at which each mesh is drawn: green the finest, then yellow, \
             orange, red; grey what is outside of the picture",
        );
    });
    ui.horizontal_wrapped(|ui| {
        let forces = ui.checkbox(&mut view.debug, "Forces and moments");
        if forces.on_hover_text("Lines that the plugins draw to show what they compute").changed() {
            actions.push(Action::Debug(view.debug));
        }
        if view.debug && view.debug_present.count_ones() > 1 {
            for channel in (0..32).filter(|c| view.debug_present & (1 << c) != 0) {
                let mut on = view.debug_shown & (1 << channel) != 0;
                if ui.checkbox(&mut on, format!("{}", channel + 1)).changed() {
                    view.debug_shown ^= 1 << channel;
                }
            }
        }
    });
}

fn messages(ui: &mut Ui, model: &PanelModel, actions: &mut Vec<Action>) {
    if model.messages.is_empty() {
        return;
    }
    let grave = model.messages.iter().filter(|m| m.level != Level::Info).count();
    let heading = if grave > 0 { format!("Messages ({grave})") } else { "Messages".to_owned() };
    egui::CollapsingHeader::new(style::section(&heading))
        .id_salt(("messages", grave > 0))
        .default_open(grave > 0)
        .show_unindented(ui, |ui| {
            ScrollArea::vertical().id_salt("messages").max_height(120.0).auto_shrink([false, true]).show(
                ui,
                |ui| {
                    for message in model.messages.iter().rev() {
                        let color = match message.level {
                            Level::Info => style::FAINT,
                            Level::Warning => style::WARNING,
                            Level::Error => style::ERROR,
                        };
                        let times = if message.count > 1 {
                            format!("  ({} ×)", message.count)
                        } else {
                            String::new()
                        };
                        ui.label(RichText::new(format!("{}{times}", message.text)).small().color(color));
                    }
                },
            );
            if ui.small_button("Clear").clicked() {
                actions.push(Action::ClearMessages);
            }
        });
}

fn keys(ui: &mut Ui) {
    egui::Grid::new("keys").num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        for (key, does) in [
            ("Drag", "look around"),
            ("Wheel", "come closer, go away"),
            ("W A S D  Q E", "swim; shift: faster"),
            ("Double-click, F", "go to a thing and circle it"),
            ("R", "back to the scene's own camera"),
            ("Right-drag", "stir the water (or shift and drag)"),
            ("Space   .", "pause; one step"),
            ("Tab", "hide and show this panel"),
            ("F11   F12", "full screen; save a picture"),
            ("Ctrl Q", "close"),
        ] {
            ui.label(RichText::new(key).small().color(style::ACCENT));
            ui.label(RichText::new(does).small());
            ui.end_row();
        }
    });
}

fn time(seconds: f64) -> String {
    let whole = seconds.max(0.0);
    format!("{}:{:04.1}", (whole / 60.0).floor(), whole % 60.0)
}

#[cfg(test)]
mod tests;
