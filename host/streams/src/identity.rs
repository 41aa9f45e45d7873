//! By which ids modules know one another's objects.
//!
//! An object's id is unique within its module. What one module hears of another's objects carries the
//! module's number in the id's highest bits, so that no object takes a stranger's flow for its own; its own
//! ids come back as it gave them.

/// Bits of an id below the number of the module.
const MODULE_SHIFT: u32 = 48;

/// The id by which other modules know an object.
pub fn foreign_id(module: usize, object: u64) -> u64 {
    if object == 0 { 0 } else { object ^ ((module as u64 + 1) << MODULE_SHIFT) }
}

/// The id that a module itself gave an object which it may know by its foreign id: its own, or a stranger's
/// as it is.
pub fn own_id(module: usize, object: u64) -> u64 {
    let own = foreign_id(module, object);
    if own >> MODULE_SHIFT == 0 { own } else { object }
}
