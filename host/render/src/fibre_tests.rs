//! How fibres look on a real device (lavapipe counts): what is thin stays whole while it moves, and tissue
//! lets light through.

use glam::{DVec3, Vec3};
use reef_abi as abi;
use reef_gpu::Picture;
use reef_streams::{
    Outputs,
    environment::{Environment, Sun},
};

use super::{
    Quality, Settings, Shot,
    device_tests::{SIZE, blackboard, decoded, keep, open},
    meshes::sample::Models,
    sample,
    texture_tests::{board_of, grey},
};
use crate::Studio;

/// Pictures of three seconds.
const PICTURES: usize = 91;

/// Light of every pixel's green as it is shown, or as it is mixed.
fn greens(picture: &Picture, quality: Quality) -> Vec<f32> {
    let light = |v: &u8| match quality {
        Quality::High => decoded(*v),
        Quality::Low => f32::from(*v) / 255.0,
    };
    picture.rgba.iter().skip(1).step_by(4).map(light).collect()
}

/// How abruptly pixels change while something sways slowly for three seconds: the sum of how much their
/// changes change from picture to picture, over the sum of the changes. An edge that crosses a pixel evenly
/// in n pictures gives 2/n, one that jumps over it 2, and so does what comes and goes.
fn abruptness(
    studio: &mut Studio,
    (name, distance): (&str, f64),
    settings: &Settings,
    make: impl Fn(f32) -> Outputs,
) -> f32 {
    let environment = blackboard();
    let camera = sample::looking_at(DVec3::new(0.0, 0.25, distance), DVec3::new(0.0, 0.25, 0.0));
    let (mut changes, mut jerks) = (0.0_f64, 0.0_f64);
    let mut seen: [Vec<f32>; 2] = Default::default();
    for i in 0..PICTURES {
        // There and back in six seconds.
        let sway = 0.12 * (std::f32::consts::PI * i as f32 / (PICTURES - 1) as f32).sin();
        let frame = sample::frame(1, camera, make(sway));
        let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
        let picture = studio.shoot(&shot, settings).expect("a picture");
        if i % 45 == 0 {
            keep(&format!("{name}-{:?}-{i}", settings.quality), &picture);
        }
        let now = greens(&picture, settings.quality);
        for ((now, before), first) in now.iter().zip(&seen[0]).zip(&seen[1]) {
            changes += f64::from((now - before).abs());
            jerks += f64::from((now - 2.0 * before + first).abs());
        }
        let [before, _] = seen;
        seen = [now, before];
    }
    assert!(changes > 100.0, "{name}: something moves: {changes}");
    (jerks / changes) as f32
}

#[test]
fn blades_neither_break_nor_sparkle_over_three_seconds() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    for quality in [Quality::Low, Quality::High] {
        // Blades of 3.2 to .5 pixels, from their faces and from their edges. Most edges need four pictures to
        // a pixel or more.
        let seen = abruptness(&mut studio, ("blades", 1.3), &Settings::of(quality), |sway| {
            let mut outputs = Outputs { materials: vec![sample::blade_material()], ..Outputs::default() };
            sample::grass(&mut outputs, 1, [0.0; 3], 0, sway);
            outputs
        });
        assert!(seen < 0.9, "{quality:?}: {seen}");
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn far_meshes_of_grass_neither_break_nor_sparkle_over_three_seconds() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let models = Models::default();
    for quality in [Quality::Low, Quality::High] {
        // A row of shoots whose ribbons are half a pixel wide.
        let seen = abruptness(&mut studio, ("grass", 4.0), &Settings::of(quality), |sway| {
            let mut outputs = models.empty();
            for i in 0..20 {
                let (x, size) = (0.11 * f64::from(i) - 1.0, 1.0 + 0.02 * i as f32);
                models.grass(&mut outputs, [x, 0.0, 0.02 * f64::from(i % 5)], size, sway);
            }
            outputs
        });
        println!("{quality:?}: {seen}");
        assert!(seen < 0.9, "{quality:?}: {seen}");
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn far_meshes_of_grass_are_as_bright_as_many_samples_of_them_are() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let models = Models::default();
    let environment = blackboard();
    // High quality mixes light, whatever share of a pixel it fills. A board far aside has a texture: then the
    // draws look at textures.
    for textured in [false, true] {
        let mut light = |samples: u32, distance: f64| {
            let mut outputs = models.empty();
            for i in 0..20 {
                let (x, size) = (0.11 * f64::from(i) - 1.0, 1.0 + 0.02 * i as f32);
                models.grass(&mut outputs, [x, 0.0, 0.0], size, 0.01 * i as f32);
            }
            if textured {
                models.plant(&mut outputs, [0.0, -50.0, 0.0], 0.01, 0.0);
                outputs.materials[0].texture = 1;
                outputs.textures = board_of(grey(1, 1, |_, _| 128), [0.0, 1.0], 0, 1.0).textures;
            }
            let camera = sample::looking_at(DVec3::new(0.0, 0.25, distance), DVec3::new(0.0, 0.25, 0.0));
            let frame = sample::frame(1, camera, outputs);
            let shot =
                Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
            let settings = Settings { samples, ..Settings::of(Quality::High) };
            let picture = studio.shoot(&shot, &settings).expect("a picture");
            keep(&format!("grass-light-{textured}-{samples}-{distance}"), &picture);
            greens(&picture, Quality::High).iter().sum::<f32>()
        };
        for distance in [3.0, 6.0, 12.0] {
            let (one, many) = (light(1, distance), light(4, distance));
            println!("textured {textured}, {distance} m: {one} and {many}");
            assert!((one / many - 1.0).abs() < 0.15, "textured {textured}, {distance} m: {one}, {many}");
        }
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

/// One upright tentacle of a radius [m] and translucency.
fn tentacle(radius: f32, translucency: f32) -> Outputs {
    let bed = sample::Bed { count: 1, spacing: 0.0, per_row: 1, y: 0.0, length: 0.5, radius };
    let mut outputs = sample::tentacles(&bed, 0.0);
    for (i, node) in outputs.fibre_nodes.iter_mut().enumerate() {
        *node = abi::FibreNode { position: [0.0, 0.05 * i as f32, 0.0], radius };
    }
    outputs.materials = vec![abi::Material { translucency, rim: 0.0, ..sample::tissue() }];
    outputs
}

#[test]
fn a_thin_tentacle_glows_against_the_light_and_a_thick_one_does_not() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    for quality in [Quality::Low, Quality::High] {
        // The light of its middle. The sun stands 60 degrees high, behind it or behind the eye; the eye is
        // level with it, or `above` it [m].
        let mut light = |name: &str, radius: f32, translucency: f32, behind: f32, above: f64| {
            let sun = Sun { direction: Vec3::new(0.0, 0.866, -0.5 * behind), ..sample::environment().sun };
            let environment = Environment { sun, ..blackboard() };
            let camera = sample::looking_at(DVec3::new(0.0, 0.35 + above, 0.5), DVec3::new(0.0, 0.35, 0.0));
            let frame = sample::frame(1, camera, tentacle(radius, translucency));
            let shot =
                Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
            let picture = studio.shoot(&shot, &Settings::of(quality)).expect("a picture");
            keep(&format!("glow-{name}-{quality:?}"), &picture);
            let middle = picture.pixel(SIZE.0 / 2, SIZE.1 / 2).expect("inside");
            middle[..3].iter().map(|v| decoded(*v)).sum::<f32>()
        };
        let (thin, thick) = (0.003, 0.03);
        let against = light("against", thin, 0.8, 1.0, 0.0);
        let with = light("with", thin, 0.8, -1.0, 0.0);
        let thick_against = light("thick", thick, 0.8, 1.0, 0.0);
        let opaque = light("opaque", thin, 0.0, 1.0, 0.0);
        let from_below = light("below", thin, 0.8, 0.0, -0.5);
        let from_above = light("above", thin, 0.8, 0.0, 0.5);
        eprintln!("{quality:?}: {against} {with} {thick_against} {opaque} {from_below} {from_above}");
        assert!(against > 1.2 * with, "{quality:?}: {against} against the light, {with} with it");
        assert!(against > 2.0 * thick_against, "{quality:?}: {against}, thick {thick_against}");
        assert!(against > 3.0 * opaque, "{quality:?}: {against}, opaque {opaque}");
        assert!(
            from_below > 1.3 * from_above,
            "{quality:?}: {from_below} toward the window, {from_above} away"
        );
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}
