//! The host's side of the contract: finding, checking and loading libraries, calling them on threads of their
//! own, and taking over what they emit.
//!
//! In the order in which things happen: [`inspect`] reads a file without running it, as an [`image`];
//! [`library`] opens one of its [`copies`] on the threads of its [`generation`] and runs what it has for its
//! beginning and its end (`life`); [`info`] takes over what it says of itself; [`instance`] makes and steps
//! instances, with [`input`] going in, `services` (its own files as `assets`, and `extensions`) lent
//! meanwhile, and [`streams`] coming out, which
//! [`streams::check`] has looked at, with the [`textures`] that an instance made; [`envelope`] wraps saved
//! states. [`registry`] knows all plugins that were found, and all that were refused; [`probe`] tries builds
//! that nobody knows in another process first.
//!
//! A sea steps all of its modules `together`.
//!
//! Every call into a library, and every job, goes through a [`guard`].
//!
//! What only `reef plugin check` does to a plugin is in `bare`.
//!
//! `unsafe` lives in `guard`, `copies`, `marker`, `pool`, `generation`, `scratch`, `services`, `info`,
//! `library`, `lent`, `frozen`, `life`, `probe`, `instance`, `bare` and the two functions of `recorder` that
//! a plugin calls.

mod assets;
#[cfg(target_os = "linux")]
pub mod bare;
pub mod copies;
pub mod envelope;
mod error;
mod extensions;
pub mod frozen;
pub mod generation;
pub mod guard;
mod health;
pub mod image;
pub mod info;
pub mod input;
pub mod inspect;
pub mod instance;
mod lent;
pub mod library;
mod life;
mod marker;
mod names;
mod pool;
pub mod probe;
mod recorder;
pub mod registry;
mod saved;
mod scratch;
mod services;
mod tag;
mod together;

use reef_streams::{self as streams, meshes, retained, textures};

pub use assets::Asset;
pub use error::{PluginError, Refusal};
pub use guard::{KEEPS_STATES, Limits, Noted, forget_state, keep_state, offer_patience, set_limits};
pub use health::Health;
pub use info::{ParamInfo, ParamKind, PluginInfo};
pub use input::StepInput;
pub use instance::{Instance, Payload, StepReport, StepStatus, StepTimes};
pub use library::{Library, Plugin, pinned};
pub use registry::{Refused, Registry};
pub use services::Figure;
pub use together::{Loading, Saving, Turn, load_together, save_together, step_together};
