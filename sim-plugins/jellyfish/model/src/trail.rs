//! What hangs from an animal and is too long for its slice: the ends of tentacles and oral arms follow their
//! leader through the water, and the water does not notice.

use glam::DVec2;

use crate::{lanes::Real, water::Water};

/// How much of the link before it is in the direction of a link.
const STRAIGHT: f64 = 0.25;

/// A rope of links of one length in the slice's plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Trail {
    /// The end of each link, from the leader on [m].
    points: Vec<DVec2>,
    /// Length of a link [m].
    link: f64,
    /// How fast it sinks in still water [m/s].
    sink: f64,
}

impl Trail {
    /// Hanging straight down from a leader.
    pub fn new(leader: DVec2, links: usize, length: f64, sink: f64) -> Self {
        let link = length / links.max(1) as f64;
        let points = (1..=links).map(|k| leader - DVec2::new(0.0, link * k as f64)).collect();
        Self { points, link, sink }
    }

    /// The ends of its links [m].
    pub fn points(&self) -> &[DVec2] {
        &self.points
    }

    /// Takes back points that [`Trail::points`] gave: as many, all finite.
    ///
    /// # Errors
    /// What is wrong; then nothing has changed.
    pub fn set_points(&mut self, points: &[DVec2]) -> Result<(), String> {
        if points.len() != self.points.len() || !points.iter().all(|point| point.is_finite()) {
            return Err(format!("a trail has {} points, and all of them are finite", self.points.len()));
        }
        self.points.copy_from_slice(points);
        Ok(())
    }

    /// Lets the water carry each point for `dt` [s], then draws the links taut behind the leader. `corner`:
    /// of the water's window [m].
    pub fn step<T: Real>(&mut self, water: &Water<T>, corner: DVec2, leader: DVec2, dt: f64) {
        let (mut before, mut way) = (leader, DVec2::ZERO);
        for point in &mut self.points {
            let flow = DVec2::from(water.velocity((*point - corner).to_array()));
            let free = *point + (flow - DVec2::new(0.0, self.sink)) * dt;
            // A rope that bends goes on a little as the link before it goes.
            way = ((free - before).normalize_or(-DVec2::Y) + STRAIGHT * way).normalize_or(-DVec2::Y);
            *point = before + way * self.link;
            before = *point;
        }
    }
}
