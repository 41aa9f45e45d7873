//! Sprites: suspended particles, local fog. Drawn after everything that is solid, from far to near, soft
//! where they meet it.
//!
//! [`crate::sprites`] says which are seen. `speck.vert` and `speck.frag` draw the small ones as points,
//! `sprite.vert` and `sprite.frag` the others; both light a sprite once a vertex, by what reaches its depth.

use ash::vk;
use reef_gpu::{
    Access, Blend, Buffer, DepthDesc, DepthLoad, Frame, Gpu, GraphicsDesc, Load, Resource, Result,
    SamplerDesc, Upload,
};

use super::{
    formats::{DEPTH, LIGHT},
    layers::{Edges, Layers},
    quality::{ByQuality, Quality},
    sprites::{Kind, Seen, Sizes},
    targets::Targets,
    view::Lens,
};

/// Least diameter of a sprite in the picture [px].
const LEAST: f32 = 1.5;
/// Up to this diameter a sprite is a point [px]: greater ones would be missed at the picture's edge, where
/// points go as soon as their middle does.
const SPECK: f32 = 5.0;
/// The indices of so many quads are made at first.
const QUADS: usize = 1024;

reef_gpu::record! {
    /// Constants of `sprite.vert` and `speck.vert`.
    pub(crate) struct SpritePush = "SpritePush" {
        /// Diameter below which a sprite is drawn wider and fainter [px].
        least: f32,
    }
}

/// The pass that draws sprites.
pub struct Billboards {
    gpu: Gpu,
    specks: ByQuality,
    quads: ByQuality,
    sampler: vk::Sampler,
    indices: Option<(usize, Buffer)>,
    seen: Seen,
}

impl Billboards {
    /// Describes the pipelines.
    pub fn new(gpu: &Gpu) -> Result<Self> {
        let color = [(LIGHT, Blend::Premultiplied)];
        let depth = DepthDesc { format: DEPTH, compare: vk::CompareOp::GREATER_OR_EQUAL, write: false };
        let desc = |name, vertex, fragment| GraphicsDesc {
            color: &color,
            depth: Some(depth),
            ..GraphicsDesc::new(name, vertex, fragment)
        };
        let specks = GraphicsDesc {
            topology: vk::PrimitiveTopology::POINT_LIST,
            ..desc("specks", "speck.vert", "speck.frag")
        };
        Ok(Self {
            gpu: gpu.clone(),
            specks: ByQuality::new(gpu, &specks),
            quads: ByQuality::new(gpu, &desc("sprites", "sprite.vert", "sprite.frag")),
            sampler: gpu.sampler(SamplerDesc { linear: false, repeat: [false; 2], anisotropic: false })?,
            indices: None,
            seen: Seen::default(),
        })
    }

    /// Compiles the pipelines of a quality now.
    pub fn prepare(&self, quality: Quality) -> Result<()> {
        self.specks.prepare(quality)?;
        self.quads.prepare(quality)
    }

    /// How many sprites the last picture showed, of what was in the sea.
    pub fn seen(&self) -> &Seen {
        &self.seen
    }

    /// The pass. `sea`: the newer step; `back`: how long before its end the picture is taken [s]; `samples`:
    /// along each side of a pixel.
    pub fn draw(
        &mut self,
        frame: &mut Frame<'_>,
        view: Upload,
        (sea, back): (&reef_streams::frame::Frame, f32),
        (lens, samples, quality): (&Lens, u32, Quality),
        layers: &mut Layers,
        targets: &Targets<'_>,
    ) -> Result<()> {
        if sea.outputs.iter().all(|outputs| outputs.billboards.is_empty()) {
            return Ok(());
        }
        layers.update(sea)?;
        let widest = if self.gpu.info().optional.large_points {
            self.gpu.info().limits.point_size_range[1] - 1.0
        } else {
            0.0
        };
        let least = LEAST * samples as f32;
        let speck = SPECK.max(least);
        let sizes = Sizes { least, speck: if widest >= speck { speck } else { 0.0 } };
        let catalogue = layers.catalogue();
        let lying = (|texture: &_| catalogue.of(texture), catalogue.dot());
        self.seen.cull(&sea.outputs, (&lens.sprites(), back, sizes), lying);
        let quads = self.seen.draws.iter().filter(|(kind, _)| *kind == Kind::Quad);
        let most = quads.map(|(_, range)| range.len()).max().unwrap_or(0);
        self.reserve(most)?;
        if self.seen.draws.is_empty() {
            return Ok(());
        }
        let sprites = frame.upload(&self.seen.sprites)?;
        let own = [(0, view.into()), (1, sprites.into())];
        let mut quads = layers.bindings(3, Edges::Hold);
        quads.extend(own);
        quads.push((2, Resource::Texture(targets.depth, self.sampler)));
        let mut pass = frame
            .pass("sprites")
            .bind(self.specks.get(quality), &own)
            .bind(self.quads.get(quality), &quads)
            .color(targets.light, Load::Keep)
            .depth(targets.depth, DepthLoad::ReadOnly);
        if let Some((_, indices)) = &self.indices {
            pass = pass.read(indices, Access::IndexRead);
        }
        pass.run(|cmd| {
            let mut bound = None;
            for (kind, range) in &self.seen.draws {
                if bound.replace(*kind) != Some(*kind) {
                    let pipeline = match kind {
                        Kind::Speck => &self.specks,
                        Kind::Quad => &self.quads,
                    };
                    cmd.pipeline(pipeline.get(quality))?;
                    cmd.push(&SpritePush { least })?;
                }
                match (kind, &self.indices) {
                    (Kind::Speck, _) => cmd.draw(range.clone(), 0..1),
                    (Kind::Quad, Some((_, indices))) => {
                        cmd.indices(indices, vk::IndexType::UINT32)?;
                        cmd.draw_indexed(0..range.len() as u32 * 6, range.start as i32 * 4, 0..1);
                    }
                    // `reserve` made them.
                    (Kind::Quad, None) => {}
                }
            }
            Ok(())
        })
    }

    /// The indices of so many quads: vertices are shared, which costs a software rasteriser less than
    /// instances do.
    fn reserve(&mut self, quads: usize) -> Result<()> {
        if quads == 0 || self.indices.as_ref().is_some_and(|(room, _)| *room >= quads) {
            return Ok(());
        }
        let room = quads.next_power_of_two().max(QUADS);
        let corners = (0..room as u32 * 4).step_by(4);
        let indices: Vec<u32> = corners.flat_map(|i| [0, 1, 2, 2, 1, 3].map(|corner| i + corner)).collect();
        let usage = vk::BufferUsageFlags::INDEX_BUFFER;
        self.indices = Some((room, self.gpu.buffer_with("quads", usage, &indices)?));
        Ok(())
    }
}
