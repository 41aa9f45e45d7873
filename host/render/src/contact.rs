//! The contact map: how much of the water's light (r) and of the sun (g) reaches the ground beside what
//! stands on it. It gives everything a skirt of shade, so that nothing seems to float.

use glam::{DVec2, Vec2};
use reef_streams::environment::{Environment, Rock};

use super::gather::Stander;

/// Side of the map [px].
pub const SIZE: usize = 512;

/// A square map of the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactMap {
    /// World x and z of its corner [m].
    pub origin: DVec2,
    /// Its side [m].
    pub extent: f32,
    /// Two bytes a texel, row after row along z.
    pub texels: Vec<u8>,
}

/// An ellipse on the ground that takes light away, softly.
struct Blot {
    center: DVec2,
    /// Half axes at which the effect is half gone [m].
    half: Vec2,
    yaw: f32,
    /// Relative width of the soft edge.
    soft: f32,
    strength: f32,
    channel: usize,
}

impl ContactMap {
    /// The map for what stands on the ground, with shadows away from the sun.
    pub fn new(environment: &Environment, standers: &[Stander]) -> Self {
        let mut blots = Vec::new();
        if let Some(terrain) = &environment.terrain {
            // How far a shadow moves for each metre of height.
            let sun = environment.sun.direction;
            let slant = Vec2::new(-sun.x, -sun.z) / sun.y.max(0.25);
            for stander in standers {
                stander_blots(stander, slant, &mut blots);
            }
            for rock in &terrain.rocks {
                rock_blots(rock, slant, &mut blots);
            }
        }
        let mut low = DVec2::splat(f64::INFINITY);
        let mut high = DVec2::splat(f64::NEG_INFINITY);
        for blot in &blots {
            let reach = f64::from(blot.half.max_element() * (1.0 + blot.soft));
            low = low.min(blot.center - reach);
            high = high.max(blot.center + reach);
        }
        if blots.is_empty() {
            (low, high) = (DVec2::ZERO, DVec2::ONE);
        }
        // Twenty metres are enough for what can be seen in detail, and leave 4 cm a texel.
        let middle = (low + high) * 0.5;
        let extent = ((high - low).max_element() + 0.2).clamp(1.0, 24.0) as f32;
        let origin = middle - DVec2::splat(f64::from(extent) * 0.5);
        let mut light = vec![1.0_f32; SIZE * SIZE * 2];
        for blot in &blots {
            splat(&mut light, blot, origin, extent);
        }
        let mut texels: Vec<u8> = light.iter().map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8).collect();
        // The border repeats outward: it has to be free.
        for i in 0..SIZE {
            for at in [i, (SIZE - 1) * SIZE + i, i * SIZE, i * SIZE + SIZE - 1] {
                texels[at * 2] = 255;
                texels[at * 2 + 1] = 255;
            }
        }
        Self { origin, extent, texels }
    }

    /// What changes when the map has to be made anew: where things stand, to a centimetre, and of what goes
    /// up from the ground how large it is and what it covers, to a hundredth. The sizes of what has all at
    /// one height are left out because they sway: a map a frame would cost more than all the rest of the
    /// picture.
    pub fn key(standers: &[Stander]) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut add = |v: i64| hash = (hash ^ v as u64).wrapping_mul(0x0000_0100_0000_01b3);
        for s in standers {
            for v in s.origin.to_array() {
                add((v * 100.0).round() as i64);
            }
            if s.tall > 0.0 {
                for v in [s.base_radius, s.crown_radius, s.cover, s.tall] {
                    add((v * 100.0).round() as i64);
                }
            }
        }
        hash
    }
}

fn stander_blots(s: &Stander, slant: Vec2, blots: &mut Vec<Blot>) {
    let center = DVec2::new(s.base.x, s.base.z);
    let round = |radius: f32, soft: f32, strength: f32, channel: usize, shift: Vec2| Blot {
        center: center + shift.as_dvec2(),
        half: Vec2::splat(radius),
        yaw: 0.0,
        soft,
        strength,
        channel,
    };
    blots.push(round(s.base_radius * 1.15, 0.6, 0.75, 0, Vec2::ZERO));
    blots.push(round(s.crown_radius, 0.8, 0.45 * s.cover, 0, Vec2::ZERO));
    // A high crown's shadow is as much longer as the sun stands askew, and as much fainter.
    let half_way = slant * (0.5 * s.tall);
    let longer = 1.0 + half_way.length() / s.crown_radius.max(1e-6);
    let strength = 0.62 * s.cover / longer;
    let shadow = round(s.crown_radius * 0.9, 0.5, strength, 1, slant * s.crown_height + half_way);
    let half = shadow.half * Vec2::new(longer, 1.0);
    blots.push(Blot { half, yaw: (-slant.y).atan2(slant.x), ..shadow });
    blots.push(round(s.base_radius * 1.1, 0.5, 0.5, 1, slant * s.crown_height * 0.5));
}

fn rock_blots(rock: &Rock, slant: Vec2, blots: &mut Vec<Blot>) {
    let center = DVec2::new(rock.position[0], rock.position[2]);
    let half = Vec2::new(rock.half_axes[0], rock.half_axes[2]);
    let blot = |scale: f32, soft: f32, strength: f32, channel: usize, shift: Vec2| Blot {
        center: center + shift.as_dvec2(),
        half: half * scale,
        yaw: rock.yaw,
        soft,
        strength,
        channel,
    };
    blots.push(blot(1.06, 0.30, 0.68, 0, Vec2::ZERO));
    blots.push(blot(1.35, 0.6, 0.30, 0, Vec2::ZERO));
    // Shadows of three slices, so that a high rock throws a long one.
    for (height, scale) in [(0.2, 0.95), (0.45, 0.8), (0.7, 0.55)] {
        blots.push(blot(scale, 0.25, 0.7, 1, slant * (rock.half_axes[1] * height)));
    }
}

fn splat(light: &mut [f32], blot: &Blot, origin: DVec2, extent: f32) {
    let texel = extent / SIZE as f32;
    let center = (blot.center - origin).as_vec2() / texel;
    let reach = blot.half.max_element() * (1.0 + blot.soft) / texel;
    let range = |c: f32| {
        let from = (c - reach).floor().clamp(0.0, SIZE as f32) as usize;
        let to = (c + reach).ceil().clamp(0.0, SIZE as f32) as usize;
        from..to
    };
    let (sin, cos) = blot.yaw.sin_cos();
    for z in range(center.y) {
        for x in range(center.x) {
            let d = (Vec2::new(x as f32 + 0.5, z as f32 + 0.5) - center) * texel;
            // Into the rock's own axes: the inverse of a turn about y.
            let local = Vec2::new(d.x * cos - d.y * sin, d.x * sin + d.y * cos) / blot.half;
            let t = ((1.0 + blot.soft - local.length()) / (2.0 * blot.soft)).clamp(0.0, 1.0);
            light[(z * SIZE + x) * 2 + blot.channel] *= 1.0 - blot.strength * t * t * (3.0 - 2.0 * t);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::sample;

    fn stander() -> Stander {
        let base = DVec3::new(-1.0, -4.0, 0.5);
        Stander {
            origin: base,
            base,
            base_radius: 0.05,
            crown_radius: 0.12,
            crown_height: 0.1,
            cover: 1.0,
            tall: 0.0,
        }
    }

    fn at(map: &ContactMap, x: f64, z: f64) -> [u8; 2] {
        let p = (DVec2::new(x, z) - map.origin) / f64::from(map.extent) * SIZE as f64;
        let i = (p.y as usize * SIZE + p.x as usize) * 2;
        [map.texels[i], map.texels[i + 1]]
    }

    #[test]
    fn the_ground_is_dark_under_what_stands_on_it_and_free_at_the_border() {
        let environment = sample::environment();
        let map = ContactMap::new(&environment, &[stander()]);
        assert!(at(&map, -1.0, 0.5)[0] < 80);
        assert!(map.texels[..SIZE * 2].iter().all(|v| *v == 255));
        assert!(at(&map, 1.4, -1.8)[0] < 120, "under the rock");
    }

    #[test]
    fn a_high_crowns_shadow_is_long_and_faint() {
        let environment = sample::environment();
        let sun = environment.sun.direction;
        let away = DVec2::new(-f64::from(sun.x), -f64::from(sun.z)).normalize();
        let crown = Stander { crown_radius: 0.3, base_radius: 0.02, crown_height: 0.0, ..stander() };
        let dark = |s: Stander, distance: f64| {
            let map = ContactMap::new(&environment, &[s]);
            255 - at(&map, s.base.x + away.x * distance, s.base.z + away.y * distance)[1]
        };
        // A metre high, its shadow ends so far away.
        let end = f64::from((1.0 - sun.y * sun.y).sqrt() / sun.y);
        let tall = Stander { tall: 1.0, ..crown };
        assert!(dark(tall, end) > 20 && dark(crown, 0.4 + end) == 0, "{}", dark(tall, end));
        assert!(dark(tall, 0.15) < dark(crown, 0.15));
        let thin = Stander { cover: 0.25, ..crown };
        let ratio = f32::from(dark(thin, 0.15)) / f32::from(dark(crown, 0.15));
        assert!((ratio - 0.25).abs() < 0.03, "{ratio}");
    }

    #[test]
    fn shadows_fall_away_from_the_sun() {
        let environment = sample::environment();
        let map = ContactMap::new(&environment, &[stander()]);
        let sun = environment.sun.direction;
        let away = f64::from(0.16 / (sun.x * sun.x + sun.z * sun.z).sqrt());
        let (dx, dz) = (f64::from(sun.x) * away, f64::from(sun.z) * away);
        assert!(at(&map, -1.0 - dx, 0.5 - dz)[1] < at(&map, -1.0 + dx, 0.5 + dz)[1]);
    }

    #[test]
    fn the_key_changes_when_something_moves_and_only_then() {
        let mut moved = stander();
        moved.origin.x += 0.2;
        let mut swaying = stander();
        swaying.crown_radius += 0.03;
        assert_eq!(ContactMap::key(&[stander()]), ContactMap::key(&[swaying]));
        assert_eq!(ContactMap::key(&[stander()]), ContactMap::key(&[stander()]));
        assert_ne!(ContactMap::key(&[stander()]), ContactMap::key(&[moved]));
    }

    #[test]
    fn the_key_of_what_has_a_height_changes_with_its_form() {
        let tall = Stander { tall: 0.8, ..stander() };
        let others = [
            Stander { base_radius: tall.base_radius + 0.02, ..tall },
            Stander { crown_radius: tall.crown_radius + 0.02, ..tall },
            Stander { cover: tall.cover - 0.02, ..tall },
            Stander { tall: tall.tall + 0.02, ..tall },
        ];
        for other in others {
            assert_ne!(ContactMap::key(&[tall]), ContactMap::key(&[other]), "{other:?}");
        }
        let as_good_as_it = Stander { tall: tall.tall + 0.001, ..tall };
        assert_eq!(ContactMap::key(&[tall]), ContactMap::key(&[as_good_as_it]));
    }
}
