//! The equations once more, one fish, f64, with the whole matrix written out: to be read beside the thesis,
//! and what the wide kernels are measured against.
//!
//! §5.5: m ẍ = s − ζ ẋ with s the sum of the springs' forces. Here a spring pulls along its unit vector,
//! c (l − l₀) (the printed force has a vector for rest length and does not turn with the fish), its damping
//! acts along it, too, and each outer face meets the water with f = −μ S max(0, n·u) n.

use glam::{DMat3, DVec3};

use crate::{
    body::{Body, Muscle},
    material::{Beat, Drive, Material, Method, turn},
};

/// One fish.
#[derive(Clone, Debug)]
pub struct Reference {
    body: Body,
    material: Material,
    beat: Beat,
    rest: Vec<f64>,
    /// Positions of all nodes [m].
    pub positions: Vec<DVec3>,
    /// Their velocities [m/s].
    pub velocities: Vec<DVec3>,
    /// Where in its beat it is [beats].
    pub phase: f64,
}

impl Reference {
    /// A fish at rest, its nose toward +x.
    pub fn new(body: &Body, material: &Material, beat: &Beat) -> Self {
        let nodes = body.nodes();
        let rest = body.springs().iter().map(|link| (nodes[link.ends[1]] - nodes[link.ends[0]]).length());
        Self {
            body: body.clone(),
            material: *material,
            beat: *beat,
            rest: rest.collect(),
            positions: nodes.to_vec(),
            velocities: vec![DVec3::ZERO; nodes.len()],
            phase: 0.0,
        }
    }

    /// Mass of a node [kg].
    pub fn node_mass(&self) -> f64 {
        self.material.mass / self.positions.len() as f64
    }

    /// Σ m v [kg·m/s].
    pub fn momentum(&self) -> DVec3 {
        self.velocities.iter().sum::<DVec3>() * self.node_mass()
    }

    /// Centre of all nodes [m].
    pub fn center(&self) -> DVec3 {
        self.positions.iter().sum::<DVec3>() / self.positions.len() as f64
    }

    /// Lengths of all springs over those at rest.
    pub fn stretches(&self) -> impl Iterator<Item = f64> + '_ {
        let of = |(link, rest): (&crate::body::Link, &f64)| {
            (self.positions[link.ends[1]] - self.positions[link.ends[0]]).length() / rest
        };
        self.body.springs().iter().zip(&self.rest).map(of)
    }

    /// Share of its rest length that a muscle has now.
    fn contraction(&self, muscle: Muscle, drive: &Drive) -> f64 {
        let last = self.body.muscle_gaps().saturating_sub(1).max(1) as f64;
        let first_group = turn(self.phase - self.beat.lag * f64::from(muscle.gap) / last, self.beat.edge);
        let side = if self.beat.upright { muscle.top } else { muscle.left };
        let share = if side > 0 { first_group } else { 1.0 - first_group };
        let bias = f64::from(muscle.left) * drive.yaw + f64::from(muscle.top) * drive.pitch;
        (1.0 - drive.force * share - bias).max(0.0)
    }

    /// One sub-step of `dt` [s] in water that moves with `water` [m/s].
    pub fn step(&mut self, dt: f64, method: Method, drive: &Drive, water: DVec3) {
        self.phase = (self.phase + drive.speed * dt).rem_euclid(1.0);
        let count = self.positions.len();
        let mass = self.node_mass();
        let implicit = method == Method::Implicit;
        let mut impulse = vec![DVec3::ZERO; count];
        let mut matrix = vec![vec![0.0; 3 * count]; if implicit { 3 * count } else { 0 }];
        let mut add = |a: usize, b: usize, block: DMat3| {
            for i in 0..3 {
                for k in 0..3 {
                    matrix[3 * a + i][3 * b + k] += block.col(k)[i];
                }
            }
        };
        if implicit {
            (0..count).for_each(|node| add(node, node, DMat3::from_diagonal(DVec3::splat(mass))));
        }
        for (link, rest) in self.body.springs().iter().zip(&self.rest) {
            let [a, b] = link.ends;
            let rest = rest * link.muscle.map_or(1.0, |muscle| self.contraction(muscle, drive));
            let (across, apart) =
                (self.positions[b] - self.positions[a], self.velocities[b] - self.velocities[a]);
            let length = across.length().max(SHORTEST);
            let n = across / length;
            let (k, c) = (self.material.stiffness(link.role), self.material.damping);
            let pull = k * (length - rest) + c * apart.dot(n);
            let mut push = dt * pull * n;
            if implicit {
                // Stiffness along the spring, and across it where it is stretched.
                let across_share = ((length - rest) / length).max(0.0);
                let along = outer(n) * (k * (1.0 - across_share));
                let stiffness = along + DMat3::IDENTITY * (k * across_share);
                push += dt * dt * (stiffness * apart);
                let block = stiffness * (dt * dt) + outer(n) * (dt * c);
                add(a, a, block);
                add(b, b, block);
                add(a, b, block * -1.0);
                add(b, a, block * -1.0);
            }
            impulse[a] += push;
            impulse[b] -= push;
        }
        for face in self.body.faces() {
            let nodes = face.nodes();
            let share = 1.0 / nodes.len() as f64;
            let area = face.area(&self.positions);
            let size = area.length().max(SHORTEST * SHORTEST);
            let u = nodes.iter().map(|node| self.velocities[*node]).sum::<DVec3>() * share - water;
            if area.dot(u) <= 0.0 {
                continue;
            }
            let drag = outer(area) * (self.material.water / size);
            for a in nodes {
                impulse[*a] -= drag * u * (dt * share);
                if implicit {
                    nodes.iter().for_each(|b| add(*a, *b, drag * (dt * share * share)));
                }
            }
        }
        let up = self.up();
        let tilt = (DVec3::Y - up * up.y) * (mass * self.material.righting * dt);
        for (impulse, lift) in impulse.iter_mut().zip(self.body.lift()) {
            *impulse += tilt * f64::from(*lift);
        }
        let change = if implicit {
            solved(matrix, impulse.iter().flat_map(|v| v.to_array()).collect())
        } else {
            impulse.iter().flat_map(|v| (*v / mass).to_array()).collect()
        };
        for ((x, v), change) in
            self.positions.iter_mut().zip(&mut self.velocities).zip(change.as_chunks::<3>().0)
        {
            *v += DVec3::from(*change);
            *x += *v * dt;
        }
    }

    /// From what sinks to what floats, unit.
    pub fn up(&self) -> DVec3 {
        let lifted = self.positions.iter().zip(self.body.lift()).map(|(at, lift)| *at * f64::from(*lift));
        lifted.sum::<DVec3>().normalize_or(DVec3::Y)
    }
}

/// No spring is taken for shorter than this [m].
const SHORTEST: f64 = 1e-9;

/// v vᵀ.
fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

/// A symmetric positive system, by Gauss.
fn solved(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let count = right.len();
    for i in 0..count {
        let pivot = matrix[i].clone();
        for k in i + 1..count {
            let share = matrix[k][i] / pivot[i];
            if share == 0.0 {
                continue;
            }
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
