//! The same flow in plain f64, one point at a time, written as the paper prints it. Tests compare the kernels
//! with it; nothing that runs in a scene uses it.

use reef_abi::{self as abi, Flow};

type Vector = [f64; 3];

/// Velocity of the water [m/s] at a point [m, world]: the sum (1), without what `owner` (0: nobody) emits
/// itself.
pub fn velocity(flows: &[Flow], point: Vector, owner: u64) -> Vector {
    let mut sum = [0.0; 3];
    let mut factor = 1.0;
    for flow in flows.iter().filter(|flow| owner == 0 || flow.owner != owner) {
        match flow.kind {
            abi::FLOW_SOURCE => sum = add(sum, source(flow, point)),
            abi::FLOW_HOLE => sum = add(sum, hole(flow, point)),
            abi::FLOW_WHIRLWIND => sum = add(sum, whirlwind(flow, point)),
            abi::FLOW_DIRECTIONAL => sum = add(sum, directional(flow, point)),
            abi::FLOW_SHELTER => factor *= 1.0 - f64::from(flow.strength) * fade(flow, point),
            _ => {}
        }
    }
    scale(sum, factor)
}

/// Source, eq. (2), with |Φ| in the denominator and the sign outside.
pub fn source(flow: &Flow, point: Vector) -> Vector {
    scale(unit(from_center(flow, point), flow.core), intensity(flow, point))
}

/// Hole, eq. (3): H = −S.
pub fn hole(flow: &Flow, point: Vector) -> Vector {
    scale(source(flow, point), -1.0)
}

/// Whirlwind, eq. (4).
pub fn whirlwind(flow: &Flow, point: Vector) -> Vector {
    let w = cross(from_center(flow, point), flow.axis.map(f64::from));
    scale(unit(w, flow.core), intensity(flow, point))
}

/// Directional field, eq. (5): constant, a sine in time, a travelling sine, growing with height.
pub fn directional(flow: &Flow, point: Vector) -> Vector {
    let m = f64::from(flow.modulation);
    let phase = f64::from(flow.phase) + dot(flow.wave_vector.map(f64::from), point);
    let height = (1.0 + f64::from(flow.gradient) * (point[1] - f64::from(flow.level))).max(0.0);
    let speed = f64::from(flow.strength) * (1.0 - m + m * phase.sin()) * height;
    scale(flow.axis.map(f64::from), speed)
}

fn intensity(flow: &Flow, point: Vector) -> f64 {
    let strength = f64::from(flow.strength);
    let d = length(from_center(flow, point));
    fade(flow, point) * strength / (strength.abs() / f64::from(flow.peak) + d * d)
}

/// 1 near, 0 beyond the reach, u² (3 − 2u) between.
fn fade(flow: &Flow, point: Vector) -> f64 {
    if flow.reach <= 0.0 {
        return 1.0;
    }
    let (reach, d) = (f64::from(flow.reach), length(from_center(flow, point)));
    let start = f64::from(flow.fade) * reach;
    if d >= reach {
        return 0.0;
    }
    if d <= start {
        return 1.0;
    }
    let u = (reach * reach - d * d) / (reach * reach - start * start);
    u * u * (3.0 - 2.0 * u)
}

fn from_center(flow: &Flow, point: Vector) -> Vector {
    core::array::from_fn(|i| point[i] - flow.position[i])
}

/// The direction of a vector, rounded by a core; the zero vector has none.
fn unit(v: Vector, core: f32) -> Vector {
    let core = f64::from(core);
    let long = (dot(v, v) + core * core).sqrt();
    if long == 0.0 { [0.0; 3] } else { scale(v, 1.0 / long) }
}

fn add(a: Vector, b: Vector) -> Vector {
    core::array::from_fn(|i| a[i] + b[i])
}

fn scale(a: Vector, factor: f64) -> Vector {
    a.map(|v| v * factor)
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn length(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
