//! Meshes: compute passes that blend, cull, choose levels of detail and skin, and the draws.
//!
//! 1. `mesh_pose.comp`, one invocation an instance: joints of two steps → what moves vertices, or nothing
//!    where it is culled; up to two levels of detail, of which the pixels are shared;
//! 2. `mesh_scan.comp`, one work group: where each part's vertices and indices lie, in the instances' order;
//! 3. `mesh_skin.comp`, four invocations a part, eight parts a work group: vertices in clip space;
//! 4. `mesh_index.comp`, in the same way: triangles;
//! 5. `mesh_lit.comp`, one invocation a vertex: at low quality the light of what is small;
//! 6. `mesh_lit.vert` and `mesh_lit.frag` draw what is lit, `mesh.vert` and `mesh.frag` (`mesh_textured.frag`
//!    where a material has a texture) the rest: a draw for all instances of all meshes, by what they need of
//!    the device.
//!
//! What is solid is drawn early; veils, which light comes through, late, from far to near, first what they
//! turn away from the eye. Between them comes what is two-sided and thinner than some pixels: it is drawn a
//! little wider across its rows ([`rows`]) and fades there by the share of a pixel that it covers.
//!
//! Offsets come from a prefix sum, never from atomics: the same frame gives the same bytes.

mod buffers;
mod debug;
mod draws;
pub mod gather;
pub mod library;
pub mod records;
pub mod rows;
pub mod sample;
pub mod stand;
#[cfg(test)]
mod tests;
pub mod twin;

use reef_gpu::{Access, Buffer, Cmd, Data, DepthLoad, Frame, Gpu, Load, Pipeline, Result, Upload};

use self::{
    buffers::{Buffers, MOST_INDICES, Most, Wanted},
    draws::{Draws, Kind, lit_pipeline},
    gather::Subject,
    library::Library,
    records::{
        BIN_LIT, BIN_LIT_THIN, BIN_LIT_VEIL, BIN_PIXEL, BIN_THIN, BIN_VEIL, Drawn, GROUPS, IndexPush,
        LIGHT_GROUPS, LightPush, MeshCounts, PosePush, ScanPush, SkinPush, VERTEX_WORDS,
    },
    stand::{Canopy, Standing},
};
use super::{
    Shot,
    gather::{Gathered, GpuLine, Stander},
    layers::{Edges, Layers},
    lod::Thresholds,
    matched::Matched,
    quality::Quality,
    steps::Shown,
    targets::Targets,
    variant::{Variant, Variants},
    view::Lens,
};

/// Work groups along x; the rest goes along y.
const GROUPS_X: u32 = 32_768;

/// What one picture uploaded.
#[derive(Clone, Copy)]
struct Picture {
    instances: Upload,
    veils: bool,
    lit_veils: bool,
    /// Some mesh is two-sided, solid and skinned: it may be thin.
    leaves: bool,
}

/// The mesh passes.
pub struct Meshes {
    gpu: Gpu,
    library: Library,
    pose: Pipeline,
    scan: Pipeline,
    skin: Pipeline,
    index: Pipeline,
    lit: [Pipeline; 2],
    lit_veil: Pipeline,
    lit_thin: Pipeline,
    draws: Variants<Draws>,
    buffers: Option<Buffers>,
    picture: Option<Picture>,
    /// Of one picture at most.
    pub(crate) most: Most,
    standing: Vec<Standing>,
    canopy: Canopy,
}

impl Meshes {
    /// Describes the pipelines; nothing is compiled yet.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            gpu: gpu.clone(),
            library: Library::default(),
            pose: Pipeline::compute(gpu, "mesh_pose.comp", &[]),
            scan: Pipeline::compute(gpu, "mesh_scan.comp", &[]),
            skin: Pipeline::compute(gpu, "mesh_skin.comp", &[]),
            index: Pipeline::compute(gpu, "mesh_index.comp", &[]),
            lit: [("lit meshes", Kind::OneSided), ("lit meshes, two-sided", Kind::TwoSided)]
                .map(|(name, kind)| lit_pipeline(gpu, name, kind)),
            lit_veil: lit_pipeline(gpu, "lit veils", Kind::Veil),
            lit_thin: lit_pipeline(gpu, "lit thin meshes", Kind::Thin),
            draws: Variants::default(),
            buffers: None,
            picture: None,
            most: Most::of(&gpu.info().limits),
            standing: Vec::new(),
            canopy: Canopy::default(),
        }
    }

    /// Looks at what stands on the ground of a picture: before the ground is drawn, and the meshes are.
    pub fn stand(&mut self, shot: &Shot<'_>, matched: &[Matched]) -> Result<()> {
        self.library.update(&self.gpu, shot.current)?;
        let shelf = &self.library.shelf;
        let terrain = shot.environment.terrain.as_deref();
        let steps = [shot.previous, shot.current];
        let standing = terrain.map(|t| stand::standing(steps, matched, t, shelf)).unwrap_or_default();
        if standing != self.standing {
            self.canopy = Canopy::new(&standing);
            self.standing = standing;
        }
        Ok(())
    }

    /// What stands on the ground of the picture, as the ground feels it.
    pub fn standers(&self) -> impl Iterator<Item = Stander> + '_ {
        self.standing.iter().map(Standing::stander)
    }

    /// The compute passes. `limits` None: everything at its finest level, nothing culled.
    pub fn skin(
        &mut self,
        frame: &mut Frame<'_>,
        view: Upload,
        shot: &Shot<'_>,
        (gathered, shown, lens): (&Gathered, Shown<'_>, &Lens),
        limits: Option<&Thresholds>,
        quality: Quality,
    ) -> Result<()> {
        self.picture = None;
        let steps = [shot.previous, shot.current];
        let shelf = &self.library.shelf;
        let mut subject = gather::gather(steps, &gathered.matched, shot.alpha, lens, quality, shelf);
        subject.fit(&self.most);
        subject.shade(&self.canopy, lens);
        if subject.instances.is_empty() {
            return Ok(());
        }
        let used = subject.instances.iter().filter_map(|i| gathered.materials.get(i.material as usize));
        let variant = Variant::of(quality, used);
        self.draws.choose(variant, |variant| Draws::new(&self.gpu, variant));
        self.reserve(&subject)?;
        let (Some(b), Some(books)) = (&self.buffers, self.library.books()) else { return Ok(()) };
        let Shown { before, now, materials, objects, .. } = shown;
        let count = subject.instances.len() as u32;
        let instances = frame.upload(&subject.instances)?;
        let chosen = limits.copied().unwrap_or_default();
        let first_instance = instances.first_texel();

        frame
            .pass("meshes: joints, cull, detail")
            .bind(
                &self.pose,
                &[
                    (0, view.into()),
                    (1, instances.into()),
                    (2, objects.into()),
                    (3, (&before.joints).into()),
                    (4, (&now.joints).into()),
                    (5, (&books.meshes).into()),
                    (6, (&books.levels).into()),
                    (7, (&books.rests).into()),
                    (8, (&b.parts).into()),
                    (9, (&b.palette).into()),
                ],
            )
            .run(|cmd| {
                cmd.pipeline(&self.pose)?;
                cmd.push(&PosePush {
                    count,
                    use_lod: u32::from(limits.is_some()),
                    error: if limits.is_some() { chosen.mesh_error } else { -1.0 },
                    lit: if limits.is_some() && quality == Quality::Low { chosen.lit_mesh } else { 0.0 },
                    first_instance,
                    first_object: objects.first_texel(),
                })?;
                cmd.dispatch_over(count)
            })?;
        let index_limit = (b.index.size() / 4) as u32;
        frame
            .pass("meshes: offsets")
            .bind(&self.scan, &[(2, (&b.parts).into()), (3, (&b.draw).into()), (4, (&b.order).into())])
            .run(|cmd| {
                cmd.pipeline(&self.scan)?;
                cmd.push(&ScanPush {
                    part_count: 2 * count,
                    vertex_limit: (b.vertex.size() / (VERTEX_WORDS as u64 * 4)) as u32,
                    index_limit,
                    groups_x: GROUPS_X,
                })?;
                cmd.dispatch(1, 1, 1);
                Ok(())
            })?;
        frame
            .pass("meshes: skin")
            .read(&b.draw, Access::IndirectRead)
            .bind(
                &self.skin,
                &[
                    (0, view.into()),
                    (1, instances.into()),
                    (4, (&books.vertices).into()),
                    (5, (&books.bones).into()),
                    (6, (&b.palette).into()),
                    (7, (&before.vertices).into()),
                    (8, (&now.vertices).into()),
                    (9, (&b.parts).into()),
                    (10, (&b.order).into()),
                    (11, (&b.draw).into()),
                    (12, (&b.vertex).into()),
                    (13, (&books.rows).into()),
                ],
            )
            .run(|cmd| {
                cmd.pipeline(&self.skin)?;
                cmd.push(&SkinPush { groups_x: GROUPS_X, first_instance })?;
                cmd.dispatch_indirect(Data::Part(&b.draw, GROUPS, 12))
            })?;
        frame
            .pass("meshes: triangles")
            .read(&b.draw, Access::IndirectRead)
            .bind(
                &self.index,
                &[
                    (1, instances.into()),
                    (2, (&books.levels).into()),
                    (3, (&books.indices).into()),
                    (4, (&b.vertex).into()),
                    (5, (&b.parts).into()),
                    (6, (&b.order).into()),
                    (7, (&b.draw).into()),
                    (8, (&b.index).into()),
                ],
            )
            .run(|cmd| {
                cmd.pipeline(&self.index)?;
                cmd.push(&IndexPush { groups_x: GROUPS_X, index_limit, first_instance })?;
                cmd.dispatch_indirect(Data::Part(&b.draw, GROUPS, 12))
            })?;
        // After the triangles, which do not read what the light takes the place of.
        if let (Quality::Low, Some(draws)) = (quality, self.draws.get()) {
            frame
                .pass("meshes: light")
                .read(&b.draw, Access::IndirectRead)
                .bind(
                    &draws.light,
                    &[
                        (0, view.into()),
                        (1, instances.into()),
                        (2, (&b.parts).into()),
                        (3, materials.into()),
                        (4, (&b.draw).into()),
                        (5, (&b.vertex).into()),
                    ],
                )
                .run(|cmd| {
                    cmd.pipeline(&draws.light)?;
                    cmd.push(&LightPush { first_instance })?;
                    cmd.dispatch_indirect(Data::Part(&b.draw, LIGHT_GROUPS, 12))
                })?;
        }
        let last = subject.instances.last().map_or(0, |last| last.flags);
        let [veils, lit_veils] = [records::VEIL, records::LIT_VEIL].map(|flag| last & flag != 0);
        let leaf = |instance: &records::GpuInstance| {
            let two_sided = self.library.shelf.meshes[instance.mesh as usize].flags & records::TWO_SIDED != 0;
            two_sided && instance.flags & (records::VEIL | records::DRAWN_ANEW) == 0
        };
        let leaves = subject.instances.iter().any(leaf);
        self.picture = Some(Picture { instances, veils, lit_veils, leaves });
        Ok(())
    }

    /// The draw of what hides what is behind it.
    pub fn draw_solid(
        &self,
        frame: &mut Frame<'_>,
        (view, materials): (Upload, &Buffer),
        layers: &Layers,
        targets: &Targets<'_>,
    ) -> Result<()> {
        let Some(draws) = self.draws.get() else { return Ok(()) };
        self.draw(frame, "meshes: draw", (view, materials, layers, targets), &draws.sides, |cmd, b| {
            if self.draws.chosen().quality == Quality::Low {
                for (side, pipeline) in self.lit.iter().enumerate() {
                    b.draw_bin(cmd, pipeline, BIN_LIT + side)?;
                }
            }
            for (side, pipeline) in draws.sides.iter().enumerate() {
                b.draw_bin(cmd, pipeline, BIN_PIXEL + side)?;
            }
            Ok(())
        })
    }

    /// The draw of what is thin, from far to near, over all that is solid.
    pub fn draw_thin(
        &self,
        frame: &mut Frame<'_>,
        (view, materials): (Upload, &Buffer),
        layers: &Layers,
        targets: &Targets<'_>,
    ) -> Result<()> {
        let (Some(draws), Some(true)) = (self.draws.get(), self.picture.map(|picture| picture.leaves)) else {
            return Ok(());
        };
        let by_pixels = std::slice::from_ref(&draws.thin);
        self.draw(frame, "meshes: thin", (view, materials, layers, targets), by_pixels, |cmd, b| {
            if self.draws.chosen().quality == Quality::Low {
                b.draw_bin(cmd, &self.lit_thin, BIN_LIT_THIN)?;
            }
            b.draw_bin(cmd, &draws.thin, BIN_THIN)
        })
    }

    /// The draw of veils, over all that is solid.
    pub fn draw_veils(
        &self,
        frame: &mut Frame<'_>,
        (view, materials): (Upload, &Buffer),
        layers: &Layers,
        targets: &Targets<'_>,
    ) -> Result<()> {
        let Some(draws) = self.draws.get().filter(|_| self.picture.is_some_and(|picture| picture.veils))
        else {
            return Ok(());
        };
        let lit = self.picture.is_some_and(|picture| picture.lit_veils);
        let (pipeline, bin) = if lit { (&self.lit_veil, BIN_LIT_VEIL) } else { (&draws.veil, BIN_VEIL) };
        let by_pixels = if lit { &[][..] } else { std::slice::from_ref(pipeline) };
        self.draw(frame, "meshes: veils", (view, materials, layers, targets), by_pixels, |cmd, b| {
            b.draw_bin(cmd, pipeline, bin)
        })
    }

    /// A pass that draws; nothing where the picture has no meshes. `by_pixels`: pipelines that light pixels.
    fn draw(
        &self,
        frame: &mut Frame<'_>,
        name: &str,
        (view, materials, layers, targets): (Upload, &Buffer, &Layers, &Targets<'_>),
        by_pixels: &[Pipeline],
        record: impl FnOnce(&mut Cmd<'_, '_>, &Buffers) -> Result<()>,
    ) -> Result<()> {
        let (Some(b), Some(picture)) = (&self.buffers, self.picture) else { return Ok(()) };
        let mut bound = vec![
            (0, view.into()),
            (1, materials.into()),
            (2, picture.instances.into()),
            (3, (&b.parts).into()),
        ];
        if self.draws.chosen().textures != 0 {
            bound.extend(layers.bindings(4, Edges::Around));
        }
        let pass = by_pixels.iter().fold(frame.pass(name), |pass, pipeline| pass.bind(pipeline, &bound));
        pass.read(&b.vertex, Access::AttributeRead)
            .read(&b.index, Access::IndexRead)
            .read(&b.draw, Access::IndirectRead)
            .color(targets.light, Load::Keep)
            .depth(targets.depth, DepthLoad::Keep)
            .run(|cmd| record(cmd, b))
    }

    /// Joints and levels of detail of a picture as lines.
    pub fn lines(
        &self,
        shot: &Shot<'_>,
        gathered: &Gathered,
        lens: &Lens,
        how: (Option<&Thresholds>, Quality),
    ) -> Vec<GpuLine> {
        debug::lines(shot, (&self.library.shelf, gathered), lens, how)
    }

    /// What the last picture's scan counted. Waits for the device: for tests and benches.
    pub fn counts(&self) -> Result<MeshCounts> {
        let Some(b) = self.buffers.as_ref().filter(|_| self.picture.is_some()) else {
            return Ok(MeshCounts::default());
        };
        Ok(self.gpu.read_records(&b.draw, 1)?.pop().unwrap_or_default())
    }

    /// What the last picture drew. Waits for the device: for tests.
    pub fn read_back(&self) -> Result<Drawn> {
        let Some(b) = self.buffers.as_ref().filter(|_| self.picture.is_some()) else {
            return Ok(Drawn::default());
        };
        let counts = self.counts()?;
        Ok(Drawn {
            parts: self.gpu.read_records(&b.parts, usize::MAX)?,
            vertices: self.gpu.read_records(&b.vertex, counts.vertices as usize)?,
            indices: self.gpu.read_records(&b.index, 3 * counts.triangles as usize)?,
        })
    }

    /// The meshes on the device, for tests.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// Makes the buffers great enough; they only grow.
    fn reserve(&mut self, subject: &Subject) -> Result<()> {
        let wanted = Wanted {
            instances: subject.instances.len() as u64,
            joints: u64::from(subject.palette),
            vertices: subject.most_vertices.min(self.most.vertices),
            indices: subject.most_indices.min(MOST_INDICES),
        };
        if !self.buffers.as_ref().is_some_and(|buffers| buffers.fit(&wanted)) {
            self.buffers = Some(Buffers::new(&self.gpu, &wanted, &self.most)?);
        }
        Ok(())
    }
}
