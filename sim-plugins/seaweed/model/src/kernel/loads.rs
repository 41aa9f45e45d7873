//! What acts on the segments (§4.3.1): drag and inertia of the water at their centres, buoyancy, and what
//! they touch.

use fearless_simd::{Select, Simd, f32x8, prelude::*};
use reef_flow::simd::{clamp, splat};

use super::{Needs, Node, Pass, Stand, pose::Frame};
use crate::{
    lanes::{
        Vector, add_scaled, dot, length, load, load3, mix, scale, smooth, store, store3, sub, sub_scaled,
    },
    skeleton::Joint,
    water::{Felt, current, felt, swell, together},
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
pub(crate) const SKIN: f32 = 0.05;
/// Where on a segment, as shares of its length, two points stand for it: ½ ∓ 1/(2√3).
const GAUSS: [f32; 2] = [0.211_324_87, 0.788_675_1];

/// What acts on all segments of a pack.
pub(super) struct Acting<'a, S: Simd> {
    pass: &'a Pass<'a>,
    size: f32x8<S>,
    size2: f32x8<S>,
    size3: f32x8<S>,
    normal: Vector<S>,
    ground: f32x8<S>,
}

impl<'a, S: Simd> Acting<'a, S> {
    #[inline(always)]
    pub(super) fn new(simd: S, pass: &'a Pass<'a>, stand: &Stand) -> Self {
        let size = load(simd, &stand.size);
        Self {
            pass,
            size,
            size2: size * size,
            size3: size * size * size,
            normal: load3(simd, &stand.normal),
            ground: load(simd, &stand.ground),
        }
    }

    /// The water at a segment's centre.
    #[inline(always)]
    pub(super) fn water(&self, simd: S, joint: &Joint, y: Vector<S>, origin: Vector<S>) -> Felt<f32x8<S>> {
        let half = self.size * splat(simd, 0.5 * joint.length);
        felt(simd, &self.pass.water, add_scaled(origin, y, half))
    }

    /// Forces on a segment in that water.
    #[inline(always)]
    pub(super) fn act(
        &self,
        simd: S,
        joint: &Joint,
        frame: &Frame<S>,
        felt: &Felt<f32x8<S>>,
        node: &mut Node,
    ) {
        let one = splat(simd, 1.0);
        let (y, origin) = (frame.y, frame.origin);
        let long = self.size * splat(simd, joint.length);
        let end = add_scaled(origin, y, long);
        let weight = self.size3 * splat(simd, joint.weight);
        let buoyant = self.size3 * splat(simd, joint.lift) + weight;
        let (mut drag, mut carried) =
            (self.size2 * splat(simd, joint.drag), self.size3 * splat(simd, joint.carried));
        let mut up = buoyant - weight;
        let mut touch = self.touch(simd, joint, end, node);
        // Deep down each of the following is exact: what a neighbour needs changes nothing.
        if self.pass.deep {
            store(&mut node.surface, splat(simd, 0.0));
            touch[1] += splat(simd, 0.0);
        } else {
            // What is above the surface has no water to drag it or to bear it. Seen at two points (Gauss's),
            // so that a segment that floats lies down.
            let under = felt.rise - origin[1] - splat(simd, self.pass.level);
            let rises = y[1] * long;
            let lower = wet(simd, under - rises * splat(simd, GAUSS[0]));
            let upper = wet(simd, under - rises * splat(simd, GAUSS[1]));
            let wet = (lower + upper) * splat(simd, 0.5);
            // Two forces at the points are one at the centre and one at the end.
            let aside = (upper - lower) * buoyant * splat(simd, 0.5 * (GAUSS[1] - GAUSS[0]));
            (drag, carried) = (drag * wet, carried * wet);
            up = wet * buoyant - weight - aside;
            touch[1] += aside;
            let floating = wet * (one - wet) * splat(simd, 4.0);
            store(&mut node.surface, floating * buoyant.abs() * splat(simd, 0.5 / SKIN));
        }
        let mut force = add_scaled(scale(felt.velocity, drag), felt.acceleration, carried);
        force[1] += up;
        store3(&mut node.force, force);
        store(&mut node.drag, drag);
        store3(&mut node.touch, touch);
    }

    /// The force of what a segment's end overlaps: the sum of (overlap) · (way out) · stiffness.
    #[inline(always)]
    fn touch(&self, simd: S, joint: &Joint, end: Vector<S>, node: &mut Node) -> Vector<S> {
        let (one, zero) = (splat(simd, 1.0), splat(simd, 0.0));
        if self.pass.contact <= 0.0 {
            store(&mut node.touching, zero);
            return [zero; 3];
        }
        let radius = self.size * splat(simd, joint.radius);
        let over = dot(self.normal, end) - self.ground;
        let depth = (radius - over - self.size * splat(simd, joint.buried)).max(zero);
        let mut push = scale(self.normal, depth);
        let mut touching = depth.simd_gt(zero).select(one, zero);
        for capsule in self.pass.capsules {
            let (off, distance) = from_axis(simd, capsule, end);
            let depth = (radius + splat(simd, capsule.radius) - distance).max(zero);
            touching = depth.simd_gt(zero).select(one, touching);
            // On the axis itself there is no way out to prefer: no push.
            push = add_scaled(push, off, depth / distance.max(splat(simd, 1e-9)));
        }
        store(&mut node.touching, touching);
        scale(push, splat(simd, self.pass.contact))
    }
}

/// Share of a point that is in the water, so far under its surface.
#[inline(always)]
fn wet<S: Simd>(simd: S, under: f32x8<S>) -> f32x8<S> {
    let share = under * splat(simd, 0.5 / SKIN) + splat(simd, 0.5);
    clamp(share, splat(simd, 0.0), splat(simd, 1.0))
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

/// The water and the forces of all segments where some take it from others: the waves from two of their
/// branch, and what a level, or one between two, leaves out.
#[inline(always)]
pub(super) fn shared<S: Simd>(simd: S, pass: &Pass<'_>, needs: Needs, stand: &Stand, nodes: &mut [Node]) {
    let acting = Acting::new(simd, pass, stand);
    let stations = pass.stations.filter(|_| needs.level < 2);
    for (number, (joint, node)) in (0..).zip(pass.joints.iter().zip(nodes.iter_mut())) {
        let feels = joint.feels(number, needs.level);
        let waves = stations.map_or(feels, |stations| {
            joint.stations[stations][0] == number || (needs.mixed && joint.far == number)
        });
        if !feels && !waves {
            continue;
        }
        let half = acting.size * splat(simd, 0.5 * joint.length);
        let place = add_scaled(load3(simd, &node.origin), load3(simd, &node.y), half);
        if feels {
            store3(&mut node.velocity, current(simd, &pass.water, place));
        }
        if waves {
            let swell = swell(simd, &pass.water, place);
            store3(&mut node.orbit, swell.velocity);
            store3(&mut node.acceleration, swell.acceleration);
            store(&mut node.rise, swell.rise);
        }
    }
    let one = splat(simd, 1.0);
    let detail = load(simd, &stand.detail);
    let shares = Shares { middle: smooth(simd, detail), far: smooth(simd, detail - one) };
    for (number, joint) in pass.joints.iter().enumerate() {
        // Not by closures: see [`super::pose::with_loads`].
        let (middle, far) = (joint.middle as usize, &nodes[joint.far as usize]);
        let felt = if needs.level == 2 {
            at(simd, far)
        } else {
            let mut felt = near(simd, &pass.joints[middle], middle, nodes, stations);
            if needs.level == 0 {
                let own = near(simd, joint, number, nodes, stations);
                felt = if needs.mixed { mixed(simd, &own, &felt, shares.middle) } else { own };
            }
            if needs.mixed { mixed(simd, &felt, &at(simd, far), shares.far) } else { felt }
        };
        let node = &mut nodes[number];
        let frame = Frame { x: [one; 3], y: load3(simd, &node.y), origin: load3(simd, &node.origin) };
        acting.act(simd, joint, &frame, &felt, node);
    }
}

/// Share of the middle level's water, and of the far one's on top of that.
#[derive(Clone, Copy)]
struct Shares<S: Simd> {
    middle: f32x8<S>,
    far: f32x8<S>,
}

/// The waves where they are evaluated.
#[inline(always)]
fn waves_at<S: Simd>(simd: S, node: &Node) -> Felt<f32x8<S>> {
    Felt {
        velocity: load3(simd, &node.orbit),
        acceleration: load3(simd, &node.acceleration),
        rise: load(simd, &node.rise),
    }
}

/// The water where it is evaluated.
#[inline(always)]
fn at<S: Simd>(simd: S, node: &Node) -> Felt<f32x8<S>> {
    together(simd, load3(simd, &node.velocity), &waves_at(simd, node))
}

/// The water at a segment, not far away: currents where it is, and the waves between those at two of its
/// branch.
#[inline(always)]
fn near<S: Simd>(
    simd: S,
    joint: &Joint,
    number: usize,
    nodes: &[Node],
    stations: Option<usize>,
) -> Felt<f32x8<S>> {
    let Some(stations) = stations else { return at(simd, &nodes[number]) };
    let [first, second] = joint.stations[stations].map(|station| station as usize);
    if first == second {
        return at(simd, &nodes[number]);
    }
    let (a, b) = (waves_at(simd, &nodes[first]), waves_at(simd, &nodes[second]));
    let share = splat(simd, joint.between[stations]);
    let mut between = a;
    for axis in 0..3 {
        between.velocity[axis] = mix(simd, a.velocity[axis], b.velocity[axis], share);
        between.acceleration[axis] = mix(simd, a.acceleration[axis], b.acceleration[axis], share);
    }
    between.rise = mix(simd, a.rise, b.rise, share);
    together(simd, load3(simd, &nodes[number].velocity), &between)
}

/// Some of one water, and a share of another.
#[inline(always)]
fn mixed<S: Simd>(simd: S, a: &Felt<f32x8<S>>, b: &Felt<f32x8<S>>, share: f32x8<S>) -> Felt<f32x8<S>> {
    let mut felt = *a;
    for axis in 0..3 {
        felt.velocity[axis] = mix(simd, a.velocity[axis], b.velocity[axis], share);
        felt.acceleration[axis] = mix(simd, a.acceleration[axis], b.acceleration[axis], share);
    }
    felt.rise = mix(simd, a.rise, b.rise, share);
    felt
}

#[cfg(test)]
mod tests {
    use reef_flow::{Level, Packed, waves::Trains};
    use reef_sdk::abi::Wave;

    use super::*;
    use crate::{
        kernel::Room,
        lanes::{Lane, WIDTH},
        skeleton::{STATIONS, Segment, Skeleton},
        water::Water,
    };

    /// A blade of 3 m that leans by 45° along x.
    fn blade() -> Skeleton {
        let segment = |i: usize| Segment {
            parent: i.checked_sub(1),
            height: if i == 0 { 0.0 } else { 0.05 },
            length: 0.05,
            theta: if i == 0 { core::f64::consts::FRAC_PI_2 } else { 0.0 },
            phi: if i == 0 { core::f64::consts::FRAC_PI_4 } else { 0.0 },
            ..Segment::default()
        };
        Skeleton::new(&(0..60).map(segment).collect::<Vec<_>>()).expect("a blade")
    }

    /// What the waves do at all segments of a blade in each lane, by its own evaluation or between stations.
    fn felt(trains: &Trains, stations: Option<usize>) -> Vec<[Lane; 6]> {
        let skeleton = blade();
        let mut room = Room::default();
        room.fit(skeleton.len());
        let mut stand = Stand { size: Lane::all(1.0), stiff: Lane::all(1.0), ..Stand::default() };
        (stand.x[0], stand.y[1], stand.normal[1]) = (Lane::all(1.0), Lane::all(1.0), Lane::all(1.0));
        // Where in a wave the blade stands differs from lane to lane.
        stand.origin =
            [Lane(core::array::from_fn(|lane| 0.7 * lane as f32)), Lane::all(-4.0), Lane::all(0.0)];
        let currents = Packed::new();
        let pass = Pass {
            joints: &skeleton.joints,
            water: Water { currents: &currents, trains, count: usize::MAX, share: 1.0 },
            level: 0.0,
            capsules: &[],
            dt: Lane::all(1.0 / 60.0),
            lag: 0.3,
            contact: 0.0,
            deep: false,
            stations,
        };
        let needs = Needs::of(&stand, &pass.dt).expect("they are stepped");
        let rest: Vec<_> = skeleton
            .segments()
            .iter()
            .map(|segment| crate::kernel::Row {
                theta: Lane::all(segment.theta as f32),
                phi: Lane::all(segment.phi as f32),
                ..Default::default()
            })
            .collect();
        reef_flow::dispatch!(Level::scalar(), simd => {
            crate::kernel::pose::pose(simd, &pass, &stand, &rest, &mut room.nodes);
            shared(simd, &pass, needs, &stand, &mut room.nodes);
            let all = 0..skeleton.len();
            let water = all.map(|number| near(simd, &skeleton.joints[number], number, &room.nodes, stations));
            water
                .map(|felt| {
                    let mut lanes = [Lane::default(); 6];
                    for axis in 0..3 {
                        store(&mut lanes[axis], felt.velocity[axis]);
                        store(&mut lanes[3 + axis], felt.acceleration[axis]);
                    }
                    lanes
                })
                .collect()
        })
    }

    /// The greatest error between stations over the greatest that there is, of velocity and of acceleration.
    fn error(length: f64, stations: usize) -> [f32; 2] {
        let k = core::f64::consts::TAU / length;
        let train = |phase: f32| Wave {
            amplitude: 0.1,
            wave_number: k as f32,
            frequency: (9.81 * k).sqrt() as f32,
            direction: [1.0, 0.0],
            phase,
            ..Wave::default()
        };
        let mut worst = [0.0_f32; 2];
        for turn in 0..8 {
            let mut trains = Trains::new();
            trains.fill(&[train(0.8 * turn as f32)], 50.0, [0.0; 3]);
            let (own, between) = (felt(&trains, None), felt(&trains, Some(stations)));
            for (of, worst) in [0, 3].into_iter().zip(&mut worst) {
                let size = |lanes: &[Lane; 6], other: &[Lane; 6], lane: usize| {
                    let square = |i: usize| (lanes[i].0[lane] - other[i].0[lane]).powi(2);
                    (of..of + 3).map(square).sum::<f32>().sqrt()
                };
                for lane in 0..WIDTH {
                    let most =
                        own.iter().map(|own| size(own, &[Lane::default(); 6], lane)).fold(0.0, f32::max);
                    let off = own.iter().zip(&between).map(|(a, b)| size(a, b, lane)).fold(0.0, f32::max);
                    *worst = worst.max(off / most);
                }
            }
        }
        worst
    }

    #[test]
    fn between_stations_waves_err_by_three_percent_at_most() {
        for (number, apart) in STATIONS.iter().enumerate() {
            // The shortest wave for which the bed takes these stations, see `bed/spacing.rs`.
            let shortest = apart * core::f64::consts::TAU / 0.24_f64.sqrt();
            let [speed, pull] = error(shortest, number);
            println!("{apart} m apart, waves of {shortest:.2} m: {speed:.4} and {pull:.4}");
            assert!(speed < 0.031 && pull < 0.031, "{apart} m: {speed} {pull}");
            assert!(apart < &0.2 || (speed > 0.01 && pull > 0.01), "{apart} m: {speed} {pull}");
        }
        // Half a metre apart they would err by so much at 6 m and at 3 m.
        let [six, three] = [6.0, 3.0].map(|length| error(length, 1)[1]);
        println!("half a metre apart: {six:.4} at 6 m, {three:.4} at 3 m");
        assert!(six > 0.02 && three > 0.08, "{six} {three}");
    }
}
