//! Which sprites of a step are seen, where, and in which order they are drawn: what the billboard pass uploads.
//!
//! Streams are born on the processor, and most of their sprites are not seen: so they are culled and sorted here, by as many
//! threads as there are, and only what is left goes to the device. Sorting is by buckets of the distance, and stable: the
//! same step gives the same bytes.
//!
//! Small sprites are *specks*: one vertex, drawn as a point whose pixels get exactly the share of them that it covers.
//! Greater ones are *quads* with their texture. Within a slice of distance (a fifth of it) quads come before specks, so that
//! a picture takes few draws.

use std::{
    ops::Range,
    sync::{
        Arc, LazyLock, Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Instant,
};

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use reef_abi as abi;

use super::{
    layers::{Catalogue, Layer},
    view::{Lens, NEAR},
};
use crate::{
    plugin::{streams::Outputs, textures::Texture},
    world::frame::Frame,
};

/// `Sprite` of `shaders/sprite.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GpuSprite {
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
    /// Layer of its texture.
    pub layer: u32,
    /// Zero.
    pub spare: u32,
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

/// Below this share of a pixel nothing is drawn: a quarter of what the eye and eight bits can tell.
pub const FAINTEST: f32 = 1.0 / 1024.0;
/// Sprites that one thread looks at in one go.
const PART: usize = 1 << PART_BITS;
const PART_BITS: u32 = 13;
/// Threads at most.
const MOST_THREADS: usize = 8;

/// One instance's sprites, and what they refer to.
struct Batch<'a> {
    sprites: &'a [abi::Billboard],
    /// Origins of the objects relative to the eye [m].
    origins: Vec<Vec3>,
    /// The layer of each texture of the instance, in the order of ids.
    layers: Vec<(u32, Layer)>,
    dot: Layer,
}

/// What is seen of a step's sprites.
#[derive(Debug, Default)]
pub struct Seen {
    /// From the farthest to the nearest, slice by slice.
    pub sprites: Vec<GpuSprite>,
    /// Which of them are drawn together, in this order.
    pub draws: Vec<(Kind, Range<u32>)>,
    seconds: f64,
    found: Vec<Mutex<Found>>,
    order: Vec<u32>,
    spare: Vec<u32>,
}

/// What was found in one part of the streams, in their order.
#[derive(Debug, Default)]
struct Found {
    keys: Vec<u16>,
    sprites: Vec<GpuSprite>,
}

impl Seen {
    /// Looks at a step's sprites. `back`: how long before the end of the step the picture is taken [s].
    pub fn look(&mut self, frame: &Frame, back: f32, lens: &Lens, layers: &Catalogue, sizes: Sizes) {
        let began = Instant::now();
        self.sprites.clear();
        self.draws.clear();
        let batches: Vec<Batch<'_>> = frame
            .outputs
            .iter()
            .filter(|outputs| !outputs.billboards.is_empty())
            .map(|outputs| Batch::new(outputs, lens, layers))
            .collect();
        let total: usize = batches.iter().map(|batch| batch.sprites.len()).sum();
        if total == 0 {
            self.seconds = 0.0;
            return;
        }
        let parts = total.div_ceil(PART);
        self.found.resize_with(parts, Mutex::default);
        let gaze = Gaze::new(lens, back, sizes);
        let look = |found: &mut Found, part: usize| {
            found.clear();
            let mut skip = part * PART;
            let mut left = PART;
            for batch in &batches {
                let from = skip.min(batch.sprites.len());
                let to = (from + left).min(batch.sprites.len());
                found.look(batch, from..to, &gaze);
                skip -= from;
                left -= to - from;
            }
        };
        // Who looks at a part changes nothing: its place in the list is its own.
        let next = AtomicUsize::new(0);
        let work = || {
            loop {
                let part = next.fetch_add(1, Ordering::Relaxed);
                let Some(found) = self.found.get(part) else { break };
                look(&mut found.lock().unwrap_or_else(PoisonError::into_inner), part);
            }
        };
        let helpers = thread::available_parallelism().map_or(1, |n| n.get()).min(MOST_THREADS).min(parts) - 1;
        thread::scope(|scope| {
            for _ in 0..helpers {
                // Where no thread can be had, this one does it all.
                let _ = thread::Builder::new().spawn_scoped(scope, work);
            }
            work();
        });
        self.sort();
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

    /// Brings what was found into order: two passes over the bytes of the keys, each keeping the order of equals.
    fn sort(&mut self) {
        let Self { sprites, draws, found, order, spare, .. } = self;
        let found: Vec<&Found> =
            found.iter_mut().map(|f| &*f.get_mut().unwrap_or_else(PoisonError::into_inner)).collect();
        // A part and a place in it, in one number.
        let key =
            |index: u32| found[(index >> PART_BITS) as usize].keys[(index & (PART as u32 - 1)) as usize];
        order.clear();
        for (part, found) in found.iter().enumerate() {
            order.extend((0..found.keys.len() as u32).map(|place| (part as u32) << PART_BITS | place));
        }
        spare.resize(order.len(), 0);
        for shift in [0, 8] {
            let mut places = [0_u32; 257];
            for key in found.iter().flat_map(|found| &found.keys) {
                places[((key >> shift) & 255) as usize + 1] += 1;
            }
            for i in 1..257 {
                places[i] += places[i - 1];
            }
            for &index in order.iter() {
                let place = &mut places[((key(index) >> shift) & 255) as usize];
                spare[*place as usize] = index;
                *place += 1;
            }
            std::mem::swap(order, spare);
        }
        for &index in order.iter() {
            let part = found[(index >> PART_BITS) as usize];
            sprites.push(part.sprites[(index & (PART as u32 - 1)) as usize]);
            let kind = if key(index) & SPECK == 0 { Kind::Quad } else { Kind::Speck };
            let at = sprites.len() as u32;
            match draws.last_mut() {
                Some((last, range)) if *last == kind => range.end = at,
                _ => draws.push((kind, at - 1..at)),
            }
        }
    }
}

impl<'a> Batch<'a> {
    fn new(outputs: &'a Outputs, lens: &Lens, layers: &Catalogue) -> Self {
        let origins =
            outputs.objects.iter().map(|object| (DVec3::from(object.origin) - lens.eye).as_vec3()).collect();
        let of = |texture: &Arc<Texture>| (texture.id, layers.of(texture));
        Self {
            sprites: &outputs.billboards,
            origins,
            layers: outputs.textures.iter().map(of).collect(),
            dot: layers.dot(),
        }
    }

    fn layer(&self, id: u32) -> Layer {
        match id {
            0 => self.dot,
            _ => self.layers.iter().find(|(known, _)| *known == id).map_or(self.dot, |(_, layer)| *layer),
        }
    }
}

/// The lens with what is the same for all sprites.
struct Gaze {
    lens: Lens,
    /// Lengths that a sphere's radius has at the sides of the picture.
    sides: [f32; 2],
    pixels: f32,
    back: f32,
    sizes: Sizes,
}

impl Gaze {
    fn new(lens: &Lens, back: f32, sizes: Sizes) -> Self {
        let sides = lens.tangent.map(|t| (1.0 + t * t).sqrt());
        Self { lens: *lens, sides, pixels: lens.pixels_per_metre(), back, sizes }
    }
}

/// The bit of a key that tells specks from quads of the same slice.
const SPECK: u16 = 1 << 9;

/// Sorts from far to near: a slice of the distance, the kind, the distance within the slice. The bits of a float grow with it.
fn key(square: f32, kind: Kind) -> u16 {
    let least = (0.5_f32).powi(10);
    let bits = square.clamp(least, 262_143.0).to_bits() - least.to_bits();
    // 28 octaves of 1024 steps.
    let far_first = 0x7fff - (bits >> 13) as u16;
    let speck = if kind == Kind::Speck { SPECK } else { 0 };
    (far_first >> 9) << 10 | speck | (far_first & 511)
}

impl Found {
    fn clear(&mut self) {
        self.keys.clear();
        self.sprites.clear();
    }

    fn look(&mut self, batch: &Batch<'_>, range: Range<usize>, gaze: &Gaze) {
        let lens = &gaze.lens;
        // Neighbours share texture and colour.
        let mut texture = (0, batch.dot);
        let mut color = (0, [0.0; 3]);
        for sprite in &batch.sprites[range] {
            let mut place = batch.origins[sprite.object as usize] + Vec3::from(sprite.position);
            if sprite.flags & abi::FLAG_NO_BLEND == 0 {
                place -= Vec3::from(sprite.velocity) * gaze.back;
            }
            let radius = sprite.size * 0.5;
            let depth = place.dot(lens.forward);
            if depth < NEAR || depth - radius > lens.far {
                continue;
            }
            let pixels = sprite.size * gaze.pixels / depth;
            // A point is as wide as it has to be at least; a quad reaches as far as its corners.
            let reach = radius.max(0.5 * gaze.sizes.least * depth / gaze.pixels) * std::f32::consts::SQRT_2;
            if place.dot(lens.right).abs() > depth * lens.tangent[0] + gaze.sides[0] * reach
                || place.dot(lens.up).abs() > depth * lens.tangent[1] + gaze.sides[1] * reach
            {
                continue;
            }
            if texture.0 != sprite.texture {
                texture = (sprite.texture, batch.layer(sprite.texture));
            }
            let layer = texture.1;
            let square = place.length_squared();
            let facing = sprite.flags & abi::BILLBOARD_FACING != 0;
            let lies = if facing { 1.0 } else { Vec3::from(sprite.axis).dot(place).abs() / square.sqrt() };
            let opacity = sprite.opacity * nearness(square.sqrt(), sprite.size);
            let kind = if pixels < gaze.sizes.speck { Kind::Speck } else { Kind::Quad };
            let share = (pixels / gaze.sizes.least).min(1.0);
            if opacity * share * share * lies * layer.mean[3].max(0.05) < FAINTEST {
                continue;
            }
            if color.0 != sprite.color || self.keys.is_empty() {
                color = (sprite.color, linear(sprite.color));
            }
            // From afar only the mean of the texture is left.
            let [r, g, b] = color.1;
            let (opacity, [mr, mg, mb, ma]) = match kind {
                Kind::Speck => (opacity * lies, layer.mean),
                Kind::Quad => (opacity, [1.0; 4]),
            };
            let tint =
                [half(r * mr * opacity), half(g * mg * opacity), half(b * mb * opacity), half(ma * opacity)];
            self.keys.push(key(square, kind));
            self.sprites.push(GpuSprite {
                place: place.to_array(),
                size: sprite.size,
                axis: if facing { [0.0; 3] } else { sprite.axis },
                roll: sprite.roll,
                tint,
                layer: layer.index,
                spare: 0,
            });
        }
    }
}

/// What is too near to be sharp fades: nothing fills the picture, or goes with a jump when the eye passes through it.
fn nearness(distance: f32, size: f32) -> f32 {
    let t = ((distance - 0.06) / (0.06 + 0.8 * size)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Linear light of a colour 0xAABBGGRR; its alpha is not read: opacity has a field of its own.
fn linear(color: u32) -> [f32; 3] {
    static CURVE: LazyLock<[f32; 256]> = LazyLock::new(|| {
        std::array::from_fn(|i| {
            let v = i as f32 / 255.0;
            if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        })
    });
    [0, 8, 16].map(|shift| CURVE[(color >> shift & 0xff) as usize])
}

/// A half float of a number in 0..1; what is too small for one is 0.
fn half(v: f32) -> u16 {
    if v < 6.2e-5 {
        return 0;
    }
    // Exponent and mantissa move down; half a step is added, and may carry.
    let bits = v.min(1.0).to_bits() + 0x1000;
    ((bits >> 13) - (112 << 10)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::sample;

    #[test]
    fn halves_are_what_the_shader_unpacks() {
        for (value, bits) in [(0.0, 0), (1.0, 0x3c00), (0.5, 0x3800), (0.25, 0x3400), (0.1, 0x2e66)] {
            assert_eq!(half(value), bits, "{value}");
        }
        assert_eq!(half(7.0), 0x3c00, "no opacity is above 1");
    }

    #[test]
    fn keys_sort_from_far_to_near_and_quads_before_specks_of_the_same_slice() {
        let mut last = u16::MAX;
        for i in 0..400 {
            let distance = 0.04_f32 * 1.024_f32.powi(i);
            let key = key(distance * distance, Kind::Quad);
            assert!(key <= last, "{distance} m");
            last = key;
        }
        assert!(key(4.0, Kind::Quad) < key(4.1, Kind::Speck));
        assert!(key(4.0, Kind::Speck) > key(8.1, Kind::Speck), "another slice");
        assert_eq!(key(0.0, Kind::Quad), key(1e-9, Kind::Quad));
        assert_eq!(key(f32::INFINITY, Kind::Quad), key(3e5, Kind::Quad));
    }

    const SIZES: Sizes = Sizes { least: 1.5, speck: 5.0 };

    fn lens() -> Lens {
        let camera = sample::looking_at(DVec3::new(0.0, -2.0, 0.0), DVec3::new(0.3, -2.2, -4.0));
        Lens::new(&camera, [640, 360], 30.0)
    }

    fn seen(outputs: Outputs) -> Seen {
        let lens = lens();
        let camera = sample::looking_at(lens.eye, DVec3::ZERO);
        let frame = sample::frame(2, camera, outputs);
        let mut seen = Seen::default();
        seen.look(&frame, 1.0 / 120.0, &lens, &Catalogue::default(), SIZES);
        seen
    }

    /// Corners of the square that holds a sprite however it is turned, on the picture; None: one lies behind the eye.
    fn corners(place: Vec3, half: f32, lens: &Lens) -> Option<Vec<[f32; 2]>> {
        let turned = [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)];
        turned
            .iter()
            .map(|(x, y)| {
                let p = lens.clip_from_eye() * (place + (lens.right * *x + lens.up * *y) * half).extend(1.0);
                (p.w > 0.0).then(|| [p.x / p.w, p.y / p.w])
            })
            .collect()
    }

    #[test]
    fn nothing_that_is_in_the_picture_is_left_out_and_most_that_is_not_is() {
        let corners_of_box = [DVec3::new(-9.0, -6.0, -12.0), DVec3::new(9.0, 2.0, 6.0)];
        let outputs = sample::snow(20_000, corners_of_box, 0.2);
        let lens = lens();
        let origin = (DVec3::from(outputs.objects[0].origin) - lens.eye).as_vec3();
        let places: Vec<(Vec3, f32)> = outputs
            .billboards
            .iter()
            .map(|b| (origin + Vec3::from(b.position) - Vec3::from(b.velocity) / 120.0, b.size))
            .collect();
        let seen = seen(outputs);
        let mut in_picture = 0;
        for (place, size) in places {
            let inside = corners(place, size * 0.5, &lens)
                .is_some_and(|corners| corners.iter().any(|[x, y]| x.abs() < 1.0 && y.abs() < 1.0));
            let near = place.length() < 0.4;
            if inside && !near {
                in_picture += 1;
                assert!(seen.sprites.iter().any(|s| Vec3::from(s.place).distance(place) < 1e-4), "{place}");
            }
        }
        assert!(in_picture > 1000, "the test sees something");
        // Those at the picture's edge, whose corners alone are outside.
        assert!(seen.count() < in_picture * 6 / 5, "{} for {in_picture}", seen.count());
    }

    #[test]
    fn what_is_seen_is_sorted_from_far_to_near_and_drawn_once() {
        let corners_of_box = [DVec3::new(-6.0, -6.0, -12.0), DVec3::new(6.0, 2.0, -1.0)];
        let seen = seen(sample::snow(20_000, corners_of_box, 0.05));
        let mut at = 0;
        for (kind, range) in &seen.draws {
            assert_eq!(range.start, at, "no gap and no overlap");
            at = range.end;
            let sprites = &seen.sprites[range.start as usize..range.end as usize];
            let small = |s: &GpuSprite| {
                s.size * lens().pixels_per_metre() / Vec3::from(s.place).dot(lens().forward) < SIZES.speck
            };
            assert!(sprites.iter().all(|s| small(s) == (*kind == Kind::Speck)));
        }
        assert_eq!(at as usize, seen.count());
        assert!(seen.draws.len() < 120, "{} draws", seen.draws.len());
        for pair in seen.sprites.windows(2) {
            let [far, near] = [pair[0], pair[1]].map(|s| Vec3::from(s.place).length());
            // Specks and quads take turns by slices: halves of an octave of the square, 1 to 1.5 of it at most.
            assert!(near < far * 1.5_f32.sqrt() * 1.001, "{near} after {far}");
        }
    }

    #[test]
    fn threads_change_nothing() {
        let corners_of_box = [DVec3::new(-6.0, -6.0, -12.0), DVec3::new(6.0, 2.0, -1.0)];
        let all = sample::snow(3 * PART, corners_of_box, 0.05);
        let lens = lens();
        let batch = Batch::new(&all, &lens, &Catalogue::default());
        let gaze = Gaze::new(&lens, 1.0 / 120.0, SIZES);
        // One after the other, and by the standard library's stable sort.
        let mut found = Found::default();
        found.look(&batch, 0..all.billboards.len(), &gaze);
        let mut alone: Vec<(u16, GpuSprite)> =
            found.keys.iter().copied().zip(found.sprites.iter().copied()).collect();
        alone.sort_by_key(|(key, _)| *key);
        let shared = seen(all.clone());
        assert!(alone.len() > PART && shared.sprites.iter().eq(alone.iter().map(|(_, sprite)| sprite)));
    }

    #[test]
    fn what_no_pixel_would_show_is_not_drawn() {
        let one = |sprite: abi::Billboard| {
            let mut outputs = sample::snow(1, [DVec3::new(0.0, -2.1, -3.0); 2], 0.01);
            outputs.billboards[0] = abi::Billboard { size: 0.01, ..sprite };
            seen(outputs).count()
        };
        let facing = abi::Billboard { flags: abi::BILLBOARD_FACING, opacity: 0.5, ..Default::default() };
        assert_eq!(one(facing), 1);
        assert_eq!(one(abi::Billboard { opacity: 0.0, ..facing }), 0);
        assert_eq!(one(abi::Billboard { opacity: 0.001, ..facing }), 0);
        let lying = abi::Billboard { flags: 0, axis: [0.0, 0.0, 1.0], ..facing };
        assert_eq!(one(lying), 1);
        assert_eq!(one(abi::Billboard { axis: [1.0, 0.0, 0.0], ..lying }), 0, "seen from its edge");
    }

    #[test]
    fn what_is_at_the_eye_fades() {
        assert_eq!((nearness(0.05, 0.01), nearness(0.5, 0.01)), (0.0, 1.0));
        assert!(nearness(0.5, 1.0) < 0.6 && nearness(2.0, 1.0) == 1.0, "a cloud fades from farther away");
    }

    #[test]
    fn colours_are_srgb_with_red_in_the_lowest_byte() {
        let [r, g, b] = linear(0xff00_80ff);
        assert_eq!((r, b), (1.0, 0.0));
        assert!((g - 0.2159).abs() < 1e-3, "{g}");
    }
}
