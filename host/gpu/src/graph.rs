//! Passes: each says what it binds, reads and writes, and what has to happen before it follows from that. How
//! a pass touches what it binds is read from its shaders: it is said nowhere else.
//!
//! ```ignore
//! frame.pass("skin")
//!     .bind(&skin, &[(0, (&nodes).into()), (1, (&vertices).into())])
//!     .run(|cmd| {
//!         cmd.pipeline(&skin)?;
//!         cmd.push(&constants)?;
//!         cmd.dispatch_over(count)
//!     })?;
//! frame.pass("draw")
//!     .bind(&draw, &[(0, (&lights).into())])
//!     .read(&vertices, Access::AttributeRead)
//!     .color(&picture, Load::Clear([0.0; 4]))
//!     .depth(&depth, DepthLoad::Clear(0.0))
//!     .run(|cmd| { … })?;
//! ```
//!
//! A pass is recorded at once: its barriers (all in one call), its label, its timestamps, its commands.

use std::ffi::CString;

use ash::vk;

use super::{
    access::{Access, Use},
    barriers::{Barrier, merge},
    buffer::Buffer,
    commands::{Bound, Cmd},
    data::{Data, Resource},
    error::{GpuError, Result},
    fault::Fault,
    frames::Frame,
    image::Image,
    pipelines::Pipeline,
};

/// What is in a colour attachment when the pass begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Load {
    /// What passes before have drawn.
    Keep,
    /// This colour.
    Clear([f32; 4]),
    /// Anything: the pass covers all of it.
    Discard,
}

/// What is in the depth attachment when the pass begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthLoad {
    /// What passes before have drawn.
    Keep,
    /// This depth. Reef's depth is reversed: 0 is far.
    Clear(f32),
    /// As before, and it is only tested, not written.
    ReadOnly,
}

/// A resource that a pass touches.
#[derive(Clone, Copy)]
pub enum Touched<'r> {
    /// A buffer.
    Buffer(&'r Buffer),
    /// An image.
    Image(&'r Image),
}

impl<'r> From<&'r Buffer> for Touched<'r> {
    fn from(buffer: &'r Buffer) -> Self {
        Touched::Buffer(buffer)
    }
}

impl<'r> From<&'r Image> for Touched<'r> {
    fn from(image: &'r Image) -> Self {
        Touched::Image(image)
    }
}

impl Touched<'_> {
    fn id(&self) -> u64 {
        match self {
            Touched::Buffer(buffer) => buffer.id(),
            Touched::Image(image) => image.id(),
        }
    }

    fn name(&self) -> &str {
        match self {
            Touched::Buffer(buffer) => buffer.name(),
            Touched::Image(image) => image.name(),
        }
    }
}

struct ColorAttachment<'r> {
    image: &'r Image,
    load: Load,
    resolve: Option<&'r Image>,
}

/// A pass that is being declared.
pub struct Pass<'p, 'f, 'r> {
    frame: &'p mut Frame<'f>,
    name: &'p str,
    touched: Vec<(Touched<'r>, Access)>,
    bound: Vec<Bound<'r>>,
    /// Images whose content before the pass is not wanted.
    discarded: Vec<u64>,
    color: Vec<ColorAttachment<'r>>,
    depth: Option<(&'r Image, DepthLoad)>,
    refused: Option<GpuError>,
}

impl<'f> Frame<'f> {
    /// Declares the next pass.
    pub fn pass<'p, 'r>(&'p mut self, name: &'p str) -> Pass<'p, 'f, 'r> {
        Pass {
            frame: self,
            name,
            touched: Vec::new(),
            bound: Vec::new(),
            discarded: Vec::new(),
            color: Vec::new(),
            depth: None,
            refused: None,
        }
    }

    /// Brings an image into the layout in which the window system takes it; the last thing that happens to
    /// it.
    pub fn finish_for_present(&mut self, image: &Image) -> Result<()> {
        self.pass("present").read(image, Access::Present).run(|_| Ok(()))
    }
}

impl<'p, 'f, 'r> Pass<'p, 'f, 'r> {
    /// The pass may use this pipeline, with these resources by their binding numbers in set 0: all that its
    /// shaders have. Whether these are read or written there follows from the shaders.
    pub fn bind(mut self, pipeline: &Pipeline, resources: &[(u32, Resource<'r>)]) -> Self {
        let built = match pipeline.get() {
            Ok(built) => built,
            Err(error) => {
                self.refused.get_or_insert(error);
                return self;
            }
        };
        for (number, binding) in &built.interface.bindings {
            let Some((_, resource)) = resources.iter().find(|(given, _)| given == number) else {
                self.refuse(format!("binding {number} of `{}` is not given", pipeline.name()));
                continue;
            };
            let resource = match *resource {
                Resource::Buffer(Data::Whole(buffer) | Data::Part(buffer, ..)) => Touched::Buffer(buffer),
                Resource::Texture(image, _) | Resource::Storage(image) => Touched::Image(image),
                // The program wrote it before the frame began.
                Resource::Buffer(Data::Upload(_)) => continue,
            };
            match binding.accesses() {
                Ok(accesses) => accesses.into_iter().for_each(|access| self.touch(resource, access)),
                Err(reason) => self.refuse(format!("`{}`: {reason}", pipeline.name())),
            }
        }
        self.bound.push(Bound { pipeline: pipeline.id(), built, resources: resources.to_vec() });
        self
    }

    /// The pass reads this resource.
    pub fn read(mut self, resource: impl Into<Touched<'r>>, access: Access) -> Self {
        let resource = resource.into();
        if access.describe(false).writes {
            self.refuse(format!("`{}`: {access:?} is no way of reading", resource.name()));
        }
        self.touch(resource, access);
        self
    }

    /// The pass writes this resource. (One that it reads, too, is declared twice.)
    pub fn write(mut self, resource: impl Into<Touched<'r>>, access: Access) -> Self {
        let resource = resource.into();
        if !access.describe(false).writes {
            self.refuse(format!("`{}`: {access:?} is no way of writing", resource.name()));
        }
        self.touch(resource, access);
        self
    }

    /// The pass writes all of this resource: what an image held before is not kept.
    pub fn overwrite(mut self, resource: impl Into<Touched<'r>>, access: Access) -> Self {
        let resource = resource.into();
        self.discarded.push(resource.id());
        self.write(resource, access)
    }

    /// The pass draws into this image. Its size is the area that is drawn to.
    pub fn color(mut self, image: &'r Image, load: Load) -> Self {
        self.attach(image, load, None);
        self
    }

    /// The pass draws into this image of several samples, which is then resolved into another.
    pub fn color_resolved(mut self, image: &'r Image, load: Load, into: &'r Image) -> Self {
        self.attach(image, load, Some(into));
        self.discarded.push(into.id());
        self.touch(into.into(), Access::ColorAttachment);
        self
    }

    /// The pass tests against, and may write, this depth image.
    pub fn depth(mut self, image: &'r Image, load: DepthLoad) -> Self {
        let access = match load {
            DepthLoad::ReadOnly => Access::DepthAttachmentRead,
            DepthLoad::Keep | DepthLoad::Clear(_) => Access::DepthAttachment,
        };
        if matches!(load, DepthLoad::Clear(_)) {
            self.discarded.push(image.id());
        }
        self.depth = Some((image, load));
        self.touch(image.into(), access);
        self
    }

    /// Records the pass: barriers first, then, between timestamps and within the attachments if there are
    /// any, what `record` says.
    pub fn run(self, record: impl FnOnce(&mut Cmd<'_, 'f>) -> Result<()>) -> Result<()> {
        let Pass { frame, name, touched, bound, discarded, color, depth, refused } = self;
        if let Some(error) = refused {
            return Err(error);
        }
        let shared = frame.shared.clone();
        let commands = frame.commands;
        let label = CString::new(name).unwrap_or_default();
        shared.begin_label(commands, &label);
        let query = frame.timestamps().begin(commands, name);
        frame.note_pass(name);
        let declared: Vec<_> = touched.iter().map(|(resource, access)| (resource.id(), *access)).collect();
        record_barriers(frame, name, &touched, &discarded)?;

        let rendering = !color.is_empty() || depth.is_some();
        let area = if rendering { begin_rendering(frame, name, &color, depth)? } else { None };
        let mut cmd = Cmd::new(frame, name, &declared, &bound);
        if let Some(area) = area {
            cmd.viewport(area);
        }
        let recorded = record(&mut cmd);
        if rendering {
            // SAFETY: rendering was begun in this command buffer.
            unsafe { shared.device.cmd_end_rendering(commands) };
        }
        frame.timestamps().end(commands, query);
        shared.end_label(commands);
        recorded
    }

    fn attach(&mut self, image: &'r Image, load: Load, resolve: Option<&'r Image>) {
        if load != Load::Keep {
            self.discarded.push(image.id());
        }
        self.color.push(ColorAttachment { image, load, resolve });
        self.touch(image.into(), Access::ColorAttachment);
    }

    fn touch(&mut self, resource: Touched<'r>, access: Access) {
        let suits = match resource {
            Touched::Buffer(_) => access.suits_buffers(),
            Touched::Image(_) => access.suits_images(),
        };
        if !suits {
            self.refuse(format!("`{}` cannot be touched by {access:?}", resource.name()));
        }
        self.touched.push((resource, access));
    }

    fn refuse(&mut self, reason: String) {
        let pass = self.name;
        self.refused.get_or_insert_with(|| GpuError::Pass { pass: pass.to_owned(), reason });
    }
}

/// Derives the barriers of one pass from what it touches, and records them in one call.
fn record_barriers(
    frame: &mut Frame<'_>,
    pass: &str,
    touched: &[(Touched<'_>, Access)],
    discarded: &[u64],
) -> Result<()> {
    let fault = frame.shared.fault;
    let mut buffers = Vec::new();
    let mut images = Vec::new();
    for (i, (resource, _)) in touched.iter().enumerate() {
        if touched[..i].iter().any(|(before, _)| before.id() == resource.id()) {
            continue;
        }
        let uses = |depth: bool| -> Vec<Use> {
            touched
                .iter()
                .filter(|(other, _)| other.id() == resource.id())
                .map(|(_, access)| access.describe(depth))
                .collect()
        };
        match resource {
            Touched::Buffer(buffer) => {
                let merged = merge(&uses(false), false).map_err(|error| conflict(pass, resource, error))?;
                let barrier = buffer.state().transition(merged);
                buffers.extend(
                    barrier.filter(|barrier| !left_out(fault, barrier)).map(|b| buffer_barrier(buffer, &b)),
                );
            }
            Touched::Image(image) => {
                let merged =
                    merge(&uses(image.is_depth()), true).map_err(|error| conflict(pass, resource, error))?;
                let mut state = image.state();
                let barrier = if discarded.contains(&image.id()) {
                    state.transition_discarding(merged)
                } else {
                    state.transition(merged)
                };
                images.extend(barrier.map(|b| image_barrier(image, &misled(fault, b))));
            }
        }
    }
    if buffers.is_empty() && images.is_empty() {
        return Ok(());
    }
    let info = vk::DependencyInfo::default().buffer_memory_barriers(&buffers).image_memory_barriers(&images);
    // SAFETY: the command buffer is being recorded, outside of rendering.
    unsafe { frame.shared.device.cmd_pipeline_barrier2(frame.commands, &info) };
    Ok(())
}

fn conflict(pass: &str, resource: &Touched<'_>, error: impl std::fmt::Display) -> GpuError {
    GpuError::Pass { pass: pass.to_owned(), reason: format!("`{}`: {error}", resource.name()) }
}

/// The planted fault `barrier`.
fn left_out(fault: Option<Fault>, barrier: &Barrier) -> bool {
    fault == Some(Fault::Barrier) && barrier.src_accesses.contains(vk::AccessFlags2::SHADER_STORAGE_WRITE)
}

/// The planted fault `layout`.
fn misled(fault: Option<Fault>, mut barrier: Barrier) -> Barrier {
    use vk::ImageLayout as L;
    let read_only = [
        L::SHADER_READ_ONLY_OPTIMAL,
        L::TRANSFER_SRC_OPTIMAL,
        L::DEPTH_READ_ONLY_OPTIMAL,
        L::PRESENT_SRC_KHR,
    ];
    if fault == Some(Fault::Layout) && read_only.contains(&barrier.new_layout) {
        barrier.new_layout = L::GENERAL;
    }
    barrier
}

fn buffer_barrier(buffer: &Buffer, barrier: &Barrier) -> vk::BufferMemoryBarrier2<'static> {
    vk::BufferMemoryBarrier2::default()
        .src_stage_mask(barrier.src_stages)
        .src_access_mask(barrier.src_accesses)
        .dst_stage_mask(barrier.dst_stages)
        .dst_access_mask(barrier.dst_accesses)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .buffer(buffer.raw())
        .size(vk::WHOLE_SIZE)
}

fn image_barrier(image: &Image, barrier: &Barrier) -> vk::ImageMemoryBarrier2<'static> {
    vk::ImageMemoryBarrier2::default()
        .src_stage_mask(barrier.src_stages)
        .src_access_mask(barrier.src_accesses)
        .dst_stage_mask(barrier.dst_stages)
        .dst_access_mask(barrier.dst_accesses)
        .old_layout(barrier.old_layout)
        .new_layout(barrier.new_layout)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image.raw())
        .subresource_range(image.range())
}

/// Begins rendering into the attachments; returns the area, which all of them share.
fn begin_rendering(
    frame: &mut Frame<'_>,
    pass: &str,
    color: &[ColorAttachment<'_>],
    depth: Option<(&Image, DepthLoad)>,
) -> Result<Option<vk::Rect2D>> {
    let all = color.iter().map(|c| c.image).chain(depth.map(|(image, _)| image));
    let mut extent: Option<vk::Extent2D> = None;
    for image in all {
        if extent.is_some_and(|extent| extent != image.extent()) {
            let reason = format!("`{}` is of another size than the attachments before it", image.name());
            return Err(GpuError::Pass { pass: pass.to_owned(), reason });
        }
        extent = Some(image.extent());
    }
    let Some(extent) = extent else { return Ok(None) };

    let colors: Vec<_> = color
        .iter()
        .map(|attachment| {
            let (load, clear) = match attachment.load {
                Load::Keep => (vk::AttachmentLoadOp::LOAD, [0.0; 4]),
                Load::Clear(color) => (vk::AttachmentLoadOp::CLEAR, color),
                Load::Discard => (vk::AttachmentLoadOp::DONT_CARE, [0.0; 4]),
            };
            let info = vk::RenderingAttachmentInfo::default()
                .image_view(attachment.image.view())
                .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
                .load_op(load)
                .store_op(vk::AttachmentStoreOp::STORE)
                .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32: clear } });
            match attachment.resolve {
                None => info,
                Some(into) => info
                    .resolve_mode(vk::ResolveModeFlags::AVERAGE)
                    .resolve_image_view(into.view())
                    .resolve_image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL),
            }
        })
        .collect();
    let depth = depth.map(|(image, load)| {
        let (op, clear, layout, store) = match load {
            DepthLoad::Keep => {
                (vk::AttachmentLoadOp::LOAD, 0.0, vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL, true)
            }
            DepthLoad::Clear(depth) => {
                (vk::AttachmentLoadOp::CLEAR, depth, vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL, true)
            }
            DepthLoad::ReadOnly => {
                (vk::AttachmentLoadOp::LOAD, 0.0, vk::ImageLayout::DEPTH_READ_ONLY_OPTIMAL, false)
            }
        };
        vk::RenderingAttachmentInfo::default()
            .image_view(image.view())
            .image_layout(layout)
            .load_op(op)
            .store_op(if store { vk::AttachmentStoreOp::STORE } else { vk::AttachmentStoreOp::NONE })
            .clear_value(vk::ClearValue {
                depth_stencil: vk::ClearDepthStencilValue { depth: clear, stencil: 0 },
            })
    });
    let area = vk::Rect2D { offset: vk::Offset2D::default(), extent };
    let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&colors);
    if let Some(depth) = &depth {
        info = info.depth_attachment(depth);
    }
    // SAFETY: the command buffer is being recorded; the attachments were brought into these layouts before.
    unsafe { frame.shared.device.cmd_begin_rendering(frame.commands, &info) };
    Ok(Some(area))
}
