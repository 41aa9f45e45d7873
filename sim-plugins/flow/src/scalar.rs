//! The kernels' equations once more, one point at a time in plain f32 without fused operations: what the wide
//! code is measured against. Its rounding differs from [`crate::velocity8`]'s, so nothing that simulates uses
//! it.

use crate::packed::{AXIS_CONE, Local, Packed, Varying};

/// Velocity of the water [m/s] at one point [m, relative to the origin of `packed`].
pub fn velocity(packed: &Packed, p: [f32; 3]) -> [f32; 3] {
    let mut v = packed.base;
    for field in &packed.varying {
        v = add_scaled(v, varying(field, p), field.velocity);
    }
    for source in &packed.sources {
        let d = from_center(source.center, p);
        let d2 = dot(d, d);
        v = add_scaled(v, intensity(source, d2, d2), d);
    }
    for whirlwind in &packed.whirlwinds {
        let d = from_center(whirlwind.local.center, p);
        let d2 = dot(d, d);
        let r = whirlwind.axis;
        let w = [d[1] * r[2] - d[2] * r[1], d[2] * r[0] - d[0] * r[2], d[0] * r[1] - d[1] * r[0]];
        let w2 = dot(w, w);
        if w2 > d2 * (AXIS_CONE * AXIS_CONE) {
            v = add_scaled(v, intensity(&whirlwind.local, d2, w2), w);
        }
    }
    for shelter in &packed.shelters {
        let d = from_center(shelter.center, p);
        let factor = 1.0 - shelter.strength * fade(shelter.reach2, shelter.inv_shell, dot(d, d));
        v = v.map(|c| c * factor);
    }
    v
}

fn intensity(local: &Local, d2: f32, l2: f32) -> f32 {
    let strength = local.strength * fade(local.reach2, local.inv_shell, d2);
    strength / ((local.softening + d2) * (l2 + local.core2).sqrt())
}

fn fade(reach2: f32, inv_shell: f32, d2: f32) -> f32 {
    if inv_shell == 0.0 {
        return 1.0;
    }
    let u = ((reach2 - d2) * inv_shell).clamp(0.0, 1.0);
    u * u * (3.0 - 2.0 * u)
}

fn varying(field: &Varying, p: [f32; 3]) -> f32 {
    let height = (field.height + field.gradient * p[1]).max(0.0);
    if field.modulation == 0.0 {
        return height;
    }
    let phase = field.phase + dot(field.wave_vector, p);
    height * (1.0 - field.modulation + field.modulation * crate::math::sin_f64(f64::from(phase)) as f32)
}

fn from_center(center: [f32; 3], p: [f32; 3]) -> [f32; 3] {
    [p[0] - center[0], p[1] - center[1], p[2] - center[2]]
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn add_scaled(v: [f32; 3], s: f32, d: [f32; 3]) -> [f32; 3] {
    [v[0] + s * d[0], v[1] + s * d[1], v[2] + s * d[2]]
}
