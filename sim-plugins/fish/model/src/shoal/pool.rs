//! The bodies of a kind: held by those of its fish that are near, and by points whose pose still fades into
//! the gait's. The other points have none.

use glam::{DVec3, Vec3};

use crate::{
    kernel::Plan,
    tank::{Swimmer, Tank},
};

/// Bodies that there is room for from the start, where there are as many fish: a step in which no more are
/// held asks for no memory.
pub(super) const ROOM: usize = 512;
/// A pool that is full grows by this share of itself.
const GROWTH: usize = 2;

/// The number of a body in its kind's pool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BodyId(u32);

impl BodyId {
    /// No body.
    pub(super) const NONE: Self = Self(u32::MAX);

    /// Its number; None: there is none.
    pub(super) fn number(self) -> Option<usize> {
        (self != Self::NONE).then_some(self.0 as usize)
    }
}

/// The bodies of a kind.
#[derive(Clone, Debug)]
pub(super) struct Pool {
    pub(super) tank: Tank,
    /// What a fading point's nodes still are off its gait, at the species' size [m]; body by body.
    offsets: Vec<Vec3>,
    /// Those that nobody holds; the last is taken first. Fish take and give back in the order in which they
    /// are kept: no bytes hang on who has which.
    free: Vec<u32>,
}

impl Pool {
    /// Room for the first bodies of so many fish.
    pub(super) fn new(plan: Plan, fish: usize) -> Self {
        let mut pool = Self { tank: Tank::new(plan, Vec::new(), &[]), offsets: Vec::new(), free: Vec::new() };
        pool.grow(fish.min(ROOM));
        pool
    }

    fn nodes(&self) -> usize {
        self.tank.plan().body().nodes().len()
    }

    /// Room for so many bodies more.
    fn grow(&mut self, more: usize) {
        let had = self.tank.swimmers().len();
        self.tank.add(more);
        self.offsets.resize((had + more) * self.nodes(), Vec3::ZERO);
        self.free.reserve(had + more);
        self.free.extend((had as u32..(had + more) as u32).rev());
    }

    /// Nobody holds any.
    pub(super) fn clear(&mut self) {
        self.free.clear();
        self.free.extend((0..self.tank.swimmers().len() as u32).rev());
    }

    /// A body for a fish of this size.
    pub(super) fn take(&mut self, size: f64) -> BodyId {
        let at = self.free.pop().unwrap_or_else(|| {
            // The first of the new ones, which is the next to be taken.
            let first = self.tank.swimmers().len();
            self.grow((first / GROWTH).max(1));
            self.free.pop();
            first as u32
        });
        self.tank.swimmers_mut()[at as usize] = Swimmer { size, ..Swimmer::at(DVec3::ZERO) };
        BodyId(at)
    }

    /// Nobody holds it any more.
    pub(super) fn give_back(&mut self, body: BodyId) {
        self.free.extend(body.number().map(|at| at as u32));
    }

    /// Positions and velocities of a body's nodes, to be changed, and its offsets.
    pub(super) fn body_mut(&mut self, at: usize) -> (&mut [[f32; 3]], &mut [[f32; 3]], &mut [Vec3]) {
        let nodes = self.nodes();
        let (positions, velocities) = self.tank.nodes_mut(at);
        (positions, velocities, &mut self.offsets[at * nodes..(at + 1) * nodes])
    }

    /// What a point's nodes still are off its gait; empty where it has no body.
    pub(super) fn offsets(&self, body: BodyId) -> &[Vec3] {
        let nodes = self.nodes();
        body.number().map_or(&[], |at| &self.offsets[at * nodes..(at + 1) * nodes])
    }

    /// Its bodies, and those offsets of one.
    pub(super) fn offsets_mut(&mut self, body: BodyId) -> (&Tank, &mut [Vec3]) {
        let nodes = self.nodes();
        let offsets = body.number().map_or(0..0, |at| at * nodes..(at + 1) * nodes);
        (&self.tank, &mut self.offsets[offsets])
    }

    /// Memory that they take [bytes].
    pub(super) fn bytes(&self) -> usize {
        self.tank.bytes() + size_of_val(&*self.offsets) + self.free.capacity() * size_of::<u32>()
    }
}
