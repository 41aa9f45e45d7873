//! The streams of steps on the device: each step is brought there once, however many pictures show it, and
//! two stay there. So does what is gathered from two steps and is the same in all pictures between them.

use std::{collections::VecDeque, iter, sync::Arc};

use ash::vk;
use bytemuck::Pod;
use reef_gpu::{Buffer, BufferDesc, Gpu, Memory, Result, Upload};
use reef_streams::{Outputs, frame::Frame};

use crate::gather::Gathered;

/// Steps that are kept: the two of a picture, and those that frames in flight may still read. A frame brings
/// two at most.
const KEPT: usize = 8;

/// One step on the device: the elements of all modules, one module after the other.
pub struct Resident {
    /// What was brought; held while a picture shows it, so that no other step can have their addresses. Empty
    /// where the buffers only wait for frames in flight.
    outputs: Vec<Arc<Outputs>>,
    /// Nodes of fibres.
    pub nodes: Buffer,
    /// Joints of meshes.
    pub joints: Buffer,
    /// Vertices of meshes that were made anew.
    pub vertices: Buffer,
}

/// What the passes read of a picture's two steps.
#[derive(Clone, Copy)]
pub struct Shown<'a> {
    /// The step before.
    pub before: &'a Resident,
    /// The present step.
    pub now: &'a Resident,
    /// Fibres of the present step, matched with those of the step before.
    pub fibres: &'a Buffer,
    /// Materials of the present step.
    pub materials: &'a Buffer,
    /// Where the objects are in this picture.
    pub objects: Upload,
}

/// The steps that are there, the newest last.
#[derive(Default)]
pub struct Steps {
    residents: Vec<Resident>,
    /// The two of the last picture among them.
    pair: Option<[usize; 2]>,
    fibres: Turns,
    materials: Turns,
    /// Of what is gathered: what was brought with it.
    generation: u64,
    /// What was brought for the last picture [bytes].
    pub brought: u64,
}

/// Whether these are the same outputs.
fn same(some: &[Arc<Outputs>], others: &[Arc<Outputs>]) -> bool {
    some.len() == others.len() && some.iter().zip(others).all(|(a, b)| Arc::ptr_eq(a, b))
}

impl Steps {
    /// Whether the last picture lay between the same two steps.
    pub fn show(&self, [previous, current]: [&Frame; 2]) -> bool {
        let is = |at: usize, frame: &Frame| same(&self.residents[at].outputs, &frame.outputs);
        self.pair.is_some_and(|[before, now]| is(before, previous) && is(now, current))
    }

    /// Brings the steps of a picture, and what was gathered from them, to the device, where they are not yet
    /// there.
    pub fn update(&mut self, gpu: &Gpu, [previous, current]: [&Frame; 2], gathered: &Gathered) -> Result<()> {
        self.brought = 0;
        if !self.show([previous, current]) || self.generation != gathered.generation {
            self.brought += self.fibres.write(gpu, "fibres", bytemuck::cast_slice(&gathered.fibres))?;
            self.brought +=
                self.materials.write(gpu, "materials", bytemuck::cast_slice(&gathered.materials))?;
            self.generation = gathered.generation;
        }
        self.pair = None;
        for frame in [previous, current] {
            if let Some(at) =
                self.residents.iter().position(|resident| same(&resident.outputs, &frame.outputs))
            {
                let resident = self.residents.remove(at);
                self.residents.push(resident);
                continue;
            }
            // The oldest has not been shown for so many pictures that no frame reads it.
            let old = (self.residents.len() >= KEPT).then(|| self.residents.remove(0));
            let [nodes, joints, vertices] = match old {
                Some(old) => [old.nodes, old.joints, old.vertices].map(Some),
                None => [None, None, None],
            };
            let lists = |of: fn(&Outputs) -> &[u8]| frame.outputs.iter().map(move |outputs| of(outputs));
            let nodes = write(gpu, "step nodes", nodes, lists(|o| bytemuck::cast_slice(&o.fibre_nodes)))?;
            let joints = write(gpu, "step joints", joints, lists(|o| bytemuck::cast_slice(&o.joints)))?;
            let vertices =
                write(gpu, "step vertices", vertices, lists(|o| bytemuck::cast_slice(&o.draw_vertices)))?;
            self.brought += nodes.1 + joints.1 + vertices.1;
            self.residents.push(Resident {
                outputs: frame.outputs.clone(),
                nodes: nodes.0,
                joints: joints.0,
                vertices: vertices.0,
            });
        }
        let at = |frame: &Frame| self.residents.iter().rposition(|r| same(&r.outputs, &frame.outputs));
        self.pair = at(previous).zip(at(current)).map(|(before, now)| [before, now]);
        // Modules write their next steps into outputs that nobody holds.
        for (at, resident) in self.residents.iter_mut().enumerate() {
            if !self.pair.is_some_and(|pair| pair.contains(&at)) {
                resident.outputs.clear();
            }
        }
        Ok(())
    }

    /// What the passes read of the picture that all was brought for, whose objects these are.
    pub fn shown(&self, objects: Upload) -> Option<Shown<'_>> {
        let [before, now] = self.pair?.map(|at| &self.residents[at]);
        Some(Shown {
            before,
            now,
            fibres: self.fibres.newest()?,
            materials: self.materials.newest()?,
            objects,
        })
    }
}

/// A buffer whose content is replaced as a whole, while frames in flight read what it held before.
#[derive(Default)]
struct Turns(VecDeque<Buffer>);

impl Turns {
    /// Replaces the content; returns how much it is [bytes].
    fn write(&mut self, gpu: &Gpu, name: &str, bytes: &[u8]) -> Result<u64> {
        let old = if self.0.len() >= KEPT { self.0.pop_front() } else { None };
        let (buffer, size) = write(gpu, name, old, iter::once(bytes))?;
        self.0.push_back(buffer);
        Ok(size)
    }

    fn newest(&self) -> Option<&Buffer> {
        self.0.back()
    }
}

/// Bytes one after the other in a buffer, the one that is given where they fit; and how many they are.
fn write<'a>(
    gpu: &Gpu,
    name: &str,
    old: Option<Buffer>,
    lists: impl Iterator<Item = &'a [u8]> + Clone,
) -> Result<(Buffer, u64)> {
    let total: u64 = lists.clone().map(|bytes| bytes.len() as u64).sum();
    let buffer = match old.filter(|old| old.size() >= total) {
        Some(old) => old,
        None => {
            // A buffer of no bytes is not allowed.
            let size = total.next_power_of_two().max(64);
            let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER;
            Buffer::new(gpu, &BufferDesc { name, size, usage, memory: Memory::Upload })?
        }
    };
    let mut end = 0;
    for bytes in lists {
        buffer.write(end, bytes)?;
        end += bytes.len() as u64;
    }
    Ok((buffer, total))
}

/// What a step has of one stream, as it lies on the device: for the twin.
pub fn joined<T: Pod>(frame: &Frame, of: impl Fn(&Outputs) -> &[T]) -> Vec<T> {
    frame.outputs.iter().flat_map(|outputs| of(outputs).iter().copied()).collect()
}
