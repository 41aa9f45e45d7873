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
    /// A force on a point [N per metre of depth].
    fn push(&mut self, point: usize, force: DVec2);
    /// −∂F/∂x of point `a` by the place of point `b`.
    fn stiffen(&mut self, a: usize, b: usize, by: DMat2);
}

/// Forces for the implicit system, with the velocity of each point.
pub(crate) struct Implicit<'a> {
    pub(crate) system: &'a mut System,
    pub(crate) velocity: &'a [DVec2],
    pub(crate) dt: f64,
}

impl Into for Implicit<'_> {
    #[inline(always)]
    fn push(&mut self, point: usize, force: DVec2) {
        self.system.push(point, force * self.dt);
    }

    #[inline(always)]
    fn stiffen(&mut self, a: usize, b: usize, by: DMat2) {
        let by = by * (IMPLICITNESS * self.dt * self.dt);
        self.system.add(a, b, by);
        self.system.push(a, -(by * self.velocity[b]));
    }
}

/// Forces alone.
impl Into for Vec<DVec2> {
    fn push(&mut self, point: usize, force: DVec2) {
        self[point] += force;
    }

    fn stiffen(&mut self, _: usize, _: usize, _: DMat2) {}
}

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
    into.push(a, along * tension);
    into.push(b, along * -tension);
    let across = (tension / length).max(0.0);
    let own = outer(along, along * (stiffness - across)) + DMat2::from_diagonal(DVec2::splat(across));
    into.stiffen(a, a, own);
    into.stiffen(b, b, own);
    into.stiffen(a, b, -own);
    into.stiffen(b, a, -own);
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
    let torque = 2.0 * hinge.stiffness * sine;
    let stiffness = hinge.stiffness * half;
    for (a, to) in hinge.points.into_iter().zip(gradients) {
        into.push(a, to * -torque);
        for (b, by) in hinge.points.into_iter().zip(gradients) {
            into.stiffen(a, b, outer(to * stiffness, by));
        }
    }
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
