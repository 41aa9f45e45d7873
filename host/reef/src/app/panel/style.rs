//! How the panel looks: dark water, light text, one accent.

use egui::{Color32, CornerRadius, FontId, Margin, Response, RichText, Stroke, TextStyle, Ui};

/// What is behind the panel's text.
pub const BACKGROUND: Color32 = Color32::from_rgba_premultiplied(4, 13, 20, 208);
/// Text that matters.
pub const TEXT: Color32 = Color32::from_rgb(222, 236, 240);
/// Text that may be skipped.
pub const FAINT: Color32 = Color32::from_rgb(140, 168, 178);
/// What can be moved, what is on.
pub const ACCENT: Color32 = Color32::from_rgb(84, 190, 205);
/// Something is not as it should be.
pub const WARNING: Color32 = Color32::from_rgb(240, 186, 92);
/// Something failed.
pub const ERROR: Color32 = Color32::from_rgb(245, 120, 104);

/// Sets the context's style, once.
pub fn apply(ctx: &egui::Context) {
    ctx.set_theme(egui::Theme::Dark);
    ctx.style_mut_of(egui::Theme::Dark, |style| {
        for (name, size) in [
            (TextStyle::Small, 10.5),
            (TextStyle::Body, 12.5),
            (TextStyle::Button, 12.5),
            (TextStyle::Monospace, 11.5),
            (TextStyle::Heading, 16.0),
        ] {
            if let Some(font) = style.text_styles.get_mut(&name) {
                *font = FontId::new(size, font.family.clone());
            }
        }
        style.spacing.item_spacing = egui::vec2(6.0, 4.0);
        style.spacing.interact_size.y = 18.0;
        style.spacing.slider_rail_height = 4.0;
        style.interaction.tooltip_delay = 0.35;
        style.interaction.selectable_labels = false;
        let visuals = &mut style.visuals;
        visuals.override_text_color = Some(TEXT);
        visuals.panel_fill = BACKGROUND;
        visuals.window_fill = Color32::from_rgb(8, 22, 31);
        visuals.window_stroke = Stroke::new(1.0, Color32::from_rgb(28, 56, 68));
        visuals.extreme_bg_color = Color32::from_rgb(3, 10, 15);
        visuals.slider_trailing_fill = true;
        visuals.selection.bg_fill = Color32::from_rgb(30, 104, 122);
        visuals.selection.stroke = Stroke::new(1.0, TEXT);
        visuals.hyperlink_color = ACCENT;
        visuals.warn_fg_color = WARNING;
        visuals.error_fg_color = ERROR;
        visuals.collapsing_header_frame = false;
        let shades = [
            (&mut visuals.widgets.inactive, Color32::from_rgb(24, 50, 62)),
            (&mut visuals.widgets.hovered, Color32::from_rgb(34, 72, 88)),
            (&mut visuals.widgets.active, Color32::from_rgb(44, 96, 114)),
            (&mut visuals.widgets.open, Color32::from_rgb(24, 50, 62)),
        ];
        for (widget, shade) in shades {
            widget.bg_fill = shade;
            widget.weak_bg_fill = shade;
            widget.corner_radius = CornerRadius::same(4);
        }
        // An empty check box has to be seen.
        visuals.widgets.inactive.bg_stroke = Stroke::new(1.0, Color32::from_rgb(58, 98, 114));
        visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_rgb(28, 56, 68));
    });
}

/// The panel's frame.
pub fn frame() -> egui::Frame {
    egui::Frame::new()
        .fill(BACKGROUND)
        .inner_margin(Margin::symmetric(12, 10))
        .corner_radius(CornerRadius::same(8))
}

/// Text that may be skipped.
pub fn faint(ui: &mut Ui, text: &str) -> Response {
    ui.label(RichText::new(text).small().color(FAINT))
}

/// Heading of a group of parameters.
pub fn group(ui: &mut Ui, text: &str) {
    if !text.is_empty() {
        ui.label(RichText::new(text).small().strong().color(ACCENT));
    }
}

/// Heading of a section of the panel.
pub fn section(text: &str) -> RichText {
    RichText::new(text).strong()
}
