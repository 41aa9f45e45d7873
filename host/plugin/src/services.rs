//! What the host lends to a plugin's code: the functions of `reef_host`, one table an instance, so that
//! messages and memory know whose they are. Every argument is checked before use.

use std::{
    ffi::{c_char, c_void},
    slice,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError, RwLock,
        atomic::{AtomicBool, AtomicPtr, AtomicU32, AtomicU64, AtomicUsize, Ordering},
    },
};

use reef_abi as abi;
use reef_flow::{Field, Level, Packed, sample};

use super::{
    assets::{self, Asset, Assets, Unread},
    extensions,
    generation::Generation,
    guard::{self, Fate},
    input::StepInput,
    marker::{self, Place},
    meshes::{self, MeshList, Meshes},
    pool::{self, Pool},
    retained::{self, Refused, Retained, Store},
    scratch::{LIMIT, Scratch},
    tag::{self, Tag, Tagged},
    textures::{TextureList, Textures, Wanted},
};

/// Longest message that is kept [bytes].
const LONGEST_TEXT: u64 = 1 << 14;

/// Most bytes of a texture's name that are read.
const LONGEST_NAME: usize = 1 << 10;

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
    pub(super) fn refused_meshes(&self) -> Refused {
        self.made.as_ref().map_or_else(Refused::default, |made| lock(&made.meshes).refused.clone())
    }

    /// What was refused of the instance's textures so far.
    pub(super) fn refused_textures(&self) -> Refused {
        self.made.as_ref().map_or_else(Refused::default, |made| lock(&made.textures).refused.clone())
    }

    /// Did the step write behind what it was lent?
    pub(super) fn scratch_is_whole(&self) -> Result<(), String> {
        let scratch = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        match scratch.overrun() {
            None => Ok(()),
            Some(bytes) => Err(format!("scratch: more was written than the {bytes} bytes that were lent")),
        }
    }

    /// Between two steps: scratch memory holds nonsense.
    pub(super) fn soil(&self) {
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

    /// Why something was refused, which is remembered where it is the plugin's fault.
    fn refuse<T>(&self, store: Option<&Mutex<Store<T>>>, call: &str, status: i32, reason: &str) -> i32 {
        if let (abi::BAD_INPUT, Some(store)) = (status, store) {
            lock(store).refused.unfit.get_or_insert_with(|| reason.to_owned());
        }
        self.fail(status, format!("{call}: {reason}"))
    }

    /// Whether an instance may make or destroy something in this call.
    fn may_make<'a, T>(
        &'a self,
        store: Option<&'a Mutex<Store<T>>>,
    ) -> Result<&'a Mutex<Store<T>>, &'static str> {
        let store = store.ok_or("it belongs to an instance: not in open()")?;
        if !self.on_a_thread_of_ours() || marker::current_job().is_some() {
            return Err("only on the control thread, and not in a job");
        }
        Ok(store)
    }

    /// Forgets something that an instance made.
    fn destroy<T: Retained>(&self, store: Option<&Mutex<Store<T>>>, call: &str, id: u32) -> i32 {
        let store = match self.may_make(store) {
            Ok(store) => store,
            Err(reason) => return self.fail(abi::BAD_INPUT, format!("{call}: {reason}")),
        };
        guard::require_stack();
        marker::in_service(self.fate.generation(), || {
            let removed = lock(store).remove(id);
            match removed {
                Ok(()) => abi::OK,
                Err(reason) => self.fail(abi::BAD_INPUT, format!("{call}: {reason}")),
            }
        })
    }

    fn on_a_thread_of_ours(&self) -> bool {
        marker::place() == Place::Plugin(self.fate.generation())
    }

    fn sample(&self, query: &abi::FlowQuery) -> i32 {
        let count = query.count as usize;
        if count == 0 {
            return abi::OK;
        }
        let inputs = [query.x, query.y, query.z];
        let outputs = [query.vx, query.vy, query.vz];
        let unusable = inputs.iter().any(|p| p.is_null() || !p.is_aligned())
            || outputs.iter().any(|p| p.is_null() || !p.is_aligned())
            || !query.owners.is_aligned();
        if unusable {
            return self.fail(abi::BAD_INPUT, "sample_flow: a pointer is NULL or misaligned".into());
        }
        if !query.origin.iter().all(|v| v.is_finite()) {
            return self.fail(abi::BAD_INPUT, "sample_flow: the origin is not finite".into());
        }
        let worker = marker::current_job().unwrap_or(0) as usize;
        let Some(packed) = self.packed.get(worker) else {
            return self.fail(abi::BAD_INPUT, "sample_flow: not on a thread of the host".into());
        };
        {
            let stepped = self.field.read().unwrap_or_else(PoisonError::into_inner);
            if !stepped.ready {
                drop(stepped);
                self.prepare_field();
            }
        }
        let stepped = self.field.read().unwrap_or_else(PoisonError::into_inner);
        let mut packed = packed.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: seven arrays of `count` elements, as the contract says; they are the caller's and live
        // during the call. The outputs are checked to be non-NULL and aligned; that they do not overlap is
        // the contract's word.
        let (points, out, owner) = unsafe {
            let [x, y, z] = inputs.map(|p| slice::from_raw_parts(p, count));
            let [vx, vy, vz] = outputs.map(|p| slice::from_raw_parts_mut(p, count));
            let owner = if query.owners.is_null() {
                sample::Owner::One(query.owner)
            } else {
                sample::Owner::Each(slice::from_raw_parts(query.owners, count))
            };
            (sample::Points { x, y, z }, sample::Velocities { x: vx, y: vy, z: vz }, owner)
        };
        let level = Level::at_most(self.simd_level.load(Ordering::Relaxed));
        sample::sample_field(level, &stepped.field, &mut packed, query.origin, owner, points, out);
        abi::OK
    }

    fn prepare_field(&self) {
        let mut stepped = self.field.write().unwrap_or_else(PoisonError::into_inner);
        if !stepped.ready {
            let (flow, count) = (self.flow.load(Ordering::Relaxed), self.flow_count.load(Ordering::Relaxed));
            // SAFETY: `begin_step` took both from one slice, which lives until `end_step`; a slice's pointer
            // is never NULL, and the empty case does not read it.
            let flow = if count == 0 { &[] } else { unsafe { slice::from_raw_parts(flow, count) } };
            stepped.field.refill(flow);
            stepped.ready = true;
        }
    }
}

fn lock<T>(store: &Mutex<T>) -> MutexGuard<'_, T> {
    store.lock().unwrap_or_else(PoisonError::into_inner)
}

fn list<T: Retained>(store: &Mutex<Store<T>>) -> retained::List<T> {
    lock(store).list().clone()
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

unsafe extern "C" fn sample_flow(ctx: *mut c_void, query: *const abi::FlowQuery) -> i32 {
    // SAFETY: the contract's pointer.
    let Some(services) = (unsafe { services(ctx, "sample_flow") }) else { return abi::BAD_INPUT };
    if query.is_null() || !query.is_aligned() {
        return services.fail(abi::BAD_INPUT, "sample_flow: the query is NULL or misaligned".into());
    }
    if !services.on_a_thread_of_ours() || !services.in_step.load(Ordering::Acquire) {
        return services.fail(abi::BAD_INPUT, "sample_flow: only in a step".into());
    }
    guard::require_stack();
    // SAFETY: checked above; the query lives during the call.
    let query = unsafe { *query };
    if query.spare != 0 {
        return services.fail(abi::BAD_INPUT, "sample_flow: the query's spare is not zero".into());
    }
    let length = query.count as usize * size_of::<f32>();
    [query.x, query.y, query.z].iter().for_each(|points| guard::probe_read(points.cast(), length));
    [query.vx, query.vy, query.vz].iter().for_each(|out| guard::probe_write(out.cast(), length));
    if !query.owners.is_null() {
        guard::probe_read(query.owners.cast(), query.count as usize * size_of::<u64>());
    }
    marker::in_service(services.fate.generation(), || services.sample(&query))
}

/// Looks at a mesh that a plugin wants, touches all that it points to, and takes it over.
unsafe extern "C" fn mesh_create(ctx: *mut c_void, mesh: *const abi::Mesh, out: *mut u32) -> i32 {
    // SAFETY: the contract's pointer.
    let Some(services) = (unsafe { services(ctx, "mesh_create") }) else { return abi::BAD_INPUT };
    let store = services.made.as_ref().map(|made| &made.meshes);
    let refuse = |status: i32, reason: &str| services.refuse(store, "mesh_create", status, reason);
    if mesh.is_null() || !mesh.is_aligned() || out.is_null() || !out.is_aligned() {
        return refuse(abi::BAD_INPUT, "the mesh or its id's place is NULL or misaligned");
    }
    let meshes = match services.may_make(store) {
        Ok(meshes) => meshes,
        Err(reason) => return refuse(abi::BAD_INPUT, reason),
    };
    guard::require_stack();
    // SAFETY: checked above; it lives during the call.
    let mesh = unsafe { *mesh };
    // SAFETY: a plugin's word; if it lied, the guard around its call takes the fault.
    let name = unsafe { short_name(mesh.name) };
    let unfit = |reason: &str| refuse(abi::BAD_INPUT, &format!("`{name}`: {reason}"));
    let sizes = meshes::Sizes {
        vertices: mesh.vertex_count,
        indices: mesh.index_count,
        levels: mesh.level_count,
        joints: mesh.joint_count,
        influences: mesh.influences,
    };
    if let Err(reason) = sizes.check() {
        return unfit(&reason);
    }
    if mesh.spare != [0; 2] {
        return unfit("spare is not zero");
    }
    if let unknown @ 1.. = mesh.flags & !meshes::FLAGS {
        return refuse(abi::UNSUPPORTED, &format!("`{name}`: its flags {unknown:#x} are not known here"));
    }
    let bones = mesh.vertex_count as usize * mesh.influences as usize;
    // SAFETY: the contract's arrays of as many elements; each is touched before it becomes a slice.
    let arrays = unsafe {
        array(mesh.vertices, mesh.vertex_count as usize, "vertices").and_then(|vertices| {
            Ok(meshes::Wanted {
                name: &name,
                vertices,
                indices: array(mesh.indices, mesh.index_count as usize, "indices")?,
                levels: array(mesh.levels, mesh.level_count as usize, "levels")?,
                rest: array(mesh.rest, mesh.joint_count as usize, "rest")?,
                influences: mesh.influences,
                joints: array(mesh.joints, bones, "joints")?,
                weights: array(mesh.weights, bones, "weights")?,
                flags: mesh.flags,
            })
        })
    };
    let wanted = match arrays {
        Ok(wanted) => wanted,
        Err(reason) => return unfit(&reason),
    };
    guard::probe_write(out.cast(), size_of::<u32>());
    marker::in_service(services.fate.generation(), || {
        let made = lock(meshes).add(wanted);
        match made {
            Ok(Ok(id)) => {
                // SAFETY: checked and touched above.
                unsafe { out.write(id) };
                abi::OK
            }
            Ok(Err(reason)) => refuse(abi::NO_SPACE, &reason),
            Err(reason) => unfit(&reason),
        }
    })
}

/// A plugin's array, touched from end to end; empty where it has no elements.
///
/// # Safety
/// A pointer that is neither NULL nor misaligned is the contract's, to `count` elements that live for `'a`.
unsafe fn array<'a, T: bytemuck::Pod>(
    pointer: *const T,
    count: usize,
    what: &str,
) -> Result<&'a [T], String> {
    match count {
        0 => Ok(&[]),
        _ if pointer.is_null() || !pointer.is_aligned() => Err(format!("{what} are NULL or misaligned")),
        _ => {
            guard::probe_read(pointer.cast(), count * size_of::<T>());
            // SAFETY: the caller's promise.
            Ok(unsafe { slice::from_raw_parts(pointer, count) })
        }
    }
}

unsafe extern "C" fn mesh_destroy(ctx: *mut c_void, id: u32) -> i32 {
    // SAFETY: the contract's pointer.
    let Some(services) = (unsafe { services(ctx, "mesh_destroy") }) else { return abi::BAD_INPUT };
    services.destroy(services.made.as_ref().map(|made| &made.meshes), "mesh_destroy", id)
}

/// Looks at a texture that a plugin wants, touches all that it points to, and takes it over.
unsafe extern "C" fn texture_create(ctx: *mut c_void, texture: *const abi::Texture, out: *mut u32) -> i32 {
    // SAFETY: the contract's pointer.
    let Some(services) = (unsafe { services(ctx, "texture_create") }) else { return abi::BAD_INPUT };
    let store = services.made.as_ref().map(|made| &made.textures);
    let refuse = |status: i32, reason: &str| services.refuse(store, "texture_create", status, reason);
    if texture.is_null() || !texture.is_aligned() || out.is_null() || !out.is_aligned() {
        return refuse(abi::BAD_INPUT, "the texture or its id's place is NULL or misaligned");
    }
    let textures = match services.may_make(store) {
        Ok(textures) => textures,
        Err(reason) => return refuse(abi::BAD_INPUT, reason),
    };
    guard::require_stack();
    // SAFETY: checked above; it lives during the call.
    let texture = unsafe { *texture };
    // SAFETY: a plugin's word; if it lied, the guard around its call takes the fault.
    let name = unsafe { short_name(texture.name) };
    if texture.format > abi::TEXTURE_RGBA8 {
        let format = texture.format;
        return refuse(abi::UNSUPPORTED, &format!("`{name}`: its format {format} is not known here"));
    }
    if texture.spare != [0; 3] {
        return refuse(abi::BAD_INPUT, &format!("`{name}`: spare is not zero"));
    }
    let wanted = Wanted { name: &name, format: texture.format, width: texture.width, height: texture.height };
    let bytes = match wanted.bytes() {
        Ok(bytes) => bytes,
        Err(reason) => return refuse(abi::BAD_INPUT, &reason),
    };
    // SAFETY: the contract's texels, as many as the texture's size says.
    let texels = match unsafe { array(texture.texels.cast::<u8>(), bytes, "its texels") } {
        Ok(texels) => texels,
        Err(reason) => return refuse(abi::BAD_INPUT, &format!("`{name}`: {reason}")),
    };
    guard::probe_write(out.cast(), size_of::<u32>());
    marker::in_service(services.fate.generation(), || {
        let made = lock(textures).add(wanted, texels);
        match made {
            Ok(id) => {
                // SAFETY: checked and touched above.
                unsafe { out.write(id) };
                abi::OK
            }
            Err(reason) => refuse(abi::NO_SPACE, &reason),
        }
    })
}

unsafe extern "C" fn texture_destroy(ctx: *mut c_void, id: u32) -> i32 {
    // SAFETY: the contract's pointer.
    let Some(services) = (unsafe { services(ctx, "texture_destroy") }) else { return abi::BAD_INPUT };
    services.destroy(services.made.as_ref().map(|made| &made.textures), "texture_destroy", id)
}

/// A plugin's name for something, cut where it is endless; empty for NULL.
///
/// # Safety
/// The pointer is NULL or leads to a text that ends with NUL.
unsafe fn short_name(pointer: *const c_char) -> String {
    let mut bytes = Vec::new();
    while !pointer.is_null() && bytes.len() < LONGEST_NAME {
        // SAFETY: the caller's promise: no NUL came before.
        match unsafe { pointer.add(bytes.len()).read() } {
            0 => break,
            byte => bytes.push(byte as u8),
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
