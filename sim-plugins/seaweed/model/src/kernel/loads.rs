//! What acts on the segments (§4.3.1): drag and inertia of the water at their centres, buoyancy, and what they touch.

use fearless_simd::{Select, Simd, f32x8, prelude::*};
use reef_flow::simd::{clamp, splat};

use super::{Needs, Node, Pass, Stand};
use crate::{
    lanes::{Lane, Vector, add_scaled, dot, length, load, load3, mix, scale, smooth, store, store3, sub, sub_scaled},
    skeleton::Joint,
    water::felt,
};

/// A capsule that nothing should enter, relative to the anchor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Capsule {
    /// One end of its axis [m], and from there to the other.
    pub(crate) from: [f32; 3],
    pub(crate) delta: [f32; 3],
    /// [m]
    pub(crate) radius: f32,
}

/// Half of the height [m] over which a segment comes out of the water.
const SKIN: f32 = 0.05;
/// Where on a segment, as shares of its length, two points stand for it: ½ ∓ 1/(2√3).
const GAUSS: [f32; 2] = [0.211_324_87, 0.788_675_13];

/// The water at the centres of all segments for which their levels ask.
#[inline(always)]
pub(super) fn evaluate<S: Simd>(simd: S, pass: &Pass<'_>, needs: Needs, stand: &Stand, nodes: &mut [Node]) {
    let size = load(simd, &stand.size);
    for (number, (joint, node)) in (0..).zip(pass.joints.iter().zip(nodes)) {
        if joint.feels(number, needs.level) {
            let half = size * splat(simd, 0.5 * joint.length);
            let center = add_scaled(load3(simd, &node.origin), load3(simd, &node.y), half);
            let felt = felt(simd, &pass.water, center);
            store3(&mut node.velocity, felt.velocity);
            store3(&mut node.acceleration, felt.acceleration);
            store(&mut node.rise, felt.rise);
        }
    }
}

/// The water that a segment feels: its own, or that of another of its branch; between two levels some of both.
#[derive(Clone, Copy)]
struct Shares<S: Simd> {
    /// Share of the middle level's, and of the far one's on top of that.
    middle: f32x8<S>,
    far: f32x8<S>,
}

/// One number of the water of a segment.
#[inline(always)]
fn taken<S: Simd>(
    simd: S,
    (needs, shares): (Needs, Shares<S>),
    [own, middle, far]: [&Node; 3],
    pick: impl Fn(&Node) -> &Lane,
) -> f32x8<S> {
    let level = if needs.level == 0 {
        let own = load(simd, pick(own));
        if !needs.mixed {
            return own;
        }
        mix(simd, own, load(simd, pick(middle)), shares.middle)
    } else if needs.level == 1 {
        load(simd, pick(middle))
    } else {
        return load(simd, pick(far));
    };
    if needs.mixed { mix(simd, level, load(simd, pick(far)), shares.far) } else { level }
}

/// Forces of all segments.
#[inline(always)]
pub(super) fn act<S: Simd>(simd: S, pass: &Pass<'_>, needs: Needs, stand: &Stand, nodes: &mut [Node]) {
    let size = load(simd, &stand.size);
    let (size2, size3) = (size * size, size * size * size);
    let (one, zero) = (splat(simd, 1.0), splat(simd, 0.0));
    let detail = load(simd, &stand.detail);
    let shares = Shares { middle: smooth(simd, detail), far: smooth(simd, detail - one) };
    let contacts = Contacts::new(simd, pass, stand);
    for (number, joint) in pass.joints.iter().enumerate() {
        let sources = [&nodes[number], &nodes[joint.middle as usize], &nodes[joint.far as usize]];
        let how = (needs, shares);
        let mut velocity = [zero; 3];
        let mut acceleration = [zero; 3];
        for i in 0..3 {
            velocity[i] = taken(simd, how, sources, |node| &node.velocity[i]);
            acceleration[i] = taken(simd, how, sources, |node| &node.acceleration[i]);
        }
        let rise = taken(simd, how, sources, |node| &node.rise);
        let node = &mut nodes[number];
        let (y, origin) = (load3(simd, &node.y), load3(simd, &node.origin));
        let long = size * splat(simd, joint.length);
        // What is above the surface has no water to drag it or to bear it. Seen at two points (Gauss's), so that a segment that
        // floats lies down.
        let under = rise - origin[1] - splat(simd, pass.level);
        let rises = y[1] * long;
        let lower = wet(simd, under - rises * splat(simd, GAUSS[0]));
        let upper = wet(simd, under - rises * splat(simd, GAUSS[1]));
        let wet = (lower + upper) * splat(simd, 0.5);
        let drag = size2 * splat(simd, joint.drag) * wet;
        let carried = size3 * splat(simd, joint.carried) * wet;
        let mut force = add_scaled(scale(velocity, drag), acceleration, carried);
        let weight = size3 * splat(simd, joint.weight);
        let buoyant = size3 * splat(simd, joint.lift) + weight;
        let aside = (upper - lower) * buoyant * splat(simd, 0.5 * (GAUSS[1] - GAUSS[0]));
        force[1] += wet * buoyant - weight - aside;
        store3(&mut node.force, force);
        store(&mut node.drag, drag);
        contacts.push(simd, joint, size, add_scaled(origin, y, long), node);
        // Two forces at the points are one at the centre and one at the end.
        let end = load(simd, &node.touch[1]) + aside;
        store(&mut node.touch[1], end);
        let floating = wet * (one - wet) * splat(simd, 4.0);
        store(&mut node.surface, floating * buoyant.abs() * splat(simd, 0.5 / SKIN));
    }
}

/// Share of a point that is in the water, so far under its surface.
#[inline(always)]
fn wet<S: Simd>(simd: S, under: f32x8<S>) -> f32x8<S> {
    let share = under * splat(simd, 0.5 / SKIN) + splat(simd, 0.5);
    clamp(share, splat(simd, 0.0), splat(simd, 1.0))
}

/// What the segments may touch.
struct Contacts<'a, S: Simd> {
    capsules: &'a [Capsule],
    normal: Vector<S>,
    ground: f32x8<S>,
    stiffness: f32,
}

impl<'a, S: Simd> Contacts<'a, S> {
    #[inline(always)]
    fn new(simd: S, pass: &Pass<'a>, stand: &Stand) -> Self {
        Self {
            capsules: pass.capsules,
            normal: load3(simd, &stand.normal),
            ground: load(simd, &stand.ground),
            stiffness: pass.contact,
        }
    }

    /// The force at a segment's end: the sum over what it overlaps of (overlap) · (way out) · stiffness.
    #[inline(always)]
    fn push(&self, simd: S, joint: &Joint, size: f32x8<S>, end: Vector<S>, node: &mut Node) {
        let (one, zero) = (splat(simd, 1.0), splat(simd, 0.0));
        let radius = size * splat(simd, joint.radius);
        let over = dot(self.normal, end) - self.ground;
        let depth = (radius - over - size * splat(simd, joint.buried)).max(zero);
        let mut push = scale(self.normal, depth);
        let mut touching = depth.simd_gt(zero).select(one, zero);
        for capsule in self.capsules {
            let (off, distance) = from_axis(simd, capsule, end);
            let depth = (radius + splat(simd, capsule.radius) - distance).max(zero);
            touching = depth.simd_gt(zero).select(one, touching);
            // On the axis itself there is no way out to prefer: no push.
            push = add_scaled(push, off, depth / distance.max(splat(simd, 1e-9)));
        }
        let stiffness = splat(simd, self.stiffness);
        store3(&mut node.touch, scale(push, stiffness));
        store(&mut node.touching, if self.stiffness > 0.0 { touching } else { zero });
    }
}

/// From the nearest point of a capsule's axis, and how far that is.
#[inline(always)]
fn from_axis<S: Simd>(simd: S, capsule: &Capsule, place: Vector<S>) -> (Vector<S>, f32x8<S>) {
    let [dx, dy, dz] = capsule.delta;
    let inverse = 1.0 / (dx * dx + dy * dy + dz * dz).max(1e-12);
    let [x, y, z] = capsule.from;
    let p = sub(place, [splat(simd, x), splat(simd, y), splat(simd, z)]);
    let d = [splat(simd, dx), splat(simd, dy), splat(simd, dz)];
    let along = clamp(dot(d, p) * splat(simd, inverse), splat(simd, 0.0), splat(simd, 1.0));
    let off = sub_scaled(p, d, along);
    (off, length(off))
}
