//! What is on a blade: a picture of its veins, its edges' shade, what grows on it, and where old ones are
//! torn.
//!
//! From left to right: from one edge to the other. From the last row up: from the root to the tip.

use reef_flow::{
    color::{byte, texels},
    math::{sin_f64, smoothstep},
    random::mix,
};

use crate::{looks::Palette, species::Species};

/// Texels across and along.
pub const SIZE: [u32; 2] = [128, 256];

/// Blades that are narrower than this [m] have no room for a picture.
const NARROW: f64 = 0.02;
/// Rows of side veins along a blade, and how much farther up they are at its edge, as a share of its length.
const VEINS: f64 = 17.0;
const RISE: f64 = 0.09;
/// How much darker the furrows between veins are, the flanks of a midrib, and the hollows of ruffles.
const FURROW: f64 = 0.2;
const FLANK: f64 = 0.3;
const HOLLOW: f64 = 0.24;

/// Whether a species has blades that are worth a picture.
pub fn is_painted(species: &Species) -> bool {
    let joints = species.joints.iter().map(|table| table.tissue.width);
    let own = [species.stem.tissue.width, species.blades.tissue.width];
    let blades = if species.blades.count > 0 { &own[..] } else { &own[..1] };
    blades.iter().copied().chain(joints).fold(0.0, f64::max) > NARROW
}

/// Texels of a species at an age from 0 to [`crate::mesh::AGES`] − 1: sRGB with alpha, row after row.
pub fn paint(species: &Species, age: usize) -> Vec<u8> {
    let paints = Paints { species, palette: Palette::new(species, age), seed: mix(0xb1ade ^ age as u64) };
    texels(SIZE, |u, v| {
        let u = 2.0 * u - 1.0;
        let [r, g, b] = paints.at(u, v).map(byte);
        [r, g, b, if paints.torn(u, v) { 0 } else { 255 }]
    })
}

struct Paints<'a> {
    species: &'a Species,
    palette: Palette,
    seed: u64,
}

impl Paints<'_> {
    /// Smooth chance in the plane, 0 to 1.
    fn noise(&self, x: f64, y: f64, of: u64) -> f64 {
        let corner = |i: i64, j: i64| {
            let hash = mix(mix(self.seed ^ of ^ (i as u64)) ^ ((j as u64) << 32));
            (hash >> 40) as f64 / (1_u64 << 24) as f64
        };
        let (i, j) = (x.floor(), y.floor());
        let (s, t) = (smoothstep(0.0, 1.0, x - i), smoothstep(0.0, 1.0, y - j));
        let (i, j) = (i as i64, j as i64);
        let low = corner(i, j) + (corner(i + 1, j) - corner(i, j)) * s;
        let high = corner(i, j + 1) + (corner(i + 1, j + 1) - corner(i, j + 1)) * s;
        low + (high - low) * t
    }

    /// Linear colour at a place from −1 to 1 across and from the root (0) to the tip (1).
    fn at(&self, u: f64, v: f64) -> [f64; 3] {
        let look = &self.species.look;
        let side = u.abs();
        let mut shade = 0.94 + 0.12 * self.noise(3.0 * u, 24.0 * v, 1);
        // Wrinkles along the blade.
        shade *= 0.93 + 0.14 * self.noise(11.0 * u, 7.0 * v, 2);
        // Side veins rise from the middle to the edges; where they meet it depends on chance.
        let bowed = v - RISE * side * (1.6 - 0.6 * side) + 0.012 * self.noise(4.0 * u, 9.0 * v, 3);
        let vein = VEINS * bowed + if u < 0.0 { 0.5 } else { 0.0 };
        let furrow = smoothstep(0.26, 0.5, (vein - vein.floor() - 0.5).abs());
        shade *= 1.0 - FURROW * furrow * smoothstep(0.04, 0.2, side) * smoothstep(1.0, 0.7, side);
        // A midrib is light between dark flanks.
        if look.midrib > 0.0 {
            let rib = look.midrib * (1.1 - 0.7 * v);
            let flank = smoothstep(2.2 * rib, 1.1 * rib, side) * smoothstep(0.5 * rib, 1.0 * rib, side);
            shade *= (1.0 - FLANK * flank) * (1.0 + 0.18 * smoothstep(0.8 * rib, 0.3 * rib, side));
        }
        // Hollows of ruffles, and a thin edge that is paler.
        if look.ruffle > 0.0 && look.ruffles > 0.0 {
            let turns = look.ruffles * v + if u < 0.0 { 0.37 } else { 0.0 };
            let hollow = 0.5 + 0.5 * sin_f64(core::f64::consts::TAU * turns);
            shade *= 1.0 - HOLLOW * hollow * smoothstep(0.45, 0.95, side);
        }
        shade *= 1.0 + 0.16 * smoothstep(0.9, 0.98, side);
        let grown = self.palette.ripe();
        let spots = 0.6 * self.noise(6.0 * u, 22.0 * v, 4) + 0.4 * self.noise(15.0 * u, 51.0 * v, 5);
        let spot = smoothstep(0.72 - 0.14 * grown, 0.8 - 0.14 * grown, spots) * (0.3 + 0.45 * grown);
        self.palette.blade(v, spot).map(|x| f64::from(x) * shade)
    }

    /// Whether there is nothing: notches of the edges, and holes.
    fn torn(&self, u: f64, v: f64) -> bool {
        let ripe = self.palette.ripe();
        if ripe < 0.75 {
            return false;
        }
        let side = if u < 0.0 { 0.0 } else { 40.0 };
        let rough = self.noise(side, 13.0 * v, 6);
        let notch =
            0.5 * rough * rough * rough * smoothstep(0.35, 0.95, v) + 0.03 * self.noise(side, 60.0 * v, 7);
        let hole = 0.5 * self.noise(3.0 * u, 15.0 * v, 8) + 0.5 * self.noise(7.0 * u, 33.0 * v, 9);
        u.abs() > 1.0 - ripe * notch * smoothstep(0.2, 0.5, v) || (v > 0.55 && hole > 0.86 - 0.04 * v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        mesh::AGES,
        species::{Look, Stem, Tissue},
    };

    fn kelp() -> Species {
        Species {
            stem: Stem { tissue: Tissue { width: 0.2, ..Tissue::default() }, ..Stem::default() },
            look: Look { midrib: 0.2, ruffle: 0.2, ruffles: 6.0, ..Look::default() },
            ..Species::default()
        }
    }

    /// Light of all three channels in a column, from the root to the tip, of what is there.
    fn column(texels: &[u8], u: f64) -> Vec<f64> {
        let at = ((0.5 + 0.5 * u) * 127.0) as usize;
        let rows = texels.chunks_exact(128 * 4).map(|row| &row[4 * at..4 * at + 4]);
        rows.rev()
            .filter(|texel| texel[3] == 255)
            .map(|t| t[..3].iter().map(|x| f64::from(*x)).sum())
            .collect()
    }

    fn mean(of: &[f64]) -> f64 {
        of.iter().sum::<f64>() / of.len() as f64
    }

    #[test]
    fn a_midrib_is_light_between_dark_flanks_and_veins_cross_the_blade() {
        let texels = paint(&kelp(), 0);
        let [middle, flank, blade] = [0.0, 0.19, 0.62].map(|u| mean(&column(&texels, u)));
        assert!(middle > 1.1 * flank && blade > 1.04 * flank, "{middle} {flank} {blade}");
        // As many furrows as there are rows of veins, within a few that chance makes.
        let line = column(&texels, 0.35);
        let off: Vec<f64> =
            (8..line.len() - 8).map(|row| line[row] - mean(&line[row - 8..=row + 8])).collect();
        let crossed = off.windows(2).filter(|pair| pair[0] > 0.0 && pair[1] <= 0.0).count();
        assert!((10..30).contains(&crossed), "{crossed}");
        let plain = Look { midrib: 0.0, ..kelp().look };
        let texels = paint(&Species { look: plain, ..kelp() }, 0);
        let [middle, flank] = [0.0, 0.19].map(|u| mean(&column(&texels, u)));
        assert!((middle / flank - 1.0).abs() < 0.06, "{middle} {flank}");
    }

    #[test]
    fn old_blades_alone_are_torn_and_at_their_upper_edges_most() {
        let gone = |age: usize, from: usize, to: usize| {
            let texels = paint(&kelp(), age);
            let rows = texels.chunks_exact(128 * 4).skip(255 - to).take(to - from);
            rows.flat_map(|row| row.chunks_exact(4)).filter(|texel| texel[3] == 0).count()
        };
        assert_eq!([gone(0, 0, 255), gone(1, 0, 255)], [0, 0]);
        let (low, high) = (gone(AGES - 1, 0, 50), gone(AGES - 1, 150, 250));
        assert!(low == 0 && (150..4000).contains(&high), "{low} {high}");
    }

    #[test]
    fn ribbons_that_are_narrow_have_no_picture() {
        assert!(is_painted(&kelp()));
        let narrow = Stem { tissue: Tissue { width: 0.008, ..Tissue::default() }, ..Stem::default() };
        assert!(!is_painted(&Species { stem: narrow, ..Species::default() }));
    }
}
