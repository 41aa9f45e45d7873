//! A plugin in Rust to learn from: a small forest of kelp that bends in the water.
//!
//! A stalk is a chain of segments of equal length, lifted by its floats and dragged by the water. At rest,
//! the slope of a segment is the drag of all that is above it over the lift of all that is above it; a stalk
//! follows that slope with a delay. Blades grow from its nodes and stream with it. The stalks calm the water
//! between them.
//!
//! The same plugin stands beside this one in C and in C++, and emits the same bytes. Hence every sum has one
//! order, and only + − · ÷ and square roots are used, which IEEE 754 rounds alike everywhere.

#![deny(unsafe_code)]

use reef_sdk::prelude::*;

/// Most stalks of a forest.
const MOST: usize = 64;
/// Segments of a stalk.
const SEGMENTS: usize = 16;
/// Nodes of a stalk.
const NODES: usize = SEGMENTS + 1;
/// Node that bears the lowest blade.
const FIRST_BLADE: usize = 2;
/// Blades of a stalk.
const BLADES: usize = NODES - FIRST_BLADE;
/// Nodes of a blade.
const BLADE_NODES: usize = 6;
/// Fibres of a stalk: itself, then its blades from below.
const ALL_FIBRES: usize = 1 + BLADES;
/// Nodes of all of them.
const ALL_NODES: usize = NODES + BLADES * BLADE_NODES;

/// Distance between neighbouring stalks, about [m].
const SPACING: f32 = 0.12;
/// Square of the speed whose drag equals the lift [m²/s²]: 0.14 m/s.
const LIFT: f32 = 0.02;
/// Slope of a stalk in still water, away from the middle.
const LEAN: f32 = 0.06;
/// Most by which a segment differs from that, from side to side.
const CROOK: f32 = 0.4;
/// Cosine and sine of the golden angle, 137.5 degrees.
const GOLDEN: [f32; 2] = [-0.737_368_9, 0.675_490_3];

/// Ids of the parameters: they never change.
const COUNT: u32 = 1;
const HEIGHT: u32 = 2;
const STIFFNESS: u32 = 3;
const DELAY: u32 = 4;
const X: u32 = 5;
const Z: u32 = 6;

static PARAMS: &[Param] = &[
    Param::int(COUNT, "count")
        .label("Stalks")
        .group("Kelp")
        .range(1.0, MOST as f64)
        .default(12.0)
        .help("How many stalks grow."),
    Param::float(HEIGHT, "height")
        .label("Height")
        .group("Kelp")
        .unit("m")
        .range(0.2, 5.0)
        .default(1.4)
        .help("Length of the longest stalk."),
    Param::float(STIFFNESS, "stiffness")
        .label("Stiffness")
        .group("Kelp")
        .range(0.1, 10.0)
        .default(1.0)
        .logarithmic()
        .help("Factor on what holds the stalks upright."),
    Param::float(DELAY, "delay")
        .label("Delay")
        .group("Kelp")
        .unit("s")
        .range(0.02, 10.0)
        .default(0.7)
        .logarithmic()
        .help("How slowly the stalks follow the water."),
    Param::float(X, "x").group("Place").unit("m").range(-10000.0, 10000.0).help("Where the forest stands."),
    Param::float(Z, "z").group("Place").unit("m").range(-10000.0, 10000.0).help("Where the forest stands."),
];

/// The module's table in a scene file: parameters say it all, so it has no keys.
#[derive(serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Config {}

/// Slope of each segment of a stalk along x and z.
type Bend = [[f32; 2]; SEGMENTS];

/// One module of a scene.
struct Kelp {
    /// What a saved state holds, for as many stalks as there may be.
    bend: Vec<Bend>,
    /// The stalks as they stand in this step.
    stalks: Vec<Stalk>,
}

/// A stalk as it stands in this step.
#[derive(Clone, Copy, Default)]
struct Stalk {
    /// Relative to the origin [m].
    root: [f32; 3],
    /// Unit vector away from the middle.
    out: [f32; 2],
    /// Length of a segment [m].
    segment: f32,
    hash: u32,
}

/// A hash of one number (a permutation of all 32-bit numbers).
fn mix(v: u32) -> u32 {
    let v = (v ^ (v >> 16)).wrapping_mul(0x7feb_352d);
    let v = (v ^ (v >> 15)).wrapping_mul(0x846c_a68b);
    v ^ (v >> 16)
}

/// 0 to below 1.
fn unit(hash: u32) -> f32 {
    (hash >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Turned by the golden angle.
fn turned([c, s]: [f32; 2]) -> [f32; 2] {
    [c * GOLDEN[0] - s * GOLDEN[1], c * GOLDEN[1] + s * GOLDEN[0]]
}

/// y of the bed; without heights it is level.
fn bed(input: &StepInput, x: f64, z: f64) -> f32 {
    input.heightfield().map_or(-input.water().depth, |field| field.height(x, z))
}

/// Puts the stalks on the bed, the next one always turned by the golden angle and a little farther out.
fn stand(input: &StepInput, origin: [f64; 3], stalks: &mut [Stalk]) {
    let ground = bed(input, origin[0], origin[2]);
    let height = input.param(HEIGHT) as f32;
    let mut out = [1.0, 0.0];
    for (n, stalk) in stalks.iter_mut().enumerate() {
        let radius = SPACING * (n as f32 + 0.5).sqrt();
        let (x, z) = (radius * out[0], radius * out[1]);
        let hash = mix(input.seed() as u32 ^ mix(n as u32));
        *stalk = Stalk {
            root: [x, bed(input, origin[0] + f64::from(x), origin[2] + f64::from(z)) - ground, z],
            out,
            segment: height * (0.6 + 0.4 * unit(hash)) / SEGMENTS as f32,
            hash,
        };
        out = turned(out);
    }
}

/// A stalk's nodes from its bend.
fn grow(stalk: &Stalk, bend: &Bend) -> [[f32; 3]; NODES] {
    let mut nodes = [stalk.root; NODES];
    for (k, [bx, bz]) in bend.iter().enumerate() {
        let rise = stalk.segment / (1.0 + bx * bx + bz * bz).sqrt();
        let [x, y, z] = nodes[k];
        nodes[k + 1] = [x + bx * rise, y + rise, z + bz * rise];
    }
    nodes
}

/// How a forest follows the water.
struct Following {
    dt: f32,
    stiffness: f32,
    delay: f32,
}

impl Following {
    /// Lets a stalk follow the water at the upper ends of its segments, from the tip down, as the drag adds
    /// up.
    fn bend(&self, stalk: &Stalk, vx: &[f32], vz: &[f32], bend: &mut Bend) {
        let mut drag = [0.0_f32; 2];
        for (k, bend) in bend.iter_mut().enumerate().rev() {
            let (vx, vz) = (vx[k], vz[k]);
            let speed = (vx * vx + vz * vz).sqrt();
            let lift = LIFT * self.stiffness * (SEGMENTS - k) as f32;
            // The tip is the last to follow.
            let delay = self.delay * (0.5 + (k + 1) as f32 / SEGMENTS as f32);
            // An implicit step: stable at any length, exactly still for dt = 0.
            let share = self.dt / (delay + self.dt);
            let crook = |side| CROOK * (unit(mix(stalk.hash.wrapping_add(2 * k as u32 + side))) - 0.5);
            drag[0] += speed * vx;
            drag[1] += speed * vz;
            bend[0] += share * (LEAN * stalk.out[0] + crook(0) + drag[0] / lift - bend[0]);
            bend[1] += share * (LEAN * stalk.out[1] + crook(1) + drag[1] / lift - bend[1]);
        }
    }
}

/// A blade: out from its node and up, then over, and all of it along with the bend of the stalk. Returns the
/// unit vector that it is wide along: across its first segment, and level.
fn grow_blade(
    root: [f32; 3],
    out: [f32; 2],
    bend: [f32; 2],
    length: f32,
    width: f32,
    nodes: &mut [abi::FibreNode],
) -> [f32; 3] {
    let mut normal = [1.0, 0.0, 0.0];
    let mut p = root;
    for (i, node) in nodes.iter_mut().enumerate() {
        let q = i as f32 / (BLADE_NODES - 1) as f32;
        *node = abi::FibreNode { position: p, radius: width * (0.1 + 3.6 * q * (1.0 - q)) };
        let d = [
            out[0] * (1.0 - 0.4 * q) + 2.5 * bend[0] * (0.3 + q),
            0.5 - 0.9 * q,
            out[1] * (1.0 - 0.4 * q) + 2.5 * bend[1] * (0.3 + q),
        ];
        let scale = length / (BLADE_NODES - 1) as f32 / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        if i == 0 {
            let across = (d[0] * d[0] + d[2] * d[2]).sqrt();
            if across >= 1e-6 {
                normal = [-d[2] / across, 0.0, d[0] / across];
            }
        }
        for axis in 0..3 {
            p[axis] += d[axis] * scale;
        }
    }
    normal
}

/// Writes one stalk's fibres and nodes.
fn write_stalk(
    n: usize,
    stalk: &Stalk,
    chain: &[[f32; 3]; NODES],
    bend: &Bend,
    fibres: &mut [abi::Fibre],
    nodes: &mut [abi::FibreNode],
) {
    for (k, (node, position)) in nodes.iter_mut().zip(chain).enumerate() {
        let radius = stalk.segment * (0.07 - 0.04 * (k as f32 / SEGMENTS as f32));
        *node = abi::FibreNode { position: *position, radius };
    }
    let first = n * ALL_NODES;
    fibres[0] = abi::Fibre {
        first_node: first as u32,
        node_count: NODES as u32,
        sides: 8,
        variation: stalk.hash,
        flatness: 1.0,
        normal: [-stalk.out[1], 0.0, stalk.out[0]],
        ..Default::default()
    };
    let mut out = stalk.out;
    for b in 0..BLADES {
        let node = FIRST_BLADE + b;
        let at = NODES + b * BLADE_NODES;
        let hash = mix(stalk.hash.wrapping_sub(b as u32 + 1));
        let length = stalk.segment * (3.5 + 1.5 * unit(hash));
        let blade = &mut nodes[at..at + BLADE_NODES];
        out = turned(out);
        let normal = grow_blade(chain[node], out, bend[node - 1], length, 0.1 * length, blade);
        fibres[1 + b] = abi::Fibre {
            first_node: (first + at) as u32,
            node_count: BLADE_NODES as u32,
            material: 1,
            flags: abi::FIBRE_BLADE,
            sides: 6,
            variation: hash,
            flatness: 0.08,
            normal,
            ..Default::default()
        };
    }
}

/// A point near an origin, in the world.
fn world(origin: [f64; 3], local: [f32; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| origin[axis] + f64::from(local[axis]))
}

/// What recordings see: each stalk and each blade an object of its own, its nodes from the root to the tip.
fn trace(
    origin: [f64; 3],
    fibres: &[abi::Fibre],
    nodes: &[abi::FibreNode],
    output: &mut Output,
) -> Result<(), StepError> {
    let points = output.reserve::<abi::Trace>(nodes.len())?;
    let all =
        fibres.iter().enumerate().flat_map(|(f, fibre)| (0..fibre.node_count).map(move |k| (f, fibre, k)));
    for (point, (f, fibre, k)) in points.iter_mut().zip(all) {
        let node = &nodes[(fibre.first_node + k) as usize];
        *point = abi::Trace {
            object: f as u64,
            position: world(origin, node.position),
            radius: node.radius,
            node: k,
            kind: 0,
            spare: 0,
        };
    }
    output.commit::<abi::Trace>(nodes.len())
}

impl Plugin for Kelp {
    const ID: &'static str = "example.kelp-rust";
    const NAME: &'static str = "Kelp in Rust";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const VENDOR: &'static str = "Reef";
    const DESCRIPTION: &'static str = "A small forest of kelp that bends in the water, in Rust.";
    const STATE_VERSION: u32 = 1;
    const STATE_MIN_VERSION: u32 = 1;
    type Config = Config;

    fn traces() -> &'static [&'static str] {
        &["fibre"]
    }

    fn params() -> &'static [Param] {
        PARAMS
    }

    fn create(_host: &Host, _scene: &SceneInfo, _config: Config) -> Result<Self, ConfigError> {
        Ok(Self { bend: vec![[[0.0; 2]; SEGMENTS]; MOST], stalks: vec![Stalk::default(); MOST] })
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        let count = input.param(COUNT) as usize;
        let height = input.param(HEIGHT) as f32;
        let (x, z) = (input.param(X), input.param(Z));
        let origin = [x, f64::from(bed(input, x, z)), z];
        let stalks = &mut self.stalks[..count];
        stand(input, origin, stalks);

        // All points at once, without the shelter that object 1, the forest, gives itself.
        let points = count * SEGMENTS;
        let [x, y, z] = [input.scratch(points)?, input.scratch(points)?, input.scratch(points)?];
        let [vx, vy, vz] = [input.scratch(points)?, input.scratch(points)?, input.scratch(points)?];
        for (n, stalk) in stalks.iter().enumerate() {
            for (k, node) in grow(stalk, &self.bend[n])[1..].iter().enumerate() {
                [x[n * SEGMENTS + k], y[n * SEGMENTS + k], z[n * SEGMENTS + k]] = *node;
            }
        }
        input.sample_flow(origin, 1, [x, y, z], [vx, vy, vz])?;

        // Room first: after this nothing can fail that leaves half a step behind.
        let fibres = output.reserve::<abi::Fibre>(count * ALL_FIBRES)?;
        let nodes = output.reserve::<abi::FibreNode>(count * ALL_NODES)?;
        // A host that takes no debug lines gets none: the step goes on.
        let wanted = if input.wants_debug() { points } else { 0 };
        let lines = output.offer::<abi::DebugLine>(wanted)?.unwrap_or_default();
        let reach = height + SPACING * (count as f32).sqrt();
        output.emit(&[abi::Object {
            id: 1,
            origin,
            bounds_center: [0.0, height / 2.0, 0.0],
            bounds_radius: reach,
            ..Default::default()
        }])?;
        output.emit(&[
            abi::Material {
                base: [0.30, 0.20, 0.05, 1.0],
                tip: [0.45, 0.34, 0.08, 0.3],
                translucency: 0.2,
                wrap: 0.3,
                rim: 0.2,
                roughness: 0.7,
                specular: 0.0003,
                ..Default::default()
            },
            abi::Material {
                base: [0.48, 0.36, 0.07, 1.0],
                tip: [0.66, 0.52, 0.12, 0.2],
                accent: [0.26, 0.18, 0.03, 0.35],
                pattern: abi::PATTERN_BLOTCHES,
                pattern_scale: 90.0,
                pattern_softness: 0.8,
                translucency: 0.85,
                wrap: 0.5,
                rim: 0.3,
                roughness: 0.6,
                specular: 0.0003,
                ..Default::default()
            },
        ])?;
        output.emit(&[abi::Flow {
            owner: 1,
            kind: abi::FLOW_SHELTER,
            position: [origin[0], origin[1] + f64::from(height) / 2.0, origin[2]],
            strength: 0.3,
            reach,
            fade: 0.5,
            ..Default::default()
        }])?;

        let following = Following {
            dt: input.dt() as f32,
            stiffness: input.param(STIFFNESS) as f32,
            delay: input.param(DELAY) as f32,
        };
        input.host().figure("stalks", count as f64);
        let (stalks, vx, vz) = (&self.stalks, &*vx, &*vz);
        input.workers().for_each_part(
            (
                Chunks::new(&mut self.bend[..count], 1),
                Chunks::new(fibres, ALL_FIBRES),
                Chunks::new(nodes, ALL_NODES),
            ),
            |n, (bend, fibres, nodes)| {
                let (stalk, bend) = (&stalks[n], &mut bend[0]);
                let own = n * SEGMENTS..(n + 1) * SEGMENTS;
                following.bend(stalk, &vx[own.clone()], &vz[own], bend);
                write_stalk(n, stalk, &grow(stalk, bend), bend, fibres, nodes);
            },
        );
        // The water that each segment feels.
        for (i, line) in lines.iter_mut().enumerate() {
            let node = i / SEGMENTS * ALL_NODES + i % SEGMENTS + 1;
            let from = world(origin, nodes[node].position);
            *line =
                abi::DebugLine { from, delta: [vx[i], 0.0, vz[i]], color: 0xff30_c0ff, channel: 0, spare: 0 };
        }
        output.commit::<abi::Fibre>(count * ALL_FIBRES)?;
        output.commit::<abi::FibreNode>(count * ALL_NODES)?;
        if !lines.is_empty() {
            output.commit::<abi::DebugLine>(lines.len())?;
        }
        if input.wants_trace() {
            trace(origin, fibres, nodes, output)?;
        }
        Ok(Status::Ok)
    }

    fn save(&self, state: &mut StateWriter) {
        state.put("bend", self.bend.as_flattened().as_flattened());
    }

    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
        state.fill("bend", self.bend.as_flattened_mut().as_flattened_mut())
    }
}

reef_sdk::export!(Kelp);
