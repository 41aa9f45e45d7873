//! When a scene's golden pictures are taken, and what their files are called.

use std::path::{Path, PathBuf};

use reef_sea::{World, step::clock::Clock};

/// A golden picture's moment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Moment {
    /// The step that it shows.
    pub step: u64,
    /// Name of its file, without an ending: the scene's file, and the step where there are several.
    pub name: String,
}

/// A scene's moments in the order of time. `stem`: the name of its file. Without a wish: the middle of what
/// is worth watching, where things have settled into their motion and nothing has ended.
pub fn moments(stem: &str, world: &World) -> Vec<Moment> {
    let table = &world.scene().file.scene;
    named(stem, &table.moments, table.duration * 0.5, world.clock())
}

fn named(stem: &str, wanted: &[f64], middle: f64, clock: Clock) -> Vec<Moment> {
    let times = if wanted.is_empty() { &[middle][..] } else { wanted };
    let mut steps: Vec<u64> = times.iter().map(|time| clock.steps_to(*time)).collect();
    steps.sort_unstable();
    steps.dedup();
    let one = steps.len() == 1;
    let name = |step: u64| if one { stem.to_owned() } else { format!("{stem}-{step}") };
    steps.into_iter().map(|step| Moment { step, name: name(step) }).collect()
}

/// Pictures of a scene, and their origins, that belong to none of its moments.
pub fn strays(folder: &Path, stem: &str, moments: &[Moment]) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let belongs = |path: &Path| {
        let Some(name) = path.file_stem().and_then(|name| name.to_str()) else { return false };
        let rest = name.strip_prefix(stem);
        let step = rest.and_then(|rest| rest.strip_prefix('-')).unwrap_or_default();
        let of_scene = rest == Some("") || !step.is_empty() && step.bytes().all(|b| b.is_ascii_digit());
        of_scene && moments.iter().all(|moment| moment.name != name)
    };
    let mut found: Vec<PathBuf> =
        entries.flatten().map(|entry| entry.path()).filter(|path| belongs(path)).collect();
    found.sort();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLOCK: Clock = Clock { step: 0, dt: 1.0 / 60.0 };

    #[test]
    fn moments_are_steps_in_order_and_one_alone_has_the_scenes_name() {
        let of = |wanted: &[f64]| named("sea", wanted, 5.0, CLOCK);
        assert_eq!(of(&[]), [Moment { step: 300, name: "sea".into() }]);
        assert_eq!(of(&[2.0]), [Moment { step: 120, name: "sea".into() }]);
        let names: Vec<String> = of(&[4.0, 0.5, 4.0]).into_iter().map(|moment| moment.name).collect();
        assert_eq!(names, ["sea-30", "sea-240"]);
    }

    #[test]
    fn only_pictures_of_the_scene_at_other_moments_are_strays() {
        let folder = tempfile::tempdir().expect("a folder");
        let put = |name: &str| std::fs::write(folder.path().join(name), "").expect("written");
        for name in
            ["sea.png", "sea-30.png", "sea-31.png", "sea-31.json", "sea-deep.png", "seaside.png", "a.png"]
        {
            put(name);
        }
        let moments = named("sea", &[0.5, 4.0], 5.0, CLOCK);
        let found = strays(folder.path(), "sea", &moments);
        assert_eq!(found, ["sea-31.json", "sea-31.png", "sea.png"].map(|name| folder.path().join(name)));
    }
}
