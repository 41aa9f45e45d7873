//! The whole way on a real device (lavapipe counts): computed, drawn and read back exactly, and clean under
//! the validation layer; and every planted fault is found.

use ash::vk;

use super::{ring::Ring, *};

/// A context under core and synchronisation validation; None where the machine has no driver or no layer and
/// tests may be skipped.
fn open(fault: Option<Fault>) -> Option<Gpu> {
    open_with(Validation::CoreSync, fault)
}

fn open_with(validation: Validation, fault: Option<Fault>) -> Option<Gpu> {
    let options = GpuOptions { validation, fault, ..GpuOptions::default() };
    match Gpu::open(&options) {
        Ok(gpu) => Some(gpu),
        Err(error) if std::env::var("REEF_REQUIRE").as_deref() == Ok("all") => panic!("{error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// Closes the context; what the canary heard until the end.
fn close(gpu: Gpu) -> Vec<Message> {
    let canary = gpu.canary();
    gpu.close();
    canary.take()
}

fn storage(gpu: &Gpu, name: &str, words: &[u32]) -> Buffer {
    gpu.buffer_with(name, vk::BufferUsageFlags::STORAGE_BUFFER, words).expect("a buffer")
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytemuck::pod_collect_to_vec(bytes)
}

#[test]
fn passes_that_depend_on_one_another_are_timed_by_name() {
    let Some(gpu) = open(None) else { return };
    let mut frames = Frames::new(&gpu, 2).expect("frames");
    self_test::compute(&gpu, &mut frames).expect("computed");
    let timings = frames.timings();
    let names: Vec<&str> = timings.passes.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["first", "second"]);
    assert!(timings.passes.iter().all(|p| p.milliseconds >= 0.0 && p.milliseconds <= timings.milliseconds));
    drop(frames);
    assert_eq!(close(gpu), []);
}

#[test]
fn what_is_computed_drawn_sampled_and_read_back_is_exact_and_clean() {
    let Some(gpu) = open(None) else { return };
    self_test::run(&gpu).expect("exact");
    assert_eq!(close(gpu), []);
}

#[test]
fn the_tier_of_best_practices_is_clean_and_finds_a_wrong_layout() {
    let Some(gpu) = open_with(Validation::BestPractices, None) else { return };
    self_test::run(&gpu).expect("exact");
    assert_eq!(close(gpu), []);
    let Some(gpu) = open_with(Validation::BestPractices, Some(Fault::Layout)) else { return };
    let mut frames = Frames::new(&gpu, 2).expect("frames");
    self_test::draw(&gpu, &mut frames).expect("drawn");
    drop(frames);
    assert_ne!(close(gpu), []);
}

#[test]
fn a_buffer_without_texels_is_refused_where_a_shader_reads_them() {
    let Some(gpu) = open(None) else { return };
    let mut frames = Frames::new(&gpu, 1).expect("frames");
    let pipeline = Pipeline::compute(&gpu, "mesh_index.comp", &[]);
    let plain = storage(&gpu, "plain", &[0; 64]);
    let mut frame = frames.begin().expect("a frame");
    let all: Vec<_> = (1..9).map(|binding| (binding, Resource::from(&plain))).collect();
    let refused = frame.pass("texels").bind(&pipeline, &all).run(|cmd| cmd.pipeline(&pipeline));
    let error = refused.expect_err("it has none").to_string();
    assert!(error.contains("binding 1 is a buffer without texels"), "{error}");
    drop((frame, plain, pipeline));
    drop(frames);
    assert_eq!(close(gpu), []);
}

#[test]
fn a_barrier_that_is_left_out_is_found() {
    let Some(gpu) = open(Some(Fault::Barrier)) else { return };
    let mut frames = Frames::new(&gpu, 2).expect("frames");
    self_test::compute(&gpu, &mut frames).expect("computed");
    drop(frames);
    let messages = close(gpu);
    assert!(messages.iter().any(|m| m.id.contains("SYNC-HAZARD")), "{messages:?}");
}

#[test]
fn a_wrong_layout_is_found() {
    let Some(gpu) = open(Some(Fault::Layout)) else { return };
    let mut frames = Frames::new(&gpu, 2).expect("frames");
    self_test::draw(&gpu, &mut frames).expect("drawn");
    drop(frames);
    let messages = close(gpu);
    let about = |m: &Message| m.text.to_lowercase().contains("layout");
    assert!(messages.iter().any(about), "{messages:?}");
}

#[test]
fn a_leaked_buffer_is_found_by_name_and_by_the_layer() {
    let Some(gpu) = open(Some(Fault::Leak)) else { return };
    let messages = close(gpu);
    assert!(messages.iter().any(|m| m.id == "REEF-leak" && m.text.contains("planted leak")), "{messages:?}");
    assert!(messages.iter().any(|m| m.id.contains("vkDestroyDevice")), "{messages:?}");
}

#[test]
fn a_fault_is_planted_only_under_validation() {
    let options = GpuOptions { fault: Some(Fault::Leak), ..GpuOptions::default() };
    match Gpu::open(&options) {
        Ok(gpu) => assert!(gpu.close().is_empty()),
        Err(error) => eprintln!("skipped: {error}"),
    }
}

#[test]
fn a_pass_that_uses_what_it_did_not_declare_is_refused() {
    let Some(gpu) = open(None) else { return };
    let mut frames = Frames::new(&gpu, 1).expect("frames");
    let a = storage(&gpu, "declared", &[1]);
    let b = storage(&gpu, "forgotten", &[1]);
    let scale = Pipeline::compute(&gpu, "selftest_scale.comp", &[]);
    let mut frame = frames.begin().expect("a frame");
    let mut refused = |pass: &str, resources: &[(u32, Resource<'_>)], access: Access| {
        let pass = frame.pass(pass).read(&a, access);
        let pass = if resources.is_empty() { pass } else { pass.bind(&scale, resources) };
        let used = pass.run(|cmd| {
            cmd.pipeline(&scale)?;
            cmd.copy(&a, &b, 0)
        });
        used.expect_err("refused").to_string()
    };
    let both = [(0, Resource::from(&a)), (1, Resource::from(&b))];
    // No bindings, half of them, a copy that nobody declared: of what is declared in another way, and of what
    // is not at all.
    assert!(refused("none", &[], Access::TransferSrc).contains("selftest_scale"));
    assert!(refused("half", &both[..1], Access::TransferSrc).contains("binding 1"));
    let error = refused("other", &both, Access::ComputeRead);
    assert!(error.contains("`declared`") && error.contains("TransferSrc"), "{error}");
    let error = refused("target", &both, Access::TransferSrc);
    assert!(error.contains("`forgotten`") && error.contains("TransferDst"), "{error}");
    drop(frame);
    drop((a, b, scale, frames));
    assert_eq!(close(gpu), []);
}

#[test]
fn what_is_dropped_during_a_frame_lives_until_the_frame_has_ended() {
    let Some(gpu) = open(None) else { return };
    let mut frames = Frames::new(&gpu, 3).expect("frames");
    for i in 0..12u32 {
        let mut frame = frames.begin().expect("a frame");
        let short = Buffer::new(
            &gpu,
            &BufferDesc {
                name: "short-lived",
                size: 4096,
                usage: vk::BufferUsageFlags::STORAGE_BUFFER,
                memory: Memory::Device,
            },
        )
        .expect("a buffer");
        let data = frame.upload(&vec![i; 1024]).expect("room in the ring");
        frame
            .pass("copy")
            .write(&short, Access::TransferDst)
            .run(|cmd| cmd.copy(data, &short, 0))
            .expect("a pass");
        drop(short);
        // A blocking upload between must not destroy what the frame still needs.
        drop(storage(&gpu, "between", &[i]));
        frame.submit(Signals::default()).expect("submitted");
    }
    drop(frames);
    assert_eq!(close(gpu), []);
}

#[test]
fn the_upload_ring_grows_with_what_a_frame_needs_and_keeps_every_byte() {
    let Some(gpu) = open(None) else { return };
    let mut frames = Frames::new(&gpu, 2).expect("frames");
    let most = 3 << 18;
    let target = Buffer::new(
        &gpu,
        &BufferDesc {
            name: "target",
            size: 4 * 4 * most as u64,
            usage: vk::BufferUsageFlags::STORAGE_BUFFER,
            memory: Memory::Device,
        },
    )
    .expect("a buffer");
    for round in 0..3u32 {
        let mut frame = frames.begin().expect("a frame");
        let pieces: Vec<Upload> = (0..4u32)
            .map(|piece| {
                let data: Vec<u32> = (0..most).map(|i| round ^ piece << 24 ^ i).collect();
                frame.upload(&data).expect("room")
            })
            .collect();
        frame
            .pass("copy")
            .write(&target, Access::TransferDst)
            .run(|cmd| {
                pieces
                    .iter()
                    .enumerate()
                    .try_for_each(|(i, piece)| cmd.copy(*piece, &target, i as u64 * 4 * u64::from(most)))
            })
            .expect("a pass");
        frame.submit(Signals::default()).expect("submitted");
    }
    frames.wait_all().expect("ended");
    let result = words(&gpu.read_buffer(&target).expect("read back"));
    let expected: Vec<u32> =
        (0..4u32).flat_map(|piece| (0..most).map(move |i| 2 ^ piece << 24 ^ i)).collect();
    assert!(result == expected, "a byte of the last round is wrong");
    drop((frames, target));
    assert_eq!(close(gpu), []);
}

#[test]
fn chunks_that_no_device_sees_as_one_are_filled_anew_in_each_frame() {
    let Some(gpu) = open(None) else { return };
    let filled = |most_texels: u32| {
        let mut ring = Ring::with_texels(&gpu.shared, most_texels);
        let frames = [(); 4].map(|()| {
            ring.reset().expect("reset");
            // Three pieces of most of the ring's first size, and a small one that fits beside the last.
            let sizes = [900_000, 900_000, 900_000, 1_000];
            sizes
                .map(|size| ring.push(&vec![7; size]).expect("room"))
                .map(|piece| (piece.buffer, piece.offset))
        });
        drop(ring);
        frames
    };
    // A megabyte at a time: four frames with the same three chunks.
    let frames = filled(1 << 16);
    assert_eq!(frames, [frames[0]; 4]);
    let [a, b, c, d] = frames[0].map(|(buffer, _)| buffer);
    assert!(a != b && b != c && a != c && c == d, "{:?}", frames[0]);
    // All at a time: from the second frame on there is one chunk.
    let frames = filled(1 << 27);
    assert_eq!(frames[1..], [frames[1]; 3]);
    assert!(frames[1].iter().all(|(buffer, _)| *buffer == frames[1][0].0), "{:?}", frames[1]);
    assert_eq!(close(gpu), []);
}

#[test]
fn a_replaced_shader_is_drawn_with_from_the_next_frame_on_and_a_broken_one_is_not() {
    let Some(gpu) = open(None) else { return };
    let mut frames = Frames::new(&gpu, 2).expect("frames");
    let pipeline = Pipeline::compute(&gpu, "selftest_scale.comp", &[]);
    pipeline.prepare().expect("made");
    let (_, spirv) = embedded::SHADERS.iter().find(|(n, _)| *n == "selftest_scale.comp").expect("embedded");
    gpu.shaders().replace("selftest_scale.comp", spirv).expect("replaced");
    pipeline.prepare().expect("re-made");
    assert!(gpu.shaders().failures().is_empty());
    // A vertex shader under a compute shader's name: readable SPIR-V, but no pipeline comes of it.
    let (_, wrong) = embedded::SHADERS.iter().find(|(n, _)| n.ends_with(".vert")).expect("embedded");
    gpu.shaders().replace("selftest_scale.comp", wrong).expect("readable");
    pipeline.prepare().expect("the old one stays");
    assert_eq!(gpu.shaders().failures().len(), 1);
    let mut frame = frames.begin().expect("a frame");
    let [a, b] = [&[7u32], &[0]].map(|words| storage(&gpu, "one word", words));
    frame
        .pass("with the old one")
        .bind(&pipeline, &[(0, (&a).into()), (1, (&b).into())])
        .run(|cmd| {
            cmd.pipeline(&pipeline)?;
            cmd.push(&self_test::ScalePush { count: 1, factor: 10, offset: 1 })?;
            cmd.dispatch_over(1)
        })
        .expect("a pass");
    frame.submit(Signals::default()).expect("submitted");
    frames.wait_all().expect("ended");
    assert_eq!(words(&gpu.read_buffer(&b).expect("read back")), [71]);
    drop((frames, pipeline, a, b));
    assert_eq!(close(gpu), []);
}

#[test]
fn an_image_of_no_size_or_beyond_the_devices_limit_is_refused() {
    let Some(gpu) = open(None) else { return };
    for size in [(0, 1), (1, 0), (u32::MAX, 1)] {
        let usage = vk::ImageUsageFlags::SAMPLED;
        let desc = ImageDesc::new("absurd", size, vk::Format::R8G8B8A8_UNORM, usage);
        assert!(Image::new(&gpu, &desc).is_err(), "{size:?}");
    }
    assert_eq!(close(gpu), []);
}

#[test]
fn a_texture_is_filled_with_all_its_levels_and_read_back() {
    let Some(gpu) = open(None) else { return };
    let usage =
        vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC;
    let desc = ImageDesc { mips: 4, ..ImageDesc::new("texture", (8, 8), vk::Format::R8G8B8A8_UNORM, usage) };
    let texture = Image::new(&gpu, &desc).expect("an image");
    let pixels: Vec<u8> = (0..8 * 8 * 4).map(|i| i as u8).collect();
    gpu.write_image(&texture, &pixels).expect("filled");
    assert!(gpu.write_image(&texture, &pixels[1..]).is_err(), "a byte is missing");
    let mut frames = Frames::new(&gpu, 1).expect("frames");
    let mut frame = frames.begin().expect("a frame");
    let readback = frame.read_back(&texture).expect("a copy");
    frame.submit(Signals::default()).expect("submitted");
    assert_eq!(readback.finish(&mut frames).expect("a picture").rgba, pixels);
    drop((frames, texture));
    assert_eq!(close(gpu), []);
}
