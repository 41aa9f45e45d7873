use super::*;

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_file_appears_whole_when_it_is_finished_and_never_before() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.csv");
    fs::write(&path, "old").unwrap();
    let mut file = Writing::create(&path).unwrap();
    file.write_all(&[b'x'; 100_000]).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"old");
    file.finish().unwrap();
    assert_eq!(fs::read(&path).unwrap().len(), 100_000);
    assert_eq!(names(folder.path()), ["out.csv"]);
}

#[test]
fn a_file_that_is_given_up_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = Writing::create(&folder.path().join("out.csv")).unwrap();
    file.write_all(b"half").unwrap();
    drop(file);
    assert!(names(folder.path()).is_empty());
}

#[test]
fn a_place_that_cannot_be_written_is_refused_at_once_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("no/such/out.csv");
    let error = Writing::create(&missing).unwrap_err().to_string();
    assert!(error.contains("out.csv cannot be written: there is no folder"), "{error}");
    let error = Writing::create(folder.path()).unwrap_err().to_string();
    assert!(error.ends_with("cannot be written: a folder stands there"), "{error}");
    assert!(write(Path::new("/"), b"").is_err());
}

#[cfg(unix)]
#[test]
fn files_can_be_read_by_those_whom_the_umask_allows() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("mine"), b"1").unwrap();
    fs::write(folder.path().join("std"), b"1").unwrap();
    let mode = |name| fs::metadata(folder.path().join(name)).unwrap().permissions().mode();
    assert_eq!(mode("mine"), mode("std"));
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};

    use super::*;

    fn busy(_: &Path, _: &Path) -> io::Result<()> {
        Err(io::Error::from_raw_os_error(16))
    }

    #[test]
    fn a_link_stays_and_what_it_leads_to_is_written() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        fs::create_dir(at("data")).unwrap();
        fs::write(at("data/real.csv"), "old").unwrap();
        symlink("data/real.csv", at("inner")).unwrap();
        symlink("inner", at("outer")).unwrap();
        symlink("data/new.csv", at("dangling")).unwrap();
        write(&at("outer"), b"new").unwrap();
        write(&at("dangling"), b"first").unwrap();
        assert_eq!(fs::read(at("data/real.csv")).unwrap(), b"new");
        assert_eq!(fs::read(at("data/new.csv")).unwrap(), b"first");
        assert!(["inner", "outer", "dangling"].iter().all(|name| at(name).is_symlink()));
        assert_eq!(names(&at("data")), ["new.csv", "real.csv"], "no temporary file stays");
        symlink("ring", at("ring")).unwrap();
        assert!(write(&at("ring"), b"").is_err());
        symlink("no/such/file", at("nowhere")).unwrap();
        let error = write(&at("nowhere"), b"").unwrap_err().to_string();
        assert!(error.contains("there is no folder") && error.contains("no/such"), "{error}");
    }

    #[test]
    fn a_file_that_cannot_be_replaced_is_written_in_place() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("out.csv");
        fs::write(&path, "an older and longer text").unwrap();
        let inode = fs::metadata(&path).unwrap().ino();
        let mut file = Writing::create(&path).unwrap();
        file.write_all(b"new").unwrap();
        file.finish_by(busy).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::metadata(&path).unwrap().ino(), inode);
        assert_eq!(names(place.path()), ["out.csv"]);
    }

    #[test]
    fn a_result_without_a_place_is_kept_and_its_name_told() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("out.csv");
        let mut file = Writing::create(&path).unwrap();
        file.write_all(b"all of it").unwrap();
        fs::create_dir(&path).unwrap();
        let error = file.finish().unwrap_err().to_string();
        let kept = error.split("the whole result is kept as ").nth(1).expect(&error);
        assert_eq!(fs::read(kept).unwrap(), b"all of it");
    }

    #[test]
    fn a_file_keeps_the_rights_of_the_one_it_replaces() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("secret");
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        write(&path, b"new").unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o7777, 0o600);
    }

    #[test]
    fn a_name_that_no_file_can_have_is_refused_at_once() {
        let place = tempfile::tempdir().unwrap();
        assert!(Writing::create(&place.path().join("n".repeat(300))).is_err());
        assert!(Folder::create(&place.path().join("n".repeat(300))).is_err());
    }

    #[test]
    fn a_device_is_never_replaced() {
        for file in
            [Writing::create(Path::new("/dev/null")), Writing::create_seekable(Path::new("/dev/null"))]
        {
            let mut file = file.unwrap();
            file.write_all(b"gone").unwrap();
            file.finish().unwrap();
        }
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }

    #[test]
    fn an_empty_folder_stays_the_folder_that_it_is_and_gets_the_files() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        fs::create_dir(at("real")).unwrap();
        symlink("real", at("link")).unwrap();
        let inode = fs::metadata(at("real")).unwrap().ino();
        let folder = Folder::create(&at("link")).unwrap();
        fs::write(folder.part().join("a"), "1").unwrap();
        folder.finish().unwrap();
        assert_eq!(names(&at("real")), ["a"]);
        assert_eq!(fs::metadata(at("real")).unwrap().ino(), inode);
        assert!(at("link").is_symlink());
    }
}

#[test]
fn a_folder_that_something_else_came_into_is_kept_beside() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("all");
    for is_there in [false, true] {
        if is_there {
            fs::remove_dir_all(&path).unwrap();
            fs::create_dir(&path).unwrap();
        }
        let folder = Folder::create(&path).unwrap();
        fs::write(folder.part().join("a"), "1").unwrap();
        fs::create_dir_all(&path).unwrap();
        fs::write(path.join("foreign"), "kept").unwrap();
        let error = folder.finish().unwrap_err().to_string();
        let kept = error.split("the result is kept in ").nth(1).expect(&error);
        assert_eq!(fs::read(Path::new(kept).join("a")).unwrap(), b"1");
        assert_eq!(fs::read(path.join("foreign")).unwrap(), b"kept");
    }
}

#[test]
fn a_file_or_a_full_folder_is_no_place_for_a_folder() {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join("file"), "").unwrap();
    let error = Folder::create(&place.path().join("file")).unwrap_err().to_string();
    assert!(error.ends_with("what stands there is no folder"), "{error}");
    let error = Folder::create(place.path()).unwrap_err().to_string();
    assert!(error.ends_with("the folder is not empty"), "{error}");
    assert_eq!(names(place.path()), ["file"]);
}
