use std::os::unix::fs::symlink;

use tempfile::TempDir;

use super::*;

/// Files that nobody tells anything of, as where all watches are taken.
fn deaf() -> Files {
    Files::new(Err(notify::Error::generic("all are taken")))
}

/// What changes before all files were looked at a few times, as text.
fn next_change(files: &mut Files) -> Option<(PathBuf, String)> {
    change_within(files, 5 * ROUND)
}

/// The same within one look at all files.
fn is_quiet(files: &mut Files) -> bool {
    change_within(files, ROUND + ROUND / 5).is_none()
}

fn change_within(files: &mut Files, time: Duration) -> Option<(PathBuf, String)> {
    let end = Instant::now() + time;
    while Instant::now() < end {
        if let Some(change) = files.changes(|_, image| image.length() > 0).pop() {
            let image = change.content.expect("a file that can be read");
            let bytes = image.parts().flat_map(|(_, part)| part).copied().collect();
            return Some((change.path, String::from_utf8(bytes).unwrap()));
        }
        std::thread::sleep(files.due().saturating_duration_since(Instant::now()).min(ROUND / 20));
    }
    None
}

fn place(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    folder
}

/// The watcher that a sea has, whose events come to nobody here: what it tells is not what counts.
fn watched() -> Files {
    Files::new(notify::recommended_watcher(|_| {}))
}

#[test]
fn an_edit_of_what_a_link_leads_to_is_noticed() {
    let place = place(&[("kept/scene.toml", "one"), ("used/x", "")]);
    let link = place.path().join("used/scene.toml");
    symlink("../kept/scene.toml", &link).unwrap();
    let mut files = watched();
    files.add(&link);
    fs::write(place.path().join("kept/scene.toml"), "another").unwrap();
    assert_eq!(next_change(&mut files), Some((link.clone(), "another".to_owned())));
    // Read once, and not again.
    assert!(is_quiet(&mut files));
    let mut deaf = deaf();
    deaf.add(&link);
    fs::write(place.path().join("kept/scene.toml"), "a third").unwrap();
    assert_eq!(next_change(&mut deaf), Some((link, "a third".to_owned())));
}

#[test]
fn a_folder_of_data_that_is_swapped_behind_a_link_is_noticed() {
    let place = place(&[("..1/scene.toml", "one"), ("..2/scene.toml", "two")]);
    let at = |name: &str| place.path().join(name);
    symlink("..1", at("..data")).unwrap();
    symlink("..data/scene.toml", at("scene.toml")).unwrap();
    let (mut files, mut through) = (watched(), watched());
    files.add(&at("scene.toml"));
    through.add(&at("..data/scene.toml"));
    symlink("..2", at("..new")).unwrap();
    fs::rename(at("..new"), at("..data")).unwrap();
    fs::remove_dir_all(at("..1")).unwrap();
    assert_eq!(next_change(&mut files), Some((at("scene.toml"), "two".to_owned())));
    assert_eq!(next_change(&mut through), Some((at("..data/scene.toml"), "two".to_owned())));
}

#[test]
fn a_library_behind_a_link_and_one_that_is_new_are_noticed_without_events() {
    let name = |stem: &str| format!("{stem}{}", std::env::consts::DLL_SUFFIX);
    let place = place(&[("builds/a", "one"), ("plugins/readme", "")]);
    let (plugins, link) = (place.path().join("plugins"), place.path().join("plugins").join(name("a")));
    symlink("../builds/a", &link).unwrap();
    let mut files = deaf();
    files.add_folder(&plugins, true);
    files.add(&link);
    // As a linker does: a file of another name takes the place.
    fs::write(place.path().join("builds/b"), "two").unwrap();
    fs::rename(place.path().join("builds/b"), place.path().join("builds/a")).unwrap();
    assert_eq!(next_change(&mut files), Some((link, "two".to_owned())));
    fs::write(plugins.join(name("new")), "new").unwrap();
    fs::write(plugins.join("no-library"), "new").unwrap();
    assert_eq!(next_change(&mut files), Some((plugins.join(name("new")), "new".to_owned())));
    assert!(is_quiet(&mut files));
}

#[test]
fn a_folder_that_is_not_there_is_waited_for_instead_of_ending_anything() {
    let place = place(&[]);
    let path = place.path().join("later/scene.toml");
    for mut files in [watched(), deaf()] {
        files.add(&path);
        assert!(is_quiet(&mut files));
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, "there").unwrap();
        assert_eq!(next_change(&mut files), Some((path.clone(), "there".to_owned())));
        fs::remove_dir_all(path.parent().unwrap()).unwrap();
    }
}
