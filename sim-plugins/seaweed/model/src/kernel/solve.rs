//! The physical method (§4.3.3), linearly implicit, for the whole tree at once.
//!
//! Eq. (8) balances the torques of each segment: external forces, its own spring and damper, those of its
//! children. Put together with eq. (9), which says that a segment turns by its joint against its parent, this
//! is a system for all θ̇, φ̇ of the step's end. What they depend on is taken there, too: springs at the new
//! angles, drag at the new velocities, the pull of stretched branches at the new directions. So the step
//! stays finite for any k, v and dt (eq. (10), Euler's explicit method, does not beyond v/k), and without
//! forcing energy never grows: the new velocities are the old ones' nearest (in the sense of kinetic energy)
//! that the springs allow.
//!
//! The system is solved in two walks along the tree, without a matrix. From the tips to the roots: the
//! momentum [N·s·m, N·s] that a sub-branch gives up at its base when that moves with (ω, v) is b − J (ω, v),
//! with J a symmetric 6 × 6 matrix of the blocks A, B, C; a joint takes its two axes out of J and b
//! ([`take_out`]), a shift refers them to the parent's base ([`Body::shift`]). From the roots to the tips:
//! the velocities ([`super::advance`]).

use fearless_simd::{Select, Simd, f32x8, prelude::*};
use reef_flow::simd::{mul_add, neg_mul_add, splat};

use super::{Needs, Node, Pass, Row, Stand, pose};
use crate::{
    lanes::{
        Lane, Vector, add, add_scaled, cross, dot, load, load3, scale, smooth, store, store3, sub_scaled,
    },
    skeleton::{Above, GROUND},
};

/// J and b of the sub-branches that stand on a segment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Art {
    /// xx, xy, xz, yy, yz, zz of torque by ω.
    a: [Lane; 6],
    /// Torque (row) by v (column).
    b: [[Lane; 3]; 3],
    /// Force by v.
    c: [Lane; 6],
    torque: [Lane; 3],
    force: [Lane; 3],
    /// Force of the sub-branches [N], and Σ h Y·S over them [N·m]: what stretches the segment.
    total: [Lane; 3],
    stretch: Lane,
}

/// θ̇ or φ̇ = free − about·ω − along·v, with the base's ω and v.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Answer {
    free: Lane,
    about: [Lane; 3],
    along: [Lane; 3],
}

impl Answer {
    /// The rate of the joint [rad/s] when its base moves so.
    #[inline(always)]
    pub(super) fn rate<S: Simd>(&self, simd: S, omega: Vector<S>, speed: Vector<S>) -> f32x8<S> {
        let moved = dot(load3(simd, &self.about), omega) + dot(load3(simd, &self.along), speed);
        load(simd, &self.free) - moved
    }
}

/// Where xx … zz of a symmetric matrix are.
const AT: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// J and b in registers.
#[derive(Clone, Copy)]
pub(super) struct Body<S: Simd> {
    a: [f32x8<S>; 6],
    b: [[f32x8<S>; 3]; 3],
    c: [f32x8<S>; 6],
    torque: Vector<S>,
    force: Vector<S>,
}

/// Walks from the tips to the roots.
#[inline(always)]
pub(super) fn gather<S: Simd>(
    simd: S,
    pass: &Pass<'_>,
    needs: Needs,
    stand: &Stand,
    rows: &[Row],
    (nodes, arts): (&mut [Node], &mut [Art]),
) {
    let zero = splat(simd, 0.0);
    let dt = load(simd, &pass.dt);
    let dt2 = dt * dt;
    let size = load(simd, &stand.size);
    let size3 = size * size * size;
    let stiff = size3 * load(simd, &stand.stiff);
    let touch_mass = dt2 * splat(simd, pass.contact);
    let base = pose::base(simd, stand);
    let weights = weights(simd, stand);
    for (number, joint) in pass.joints.iter().enumerate() {
        if joint.above == Above::Branches {
            arts[number] = Art::default();
        }
    }
    // What stands on a segment stays in registers where that is the next one alone.
    let (mut body, mut total, mut stretch) = (Body::empty(simd), [zero; 3], zero);
    for (number, (joint, row)) in pass.joints.iter().zip(rows).enumerate().rev() {
        let node = &nodes[number];
        let (x, y) = (load3(simd, &node.x), load3(simd, &node.y));
        let long = size * splat(simd, joint.length);
        let half = long * splat(simd, 0.5);
        let mass = size3 * splat(simd, joint.mass);
        let drag = load(simd, &node.drag);
        let speed = load3(simd, &row.speed);
        let (force, touch) = (load3(simd, &node.force), load3(simd, &node.touch));
        // Mass and what drag adds to it, at the centre; what contact adds, at the end.
        let inert = mul_add(dt, drag, mass);
        let end_mass = touch_mass * load(simd, &node.touching);
        let momentum = add_scaled(scale(speed, mass), force, dt);
        let impulse = scale(touch, dt);
        // The pull of a stretched segment turns it back: so much for each radian.
        let acting = sub_scaled(force, speed, drag);
        let mut pull = half * dot(y, acting) + long * dot(y, touch);
        let spin = mass * long * long * splat(simd, 1.0 / 12.0);
        match joint.above {
            Above::Next => {}
            Above::Nothing => (body, total, stretch) = (Body::empty(simd), [zero; 3], zero),
            Above::Branches => {
                let art = &arts[number];
                body = Body::of(simd, art);
                (total, stretch) = (load3(simd, &art.total), load(simd, &art.stretch));
            }
        }
        pull += stretch;
        total = add(total, add(acting, touch));
        let spread = inert * long * long * splat(simd, 1.0 / 12.0);
        let tight = dt2 * pull.max(zero);
        let round = spread + mul_add(inert, half * half, mul_add(end_mass, long * long, tight));
        let moment = mul_add(end_mass, long, inert * half);
        body.bear(y, [spread, round], [moment, inert + end_mass]);
        let arm = add_scaled(scale(momentum, half), impulse, long);
        body.push(add_scaled(cross(y, arm), load3(simd, &row.omega), spin), add(momentum, impulse));
        let below = pose::below(simd, base, nodes, joint);
        let answers = &mut nodes[number].answers;
        if joint.tier + needs.level <= 2 {
            let open = weights[usize::from(joint.tier)];
            let (k, v) = (stiff * splat(simd, joint.stiffness), stiff * splat(simd, joint.damping));
            let hold = dt * mul_add(dt, k, v);
            let bent = [
                load(simd, &row.theta) - load(simd, &row.theta_rest),
                load(simd, &row.phi) - load(simd, &row.phi_rest),
            ];
            take_out(simd, &mut body, x, [hold, dt * k * bent[1], open], &mut answers[1]);
            take_out(simd, &mut body, below.y, [hold, dt * k * bent[0], open], &mut answers[0]);
        }
        if joint.parent != GROUND {
            let height = size * splat(simd, joint.height);
            body.shift(simd, scale(below.y, height));
            stretch = height * dot(below.y, total);
            if !joint.only {
                let art = &mut arts[joint.parent as usize];
                body.hand_down(simd, art);
                let sum = load(simd, &art.stretch) + stretch;
                store(&mut art.stretch, sum);
                let sum = add(load3(simd, &art.total), total);
                store3(&mut art.total, sum);
            }
        }
    }
}

/// How much of their turn joints of each tier make: 1 where a level computes them, 0 where it does not.
#[inline(always)]
pub(super) fn weights<S: Simd>(simd: S, stand: &Stand) -> [f32x8<S>; 3] {
    let one = splat(simd, 1.0);
    let detail = load(simd, &stand.detail);
    [one, one - smooth(simd, detail - one), one - smooth(simd, detail)]
}

impl<S: Simd> Body<S> {
    /// Of nothing.
    #[inline(always)]
    pub(super) fn empty(simd: S) -> Self {
        let zero = splat(simd, 0.0);
        Self { a: [zero; 6], b: [[zero; 3]; 3], c: [zero; 6], torque: [zero; 3], force: [zero; 3] }
    }

    /// What stands on a segment.
    #[inline(always)]
    fn of(simd: S, art: &Art) -> Self {
        let mut body = Self::empty(simd);
        for i in 0..6 {
            body.a[i] = load(simd, &art.a[i]);
            body.c[i] = load(simd, &art.c[i]);
        }
        for i in 0..3 {
            body.b[i] = load3(simd, &art.b[i]);
        }
        body.torque = load3(simd, &art.torque);
        body.force = load3(simd, &art.force);
        body
    }

    /// Adds a segment's own inertia: along its Y and across it [kg·m²], first moment along Y [kg·m] and mass
    /// [kg].
    #[inline(always)]
    pub(super) fn bear(
        &mut self,
        y: Vector<S>,
        [along, round]: [f32x8<S>; 2],
        [moment, mass]: [f32x8<S>; 2],
    ) {
        let across = along - round;
        for i in 0..3 {
            for k in i..3 {
                let entry = mul_add(across * y[i], y[k], self.a[AT[i][k]]);
                self.a[AT[i][k]] = if i == k { entry + round } else { entry };
            }
            self.c[AT[i][i]] += mass;
        }
        let m = scale(y, moment);
        self.b[0][1] -= m[2];
        self.b[0][2] += m[1];
        self.b[1][0] += m[2];
        self.b[1][2] -= m[0];
        self.b[2][0] -= m[1];
        self.b[2][1] += m[0];
    }

    /// Adds momentum.
    #[inline(always)]
    pub(super) fn push(&mut self, torque: Vector<S>, force: Vector<S>) {
        self.torque = add(self.torque, torque);
        self.force = add(self.force, force);
    }

    /// Refers J and b to a base that lies −r from the present one.
    #[inline(always)]
    pub(super) fn shift(&mut self, simd: S, r: Vector<S>) {
        let half = splat(simd, 0.5);
        // [r]× C, by its columns.
        let mut lever = self.b;
        for k in 0..3 {
            let column = cross(r, [self.c[AT[0][k]], self.c[AT[1][k]], self.c[AT[2][k]]]);
            lever[0][k] = column[0];
            lever[1][k] = column[1];
            lever[2][k] = column[2];
        }
        let mut turned = self.b;
        for i in 0..3 {
            turned[i] = cross(r, add_scaled(self.b[i], lever[i], half));
        }
        for i in 0..3 {
            for k in i..3 {
                self.a[AT[i][k]] += turned[k][i] + turned[i][k];
            }
            self.b[i] = add(self.b[i], lever[i]);
        }
        self.torque = add(self.torque, cross(r, self.force));
    }

    /// Adds this to what a parent bears.
    #[inline(always)]
    fn hand_down(&self, simd: S, art: &mut Art) {
        for i in 0..6 {
            let (a, c) = (load(simd, &art.a[i]), load(simd, &art.c[i]));
            store(&mut art.a[i], a + self.a[i]);
            store(&mut art.c[i], c + self.c[i]);
        }
        for i in 0..3 {
            let b = load3(simd, &art.b[i]);
            store3(&mut art.b[i], add(b, self.b[i]));
        }
        let sum = add(load3(simd, &art.torque), self.torque);
        store3(&mut art.torque, sum);
        let sum = add(load3(simd, &art.force), self.force);
        store3(&mut art.force, sum);
    }
}

/// Lets the body turn about an axis through its base: `hold` is what its spring and damper add to the axis'
/// inertia, `bent` what the spring exerts already; `open`: 0 where it cannot turn.
#[inline(always)]
pub(super) fn take_out<S: Simd>(
    simd: S,
    body: &mut Body<S>,
    axis: Vector<S>,
    [hold, bent, open]: [f32x8<S>; 3],
    answer: &mut Answer,
) {
    let zero = splat(simd, 0.0);
    let mut ua = [zero; 3];
    let mut ub = [zero; 3];
    for i in 0..3 {
        let [x, y, z] = AT[i];
        ua[i] = dot([body.a[x], body.a[y], body.a[z]], axis);
        ub[i] = dot([body.b[0][i], body.b[1][i], body.b[2][i]], axis);
    }
    let inertia = dot(axis, ua).max(zero) + hold;
    let inverse = open.simd_gt(zero).select(splat(simd, 1.0) / inertia, zero);
    let free = (dot(axis, body.torque) - bent) * inverse;
    let (about, along) = (scale(ua, inverse), scale(ub, inverse));
    for i in 0..3 {
        for k in i..3 {
            body.a[AT[i][k]] = neg_mul_add(ua[i], about[k], body.a[AT[i][k]]);
            body.c[AT[i][k]] = neg_mul_add(ub[i], along[k], body.c[AT[i][k]]);
        }
        body.b[i] = sub_scaled(body.b[i], along, ua[i]);
    }
    body.torque = sub_scaled(body.torque, ua, free);
    body.force = sub_scaled(body.force, ub, free);
    store(&mut answer.free, free);
    store3(&mut answer.about, about);
    store3(&mut answer.along, along);
}
