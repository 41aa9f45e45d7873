//! Reads from SPIR-V what a shader is bound to: descriptors of set 0, push constants, the size of a work
//! group. So a pipeline's layout follows from its shaders, and nobody writes it twice. And where the members
//! of its records lie, for the test that compares them with Rust's.

use std::collections::{BTreeMap, HashMap};

use ash::vk;

use super::{
    access::Access,
    record::{Layout, Member, ShaderRecord},
};

/// What one or several stages are bound to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Interface {
    /// Stages that were read.
    pub stages: vk::ShaderStageFlags,
    /// By number, in set 0.
    pub bindings: BTreeMap<u32, Binding>,
    /// Bytes of push constants.
    pub push_size: u32,
    /// Name of their block; empty without any.
    pub push_name: String,
    /// Size of a compute shader's work group.
    pub group: [u32; 3],
}

/// What a number of set 0 is bound to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Binding {
    /// Of its descriptors.
    pub kind: vk::DescriptorType,
    /// How many these are.
    pub count: u32,
    /// Stages that have it.
    pub stages: vk::ShaderStageFlags,
    /// Whether any of them may read it.
    pub reads: bool,
    /// Whether any of them may write it.
    pub writes: bool,
}

impl Binding {
    /// How a pass touches what is bound so. An error: a stage that writes and is no compute shader.
    pub fn accesses(&self) -> Result<Vec<Access>, String> {
        use vk::{DescriptorType as D, ShaderStageFlags as S};
        let sampled =
            matches!(self.kind, D::COMBINED_IMAGE_SAMPLER | D::SAMPLED_IMAGE | D::UNIFORM_TEXEL_BUFFER);
        if self.writes && self.stages != S::COMPUTE {
            return Err(format!(
                "a {:?} is written by {:?}: only compute shaders write",
                self.kind, self.stages
            ));
        }
        let of = |stage, read, sample| {
            self.stages.contains(stage).then_some(if sampled { sample } else { read }).filter(|_| self.reads)
        };
        let reads = [
            of(S::VERTEX, Access::VertexRead, Access::VertexSampled),
            of(S::FRAGMENT, Access::FragmentRead, Access::FragmentSampled),
            of(S::COMPUTE, Access::ComputeRead, Access::ComputeSampled),
        ];
        Ok(reads.into_iter().flatten().chain(self.writes.then_some(Access::ComputeWrite)).collect())
    }
}

impl Interface {
    /// What a pipeline of both is bound to.
    pub fn join(mut self, other: &Interface) -> Result<Interface, String> {
        self.stages |= other.stages;
        self.push_size = self.push_size.max(other.push_size);
        if self.push_name.is_empty() {
            self.push_name.clone_from(&other.push_name);
        } else if !other.push_name.is_empty() && self.push_name != other.push_name {
            return Err(format!(
                "push constants are {} in one stage and {} in another",
                self.push_name, other.push_name
            ));
        }
        for (number, other) in &other.bindings {
            let mine = self.bindings.entry(*number).or_insert(*other);
            if (mine.kind, mine.count) != (other.kind, other.count) {
                let [mine, other] = [*mine, *other].map(|binding| (binding.kind, binding.count));
                return Err(format!("binding {number} is {mine:?} in one stage and {other:?} in another"));
            }
            mine.stages |= other.stages;
            mine.reads |= other.reads;
            mine.writes |= other.writes;
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
    block: bool,
    buffer_block: bool,
    array_stride: u32,
    touched: Touched,
}

/// What a shader says that it does not do.
#[derive(Clone, Copy, Default)]
struct Touched {
    never_written: bool,
    never_read: bool,
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
    RuntimeArray(u32),
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
    /// (structure, member) → how it is touched.
    touched: HashMap<(u32, u32), Touched>,
    /// (structure, member) → offset and matrix stride.
    members: HashMap<(u32, u32), (u32, u32)>,
    types: HashMap<u32, Type>,
    constants: HashMap<u32, u32>,
    /// Type, identity, storage class.
    variables: Vec<(u32, u32, u32)>,
    names: HashMap<u32, String>,
    /// (structure, member) → name.
    member_names: HashMap<(u32, u32), String>,
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
            interface.push_name = module.names.get(pointee).cloned().unwrap_or_default();
            continue;
        }
        let Some(Decorations { binding: Some(binding), set, .. }) = module.decorations.get(&id) else {
            continue;
        };
        if *set != 0 {
            return Err(format!("descriptor set {set}: only set 0 is used"));
        }
        let (kind, count) = module.descriptor(*pointee, class, 0)?;
        let (reads, writes) = module.touches(id, *pointee, kind);
        let stages = interface.stages;
        interface.bindings.insert(*binding, Binding { kind, count, stages, reads, writes });
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
            (5, [target, name @ ..]) => drop(module.names.insert(*target, text(name))),
            (6, [structure, member, name @ ..]) => {
                drop(module.member_names.insert((*structure, *member), text(name)));
            }
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
                    (2, _) => entry.block = true,
                    (3, _) => entry.buffer_block = true,
                    (6, [stride, ..]) => entry.array_stride = *stride,
                    (24, _) => entry.touched.never_written = true,
                    (25, _) => entry.touched.never_read = true,
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
            (72, [structure, member, 24]) => {
                module.touched.entry((*structure, *member)).or_default().never_written = true;
            }
            (72, [structure, member, 25]) => {
                module.touched.entry((*structure, *member)).or_default().never_read = true;
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
            (29, [id, of]) => drop(module.types.insert(*id, Type::RuntimeArray(*of))),
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

/// A literal string.
fn text(words: &[u32]) -> String {
    let bytes = words.iter().flat_map(|word| word.to_le_bytes()).take_while(|byte| *byte != 0);
    String::from_utf8_lossy(&bytes.collect::<Vec<u8>>()).into_owned()
}

/// The structures of a module with names: see [`super::record::shader_records`].
pub fn records(words: &[u32]) -> Result<Vec<ShaderRecord>, String> {
    let module = parse(words)?;
    let mut all = Vec::new();
    for (id, kind) in &module.types {
        let Type::Struct(members) = kind else { continue };
        let Some(name) = module.names.get(id).filter(|name| !name.is_empty() && !name.starts_with("gl_"))
        else {
            continue;
        };
        let block = module.decorations.get(id).is_some_and(|d| d.block || d.buffer_block);
        let holds = |of: &u32| matches!(module.types.get(of), Some(Type::Struct(_) | Type::RuntimeArray(_)));
        if block && matches!(&members[..], [one] if holds(one)) {
            continue;
        }
        let laid_out = !members.is_empty() && module.members.contains_key(&(*id, 0));
        let mut at = 0;
        let mut found = Vec::new();
        for (number, of) in (0..).zip(members) {
            let size = module.member_size(*id, number, *of, 0)? as usize;
            let offset = if laid_out {
                module.members.get(&(*id, number)).map_or(0, |(offset, _)| *offset as usize)
            } else {
                at
            };
            at = offset + size;
            let name = module.member_names.get(&(*id, number)).cloned().unwrap_or_default();
            found.push(Member { name, offset, size });
        }
        let strides = module.types.iter().filter_map(|(array, kind)| match kind {
            Type::Array(of, _) | Type::RuntimeArray(of) if of == id => {
                module.decorations.get(array).map(|d| d.array_stride as usize)
            }
            _ => None,
        });
        all.push(ShaderRecord {
            shader: String::new(),
            layout: Layout { name: name.clone(), size: at, members: found },
            laid_out,
            strides: strides.filter(|stride| *stride > 0).collect(),
        });
    }
    Ok(all)
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

    /// Whether the shader may read a variable, and whether it may write it: what it does not deny.
    fn touches(&self, variable: u32, pointee: u32, kind: vk::DescriptorType) -> (bool, bool) {
        use vk::DescriptorType as D;
        if !matches!(kind, D::STORAGE_BUFFER | D::STORAGE_IMAGE | D::STORAGE_TEXEL_BUFFER) {
            return (true, false);
        }
        let mut touched = self.decorations.get(&variable).map_or_else(Touched::default, |d| d.touched);
        if let Some(Type::Struct(members)) = self.types.get(&pointee) {
            let all = |denied: fn(&Touched) -> bool| {
                (0..).zip(members).all(|(member, _)| self.touched.get(&(pointee, member)).is_some_and(denied))
            };
            touched.never_written |= all(|t| t.never_written);
            touched.never_read |= all(|t| t.never_read);
        }
        (!touched.never_read, !touched.never_written)
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
                for (member, of) in (0..).zip(members) {
                    let size = self.member_size(id, member, *of, depth)?;
                    // What lies in no buffer is packed.
                    let offset = self.members.get(&(id, member)).map_or(end, |(offset, _)| *offset);
                    end = end.max(offset.saturating_add(size));
                }
                Ok(end)
            }
            _ => Err("a record has a member of a type without a size".to_owned()),
        }
    }

    /// Of a structure's member, in bytes.
    fn member_size(&self, structure: u32, member: u32, of: u32, depth: u32) -> Result<u32, String> {
        let matrix = self.members.get(&(structure, member)).map_or(0, |(_, matrix)| *matrix);
        match self.types.get(&of) {
            Some(Type::Matrix(_, columns)) if matrix > 0 => Ok(matrix.saturating_mul(*columns)),
            _ => self.size(of, depth + 1),
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
        let storage = |reads, writes| Binding {
            kind: vk::DescriptorType::STORAGE_BUFFER,
            count: 1,
            stages: vk::ShaderStageFlags::COMPUTE,
            reads,
            writes,
        };
        assert_eq!(
            interface.bindings,
            BTreeMap::from([(0, storage(true, false)), (1, storage(false, true))])
        );
    }

    #[test]
    fn a_fragment_shaders_texture_is_read_and_joined_with_the_vertex_stage() {
        let joined = of("selftest_picture.vert").join(&of("selftest_sample.frag")).expect("no conflict");
        assert_eq!(joined.stages, vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT);
        let picture = joined.bindings[&0];
        assert_eq!((picture.kind, picture.count), (vk::DescriptorType::COMBINED_IMAGE_SAMPLER, 1));
        assert_eq!(picture.accesses(), Ok(vec![Access::FragmentSampled]));
    }

    #[test]
    fn buffers_of_texels_are_told_from_textures_and_storage_images() {
        let bindings = of("mesh_skin.comp").bindings;
        let kind = |binding: u32| bindings.get(&binding).map(|binding| binding.kind);
        assert_eq!(kind(6), Some(vk::DescriptorType::UNIFORM_TEXEL_BUFFER));
        assert_eq!(kind(12), Some(vk::DescriptorType::STORAGE_TEXEL_BUFFER));
        assert_eq!(kind(10), Some(vk::DescriptorType::STORAGE_BUFFER));
    }

    #[test]
    fn how_a_pass_touches_what_it_binds_follows_from_its_shaders() {
        let touched = |shader: &str, binding: u32| of(shader).bindings[&binding].accesses().expect("compute");
        let both = [Access::ComputeRead, Access::ComputeWrite];
        assert_eq!(touched("fibre_scan.comp", 0), both);
        assert_eq!(touched("fibre_scan.comp", 1), [Access::ComputeWrite]);
        assert_eq!(touched("fibre_skin.comp", 2), [Access::ComputeRead]);
        assert_eq!(touched("mesh_lit.comp", 2), [Access::ComputeSampled]);
        assert_eq!(touched("mesh_lit.comp", 5), both);
        assert_eq!(touched("mesh_skin.comp", 12), [Access::ComputeWrite]);
        assert_eq!(touched("terrain.vert", 1), [Access::VertexRead]);
        let view = of("terrain.vert").join(&of("terrain.frag")).expect("no conflict").bindings[&0];
        assert_eq!(view.accesses(), Ok(vec![Access::VertexRead, Access::FragmentRead]));
        let draws = Binding { stages: vk::ShaderStageFlags::FRAGMENT, writes: true, ..view };
        assert!(draws.accesses().is_err(), "a fragment shader that writes");
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
