//! How an instance's calls end.

use reef_abi as abi;
use thiserror::Error;

/// A step that did what it was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The outputs count.
    Ok,
    /// Nothing changed since the last step: the last outputs stay, flow and actors included.
    Sleep,
}

/// What [`crate::Plugin::reset`] did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// The instance is as it was right after `create`.
    Done,
    /// The SDK shall make the instance anew from its configuration.
    Recreate,
}

/// A step that failed, by the state in which it leaves the instance.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum StepError {
    /// This step is refused, the state is untouched; the last good outputs stay.
    #[error("{0}")]
    Discard(String),
    /// The instance needs a reset or a loaded state.
    #[error("{0}")]
    Error(String),
    /// The library is at fault: the host rolls it back.
    #[error("{0}")]
    Fatal(String),
    /// A limit of the host is reached.
    #[error("{0}")]
    NoSpace(String),
}

impl StepError {
    /// The contract's status value.
    pub(crate) fn code(&self) -> i32 {
        match self {
            Self::Discard(_) => abi::DISCARD,
            Self::Error(_) => abi::ERROR,
            Self::Fatal(_) => abi::FATAL,
            Self::NoSpace(_) => abi::NO_SPACE,
        }
    }
}

/// What is wrong with a configuration, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConfigError {
    /// Path in the configuration: `anemones[3].species`. Empty: the whole.
    pub path: String,
    /// What is wrong, and what is allowed.
    pub message: String,
}

impl ConfigError {
    /// An error at a path: `ConfigError::new("anemones[3].radius", "must be above 0 m, is -1")`.
    pub fn new(path: impl Into<String>, message: impl Into<String>) -> Self {
        Self { path: path.into(), message: message.into() }
    }

    /// The same error seen from further out: `anemones[3]` in front of `species` gives `anemones[3].species`.
    pub fn within(mut self, outer: &str) -> Self {
        self.path = match (outer.is_empty(), self.path.is_empty()) {
            (true, _) => self.path,
            (false, true) => outer.to_owned(),
            (false, false) if self.path.starts_with('[') => format!("{outer}{}", self.path),
            (false, false) => format!("{outer}.{}", self.path),
        };
        self
    }
}

impl std::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.path.as_str() {
            "" => f.write_str(&self.message),
            path => write!(f, "{path}: {}", self.message),
        }
    }
}

impl std::error::Error for ConfigError {}

/// Why there is no texture.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum TextureError {
    /// Bytes and size do not go together.
    #[error("texture `{name}`: {bytes} bytes are not {width} x {height} texels of four")]
    Size {
        /// The texture.
        name: String,
        /// Texels along a row.
        width: u32,
        /// Rows.
        height: u32,
        /// What was given.
        bytes: usize,
    },
    /// The host did not take it; its message says why.
    #[error("the host refused the texture `{name}`")]
    Refused {
        /// The texture.
        name: String,
    },
}

impl TextureError {
    /// What the plugin has to say; nothing where the host has said it already.
    fn own_words(&self) -> String {
        match self {
            Self::Size { .. } => self.to_string(),
            Self::Refused { .. } => String::new(),
        }
    }
}

impl From<TextureError> for ConfigError {
    fn from(error: TextureError) -> Self {
        Self::new("", error.own_words())
    }
}

impl From<TextureError> for StepError {
    fn from(error: TextureError) -> Self {
        Self::NoSpace(error.own_words())
    }
}

/// Why a file of the module's own was not read. The host has said it already.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("the host does not give the file `{name}`")]
pub struct AssetError {
    /// The file, as it was asked for.
    pub name: String,
}

impl From<AssetError> for ConfigError {
    fn from(_: AssetError) -> Self {
        Self::new("", "")
    }
}

/// Why there is no mesh.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum MeshError {
    /// Vertices and what hangs on them do not go together.
    #[error("mesh `{name}`: {count} {what} are not the {expected} of its vertices")]
    Count {
        /// The mesh.
        name: String,
        /// Joints or weights.
        what: &'static str,
        /// How many were given.
        count: usize,
        /// As many as all vertices have influences.
        expected: usize,
    },
    /// The host did not take it; its message says why.
    #[error("the host refused the mesh `{name}`")]
    Refused {
        /// The mesh.
        name: String,
    },
}

impl MeshError {
    /// What the plugin has to say; nothing where the host has said it already.
    fn own_words(&self) -> String {
        match self {
            Self::Count { .. } => self.to_string(),
            Self::Refused { .. } => String::new(),
        }
    }
}

impl From<MeshError> for ConfigError {
    fn from(error: MeshError) -> Self {
        Self::new("", error.own_words())
    }
}

impl From<MeshError> for StepError {
    fn from(error: MeshError) -> Self {
        Self::NoSpace(error.own_words())
    }
}

/// Why saved bytes are not taken over.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum StateError {
    /// The bytes are none that this SDK wrote, or are damaged.
    #[error("the saved state is damaged: {0}")]
    Damaged(String),
    /// A field that the plugin needs is not in the state.
    #[error("the saved state has no field `{0}`")]
    Missing(String),
    /// A field is of another type or length than the plugin expects.
    #[error("field `{name}` of the saved state {problem}")]
    Mismatch {
        /// The field.
        name: String,
        /// In what it differs.
        problem: String,
    },
    /// Anything else that the plugin refuses.
    #[error("{0}")]
    Refused(String),
}
