//! What one fibre is at rest: its segments, and how they answer to a force.

use glam::{DVec2, DVec3};

use crate::{frame::Frame, math};

/// Reynolds number at which the drag coefficient falls, eq. (7).
pub const CRITICAL_REYNOLDS: f64 = 5e5;
/// Drag coefficient of a cylinder below and above [`CRITICAL_REYNOLDS`], eq. (7).
pub const DRAG_COEFFICIENTS: [f64; 2] = [1.2, 0.5];

/// One fibre at rest. Segment i joins node i − 1 to node i; entry i − 1 of each list belongs to segment i and
/// node i.
#[derive(Clone, Debug, PartialEq)]
pub struct FibreShape {
    /// L_i [m] > 0.
    pub lengths: Vec<f64>,
    /// r_0 of the root [m] > 0.
    pub root_radius: f64,
    /// r_i [m] > 0.
    pub radii: Vec<f64>,
    /// k_i [N/m] > 0, eq. (11).
    pub stiffness: Vec<f64>,
    /// The drag that each node catches: A_i [kg/s] where the scene gives it, else L_i · r_i [m²].
    pub drag: Vec<f64>,
    /// Bend of the rest pose at each segment, carried by the frame of the segment below it [rad].
    pub rest: Vec<DVec2>,
    /// Time constant of each joint over the fibre's τ, at least 1; see [`Self::set_lag`].
    pub lags: Vec<f64>,
}

/// How the flow's velocity becomes a force on a node (§4.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DragLaw {
    /// F = A V, eq. (9), with A = `factor` · drag_i: `factor` is ρ C_D · (1 m/s) [kg/(m² s)], or 1 where
    /// drag_i is A itself.
    Linear {
        /// See above.
        factor: f64,
    },
    /// F = ½ ρ V² L 2r C_D · V/|V|, eq. (6), with C_D by (7) and Re by (8); drag_i is L_i · r_i.
    Quadratic {
        /// ρ [kg/m³] times any gain.
        density: f64,
        /// ρ/μ [s/m²]: Re = 2 r |V| ρ/μ.
        reynolds: f64,
    },
}

impl DragLaw {
    /// A = ρ C_D L r · (1 m/s), eq. (9); the paper's ½ ρ L r is C_D = 0.5.
    pub fn linear(density: f64, drag_coefficient: f64) -> Self {
        Self::Linear { factor: density * drag_coefficient }
    }

    /// Force [N] on a node that catches `drag` and has radius `radius` [m], in a flow of velocity `v` [m/s].
    pub fn force(&self, drag: f64, radius: f64, v: DVec3) -> DVec3 {
        match *self {
            Self::Linear { factor } => v * (drag * factor),
            Self::Quadratic { density, reynolds } => {
                let speed = v.length();
                let re = 2.0 * radius * speed * reynolds;
                let coefficient = DRAG_COEFFICIENTS[usize::from(re >= CRITICAL_REYNOLDS)];
                v * (density * drag * coefficient * speed)
            }
        }
    }
}

impl FibreShape {
    /// Number of segments: one less than nodes.
    pub fn segments(&self) -> usize {
        self.lengths.len()
    }

    /// Number of nodes, the root included.
    pub fn nodes(&self) -> usize {
        self.lengths.len() + 1
    }

    /// Whether some rest direction leaves the line of the segment below.
    pub fn is_curved(&self) -> bool {
        self.rest.iter().any(|bend| *bend != DVec2::ZERO)
    }

    /// Length of the whole chain [m].
    pub fn length(&self) -> f64 {
        self.lengths.iter().sum()
    }

    /// Radius of node i, 0 the root [m].
    pub fn radius(&self, node: usize) -> f64 {
        if node == 0 { self.root_radius } else { self.radii[node - 1] }
    }

    /// A straight fibre of equal segments. Its radius goes from `root_radius` to `tip_radius` evenly, and its
    /// stiffness follows from [`Self::set_stiffness`].
    pub fn straight(nodes: usize, length: f64, root_radius: f64, tip_radius: f64, k: f64, n: f64) -> Self {
        let segments = nodes.saturating_sub(1).max(1);
        let radii = (1..=segments)
            .map(|i| root_radius + (tip_radius - root_radius) * i as f64 / segments as f64)
            .collect::<Vec<_>>();
        let mut shape = Self {
            lengths: vec![length; segments],
            root_radius,
            drag: radii.iter().map(|r| r * length).collect(),
            radii,
            stiffness: vec![0.0; segments],
            rest: vec![DVec2::ZERO; segments],
            lags: vec![1.0; segments],
        };
        shape.set_stiffness(k, n);
        shape
    }

    /// k_i = K (r_i / r_tip)^n, eq. (11). Relative to the tip's radius: with bare radii below 1 m a greater
    /// exponent would soften the root.
    pub fn set_stiffness(&mut self, k: f64, n: f64) {
        let tip = self.radii.last().copied().unwrap_or(self.root_radius);
        self.stiffness = self.radii.iter().map(|r| k * math::pow(r / tip, n)).collect();
    }

    /// Lets the time constant grow evenly along the fibre, from τ at the root to `lag` · τ at the tip: where
    /// the water swings, the tip comes after the base. 1 is the paper's fibre, whose joints answer together.
    pub fn set_lag(&mut self, lag: f64) {
        let last = self.segments().saturating_sub(1).max(1) as f64;
        self.lags = (0..self.segments()).map(|i| 1.0 + (lag - 1.0) * i as f64 / last).collect();
    }

    /// Whether some joint follows later than τ says.
    pub fn lags(&self) -> bool {
        self.lags.iter().any(|lag| *lag != 1.0)
    }

    /// Nodes of the rest pose, the root first.
    pub fn rest_nodes(&self, root: DVec3, frame: &Frame) -> Vec<DVec3> {
        let mut frame = *frame;
        let mut at = root;
        let mut nodes = vec![root];
        for (length, rest) in self.lengths.iter().zip(&self.rest) {
            frame = frame.bent(*rest);
            at += frame.z * *length;
            nodes.push(at);
        }
        nodes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stiffness_grows_with_the_exponent_toward_the_root_and_is_k_at_the_tip() {
        let mut shape = FibreShape::straight(10, 0.006, 0.003, 0.0012, 4.2, 1.0);
        let root = shape.stiffness[0];
        assert_eq!(shape.stiffness[8], 4.2);
        shape.set_stiffness(4.2, 3.0);
        assert_eq!(shape.stiffness[8], 4.2);
        assert!(shape.stiffness[0] > root);
    }

    #[test]
    fn quadratic_drag_follows_the_two_coefficients_of_equation_7() {
        let law = DragLaw::Quadratic { density: 1000.0, reynolds: 1000.0 / 1.15e-3 };
        let (l, r) = (0.01, 0.003);
        // Eq. (6) by hand at 0.2 m/s: ½ · 1000 · 0.04 · 0.01 · 0.006 · 1.2.
        let slow = law.force(l * r, r, DVec3::X * 0.2).x;
        assert!((slow - 0.00144).abs() < 1e-15, "{slow}");
        // Re = 5e5 at 2 r V = 0.575 m²/s: above it the coefficient is 0.5, as in the remark after (8).
        let fast = law.force(l * r, r, DVec3::X * 100.0).x;
        assert!((fast - 0.5 * 1000.0 * 1e4 * l * 2.0 * r * 0.5).abs() < 1e-9, "{fast}");
    }

    #[test]
    fn linear_drag_with_a_coefficient_of_one_half_is_the_papers_a() {
        let law = DragLaw::linear(1000.0, 0.5);
        let force = law.force(0.006 * 0.002, 0.002, DVec3::new(0.0, 0.0, 0.3));
        // ½ ρ L r V; exact to rounding.
        assert!((force.z - 0.5 * 1000.0 * 0.006 * 0.002 * 0.3).abs() < 1e-18);
    }
}
