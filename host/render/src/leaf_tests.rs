//! How leaves look on a real device (lavapipe counts): light through them, holes in them, what they mirror,
//! and the light that a bed takes from what is in it and under it.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use reef_abi as abi;
use reef_gpu::Picture;
use reef_streams::{
    Outputs,
    environment::{Environment, Sun, Terrain},
    frame::CameraPose,
    textures::Texture,
};

use super::{
    Quality, Settings, Shot,
    device_tests::{SIZE, blackboard, decoded, keep, open},
    meshes::{records::BIN_LIT_THIN, sample::Models},
    sample,
    texture_tests::{board_of, grey, sheet_of, white},
};
use crate::Studio;

const BOTH: [Quality; 2] = [Quality::High, Quality::Low];

/// A diagram with the sun in this direction.
fn sunlit(direction: Vec3) -> Environment {
    let sun = Sun { direction: direction.normalize(), ambient: [0.05; 3], ..sample::environment().sun };
    Environment { sun, ..blackboard() }
}

fn shoot(
    studio: &mut Studio,
    name: &str,
    outputs: &Outputs,
    (environment, camera): (&Environment, CameraPose),
    quality: Quality,
) -> Picture {
    let frame = sample::frame(1, camera, outputs.clone());
    let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment };
    let picture = studio.shoot(&shot, &Settings::of(quality)).expect("a picture");
    keep(&format!("leaf-{name}-{quality:?}"), &picture);
    picture
}

fn ahead() -> CameraPose {
    sample::looking_at(DVec3::new(0.0, 0.0, 1.2), DVec3::ZERO)
}

/// Light of a place in the picture, as shares of its sides.
fn light(picture: &Picture, x: f32, y: f32) -> f32 {
    let pixel = picture.pixel((SIZE.0 as f32 * x) as u32, (SIZE.1 as f32 * y) as u32).expect("inside");
    pixel[..3].iter().map(|v| decoded(*v)).sum()
}

/// A green leaf that fills the middle of the picture.
fn leaf(thickness: f32, translucency: f32) -> Outputs {
    let mut outputs = board_of(grey(1, 1, |_, _| 0), [0.0, 1.0], abi::MESH_TWO_SIDED, thickness);
    let color = [0.2, 0.3, 0.1, 1.0];
    let of = abi::Material { base: color, tip: color, texture: 0, wrap: 0.3, translucency, ..white() };
    outputs.materials = vec![of];
    outputs
}

#[test]
fn a_thin_leaf_is_bright_from_both_sides_and_a_thick_one_from_one() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    for quality in BOTH {
        let mut seen = |name: &str, thickness: f32, translucency: f32, z: f32| {
            let environment = sunlit(Vec3::new(0.0, 0.5, z));
            light(
                &shoot(&mut studio, name, &leaf(thickness, translucency), (&environment, ahead()), quality),
                0.5,
                0.5,
            )
        };
        let front = seen("front", 0.0005, 0.9, 1.0);
        let back = seen("back", 0.0005, 0.9, -1.0);
        let thick = seen("thick-back", 0.03, 0.9, -1.0);
        let opaque = seen("opaque-back", 0.0005, 0.0, -1.0);
        // The sun is nearly behind it.
        assert!(back > 0.4 * front && back < 3.0 * front, "{quality:?}: {back} behind, {front} before");
        assert!(back > 4.0 * thick && back > 4.0 * opaque, "{quality:?}: {back}, {thick}, {opaque}");
        // A leaf of 5 mm has exp(-1) of what one of nothing has come through.
        let none = seen("clear", 0.0, 0.9, -1.0) - opaque;
        let some = seen("dim", 0.005, 0.9, -1.0) - opaque;
        assert!((some / none - (-1.0_f32).exp()).abs() < 0.03, "{quality:?}: {some} of {none}");
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn a_blade_thinner_than_a_pixel_is_lit_alike_from_both_sides() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let environment = sunlit(Vec3::Z);
    let mut blade = sheet_of(grey(1, 1, |_, _| 0), [0.0, 1.0], abi::MESH_TWO_SIDED, 0.03, [0.003, 0.3]);
    blade.materials = leaf(0.03, 0.0).materials;
    for quality in BOTH {
        let mut seen = |name: &str, rotation: [f32; 4]| {
            blade.joints[0].rotation = rotation;
            let picture = shoot(&mut studio, name, &blade, (&environment, ahead()), quality);
            (0..SIZE.0).map(|x| light(&picture, (x as f32 + 0.5) / SIZE.0 as f32, 0.5)).sum::<f32>()
        };
        let face = seen("blade", [0.0, 0.0, 0.0, 1.0]);
        let back = seen("turned-blade", [0.0, 1.0, 0.0, 0.0]);
        assert!(face > 0.1 && (back / face - 1.0).abs() < 0.03, "{quality:?}: {face} before, {back} behind");
    }
    let counts = studio.renderer().meshes().counts().expect("read back");
    let thin = counts.commands[BIN_LIT_THIN].indices;
    assert!(thin > 0 && counts.lit == counts.vertices, "it is lit at its vertices: {counts:?}");
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

/// Stripes of an opaque and a clear texel, the clear ones white.
fn stripes() -> Texture {
    let whole = grey(64, 64, |_, _| 128);
    let texel = |i: usize| if (i / 8).is_multiple_of(2) { [128, 128, 128, 255] } else { [255, 255, 255, 0] };
    let texels: Vec<u8> = (0..64 * 64).flat_map(texel).collect();
    Texture { hash: *blake3::hash(&texels).as_bytes(), texels, ..whole }
}

#[test]
fn a_cut_out_texture_leaves_holes_as_wide_as_its_clear_texels() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let environment = sunlit(Vec3::Z);
    for quality in BOTH {
        let mut covered = |name: &str, flags: u32, distance: f64| {
            let outputs = board_of(stripes(), [0.0, 1.0], flags, 1.0);
            let camera = sample::looking_at(DVec3::new(0.0, 0.0, distance), DVec3::ZERO);
            let picture = shoot(&mut studio, name, &outputs, (&environment, camera), quality);
            let seen: Vec<u8> = picture.rgba.chunks_exact(4).map(|p| p[1]).filter(|v| *v > 0).collect();
            (seen.len() as f32, *seen.iter().max().unwrap_or(&0), *seen.iter().min().unwrap_or(&0))
        };
        for distance in [1.2, 4.0] {
            let (whole, ..) = covered("whole", 0, distance);
            let (half, most, least) = covered("cut", abi::MESH_CUT_OUT, distance);
            assert!((half / whole - 0.5).abs() < 0.06, "{quality:?}, {distance} m: {half} of {whole}");
            // No fringe of what is behind the holes: neither white nor the material's own.
            assert!(most - least < 8, "{quality:?}, {distance} m: {least} to {most}");
        }
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn a_cut_out_texture_that_found_no_room_leaves_no_hole() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let environment = sunlit(Vec3::Z);
    for quality in BOTH {
        let mut covered = |name: &str, flags: u32| {
            let mut outputs = board_of(stripes(), [0.0, 1.0], flags, 1.0);
            // A small board behind it has a texture: so the picture's draws look at textures.
            outputs.materials = vec![abi::Material { texture: 2, ..white() }, white()];
            let small = abi::Skinned { material: 1, first_joint: 1, scale: 0.1, ..outputs.skinned[0] };
            outputs.skinned.push(small);
            outputs.joints.push(abi::Joint { translation: [0.0, 0.0, -0.2], ..outputs.joints[0] });
            let picture = shoot(&mut studio, name, &outputs, (&environment, ahead()), quality);
            picture.rgba.chunks_exact(4).filter(|p| p[1] > 0).count()
        };
        let (whole, cut) = (covered("missing-whole", 0), covered("missing-cut", abi::MESH_CUT_OUT));
        assert!(whole > 1000 && cut == whole, "{quality:?}: {cut} of {whole}");
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn a_leaf_mirrors_the_sun_softly_only_if_its_material_says_so() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    // Eye and sun level with each other on both sides of the normal: the middle mirrors the sun.
    let environment = sunlit(Vec3::new(-0.6, 0.0, 0.8));
    let camera = sample::looking_at(DVec3::new(0.72, 0.0, 0.96), DVec3::ZERO);
    for quality in BOTH {
        let mut seen = |specular: f32, roughness: f32| {
            let mut outputs = leaf(0.001, 0.9);
            let of = abi::Material { specular, roughness, ..outputs.materials[0] };
            outputs.materials = vec![of];
            let name = format!("shine-{specular}-{roughness}");
            shoot(&mut studio, &name, &outputs, (&environment, camera), quality)
        };
        let [none, tissue, wax, matt] = [seen(0.0, 0.3), seen(0.0003, 0.3), seen(0.02, 0.4), seen(0.02, 1.0)];
        assert!(none == tissue, "{quality:?}: tissue under water mirrors nothing");
        let more = |picture: &Picture, x: f32| light(picture, x, 0.5) - light(&none, x, 0.5);
        assert!(more(&wax, 0.5) > 0.1 && more(&wax, 0.5) > 4.0 * more(&matt, 0.5), "{}", more(&wax, 0.5));
        assert!(more(&wax, 0.5) > 3.0 * more(&wax, 0.3), "it is narrow: {}", more(&wax, 0.3));
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

/// The sample's sea over level ground, the sun above.
fn level() -> Environment {
    let of = sample::environment();
    let ground = of.terrain.as_deref().expect("it has one");
    let heights = vec![-4.0; ground.heights.len()];
    let terrain = Terrain { heights, rocks: Vec::new(), ..ground.clone() };
    let sun = Sun { direction: Vec3::new(0.2, 0.95, 0.1).normalize(), ..of.sun };
    Environment { terrain: Some(Arc::new(terrain)), sun, ..of }
}

#[test]
fn in_a_bed_it_is_dark_below_and_bright_above() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let environment = level();
    let models = Models::default();
    let camera = sample::looking_at(DVec3::new(0.0, -3.5, 1.3), DVec3::new(0.0, -3.5, 0.0));
    for quality in BOTH {
        let mut seen = |name: &str, many: bool| {
            let mut leaves = leaf(0.001, 0.9);
            leaves.objects[0].origin = [0.0, -4.0, 0.0];
            // A board of a metre on the ground; its rest is what the picture shows.
            leaves.joints[0].translation = [0.0, 0.5, 0.0];
            let mut plants = models.empty();
            if many {
                // A hedge behind the eye and beside it, in the board's cells, out of the picture.
                for i in 0..60 {
                    let x = 0.02 * f64::from(i % 30) - 0.3;
                    models.plant(&mut plants, [x, -4.0, -0.3 - 0.1 * f64::from(i / 30)], 1.0, 0.0);
                }
            }
            let frame = |outputs: &[&Outputs]| {
                let mut frame = sample::frame(1, camera, outputs[0].clone());
                frame.outputs.extend(outputs[1..].iter().map(|o| Arc::new((*o).clone())));
                frame
            };
            let frame = frame(&[&leaves, &plants]);
            let environment = &environment;
            let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment };
            let picture = studio.shoot(&shot, &Settings::of(quality)).expect("a picture");
            keep(&format!("leaf-bed-{name}-{quality:?}"), &picture);
            picture
        };
        let [alone, bed] = [("alone", false), ("among", true)].map(|(name, many)| seen(name, many));
        let ratio = |y: f32| light(&bed, 0.5, y) / light(&alone, 0.5, y);
        let [top, middle, foot] = [0.12, 0.5, 0.85].map(ratio);
        assert!(
            top > 0.85 && middle < 0.95 * top && foot < 0.9 * middle,
            "{quality:?}: {top} {middle} {foot}"
        );
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}
