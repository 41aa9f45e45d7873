//! Rocks: one draw each, at the level of detail that its size in the picture asks for.

use ash::vk;
use glam::{DVec3, Vec3};
use reef_gpu::{
    Access, Blend, Buffer, DepthDesc, DepthLoad, Frame, Gpu, GraphicsDesc, Load, Result, Upload, VertexDesc,
};
use reef_streams::environment::{Rock, Terrain};

use super::{
    boulder::{Ball, RockVertex, SUBDIVISIONS, vertices},
    formats::{DEPTH, LIGHT},
    quality::{ByQuality, Quality},
    sunlit::Sunlight,
    targets::Targets,
    terrain::GroundTextures,
    view::Lens,
};

/// Radius [px] from which on each level of [`SUBDIVISIONS`] is drawn: its edges are then 8 to 16 px long, at
/// low quality twice that.
fn from_px(quality: Quality) -> [f32; 4] {
    let scale = if quality == Quality::Low { 2.0 } else { 1.0 };
    [120.0, 50.0, 18.0, 0.0].map(|px| px * scale)
}

reef_gpu::record! {
    /// Constants of `rock.vert` and `rock_low.vert`.
    pub(crate) struct RockPush = "RockPush" {
        /// Relative to the eye [m].
        origin: [f32; 3],
    }
}

struct Meshes {
    rocks: Vec<Rock>,
    vertices: Buffer,
}

/// The pass that draws the rocks.
pub struct Rocks {
    pipeline: ByQuality,
    balls: Vec<Ball>,
    /// First index and number of indices of each level.
    ranges: Vec<(u32, u32)>,
    indices: Buffer,
    meshes: Option<Meshes>,
}

impl Rocks {
    /// Describes the pipeline, makes the balls.
    pub fn new(gpu: &Gpu) -> Result<Self> {
        let vertex = [
            (0, vk::Format::R32G32B32_SFLOAT, 0),
            (1, vk::Format::R16G16B16A16_SNORM, 12),
            (2, vk::Format::R32_SFLOAT, 20),
        ];
        let buffers =
            [VertexDesc { stride: size_of::<RockVertex>() as u32, per_instance: false, attributes: &vertex }];
        let desc = GraphicsDesc {
            cull: vk::CullModeFlags::BACK,
            vertices: &buffers,
            color: &[(LIGHT, Blend::Replace)],
            depth: Some(DepthDesc { format: DEPTH, compare: vk::CompareOp::GREATER, write: true }),
            ..GraphicsDesc::new("rocks", "rock.vert", "rock.frag")
        };
        let low = GraphicsDesc { vertex: "rock_low.vert", fragment: Some("rock_low.frag"), ..desc };
        let balls: Vec<Ball> = SUBDIVISIONS.iter().map(|n| Ball::new(*n)).collect();
        let mut all: Vec<u16> = Vec::new();
        let mut ranges = Vec::new();
        for ball in &balls {
            ranges.push((all.len() as u32, ball.indices.len() as u32));
            all.extend_from_slice(&ball.indices);
        }
        Ok(Self {
            pipeline: ByQuality::with_low(gpu, &desc, &low),
            balls,
            ranges,
            indices: gpu.buffer_with("rock indices", vk::BufferUsageFlags::INDEX_BUFFER, &all)?,
            meshes: None,
        })
    }

    /// Compiles the pipeline now.
    pub fn prepare(&self, quality: Quality) -> Result<()> {
        self.pipeline.prepare(quality)
    }

    /// Shapes a scene's rocks. `sun`: unit vector toward it.
    pub fn set(&mut self, gpu: &Gpu, terrain: Option<&Terrain>, sun: Vec3) -> Result<()> {
        self.meshes = match terrain.filter(|t| !t.rocks.is_empty()) {
            Some(terrain) => {
                let sunlight = Sunlight::new(&terrain.rocks, sun);
                let mut all = Vec::new();
                for index in 0..terrain.rocks.len() {
                    for ball in &self.balls {
                        all.extend(vertices(terrain, index, &sunlight, ball));
                    }
                }
                let usage = vk::BufferUsageFlags::VERTEX_BUFFER;
                let vertices = gpu.buffer_with("rock vertices", usage, &all)?;
                Some(Meshes { rocks: terrain.rocks.clone(), vertices })
            }
            None => None,
        };
        Ok(())
    }

    /// The pass.
    pub fn draw(
        &self,
        frame: &mut Frame<'_>,
        view: Upload,
        lens: &Lens,
        quality: Quality,
        textures: &GroundTextures,
        targets: &Targets<'_>,
    ) -> Result<()> {
        let Some(meshes) = &self.meshes else { return Ok(()) };
        let visible = visible(&meshes.rocks, lens, &from_px(quality));
        if visible.is_empty() {
            return Ok(());
        }
        let [noise, contact] = textures.bindings(&textures.noise);
        let pipeline = self.pipeline.get(quality);
        frame
            .pass("rocks")
            .bind(pipeline, &[(0, view.into()), noise, contact])
            .read(&self.indices, Access::IndexRead)
            .read(&meshes.vertices, Access::AttributeRead)
            .color(targets.light, Load::Keep)
            .depth(targets.depth, DepthLoad::Keep)
            .run(|cmd| {
                cmd.pipeline(pipeline)?;
                cmd.vertices(0, &meshes.vertices)?;
                cmd.indices(&self.indices, vk::IndexType::UINT16)?;
                for (index, level, origin) in visible {
                    let (first, count) = self.ranges[level];
                    cmd.push(&RockPush { origin: origin.to_array() })?;
                    cmd.draw_indexed(first..first + count, self.first_vertex(index, level) as i32, 0..1);
                }
                Ok(())
            })
    }

    fn first_vertex(&self, rock: usize, level: usize) -> usize {
        let points = |balls: &[Ball]| balls.iter().map(|b| b.points.len()).sum::<usize>();
        rock * points(&self.balls) + points(&self.balls[..level])
    }
}

/// Index, level and origin in eye space of the rocks that can be seen.
fn visible(rocks: &[Rock], lens: &Lens, from_px: &[f32; 4]) -> Vec<(usize, usize, Vec3)> {
    rocks
        .iter()
        .enumerate()
        .filter_map(|(i, rock)| {
            let origin = (DVec3::from(rock.position) - lens.eye).as_vec3();
            let radius = Vec3::from(rock.half_axes).max_element();
            if lens.culls(origin, radius) {
                return None;
            }
            let px = radius * lens.pixels_per_metre() / (origin.length() - radius).max(0.05);
            let level = from_px.iter().position(|from| px >= *from).unwrap_or(from_px.len() - 1);
            Some((i, level, origin))
        })
        .collect()
}
