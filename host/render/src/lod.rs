//! Levels of detail of a fibre: how many rings and sides it gets for its size in the picture. The twin of
//! `shaders/fibre.glsl` and of the choice in `shaders/fibre_rings.comp`.
//!
//! Two things are chosen by themselves: rings along the fibre by its length in pixels, sides of a ring by its
//! radius in pixels. Toward a switch, pairs of rings (or sides) slide together until the finer level is the
//! coarser one, so that nothing jumps. The last side level is a ribbon that faces the eye.

use super::quality::Quality;

/// Rings at full detail.
pub const RINGS: u32 = 16;
/// Levels of rings: 16, 8, 4.
pub const RING_LEVELS: u32 = 3;
/// Sides that stand for a ribbon.
pub const RIBBON: u32 = 2;

/// A fibre is a ribbon below this radius, in side errors: its edges fade, and those of a tube do not.
pub const RIBBON_ERRORS: f32 = 6.0;
/// A lit ribbon's edges fade where its radius is below this somewhere [px].
pub const THIN_RADIUS: f32 = 0.75;
/// A ribbon's edge fades over twice this [px].
pub const EDGE: f32 = 0.75;
/// The same of lit ribbons.
pub const LIT_EDGE: f32 = 0.5;

/// Where levels switch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// A coarser ring level with n segments is chosen for fibres shorter than n² times this [px]: cut into n
    /// chords, a fibre that bends by an angle a strays from its curve by a / 8n² of its length.
    pub ring_step: f32,
    /// A coarser side level is chosen when its silhouette errs by less than this [px].
    pub side_error: f32,
    /// A fibre of one colour that is thinner than this [px] is a ribbon that is lit at its rings; 0: none is.
    pub lit_ribbon: f32,
    /// A coarser level of a mesh is chosen where it errs by less than this [px].
    pub mesh_error: f32,
    /// A mesh that is smaller than this is lit at its vertices [px]; 0: none is.
    pub lit_mesh: f32,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self { ring_step: 2.0, side_error: 0.4, lit_ribbon: 0.0, mesh_error: 0.4, lit_mesh: 0.0 }
    }
}

impl Thresholds {
    /// Those of a quality.
    pub fn of(quality: Quality) -> Self {
        match quality {
            Quality::Low => {
                Self { ring_step: 4.0, side_error: 0.4, lit_ribbon: 6.0, mesh_error: 1.5, lit_mesh: 48.0 }
            }
            Quality::High => Self::default(),
        }
    }
}

/// What was chosen for one fibre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detail {
    /// 0: 16 rings, 1: 8, 2: 4.
    pub ring_level: u32,
    /// Halvings of the sides; each ends at the ribbon.
    pub side_level: u32,
    /// 0: this ring level, 1: the next coarser.
    pub ring_morph: f32,
    /// 0: this side level, 1: the next coarser.
    pub side_morph: f32,
}

impl Detail {
    /// Everything.
    pub const FULL: Detail = Detail { ring_level: 0, side_level: 0, ring_morph: 0.0, side_morph: 0.0 };

    /// The choice for a fibre of this length and radius [px]. `cap`: its end is a disc.
    pub fn choose(length_px: f32, radius_px: f32, sides: u32, cap: bool, limits: &Thresholds) -> Detail {
        let mut detail = Detail::FULL;
        let ring_limit = |level: u32| limits.ring_step * ((body_rings(level, cap) - 1) as f32).powi(2);
        while detail.ring_level + 1 < RING_LEVELS && length_px < ring_limit(detail.ring_level + 1) {
            detail.ring_level += 1;
        }
        if detail.ring_level + 1 < RING_LEVELS {
            detail.ring_morph = morph(length_px, ring_limit(detail.ring_level + 1));
        }
        let mut sides = sides;
        while sides > RIBBON {
            let fewer = fewer_sides(sides);
            // The silhouette of a polygon with n sides errs by half of r (1 - cos(pi / n)).
            let limit = if fewer == RIBBON {
                limits.side_error * RIBBON_ERRORS
            } else {
                2.0 * limits.side_error / (1.0 - (std::f32::consts::PI / fewer as f32).cos())
            };
            if radius_px >= limit {
                if fewer > RIBBON {
                    detail.side_morph = morph(radius_px, limit);
                }
                break;
            }
            sides = fewer;
            detail.side_level += 1;
        }
        detail
    }

    /// Rings of this level.
    pub fn rings(&self) -> u32 {
        RINGS >> self.ring_level
    }

    /// Vertices around a ring of a fibre that has `full` at full detail.
    pub fn sides(&self, full: u32) -> u32 {
        side_count(full, self.side_level)
    }

    /// Vertices of a fibre.
    pub fn vertices(&self, full: u32) -> u32 {
        self.rings() * self.sides(full)
    }

    /// Indices of a fibre.
    pub fn indices(&self, full: u32) -> u32 {
        let sides = self.sides(full);
        (self.rings() - 1) * if sides == RIBBON { 1 } else { sides } * 6
    }
}

/// 0 far from the switch at `limit`, 1 at it.
fn morph(value: f32, limit: f32) -> f32 {
    ((limit * 1.5 - value) / (limit * 0.5)).clamp(0.0, 1.0)
}

fn fewer_sides(sides: u32) -> u32 {
    if sides <= 4 { RIBBON } else { sides.div_ceil(2) }
}

/// Vertices around a ring after `level` halvings.
pub fn side_count(sides: u32, level: u32) -> u32 {
    (0..level).fold(sides, |n, _| fewer_sides(n))
}

/// Rings on the chain itself; the others close its end.
pub fn body_rings(level: u32, cap: bool) -> u32 {
    let table = if cap { [9, 5, 3] } else { [13, 7, 3] };
    table[level.min(RING_LEVELS - 1) as usize]
}

/// Where ring `k` of a level lies: 0 at the root, 1 at the last node, 2 at the end of the cap.
pub fn ring_position(level: u32, k: u32, cap: bool) -> f32 {
    let body = body_rings(level, cap);
    if k < body {
        k as f32 / (body - 1) as f32
    } else {
        1.0 + (k + 1 - body) as f32 / ((RINGS >> level) - body) as f32
    }
}

/// An inscribed polygon is thinner than its circle; this factor gives it the circle's mean width.
pub fn polygon_scale(sides: u32) -> f32 {
    if sides <= RIBBON {
        return 1.0;
    }
    let a = std::f32::consts::PI / sides as f32;
    a / a.sin()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZES: [f32; 12] = [0.05, 0.2, 0.5, 0.89, 0.95, 1.5, 2.0, 2.1, 3.0, 8.0, 30.0, 200.0];

    #[test]
    fn a_greater_fibre_never_gets_fewer_rings_sides_or_vertices() {
        let limits = Thresholds::default();
        for sides in [3, 5, 8, 12, 32, 64] {
            for cap in [false, true] {
                let mut last = 0;
                for n in 1..4000 {
                    let px = n as f32 * 0.05;
                    let detail = Detail::choose(px * 18.0, px, sides, cap, &limits);
                    let vertices = detail.vertices(sides);
                    assert!(vertices >= last, "{px} px: {vertices} after {last}");
                    last = vertices;
                }
                assert_eq!(last, RINGS * sides, "full detail in the end");
            }
        }
    }

    #[test]
    fn small_round_fibres_become_ribbons_and_great_ones_keep_all_sides() {
        let limits = Thresholds::default();
        for px in SIZES {
            let detail = Detail::choose(px * 18.0, px, 8, false, &limits);
            // A ribbon below six errors; four sides up to 2 · 0.4 / (1 − cos 45°).
            assert_eq!(detail.sides(8) == RIBBON, px < 2.4, "{px} px");
            assert_eq!(detail.sides(8) == 8, px > 2.74, "{px} px");
        }
    }

    #[test]
    fn at_a_switch_the_finer_level_has_become_the_coarser_one() {
        let limits = Thresholds::default();
        for cap in [false, true] {
            for level in 0..RING_LEVELS - 1 {
                let at = limits.ring_step * ((body_rings(level + 1, cap) - 1) as f32).powi(2);
                let finer = Detail::choose(at * 1.0001, 100.0, 8, cap, &limits);
                let coarser = Detail::choose(at * 0.9999, 100.0, 8, cap, &limits);
                assert_eq!((finer.ring_level, coarser.ring_level), (level, level + 1));
                // 1.0001 of the limit leaves 2e-4 of the way to go.
                assert!(finer.ring_morph > 0.999);
                if coarser.ring_level + 1 < RING_LEVELS {
                    assert!(coarser.ring_morph < 1.0, "the next switch is not reached");
                }
            }
        }
    }

    #[test]
    fn rings_run_from_the_root_over_the_last_node_to_the_end_and_pairs_slide_to_coarser_rings() {
        for cap in [false, true] {
            for level in 0..RING_LEVELS {
                let rings = RINGS >> level;
                let at: Vec<f32> = (0..rings).map(|k| ring_position(level, k, cap)).collect();
                assert_eq!((at[0], at[rings as usize - 1]), (0.0, 2.0));
                assert!(at.windows(2).all(|w| w[0] < w[1]));
                assert!(at.contains(&1.0), "a ring lies on the last node");
                if level + 1 < RING_LEVELS {
                    let slid: Vec<f32> = (0..rings).map(|k| ring_position(level + 1, k >> 1, cap)).collect();
                    assert!(slid.windows(2).all(|w| w[0] <= w[1]));
                    assert_eq!((slid[0], slid[rings as usize - 1]), (0.0, 2.0));
                }
            }
        }
    }

    #[test]
    fn halving_ends_at_the_ribbon_from_any_number_of_sides() {
        for sides in 3..=64 {
            let mut level = 0;
            while side_count(sides, level) != RIBBON {
                assert!(side_count(sides, level + 1) < side_count(sides, level));
                level += 1;
                assert!(level < 8);
            }
        }
    }
}
