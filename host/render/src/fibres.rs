//! The fibres: compute passes that blend, cull, choose detail and skin, and the draws.
//!
//! 1. `fibre_rings.comp`, one invocation a fibre: node chains of two steps → rings, or nothing where it is
//!    culled;
//! 2. `fibre_scan.comp`, one work group: where each fibre's vertices and indices lie, in the fibres' order;
//! 3. `fibre_skin.comp`, one work group a tube: vertices in clip space and triangles;
//! 4. `fibre_ribbon.comp`, one invocation a lit ribbon: a strip of vertices with their light;
//! 5. `fibre.vert` and `fibre.frag` (`fibre_textured.frag` where a material has a texture) draw the tubes,
//!    `fibre_ribbon.vert` and `fibre_ribbon.frag` the lit ribbons.
//!
//! Lit ribbons are low quality's: they are drawn before all else where they hide what is behind them, so that
//! nothing is shaded there, and last where they are so thin that their edges fade.
//!
//! Tubes so thin that they are ribbons, and thin lit ribbons, are drawn twice: first the pixels of which they
//! cover three quarters or more, with depth, then, over all of these, the pixels of which they cover less,
//! without. A fringe that wrote depth would cut a rim of background into what stands behind it.
//!
//! Offsets come from a prefix sum, never from atomics: the same frame gives the same bytes.

use std::mem::offset_of;

use ash::vk;
use reef_gpu::{
    Access, Blend, Buffer, BufferDesc, Data, DepthDesc, DepthLoad, Frame, Gpu, GraphicsDesc, Load, Memory,
    Pipeline, Result, Upload, VertexDesc,
};

use super::{
    fibre_records::{
        Draw, DrawCounts, FibreScanPush, FibreSkinPush, GpuChoice, GpuRing, Groups, IndexedDraw, RibbonPush,
        RingsPush, STRIP, STRIP_WORDS, StripVertex, TUBE, TubeVertex, VERTEX_WORDS,
    },
    formats::DEPTH,
    gather::Gathered,
    layers::{Edges, Layers},
    lod::{RINGS, Thresholds},
    quality::Quality,
    steps::Shown,
    targets::Targets,
    variant::{Variant, Variants},
};

/// Vertices of a lit ribbon at most.
const STRIP_VERTICES: u64 = 2 * RINGS as u64 + 2;
/// Vertices of one picture at most: their buffer has to stay below 128 MiB, the least that Vulkan promises.
const MOST_VERTICES: u64 = 2_750_000;
/// Vertices of one picture's lit ribbons at most, for the same reason.
const MOST_STRIP_VERTICES: u64 = 5_000_000;
/// Indices of one picture at most.
const MOST_INDICES: u64 = 24_000_000;
/// Work groups along x; the rest goes along y.
const GROUPS_X: u32 = 32_768;

struct Buffers {
    fibres: u64,
    vertices: u64,
    choices: Buffer,
    rings: Buffer,
    vertex: Buffer,
    index: Buffer,
    draw: Buffer,
    tubes: Buffer,
    strips: Buffer,
}

impl Buffers {
    /// Whether so many fibres could all be lit ribbons.
    fn strips_fit(&self, fibres: u32) -> bool {
        u64::from(fibres) * STRIP_VERTICES * STRIP <= self.strips.size()
    }
}

/// The fibre passes.
pub struct Fibres {
    gpu: Gpu,
    rings: Pipeline,
    scan: Pipeline,
    skin: Pipeline,
    ribbon: Pipeline,
    ribbons: Ribbons,
    draws: Variants<Draws>,
    buffers: Option<Buffers>,
    any: bool,
    /// Whether fibres may be lit ribbons in this picture.
    lit: bool,
}

/// The draws of tubes: all but the fringes of those that are ribbons, and these.
struct Draws {
    core: Pipeline,
    fringe: Pipeline,
}

/// The draws of lit ribbons; `thin`: the core and the fringe of those whose edges fade.
struct Ribbons {
    solid: Pipeline,
    thin: [Pipeline; 2],
}

impl Fibres {
    /// Describes the pipelines; nothing is compiled yet.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            gpu: gpu.clone(),
            rings: Pipeline::compute(gpu, "fibre_rings.comp", &[]),
            scan: Pipeline::compute(gpu, "fibre_scan.comp", &[]),
            skin: Pipeline::compute(gpu, "fibre_skin.comp", &[]),
            // A lit ribbon has no pattern.
            ribbon: Pipeline::compute(gpu, "fibre_ribbon.comp", &[Quality::Low.constant(), (1, 0)]),
            ribbons: Ribbons {
                solid: ribbon_pipeline(gpu, "solid ribbons", Blend::Replace, 0),
                thin: [("thin ribbons", 1), ("fringes of thin ribbons", 2)]
                    .map(|(name, part)| ribbon_pipeline(gpu, name, Blend::Alpha, part)),
            },
            draws: Variants::default(),
            buffers: None,
            any: false,
            lit: false,
        }
    }

    /// Compiles the pipelines now.
    pub fn prepare(&self) -> Result<()> {
        [&self.rings, &self.scan, &self.skin].into_iter().try_for_each(Pipeline::prepare)
    }

    /// The compute passes. `limits` None: everything at full detail, nothing culled.
    pub fn skin(
        &mut self,
        frame: &mut Frame<'_>,
        view: Upload,
        (gathered, shown): (&Gathered, Shown<'_>),
        limits: Option<&Thresholds>,
        quality: Quality,
    ) -> Result<()> {
        self.any = !gathered.fibres.is_empty();
        if !self.any {
            return Ok(());
        }
        let count = gathered.fibres.len() as u32;
        let variant = Variant::of_fibres(quality, gathered);
        self.draws.choose(variant, |variant| {
            let [core, fringe] = [("fibres", false), ("fibres: fringes", true)]
                .map(|(name, fringe)| draw_pipeline(&self.gpu, name, variant, fringe));
            Draws { core, fringe }
        });
        let Shown { before, now, fibres, materials, objects } = shown;
        self.reserve(u64::from(count), gathered.full_vertices())?;
        let Some(b) = &self.buffers else { return Ok(()) };
        let full = Thresholds::default();
        let chosen = limits.unwrap_or(&full);
        // Light that is shown at once is low quality's.
        self.lit =
            quality == Quality::Low && limits.is_some_and(|l| l.lit_ribbon > 0.0) && b.strips_fit(count);

        frame
            .pass("fibres: cull, detail, rings")
            .bind(
                &self.rings,
                &[
                    (0, view.into()),
                    (1, fibres.into()),
                    (2, objects.into()),
                    (3, (&before.nodes).into()),
                    (4, (&now.nodes).into()),
                    (5, (&b.choices).into()),
                    (6, (&b.rings).into()),
                ],
            )
            .run(|cmd| {
                cmd.pipeline(&self.rings)?;
                cmd.push(&RingsPush {
                    fibre_count: count,
                    alpha: gathered.alpha,
                    use_lod: u32::from(limits.is_some()),
                    ring_step: chosen.ring_step,
                    side_error: chosen.side_error,
                    lit_ribbon: if self.lit { chosen.lit_ribbon } else { 0.0 },
                })?;
                cmd.dispatch_over(count)
            })?;
        frame
            .pass("fibres: offsets")
            .bind(&self.scan, &[(0, (&b.choices).into()), (1, (&b.draw).into()), (2, (&b.tubes).into())])
            .run(|cmd| {
                cmd.pipeline(&self.scan)?;
                cmd.push(&FibreScanPush {
                    fibre_count: count,
                    vertex_limit: (b.vertex.size() / TUBE) as u32,
                    index_limit: (b.index.size() / 4) as u32,
                    groups_x: GROUPS_X,
                })?;
                cmd.dispatch(1, 1, 1);
                Ok(())
            })?;
        frame
            .pass("fibres: skin")
            .read(&b.draw, Access::IndirectRead)
            .bind(
                &self.skin,
                &[
                    (0, view.into()),
                    (1, fibres.into()),
                    (2, (&b.choices).into()),
                    (3, (&b.rings).into()),
                    (4, (&b.vertex).into()),
                    (5, (&b.index).into()),
                    (6, (&b.tubes).into()),
                    (7, (&b.draw).into()),
                ],
            )
            .run(|cmd| {
                cmd.pipeline(&self.skin)?;
                cmd.push(&FibreSkinPush { groups_x: GROUPS_X })?;
                cmd.dispatch_indirect(groups(b))
            })?;
        if !self.lit {
            return Ok(());
        }
        frame
            .pass("fibres: ribbons")
            .bind(
                &self.ribbon,
                &[
                    (0, view.into()),
                    (1, fibres.into()),
                    (2, objects.into()),
                    (3, (&before.nodes).into()),
                    (4, (&now.nodes).into()),
                    (5, (&b.choices).into()),
                    (6, materials.into()),
                    (7, (&b.strips).into()),
                ],
            )
            .run(|cmd| {
                cmd.pipeline(&self.ribbon)?;
                cmd.push(&RibbonPush { fibre_count: count, alpha: gathered.alpha })?;
                cmd.dispatch_over(count)
            })
    }

    /// The draw of lit ribbons that hide what is behind them: before everything that they may hide.
    pub fn draw_solid(&self, frame: &mut Frame<'_>, targets: &Targets<'_>) -> Result<()> {
        let (Some(b), true) = (&self.buffers, self.any && self.lit) else { return Ok(()) };
        frame
            .pass("fibres: solid")
            .read(&b.strips, Access::AttributeRead)
            .read(&b.draw, Access::IndirectRead)
            .color(targets.light, Load::Keep)
            .depth(targets.depth, DepthLoad::Keep)
            .run(|cmd| {
                cmd.pipeline(&self.ribbons.solid)?;
                cmd.vertices(0, &b.strips)?;
                cmd.draw_indirect(strips(b, offset_of!(DrawCounts, solid)), 1)
            })
    }

    /// The draw of all other fibres, over the background.
    pub fn draw(
        &self,
        frame: &mut Frame<'_>,
        (view, materials): (Upload, &Buffer),
        layers: &Layers,
        targets: &Targets<'_>,
    ) -> Result<()> {
        let (Some(b), true) = (&self.buffers, self.any) else { return Ok(()) };
        let Some(draws) = self.draws.get() else { return Ok(()) };
        let mut bound = vec![(0, view.into()), (1, materials.into())];
        if self.draws.chosen().textures != 0 {
            bound.extend(layers.bindings(2, Edges::Around));
        }
        frame
            .pass("fibres: draw")
            .bind(&draws.core, &bound)
            .bind(&draws.fringe, &bound)
            .read(&b.vertex, Access::AttributeRead)
            .read(&b.index, Access::IndexRead)
            .read(&b.strips, Access::AttributeRead)
            .read(&b.draw, Access::IndirectRead)
            .color(targets.light, Load::Keep)
            .depth(targets.depth, DepthLoad::Keep)
            .run(|cmd| {
                cmd.pipeline(&draws.core)?;
                cmd.vertices(0, &b.vertex)?;
                cmd.indices(&b.index, vk::IndexType::UINT32)?;
                cmd.draw_indexed_indirect(tubes(b, offset_of!(DrawCounts, tubes)), 1)?;
                cmd.draw_indexed_indirect(tubes(b, offset_of!(DrawCounts, flat_tubes)), 1)?;
                if self.lit {
                    let [core, fringe] = &self.ribbons.thin;
                    cmd.vertices(0, &b.strips)?;
                    for pipeline in [core, fringe] {
                        cmd.pipeline(pipeline)?;
                        cmd.draw_indirect(strips(b, offset_of!(DrawCounts, thin)), 1)?;
                    }
                    cmd.vertices(0, &b.vertex)?;
                }
                cmd.pipeline(&draws.fringe)?;
                cmd.draw_indexed_indirect(tubes(b, offset_of!(DrawCounts, flat_tubes)), 1)
            })
    }

    /// What the last picture's scan counted. Waits for the device: for tests and benches.
    pub fn counts(&self) -> Result<DrawCounts> {
        let Some(b) = self.buffers.as_ref().filter(|_| self.any) else { return Ok(DrawCounts::default()) };
        Ok(self.gpu.read_records(&b.draw, 1)?.pop().unwrap_or_default())
    }

    /// Vertices and indices of the last picture, those of ribbons last. Waits for the device: for tests.
    pub fn read_back(&self) -> Result<(Vec<[u32; VERTEX_WORDS]>, Vec<u32>)> {
        let Some(b) = self.buffers.as_ref().filter(|_| self.any) else { return Ok((Vec::new(), Vec::new())) };
        let counts = self.counts()?;
        let indices = (counts.tubes.indices + counts.flat_tubes.indices) as usize;
        let vertices = self.gpu.read_records(&b.vertex, counts.vertices as usize)?;
        Ok((vertices, self.gpu.read_records(&b.index, indices)?))
    }

    /// Vertices of the last picture's lit ribbons, the solid ones first. Waits for the device: for tests.
    pub fn read_back_strips(&self) -> Result<Vec<[u32; STRIP_WORDS]>> {
        let Some(b) = self.buffers.as_ref().filter(|_| self.any) else { return Ok(Vec::new()) };
        let counts = self.counts()?;
        self.gpu.read_records(&b.strips, (counts.solid.vertices + counts.thin.vertices) as usize)
    }

    /// Makes the buffers great enough; they only grow.
    fn reserve(&mut self, fibres: u64, vertices: u64) -> Result<()> {
        let vertices = vertices.min(MOST_VERTICES);
        if self.buffers.as_ref().is_some_and(|b| b.fibres >= fibres && b.vertices >= vertices) {
            return Ok(());
        }
        let fibres = fibres.next_power_of_two().max(256);
        let vertices = vertices.next_power_of_two().clamp(4096, MOST_VERTICES);
        let buffer = |name, size, usage| {
            let usage = usage | vk::BufferUsageFlags::STORAGE_BUFFER;
            Buffer::new(&self.gpu, &BufferDesc { name, size, usage, memory: Memory::Device })
        };
        use vk::BufferUsageFlags as U;
        self.buffers = Some(Buffers {
            fibres,
            vertices,
            choices: buffer("fibre choices", fibres * size_of::<GpuChoice>() as u64, U::empty())?,
            rings: buffer(
                "fibre rings",
                fibres * u64::from(RINGS) * size_of::<GpuRing>() as u64,
                U::empty(),
            )?,
            vertex: buffer("fibre vertices", vertices * TUBE, U::VERTEX_BUFFER)?,
            // Six indices a quad, one quad a vertex at most.
            index: buffer("fibre indices", (vertices * 6).min(MOST_INDICES) * 4, U::INDEX_BUFFER)?,
            draw: buffer("fibre draw", size_of::<DrawCounts>() as u64, U::INDIRECT_BUFFER)?,
            tubes: buffer("tubes", fibres * 4, U::empty())?,
            strips: buffer(
                "ribbon strips",
                (fibres * STRIP_VERTICES).min(MOST_STRIP_VERTICES) * STRIP,
                U::VERTEX_BUFFER,
            )?,
        });
        Ok(())
    }
}

/// The work groups that skin the tubes.
fn groups(b: &Buffers) -> Data<'_> {
    Data::Part(&b.draw, offset_of!(DrawCounts, groups) as u64, size_of::<Groups>() as u64)
}

/// A draw of tubes.
fn tubes(b: &Buffers, offset: usize) -> Data<'_> {
    Data::Part(&b.draw, offset as u64, size_of::<IndexedDraw>() as u64)
}

/// A draw of lit ribbons.
fn strips(b: &Buffers, offset: usize) -> Data<'_> {
    Data::Part(&b.draw, offset as u64, size_of::<Draw>() as u64)
}

fn draw_pipeline(gpu: &Gpu, name: &str, variant: Variant, fringe: bool) -> Pipeline {
    use vk::Format as F;
    let attributes = [
        (0, F::R32G32B32A32_SFLOAT, offset_of!(TubeVertex, clip) as u32),
        (1, F::R16G16B16A16_SNORM, offset_of!(TubeVertex, normal_xy) as u32),
        (2, F::R16G16_SNORM, offset_of!(TubeVertex, circle) as u32),
        (3, F::R16G16_SFLOAT, offset_of!(TubeVertex, radius_half) as u32),
        (4, F::R32G32B32_UINT, offset_of!(TubeVertex, material_flags) as u32),
        (5, F::R32_SFLOAT, offset_of!(TubeVertex, edge) as u32),
    ];
    let vertices = [VertexDesc { stride: TUBE as u32, per_instance: false, attributes: &attributes }];
    let draw = GraphicsDesc {
        cull: vk::CullModeFlags::BACK,
        vertices: &vertices,
        color: &[(variant.quality.format(), Blend::Alpha)],
        depth: Some(DepthDesc { format: DEPTH, compare: vk::CompareOp::GREATER, write: !fringe }),
        constants: &[
            variant.quality.constant(),
            (1, variant.patterns),
            (2, u32::from(fringe)),
            (4, variant.textures),
        ],
        ..GraphicsDesc::new(
            name,
            "fibre.vert",
            if variant.textures != 0 { "fibre_textured.frag" } else { "fibre.frag" },
        )
    };
    Pipeline::graphics(gpu, &draw)
}

/// `part`: `PART` of `fibre_ribbon.frag`.
fn ribbon_pipeline(gpu: &Gpu, name: &str, blend: Blend, part: u32) -> Pipeline {
    use vk::Format as F;
    let attributes = [
        (0, F::R32G32B32A32_SFLOAT, offset_of!(StripVertex, clip) as u32),
        (1, F::R8G8B8A8_UNORM, offset_of!(StripVertex, edge) as u32),
        (2, F::R8G8B8A8_SNORM, offset_of!(StripVertex, bow) as u32),
    ];
    let vertices = [VertexDesc { stride: STRIP as u32, per_instance: false, attributes: &attributes }];
    let draw = GraphicsDesc {
        topology: vk::PrimitiveTopology::TRIANGLE_STRIP,
        vertices: &vertices,
        color: &[(Quality::Low.format(), blend)],
        depth: Some(DepthDesc { format: DEPTH, compare: vk::CompareOp::GREATER, write: part != 2 }),
        constants: &[(0, part)],
        ..GraphicsDesc::new(name, "fibre_ribbon.vert", "fibre_ribbon.frag")
    };
    Pipeline::graphics(gpu, &draw)
}
