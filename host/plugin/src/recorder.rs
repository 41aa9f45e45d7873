//! `reef_output`: takes a step's elements into memory of the host. Two sets of outputs take turns (more while
//! the renderer holds on to older ones), so that after the first steps nothing is allocated.

use std::{
    ffi::c_void,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

use reef_abi as abi;

use super::{
    guard, marker,
    meshes::MeshList,
    names::version_text,
    streams::{Lane, Outputs, STREAMS, Stream, check},
    tag::{self, Tag, Tagged},
    textures::TextureList,
};

/// Sets of outputs that are kept for reuse.
const SPARE: usize = 4;

/// How often jobs called what only a step may.
static MISPLACED: AtomicU64 = AtomicU64::new(0);

/// How often jobs called what only a step may.
#[cfg(target_os = "linux")]
pub(super) fn misplaced() -> u64 {
    MISPLACED.load(Ordering::Relaxed)
}

/// What happened to a stream in this step.
#[derive(Clone, Copy, Debug, Default)]
struct Progress {
    reserved: Option<u64>,
    committed: Option<u64>,
}

/// The outputs of one instance.
#[derive(Debug)]
pub(crate) struct Recorder {
    /// The last good step's.
    current: Arc<Outputs>,
    /// The running step's; nobody else has it. None before a step begins.
    staging: Option<Arc<Outputs>>,
    /// Former ones, the newest last, to be used again when nobody holds them any more.
    spare: Vec<Arc<Outputs>>,
    progress: [Progress; abi::STREAM_COUNT as usize],
    /// Why the first refused call of this step was refused.
    message: Option<String>,
    /// As `message`, of calls that fail the step: a plugin that ignores their status must not pass.
    refused: Option<String>,
    checker: check::Checker,
    trace_kinds: u32,
    /// Set while a step runs.
    tag: Tag,
}

impl Tagged for Recorder {
    const AT: usize = std::mem::offset_of!(Self, tag);
}

impl Recorder {
    /// Of a plugin that names so many kinds of traces.
    pub(crate) fn new(trace_kinds: u32) -> Self {
        Self {
            trace_kinds,
            current: Arc::default(),
            staging: None,
            spare: Vec::new(),
            progress: Default::default(),
            message: None,
            refused: None,
            checker: check::Checker::default(),
            tag: Tag::default(),
        }
    }

    /// The outputs of the last good step.
    pub(crate) fn current(&self) -> &Arc<Outputs> {
        &self.current
    }

    /// Forgets the last good step: the instance was reset, or has another state.
    pub(crate) fn forget(&mut self) {
        self.current = Arc::default();
    }

    /// Fills all room that no good step's elements are in with nonsense, as the contract allows.
    pub(super) fn soil(&mut self) {
        let unused = self.spare.iter_mut().chain(&mut self.staging);
        for outputs in unused.filter_map(Arc::get_mut) {
            STREAMS.iter().filter_map(|stream| outputs.lane(stream.number).map(Lane::soil)).for_each(drop);
        }
    }

    /// How many elements of a stream the last step committed.
    pub(super) fn committed(&self, stream: u32) -> Option<u64> {
        self.progress.get(stream as usize)?.committed
    }

    /// A step begins. The recorder stays where it is until [`Recorder::end`].
    pub(crate) fn begin(&mut self) {
        self.tag.set();
        self.progress = Default::default();
        self.message = None;
        self.refused = None;
        if self.staging.as_mut().and_then(Arc::get_mut).is_none() {
            // The newest that nobody holds: its memory is nearest. Only now are those of the step before the
            // last free.
            let free = self.spare.iter_mut().rposition(|outputs| Arc::get_mut(outputs).is_some());
            self.staging = Some(free.map(|free| self.spare.remove(free)).unwrap_or_default());
        }
    }

    /// The step is over: nothing comes in any more.
    pub(crate) fn end(&mut self) {
        self.tag.clear();
    }

    fn staging(staging: &mut Option<Arc<Outputs>>) -> Option<&mut Outputs> {
        staging.as_mut().and_then(Arc::get_mut)
    }

    /// The table for the plugin. Valid until this value is used or moved.
    pub(crate) fn table(&mut self) -> abi::Output {
        abi::Output {
            size: size_of::<abi::Output>() as u32,
            spare: 0,
            ctx: (&raw mut *self).cast(),
            reserve: Some(reserve),
            commit: Some(commit),
        }
    }

    /// Why the first refused call of this step was refused.
    pub(crate) fn take_message(&mut self) -> Option<String> {
        self.message.take()
    }

    /// The step returned REEF_OK: cuts the streams to what was committed, checks all, and makes it the
    /// current outputs. `made`: what the instance has now. `share`: who helps to check. On an error the
    /// outputs stay as they were.
    pub(crate) fn finish(
        &mut self,
        flags: u32,
        made: (TextureList, MeshList),
        share: check::Share<'_>,
    ) -> Result<(), String> {
        if let Some(message) = &self.refused {
            return Err(message.clone());
        }
        for stream in &STREAMS {
            self.look_at_fence(stream.number).map_err(|(_, message)| message)?;
        }
        let progress = self.progress;
        let committed = |stream: u32| progress[stream as usize].committed;
        let staging = Self::staging(&mut self.staging).ok_or("the host lost its output memory")?;
        for stream in &STREAMS {
            if let Some(lane) = staging.lane(stream.number) {
                let kept = committed(stream.number).filter(|_| stream.is_wanted(flags));
                lane.truncate(kept.unwrap_or(0) as usize);
            }
        }
        (staging.textures, staging.meshes) = made;
        staging.trace_kinds = self.trace_kinds;
        self.checker.check(staging, share)?;
        if let Some(finished) = self.staging.take() {
            if self.spare.len() >= SPARE {
                // Left to its holders.
                self.spare.remove(0);
            }
            self.spare.push(std::mem::replace(&mut self.current, finished));
        }
        Ok(())
    }

    /// What the last checks met of a later contract, and nobody was told: a text each.
    pub(crate) fn news(&mut self) -> impl Iterator<Item = String> + '_ {
        self.checker.news()
    }

    fn refuse(&mut self, status: i32, message: String) -> i32 {
        // A stream that this host does not take may be left out; everything else is a fault that no status
        // can hide.
        if self.message.is_none() {
            self.message = Some(message.clone());
        }
        if status != abi::UNSUPPORTED && self.refused.is_none() {
            self.refused = Some(message);
        }
        status
    }

    fn reserve(&mut self, stream: u32, element_size: u32, count: u64) -> Result<*mut c_void, (i32, String)> {
        let missing = || {
            let name = Stream::numbered(stream).map_or_else(|| stream.to_string(), |s| s.name.to_owned());
            let version = version_text(abi::VERSION);
            let message = format!("stream {name}: this host (reef_sim.h {version}) does not take it");
            (abi::UNSUPPORTED, message)
        };
        let &Stream { name, limit: Some(limit), .. } = Stream::numbered(stream).ok_or_else(missing)? else {
            return Err(missing());
        };
        let staging = Self::staging(&mut self.staging)
            .ok_or_else(|| (abi::ERROR, "the host lost its output memory".to_owned()))?;
        let lane = staging.lane(stream).ok_or_else(missing)?;
        if element_size as usize != lane.element_size() {
            return Err((
                abi::BAD_INPUT,
                format!("stream {name}: elements of {element_size} bytes; they have {}", lane.element_size()),
            ));
        }
        if count > limit {
            return Err((abi::NO_SPACE, format!("stream {name}: {count} elements; the limit is {limit}")));
        }
        lane.resize(count as usize)
            .map_err(|error| (abi::NO_SPACE, format!("stream {name}: {count} elements: {error}")))?;
        let start = lane.start();
        self.progress[stream as usize] = Progress { reserved: Some(count), committed: None };
        Ok(start)
    }

    /// Did the plugin write behind the room that it reserved?
    fn look_at_fence(&mut self, stream: u32) -> Result<(), (i32, String)> {
        let reserved = self.progress.get(stream as usize).and_then(|progress| progress.reserved);
        let (Some(count), Some(staging)) = (reserved, Self::staging(&mut self.staging)) else {
            return Ok(());
        };
        let lane = staging.lane(stream);
        if lane.is_none_or(|lane| lane.is_fenced(count as usize)) {
            return Ok(());
        }
        let name = Stream::numbered(stream).map_or("unknown", |stream| stream.name);
        Err((
            abi::BAD_INPUT,
            format!("stream {name}: more was written than the {count} elements that were reserved"),
        ))
    }

    fn commit(&mut self, stream: u32, count: u64) -> Result<(), (i32, String)> {
        self.look_at_fence(stream)?;
        let name = Stream::numbered(stream).map_or("unknown", |stream| stream.name);
        match self.progress.get_mut(stream as usize) {
            Some(Progress { reserved: Some(reserved), committed }) if count <= *reserved => {
                *committed = Some(count);
                Ok(())
            }
            Some(Progress { reserved: Some(reserved), .. }) => Err((
                abi::BAD_INPUT,
                format!("stream {name}: {count} elements committed, {reserved} reserved"),
            )),
            Some(_) => Err((abi::BAD_INPUT, format!("stream {name}: committed without reserve"))),
            None => {
                Err((abi::UNSUPPORTED, format!("stream {stream}: there is none that could be committed")))
            }
        }
    }
}

/// The recorder behind a context, unless the call comes from where it must not.
///
/// # Safety
/// `ctx` is NULL or the context of [`Recorder::table`], whose step runs on this thread.
unsafe fn recorder<'a>(ctx: *mut c_void, service: &'static str) -> Option<&'a mut Recorder> {
    if marker::current_job().is_some() {
        MISPLACED.fetch_add(1, Ordering::Relaxed);
    }
    if marker::current_job().is_some() || !matches!(marker::place(), marker::Place::Plugin(_)) {
        return None; // A job, or a thread of the plugin's own: others may be in here.
    }
    let recorder = ctx.cast::<Recorder>();
    // SAFETY: a context of ours, or a fault of the plugin's code, by the marker.
    if unsafe { !tag::is_ours(recorder) } {
        guard::leave_foreign(service);
        return None;
    }
    // SAFETY: the mark says that it is the recorder of the step that runs, on this thread.
    unsafe { recorder.as_mut() }
}

/// The thread is in the host until `service` returned.
fn in_service<R>(service: impl FnOnce() -> R) -> R {
    match marker::place() {
        marker::Place::Plugin(generation) => marker::in_service(generation, service),
        _ => service(),
    }
}

unsafe extern "C" fn reserve(
    ctx: *mut c_void,
    stream: u32,
    element_size: u32,
    count: u64,
    out: *mut *mut c_void,
) -> i32 {
    guard::require_stack();
    // SAFETY: the contract's pointer.
    let Some(recorder) = (unsafe { recorder(ctx, "reserve") }) else { return abi::BAD_INPUT };
    if out.is_null() || !out.is_aligned() {
        return recorder.refuse(abi::BAD_INPUT, "reserve: the result's place is NULL or misaligned".into());
    }
    guard::probe_write(out.cast(), size_of::<*mut c_void>());
    in_service(|| match recorder.reserve(stream, element_size, count) {
        Ok(start) => {
            // SAFETY: checked and touched above.
            unsafe { out.write(start) };
            abi::OK
        }
        Err((status, message)) => recorder.refuse(status, message),
    })
}

unsafe extern "C" fn commit(ctx: *mut c_void, stream: u32, count: u64) -> i32 {
    guard::require_stack();
    // SAFETY: the contract's pointer.
    let Some(recorder) = (unsafe { recorder(ctx, "commit") }) else { return abi::BAD_INPUT };
    in_service(|| match recorder.commit(stream, count) {
        Ok(()) => abi::OK,
        Err((status, message)) => recorder.refuse(status, message),
    })
}
