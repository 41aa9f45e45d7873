//! What a body is made of, how it is driven, and how its equations are integrated.

use crate::body::{BodyError, Role};

/// The least mass of a fish [kg]: a milligram, as a larva has. The springs of bodies that are lighter still
/// swing so fast that f32 has no numbers for it.
pub const LEAST_MASS: f64 = 1e-6;

/// Stiffness, damping, mass, and the water that it pushes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// c of springs across the body [N/m].
    pub cross: f64,
    /// c of the diagonals along its sides [N/m].
    pub side: f64,
    /// c of the springs along it [N/m].
    pub long: f64,
    /// ζ: damping along each spring [N·s/m].
    pub damping: f64,
    /// μ: what a square metre of skin exerts on water that it meets at 1 m/s [N·s/m³].
    pub water: f64,
    /// Of the whole fish [kg], shared evenly by its nodes.
    pub mass: f64,
    /// How strongly it is turned upright [m/s²]: the acceleration of what floats and what sinks when it lies
    /// on its side.
    pub righting: f64,
}

impl Default for Material {
    /// For the default profile: 0.2 m.
    fn default() -> Self {
        Self { cross: 28.0, side: 30.0, long: 38.0, damping: 0.03, water: 200.0, mass: 0.15, righting: 0.5 }
    }
}

impl Material {
    /// Stiffness of a spring of this role [N/m].
    pub fn stiffness(&self, role: Role) -> f64 {
        match role {
            Role::Cross => self.cross,
            Role::Side => self.side,
            Role::Long => self.long,
        }
    }
}

/// How the two groups of muscles take turns (§5.5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beat {
    /// The groups are top and bottom in place of left and right: a whale's.
    pub upright: bool,
    /// How soft the change of sides is: 0 is the thesis's jump, 1 a change that takes all of the beat.
    pub edge: f64,
    /// By how much of a beat the last gap with muscles follows the first; 0: the thesis's, all at once.
    pub lag: f64,
}

impl Default for Beat {
    fn default() -> Self {
        Self { upright: false, edge: 0.5, lag: 0.0 }
    }
}

/// What the muscles of one fish are told.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drive {
    /// `speed` of §5.4.1: beats a second [Hz].
    pub speed: f64,
    /// `force` of §5.4.1: by which share the rest length of the group whose turn it is falls.
    pub force: f64,
    /// By which share muscles on the left shorten more than those on the right: it turns left.
    pub yaw: f64,
    /// By which share muscles at the top shorten more than those at the bottom: it turns up.
    pub pitch: f64,
}

/// How time goes on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Linearly implicit: finite whatever speed, force and step.
    #[default]
    Implicit,
    /// Semi-implicit Euler: new velocities move the nodes. Cheap, and stable in short steps at moderate
    /// force.
    Symplectic,
}

/// Which share of `force` the first group's turn has, by its phase in beats: ½ (1 + q (3 − q²)/2) where q is
/// the sine over `edge`, within ±1; without an edge 1 in the first half of a beat and 0 in the second.
pub fn turn(phase: f64, edge: f64) -> f64 {
    let sine = reef_flow::math::sin_f64(core::f64::consts::TAU * phase);
    if edge <= 0.0 {
        return if sine >= 0.0 { 1.0 } else { 0.0 };
    }
    let q = (sine / edge).clamp(-1.0, 1.0);
    0.5 + 0.25 * q * (3.0 - q * q)
}

impl Material {
    /// # Errors
    /// The number that no body can have, and what is allowed.
    pub fn check(&self) -> Result<(), BodyError> {
        let refuse = |key: &str, value: f64, allowed: &str| {
            Err(BodyError { key: key.into(), problem: format!("must be {allowed}, is {value}") })
        };
        if !(self.mass >= LEAST_MASS && self.mass.is_finite()) {
            return refuse("mass", self.mass, &format!("at least {LEAST_MASS}"));
        }
        for (key, value) in [("cross", self.cross), ("side", self.side), ("long", self.long)] {
            if !(value.is_finite() && value > 0.0) {
                return refuse(key, value, "above 0");
            }
        }
        for (key, value) in [("damping", self.damping), ("water", self.water), ("righting", self.righting)] {
            if !(value.is_finite() && value >= 0.0) {
                return refuse(key, value, "0 or above");
            }
        }
        Ok(())
    }
}
