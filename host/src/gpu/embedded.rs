//! Every shader as SPIR-V. Written by `cargo xtask shaders`; do not edit.

/// File name in `shaders/` → SPIR-V.
pub(crate) const SHADERS: &[(&str, &[u8])] = &[
    ("fibre.frag", include_bytes!("../../../shaders/spv/fibre.frag.spv")),
    ("fibre.vert", include_bytes!("../../../shaders/spv/fibre.vert.spv")),
    ("fibre_rings.comp", include_bytes!("../../../shaders/spv/fibre_rings.comp.spv")),
    ("fibre_scan.comp", include_bytes!("../../../shaders/spv/fibre_scan.comp.spv")),
    ("fibre_skin.comp", include_bytes!("../../../shaders/spv/fibre_skin.comp.spv")),
    ("full_screen.vert", include_bytes!("../../../shaders/spv/full_screen.vert.spv")),
    ("line.frag", include_bytes!("../../../shaders/spv/line.frag.spv")),
    ("line.vert", include_bytes!("../../../shaders/spv/line.vert.spv")),
    ("rock.frag", include_bytes!("../../../shaders/spv/rock.frag.spv")),
    ("rock.vert", include_bytes!("../../../shaders/spv/rock.vert.spv")),
    ("selftest_color.frag", include_bytes!("../../../shaders/spv/selftest_color.frag.spv")),
    ("selftest_picture.vert", include_bytes!("../../../shaders/spv/selftest_picture.vert.spv")),
    ("selftest_sample.frag", include_bytes!("../../../shaders/spv/selftest_sample.frag.spv")),
    ("selftest_scale.comp", include_bytes!("../../../shaders/spv/selftest_scale.comp.spv")),
    ("shaft.frag", include_bytes!("../../../shaders/spv/shaft.frag.spv")),
    ("shaft.vert", include_bytes!("../../../shaders/spv/shaft.vert.spv")),
    ("sky.frag", include_bytes!("../../../shaders/spv/sky.frag.spv")),
    ("speck.frag", include_bytes!("../../../shaders/spv/speck.frag.spv")),
    ("speck.vert", include_bytes!("../../../shaders/spv/speck.vert.spv")),
    ("sprite.frag", include_bytes!("../../../shaders/spv/sprite.frag.spv")),
    ("sprite.vert", include_bytes!("../../../shaders/spv/sprite.vert.spv")),
    ("terrain.frag", include_bytes!("../../../shaders/spv/terrain.frag.spv")),
    ("terrain.vert", include_bytes!("../../../shaders/spv/terrain.vert.spv")),
    ("tonemap.frag", include_bytes!("../../../shaders/spv/tonemap.frag.spv")),
];
