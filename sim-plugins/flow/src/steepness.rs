//! How fast the flow changes from place to place: an upper bound of ‖∇V‖, from which a model chooses how far
//! a step may go.
//!
//! For a local field s(p) (p − C), with s as [`crate::packed`] evaluates it, a = d²/(|Φ|/Φ_max + d²) and b =
//! l²/(l² + core²): the gradient's greatest stretch is s for what turns about C, and |1 − 2a − b| s along the
//! ray. Both shares grow with the distance and s falls, so the greatest steepness in a ball is bounded by s
//! at its nearest point and a and b at its farthest.

use fearless_simd::{Select, Simd};

use crate::{
    packed::{Local, Packed, Varying, cross, fade, from_center, in_shell, length2, splat3},
    simd::{Lanes, mul_add},
};

/// Greatest steepness [1/s] that is told apart: sums and squares of it stay finite.
const GREATEST: f32 = 1e12;

/// An upper bound of ‖∇V‖ [1/s] in balls of radius `reach` [m] around points [m, relative to the origin of
/// `packed`]; with a reach of zero, at the points. The same bytes at every level.
#[inline(always)]
pub fn steepness<S: Simd, V: Lanes<S>>(simd: S, packed: &Packed, p: [V; 3], reach: V) -> V {
    let mut sum = V::splat(simd, 0.0);
    for field in &packed.varying {
        sum += of_varying(simd, field, p[1], reach);
    }
    for source in &packed.sources {
        let (_, d2) = from_center(simd, source.center, p);
        let ball = Ball::around(simd, d2, reach);
        sum += of_local(simd, source, ball, ball, 0.0);
    }
    for whirlwind in &packed.whirlwinds {
        let (d, d2) = from_center(simd, whirlwind.local.center, p);
        let w2 = length2(cross(d, splat3(simd, whirlwind.axis)));
        let (ball, off_axis) = (Ball::around(simd, d2, reach), Ball::around(simd, w2, reach));
        // Along the axis the fall with d adds at most a.
        sum += of_local(simd, &whirlwind.local, ball, off_axis, 1.0);
    }
    for shelter in &packed.shelters {
        let (_, d2) = from_center(simd, shelter.center, p);
        let ball = Ball::around(simd, d2, reach);
        // What calms the water by up to `strength` within its shell: |V| · strength · |∇fade|.
        let speed = V::splat(simd, packed.fastest * shelter.strength.abs());
        sum += speed * shell_slope(simd, shelter.reach2, shelter.inv_shell, ball) * ball.far;
    }
    sum.min(V::splat(simd, GREATEST))
}

/// Least and greatest distance of a ball's points from a centre or an axis [m].
#[derive(Clone, Copy)]
struct Ball<V> {
    near: V,
    far: V,
}

impl<V> Ball<V> {
    #[inline(always)]
    fn around<S: Simd>(simd: S, d2: V, reach: V) -> Self
    where
        V: Lanes<S>,
    {
        let d = d2.sqrt();
        Self { near: (d - reach).max(V::splat(simd, 0.0)), far: d + reach }
    }
}

/// `ball`: distances from C; `arm`: from C, or from a whirlwind's axis, whose field turns about it.
#[inline(always)]
fn of_local<S: Simd, V: Lanes<S>>(simd: S, local: &Local, ball: Ball<V>, arm: Ball<V>, along_axis: f32) -> V {
    let one = V::splat(simd, 1.0);
    let (near2, far2, arm2) = (ball.near * ball.near, ball.far * ball.far, arm.near * arm.near);
    let softening = V::splat(simd, local.softening);
    let core2 = V::splat(simd, local.core2);
    let s = V::splat(simd, local.strength.abs()) / ((near2 + softening) * (arm2 + core2).sqrt());
    let a = far2 / (far2 + softening);
    let arm_far2 = arm.far * arm.far;
    let b = arm_far2 / (arm_far2 + core2);
    let stretch = (a + a + b - one).max(one);
    let stretch = mul_add(a, V::splat(simd, along_axis), stretch);
    if local.inv_shell == 0.0 {
        return s * stretch;
    }
    let kept = fade(simd, local.reach2, local.inv_shell, near2);
    let falling = shell_slope(simd, local.reach2, local.inv_shell, ball) * far2;
    s * mul_add(kept, stretch, falling)
}

/// |∇fade| / d at most in a ball [1/m²]: 12 u (1 − u) / shell, and u (1 − u) is a quarter at most.
#[inline(always)]
fn shell_slope<S: Simd, V: Lanes<S>>(simd: S, reach2: f32, inv_shell: f32, ball: Ball<V>) -> V {
    if inv_shell == 0.0 {
        return V::splat(simd, 0.0);
    }
    let (zero, one) = (V::splat(simd, 0.0), V::splat(simd, 1.0));
    let inner = in_shell(simd, reach2, inv_shell, ball.near * ball.near);
    let outer = in_shell(simd, reach2, inv_shell, ball.far * ball.far);
    let steepest = V::splat(simd, 3.0 * inv_shell);
    inner.simd_gt(zero).select(outer.simd_lt(one).select(steepest, zero), zero)
}

/// A field that travels, or grows with height: Φ (m |k| h + |g|) at most, with h = 1 + g (y − level).
#[inline(always)]
fn of_varying<S: Simd, V: Lanes<S>>(simd: S, field: &Varying, y: V, reach: V) -> V {
    let (speed, rate) = (length(field.velocity), field.modulation.abs() * length(field.wave_vector));
    let height = mul_add(V::splat(simd, field.gradient), y, V::splat(simd, field.height));
    let height = mul_add(V::splat(simd, field.gradient.abs()), reach, height).max(V::splat(simd, 0.0));
    mul_add(
        height,
        V::splat(simd, speed * rate),
        V::splat(simd, speed * field.gradient.abs() * field.swing()),
    )
}

/// A speed [m/s] that the sum of all fields nowhere exceeds near the object, where none grows with height.
pub(crate) fn greatest_speed(packed: &Packed) -> f32 {
    let locals = packed.sources.iter().chain(packed.whirlwinds.iter().map(|whirlwind| &whirlwind.local));
    length(packed.base)
        + packed
            .varying
            .iter()
            .map(|field| length(field.velocity) * field.height.abs() * field.swing())
            .sum::<f32>()
        + locals.map(|local| local.strength.abs() / local.softening).sum::<f32>()
}

fn length(v: [f32; 3]) -> f32 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}
