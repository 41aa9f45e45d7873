//! The contract's calls on an instance: raw pointers become references here, failures a status and a message.

use std::{
    ffi::{c_char, c_void},
    ptr,
};

use reef_abi as abi;

use crate::{
    Plugin,
    error::{Reset, Status},
    guard,
    host::{Host, Level, read_sized},
    shell::{Failed, SPARE_STEPS, Shell, first_params},
};

/// Most room that is made for a state before it is read [bytes].
const LONGEST_GUESS: usize = 1 << 28;

/// Runs a call of the host: panics and failures become a status, with the message left at the host.
fn answer(host: &Host, call: impl FnOnce() -> Result<i32, Failed>) -> i32 {
    status_of(host, guard::catch(call))
}

/// As [`answer`], for a call that a panic leaves in an unknown state.
fn answer_or_break<T>(shell: &mut Shell<T>, call: impl FnOnce(&mut Shell<T>) -> Result<i32, Failed>) -> i32 {
    let outcome = guard::catch(|| call(shell));
    if let Err(message) = &outcome {
        shell.broken = Some(message.clone());
    }
    status_of(&shell.host, outcome)
}

/// The status of a call that ended, perhaps in a panic.
fn status_of(host: &Host, outcome: Result<Result<i32, Failed>, String>) -> i32 {
    let (status, message) = match outcome {
        Ok(Ok(status)) => return status,
        Ok(Err(Failed(status, message))) => (status, message),
        Err(message) => (abi::FATAL, message),
    };
    // Where a host service failed, the host has a better message already.
    if !message.is_empty() {
        host.set_error(&message);
    }
    status
}

pub(crate) unsafe extern "C" fn create<T: Plugin>(
    host: *const abi::Host,
    config: *const c_char,
    length: u64,
    out: *mut abi::Instance,
) -> i32 {
    guard::install_hook();
    // SAFETY: the host passes its table, which outlives the instance.
    let Some(host) = (unsafe { Host::from_raw(host) }) else { return abi::FATAL };
    answer(&host, || {
        if config.is_null() || out.is_null() || !out.is_aligned() {
            return Err(Failed(abi::BAD_INPUT, "the host's arguments to create are unusable".into()));
        }
        // SAFETY: pointer and length of the host's text, valid during the call.
        let config = unsafe { std::slice::from_raw_parts(config.cast::<u8>(), length as usize) };
        let shell = Box::new(Shell::<T>::new(host, config.to_vec())?);
        // SAFETY: `size` is the first field of the host's struct.
        let room = unsafe { (&raw const (*out).size).read() } as usize;
        let size = room.min(size_of::<abi::Instance>());
        if size <= std::mem::offset_of!(abi::Instance, destroy) {
            return Err(Failed(abi::BAD_INPUT, "the host has no room for an instance".into()));
        }
        let instance = abi::Instance {
            size: size as u32,
            spare: 0,
            ctx: Box::into_raw(shell).cast(),
            destroy: Some(destroy::<T>),
            reset: Some(reset::<T>),
            step: Some(step::<T>),
            save_state: Some(save_state::<T>),
            load_state: Some(load_state::<T>),
            get_param: Some(get_param::<T>),
            get_extension: None,
        };
        // SAFETY: the host has room for `size` bytes there.
        unsafe { ptr::copy_nonoverlapping((&raw const instance).cast::<u8>(), out.cast::<u8>(), size) };
        Ok(abi::OK)
    })
}

/// The instance behind the contract's context.
///
/// # Safety
/// `ctx` came from [`create`] of the same T, is not destroyed, and no other call on it runs.
unsafe fn shell<'a, T>(ctx: *mut c_void) -> &'a mut Shell<T> {
    // SAFETY: the caller's promise.
    unsafe { &mut *ctx.cast::<Shell<T>>() }
}

unsafe extern "C" fn destroy<T: Plugin>(ctx: *mut c_void) {
    // SAFETY: the contract: destroy is the last call on the instance.
    let shell = unsafe { Box::from_raw(ctx.cast::<Shell<T>>()) };
    let host = shell.host;
    if let Err(message) = guard::catch(move || drop(shell)) {
        host.log(Level::Error, &format!("{}: while an instance was destroyed: {message}", T::ID));
    }
}

unsafe extern "C" fn reset<T: Plugin>(ctx: *mut c_void) -> i32 {
    // SAFETY: the contract: one call at a time, on a living instance.
    let shell = unsafe { shell::<T>(ctx) };
    answer_or_break(shell, |shell| {
        if shell.broken.is_none() && shell.plugin.reset() == Reset::Done {
            shell.params = first_params(&shell.plugin);
        } else {
            let fresh = Shell::new(shell.host, shell.config.clone())?;
            shell.replace(fresh);
        }
        Ok(abi::OK)
    })
}

unsafe extern "C" fn step<T: Plugin>(
    ctx: *mut c_void,
    input: *const abi::Step,
    output: *const abi::Output,
) -> i32 {
    // SAFETY: as in `reset`.
    let shell = unsafe { shell::<T>(ctx) };
    answer_or_break(shell, |shell| {
        // SAFETY: the host passes input and output of this step.
        match unsafe { shell.step(input, output) }? {
            Status::Ok => Ok(abi::OK),
            Status::Sleep => Ok(abi::SLEEP),
        }
    })
}

unsafe extern "C" fn save_state<T: Plugin>(ctx: *mut c_void, writer: *const abi::Writer) -> i32 {
    // SAFETY: as in `reset`.
    let shell = unsafe { shell::<T>(ctx) };
    let host = shell.host;
    answer(&host, || {
        if let Some(message) = &shell.broken {
            return Err(Failed(abi::ERROR, format!("the instance broke earlier: {message}")));
        }
        // SAFETY: the host's writer, valid during the call.
        let writer = unsafe { read_sized(writer) };
        let Some((writer, write)) = writer.and_then(|w: abi::Writer| Some((w, w.write?))) else {
            return Err(Failed(abi::BAD_INPUT, "the host's writer is unusable".into()));
        };
        let (ctx, bytes) = (writer.ctx, shell.save()?);
        if let Some(expect) = writer.expect {
            // SAFETY: a service with a number. What it refuses, `write` refuses, too.
            let _ = unsafe { expect(ctx, bytes.len() as u64) };
        }
        // SAFETY: pointer and length of living bytes.
        match unsafe { write(ctx, bytes.as_ptr().cast(), bytes.len() as u64) } {
            abi::OK => Ok(abi::OK),
            status => Err(Failed(status, String::new())),
        }
    })
}

unsafe extern "C" fn load_state<T: Plugin>(ctx: *mut c_void, reader: *const abi::Reader) -> i32 {
    // SAFETY: as in `reset`.
    let shell = unsafe { shell::<T>(ctx) };
    let host = shell.host;
    // A panic in here happens in the fresh instance: the running one stays as it was.
    answer(&host, || {
        // SAFETY: the host's reader, valid during the call.
        let reader = unsafe { read_sized(reader) };
        let Some((reader, read)) = reader.and_then(|r: abi::Reader| Some((r, r.read?))) else {
            return Err(Failed(abi::BAD_INPUT, "the host's reader is unusable".into()));
        };
        let mut bytes = Vec::with_capacity(usize::try_from(reader.length).unwrap_or(0).min(LONGEST_GUESS));
        let mut buffer = vec![0_u8; 1 << 16];
        loop {
            // SAFETY: room for as many bytes as it says.
            let count = unsafe { read(reader.ctx, buffer.as_mut_ptr().cast(), buffer.len() as u64) };
            match usize::try_from(count).ok().and_then(|count| buffer.get(..count)) {
                Some([]) => break,
                Some(part) => bytes.extend_from_slice(part),
                None => return Err(Failed(abi::BAD_STATE, "the host's reader cannot read".into())),
            }
        }
        let fresh = shell.loaded(reader.state_version, &bytes)?;
        if T::LOADS_OVER && shell.broken.is_none() {
            let Shell { plugin, .. } = std::mem::replace(shell, fresh);
            shell.spare = Some((plugin, SPARE_STEPS));
        } else {
            shell.replace(fresh);
        }
        Ok(abi::OK)
    })
}

unsafe extern "C" fn get_param<T: Plugin>(ctx: *mut c_void, id: u32, out_value: *mut f64) -> i32 {
    // SAFETY: as in `reset`.
    let shell = unsafe { shell::<T>(ctx) };
    answer(&shell.host, || match shell.params.get(id) {
        Some(value) if !out_value.is_null() && out_value.is_aligned() => {
            // SAFETY: the host's variable.
            unsafe { out_value.write(value) };
            Ok(abi::OK)
        }
        _ => Err(Failed(abi::BAD_INPUT, format!("{} has no parameter {id}", T::ID))),
    })
}
