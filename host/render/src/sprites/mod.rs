//! Which sprites of a step are seen, where, and in which order they are drawn: what the billboard pass
//! uploads.
//!
//! Streams are born on the processor, and most of their sprites are not seen: so they are culled and sorted
//! here, by as many threads as there are, and only what is left goes to the device. Sorting is by buckets of
//! the distance, and stable: the same step gives the same bytes.
//!
//! Small sprites are *specks*: one vertex, drawn as a point whose pixels get exactly the share of them that
//! it covers. Greater ones are *quads* with their texture. Within a slice of distance (a fifth of it) quads
//! come before specks, so that a picture takes few draws.

mod found;
mod sort;

use std::{
    ops::Range,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Instant,
};

use glam::{DVec3, Vec3};
use reef_streams::{Outputs, textures::Texture};

pub use found::linear;
use found::{Batch, Found, Gaze};
use sort::Order;

reef_gpu::record! {
    /// `Sprite` of `shaders/sprite.glsl`.
    pub struct GpuSprite = "Sprite" {
        /// Middle relative to the eye [m].
        pub place: [f32; 3],
        /// Diameter [m].
        pub size: f32,
        /// Unit normal; zero: turned to the eye.
        pub axis: [f32; 3],
        /// Turn about the normal [rad].
        pub roll: f32,
        /// Half floats: linear colour times opacity, and opacity. For a speck times the mean of its texture.
        pub tint: [u16; 4],
        /// Handle of its texture.
        pub layer: u32,
    }
}

/// What one draw is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Four vertices and a texture.
    Quad,
    /// A point.
    Speck,
}

/// How small a sprite may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// Below this diameter a sprite is drawn as wide, with less opacity [px].
    pub least: f32,
    /// Below this one it is a speck [px]; 0: there are no specks.
    pub speck: f32,
}

/// Who looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// Where [m].
    pub place: DVec3,
    /// Unit vectors of the camera in world axes.
    pub right: Vec3,
    /// See `right`.
    pub up: Vec3,
    /// See `right`.
    pub forward: Vec3,
    /// Tangents of half the fields of view, horizontal and vertical.
    pub tangent: [f32; 2],
    /// Size of 1 m at 1 m [px].
    pub pixels: f32,
    /// Distances along the view between which anything is drawn [m].
    pub depths: [f32; 2],
}

/// Where a texture lies, and what is left of it from far away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Its handle, as [`crate::layers`] gives it.
    pub index: u32,
    /// Mean of its texels: linear light times coverage, and coverage.
    pub mean: [f32; 4],
}

/// Below this share of a pixel nothing is drawn: a quarter of what the eye and eight bits can tell.
pub const FAINTEST: f32 = 1.0 / 1024.0;
/// Sprites that one thread looks at in one go.
const PART: usize = 1 << PART_BITS;
const PART_BITS: u32 = 13;
/// Threads at most.
const MOST_THREADS: usize = 8;

/// What is seen of a step's sprites. Looking again allocates nothing once it has grown to its greatest size,
/// but for the threads that help.
#[derive(Debug, Default)]
pub struct Seen {
    /// From the farthest to the nearest, slice by slice.
    pub sprites: Vec<GpuSprite>,
    /// Which of them are drawn together, in this order.
    pub draws: Vec<(Kind, Range<u32>)>,
    seconds: f64,
    found: Vec<Mutex<Found>>,
    order: Order,
    /// Origins of all instances' objects relative to the eye [m].
    origins: Vec<Vec3>,
    /// The layers of all instances' textures, by their ids.
    layers: Vec<(u32, Layer)>,
    batches: Vec<Whose>,
}

/// Which of the lists' entries belong to one instance.
#[derive(Clone, Debug)]
struct Whose {
    output: usize,
    origins: Range<usize>,
    layers: Range<usize>,
}

impl Seen {
    /// Looks at a step's sprites. `back`: how long before the end of the step the picture is taken [s];
    /// `layer`: of a texture; `dot`: of none.
    pub fn cull(
        &mut self,
        outputs: &[impl AsRef<Outputs> + Sync],
        (eye, back, sizes): (&Eye, f32, Sizes),
        (layer, dot): (impl Fn(&Texture) -> Layer, Layer),
    ) {
        let threads = thread::available_parallelism().map_or(1, |n| n.get()).min(MOST_THREADS);
        self.cull_with(threads, outputs, (eye, back, sizes), (layer, dot));
    }

    /// As [`Seen::cull`], with so many threads at most: they change nothing.
    pub fn cull_with(
        &mut self,
        threads: usize,
        outputs: &[impl AsRef<Outputs> + Sync],
        (eye, back, sizes): (&Eye, f32, Sizes),
        (layer, dot): (impl Fn(&Texture) -> Layer, Layer),
    ) {
        let began = Instant::now();
        self.sprites.clear();
        self.draws.clear();
        self.seconds = 0.0;
        let of = |number: usize| outputs.get(number).map(AsRef::<Outputs>::as_ref);
        let total: usize = outputs.iter().map(|outputs| outputs.as_ref().billboards.len()).sum();
        if total == 0 {
            return;
        }
        self.origins.clear();
        self.layers.clear();
        self.batches.clear();
        for (output, outputs) in outputs.iter().map(AsRef::<Outputs>::as_ref).enumerate() {
            if outputs.billboards.is_empty() {
                continue;
            }
            let (origins, layers) = (self.origins.len(), self.layers.len());
            let relative = |origin: [f64; 3]| (DVec3::from(origin) - eye.place).as_vec3();
            self.origins.extend(outputs.objects.iter().map(|object| relative(object.origin)));
            self.layers.extend(outputs.textures.iter().map(|texture| (texture.id, layer(texture))));
            let (origins, layers) = (origins..self.origins.len(), layers..self.layers.len());
            self.batches.push(Whose { output, origins, layers });
        }
        let parts = total.div_ceil(PART);
        if self.found.len() < parts {
            self.found.resize_with(parts, Mutex::default);
        }
        let found = &self.found[..parts];
        let gaze = Gaze::new(eye, back, sizes);
        let (all, own_origins, own_layers) = (&self.batches, &self.origins, &self.layers);
        let look = |found: &mut Found, part: usize| {
            found.clear();
            let (mut skip, mut left) = (part * PART, PART);
            for whose in all {
                let Some(outputs) = of(whose.output) else { continue };
                let sprites = &outputs.billboards;
                let from = skip.min(sprites.len());
                let to = (from + left).min(sprites.len());
                let batch = Batch {
                    sprites: &sprites[from..to],
                    origins: &own_origins[whose.origins.clone()],
                    layers: &own_layers[whose.layers.clone()],
                    dot,
                };
                found.cull(&batch, &gaze);
                skip -= from;
                left -= to - from;
            }
        };
        // Who looks at a part changes nothing: its place in the list is its own.
        let next = AtomicUsize::new(0);
        let work = || {
            loop {
                let part = next.fetch_add(1, Ordering::Relaxed);
                let Some(found) = found.get(part) else { break };
                look(&mut found.lock().unwrap_or_else(PoisonError::into_inner), part);
            }
        };
        let helpers = threads.min(parts).saturating_sub(1);
        if helpers == 0 {
            work();
        } else {
            thread::scope(|scope| {
                for _ in 0..helpers {
                    // Where no thread can be had, this one does it all.
                    let _ = thread::Builder::new().spawn_scoped(scope, work);
                }
                work();
            });
        }
        self.arrange(parts);
        self.seconds = began.elapsed().as_secs_f64();
    }

    /// What the last look took [ms].
    pub fn milliseconds(&self) -> f64 {
        self.seconds * 1e3
    }

    /// How many are drawn.
    pub fn count(&self) -> usize {
        self.sprites.len()
    }

    /// Brings what was found into order.
    fn arrange(&mut self, parts: usize) {
        let Self { sprites, draws, found, order, .. } = self;
        let found = &mut found[..parts];
        order.begin();
        for (part, found) in (0_u32..).zip(found.iter_mut()) {
            let found = found.get_mut().unwrap_or_else(PoisonError::into_inner);
            order.add(&found.keys, part << PART_BITS);
        }
        order.sort();
        sprites.reserve(order.len());
        for (key, index) in order.iter() {
            let part = (index >> PART_BITS) as usize;
            let found = found[part].get_mut().unwrap_or_else(PoisonError::into_inner);
            sprites.push(found.sprites[index as usize & (PART - 1)]);
            let kind = sort::kind(key);
            let at = sprites.len() as u32;
            match draws.last_mut() {
                Some((last, range)) if *last == kind => range.end = at,
                _ => draws.push((kind, at - 1..at)),
            }
        }
    }
}
