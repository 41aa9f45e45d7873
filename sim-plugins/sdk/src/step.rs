//! A step's input as slices, and its output as typed memory of the host.

use reef_abi as abi;
pub use reef_abi::Element;

use crate::{error::StepError, host::Host, param::Params, workers::Workers};

/// What a step may read. Nothing in it outlives the step.
#[derive(Debug)]
pub struct StepInput<'a> {
    host: &'a Host,
    params: &'a Params,
    raw: abi::Step,
    camera: &'a abi::Camera,
    water: &'a abi::Water,
    heightfield: Option<Heightfield<'a>>,
    flow: &'a [abi::Flow],
    waves: &'a [abi::Wave],
    actors: &'a [abi::Actor],
    obstacles: &'a [abi::Obstacle],
    events: &'a [abi::Event],
}

// SAFETY: all pointers in `raw` lead to data that the host keeps unchanged during the step; everything else
// is shared references to plain data.
unsafe impl Sync for StepInput<'_> {}
// SAFETY: as above.
unsafe impl Send for StepInput<'_> {}

/// The sea bed under the scene.
#[derive(Clone, Copy, Debug)]
pub struct Heightfield<'a> {
    /// y [m], row after row along z, columns along x.
    pub heights: &'a [f32],
    /// x and z of the first height [m].
    pub origin: [f64; 2],
    /// Distance between two heights [m].
    pub cell: f32,
    /// Heights along x.
    pub columns: usize,
    /// Heights along z.
    pub rows: usize,
}

impl Heightfield<'_> {
    /// y of the bed at (x, z) [m]: bilinear; outside, that of the nearest edge.
    pub fn height(&self, x: f64, z: f64) -> f32 {
        let place = |p: f64, origin: f64, count: usize| {
            let u = ((p - origin) / f64::from(self.cell)).clamp(0.0, (count - 1) as f64);
            let i = (u as usize).min(count.saturating_sub(2));
            (i, (u - i as f64) as f32)
        };
        let (i, u) = place(x, self.origin[0], self.columns);
        let (j, v) = place(z, self.origin[1], self.rows);
        let at =
            |i: usize, j: usize| self.heights[j.min(self.rows - 1) * self.columns + i.min(self.columns - 1)];
        let near = at(i, j) + (at(i + 1, j) - at(i, j)) * u;
        let far = at(i, j + 1) + (at(i + 1, j + 1) - at(i, j + 1)) * u;
        near + (far - near) * v
    }
}

/// A slice out of the contract's pointer and count.
///
/// # Safety
/// A pointer that is neither NULL nor misaligned points to `count` elements that live for `'a`.
unsafe fn slice<'a, T>(pointer: *const T, count: usize, what: &str) -> Result<&'a [T], String> {
    match count {
        0 => Ok(&[]),
        _ if pointer.is_null() => Err(format!("the host's step has {count} {what} at NULL")),
        _ if !pointer.is_aligned() => Err(format!("the host's {what} are misaligned")),
        // SAFETY: the caller's promise.
        _ => Ok(unsafe { std::slice::from_raw_parts(pointer, count) }),
    }
}

/// A reference out of the contract's pointer.
///
/// # Safety
/// As [`slice`], for one element.
unsafe fn one<'a, T>(pointer: *const T, what: &str) -> Result<&'a T, String> {
    // SAFETY: the caller's promise; one element is there after `slice` returned it.
    unsafe { slice(pointer, 1, what) }.map(|s| &s[0])
}

impl<'a> StepInput<'a> {
    /// Turns the raw step into slices.
    ///
    /// # Safety
    /// The pointers in `raw` are as the contract says and stay valid for `'a`.
    pub(crate) unsafe fn new(raw: abi::Step, host: &'a Host, params: &'a Params) -> Result<Self, String> {
        // SAFETY: the caller's promise, for each pointer below.
        unsafe {
            let heightfield = match raw.heightfield.is_null() {
                true => None,
                false => {
                    let field = one(raw.heightfield, "heightfield")?;
                    let (columns, rows) = (field.columns as usize, field.rows as usize);
                    let heights = slice(field.heights, columns * rows, "heights")?;
                    if heights.is_empty() || field.cell.is_nan() || field.cell <= 0.0 {
                        return Err("the host's heightfield is empty".into());
                    }
                    Some(Heightfield { heights, origin: field.origin, cell: field.cell, columns, rows })
                }
            };
            Ok(Self {
                host,
                params,
                camera: one(raw.camera, "camera")?,
                water: one(raw.water, "water")?,
                heightfield,
                flow: slice(raw.flow, raw.flow_count as usize, "flow primitives")?,
                waves: slice(raw.waves, raw.wave_count as usize, "waves")?,
                actors: slice(raw.actors, raw.actor_count as usize, "actors")?,
                obstacles: slice(raw.obstacles, raw.obstacle_count as usize, "obstacles")?,
                events: events(&raw)?,
                raw,
            })
        }
    }

    /// Number of this step, from 1; 0: the state before the first.
    pub fn step(&self) -> u64 {
        self.raw.step
    }

    /// Time at the end of this step [s].
    pub fn time(&self) -> f64 {
        self.raw.time
    }

    /// Length of the step [s]; 0: emit the present state, change nothing.
    pub fn dt(&self) -> f64 {
        self.raw.dt
    }

    /// Seed of everything random.
    pub fn seed(&self) -> u64 {
        self.raw.seed
    }

    /// Instruction set to use, `abi::SIMD_*`. All give the same bytes.
    pub fn simd_level(&self) -> u32 {
        self.raw.simd_level
    }

    /// The outputs are checked and thrown away.
    pub fn is_trial(&self) -> bool {
        self.raw.flags & abi::STEP_TRIAL != 0
    }

    /// Emit the trace stream.
    pub fn wants_trace(&self) -> bool {
        self.raw.flags & abi::STEP_TRACE != 0
    }

    /// Emit debug lines.
    pub fn wants_debug(&self) -> bool {
        self.raw.flags & abi::STEP_DEBUG != 0
    }

    /// Nobody looks at this step: fibres, meshes and sprites may be left out. Where objects are, flow,
    /// actors, what is asked for, and the state are those of a step that is seen.
    pub fn is_unseen(&self) -> bool {
        self.raw.flags & abi::STEP_UNSEEN != 0
    }

    /// The scene's camera, with its nominal viewport.
    pub fn camera(&self) -> &'a abi::Camera {
        self.camera
    }

    /// Density, viscosity, depth.
    pub fn water(&self) -> &'a abi::Water {
        self.water
    }

    /// The sea bed, where the scene has one.
    pub fn heightfield(&self) -> Option<Heightfield<'a>> {
        self.heightfield
    }

    /// The scene's flow primitives, then what plugins emitted in the step before.
    pub fn flow(&self) -> &'a [abi::Flow] {
        self.flow
    }

    /// Wave trains, greatest amplitude first.
    pub fn waves(&self) -> &'a [abi::Wave] {
        self.waves
    }

    /// What plugins let others perceive in the step before.
    pub fn actors(&self) -> &'a [abi::Actor] {
        self.actors
    }

    /// Capsules that nothing should enter.
    pub fn obstacles(&self) -> &'a [abi::Obstacle] {
        self.obstacles
    }

    /// What came from outside. Parameter changes are applied already.
    pub fn events(&self) -> &'a [abi::Event] {
        self.events
    }

    /// Present value of the parameter `id`; its events of this step are in it. 0 for an id that is not
    /// declared.
    pub fn param(&self, id: u32) -> f64 {
        self.params.get(id).unwrap_or(0.0)
    }

    /// All parameters.
    pub fn params(&self) -> &'a Params {
        self.params
    }

    /// Log and watchdog.
    pub fn host(&self) -> &'a Host {
        self.host
    }

    /// The host's workers.
    pub fn workers(&self) -> Workers<'a> {
        Workers::of(self.host.raw())
    }

    /// Zeroed memory until the end of this step, from the host: no allocation after the first steps.
    pub fn scratch<T: bytemuck::Pod>(&self, count: usize) -> Result<&'a mut [T], StepError> {
        if count == 0 || size_of::<T>() == 0 {
            return Ok(&mut []);
        }
        let too_much = || StepError::NoSpace(format!("scratch for {count} elements is too much"));
        let bytes = size_of::<T>().checked_mul(count).ok_or_else(too_much)?;
        let Some(scratch) = self.host.raw().scratch else {
            return Err(StepError::Error("the host has no scratch memory".into()));
        };
        let mut out = std::ptr::null_mut();
        // SAFETY: valid arguments; the host fills `out`.
        let status = unsafe { scratch(self.host.raw().ctx, bytes as u64, align_of::<T>() as u64, &mut out) };
        check(status, "scratch")?;
        let out = out.cast::<T>();
        if out.is_null() || !out.is_aligned() {
            return Err(StepError::Error("the host's scratch memory is unusable".into()));
        }
        // SAFETY: the host gave that many bytes, for this step, to nobody else; zeroing initialises them, and
        // T is plain data.
        unsafe {
            std::ptr::write_bytes(out, 0, count);
            Ok(std::slice::from_raw_parts_mut(out, count))
        }
    }

    /// Velocity of the sea at points relative to `origin` [m], by the host's own field; what the object
    /// `owner` emits is left out (0: nothing is). All slices must be of one length.
    pub fn sample_flow(
        &self,
        origin: [f64; 3],
        owner: u64,
        points: [&[f32]; 3],
        velocities: [&mut [f32]; 3],
    ) -> Result<(), StepError> {
        self.sample(origin, (owner, None), points, velocities)
    }

    /// The same with an owner for each point: for many things that each emit flow. Best in runs of the same
    /// owner.
    pub fn sample_flow_of_each(
        &self,
        origin: [f64; 3],
        owners: &[u64],
        points: [&[f32]; 3],
        velocities: [&mut [f32]; 3],
    ) -> Result<(), StepError> {
        self.sample(origin, (0, Some(owners)), points, velocities)
    }

    fn sample(
        &self,
        origin: [f64; 3],
        (owner, owners): (u64, Option<&[u64]>),
        points: [&[f32]; 3],
        velocities: [&mut [f32]; 3],
    ) -> Result<(), StepError> {
        let count = points[0].len();
        let equal = owners.is_none_or(|owners| owners.len() == count)
            && points.iter().all(|s| s.len() == count)
            && velocities.iter().all(|s| s.len() == count);
        if !equal || u32::try_from(count).is_err() {
            return Err(StepError::Error("sample_flow: the slices must be of one length".into()));
        }
        let Some(sample) = self.host.raw().sample_flow else {
            return Err(StepError::Error("the host samples no flow".into()));
        };
        let [x, y, z] = points.map(<[f32]>::as_ptr);
        let [vx, vy, vz] = velocities.map(<[f32]>::as_mut_ptr);
        let owners = owners.map_or(std::ptr::null(), <[u64]>::as_ptr);
        let count = count as u32;
        let query = abi::FlowQuery { x, y, z, vx, vy, vz, origin, owner, owners, count, spare: 0 };
        // SAFETY: living slices of `count` elements.
        check(unsafe { sample(self.host.raw().ctx, &query) }, "sample_flow")
    }
}

/// The events of a raw step.
///
/// # Safety
/// As [`StepInput::new`].
pub(crate) unsafe fn events<'a>(raw: &abi::Step) -> Result<&'a [abi::Event], String> {
    // SAFETY: the caller's promise.
    unsafe { slice(raw.events, raw.event_count as usize, "events") }
}

/// A host service's status as an error; the host has its own message ready already.
fn check(status: i32, service: &str) -> Result<(), StepError> {
    match status {
        abi::OK => Ok(()),
        abi::NO_SPACE => Err(StepError::NoSpace(String::new())),
        code => Err(StepError::Error(format!("the host's {service} failed with status {code}"))),
    }
}

/// [`Output`] has a bit for each stream.
const _: () = assert!(abi::STREAM_COUNT <= u32::BITS);

/// Where a step writes. Reserve each stream once, before the jobs; write; commit how many elements count.
#[derive(Debug)]
pub struct Output<'a> {
    raw: &'a abi::Output,
    /// Bit s: stream s is reserved. Elements reserved twice would exist as two mutable slices.
    reserved: u32,
}

impl<'a> Output<'a> {
    /// Wraps the host's output.
    ///
    /// # Safety
    /// `raw` is the host's, for the step that lasts for `'a`, and nobody else uses it meanwhile.
    pub(crate) unsafe fn new(raw: &'a abi::Output) -> Self {
        Self { raw, reserved: 0 }
    }

    /// Room for `count` elements of T's stream, with arbitrary content. Once per stream and step.
    pub fn reserve<T: Element>(&mut self, count: usize) -> Result<&'a mut [T], StepError> {
        let missing = || StepError::Error(format!("the host takes no stream {}", T::STREAM));
        self.offer(count)?.ok_or_else(missing)
    }

    /// As [`Output::reserve`]; None where this host does not take the stream. The step goes on without.
    pub fn offer<T: Element>(&mut self, count: usize) -> Result<Option<&'a mut [T]>, StepError> {
        let bit = 1 << T::STREAM;
        if self.reserved & bit != 0 {
            return Err(StepError::Error(format!("stream {} is reserved twice in a step", T::STREAM)));
        }
        let Some(reserve) = self.raw.reserve else {
            return Err(StepError::Error("the host takes no output".into()));
        };
        let mut out = std::ptr::null_mut();
        // SAFETY: valid arguments; the host fills `out`.
        let status =
            unsafe { reserve(self.raw.ctx, T::STREAM, size_of::<T>() as u32, count as u64, &mut out) };
        if status == abi::UNSUPPORTED {
            return Ok(None);
        }
        check(status, "reserve")?;
        self.reserved |= bit;
        if count == 0 {
            return Ok(Some(&mut []));
        }
        let out = out.cast::<T>();
        if out.is_null() || !out.is_aligned() {
            return Err(StepError::Error("the host's output memory is unusable".into()));
        }
        // SAFETY: the host gave room for `count` initialised elements, which stays in place until the step
        // ends because the stream is reserved once; T is plain data.
        Ok(Some(unsafe { std::slice::from_raw_parts_mut(out, count) }))
    }

    /// The first `count` reserved elements of T's stream count.
    pub fn commit<T: Element>(&mut self, count: usize) -> Result<(), StepError> {
        let Some(commit) = self.raw.commit else {
            return Err(StepError::Error("the host takes no output".into()));
        };
        // SAFETY: valid arguments.
        check(unsafe { commit(self.raw.ctx, T::STREAM, count as u64) }, "commit")
    }

    /// Emits these elements: reserve, copy, commit.
    pub fn emit<T: Element>(&mut self, elements: &[T]) -> Result<(), StepError> {
        self.reserve::<T>(elements.len())?.copy_from_slice(elements);
        self.commit::<T>(elements.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bed_is_bilinear_inside_and_level_outside() {
        let heights = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let bed = Heightfield { heights: &heights, origin: [10.0, -4.0], cell: 2.0, columns: 3, rows: 2 };
        assert_eq!(bed.height(10.0, -4.0), 0.0);
        assert_eq!(bed.height(13.0, -3.0), 3.0);
        assert_eq!(bed.height(14.0, -2.0), 5.0);
        assert_eq!(bed.height(1e9, 1e9), 5.0);
        assert_eq!(bed.height(-1e9, -1e9), 0.0);
        let flat = Heightfield { heights: &heights[..1], origin: [0.0, 0.0], cell: 1.0, columns: 1, rows: 1 };
        assert_eq!(flat.height(0.3, 0.7), 0.0);
    }
}
