//! The passes on a real device (lavapipe counts): the GPU's vertices against the CPU's twin, and what a
//! picture must and must not be. With REEF_TEST_PICTURES=DIR the pictures are kept for looking at.

use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};
use reef_abi as abi;
use reef_gpu::{Gpu, GpuOptions, Picture, Validation};
use reef_streams::{
    Outputs,
    environment::{Environment, Sun},
    frame::{CameraPose, Frame},
    textures::Texture,
};

use super::{
    Quality, Settings, Shot,
    fibre_records::{STRIP_WORDS, VERTEX_WORDS},
    gather, lod,
    markers::Markers,
    sample,
    twin::{self, Skinned},
    view::{self, Lens},
};
use crate::{pictures::write_png, studio::Studio};

pub(super) const SIZE: (u32, u32) = (640, 360);

pub(super) fn open() -> Option<Gpu> {
    match Gpu::open(&GpuOptions { validation: Validation::Off, ..GpuOptions::default() }) {
        Ok(gpu) => {
            newest_shaders(&gpu);
            Some(gpu)
        }
        Err(error) if std::env::var("REEF_REQUIRE").as_deref() == Ok("all") => panic!("{error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// With REEF_TEST_SHADERS=DIR, SPIR-V from there takes the place of what is embedded.
fn newest_shaders(gpu: &Gpu) {
    let Ok(folder) = std::env::var("REEF_TEST_SHADERS") else { return };
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let name = entry.file_name().to_string_lossy().replace(".spv", "");
        let bytes = std::fs::read(entry.path()).expect("readable");
        gpu.shaders().replace(&name, &bytes).expect("usable");
    }
}

pub(super) fn keep(name: &str, picture: &Picture) {
    if let Ok(folder) = std::env::var("REEF_TEST_PICTURES") {
        write_png(&std::path::Path::new(&folder).join(format!("{name}.png")), picture).expect("written");
    }
}

fn hero() -> CameraPose {
    sample::looking_at(DVec3::new(0.15, -3.45, 1.5), DVec3::new(0.0, -3.62, 0.0))
}

fn two_steps(make: impl Fn(f32) -> Outputs, camera: CameraPose) -> [Frame; 2] {
    [sample::frame(1, camera, make(0.0)), sample::frame(2, camera, make(0.12))]
}

/// What a half float stands for.
pub(super) fn half(v: u32) -> f32 {
    let (sign, exponent, mantissa) = (v >> 15 & 1, v >> 10 & 31, v & 1023);
    let value = match exponent {
        0 => mantissa as f32 * 2.0_f32.powi(-24),
        _ => (1.0 + mantissa as f32 / 1024.0) * 2.0_f32.powi(exponent as i32 - 15),
    };
    if sign == 1 { -value } else { value }
}

fn snorm(v: u32) -> f32 {
    (f32::from(v as u16 as i16) / 32767.0).max(-1.0)
}

/// A diagram with a black ground.
pub(super) fn blackboard() -> Environment {
    Environment { terrain: None, plain_background: Some([0.0; 3]), ..sample::environment() }
}

/// Compares one fibre's vertices with its twin's. Positions: sine, cosine and square root on the device err
/// by a few units in the last place of coordinates near 2; packed values by half a step of their format.
fn assert_same(
    name: &str,
    expected: &Skinned,
    vertices: &[[u32; VERTEX_WORDS]],
    indices: &[u32],
    first: u32,
) {
    assert_eq!(vertices.len(), expected.vertices.len(), "{name}");
    for (i, (v, e)) in vertices.iter().zip(&expected.vertices).enumerate() {
        let clip =
            Vec4::new(f32::from_bits(v[0]), f32::from_bits(v[1]), f32::from_bits(v[2]), f32::from_bits(v[3]));
        assert!(
            clip.distance(e.clip) < 2e-5 * (1.0 + e.clip.length()),
            "{name}, vertex {i}: {clip} and {}",
            e.clip
        );
        let normal = Vec3::new(snorm(v[4] & 0xffff), snorm(v[4] >> 16), snorm(v[5] & 0xffff));
        assert!(normal.distance(e.normal) < 2e-3, "{name}, vertex {i}: {normal} and {}", e.normal);
        assert!((snorm(v[5] >> 16) * 2.0 - e.along).abs() < 2e-4, "{name}, vertex {i}");
        assert!((half(v[7] & 0xffff) - e.radius_cm).abs() < 1e-3 * (1.0 + e.radius_cm), "{name}, vertex {i}");
        assert!((half(v[7] >> 16) - e.half_px).abs() < 1e-3 * (1.0 + e.half_px), "{name}, vertex {i}");
        let edge = f32::from_bits(v[11]);
        assert!((edge - e.edge_px).abs() < 1e-3 * (1.0 + e.edge_px.abs()), "{name}, vertex {i}");
    }
    let relative: Vec<u32> = indices.iter().map(|i| i - first).collect();
    assert!(relative == expected.indices, "{name}: the triangles differ");
}

#[test]
fn the_gpus_vertices_are_those_of_the_twin() {
    let Some(gpu) = open() else { return };
    let environment = sample::environment();
    let camera = hero();
    let [previous, current] = two_steps(|sway| sample::garden(&environment, sway), camera);
    let lens = Lens::new(&camera, [SIZE.0, SIZE.1], view::visibility(&environment));
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    for (alpha, detail) in [(0.3, Some(lod::Thresholds::default())), (1.0, None)] {
        let shot = Shot { previous: &previous, current: &current, alpha, camera, environment: &environment };
        let settings = Settings { detail, ..Settings::default() };
        studio.run(&shot, &settings).expect("a picture");
        let (vertices, indices) = studio.renderer().fibres().read_back().expect("read back");
        let counts = studio.renderer().fibres().counts().expect("read back");
        let gathered = gather::gather(&previous, &current, alpha, &lens, 0);
        // Indices of ribbons come after all others.
        let (mut vertex, mut drawn) = (0, 0);
        let (mut index, mut flat) = (0, counts.flat_tubes.first_index as usize);
        assert_eq!(
            (flat, indices.len() - flat),
            (counts.tubes.indices as usize, counts.flat_tubes.indices as usize)
        );
        for i in 0..gathered.fibres.len() {
            let Some(expected) = twin::skin(&gathered, i, &lens, detail.as_ref()) else { continue };
            let (v, n) = (expected.vertices.len(), expected.indices.len());
            let first = if expected.is_ribbon() { &mut flat } else { &mut index };
            assert!(vertex + v <= vertices.len() && *first + n <= indices.len(), "fibre {i} is missing");
            assert_same(
                &format!("fibre {i}, alpha {alpha}"),
                &expected,
                &vertices[vertex..vertex + v],
                &indices[*first..*first + n],
                vertex as u32,
            );
            vertex += v;
            *first += n;
            drawn += 1;
        }
        assert_eq!(
            (vertex, index, flat, drawn),
            (vertices.len(), counts.tubes.indices as usize, indices.len(), counts.drawn),
            "nothing else is drawn"
        );
        assert_eq!(counts.left_out, 0);
        if detail.is_none() {
            assert_eq!(drawn as usize, gathered.fibres.len(), "nothing is culled without detail");
        } else {
            assert!((drawn as usize) < gathered.fibres.len(), "something is culled");
        }
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

/// A strip's vertices as the device wrote them: clip space and coverage.
fn strip_vertex(v: &[u32; STRIP_WORDS]) -> (Vec4, f32) {
    let clip =
        Vec4::new(f32::from_bits(v[0]), f32::from_bits(v[1]), f32::from_bits(v[2]), f32::from_bits(v[3]));
    (clip, (v[4] >> 24) as f32 / 255.0)
}

#[test]
fn the_gpus_ribbons_are_those_of_the_twin_solid_ones_before_thin_ones() {
    let Some(gpu) = open() else { return };
    let environment = sample::environment();
    let camera = hero();
    let [previous, current] = two_steps(|sway| sample::garden(&environment, sway), camera);
    let lens = Lens::new(&camera, [SIZE.0, SIZE.1], view::visibility(&environment));
    let shot = Shot { previous: &previous, current: &current, alpha: 0.3, camera, environment: &environment };
    let settings = Settings::of(Quality::Low);
    let limits = settings.detail.expect("low quality has levels of detail");
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    studio.run(&shot, &settings).expect("a picture");
    let seen = studio.renderer().fibres().read_back_strips().expect("read back");
    let counts = studio.renderer().fibres().counts().expect("read back");
    let (tubes, _) = studio.renderer().fibres().read_back().expect("read back");
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());

    let gathered = gather::gather(&previous, &current, 0.3, &lens, 0);
    let strips: Vec<Option<twin::Strip>> =
        (0..gathered.fibres.len()).map(|i| twin::strip(&gathered, i, &lens, &limits)).collect();
    let of = |thin: bool| strips.iter().flatten().filter(move |s| s.thin == thin);
    let expected: Vec<(Vec4, f32)> = of(false).chain(of(true)).flat_map(|s| s.vertices.clone()).collect();
    let solid = of(false).map(|s| s.vertices.len()).sum::<usize>();
    assert_eq!((counts.solid.vertices as usize, counts.thin.first_vertex as usize), (solid, solid));
    assert!(of(false).count() > 20 && of(true).count() > 20, "the scene has both kinds");
    assert_eq!(seen.len(), expected.len());
    for (i, (v, (clip, coverage))) in seen.iter().zip(&expected).enumerate() {
        let (seen, covered) = strip_vertex(v);
        // As in `assert_same`; coverage is packed into 8 bits.
        assert!(seen.distance(*clip) < 2e-5 * (1.0 + clip.length()), "vertex {i}: {seen} and {clip}");
        assert!((covered - coverage).abs() < 0.003, "vertex {i}: {covered} and {coverage}");
    }
    let others = strips.iter().enumerate().filter(|(_, strip)| strip.is_none());
    let skinned = others.filter_map(|(i, _)| twin::skin(&gathered, i, &lens, Some(&limits)));
    assert_eq!(tubes.len(), skinned.map(|s| s.vertices.len()).sum::<usize>(), "all others are tubes");
}

#[test]
fn low_quality_shows_the_same_sea_and_its_ribbons_the_same_tentacles() {
    let Some(gpu) = open() else { return };
    let environment = sample::environment();
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let low = Settings::of(Quality::Low);
    let side = sample::looking_at(DVec3::new(-3.0, -2.9, 2.4), DVec3::new(0.0, -3.8, -2.0));
    let cameras = [("low-garden", hero()), ("low-wide", side)];
    for (name, camera) in cameras {
        let [previous, current] = two_steps(|sway| sample::garden(&environment, sway), camera);
        let shot =
            Shot { previous: &previous, current: &current, alpha: 0.5, camera, environment: &environment };
        let high = studio.shoot(&shot, &Settings::default()).expect("a picture");
        let shown = studio.shoot(&shot, &low).expect("a picture");
        let tubes = studio.shoot(&shot, &Settings { detail: None, ..low }).expect("a picture");
        keep(name, &shown);
        keep(&format!("{name}-tubes"), &tubes);
        keep(&format!("{name}-high"), &high);
        // Means over blocks of 40 pixels: what a person sees from afar. Shafts that are left out, caustics of
        // four waves instead of eight, and another sand move blocks of water and ground; ribbons stand for
        // round tissue.
        for (other, mean, most) in [(&high, 7.0, 45.0), (&tubes, 0.8, 12.0)] {
            let (seen_mean, seen_most) = block_difference(&shown, other);
            assert!(seen_mean < mean && seen_most < most, "{name}: {seen_mean} and {seen_most}");
        }
        let fine = studio.shoot(&shot, &Settings { samples: 2, ..low }).expect("a picture");
        let (mean, most) = block_difference(&shown, &fine);
        assert!(mean < 1.5 && most < 12.0, "{name}, through the tone pass: {mean} and {most}");
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn a_materials_texture_lies_once_along_a_fibre_and_leaves_other_fibres_alone() {
    let Some(gpu) = open() else { return };
    // Two rows: red, and a clear one; the tip has the first.
    let texels = [[255, 0, 0, 255], [255, 0, 0, 255], [0, 0, 0, 0], [0, 0, 0, 0]].concat();
    let name = "half red".to_owned();
    let hash = *blake3::hash(&texels).as_bytes();
    let texture = Arc::new(Texture { id: 7, name, width: 2, height: 2, srgb: false, texels, hash });
    let environment = blackboard();
    let camera = sample::looking_at(DVec3::new(0.0, 0.25, 1.0), DVec3::new(0.0, 0.25, 0.0));
    let mut outputs = sample::tentacles(
        &sample::Bed { count: 2, spacing: 0.3, per_row: 2, y: 0.0, length: 0.5, radius: 0.02 },
        0.0,
    );
    let count = outputs.fibre_nodes.len() / 2;
    for (i, node) in outputs.fibre_nodes.iter_mut().enumerate() {
        let side = if i < count { -0.15 } else { 0.15 };
        *node = abi::FibreNode {
            position: [side, 0.5 * (i % count) as f32 / (count - 1) as f32, 0.0],
            radius: 0.02,
        };
    }
    let green = abi::Material { base: [0.0, 0.5, 0.0, 1.0], tip: [0.0, 0.5, 0.0, 1.0], ..sample::tissue() };
    outputs.materials = vec![abi::Material { texture: 7, ..green }, green];
    outputs.fibres[1].material = 1;
    outputs.textures = Arc::new(vec![texture]);
    let frame = sample::frame(1, camera, outputs);
    let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
    let lens = Lens::new(&camera, [SIZE.0, SIZE.1], 60.0);
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    for quality in [Quality::Low, Quality::High] {
        let picture = studio.shoot(&shot, &Settings::of(quality)).expect("a picture");
        keep(&format!("textured-{quality:?}"), &picture);
        // Which of red and green is more in the middle of a fibre at this height [m].
        let is_red = |side: f32, height: f32| {
            let x = SIZE.0 as f32 * 0.5 + side * lens.pixels_per_metre();
            let y = SIZE.1 as f32 * 0.5 - (height - 0.25) * lens.pixels_per_metre();
            let p = picture.pixel(x as u32, y as u32).expect("inside");
            assert!(p[0].max(p[1]) > 20, "{quality:?}: a fibre is there: {p:?}");
            p[0] > p[1]
        };
        assert!(
            !is_red(-0.15, 0.05) && is_red(-0.15, 0.45),
            "{quality:?}: clear at the root, red at the tip"
        );
        assert!(!is_red(0.15, 0.05) && !is_red(0.15, 0.45), "{quality:?}: the other has none");
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

/// Greatest change of a pixel's light from one picture to the next, as a share of the greatest contrast,
/// while a fibre so thick [px] goes sideways by an eighth of a pixel a picture.
fn greatest_step(studio: &mut Studio, thick: f32, settings: &Settings) -> f32 {
    let environment = blackboard();
    let at = |x: f64| sample::looking_at(DVec3::new(x, 0.25, 2.0), DVec3::new(x, 0.25, 0.0));
    let lens = Lens::new(&at(0.0), [SIZE.0, SIZE.1], 60.0);
    let pixel = 2.0 / lens.pixels_per_metre();
    let mut outputs = sample::tentacles(
        &sample::Bed { count: 1, spacing: 0.0, per_row: 1, y: 0.0, length: 0.5, radius: 1.0 },
        0.0,
    );
    for (i, node) in outputs.fibre_nodes.iter_mut().enumerate() {
        // A little askew, so that its edges cut pixels at all heights.
        node.position = [0.01 * i as f32, 0.05 * i as f32, 0.0];
        node.radius = 0.5 * thick * pixel;
    }
    let mut last: Option<Vec<f32>> = None;
    let (mut step, mut contrast) = (0.0_f32, 0.0_f32);
    for i in 0..12 {
        let camera = at(f64::from(pixel) * f64::from(i) / 8.0);
        let frame = sample::frame(1, camera, outputs.clone());
        let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
        let picture = studio.shoot(&shot, settings).expect("a picture");
        keep(&format!("crawl-{thick}-{:?}-{i}", settings.quality), &picture);
        // Not where it begins and ends.
        let rows = SIZE.1 as usize * 2 / 5..SIZE.1 as usize * 3 / 5;
        let bytes = &picture.rgba[rows.start * SIZE.0 as usize * 4..rows.end * SIZE.0 as usize * 4];
        // High quality blends light, low quality what is shown.
        let light = |v: &u8| match settings.quality {
            Quality::High => decoded(*v),
            Quality::Low => f32::from(*v) / 255.0,
        };
        let light: Vec<f32> = bytes.iter().skip(1).step_by(4).map(light).collect();
        contrast = light.iter().copied().fold(contrast, f32::max);
        if let Some(last) = last {
            step = light.iter().zip(&last).map(|(a, b)| (a - b).abs()).fold(step, f32::max);
        }
        last = Some(light);
    }
    assert!(contrast > 0.02, "{thick} px, {:?}: it is seen: {contrast}", settings.quality);
    step / contrast
}

#[test]
fn what_is_about_as_thin_as_a_pixel_moves_without_a_step() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let tubes = Settings { detail: None, ..Settings::default() };
    let hard = greatest_step(&mut studio, 0.6, &tubes);
    assert!(hard > 0.9, "a pixel is covered by a tube or it is not: {hard}");
    for (thick, quality) in [
        (0.3, Quality::Low),
        (0.6, Quality::Low),
        (0.3, Quality::High),
        (0.6, Quality::High),
        (1.5, Quality::High),
    ] {
        let step = greatest_step(&mut studio, thick, &Settings::of(quality));
        // What is covered of a pixel changes by an eighth at most; the greatest part that is ever covered is
        // its width.
        let most = 0.125 / thick.min(1.0);
        assert!(
            step < most + 0.15,
            "{thick} px, {quality:?}: {step} of the contrast at once, {most} is its motion's"
        );
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

/// Mean and greatest difference of two pictures' means over blocks of 40 pixels.
fn block_difference(a: &Picture, b: &Picture) -> (f32, f32) {
    const BLOCK: u32 = 40;
    let mean = |picture: &Picture, x: u32, y: u32, channel: usize| -> f32 {
        let sum: u32 = (0..BLOCK * BLOCK)
            .filter_map(|i| picture.pixel(x + i % BLOCK, y + i / BLOCK))
            .map(|p| u32::from(p[channel]))
            .sum();
        sum as f32 / (BLOCK * BLOCK) as f32
    };
    let mut differences = Vec::new();
    for y in (0..a.height).step_by(BLOCK as usize) {
        for x in (0..a.width).step_by(BLOCK as usize) {
            differences.extend((0..3).map(|c| (mean(a, x, y, c) - mean(b, x, y, c)).abs()));
        }
    }
    let sum: f32 = differences.iter().sum();
    (sum / differences.len() as f32, differences.into_iter().fold(0.0, f32::max))
}

/// Mean and standard deviation of a channel over some rows.
fn statistics(picture: &Picture, rows: std::ops::Range<u32>, channel: usize) -> (f32, f32) {
    let row = picture.width as usize * 4;
    let values: Vec<f32> = picture.rgba[rows.start as usize * row..rows.end as usize * row]
        .chunks_exact(4)
        .map(|p| f32::from(p[channel]))
        .collect();
    let mean = values.iter().sum::<f32>() / values.len() as f32;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / values.len() as f32;
    (mean, variance.sqrt())
}

#[test]
fn a_garden_is_neither_black_nor_flat_and_its_water_changes_from_top_to_bottom() {
    let Some(gpu) = open() else { return };
    let environment = sample::environment();
    let camera = hero();
    let [previous, current] = two_steps(|sway| sample::garden(&environment, sway), camera);
    let shot = Shot { previous: &previous, current: &current, alpha: 0.5, camera, environment: &environment };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let picture = studio.shoot(&shot, &Settings::default()).expect("a picture");
    keep("garden", &picture);
    for channel in 0..3 {
        let (mean, deviation) = statistics(&picture, 0..SIZE.1, channel);
        assert!((20.0..220.0).contains(&mean), "channel {channel}: mean {mean}");
        assert!(deviation > 10.0, "channel {channel}: deviation {deviation}");
    }
    let (red, _) = statistics(&picture, 0..40, 0);
    let (blue, _) = statistics(&picture, 0..40, 2);
    assert!(blue > red + 30.0, "the water is blue: {red} and {blue}");
    let again = studio.shoot(&shot, &Settings::default()).expect("a picture");
    assert!(picture == again, "the same frame gives the same bytes");

    let side = sample::looking_at(DVec3::new(-3.0, -2.9, 2.4), DVec3::new(0.0, -3.8, -2.0));
    for (name, camera) in [
        ("garden-close", sample::looking_at(DVec3::new(0.12, -3.62, 0.55), DVec3::new(0.0, -3.72, 0.0))),
        ("garden-wide", side),
        ("garden-up", sample::looking_at(DVec3::new(0.5, -3.9, 1.0), DVec3::new(0.2, -3.2, -0.3))),
    ] {
        let shot = Shot { camera, ..shot };
        keep(name, &studio.shoot(&shot, &Settings::default()).expect("a picture"));
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn a_diagram_has_its_background_and_its_lines_are_wide_enough_to_be_read() {
    let Some(gpu) = open() else { return };
    let mut environment = sample::environment();
    environment.terrain = None;
    // #F4F4F0, as the figures' scenes have it.
    environment.plain_background = Some([0.9047, 0.9047, 0.8714]);
    let camera = sample::looking_at(DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO);
    let line = |y: f64, channel: u32| abi::DebugLine {
        from: [-0.5, y, 0.0],
        delta: [1.0, 0.0, 0.0],
        color: 0xff00_00ff,
        channel,
        spare: 0,
    };
    let outputs = Outputs { debug_lines: vec![line(0.0, 0), line(0.3, 1)], ..Outputs::default() };
    let frame = sample::frame(1, camera, outputs);
    let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    for settings in [Settings::default(), Settings::fine()] {
        let settings = Settings { debug_channels: 1, ..settings };
        let picture = studio.shoot(&shot, &settings).expect("a picture");
        let corner = picture.pixel(3, 3).expect("inside");
        for (seen, wanted) in corner.iter().zip([0xf4, 0xf4, 0xf0]) {
            assert!(
                seen.abs_diff(wanted) <= 1,
                "{corner:?}: half floats and dither move a colour by one at most"
            );
        }
        let red = |y: &u32| {
            let p = picture.pixel(SIZE.0 / 2, *y).expect("inside");
            p[0] > 200 && p[1] < 120 && p[2] < 120
        };
        let rows: Vec<u32> = (0..SIZE.1).filter(red).collect();
        assert!((2..=4).contains(&rows.len()), "rows {rows:?}");
        assert!(rows.iter().all(|y| y.abs_diff(SIZE.1 / 2) <= 3), "the other channel is hidden: {rows:?}");
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn singularities_are_balls_of_their_own_colours_at_any_quality() {
    let Some(gpu) = open() else { return };
    let environment = sample::environment();
    let camera = sample::looking_at(DVec3::new(0.0, -3.0, 2.0), DVec3::new(0.0, -3.0, 0.0));
    let flow = |kind: u32, x: f64| abi::Flow {
        kind,
        position: [x, -3.0, 0.0],
        axis: [0.0, 1.0, 0.0],
        strength: 1.0,
        peak: 1.0,
        core: 0.06,
        ..abi::Flow::default()
    };
    let kinds = [abi::FLOW_SOURCE, abi::FLOW_HOLE, abi::FLOW_WHIRLWIND];
    let flow = kinds.iter().zip([-0.5, 0.0, 0.5]).map(|(kind, x)| flow(*kind, x)).collect();
    let frame = Frame { flow: Arc::new(flow), ..sample::frame(1, camera, Outputs::default()) };
    let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    // Pixels at the middle of each ball: a metre is as many pixels at 2 m.
    let metre = Lens::new(&camera, [SIZE.0, SIZE.1], 60.0).pixels_per_metre() / 2.0;
    for quality in [Quality::Low, Quality::High] {
        let without = Settings { quality, ..Settings::default() };
        let markers = Markers { singularities: true, ..Markers::default() };
        let [with, without] = [Settings { markers, ..without }, without]
            .map(|settings| studio.shoot(&shot, &settings).expect("a picture"));
        keep(&format!("markers-{quality:?}"), &with);
        let at = |picture: &Picture, x: f32| {
            let column = (SIZE.0 as f32 / 2.0 + x * metre) as u32;
            picture.pixel(column, SIZE.1 / 2).expect("inside").map(u32::from)
        };
        let [source, hole, whirlwind] = [-0.5, 0.0, 0.5].map(|x| at(&with, x));
        assert!(source[1] > 2 * source[0] && source[1] > 2 * source[2], "{quality:?}: green {source:?}");
        assert!(hole[0] > 2 * hole[1] && hole[0] > 2 * hole[2], "{quality:?}: red {hole:?}");
        let yellow = whirlwind[0] > 2 * whirlwind[2] && whirlwind[1] > 2 * whirlwind[2];
        assert!(yellow, "{quality:?}: yellow {whirlwind:?}");
        assert_eq!(at(&with, 0.25), at(&without, 0.25), "{quality:?}: nothing else changes");
        assert!(at(&without, 0.0)[2] > at(&without, 0.0)[0], "{quality:?}: without, there is water");
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

/// Linear light of a pixel's channel.
pub(super) fn decoded(v: u8) -> f32 {
    let v = f32::from(v) / 255.0;
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

#[test]
fn the_sky_is_seen_through_a_window_as_wide_as_snells_law_says() {
    let Some(gpu) = open() else { return };
    let environment = Environment { terrain: None, ..sample::environment() };
    // Straight up from 3 m below, 137 degrees wide.
    let up = sample::looking_at(DVec3::new(0.0, -3.0, 0.0), DVec3::new(0.0, 0.0, 0.001));
    let camera = CameraPose { fov_y: 2.4, ..up };
    let frame = sample::frame(1, camera, Outputs::default());
    let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
    let mut studio = Studio::new(&gpu, (400, 400)).expect("a studio");
    for quality in [Quality::Low, Quality::High] {
        let picture = studio.shoot(&shot, &Settings { quality, ..Settings::default() }).expect("a picture");
        keep(&format!("window-{quality:?}"), &picture);
        // Mean red (which the water takes first) in rings of two degrees around the vertical.
        let mut rings = [(0.0_f32, 0.0_f32); 34];
        for (i, pixel) in picture.rgba.chunks_exact(4).enumerate() {
            let place = |n: usize| (n as f32 + 0.5 - 200.0) / 200.0 * 1.2_f32.tan();
            let angle = place(i % 400).hypot(place(i / 400)).atan().to_degrees();
            if let Some(ring) = rings.get_mut((angle / 2.0) as usize) {
                // What the way through the water took is given back.
                let distance = 3.0 / angle.to_radians().cos();
                *ring = (ring.0 + decoded(pixel[0]) * (0.2 * distance).exp(), ring.1 + 1.0);
            }
        }
        let mean = |ring: usize| rings[ring].0 / rings[ring].1;
        let inside = (14..20).map(mean).sum::<f32>() / 6.0;
        let outside = (29..34).map(mean).sum::<f32>() / 5.0;
        assert!(inside > 2.0 * outside, "{quality:?}: {inside} and {outside}");
        let half = 0.5 * (inside + outside);
        let rim = (14..34).find(|ring| mean(*ring) < half).map_or(90.0, |ring| ring as f32 * 2.0);
        // 48.75 degrees, ragged by waves whose slopes are some six degrees, and Fresnel's loss just inside.
        assert!((rim - 48.75).abs() < 5.0, "{quality:?}: the rim is at {rim} degrees");
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn shafts_add_a_little_light_to_the_water_and_none_behind_what_is_near() {
    let Some(gpu) = open() else { return };
    let environment = sample::environment();
    let camera = sample::looking_at(DVec3::new(0.0, -3.3, 4.0), DVec3::new(0.0, -2.6, 0.0));
    let frame = sample::frame(1, camera, sample::garden(&environment, 0.0));
    let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let mut shoot =
        |shafts: bool| studio.shoot(&shot, &Settings { shafts, ..Settings::default() }).expect("a picture");
    let (with, without) = (shoot(true), shoot(false));
    keep("shafts", &with);
    let mut lit = 0;
    for (a, b) in with.rgba.iter().zip(&without.rgba) {
        let more = decoded(*a) - decoded(*b);
        // Several may stand behind each other, each .06 at most; half a step of 8 bits either way.
        assert!((-0.01..0.2).contains(&more), "{more}");
        lit += u32::from(more > 0.01);
    }
    let share = lit as f32 / (SIZE.0 * SIZE.1 * 4) as f32;
    assert!((0.02..0.6).contains(&share), "{share} of the picture is lit");
    // A scene says how bright they are.
    let lit_by = |shafts: f32| Environment { sun: Sun { shafts, ..environment.sun }, ..environment.clone() };
    let [none, bright] = [0.0, 2.0].map(|shafts| {
        let environment = lit_by(shafts);
        let shot = Shot { environment: &environment, ..shot };
        studio.shoot(&shot, &Settings::default()).expect("a picture")
    });
    assert!(none == without, "a scene without shafts");
    let light = |picture: &Picture| picture.rgba.iter().map(|v| f64::from(decoded(*v))).sum::<f64>();
    let more = [&bright, &with].map(|picture| light(picture) - light(&without));
    assert!((more[0] / more[1] - 2.0).abs() < 0.2, "{more:?}");
    let low = Settings { quality: Quality::Low, ..Settings::default() };
    let [one, other] =
        [true, false].map(|shafts| studio.shoot(&shot, &Settings { shafts, ..low }).expect("a picture"));
    assert!(one == other, "low quality has none");
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}
