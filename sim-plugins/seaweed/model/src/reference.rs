//! The equations once more, one plant, f64, with a matrix for the whole system: to be read beside the paper,
//! and what the wide kernels are measured against.
//!
//! For the angles' rates q̇ the balance of eqs. (8) and (9), taken at the step's end, is a linear system
//! (JᵀM J + dt V + dt² (K + T)) q̇ = Jᵀ(M u + dt F) − dt K Δq, where J turns q̇ into the velocities (ω, v) of
//! all segments' centres, M holds their masses and the drag times dt, u their velocities in the last step,
//! and T what stretched segments pull back with.

use glam::{DMat3, DVec3};

use crate::skeleton::{Segment, Skeleton};

/// The water at a point: velocity [m/s] and acceleration [m/s²].
pub type Water<'a> = &'a dyn Fn(DVec3) -> [DVec3; 2];

/// One plant that stands upright on the origin, far below the surface, and touches nothing.
#[derive(Clone, Debug)]
pub struct Reference {
    segments: Vec<Segment>,
    /// θ and φ of each segment [rad].
    pub angles: Vec<[f64; 2]>,
    /// Angular velocity and velocity of each segment's centre [rad/s, m/s].
    pub velocities: Vec<[DVec3; 2]>,
}

/// A segment as it stands: its base (X, Y, Z), its origin, and what its two angles turn about.
#[derive(Clone, Copy, Debug)]
struct Standing {
    base: DMat3,
    origin: DVec3,
    axes: [DVec3; 2],
}

impl Reference {
    /// A plant at rest.
    pub fn new(skeleton: &Skeleton) -> Self {
        let segments = skeleton.segments().to_vec();
        let angles = segments.iter().map(|segment| [segment.theta, segment.phi]).collect();
        let velocities = vec![[DVec3::ZERO; 2]; segments.len()];
        Self { segments, angles, velocities }
    }

    fn stand(&self) -> Vec<Standing> {
        let mut all: Vec<Standing> = Vec::with_capacity(self.segments.len());
        for (segment, [theta, phi]) in self.segments.iter().zip(&self.angles) {
            let (below, origin) = match segment.parent.map(|parent| all[parent]) {
                Some(parent) => (parent.base, parent.origin + parent.base.y_axis * segment.height),
                None => (DMat3::IDENTITY, DVec3::ZERO),
            };
            let turned = below * DMat3::from_rotation_y(*theta);
            let base = turned * DMat3::from_rotation_x(*phi);
            all.push(Standing { base, origin, axes: [below.y_axis, base.x_axis] });
        }
        all
    }

    /// Where the segments end [m].
    pub fn ends(&self) -> Vec<DVec3> {
        let ends = self.stand().into_iter().zip(&self.segments);
        ends.map(|(at, segment)| at.origin + at.base.y_axis * segment.length).collect()
    }

    /// Segments that a segment turns when it turns: itself and all that stands on it.
    fn carries(&self, number: usize, above: usize) -> bool {
        core::iter::successors(Some(above), |at| self.segments[*at].parent).any(|at| at == number)
    }

    fn center(&self, all: &[Standing], number: usize) -> DVec3 {
        all[number].origin + all[number].base.y_axis * (0.5 * self.segments[number].length)
    }

    /// Force at each segment's centre in water, without that of its own motion [N].
    fn forces(&self, all: &[Standing], water: Water<'_>) -> Vec<DVec3> {
        let of = |(number, segment): (usize, &Segment)| {
            let [velocity, acceleration] = water(self.center(all, number));
            segment.drag * velocity + segment.carried * acceleration + segment.lift * DVec3::Y
        };
        self.segments.iter().enumerate().map(of).collect()
    }

    /// The torque of eq. (5) at each segment's base, of all its sub-branch, projected on its two axes as in
    /// eq. (6).
    pub fn torques(&self, water: Water<'_>) -> Vec<[f64; 2]> {
        let all = self.stand();
        let forces = self.forces(&all, water);
        let of = |number: usize| {
            let above = (0..all.len()).filter(|above| self.carries(number, *above));
            let torque: DVec3 =
                above.map(|above| (self.center(&all, above) - all[number].origin).cross(forces[above])).sum();
            all[number].axes.map(|axis| axis.dot(torque))
        };
        (0..all.len()).map(of).collect()
    }

    /// The procedural method, eqs. (5) and (6): the share `share` of the way to its angles.
    pub fn step_procedurally(&mut self, share: f64, water: Water<'_>) {
        let torques = self.torques(water);
        for ((segment, angles), torque) in self.segments.iter().zip(&mut self.angles).zip(torques) {
            for (angle, (rest, torque)) in
                angles.iter_mut().zip([segment.theta, segment.phi].into_iter().zip(torque))
            {
                *angle += share * (rest + torque / segment.stiffness - *angle);
            }
        }
    }

    /// Kinetic energy, and that of the springs [J].
    pub fn energy(&self) -> f64 {
        let of = |((segment, angles), [omega, v]): ((&Segment, &[f64; 2]), &[DVec3; 2])| {
            let [theta, phi] = [angles[0] - segment.theta, angles[1] - segment.phi];
            let spin = segment.mass * segment.length * segment.length / 12.0;
            let moving = segment.mass * v.length_squared() + spin * omega.length_squared();
            0.5 * (moving + segment.stiffness * (theta * theta + phi * phi))
        };
        self.segments.iter().zip(&self.angles).zip(&self.velocities).map(of).sum()
    }

    /// The physical method, eqs. (7) to (10), linearly implicit.
    pub fn step(&mut self, dt: f64, water: Water<'_>) {
        let all = self.stand();
        let forces = self.forces(&all, water);
        let count = 2 * all.len();
        let mut matrix = vec![vec![0.0; count]; count];
        let mut right = vec![0.0; count];
        // What each rate moves each segment by.
        let moved = |rate: usize, above: usize| -> Option<[DVec3; 2]> {
            let axis = all[rate / 2].axes[rate % 2];
            let off = self.center(&all, above) - all[rate / 2].origin;
            self.carries(rate / 2, above).then(|| [axis, axis.cross(off)])
        };
        for (above, segment) in self.segments.iter().enumerate() {
            let [omega, v] = self.velocities[above];
            let inert = segment.mass + dt * segment.drag;
            let long2 = segment.length * segment.length / 12.0;
            let y = all[above].base.y_axis;
            let tight = dt * dt * self.stretch(&all, &forces, above).max(0.0);
            for i in 0..count {
                let Some([turn, way]) = moved(i, above) else { continue };
                right[i] +=
                    way.dot(segment.mass * v + dt * forces[above]) + turn.dot(omega) * segment.mass * long2;
                for (k, entry) in matrix[i].iter_mut().enumerate() {
                    let Some([other_turn, other_way]) = moved(k, above) else { continue };
                    *entry += inert * (way.dot(other_way) + long2 * turn.dot(other_turn))
                        + tight * (turn.dot(other_turn) - turn.dot(y) * other_turn.dot(y));
                }
            }
            let bent = [self.angles[above][0] - segment.theta, self.angles[above][1] - segment.phi];
            for (at, bent) in bent.into_iter().enumerate() {
                matrix[2 * above + at][2 * above + at] += dt * segment.damping + dt * dt * segment.stiffness;
                right[2 * above + at] -= dt * segment.stiffness * bent;
            }
        }
        let rates = solved(matrix, right);
        let velocity = |above: usize| {
            let parts = (0..count).filter_map(|i| moved(i, above).map(|m| m.map(|way| way * rates[i])));
            parts.fold([DVec3::ZERO; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]])
        };
        self.velocities = (0..all.len()).map(velocity).collect();
        for (angles, rates) in self.angles.iter_mut().zip(rates.as_chunks::<2>().0) {
            angles[0] += dt * rates[0];
            angles[1] += dt * rates[1];
        }
    }

    /// Torque by which a segment is held in its direction, for each radian that it leaves it [N·m].
    fn stretch(&self, all: &[Standing], forces: &[DVec3], number: usize) -> f64 {
        let y = all[number].base.y_axis;
        let acting = |above: usize| forces[above] - self.segments[above].drag * self.velocities[above][1];
        let children = (0..all.len()).filter(|child| self.segments[*child].parent == Some(number));
        let pulled = children.map(|child| {
            let above = (0..all.len()).filter(|above| self.carries(child, *above));
            self.segments[child].height * y.dot(above.map(acting).sum())
        });
        0.5 * self.segments[number].length * y.dot(acting(number)) + pulled.sum::<f64>()
    }
}

/// A symmetric positive system, by Gauss.
fn solved(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let count = right.len();
    for i in 0..count {
        let pivot = matrix[i].clone();
        for k in i + 1..count {
            let share = matrix[k][i] / pivot[i];
            for (entry, own) in matrix[k][i..].iter_mut().zip(&pivot[i..]) {
                *entry -= share * own;
            }
            right[k] -= share * right[i];
        }
    }
    for i in (0..count).rev() {
        let known: f64 = (i + 1..count).map(|k| matrix[i][k] * right[k]).sum();
        right[i] = (right[i] - known) / matrix[i][i];
    }
    right
}
