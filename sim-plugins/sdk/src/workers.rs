//! Work split into fixed chunks over the host's workers: what a chunk computes never depends on who ran it.

use std::{
    ffi::c_void,
    marker::PhantomData,
    sync::{Mutex, PoisonError},
};

use reef_abi as abi;

use crate::guard;

/// The host's workers during one step, or none (tests, benches): then everything runs inline, with the same
/// result.
#[derive(Clone, Copy, Debug)]
pub struct Workers<'a> {
    host: Option<&'a abi::Host>,
}

// SAFETY: the contract allows parallel_for from the step and from jobs, hence from any thread of the
// generation.
unsafe impl Send for Workers<'_> {}
// SAFETY: as above.
unsafe impl Sync for Workers<'_> {}

impl<'a> Workers<'a> {
    /// No workers: jobs run one after the other on the calling thread.
    pub const fn inline() -> Workers<'static> {
        Workers { host: None }
    }

    /// The workers of a host that somebody made by hand: for tests of models.
    ///
    /// # Safety
    /// Its `parallel_for`, where it has one, keeps the contract: it runs each index once, concurrent jobs on
    /// different workers below `worker_count`, and returns when all are done.
    pub unsafe fn of_host(host: &'a abi::Host) -> Self {
        Self::of(host)
    }

    pub(crate) fn of(host: &'a abi::Host) -> Self {
        Self { host: Some(host) }
    }

    /// How many workers there are; a job's worker index is below it.
    pub fn count(&self) -> usize {
        self.host.map_or(1, |host| (host.worker_count as usize).max(1))
    }

    /// Calls `job(index, worker)` for each index below `count` and returns when all are done. A panic of a
    /// job goes on in the caller when the others are done. Which worker runs what is not defined: write only
    /// what belongs to `index`.
    pub fn for_each(&self, count: usize, job: impl Fn(usize, usize) + Sync) {
        let parallel_for = self.host.and_then(|host| host.parallel_for.map(|f| (host.ctx, f)));
        let (Some((ctx, parallel_for)), true) = (parallel_for, count > 1) else {
            (0..count).for_each(|index| job(index, 0));
            return;
        };
        assert!(u32::try_from(count).is_ok(), "at most 2^32 - 1 jobs at once, not {count}");
        let shared = Shared { job, failure: Mutex::new(None) };
        // SAFETY: `shared` outlives the call, which returns when all jobs are done; `run` takes that very
        // type.
        let status = unsafe {
            parallel_for(ctx, count as u32, trampoline_of(&shared), (&raw const shared).cast_mut().cast())
        };
        if let Some((_, message)) = shared.failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
            guard::relay(message);
        }
        assert!(status == abi::OK, "the host's parallel_for failed with status {status}");
    }

    /// Calls `job(index, part)` for each part of a [`Split`] (one [`Chunks`] or [`Parts`], or a tuple of
    /// them, cut into the same number of pieces). Panics when the numbers of pieces differ.
    pub fn for_each_part<S: Split>(&self, split: S, job: impl Fn(usize, S::Part) + Sync) {
        let count = split.checked_count();
        let split = &split;
        // SAFETY: each index occurs once, so no two parts overlap.
        self.for_each(count, |index, _| job(index, unsafe { split.part(index) }));
    }

    /// As [`Workers::for_each_part`], and lends each job one of `states`: scratch space that no two
    /// concurrent jobs share. Its content must not influence the result. Panics with fewer states than
    /// [`Workers::count`].
    pub fn for_each_part_with<S: Split, W: Send>(
        &self,
        states: &mut [W],
        split: S,
        job: impl Fn(&mut W, usize, S::Part) + Sync,
    ) {
        assert!(states.len() >= self.count(), "{} states for {} workers", states.len(), self.count());
        let count = split.checked_count();
        let states = PerWorker { states: states.as_mut_ptr(), count: states.len(), lifetime: PhantomData };
        let (split, states) = (&split, &states);
        self.for_each(count, |index, worker| {
            // SAFETY: each index occurs once, and the host gives concurrent jobs different workers.
            let (part, state) = unsafe { (split.part(index), states.of(worker)) };
            job(state, index, part);
        });
    }
}

/// States that are lent to jobs, one a worker.
struct PerWorker<'a, W> {
    states: *mut W,
    count: usize,
    lifetime: PhantomData<&'a mut [W]>,
}

// SAFETY: it hands out disjoint `&mut W` only, under the rule of `of`.
unsafe impl<W: Send> Sync for PerWorker<'_, W> {}

impl<W> PerWorker<'_, W> {
    /// # Safety
    /// Nobody else holds the state of that worker.
    #[allow(clippy::mut_from_ref, reason = "the caller's promise")]
    unsafe fn of(&self, worker: usize) -> &mut W {
        assert!(worker < self.count, "worker {worker} of {}", self.count);
        // SAFETY: inside the slice that is borrowed for longer than `self` lives; the caller's promise.
        unsafe { &mut *self.states.add(worker) }
    }
}

struct Shared<F> {
    job: F,
    /// Lowest index that panicked, and its message.
    failure: Mutex<Option<(u32, String)>>,
}

fn trampoline_of<F: Fn(usize, usize) + Sync>(_: &Shared<F>) -> abi::Job {
    Some(trampoline::<F>)
}

unsafe extern "C" fn trampoline<F: Fn(usize, usize) + Sync>(user: *mut c_void, index: u32, worker: u32) {
    // SAFETY: `for_each` passes its `Shared<F>`, which is shared (never mutated but through its lock) until
    // all jobs are done.
    let shared = unsafe { &*user.cast_const().cast::<Shared<F>>() };
    if let Err(message) = guard::catch(|| (shared.job)(index as usize, worker as usize)) {
        let mut failure = shared.failure.lock().unwrap_or_else(PoisonError::into_inner);
        if failure.as_ref().is_none_or(|(first, _)| index < *first) {
            *failure = Some((index, message));
        }
    }
}

/// Something that falls into disjoint mutable parts.
///
/// # Safety
/// Parts of different indices never overlap.
pub unsafe trait Split: Sync {
    /// One part.
    type Part;

    /// How many parts there are; None: members of a tuple differ.
    fn count_or_mismatch(&self) -> Option<usize>;

    /// Part `index`.
    ///
    /// # Safety
    /// Each index is taken once at most. (An index out of range panics.)
    unsafe fn part(&self, index: usize) -> Self::Part;

    /// How many parts there are; panics when members of a tuple differ.
    fn checked_count(&self) -> usize {
        self.count_or_mismatch().expect("the slices are cut into different numbers of parts")
    }
}

/// A slice in chunks of a fixed length (the last may be shorter).
#[derive(Debug)]
pub struct Chunks<'a, T> {
    data: *mut T,
    length: usize,
    chunk: usize,
    lifetime: PhantomData<&'a mut [T]>,
}

// SAFETY: it hands out disjoint `&mut [T]` only, under the rule of `Split::part`.
unsafe impl<T: Send> Sync for Chunks<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Send for Chunks<'_, T> {}

impl<'a, T> Chunks<'a, T> {
    /// Cuts `data` every `chunk` elements. Panics when `chunk` is 0.
    pub fn new(data: &'a mut [T], chunk: usize) -> Self {
        assert!(chunk > 0, "chunks of no elements");
        Self { data: data.as_mut_ptr(), length: data.len(), chunk, lifetime: PhantomData }
    }

    fn count(&self) -> usize {
        self.length.div_ceil(self.chunk)
    }
}

// SAFETY: chunk i is the elements from i * chunk to below (i + 1) * chunk.
unsafe impl<'a, T: Send> Split for Chunks<'a, T> {
    type Part = &'a mut [T];

    fn count_or_mismatch(&self) -> Option<usize> {
        Some(self.count())
    }

    unsafe fn part(&self, index: usize) -> &'a mut [T] {
        assert!(index < self.count(), "chunk {index} of {}", self.count());
        let start = index * self.chunk;
        let length = self.chunk.min(self.length - start);
        // SAFETY: inside the slice that `new` borrowed for 'a; the caller takes each chunk once.
        unsafe { std::slice::from_raw_parts_mut(self.data.add(start), length) }
    }
}

/// A slice in parts of chosen lengths: part `i` runs from `bounds[i]` to below `bounds[i + 1]`, or several of
/// these that follow one another.
#[derive(Debug)]
pub struct Parts<'a, T> {
    data: *mut T,
    bounds: &'a [usize],
    together: usize,
    lifetime: PhantomData<&'a mut [T]>,
}

// SAFETY: it hands out disjoint `&mut [T]` only, under the rule of `Split::part`.
unsafe impl<T: Send> Sync for Parts<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Send for Parts<'_, T> {}

impl<'a, T> Parts<'a, T> {
    /// Cuts `data` at the bounds. Panics unless they grow and stay inside.
    pub fn new(data: &'a mut [T], bounds: &'a [usize]) -> Self {
        Self::every(data, bounds, 1)
    }

    /// Joins so many ranges in a part; the last part may have fewer. Panics as [`Parts::new`], and for 0.
    pub fn every(data: &'a mut [T], bounds: &'a [usize], together: usize) -> Self {
        assert!(together > 0, "a part has at least one range");
        assert!(bounds.is_sorted(), "the bounds of parts must grow");
        assert!(bounds.last().is_none_or(|last| *last <= data.len()), "the bounds of parts leave the slice");
        Self { data: data.as_mut_ptr(), bounds, together, lifetime: PhantomData }
    }

    fn count(&self) -> usize {
        self.bounds.len().saturating_sub(1).div_ceil(self.together)
    }
}

// SAFETY: the bounds grow, so parts do not overlap.
unsafe impl<'a, T: Send> Split for Parts<'a, T> {
    type Part = &'a mut [T];

    fn count_or_mismatch(&self) -> Option<usize> {
        Some(self.count())
    }

    unsafe fn part(&self, index: usize) -> &'a mut [T] {
        assert!(index < self.count(), "part {index} of {}", self.count());
        let last = ((index + 1) * self.together).min(self.bounds.len() - 1);
        let (start, end) = (self.bounds[index * self.together], self.bounds[last]);
        // SAFETY: `new` checked that the bounds grow inside the slice, which it borrowed for 'a; the caller
        // takes each part once.
        unsafe { std::slice::from_raw_parts_mut(self.data.add(start), end - start) }
    }
}

macro_rules! split_tuple {
    ($($name:ident . $index:tt),+) => {
        // SAFETY: parts of a tuple are tuples of parts of its members.
        unsafe impl<$($name: Split),+> Split for ($($name,)+) {
            type Part = ($($name::Part,)+);

            fn count_or_mismatch(&self) -> Option<usize> {
                let counts = [$(self.$index.count_or_mismatch()?),+];
                counts.iter().all(|count| *count == counts[0]).then_some(counts[0])
            }

            unsafe fn part(&self, index: usize) -> Self::Part {
                // SAFETY: the caller's promise holds for each member.
                ($(unsafe { self.$index.part(index) },)+)
            }
        }
    };
}
split_tuple!(A.0);
split_tuple!(A.0, B.1);
split_tuple!(A.0, B.1, C.2);
split_tuple!(A.0, B.1, C.2, D.3);
split_tuple!(A.0, B.1, C.2, D.3, E.4);
split_tuple!(A.0, B.1, C.2, D.3, E.4, F.5);
split_tuple!(A.0, B.1, C.2, D.3, E.4, F.5, G.6);
split_tuple!(A.0, B.1, C.2, D.3, E.4, F.5, G.6, H.7);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_and_parts_cover_each_element_once() {
        let mut a: Vec<usize> = vec![0; 10];
        let mut b: Vec<usize> = vec![0; 9];
        let bounds = [0, 2, 2, 9];
        Workers::inline().for_each_part(
            (Chunks::new(&mut a, 4), Parts::new(&mut b, &bounds)),
            |i, (a, b)| {
                a.iter_mut().for_each(|v| *v += i + 1);
                b.iter_mut().for_each(|v| *v += i + 1);
            },
        );
        assert_eq!(a, [1, 1, 1, 1, 2, 2, 2, 2, 3, 3]);
        assert_eq!(b, [1, 1, 3, 3, 3, 3, 3, 3, 3]);
    }

    #[test]
    fn parts_join_ranges_and_cover_each_element_once() {
        let bounds = [0, 2, 2, 5, 9, 10];
        for (together, expected) in [
            (1, [1, 1, 3, 3, 3, 4, 4, 4, 4, 5]),
            (2, [1, 1, 2, 2, 2, 2, 2, 2, 2, 3]),
            (5, [1; 10]),
            (8, [1; 10]),
        ] {
            let mut data = [0; 10];
            Workers::inline().for_each_part(Parts::every(&mut data, &bounds, together), |i, part| {
                part.iter_mut().for_each(|v| *v += i + 1);
            });
            assert_eq!(data, expected, "{together} together");
        }
        Workers::inline().for_each_part(Parts::every(&mut [0; 0], &[0], 4), |_, _| panic!("there is none"));
    }

    #[test]
    #[should_panic(expected = "different numbers of parts")]
    fn slices_in_different_numbers_of_parts_are_refused() {
        let (mut a, mut b) = ([0; 4], [0; 4]);
        Workers::inline().for_each_part((Chunks::new(&mut a, 2), Chunks::new(&mut b, 3)), |i, (a, b)| {
            a[0] = i;
            b[0] = i;
        });
        // 2 and 2 chunks agree; 2 and 4 do not.
        Workers::inline().for_each_part((Chunks::new(&mut a, 2), Chunks::new(&mut b, 1)), |_, _| {});
    }

    #[test]
    fn each_job_gets_a_state_of_its_worker() {
        let mut states = vec![0_u32; 1];
        let mut data = [0_u8; 6];
        Workers::inline().for_each_part_with(&mut states, Chunks::new(&mut data, 2), |state, i, part| {
            *state += 1;
            part.fill(i as u8);
        });
        assert_eq!((states, data), (vec![3], [0, 0, 1, 1, 2, 2]));
    }
}
