//! `reef doctor`: devices, drivers, layers, what is missing and the command that installs it.

use reef_command::Common;
use reef_gpu::{
    DeviceInfo, Gpu, GpuOptions, Layer, Validation, advice, inspect_machine, packages, self_test,
};
use reef_report::{
    failure::{Failure, Outcome},
    say::say,
};
use serde::Serialize;

/// Options of `reef doctor`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {}

/// One thing that was looked for.
#[derive(Clone, Debug, Serialize)]
struct Finding {
    /// What it is.
    what: &'static str,
    /// Whether Reef draws nothing without it.
    needed: bool,
    /// Whether it is there and works.
    found: bool,
    /// What was found, or what is wrong.
    detail: String,
    /// What to do about it, a line each: what of the environment hides it, else the commands that install it;
    /// empty where it is there.
    remedy: Vec<String>,
}

/// Everything that was found.
#[derive(Clone, Debug, Serialize)]
struct Diagnosis {
    /// Whether Reef can draw on this machine.
    can_render: bool,
    findings: Vec<Finding>,
    devices: Vec<DeviceInfo>,
    layers: Vec<Layer>,
}

/// Looks at the machine and prints what it found.
pub fn run(common: &Common, _args: &Args) -> Outcome {
    let diagnosis = examine(common);
    if common.json {
        let text = serde_json::to_string_pretty(&diagnosis)
            .map_err(|error| Failure::check(miette::miette!("{error}")))?;
        say(text);
    } else {
        say(describe(&diagnosis));
    }
    if diagnosis.can_render {
        return Ok(());
    }
    let missing: Vec<&str> =
        diagnosis.findings.iter().filter(|f| f.needed && !f.found).map(|f| f.what).collect();
    Err(Failure::machine(miette::miette!("Reef cannot draw on this machine: {}", missing.join(", "))))
}

fn examine(common: &Common) -> Diagnosis {
    let mut findings = Vec::new();
    let nothing: fn() -> Option<String> = || None;
    let mut add =
        |what, needed, outcome: Result<String, String>, group: &str, hidden: fn() -> Option<String>| {
            let (found, detail) = match outcome {
                Ok(detail) => (true, detail),
                Err(detail) => (false, detail),
            };
            // What the environment hides is not mended by installing it once more.
            let remedy = match group {
                _ if found => Vec::new(),
                "" => Vec::new(),
                _ => hidden().map_or_else(
                    || packages::commands(&[group]),
                    |hidden| hidden.lines().map(str::to_owned).collect(),
                ),
            };
            findings.push(Finding { what, needed, found, detail, remedy });
            found
        };

    let machine = inspect_machine();
    let mut devices = Vec::new();
    let mut layers = Vec::new();
    match machine.loader {
        Ok(version) => {
            add("Vulkan loader", true, Ok(format!("speaks Vulkan {version}")), "run", nothing);
            layers = machine.layers;
            let able = match machine.devices {
                Ok(found) => {
                    let able = found.iter().filter(|device| device.missing.is_empty()).count();
                    let detail = format!("{} found, {able} can run Reef", found.len());
                    devices = found;
                    if able > 0 { Ok(detail) } else { Err(detail) }
                }
                Err(error) => Err(error.to_string()),
            };
            add("Vulkan device", true, able, "run", advice::hidden_drivers);
        }
        Err(error) => {
            add("Vulkan loader", true, Err(error.to_string()), "run", nothing);
        }
    }
    if devices.iter().any(|device| device.missing.is_empty()) {
        add("picture", true, try_to_draw(common), "", nothing);
    }
    let has_layer = layers.iter().find(|layer| layer.name == "VK_LAYER_KHRONOS_validation");
    add(
        "validation layer",
        false,
        has_layer
            .map(|layer| format!("of Vulkan {}", layer.version))
            .ok_or_else(|| "not there: `reef validate` needs it".to_owned()),
        "validate",
        advice::hidden_layers,
    );
    add("window libraries", false, window_libraries(), "window", nothing);
    let display = ["WAYLAND_DISPLAY", "DISPLAY"]
        .into_iter()
        .find_map(|name| std::env::var(name).ok().filter(|v| !v.is_empty()).map(|v| format!("{name}={v}")));
    add(
        "display",
        false,
        display.ok_or_else(|| "none: `reef render` draws without one".to_owned()),
        "",
        nothing,
    );
    add(
        "virtual display",
        false,
        program("Xvfb", "only the window's tests need it"),
        "window-tests",
        nothing,
    );
    add("ffmpeg", false, program("ffmpeg", "`reef render --out F.mp4` needs it"), "video", nothing);
    let compiler = if cfg!(feature = "shaderc") {
        Ok("built in: shaders are reloaded while Reef runs".to_owned())
    } else {
        Err("not built in: `cargo xtask shaders` compiles shaders".to_owned())
    };
    add("shader compiler", false, compiler, "shaders", nothing);

    let can_render = findings.iter().all(|finding| finding.found || !finding.needed);
    Diagnosis { can_render, findings, devices, layers }
}

/// Draws, computes and reads back something whose result is known, on the device that `--device` names or the
/// best.
fn try_to_draw(common: &Common) -> Result<String, String> {
    let options =
        GpuOptions { device: common.device.clone(), validation: Validation::Off, ..GpuOptions::default() };
    let drawn = Gpu::open(&options).and_then(|gpu| {
        let name = gpu.info().name.clone();
        let tested = self_test::run(&gpu);
        gpu.close();
        tested.map(|()| name)
    });
    match drawn {
        Ok(name) => Ok(format!("drawn and computed as it should be on {name}")),
        Err(error) => Err(error.to_string()),
    }
}

/// What winit loads while it runs; without them the window does not open.
fn window_libraries() -> Result<String, String> {
    if !cfg!(target_os = "linux") {
        return Ok("part of the system".to_owned());
    }
    let can_load = |name: &&str| {
        // SAFETY: these libraries of the window system do nothing of note when they are loaded.
        unsafe { libloading::Library::new(*name) }.is_ok()
    };
    let wanted = ["libxkbcommon.so.0", "libwayland-client.so.0", "libX11.so.6", "libxkbcommon-x11.so.0"];
    let missing: Vec<&str> = wanted.iter().filter(|name| !can_load(name)).copied().collect();
    if missing.is_empty() {
        Ok("for X11 and Wayland".to_owned())
    } else {
        Err(format!("{} cannot be loaded", missing.join(", ")))
    }
}

fn program(name: &str, otherwise: &str) -> Result<String, String> {
    packages::program(name).map(|path| path.display().to_string()).map_err(|barred| match barred {
        Some(path) => format!("{} is not marked as a program: {otherwise}", path.display()),
        None => format!("not there: {otherwise}"),
    })
}

/// For people.
fn describe(diagnosis: &Diagnosis) -> String {
    let mut lines = Vec::new();
    for finding in &diagnosis.findings {
        let mark = match (finding.found, finding.needed) {
            (true, _) => "ok     ",
            (false, true) => "MISSING",
            (false, false) => "without",
        };
        lines.push(format!("{mark}  {:<17} {}", finding.what, finding.detail));
        for command in &finding.remedy {
            lines.push(format!("{:28}{command}", ""));
        }
    }
    if !diagnosis.devices.is_empty() {
        lines.push("\nDevices (for --device, by index or part of the name):".to_owned());
    }
    for device in &diagnosis.devices {
        lines.push(format!("  {device}"));
        if !device.missing.is_empty() {
            lines.push(format!("     cannot run Reef: it lacks {}", device.missing.join(", ")));
        }
    }
    if !diagnosis.layers.is_empty() {
        lines.push("\nLayers:".to_owned());
    }
    for layer in &diagnosis.layers {
        lines.push(format!("  {} (Vulkan {})", layer.name, layer.version));
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diagnosis_names_what_is_needed_and_how_to_get_what_is_missing() {
        let diagnosis = examine(&Common::default());
        let needed: Vec<_> = diagnosis.findings.iter().filter(|f| f.needed).collect();
        assert!(!needed.is_empty());
        assert_eq!(diagnosis.can_render, needed.iter().all(|f| f.found));
        for finding in &diagnosis.findings {
            assert!(!finding.detail.is_empty(), "{}", finding.what);
            assert!(finding.remedy.is_empty() || !finding.found, "{} is there", finding.what);
        }
        let json = serde_json::to_value(&diagnosis).expect("JSON");
        assert!(json["can_render"].is_boolean() && json["devices"].is_array());
    }

    #[test]
    fn a_device_that_is_not_there_makes_the_picture_fail_with_the_list() {
        let common = Common { device: Some("no such device".to_owned()), ..Common::default() };
        let diagnosis = examine(&common);
        if let Some(picture) = diagnosis.findings.iter().find(|f| f.what == "picture") {
            assert!(!picture.found && picture.detail.contains("no such device"), "{}", picture.detail);
            assert!(!diagnosis.can_render);
        }
    }
}
