//! A library's file without its debug information. That is most of a build, read by debuggers alone, and time
//! in which somebody waits for the new code.

use std::{
    borrow::Cow,
    fs::File,
    io::{self, Read, Seek, SeekFrom},
    ops::Range,
};

use object::{
    NativeEndian, ReadCache, ReadRef, elf,
    read::elf::{FileHeader, ProgramHeader, SectionHeader},
};

/// What is in a file, with holes where its debug information is. Two are equal when a program that loads them
/// cannot tell them apart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image<'a> {
    length: u64,
    /// Where each part begins, and its bytes, in order.
    parts: Vec<(u64, Cow<'a, [u8]>)>,
}

impl<'a> Image<'a> {
    /// All bytes of a file.
    pub fn whole(bytes: &'a [u8]) -> Self {
        Self { length: bytes.len() as u64, parts: vec![(0, Cow::Borrowed(bytes))] }
    }

    /// Bytes of the file.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Where each part begins, and its bytes.
    pub fn parts(&self) -> impl Iterator<Item = (u64, &[u8])> {
        self.parts.iter().map(|(start, bytes)| (*start, &**bytes))
    }

    /// The last part that does not begin behind a place of the file.
    fn part_of(&self, offset: u64) -> Option<(u64, &[u8])> {
        let after = self.parts.partition_point(|(start, _)| *start <= offset);
        let (start, bytes) = self.parts.get(after.checked_sub(1)?)?;
        Some((*start, bytes))
    }
}

impl Image<'static> {
    /// Reads a file of this length: all of it where it is no library of this machine's kind, or a debugger
    /// looks on. `Err` of the kind `UnexpectedEof`: it is shorter meanwhile.
    pub fn read(mut file: &File, length: u64) -> io::Result<Self> {
        let mut holes = if is_traced() { Vec::new() } else { debug_information(file).unwrap_or_default() };
        holes.retain(|hole| hole.end <= length);
        holes.push(length..length);
        let mut parts = Vec::new();
        let mut start = 0;
        for hole in holes {
            if start < hole.start {
                let size = hole.start - start;
                let mut bytes = Vec::with_capacity(size as usize);
                file.seek(SeekFrom::Start(start))?;
                if file.take(size).read_to_end(&mut bytes)? as u64 != size {
                    return Err(io::ErrorKind::UnexpectedEof.into());
                }
                parts.push((start, Cow::Owned(bytes)));
            }
            start = start.max(hole.end);
        }
        Ok(Self { length, parts })
    }
}

/// Where the sections are that no part of a program is made of, in order; None: it is no ELF library.
fn debug_information(file: &File) -> Option<Vec<Range<u64>>> {
    let data = &ReadCache::new(file);
    let header = elf::FileHeader64::<NativeEndian>::parse(data).ok()?;
    let endian = header.endian().ok()?;
    let segments = header.program_headers(endian, data).ok()?;
    let range = |(start, size): (u64, u64)| start..start.saturating_add(size);
    let mut taken: Vec<Range<u64>> = segments.iter().map(|s| range(s.file_range(endian))).collect();
    let headers = (u64::from(header.e_shnum(endian)), u64::from(header.e_shentsize(endian)));
    taken.push(range((header.e_shoff(endian), headers.0 * headers.1)));
    let sections = header.section_headers(endian, data).ok()?;
    let unused = sections.iter().filter(|section| {
        section.sh_type(endian) == elf::SHT_PROGBITS && !section.sh_flags(endian).contains(elf::SHF_ALLOC)
    });
    let mut holes: Vec<Range<u64>> =
        unused.filter_map(|section| section.file_range(endian)).map(range).collect();
    // Nothing keeps a file from saying that two things are in one place.
    holes.retain(|hole| !taken.iter().any(|taken| taken.start < hole.end && hole.start < taken.end));
    holes.sort_by_key(|hole| hole.start);
    Some(holes)
}

/// Does a debugger look on? It wants to see the source.
#[cfg(target_os = "linux")]
fn is_traced() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status.lines().any(|line| line.strip_prefix("TracerPid:").is_some_and(|tracer| tracer.trim() != "0"))
}

/// Other systems' libraries are read whole.
#[cfg(not(target_os = "linux"))]
fn is_traced() -> bool {
    false
}

impl<'a> ReadRef<'a> for &'a Image<'_> {
    fn len(self) -> Result<u64, ()> {
        Ok(self.length)
    }

    fn read_bytes_at(self, offset: u64, size: u64) -> Result<&'a [u8], ()> {
        let (start, bytes) = self.part_of(offset).ok_or(())?;
        let from = usize::try_from(offset - start).map_err(drop)?;
        let to = from.checked_add(usize::try_from(size).map_err(drop)?).ok_or(())?;
        bytes.get(from..to).ok_or(())
    }

    fn read_bytes_at_until(self, range: Range<u64>, delimiter: u8) -> Result<&'a [u8], ()> {
        let (start, bytes) = self.part_of(range.start).ok_or(())?;
        let from = usize::try_from(range.start - start).map_err(drop)?;
        let to = usize::try_from(range.end - start).map_or(bytes.len(), |to| to.min(bytes.len()));
        let bytes = bytes.get(from..to).ok_or(())?;
        bytes.get(..bytes.iter().position(|byte| *byte == delimiter).ok_or(())?).ok_or(())
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::inspect::inspect;

    fn read(bytes: &[u8]) -> Image<'static> {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(bytes).unwrap();
        Image::read(&file, bytes.len() as u64).unwrap()
    }

    #[test]
    fn of_a_program_everything_is_read_but_what_debuggers_read() {
        let bytes = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        let image = read(&bytes);
        let read: usize = image.parts().map(|(_, bytes)| bytes.len()).sum();
        assert!(read < bytes.len(), "{read} of {} bytes", bytes.len());
        assert!(image.parts().all(|(start, part)| bytes[start as usize..].starts_with(part)));
        assert_eq!(image.length(), bytes.len() as u64);
        // What is looked at in the file is the same with and without the holes.
        assert_eq!(inspect(&image), inspect(&Image::whole(&bytes)));
        let file = object::File::parse(&*bytes).unwrap();
        use object::{Object, ObjectSection};
        let loaded = |section: &object::Section<'_, '_>| section.address() != 0;
        for section in file.sections().filter(loaded) {
            let Some((start, size)) = section.file_range() else { continue };
            assert_eq!((&image).read_bytes_at(start, size), section.data().map_err(drop), "{section:?}");
        }
        let debug = file.section_by_name(".debug_info").and_then(|section| section.file_range()).unwrap();
        assert_eq!((&image).read_bytes_at(debug.0, debug.1), Err(()));
    }

    #[test]
    fn what_is_loaded_and_how_long_the_file_is_tell_two_builds_apart_and_debug_information_does_not() {
        let bytes = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        let file = object::File::parse(&*bytes).unwrap();
        use object::{Object, ObjectSection};
        let at = |name: &str| file.section_by_name(name).and_then(|s| s.file_range()).unwrap().0 as usize;
        let changed = |at: usize| {
            let mut bytes = bytes.clone();
            bytes[at + 8] ^= 1;
            read(&bytes)
        };
        assert_eq!(changed(at(".debug_info")), read(&bytes));
        for part in [".text", ".rodata", ".data"] {
            assert_ne!(changed(at(part)), read(&bytes), "{part}");
        }
        assert_ne!(read(&[&*bytes, &[0]].concat()), read(&bytes));
    }

    #[test]
    fn a_file_that_is_no_library_or_a_part_of_one_is_read_whole() {
        let program = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        for bytes in [&b""[..], b"\x7fELF", b"[scene]\n", &program[..100], &program[..program.len() / 2]] {
            let image = read(bytes);
            let read: Vec<u8> = image.parts().flat_map(|(_, bytes)| bytes).copied().collect();
            assert!(read == bytes, "{} bytes", bytes.len());
        }
        let file = tempfile::tempfile().unwrap();
        assert_eq!(Image::read(&file, 5).unwrap_err().kind(), io::ErrorKind::UnexpectedEof);
    }
}
