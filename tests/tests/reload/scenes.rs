//! Edits of scenes and species while the sea runs.

use std::fs;

use reef_sea::World;

use crate::{Place, builds};

fn scene(first: &str, second: &str) -> String {
    format!(
        "[scene]\nname = \"Edited\"\n\n[modules.first]\nuse = \"fixture.growing\"\n{first}\n\n\
         [modules.second]\nuse = \"fixture.growing\"\n{second}\n"
    )
}

fn heights(world: &World) -> Vec<f64> {
    world.frame().outputs.iter().map(|outputs| f64::from(outputs.fibre_nodes[1].position[1])).collect()
}

/// Writes the scene and runs until the sea has come to an end with it; returns the news.
fn edit(place: &mut Place, text: &str) -> String {
    place.live.take_notices();
    fs::write(place.folder.path().join("scene.toml"), text).unwrap();
    let mut news = String::new();
    let told = place.run(|live, _| {
        news.extend(live.take_notices().into_iter().map(|notice| notice.text));
        !news.is_empty()
    });
    assert!(told, "nothing was said of: {text}");
    news
}

#[test]
fn an_edit_lets_unchanged_modules_go_on_and_others_begin_anew_and_says_which() {
    let mut place = Place::new(&builds(""), &scene("height = 1.0", "height = 2.0"));
    assert!(place.world.set_param(0, 1, 3.0));
    (0..50).for_each(|_| place.world.step());
    let news = edit(&mut place, &scene("height = 1.0", "height = 5.0\nparams.pace = 2.0"));
    assert!(news.contains("carried on: first") && news.contains("anew") && news.contains("second"), "{news}");
    let step = place.world.clock().step as f64;
    let now = heights(&place.world);
    assert!(step >= 50.0 && (now[0] - 1.0 - 0.003 * step).abs() < 1e-4, "{now:?} in step {step}");
    assert!(now[1] < 5.01, "{now:?}");
    assert_eq!(place.world.param(0, 1), Some(3.0), "a parameter that somebody changed stays");
    let before = heights(&place.world);
    place.world.step();
    let after = heights(&place.world);
    let grown = [0, 1].map(|at| after[at] - before[at]);
    assert!((grown[0] - 0.003).abs() < 1e-5 && (grown[1] - 0.002).abs() < 1e-5, "{grown:?}");

    // Another module, another order: what goes on is found by its name.
    let other = scene("height = 1.0", "height = 5.0").replace("first", "third");
    let news = edit(&mut place, &other.replace("second", "first").replace("height = 5.0", "height = 1.0"));
    assert!(news.contains("carried on: first") && news.contains("third"), "{news}");
    let now = heights(&place.world);
    assert!(now[0] < 1.01 && now[1] > 1.15, "{now:?}");
}

#[test]
fn an_edit_of_a_modules_own_file_makes_anew_who_read_it_and_no_other() {
    let mut place = Place::new(&builds(""), &scene("height = 1.0", "height = 2.0"));
    let own = place.folder.path().join("plugins/fixture.growing");
    fs::create_dir(&own).unwrap();
    // A scene that names a file which is not there is refused by the file's name.
    let reading = scene("height = 1.0", "height_file = \"tall.txt\"");
    let news = edit(&mut place, &reading);
    assert!(news.contains("`tall.txt` is not there") && news.contains("runs on as it was"), "{news}");
    fs::write(own.join("tall.txt"), "4.0\n").unwrap();
    let news = edit(&mut place, &format!("{reading}\n"));
    assert!(news.contains("anew") && news.contains("second"), "{news}");
    let written = |place: &mut Place, text: &str| {
        place.live.take_notices();
        fs::write(own.join("tall.txt"), text).unwrap();
        let mut news = String::new();
        place.run(|live, _| {
            news.extend(live.take_notices().into_iter().map(|notice| notice.text));
            !news.is_empty()
        });
        news
    };
    let news = written(&mut place, "7.5\n");
    assert!(news.contains("carried on: first;") && news.contains("reads other files: second"), "{news}");
    let now = heights(&place.world);
    assert!(now[0] < 2.0 && (7.5..8.5).contains(&now[1]), "{now:?}");
    let news = written(&mut place, "tall\n");
    assert!(news.contains("height_file: there is no height in it"), "{news}");
    let news = written(&mut place, "3.0\n");
    assert!(news.contains("reads other files: second") && heights(&place.world)[1] < 4.0, "{news}");
}

#[test]
fn a_bad_edit_keeps_the_old_scene_and_names_file_line_and_column() {
    let mut place = Place::new(&builds(""), &scene("height = 1.0", ""));
    (0..10).for_each(|_| place.world.step());
    let news = edit(&mut place, &scene("height = \"tall\"", ""));
    assert!(news.contains("scene.toml:6:10: ") && news.contains("runs on as it was"), "{news}");
    let news = edit(&mut place, &scene("hieght = 1.0", ""));
    assert!(news.contains("scene.toml:6:1: ") && news.contains("hieght"), "{news}");
    let news = edit(&mut place, "[scene\n");
    assert!(news.contains("scene.toml:1:"), "{news}");
    let step = place.world.clock().step as f64;
    assert!(heights(&place.world).iter().all(|height| (height - 1.0 - 0.001 * step).abs() < 1e-4));
    assert_eq!(place.live.counts().scenes, 0);
    // Mended, and with a build in between: both are taken.
    place.rename_into_place(&builds("v2"));
    place.until(1, 0);
    let news = edit(&mut place, &scene("height = 1.0", "height = 3.0"));
    assert!(news.contains("carried on: first") && news.contains("second"), "{news}");
}

#[test]
fn what_is_remembered_begins_anew_with_an_edit_and_with_a_build() {
    let first = scene("height = 1.0", "height = 2.0");
    let mut place = Place::remembering(&builds(""), &first, 1 << 20);
    let mut since = 100;
    // Growth of the builds [m a step].
    for growth in [0.001, 0.002] {
        place.world.step_to(since);
        assert!(place.world.memory().from.is_some_and(|from| from < 60), "{:?}", place.world.memory());
        if growth == 0.001 {
            edit(&mut place, &scene("height = 1.0", "height = 5.0"));
        } else {
            place.rename_into_place(&builds("v2"));
            place.until(1, 0);
        }
        let memory = place.world.memory();
        assert!(memory.from.is_none_or(|from| from > since), "nothing of before: {memory:?}");
        // Before it there is only the sea as it is now, from its start.
        place.world.go_to(50).expect("all modules run");
        place.world.step_to(50);
        let wanted = [1.0, 5.0].map(|height| height + 50.0 * growth);
        let found = heights(&place.world);
        assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-4), "{found:?}, {wanted:?}");
        since = 200;
    }
}
