//! Joints and levels of detail as lines, for people: each joint's axes, and the way from one to the next, in
//! the colour of the level at which the instance is drawn. What is made anew has no joints: a cross at its
//! middle has that colour.

use glam::Vec3;
use reef_streams::frame::Frame;

use super::{gather::gather, library::Shelf, twin};
use crate::{
    Shot,
    gather::{Gathered, GpuLine},
    lod::Thresholds,
    quality::Quality,
    view::Lens,
};

/// From the finest to the coarsest level, sRGB 0xAABBGGRR; what is coarser has the last.
const COLORS: [u32; 5] = [0xff3c_c81e, 0xff12_d8f0, 0xff20_90f8, 0xff2a_2ad8, 0xffc8_32b4];
/// Of what is not drawn.
const CULLED: u32 = 0xff80_8080;
/// Length of an axis as a share of an instance's radius.
const AXIS: f32 = 0.08;

/// The lines of one picture.
pub(super) fn lines(
    shot: &Shot<'_>,
    (shelf, gathered): (&Shelf, &Gathered),
    lens: &Lens,
    (limits, quality): (Option<&Thresholds>, Quality),
) -> Vec<GpuLine> {
    let (previous, current): (&Frame, &Frame) = (shot.previous, shot.current);
    let subject = gather([previous, current], &gathered.matched, shot.alpha, lens, quality, shelf);
    let brought = twin::Brought::new(previous, current);
    let mut lines = Vec::new();
    for (i, instance) in subject.instances.iter().enumerate() {
        if instance.vertices_of as usize != i {
            continue;
        }
        let stand = twin::stand((&subject, &brought), (shelf, &gathered.objects), i, lens, limits);
        let color = match stand.level {
            Some(level) => COLORS[(level as usize).min(COLORS.len() - 1)],
            None => CULLED,
        };
        let mut line = |from: Vec3, to: Vec3| {
            lines.push(GpuLine { from: from.to_array(), color, to: to.to_array() });
        };
        let length = AXIS * stand.radius;
        if stand.joints.is_empty() {
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                line(stand.center - axis * length * 2.0, stand.center + axis * length * 2.0);
            }
        }
        let mut before: Option<Vec3> = None;
        for (place, turn) in stand.joints {
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                line(place, place + turn * axis * length);
            }
            if let Some(before) = before {
                line(before, place);
            }
            before = Some(place);
        }
    }
    lines
}
