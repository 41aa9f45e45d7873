//! What a pass may record: pipelines, descriptors, draws, dispatches, copies.

use ash::vk;

use super::{
    access::Access,
    buffer::Buffer,
    context::Shared,
    data::{Data, Resource, is_buffer, is_texels},
    error::{GpuError, Result},
    frames::Frame,
    image::Image,
    pipelines::{Built, Pipeline},
    record::Record,
    reflect::Binding,
    ring::Upload,
};

/// Records the commands of one pass.
pub struct Cmd<'p, 'f> {
    frame: &'p mut Frame<'f>,
    pass: &'p str,
    declared: &'p [(u64, Access)],
    sets: &'p [Bound<'p>],
    bound: Option<Built>,
}

/// A pipeline with what a pass binds to it.
pub(crate) struct Bound<'r> {
    /// Its identity.
    pub(crate) pipeline: u64,
    /// As it was when the pass was declared.
    pub(crate) built: Built,
    /// By binding number in set 0.
    pub(crate) resources: Vec<(u32, Resource<'r>)>,
}

impl<'p, 'f> Cmd<'p, 'f> {
    pub(crate) fn new(
        frame: &'p mut Frame<'f>,
        pass: &'p str,
        declared: &'p [(u64, Access)],
        sets: &'p [Bound<'p>],
    ) -> Self {
        Self { frame, pass, declared, sets, bound: None }
    }

    /// The command buffer, for what this module does not wrap.
    pub fn raw(&self) -> vk::CommandBuffer {
        self.frame.commands
    }

    /// The frame that the pass belongs to.
    pub fn frame(&mut self) -> &mut Frame<'f> {
        self.frame
    }

    /// Copies data to where the device can read it during this frame.
    pub fn upload<T: bytemuck::NoUninit>(&mut self, data: &[T]) -> Result<Upload> {
        self.frame.upload(data)
    }

    /// Binds a pipeline, with all that the pass declared for it; the first time (or after its shaders
    /// changed) it is made. One whose shaders bind nothing need not be declared.
    pub fn pipeline(&mut self, pipeline: &Pipeline) -> Result<()> {
        let declared = self.sets.iter().find(|bound| bound.pipeline == pipeline.id());
        let built = match declared {
            Some(bound) => bound.built.clone(),
            None => pipeline.get()?,
        };
        if declared.is_none() && !built.interface.bindings.is_empty() {
            return Err(
                self.refuse(format!("it uses `{}` without declaring what that binds", pipeline.name()))
            );
        }
        // SAFETY: the command buffer is being recorded, here and in all functions below; the pipeline
        // outlives the frame because dropping it is deferred.
        unsafe { self.device().cmd_bind_pipeline(self.raw(), built.bind_point, built.pipeline) };
        if let Some(bound) = declared {
            self.bind(&built, &bound.resources)?;
        }
        self.bound = Some(built);
        Ok(())
    }

    /// Binds what the shaders of a pipeline have, by binding number in set 0.
    fn bind(&self, built: &Built, resources: &[(u32, Resource<'_>)]) -> Result<()> {
        let mut buffers = Vec::with_capacity(resources.len());
        let mut images = Vec::with_capacity(resources.len());
        let mut texels = Vec::new();
        let mut kinds = Vec::with_capacity(resources.len());
        for (binding, resource) in resources {
            // What the shaders do not use is let pass: one that is being edited may use less than usual.
            let Some(&Binding { kind, .. }) = built.interface.bindings.get(binding) else { continue };
            let fits = match resource {
                Resource::Buffer(_) => is_buffer(kind) || is_texels(kind),
                Resource::Texture(..) => kind == vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
                Resource::Storage(_) => kind == vk::DescriptorType::STORAGE_IMAGE,
            };
            if !fits {
                return Err(self.refuse(format!("binding {binding} is {kind:?} in the shader")));
            }
            match resource {
                Resource::Buffer(data) if is_texels(kind) => {
                    data.check().map_err(|reason| self.refuse(reason))?;
                    if data.texels() == vk::BufferView::null() {
                        let most = self.shared().info.limits.max_texel_buffer_elements;
                        return Err(self.refuse(format!(
                            "binding {binding} is a buffer without texels, or with more than the device's {most}"
                        )));
                    }
                    texels.push([data.texels()]);
                }
                Resource::Buffer(data) => {
                    data.check().map_err(|reason| self.refuse(reason))?;
                    let (buffer, offset, range) = data.place();
                    buffers.push([vk::DescriptorBufferInfo { buffer, offset, range }]);
                }
                Resource::Texture(image, sampler) => {
                    let image_layout = if image.is_depth() {
                        vk::ImageLayout::DEPTH_READ_ONLY_OPTIMAL
                    } else {
                        vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL
                    };
                    images.push([vk::DescriptorImageInfo {
                        sampler: *sampler,
                        image_view: image.view(),
                        image_layout,
                    }]);
                }
                Resource::Storage(image) => {
                    images.push([vk::DescriptorImageInfo {
                        sampler: vk::Sampler::null(),
                        image_view: image.view(),
                        image_layout: vk::ImageLayout::GENERAL,
                    }]);
                }
            }
            kinds.push((*binding, kind));
        }
        let (mut buffer, mut image, mut texel) = (buffers.iter(), images.iter(), texels.iter());
        let mut writes = Vec::with_capacity(kinds.len());
        for (binding, kind) in kinds {
            let write = vk::WriteDescriptorSet::default().dst_binding(binding).descriptor_type(kind);
            writes.extend(if is_buffer(kind) {
                buffer.next().map(|info| write.buffer_info(info))
            } else if is_texels(kind) {
                texel.next().map(|view| write.texel_buffer_view(view))
            } else {
                image.next().map(|info| write.image_info(info))
            });
        }
        if writes.is_empty() {
            return Ok(());
        }
        // SAFETY: as above; what is bound lives until the frame has ended because dropping it is deferred.
        unsafe {
            self.shared().push_descriptor.cmd_push_descriptor_set(
                self.raw(),
                built.bind_point,
                built.layout,
                0,
                &writes,
            );
        }
        Ok(())
    }

    /// Sets the bound pipeline's push constants.
    pub fn push<T: Record>(&mut self, constants: &T) -> Result<()> {
        let built =
            self.bound.as_ref().ok_or_else(|| self.refuse("it sets constants before a pipeline".into()))?;
        let bytes = bytemuck::bytes_of(constants);
        let size = built.interface.push_size as usize;
        if size > 0 && built.interface.push_name != T::NAME {
            let wanted = &built.interface.push_name;
            return Err(self.refuse(format!("it pushes {}: the shader reads {wanted}", T::NAME)));
        }
        if bytes.len() < size {
            return Err(self.refuse(format!("{} bytes of constants: the shader reads {size}", bytes.len())));
        }
        if size > 0 {
            // SAFETY: as above.
            unsafe {
                self.device().cmd_push_constants(
                    self.raw(),
                    built.layout,
                    built.interface.stages,
                    0,
                    &bytes[..size],
                );
            }
        }
        Ok(())
    }

    /// Binds vertex attributes to the pipeline's buffer of this number.
    pub fn vertices<'a>(&mut self, number: u32, data: impl Into<Data<'a>>) -> Result<()> {
        let (buffer, offset, _) = self.place(data.into(), Access::AttributeRead)?;
        // SAFETY: as above.
        unsafe { self.device().cmd_bind_vertex_buffers(self.raw(), number, &[buffer], &[offset]) };
        Ok(())
    }

    /// Binds indices.
    pub fn indices<'a>(&mut self, data: impl Into<Data<'a>>, kind: vk::IndexType) -> Result<()> {
        let (buffer, offset, _) = self.place(data.into(), Access::IndexRead)?;
        // SAFETY: as above.
        unsafe { self.device().cmd_bind_index_buffer(self.raw(), buffer, offset, kind) };
        Ok(())
    }

    /// Sets the viewport and the scissor; a pass with attachments begins with all of them.
    pub fn viewport(&mut self, area: vk::Rect2D) {
        let viewport = vk::Viewport {
            x: area.offset.x as f32,
            y: area.offset.y as f32,
            width: area.extent.width as f32,
            height: area.extent.height as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        // SAFETY: as above.
        unsafe {
            self.device().cmd_set_viewport(self.raw(), 0, &[viewport]);
            self.device().cmd_set_scissor(self.raw(), 0, &[area]);
        }
    }

    /// Draws vertices.
    pub fn draw(&mut self, vertices: std::ops::Range<u32>, instances: std::ops::Range<u32>) {
        // SAFETY: as above.
        unsafe {
            self.device().cmd_draw(
                self.raw(),
                vertices.len() as u32,
                instances.len() as u32,
                vertices.start,
                instances.start,
            );
        }
    }

    /// Draws indexed vertices.
    pub fn draw_indexed(
        &mut self,
        indices: std::ops::Range<u32>,
        vertex_offset: i32,
        instances: std::ops::Range<u32>,
    ) {
        // SAFETY: as above.
        unsafe {
            self.device().cmd_draw_indexed(
                self.raw(),
                indices.len() as u32,
                instances.len() as u32,
                indices.start,
                vertex_offset,
                instances.start,
            );
        }
    }

    /// Draws what `count` arguments in a buffer say (`VkDrawIndirectCommand`).
    pub fn draw_indirect<'a>(&mut self, arguments: impl Into<Data<'a>>, count: u32) -> Result<()> {
        let stride = size_of::<vk::DrawIndirectCommand>() as u32;
        let (buffer, offset) = self.arguments(arguments.into(), count, stride)?;
        // SAFETY: as above.
        unsafe { self.device().cmd_draw_indirect(self.raw(), buffer, offset, count, stride) };
        Ok(())
    }

    /// Draws what `count` arguments in a buffer say (`VkDrawIndexedIndirectCommand`).
    pub fn draw_indexed_indirect<'a>(&mut self, arguments: impl Into<Data<'a>>, count: u32) -> Result<()> {
        let stride = size_of::<vk::DrawIndexedIndirectCommand>() as u32;
        let (buffer, offset) = self.arguments(arguments.into(), count, stride)?;
        // SAFETY: as above.
        unsafe { self.device().cmd_draw_indexed_indirect(self.raw(), buffer, offset, count, stride) };
        Ok(())
    }

    /// Draws as many of the arguments as a number (u32) on the device says, `most` at most. Only where
    /// `Optional::draw_indirect_count` holds.
    pub fn draw_indexed_indirect_count<'a, 'b>(
        &mut self,
        arguments: impl Into<Data<'a>>,
        number: impl Into<Data<'b>>,
        most: u32,
    ) -> Result<()> {
        if !self.shared().info.optional.draw_indirect_count {
            return Err(self.refuse("the device cannot count draws".into()));
        }
        let stride = size_of::<vk::DrawIndexedIndirectCommand>() as u32;
        let (buffer, offset) = self.arguments(arguments.into(), most, stride)?;
        let (number, number_offset) = self.arguments(number.into(), 1, 4)?;
        // SAFETY: as above.
        unsafe {
            self.device().cmd_draw_indexed_indirect_count(
                self.raw(),
                buffer,
                offset,
                number,
                number_offset,
                most,
                stride,
            );
        }
        Ok(())
    }

    /// Runs work groups.
    pub fn dispatch(&mut self, x: u32, y: u32, z: u32) {
        if x > 0 && y > 0 && z > 0 {
            // SAFETY: as above.
            unsafe { self.device().cmd_dispatch(self.raw(), x, y, z) };
        }
    }

    /// Runs as many work groups along x as `items` invocations need.
    pub fn dispatch_over(&mut self, items: u32) -> Result<()> {
        let built =
            self.bound.as_ref().ok_or_else(|| self.refuse("it dispatches before a pipeline".into()))?;
        let groups = items.div_ceil(built.interface.group[0].max(1));
        let limit = self.shared().info.limits.max_compute_work_group_count[0];
        if groups > limit {
            return Err(self.refuse(format!("{groups} work groups: the device runs {limit}")));
        }
        self.dispatch(groups, 1, 1);
        Ok(())
    }

    /// Runs as many work groups as a buffer says (`VkDispatchIndirectCommand`).
    pub fn dispatch_indirect<'a>(&mut self, arguments: impl Into<Data<'a>>) -> Result<()> {
        let (buffer, offset) = self.arguments(arguments.into(), 1, 12)?;
        // SAFETY: as above.
        unsafe { self.device().cmd_dispatch_indirect(self.raw(), buffer, offset) };
        Ok(())
    }

    /// Copies bytes into a buffer.
    pub fn copy<'a>(&mut self, from: impl Into<Data<'a>>, to: &Buffer, to_offset: u64) -> Result<()> {
        let (src, src_offset, size) = self.place(from.into(), Access::TransferSrc)?;
        let (dst, dst_offset, _) = self.place(Data::Part(to, to_offset, size), Access::TransferDst)?;
        let region = vk::BufferCopy { src_offset, dst_offset, size };
        // SAFETY: as above.
        unsafe { self.device().cmd_copy_buffer(self.raw(), src, dst, &[region]) };
        Ok(())
    }

    /// Fills bytes (a multiple of 4, at a multiple of 4) of a buffer with a word.
    pub fn fill<'a>(&mut self, to: impl Into<Data<'a>>, word: u32) -> Result<()> {
        let (buffer, offset, size) = self.place(to.into(), Access::TransferDst)?;
        if offset % 4 != 0 || size % 4 != 0 {
            return Err(self.refuse(format!("{size} bytes at {offset} are not whole words")));
        }
        // SAFETY: as above.
        unsafe { self.device().cmd_fill_buffer(self.raw(), buffer, offset, size, word) };
        Ok(())
    }

    /// Copies one level of one layer of an image into a buffer, rows packed.
    pub fn copy_image_to_buffer(&mut self, from: &Image, to: &Buffer) -> Result<()> {
        self.must_declare(from.id(), from.name(), Access::TransferSrc)?;
        self.must_declare(to.id(), to.name(), Access::TransferDst)?;
        let region = whole_picture(from);
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        // SAFETY: as above.
        unsafe {
            self.device().cmd_copy_image_to_buffer(self.raw(), from.raw(), layout, to.raw(), &[region])
        };
        Ok(())
    }

    /// Copies packed rows into the first level and layer of an image.
    pub fn copy_buffer_to_image<'a>(&mut self, from: impl Into<Data<'a>>, to: &Image) -> Result<()> {
        self.must_declare(to.id(), to.name(), Access::TransferDst)?;
        let (buffer, offset, _) = self.place(from.into(), Access::TransferSrc)?;
        let mut region = whole_picture(to);
        region.buffer_offset = offset;
        let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        // SAFETY: as above.
        unsafe { self.device().cmd_copy_buffer_to_image(self.raw(), buffer, to.raw(), layout, &[region]) };
        Ok(())
    }

    /// Copies the first level of an image into another, converting format and size.
    pub fn blit(&mut self, from: &Image, to: &Image, filter: vk::Filter) -> Result<()> {
        self.must_declare(from.id(), from.name(), Access::TransferSrc)?;
        self.must_declare(to.id(), to.name(), Access::TransferDst)?;
        let whole = |image: &Image| {
            let (width, height) = image.size();
            [vk::Offset3D::default(), vk::Offset3D { x: width as i32, y: height as i32, z: 1 }]
        };
        let region = vk::ImageBlit {
            src_subresource: first_level(from),
            src_offsets: whole(from),
            dst_subresource: first_level(to),
            dst_offsets: whole(to),
        };
        // SAFETY: as above.
        unsafe {
            self.device().cmd_blit_image(
                self.raw(),
                from.raw(),
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                to.raw(),
                vk::ImageLayout::TRANSFER_DST_OPTIMAL,
                &[region],
                filter,
            );
        }
        Ok(())
    }

    fn arguments(&self, data: Data<'_>, count: u32, stride: u32) -> Result<(vk::Buffer, u64)> {
        let (buffer, offset, size) = self.place(data, Access::IndirectRead)?;
        if u64::from(count) * u64::from(stride) > size {
            return Err(
                self.refuse(format!("{count} arguments of {stride} bytes do not lie in {size} bytes"))
            );
        }
        Ok((buffer, offset))
    }

    fn place(&self, data: Data<'_>, access: Access) -> Result<(vk::Buffer, u64, u64)> {
        data.check().map_err(|reason| self.refuse(reason))?;
        if let Some((id, name)) = data.declared() {
            self.must_declare(id, name, access)?;
        }
        Ok(data.place())
    }

    fn must_declare(&self, id: u64, name: &str, access: Access) -> Result<()> {
        if self.declared.contains(&(id, access)) {
            return Ok(());
        }
        Err(self.refuse(format!("it uses `{name}` without declaring {access:?}")))
    }

    fn refuse(&self, reason: String) -> GpuError {
        GpuError::Pass { pass: self.pass.to_owned(), reason }
    }

    fn shared(&self) -> &Shared {
        &self.frame.shared
    }

    fn device(&self) -> &ash::Device {
        &self.frame.shared.device
    }
}

pub(crate) fn first_level(image: &Image) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers {
        aspect_mask: image.range().aspect_mask,
        mip_level: 0,
        base_array_layer: 0,
        layer_count: 1,
    }
}

pub(crate) fn whole_picture(image: &Image) -> vk::BufferImageCopy {
    let (width, height) = image.size();
    vk::BufferImageCopy::default().image_subresource(first_level(image)).image_extent(vk::Extent3D {
        width,
        height,
        depth: 1,
    })
}
