//! Shaders that are edited while Reef runs: compiled in the background, taken between two frames.
//!
//! Files are looked at twice a second by time and size, then by the hash of what a stage consists of: an edit
//! of an include compiles every stage that includes it, and one that changes nothing compiles nothing. A
//! shader with a mistake changes nothing on the picture; [`super::ShaderStore::failures`] says what is wrong
//! with it, and where.

use std::{
    collections::{BTreeMap, HashMap},
    path::{Path, PathBuf},
    sync::{Arc, Condvar, Mutex, PoisonError},
    thread::JoinHandle,
    time::{Duration, SystemTime},
};

use super::{compile::Compiler, context::Gpu, shader_sources, shaders::ShaderStore};

/// Between two looks.
const PAUSE: Duration = Duration::from_millis(500);

/// Watches the folder of shaders until it is dropped.
pub struct ShaderWatch {
    stop: Arc<(Mutex<bool>, Condvar)>,
    thread: Option<JoinHandle<()>>,
}

impl ShaderWatch {
    /// Starts to watch. What differs from the manifest already is compiled at once.
    pub fn start(gpu: &Gpu, folder: &Path) -> Result<ShaderWatch, String> {
        let compiler = Compiler::new()?;
        let known = shader_sources::manifest(folder).map_err(|error| error.to_string())?;
        let known = known.shaders.into_iter().map(|(name, entry)| (name, entry.source)).collect();
        let mut eye = Eye {
            folder: folder.to_owned(),
            store: gpu.shared.shaders.clone(),
            compiler,
            known,
            stamps: None,
        };
        let stop = Arc::new((Mutex::new(false), Condvar::new()));
        let told = stop.clone();
        let look = move || {
            let (stopped, bell) = &*told;
            let mut guard = stopped.lock().unwrap_or_else(PoisonError::into_inner);
            while !*guard {
                drop(guard);
                eye.poll();
                guard = stopped.lock().unwrap_or_else(PoisonError::into_inner);
                if !*guard {
                    guard = bell.wait_timeout(guard, PAUSE).unwrap_or_else(PoisonError::into_inner).0;
                }
            }
        };
        let thread = std::thread::Builder::new()
            .name("shaders".to_owned())
            .spawn(look)
            .map_err(|error| format!("no thread to watch shaders with: {error}"))?;
        tracing::info!("watching {}", folder.display());
        Ok(ShaderWatch { stop, thread: Some(thread) })
    }
}

impl Drop for ShaderWatch {
    fn drop(&mut self) {
        *self.stop.0.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.stop.1.notify_all();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the thread that watches shaders ended early");
        }
    }
}

type Stamps = BTreeMap<PathBuf, (Option<SystemTime>, u64)>;

struct Eye {
    folder: PathBuf,
    store: Arc<ShaderStore>,
    compiler: Compiler,
    /// Hash of each stage's sources as they were compiled, or tried to be, last.
    known: HashMap<String, String>,
    stamps: Option<Stamps>,
}

impl Eye {
    /// Compiles what changed since the last look.
    fn poll(&mut self) {
        let stamps = stamps(&self.folder);
        if self.stamps.as_ref() == Some(&stamps) {
            return;
        }
        self.stamps = Some(stamps);
        // A file that an editor is just replacing is there at the next look.
        let Ok(stages) = shader_sources::stages(&self.folder) else {
            self.stamps = None;
            return;
        };
        for stage in stages {
            if self.known.get(&stage.name) == Some(&stage.hash) {
                continue;
            }
            match self.compiler.compile(&self.folder.join(&stage.name)) {
                Ok(spirv) => self.store.offer(&stage.name, spirv),
                Err(text) => self.store.fail(&stage.name, text),
            }
            self.known.insert(stage.name, stage.hash);
        }
    }
}

/// Time and size of every file in the folder.
fn stamps(folder: &Path) -> Stamps {
    let Ok(entries) = std::fs::read_dir(folder) else { return Stamps::new() };
    entries
        .flatten()
        .filter_map(|entry| {
            let meta = entry.metadata().ok()?;
            meta.is_file().then(|| (entry.path(), (meta.modified().ok(), meta.len())))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Frames, GpuOptions, Signals};

    const NAME: &str = "selftest_scale.comp";

    /// Draws empty frames until `done`, at most ten seconds.
    fn wait_for(frames: &mut Frames, mut done: impl FnMut() -> bool) {
        for _ in 0..200 {
            frames.begin().expect("a frame").submit(Signals::default()).expect("submitted");
            if done() {
                return;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("nothing happened for ten seconds");
    }

    #[test]
    fn an_edited_include_is_compiled_and_taken_and_a_mistake_is_told_by_file_and_line() {
        let gpu = match Gpu::open(&GpuOptions::default()) {
            Ok(gpu) => gpu,
            Err(error) => {
                assert!(std::env::var("REEF_REQUIRE").as_deref() != Ok("all"), "{error}");
                eprintln!("skipped: {error}");
                return;
            }
        };
        let folder = tempfile::tempdir().expect("a temporary folder");
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
        let source = include_str!("../../../shaders/selftest_scale.comp");
        let include =
            "#version 460\n#extension GL_GOOGLE_include_directive : require\n#include \"extra.glsl\"";
        write(NAME, &source.replace("#version 460", include));
        write("extra.glsl", "// nothing\n");
        write(shader_sources::MANIFEST, "{\"shaders\":{}}");
        let mut frames = Frames::new(&gpu, 1).expect("frames");
        let watch = ShaderWatch::start(&gpu, folder.path()).expect("watching");
        wait_for(&mut frames, || gpu.shaders().replacements() == 1);
        write("extra.glsl", "const uint unused = 1;\n");
        wait_for(&mut frames, || gpu.shaders().replacements() == 2);
        write("extra.glsl", "\n\nthis is no GLSL;\n");
        wait_for(&mut frames, || !gpu.shaders().failures().is_empty());
        let failure = gpu.shaders().failures().remove(0);
        assert!(failure.name == NAME && failure.text.contains("extra.glsl:3:"), "{failure:?}");
        assert_eq!(gpu.shaders().replacements(), 2, "the last good one is drawn with");
        write("extra.glsl", "// mended\n");
        wait_for(&mut frames, || gpu.shaders().replacements() == 3);
        assert!(gpu.shaders().failures().is_empty());
        drop((watch, frames));
        assert!(gpu.close().is_empty());
    }
}
