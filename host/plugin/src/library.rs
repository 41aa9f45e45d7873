//! One library: looked at, copied to a name of its own, opened on the threads of its generation, described.

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    thread,
};

use reef_abi as abi;

use super::{
    copies,
    error::Refusal,
    generation::Generation,
    guard::Text,
    image::Image,
    info::{self, PluginInfo, read_sized},
    inspect::{self, CONTRACT, Head},
    life::{self, Life},
    names::{status_name, version_text},
    probe,
    services::Services,
};

/// Most plugins in one library.
const MOST_PLUGINS: u32 = 64;

/// Addresses of the entries of all loaded generations, and whose they are (the name of the copy): the
/// system's loader must not hand one out twice.
static ENTRIES: Mutex<Option<HashMap<usize, PathBuf>>> = Mutex::new(None);

/// A library that is open. Closed when the last plugin and instance of it are gone.
#[derive(Debug)]
pub struct Library {
    /// None only while it is dropped.
    open: Option<Open>,
    path: Option<PathBuf>,
    notes: Vec<String>,
}

/// One plugin of a library.
#[derive(Clone, Debug)]
pub struct Plugin {
    library: Arc<Library>,
    descriptor: abi::Descriptor,
    info: Arc<PluginInfo>,
}

// SAFETY: the descriptor's pointers lead to constants of the library, which is open as long as `library`
// lives; its function is called on the generation's control thread only.
unsafe impl Send for Plugin {}
// SAFETY: as above.
unsafe impl Sync for Plugin {}

#[derive(Debug)]
struct Open {
    entry: Entry,
    services: Box<Services>,
    generation: Generation,
    loaded: Option<Loaded>,
}

/// The library's entry: a constant of the library.
#[derive(Clone, Copy, Debug)]
struct Entry(abi::Entry);

// SAFETY: its pointers lead to constants of the library; its functions are called on the control thread only.
unsafe impl Send for Entry {}
// SAFETY: as above.
unsafe impl Sync for Entry {}

/// A list of descriptors, on its way to the control thread.
struct List(*const *const abi::Descriptor);

// SAFETY: a constant of the library, which is read on the control thread.
unsafe impl Send for List {}

/// A descriptor, on its way back.
struct Described(abi::Descriptor);

// SAFETY: its pointers lead to constants of the library; see `Plugin`.
unsafe impl Send for Described {}

/// What the system's loader returned.
#[derive(Debug)]
struct Loaded {
    handle: libloading::Library,
    address: usize,
    /// The copy's, under which the system's loader knows it. The file itself is gone.
    name: PathBuf,
    /// The file's that it is a copy of, in messages.
    file: String,
    /// Its constructors ran: its destructors will.
    begun: Option<Begun>,
}

/// A library whose constructors the host ran.
#[derive(Clone, Debug)]
struct Begun {
    life: Life,
    base: usize,
}

/// Libraries that were closed and stayed in the process all the same.
static PINNED: AtomicU64 = AtomicU64::new(0);

/// How many closed libraries the system's loader kept: something of theirs (a thread-local on a thread of the
/// host's own, a symbol that must be unique) still stands. Each costs its size in memory until the program
/// ends.
pub fn pinned() -> u64 {
    PINNED.load(Ordering::Relaxed)
}

impl Library {
    /// Loads a file on `workers` threads of its own. Nothing of it runs before it was found to be a plugin
    /// for this host.
    pub fn load(path: &Path, workers: usize) -> Result<(Arc<Self>, Vec<Plugin>), Refusal> {
        Self::load_image(path, &inspect::read(path)?, workers)
    }

    /// The same for a file that was read before: what was looked at is what gets loaded, whatever happens to
    /// the file.
    pub fn load_image(
        path: &Path,
        image: &Image<'_>,
        workers: usize,
    ) -> Result<(Arc<Self>, Vec<Plugin>), Refusal> {
        Self::open_image(path, image, workers)?.describe()
    }

    /// The same for a build that nobody has loaded yet, where a sea runs: another process's loader takes it
    /// first.
    pub fn load_new_image(
        path: &Path,
        image: &Image<'_>,
        workers: usize,
    ) -> Result<(Arc<Self>, Vec<Plugin>), Refusal> {
        Self::open_with(path, image, workers, probe::glance)?.describe()
    }

    /// Loads and opens a library whose descriptors nobody has read yet.
    pub fn open_image(path: &Path, image: &Image<'_>, workers: usize) -> Result<Self, Refusal> {
        Self::open_with(path, image, workers, |_| Ok(()))
    }

    /// The same, when `look` has looked at the copy that is about to be loaded.
    fn open_with(
        path: &Path,
        image: &Image<'_>,
        workers: usize,
        look: impl Fn(&Path) -> Result<(), Refusal>,
    ) -> Result<Self, Refusal> {
        let head = inspect::inspect(image)?;
        let note = inspect::judge(head, CONTRACT)?;
        let generation = start(workers)?;
        let name = file_name(path);
        let life = Life::of(image);
        // Constructors of what the library needs run here: not on the caller's thread.
        let open = |copy: &Path| {
            look(copy)?;
            generation.enter(&name, "load", || open_file(copy)).map_err(Refusal::Fault)?
        };
        let ((handle, base, address), copy) = copies::with_copy(path, image, life.tags(), open)?;
        let (loaded, entry) =
            (Loaded { handle, address, name: copy, file: name.clone(), begun: None }, address);
        generation.fate().set_text(Text::of(address));
        // From here on, dropping `open` unloads the library again.
        let services = Services::new(&generation, &name);
        let mut open = Open { entry: Entry(NO_ENTRY), services, generation, loaded: Some(loaded) };
        open.claim_address()?;
        open.begin(&name, Begun { life, base })?;
        // SAFETY: `inspect` found an exported entry of this contract at the symbol, which is as long as it
        // says.
        let entry = unsafe { read_entry(entry as *const abi::Entry) };
        let seen = Head { size: entry.size, version: entry.version, header_hash: entry.header_hash };
        if entry.magic != abi::MAGIC || seen != head {
            return Err(Refusal::BadEntry("in memory it differs from the file".into()));
        }
        open.entry = Entry(entry);
        Self::open(open, Some(path.to_owned()), note)
    }

    /// A library that is linked into the program (models in tests and benches): the same path without a file.
    pub fn from_entry(
        entry: &'static abi::Entry,
        workers: usize,
    ) -> Result<(Arc<Self>, Vec<Plugin>), Refusal> {
        let head = Head { size: entry.size, version: entry.version, header_hash: entry.header_hash };
        if entry.magic != abi::MAGIC {
            return Err(Refusal::BadEntry("it does not begin with REEF_MAGIC".into()));
        }
        let note = inspect::judge(head, CONTRACT)?;
        let generation = start(workers)?;
        let services = Services::new(&generation, "linked");
        let open = Open { entry: Entry(*entry), services, generation, loaded: None };
        Self::open(open, None, note)?.describe()
    }

    /// Opens the library.
    fn open(open: Open, path: Option<PathBuf>, note: Option<String>) -> Result<Self, Refusal> {
        let entry = open.entry;
        let (Some(open_library), Some(_)) = (entry.0.open, entry.0.close) else {
            return Err(Refusal::BadEntry("its open or close is NULL".into()));
        };
        if entry.0.spare != 0 {
            return Err(Refusal::BadEntry(format!("its spare field is {:#x}, allowed is 0", entry.0.spare)));
        }
        let mut library = Self { open: None, path, notes: note.into_iter().collect() };
        open.services.begin_call();
        // SAFETY: the entry's function with the host's table, which lives until close() returned.
        let call = || unsafe { open_library(open.services.table()) };
        let status = open.generation.enter(&library.name(), "open", call).map_err(Refusal::Fault)?;
        if status != abi::OK {
            let message = open.services.take_error();
            let message = message.unwrap_or_else(|| format!("it returned {}", status_name(status)));
            return Err(Refusal::Open(message));
        }
        // From here on, dropping the library calls close().
        library.open = Some(open);
        Ok(library)
    }

    /// Reads what the library says of itself.
    fn describe(mut self) -> Result<(Arc<Self>, Vec<Plugin>), Refusal> {
        let entry = self.raw_entry();
        let count = entry.descriptor_count;
        if !(1..=MOST_PLUGINS).contains(&count) {
            return Err(Refusal::BadDescriptor(format!(
                "it has {count} plugins; allowed is 1 to {MOST_PLUGINS}"
            )));
        }
        let list = entry.descriptors;
        if list.is_null() || !list.is_aligned() {
            return Err(Refusal::BadDescriptor("its list of descriptors is NULL or misaligned".into()));
        }
        let contract = version_text(entry.version);
        // What a pointer of a descriptor leads to is read as if it were the library's code: it may lead
        // nowhere.
        let (source, list) = (self.path.clone(), List(list));
        let read = self.enter("descriptor", move || {
            let List(list) = { list };
            let (mut described, mut notes) = (Vec::new(), Vec::new());
            for i in 0..count as usize {
                // SAFETY: the entry says that the list has `count` pointers, each to a descriptor as long as
                // it says.
                let descriptor = unsafe { read_sized(*list.add(i)) }
                    .ok_or_else(|| format!("descriptor {i} is NULL or misaligned"))?;
                // SAFETY: the descriptor's pointers are as the contract says.
                let info = unsafe { info::read(&descriptor, source.clone(), contract.clone(), &mut notes) }?;
                described.push((Described(descriptor), Arc::new(info)));
            }
            Ok::<_, String>((described, notes))
        });
        let (described, notes) = read.map_err(Refusal::Fault)?.map_err(Refusal::BadDescriptor)?;
        self.notes.extend(notes);
        let library = Arc::new(self);
        let plugins = described
            .into_iter()
            .map(|(Described(descriptor), info)| Plugin { library: library.clone(), descriptor, info })
            .collect();
        Ok((library, plugins))
    }

    /// The entry as the library has it. The pointers in it lead to constants of the library.
    pub(super) fn raw_entry(&self) -> abi::Entry {
        self.open.as_ref().map_or(NO_ENTRY, |open| open.entry.0)
    }

    /// Its name in messages.
    fn name(&self) -> String {
        self.path.as_deref().map_or_else(|| "linked".to_owned(), file_name)
    }

    /// Calls close() and unloads the library; Err: what its code did in place of returning. Instances must be
    /// gone.
    pub fn close(mut self) -> Result<(), String> {
        self.close_open()
    }

    fn close_open(&mut self) -> Result<(), String> {
        let name = self.name();
        let Some(open) = self.open.take() else { return Ok(()) };
        if open.generation.quarantine().is_some() {
            // It was told when that happened.
            return Ok(());
        }
        match open.entry.0.close {
            // SAFETY: open() succeeded, and no instance is left: each holds this library.
            Some(close) => open.generation.enter(&name, "close", || unsafe { close() }),
            None => Ok(()),
        }
    }

    /// The file that it came from; None: linked into the program.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// What people should know about it: a newer contract, say.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Runs code of the library on its control thread.
    pub(super) fn enter<R: Send>(
        &self,
        call: &'static str,
        code: impl FnOnce() -> R + Send,
    ) -> Result<R, String> {
        match &self.open {
            Some(open) => open.generation.enter(&self.name(), call, code),
            None => Err("it is closed".into()),
        }
    }

    /// Runs code of the host's on the library's control thread.
    #[cfg(target_os = "linux")]
    pub fn on_control<R: Send>(&self, code: impl FnOnce() -> R + Send) -> Result<R, String> {
        self.generation().map(|generation| generation.run(code)).ok_or_else(|| "it is closed".into())
    }

    /// Its threads. None only while it is dropped.
    pub(crate) fn generation(&self) -> Option<&Generation> {
        self.open.as_ref().map(|open| &open.generation)
    }
}

impl Plugin {
    /// What it says of itself.
    pub fn info(&self) -> &Arc<PluginInfo> {
        &self.info
    }

    /// The library that it is in.
    pub fn library(&self) -> &Arc<Library> {
        &self.library
    }

    pub(crate) fn descriptor(&self) -> &abi::Descriptor {
        &self.descriptor
    }
}

impl Drop for Library {
    fn drop(&mut self) {
        if let Err(message) = self.close_open() {
            tracing::warn!("{message}");
        }
    }
}

impl Open {
    /// Runs the library's constructors on the control thread, which are watched and guarded.
    fn begin(&mut self, name: &str, begun: Begun) -> Result<(), Refusal> {
        let Begun { life, base } = &begun;
        // SAFETY: loaded there a moment ago without what the loader would have run: this is the first run.
        let run = || unsafe { life.begin(*base) };
        self.generation.enter(name, "load", run).map_err(Refusal::Fault)?;
        if let Some(loaded) = &mut self.loaded {
            loaded.begun = Some(begun);
        }
        Ok(())
    }

    /// Ends the library's threads and runs its destructors; Err: what they did in the place of returning.
    fn end(&mut self, file: &str, begun: Option<Begun>) -> Result<(), String> {
        let destructors = move || {
            if let Some(Begun { life, base }) = begun {
                // SAFETY: the constructors ran; no instance is left, and no thread that ran the library's
                // code.
                unsafe { life.end(base) };
            }
        };
        self.generation.end(file, destructors)
    }

    /// Refuses code that belongs to a library that is loaded already.
    fn claim_address(&mut self) -> Result<(), Refusal> {
        let Some(loaded) = &mut self.loaded else { return Ok(()) };
        let mut entries = ENTRIES.lock().unwrap_or_else(PoisonError::into_inner);
        let entries = entries.get_or_insert_default();
        // Who is being closed may be gone already, and its address ours, before it could say so.
        let gone = |holder: &PathBuf| cfg!(unix) && !still_loaded(holder);
        if entries.get(&loaded.address).is_none_or(gone) {
            entries.insert(loaded.address, loaded.name.clone());
            return Ok(());
        }
        loaded.address = 0; // The other one's: not ours to give back.
        Err(Refusal::StillLoaded)
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        let Some(Loaded { handle, address, name, file, begun }) = self.loaded.take() else { return };
        if self.generation.quarantine().is_some() {
            // Its memory may be in any state, and its threads sleep for ever: it stays as it is.
            std::mem::forget(handle);
            return;
        }
        if let Err(message) = self.end(&file, begun) {
            tracing::warn!("{message}, and stays in memory");
            std::mem::forget(handle);
            return;
        }
        // The watchdog has nothing to take away from now on.
        self.generation.fate().set_text(None);
        // Destructors of what the library needed run in here: on a thread of their own, not on the caller's.
        let closer = thread::Builder::new().name("reef-unload".into()).spawn(move || drop(handle));
        if let Ok(closer) = closer {
            // A destructor that panics would abort; there is nothing else to tell.
            let _ = closer.join();
        }
        if still_loaded(&name) {
            // Its address stays taken: code that is found there again is the old one.
            let count = PINNED.fetch_add(1, Ordering::Relaxed) + 1;
            tracing::warn!("{} was closed and stays in memory ({count} so far)", name.display());
        } else if let Some(entries) = &mut *ENTRIES.lock().unwrap_or_else(PoisonError::into_inner)
            && entries.get(&address) == Some(&name)
        {
            entries.remove(&address);
        }
    }
}

/// Does the system's loader still know this name?
#[cfg(unix)]
fn still_loaded(name: &Path) -> bool {
    use libloading::os::unix;
    // SAFETY: with NOLOAD nothing is loaded, so nothing of the library runs; dropping the handle takes back
    // what it counted.
    unsafe { unix::Library::open(Some(name), unix::RTLD_NOW | libc::RTLD_NOLOAD) }.is_ok()
}

/// Other systems' loaders do not tell.
#[cfg(not(unix))]
fn still_loaded(_: &Path) -> bool {
    false
}

const NO_ENTRY: abi::Entry = abi::Entry {
    magic: 0,
    size: 0,
    version: 0,
    header_hash: 0,
    descriptor_count: 0,
    spare: 0,
    descriptors: std::ptr::null(),
    open: None,
    close: None,
};

fn start(workers: usize) -> Result<Generation, Refusal> {
    Generation::new(workers)
        .map_err(|error| Refusal::Machine(format!("its threads cannot be started: {error}")))
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Opens a file with the system's loader and finds where it is loaded (0: the loader does not say) and its
/// entry. Runs the constructors of what the library needs.
fn open_file(path: &Path) -> Result<(libloading::Library, usize, usize), Refusal> {
    #[cfg(unix)]
    // SAFETY: code runs: the library was found to be a plugin, and the person who placed it there trusts what
    // it needs.
    let (handle, base) = unsafe {
        use libloading::os::unix;
        let handle = unix::Library::open(Some(path), unix::RTLD_NOW | unix::RTLD_LOCAL)
            .map_err(|error| Refusal::Load(describe_load(&error)))?
            .into_raw();
        // SAFETY: the handle, which was just opened.
        let base = life::base(handle);
        (libloading::Library::from(unix::Library::from_raw(handle)), base)
    };
    #[cfg(not(unix))]
    // SAFETY: as above.
    let (handle, base) = unsafe {
        let handle = libloading::Library::new(path);
        (handle.map_err(|error| Refusal::Load(describe_load(&error)))?, Some(0))
    };
    let Some(base) = base else {
        return Err(Refusal::Load("the system's loader does not say where it is".into()));
    };
    // SAFETY: the symbol is data; only its address is taken, as a number.
    let address = unsafe {
        let symbol = handle.get::<*const abi::Entry>(abi::ENTRY_SYMBOL).map_err(|_| Refusal::NoEntry)?;
        symbol.try_as_raw_ptr().map_or(0, |pointer| pointer as usize)
    };
    if address == 0 || address % align_of::<abi::Entry>() != 0 {
        return Err(Refusal::BadEntry("its address is odd".into()));
    }
    Ok((handle, base, address))
}

/// The loader's own words, which libloading keeps as the source.
fn describe_load(error: &libloading::Error) -> String {
    use std::error::Error;
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(inner) = source {
        text = format!("{text}: {inner}");
        source = inner.source();
    }
    text
}

/// Reads `min(size, sizeof)` bytes of an entry.
///
/// # Safety
/// The pointer leads to as many bytes as the entry's size says.
unsafe fn read_entry(entry: *const abi::Entry) -> abi::Entry {
    let mut read = NO_ENTRY;
    // SAFETY: the caller's promise; any bytes that a plugin wrote there are a value of the contract.
    unsafe {
        let size = (*entry).size as usize;
        let size = size.min(size_of::<abi::Entry>());
        std::ptr::copy_nonoverlapping(entry.cast::<u8>(), (&raw mut read).cast::<u8>(), size);
    }
    read
}

/// Does the file's name look like a dynamic library's?
pub(crate) fn looks_like_a_library(path: &Path) -> bool {
    path.to_string_lossy().ends_with(std::env::consts::DLL_SUFFIX)
        && fs::metadata(path).is_ok_and(|metadata| !metadata.is_dir())
}
