//! What a pair of opposite points of a slice becomes in the sea (§3.4), and two pairs of slices at right
//! angles.

use glam::{Vec2, Vec3};

/// Where a slice stands in the sea: its x, its y, and across it. Unit vectors, right-handed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Along the slice's x.
    pub x: Vec3,
    /// Along the slice's y: the animal's way when it is upright.
    pub y: Vec3,
    /// Across the slice.
    pub z: Vec3,
}

impl Default for Frame {
    fn default() -> Self {
        Self { x: Vec3::X, y: Vec3::Y, z: Vec3::Z }
    }
}

impl Frame {
    pub(crate) fn of(&self, v: Vec2) -> Vec3 {
        self.x * v.x + self.y * v.y
    }
}

/// A closed curve around the animal's axis: at an angle φ it is at
/// centre + half · cos φ + side · sin φ + twist · cos 2φ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disc {
    /// The mean of its points [m].
    pub centre: Vec3,
    /// From there toward φ = 0 [m].
    pub half: Vec3,
    /// From there toward φ = π/2 [m].
    pub side: Vec3,
    /// Direction of `side`.
    pub aside: Vec3,
    /// How much farther along the axis it is at φ = 0 and π than in the mean [m].
    pub twist: Vec3,
}

impl Disc {
    /// A circle through a pair of points, about an axis that goes across their line in their slice.
    pub fn turned([a, b]: [Vec2; 2], frame: &Frame) -> Self {
        let (centre, half) = (frame.of(0.5 * (a + b)), frame.of(0.5 * (a - b)));
        Self { centre, half, side: frame.z * half.length(), aside: frame.z, twist: Vec3::ZERO }
    }

    /// The curve through the pair of one slice at φ = 0 and π, and through that of another at π/2 and 3π/2.
    pub fn crossed([[a, b], [c, d]]: [[Vec2; 2]; 2], [own, other]: [&Frame; 2]) -> Self {
        let middles = [own.of(0.5 * (a + b)), other.of(0.5 * (c + d))];
        let (half, side) = (own.of(0.5 * (a - b)), other.of(0.5 * (c - d)));
        Self {
            centre: 0.5 * (middles[0] + middles[1]),
            half,
            side,
            aside: side.normalize_or(own.z),
            twist: 0.5 * (middles[0] - middles[1]),
        }
    }

    /// Nothing of it is farther from the origin [m]; a circle reaches as far.
    pub fn reach(&self) -> f32 {
        let Self { centre, half, side, twist, .. } = *self;
        // Of |c + h cos φ + s sin φ|²: the greatest of both squares and of the product with c.
        let around = half.length_squared().max(side.length_squared()) + half.dot(side).abs();
        let along = (centre.dot(half).powi(2) + centre.dot(side).powi(2)).sqrt();
        (centre.length_squared() + around + 2.0 * along).sqrt() + twist.length()
    }

    /// The way from another disc's points to its own.
    pub(crate) fn less(&self, other: &Self) -> Self {
        Self {
            centre: self.centre - other.centre,
            half: self.half - other.half,
            side: self.side - other.side,
            aside: self.aside,
            twist: self.twist - other.twist,
        }
    }
}

/// The discs of one slice's pairs, or of both slices', from root to tip.
pub(crate) fn discs(
    pairs: impl Iterator<Item = [Vec2; 2]>,
    other: Option<impl Iterator<Item = [Vec2; 2]>>,
    frames: [&Frame; 2],
) -> impl Iterator<Item = Disc> {
    let mut other = other;
    pairs.map(move |pair| match other.as_mut().and_then(Iterator::next) {
        Some(crossing) => Disc::crossed([pair, crossing], frames),
        None => Disc::turned(pair, frames[0]),
    })
}
