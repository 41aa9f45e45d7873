//! What lets code and scene change while the sea runs: newer builds of plugins take the places of older ones,
//! an older build takes over from one that fails, an edited scene is taken up where it allows.
//!
//! [`Live`] tends to it between two steps. `files` says what changed, `workshop` works beside the sea,
//! `ledger` knows what runs; `news` is what it tells; [`swap`] puts other instances in the places
//! of running ones, and [`adopt`] takes up an edited scene. [`pace()`] runs all of it in real time without a
//! window.

pub mod adopt;
mod files;
mod lease;
mod ledger;
mod live;
mod news;
mod pace;
pub mod swap;
mod workshop;

pub use ledger::Standing;
pub use live::{GRACE, Live, REMEMBER, Setup, sleep_until};
pub use news::{Arrival, Counts, Gravity, Notice, Tended};
pub use pace::{Lateness, pace};
