//! The panel without a window: what text it paints where, and what a click on it asks for.

use egui::{Event, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape};
use reef_render::markers::Markers;
use reef_sea::step::{history::Memory, timeline::Way};

use super::{
    model::{Action, Level, PanelModel, ParamKind, ParamView, PluginView, TimelineView},
    *,
};

struct Bench {
    ctx: egui::Context,
    time: f64,
    size: egui::Vec2,
    texts: Vec<(String, Rect)>,
}

impl Bench {
    fn new() -> Self {
        let ctx = egui::Context::default();
        apply_style(&ctx);
        Self { ctx, time: 0.0, size: egui::vec2(1280.0, 900.0), texts: Vec::new() }
    }

    fn frame(&mut self, model: &mut PanelModel, events: Vec<Event>) -> Vec<Action> {
        self.time += 0.1;
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, self.size)),
            time: Some(self.time),
            events,
            focused: true,
            ..RawInput::default()
        };
        let mut actions = Vec::new();
        let mut output = self.ctx.run_ui(input, |ui| {
            actions.clear();
            show(ui.ctx(), model, &mut actions);
        });
        output.textures_delta.clear();
        self.texts.clear();
        for clipped in &output.shapes {
            collect(&clipped.shape, &mut self.texts);
        }
        actions
    }

    /// Opens everything and lets animations end.
    fn settle(&mut self, model: &mut PanelModel) {
        for _ in 0..10 {
            assert!(self.frame(model, Vec::new()).is_empty(), "the panel acts by itself");
        }
    }

    fn place(&self, text: &str) -> Pos2 {
        let found = self.texts.iter().find(|(t, _)| t == text || t.trim() == text);
        found.unwrap_or_else(|| panic!("{text:?} is not painted among {:?}", self.texts)).1.center()
    }

    fn click(&mut self, model: &mut PanelModel, at: Pos2) -> Vec<Action> {
        let mut actions = self.frame(model, vec![Event::PointerMoved(at)]);
        for pressed in [true, false] {
            let button = PointerButton::Primary;
            let event = Event::PointerButton { pos: at, button, pressed, modifiers: Modifiers::NONE };
            actions.extend(self.frame(model, vec![event]));
        }
        actions
    }
}

fn collect(shape: &Shape, texts: &mut Vec<(String, Rect)>) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, texts)),
        Shape::Text(text) => {
            texts.push((text.galley.text().to_owned(), text.galley.rect.translate(text.pos.to_vec2())));
        }
        _ => {}
    }
}

fn param(id: u32, label: &str, kind: ParamKind, maximum: f64, value: f64) -> ParamView {
    ParamView {
        id,
        kind,
        label: label.to_owned(),
        group: "Tentacles".to_owned(),
        unit: "m/s".to_owned(),
        help: "What it does.".to_owned(),
        minimum: 0.0,
        maximum,
        default_value: 0.0,
        value,
    }
}

fn model() -> PanelModel {
    let params = vec![
        param(11, "Stiffness", ParamKind::Float { log: false }, 10.0, 4.0),
        param(12, "Rows", ParamKind::Int, 8.0, 2.0),
        param(13, "Feeds", ParamKind::Switch, 1.0, 0.0),
        param(14, "Species", ParamKind::Choice(vec!["red".into(), "green".into()]), 1.0, 0.0),
    ];
    let plugin = PluginView {
        instance: 3,
        name: "Anemones".to_owned(),
        version: "1.2.3".to_owned(),
        generation: 2,
        age: 75.0,
        params,
        ..PluginView::default()
    };
    PanelModel { plugins: vec![plugin], ..PanelModel::default() }
}

#[test]
fn a_plugins_controls_come_from_its_descriptions_alone() {
    let (mut bench, mut model) = (Bench::new(), model());
    bench.settle(&mut model);
    for text in [
        "Anemones  1.2.3",
        "reloaded 1 ×, 1 min ago",
        "Tentacles",
        "Stiffness",
        "Rows",
        "Feeds",
        "Species",
        "red",
    ] {
        bench.place(text);
    }
    bench.place("4.00");
    bench.place("m/s");
    assert_eq!(bench.texts.iter().filter(|(t, _)| t == "Tentacles").count(), 1, "one heading a group");
}

#[test]
fn a_plugin_that_stands_still_says_why_and_asks_for_another_chance() {
    let (mut bench, mut model) = (Bench::new(), model());
    bench.settle(&mut model);
    bench.place("reloaded 1 ×, 1 min ago");
    assert!(!bench.texts.iter().any(|(text, _)| text == "Retry"));
    model.plugins[0].trouble = Some("step 7: a node at NaN".to_owned());
    model.plugins[0].stands = true;
    bench.settle(&mut model);
    bench.place("step 7: a node at NaN");
    let at = bench.place("Retry");
    assert_eq!(bench.click(&mut model, at), [Action::Retry(3)]);
}

#[test]
fn a_switch_asks_for_its_parameter_by_instance_and_id() {
    let (mut bench, mut model) = (Bench::new(), model());
    bench.settle(&mut model);
    // The box stands right of the labels' column.
    let at = bench.place("Feeds");
    let left = bench.texts.iter().find(|(t, _)| t == "Feeds").map(|(_, r)| r.left()).unwrap_or_default();
    let actions = bench.click(&mut model, Pos2::new(left + 112.0, at.y));
    assert_eq!(actions, [Action::SetParam { instance: 3, id: 13, value: 1.0 }]);
    assert_eq!(model.plugins[0].params[2].value, 1.0);
}

#[test]
fn dragging_a_slider_asks_for_values_inside_the_range() {
    let (mut bench, mut model) = (Bench::new(), model());
    bench.settle(&mut model);
    let y = bench.place("Stiffness").y;
    let start = bench.place("4.00") - egui::vec2(60.0, 0.0);
    let button = PointerButton::Primary;
    let press = |pos, pressed| Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE };
    let mut actions = bench.frame(&mut model, vec![Event::PointerMoved(start)]);
    actions.extend(bench.frame(&mut model, vec![press(start, true)]));
    for x in [10.0, 135.0] {
        actions.extend(bench.frame(&mut model, vec![Event::PointerMoved(Pos2::new(start.x + x, y))]));
    }
    actions.extend(bench.frame(&mut model, vec![press(Pos2::new(start.x + 135.0, y), false)]));
    assert!(!actions.is_empty(), "nothing was asked for");
    for action in &actions {
        let Action::SetParam { instance: 3, id: 11, value } = action else { panic!("{action:?}") };
        assert!((0.0..=10.0).contains(value));
    }
    assert_eq!(model.plugins[0].params[0].value, 10.0);
}

#[test]
fn a_changed_parameter_goes_back_to_its_default_by_one_click() {
    let (mut bench, mut model) = (Bench::new(), model());
    bench.settle(&mut model);
    let at = bench.place("⟲");
    let actions = bench.click(&mut model, at);
    assert_eq!(actions, [Action::SetParam { instance: 3, id: 11, value: 0.0 }]);
    bench.settle(&mut model);
    let at = bench.place("Reset all to default");
    let actions = bench.click(&mut model, at);
    assert_eq!(actions, [Action::SetParam { instance: 3, id: 12, value: 0.0 }]);
}

#[test]
fn singularities_bounding_spheres_and_joints_have_a_switch_each() {
    let (mut bench, mut model) = (Bench::new(), model());
    bench.settle(&mut model);
    for (label, singularities, bounds, joints) in [
        ("Singularities", true, false, false),
        ("Bounding spheres", true, true, false),
        ("Joints and levels", true, true, true),
        ("Singularities", false, true, true),
    ] {
        let at = bench.place(label);
        assert!(bench.click(&mut model, at).is_empty(), "the picture alone changes");
        assert_eq!(model.view.markers, Markers { singularities, bounds, joints }, "{label}");
    }
}

#[test]
fn pause_asks_once_and_then_offers_to_go_on() {
    let (mut bench, mut model) = (Bench::new(), model());
    bench.settle(&mut model);
    let at = bench.place("⏸ Pause");
    assert_eq!(bench.click(&mut model, at), [Action::Pause(true)]);
    model.clock.paused = true;
    bench.settle(&mut model);
    bench.place("▶ Go on");
    let at = bench.place("Step");
    assert_eq!(bench.click(&mut model, at), [Action::StepOnce]);
}

/// Ten seconds into a scene of forty.
fn at_ten_seconds() -> PanelModel {
    let memory = Memory { states: 9, from: Some(2), to: 600, used: 17 << 20, most: 256 << 20 };
    let timeline = TimelineView { dt: 1.0 / 60.0, duration: 2400, memory, ..TimelineView::default() };
    let mut model = PanelModel { timeline, ..model() };
    model.scene.step = 600;
    model
}

#[test]
fn the_timeline_asks_for_moments_and_holds_the_sea_while_it_is_dragged() {
    let (mut bench, mut model) = (Bench::new(), at_ten_seconds());
    bench.settle(&mut model);
    bench.place("17 of 256 MB");
    let below = bench.place("remembered from 0:00.0 on");
    let left =
        bench.texts.iter().find(|(text, _)| text.starts_with("remembered")).expect("it is painted").1.left();
    // The rail is a row higher.
    let at = |x: f32| Pos2::new(left + x, below.y - 22.0);
    let press = |pos: Pos2, pressed: bool| {
        vec![
            Event::PointerMoved(pos),
            Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: Modifiers::NONE },
        ]
    };
    bench.frame(&mut model, vec![Event::PointerMoved(at(200.0))]);
    let goal = |actions: Vec<Action>| match actions[..] {
        [Action::GoTo { step, held }] => (step, held),
        _ => panic!("{actions:?}"),
    };
    let (far, held) = goal(bench.frame(&mut model, press(at(200.0), true)));
    assert!(held && (1400..2000).contains(&far), "{far}");
    let (near, held) = goal(bench.frame(&mut model, vec![Event::PointerMoved(at(40.0))]));
    assert!(held && (100..600).contains(&near), "{near}");
    assert_eq!(goal(bench.frame(&mut model, press(at(40.0), false))), (near, false));
    assert!(bench.frame(&mut model, Vec::new()).is_empty());
}

#[test]
fn a_way_to_another_moment_is_shown_and_can_be_stopped() {
    let (mut bench, mut model) = (Bench::new(), at_ten_seconds());
    model.timeline.way = Some(Way { from: 300, to: 1500 });
    bench.settle(&mut model);
    bench.place("on the way to 0:25.0");
    let stop = bench.place("Stop");
    assert_eq!(bench.click(&mut model, stop), [Action::Stop]);
}

#[test]
fn messages_and_a_slow_sea_are_told() {
    let (mut bench, mut model) = (Bench::new(), model());
    model.messages.push(Level::Error, "anemone.so is no library");
    model.messages.push(Level::Error, "anemone.so is no library");
    model.clock.behind = Some(0.5);
    bench.settle(&mut model);
    bench.place("Messages (1)");
    bench.place("anemone.so is no library  (2 ×)");
    assert!(bench.texts.iter().any(|(t, _)| t.contains("does not keep up") && t.contains("0.50×")));
}

#[test]
fn the_panel_leaves_two_thirds_of_a_common_window_to_the_sea_and_its_mouse() {
    let (mut bench, mut model) = (Bench::new(), model());
    bench.settle(&mut model);
    let left = bench.texts.iter().map(|(_, r)| r.left()).fold(f32::INFINITY, f32::min);
    assert!(left > 1280.0 * 2.0 / 3.0, "the panel begins at {left}");
    bench.frame(&mut model, vec![Event::PointerMoved(Pos2::new(600.0, 450.0))]);
    assert!(!bench.ctx.egui_wants_pointer_input(), "the mouse over the sea belongs to the sea");
    let at = bench.place("Stiffness");
    bench.frame(&mut model, vec![Event::PointerMoved(at)]);
    assert!(bench.ctx.egui_wants_pointer_input(), "the mouse over the panel belongs to the panel");
}

#[test]
fn a_tiny_window_shows_no_panel() {
    let (mut bench, mut model) = (Bench::new(), model());
    bench.size = egui::vec2(200.0, 100.0);
    bench.settle(&mut model);
    assert!(bench.texts.is_empty(), "{:?}", bench.texts);
}

#[test]
fn a_scene_that_is_described_again_leaves_a_persons_markers_alone() {
    let [none, both] = [false, true].map(|on| Markers { singularities: on, bounds: on, joints: on });
    let mut view = super::model::ViewOptions::default();
    view.ask(none);
    view.markers = both;
    view.ask(none);
    assert_eq!(view.markers, both, "a newer build of a plugin, say");
    view.ask(both);
    view.ask(none);
    assert_eq!(view.markers, none, "the scene was edited");
    view.markers = both;
    view.asked = None;
    view.ask(none);
    assert_eq!(view.markers, none, "another scene");
}
