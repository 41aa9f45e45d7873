//! The sea's primitives of one step, sorted into a grid, so that an object pays only for those that can reach
//! it (Aliaga & Larboulette 2009, §2 and §5.1).
//!
//! A local primitive with a reach lies in every cell that its sphere touches; what has no reach, or fills too
//! many cells, is on a list that every object takes. A query with an object's bounding sphere yields indices
//! in the host's order. The grid only leaves out what contributes exactly zero inside the bounding sphere.

use reef_abi::{self as abi, Flow};

use crate::packed::acts;

/// A bounding sphere in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// [m]
    pub center: [f64; 3],
    /// [m]
    pub radius: f64,
}

impl Sphere {
    /// Distance of its centre from a point [m].
    pub fn distance_to_center(self, point: [f64; 3]) -> f64 {
        let d: [f64; 3] = core::array::from_fn(|i| point[i] - self.center[i]);
        (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
    }
}

/// Cells along an axis at most.
const MOST_CELLS: usize = 32;
/// A primitive that touches more cells than this goes to the list that every object takes.
const MOST_CELLS_OF_ONE: usize = 256;
/// Below this many limited primitives a list is faster than a grid.
const FEWEST_FOR_A_GRID: usize = 8;

/// What a look at some of a step's primitives finds.
#[derive(Clone, Debug, Default)]
pub struct Look {
    /// Numbers of those that may act inside the box, ascending.
    near: Vec<u32>,
    /// How many others act at all.
    far: u32,
}

impl Look {
    /// Finds what of some primitives may act inside a box [m, world]; `first`: number of the first of them.
    /// Reuses its memory.
    pub fn find(&mut self, flows: &[Flow], first: usize, [least, greatest]: [[f64; 3]; 2]) {
        self.near.resize(flows.len(), 0);
        let (mut found, mut far) = (0, 0);
        // Most of many are far, and which is by chance: no branch hangs on it.
        for (number, flow) in (first as u32..).zip(flows) {
            let limited = is_limited(flow);
            let radius = widened(flow);
            let mut touches = true;
            for i in 0..3 {
                touches &=
                    (flow.position[i] + radius >= least[i]) & (flow.position[i] - radius <= greatest[i]);
            }
            let near = touches | !limited;
            self.near[found] = number;
            found += usize::from(near);
            far += u32::from(!near & (flow.strength != 0.0));
        }
        self.near.truncate(found);
        self.far = far;
    }
}

/// Whether a primitive has a reach.
fn is_limited(flow: &Flow) -> bool {
    (flow.kind != abi::FLOW_DIRECTIONAL) & (flow.reach > 0.0)
}

/// The reach of a limited primitive [m], wider by what rounding to f32 may move a point.
fn widened(flow: &Flow) -> f64 {
    f64::from(flow.reach) * 1.0001
}

/// One step's primitives and where they reach. Refilling it allocates nothing once it has grown to its
/// greatest size.
#[derive(Clone, Debug, Default)]
pub struct Field {
    flows: Vec<Flow>,
    count: u32,
    /// Indices of what every object takes, ascending.
    everywhere: Vec<u32>,
    /// Indices and spheres (centre, reach) of what lies in the grid.
    limited: Vec<(u32, Sphere)>,
    corner: [f64; 3],
    cell: f64,
    cells: [usize; 3],
    /// Where each cell's indices begin in `members`; one more at the end.
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Field {
    /// Still water.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes a step's primitives, in the host's order.
    pub fn refill(&mut self, flows: &[Flow]) {
        self.clear();
        flows.iter().for_each(|flow| self.take(flow));
        self.sort();
    }

    /// Takes what looks at parts of a step's primitives found, part by part in their order: for who asks
    /// about no place outside of their box.
    pub fn refill_found<'a>(&mut self, flows: &[Flow], looks: impl IntoIterator<Item = &'a Look>) {
        self.clear();
        for look in looks {
            self.count += look.far;
            for flow in look.near.iter().filter_map(|number| flows.get(*number as usize)) {
                self.take(flow);
            }
        }
        self.sort();
    }

    fn clear(&mut self) {
        self.flows.clear();
        self.count = 0;
        self.everywhere.clear();
        self.limited.clear();
        self.cells = [0; 3];
    }

    fn sort(&mut self) {
        if self.limited.len() < FEWEST_FOR_A_GRID {
            self.everywhere.extend(self.limited.drain(..).map(|(index, _)| index));
        } else {
            self.shape_grid();
            self.sort_into_cells();
        }
        self.everywhere.sort_unstable();
    }

    fn take(&mut self, flow: &Flow) {
        if !acts(flow) {
            return;
        }
        self.count += 1;
        let index = self.flows.len() as u32;
        if is_limited(flow) {
            self.limited.push((index, Sphere { center: flow.position, radius: widened(flow) }));
        } else {
            self.everywhere.push(index);
        }
        self.flows.push(*flow);
    }

    /// Those of them that act, in the order in which they came.
    pub fn flows(&self) -> &[Flow] {
        &self.flows
    }

    /// How many primitives act at all, at most.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// How many indices [`Field::candidates`] finds at most, some of them more than once while it looks.
    pub fn most_candidates(&self) -> usize {
        self.everywhere.len() + self.members.len()
    }

    /// Indices into [`Field::flows`] of all that may act inside a sphere, ascending. Reuses `out`.
    pub fn candidates(&self, bounds: Sphere, out: &mut Vec<u32>) {
        out.clear();
        out.extend_from_slice(&self.everywhere);
        if self.limited.is_empty() {
            return;
        }
        let Some((low, high)) = self.cells_of(bounds) else { return };
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                let row = (z * self.cells[1] + y) * self.cells[0];
                let from = self.starts[row + low[0]] as usize;
                let to = self.starts[row + high[0] + 1] as usize;
                out.extend_from_slice(&self.members[from..to]);
            }
        }
        out.sort_unstable();
        out.dedup();
    }

    /// Cubes of about the mean reach over the box of all limited spheres, at most [`MOST_CELLS`] along an
    /// axis.
    fn shape_grid(&mut self) {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        let mut reach = 0.0;
        for (_, sphere) in &self.limited {
            for i in 0..3 {
                low[i] = low[i].min(sphere.center[i] - sphere.radius);
                high[i] = high[i].max(sphere.center[i] + sphere.radius);
            }
            reach += sphere.radius;
        }
        let extent = (high[0] - low[0]).max(high[1] - low[1]).max(high[2] - low[2]);
        let mean = reach / self.limited.len() as f64;
        self.cell = mean.max(extent / MOST_CELLS as f64).max(f64::MIN_POSITIVE);
        self.corner = low;
        self.cells =
            core::array::from_fn(|i| (((high[i] - low[i]) / self.cell).ceil() as usize).clamp(1, MOST_CELLS));
    }

    /// A counting sort: sizes, then starts, then members, which keeps indices ascending inside a cell.
    fn sort_into_cells(&mut self) {
        let total = self.cells[0] * self.cells[1] * self.cells[2];
        self.starts.clear();
        self.starts.resize(total + 1, 0);
        let limited = core::mem::take(&mut self.limited);
        for (index, sphere) in &limited {
            match self.own_cells(*sphere) {
                Some(range) => each_cell(range, self.cells, |cell| self.starts[cell + 1] += 1),
                None => self.everywhere.push(*index),
            }
        }
        for cell in 0..total {
            self.starts[cell + 1] += self.starts[cell];
        }
        self.members.clear();
        self.members.resize(self.starts[total] as usize, 0);
        for (index, sphere) in &limited {
            if let Some(range) = self.own_cells(*sphere) {
                each_cell(range, self.cells, |cell| {
                    self.members[self.starts[cell] as usize] = *index;
                    self.starts[cell] += 1;
                });
            }
        }
        // Filling moved each start to the next cell's: move them back.
        for cell in (1..=total).rev() {
            self.starts[cell] = self.starts[cell - 1];
        }
        self.starts[0] = 0;
        self.limited = limited;
    }

    /// The cells of a primitive's sphere; None when there are too many of them.
    fn own_cells(&self, sphere: Sphere) -> Option<([usize; 3], [usize; 3])> {
        let (low, high) = self.cells_of(sphere)?;
        let count: usize = (0..3).map(|i| high[i] - low[i] + 1).product();
        (count <= MOST_CELLS_OF_ONE).then_some((low, high))
    }

    /// First and last cell along each axis that a sphere's box touches; None outside of the grid.
    fn cells_of(&self, sphere: Sphere) -> Option<([usize; 3], [usize; 3])> {
        let mut low = [0; 3];
        let mut high = [0; 3];
        for i in 0..3 {
            let last = self.cells[i].checked_sub(1)?;
            let from = ((sphere.center[i] - sphere.radius - self.corner[i]) / self.cell).floor();
            let to = ((sphere.center[i] + sphere.radius - self.corner[i]) / self.cell).floor();
            // The grid's upper face belongs to its last cell, and rounding may have moved a sphere's own
            // face.
            if to < -1e-3 || from > last as f64 + 1.001 || from.is_nan() || to.is_nan() {
                return None;
            }
            // A cast saturates: below zero is zero.
            low[i] = (from as usize).min(last);
            high[i] = (to as usize).min(last);
        }
        Some((low, high))
    }
}

fn each_cell((low, high): ([usize; 3], [usize; 3]), cells: [usize; 3], mut visit: impl FnMut(usize)) {
    for z in low[2]..=high[2] {
        for y in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                visit((z * cells[1] + y) * cells[0] + x);
            }
        }
    }
}
