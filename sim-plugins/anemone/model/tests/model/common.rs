//! What the tests of the fibre share.

use glam::{DVec3, Vec3};
use reef_anemone_model::{
    frame::Frame,
    reference::Fibre,
    shape::{DragLaw, FibreShape},
    wide::{self, Chunk, Contacts, Drag, Lane, Place, StepConstants},
};
use reef_flow::{Level, Packed};
use reef_sdk::abi::{self, Flow};

/// The water's speed at the paper's time step.
pub const DT: f64 = 1.0 / 60.0;

/// A current along a unit vector.
pub fn current(velocity: DVec3) -> Flow {
    let axis = velocity.normalize_or(DVec3::X).as_vec3().to_array();
    Flow { kind: abi::FLOW_DIRECTIONAL, axis, strength: velocity.length() as f32, ..Flow::default() }
}

/// A singularity of one of the local kinds.
pub fn local(kind: u32, position: DVec3, strength: f32, peak: f32, core: f32) -> Flow {
    Flow {
        kind,
        position: position.to_array(),
        axis: [0.0, 1.0, 0.0],
        strength,
        peak,
        core,
        ..Flow::default()
    }
}

/// Velocity in f64.
pub fn velocity(flows: &[Flow]) -> impl Fn(DVec3) -> DVec3 {
    move |at| DVec3::from(reef_flow::reference::velocity(flows, at.to_array(), 0))
}

/// The tentacle of the default parameters: 10 nodes, 6 mm apart, 3 to 1.2 mm thick, K = 4.2 N/m, n = 1.
pub fn tentacle() -> FibreShape {
    FibreShape::straight(10, 0.006, 0.003, 0.0012, 4.2, 1.0)
}

/// The default drag, eq. (9) with C_D = 0.5.
pub fn drag() -> DragLaw {
    DragLaw::linear(1000.0, 0.5)
}

/// A chunk of one shape many times, each at its own root, with τ [s].
pub fn chunk_of(shape: &FibreShape, roots: &[(DVec3, Frame)], drag: Drag, tau: f64) -> Chunk {
    let lanes: Vec<Lane> = roots
        .iter()
        .map(|(offset, frame)| Lane {
            shape: shape.clone(),
            place: Place { offset: *offset, frame: *frame },
            offset: Vec3::ZERO,
            relaxation: tau,
            break_force: f64::INFINITY,
        })
        .collect();
    let stiffness = vec![stiffness_of(shape); lanes.len()];
    let mut chunk = Chunk::new(&lanes, drag, &stiffness).expect("a chunk of equal fibres");
    wide::carry(Level::best(), &mut chunk, DVec3::ZERO, &world());
    wide::rebuild(Level::best(), &mut chunk);
    chunk
}

/// The frame whose axes are the world's, with z up along y: what places are given in.
pub fn world() -> Frame {
    Frame { x: DVec3::X, y: DVec3::Y, z: DVec3::Z }
}

/// K and n as the shape has them: k at the tip, and the power by which it grows with the radius.
fn stiffness_of(shape: &FibreShape) -> (f64, f64) {
    let last = shape.segments() - 1;
    let k = shape.stiffness[last];
    let ratio = shape.radii[0] / shape.radii[last];
    let n = if ratio == 1.0 { 0.0 } else { (shape.stiffness[0] / k).ln() / ratio.ln() };
    (k, (n * 1e6).round() / 1e6)
}

/// Steps a chunk.
pub fn run(
    level: Level,
    chunk: &mut Chunk,
    flows: &[Flow],
    constants: &StepConstants,
    dt: f64,
    steps: usize,
) {
    let mut packed = Packed::new();
    packed.fill(flows, [0.0; 3], 0);
    chunk.set_gain(dt, 1.0);
    for _ in 0..steps {
        wide::step(level, chunk, &packed, &Contacts::default(), constants);
    }
}

/// Steps the reference.
pub fn run_reference(fibre: &mut Fibre, law: &DragLaw, flows: &[Flow], tau: f64, dt: f64, steps: usize) {
    let velocity = velocity(flows);
    for _ in 0..steps {
        fibre.step(law, &velocity, dt, tau);
    }
}

/// Nodes of one fibre of a chunk.
pub fn nodes(chunk: &Chunk, fibre: usize) -> Vec<DVec3> {
    (0..=chunk.segments()).map(|n| chunk.node(fibre, n).as_dvec3()).collect()
}

/// Greatest distance between the nodes of two poses.
pub fn apart(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max)
}

/// Greatest relative error of a segment's length.
pub fn length_error(shape: &FibreShape, nodes: &[DVec3]) -> f64 {
    nodes
        .windows(2)
        .zip(&shape.lengths)
        .map(|(pair, length)| ((pair[1] - pair[0]).length() / length - 1.0).abs())
        .fold(0.0, f64::max)
}
