//! Is a finished film one? The outer boxes of its file tell: the program that wrote it may end well on a full
//! disk.

use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom},
    path::Path,
};

/// What films are kept in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// ISO base media file format (ISO/IEC 14496-12).
    Mp4,
    /// A subset of Matroska (RFC 9559) in EBML (RFC 8794).
    Webm,
}

impl Container {
    /// What ffmpeg calls it; the ending of its files, too.
    pub fn name(self) -> &'static str {
        match self {
            Container::Mp4 => "mp4",
            Container::Webm => "webm",
        }
    }
}

/// Looks at a film. `Err`: what is missing.
pub fn look(path: &Path, container: Container) -> Result<(), String> {
    let mut file = File::open(path).map_err(|error| error.to_string())?;
    let length = file.metadata().map_err(|error| error.to_string())?.len();
    let looked = match container {
        Container::Mp4 => mp4(&mut file, length),
        Container::Webm => webm(&mut file, length),
    };
    looked.unwrap_or_else(|error| {
        Err(match error.kind() {
            io::ErrorKind::UnexpectedEof => format!("it ends too early, after {length} bytes"),
            _ => error.to_string(),
        })
    })
}

/// Boxes one behind the other up to the file's end: `ftyp` first, `moov` (what is where) and `mdat`
/// (pictures).
fn mp4(file: &mut (impl Read + Seek), length: u64) -> io::Result<Result<(), String>> {
    let (mut at, mut has_index, mut has_pictures) = (0, false, false);
    while at < length {
        file.seek(SeekFrom::Start(at))?;
        let head: [u8; 8] = array(file)?;
        let [a, b, c, d, kind @ ..] = head;
        let (header, size) = match u32::from_be_bytes([a, b, c, d]) {
            0 => (8, length - at),
            1 => (16, u64::from_be_bytes(array(file)?)),
            size => (8, size.into()),
        };
        if at == 0 && kind != *b"ftyp" {
            return Ok(Err("it does not begin as an MP4 file does".to_owned()));
        }
        let beyond = at.checked_add(size).is_none_or(|end| end > length);
        if size < header || beyond {
            return Ok(Err(format!("its box at byte {at} does not end inside of it")));
        }
        has_index |= kind == *b"moov" && size > header;
        has_pictures |= kind == *b"mdat" && size > header;
        at += size;
    }
    Ok(match (has_index, has_pictures) {
        (true, true) => Ok(()),
        (false, _) => Err("it has no index of its pictures (`moov`)".to_owned()),
        (true, false) => Err("it has no pictures (`mdat`)".to_owned()),
    })
}

const EBML: u32 = 0x1A45_DFA3;
const SEGMENT: u32 = 0x1853_8067;
const TRACKS: u32 = 0x1654_AE6B;
const CLUSTER: u32 = 0x1F43_B675;

/// An EBML header, then one Segment of a known size up to the file's end, with Tracks and a Cluster
/// (pictures).
fn webm(file: &mut (impl Read + Seek), length: u64) -> io::Result<Result<(), String>> {
    let (id, size) = element(file)?;
    let Some(size) = size.filter(|_| id == EBML) else {
        return Ok(Err("it does not begin as a WebM file does".to_owned()));
    };
    file.seek_relative(i64::try_from(size).map_err(io::Error::other)?)?;
    let (id, size) = element(file)?;
    let mut at = file.stream_position()?;
    if id != SEGMENT || size.is_none_or(|size| at.checked_add(size) != Some(length)) {
        return Ok(Err("its segment does not end where the file does: it was not finished".to_owned()));
    }
    let (mut has_tracks, mut has_pictures) = (false, false);
    while at < length {
        file.seek(SeekFrom::Start(at))?;
        let (id, size) = element(file)?;
        let end = size.and_then(|size| file.stream_position().ok()?.checked_add(size));
        let Some(end) = end.filter(|end| *end <= length) else {
            return Ok(Err(format!("its element at byte {at} does not end inside of it")));
        };
        has_tracks |= id == TRACKS;
        has_pictures |= id == CLUSTER && size > Some(0);
        at = end;
    }
    Ok(if has_tracks && has_pictures { Ok(()) } else { Err("it has no pictures".to_owned()) })
}

/// An element's id and size; None: its size is not known.
fn element(file: &mut impl Read) -> io::Result<(u32, Option<u64>)> {
    let (id, bytes) = number(file)?;
    let id = if bytes <= 4 { id as u32 } else { 0 };
    let (size, bytes) = number(file)?;
    let size = size & !(1 << (7 * bytes));
    let unknown = (1 << (7 * bytes)) - 1;
    Ok((id, (size != unknown).then_some(size)))
}

/// A number whose leading zeros tell its length [bytes], with the bit that ends them.
fn number(file: &mut impl Read) -> io::Result<(u64, u32)> {
    let [first] = array(file)?;
    let more = u8::leading_zeros(first);
    if more == 8 {
        return Err(io::Error::other("a number of its structure is none"));
    }
    let mut value = u64::from(first);
    for _ in 0..more {
        let [next] = array(file)?;
        value = value << 8 | u64::from(next);
    }
    Ok((value, more + 1))
}

fn array<const N: usize>(file: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The smallest files that have everything.
    fn whole(container: Container) -> Vec<u8> {
        match container {
            Container::Mp4 => {
                let boxes =
                    [(b"ftyp", 8), (b"moov", 20), (b"mdat", 5)].map(|(kind, size): (&[u8; 4], u32)| {
                        [&(size + 8).to_be_bytes()[..], kind, &vec![7; size as usize]].concat()
                    });
                boxes.concat()
            }
            Container::Webm => {
                let tracks = [&TRACKS.to_be_bytes()[..], &[0x83, 1, 2, 3]].concat();
                let cluster = [&CLUSTER.to_be_bytes()[..], &[0x40, 0x02, 1, 2]].concat();
                let inside = [tracks, cluster].concat();
                let header = [&EBML.to_be_bytes()[..], &[0x82, 0, 0]].concat();
                let size = [&[1][..], &(inside.len() as u64).to_be_bytes()[1..]].concat();
                [header, SEGMENT.to_be_bytes().to_vec(), size, inside].concat()
            }
        }
    }

    fn looked(bytes: &[u8], container: Container) -> Result<(), String> {
        let file = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(file.path(), bytes).expect("written");
        look(file.path(), container)
    }

    #[test]
    fn a_whole_film_passes_and_one_that_was_cut_anywhere_does_not() {
        for container in [Container::Mp4, Container::Webm] {
            let whole = whole(container);
            assert_eq!(looked(&whole, container), Ok(()), "{container:?}");
            for length in 0..whole.len() {
                assert!(looked(&whole[..length], container).is_err(), "{container:?}: {length} bytes");
            }
        }
        assert!(looked(&whole(Container::Webm), Container::Mp4).is_err());
        assert!(looked(&whole(Container::Mp4), Container::Webm).is_err());
    }

    #[test]
    fn a_film_without_its_index_or_its_pictures_is_none() {
        let whole = whole(Container::Mp4);
        for (missing, told) in [(b"moov", "no index"), (b"mdat", "no pictures")] {
            let at = whole.windows(4).position(|four| four == missing).expect("it is there");
            let mut without = whole.clone();
            without[at..at + 4].copy_from_slice(b"free");
            let error = looked(&without, Container::Mp4).expect_err("something is missing");
            assert!(error.contains(told), "{error}");
        }
        let mut unfinished = self::whole(Container::Webm);
        let at = unfinished.windows(4).position(|four| four == SEGMENT.to_be_bytes()).expect("a segment");
        unfinished[at + 4..at + 12].copy_from_slice(&[1, 255, 255, 255, 255, 255, 255, 255]);
        let error = looked(&unfinished, Container::Webm).expect_err("its size is not known");
        assert!(error.contains("not finished"), "{error}");
    }

    proptest::proptest! {
        #[test]
        fn any_bytes_get_an_answer(bytes in proptest::collection::vec(proptest::num::u8::ANY, 0..64)) {
            for container in [Container::Mp4, Container::Webm] {
                proptest::prop_assert!(looked(&bytes, container).is_err());
                let _ = looked(&[whole(container), bytes.clone()].concat(), container);
            }
        }
    }
}
