//! Meshes that an instance makes once.

use std::ffi::CString;

use reef_abi as abi;

use crate::{error::MeshError, host::Host};

/// A mesh at rest, as [`Host::mesh`] takes it. `reef_sim.h` says what each part means.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeshDesc<'a> {
    /// For messages.
    pub name: &'a str,
    /// At rest.
    pub vertices: &'a [abi::MeshVertex],
    /// Three a triangle, counter-clockwise from outside.
    pub indices: &'a [u32],
    /// The finest first; empty: one level of all triangles.
    pub levels: &'a [abi::MeshLevel],
    /// Where the joints stand at rest.
    pub rest: &'a [abi::Joint],
    /// Joints that move a vertex: 0, 1, 2, 4 or 8.
    pub influences: u32,
    /// As many a vertex.
    pub joints: &'a [u32],
    /// As many a vertex, summing to 1.
    pub weights: &'a [f32],
    /// `abi::MESH_*`.
    pub flags: u32,
}

impl Host {
    /// Makes a mesh. In `create` and in a step, not in its jobs.
    ///
    /// `Err`: what it is made of has rules, and their number a limit. Turned into the error of a create or a
    /// step, it leaves the word to the host, which says them.
    pub fn mesh(&self, desc: &MeshDesc<'_>) -> Result<Mesh, MeshError> {
        let bones = desc.vertices.len() * desc.influences as usize;
        for (what, count) in [("joints", desc.joints.len()), ("weights", desc.weights.len())] {
            if count != bones {
                let name = desc.name.to_owned();
                return Err(MeshError::Count { name, what, count, expected: bones });
            }
        }
        let whole = [abi::MeshLevel {
            index_count: desc.indices.len() as u32,
            vertex_count: desc.vertices.len() as u32,
            influences: desc.influences,
            ..Default::default()
        }];
        let levels = if desc.levels.is_empty() { &whole } else { desc.levels };
        let refused = || MeshError::Refused { name: desc.name.to_owned() };
        let create = self.raw().mesh_create.ok_or_else(refused)?;
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        // A NUL would end the name early: it is left out.
        let name = CString::new(desc.name.replace('\0', "")).unwrap_or_default();
        let mesh = abi::Mesh {
            name: name.as_ptr(),
            vertices: desc.vertices.as_ptr(),
            indices: desc.indices.as_ptr(),
            levels: levels.as_ptr(),
            rest: desc.rest.as_ptr(),
            joints: desc.joints.as_ptr(),
            weights: desc.weights.as_ptr(),
            vertex_count: count(desc.vertices.len()),
            index_count: count(desc.indices.len()),
            level_count: count(levels.len()),
            joint_count: count(desc.rest.len()),
            influences: desc.influences,
            flags: desc.flags,
            spare: [0; 2],
        };
        let mut id = 0;
        // SAFETY: the mesh's pointers lead to living slices of the lengths that it says; the host copies what
        // it keeps.
        match unsafe { create(self.raw().ctx, &mesh, &mut id) } {
            abi::OK => Ok(Mesh { host: *self, id }),
            _ => Err(refused()),
        }
    }
}

/// A mesh that the host keeps for this instance. Dropped, it is gone: nothing that is emitted from then on
/// may name it.
#[derive(Debug)]
pub struct Mesh {
    host: Host,
    id: u32,
}

impl Mesh {
    /// What elements name it by.
    pub fn id(&self) -> u32 {
        self.id
    }
}

impl Drop for Mesh {
    fn drop(&mut self) {
        if let Some(destroy) = self.host.raw().mesh_destroy {
            // SAFETY: a service with a number; like the instance that holds this value, it ends before the
            // host's table does. A refusal leaves a mesh that nothing names.
            let _ = unsafe { destroy(self.host.raw().ctx, self.id) };
        }
    }
}

#[cfg(test)]
mod tests {
    use reef_abi::pack_normal;

    /// As the header has it, backwards.
    fn unpack(packed: u32) -> [f32; 3] {
        let half = |v: u32| f32::from(v as u16 as i16) / 32767.0;
        let (a, b) = (half(packed), half(packed >> 16));
        let z = 1.0 - a.abs() - b.abs();
        let sign = |v: f32| if v < 0.0 { -1.0 } else { 1.0 };
        let (x, y) = if z < 0.0 { ((1.0 - b.abs()) * sign(a), (1.0 - a.abs()) * sign(b)) } else { (a, b) };
        let length = (x * x + y * y + z * z).sqrt();
        [x / length, y / length, z / length]
    }

    #[test]
    fn a_packed_normal_is_the_normal_within_a_hundredth_of_a_degree() {
        for i in 0..1000 {
            // Points of a spiral over the whole sphere, the poles among them.
            let z = 1.0 - 2.0 * i as f32 / 999.0;
            let (s, c) = (i as f32 * 2.4).sin_cos();
            let r = (1.0 - z * z).max(0.0).sqrt();
            let normal = [r * c, r * s, z];
            let seen = unpack(pack_normal(normal));
            let off: f32 = normal.iter().zip(seen).map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt();
            assert!(off < 1.5e-4, "{normal:?} became {seen:?}");
        }
        assert_eq!(pack_normal([0.0, 0.0, 1.0]), 0);
    }
}
