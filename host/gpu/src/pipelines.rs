//! Pipelines: described once, made when they are first bound, re-made when one of their shaders changes.

use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;

use super::{
    context::{Gpu, Shared},
    error::{Call, GpuError, Result},
    garbage::Garbage,
    reflect::Interface,
    shaders::Shader,
};

/// How a colour goes into its attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// It replaces what was there.
    Replace,
    /// Straight alpha: `src·α + dst·(1 − α)`.
    Alpha,
    /// Premultiplied alpha: `src + dst·(1 − α)`.
    Premultiplied,
    /// `src + dst`.
    Add,
}

/// Test against the depth attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthDesc {
    /// Format of the attachment.
    pub format: vk::Format,
    /// When a fragment passes. Reef's depth is reversed (1 near, 0 far): GREATER.
    pub compare: vk::CompareOp,
    /// Whether a fragment that passes writes its depth.
    pub write: bool,
}

/// A buffer of vertex attributes.
#[derive(Clone, Copy, Debug)]
pub struct VertexDesc<'a> {
    /// Bytes from one element to the next.
    pub stride: u32,
    /// One element an instance instead of one a vertex.
    pub per_instance: bool,
    /// Location, format, offset.
    pub attributes: &'a [(u32, vk::Format, u32)],
}

/// What a graphics pipeline is to be. Descriptors and push constants follow from the shaders.
#[derive(Clone, Copy, Debug)]
pub struct GraphicsDesc<'a> {
    /// For messages and debuggers.
    pub name: &'a str,
    /// File name of the vertex shader.
    pub vertex: &'a str,
    /// File name of the fragment shader; None: only depth is written.
    pub fragment: Option<&'a str>,
    /// What vertices are joined to.
    pub topology: vk::PrimitiveTopology,
    /// Which faces are left out; counter-clockwise ones (in the picture) are in front.
    pub cull: vk::CullModeFlags,
    /// Only the edges, where the device can.
    pub wireframe: bool,
    /// Buffers of vertex attributes; none where the shader fetches for itself.
    pub vertices: &'a [VertexDesc<'a>],
    /// Colour attachments.
    pub color: &'a [(vk::Format, Blend)],
    /// The depth attachment.
    pub depth: Option<DepthDesc>,
    /// Samples a pixel.
    pub samples: vk::SampleCountFlags,
    /// Specialisation constants by number, as the 32 bits of a u32, i32 or f32; all stages get them.
    pub constants: &'a [(u32, u32)],
}

impl<'a> GraphicsDesc<'a> {
    /// Triangles without attributes, depth, culling or blending.
    pub fn new(name: &'a str, vertex: &'a str, fragment: &'a str) -> Self {
        Self {
            name,
            vertex,
            fragment: Some(fragment),
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            cull: vk::CullModeFlags::NONE,
            wireframe: false,
            vertices: &[],
            color: &[],
            depth: None,
            samples: vk::SampleCountFlags::TYPE_1,
            constants: &[],
        }
    }
}

enum Kind {
    Compute {
        shader: String,
    },
    Graphics {
        vertex: String,
        fragment: Option<String>,
        topology: vk::PrimitiveTopology,
        cull: vk::CullModeFlags,
        wireframe: bool,
        bindings: Vec<vk::VertexInputBindingDescription>,
        attributes: Vec<vk::VertexInputAttributeDescription>,
        color: Vec<(vk::Format, Blend)>,
        depth: Option<DepthDesc>,
        samples: vk::SampleCountFlags,
    },
}

/// A pipeline as it is bound.
#[derive(Clone)]
pub(crate) struct Built {
    pub(crate) pipeline: vk::Pipeline,
    pub(crate) layout: vk::PipelineLayout,
    pub(crate) interface: Arc<Interface>,
    pub(crate) bind_point: vk::PipelineBindPoint,
    sets: vk::DescriptorSetLayout,
}

#[derive(Default)]
struct Slot {
    built: Option<Built>,
    /// Generations of the shaders that it was built from, in their order.
    generations: Vec<u64>,
    epoch: u64,
}

/// A graphics or compute pipeline.
pub struct Pipeline {
    name: String,
    kind: Kind,
    constants: Vec<(u32, u32)>,
    slot: Mutex<Slot>,
    id: u64,
    shared: Arc<Shared>,
}

impl Pipeline {
    /// A compute pipeline of one shader. Nothing is compiled yet.
    pub fn compute(gpu: &Gpu, shader: &str, constants: &[(u32, u32)]) -> Pipeline {
        Self::new(gpu, shader, Kind::Compute { shader: shader.to_owned() }, constants)
    }

    /// A graphics pipeline. Nothing is compiled yet.
    pub fn graphics(gpu: &Gpu, desc: &GraphicsDesc<'_>) -> Pipeline {
        let mut bindings = Vec::new();
        let mut attributes = Vec::new();
        for (binding, vertices) in desc.vertices.iter().enumerate() {
            let binding = binding as u32;
            bindings.push(vk::VertexInputBindingDescription {
                binding,
                stride: vertices.stride,
                input_rate: if vertices.per_instance {
                    vk::VertexInputRate::INSTANCE
                } else {
                    vk::VertexInputRate::VERTEX
                },
            });
            attributes.extend(vertices.attributes.iter().map(|&(location, format, offset)| {
                vk::VertexInputAttributeDescription { location, binding, format, offset }
            }));
        }
        let kind = Kind::Graphics {
            vertex: desc.vertex.to_owned(),
            fragment: desc.fragment.map(str::to_owned),
            topology: desc.topology,
            cull: desc.cull,
            wireframe: desc.wireframe && gpu.info().optional.wireframe,
            bindings,
            attributes,
            color: desc.color.to_vec(),
            depth: desc.depth,
            samples: desc.samples,
        };
        Self::new(gpu, desc.name, kind, desc.constants)
    }

    fn new(gpu: &Gpu, name: &str, kind: Kind, constants: &[(u32, u32)]) -> Pipeline {
        Pipeline {
            name: name.to_owned(),
            kind,
            constants: constants.to_vec(),
            slot: Mutex::new(Slot::default()),
            id: gpu.shared.register("pipeline", name),
            shared: gpu.shared.clone(),
        }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// A number that no other resource of the context has.
    pub(crate) fn id(&self) -> u64 {
        self.id
    }

    /// Compiles it now, if it is not yet: so that the first frame does not have to.
    pub fn prepare(&self) -> Result<()> {
        self.get().map(drop)
    }

    /// The pipeline for the shaders as they are now. Where new shaders cannot be used, the pipeline before
    /// stays, and the failure is noted in the [`super::ShaderStore`].
    pub(crate) fn get(&self) -> Result<Built> {
        let shared = &self.shared;
        let epoch = shared.shaders.epoch();
        let mut slot = self.slot.lock().unwrap_or_else(PoisonError::into_inner);
        if let (Some(built), true) = (&slot.built, slot.epoch == epoch) {
            return Ok(built.clone());
        }
        let shaders: Vec<(&str, Shader)> =
            self.shader_names().map(|name| Ok((name, shared.shaders.get(name)?))).collect::<Result<_>>()?;
        let generations: Vec<u64> = shaders.iter().map(|(_, shader)| shader.generation).collect();
        slot.epoch = epoch;
        if let Some(built) = &slot.built
            && slot.generations == generations
        {
            return Ok(built.clone());
        }
        let floor = slot.built.as_ref().map(|built| built.interface.clone());
        match (self.build(&shaders, floor.as_deref()), slot.built.take()) {
            (Ok(new), old) => {
                if let Some(old) = old {
                    shared.discard(Garbage::Pipeline(old.pipeline, old.layout, old.sets));
                }
                slot.built = Some(new.clone());
                slot.generations = generations;
                Ok(new)
            }
            (Err(error), Some(old)) => {
                for (name, _) in &shaders {
                    shared.shaders.fail(name, error.to_string());
                }
                slot.built = Some(old.clone());
                Ok(old)
            }
            (Err(error), None) => Err(error),
        }
    }

    fn shader_names(&self) -> impl Iterator<Item = &str> {
        let (first, second) = match &self.kind {
            Kind::Compute { shader } => (shader, None),
            Kind::Graphics { vertex, fragment, .. } => (vertex, fragment.as_ref()),
        };
        std::iter::once(first).chain(second).map(String::as_str)
    }

    /// `before`: the interface that the program binds. New shaders may use less of it, never more.
    fn build(&self, shaders: &[(&str, Shader)], before: Option<&Interface>) -> Result<Built> {
        let device = &self.shared.device;
        let refuse = |reason| GpuError::Shader { name: self.name.clone(), reason };
        let mut interface = Interface::default();
        for (name, shader) in shaders {
            let wanted = match &self.kind {
                Kind::Compute { .. } => vk::ShaderStageFlags::COMPUTE,
                Kind::Graphics { vertex, .. } if vertex == name => vk::ShaderStageFlags::VERTEX,
                Kind::Graphics { .. } => vk::ShaderStageFlags::FRAGMENT,
            };
            if shader.interface.stages != wanted {
                return Err(refuse(format!("{name} is no {wanted:?} shader")));
            }
            interface = interface.join(&shader.interface).map_err(refuse)?;
        }
        if matches!(self.kind, Kind::Compute { .. }) {
            interface.group = shaders[0].1.interface.group;
        }
        if let Some(before) = before {
            interface = interface.join(before).map_err(refuse)?;
            // Kinds and counts are the same, or they could not be joined.
            if interface.bindings.len() != before.bindings.len() || interface.push_size != before.push_size {
                return Err(refuse(
                    "it binds more than before: the program has to be built anew for that".to_owned(),
                ));
            }
        }
        let limit = self.shared.info.limits.max_push_constants_size;
        if interface.push_size > limit {
            return Err(refuse(format!(
                "{} bytes of push constants: the device has {limit}",
                interface.push_size
            )));
        }

        let bindings: Vec<_> = interface
            .bindings
            .iter()
            .map(|(&number, binding)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(number)
                    .descriptor_type(binding.kind)
                    .descriptor_count(binding.count)
                    .stage_flags(interface.stages)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default()
            .flags(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR)
            .bindings(&bindings);
        // SAFETY: the device lives; so in all calls below, which destroy what they made when one of them
        // fails.
        let sets = unsafe { device.create_descriptor_set_layout(&info, None) }
            .call("vkCreateDescriptorSetLayout")?;
        let set_layouts = [sets];
        let push =
            [vk::PushConstantRange { stage_flags: interface.stages, offset: 0, size: interface.push_size }];
        let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
        if interface.push_size > 0 {
            info = info.push_constant_ranges(&push);
        }
        // SAFETY: as above.
        let layout = unsafe { device.create_pipeline_layout(&info, None) }.call("vkCreatePipelineLayout");
        let layout = layout.inspect_err(|_| {
            // SAFETY: as above.
            unsafe { device.destroy_descriptor_set_layout(sets, None) }
        })?;

        let mut modules = Vec::new();
        let pipeline = self.make(shaders, layout, &mut modules);
        for module in modules {
            // SAFETY: a module is needed only while pipelines are made from it.
            unsafe { device.destroy_shader_module(module, None) };
        }
        let pipeline = pipeline.inspect_err(|_| {
            // SAFETY: as above.
            unsafe {
                device.destroy_pipeline_layout(layout, None);
                device.destroy_descriptor_set_layout(sets, None);
            }
        })?;
        self.shared.name(pipeline, &self.name);
        self.shared.name(layout, &self.name);
        let bind_point = match self.kind {
            Kind::Compute { .. } => vk::PipelineBindPoint::COMPUTE,
            Kind::Graphics { .. } => vk::PipelineBindPoint::GRAPHICS,
        };
        Ok(Built { pipeline, layout, interface: Arc::new(interface), bind_point, sets })
    }

    fn make(
        &self,
        shaders: &[(&str, Shader)],
        layout: vk::PipelineLayout,
        modules: &mut Vec<vk::ShaderModule>,
    ) -> Result<vk::Pipeline> {
        let shared = &self.shared;
        for (name, shader) in shaders {
            let info = vk::ShaderModuleCreateInfo::default().code(&shader.code);
            // SAFETY: the code is SPIR-V that our compiler made and whose structure was read.
            let module =
                unsafe { shared.device.create_shader_module(&info, None) }.call("vkCreateShaderModule")?;
            shared.name(module, name);
            modules.push(module);
        }
        let values: Vec<u8> = self.constants.iter().flat_map(|(_, value)| value.to_ne_bytes()).collect();
        let entries: Vec<_> = self
            .constants
            .iter()
            .enumerate()
            .map(|(i, &(constant_id, _))| vk::SpecializationMapEntry {
                constant_id,
                offset: i as u32 * 4,
                size: 4,
            })
            .collect();
        let constants = vk::SpecializationInfo::default().map_entries(&entries).data(&values);
        let stages: Vec<_> = shaders
            .iter()
            .zip(modules.iter())
            .map(|((_, shader), &module)| {
                vk::PipelineShaderStageCreateInfo::default()
                    .stage(shader.interface.stages)
                    .module(module)
                    .name(c"main")
                    .specialization_info(&constants)
            })
            .collect();
        let cache = shared.pipeline_cache.raw;
        let made = match &self.kind {
            Kind::Compute { .. } => {
                let info = vk::ComputePipelineCreateInfo::default().stage(stages[0]).layout(layout);
                // SAFETY: everything that `info` points to lives until the call returns.
                unsafe { shared.device.create_compute_pipelines(cache, &[info], None) }
            }
            Kind::Graphics {
                topology, cull, wireframe, bindings, attributes, color, depth, samples, ..
            } => {
                let input = vk::PipelineVertexInputStateCreateInfo::default()
                    .vertex_binding_descriptions(bindings)
                    .vertex_attribute_descriptions(attributes);
                let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(*topology);
                let viewport =
                    vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
                let fill = if *wireframe { vk::PolygonMode::LINE } else { vk::PolygonMode::FILL };
                let raster = vk::PipelineRasterizationStateCreateInfo::default()
                    .polygon_mode(fill)
                    .cull_mode(*cull)
                    .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
                    .line_width(1.0);
                let multisample =
                    vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(*samples);
                let depth_state =
                    depth.map_or_else(vk::PipelineDepthStencilStateCreateInfo::default, |depth| {
                        vk::PipelineDepthStencilStateCreateInfo::default()
                            .depth_test_enable(true)
                            .depth_write_enable(depth.write)
                            .depth_compare_op(depth.compare)
                    });
                let blends: Vec<_> = color.iter().map(|(_, blend)| blend_state(*blend)).collect();
                let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
                let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
                let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
                let formats: Vec<_> = color.iter().map(|(format, _)| *format).collect();
                let mut rendering = vk::PipelineRenderingCreateInfo::default()
                    .color_attachment_formats(&formats)
                    .depth_attachment_format(depth.map_or(vk::Format::UNDEFINED, |depth| depth.format));
                let info = vk::GraphicsPipelineCreateInfo::default()
                    .stages(&stages)
                    .vertex_input_state(&input)
                    .input_assembly_state(&assembly)
                    .viewport_state(&viewport)
                    .rasterization_state(&raster)
                    .multisample_state(&multisample)
                    .depth_stencil_state(&depth_state)
                    .color_blend_state(&blend)
                    .dynamic_state(&dynamic)
                    .layout(layout)
                    .push_next(&mut rendering);
                // SAFETY: everything that `info` points to lives until the call returns.
                unsafe { shared.device.create_graphics_pipelines(cache, &[info], None) }
            }
        };
        match made {
            Ok(pipelines) => Ok(pipelines[0]),
            Err((_, result)) => Err(GpuError::Shader {
                name: self.name.clone(),
                reason: format!("the driver makes no pipeline of it: {result}"),
            }),
        }
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        let lives = self.shared.unregister(self.id);
        let slot = self.slot.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let (true, Some(built)) = (lives, slot.built.take()) {
            self.shared.discard(Garbage::Pipeline(built.pipeline, built.layout, built.sets));
        }
    }
}

fn blend_state(blend: Blend) -> vk::PipelineColorBlendAttachmentState {
    use vk::BlendFactor as F;
    let (enable, src, dst, src_alpha) = match blend {
        Blend::Replace => (false, F::ONE, F::ZERO, F::ONE),
        Blend::Alpha => (true, F::SRC_ALPHA, F::ONE_MINUS_SRC_ALPHA, F::ONE),
        Blend::Premultiplied => (true, F::ONE, F::ONE_MINUS_SRC_ALPHA, F::ONE),
        Blend::Add => (true, F::ONE, F::ONE, F::ONE),
    };
    vk::PipelineColorBlendAttachmentState::default()
        .blend_enable(enable)
        .src_color_blend_factor(src)
        .dst_color_blend_factor(dst)
        .color_blend_op(vk::BlendOp::ADD)
        .src_alpha_blend_factor(src_alpha)
        .dst_alpha_blend_factor(dst)
        .alpha_blend_op(vk::BlendOp::ADD)
        .color_write_mask(vk::ColorComponentFlags::RGBA)
}
