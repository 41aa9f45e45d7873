//! What a plugin makes once and names by an id: meshes and textures.

use std::{
    ffi::{c_char, c_void},
    slice,
    sync::{Mutex, MutexGuard, PoisonError},
};

use reef_abi as abi;

use super::{Services, services};
use crate::{
    guard, marker, meshes,
    retained::{self, Retained, Store},
    textures::Wanted,
};

/// Most bytes of a texture's name that are read.
const LONGEST_NAME: usize = 1 << 10;

impl Services {
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
}

pub(super) fn lock<T>(store: &Mutex<T>) -> MutexGuard<'_, T> {
    store.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(super) fn list<T: Retained>(store: &Mutex<Store<T>>) -> retained::List<T> {
    lock(store).list().clone()
}

/// Looks at a mesh that a plugin wants, touches all that it points to, and takes it over.
pub(super) unsafe extern "C" fn mesh_create(ctx: *mut c_void, mesh: *const abi::Mesh, out: *mut u32) -> i32 {
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

pub(super) unsafe extern "C" fn mesh_destroy(ctx: *mut c_void, id: u32) -> i32 {
    // SAFETY: the contract's pointer.
    let Some(services) = (unsafe { services(ctx, "mesh_destroy") }) else { return abi::BAD_INPUT };
    services.destroy(services.made.as_ref().map(|made| &made.meshes), "mesh_destroy", id)
}

/// Looks at a texture that a plugin wants, touches all that it points to, and takes it over.
pub(super) unsafe extern "C" fn texture_create(
    ctx: *mut c_void,
    texture: *const abi::Texture,
    out: *mut u32,
) -> i32 {
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

pub(super) unsafe extern "C" fn texture_destroy(ctx: *mut c_void, id: u32) -> i32 {
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
