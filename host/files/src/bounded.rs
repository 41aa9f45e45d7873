//! Reading files that anybody may have put there: only regular ones, and never more of them than is allowed.

use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

/// A byte order mark.
const MARK: char = '\u{feff}';

/// Opens a regular file. Anything else — a folder, a pipe, a device — is an error: who opens a pipe waits for
/// its other end, and a device may have no end.
pub fn open(path: &Path) -> io::Result<File> {
    let mut options = File::options();
    options.read(true);
    // Between a look at the path and its opening another file may have taken its place: opening must not wait
    // either way.
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK);
    if !std::fs::metadata(path)?.is_file() {
        return Err(irregular());
    }
    let file = options.open(path)?;
    if file.metadata()?.is_file() { Ok(file) } else { Err(irregular()) }
}

/// Reads a regular file of at most `most` bytes.
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    rest(&open(path)?, Vec::new(), most)
}

/// The same for what is text, [without a mark](without_mark).
pub fn read_text(path: &Path, most: u64) -> io::Result<String> {
    let bytes = read(path, most)?;
    String::from_utf8(bytes)
        .map(without_mark)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text"))
}

/// Takes away the byte order mark with which some editors begin a file.
pub fn without_mark(mut text: String) -> String {
    if text.starts_with(MARK) {
        text.drain(..MARK.len_utf8());
    }
    text
}

/// Reads the first bytes of a file, or all of a shorter one.
pub fn beginning(file: &File, length: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads on to the end of a file of at most `most` bytes, of which `bytes` were read.
pub fn rest(mut file: &File, mut bytes: Vec<u8>, most: u64) -> io::Result<Vec<u8>> {
    let too_large = |length: u64| {
        let problem = format!("it has {length} bytes; the limit is {most}");
        io::Error::new(io::ErrorKind::FileTooLarge, problem)
    };
    let length = file.metadata()?.len();
    if length > most {
        return Err(too_large(length));
    }
    bytes.try_reserve_exact((length as usize).saturating_sub(bytes.len()))?;
    // A file may grow while it is read.
    let left = (most + 1).saturating_sub(bytes.len() as u64);
    Read::by_ref(&mut file).take(left).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(too_large(bytes.len() as u64));
    }
    Ok(bytes)
}

fn irregular() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, "it is no regular file")
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn pipes_devices_and_folders_are_refused_at_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = folder.path().join("pipe");
        let name = std::ffi::CString::new(pipe.to_str().expect("UTF-8")).expect("no NUL");
        // SAFETY: the path is null-terminated.
        assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
        for path in [pipe.as_path(), Path::new("/dev/zero"), folder.path()] {
            let error = read(path, 100).expect_err("it is no file");
            assert_eq!(error.to_string(), "it is no regular file", "{}", path.display());
        }
    }

    #[test]
    fn a_file_is_read_up_to_its_limit() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        std::fs::write(&path, "1234567").expect("a file");
        assert_eq!(read(&path, 7).expect("just within"), b"1234567");
        let told = read(&path, 6).expect_err("one byte too many").to_string();
        assert_eq!(told, "it has 7 bytes; the limit is 6");
        let file = open(&path).expect("a file");
        let first = beginning(&file, 3).expect("its beginning");
        assert_eq!(first, b"123");
        assert_eq!(rest(&file, first, 7).expect("all of it"), b"1234567");
        std::fs::write(&path, "\u{feff}x").expect("a file");
        assert_eq!(read_text(&path, 7).expect("text"), "x");
        std::fs::write(&path, b"\xff").expect("a file");
        assert_eq!(read_text(&path, 7).expect_err("no text").to_string(), "it is not UTF-8 text");
    }
}
