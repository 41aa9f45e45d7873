//! Why a library is not used, and how an instance's calls fail.

use std::path::PathBuf;

use reef_abi as abi;
use thiserror::Error;

use super::names::status_name;

/// Why a file is not used as a plugin.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Refusal {
    /// It cannot be read.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// A folder stands there.
    #[error("is a folder, not a library")]
    Folder,
    /// Nothing is in it.
    #[error("is empty (a build that did not finish?)")]
    Empty,
    /// Larger than any plugin.
    #[error("has {size} bytes; the limit is {limit}")]
    TooLarge {
        /// Bytes in the file.
        size: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// Not a dynamic library.
    #[error("is no dynamic library: {0}")]
    NoLibrary(String),
    /// A part of it: a build that goes on, or did not finish.
    #[error("is cut: it has {has} bytes, its sections end at {needs} (a build that did not finish?)")]
    Cut {
        /// Bytes in the file.
        has: u64,
        /// Bytes that its headers speak of.
        needs: u64,
    },
    /// A library for another machine or system.
    #[error("is a library for {found}; this program runs on {expected}")]
    OtherMachine {
        /// What the file was built for.
        found: String,
        /// What this program was built for.
        expected: String,
    },
    /// A library, but no plugin of ours.
    #[error("does not export the symbol `reef_sim_entry`: it is no Reef plugin")]
    NoEntry,
    /// The symbol is there, its content is not ours.
    #[error("its `reef_sim_entry` is no plugin's entry: {0}")]
    BadEntry(String),
    /// Another major version of the contract.
    #[error("is built for reef_sim.h {found}; this host speaks {host}: rebuild it with this host's header")]
    OtherVersion {
        /// The library's, `major.minor`.
        found: String,
        /// The host's.
        host: String,
    },
    /// While the contract is 0.x, its text must be the same.
    #[error(
        "is built with another reef_sim.h: header hash {found:016x}, the host's is {host:016x} (any difference \
         counts while the contract is 0.x): rebuild it with this host's header"
    )]
    OtherHeader {
        /// The library's.
        found: u64,
        /// The host's.
        host: u64,
    },
    /// The system's loader refused it.
    #[error("cannot be loaded: {0}")]
    Load(String),
    /// The same code is loaded already.
    #[error("is loaded already: the system's loader returned code that is still in use")]
    StillLoaded,
    /// It says something about itself that is not allowed.
    #[error("describes itself wrongly: {0}")]
    BadDescriptor(String),
    /// Its `open` failed.
    #[error("failed to open: {0}")]
    Open(String),
    /// Another library has this id.
    #[error("its plugin `{id}` is already there: {first}")]
    Duplicate {
        /// The id of both.
        id: String,
        /// Where the first one is.
        first: String,
    },
    /// Its code ended in a signal, or did not end, while it was loaded.
    #[error("{0}")]
    Fault(String),
    /// The machine has no threads or no room for it.
    #[error("{0}")]
    Machine(String),
}

/// How a call into a plugin failed. The sea goes on; this instance does not, until reset or loaded.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum PluginError {
    /// The file is not used.
    #[error("{}: {reason}", path.display())]
    Refused {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: Refusal,
    },
    /// `create` refused its configuration.
    #[error("plugin `{plugin}`: {}{message}", path.as_ref().map(|p| format!("{p}: ")).unwrap_or_default())]
    Config {
        /// The plugin.
        plugin: String,
        /// Path in the configuration: `anemones[3].species`; None: the whole.
        path: Option<String>,
        /// What is wrong.
        message: String,
    },
    /// A call ended with a failure.
    #[error("plugin `{plugin}`: {call} failed ({status}): {message}")]
    Call {
        /// The plugin.
        plugin: String,
        /// The function.
        call: &'static str,
        /// Name of the contract's status value.
        status: String,
        /// The plugin's message.
        message: String,
    },
    /// A call was stopped by a fault, in it or earlier in the same library, which is not called any more.
    #[error("{message}")]
    Fault {
        /// The plugin.
        plugin: String,
        /// The function.
        call: &'static str,
        /// What happened, with plugin, call, signal and address.
        message: String,
    },
    /// A saved state is refused; the instance is as it was.
    #[error("plugin `{plugin}`: the saved state is refused: {message}")]
    State {
        /// The plugin.
        plugin: String,
        /// Why.
        message: String,
    },
}

impl PluginError {
    /// Is the library itself at fault (REEF_FATAL, a caught panic, say), and not just this call?
    pub fn is_fatal(&self) -> bool {
        match self {
            Self::Call { status, .. } => *status == status_name(abi::FATAL),
            Self::Fault { .. } => true,
            _ => false,
        }
    }
}
