//! `sample_flow`: the water's velocity where a plugin asks for it, in the step that it makes.

use std::{
    ffi::c_void,
    slice,
    sync::{PoisonError, atomic::Ordering},
};

use reef_abi as abi;
use reef_flow::{Level, sample};

use super::{Services, services};
use crate::{guard, marker};

impl Services {
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

pub(super) unsafe extern "C" fn sample_flow(ctx: *mut c_void, query: *const abi::FlowQuery) -> i32 {
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
