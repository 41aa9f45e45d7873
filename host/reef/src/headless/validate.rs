//! `reef validate`: scenes under the validation layers, compared with their golden pictures.

use std::path::{Path, PathBuf};

use reef_command::{Common, open};
use reef_files as files;
use reef_files::InOrder;
use reef_gpu::{Gpu, GpuOptions, Message, Picture, Validation};
use reef_render::{
    Quality, Settings, Studio,
    pictures::{read_png, write_png},
};
use reef_report::{
    failure::{Failure, Outcome},
    say::{self, say},
};
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::{
    compare::{Allowance, Difference, OTHER_DRIVER, SAME_DRIVER, TOLERANCE, compare, difference_picture},
    moments::{self, Moment},
    report::{self, Entry},
    show::Show,
    subjects,
};

/// Size of golden pictures [px].
const SIZE: (u32, u32) = (512, 288);
/// Pictures that are made of a scene before the golden one, so that frames meet each other in flight.
const LEAD: u32 = 3;

/// Options of `reef validate`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// Scenes; all of assets/scenes without any.
    pub scenes: Vec<PathBuf>,
    /// Write the golden pictures anew.
    #[arg(long)]
    pub bless: bool,
    /// Write an HTML page with expected, actual and difference.
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Take each thing out of each scene in turn, and fail where the pictures stay as they were: it is not
    /// seen.
    #[arg(long, conflicts_with_all = ["bless", "report"])]
    pub subjects: bool,
}

/// Where and when a golden picture was made, beside it as JSON.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// Moment of the scene, in milliseconds.
    pub milliseconds: u64,
    /// The processor's name.
    pub cpu: String,
    /// The Vulkan device: lavapipe names LLVM and its vector width.
    pub device: String,
    /// The driver's name and version.
    pub driver: String,
    /// Reef's version.
    pub reef: String,
}

/// What became of one picture.
struct Verdict {
    name: String,
    /// None: blessed.
    difference: Option<Difference>,
    /// How far the picture may be from the golden one.
    allowance: Allowance,
    /// Why it fails, in words.
    faults: Vec<String>,
    messages: Vec<Message>,
    expected: Option<Picture>,
    actual: Picture,
}

/// Renders each scene, fails on any message or mismatch.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let assets = open::assets_folder(common)?;
    let golden = assets.join("golden");
    let scenes = if args.scenes.is_empty() { all_scenes(&assets)? } else { args.scenes.clone() };
    if args.subjects {
        return subjects::run(common, &scenes);
    }
    if let Some(folder) = &args.report {
        files::make_folder(folder).map_err(Failure::input)?;
    }
    if args.bless {
        files::make_folder(&golden).map_err(Failure::input)?;
    }
    let options = GpuOptions::from_environment(common.device.clone(), Validation::CoreSync);
    let gpu = Gpu::open(&options)?;
    let canary = gpu.canary();
    let mut verdicts = Vec::new();
    let bar = say::progress(scenes.len() as u64, "scenes", !common.json);
    let in_order = files::in_order();
    for (seen, scene) in (1..).zip(&scenes) {
        verdicts.extend(validate(common, args, scene, &golden, &gpu, &in_order)?);
        if let Some(signal) = in_order.asked().filter(|_| seen < scenes.len()) {
            tracing::warn!("ended by {signal}: not all pictures were looked at");
            break;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    let device = gpu.info().to_string();
    gpu.close();
    let last_words = canary.take();

    tell(common, &verdicts, &last_words, &device);
    if let Some(folder) = &args.report {
        write_report(folder, &verdicts, &last_words, &device)?;
    }
    let failed = verdicts.iter().filter(|v| !v.faults.is_empty() || !v.messages.is_empty()).count();
    if failed == 0 && last_words.is_empty() {
        return Ok(());
    }
    Err(Failure::check(miette::miette!(
        "{failed} of {} pictures failed{}",
        verdicts.len(),
        if last_words.is_empty() { "" } else { "; messages came when the device was closed" }
    )))
}

/// All scenes of the assets, by name.
fn all_scenes(assets: &Path) -> Result<Vec<PathBuf>, Failure> {
    let folder = assets.join("scenes");
    let fail = |error: std::io::Error| Failure::input(miette::miette!("{}: {error}", folder.display()));
    let mut scenes = Vec::new();
    for entry in std::fs::read_dir(&folder).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        if path.extension().is_some_and(|e| e == "toml") {
            scenes.push(path);
        }
    }
    scenes.sort();
    if scenes.is_empty() {
        return Err(Failure::input(miette::miette!("{}: there are no scenes", folder.display())));
    }
    Ok(scenes)
}

fn validate(
    common: &Common,
    args: &Args,
    scene: &Path,
    golden: &Path,
    gpu: &Gpu,
    in_order: &InOrder,
) -> Result<Vec<Verdict>, Failure> {
    let stem = stem(scene);
    let world = open::world(common, scene, reef_sea::Options::default())?;
    let moments = moments::moments(&stem, &world);
    let strays = moments::strays(golden, &stem, &moments);
    let dt = world.clock().dt;
    let mut show = Show::new(world);
    let settings = show.settings();
    let mut studio = Studio::new(gpu, SIZE)?;
    let mut verdicts = Vec::new();
    for moment in moments.iter().take_while(|_| in_order.asked().is_none()) {
        let time = moment.step as f64 * dt;
        for n in (1..=LEAD).rev() {
            show.go_to((time - dt * f64::from(n)).max(0.0));
            studio.run(&show.shot(), &settings)?;
        }
        show.go_to(time);
        let actual = studio.shoot(&show.shot(), &settings)?;
        if verdicts.is_empty() {
            // Low quality has passes of its own; the layers look at them, too.
            let Settings { debug_channels, markers, .. } = settings;
            let low = Settings { debug_channels, markers, ..Settings::of(Quality::Low) };
            studio.run(&show.shot(), &low)?;
        }
        let mut verdict = judge(args, golden, moment, actual, (time, gpu))?;
        let said = show.world().take_messages();
        verdict.faults.extend(said.iter().map(|m| format!("{}: {}", m.module, m.text)));
        verdicts.push(verdict);
    }
    drop(studio);
    if let Some(last) = verdicts.last_mut() {
        last.messages.extend(gpu.canary().take());
        for stray in strays {
            if args.bless {
                std::fs::remove_file(&stray)
                    .map_err(|error| Failure::input(miette::miette!("{}: {error}", stray.display())))?;
            } else {
                last.faults.push(format!(
                    "{}: this is no moment of the scene (`--bless` removes it)",
                    stray.display()
                ));
            }
        }
    }
    Ok(verdicts)
}

/// Compares a picture with its golden one, or puts it in that one's place.
fn judge(
    args: &Args,
    golden: &Path,
    moment: &Moment,
    actual: Picture,
    (time, gpu): (f64, &Gpu),
) -> Result<Verdict, Failure> {
    let path = golden.join(format!("{}.png", moment.name));
    let mut verdict = Verdict {
        name: moment.name.clone(),
        difference: None,
        allowance: allowance(&path, &gpu.info().driver),
        faults: Vec::new(),
        messages: gpu.canary().take(),
        expected: None,
        actual,
    };
    if args.bless {
        bless(&path, &verdict.actual, &origin(gpu, time))?;
        return Ok(verdict);
    }
    match read_png(&path) {
        Err(error) => {
            verdict.faults.push(format!("no golden picture: {error} (`reef validate --bless` makes it)"));
        }
        Ok(expected) => {
            let difference = compare(&expected, &verdict.actual);
            if !difference.passes(verdict.allowance) {
                verdict.faults.push(in_words(&difference, verdict.allowance));
            }
            verdict.difference = Some(difference);
            verdict.expected = Some(expected);
        }
    }
    Ok(verdict)
}

/// A scene's file without its ending.
pub(super) fn stem(scene: &Path) -> String {
    scene.file_stem().map_or_else(|| "scene".to_owned(), |s| s.to_string_lossy().into_owned())
}

/// How far a picture of this driver may be from a golden one, by the origin beside that.
fn allowance(golden: &Path, driver: &str) -> Allowance {
    let origin = std::fs::read(golden.with_extension("json")).ok();
    let origin = origin.and_then(|text| serde_json::from_slice::<Origin>(&text).ok());
    let name = |driver: &str| driver.split_whitespace().next().map(str::to_owned);
    match origin {
        Some(origin) if name(&origin.driver) != name(driver) => OTHER_DRIVER,
        _ => SAME_DRIVER,
    }
}

fn in_words(difference: &Difference, allowance: Allowance) -> String {
    if difference.other_size {
        return "the golden picture is of another size".to_owned();
    }
    format!(
        "{} of {} pixels differ by more than {TOLERANCE} (allowed: {:.1} %), the greatest difference is {} (allowed: {})",
        difference.exceptions,
        difference.pixels,
        allowance.exceptions * 100.0,
        difference.greatest,
        allowance.limit
    )
}

fn bless(path: &Path, picture: &Picture, origin: &Origin) -> Outcome {
    write_png(path, picture).map_err(Failure::input)?;
    let text = serde_json::to_string_pretty(origin).unwrap_or_default() + "\n";
    files::write(&path.with_extension("json"), text.as_bytes()).map_err(Failure::input)
}

fn origin(gpu: &Gpu, time: f64) -> Origin {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    Origin {
        milliseconds: (time * 1e3).round() as u64,
        cpu: cpu.unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
        device: gpu.info().name.clone(),
        driver: gpu.info().driver.clone(),
        reef: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

fn tell(common: &Common, verdicts: &[Verdict], last_words: &[Message], device: &str) {
    if common.json {
        let pictures: Vec<_> = verdicts
            .iter()
            .map(|v| {
                json!({
                    "picture": v.name,
                    "passed": v.faults.is_empty() && v.messages.is_empty(),
                    "faults": v.faults,
                    "messages": v.messages,
                    "exceptions": v.difference.as_ref().map(|d| d.exceptions),
                    "greatest": v.difference.as_ref().map(|d| d.greatest),
                })
            })
            .collect();
        say(json!({ "device": device, "pictures": pictures, "messages_at_close": last_words }));
        return;
    }
    for v in verdicts {
        let mark = if v.faults.is_empty() && v.messages.is_empty() { "ok  " } else { "FAIL" };
        let how = match &v.difference {
            Some(d) => {
                format!("greatest difference {}, {} pixels beyond {TOLERANCE}", d.greatest, d.exceptions)
            }
            None if v.faults.is_empty() => "blessed".to_owned(),
            None => "not compared".to_owned(),
        };
        say(format_args!("{mark} {:34} {how}", v.name));
        for fault in &v.faults {
            say(format_args!("     {fault}"));
        }
        for message in &v.messages {
            say(format_args!("     {message}"));
        }
    }
    for message in last_words {
        say(format_args!("FAIL at close: {message}"));
    }
}

fn write_report(
    folder: &Path,
    verdicts: &[Verdict],
    last_words: &[Message],
    device: &str,
) -> Result<(), Failure> {
    let mut entries = Vec::new();
    for v in verdicts {
        let save = |kind: &str, picture: &Picture| -> Result<String, Failure> {
            let file = format!("{}-{kind}.png", v.name);
            write_png(&folder.join(&file), picture).map_err(Failure::input)?;
            Ok(file)
        };
        let actual = save("actual", &v.actual)?;
        let (expected, difference) = match &v.expected {
            Some(expected) => (
                Some(save("expected", expected)?),
                Some(save("difference", &difference_picture(expected, &v.actual))?),
            ),
            None => (None, None),
        };
        let mut lines = v.faults.clone();
        lines.extend(v.messages.iter().map(ToString::to_string));
        entries.push(Entry {
            name: v.name.clone(),
            passed: lines.is_empty(),
            figures: v.difference.as_ref().map(|d| in_words(d, v.allowance)).unwrap_or_default(),
            lines,
            pictures: [expected, Some(actual), difference],
        });
    }
    let last: Vec<String> = last_words.iter().map(ToString::to_string).collect();
    let page = report::page(device, &entries, &last);
    files::write(&folder.join("index.html"), page.as_bytes()).map_err(Failure::input)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_driver_than_the_goldens_may_place_edges_elsewhere() {
        let folder = tempfile::tempdir().expect("a folder");
        let golden = folder.path().join("sea.png");
        assert_eq!(allowance(&golden, "llvmpipe Mesa 22.3.6"), SAME_DRIVER, "no origin: no excuse");
        let origin = Origin {
            milliseconds: 0,
            cpu: String::new(),
            device: String::new(),
            driver: "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)".to_owned(),
            reef: String::new(),
        };
        let text = serde_json::to_string(&origin).expect("JSON");
        std::fs::write(golden.with_extension("json"), text).expect("written");
        assert_eq!(allowance(&golden, "llvmpipe Mesa 25.0.1 (LLVM 19.1.7)"), SAME_DRIVER);
        assert_eq!(allowance(&golden, "NVIDIA 580.159.04"), OTHER_DRIVER);
    }

    #[test]
    fn a_blessed_picture_has_its_origin_beside_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let golden = folder.path().join("golden");
        let picture = Picture { width: 1, height: 1, rgba: vec![1, 2, 3, 255] };
        let origin = Origin {
            milliseconds: 5000,
            cpu: "c".into(),
            device: "d".into(),
            driver: "e".into(),
            reef: "0".into(),
        };
        files::make_folder(&golden).expect("a folder");
        bless(&golden.join("a.png"), &picture, &origin).expect("blessed");
        assert_eq!(read_png(&golden.join("a.png")).expect("read"), picture);
        let text = std::fs::read_to_string(golden.join("a.json")).expect("read");
        assert_eq!(serde_json::from_str::<Origin>(&text).expect("parsed"), origin);
    }

    #[test]
    fn all_scenes_are_found_in_order_and_an_empty_folder_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let scenes = folder.path().join("scenes");
        std::fs::create_dir(&scenes).expect("made");
        assert_eq!(all_scenes(folder.path()).expect_err("empty").code, 2);
        for name in ["b.toml", "a.toml", "README.md"] {
            std::fs::write(scenes.join(name), "").expect("written");
        }
        let found = all_scenes(folder.path()).expect("found");
        assert_eq!(found, [scenes.join("a.toml"), scenes.join("b.toml")]);
    }
}
