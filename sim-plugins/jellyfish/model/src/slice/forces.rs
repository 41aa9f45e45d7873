//! The forces of springs, angular springs and muscles, and how they change with the points.

use glam::{DMat2, DVec2};

use super::{
    build::{Hinge, Muscle, Network, Spring},
    gait::Gait,
    solve::System,
};

/// c: share of a step after which forces are taken. Below 1/2 stiff springs would be unstable; the nearer to
/// 1, the more of their motion they lose.
const IMPLICITNESS: f64 = 0.7;

/// Where forces go.
pub(crate) trait Into {
    /// A force on one point and its opposite on another [N per metre of depth], and how it grows with their
    /// distance: −∂F/∂x.
    fn pull(&mut self, ends: [usize; 2], force: DVec2, stiffness: DMat2);
    /// Forces on three points along gradients, of one size, which grows with what these are the gradients of.
    fn bend(&mut self, points: [usize; 3], gradients: [DVec2; 3], size: f64, stiffness: f64);
}

/// Forces for the implicit system, with the velocity of each point.
pub(crate) struct Implicit<'a> {
    pub(crate) system: &'a mut System,
    pub(crate) velocity: &'a [DVec2],
    pub(crate) dt: f64,
}

impl Into for Implicit<'_> {
    #[inline(always)]
    fn pull(&mut self, [a, b]: [usize; 2], force: DVec2, stiffness: DMat2) {
        let by = stiffness * (IMPLICITNESS * self.dt * self.dt);
        let right = force * self.dt - by * (self.velocity[a] - self.velocity[b]);
        self.system.push(a, right);
        self.system.push(b, -right);
        self.system.add(a, a, by);
        self.system.add(b, b, by);
        // The ends come in the order of their pairs, or are one pair.
        self.system.add(b, a, -by);
        if a / 2 == b / 2 {
            self.system.add(a, b, -by);
        }
    }

    #[inline(always)]
    fn bend(&mut self, points: [usize; 3], gradients: [DVec2; 3], size: f64, stiffness: f64) {
        let by = stiffness * (IMPLICITNESS * self.dt * self.dt);
        let [a, b, c] = [0, 1, 2].map(|k| gradients[k].dot(self.velocity[points[k]]));
        let right = size * self.dt - by * ((a + b) + c);
        for i in 0..3 {
            self.system.push(points[i], gradients[i] * right);
            for j in 0..3 {
                if points[i] / 2 >= points[j] / 2 {
                    self.system.add(points[i], points[j], outer(gradients[i] * by, gradients[j]));
                }
            }
        }
    }
}

/// Forces alone.
impl Into for Vec<DVec2> {
    fn pull(&mut self, [a, b]: [usize; 2], force: DVec2, _: DMat2) {
        self[a] += force;
        self[b] -= force;
    }

    fn bend(&mut self, points: [usize; 3], gradients: [DVec2; 3], size: f64, _: f64) {
        for (point, gradient) in points.into_iter().zip(gradients) {
            self[point] += gradient * size;
        }
    }
}

#[inline(always)]
fn outer(a: DVec2, b: DVec2) -> DMat2 {
    DMat2::from_cols(a * b.x, a * b.y)
}

/// Hooke's law between two points. Across the spring only a pull counts: with a push the system would not be
/// positive definite.
#[inline(always)]
fn stretch(spring: &Spring, rest: f64, stiffness: f64, points: &[DVec2], into: &mut impl Into) {
    let [a, b] = spring.ends;
    let way = points[b] - points[a];
    let length = way.length();
    if length == 0.0 {
        return;
    }
    let along = way / length;
    let tension = stiffness * (length - rest);
    let across = (tension / length).max(0.0);
    let grows = outer(along, along * (stiffness - across)) + DMat2::from_diagonal(DVec2::splat(across));
    into.pull(spring.ends, along * tension, grows);
}

/// Cosine and sine of how far a hinge is from its rest, turned by `rest`, and the gradients of its angle;
/// None: it has collapsed.
#[inline(always)]
fn bent(hinge: &Hinge, rest: DVec2, points: &[DVec2]) -> Option<(DVec2, [DVec2; 3])> {
    let [a, b, c] = hinge.points.map(|point| points[point]);
    let (before, after) = (b - a, c - b);
    let (near, far) = (before.length_squared(), after.length_squared());
    if near == 0.0 || far == 0.0 {
        return None;
    }
    let angle = DVec2::new(before.dot(after), before.perp_dot(after)) / (near * far).sqrt();
    let off = DVec2::new(angle.dot(rest), rest.perp_dot(angle));
    let (first, last) = (before.perp() / near, after.perp() / far);
    Some((off, [first, -(first + last), last]))
}

/// The torque of a hinge is 2 B sin(δ/2): B δ for small angles, and still growing where it folds.
#[inline(always)]
fn bend(hinge: &Hinge, rest: DVec2, points: &[DVec2], into: &mut impl Into) {
    let Some((off, gradients)) = bent(hinge, rest, points) else { return };
    let half = (0.5 * (1.0 + off.x)).max(0.0).sqrt();
    let sine = (0.5 * (1.0 - off.x)).max(0.0).sqrt();
    // For small angles the difference from 1 has lost its digits.
    let sine = if half > 0.5 { off.y / (2.0 * half) } else { sine * off.y.signum() };
    into.bend(hinge.points, gradients, -2.0 * hinge.stiffness * sine, hinge.stiffness * half);
}

/// What the animal does at this moment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose<'a> {
    pub(crate) network: &'a Network,
    pub(crate) gait: Gait,
    /// Share of the period.
    pub(crate) phase: f64,
    /// Share of a muscle's stiffness with which it pushes.
    pub(crate) push: f64,
}

impl Pose<'_> {
    /// All internal forces: they sum to nothing, and neither do they turn the animal.
    pub(crate) fn forces(&self, points: &[DVec2], into: &mut impl Into) {
        for spring in &self.network.springs {
            stretch(spring, spring.rest, spring.stiffness, points, into);
        }
        let turn = self.turned();
        for hinge in &self.network.hinges {
            bend(hinge, rest_of(hinge, turn), points, into);
        }
        for muscle in &self.network.muscles {
            let (rest, stiffness) = self.told(muscle, points);
            stretch(&muscle.spring, rest, stiffness, points, into);
        }
    }

    /// Rest length [m] and stiffness of a muscle at this moment.
    #[inline(always)]
    fn told(&self, muscle: &Muscle, points: &[DVec2]) -> (f64, f64) {
        let spring = &muscle.spring;
        let [a, b] = spring.ends;
        let rest = spring.rest * self.gait.rest_length(self.phase, muscle.place);
        let pushes = points[a].distance(points[b]) < rest;
        (rest, spring.stiffness * if pushes { self.push } else { 1.0 })
    }

    /// The turn of each joint of the bell, as cosine and sine.
    fn turned(&self) -> DVec2 {
        let angle = self.gait.turn * self.gait.contraction(self.phase);
        if angle == 0.0 { DVec2::X } else { DVec2::from(reef_flow::math::cos_sin_f64(angle)) }
    }

    /// Elastic energy, that of the muscles included [J per metre of depth].
    pub(crate) fn energy(&self, points: &[DVec2]) -> f64 {
        let springs = self.network.springs.iter().map(|spring| {
            let [a, b] = spring.ends;
            0.5 * spring.stiffness * (points[a].distance(points[b]) - spring.rest).powi(2)
        });
        let turn = self.turned();
        let hinges = self.network.hinges.iter().filter_map(|hinge| {
            let (off, _) = bent(hinge, rest_of(hinge, turn), points)?;
            Some(4.0 * hinge.stiffness * (1.0 - (0.5 * (1.0 + off.x)).max(0.0).sqrt()))
        });
        let muscles = self.network.muscles.iter().map(|muscle| {
            let (rest, stiffness) = self.told(muscle, points);
            let [a, b] = muscle.spring.ends;
            0.5 * stiffness * (points[a].distance(points[b]) - rest).powi(2)
        });
        springs.sum::<f64>() + hinges.sum::<f64>() + muscles.sum::<f64>()
    }
}

/// Both sides of the bell bend the same way as seen, which is the opposite way along the chain.
fn rest_of(hinge: &Hinge, turn: DVec2) -> DVec2 {
    if hinge.turns { hinge.rest.rotate(turn) } else { hinge.rest }
}
