//! All plants of a scene, stepped together.
//!
//! A step goes in three waves, each spread over the workers in fixed pieces: the feet; the fibres on them, whose roots ride
//! on the feet as they have just become; the fibres that follow guides. Each piece packs the flow around itself once
//! and, when it is done, writes its nodes to where they are emitted.

use glam::{DVec3, Vec3};
use reef_flow::{Field, Level, Packed, Sphere};
use reef_sdk::{
    Chunks, Heightfield, Parts, Workers,
    abi::{self, Actor, Flow, Material, Object, Obstacle, Trace},
};

use crate::{
    frame::Frame,
    plant::{self, Strand},
    sow::{Harvest, Seedling},
    wide::{self, Blend, Capsule, Chunk, Contacts, Drag, Force, Lane, MOST_FIBRES, Plane, StepConstants},
};

/// What surrounds the plants in one step.
#[derive(Debug)]
pub struct Surroundings<'a> {
    /// All primitives, in the host's order.
    pub flow: &'a [Flow],
    /// Rocks.
    pub obstacles: &'a [Obstacle],
    /// The sea bed.
    pub ground: Option<Heightfield<'a>>,
    /// ρ [kg/m³].
    pub density: f32,
    /// μ [Pa s].
    pub viscosity: f32,
    /// Length of the step [s]; 0: only emit.
    pub dt: f64,
    /// Instruction set.
    pub level: Level,
    /// Who shares the work.
    pub workers: Workers<'a>,
}

/// What a person may change while the sea runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Factor on every K.
    pub stiffness: f64,
    /// Added to every n.
    pub exponent: f64,
    /// Factor on every τ.
    pub damping: f64,
    /// Factor on every drag force.
    pub drag: f32,
    /// Factor on the flow's velocity.
    pub current: f32,
    /// Stiffness of contacts over that of the touching node.
    pub contact: f32,
    /// The law of fibres whose drag is an area.
    pub force: Force,
    /// Loads without deformation.
    pub rigid: bool,
}

impl Default for Settings {
    fn default() -> Self {
        let constants = StepConstants::default();
        Self {
            stiffness: 1.0,
            exponent: 0.0,
            damping: 1.0,
            drag: constants.drag,
            current: constants.current,
            contact: constants.contact,
            force: constants.force,
            rigid: constants.rigid,
        }
    }
}

/// Which list of batches a fibre is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wave {
    Feet,
    Fibres,
    Followers,
}

/// Where a fibre is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    pub(crate) wave: Wave,
    pub(crate) batch: u32,
    pub(crate) lane: u32,
    pub(crate) node: u32,
    pub(crate) nodes: u32,
}

/// Fibres that one job steps.
#[derive(Clone, Debug)]
pub(crate) struct Batch {
    pub(crate) chunk: Chunk,
    /// The plant of each fibre.
    pub(crate) plants: Vec<u32>,
    /// The guides of each fibre (followers only).
    blends: Vec<Blend>,
    /// All fibres ride on one foot.
    riding: bool,
    /// What offsets and flow are relative to [m, world].
    pub(crate) anchor: DVec3,
    bounds: Sphere,
    pub(crate) packed: Packed,
    contacts: Contacts,
}

/// One plant in the bed.
#[derive(Clone, Debug)]
pub(crate) struct Standing {
    position: DVec3,
    grounded: bool,
    yaw: f64,
    /// World position that its nodes are relative to [m].
    pub(crate) origin: DVec3,
    stand: Frame,
    /// Top of the foot, relative to the origin; the stand itself without one.
    top: (DVec3, Frame),
    foot: Option<Spot>,
    reach: f64,
    crown: f64,
    species: u32,
    materials: [u32; 2],
    sides: [u32; 2],
    flatness: f32,
    /// Its fibres in [`Bed::fibres`]: the foot first.
    fibres: core::ops::Range<usize>,
}

/// All plants of a scene.
#[derive(Clone, Debug)]
pub struct Bed {
    pub(crate) plants: Vec<Standing>,
    feet: Vec<Batch>,
    pub(crate) fibres: Vec<Batch>,
    followers: Vec<Batch>,
    spots: Vec<(Spot, u32)>,
    materials: Vec<Material>,
    /// Where each batch's nodes begin, one more at the end; the three waves one after the other.
    node_bounds: [Vec<usize>; 3],
    nodes: usize,
    field: Field,
    applied: (f64, f64),
    placed: bool,
    /// Poses must be rebuilt from the bends before anything else.
    stale: bool,
}

/// How far a foot's root lies below the ground, in radii of its base: no gap shows under the flare.
const BURIED: f64 = 0.08;
/// How much of the ground's slope a plant's stand leans with.
const SLOPE_SHARE: f64 = 0.6;

impl Bed {
    /// Packs the plants.
    pub(crate) fn new(harvest: Harvest) -> Self {
        let mut bed = Self {
            plants: Vec::new(),
            feet: Vec::new(),
            fibres: Vec::new(),
            followers: Vec::new(),
            spots: Vec::new(),
            materials: harvest.materials,
            node_bounds: Default::default(),
            nodes: 0,
            field: Field::new(),
            applied: (1.0, 0.0),
            placed: false,
            stale: true,
        };
        bed.pack(&harvest.seedlings);
        bed
    }

    fn pack(&mut self, seedlings: &[Seedling]) {
        let mut feet = Packer::new(Wave::Feet);
        let mut fibres = Packer::new(Wave::Fibres);
        let mut followers = Packer::new(Wave::Followers);
        for (index, seedling) in (0_u32..).zip(seedlings) {
            let plant = &seedling.plant;
            let riding = plant.foot.is_some();
            let first = self.spots.len();
            let foot = plant.foot.as_ref().map(|strand| feet.add(strand, index, seedling, false, None));
            if let (Some(spot), Some(strand)) = (foot, &plant.foot) {
                self.spots.push((spot, strand.variation));
            }
            let mut guides = Vec::with_capacity(plant.guides.len());
            for strand in &plant.guides {
                let spot = fibres.add(strand, index, seedling, riding, None);
                guides.push((spot.batch, spot.lane));
                self.spots.push((spot, strand.variation));
            }
            for (strand, nearest, weights) in &plant.followers {
                let place = |i: u32| guides.get(i as usize).copied().unwrap_or_default();
                let blend = plant::blend(*nearest, *weights, place);
                let spot = followers.add(strand, index, seedling, riding, Some(blend));
                self.spots.push((spot, strand.variation));
            }
            let upright = Frame::upright(seedling.yaw);
            self.plants.push(Standing {
                position: seedling.position,
                grounded: seedling.grounded,
                yaw: seedling.yaw,
                origin: seedling.position,
                stand: upright,
                top: (DVec3::ZERO, upright),
                foot,
                reach: plant.reach,
                crown: plant.crown,
                species: seedling.species,
                materials: seedling.materials,
                sides: seedling.sides,
                flatness: seedling.flatness,
                fibres: first..self.spots.len(),
            });
        }
        self.feet = feet.finish();
        self.fibres = fibres.finish();
        self.followers = followers.finish();
        let mut nodes = 0;
        for (bounds, batches) in self.node_bounds.iter_mut().zip([&self.feet, &self.fibres, &self.followers])
        {
            // Each wave's bounds count from that wave's first node.
            bounds.push(0);
            for batch in batches {
                bounds.push(bounds[bounds.len() - 1] + batch.chunk.nodes());
            }
            nodes += bounds[bounds.len() - 1];
        }
        self.nodes = nodes;
        let starts = [0, self.wave_nodes(0), self.wave_nodes(0) + self.wave_nodes(1)];
        for (spot, _) in &mut self.spots {
            let wave = spot.wave as usize;
            let within = spot.lane as usize * spot.nodes as usize;
            let batch = self.node_bounds[wave][spot.batch as usize];
            spot.node = (starts[wave] + batch + within) as u32;
        }
        for plant in &mut self.plants {
            plant.foot = plant.foot.and_then(|_| self.spots.get(plant.fibres.start).map(|(spot, _)| *spot));
        }
    }

    fn wave_nodes(&self, wave: usize) -> usize {
        self.node_bounds[wave].last().copied().unwrap_or(0)
    }

    /// Nodes of all fibres.
    pub fn node_count(&self) -> usize {
        self.nodes
    }

    /// Fibres, feet included.
    pub fn fibre_count(&self) -> usize {
        self.spots.len()
    }

    /// Plants, bare fibres included.
    pub fn plant_count(&self) -> usize {
        self.plants.len()
    }

    /// Local flow primitives that were evaluated in the last step, and those that bounding spheres saved, both times the
    /// nodes that they would have been evaluated at.
    pub fn evaluations(&self) -> (u64, u64) {
        self.feet.iter().chain(&self.fibres).fold((0, 0), |(done, saved), batch| {
            let nodes = (batch.chunk.nodes() - batch.chunk.count()) as u64;
            (
                done + nodes * u64::from(batch.packed.evaluated()),
                saved + nodes * u64::from(batch.packed.saved()),
            )
        })
    }

    /// Vertices of all rings at full detail.
    pub fn vertex_count(&self) -> u64 {
        self.plants
            .iter()
            .flat_map(|plant| self.spots[plant.fibres.clone()].iter().map(move |(spot, _)| (plant, spot)))
            .map(|(plant, spot)| {
                u64::from(spot.nodes) * u64::from(plant.sides[usize::from(spot.wave != Wave::Feet)])
            })
            .sum()
    }

    /// One step; with dt = 0 the poses stay. Writes all nodes to `nodes`, which must have room for
    /// [`Self::node_count`].
    pub fn step(&mut self, around: &Surroundings<'_>, settings: &Settings, nodes: &mut [[f32; 4]]) {
        if !self.placed {
            self.place(around);
        }
        if self.stale {
            self.rebuild(around.level);
        }
        if self.applied != (settings.stiffness, settings.exponent) {
            self.applied = (settings.stiffness, settings.exponent);
            for batch in self.feet.iter_mut().chain(&mut self.fibres) {
                batch.chunk.set_stiffness(settings.stiffness, settings.exponent);
            }
        }
        let constants = StepConstants {
            density: around.density,
            viscosity: around.viscosity,
            drag: settings.drag,
            current: settings.current,
            contact: settings.contact,
            force: settings.force,
            rigid: settings.rigid,
        };
        let moving = around.dt > 0.0;
        if moving {
            self.field.refill(around.flow);
        }
        let (feet_nodes, rest) = nodes.split_at_mut(self.wave_nodes(0).min(nodes.len()));
        let (fibre_nodes, follower_nodes) = rest.split_at_mut(self.wave_nodes(1).min(rest.len()));
        let Self { plants, feet, fibres, followers, node_bounds, field, .. } = self;
        let advance = |batch: &mut Batch| {
            batch.packed.fill_near(field, batch.bounds, batch.anchor.to_array(), 0);
            batch.chunk.set_gain(around.dt, settings.damping);
            wide::step(around.level, &mut batch.chunk, &batch.packed, &batch.contacts, &constants);
        };
        around.workers.for_each_part(
            (Chunks::new(feet, 1), Parts::new(feet_nodes, &node_bounds[0])),
            |_, (batch, nodes)| {
                for batch in batch {
                    if moving {
                        advance(batch);
                    }
                    batch.chunk.emit(nodes);
                }
            },
        );
        if moving {
            ride(plants, feet);
        }
        let plants = &*plants;
        around.workers.for_each_part(
            (Chunks::new(fibres, 1), Parts::new(fibre_nodes, &node_bounds[1])),
            |_, (batch, nodes)| {
                for batch in batch {
                    if moving {
                        batch.carry(plants);
                        batch.touch(around.obstacles, settings.contact);
                        advance(batch);
                    }
                    batch.chunk.emit(nodes);
                }
            },
        );
        let fibres = &*fibres;
        around.workers.for_each_part(
            (Chunks::new(followers, 1), Parts::new(follower_nodes, &node_bounds[2])),
            |_, (batch, nodes)| {
                for batch in batch {
                    if moving {
                        batch.carry(plants);
                        batch.follow(around.level, fibres);
                    }
                    batch.chunk.emit(nodes);
                }
            },
        );
    }

    /// Puts every plant on the ground, once.
    fn place(&mut self, around: &Surroundings<'_>) {
        for plant in &mut self.plants {
            let buried = plant.foot.map_or(0.0, |spot| {
                BURIED * f64::from(self.feet[spot.batch as usize].chunk.radius(spot.lane as usize, 0))
            });
            plant.stand_on(around.ground.as_ref(), around.obstacles, buried);
        }
        let plants = &self.plants;
        for batch in self.feet.iter_mut().chain(&mut self.fibres).chain(&mut self.followers) {
            batch.settle(plants, around.ground.as_ref());
        }
        self.placed = true;
        self.stale = true;
    }

    /// Poses from bends.
    fn rebuild(&mut self, level: Level) {
        for batch in &mut self.feet {
            wide::rebuild(level, &mut batch.chunk);
        }
        ride(&mut self.plants, &self.feet);
        let plants = &self.plants;
        for batch in &mut self.fibres {
            batch.carry(plants);
            wide::rebuild(level, &mut batch.chunk);
        }
        let fibres = &self.fibres;
        for batch in &mut self.followers {
            batch.carry(plants);
            batch.follow(level, fibres);
        }
        self.stale = false;
    }

    fn batch(&self, spot: &Spot) -> Option<&Batch> {
        match spot.wave {
            Wave::Feet => self.feet.get(spot.batch as usize),
            Wave::Fibres => self.fibres.get(spot.batch as usize),
            Wave::Followers => self.followers.get(spot.batch as usize),
        }
    }

    /// Materials: they never change.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// One object a plant.
    pub fn objects(&self) -> impl Iterator<Item = Object> + '_ {
        (1_u64..).zip(&self.plants).map(|(id, plant)| Object {
            id,
            origin: plant.origin.to_array(),
            bounds_radius: plant.reach as f32,
            ..Object::default()
        })
    }

    /// The plants that others perceive: the crowns.
    pub fn actors(&self) -> impl Iterator<Item = Actor> + '_ {
        (1_u64..).zip(&self.plants).filter(|(_, plant)| plant.species != 0).map(|(id, plant)| Actor {
            id,
            position: (plant.origin + plant.top.0).to_array(),
            radius: plant.crown as f32,
            forward: plant.top.1.z.as_vec3().to_array(),
            species: plant.species,
            ..Actor::default()
        })
    }

    /// All fibres that are not broken off, plant by plant, the foot first.
    pub fn fibres(&self) -> impl Iterator<Item = abi::Fibre> + '_ {
        (0_u32..).zip(&self.plants).flat_map(move |(object, plant)| {
            self.spots[plant.fibres.clone()].iter().filter_map(move |(spot, variation)| {
                let chunk = &self.batch(spot)?.chunk;
                let lane = spot.lane as usize;
                if chunk.is_broken(lane) {
                    return None;
                }
                let part = usize::from(spot.wave != Wave::Feet);
                let blade = part == 1 && plant.flatness < 1.0;
                let flags =
                    if part == 0 { abi::FIBRE_CAP } else { 0 } | if blade { abi::FIBRE_BLADE } else { 0 };
                Some(abi::Fibre {
                    object,
                    first_node: spot.node,
                    node_count: spot.nodes,
                    material: plant.materials[part],
                    flags,
                    sides: plant.sides[part],
                    variation: *variation,
                    flatness: if part == 1 { plant.flatness } else { 1.0 },
                    normal: chunk.normal(lane).to_array(),
                    ..abi::Fibre::default()
                })
            })
        })
    }

    /// Every node as recordings see it: a foot and each of its tentacles are objects of their own, in that order.
    pub fn trace(&self) -> impl Iterator<Item = Trace> + '_ {
        let all = self
            .plants
            .iter()
            .flat_map(|plant| self.spots[plant.fibres.clone()].iter().map(move |(spot, _)| (plant, spot)));
        (0_u64..).zip(all).flat_map(move |(object, (plant, spot))| {
            let chunk = self.batch(spot).map(|batch| &batch.chunk);
            let lane = spot.lane as usize;
            chunk.into_iter().flat_map(move |chunk| {
                (0..spot.nodes).map(move |node| Trace {
                    object,
                    position: (plant.origin + chunk.node(lane, node as usize).as_dvec3()).to_array(),
                    radius: chunk.radius(lane, node as usize),
                    node,
                    kind: abi::TRACE_FIBRE,
                    ..Trace::default()
                })
            })
        })
    }

    /// Nodes in [`Self::trace`].
    pub fn trace_len(&self) -> usize {
        self.nodes
    }

    /// Every number that a later step depends on.
    pub fn save(&self) -> Vec<f32> {
        let mut state = Vec::new();
        for batch in self.feet.iter().chain(&self.fibres) {
            batch.chunk.save(&mut state);
        }
        state
    }

    /// Takes back what [`Self::save`] wrote; says what is wrong with it otherwise.
    pub fn load(&mut self, state: &[f32]) -> Result<(), String> {
        let wanted: usize = self.feet.iter().chain(&self.fibres).map(|batch| batch.chunk.state_len()).sum();
        if state.len() != wanted {
            return Err(format!("holds {} numbers; these plants have {wanted}", state.len()));
        }
        let mut rest = state;
        for batch in self.feet.iter_mut().chain(&mut self.fibres) {
            let (own, after) = rest.split_at(batch.chunk.state_len());
            if !batch.chunk.load(own) {
                return Err("holds a number that is not finite".to_owned());
            }
            rest = after;
        }
        self.stale = true;
        Ok(())
    }
}

/// Tells every plant where the top of its foot is.
fn ride(plants: &mut [Standing], feet: &[Batch]) {
    for plant in plants {
        if let Some((chunk, lane)) =
            plant.foot.and_then(|spot| Some((&feet.get(spot.batch as usize)?.chunk, spot.lane as usize)))
        {
            plant.top = (chunk.node(lane, chunk.segments()).as_dvec3(), chunk.tip_frame(lane));
        }
    }
}

impl Standing {
    fn stand_on(&mut self, ground: Option<&Heightfield<'_>>, rocks: &[Obstacle], buried: f64) {
        self.origin = self.position;
        self.stand = Frame::upright(self.yaw);
        if let (true, Some(ground)) = (self.grounded, ground) {
            let [x, z] = [self.position.x, self.position.z];
            let bed = f64::from(ground.height(x, z));
            let (height, normal) = match on_rock(rocks, x, z, bed) {
                Some(found) => found,
                None => (bed, normal_of(ground, x, z)),
            };
            self.origin.y = height + self.position.y - buried;
            let up = DVec3::Y.lerp(normal, SLOPE_SHARE).normalize_or(DVec3::Y);
            self.stand = Frame::along(up, self.stand.x);
        }
        self.top = (DVec3::ZERO, self.stand);
    }
}

/// Unit normal of the bed.
fn normal_of(ground: &Heightfield<'_>, x: f64, z: f64) -> DVec3 {
    let e = f64::from(ground.cell);
    let slope = |dx: f64, dz: f64| {
        f64::from(ground.height(x + dx, z + dz) - ground.height(x - dx, z - dz)) / (2.0 * e)
    };
    DVec3::new(-slope(e, 0.0), 1.0, -slope(0.0, e)).normalize_or(DVec3::Y)
}

/// Height and normal of the highest rock over (x, z), where one rises over the bed.
fn on_rock(rocks: &[Obstacle], x: f64, z: f64, bed: f64) -> Option<(f64, DVec3)> {
    let mut best: Option<(f64, DVec3)> = None;
    for rock in rocks {
        let (from, delta) = (DVec3::from(rock.from), Vec3::from(rock.delta).as_dvec3());
        let radius = f64::from(rock.radius);
        // The highest point of the capsule over (x, z), found along its axis by sections.
        let flat2 = delta.x * delta.x + delta.z * delta.z;
        let near = ((x - from.x) * delta.x + (z - from.z) * delta.z) / flat2.max(1e-12);
        for t in [0.0, near.clamp(0.0, 1.0), 1.0] {
            let center = from + delta * t;
            let off2 = (x - center.x) * (x - center.x) + (z - center.z) * (z - center.z);
            let rise2 = radius * radius - off2;
            if rise2 > 0.0 {
                let top = center.y + rise2.sqrt();
                if top > bed && best.is_none_or(|(highest, _)| top > highest) {
                    best = Some((top, (DVec3::new(x, top, z) - center) / radius));
                }
            }
        }
    }
    best
}

impl Batch {
    /// Once, when all plants stand: what everything in here is relative to, and what lies around.
    fn settle(&mut self, plants: &[Standing], ground: Option<&Heightfield<'_>>) {
        let of = |fibre: usize| self.plants.get(fibre).and_then(|plant| plants.get(*plant as usize));
        let Some(first) = of(0) else { return };
        // Rounded to a millimetre-free grid it is not: one plant's own origin makes its offsets exactly zero.
        self.anchor = first.origin;
        let mut center = DVec3::ZERO;
        for fibre in 0..self.plants.len() {
            center += of(fibre).map_or(DVec3::ZERO, |plant| plant.origin - self.anchor);
        }
        center = self.anchor + center / self.plants.len() as f64;
        let mut radius: f64 = 0.0;
        for fibre in 0..self.plants.len() {
            if let Some(plant) = of(fibre) {
                radius = radius.max(plant.origin.distance(center) + plant.reach);
            }
        }
        self.bounds = Sphere { center: center.to_array(), radius };
        let offsets: Vec<Vec3> = (0..self.plants.len())
            .map(|fibre| of(fibre).map_or(Vec3::ZERO, |plant| (plant.origin - self.anchor).as_vec3()))
            .collect();
        for (fibre, offset) in offsets.iter().enumerate() {
            self.chunk.set_offset(fibre, *offset);
        }
        // The ground as one plane: right for one plant, and for plants that stand apart too coarse to be used.
        let one_plant = self.plants.iter().all(|plant| *plant == self.plants[0]);
        self.contacts.ground = ground.filter(|_| one_plant && first.grounded).map(|ground| {
            let (x, z) = (first.origin.x, first.origin.z);
            let normal = normal_of(ground, x, z);
            let bed = DVec3::new(x, f64::from(ground.height(x, z)), z) - self.anchor;
            Plane { normal: normal.as_vec3().to_array(), height: normal.dot(bed) as f32 }
        });
        let stands: Vec<Frame> =
            (0..self.plants.len()).map(|fibre| of(fibre).map_or(first.stand, |plant| plant.stand)).collect();
        self.chunk.carry_each(|fibre| (DVec3::ZERO, stands.get(fibre).copied().unwrap_or(first.stand)));
    }

    /// Puts the roots on the foot.
    fn carry(&mut self, plants: &[Standing]) {
        if let (true, Some(plant)) = (self.riding, self.plants.first().and_then(|p| plants.get(*p as usize)))
        {
            self.chunk.carry(plant.top.0, &plant.top.1);
        }
    }

    /// Collects the rocks near by.
    fn touch(&mut self, rocks: &[Obstacle], contact: f32) {
        self.contacts.capsules.clear();
        if contact <= 0.0 {
            return;
        }
        let center = DVec3::from(self.bounds.center);
        for rock in rocks {
            let from = DVec3::from(rock.from);
            let delta = Vec3::from(rock.delta).as_dvec3();
            let t = ((center - from).dot(delta) / delta.length_squared().max(1e-12)).clamp(0.0, 1.0);
            let near = from + delta * t;
            if near.distance(center) < self.bounds.radius + f64::from(rock.radius) {
                self.contacts.capsules.push(Capsule {
                    from: (from - self.anchor).as_vec3().to_array(),
                    delta: rock.delta,
                    radius: rock.radius,
                });
            }
        }
    }

    fn follow(&mut self, level: Level, guides: &[Self]) {
        let Self { chunk, blends, .. } = self;
        wide::follow(level, chunk, blends, |batch| guides.get(batch as usize).map(|batch| &batch.chunk));
    }
}

/// What the fibres of one batch have in common.
#[derive(Clone, Copy, PartialEq)]
struct Kin {
    segments: usize,
    drag: Drag,
    weight: f64,
    /// The one plant that all ride on; None: they stand by themselves.
    plant: Option<u32>,
}

/// Collects fibres into batches.
struct Packer {
    wave: Wave,
    batches: Vec<Batch>,
    open: Vec<(Kin, Vec<Lane>, Vec<(f64, f64)>, Vec<u32>, Vec<Blend>)>,
}

impl Packer {
    fn new(wave: Wave) -> Self {
        Self { wave, batches: Vec::new(), open: Vec::new() }
    }

    fn add(
        &mut self,
        strand: &Strand,
        plant: u32,
        seedling: &Seedling,
        riding: bool,
        blend: Option<Blend>,
    ) -> Spot {
        let kin = Kin {
            segments: strand.shape.segments(),
            drag: if self.wave == Wave::Feet { Drag::Area { coefficient: 0.5 } } else { seedling.drag },
            weight: if self.wave == Wave::Feet { 0.0 } else { seedling.weight },
            plant: riding.then_some(plant),
        };
        let lane = Lane {
            shape: strand.shape.clone(),
            place: strand.place,
            offset: Vec3::ZERO,
            relaxation: strand.relaxation,
            break_force: strand.break_force,
        };
        // The newest batch of this kin that has room.
        let at = match self.open.iter().rposition(|(own, lanes, ..)| *own == kin && lanes.len() < MOST_FIBRES)
        {
            Some(at) => at,
            None => {
                self.open.push((kin, Vec::new(), Vec::new(), Vec::new(), Vec::new()));
                self.open.len() - 1
            }
        };
        let (_, lanes, stiffness, plants, blends) = &mut self.open[at];
        lanes.push(lane);
        stiffness.push(strand.stiffness);
        plants.push(plant);
        blends.extend(blend);
        Spot {
            wave: self.wave,
            batch: at as u32,
            lane: lanes.len() as u32 - 1,
            node: 0,
            nodes: strand.shape.nodes() as u32,
        }
    }

    fn finish(mut self) -> Vec<Batch> {
        for (kin, lanes, stiffness, plants, blends) in self.open {
            let Some(mut chunk) = Chunk::new(&lanes, kin.drag, &stiffness) else { continue };
            chunk.set_load(Vec3::new(0.0, -kin.weight as f32, 0.0));
            self.batches.push(Batch {
                chunk,
                plants,
                blends,
                riding: kin.plant.is_some(),
                anchor: DVec3::ZERO,
                bounds: Sphere { center: [0.0; 3], radius: 0.0 },
                packed: Packed::new(),
                contacts: Contacts::default(),
            });
        }
        self.batches
    }
}
