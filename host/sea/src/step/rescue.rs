//! The newest whole state of a sea that runs, about once a second: should a plugin take the program down, its
//! last words write it to a file.

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use reef_files::cache;
use reef_plugin::{KEEPS_STATES, forget_state, keep_state};

use super::{hash::Chain, world::World};

/// From one state to the next, at least.
const EVERY: Duration = Duration::from_secs(1);
/// Of the time of a run, one part in so many goes into this.
const SHARE: u32 = 100;
/// What the name of a run's own file ends with.
const ENDING: &str = ".last";
/// The file of a run that has none of its own.
const NAME: &str = "last.state";

/// Keeps states as long as it lives.
#[derive(Debug)]
pub struct Rescue {
    path: PathBuf,
    /// When the next state is due.
    next: Instant,
    /// The step of the last one.
    step: Option<u64>,
}

impl Rescue {
    /// For a run that writes this file: states go beside it, and else to the user's cache folder.
    pub fn beside(file: Option<&Path>) -> Self {
        let own = file.filter(|path| path.is_file() || !path.exists()).map(|path| {
            let mut name = path.as_os_str().to_owned();
            name.push(ENDING);
            PathBuf::from(name)
        });
        let path = own.unwrap_or_else(|| {
            let folder = cache::folder().filter(|folder| fs::create_dir_all(folder).is_ok());
            folder.unwrap_or_else(std::env::temp_dir).join(NAME)
        });
        Self { path, next: Instant::now(), step: None }
    }

    /// Keeps the present state, where one is due. `chain`: the hashes so far.
    pub fn keep(&mut self, world: &mut World, chain: Option<&Chain>) {
        let (began, step) = (Instant::now(), world.clock().step);
        if !KEEPS_STATES || began < self.next || self.step == Some(step) {
            return;
        }
        // Where a module gives no state, the state before stays.
        if let Some(bytes) = world.try_save(chain) {
            keep_state(&self.path, &format!("The sea at step {step}"), &bytes);
            self.step = Some(step);
        }
        self.next = Instant::now() + EVERY.max(SHARE * began.elapsed());
    }
}

impl Drop for Rescue {
    fn drop(&mut self) {
        forget_state();
    }
}
