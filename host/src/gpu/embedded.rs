//! Every shader as SPIR-V. Written by `cargo xtask shaders`, as is what it includes; do not edit.

/// File name in `shaders/` → SPIR-V.
pub(crate) const SHADERS: &[(&str, &[u8])] = &[
    ("selftest_color.frag", include_bytes!("../../../shaders/spv/selftest_color.frag.spv")),
    ("selftest_picture.vert", include_bytes!("../../../shaders/spv/selftest_picture.vert.spv")),
    ("selftest_sample.frag", include_bytes!("../../../shaders/spv/selftest_sample.frag.spv")),
    ("selftest_scale.comp", include_bytes!("../../../shaders/spv/selftest_scale.comp.spv")),
];
