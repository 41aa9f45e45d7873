//! What tables of the papers share: a cell is a scene's sea under some parameters, its steps and pictures are
//! measured.

use std::{path::Path, time::Instant};

use reef_command::{Common, open};
use reef_gpu::{Gpu, GpuOptions, Validation};
use reef_plugin::{Registry, StepTimes};
use reef_render::{Quality, Settings, Shot, Studio};
use reef_report::failure::Failure;
use reef_sea::{Options, World, scene::Scene};
use reef_streams::frame::Frame;

use super::{fibre::running, measure::median, report::Report};

/// Picture [px], and how many are measured of each cell.
const SIZE: (u32, u32) = (1280, 720);
const PICTURES: usize = 3;

/// Numbers in columns.
pub(super) fn line(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:>9.0}")).collect()
}

/// A figure of the scene's first module.
pub(super) fn figure(world: &World, name: &str) -> f64 {
    let figures = world.instance(0).map(|instance| instance.figures()).unwrap_or_default();
    figures.into_iter().find(|(known, _)| known == name).map_or(f64::NAN, |(_, value)| value)
}

/// Real time of the last step of the first module with this plugin.
pub(super) fn times_of(world: &World, plugin: &str) -> Option<StepTimes> {
    let module = world.modules().position(|(_, info)| info.id == plugin)?;
    world.instance(module).map(|instance| instance.times())
}

/// The sea of a scene that `edit` made another.
pub(super) fn world(
    common: &Common,
    plugins: &Registry,
    scene: &str,
    edit: impl FnOnce(&mut Scene),
) -> Result<World, Failure> {
    let mut scene = open::scene(common, Path::new(scene), plugins)?;
    edit(&mut scene);
    World::new(scene, plugins, &Options { seed: common.seed, ..Options::default() }).map_err(Failure::input)
}

/// Steps before anything is measured: what is there has gone over to its levels of detail.
pub(super) fn warm(world: &mut World, steps: usize) -> Result<(), Failure> {
    (0..steps).for_each(|_| world.step());
    running(world)
}

/// Sets parameters of all modules: `wanted` says the value of one by its module's plugin and its key; None:
/// it stays.
pub(super) fn set(world: &mut World, wanted: impl Fn(&str, &str) -> Option<f64>) {
    let settings: Vec<(usize, u32, f64)> = world
        .modules()
        .enumerate()
        .flat_map(|(module, (_, info))| {
            let value =
                |param: &reef_plugin::ParamInfo| Some((module, param.id, wanted(&info.id, &param.key)?));
            info.params.iter().filter_map(value).collect::<Vec<_>>()
        })
        .collect();
    for (module, id, value) in settings {
        world.set_param(module, id, value);
    }
}

/// Seconds a picture of each cell; None where there is no Vulkan.
pub(super) fn pictures(
    common: &Common,
    cells: &[World],
    report: &mut Report,
) -> Result<Option<Vec<f64>>, Failure> {
    let gpu = match Gpu::open(&GpuOptions::from_environment(common.device.clone(), Validation::Off)) {
        Ok(gpu) => gpu,
        Err(error) => {
            report.note(format!("No pictures: {error}"));
            return Ok(None);
        }
    };
    let measured = draw(&gpu, cells);
    report.note(format!(
        "Pictures: {} on {}, {}×{}, low quality, medians of {PICTURES}.",
        gpu.info().name,
        gpu.info().driver,
        SIZE.0,
        SIZE.1
    ));
    gpu.close();
    Ok(Some(measured?))
}

fn draw(gpu: &Gpu, cells: &[World]) -> Result<Vec<f64>, Failure> {
    let mut studio = Studio::new(gpu, SIZE)?;
    let settings = Settings { quality: Quality::Low, ..Settings::default() };
    let mut times = Vec::new();
    for world in cells {
        let frame: &Frame = world.frame();
        let shot = Shot {
            previous: frame,
            current: frame,
            alpha: 1.0,
            camera: frame.camera,
            environment: world.environment(),
        };
        studio.run(&shot, &settings)?;
        let mut own = Vec::new();
        for _ in 0..PICTURES {
            let start = Instant::now();
            studio.run(&shot, &settings)?;
            own.push(start.elapsed().as_secs_f64());
        }
        times.push(median(own));
    }
    Ok(times)
}
