//! Textures on a real device (lavapipe counts): boards and fibres that wear them, in pictures whose every
//! pixel is known.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use reef_abi as abi;
use reef_gpu::Picture;
use reef_streams::{
    Outputs,
    meshes::{Meshes, Wanted},
    textures::Texture,
};

use super::{
    Quality, Settings, Shot,
    device_tests::{SIZE, blackboard, decoded, keep, open},
    sample,
};
use crate::Studio;

/// A texture of grey texels, opaque.
pub(super) fn grey(width: u32, height: u32, texel: impl Fn(u32, u32) -> u8) -> Texture {
    let four = |i: u32| {
        let v = texel(i % width, i / width);
        [v, v, v, 255]
    };
    let texels: Vec<u8> = (0..width * height).flat_map(four).collect();
    let hash = *blake3::hash(&[&texels[..], &width.to_le_bytes()].concat()).as_bytes();
    Texture { id: 1, name: "grey".into(), width, height, srgb: false, texels, hash }
}

/// Its columns, `by` farther to the right; what leaves on the right comes in on the left.
fn turned(texture: &Texture, by: u32) -> Texture {
    let width = texture.width;
    let at = |x: u32, y: u32| texture.texels[((y * width + (x + width - by) % width) * 4) as usize];
    grey(width, texture.height, at)
}

/// White tissue with nothing of its own.
pub(super) fn white() -> abi::Material {
    let color = [1.0; 4];
    abi::Material { base: color, tip: color, texture: 1, roughness: 1.0, ..abi::Material::default() }
}

/// A board of a metre that faces the eye and wears a texture from `from` to `to` along u.
pub(super) fn board(texture: Texture, [from, to]: [f32; 2]) -> Outputs {
    board_of(texture, [from, to], 0, 1.0)
}

/// The same as a mesh with these flags, so thick [m].
pub(super) fn board_of(texture: Texture, range: [f32; 2], flags: u32, thickness: f32) -> Outputs {
    sheet_of(texture, range, flags, thickness, [1.0; 2])
}

/// The same with this width and height [m].
pub(super) fn sheet_of(
    texture: Texture,
    [from, to]: [f32; 2],
    flags: u32,
    thickness: f32,
    [width, height]: [f32; 2],
) -> Outputs {
    let vertex = |x: f32, y: f32| abi::MeshVertex {
        position: [width * (x - 0.5), height * (y - 0.5), 0.0],
        normal: abi::pack_normal([0.0, 0.0, 1.0]),
        uv: [from + (to - from) * x, y],
        thickness,
        color: u32::MAX,
        ..abi::MeshVertex::default()
    };
    let vertices = [vertex(0.0, 0.0), vertex(1.0, 0.0), vertex(1.0, 1.0), vertex(0.0, 1.0)];
    let level = abi::MeshLevel { index_count: 6, vertex_count: 4, ..abi::MeshLevel::default() };
    let mut meshes = Meshes::default();
    let wanted = Wanted {
        name: "board",
        vertices: &vertices,
        indices: &[0, 1, 2, 0, 2, 3],
        levels: &[level],
        flags,
        ..Wanted::default()
    };
    let mesh = meshes.add(wanted).expect("sound").expect("room");
    let rotation = [0.0, 0.0, 0.0, 1.0];
    Outputs {
        objects: vec![abi::Object { id: 1, bounds_radius: 1.0, ..abi::Object::default() }],
        skinned: vec![abi::Skinned { mesh, joint_count: 1, scale: 1.0, ..abi::Skinned::default() }],
        joints: vec![abi::Joint { rotation, translation: [0.0; 3], scale: 1.0 }],
        meshes: meshes.list().clone(),
        materials: vec![white()],
        textures: Arc::new(vec![Arc::new(texture)]),
        ..Outputs::default()
    }
}

/// An upright fibre as wide as a hand, its angle 0 turned about its axis, that wears a texture.
fn column(texture: Texture, angle: f32) -> Outputs {
    let bed = sample::Bed { count: 1, spacing: 0.0, per_row: 1, y: 0.0, length: 0.6, radius: 0.1 };
    let mut outputs = sample::tentacles(&bed, 0.0);
    let last = outputs.fibre_nodes.len() - 1;
    for (i, node) in outputs.fibre_nodes.iter_mut().enumerate() {
        *node = abi::FibreNode { position: [0.0, 0.6 * (i as f32 / last as f32 - 0.5), 0.0], radius: 0.1 };
    }
    outputs.fibres[0].sides = 32;
    outputs.fibres[0].normal = Vec3::new(angle.cos(), 0.0, -angle.sin()).to_array();
    outputs.materials = vec![white()];
    outputs.textures = Arc::new(vec![Arc::new(texture)]);
    outputs
}

fn shoot(studio: &mut Studio, name: &str, outputs: Outputs, distance: f64, quality: Quality) -> Picture {
    let environment = blackboard();
    let camera = sample::looking_at(DVec3::new(0.0, 0.0, distance), DVec3::ZERO);
    let frame = sample::frame(1, camera, outputs);
    let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
    let settings = Settings { detail: None, ..Settings::of(quality) };
    let picture = studio.shoot(&shot, &settings).expect("a picture");
    keep(&format!("texture-{name}-{quality:?}"), &picture);
    picture
}

/// How many pixels show something, and the greatest difference of light between two of these.
fn shown(picture: &Picture) -> (usize, u8) {
    let seen: Vec<u8> = picture.rgba.chunks_exact(4).map(|p| p[1]).filter(|v| *v > 3).collect();
    let [least, most] = [seen.iter().min(), seen.iter().max()].map(|v| v.copied().unwrap_or(0));
    (seen.len(), most - least)
}

/// The greatest difference of two pictures' pixels, and how many differ by more than 3.
fn difference(a: &Picture, b: &Picture) -> (u8, usize) {
    let of = a.rgba.iter().zip(&b.rgba).map(|(a, b)| a.abs_diff(*b));
    (of.clone().max().unwrap_or(0), of.filter(|d| *d > 3).count())
}

#[test]
fn a_texture_whose_edges_join_shows_no_line_where_they_do() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    // Few texels, so that what is wrong at an edge is wide: four and twelve of a texture that is made wider.
    for width in [4, 12, 64, 160] {
        let wave = |x: u32, _| {
            let angle = (x as f32 + 0.5) / width as f32 * std::f32::consts::TAU;
            (140.0 + 100.0 * angle.sin()) as u8
        };
        let texture = grey(width, 4, wave);
        for quality in [Quality::High, Quality::Low] {
            // A quarter of the texture is a quarter turn: the same picture, with the seam elsewhere.
            let mut seen = |name: &str, quarters: u32| {
                let outputs = column(
                    turned(&texture, quarters * width / 4),
                    -std::f32::consts::FRAC_PI_2 * quarters as f32,
                );
                shoot(&mut studio, &format!("{name}-{width}"), outputs, 1.0, quality)
            };
            let [at_the_side, before] = [("column", 0), ("column-turned", 1)].map(|(n, q)| seen(n, q));
            let (pixels, contrast) = shown(&before);
            assert!(pixels > 1000 && contrast > 80, "{quality:?}, {width} texels: {pixels}, {contrast}");
            let (most, many) = difference(&at_the_side, &before);
            assert!(many < 8, "{quality:?}, {width} texels: {many} differ, by {most}");
            // On a mesh, u goes on beyond 1.
            let mut seen = |name: &str, by: u32, span: [f32; 2]| {
                let outputs = board(turned(&texture, by), span);
                shoot(&mut studio, &format!("{name}-{width}"), outputs, 1.2, quality)
            };
            let whole = seen("board", 0, [0.0, 1.0]);
            let moved = seen("board-moved", width / 2, [0.5, 1.5]);
            let (pixels, contrast) = shown(&moved);
            assert!(pixels > 1000 && contrast > 40, "{quality:?}, {width} texels: {pixels}, {contrast}");
            let (most, many) = difference(&whole, &moved);
            assert!(many < 8, "{quality:?}, {width} texels, board: {many} differ, by {most}");
        }
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

/// Mean and greatest difference from it of the light in the middle of a picture.
fn middle(picture: &Picture) -> (f32, f32) {
    let (x, y) = (SIZE.0 / 2, SIZE.1 / 2);
    let pixels = (0..64).map(|i| picture.pixel(x - 4 + i % 8, y - 4 + i / 8).expect("inside"));
    let light: Vec<f32> = pixels.map(|p| decoded(p[1])).collect();
    let mean = light.iter().sum::<f32>() / light.len() as f32;
    (mean, light.iter().map(|v| (v - mean).abs()).fold(0.0, f32::max))
}

#[test]
fn a_fine_texture_is_fine_from_near_and_its_mean_from_afar() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    for quality in [Quality::High, Quality::Low] {
        let flat = shoot(&mut studio, "flat", board(grey(64, 64, |_, _| 128), [0.0, 1.0]), 1.0, quality);
        let (half, _) = middle(&flat);
        for (side, sharp) in [(64, true), (256, true), (512, true), (1024, false)] {
            let checks =
                || board(grey(side, side, |x, y| if (x ^ y) & 1 == 0 { 255 } else { 0 }), [0.0, 1.0]);
            // From where a texel is four pixels wide, as the size of the array has it.
            let near = 400.0 / (4.0 * f64::from(side.min(512)));
            let name = format!("checks-{side}");
            let (mean, contrast) = middle(&shoot(&mut studio, &name, checks(), near, quality));
            assert!((mean / half - 1.0).abs() < 0.1, "{quality:?}, {side}: {mean} of {half}");
            assert_eq!(contrast > 0.7 * half, sharp, "{quality:?}, {side}: {contrast} of {half}");
            // From where a pixel is four texels wide: one level has to have the other's mean.
            let far = 400.0 * 4.0 / f64::from(side.min(512));
            let (mean, contrast) =
                middle(&shoot(&mut studio, &format!("{name}-far"), checks(), far, quality));
            // Of eight bits, one.
            assert!((mean / half - 1.0).abs() < 0.02, "{quality:?}, {side} from afar: {mean} of {half}");
            assert!(contrast < 0.03 * half, "{quality:?}, {side} from afar: {contrast} of {half}");
        }
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn textures_of_all_sizes_are_seen_in_one_picture() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    for quality in [Quality::High, Quality::Low] {
        // Three boards beside each other, each of another grey and size; and sprites with the same textures.
        let values = [(40_u8, 32), (120, 200), (220, 400)];
        let mut outputs = board(grey(1, 1, |_, _| 0), [0.0, 1.0]);
        let textures = values.map(|(v, side)| Arc::new(grey(side, 8, |_, _| v)));
        let numbered = (1..).zip(textures).map(|(id, t)| Arc::new(Texture { id, ..(*t).clone() }));
        outputs.textures = Arc::new(numbered.collect());
        outputs.materials = (1..=3).map(|texture| abi::Material { texture, ..white() }).collect();
        let of = outputs.skinned[0];
        let places = [-0.6_f32, 0.0, 0.6];
        outputs.skinned =
            (0..3).map(|i| abi::Skinned { material: i, first_joint: i, scale: 0.25, ..of }).collect();
        outputs.joints = places
            .map(|x| abi::Joint { rotation: [0.0, 0.0, 0.0, 1.0], translation: [x, 0.2, 0.0], scale: 1.0 })
            .to_vec();
        outputs.billboards = (1..=3)
            .zip(places)
            .map(|(texture, x)| abi::Billboard {
                position: [x, -0.2, 0.0],
                size: 0.25,
                opacity: 1.0,
                color: u32::MAX,
                flags: abi::BILLBOARD_FACING,
                texture,
                ..abi::Billboard::default()
            })
            .collect();
        let picture = shoot(&mut studio, "sizes", outputs, 2.0, quality);
        let pixels = f64::from(SIZE.1) / 0.546_302_489_843_790_5 / 4.0;
        let light = |x: f32, y: f64| {
            let place = |middle: u32, offset: f64| (f64::from(middle / 2) + offset * pixels) as u32;
            let pixel = picture.pixel(place(SIZE.0, f64::from(x)), place(SIZE.1, -y)).expect("inside");
            decoded(pixel[1])
        };
        for y in [0.2, -0.2] {
            let seen = places.map(|x| light(x, y));
            assert!(seen[0] > 0.01 && seen[1] < 1.0, "{quality:?}: {seen:?}");
            // As their values are to each other, but for the tone curve's shoulder.
            let ratio = seen[1] / seen[0];
            assert!((ratio - 3.0).abs() < 0.35 && seen[2] > 1.3 * seen[1], "{quality:?}, {y}: {seen:?}");
        }
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}
