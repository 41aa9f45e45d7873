//! The file and its entry, read without running any of it.

use object::{
    Object, ObjectSection, ObjectSymbol, SymbolFlags, SymbolKind,
    elf::{DF_1_NODELETE, DT_FLAGS_1, STB_GNU_UNIQUE},
};
use reef_abi as abi;
use reef_plugin::{
    Refusal,
    inspect::{self, CONTRACT, Contract, Head, Parsed},
};

use super::{
    subject::Subject,
    table::{
        Check, Of,
        Rule::{Guide, Header},
    },
    verdict::{Not, Outcome, broken, must},
};

const SYMBOL: &str = "A plugin is a dynamic library with one exported data symbol, `reef_sim_entry`.";
const HEAD: &str =
    "The host reads magic, version and header hash from it before it runs any of the library's code";
const PINNED: &str = "Let nothing pin the library";

pub(super) const CHECKS: &[Check] = &[
    Check {
        name: "file-library",
        about: "The file is a whole dynamic library for this machine.",
        rule: Header("A plugin is a dynamic library"),
        needs: &[],
        of: Of::Library,
        run: library,
    },
    Check {
        name: "file-unique",
        about: "No symbol is of the kind that the system's loader keeps for ever.",
        rule: Guide("a static in an inline function or template would pin the library in memory"),
        needs: &["file-library"],
        of: Of::Library,
        run: unique,
    },
    Check {
        name: "file-nodelete",
        about: "The library does not ask the system's loader to keep it for ever.",
        rule: Guide(PINNED),
        needs: &["file-library"],
        of: Of::Library,
        run: nodelete,
    },
    Check {
        name: "entry-symbol",
        about: "It exports the symbol reef_sim_entry.",
        rule: Header(SYMBOL),
        needs: &["file-library"],
        of: Of::Library,
        run: symbol,
    },
    Check {
        name: "entry-data",
        about: "The symbol is data, not a function.",
        rule: Header(SYMBOL),
        needs: &["entry-symbol"],
        of: Of::Library,
        run: data,
    },
    Check {
        name: "entry-magic",
        about: "The entry begins with REEF_MAGIC.",
        rule: Header("\"REEFSIM\\0\", read as a little-endian integer."),
        needs: &["entry-symbol"],
        of: Of::Library,
        run: magic,
    },
    Check {
        name: "entry-version",
        about: "The entry is of this host's major version of the contract.",
        rule: Header(HEAD),
        needs: &["entry-magic"],
        of: Of::Library,
        run: version,
    },
    Check {
        name: "entry-header",
        about: "It was built with this host's reef_sim.h.",
        rule: Header(
            "While the major version is 0, REEF_HEADER_HASH must match, too: any difference is refused by name.",
        ),
        needs: &["entry-version"],
        of: Of::Library,
        run: header,
    },
    Check {
        name: "entry-size",
        about: "The entry says as many bytes as this version of it has.",
        rule: Header("begin with `uint32_t size` and only ever get fields appended."),
        needs: &["entry-magic"],
        of: Of::Library,
        run: size,
    },
    Check {
        name: "entry-spare",
        about: "The entry's spare field is zero.",
        rule: Header("of everything are zero"),
        needs: &["entry-magic"],
        of: Of::Library,
        run: spare,
    },
];

/// What every host must find there to call it.
pub(super) const SOUND: &[&str] =
    &["entry-symbol", "entry-magic", "entry-version", "entry-header", "entry-size", "entry-spare"];

fn parse(subject: &Subject) -> Result<Parsed<'_>, Not> {
    Ok(inspect::parse(&subject.image)?)
}

fn library(subject: &Subject) -> Outcome {
    match inspect::inspect(&subject.image) {
        // What the entry is like is for other checks.
        Ok(_) | Err(Refusal::NoEntry | Refusal::BadEntry(_)) => Ok(None),
        Err(refusal) => broken!("the file {refusal}"),
    }
}

fn unique(subject: &Subject) -> Outcome {
    let file = parse(subject)?;
    let kept = file.dynamic_symbols().find(|symbol| {
        let SymbolFlags::Elf { st_info, .. } = symbol.flags() else { return false };
        st_info.0 >> 4 == STB_GNU_UNIQUE.0 && !symbol.is_undefined()
    });
    match kept {
        Some(symbol) => broken!(
            "the symbol {} is unique in the process (STB_GNU_UNIQUE): build with -fno-gnu-unique",
            symbol.name().unwrap_or("?")
        ),
        None => Ok(None),
    }
}

fn nodelete(subject: &Subject) -> Outcome {
    let file = parse(subject)?;
    let Some(section) = file.section_by_name(".dynamic") else {
        return Err(Not::There("it has no section .dynamic".into()));
    };
    let data = section.data().unwrap_or_default();
    let word = |bytes: &[u8]| bytes.try_into().map_or(0, u64::from_ne_bytes);
    let flags = data
        .chunks_exact(16)
        .find(|entry| word(&entry[..8]) == DT_FLAGS_1.0 as u64)
        .map_or(0, |entry| word(&entry[8..]));
    must!(
        flags & DF_1_NODELETE.0 == 0,
        "its flags have DF_1_NODELETE: build without -z nodelete, lest no newer build replaces it"
    );
    Ok(None)
}

fn symbol(subject: &Subject) -> Outcome {
    match inspect::inspect(&subject.image) {
        Ok(_) | Err(Refusal::BadEntry(_)) => Ok(None),
        Err(refusal) => broken!("the library {refusal}"),
    }
}

fn data(subject: &Subject) -> Outcome {
    let file = parse(subject)?;
    let entry = file.dynamic_symbols().find(|symbol| symbol.name() == Ok(abi::ENTRY_SYMBOL));
    match entry.map(|symbol| symbol.kind()) {
        Some(SymbolKind::Data) => Ok(None),
        Some(kind) => broken!("the symbol {} is of kind {kind:?}: it must be data", abi::ENTRY_SYMBOL),
        None => Err(Not::There("this kind of file does not tell".into())),
    }
}

/// The entry's head, wherever it is sound enough to have one.
fn head(subject: &Subject) -> Result<Head, Not> {
    Ok(inspect::inspect(&subject.image)?)
}

fn magic(subject: &Subject) -> Outcome {
    head(subject)?;
    Ok(None)
}

fn version(subject: &Subject) -> Outcome {
    // With the hash that this host has: that is for another check.
    let head = Head { header_hash: CONTRACT.header_hash, ..head(subject)? };
    match inspect::judge(head, CONTRACT) {
        Err(refusal @ Refusal::OtherVersion { .. }) => broken!("it {refusal}"),
        Ok(Some(note)) => Ok(Some(note)),
        _ => Ok(None),
    }
}

fn header(subject: &Subject) -> Outcome {
    let head = head(subject)?;
    if let Err(refusal @ Refusal::OtherHeader { .. }) = inspect::judge(head, CONTRACT) {
        broken!("it {refusal}");
    }
    Ok(None)
}

fn size(subject: &Subject) -> Outcome {
    let (head, known) = (head(subject)?, size_of::<abi::Entry>() as u32);
    let Contract { version, .. } = CONTRACT;
    match head.size {
        size if size == known || (size > known && head.version > version) => Ok(None),
        size => broken!("its size is {size}; reef_entry of this version has {known} bytes"),
    }
}

fn spare(subject: &Subject) -> Outcome {
    let spare = inspect::entry_word(&subject.image, std::mem::offset_of!(abi::Entry, spare))?;
    must!(spare == 0, "its spare field is {spare:#x}");
    Ok(None)
}
