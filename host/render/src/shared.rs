//! What Rust says once for the shaders, too: numbers of the contract and of the passes, as
//! `shaders/shared.glsl`, and where the members of records lie. `cargo xtask shaders` writes the file; tests
//! compare it and every shader's records with what stands in Rust.

use std::fmt::Write;

use reef_abi as abi;

use crate::{fibre_records, gather, lod, markers, meshes::records, tiles, water};

/// Name of the file among the shaders.
pub const FILE: &str = "shared.glsl";

/// A number as GLSL writes it.
#[derive(Clone, Copy)]
enum Number {
    Bits(u32),
    Count(u32),
    Real(f32),
}
use Number::{Bits, Count, Real};

/// Of the contract, then of the passes.
const NUMBERS: &[(&str, Number)] = &[
    ("REEF_PATTERN_NONE", Bits(abi::PATTERN_NONE)),
    ("REEF_PATTERN_SPOTS", Bits(abi::PATTERN_SPOTS)),
    ("REEF_PATTERN_BANDS", Bits(abi::PATTERN_BANDS)),
    ("REEF_PATTERN_STRIPES", Bits(abi::PATTERN_STRIPES)),
    ("REEF_PATTERN_BLOTCHES", Bits(abi::PATTERN_BLOTCHES)),
    ("WAVES", Count(water::WAVES as u32)),
    ("SURFACE_WAVES", Count(water::SURFACE_WAVES as u32)),
    ("LONG_REACH", Real(water::LONG_REACH)),
    ("TILE_SIDES", Real(tiles::SIDES as f32)),
    ("TILE_QUADS_LOW", Count(tiles::QUADS_LOW)),
    ("TILE_QUADS_HIGH", Count(tiles::QUADS_HIGH)),
    ("MARKER_SIDES", Count(markers::BODY_SIDES)),
    ("MARKER_RINGS", Count(markers::BODY_RINGS)),
    ("NOT_DRAWN", Bits(records::NOT_DRAWN)),
    ("RINGS", Count(lod::RINGS)),
    ("RING_LEVELS", Count(lod::RING_LEVELS)),
    ("RIBBON_ERRORS", Real(lod::RIBBON_ERRORS)),
    ("THIN_RADIUS", Real(lod::THIN_RADIUS)),
    ("EDGE", Real(lod::EDGE)),
    ("LIT_EDGE", Real(lod::LIT_EDGE)),
    ("FLAG_CAP", Bits(gather::CAP)),
    ("FLAG_BLADE", Bits(gather::BLADE)),
    ("LIT_RIBBON", Bits(fibre_records::LIT_RIBBON)),
    ("THIN", Bits(fibre_records::THIN)),
    ("MESH_DUAL", Bits(records::DUAL)),
    ("MESH_TWO_SIDED", Bits(records::TWO_SIDED)),
    ("DRAWN_ANEW", Bits(records::DRAWN_ANEW)),
    ("RIGID", Bits(records::RIGID)),
    ("VEIL", Bits(records::VEIL)),
    ("FAR_SIDE", Bits(records::FAR_SIDE)),
    ("PLAIN", Bits(records::PLAIN)),
    ("SMOOTH", Bits(records::SMOOTH)),
    ("LIT_VEIL", Bits(records::LIT_VEIL)),
    ("CUT_OUT", Bits(records::CUT_OUT)),
    ("LEFT_OUT", Bits(records::LEFT_OUT)),
    ("BINS", Bits(records::BINS as u32)),
    ("BIN_LIT", Bits(records::BIN_LIT as u32)),
    ("BIN_PIXEL", Bits(records::BIN_PIXEL as u32)),
    ("BIN_VEIL", Bits(records::BIN_VEIL as u32)),
    ("BIN_LIT_VEIL", Bits(records::BIN_LIT_VEIL as u32)),
    ("BIN_THIN", Bits(records::BIN_THIN as u32)),
    ("BIN_LIT_THIN", Bits(records::BIN_LIT_THIN as u32)),
    ("THIN_HALF", Real(records::THIN_HALF)),
    ("NO_ROW", Real(records::NO_ROW)),
    ("SMOOTH_LIT", Real(records::SMOOTH_LIT)),
    ("BAND", Real(records::BAND)),
];

/// The text of [`FILE`].
pub fn glsl() -> String {
    let mut text = String::from(
        "// Numbers that Rust and the shaders share, as host/render/src/shared.rs has them. Written by `cargo xtask\n\
         // shaders`; do not edit.\n\n#ifndef SHARED\n#define SHARED\n\n",
    );
    for (name, number) in NUMBERS {
        // Writing to a string cannot fail.
        let _ = match number {
            Bits(bits) => writeln!(text, "#define {name} {bits}u"),
            Count(count) => writeln!(text, "#define {name} {count}"),
            Real(real) => writeln!(text, "#define {name} {real:?}"),
        };
    }
    text + "\n#endif\n"
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeSet, path::Path};

    use reef_gpu::{Layout, Record, layout, shader_records};

    use super::*;
    use crate::{billboards, lines, rocks, shafts, sprites, tone, view};

    /// Structures that only a shader has.
    const LOCAL: [&str; 9] =
        ["Haze", "Moved", "Needs", "Place", "RestRow", "Sand", "Skin", "Surface", "Window"];

    fn layouts() -> Vec<Layout> {
        fn of<T: Record>() -> Layout {
            T::layout()
        }
        vec![
            of::<view::View>(),
            of::<water::CausticTrain>(),
            of::<water::SurfaceTrain>(),
            of::<gather::GpuFibre>(),
            of::<gather::GpuObject>(),
            of::<gather::GpuLine>(),
            of::<fibre_records::Draw>(),
            of::<fibre_records::IndexedDraw>(),
            of::<fibre_records::Groups>(),
            of::<fibre_records::GpuChoice>(),
            of::<fibre_records::GpuRing>(),
            of::<fibre_records::TubeVertex>(),
            of::<fibre_records::StripVertex>(),
            of::<fibre_records::DrawCounts>(),
            of::<fibre_records::RingsPush>(),
            of::<fibre_records::FibreScanPush>(),
            of::<fibre_records::FibreSkinPush>(),
            of::<fibre_records::RibbonPush>(),
            of::<records::GpuMesh>(),
            of::<records::GpuLevel>(),
            of::<records::GpuRest>(),
            of::<records::GpuVertex>(),
            of::<records::GpuInstance>(),
            of::<records::GpuPart>(),
            of::<records::MeshCounts>(),
            of::<records::PosePush>(),
            of::<records::ScanPush>(),
            of::<records::SkinPush>(),
            of::<records::IndexPush>(),
            of::<records::LightPush>(),
            of::<markers::GpuMarker>(),
            of::<sprites::GpuSprite>(),
            of::<billboards::SpritePush>(),
            of::<shafts::GpuShaft>(),
            of::<tiles::Tile>(),
            of::<tiles::Height>(),
            of::<rocks::RockPush>(),
            of::<lines::LinePush>(),
            of::<tone::TonePush>(),
            of::<reef_gpu::self_test::ScalePush>(),
            of::<reef_gpu::self_test::ColorPush>(),
            layout!(abi::FibreNode = "Node" { position, radius }),
            layout!(abi::Joint = "Joint" { rotation, translation, scale }),
            layout!(abi::DrawVertex = "DrawVertex" { position, normal, thickness }),
            layout!(abi::Material = "Material" {
                base, tip, accent, pattern, texture, pattern_scale, pattern_softness, translucency, wrap, rim,
                glow, roughness, specular, spare
            }),
        ]
    }

    #[test]
    fn every_shaders_records_lie_as_rusts_do() {
        let rust = layouts();
        let mut seen = BTreeSet::new();
        for record in shader_records().expect("SPIR-V") {
            let name = &record.layout.name;
            let known = rust.iter().find(|layout| layout.name == *name);
            if known.is_none() && !record.laid_out && LOCAL.contains(&name.as_str()) {
                continue;
            }
            let shader = &record.shader;
            let known = known.unwrap_or_else(|| panic!("{shader}: {name} is no record of `layouts`"));
            assert_eq!(record.layout, *known, "{shader}: {name}");
            assert!(
                record.strides.iter().all(|stride| *stride == known.size),
                "{shader}: {:?}",
                record.strides
            );
            seen.insert(name.clone());
        }
        let unseen: Vec<_> = rust.iter().filter(|layout| !seen.contains(&layout.name)).collect();
        assert!(unseen.is_empty(), "no shader has {unseen:?}");
    }

    #[test]
    fn the_shaders_numbers_are_rusts() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shaders").join(FILE);
        let text = std::fs::read_to_string(path).expect("among the shaders");
        assert_eq!(text, glsl(), "run `cargo xtask shaders`");
    }
}
