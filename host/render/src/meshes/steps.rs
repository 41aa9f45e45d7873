//! The joints and vertices of steps on the device: each step is brought there once, however many pictures
//! show it, and two stay there.

use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;
use reef_gpu::{Buffer, BufferDesc, Gpu, Memory, Result};
use reef_streams::{Outputs, frame::Frame};

/// Steps that are kept: the two of a picture, and those that frames in flight may still read. A frame brings
/// two at most.
const KEPT: usize = 8;

/// One step on the device.
pub struct Resident {
    /// What was brought; held while a picture shows it, so that no other step can have their addresses. Empty
    /// where the buffers only wait for frames in flight.
    outputs: Vec<Arc<Outputs>>,
    /// Joints of all modules, one after the other.
    pub joints: Buffer,
    /// Vertices that were made anew, in the same way.
    pub vertices: Buffer,
}

/// The steps that are there, the newest last.
#[derive(Default)]
pub struct Steps {
    residents: Vec<Resident>,
    /// What was brought for the last picture [bytes].
    pub brought: u64,
}

impl Resident {
    fn shows(&self, frame: &Frame) -> bool {
        self.outputs.len() == frame.outputs.len()
            && self.outputs.iter().zip(&frame.outputs).all(|(a, b)| Arc::ptr_eq(a, b))
    }
}

impl Steps {
    /// Brings the steps of a picture to the device, where they are not there yet.
    pub fn update(&mut self, gpu: &Gpu, [previous, current]: [&Frame; 2]) -> Result<()> {
        self.brought = 0;
        for frame in [previous, current] {
            if let Some(at) = self.residents.iter().position(|resident| resident.shows(frame)) {
                let resident = self.residents.remove(at);
                self.residents.push(resident);
                continue;
            }
            // The oldest has not been shown for so many pictures that no frame reads it.
            let old = (self.residents.len() >= KEPT).then(|| self.residents.remove(0));
            let (joints, vertices) = old.map(|old| (old.joints, old.vertices)).unzip();
            let lists = |of: fn(&Outputs) -> &[u8]| frame.outputs.iter().map(move |outputs| of(outputs));
            let joints = write(gpu, "mesh step joints", joints, lists(|o| bytemuck::cast_slice(&o.joints)))?;
            let vertices = write(
                gpu,
                "mesh step vertices",
                vertices,
                lists(|o| bytemuck::cast_slice(&o.draw_vertices)),
            )?;
            self.brought += joints.1 + vertices.1;
            self.residents.push(Resident {
                outputs: frame.outputs.clone(),
                joints: joints.0,
                vertices: vertices.0,
            });
        }
        self.let_go(|resident| resident.shows(previous) || resident.shows(current));
        Ok(())
    }

    /// No picture shows any of them now.
    pub fn forget(&mut self) {
        self.let_go(|_| false);
    }

    /// Modules write their next steps into outputs that nobody holds.
    fn let_go(&mut self, stays: impl Fn(&Resident) -> bool) {
        self.residents.iter_mut().filter(|resident| !stays(resident)).for_each(|r| r.outputs.clear());
    }

    /// A step that was brought for this picture.
    pub fn of(&self, frame: &Frame) -> Option<&Resident> {
        self.residents.iter().rev().find(|resident| resident.shows(frame))
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

/// Where a module's joints and vertices begin in a step.
pub fn base(frame: &Frame, module: usize) -> [u32; 2] {
    let before = &frame.outputs[..module.min(frame.outputs.len())];
    let sum = |of: fn(&Outputs) -> usize| before.iter().map(|outputs| of(outputs)).sum::<usize>() as u32;
    [sum(|o| o.joints.len()), sum(|o| o.draw_vertices.len())]
}
