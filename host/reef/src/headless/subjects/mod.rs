//! `reef validate --subjects`: takes each thing out of each scene in turn, and sees the pictures of the
//! scene's moments change: each of them for a module, at least one for any other thing. A thing whose absence
//! nobody would see in a golden picture is one that the golden picture does not hold.

mod list;

use std::{
    collections::HashSet,
    path::{Path, PathBuf},
    sync::Arc,
};

use reef_command::{Common, open};
use reef_gpu::{Gpu, GpuOptions, Picture, Validation};
use reef_plugin::Registry;
use reef_render::{Settings, Shot, Studio};
use reef_report::{
    failure::{Failure, Outcome},
    say::{self, say},
};
use reef_sea::{Options, World, scene::Scene};
use reef_streams::{Outputs, environment::Environment, frame::Frame};
use serde_json::json;

use self::list::{Subject, Without};
use super::{
    compare::{SAME_DRIVER, compare},
    moments::moments,
    show::Show,
    validate::stem,
};

/// Size of the pictures that are compared [px]: what is seen in half a golden picture is seen in a whole one.
const SIZE: (u32, u32) = (320, 180);

/// What became of one scene.
struct Found {
    scene: String,
    seen: Vec<String>,
    /// What could be gone without anybody noticing.
    unseen: Vec<String>,
}

/// Looks at all scenes.
pub fn run(common: &Common, scenes: &[PathBuf]) -> Outcome {
    let plugins = open::plugins(common)?;
    let options = GpuOptions::from_environment(common.device.clone(), Validation::Off);
    let gpu = Gpu::open(&options)?;
    let mut studio = Studio::new(&gpu, SIZE)?;
    let bar = say::progress(scenes.len() as u64, "scenes", !common.json);
    let mut all = Vec::new();
    for path in scenes {
        all.push(look(common, path, &plugins, &mut studio)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    drop(studio);
    gpu.close();
    tell(common, &all);
    let failed = all.iter().filter(|found| !found.unseen.is_empty()).count();
    if failed == 0 {
        return Ok(());
    }
    Err(Failure::check(miette::miette!(
        help = "choose `moments` and a camera from which each thing is seen, or leave the thing out of the scene",
        "{failed} of {} scenes hold something that their pictures do not show",
        all.len()
    )))
}

fn look(common: &Common, path: &Path, plugins: &Registry, studio: &mut Studio) -> Result<Found, Failure> {
    let scene = open::scene(common, path, plugins)?;
    let options = Options { seed: common.seed, ..Options::default() };
    let make = |scene: Scene| World::new(scene, plugins, &options).map_err(Failure::input);
    let world = make(scene.clone())?;
    let moments = moments(&stem(path), &world);
    let dt = world.clock().dt;
    let subjects = list::subjects(&scene, &world, &make)?;
    let (mut modules, mut others): (Vec<Subject>, Vec<Subject>) =
        subjects.into_iter().partition(|subject| matches!(subject.without, Without::Module(_)));
    let mut show = Show::new(world);
    let settings = Settings { samples: 1, ..show.settings() };
    let mut found = Found { scene: stem(path), seen: Vec::new(), unseen: Vec::new() };
    for moment in moments {
        let time = moment.step as f64 * dt;
        show.go_to(time);
        let whole = studio.shoot(&show.shot(), &settings)?;
        let mut is_seen = |subject: &mut Subject| -> Result<bool, Failure> {
            let without = shoot_without(subject, &show, time, &settings, studio)?;
            Ok(!compare(&whole, &without).passes(SAME_DRIVER))
        };
        // No picture is blind to a module.
        for module in &mut modules {
            let seen = is_seen(module)?;
            let list = if seen { &mut found.seen } else { &mut found.unseen };
            list.push(format!("{} at step {}", module.name, moment.step));
        }
        // Each other thing is in one picture at least.
        let mut left = Vec::new();
        for mut subject in others {
            if is_seen(&mut subject)? {
                found.seen.push(subject.name);
            } else {
                left.push(subject);
            }
        }
        others = left;
    }
    found.unseen.extend(others.into_iter().map(|subject| subject.name));
    Ok(found)
}

/// The picture of a moment without a subject.
fn shoot_without(
    subject: &mut Subject,
    show: &Show,
    time: f64,
    settings: &Settings,
    studio: &mut Studio,
) -> Result<Picture, Failure> {
    let shot = show.shot();
    let bare = |hide: &dyn Fn(&Frame) -> Frame, studio: &mut Studio| {
        let [previous, current] = [shot.previous, shot.current].map(hide);
        studio.shoot(&Shot { previous: &previous, current: &current, ..shot }, settings)
    };
    Ok(match &mut subject.without {
        Without::Module(module) => bare(&|frame| hidden(frame, *module, None), studio)?,
        Without::Objects(module, ids) => bare(&|frame| hidden(frame, *module, Some(ids)), studio)?,
        Without::Setting(environment) => studio.shoot(&Shot { environment, ..shot }, settings)?,
        Without::Switch(off) => studio.shoot(&shot, &off(settings))?,
        Without::Anew(other) => {
            other.go_to(time);
            studio.shoot(&other.shot(), settings)?
        }
    })
}

/// A frame without a module's streams, or without what belongs to some of its objects.
fn hidden(frame: &Frame, module: usize, ids: Option<&HashSet<u64>>) -> Frame {
    let mut frame = frame.clone();
    let Some(whole) = frame.outputs.get_mut(module) else { return frame };
    let mut outputs = Outputs { materials: whole.materials.clone(), ..Outputs::default() };
    if let Some(ids) = ids {
        outputs = Outputs::clone(whole);
        let gone: Vec<bool> = outputs.objects.iter().map(|object| ids.contains(&object.id)).collect();
        outputs.take_out(|object| gone.get(object as usize).copied().unwrap_or(false));
    }
    *whole = Arc::new(outputs);
    frame
}

fn tell(common: &Common, all: &[Found]) {
    if common.json {
        let scenes: Vec<_> = all
            .iter()
            .map(|found| json!({ "scene": found.scene, "seen": found.seen, "unseen": found.unseen }))
            .collect();
        say(json!(scenes));
        return;
    }
    for found in all {
        let mark = if found.unseen.is_empty() { "ok  " } else { "FAIL" };
        let count = found.seen.len() + found.unseen.len();
        say(format_args!("{mark} {:34} {} of {count} things are seen", found.scene, found.seen.len()));
        for name in &found.unseen {
            say(format_args!("     {name} can be taken out, and nobody sees it"));
        }
    }
}

/// What stands still in a scene, changed.
fn changed(environment: &Environment, change: impl FnOnce(&mut Environment)) -> Box<Environment> {
    let mut environment = environment.clone();
    change(&mut environment);
    Box::new(environment)
}
