//! Reads from SPIR-V what a shader is bound to: descriptors of set 0, push constants, the size of a work
//! group. So a pipeline's layout follows from its shaders, and nobody writes it twice.

use std::collections::{BTreeMap, HashMap};

use ash::vk;

/// What one or several stages are bound to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Interface {
    /// Stages that were read.
    pub stages: vk::ShaderStageFlags,
    /// Binding of set 0 → kind and number of descriptors.
    pub bindings: BTreeMap<u32, (vk::DescriptorType, u32)>,
    /// Bytes of push constants.
    pub push_size: u32,
    /// Size of a compute shader's work group.
    pub group: [u32; 3],
}

impl Interface {
    /// What a pipeline of both is bound to.
    pub fn join(mut self, other: &Interface) -> Result<Interface, String> {
        self.stages |= other.stages;
        self.push_size = self.push_size.max(other.push_size);
        for (binding, kind) in &other.bindings {
            if let Some(mine) = self.bindings.insert(*binding, *kind)
                && mine != *kind
            {
                return Err(format!("binding {binding} is {mine:?} in one stage and {kind:?} in another"));
            }
        }
        Ok(self)
    }
}

/// Types deeper than this are damaged, or contain themselves.
const MOST_NESTING: u32 = 6;

const MAGIC: u32 = 0x0723_0203;
/// SPIR-V's number of an image that is a buffer.
const BUFFER: u32 = 5;

/// Words of a SPIR-V file of either byte order's right one.
pub fn words(bytes: &[u8]) -> Result<Vec<u32>, String> {
    if bytes.len() < 20 || !bytes.len().is_multiple_of(4) {
        return Err(format!("{} bytes are no SPIR-V module", bytes.len()));
    }
    let words: Vec<u32> =
        bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect();
    if words[0] != MAGIC {
        return Err("it does not begin as SPIR-V does".to_owned());
    }
    Ok(words)
}

#[derive(Default)]
struct Decorations {
    set: u32,
    binding: Option<u32>,
    buffer_block: bool,
    array_stride: u32,
}

enum Type {
    Scalar(u32),
    Vector(u32, u32),
    Matrix(u32, u32),
    SampledImage,
    /// Whether it is a storage image, and whether it is a buffer's texels.
    Image(bool, bool),
    Sampler,
    Array(u32, u32),
    RuntimeArray,
    Struct(Vec<u32>),
    Pointer(u32),
}

#[derive(Default)]
struct Module {
    stages: vk::ShaderStageFlags,
    group: [u32; 3],
    /// The same as constants' identities, which are declared later.
    group_ids: Option<[u32; 3]>,
    decorations: HashMap<u32, Decorations>,
    /// (structure, member) → offset and matrix stride.
    members: HashMap<(u32, u32), (u32, u32)>,
    types: HashMap<u32, Type>,
    constants: HashMap<u32, u32>,
    /// Type, identity, storage class.
    variables: Vec<(u32, u32, u32)>,
}

/// Reads the interface of a module.
pub fn reflect(words: &[u32]) -> Result<Interface, String> {
    let module = parse(words)?;
    if module.stages.is_empty() {
        return Err("it has no entry point of a stage that Reef uses".to_owned());
    }
    let mut interface = Interface { stages: module.stages, group: module.group, ..Interface::default() };
    for &(pointer, id, class) in &module.variables {
        let Some(Type::Pointer(pointee)) = module.types.get(&pointer) else { continue };
        if class == 9 {
            interface.push_size = interface.push_size.max(module.size(*pointee, 0)?);
            continue;
        }
        let Some(Decorations { binding: Some(binding), set, .. }) = module.decorations.get(&id) else {
            continue;
        };
        if *set != 0 {
            return Err(format!("descriptor set {set}: only set 0 is used"));
        }
        let (kind, count) = module.descriptor(*pointee, class, 0)?;
        interface.bindings.insert(*binding, (kind, count));
    }
    Ok(interface)
}

fn parse(words: &[u32]) -> Result<Module, String> {
    let mut module = Module::default();
    let mut at = 5;
    while at < words.len() {
        let (length, opcode) = ((words[at] >> 16) as usize, words[at] & 0xffff);
        if length == 0 || at + length > words.len() {
            return Err("a SPIR-V instruction reaches beyond the end".to_owned());
        }
        let w = &words[at + 1..at + length];
        at += length;
        match (opcode, w) {
            (15, [model, ..]) => {
                module.stages |= match model {
                    0 => vk::ShaderStageFlags::VERTEX,
                    4 => vk::ShaderStageFlags::FRAGMENT,
                    5 => vk::ShaderStageFlags::COMPUTE,
                    _ => vk::ShaderStageFlags::empty(),
                };
            }
            (16, [_, 17, x, y, z]) => module.group = [*x, *y, *z],
            (331, [_, 38, x, y, z]) => module.group_ids = Some([*x, *y, *z]),
            (71, [target, decoration, rest @ ..]) => {
                let entry = module.decorations.entry(*target).or_default();
                match (decoration, rest) {
                    (3, _) => entry.buffer_block = true,
                    (6, [stride, ..]) => entry.array_stride = *stride,
                    (33, [binding, ..]) => entry.binding = Some(*binding),
                    (34, [set, ..]) => entry.set = *set,
                    _ => {}
                }
            }
            (72, [structure, member, 35, offset, ..]) => {
                module.members.entry((*structure, *member)).or_default().0 = *offset;
            }
            (72, [structure, member, 7, stride, ..]) => {
                module.members.entry((*structure, *member)).or_default().1 = *stride;
            }
            (20, [id]) => drop(module.types.insert(*id, Type::Scalar(4))),
            (21 | 22, [id, bits, ..]) => drop(module.types.insert(*id, Type::Scalar(bits / 8))),
            (23, [id, of, count]) => drop(module.types.insert(*id, Type::Vector(*of, *count))),
            (24, [id, of, count]) => drop(module.types.insert(*id, Type::Matrix(*of, *count))),
            (25, [id, _, dimensions, _, _, _, sampled, ..]) => {
                module.types.insert(*id, Type::Image(*sampled == 2, *dimensions == BUFFER));
            }
            (26, [id]) => drop(module.types.insert(*id, Type::Sampler)),
            (27, [id, _]) => drop(module.types.insert(*id, Type::SampledImage)),
            (28, [id, of, length]) => drop(module.types.insert(*id, Type::Array(*of, *length))),
            (29, [id, _]) => drop(module.types.insert(*id, Type::RuntimeArray)),
            (30, [id, members @ ..]) => drop(module.types.insert(*id, Type::Struct(members.to_vec()))),
            (32, [id, _, of]) => drop(module.types.insert(*id, Type::Pointer(*of))),
            (43 | 50, [_, id, value, ..]) => drop(module.constants.insert(*id, *value)),
            (59, [pointer, id, class, ..]) => module.variables.push((*pointer, *id, *class)),
            // The interface is all declared before the first function.
            (54, _) => break,
            _ => {}
        }
    }
    if let Some(ids) = module.group_ids {
        module.group = ids.map(|id| module.constants.get(&id).copied().unwrap_or(1));
    }
    Ok(module)
}

impl Module {
    fn descriptor(&self, id: u32, class: u32, depth: u32) -> Result<(vk::DescriptorType, u32), String> {
        use vk::DescriptorType as D;
        let block = |id: u32| self.decorations.get(&id).is_some_and(|d| d.buffer_block);
        match self.types.get(&id) {
            Some(Type::Array(of, length)) if depth < MOST_NESTING => {
                let length = self.constants.get(length).copied().unwrap_or(1);
                let (kind, inner) = self.descriptor(*of, class, depth + 1)?;
                Ok((kind, length.saturating_mul(inner)))
            }
            Some(Type::Struct(_)) if class == 12 || block(id) => Ok((D::STORAGE_BUFFER, 1)),
            Some(Type::Struct(_)) => Ok((D::UNIFORM_BUFFER, 1)),
            Some(Type::SampledImage) => Ok((D::COMBINED_IMAGE_SAMPLER, 1)),
            Some(Type::Image(true, true)) => Ok((D::STORAGE_TEXEL_BUFFER, 1)),
            Some(Type::Image(false, true)) => Ok((D::UNIFORM_TEXEL_BUFFER, 1)),
            Some(Type::Image(true, false)) => Ok((D::STORAGE_IMAGE, 1)),
            Some(Type::Image(false, false)) => Ok((D::SAMPLED_IMAGE, 1)),
            Some(Type::Sampler) => Ok((D::SAMPLER, 1)),
            _ => Err("a descriptor of a kind that Reef does not use".to_owned()),
        }
    }

    /// In bytes, without padding at the end.
    fn size(&self, id: u32, depth: u32) -> Result<u32, String> {
        if depth > MOST_NESTING {
            return Err("types nested too deeply".to_owned());
        }
        let deeper = depth + 1;
        let stride = self.decorations.get(&id).map_or(0, |d| d.array_stride);
        match self.types.get(&id) {
            Some(Type::Scalar(bytes)) => Ok(*bytes),
            Some(Type::Vector(of, count) | Type::Matrix(of, count)) => {
                Ok(self.size(*of, deeper)?.saturating_mul(*count))
            }
            Some(Type::Array(of, length)) => {
                let stride = if stride == 0 { self.size(*of, deeper)? } else { stride };
                Ok(stride.saturating_mul(self.constants.get(length).copied().unwrap_or(1)))
            }
            Some(Type::Struct(members)) => {
                let mut end = 0;
                for (member, of) in members.iter().enumerate() {
                    let (offset, matrix) =
                        self.members.get(&(id, member as u32)).copied().unwrap_or_default();
                    let size = match self.types.get(of) {
                        Some(Type::Matrix(_, columns)) if matrix > 0 => matrix.saturating_mul(*columns),
                        _ => self.size(*of, deeper)?,
                    };
                    end = end.max(offset.saturating_add(size));
                }
                Ok(end)
            }
            _ => Err("push constants of a type without a size".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embedded;
    use proptest::prelude::*;

    fn of(name: &str) -> Interface {
        let (_, bytes) = embedded::SHADERS.iter().find(|(n, _)| *n == name).expect("an embedded shader");
        reflect(&words(bytes).expect("SPIR-V")).expect("an interface")
    }

    #[test]
    fn a_compute_shaders_buffers_push_constants_and_group_are_read() {
        let interface = of("selftest_scale.comp");
        assert_eq!(interface.stages, vk::ShaderStageFlags::COMPUTE);
        assert_eq!(interface.group, [64, 1, 1]);
        assert_eq!(interface.push_size, 12);
        let storage = (vk::DescriptorType::STORAGE_BUFFER, 1);
        assert_eq!(interface.bindings, BTreeMap::from([(0, storage), (1, storage)]));
    }

    #[test]
    fn a_fragment_shaders_texture_is_read_and_joined_with_the_vertex_stage() {
        let joined = of("selftest_picture.vert").join(&of("selftest_sample.frag")).expect("no conflict");
        assert_eq!(joined.stages, vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT);
        assert_eq!(joined.bindings.get(&0), Some(&(vk::DescriptorType::COMBINED_IMAGE_SAMPLER, 1)));
    }

    #[test]
    fn buffers_of_texels_are_told_from_textures_and_storage_images() {
        let bindings = of("mesh_skin.comp").bindings;
        let kind = |binding: u32| bindings.get(&binding).map(|(kind, _)| *kind);
        assert_eq!(kind(6), Some(vk::DescriptorType::UNIFORM_TEXEL_BUFFER));
        assert_eq!(kind(12), Some(vk::DescriptorType::STORAGE_TEXEL_BUFFER));
        assert_eq!(kind(10), Some(vk::DescriptorType::STORAGE_BUFFER));
    }

    #[test]
    fn stages_that_disagree_about_a_binding_are_refused() {
        let a = of("selftest_scale.comp");
        assert!(a.clone().join(&of("selftest_sample.frag")).is_err());
        assert!(a.clone().join(&a).is_ok());
    }

    #[test]
    fn what_is_no_spirv_is_refused() {
        assert!(words(b"").is_err());
        assert!(words(&[0; 24]).is_err());
        assert!(words(&[1; 23]).is_err());
    }

    proptest! {
        #[test]
        fn damaged_spirv_is_refused_or_read_but_never_crashes(at in 5usize..200, value: u32) {
            let (_, bytes) = embedded::SHADERS[0];
            let mut damaged = words(bytes).expect("SPIR-V");
            let at = at % damaged.len();
            damaged[at] = value;
            let _ = reflect(&damaged);
        }
    }
}
