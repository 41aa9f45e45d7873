//! What of meshes stands on the ground: it keeps light from the ground, and in a bed neighbours keep it from
//! each other.

use std::collections::HashMap;

use glam::{DVec3, Vec3, Vec3Swizzles};
use reef_abi as abi;
use reef_streams::{Outputs, environment::Terrain, frame::Frame, meshes::Mesh};

use super::library::{Shelf, half};
use crate::{boulder::ground_height, gather::Stander, matched::Matched};

/// Farthest that the origin of what stands is from the ground [m].
const STANDS: f32 = 0.15;
/// Side of the cells over which leaves are counted [m]: around a plant three by three.
const CELL: f64 = 0.5;
/// A higher plant [m] gets its light from farther around: its cells are twice, four times, ... as large.
const SHADED: f32 = 2.0;
const MOST_LEVEL: f32 = 5.0;
/// Least radius of the skirt of shade around a foot, in radii of the crown.
const SKIRT: f32 = 0.6;
/// Share of the light that a leaf takes away: some shines through.
const TAKEN: f32 = 0.8;

/// How a mesh stands: upright at rest, its root at 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Form {
    /// Radius of its foot [m].
    pub base: f32,
    /// Radius of a disc over which its triangles are spread as they are [m].
    pub crown: f32,
    /// Of its highest vertex [m].
    pub height: f32,
    /// What its triangles cover, seen from above without overlap [m²].
    pub leaf: f32,
}

impl Form {
    /// The form of a mesh's finest level. A random sheet covers half of its area, a body, whose triangles
    /// are its whole surface, a quarter.
    pub fn of(mesh: &Mesh) -> Self {
        let place = |i: u32| Vec3::from(mesh.vertices[i as usize].position);
        let level = mesh.levels[0];
        let corners = &mesh.indices[level.first_index as usize..][..level.index_count as usize];
        let (mut area, mut spread) = (0.0, 0.0);
        for corner in corners.chunks_exact(3) {
            let [a, b, c] = [place(corner[0]), place(corner[1]), place(corner[2])];
            let own = 0.5 * (b - a).cross(c - a).length();
            let middle = (a + b + c) / 3.0;
            area += own;
            spread += own * middle.xz().length_squared();
        }
        let own = &mesh.vertices[level.first_vertex as usize..][..level.vertex_count as usize];
        let places = || own.iter().map(|v| Vec3::from(v.position));
        let height = places().fold(0.0_f32, |high, p| high.max(p.y));
        let feet = places().filter(|p| p.y < 0.1 * height).map(|p| p.xz().length_squared());
        let (sum, count) = feet.fold((0.0, 0.0_f32), |(sum, count), r| (sum + r, count + 1.0));
        // The mean square of a disc's radii is half of its radius' square.
        let radius = |mean_square: f32| (2.0 * mean_square).sqrt();
        let covers = if mesh.flags & abi::MESH_TWO_SIDED != 0 { 0.5 } else { 0.25 };
        Self {
            base: radius(sum / count.max(1.0)),
            crown: radius(spread / f32::max(area, 1e-12)),
            height,
            leaf: covers * area,
        }
    }

    fn scaled(self, by: f32) -> Self {
        let Self { base, crown, height, leaf } = self;
        Self { base: base * by, crown: crown * by, height: height * by, leaf: leaf * by * by }
    }

    fn and(self, other: Self) -> Self {
        Self {
            base: self.base.max(other.base),
            crown: self.crown.max(other.crown),
            height: self.height.max(other.height),
            leaf: self.leaf + other.leaf,
        }
    }
}

/// One object that stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standing {
    /// Its number among all objects of the step.
    pub object: u32,
    /// World position of its foot [m].
    pub origin: DVec3,
    /// Of all its meshes.
    pub form: Form,
}

impl Standing {
    /// As the ground feels it.
    pub fn stander(&self) -> Stander {
        let Form { base, crown, height, leaf } = self.form;
        Stander {
            origin: self.origin,
            base: self.origin,
            // A stem alone would be thinner than what the ground shows.
            base_radius: base.max(SKIRT * crown).min(crown),
            crown_radius: crown,
            crown_height: 0.0,
            cover: 1.0 - (-TAKEN * leaf / (std::f32::consts::PI * crown * crown).max(1e-6)).exp(),
            tall: height,
        }
    }
}

/// What stands on the ground: objects of skinned meshes whose origins are at it, and where they were in the
/// step before. How they sway is not looked at, so it is the same in every step. `matched`: the objects of
/// the two steps.
pub fn standing(
    [previous, current]: [&Frame; 2],
    matched: &[Matched],
    terrain: &Terrain,
    shelf: &Shelf,
) -> Vec<Standing> {
    let mut all = Vec::new();
    let mut objects = 0;
    for (number, (now, matched)) in current.outputs.iter().zip(matched).enumerate() {
        let before = previous.of_module(number);
        let known: Vec<(u32, Form)> = now
            .meshes
            .iter()
            .filter_map(|mesh| Some((mesh.id, shelf.forms[shelf.number(mesh)? as usize])))
            .collect();
        let mut forms: Vec<Option<Form>> = Vec::new();
        for element in &now.skinned {
            let own = element.object as usize;
            let first = forms.get(own).is_none_or(Option::is_none);
            if first && !stands(before, (now, own), matched, terrain) {
                continue;
            }
            let Ok(at) = known.binary_search_by_key(&element.mesh, |(id, _)| *id) else { continue };
            let form = known[at].1.scaled(element.scale);
            forms.resize(forms.len().max(own + 1), None);
            forms[own] = Some(forms[own].map_or(form, |known| known.and(form)));
        }
        for (own, form) in forms.iter().enumerate() {
            let Some(form) = *form else { continue };
            let origin = DVec3::from(now.objects[own].origin);
            all.push(Standing { object: objects + own as u32, origin, form });
        }
        objects += now.objects.len() as u32;
    }
    all
}

fn stands(before: &Outputs, (now, number): (&Outputs, usize), matched: &Matched, terrain: &Terrain) -> bool {
    let object = &now.objects[number];
    let rests = matched.of(number).is_none_or(|then| before.objects[then].origin == object.origin);
    let [x, y, z] = object.origin;
    rests && (y as f32 - ground_height(terrain, x, z)).abs() < STANDS
}

/// How much light the leaves of a bed take from what is under them: the law of Beer and Lambert down from the
/// bed's top, by the leaves in the nine cells around a plant.
#[derive(Clone, Debug, Default)]
pub struct Canopy {
    /// By the step's objects, empty where none stands: how fast light fades downward [1/m], and from which y
    /// on [m].
    fades: Vec<(f32, f64)>,
}

/// Sums over a cell.
#[derive(Clone, Copy, Default)]
struct Cell {
    leaf: f32,
    /// Times leaf: height of plants, and y of their tops.
    height: f32,
    top: f64,
}

impl Canopy {
    /// Of what stands.
    pub fn new(standing: &[Standing]) -> Self {
        let level = |form: &Form| (form.height / SHADED).log2().ceil().clamp(0.0, MOST_LEVEL) as i32;
        let side = |level: i32| CELL * f64::from(1 << level);
        let cell = |at: DVec3, level: i32| {
            [i64::from(level), (at.x / side(level)).floor() as i64, (at.z / side(level)).floor() as i64]
        };
        let mut levels: Vec<i32> = standing.iter().map(|standing| level(&standing.form)).collect();
        levels.sort_unstable();
        levels.dedup();
        let mut cells: HashMap<[i64; 3], Cell> = HashMap::new();
        for Standing { origin, form, .. } in standing {
            for level in &levels {
                let sum = cells.entry(cell(*origin, *level)).or_default();
                sum.leaf += form.leaf;
                sum.height += form.leaf * form.height;
                sum.top += f64::from(form.leaf) * (origin.y + f64::from(form.height));
            }
        }
        let mut fades = Vec::new();
        for Standing { object, origin, form } in standing {
            let own = level(form);
            let [_, x, z] = cell(*origin, own);
            let mut sum = Cell::default();
            for [i, j] in (-1..=1).flat_map(|i| (-1..=1).map(move |j| [x + i, z + j])) {
                let Some(own) = cells.get(&[i64::from(own), i, j]) else { continue };
                sum.leaf += own.leaf;
                sum.height += own.height;
                sum.top += own.top;
            }
            let layers = f64::from(sum.leaf) / (9.0 * side(own) * side(own));
            let height = sum.height / sum.leaf.max(1e-12);
            fades.resize(fades.len().max(*object as usize + 1), (0.0, 0.0));
            fades[*object as usize] =
                (TAKEN * layers as f32 / height.max(0.01), sum.top / f64::from(sum.leaf.max(1e-12)));
        }
        Self { fades }
    }

    /// Of an object, by its number among all of the step: two half floats, how fast light fades downward
    /// [1/m], and from which height on, relative to an eye at this y [m].
    pub fn shade(&self, object: u32, eye: f64) -> u32 {
        match self.fades.get(object as usize) {
            Some((fade, top)) => half(*fade) | half((top - eye) as f32) << 16,
            None => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{device_tests, meshes::sample::Models, sample};

    const GROUND: f64 = -4.0;

    fn flat() -> Terrain {
        let of = sample::environment().terrain.expect("it has one");
        let heights = vec![GROUND as f32; of.heights.len()];
        Terrain { heights, ..(*of).clone() }
    }

    fn shelf(models: &Models) -> Shelf {
        let mut shelf = Shelf::default();
        models.list.iter().for_each(|mesh| shelf.add(mesh));
        shelf
    }

    fn frame(outputs: Outputs) -> Frame {
        sample::frame(1, sample::looking_at(DVec3::ONE, DVec3::ZERO), outputs)
    }

    fn stand([before, now]: [&Frame; 2], models: &Models) -> Vec<Standing> {
        standing([before, now], &Matched::modules(before, now), &flat(), &shelf(models))
    }

    fn seen(models: &Models, before: &Outputs, now: &Outputs) -> Vec<Standing> {
        stand([&frame(before.clone()), &frame(now.clone())], models)
    }

    #[test]
    fn what_is_at_the_ground_and_rests_stands_and_nothing_else() {
        let models = Models::default();
        let make = |time: f32, swum: f64| {
            let mut outputs = models.empty();
            models.fish(&mut outputs, [0.0, GROUND + 1.0, 0.0], 0.0, time);
            models.plant(&mut outputs, [1.0, GROUND - 0.02, 0.0], 0.8, time);
            models.fish(&mut outputs, [swum, GROUND + 0.05, 2.0], 0.0, time);
            models.bell(&mut outputs, [0.0, GROUND, 0.0], 1.0, time);
            models.plant(&mut outputs, [2.0, GROUND, 0.0], 0.5, time);
            outputs
        };
        let (before, now) = (make(0.0, 0.0), make(0.3, 0.01));
        let all = seen(&models, &before, &now);
        assert_eq!(all.iter().map(|s| s.object).collect::<Vec<_>>(), [1, 4]);
        // The same, however it sways; but for what swims no more.
        assert_eq!(all, seen(&models, &make(0.0, 0.02), &make(1.7, 0.03)));
        assert_eq!(seen(&models, &now, &now).len(), 3);
        // Another instance's objects come after these.
        let mut both = frame(now.clone());
        both.outputs.push(Arc::new(now.clone()));
        let numbers: Vec<u32> = stand([&both, &both], &models).iter().map(|s| s.object).collect();
        assert_eq!(numbers, [1, 2, 4, 6, 7, 9]);
        // What swims does not stand, though another one came before it.
        let mut more = models.empty();
        models.plant(&mut more, [3.0, GROUND, 0.0], 0.5, 0.0);
        models.fish(&mut more, [0.02, GROUND + 0.05, 2.0], 0.0, 0.0);
        let fish = now.objects[2].id;
        (more.objects[0].id, more.objects[1].id) = (u64::MAX, fish);
        let numbers: Vec<u32> = seen(&models, &now, &more).iter().map(|s| s.object).collect();
        assert_eq!(numbers, [0]);
    }

    #[test]
    fn a_form_is_that_of_the_shape() {
        let models = Models::default();
        let form = Form::of(&models.list[0]);
        // A stem of 6 mm, leaves of up to 22 cm, drooping ones at the top.
        assert!((0.9..1.1).contains(&form.height) && (0.1..0.2).contains(&form.crown), "{form:?}");
        assert!(form.base < 0.12 && (0.02..0.3).contains(&form.leaf), "{form:?}");
        let half = form.scaled(0.5);
        assert_eq!((half.height, half.leaf), (0.5 * form.height, 0.25 * form.leaf));
        assert_eq!(form.and(form).leaf, 2.0 * form.leaf);
    }

    #[test]
    fn a_bed_fades_light_by_its_leaves_over_its_height() {
        let models = Models::default();
        let eye = GROUND + 1.25;
        let shade = |pitch: f64, size: f32| {
            let mut outputs = models.empty();
            let many = (4.0 / pitch) as i32;
            for i in 0..many * many {
                let at = [i % many, i / many].map(|n| (f64::from(n - many / 2) + 0.5) * pitch);
                models.plant(&mut outputs, [at[0], GROUND, at[1]], size, 0.0);
            }
            let canopy = Canopy::new(&seen(&models, &outputs, &outputs));
            let packed = canopy.shade((many * many / 2 + many / 2) as u32, eye);
            [device_tests::half(packed & 0xffff), device_tests::half(packed >> 16)]
        };
        let form = Form::of(&models.list[0]);
        // The last are high, and far from each other: counted over a wider circle.
        for (pitch, size) in [(0.25_f64, 1.0), (0.125, 1.0), (0.25, 0.5), (1.0, 3.5)] {
            let [fade, top] = shade(pitch, size);
            let own = form.scaled(size);
            // So many leaves over each other: a plant's over the ground that it has.
            let layers = own.leaf / (pitch * pitch) as f32;
            // Half floats have eleven bits.
            let expected = TAKEN * layers / own.height;
            assert!((fade / expected - 1.0).abs() < 2e-3, "{pitch} m, {size}: {fade}, {expected}");
            assert!((top - (own.height - 1.25)).abs() < 2e-3, "{pitch} m, {size}: {top}");
        }
        assert_eq!(Canopy::new(&[]).shade(3, eye), 0);
    }
}
