//! Newer builds of a plugin, in every way in which a file can appear.

use std::{fs, path::Path, time::Duration};

use crate::{Place, SCENE, another, builds, write_slowly};

/// Growth of the first build and of the second [m].
const SLOW: f64 = 0.001;
const FAST: f64 = 0.002;

fn assert_grows(place: &mut Place, expected: f64) {
    let growth = place.growth();
    // The height is an f32 near 1.
    assert!((growth - expected).abs() < 1e-6, "it grows by {growth} m a step, not {expected}");
}

#[test]
fn a_newer_build_takes_over_with_state_and_parameters_between_two_steps() {
    let mut place = Place::new(&builds(""), SCENE);
    assert!(place.world.set_param(0, 1, 3.0));
    (0..50).for_each(|_| place.world.step());
    assert_grows(&mut place, 3.0 * SLOW);
    place.rename_into_place(&builds("v2"));
    let news = place.until(1, 0);
    assert!(news.contains("fixture.growing 2.0.0 is generation 2: growing carried on"), "{news}");
    let steps = place.world.clock().step as f64;
    // No step is lost or made twice; those that the newer build made up for are its own, twice as large.
    let extra = (place.height() - 1.0) / (3.0 * SLOW) - steps;
    assert!((extra - extra.round()).abs() < 1e-3 && (0.0..40.0).contains(&extra.round()), "{extra}");
    assert_eq!(place.world.param(0, 1), Some(3.0));
    assert_grows(&mut place, 3.0 * FAST);
    assert_eq!(place.live.standing(&place.world, 0).generation, 2);
}

#[test]
fn a_file_that_is_overwritten_in_place_linked_or_written_in_pieces_is_taken_whole() {
    let mut place = Place::new(&builds(""), SCENE);
    let (slow, fast) = (builds(""), builds("v2"));
    let path = place.library();
    // In place, over the file that was loaded.
    fs::write(&path, &fast).unwrap();
    place.until(1, 0);
    assert_grows(&mut place, FAST);
    // Linked, as cargo does.
    let kept = place.folder.path().join("linked");
    fs::write(&kept, another(slow.clone())).unwrap();
    fs::remove_file(&path).unwrap();
    fs::hard_link(&kept, &path).unwrap();
    place.until(2, 0);
    assert_grows(&mut place, SLOW);
    // In pieces, over a second: longer than any patience.
    let (writer, bytes) = (path.clone(), another(fast));
    let slowly = std::thread::spawn(move || write_slowly(&writer, &bytes, 12, Duration::from_millis(90)));
    place.until(3, 0);
    slowly.join().unwrap();
    assert_grows(&mut place, FAST);
    // The whole length at once, and the bytes later, through a mapping's like: the length alone tells
    // nothing.
    let (writer, bytes) = (path, another(slow));
    let slowly = std::thread::spawn(move || write_backwards(&writer, &bytes));
    place.until(4, 0);
    slowly.join().unwrap();
    assert_grows(&mut place, SLOW);
    let standing = place.live.standing(&place.world, 0);
    assert_eq!((standing.generation, standing.trouble), (5, None));
}

/// Makes the file as long as it will be, writes its head, and the rest much later.
fn write_backwards(path: &Path, bytes: &[u8]) {
    use std::io::{Seek, SeekFrom, Write};
    let mut file = fs::OpenOptions::new().write(true).create(true).truncate(true).open(path).unwrap();
    file.set_len(bytes.len() as u64).unwrap();
    let (head, tail) = (&bytes[..4096], bytes.len() - 65536);
    file.write_all(head).unwrap();
    file.seek(SeekFrom::Start(tail as u64)).unwrap();
    file.write_all(&bytes[tail..]).unwrap();
    std::thread::sleep(Duration::from_millis(900));
    file.seek(SeekFrom::Start(4096)).unwrap();
    file.write_all(&bytes[4096..tail]).unwrap();
}

#[test]
fn a_file_that_stays_a_part_is_refused_once_and_the_next_whole_one_is_taken() {
    let mut place = Place::new(&builds(""), SCENE);
    let fast = builds("v2");
    fs::write(place.library(), &fast[..fast.len() / 2]).unwrap();
    let news = place.until(0, 1);
    assert!(news.contains("is refused") && news.contains("runs on"), "{news}");
    assert_grows(&mut place, SLOW);
    assert!(place.live.standing(&place.world, 0).trouble.is_some());
    place.rename_into_place(&fast);
    place.until(1, 1);
    assert_grows(&mut place, FAST);
}

#[test]
fn of_many_builds_in_a_row_the_last_is_never_missed() {
    let mut place = Place::new(&builds(""), SCENE);
    let (slow, fast) = (builds(""), builds("v2"));
    for round in 0..6 {
        // Several within one tick of the file system's clock, of the same length.
        for _ in 0..5 {
            place.rename_into_place(&another(slow.clone()));
            fs::write(place.library(), another(fast.clone())).unwrap();
        }
        let last = if round % 2 == 0 { SLOW } else { FAST };
        let bytes = if round % 2 == 0 { &slow } else { &fast };
        place.rename_into_place(&another(bytes.clone()));
        let end = std::time::Instant::now() + Duration::from_millis(700);
        place.run(|_, _| std::time::Instant::now() > end);
        assert_grows(&mut place, last);
    }
    assert_eq!(place.live.counts().refusals, 0);
}

#[test]
fn a_build_that_cannot_read_the_state_changes_nothing_and_both_versions_are_named() {
    let mut place = Place::new(&builds(""), SCENE);
    place.rename_into_place(&builds("v2,other-state"));
    let news = place.until(0, 1);
    for part in
        ["growing: the state cannot be carried", "state version 3", "2.0.0", "reads 7 to 9", "runs on"]
    {
        assert!(news.contains(part), "{part}: {news}");
    }
    assert_grows(&mut place, SLOW);
    assert_eq!(place.live.standing(&place.world, 0).generation, 1);
}

#[test]
fn a_build_whose_trial_step_fails_changes_nothing() {
    let mut place = Place::new(&builds(""), SCENE);
    place.rename_into_place(&builds("bad-outputs"));
    let news = place.until(0, 1);
    assert!(news.contains("position is NaN") && news.contains("runs on"), "{news}");
    assert_grows(&mut place, SLOW);
}
