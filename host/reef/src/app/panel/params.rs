//! Controls for a plugin's parameters, made from their descriptions alone.

use egui::{ComboBox, DragValue, RichText, Slider, Ui};

use super::{
    model::{Action, ParamKind, ParamView, PluginView},
    style,
};

/// Width of the labels beside the controls, in points.
const LABEL: f32 = 112.0;

/// One instance: heading with name, version and generation, then its parameters under their group's headings.
pub fn plugin(ui: &mut Ui, plugin: &mut PluginView, open: bool, actions: &mut Vec<Action>) {
    let heading = format!("{}  {}", plugin.name, plugin.version);
    egui::CollapsingHeader::new(heading).id_salt(("plugin", plugin.instance)).default_open(open).show(
        ui,
        |ui| {
            ui.horizontal_wrapped(|ui| {
                let generation = match plugin.generation {
                    0 | 1 => "as first loaded".to_owned(),
                    n => format!("reloaded {} ×", n - 1),
                };
                style::faint(ui, &format!("{generation}, {} ago", age(plugin.age)))
                    .on_hover_text(format!("Generation {} of its library.", plugin.generation.max(1)));
                if !plugin.description.is_empty() {
                    style::faint(ui, &plugin.description);
                }
            });
            if let Some(trouble) = &plugin.trouble {
                let color = if plugin.stands { style::ERROR } else { style::WARNING };
                ui.label(RichText::new(trouble).small().color(color));
            }
            if plugin.stands {
                let retry = ui.small_button("Retry");
                let help =
                    "The newest build once more, from the last good state; what it missed is left out.";
                if retry.on_hover_text(help).clicked() {
                    actions.push(Action::Retry(plugin.instance));
                }
            }
            for (name, value) in &plugin.figures {
                style::faint(ui, &format!("{}: {}", capital(name), short(*value)));
            }
            if plugin.params.is_empty() {
                style::faint(ui, "Nothing to adjust.");
            }
            let mut group = "";
            for param in &mut plugin.params {
                if param.group != group {
                    ui.add_space(4.0);
                    style::group(ui, &param.group);
                }
                if let Some(value) = control(ui, plugin.instance, param) {
                    param.value = value;
                    actions.push(Action::SetParam { instance: plugin.instance, id: param.id, value });
                }
                group = &param.group;
            }
            if plugin.params.iter().any(|p| p.value != p.default_value)
                && ui.small_button("Reset all to default").clicked()
            {
                for param in &mut plugin.params {
                    if param.value != param.default_value {
                        param.value = param.default_value;
                        let (instance, id) = (plugin.instance, param.id);
                        actions.push(Action::SetParam { instance, id, value: param.default_value });
                    }
                }
            }
        },
    );
}

/// A name at the beginning of a line.
fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A figure of about three digits.
fn short(value: f64) -> String {
    match value.abs() {
        size if size >= 1e9 => format!("{:.2} G", value / 1e9),
        size if size >= 1e6 => format!("{:.2} M", value / 1e6),
        size if size >= 1e4 => format!("{:.1} k", value / 1e3),
        size if size >= 100.0 || value.fract() == 0.0 => format!("{value:.0}"),
        _ => format!("{value:.3}"),
    }
}

/// A length of time, for people.
fn age(seconds: f64) -> String {
    match seconds {
        s if s < 60.0 => format!("{s:.0} s"),
        s if s < 3600.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.0} h", s / 3600.0),
    }
}

/// One parameter; its new value, if somebody changed it.
fn control(ui: &mut Ui, instance: usize, param: &ParamView) -> Option<f64> {
    ui.push_id((instance, param.id), |ui| {
        ui.horizontal(|ui| {
            let mut value = param.value;
            let mut changed = label(ui, param).clicked().then_some(()).is_some();
            if changed {
                value = param.default_value;
            }
            changed |= match &param.kind {
                ParamKind::Float { log } => number(ui, param, &mut value, *log, false),
                ParamKind::Int => number(ui, param, &mut value, false, true),
                ParamKind::Switch => {
                    let mut on = value >= 0.5;
                    let response = ui.checkbox(&mut on, "").on_hover_text(help(param));
                    value = f64::from(u8::from(on));
                    response.changed()
                }
                ParamKind::Choice(names) => choice(ui, param, names, &mut value),
            };
            (changed && value.is_finite() && value != param.value)
                .then(|| value.clamp(param.minimum, param.maximum))
        })
        .inner
    })
    .inner
}

/// The label; a changed value is marked, and a click on the mark takes the default back.
fn label(ui: &mut Ui, param: &ParamView) -> egui::Response {
    let changed = param.value != param.default_value;
    let height = ui.spacing().interact_size.y;
    let layout = egui::Layout::left_to_right(egui::Align::Center);
    ui.allocate_ui_with_layout(egui::vec2(LABEL, height), layout, |ui| {
        ui.set_min_width(LABEL);
        ui.spacing_mut().item_spacing.x = 3.0;
        let reset = ui.add_visible(changed, egui::Button::new("⟲").small().frame(false));
        ui.add(egui::Label::new(&param.label).truncate()).on_hover_text(help(param));
        reset.on_hover_text(format!("Back to {}", in_words(param, param.default_value)))
    })
    .inner
}

fn number(ui: &mut Ui, param: &ParamView, value: &mut f64, log: bool, whole: bool) -> bool {
    let range = param.minimum..=param.maximum;
    let suffix = if param.unit.is_empty() { String::new() } else { format!(" {}", param.unit) };
    let width = (ui.available_width() - 74.0).clamp(40.0, 220.0);
    ui.spacing_mut().slider_width = width;
    let mut slider = Slider::new(value, range.clone()).show_value(false).logarithmic(log);
    if log && param.minimum > 0.0 {
        slider = slider.smallest_positive(param.minimum);
    }
    if whole {
        slider = slider.integer();
    }
    let moved = ui.add(slider).on_hover_text(help(param)).changed();
    let speed = if whole { 0.1 } else { (param.maximum - param.minimum).abs() * 0.002 };
    let mut drag = DragValue::new(value).range(range).speed(speed).suffix(suffix);
    drag = if whole { drag.max_decimals(0) } else { drag.max_decimals(4) };
    moved | ui.add(drag).on_hover_text(help(param)).changed()
}

fn choice(ui: &mut Ui, param: &ParamView, names: &[String], value: &mut f64) -> bool {
    let now = as_index(*value, names.len());
    let mut picked = now;
    ComboBox::from_id_salt("choice")
        .width(ui.available_width() - 8.0)
        .selected_text(names.get(now).map_or("", String::as_str))
        .show_ui(ui, |ui| {
            for (index, name) in names.iter().enumerate() {
                ui.selectable_value(&mut picked, index, name);
            }
        })
        .response
        .on_hover_text(help(param));
    *value = picked as f64;
    picked != now
}

fn as_index(value: f64, count: usize) -> usize {
    (value.max(0.0).round() as usize).min(count.saturating_sub(1))
}

fn help(param: &ParamView) -> String {
    let range = match param.kind {
        ParamKind::Switch | ParamKind::Choice(_) => String::new(),
        _ => format!("\n{} to {}", in_words(param, param.minimum), in_words(param, param.maximum)),
    };
    let default = in_words(param, param.default_value);
    let help = if param.help.is_empty() { &param.label } else { &param.help };
    format!("{help}{range}\nDefault: {default}")
}

fn in_words(param: &ParamView, value: f64) -> String {
    match &param.kind {
        ParamKind::Switch => if value >= 0.5 { "on" } else { "off" }.to_owned(),
        ParamKind::Choice(names) => names.get(as_index(value, names.len())).cloned().unwrap_or_default(),
        _ if param.unit.is_empty() => format!("{value}"),
        _ => format!("{value} {}", param.unit),
    }
}
