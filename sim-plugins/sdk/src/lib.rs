//! The safe side of the contract `reef_sim.h`: implement [`Plugin`], write [`export!`], get a library that
//! Reef loads.
//!
//! ```
//! use reef_sdk::prelude::*;
//!
//! /// What a scene may say about this module.
//! #[derive(serde::Deserialize, schemars::JsonSchema)]
//! #[serde(deny_unknown_fields, default)]
//! struct Config {
//!     /// How many markers stand on the sea bed.
//!     count: u32,
//! }
//!
//! impl Default for Config {
//!     fn default() -> Self {
//!         Self { count: 3 }
//!     }
//! }
//!
//! struct Markers {
//!     count: u32,
//!     age: f64,
//! }
//!
//! impl Plugin for Markers {
//!     const ID: &'static str = "example.markers";
//!     const NAME: &'static str = "Markers";
//!     const VERSION: &'static str = "1.0.0";
//!     const VENDOR: &'static str = "Example";
//!     const DESCRIPTION: &'static str = "Markers on the sea bed.";
//!     const STATE_VERSION: u32 = 1;
//!     const STATE_MIN_VERSION: u32 = 1;
//!     type Config = Config;
//!
//!     fn create(_host: &Host, _scene: &SceneInfo, config: Config) -> Result<Self, ConfigError> {
//!         Ok(Self { count: config.count, age: 0.0 })
//!     }
//!
//!     fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
//!         self.age += input.dt();
//!         let objects = output.reserve::<abi::Object>(self.count as usize)?;
//!         for (i, object) in objects.iter_mut().enumerate() {
//!             *object = abi::Object { id: i as u64 + 1, origin: [i as f64, 0.0, 0.0], ..Default::default() };
//!         }
//!         output.commit::<abi::Object>(self.count as usize)?;
//!         Ok(Status::Ok)
//!     }
//!
//!     fn save(&self, state: &mut StateWriter) {
//!         state.put_one("age", self.age);
//!     }
//!
//!     fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
//!         self.age = state.get_one("age")?;
//!         Ok(())
//!     }
//! }
//!
//! // In the library crate: reef_sdk::export!(Markers);
//! # assert_eq!(reef_sdk::entry::<Markers>().descriptor_count, 1);
//! ```
//!
//! What the crate takes care of: sizes of growable structs, parameters (stored, clamped, saved, loaded),
//! state that is loaded wholly or not at all, and panics — they are caught on this side, in every entry and
//! every job, and become `REEF_FATAL` with the message.

#![deny(unsafe_code)]

pub use reef_abi as abi;

#[allow(unsafe_code, reason = "the C calls: raw pointers of the contract become references here")]
mod calls;
mod config;
#[allow(unsafe_code, reason = "the C entry: raw pointers of the contract become references here")]
mod entry;
mod error;
#[allow(unsafe_code, reason = "the panic hook writes through a pointer to the guarded call's record")]
mod guard;
#[allow(unsafe_code, reason = "calls of the host's services")]
mod host;
mod kept;
#[allow(unsafe_code, reason = "calls of the host's services")]
mod mesh;
mod param;
pub mod ranges;
#[allow(unsafe_code, reason = "a step's raw pointers become references here")]
mod shell;
mod state;
#[allow(unsafe_code, reason = "slices out of the step's raw input and of the host's output memory")]
mod step;
#[allow(unsafe_code, reason = "disjoint parts of one slice go to concurrent jobs")]
mod workers;

pub use config::{SceneInfo, describe_species, species_schema};
pub use entry::entry;
pub use error::{AssetError, ConfigError, MeshError, Reset, StateError, Status, StepError, TextureError};
pub use host::{Host, Level, Limits, Texture, TextureFormat};
pub use kept::{Held, Kept};
pub use mesh::{Mesh, MeshDesc};
pub use param::{Param, ParamKind, Params};
pub use reef_abi::pack_normal;
pub use state::{Scalar, StateReader, StateWriter};
pub use step::{Element, Heightfield, Output, StepInput};
pub use workers::{Chunks, Parts, Split, Workers};

/// What [`export!`] expands to; not for direct use.
#[doc(hidden)]
pub mod macros {
    pub use crate::entry::{DescriptorPointer, Slot, Slots, close, descriptor_pointers, open};
}

/// Everything that a plugin's source usually names.
pub mod prelude {
    pub use crate::{
        AssetError, Chunks, ConfigError, Element, Heightfield, Held, Host, Level, Mesh, MeshDesc, MeshError,
        Output, Param, ParamKind, Params, Parts, Plugin, Reset, SceneInfo, Split, StateError, StateReader,
        StateWriter, Status, StepError, StepInput, Texture, TextureError, TextureFormat, Workers, abi,
        pack_normal,
    };
}

/// One simulation module. Each module of a scene is one value of this type; the host makes it with
/// [`Plugin::create`] and calls [`Plugin::step`] once per simulation step, never two calls on one value at a
/// time.
pub trait Plugin: Sized + Send + 'static {
    /// Stable identifier, `vendor.name`: scene files and saved states name it.
    const ID: &'static str;
    /// Name for people.
    const NAME: &'static str;
    /// Version of the plugin, `"1.2.3"`.
    const VERSION: &'static str;
    /// Who makes it.
    const VENDOR: &'static str;
    /// One sentence.
    const DESCRIPTION: &'static str;
    /// Version of what [`Plugin::save`] writes.
    const STATE_VERSION: u32;
    /// The oldest version that [`Plugin::load`] reads.
    const STATE_MIN_VERSION: u32;
    /// [`Plugin::load`] leaves an instance that has run as it leaves a fresh one: all later steps emit the
    /// same bytes, lists that stay among them. Then the SDK keeps the instance that a load has replaced, and
    /// the next load needs no new one: loads are as fast as the states are short, and jumps in time fluid.
    const LOADS_OVER: bool = false;

    /// The module's table in a scene file. Refuse unknown keys (`#[serde(deny_unknown_fields)]`); doc
    /// comments become the descriptions of the JSON Schema.
    type Config: serde::de::DeserializeOwned + schemars::JsonSchema;

    /// Parameters that can change while the sea runs. The SDK stores their values: read them from
    /// [`StepInput::param`].
    fn params() -> &'static [Param] {
        &[]
    }

    /// What the traces are of, as recordings name it (`"fibre"`, lower_case_words): [`abi::Trace::kind`] is
    /// an index.
    fn traces() -> &'static [&'static str] {
        &[]
    }

    /// Makes an instance. An error names the place in the configuration.
    fn create(host: &Host, scene: &SceneInfo, config: Self::Config) -> Result<Self, ConfigError>;

    /// A parameter's value right after [`Plugin::create`], where the configuration says something other than
    /// the declared default.
    fn initial_param(&self, param: &Param) -> f64 {
        param.default
    }

    /// Advances by `input.dt()` seconds and emits the new state. With dt = 0: emits the present state,
    /// changes nothing.
    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError>;

    /// Back to the state right after [`Plugin::create`]. Without this method the SDK makes the instance anew.
    fn reset(&mut self) -> Reset {
        Reset::Recreate
    }

    /// Writes everything that a later step depends on, but parameters (the SDK saves them).
    fn save(&self, state: &mut StateWriter);

    /// Takes over what [`Plugin::save`] wrote. Called on a fresh instance of the same configuration (or on
    /// one that was replaced, see [`Plugin::LOADS_OVER`]), which replaces the running one only on success:
    /// whatever this method did before it failed has no effect.
    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError>;
}

/// Makes the types' plugins the library's: defines the one exported symbol, `reef_sim_entry`. Once per
/// `cdylib`.
///
/// ```ignore
/// reef_sdk::export!(Anemones);
/// ```
#[macro_export]
macro_rules! export {
    ($($plugin:ty),+ $(,)?) => {
        #[allow(unsafe_code, non_upper_case_globals, missing_docs)]
        const _: () = {
            const COUNT: usize = [$(stringify!($plugin)),+].len();
            static SLOTS: $crate::macros::Slots<COUNT> =
                $crate::macros::Slots::new([$($crate::macros::Slot::new::<$plugin>()),+]);
            static DESCRIPTORS: [$crate::macros::DescriptorPointer; COUNT] =
                $crate::macros::descriptor_pointers(&SLOTS);

            unsafe extern "C" fn open(host: *const $crate::abi::Host) -> i32 {
                // SAFETY: the host calls this with a valid pointer, as the contract says.
                unsafe { $crate::macros::open(&SLOTS, host) }
            }

            unsafe extern "C" fn close() {
                $crate::macros::close(&SLOTS);
            }

            #[unsafe(no_mangle)]
            pub static reef_sim_entry: $crate::abi::Entry = $crate::abi::Entry {
                magic: $crate::abi::MAGIC,
                size: size_of::<$crate::abi::Entry>() as u32,
                version: $crate::abi::VERSION,
                header_hash: $crate::abi::HEADER_HASH,
                descriptor_count: COUNT as u32,
                spare: 0,
                descriptors: (&raw const DESCRIPTORS).cast(),
                open: Some(open),
                close: Some(close),
            };
        };
    };
}
