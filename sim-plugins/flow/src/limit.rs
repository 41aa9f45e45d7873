//! Cutting a local field off where it no longer matters. The paper cuts at a bounding sphere (§5.1), which
//! jumps; here a field fades to zero before its reach, and what is left out anywhere is bounded.

use reef_abi::{self as abi, Flow};

/// Share of the reach from which on [`limit`] fades a field.
pub const FADE: f32 = 0.8;

/// What a faded field may lack at its worst point, as a multiple of its intensity at the reach: the greatest
/// value of (1 − u²(3 − 2u)) / (1 − b u), u in 0..1, for b = 1 − FADE², the largest that b can be.
const WORST: f64 = 1.0125;

/// The distance [m] at which a local field of nominal intensity `strength` [m³/s] and greatest intensity
/// `peak` [m/s] can be cut, so that with [`FADE`] nowhere more than `threshold` [m/s] is left out. Zero where
/// the field never passes the threshold.
pub fn reach_for(strength: f32, peak: f32, threshold: f32) -> f32 {
    let strength = f64::from(strength.abs());
    let at_reach = f64::from(threshold) / WORST;
    let reach2 = strength / at_reach - strength / f64::from(peak);
    if reach2 > 0.0 { reach2.sqrt() as f32 } else { 0.0 }
}

/// Gives a local primitive the reach at which its contribution falls below `threshold` [m/s], unless it has a
/// nearer one. Returns the bound [m/s] on what is left out at any point: `threshold`, or 0 where nothing was
/// changed. A field that never passes the threshold is taken out wholly. Directional fields and shelters stay
/// as they are.
pub fn limit(flow: &mut Flow, threshold: f32) -> f32 {
    let local = matches!(flow.kind, abi::FLOW_SOURCE | abi::FLOW_HOLE | abi::FLOW_WHIRLWIND);
    if !local || threshold.is_nan() || threshold <= 0.0 || flow.peak.is_nan() || flow.peak <= 0.0 {
        return 0.0;
    }
    let reach = reach_for(flow.strength, flow.peak, threshold);
    if reach == 0.0 {
        flow.strength = 0.0;
        return threshold;
    }
    if flow.reach > 0.0 && flow.reach <= reach {
        return 0.0;
    }
    flow.reach = reach;
    flow.fade = FADE;
    threshold
}
