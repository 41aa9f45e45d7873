//! The mesh passes on a real device (lavapipe counts): the GPU's vertices and triangles against the CPU's
//! twin, and what a picture must and must not be. With REEF_TEST_PICTURES=DIR the pictures are kept for
//! looking at.

use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};
use reef_abi as abi;
use reef_gpu::Picture;
use reef_streams::{
    Outputs, check,
    frame::{CameraPose, Frame},
};

use super::{
    gather::{Subject, gather},
    library::Shelf,
    records::{BIN_LIT, BIN_LIT_THIN, BIN_LIT_VEIL, BIN_THIN, BIN_VEIL, BINS, Drawn, FAR_SIDE, VEIL},
    sample::Models,
    twin,
};
use crate::{
    Quality, Settings, Shot,
    device_tests::{SIZE, blackboard, half, keep, open},
    gather as fibres,
    lod::LIT_EDGE,
    matched::Matched,
    sample,
    studio::Studio,
    view::{self, Lens},
};

/// Plants, bodies and bells from near to far, and some behind the eye.
fn garden(models: &Models, time: f32) -> Outputs {
    let mut outputs = models.empty();
    for i in 0..24_u32 {
        let (row, column) = (f64::from(i / 4), f64::from(i % 4) - 1.5);
        let z = -0.3 - 0.3 * row * row;
        models.plant(&mut outputs, [0.7 * column, -4.0, z], 0.5 + 0.02 * i as f32, time);
        let at = [0.4 * column, -3.5 + 0.08 * row, z + 0.5];
        models.fish(&mut outputs, at, 0.8 * i as f32, time + 0.1 * i as f32);
        models.grass(&mut outputs, [0.7 * column + 0.1, -4.0, z], 1.0, 0.1 * time + 0.02 * i as f32);
        if i % 3 == 0 {
            models.bell(&mut outputs, [0.6 * column + 0.2, -3.2, z - 0.2], 1.0, time + 0.2 * i as f32);
            models.late_bell(&mut outputs, [0.6 * column - 0.2, -3.0, z - 0.3], 1.0, time + 0.3 * i as f32);
        }
    }
    models.plant(&mut outputs, [0.0, -4.0, 5.0], 1.0, time);
    models.bell(&mut outputs, [0.0, -3.0, 4.0], 1.0, time);
    outputs
}

fn camera() -> CameraPose {
    sample::looking_at(DVec3::new(0.1, -3.4, 1.0), DVec3::new(0.0, -3.5, 0.0))
}

fn two_steps(make: impl Fn(f32) -> Outputs, camera: CameraPose) -> [Frame; 2] {
    [(1, 0.9), (2, 1.0)].map(|(step, time)| {
        let outputs = make(time);
        assert_eq!(check::Checker::default().check(&outputs, &check::alone), Ok(()));
        sample::frame(step, camera, outputs)
    })
}

fn shelf(frame: &Frame) -> Shelf {
    let mut shelf = Shelf::default();
    frame.outputs.iter().flat_map(|o| o.meshes.iter()).for_each(|mesh| shelf.add(mesh));
    shelf
}

fn snorm(v: u32) -> f32 {
    (f32::from(v as u16 as i16) / 32767.0).max(-1.0)
}

fn unorm([low, high]: [f32; 2]) -> u32 {
    let sixteen = |v: f32| (v.clamp(0.0, 1.0) * 65535.0).round_ties_even() as u32;
    sixteen(low) | sixteen(high) << 16
}

/// Whether two packed shares are the same within a thousandth.
fn near(a: u32, b: u32) -> bool {
    (a & 0xffff).abs_diff(b & 0xffff) < 64 && (a >> 16).abs_diff(b >> 16) < 64
}

#[test]
fn the_gpus_meshes_are_those_of_the_twin() {
    let Some(gpu) = open() else { return };
    let environment = sample::environment();
    let models = Models::default();
    let [previous, current] = two_steps(|time| garden(&models, time), camera());
    let lens = Lens::new(&camera(), [SIZE.0, SIZE.1], view::visibility(&environment));
    let shelf = shelf(&current);
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let high = Settings::default();
    let cases = [
        ("blended", 0.3, high),
        ("whole", 1.0, Settings { detail: None, ..high }),
        ("low", 0.7, Settings::of(Quality::Low)),
    ];
    for (name, alpha, settings) in cases {
        let shot = Shot {
            previous: &previous,
            current: &current,
            alpha,
            camera: camera(),
            environment: &environment,
        };
        studio.run(&shot, &settings).expect("a picture");
        let Drawn { parts, vertices, indices } = studio.renderer().meshes().read_back().expect("read back");
        let counts = studio.renderer().meshes().counts().expect("read back");
        assert_eq!(counts.left_out, 0);
        let fibres::Gathered { objects, matched, .. } = fibres::gather(&previous, &current, alpha, &lens, 0);
        let subject = gather([&previous, &current], &matched, alpha, &lens, settings.quality, &shelf);
        let brought = twin::Brought::new(&previous, &current);
        let (mut drawn, mut pairs, mut levels, mut bins) = (0, 0, [0; 6], [0; BINS]);
        for i in 0..subject.instances.len() {
            let expected =
                twin::parts((&subject, &brought), (&shelf, &objects), i, &lens, settings.detail.as_ref());
            pairs += usize::from(expected[1].is_some());
            for (slot, expected) in expected.iter().enumerate() {
                let part = &parts[2 * i + slot];
                let place = format!("{name}, instance {i}, part {slot}");
                let Some(expected) = expected else {
                    assert_eq!(part.level, u32::MAX, "{place} is drawn");
                    continue;
                };
                drawn += 1;
                assert_eq!((part.level, part.bin), (expected.level, expected.bin as u32), "{place}");
                assert!(near(part.shares, unorm(expected.shares)), "{place}: {:x}", part.shares);
                let first = [part.first_vertex, part.first_vertex + expected.vertices.len() as u32];
                let lit = [BIN_LIT, BIN_LIT + 1, BIN_LIT_VEIL, BIN_LIT_THIN].contains(&expected.bin);
                let apart = if lit { first[1] <= counts.lit } else { first[0] >= counts.lit };
                assert!(apart || expected.vertices.is_empty(), "{place}: {first:?}, {} are lit", counts.lit);
                bins[expected.bin] += 1;
                let instance = &subject.instances[i];
                levels[(part.level - shelf.meshes[instance.mesh as usize].first_level) as usize] += 1;
                for (v, e) in expected.vertices.iter().enumerate() {
                    let seen = &vertices[part.first_vertex as usize + v];
                    let clip = Vec4::from_array([0, 1, 2, 3].map(|k| f32::from_bits(seen[k])));
                    // Roundings of products and roots of numbers near 1, at most a few metres away.
                    assert!(
                        clip.distance(e.clip) < 2e-5 * (1.0 + e.clip.length()),
                        "{place}, vertex {v}: {clip} and {}",
                        e.clip
                    );
                    if expected.bin < BIN_LIT + 2 || expected.bin == BIN_LIT_VEIL {
                        continue;
                    }
                    let [share, half_px] = e.across;
                    if expected.bin == BIN_LIT_THIN {
                        let [off, width] = [half(seen[6] & 0xffff), half(seen[6] >> 16)];
                        let expected_off = share * (half_px.abs() + LIT_EDGE);
                        assert!((off - expected_off).abs() < 5e-3 * (1.0 + half_px.abs()), "{place}: {off}");
                        assert!((width - half_px).abs() < 5e-3 * (1.0 + half_px.abs()), "{place}: {width}");
                        continue;
                    }
                    let (seen_share, width) = (snorm(seen[5] >> 16), half(seen[9] >> 16));
                    assert!((seen_share - share).abs() < 5e-3, "{place}, vertex {v}: {seen_share}, {share}");
                    assert!((width - half_px).abs() < 5e-3 * (1.0 + half_px.abs()), "{place}: {width}");
                    let normal = Vec3::new(snorm(seen[4]), snorm(seen[4] >> 16), snorm(seen[5]));
                    assert!(normal.distance(e.normal) < 2e-3, "{place}, vertex {v}: {normal}");
                    let thickness = half(seen[8] >> 16);
                    assert!((thickness - e.thickness_cm).abs() < 1e-3 * (1.0 + e.thickness_cm));
                }
                // The vertices of a veil are its near side's.
                let of = parts[2 * instance.vertices_of as usize + slot].first_vertex;
                let seen = &indices[part.first_index as usize..][..expected.indices.len()];
                let mut other = 0;
                for (t, (s, e)) in seen.chunks_exact(3).zip(expected.indices.chunks_exact(3)).enumerate() {
                    let same = s.iter().zip(e).all(|(s, e)| s - of == *e);
                    // A triangle that is seen from its edge may count for either side.
                    assert!(
                        same || expected.bin == BIN_VEIL || expected.bin == BIN_LIT_VEIL,
                        "{place}, triangle {t}: {s:?}, {e:?} + {of}"
                    );
                    other += usize::from(!same);
                }
                assert!(100 * other <= seen.len() / 3, "{place}: {other} are on the other side");
            }
        }
        assert_eq!(drawn, counts.drawn, "{name}: nothing else is drawn");
        if settings.detail.is_some() {
            assert!((drawn as usize) < subject.instances.len() + pairs, "{name}: something is culled");
            assert!(pairs > 0 && levels[1..].iter().sum::<i32>() > 10, "{name}: {pairs}, {levels:?}");
        }
        assert_eq!(bins[..2].iter().any(|n| *n > 0), settings.quality == Quality::Low, "{name}: {bins:?}");
        assert!(bins[BIN_THIN] + bins[BIN_LIT_THIN] > 0, "{name}: {bins:?}");
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

fn subject(before: Outputs, now: Outputs, alpha: f32) -> Subject {
    let frames = [(1, before), (2, now)].map(|(step, outputs)| sample::frame(step, camera(), outputs));
    let lens = Lens::new(&camera(), [SIZE.0, SIZE.1], 60.0);
    let [before, now] = &frames;
    let matched = Matched::modules(before, now);
    gather([before, now], &matched, alpha, &lens, Quality::High, &shelf(now))
}

#[test]
fn elements_are_matched_by_their_objects_id_and_their_number_within_it() {
    let models = Models::default();
    let make = |ids: [u64; 3]| {
        let mut outputs = models.empty();
        for (i, id) in ids.into_iter().enumerate() {
            models.fish(&mut outputs, [id as f64, 0.0, 0.0], 0.0, 0.0);
            outputs.objects[i].id = id;
        }
        outputs
    };
    let joints = reef_shapes::fish::JOINTS as u32;
    let previous = |before: Outputs, now: Outputs| -> Vec<(u32, f32)> {
        let mut instances = subject(before, now, 0.25).instances;
        // In the order of the elements.
        instances.sort_by_key(|instance| instance.current);
        instances.iter().map(|i| (i.previous / joints, i.blend)).collect()
    };
    assert_eq!(previous(make([1, 2, 3]), make([1, 2, 3])), [(0, 0.25), (1, 0.25), (2, 0.25)]);
    assert_eq!(previous(make([1, 2, 3]), make([3, 4, 1])), [(2, 0.25), (0, 1.0), (0, 0.25)]);
    let mut jumped = make([1, 2, 3]);
    jumped.skinned[0].flags = abi::FLAG_NO_BLEND;
    jumped.objects[1].flags = abi::FLAG_NO_BLEND;
    assert_eq!(previous(make([1, 2, 3]), jumped), [(0, 1.0), (0, 1.0), (2, 0.25)]);
    // Another number of joints, another mesh.
    let mut rigid = make([1, 2, 3]);
    rigid.skinned[2].joint_count = 1;
    assert_eq!(previous(make([1, 2, 3]), rigid)[2], (0, 1.0));
    let mut other = make([1, 2, 3]);
    other.skinned[1].mesh = 1;
    assert_eq!(previous(make([1, 2, 3]), other)[1].1, 1.0);
    // The second element of an object is another than the first.
    let both = |outputs: &mut Outputs| outputs.skinned[1].object = 0;
    let (mut before, mut now) = (make([1, 2, 3]), make([3, 2, 1]));
    both(&mut before);
    now.skinned[2].object = 2;
    now.skinned[1].object = 2;
    assert_eq!(previous(before, now), [(2, 0.25), (0, 0.25), (1, 0.25)]);
}

#[test]
fn what_hides_what_is_behind_it_comes_from_near_to_far() {
    let models = Models::default();
    let mut outputs = models.empty();
    for z in [-3.0, 0.0, -8.0, -1.0] {
        models.fish(&mut outputs, [0.0, -3.5, z], 0.0, 0.0);
    }
    let all = subject(outputs.clone(), outputs, 1.0);
    assert_eq!(all.instances.iter().map(|i| i.object).collect::<Vec<_>>(), [1, 3, 0, 2]);
    assert!(all.instances.iter().enumerate().all(|(i, instance)| instance.vertices_of == i as u32));
}

#[test]
fn veils_come_from_far_to_near_and_their_far_sides_from_outside_in() {
    let models = Models::default();
    let mut outputs = models.empty();
    for z in [-1.0, -5.0] {
        models.bell(&mut outputs, [0.0, -3.5, z], 1.0, 0.0);
    }
    models.bell(&mut outputs, [0.0, -3.5, -3.0], 1.0, 0.0);
    // An inner and an outer one in one object.
    outputs.mesh_draws[1].object = 0;
    models.plant(&mut outputs, [0.0, -4.0, 0.0], 1.0, 0.0);
    let all = subject(outputs.clone(), outputs, 1.0);
    let order: Vec<(u32, u32, bool)> = all
        .instances
        .iter()
        .map(|i| (i.object, i.current / reef_shapes::bell::VERTICES as u32, i.flags & FAR_SIDE != 0))
        .collect();
    assert_eq!(all.instances[0].flags & VEIL, 0, "what is solid comes first");
    assert_eq!(
        order[1..],
        [(2, 2, true), (2, 2, false), (0, 1, true), (0, 0, true), (0, 0, false), (0, 1, false)]
    );
    for (i, instance) in all.instances.iter().enumerate() {
        let own = &all.instances[instance.vertices_of as usize];
        assert_eq!((own.current, own.flags & FAR_SIDE), (instance.current, 0));
        assert_eq!(instance.vertices_of == i as u32, instance.flags & FAR_SIDE == 0);
    }
}

#[test]
fn a_draw_with_another_number_of_vertices_is_not_blended() {
    let models = Models::default();
    let mut outputs = models.empty();
    models.bell(&mut outputs, [0.0, -3.0, 0.0], 1.0, 0.0);
    let mut other = outputs.clone();
    other.mesh_draws[0].vertex_count -= 1;
    let blends = |before| subject(before, outputs.clone(), 0.25).instances.iter().map(|i| i.blend).collect();
    let (same, new): (Vec<f32>, Vec<f32>) = (blends(outputs.clone()), blends(other));
    assert!(same.iter().all(|blend| *blend == 0.25) && new.iter().all(|blend| *blend == 1.0), "{new:?}");
}

#[test]
fn what_does_not_fit_is_left_out_whole() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let models = Models::default();
    let mut outputs = models.empty();
    for i in 0..6 {
        models.bell(&mut outputs, [0.3 * f64::from(i), -3.4, -2.0], 1.0, 0.3);
    }
    let most = 3 * u64::from(outputs.mesh_draws[0].vertex_count) + 100;
    studio.renderer_mut().meshes.most.vertices = most;
    let how = Settings { detail: None, ..Settings::default() };
    let first = shoot(&mut studio, "left-out", &outputs, camera(), &how);
    let counts = studio.renderer().meshes().counts().expect("read back");
    let Drawn { indices, .. } = studio.renderer().meshes().read_back().expect("read back");
    assert!(counts.left_out > 0 && counts.drawn > 0 && u64::from(counts.vertices) <= most, "{counts:?}");
    assert!(indices.iter().all(|index| *index < counts.vertices));
    assert!(first.rgba == shoot(&mut studio, "left-out", &outputs, camera(), &how).rgba);
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn instances_and_joints_that_do_not_fit_are_left_out_whole() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let models = Models::default();
    let mut outputs = models.empty();
    for i in 0..4 {
        models.fish(&mut outputs, [0.4 * f64::from(i) - 0.6, -3.4, -1.0], 0.3, 0.2);
        models.bell(&mut outputs, [0.4 * f64::from(i) - 0.6, -3.2, -1.0], 1.0, 0.3);
    }
    let how = Settings { detail: None, ..Settings::default() };
    let mut drawn = |instances: u64, joints: u64| {
        studio.renderer_mut().meshes.most.instances = instances;
        studio.renderer_mut().meshes.most.joints = joints;
        shoot(&mut studio, "no-room", &outputs, camera(), &how);
        studio.renderer().meshes().counts().expect("read back").drawn
    };
    // Fishes first; of each bell the far side and the near one, whose vertices both draw.
    let joints = reef_shapes::fish::JOINTS as u64;
    assert_eq!(drawn(12, 4 * joints), 12);
    assert_eq!(drawn(12, 4 * joints - 1), 11);
    assert_eq!(drawn(12, 2 * joints + 1), 10);
    // Without the near side of the last bell there is no far one.
    assert_eq!(drawn(11, 4 * joints), 10);
    assert_eq!(drawn(3, 4 * joints), 3);
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn outputs_that_no_picture_shows_are_let_go() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let models = Models::default();
    let environment = blackboard();
    let frames = [1, 2, 3].map(|step| sample::frame(step, camera(), garden(&models, step as f32 / 60.0)));
    for pair in frames.windows(2) {
        let shot = Shot {
            previous: &pair[0],
            current: &pair[1],
            alpha: 0.5,
            camera: camera(),
            environment: &environment,
        };
        studio.run(&shot, &Settings::default()).expect("a picture");
    }
    let held = |frame: &Frame| Arc::strong_count(&frame.outputs[0]) - 1;
    assert_eq!(frames.each_ref().map(held), [0, 1, 1]);
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

fn shoot(studio: &mut Studio, name: &str, outputs: &Outputs, camera: CameraPose, how: &Settings) -> Picture {
    let environment = blackboard();
    let frame = sample::frame(1, camera, outputs.clone());
    let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
    let picture = studio.shoot(&shot, how).expect("a picture");
    keep(&format!("mesh-{name}-{:?}", how.quality), &picture);
    picture
}

fn covered(picture: &Picture) -> usize {
    picture.rgba.chunks_exact(4).filter(|p| p[..3].iter().any(|v| *v > 12)).count()
}

#[test]
fn a_level_fades_into_the_next_without_a_gap_or_a_jump() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let models = Models::default();
    let mut outputs = models.empty();
    models.fish(&mut outputs, [0.0; 3], 0.6, 0.2);
    for quality in [Quality::High, Quality::Low] {
        let settings = Settings::of(quality);
        let whole = Settings { detail: None, ..settings };
        // Ten centimetres of camera at a time, through all switches.
        for i in 0..40 {
            let distance = 0.25 * 1.08_f64.powi(i);
            let camera = sample::looking_at(DVec3::new(0.0, 0.0, distance), DVec3::ZERO);
            let name = format!("level-{i}");
            let [seen, full] = [settings, whole].map(|how| shoot(&mut studio, &name, &outputs, camera, &how));
            let (seen, full) = (covered(&seen), covered(&full));
            // A strip half a pixel wide around the outline, some of which shows.
            let strip = 4.0 * (full as f64).sqrt() + 6.0;
            assert!((seen as f64 - full as f64).abs() < strip, "{quality:?}, {distance} m: {seen} of {full}");
        }
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn a_fade_takes_its_share_of_the_pixels() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let models = Models::default();
    let mut outputs = models.empty();
    models.fish(&mut outputs, [0.0; 3], 0.3, 0.2);
    let camera = sample::looking_at(DVec3::new(0.0, 0.0, 0.25), DVec3::ZERO);
    for quality in [Quality::High, Quality::Low] {
        let mut at = |fade: f32| {
            outputs.skinned[0].fade = fade;
            let seen = shoot(&mut studio, &format!("fade-{fade}"), &outputs, camera, &Settings::of(quality));
            covered(&seen) as f32
        };
        let [whole, most, less, gone] = [0.0, 0.25, 0.75, 1.0].map(&mut at);
        assert!(whole > 2000.0 && gone == 0.0, "{quality:?}: {whole}, {gone}");
        assert!((most / whole - 0.75).abs() < 0.03 && (less / whole - 0.25).abs() < 0.03, "{most}, {less}");
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

#[test]
fn a_material_that_lets_light_through_shows_what_is_behind_it() {
    let Some(gpu) = open() else { return };
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    let models = Models::default();
    let camera = sample::looking_at(DVec3::new(0.0, 0.1, 0.6), DVec3::ZERO);
    let mut outputs = models.empty();
    models.fish(&mut outputs, [0.0, -0.05, -0.3], 0.2, 0.2);
    let settings = Settings::default();
    let middle = |picture: &Picture| {
        let [r, _, b, _] = picture.pixel(SIZE.0 / 2, SIZE.1 / 2).expect("inside");
        (r, b)
    };
    let alone = shoot(&mut studio, "behind-nothing", &outputs, camera, &settings);
    models.bell(&mut outputs, [0.0, -0.03, 0.0], 1.0, 0.0);
    let veiled = shoot(&mut studio, "behind-a-bell", &outputs, camera, &settings);
    outputs.materials[2].base[3] = 1.0;
    let hidden = shoot(&mut studio, "behind-a-wall", &outputs, camera, &settings);
    let [(red, _), (dim, blue), (none, _)] = [&alone, &veiled, &hidden].map(middle);
    assert!(red > 60, "{red} {dim} {blue} {none}");
    let ratio = |picture: &Picture| {
        let (r, b) = middle(picture);
        f32::from(r) / f32::from(b.max(1))
    };
    let [alone, veiled, hidden] = [&alone, &veiled, &hidden].map(ratio);
    assert!(alone > 1.5 * veiled && veiled > 1.1 * hidden, "{alone}, {veiled}, {hidden}");
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}
