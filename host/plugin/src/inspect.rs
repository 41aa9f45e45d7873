//! Reads a library's file without running any of it: is it a library of this machine, is it a plugin, does it
//! speak this host's contract?

use std::{fs, path::Path};

use object::{ExportTarget, Object, ObjectSection, ObjectSegment};
use reef_abi as abi;
use reef_files::bounded;

use super::{error::Refusal, image::Image, life::Life, names::version_text};

/// Largest file that is looked at [bytes].
const LARGEST: u64 = 1 << 30;

/// The head of a library's `reef_entry`, as it stands in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    /// Bytes of the library's `reef_entry`.
    pub size: u32,
    /// `REEF_VERSION` of the header that it was built with.
    pub version: u32,
    /// `REEF_HEADER_HASH` of that header.
    pub header_hash: u64,
}

/// The contract that a host speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contract {
    /// `REEF_VERSION`.
    pub version: u32,
    /// `REEF_HEADER_HASH`.
    pub header_hash: u64,
}

/// This host's.
pub const CONTRACT: Contract = Contract { version: abi::VERSION, header_hash: abi::HEADER_HASH };

/// Reads a file that might be a plugin.
pub fn read(path: &Path) -> Result<Image<'static>, Refusal> {
    let unreadable = |error: std::io::Error| Refusal::Unreadable(error.to_string());
    let metadata = fs::metadata(path).map_err(unreadable)?;
    if metadata.is_dir() {
        return Err(Refusal::Folder);
    }
    if metadata.len() > LARGEST {
        return Err(Refusal::TooLarge { size: metadata.len(), limit: LARGEST });
    }
    Image::read(&bounded::open(path).map_err(unreadable)?, metadata.len()).map_err(unreadable)
}

/// A library's file, taken apart.
pub type Parsed<'a> = object::File<'a, &'a Image<'a>>;

/// Looks for the entry in a library.
pub fn inspect(image: &Image<'_>) -> Result<Head, Refusal> {
    if image.length() == 0 {
        return Err(Refusal::Empty);
    }
    let file = parse(image)?;
    let found = machine(&file);
    let own = own_machine();
    if found != own {
        return Err(Refusal::OtherMachine { found, expected: own });
    }
    if file.kind() != object::ObjectKind::Dynamic {
        return Err(Refusal::NoLibrary("it is a program or an object file".into()));
    }
    whole(&file, image.length())?;
    let entry = find_entry(&file)?;
    let head = entry_bytes(&file, entry, HEAD)?;
    let number = |at: usize| u64::from_ne_bytes(std::array::from_fn(|i| head[at + i]));
    if number(0) != abi::MAGIC {
        return Err(Refusal::BadEntry("it does not begin with REEF_MAGIC".into()));
    }
    let sizes = number(8).to_ne_bytes();
    let half = |at: usize| u32::from_ne_bytes(std::array::from_fn(|i| sizes[at + i]));
    Ok(Head { size: half(0), version: half(4), header_hash: number(16) })
}

/// Takes a library's file apart.
pub fn parse<'a>(image: &'a Image<'a>) -> Result<Parsed<'a>, Refusal> {
    object::File::parse(image).map_err(|error| Refusal::NoLibrary(error.to_string()))
}

/// Places in a copy of a library from which the system's loader does not learn of its constructors and
/// destructors any more.
pub fn passed_over(image: &Image<'_>) -> Vec<u64> {
    Life::of(image).tags().to_vec()
}

/// A word of 32 bits of the entry, at this offset in it.
pub fn entry_word(image: &Image<'_>, offset: usize) -> Result<u32, Refusal> {
    let file = parse(image)?;
    let entry = entry_bytes(&file, find_entry(&file)?, offset + 4)?;
    Ok(u32::from_ne_bytes(std::array::from_fn(|i| entry[offset + i])))
}

/// The address of the exported entry.
fn find_entry(file: &Parsed<'_>) -> Result<u64, Refusal> {
    let exports = file.exports().map_err(|error| Refusal::NoLibrary(error.to_string()))?;
    let symbol = abi::ENTRY_SYMBOL.as_bytes();
    let is_entry = |name: &[u8]| name == symbol || name.strip_prefix(b"_") == Some(symbol);
    for export in exports {
        let export = export.map_err(|error| Refusal::NoLibrary(error.to_string()))?;
        if let (Some(name), ExportTarget::Address { address }) = (export.name().name(), export.target())
            && is_entry(name)
        {
            return Ok(address);
        }
    }
    Err(Refusal::NoEntry)
}

/// Are all sections and segments inside of the file? One that is cut crashes whoever maps it.
fn whole(file: &Parsed<'_>, has: u64) -> Result<(), Refusal> {
    let sections = file.sections().filter_map(|section| section.file_range());
    let segments = file.segments().map(|segment| segment.file_range());
    let needs = sections.chain(segments).map(|(start, size)| start.saturating_add(size)).max().unwrap_or(0);
    if needs > has { Err(Refusal::Cut { has, needs }) } else { Ok(()) }
}

/// Magic, size, version and hash [bytes].
const HEAD: usize = 24;

/// The first `length` bytes at an address.
fn entry_bytes<'a>(file: &Parsed<'a>, address: u64, length: usize) -> Result<&'a [u8], Refusal> {
    let find = || {
        let has = |start: u64, size: u64| address.checked_sub(start).is_some_and(|offset| offset < size);
        let section = file.sections().find(|section| has(section.address(), section.size()))?;
        let data = section.data().ok()?;
        let start = usize::try_from(address - section.address()).ok()?;
        data.get(start..start.checked_add(length)?)
    };
    find().ok_or_else(|| Refusal::BadEntry("the file has no bytes for it".into()))
}

fn machine(file: &Parsed<'_>) -> String {
    let bits = if file.is_64() { 64 } else { 32 };
    let order = if file.is_little_endian() { "little-endian" } else { "big-endian" };
    format!("{:?} {:?} ({bits} bits, {order})", file.format(), file.architecture())
}

fn own_machine() -> String {
    use object::{Architecture, BinaryFormat};
    let format = if cfg!(windows) { BinaryFormat::Pe } else { BinaryFormat::native_object() };
    let architecture = match std::env::consts::ARCH {
        "x86_64" => Architecture::X86_64,
        "aarch64" => Architecture::Aarch64,
        "riscv64" => Architecture::Riscv64,
        "loongarch64" => Architecture::LoongArch64,
        "powerpc64" => Architecture::PowerPc64,
        _ => Architecture::Unknown,
    };
    let order = if cfg!(target_endian = "little") { "little-endian" } else { "big-endian" };
    format!("{format:?} {architecture:?} ({} bits, {order})", usize::BITS)
}

/// May a library with this head run on a host of this contract? Ok(Some(…)): it may, and this is what to tell
/// people.
pub fn judge(head: Head, host: Contract) -> Result<Option<String>, Refusal> {
    let (major, host_major) = (head.version >> 16, host.version >> 16);
    if major != host_major {
        return Err(Refusal::OtherVersion {
            found: version_text(head.version),
            host: version_text(host.version),
        });
    }
    if major == 0 && head.header_hash != host.header_hash {
        return Err(Refusal::OtherHeader { found: head.header_hash, host: host.header_hash });
    }
    if (head.size as usize) < std::mem::offset_of!(abi::Entry, open) {
        return Err(Refusal::BadEntry(format!("its size is {} bytes", head.size)));
    }
    Ok((head.version > host.version).then(|| {
        format!(
            "is built for reef_sim.h {}, this host speaks {}: it runs, but what {} added (streams, services, fields) is \
             not used",
            version_text(head.version),
            version_text(host.version),
            version_text(head.version)
        )
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOST: Contract = Contract { version: (1 << 16) | 2, header_hash: 7 };

    fn head(major: u32, minor: u32) -> Head {
        Head { size: size_of::<abi::Entry>() as u32, version: (major << 16) | minor, header_hash: 9 }
    }

    #[test]
    fn another_major_version_is_refused() {
        for major in [0, 2] {
            let refusal = judge(head(major, 2), HOST).unwrap_err();
            assert!(matches!(refusal, Refusal::OtherVersion { .. }), "{refusal}");
        }
    }

    #[test]
    fn an_older_or_equal_minor_version_runs_and_a_newer_one_runs_and_is_told() {
        assert_eq!(judge(head(1, 0), HOST), Ok(None));
        assert_eq!(judge(head(1, 2), HOST), Ok(None));
        let told = judge(head(1, 3), HOST).unwrap().unwrap();
        assert!(told.contains("1.3") && told.contains("1.2") && told.contains("not used"), "{told}");
    }

    #[test]
    fn while_the_major_version_is_0_any_other_header_is_refused() {
        let host = Contract { version: 1, header_hash: 7 };
        assert!(matches!(judge(head(0, 1), host), Err(Refusal::OtherHeader { found: 9, host: 7 })));
        assert_eq!(judge(Head { header_hash: 7, ..head(0, 1) }, host), Ok(None));
    }

    #[test]
    fn an_entry_that_is_too_small_is_refused() {
        assert!(matches!(judge(Head { size: 8, ..head(1, 2) }, HOST), Err(Refusal::BadEntry(_))));
    }

    #[test]
    fn bytes_that_are_no_library_are_refused() {
        assert_eq!(inspect(&Image::whole(b"")), Err(Refusal::Empty));
        for bytes in [&b"#!/bin/sh\necho hello, this is a script\n"[..], b"\x7fELF\x02\x01\x01"] {
            assert!(matches!(inspect(&Image::whole(bytes)), Err(Refusal::NoLibrary(_))));
        }
    }

    #[test]
    fn a_program_is_no_library() {
        let own = std::env::current_exe().unwrap();
        let refusal = inspect(&read(&own).unwrap()).unwrap_err();
        assert!(matches!(refusal, Refusal::NoEntry | Refusal::NoLibrary(_)), "{refusal}");
    }
}
