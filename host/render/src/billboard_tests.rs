//! Sprites on a real device (lavapipe counts): planted ones in pictures whose every pixel is known.

use std::sync::Arc;

use glam::DVec3;
use reef_abi as abi;
use reef_gpu::{Gpu, Picture};
use reef_streams::{
    Outputs,
    environment::Environment,
    frame::{CameraPose, Frame},
    textures::Texture,
};

use super::{
    Settings, Shot,
    device_tests::{SIZE, blackboard, keep, open},
    sample,
};
use crate::Studio;

/// At 2 m the picture has this many pixels a metre: half its height over the tangent of half a radian, over 2
/// m.
const PIXELS: f64 = 180.0 / 0.546_302_489_843_790_5 / 2.0;

/// A diagram with a black ground, seen from 2 m.
fn board() -> (Environment, CameraPose) {
    (blackboard(), sample::looking_at(DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO))
}

fn sprite(x: f64, size: f64) -> abi::Billboard {
    abi::Billboard {
        position: [x as f32, 0.0, 0.0],
        size: size as f32,
        opacity: 1.0,
        color: 0xffff_ffff,
        flags: abi::BILLBOARD_FACING,
        ..abi::Billboard::default()
    }
}

/// Four fields: red, green above blue, white.
fn fields() -> Arc<Texture> {
    let texels = vec![255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 255];
    let (name, hash) = ("fields".to_owned(), [7; 32]);
    Arc::new(Texture { id: 1, name, width: 2, height: 2, srgb: false, texels, hash })
}

fn outputs(sprites: Vec<abi::Billboard>) -> Outputs {
    Outputs {
        objects: vec![abi::Object { id: 1, ..abi::Object::default() }],
        billboards: sprites,
        textures: Arc::new(vec![fields()]),
        ..Outputs::default()
    }
}

fn shoot(gpu: &Gpu, name: &str, sprites: Vec<abi::Billboard>, settings: &Settings) -> Picture {
    let (environment, camera) = board();
    let [previous, current] =
        [1, 2].map(|step: u64| -> Frame { sample::frame(step, camera, outputs(sprites.clone())) });
    let shot = Shot { previous: &previous, current: &current, alpha: 0.5, camera, environment: &environment };
    let mut studio = Studio::new(gpu, SIZE).expect("a studio");
    let picture = studio.shoot(&shot, settings).expect("a picture");
    keep(name, &picture);
    picture
}

/// The colour around a point of the board [m].
fn at(picture: &Picture, x: f64, y: f64) -> [u8; 3] {
    let place = |center: u32, offset: f64| (f64::from(center / 2) + offset * PIXELS) as u32;
    let pixel = picture.pixel(place(SIZE.0, x), place(SIZE.1, -y)).expect("inside");
    [pixel[0], pixel[1], pixel[2]]
}

fn is_red(p: [u8; 3]) -> bool {
    p[0] > 180 && p[1] < 90 && p[2] < 90
}

/// Linear light of the whole picture, channel green.
fn light(picture: &Picture) -> f64 {
    let decode = |v: u8| {
        let v = f64::from(v) / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    };
    picture.rgba.chunks_exact(4).map(|p| decode(p[1])).sum()
}

#[test]
fn a_sprite_shows_its_texture_upright_where_its_velocity_says() {
    let Some(gpu) = open() else { return };
    // Between two steps of 1/60 s, half a step before the end: 36 m/s are 0.3 m.
    let moving = abi::Billboard { texture: 1, velocity: [36.0, 0.0, 0.0], ..sprite(0.3, 1.0) };
    let picture = shoot(&gpu, "sprite-moving", vec![moving], &Settings::default());
    assert!(is_red(at(&picture, -0.25, 0.25)), "{:?}", at(&picture, -0.25, 0.25));
    let [green, blue, white] = [(0.25, 0.25), (-0.25, -0.25), (0.25, -0.25)].map(|(x, y)| at(&picture, x, y));
    assert!(green[1] > 180 && green[0] < 90 && blue[2] > 180 && blue[1] < 90, "{green:?} {blue:?}");
    assert!(white.iter().all(|v| *v > 180), "{white:?}");
    assert_eq!(at(&picture, 0.6, 0.0), [0; 3], "nothing beside it");

    let jumped = abi::Billboard { flags: moving.flags | abi::FLAG_NO_BLEND, ..moving };
    let picture = shoot(&gpu, "sprite-jumped", vec![jumped], &Settings::default());
    assert!(is_red(at(&picture, 0.05, 0.25)) && at(&picture, -0.3, 0.25) == [0; 3]);

    let turned = abi::Billboard { roll: std::f32::consts::FRAC_PI_2, ..moving };
    let picture = shoot(&gpu, "sprite-turned", vec![turned], &Settings::default());
    assert!(is_red(at(&picture, -0.25, -0.25)), "a quarter turn against the clock");
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn nearer_sprites_cover_farther_ones_whatever_their_order_and_kind() {
    let Some(gpu) = open() else { return };
    let red = |z: f32, size: f64| {
        let mut near = abi::Billboard { color: 0xff00_00ff, ..sprite(0.0, size) };
        near.position[2] = z;
        near
    };
    let blue = abi::Billboard { color: 0xffff_0000, ..sprite(0.0, 0.6) };
    for (name, sprites) in [
        ("sprite-order", vec![red(0.4, 0.3), blue]),
        ("sprite-order-reversed", vec![blue, red(0.4, 0.3)]),
        // Opaque specks are faint: enough of them are not.
        ("sprite-order-specks", [vec![red(0.4, 0.02); 60], vec![blue]].concat()),
    ] {
        let picture = shoot(&gpu, name, sprites, &Settings::default());
        assert!(is_red(at(&picture, 0.0, 0.0)), "{name}: {:?}", at(&picture, 0.0, 0.0));
    }
    let behind = shoot(&gpu, "sprite-behind", vec![red(-0.4, 0.3), blue], &Settings::default());
    assert!(at(&behind, 0.0, 0.0)[2] > 180, "the blue one is nearer now");
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn a_sprite_across_its_axis_is_seen_from_its_face_and_not_from_its_edge() {
    let Some(gpu) = open() else { return };
    let lying = |axis: [f32; 3]| abi::Billboard { axis, flags: 0, ..sprite(0.0, 1.0) };
    let face = shoot(&gpu, "sprite-face", vec![lying([0.0, 0.0, 1.0])], &Settings::default());
    assert!(at(&face, 0.0, 0.0)[1] > 240 && at(&face, 0.4, 0.0)[1] > 40);
    let edge = shoot(&gpu, "sprite-edge", vec![lying([1.0, 0.0, 0.0])], &Settings::default());
    assert!(light(&edge) < 0.02 * light(&face), "{} and {}", light(&edge), light(&face));
    let slanted = shoot(&gpu, "sprite-slanted", vec![lying([0.6, 0.0, 0.8])], &Settings::default());
    let share = light(&slanted) / light(&face);
    // The cosine; perspective makes the nearer half a little greater than it makes the other smaller.
    assert!((share - 0.8).abs() < 0.05, "{share}");
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn a_speck_gives_as_much_light_as_it_covers_wherever_it_stands_between_the_pixels() {
    let Some(gpu) = open() else { return };
    // The mean of the dot over its square is pi / 12.
    let expected = |pixels: f64| pixels * pixels * std::f64::consts::PI / 12.0;
    for (pixels, offsets) in [(3.0, [0.0, 0.21, 0.5, 0.83]), (1.0, [0.0, 0.3, 0.5, 0.7])] {
        for offset in offsets {
            // Many beside each other, because one is little light: 40 in a row, five pixels apart.
            let row =
                (0..40).map(|i| sprite((f64::from(i) * 7.0 - 140.0 + offset) / PIXELS, pixels / PIXELS));
            for samples in [1, 2] {
                let settings = Settings { samples, ..Settings::default() };
                let picture = shoot(
                    &gpu,
                    &format!("specks-{pixels}-{offset}-{samples}"),
                    row.clone().collect(),
                    &settings,
                );
                let share = light(&picture) / 40.0 / expected(pixels);
                // Eight bits hold a faint pixel's light to a few per cent.
                assert!((share - 1.0).abs() < 0.06, "{pixels} px, {offset}, {samples} samples: {share}");
            }
        }
    }
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn the_ground_hides_what_lies_under_it_and_softens_what_touches_it() {
    let Some(gpu) = open() else { return };
    let environment = sample::environment();
    let camera = sample::looking_at(DVec3::new(0.0, -3.3, 1.6), DVec3::new(0.0, -3.9, 0.0));
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let mut shoot = |name: &str, sprites: Vec<abi::Billboard>| {
        let frame = sample::frame(1, camera, outputs(sprites));
        let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
        let picture = studio.shoot(&shot, &Settings::default()).expect("a picture");
        keep(name, &picture);
        picture
    };
    let cloud = |y: f32| abi::Billboard { position: [0.0, y, 0.0], ..sprite(0.0, 0.5) };
    let nothing = shoot("cloud-none", vec![]);
    assert!(shoot("cloud-under", vec![cloud(-4.6)]) == nothing, "nothing shines through the sand");
    let whole = shoot("cloud-above", vec![cloud(-3.7)]);
    let half = shoot("cloud-touching", vec![cloud(-4.0)]);
    assert!(whole != nothing && half != nothing);
    // Where a hard edge would cut through the cloud there is none: rows differ from the picture without it by
    // little more than their neighbours do.
    let change = |y: u32| {
        let row = |p: &Picture| {
            (0..SIZE.0).map(|x| i32::from(p.pixel(x, y).expect("inside")[0])).collect::<Vec<_>>()
        };
        let pairs = row(&half).into_iter().zip(row(&nothing));
        f64::from(pairs.map(|(a, b)| (a - b).abs()).max().unwrap_or(0))
    };
    let steps = (1..SIZE.1).map(|y| (change(y) - change(y - 1)).abs()).fold(0.0, f64::max);
    let most = (0..SIZE.1).map(change).fold(0.0, f64::max);
    assert!(most > 20.0, "it is seen: {most}");
    // The cloud's own slope and a step of dither; a hard edge would be most of it.
    assert!(steps < 0.35 * most, "a step of {steps} of {most}");
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}
