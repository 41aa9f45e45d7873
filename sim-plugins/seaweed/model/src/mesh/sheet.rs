//! Flat limbs: blades with ruffled edges and a midrib, ribbons, straps that fork.

use core::f64::consts::TAU;

use glam::{DQuat, DVec3};
use reef_flow::{
    math::{cos_sin_f64, sin_f64, smoothstep},
    random::Random,
};

use super::{
    Draft, Tissue, Waves, quads,
    spine::{Spine, Spot},
};
use crate::grow::{Limb, Part};

/// What the edge of a sheet is like.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Outline {
    /// Narrow where it begins, widest in its lower third, with a tip: of a stem that is a stipe at first.
    Kelp { stipe: f64 },
    /// Narrow at both ends.
    Leaf,
    /// As wide everywhere; its end is round.
    Ribbon,
    /// As wide everywhere; what ends is swollen.
    Strap { goes_on: bool },
}

/// Chances that make a sheet unlike others.
#[derive(Clone, Copy, Debug)]
struct Chance {
    /// Phases of waves [turns].
    phases: [f64; 8],
    /// Turn of the sheet about its middle line, from root to tip [rad].
    twist: f64,
}

/// A sheet as a surface over t (0 root to 1 tip) and u (−1 to 1 across).
struct Sheet<'a> {
    spine: &'a Spine,
    outline: Outline,
    /// Where the sheet begins on the limb [m].
    from: f64,
    half: f64,
    thickness: f64,
    /// Way across at the root, unit.
    across: DVec3,
    /// Depth of the edges' waves [m], how many there are, and which of them.
    ruffle: f64,
    ruffles: f64,
    waves: Waves,
    /// How much of its edge and tip is torn.
    torn: f64,
    chance: Chance,
}

impl Sheet<'_> {
    /// Half the width at t, as a share of the greatest.
    fn width(&self, t: f64) -> f64 {
        // No corner of a mesh is two.
        let least = 0.03;
        let round = |from: f64| (1.0 - ((t - from) / (1.0 - from)).max(0.0).powi(2)).max(0.0).sqrt();
        let share = match self.outline {
            Outline::Kelp { stipe } => {
                let narrow = (2.2 * self.thickness / self.half).min(0.3);
                let blade = ((t - stipe) / (1.0 - stipe)).max(0.0);
                let body = smoothstep(-0.02, 0.28, blade) * (1.0 - 0.35 * blade) * round(0.72);
                if t < stipe { narrow } else { narrow.max(body) * round(0.9) }
            }
            Outline::Leaf => smoothstep(-0.03, 0.3, t) * (1.0 - 0.4 * t) * round(0.45),
            Outline::Ribbon => (0.7 + 0.3 * smoothstep(0.0, 0.2, t)) * round(0.94),
            Outline::Strap { goes_on: true } => 1.0,
            Outline::Strap { goes_on: false } => (1.0 + 0.35 * smoothstep(0.55, 0.8, t)) * round(0.8),
        };
        share.max(least)
    }

    /// How much its edges wave at t.
    fn waving(&self, t: f64) -> f64 {
        let begin = if let Outline::Kelp { stipe } = self.outline { stipe } else { 0.0 };
        smoothstep(begin + 0.02, begin + 0.22, t) * (1.0 - 0.3 * smoothstep(0.85, 1.0, t))
    }

    fn wave(&self, turns: f64, phase: usize) -> f64 {
        sin_f64(TAU * (turns + self.chance.phases[phase]))
    }

    /// A place on the surface, and on the middle line beside it.
    fn at(&self, t: f64, u: f64) -> (DVec3, Spot) {
        let side = usize::from(u < 0.0);
        let (mut along, mut half) = (t, self.half * self.width(t));
        if self.torn > 0.0 {
            // The tip is frayed: shorter here and there. The edges have notches.
            let frayed = 0.5 + 0.5 * self.wave(0.4 * u, 6);
            along *= 1.0 - self.torn * (0.08 + 0.1 * frayed);
            let notch = self.wave(3.1 * t, 4 + side).max(0.0).powi(6) * smoothstep(0.35, 0.8, t);
            half *= 1.0 - 0.4 * self.torn * notch * u.abs();
        }
        let spot = self.spine.at(self.from + along * (self.spine.length - self.from));
        let mut across = (self.across - spot.up * spot.up.dot(self.across)).normalize_or(DVec3::X);
        if self.chance.twist != 0.0 {
            let (cos, sin) = cos_sin_f64(self.chance.twist * smoothstep(0.05, 1.0, t));
            across = across * cos + spot.up.cross(across) * sin;
        }
        let normal = across.cross(spot.up);
        let edge = u * u;
        let (mut lift, mut lean) = (-0.1 * half * edge, 0.0);
        if self.ruffle > 0.0 {
            let (f, deep) = (self.ruffles, self.ruffle * self.waving(t));
            let short = if self.waves == Waves::All { 0.35 * self.wave(1.63 * f * t, 2 + side) } else { 0.0 };
            let waves = 0.8 * self.wave(f * t, side) + short;
            // Two rows of dents beside the midrib.
            let beside = (1.0 - (3.2 * (u.abs() - 0.4)).powi(2)).max(0.0);
            let dents = if beside > 0.0 { 0.2 * beside * self.wave(1.2 * f * t, 1 - side) } else { 0.0 };
            lift += deep * (edge * waves + dents);
            // An edge that waves is longer than the middle: it leans to and fro along the blade, too.
            lean = 0.3 * deep * edge * self.wave(f * t + 0.25, side);
        }
        (spot.place + across * (half * u) + normal * lift + spot.up * lean, spot)
    }
}

/// The normal at a point of a grid of places, from its neighbours, unit.
fn normal(places: &[(DVec3, Spot)], width: usize, row: usize, column: usize) -> DVec3 {
    let at = |row: usize, column: usize| places[row * width + column].0;
    let (last_row, last_column) = (places.len() / width - 1, width - 1);
    let along = at((row + 1).min(last_row), column) - at(row.saturating_sub(1), column);
    let across = at(row, (column + 1).min(last_column)) - at(row, column.saturating_sub(1));
    across.cross(along).normalize_or(DVec3::Z)
}

impl Draft<'_> {
    /// Adds a flat limb that begins `from` [m] up its middle line.
    pub(super) fn sheet(
        &mut self,
        number: usize,
        spine: &Spine,
        from: f64,
        width: f64,
        thickness: f64,
        random: &mut Random,
    ) {
        let limb = &self.limbs[number];
        let look = &self.species.look;
        let forks = self.species.forks.times > 0;
        let outline = match limb.part {
            Part::Blade => Outline::Leaf,
            Part::Fork => Outline::Strap { goes_on: limb.goes_on },
            Part::Stem if forks => Outline::Strap { goes_on: true },
            Part::Stem if look.ruffle > 0.0 || look.stipe > 0.0 => Outline::Kelp { stipe: look.stipe },
            Part::Stem => Outline::Ribbon,
        };
        let phases = core::array::from_fn(|_| random.unit());
        let twist = match outline {
            Outline::Kelp { .. } => 0.7,
            Outline::Leaf => 0.9,
            Outline::Ribbon => 1.6,
            Outline::Strap { .. } => 0.0,
        };
        let flat = matches!(outline, Outline::Strap { .. });
        let sheet = Sheet {
            spine,
            outline,
            from,
            half: 0.5 * width,
            thickness,
            across: if flat { spine.inside } else { spine.across },
            ruffle: if self.fine.waves == Waves::None { 0.0 } else { 0.5 * look.ruffle * width },
            ruffles: look.ruffles,
            waves: self.fine.waves,
            torn: if matches!(outline, Outline::Kelp { .. } | Outline::Leaf) { self.ripe } else { 0.0 },
            chance: Chance { phases, twist: twist * random.signed() },
        };
        let (rows, columns) = self.grid(limb, &sheet);
        let first = self.shape.vertices.len() as u32;
        let share = |row: u32| f64::from(row) / f64::from(rows);
        let side = |column: u32| 2.0 * f64::from(column) / f64::from(columns) - 1.0;
        let grid = || (0..=rows).flat_map(|row| (0..=columns).map(move |column| (row, column)));
        let places: Vec<(DVec3, Spot)> =
            grid().map(|(row, column)| sheet.at(share(row), side(column))).collect();
        for ((row, column), (place, spot)) in grid().zip(&places) {
            let normal = normal(&places, columns as usize + 1, row as usize, column as usize);
            let tissue = self.skin(number, &sheet, (share(row), side(column)), normal);
            self.vertex(*place, spot, &tissue);
        }
        quads(&mut self.shape.indices, first, rows, columns);
    }

    /// Quads along and across.
    fn grid(&self, limb: &Limb, sheet: &Sheet<'_>) -> (u32, u32) {
        let segments = limb.segments.len() as f64;
        let waving = sheet.ruffle > 0.0 && sheet.ruffles > 0.0;
        let waves = if sheet.ruffles > 0.0 { 8.0 * sheet.ruffles } else { 0.0 };
        // What does not wave needs fewer at once.
        let share = if waving { self.fine.along } else { self.fine.along * self.fine.along };
        let rows = (2.0 * segments).max(waves).clamp(4.0, 96.0) * share.max(self.fine.along * 0.65);
        let least = if matches!(sheet.outline, Outline::Strap { .. }) { 1.0 } else { 2.0 };
        let ribbed = self.species.look.midrib > 0.0;
        let across = match 2.0 * sheet.half {
            width if width >= 0.1 && ribbed => 8.0,
            width if width >= 0.012 && ribbed => 4.0,
            _ => 2.0,
        };
        let narrow = if waving { 2.0 } else { 1.0 };
        (rows.round().max(least) as u32, (across * self.fine.across).round().max(narrow) as u32)
    }

    /// What a sheet's vertex is beside its place.
    fn skin(&self, number: usize, sheet: &Sheet<'_>, (t, u): (f64, f64), normal: DVec3) -> Tissue {
        let look = &self.species.look;
        let [start, end] = self.heights[number];
        let height = start + (end - start) * t;
        let (v, stipe) = match sheet.outline {
            Outline::Strap { .. } => (height, 1.0 - smoothstep(0.0, 0.25, height)),
            Outline::Kelp { stipe } => (t, 1.0 - smoothstep(stipe, stipe + 0.12, t)),
            Outline::Leaf => (t, 1.0 - smoothstep(0.0, 0.12, t)),
            Outline::Ribbon => (t, 1.0 - smoothstep(0.0, 0.18, t)),
        };
        // A midrib tapers toward the tip.
        let rib = if look.midrib > 0.0 { look.midrib * (1.1 - 0.7 * t) } else { 0.0 };
        let middle = if rib > 0.0 { 1.0 - smoothstep(0.4 * rib, 1.6 * rib, u.abs()) } else { 0.0 };
        let share = stipe.max(0.7 * middle);
        // Blotches of growth, and edges that are thinner and paler.
        let grain = 0.5 * sheet.wave(2.7 * t + 0.6 * u, 6) + 0.5 * sheet.wave(6.1 * t - 0.9 * u, 7);
        let shade = 0.86 + 0.09 * u * u + 0.05 * grain;
        let thickness = sheet.thickness * (0.75 + 0.9 * middle - 0.3 * u * u * (1.0 - middle));
        Tissue {
            normal,
            uv: [0.5 + 0.5 * u, v],
            thickness: thickness.max(1e-4),
            color: self.palette.vertex(share, shade),
        }
    }

    /// The teeth of a feather, along both sides of a thin blade.
    pub(super) fn comb(&mut self, spine: &Spine, random: &mut Random) {
        let look = &self.species.look;
        // From afar one stands for several.
        let every = match self.fine.waves {
            Waves::All => 1,
            Waves::Long => 2,
            Waves::None => 3,
        };
        let pitch = spine.length / f64::from(look.teeth + 1);
        for tooth in 0..2 * look.teeth {
            let [moved, longer, turned, light] = [(); 4].map(|()| random.signed());
            if tooth / 2 % every != tooth % 2 {
                continue;
            }
            let side = if tooth % 2 == 0 { 1.0 } else { -1.0 };
            let along = pitch * (0.6 + 0.5 * f64::from(tooth) + 0.2 * moved);
            let t = (along / spine.length).min(1.0);
            let length = look.tooth * (1.0 - 0.65 * t) * (1.0 + 0.2 * longer);
            let spot = spine.at(along);
            let across = spine.inside * side;
            let out = (across + spot.up * 0.9).normalize_or(across);
            let out = DQuat::from_axis_angle(spot.up, 0.35 * turned) * out;
            let half = spot.up * (0.07 * length * f64::from(every));
            let normal = out.cross(spot.up).normalize_or(DVec3::Z) * side;
            let shade = 0.85 + 0.1 * light;
            let corners = [spot.place - half, spot.place + half, spot.place + out * length];
            for (place, v) in corners.into_iter().zip([0.6 * t, 0.6 * t, 0.4 + 0.6 * t]) {
                let uv = [0.5 + 0.5 * side, v];
                let color = self.palette.vertex(0.3 * (1.0 - v), shade);
                let vertex = self.vertex(place, &spot, &Tissue { normal, uv, thickness: TOOTH, color });
                self.shape.indices.push(vertex);
            }
        }
    }
}

/// Thickness of a tooth [m].
const TOOTH: f64 = 8e-4;
