//! A species' body as the kernel walks it: springs and faces by numbers, and the order in which the matrix of
//! the implicit step is taken apart.
//!
//! The matrix has a 3 × 3 block for each pair of nodes that a spring joins. Taking a node out joins all later
//! nodes that it was joined to; what blocks that fills in depends on the body alone and is worked out here,
//! for any body that segment types make.

use crate::{
    body::{Body, BodyError},
    material::{Beat, Material},
};

/// A spring.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spring {
    pub(crate) ends: [u32; 2],
    /// Its block of the matrix.
    pub(crate) block: u32,
    /// Length at rest [m] and stiffness [N/m].
    pub(crate) rest: f32,
    pub(crate) stiffness: f32,
    pub(crate) muscle: Option<Muscle>,
}

/// What its group and its place make of the fish's drive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Muscle {
    /// Of those whose turn is the first half of a beat.
    pub(crate) first: bool,
    pub(crate) left: f32,
    pub(crate) top: f32,
    pub(crate) gap: u32,
}

/// A face of three or four nodes, and the blocks of all pairs of them: 01, 02, 12, then 03, 13, 23.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Skin {
    pub(crate) nodes: [u32; 4],
    pub(crate) blocks: [u32; 6],
    pub(crate) four: bool,
}

/// A block below the diagonal, and which products are taken off it: `terms` of the plan, two blocks each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    pub(crate) row: u32,
    pub(crate) terms: [u32; 2],
    /// It is not only filled in.
    pub(crate) own: bool,
}

/// What is taken off a node's own block, `lefts` of the plan, and its column of blocks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Column {
    pub(crate) lefts: [u32; 2],
    pub(crate) blocks: [u32; 2],
}

/// Everything about a species that a step needs.
#[derive(Clone, Debug)]
pub struct Plan {
    body: Body,
    pub(crate) beat: Beat,
    /// Nodes at rest [m].
    pub(crate) rest: Vec<[f32; 3]>,
    pub(crate) springs: Vec<Spring>,
    pub(crate) skins: Vec<Skin>,
    pub(crate) lift: Vec<f32>,
    /// Mass of a node [kg].
    pub(crate) mass: f32,
    pub(crate) damping: f32,
    pub(crate) water: f32,
    pub(crate) righting: f32,
    pub(crate) gaps: u32,
    pub(crate) columns: Vec<Column>,
    pub(crate) blocks: Vec<Block>,
    pub(crate) terms: Vec<[u32; 2]>,
    /// Block, and the node of its column.
    pub(crate) lefts: Vec<[u32; 2]>,
}

impl Plan {
    /// # Errors
    /// A number of the material that no body can have; a segment type whose face has two nodes that no spring
    /// joins.
    pub fn new(body: &Body, material: &Material, beat: &Beat) -> Result<Self, BodyError> {
        material.check()?;
        let count = body.nodes().len();
        let (columns, blocks, terms, lefts) = taken_apart(body);
        let block_of = |a: usize, b: usize| -> Option<u32> {
            let [begin, end] = columns[a.min(b)].blocks;
            (begin..end).find(|block| blocks[*block as usize].row as usize == a.max(b))
        };
        let rest: Vec<[f32; 3]> = body.nodes().iter().map(|at| at.as_vec3().to_array()).collect();
        let mut springs = Vec::new();
        for link in body.springs() {
            let [a, b] = link.ends;
            let muscle = link.muscle.map(|muscle| Muscle {
                first: if beat.upright { muscle.top > 0 } else { muscle.left > 0 },
                left: f32::from(muscle.left),
                top: f32::from(muscle.top),
                gap: u32::from(muscle.gap),
            });
            springs.push(Spring {
                ends: [a as u32, b as u32],
                block: block_of(a, b).unwrap_or_default(),
                rest: distance(rest[a], rest[b]),
                stiffness: material.stiffness(link.role) as f32,
                muscle,
            });
        }
        let mut skins = Vec::new();
        for face in body.faces() {
            let mut nodes = [face.nodes()[face.nodes().len() - 1] as u32; 4];
            for (into, node) in nodes.iter_mut().zip(face.nodes()) {
                *into = *node as u32;
            }
            let four = face.nodes().len() == 4;
            let pairs = [[0, 1], [0, 2], [1, 2], [0, 3], [1, 3], [2, 3]];
            let mut skin = Skin { nodes, blocks: [0; 6], four };
            for (into, [a, b]) in skin.blocks.iter_mut().zip(pairs).take(if four { 6 } else { 3 }) {
                let [a, b] = [nodes[a] as usize, nodes[b] as usize];
                let joined = body.springs().iter().any(|link| link.ends == [a, b] || link.ends == [b, a]);
                let (Some(block), true) = (block_of(a, b), joined) else {
                    let problem = format!("nodes {a} and {b} of a face must be joined by a spring");
                    return Err(BodyError { key: "faces".into(), problem });
                };
                *into = block;
            }
            skins.push(skin);
        }
        Ok(Self {
            beat: *beat,
            rest,
            springs,
            skins,
            lift: body.lift().iter().map(|lift| f32::from(*lift)).collect(),
            mass: (material.mass / count as f64) as f32,
            damping: material.damping as f32,
            water: material.water as f32,
            righting: material.righting as f32,
            gaps: body.muscle_gaps() as u32,
            columns,
            blocks,
            terms,
            lefts,
            body: body.clone(),
        })
    }

    /// The body.
    pub fn body(&self) -> &Body {
        &self.body
    }
}

/// Length as the kernel works it out, so that a fish at rest feels nothing.
fn distance([ax, ay, az]: [f32; 3], [bx, by, bz]: [f32; 3]) -> f32 {
    let [x, y, z] = [bx - ax, by - ay, bz - az];
    z.mul_add(z, y.mul_add(y, x * x)).sqrt()
}

type Apart = (Vec<Column>, Vec<Block>, Vec<[u32; 2]>, Vec<[u32; 2]>);

/// Which blocks there are when the nodes are taken out front to back, and what is taken off each.
fn taken_apart(body: &Body) -> Apart {
    let count = body.nodes().len();
    let mut own = vec![vec![false; count]; count];
    for link in body.springs() {
        let [a, b] = link.ends;
        own[a.max(b)][a.min(b)] = true;
    }
    let mut filled = own.clone();
    for k in 0..count {
        let rows: Vec<usize> = (k + 1..count).filter(|i| filled[*i][k]).collect();
        for (n, j) in rows.iter().enumerate() {
            rows[n + 1..].iter().for_each(|i| filled[*i][*j] = true);
        }
    }
    let mut number = vec![vec![u32::MAX; count]; count];
    let mut next = 0;
    for j in 0..count {
        for i in j + 1..count {
            if filled[i][j] {
                number[i][j] = next;
                next += 1;
            }
        }
    }
    let (mut columns, mut blocks, mut terms, mut lefts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for j in 0..count {
        let left_begin = lefts.len() as u32;
        lefts.extend((0..j).filter(|k| filled[j][*k]).map(|k| [number[j][k], k as u32]));
        let begin = blocks.len() as u32;
        for i in (j + 1..count).filter(|i| filled[*i][j]) {
            let from = terms.len() as u32;
            let both = (0..j).filter(|k| filled[i][*k] && filled[j][*k]);
            terms.extend(both.map(|k| [number[i][k], number[j][k]]));
            blocks.push(Block { row: i as u32, terms: [from, terms.len() as u32], own: own[i][j] });
        }
        columns
            .push(Column { lefts: [left_begin, lefts.len() as u32], blocks: [begin, blocks.len() as u32] });
    }
    (columns, blocks, terms, lefts)
}
