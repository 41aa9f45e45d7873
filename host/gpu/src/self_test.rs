//! A small check that a device computes and draws what it should: two dependent compute passes, a picture, a
//! texture.

use ash::vk;

use super::{
    Blend, Frames, Gpu, GpuError, GraphicsDesc, Image, ImageDesc, Load, Picture, Pipeline, Resource, Result,
    SamplerDesc, Signals,
};

/// Numbers that are computed.
const COUNT: u32 = 1000;
/// Odd and small, so that rows are not a multiple of anything.
const SIZE: (u32, u32) = (33, 17);

/// Computes and draws; an error names what came out wrong.
pub fn run(gpu: &Gpu) -> Result<()> {
    let mut frames = Frames::new(gpu, 2)?;
    let wrong = |what: &str| GpuError::Resource {
        name: gpu.info().name.clone(),
        reason: format!("{what} came out wrong: the driver or the device is faulty"),
    };
    let numbers = compute(gpu, &mut frames)?;
    if numbers != (0..COUNT).map(|i| 5 * (3 * i + 1) + 2).collect::<Vec<_>>() {
        return Err(wrong("what was computed"));
    }
    let picture = draw(gpu, &mut frames)?;
    let columns = (0..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| (x, y)));
    for (x, y) in columns {
        // The middle column's centre lies on the edge of what is drawn: either side may have it.
        if x == SIZE.0 / 2 {
            continue;
        }
        let expected = if x < SIZE.0 / 2 { [255, 0, 102, 255] } else { [0, 0, 0, 255] };
        if picture.pixel(x, y) != Some(expected) {
            return Err(wrong(&format!("the pixel at {x}, {y}")));
        }
    }
    Ok(())
}

crate::record! {
    /// Constants of `selftest_scale.comp`.
    pub struct ScalePush = "ScalePush" {
        /// Elements.
        pub count: u32,
        /// By which each is multiplied.
        pub factor: u32,
        /// What is added.
        pub offset: u32,
    }
}

impl ScalePush {
    fn new(factor: u32, offset: u32) -> Self {
        Self { count: COUNT, factor, offset }
    }
}

crate::record! {
    /// Constants of `selftest_color.frag`.
    pub struct ColorPush = "ColorPush" {
        /// Red, green, blue, alpha.
        pub wanted: [f32; 4],
    }
}

/// Two passes of which the second reads what the first wrote, for several frames: b = 3·a + 1, c = 5·b + 2.
pub(super) fn compute(gpu: &Gpu, frames: &mut Frames) -> Result<Vec<u32>> {
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
    let a = gpu.buffer_with("a", usage, &(0..COUNT).collect::<Vec<_>>())?;
    let b = gpu.buffer_with("b", usage, &[0u32; COUNT as usize])?;
    let c = gpu.buffer_with("c", usage, &[0u32; COUNT as usize])?;
    let scale = Pipeline::compute(gpu, "selftest_scale.comp", &[]);
    for _ in 0..5 {
        let mut frame = frames.begin()?;
        for (name, from, to, constants) in
            [("first", &a, &b, ScalePush::new(3, 1)), ("second", &b, &c, ScalePush::new(5, 2))]
        {
            frame.pass(name).bind(&scale, &[(0, from.into()), (1, to.into())]).run(|cmd| {
                cmd.pipeline(&scale)?;
                cmd.push(&constants)?;
                cmd.dispatch_over(COUNT)
            })?;
        }
        frame.submit(Signals::default())?;
    }
    frames.wait_all()?;
    Ok(bytemuck::pod_collect_to_vec(&gpu.read_buffer(&c)?))
}

/// Clears a picture, draws its left half, copies that half through a texture into another, and fetches that
/// one.
pub(super) fn draw(gpu: &Gpu, frames: &mut Frames) -> Result<Picture> {
    let format = vk::Format::R8G8B8A8_UNORM;
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT
        | vk::ImageUsageFlags::SAMPLED
        | vk::ImageUsageFlags::TRANSFER_SRC;
    let first = Image::new(gpu, &ImageDesc::new("first", SIZE, format, usage))?;
    let second = Image::new(gpu, &ImageDesc::new("second", SIZE, format, usage))?;
    let color = [(format, Blend::Replace)];
    let desc = GraphicsDesc::new("half", "selftest_picture.vert", "selftest_color.frag");
    let half = Pipeline::graphics(gpu, &GraphicsDesc { color: &color, ..desc });
    let desc = GraphicsDesc::new("sample", "selftest_picture.vert", "selftest_sample.frag");
    let sample = Pipeline::graphics(gpu, &GraphicsDesc { color: &color, ..desc });
    let sampler = gpu.sampler(SamplerDesc { linear: false, repeat: [false; 2], anisotropic: false })?;
    let mut fetched = Vec::new();
    for _ in 0..3 {
        let mut frame = frames.begin()?;
        frame.pass("half").color(&first, Load::Clear([0.0, 1.0, 0.2, 1.0])).run(|cmd| {
            cmd.pipeline(&half)?;
            cmd.push(&ColorPush { wanted: [1.0, 0.0, 0.4, 1.0] })?;
            cmd.draw(0..6, 0..1);
            Ok(())
        })?;
        frame
            .pass("sample")
            .bind(&sample, &[(0, Resource::Texture(&first, sampler))])
            .color(&second, Load::Clear([0.0, 0.0, 0.0, 1.0]))
            .run(|cmd| {
                cmd.pipeline(&sample)?;
                cmd.draw(0..6, 0..1);
                Ok(())
            })?;
        fetched.push(frame.read_back(&second)?);
        frame.submit(Signals::default())?;
    }
    let last = fetched.pop().ok_or_else(|| GpuError::Resource {
        name: "picture".to_owned(),
        reason: "no frame was drawn".to_owned(),
    })?;
    last.finish(frames)
}
