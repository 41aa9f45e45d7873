//! The flow as one object feels it, ready for a kernel: f32 positions relative to the object's origin, kinds
//! apart.
//!
//! Singularities with the point C, nominal intensity Φ, greatest intensity Φ_max and d = |p − C| (Aliaga &
//! Larboulette 2009, §2). The denominator takes |Φ| and the sign stands outside, so that an intensity keyed
//! through zero passes no pole:
//!
//! - source (2) and hole (3): S = Φ / (|Φ|/Φ_max + d²) · (p − C) / √(d² + core²)
//! - whirlwind (4): W = Φ / (|Φ|/Φ_max + d²) · w / √(|w|² + core²), w = (p − C) × R
//! - directional (5): D = Φ (1 − m + m sin(phase + k·p)) max(0, 1 + g (y − level)) v
//! - shelter: multiplies the sum of all by 1 − strength · fade
//!
//! A local field with a reach is multiplied by fade(d), 1 up to the share `fade` of its reach and exactly 0
//! beyond it.
//!
//! Where the direction is undefined the contribution is the zero vector: at C, and for a whirlwind within
//! [`AXIS_CONE`] of its axis. Without a core the length just beside it is Φ_max.

use fearless_simd::{Select, Simd, f32x8, f32x16};
use reef_abi::{self as abi, Flow};

use crate::{
    field::{Field, Sphere},
    math,
    simd::{Lanes, mul_add},
    steepness,
};

/// A whirlwind's axis is as wide as this [rad, seen from C]: nearer to it the direction of (p − C) × R is
/// rounding.
pub const AXIS_CONE: f32 = 9.536_743e-7;

/// Smallest core² [m²] that a kernel sees. A core of 10⁻¹⁵ m changes no figure anywhere but at C itself,
/// where it makes the zero vector out of 0/0 without a comparison.
const CORE2_FLOOR: f32 = 1e-30;
/// Smallest |Φ|/Φ_max [m²] that a kernel sees: keeps the product of both floors above the denormal numbers.
const SOFTENING_FLOOR: f32 = 1e-20;
/// Greatest Φ_max [m/s] that a kernel sees: keeps the quotient at C finite.
const PEAK_CEILING: f32 = 1e20;

/// What all local kinds share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Local {
    /// C relative to the origin [m].
    pub(crate) center: [f32; 3],
    /// Signed Φ [m³/s].
    pub(crate) strength: f32,
    /// |Φ| / Φ_max [m²].
    pub(crate) softening: f32,
    /// core² [m²].
    pub(crate) core2: f32,
    /// reach² [m²]; infinite where no point of the object lies in the fading shell.
    pub(crate) reach2: f32,
    /// 1 / (reach² − (fade · reach)²) [1/m²].
    pub(crate) inv_shell: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Whirlwind {
    pub(crate) local: Local,
    /// R, unit.
    pub(crate) axis: [f32; 3],
}

/// A directional field whose speed varies over the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Varying {
    /// Φ v [m/s].
    pub(crate) velocity: [f32; 3],
    pub(crate) modulation: f32,
    /// At the origin [rad].
    pub(crate) phase: f32,
    /// k [rad/m].
    pub(crate) wave_vector: [f32; 3],
    /// g [1/m].
    pub(crate) gradient: f32,
    /// 1 + g (y − level) at the origin.
    pub(crate) height: f32,
}

impl Varying {
    /// What modulation makes of its velocity at most: |1 − m + m sin|.
    pub(crate) fn swing(&self) -> f32 {
        (1.0 - self.modulation).abs() + self.modulation.abs()
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shelter {
    pub(crate) center: [f32; 3],
    pub(crate) strength: f32,
    pub(crate) reach2: f32,
    pub(crate) inv_shell: f32,
}

/// The flow primitives that act on one object. Refilling it allocates nothing once it has grown to its
/// greatest size.
#[derive(Clone, Debug, Default)]
pub struct Packed {
    /// Sum of the directional fields that are the same everywhere on the object [m/s].
    pub(crate) base: [f32; 3],
    pub(crate) sources: Vec<Local>,
    pub(crate) whirlwinds: Vec<Whirlwind>,
    pub(crate) varying: Vec<Varying>,
    pub(crate) shelters: Vec<Shelter>,
    /// Where there are shelters: a speed [m/s] that the water they calm does not exceed.
    pub(crate) fastest: f32,
    /// While filling: the sum in f64.
    base_sum: [f64; 3],
    /// Room for [`Field`]'s queries.
    pub(crate) candidates: Vec<u32>,
    local: u32,
    left_out: u32,
}

impl Packed {
    /// Still water.
    pub fn new() -> Self {
        Self::default()
    }

    /// Makes room for whatever [`Packed::fill_near`] may find, so that no later fill of this field's size
    /// allocates: for those of several that may not be filled in every step.
    pub fn make_room(&mut self, field: &Field) {
        fn room<T>(list: &mut Vec<T>, count: usize) {
            list.reserve(count.saturating_sub(list.len()));
        }
        let count = field.flows().len();
        room(&mut self.sources, count);
        room(&mut self.whirlwinds, count);
        room(&mut self.varying, count);
        room(&mut self.shelters, count);
        room(&mut self.candidates, field.most_candidates());
    }

    /// Takes all primitives of `flows`, in their order, but what `owner` (0: nobody) emits itself, relative
    /// to `origin` [m].
    pub fn fill(&mut self, flows: &[Flow], origin: [f64; 3], owner: u64) {
        self.begin();
        for flow in flows {
            self.push(flow, origin, owner, None);
        }
        self.end();
    }

    /// Takes what acts inside `bounds` alone: the same bytes as [`Packed::fill`] for every point in there,
    /// for less work. A point outside of `bounds` may miss some of the flow.
    pub fn fill_near(&mut self, field: &Field, bounds: Sphere, origin: [f64; 3], owner: u64) {
        self.begin();
        let mut candidates = core::mem::take(&mut self.candidates);
        field.candidates(bounds, &mut candidates);
        for &index in &candidates {
            if let Some(flow) = field.flows().get(index as usize) {
                self.push(flow, origin, owner, Some(bounds));
            }
        }
        let seen = u32::try_from(candidates.len()).unwrap_or(u32::MAX);
        self.left_out += field.count().saturating_sub(seen);
        self.candidates = candidates;
        self.end();
    }

    /// Whether streamlines bend sharply anywhere: sources, holes or whirlwinds act.
    pub fn is_singular(&self) -> bool {
        !self.sources.is_empty() || !self.whirlwinds.is_empty()
    }

    /// Whether sources or holes act: whether water comes from nowhere, or goes there.
    pub fn has_sources(&self) -> bool {
        !self.sources.is_empty()
    }

    /// Lets currents that travel fit a box of an extent [m] around the origin: a whole number of wavelengths
    /// along each axis, the nearest. Then they do the same at opposite walls, and who leaves through one and
    /// enters through the other goes on as before. In the box's middle nothing changes.
    pub fn fit(&mut self, extent: [f64; 3]) {
        for field in &mut self.varying {
            for (k, extent) in field.wave_vector.iter_mut().zip(extent) {
                let one = core::f64::consts::TAU / extent;
                *k = ((f64::from(*k) / one).round() * one) as f32;
            }
        }
    }

    /// Local primitives that are evaluated at each point of the object.
    pub fn evaluated(&self) -> u32 {
        self.local
    }

    /// Local primitives whose evaluation at each point the bounding sphere saved.
    pub fn saved(&self) -> u32 {
        self.left_out
    }

    /// Whether no primitive acts: the water stands still.
    pub fn is_still(&self) -> bool {
        self.base == [0.0; 3]
            && self.sources.is_empty()
            && self.whirlwinds.is_empty()
            && self.varying.is_empty()
    }

    /// The sum of the directional fields that are the same everywhere on the object [m/s]: what the velocity
    /// is where nothing else acts.
    pub fn uniform(&self) -> [f32; 3] {
        self.base
    }

    /// Whether the velocity is [`Packed::uniform`] at every point.
    pub fn is_uniform(&self) -> bool {
        let sheltered = !self.shelters.is_empty() && self.base != [0.0; 3];
        self.sources.is_empty() && self.whirlwinds.is_empty() && self.varying.is_empty() && !sheltered
    }

    fn begin(&mut self) {
        self.base_sum = [0.0; 3];
        self.sources.clear();
        self.whirlwinds.clear();
        self.varying.clear();
        self.shelters.clear();
        self.local = 0;
        self.left_out = 0;
    }

    fn end(&mut self) {
        self.base = self.base_sum.map(|v| v as f32 + 0.0);
        self.local = u32::try_from(self.sources.len() + self.whirlwinds.len() + self.shelters.len())
            .unwrap_or(u32::MAX);
        self.fastest = if self.shelters.is_empty() { 0.0 } else { steepness::greatest_speed(self) };
    }

    /// One primitive. What is not finite or without a peak (the host refuses it earlier), or of unknown kind
    /// (a later contract's), does not act.
    fn push(&mut self, flow: &Flow, origin: [f64; 3], owner: u64, bounds: Option<Sphere>) {
        if owner != 0 && flow.owner == owner {
            return;
        }
        if !acts(flow) {
            return;
        }
        if flow.kind == abi::FLOW_DIRECTIONAL {
            return self.push_directional(flow, origin);
        }
        let shell = Shell::of(flow);
        let faded = match bounds {
            None => true,
            Some(bounds) => match shell.against(flow, bounds) {
                Place::Outside => {
                    self.left_out += 1;
                    return;
                }
                Place::Fading => true,
                Place::Inside => false,
            },
        };
        let (reach2, inv_shell) = if faded { (shell.reach2, shell.inv_shell) } else { UNLIMITED };
        let center = core::array::from_fn(|i| (flow.position[i] - origin[i]) as f32);
        let strength = if flow.kind == abi::FLOW_HOLE { -flow.strength } else { flow.strength };
        if flow.kind == abi::FLOW_SHELTER {
            self.shelters.push(Shelter { center, strength, reach2, inv_shell });
            return;
        }
        let local = Local {
            center,
            strength,
            softening: (strength.abs() / flow.peak.min(PEAK_CEILING)).max(SOFTENING_FLOOR),
            core2: (flow.core * flow.core).max(CORE2_FLOOR),
            reach2,
            inv_shell,
        };
        if flow.kind == abi::FLOW_WHIRLWIND {
            self.whirlwinds.push(Whirlwind { local, axis: flow.axis });
        } else {
            self.sources.push(local);
        }
    }

    fn push_directional(&mut self, flow: &Flow, origin: [f64; 3]) {
        let wave: [f64; 3] = flow.wave_vector.map(f64::from);
        let modulation = f64::from(flow.modulation);
        let phase = f64::from(flow.phase) + wave[0] * origin[0] + wave[1] * origin[1] + wave[2] * origin[2];
        let gradient = f64::from(flow.gradient);
        let height = 1.0 + gradient * (origin[1] - f64::from(flow.level));
        let waving = flow.modulation != 0.0 && flow.wave_vector != [0.0; 3];
        if waving || flow.gradient != 0.0 {
            self.varying.push(Varying {
                velocity: flow.axis.map(|v| flow.strength * v),
                modulation: flow.modulation,
                phase: math::reduce_phase(phase) as f32,
                wave_vector: if waving { flow.wave_vector } else { [0.0; 3] },
                gradient: flow.gradient,
                height: height as f32,
            });
            return;
        }
        let speed = f64::from(flow.strength) * (1.0 - modulation + modulation * math::sin_f64(phase));
        for i in 0..3 {
            self.base_sum[i] += speed * f64::from(flow.axis[i]);
        }
    }
}

/// Whether a primitive is one that the kernels know and can be evaluated without a NaN.
pub(crate) fn acts(flow: &Flow) -> bool {
    let numbers = [
        flow.strength,
        flow.core,
        flow.reach,
        flow.fade,
        flow.modulation,
        flow.phase,
        flow.gradient,
        flow.level,
    ];
    let finite = numbers.iter().chain(&flow.axis).chain(&flow.wave_vector).all(|v| v.is_finite())
        && flow.position.iter().all(|v| v.is_finite());
    if !finite || flow.strength == 0.0 {
        return false;
    }
    match flow.kind {
        abi::FLOW_SOURCE | abi::FLOW_HOLE | abi::FLOW_WHIRLWIND => flow.peak.is_finite() && flow.peak > 0.0,
        abi::FLOW_DIRECTIONAL | abi::FLOW_SHELTER => true,
        _ => false,
    }
}

/// reach² and 1/shell of a field that fades nowhere on the object.
const UNLIMITED: (f32, f32) = (f32::INFINITY, 0.0);

/// Where a local field fades: u = clamp((reach² − d²) / (reach² − start²), 0, 1), fade = u² (3 − 2u). Smooth,
/// and no root.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shell {
    reach2: f32,
    inv_shell: f32,
}

enum Place {
    Outside,
    Fading,
    Inside,
}

impl Shell {
    pub(crate) fn of(flow: &Flow) -> Self {
        if flow.reach <= 0.0 {
            return Self { reach2: UNLIMITED.0, inv_shell: UNLIMITED.1 };
        }
        let start = flow.fade.clamp(0.0, 1.0) * flow.reach;
        let reach2 = flow.reach * flow.reach;
        // A shell without thickness is a hard edge; the cap keeps the factor finite.
        let inv_shell = (1.0 / (reach2 - start * start)).min(1e30);
        Self { reach2, inv_shell }
    }

    /// Where a sphere lies. The margins are wider than what rounding moves a point by.
    fn against(self, flow: &Flow, bounds: Sphere) -> Place {
        if flow.reach <= 0.0 {
            return Place::Inside;
        }
        let reach = f64::from(flow.reach);
        let start = f64::from(flow.fade.clamp(0.0, 1.0)) * reach;
        let distance = bounds.distance_to_center(flow.position);
        let margin = 1e-5 * (reach + bounds.radius + distance);
        if distance - bounds.radius > reach + margin {
            Place::Outside
        } else if distance + bounds.radius < start - margin {
            Place::Inside
        } else {
            Place::Fading
        }
    }
}

/// Velocity of the water [m/s] at eight points [m, relative to the origin of `packed`].
///
/// The sum (1) in fixed order: directional fields, sources and holes, whirlwinds, each in the host's order;
/// shelters last. The result is the same bytes at every level.
#[inline(always)]
pub fn velocity8<S: Simd>(simd: S, packed: &Packed, x: f32x8<S>, y: f32x8<S>, z: f32x8<S>) -> [f32x8<S>; 3] {
    velocity(simd, packed, x, y, z)
}

/// As [`velocity8`], at sixteen points: the same bytes.
#[inline(always)]
pub fn velocity16<S: Simd>(
    simd: S,
    packed: &Packed,
    x: f32x16<S>,
    y: f32x16<S>,
    z: f32x16<S>,
) -> [f32x16<S>; 3] {
    velocity(simd, packed, x, y, z)
}

/// As [`velocity8`], for a kernel that is written for both widths: the same bytes.
#[inline(always)]
pub fn velocity<S: Simd, V: Lanes<S>>(simd: S, packed: &Packed, x: V, y: V, z: V) -> [V; 3] {
    let mut v = splat3(simd, packed.base);
    for field in &packed.varying {
        v = add_varying(simd, field, [x, y, z], v);
    }
    for source in &packed.sources {
        let (d, d2) = from_center(simd, source.center, [x, y, z]);
        let speed = intensity(simd, source, d2, d2);
        v = add_scaled(v, speed, d);
    }
    for whirlwind in &packed.whirlwinds {
        let local = &whirlwind.local;
        let (d, d2) = from_center(simd, local.center, [x, y, z]);
        let axis = splat3(simd, whirlwind.axis);
        let w = cross(d, axis);
        let w2 = length2(w);
        let speed = intensity(simd, local, d2, w2);
        let on_axis = w2.simd_le(d2 * V::splat(simd, AXIS_CONE * AXIS_CONE));
        let speed = on_axis.select(V::splat(simd, 0.0), speed);
        v = add_scaled(v, speed, w);
    }
    for shelter in &packed.shelters {
        let factor = calm(simd, shelter, [x, y, z]);
        v = [v[0] * factor, v[1] * factor, v[2] * factor];
    }
    v
}

/// What sources and holes make of water at many points, or take away [1/s]: ∇·V of their fields, calmed as
/// the water is in a shelter. For d² = q a local field is s(q) (p − C), whose divergence is 3 s + 2 q s′. The
/// same bytes at every level.
#[inline(always)]
pub fn divergence<S: Simd, V: Lanes<S>>(simd: S, packed: &Packed, x: V, y: V, z: V) -> V {
    let mut sum = V::splat(simd, 0.0);
    for source in &packed.sources {
        let (_, d2) = from_center(simd, source.center, [x, y, z]);
        sum += spread(simd, source, d2);
    }
    for shelter in &packed.shelters {
        sum *= calm(simd, shelter, [x, y, z]);
    }
    sum
}

/// 3 s + 2 q s′ of one source: s (3 − 2q/(|Φ|/Φ_max + q) − q/(q + core²)), and what its fading takes.
#[inline(always)]
fn spread<S: Simd, V: Lanes<S>>(simd: S, local: &Local, d2: V) -> V {
    let (soft, round) = (d2 + V::splat(simd, local.softening), d2 + V::splat(simd, local.core2));
    let shares = V::splat(simd, 3.0) - (d2 + d2) / soft - d2 / round;
    let sum = intensity(simd, local, d2, d2) * shares;
    if local.inv_shell == 0.0 {
        return sum;
    }
    let u = in_shell(simd, local.reach2, local.inv_shell, d2);
    let steep = u * (V::splat(simd, 1.0) - u) * V::splat(simd, 6.0 * local.inv_shell * local.strength);
    sum - (d2 + d2) * steep / (soft * round.sqrt())
}

/// What a shelter leaves of the flow.
#[inline(always)]
fn calm<S: Simd, V: Lanes<S>>(simd: S, shelter: &Shelter, p: [V; 3]) -> V {
    let (_, d2) = from_center(simd, shelter.center, p);
    let fade = fade(simd, shelter.reach2, shelter.inv_shell, d2);
    mul_add(V::splat(simd, -shelter.strength), fade, V::splat(simd, 1.0))
}

/// A vector in all lanes. Written out: a closure, as `map` takes it, does not always inherit the vector
/// instructions of where it stands, and then costs a call an operation.
#[inline(always)]
pub(crate) fn splat3<S: Simd, V: Lanes<S>>(simd: S, [x, y, z]: [f32; 3]) -> [V; 3] {
    [V::splat(simd, x), V::splat(simd, y), V::splat(simd, z)]
}

/// v + speed · d, rounded twice on purpose: fused, two equal sources would leave a rounding behind at their
/// midpoint.
#[inline(always)]
fn add_scaled<S: Simd, V: Lanes<S>>(v: [V; 3], speed: V, d: [V; 3]) -> [V; 3] {
    [v[0] + speed * d[0], v[1] + speed * d[1], v[2] + speed * d[2]]
}

/// p − C and its square.
#[inline(always)]
pub(crate) fn from_center<S: Simd, V: Lanes<S>>(simd: S, center: [f32; 3], p: [V; 3]) -> ([V; 3], V) {
    let d = [
        p[0] - V::splat(simd, center[0]),
        p[1] - V::splat(simd, center[1]),
        p[2] - V::splat(simd, center[2]),
    ];
    (d, length2(d))
}

#[inline(always)]
pub(crate) fn length2<S: Simd, V: Lanes<S>>(d: [V; 3]) -> V {
    mul_add(d[2], d[2], mul_add(d[1], d[1], d[0] * d[0]))
}

#[inline(always)]
pub(crate) fn cross<S: Simd, V: Lanes<S>>(a: [V; 3], b: [V; 3]) -> [V; 3] {
    [
        mul_add(a[1], b[2], -(a[2] * b[1])),
        mul_add(a[2], b[0], -(a[0] * b[2])),
        mul_add(a[0], b[1], -(a[1] * b[0])),
    ]
}

/// Φ / ((|Φ|/Φ_max + d²) √(l² + core²)): times a vector of square l² it is the field. One root and one
/// division in all.
#[inline(always)]
fn intensity<S: Simd, V: Lanes<S>>(simd: S, local: &Local, d2: V, l2: V) -> V {
    let length = (l2 + V::splat(simd, local.core2)).sqrt();
    let below = (d2 + V::splat(simd, local.softening)) * length;
    let mut strength = V::splat(simd, local.strength);
    if local.inv_shell != 0.0 {
        strength *= fade(simd, local.reach2, local.inv_shell, d2);
    }
    strength / below
}

/// 1 inside of the shell, 0 outside, u² (3 − 2u) in it.
#[inline(always)]
pub(crate) fn fade<S: Simd, V: Lanes<S>>(simd: S, reach2: f32, inv_shell: f32, d2: V) -> V {
    if inv_shell == 0.0 {
        return V::splat(simd, 1.0);
    }
    let u = in_shell(simd, reach2, inv_shell, d2);
    u * u * mul_add(u, V::splat(simd, -2.0), V::splat(simd, 3.0))
}

/// u: 1 at the inner side of the shell and inside of it, 0 at its outer side and beyond.
#[inline(always)]
pub(crate) fn in_shell<S: Simd, V: Lanes<S>>(simd: S, reach2: f32, inv_shell: f32, d2: V) -> V {
    let u = (V::splat(simd, reach2) - d2) * V::splat(simd, inv_shell);
    u.max(V::splat(simd, 0.0)).min(V::splat(simd, 1.0))
}

/// A directional field (5) that travels or grows with height.
#[inline(always)]
fn add_varying<S: Simd, V: Lanes<S>>(simd: S, field: &Varying, p: [V; 3], v: [V; 3]) -> [V; 3] {
    let mut factor =
        mul_add(V::splat(simd, field.gradient), p[1], V::splat(simd, field.height)).max(V::splat(simd, 0.0));
    if field.modulation != 0.0 {
        let k = splat3(simd, field.wave_vector);
        let phase = mul_add(k[0], p[0], V::splat(simd, field.phase));
        let phase = mul_add(k[2], p[2], mul_add(k[1], p[1], phase));
        let m = V::splat(simd, field.modulation);
        factor *= mul_add(m, math::sin(phase), V::splat(simd, 1.0) - m);
    }
    let [vx, vy, vz] = field.velocity;
    add_scaled(v, factor, [V::splat(simd, vx), V::splat(simd, vy), V::splat(simd, vz)])
}
