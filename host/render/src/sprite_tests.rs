//! What [`crate::sprites`] sees of samples of the sea, through this renderer's lenses.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use reef_abi as abi;
use reef_streams::{Outputs, frame::CameraPose};

use super::{
    device_tests::half,
    layers::Catalogue,
    sample,
    sprites::{GpuSprite, Kind, Seen, Sizes},
    view::Lens,
};

const SIZES: Sizes = Sizes { least: 1.5, speck: 5.0 };

fn lens() -> Lens {
    let camera = sample::looking_at(DVec3::new(0.0, -2.0, 0.0), DVec3::new(0.3, -2.2, -4.0));
    Lens::new(&camera, [640, 360], 30.0)
}

fn seen(outputs: Outputs) -> Seen {
    let lens = lens();
    let camera = sample::looking_at(lens.eye, DVec3::ZERO);
    let frame = sample::frame(2, camera, outputs);
    let mut seen = Seen::default();
    let catalogue = Catalogue::default();
    let layers = (|texture: &_| catalogue.of(texture), catalogue.dot());
    seen.cull(&frame.outputs, (&lens.sprites(), 1.0 / 120.0, SIZES), layers);
    seen
}

/// Corners of the square that holds a sprite however it is turned, on the picture; None: one lies behind the
/// eye.
fn corners(place: Vec3, half: f32, lens: &Lens) -> Option<Vec<[f32; 2]>> {
    let turned = [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)];
    turned
        .iter()
        .map(|(x, y)| {
            let p = lens.clip_from_eye() * (place + (lens.right * *x + lens.up * *y) * half).extend(1.0);
            (p.w > 0.0).then(|| [p.x / p.w, p.y / p.w])
        })
        .collect()
}

#[test]
fn nothing_that_is_in_the_picture_is_left_out_and_most_that_is_not_is() {
    let corners_of_box = [DVec3::new(-9.0, -6.0, -12.0), DVec3::new(9.0, 2.0, 6.0)];
    let outputs = sample::snow(20_000, corners_of_box, 0.2);
    let lens = lens();
    let origin = (DVec3::from(outputs.objects[0].origin) - lens.eye).as_vec3();
    let places: Vec<(Vec3, f32)> = outputs
        .billboards
        .iter()
        .map(|b| (origin + Vec3::from(b.position) - Vec3::from(b.velocity) / 120.0, b.size))
        .collect();
    let seen = seen(outputs);
    let mut in_picture = 0;
    for (place, size) in places {
        let inside = corners(place, size * 0.5, &lens)
            .is_some_and(|corners| corners.iter().any(|[x, y]| x.abs() < 1.0 && y.abs() < 1.0));
        let near = place.length() < 0.4;
        if inside && !near {
            in_picture += 1;
            assert!(seen.sprites.iter().any(|s| Vec3::from(s.place).distance(place) < 1e-4), "{place}");
        }
    }
    assert!(in_picture > 1000, "the test sees something");
    // Those at the picture's edge, whose corners alone are outside.
    assert!(seen.count() < in_picture * 6 / 5, "{} for {in_picture}", seen.count());
}

#[test]
fn what_is_seen_is_sorted_from_far_to_near_and_drawn_once() {
    let corners_of_box = [DVec3::new(-6.0, -6.0, -12.0), DVec3::new(6.0, 2.0, -1.0)];
    let seen = seen(sample::snow(20_000, corners_of_box, 0.05));
    let mut at = 0;
    for (kind, range) in &seen.draws {
        assert_eq!(range.start, at, "no gap and no overlap");
        at = range.end;
        let sprites = &seen.sprites[range.start as usize..range.end as usize];
        let small = |s: &GpuSprite| {
            s.size * lens().pixels_per_metre() / Vec3::from(s.place).dot(lens().forward) < SIZES.speck
        };
        assert!(sprites.iter().all(|s| small(s) == (*kind == Kind::Speck)));
    }
    assert_eq!(at as usize, seen.count());
    assert!(seen.draws.len() < 120, "{} draws", seen.draws.len());
    for pair in seen.sprites.windows(2) {
        let [far, near] = [pair[0], pair[1]].map(|s| Vec3::from(s.place).length());
        // Specks and quads take turns by slices: halves of an octave of the square, 1 to 1.5 of it at most.
        assert!(near < far * 1.5_f32.sqrt() * 1.001, "{near} after {far}");
    }
}

#[test]
fn threads_change_nothing() {
    let corners_of_box = [DVec3::new(-6.0, -6.0, -12.0), DVec3::new(6.0, 2.0, -1.0)];
    let all = [
        Arc::new(sample::snow(30_000, corners_of_box, 0.05)),
        Arc::new(Outputs::default()),
        Arc::new(sample::snow(3_000, corners_of_box, 0.02)),
    ];
    let catalogue = Catalogue::default();
    let look = |seen: &mut Seen, threads: usize| {
        let layers = (|texture: &_| catalogue.of(texture), catalogue.dot());
        seen.cull_with(threads, &all, (&lens().sprites(), 1.0 / 120.0, SIZES), layers);
    };
    let (mut alone, mut shared) = (Seen::default(), Seen::default());
    look(&mut alone, 1);
    // What was there before changes nothing, either.
    look(&mut shared, 3);
    look(&mut shared, 7);
    assert!(alone.count() > 10_000 && shared.sprites == alone.sprites && shared.draws == alone.draws);
}

/// Whether something of a sprite is in the picture, however it is turned: it reaches through the view's four
/// sides.
fn reaches_into_the_picture(place: Vec3, radius: f32, lens: &Lens) -> bool {
    let depth = place.dot(lens.forward);
    let inside = |across: f32, tangent: f32| {
        (across.abs() - depth * tangent) / (1.0 + tangent * tangent).sqrt() < radius
    };
    depth > -radius
        && inside(place.dot(lens.right), lens.tangent[0])
        && inside(place.dot(lens.up), lens.tangent[1])
}

#[test]
fn no_sprite_comes_or_goes_in_one_frame() {
    // A cloud that the eye passes through, above, and beside, straight ahead or at an angle, with lenses of
    // all kinds.
    let catalogue = Catalogue::default();
    for (fov, aside, size) in [
        (30.0, 0.0, 2.0),
        (55.0, 0.3, 2.0),
        (55.0, 0.9, 2.0),
        (55.0, 1.3, 2.0),
        (55.0, 2.4, 2.0),
        (90.0, 1.1, 2.0),
        (90.0, 0.2, 0.3),
        (55.0, 0.03, 0.05),
        (110.0, 1.6, 2.0),
    ] {
        for facing in [abi::BILLBOARD_FACING, 0] {
            let mut outputs = sample::snow(1, [DVec3::new(0.0, -2.0, -3.0); 2], 1.0);
            let axis = Vec3::new(0.3, 0.2, 0.9).normalize().to_array();
            outputs.billboards[0] =
                abi::Billboard { size, axis, opacity: 0.9, flags: facing, ..Default::default() };
            outputs.objects[0].origin = [aside, -2.0, -3.0];
            let cloud = [Arc::new(outputs)];
            for turned in [0.0, 0.7] {
                let mut seen = Seen::default();
                let mut last: Option<f32> = None;
                let mut most = 0.0_f32;
                for frame in 0..2400 {
                    let eye = DVec3::new(0.0, -2.0, 6.0 - f64::from(frame) / 200.0);
                    let target = eye + DVec3::new(turned, 0.0, -1.0);
                    let pose = CameraPose { fov_y: f32::to_radians(fov), ..sample::looking_at(eye, target) };
                    let lens = Lens::new(&pose, [640, 360], 30.0);
                    let layers = (|texture: &_| catalogue.of(texture), catalogue.dot());
                    let view = (&lens.sprites(), 0.0, Sizes { least: 1.5, speck: 0.0 });
                    seen.cull_with(1, &cloud, view, layers);
                    let place = (DVec3::new(aside, -2.0, -3.0) - eye).as_vec3();
                    let visible = reaches_into_the_picture(place, 0.5 * size, &lens);
                    // Opacity as a half float: of the cloud where it is in the picture.
                    let shown = seen.sprites.first().map_or(0.0, |sprite| half(sprite.tint[3].into()));
                    // Seen from its edge it is nothing.
                    let lies = if facing == 0 {
                        Vec3::from(axis).dot(place).abs() / place.length().max(1e-6)
                    } else {
                        1.0
                    };
                    let shown = if visible { shown * lies } else { 0.0 };
                    most = most.max(shown);
                    if let (Some(last), true) = (last, visible) {
                        let what =
                            format!("{fov}°, {aside} m aside, {size} m, {facing}, {turned}, frame {frame}");
                        assert!((shown - last).abs() < 0.12, "{what}: {last} then {shown}");
                    }
                    last = visible.then_some(shown);
                }
                assert!(
                    most > 0.3,
                    "{fov}°, {aside} m aside, {size} m, {facing}, {turned}: it is seen at all: {most}"
                );
            }
        }
    }
}

#[test]
fn what_no_pixel_would_show_is_not_drawn() {
    let one = |sprite: abi::Billboard| {
        let mut outputs = sample::snow(1, [DVec3::new(0.0, -2.1, -3.0); 2], 0.01);
        outputs.billboards[0] = abi::Billboard { size: 0.01, ..sprite };
        seen(outputs).count()
    };
    let facing = abi::Billboard { flags: abi::BILLBOARD_FACING, opacity: 0.5, ..Default::default() };
    assert_eq!(one(facing), 1);
    assert_eq!(one(abi::Billboard { opacity: 0.0, ..facing }), 0);
    assert_eq!(one(abi::Billboard { opacity: 0.001, ..facing }), 0);
    let lying = abi::Billboard { flags: 0, axis: [0.0, 0.0, 1.0], ..facing };
    assert_eq!(one(lying), 1);
    assert_eq!(one(abi::Billboard { axis: [1.0, 0.0, 0.0], ..lying }), 0, "seen from its edge");
}
