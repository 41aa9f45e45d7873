//! What the host lends to a plugin's code: the functions of `reef_host`, one table an instance, so that
//! messages and memory know whose they are. Every argument is checked before use.

use std::{
    ffi::{c_char, c_void},
    slice,
    sync::{
        Arc, Mutex, PoisonError, RwLock,
        atomic::{AtomicBool, AtomicPtr, AtomicU32, AtomicU64, AtomicUsize, Ordering},
    },
};

use reef_abi as abi;
use reef_flow::{Field, Packed};

use self::{
    flow::sample_flow,
    made::{list, lock, mesh_create, mesh_destroy, texture_create, texture_destroy},
};
use crate::{
    assets::{self, Asset, Assets, Unread},
    extensions,
    generation::Generation,
    guard::{self, Fate},
    input::StepInput,
    marker::{self, Place},
    meshes::{MeshList, Meshes},
    pool::{self, Pool},
    retained::Refused,
    scratch::{LIMIT, Scratch},
    tag::{self, Tag, Tagged},
    textures::{TextureList, Textures},
};

mod flow;
mod made;

/// Longest message that is kept [bytes].
const LONGEST_TEXT: u64 = 1 << 14;

/// Most lines that one instance may write to the log: one that writes in every step must not drown the
/// others.
const MOST_LINES: u64 = 1000;

/// Most figures of one instance, and most bytes of a figure's name.
const MOST_FIGURES: usize = 32;
const LONGEST_FIGURE: u64 = 64;

/// A figure that a module shows of itself: its name and its last value.
pub type Figure = (String, f64);

/// The services of one instance (or of a library's `open`), and what they remember.
#[derive(Debug)]
pub(crate) struct Services {
    /// `ctx` leads back to this very value, which therefore never moves.
    table: abi::Host,
    tag: Tag,
    plugin: String,
    pool: Arc<Pool>,
    error: Mutex<Option<String>>,
    lines: AtomicU64,
    figures: Mutex<Vec<Figure>>,
    scratch: Mutex<Scratch>,
    in_step: AtomicBool,
    fate: Arc<Fate>,
    /// The step's flow, while a step runs.
    flow: AtomicPtr<abi::Flow>,
    flow_count: AtomicUsize,
    simd_level: AtomicU32,
    /// Made from `flow` by the first query of a step.
    field: RwLock<SteppedField>,
    /// One a worker.
    packed: Vec<Mutex<Packed>>,
    /// None: a library's `open`, which owns nothing.
    made: Option<Made>,
}

/// What an instance made, and read.
#[derive(Debug, Default)]
struct Made {
    textures: Mutex<Textures>,
    meshes: Mutex<Meshes>,
    assets: Mutex<Assets>,
}

#[derive(Debug, Default)]
struct SteppedField {
    ready: bool,
    field: Field,
}

// SAFETY: what the pointers in `table` and `flow` lead to is shared and guarded by the locks and atomics
// beside them.
unsafe impl Send for Services {}
// SAFETY: as above.
unsafe impl Sync for Services {}

impl Tagged for Services {
    const AT: usize = std::mem::offset_of!(Self, tag);
}

impl Services {
    /// Services for the `open` of a library with this name.
    pub(crate) fn new(generation: &Generation, library: &str) -> Box<Self> {
        Self::with(generation, library, None)
    }

    /// Services for an instance of the plugin with this name.
    pub(crate) fn of_instance(generation: &Generation, plugin: &str, assets: Assets) -> Box<Self> {
        Self::with(generation, plugin, Some(Made { assets: assets.into(), ..Made::default() }))
    }

    fn with(generation: &Generation, plugin: &str, made: Option<Made>) -> Box<Self> {
        let workers = generation.workers();
        let mut services = Box::new(Self {
            table: abi::Host {
                size: size_of::<abi::Host>() as u32,
                version: abi::VERSION,
                ctx: std::ptr::null_mut(),
                worker_count: workers,
                spare: 0,
                log: Some(log),
                set_error: Some(set_error),
                should_stop: Some(should_stop),
                parallel_for: Some(parallel_for),
                scratch: Some(scratch),
                sample_flow: Some(sample_flow),
                mesh_create: Some(mesh_create),
                mesh_destroy: Some(mesh_destroy),
                texture_create: Some(texture_create),
                texture_destroy: Some(texture_destroy),
                figure: Some(figure),
                asset_read: Some(asset_read),
                get_extension: Some(get_extension),
            },
            tag: Tag::default(),
            plugin: plugin.to_owned(),
            pool: generation.pool().clone(),
            error: Mutex::new(None),
            lines: AtomicU64::new(0),
            figures: Mutex::default(),
            scratch: Mutex::default(),
            in_step: AtomicBool::new(false),
            fate: generation.fate().clone(),
            flow: AtomicPtr::default(),
            flow_count: AtomicUsize::new(0),
            simd_level: AtomicU32::new(0),
            field: RwLock::default(),
            packed: (0..workers).map(|_| Mutex::default()).collect(),
            made,
        });
        services.table.ctx = (&raw const *services).cast_mut().cast();
        services.tag.set();
        services
    }

    /// The table to hand out; it lives as long as this value.
    pub(crate) fn table(&self) -> *const abi::Host {
        &self.table
    }

    /// The message that the last failure left, if it left one.
    pub(crate) fn take_error(&self) -> Option<String> {
        self.error.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// What the module shows of itself, in the order in which it first did.
    pub(crate) fn figures(&self) -> Vec<Figure> {
        self.figures.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// A call begins: an older call's message is not this one's.
    pub(crate) fn begin_call(&self) {
        self.take_error();
    }

    /// A call is over: what was lent for it is gone.
    pub(crate) fn end_call(&self) {
        if let Some(made) = &self.made {
            lock(&made.assets).end_call();
        }
    }

    /// A step begins: its scratch memory and its flow.
    pub(crate) fn begin_step(&self, input: &StepInput<'_>) {
        self.begin_call();
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner).begin_step();
        self.field.write().unwrap_or_else(PoisonError::into_inner).ready = false;
        self.flow_count.store(input.flow.len(), Ordering::Relaxed);
        self.simd_level.store(input.simd_level, Ordering::Relaxed);
        self.flow.store(input.flow.as_ptr().cast_mut(), Ordering::Relaxed);
        self.in_step.store(true, Ordering::Release);
    }

    /// The step is over: nothing of its input is looked at any more.
    pub(crate) fn end_step(&self) {
        self.in_step.store(false, Ordering::Release);
        self.flow_count.store(0, Ordering::Relaxed);
        self.flow.store(std::ptr::null_mut(), Ordering::Relaxed);
    }

    /// The textures that there are now.
    pub(crate) fn textures(&self) -> TextureList {
        self.made.as_ref().map_or_else(TextureList::default, |made| list(&made.textures))
    }

    /// The meshes that there are now.
    pub(crate) fn meshes(&self) -> MeshList {
        self.made.as_ref().map_or_else(MeshList::default, |made| list(&made.meshes))
    }

    /// The files that the instance has read.
    pub(crate) fn assets(&self) -> Vec<Asset> {
        self.made.as_ref().map_or_else(Vec::new, |made| lock(&made.assets).all())
    }

    /// What was refused of the instance's meshes so far.
    pub(crate) fn refused_meshes(&self) -> Refused {
        self.made.as_ref().map_or_else(Refused::default, |made| lock(&made.meshes).refused.clone())
    }

    /// What was refused of the instance's textures so far.
    pub(crate) fn refused_textures(&self) -> Refused {
        self.made.as_ref().map_or_else(Refused::default, |made| lock(&made.textures).refused.clone())
    }

    /// Did the step write behind what it was lent?
    pub(crate) fn scratch_is_whole(&self) -> Result<(), String> {
        let scratch = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        match scratch.overrun() {
            None => Ok(()),
            Some(bytes) => Err(format!("scratch: more was written than the {bytes} bytes that were lent")),
        }
    }

    /// Between two steps: scratch memory holds nonsense.
    pub(crate) fn soil(&self) {
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner).soil();
    }

    fn fail(&self, status: i32, message: String) -> i32 {
        *self.error.lock().unwrap_or_else(PoisonError::into_inner) = Some(message);
        status
    }

    /// Takes over a plugin's text, then serves it as the host.
    fn serve(&self, message: *const c_char, length: u64, service: impl FnOnce(String)) {
        guard::require_stack();
        guard::probe_read(message.cast(), length.min(LONGEST_TEXT) as usize);
        marker::in_service(self.fate.generation(), || {
            // SAFETY: the contract's pointer and length, which were just touched.
            service(unsafe { text(message, length) });
        });
    }

    fn on_a_thread_of_ours(&self) -> bool {
        marker::place() == Place::Plugin(self.fate.generation())
    }
}

/// The services behind a context; None for NULL.
///
/// # Safety
/// `ctx` is whatever a plugin passed; where it is the context that [`Services::new`] made, its value is
/// alive.
unsafe fn services<'a>(ctx: *mut c_void, service: &'static str) -> Option<&'a Services> {
    let services = ctx.cast_const().cast::<Services>();
    if services.is_null() {
        return None;
    }
    // SAFETY: a context of ours, or a fault of the plugin's code, by the marker.
    if unsafe { !tag::is_ours(services) } {
        guard::leave_foreign(service);
        return None;
    }
    // SAFETY: the mark says that it is a context of ours.
    unsafe { services.as_ref() }
}

/// A plugin's text, made whole where it is not UTF-8 and cut where it is endless.
///
/// # Safety
/// The pointer is NULL or leads to `length` bytes.
unsafe fn text(pointer: *const c_char, length: u64) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: the caller's promise; cutting reads less.
    let bytes = unsafe { slice::from_raw_parts(pointer.cast::<u8>(), length.min(LONGEST_TEXT) as usize) };
    let mut text = String::from_utf8_lossy(bytes).into_owned();
    if length > LONGEST_TEXT {
        text.push_str(" …");
    }
    text
}

unsafe extern "C" fn log(ctx: *mut c_void, level: u32, message: *const c_char, length: u64) {
    // SAFETY: the contract's pointer.
    let Some(services) = (unsafe { services(ctx, "log") }) else { return };
    services.serve(message, length, |message| {
        let line = services.lines.fetch_add(1, Ordering::Relaxed);
        if line >= MOST_LINES {
            return;
        }
        let plugin = services.plugin.as_str();
        if line + 1 == MOST_LINES {
            tracing::warn!(target: "reef::plugin", plugin, "its {MOST_LINES}th line: no more of it is shown");
        }
        match level {
            abi::LOG_ERROR => tracing::error!(target: "reef::plugin", plugin, "{message}"),
            abi::LOG_WARN => tracing::warn!(target: "reef::plugin", plugin, "{message}"),
            abi::LOG_INFO => tracing::info!(target: "reef::plugin", plugin, "{message}"),
            _ => tracing::debug!(target: "reef::plugin", plugin, "{message}"),
        }
    });
}

unsafe extern "C" fn set_error(ctx: *mut c_void, message: *const c_char, length: u64) {
    // SAFETY: the contract's pointer.
    let Some(services) = (unsafe { services(ctx, "set_error") }) else { return };
    services.serve(message, length, |message| {
        services.fail(abi::OK, message);
    });
}

unsafe extern "C" fn figure(ctx: *mut c_void, name: *const c_char, length: u64, value: f64) {
    // SAFETY: the contract's pointer.
    let Some(services) = (unsafe { services(ctx, "figure") }) else { return };
    if name.is_null() || length > LONGEST_FIGURE {
        return;
    }
    guard::require_stack();
    guard::probe_read(name.cast(), length as usize);
    marker::in_service(services.fate.generation(), || {
        // SAFETY: the contract's pointer and length, which were just touched.
        let name = unsafe { slice::from_raw_parts(name.cast::<u8>(), length as usize) };
        let mut figures = services.figures.lock().unwrap_or_else(PoisonError::into_inner);
        let room = figures.len() < MOST_FIGURES;
        match figures.iter_mut().find(|(known, _)| known.as_bytes() == name) {
            Some((_, last)) => *last = value,
            None if room => {
                if let Ok(name) = std::str::from_utf8(name) {
                    figures.push((name.to_owned(), value));
                }
            }
            None => {}
        }
    });
}

unsafe extern "C" fn should_stop(ctx: *mut c_void) -> u32 {
    // SAFETY: the contract's pointer.
    unsafe { services(ctx, "should_stop") }.is_some_and(|services| services.fate.asked_to_stop()).into()
}

unsafe extern "C" fn parallel_for(ctx: *mut c_void, count: u32, job: abi::Job, user: *mut c_void) -> i32 {
    // SAFETY: the contract's pointer.
    let Some(services) = (unsafe { services(ctx, "parallel_for") }) else { return abi::BAD_INPUT };
    let Some(job) = pool::job_of(job) else {
        return services.fail(abi::BAD_INPUT, "parallel_for: the job is NULL".into());
    };
    if !services.on_a_thread_of_ours() {
        return services.fail(abi::BAD_INPUT, "parallel_for: not on a thread of the host".into());
    }
    guard::require_stack();
    if let Some(worker) = marker::current_job() {
        // A job's own loop runs inline, as the same worker, within the job's guard.
        for index in 0..count {
            // SAFETY: the plugin says that `job` may be called with `user`.
            unsafe { job(user, index, worker) };
        }
        return abi::OK;
    }
    let fault = marker::in_service(services.fate.generation(), || {
        // SAFETY: the plugin says that `job` may be called with `user` from several threads; no job runs on
        // this thread of ours, so it is the control thread.
        unsafe { services.pool.run(count, job, user) }
    });
    match fault {
        None => abi::OK,
        // What the job left behind is in no state that its caller could go on with.
        Some(fault) => guard::leave(fault),
    }
}

unsafe extern "C" fn scratch(ctx: *mut c_void, bytes: u64, align: u64, out: *mut *mut c_void) -> i32 {
    // SAFETY: the contract's pointer.
    let Some(services) = (unsafe { services(ctx, "scratch") }) else { return abi::BAD_INPUT };
    if out.is_null() || !out.is_aligned() {
        return services.fail(abi::BAD_INPUT, "scratch: the result's place is NULL or misaligned".into());
    }
    if !services.in_step.load(Ordering::Acquire) || marker::current_job().is_some() {
        return services.fail(abi::BAD_INPUT, "scratch: only in a step, and not in a job".into());
    }
    guard::require_stack();
    guard::probe_write(out.cast(), size_of::<*mut c_void>());
    marker::in_service(services.fate.generation(), || {
        match services.scratch.lock().unwrap_or_else(PoisonError::into_inner).take(bytes, align) {
            Some(memory) => {
                // SAFETY: checked and touched above.
                unsafe { out.write(memory.as_ptr().cast()) };
                abi::OK
            }
            None => services.fail(
                abi::NO_SPACE,
                format!(
                    "scratch: {bytes} bytes aligned to {align}: at most {LIMIT} bytes a step, alignments to 4096"
                ),
            ),
        }
    })
}

/// Lends the bytes of one of the module's own files.
unsafe extern "C" fn asset_read(
    ctx: *mut c_void,
    name: *const c_char,
    length: u64,
    out_bytes: *mut *const c_void,
    out_length: *mut u64,
) -> i32 {
    // SAFETY: the contract's pointer.
    let Some(services) = (unsafe { services(ctx, "asset_read") }) else { return abi::BAD_INPUT };
    let refuse = |status: i32, reason: &str| services.fail(status, format!("asset_read: {reason}"));
    let unusable = out_bytes.is_null() || !out_bytes.is_aligned() || out_length.is_null();
    if unusable || !out_length.is_aligned() || name.is_null() || length > assets::LONGEST_NAME {
        return refuse(abi::BAD_INPUT, "the name or the results' place is NULL, misaligned or too long");
    }
    let Some(made) = &services.made else {
        return refuse(abi::BAD_INPUT, "files belong to an instance: not in open()");
    };
    if !services.on_a_thread_of_ours()
        || marker::current_job().is_some()
        || services.in_step.load(Ordering::Acquire)
    {
        return refuse(abi::BAD_INPUT, "only on the control thread, and not in a step");
    }
    guard::require_stack();
    guard::probe_read(name.cast(), length as usize);
    guard::probe_write(out_bytes.cast(), size_of::<*const c_void>());
    guard::probe_write(out_length.cast(), size_of::<u64>());
    marker::in_service(services.fate.generation(), || {
        // SAFETY: the contract's pointer and length, which were just touched.
        let name = unsafe { slice::from_raw_parts(name.cast::<u8>(), length as usize) };
        let Ok(name) = std::str::from_utf8(name) else {
            return refuse(abi::BAD_INPUT, "the name is not UTF-8");
        };
        let mut assets = lock(&made.assets);
        match assets.read(name) {
            Ok(bytes) => {
                // SAFETY: checked and touched above.
                unsafe {
                    out_bytes.write(bytes.as_ptr().cast());
                    out_length.write(bytes.len() as u64);
                }
                abi::OK
            }
            Err(Unread::Unfit(reason)) => refuse(abi::BAD_INPUT, &reason),
            Err(Unread::TooMuch(reason)) => refuse(abi::NO_SPACE, &reason),
        }
    })
}

unsafe extern "C" fn get_extension(ctx: *mut c_void, id: *const c_char) -> *const c_void {
    // SAFETY: the contract's pointer.
    let Some(services) = (unsafe { services(ctx, "get_extension") }) else { return std::ptr::null() };
    if id.is_null() {
        return std::ptr::null();
    }
    guard::require_stack();
    // The plugin's text, touched byte by byte while the marker says that it is the plugin's fault if there is
    // none.
    let mut length = 0;
    while length < extensions::LONGEST_ID {
        guard::probe_read(id.wrapping_add(length).cast(), 1);
        // SAFETY: touched above.
        if unsafe { *id.wrapping_add(length) } == 0 {
            break;
        }
        length += 1;
    }
    marker::in_service(services.fate.generation(), || {
        // SAFETY: touched above.
        extensions::find(unsafe { slice::from_raw_parts(id.cast::<u8>(), length) })
    })
}
