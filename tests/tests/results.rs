//! Results of the program at their places: films that are films, links, mounts, folders that stay, and
//! nothing left behind.
#![cfg(target_os = "linux")]

use std::{
    fs,
    io::{BufRead, BufReader},
    os::unix::{
        fs::{MetadataExt, PermissionsExt, symlink},
        process::{CommandExt, ExitStatusExt},
    },
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    sync::OnceLock,
    thread,
    time::{Duration, Instant},
};

use reef_tests::{
    artifacts::{artifacts, workspace},
    child, own, skip,
};
use tempfile::TempDir;

/// Water alone, in few pixels.
const SEA: &str = "[camera]\nviewport = [16, 16]\n";
/// The boxes of an MP4 file, as a shell's `printf` writes them.
const MP4: &str =
    r#"printf '\000\000\000\014ftypisom\000\000\000\014moovabcd\000\000\000\014mdatabcd' > "$last""#;

fn program() -> PathBuf {
    static INSTALLED: OnceLock<TempDir> = OnceLock::new();
    let folder = INSTALLED.get_or_init(|| {
        let folder = artifacts().side_by_side(&own::libraries());
        // Other users run it, too.
        fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755)).unwrap();
        folder
    });
    folder.path().join("reef")
}

fn reef() -> Command {
    let mut command = Command::new(program());
    command.arg("--assets").arg(workspace().join("assets")).env_remove("REEF_LOG");
    command
}

/// A folder for all, with the scene.
fn place() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755)).unwrap();
    fs::write(folder.path().join("sea.toml"), SEA).unwrap();
    folder
}

fn render(place: &Path, out: &Path) -> Command {
    let mut command = reef();
    command.arg("render").arg(place.join("sea.toml")).args(["--size", "16x16", "--quality", "low"]);
    command.arg("--out").arg(out);
    command
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Can this machine draw?
fn draws(place: &Path) -> bool {
    let output = render(place, &place.join("try.png")).output().unwrap();
    if output.status.code() == Some(3) {
        skip(&told(&output));
        return false;
    }
    assert!(output.status.success(), "{}", told(&output));
    fs::remove_file(place.join("try.png")).unwrap();
    true
}

/// A folder with an `ffmpeg` that is this shell script; `$last` is the file to write.
fn fake(script: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ffmpeg");
    fs::write(&path, format!("#!/bin/sh\nfor last; do :; done\n{script}\n")).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    folder
}

/// Renders three frames with this `ffmpeg`, over an older film; it must end within a minute.
fn film(place: &Path, folder: &Path) -> (Option<i32>, String, Vec<u8>) {
    let out = place.join("film.mp4");
    fs::write(&out, "the older film").unwrap();
    let paths = [folder.to_owned(), "/usr/bin".into(), "/bin".into()];
    let child = render(place, &out)
        .args(["--frames", "3"])
        .env("PATH", std::env::join_paths(paths).unwrap())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let output = child::wait(child, Duration::from_secs(60), "the render");
    assert_eq!(names(place), ["film.mp4", "sea.toml"], "nothing is left beside the film");
    (output.status.code(), told(&output), fs::read(out).unwrap())
}

#[test]
fn a_film_takes_its_place_only_when_it_is_one() {
    let place = place();
    if !draws(place.path()) {
        return;
    }
    let good = format!("cat > /dev/null\n{MP4}");
    let (code, words, film_) = film(place.path(), fake(&good).path());
    assert_eq!((code, &film_[4..8]), (Some(0), &b"ftyp"[..]), "{words}");
    let cut = format!(
        "{good}\nhead -c 30 \"$last\" > \"$last.cut\"; cat \"$last.cut\" > \"$last\"; rm \"$last.cut\""
    );
    for (what, script, wanted) in [
        ("cut on a full disk", cut.as_str(), "is no film"),
        ("nothing written", "cat > /dev/null", "is no film"),
        ("an error and status 0", &format!("{good}\necho 'av_interleaved: no space' >&2"), "no space"),
        ("a status", &format!("{good}\nexit 7"), "exit status: 7"),
        ("a sudden end", "echo 'no such encoder' >&2; exit 1", "no such encoder"),
        ("300 kB of words", &format!("head -c 300000 /dev/zero | tr '\\0' x >&2\n{good}"), "ffmpeg failed"),
        ("words after each picture", "while head -c 1024 > /dev/null; do echo bad >&2; done", "bad"),
    ] {
        let (code, words, film) = film(place.path(), fake(script).path());
        assert_eq!(code, Some(3), "{what}: {words}");
        assert!(words.contains(wanted), "{what}: {words}");
        assert_eq!(film, b"the older film", "{what}");
    }
}

#[test]
fn a_file_called_ffmpeg_that_cannot_be_run_is_told_as_that() {
    let place = place();
    if !draws(place.path()) {
        return;
    }
    let folder = fake("true");
    let path = folder.path().join("ffmpeg");
    fs::write(&path, "#!/no/such/shell\n").unwrap();
    let (code, words, _) = film(place.path(), folder.path());
    assert_eq!(code, Some(3), "{words}");
    assert!(words.contains("ffmpeg cannot be run: ") && words.contains("interpreter"), "{words}");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).unwrap();
    let out = place.path().join("film.mp4");
    let output = render(place.path(), &out).env("PATH", folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(3));
    assert!(
        told(&output).contains("ffmpeg cannot be run: it is not marked as a program"),
        "{}",
        told(&output)
    );
}

#[test]
fn a_real_film_is_found_whole_even_through_a_link() {
    let place = place();
    if !draws(place.path()) {
        return;
    }
    if Command::new("ffmpeg").arg("-version").stdout(Stdio::null()).status().is_err() {
        skip("there is no ffmpeg here");
        return;
    }
    for kind in ["mp4", "webm"] {
        let [link, real] =
            [format!("link.{kind}"), format!("real.{kind}")].map(|name| place.path().join(name));
        symlink(&real, &link).unwrap();
        let output = render(place.path(), &link).args(["--frames", "3"]).output().unwrap();
        assert!(output.status.success(), "{kind}: {}", told(&output));
        assert!(link.is_symlink() && fs::metadata(&real).unwrap().len() > 200, "{kind}");
    }
    assert_eq!(names(place.path()), ["link.mp4", "link.webm", "real.mp4", "real.webm", "sea.toml"]);
}

#[test]
fn frames_fill_the_present_folder_and_one_behind_a_link() {
    let place = place();
    if !draws(place.path()) {
        return;
    }
    for name in ["present", "real"] {
        fs::create_dir(place.path().join(name)).unwrap();
    }
    symlink("real", place.path().join("link")).unwrap();
    let inode = |name: &str| fs::metadata(place.path().join(name)).unwrap().ino();
    let before = ["present", "real"].map(inode);
    let mut command = render(place.path(), Path::new("."));
    let output = command.current_dir(place.path().join("present")).output().unwrap();
    assert!(output.status.success(), "{}", told(&output));
    let output = render(place.path(), &place.path().join("link")).output().unwrap();
    assert!(output.status.success(), "{}", told(&output));
    assert_eq!(["present", "real"].map(inode), before);
    assert_eq!(["present", "real"].map(|name| names(&place.path().join(name))), [["frame-000001.png"]; 2]);

    for (out, wanted) in [("sea.toml", "is none of the kinds"), ("file", "what stands there is no folder")] {
        fs::write(place.path().join("file"), "kept").unwrap();
        let output = render(place.path(), &place.path().join(out)).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        assert!(told(&output).contains(wanted), "{}", told(&output));
    }
    let read_only = place.path().join("old.png");
    fs::write(&read_only, "kept").unwrap();
    fs::set_permissions(&read_only, fs::Permissions::from_mode(0o444)).unwrap();
    // The scene is not there, either: the place is tried first.
    let output = reef().args(["render", "no-such-scene", "--out"]).arg(&read_only).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(told(&output).contains("old.png cannot be written"), "{}", told(&output));
}

#[test]
fn a_mount_gets_the_result_whether_file_or_folder() {
    let place = place();
    let script = "mount -t tmpfs none mount && touch file source && mount --bind source file && \
                  \"$0\" sim sea.toml --steps 2 --record file --assets \"$1\" && \
                  \"$0\" render sea.toml --size 16x16 --out mount --assets \"$1\"; \
                  code=$?; head -c 9 source; ls mount; exit $code";
    fs::create_dir(place.path().join("mount")).unwrap();
    let mounts = "mount -t tmpfs none mount";
    let unshared = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["-m", "sh", "-c", script]).arg(program()).arg(workspace().join("assets"));
        command.current_dir(place.path()).output()
    };
    if !unshared(mounts).is_ok_and(|output| output.status.success()) {
        println!("skipped: mounts are not allowed here");
        return;
    }
    let output = unshared(script).unwrap();
    if output.status.code() == Some(3) {
        return skip(&told(&output));
    }
    assert!(output.status.success(), "{}", told(&output));
    assert!(told(&output).contains("step,time"), "{}", told(&output));
    assert!(told(&output).contains("frame-000001.png"), "{}", told(&output));
    assert_eq!(names(place.path()), ["file", "mount", "sea.toml", "source"], "nothing is left beside");
}

#[test]
fn anothers_file_in_a_sticky_folder_is_written_in_place() {
    // SAFETY: asks for this process's user.
    if unsafe { libc::geteuid() } != 0 {
        println!("skipped: only root can be somebody else");
        return;
    }
    let place = place();
    let shared = place.path().join("shared");
    fs::create_dir(&shared).unwrap();
    fs::set_permissions(&shared, fs::Permissions::from_mode(0o1777)).unwrap();
    let file = shared.join("out.csv");
    fs::write(&file, "old").unwrap();
    fs::set_permissions(&file, fs::Permissions::from_mode(0o666)).unwrap();
    let inode = fs::metadata(&file).unwrap().ino();
    let mut command = reef();
    command.uid(65534).gid(65534).arg("sim").arg(place.path().join("sea.toml"));
    let Ok(output) = command.args(["--steps", "2", "--record"]).arg(&file).output() else {
        println!("skipped: nobody else reaches the program here");
        return;
    };
    assert!(output.status.success(), "{}", told(&output));
    assert!(fs::read_to_string(&file).unwrap().starts_with("step,time"));
    assert_eq!((fs::metadata(&file).unwrap().ino(), names(&shared)), (inode, vec!["out.csv".to_owned()]));
}

#[test]
fn hashes_that_nobody_reads_any_more_end_quietly() {
    let place = place();
    let mut command = reef();
    command.arg("sim").arg(place.path().join("sea.toml")).args(["--steps", "4000000000", "--hash"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(lines.next().unwrap().unwrap().starts_with("step 1 "));
    drop(lines);
    let output = child::wait(child, Duration::from_secs(30), "a run without a reader");
    assert!(output.status.success() && output.stderr.is_empty(), "{}", told(&output));
}

#[test]
fn a_signal_leaves_nothing_half_done_behind() {
    let place = place();
    let path = |name: &str| place.path().join(name);
    fs::write(path("old.csv"), "old").unwrap();
    for signal in [libc::SIGINT, libc::SIGTERM, libc::SIGHUP] {
        let mut command = reef();
        command.arg("sim").arg(path("sea.toml")).args(["--steps", "4000000000", "--record"]);
        command.arg(path("old.csv")).arg("--save-state").arg(path("state"));
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let end = Instant::now() + Duration::from_secs(30);
        while names(place.path()).iter().filter(|name| name.ends_with(".part")).count() < 2 {
            assert!(Instant::now() < end, "the outputs are begun");
            thread::sleep(Duration::from_millis(5));
        }
        // SAFETY: the child was not waited for.
        unsafe { libc::kill(child.id() as i32, signal) };
        assert_eq!(child.wait().unwrap().signal(), Some(signal));
        assert_eq!(names(place.path()), ["old.csv", "sea.toml"]);
        assert_eq!(fs::read(path("old.csv")).unwrap(), b"old");
    }
}

#[test]
fn a_signal_keeps_the_frames_that_are_whole_and_no_half_film() {
    let place = place();
    let out = place.path().join("pictures");
    fs::write(place.path().join("old.mp4"), "old").unwrap();
    for (to, kept) in [(out.clone(), true), (place.path().join("old.mp4"), false)] {
        let mut command = render(place.path(), &to);
        command.args(["--frames", "1000000"]);
        let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let end = Instant::now() + Duration::from_secs(60);
        let first = |entry: fs::DirEntry| {
            let path = entry.path();
            path.to_string_lossy().ends_with(".part") && (!kept || path.join("frame-000002.png").exists())
        };
        while !fs::read_dir(place.path()).unwrap().flatten().any(first) {
            assert!(Instant::now() < end, "the first frames are drawn");
            thread::sleep(Duration::from_millis(5));
        }
        // SAFETY: the child was not waited for.
        unsafe { libc::kill(child.id() as i32, libc::SIGTERM) };
        let output = child::wait(child, Duration::from_secs(30), "a rendering that a signal ends");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.signal(), Some(libc::SIGTERM), "{said}");
        assert!(said.contains(if kept { "of 1000000 frames" } else { "is not written" }), "{said}");
    }
    let frames = names(&out);
    assert!(frames.len() >= 2 && frames.len() < 1_000_000, "{frames:?}");
    for frame in &frames {
        assert!(reef_render::pictures::read_png(&out.join(frame)).is_ok(), "{frame} is whole");
    }
    assert_eq!(names(place.path()), ["old.mp4", "pictures", "sea.toml"]);
    assert_eq!(fs::read(place.path().join("old.mp4")).unwrap(), b"old");
}

#[test]
fn a_signal_leaves_no_part_of_a_film_that_its_encoder_begins_late() {
    let place = place();
    // A part of it outlives the shell that was started. Nobody reads its complaints by then.
    let folder = fake(
        "exec 3<&0\ntouch \"$0.begun\"\n\
         { cat <&3 > /dev/null; { echo late > \"$last\"; } 2> /dev/null; touch \"$0.ended\"; } &\nwait",
    );
    let paths = [folder.path().to_owned(), "/usr/bin".into(), "/bin".into()];
    let mut child = render(place.path(), &place.path().join("film.mp4"))
        .args(["--frames", "1000000"])
        .env("PATH", std::env::join_paths(paths).unwrap())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let until = |what: &str, so: &dyn Fn() -> bool| {
        let end = Instant::now() + Duration::from_secs(30);
        while !so() {
            assert!(Instant::now() < end, "{what}");
            thread::sleep(Duration::from_millis(5));
        }
    };
    until("the film is begun", &|| {
        names(place.path()).len() > 1 && folder.path().join("ffmpeg.begun").exists()
    });
    // SAFETY: the child was not waited for.
    unsafe { libc::kill(child.id() as i32, libc::SIGTERM) };
    child.wait().unwrap();
    // The encoder sees the end of its pictures only now, and makes its file.
    until("the encoder ends", &|| folder.path().join("ffmpeg.ended").exists());
    assert_eq!(names(place.path()), ["sea.toml"]);
}
