//! How animals keep apart: one that comes near another leans to its side, and what is between two that touch
//! holds them off.

use glam::{DVec2, DVec3};

/// Distance at which animals begin to lean aside, and at which they are held off, over the sum of their
/// radii.
const LEANS_FROM: f64 = 1.5;
const HELD_FROM: f64 = 1.15;
/// Most of a lean, as a share of the aim.
const MOST_LEAN: f64 = 0.7;
/// How far to its side another must be, over the sum of the radii, that which side it is counts fully; and
/// how far the one with the lower id is taken to be from one that is right ahead.
const ASIDE: f64 = 0.2;
const AHEAD: f64 = 0.1;
/// Share of what they are too near by which they are held off in a second, and the most, in widths of the
/// bell a second.
const HOLD: f64 = 2.0;
const MOST_HOLD: f64 = 1.0;

/// What another animal sees of one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    pub(super) id: u64,
    /// Middle of the bell [m, world].
    pub(super) place: DVec3,
    /// Half of the bell's width [m].
    pub(super) radius: f64,
}

/// All animals at the beginning of a step, in the order of their x.
#[derive(Clone, Debug, Default)]
pub(super) struct Crowd {
    bodies: Vec<Body>,
    order: Vec<usize>,
    /// Where each is in that order.
    ranks: Vec<usize>,
    widest: f64,
}

/// What those around do to one animal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Push {
    /// Of its aim, across it, toward the left of one that looks along it.
    pub(super) lean: f64,
    /// [m/s]
    pub(super) velocity: DVec3,
}

impl Crowd {
    /// Looks at all of them.
    pub(super) fn fill(&mut self, bodies: impl Iterator<Item = Body>) {
        self.bodies.clear();
        self.bodies.extend(bodies);
        let Self { bodies, order, ranks, widest } = self;
        order.clear();
        order.extend(0..bodies.len());
        order.sort_unstable_by(|a, b| bodies[*a].place.x.total_cmp(&bodies[*b].place.x).then(a.cmp(b)));
        ranks.resize(bodies.len(), 0);
        order.iter().enumerate().for_each(|(rank, body)| ranks[*body] = rank);
        *widest = bodies.iter().map(|body| body.radius).fold(0.0, f64::max);
    }

    /// What those around do to one of them, whose slice has its x along `x` and whose aim there is `aim`, of
    /// length 1. `apart`: factor on all distances.
    pub(super) fn push(&self, own: usize, x: DVec3, aim: DVec2, apart: f64) -> Push {
        let body = self.bodies[own];
        let reach = LEANS_FROM * apart * (body.radius + self.widest);
        let left = x * -aim.y + DVec3::Y * aim.x;
        let near = |other: &&usize| (self.bodies[**other].place.x - body.place.x).abs() < reach;
        let rank = self.ranks[own];
        let before = self.order[..rank].iter().rev().take_while(near);
        let behind = self.order[rank + 1..].iter().take_while(near);
        let mut push = Push::default();
        for other in before.chain(behind).map(|other| &self.bodies[*other]) {
            let touching = apart * (body.radius + other.radius);
            let way = body.place - other.place;
            let distance = way.length();
            if distance >= LEANS_FROM * touching {
                continue;
            }
            let first = if body.id < other.id { 1.0 } else { -1.0 };
            let nearness = ((LEANS_FROM * touching - distance) / ((LEANS_FROM - 1.0) * touching)).min(1.0);
            let aside = way.dot(left) / touching + AHEAD * first;
            push.lean += MOST_LEAN * nearness * aside / (aside * aside + ASIDE * ASIDE).sqrt();
            // The smaller one gives way.
            let share = other.radius.powi(3) / (other.radius.powi(3) + body.radius.powi(3));
            let off = if distance > 0.0 { way / distance } else { DVec3::X * first };
            push.velocity += off * (share * HOLD * (HELD_FROM * touching - distance).max(0.0));
        }
        push.lean = push.lean.clamp(-MOST_LEAN, MOST_LEAN);
        push.velocity = push.velocity.clamp_length_max(MOST_HOLD * 2.0 * body.radius);
        push
    }
}
