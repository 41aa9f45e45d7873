//! Orbits of many centres at once, from slices into slices.

use fearless_simd::{Simd, f32x8, f32x16};

use super::{Orbit, Trains, orbit};
use crate::{Level, sample::Points, simd::Lanes};

/// Where a train of centres goes: positions [m] and velocities [m/s], one slice an axis.
#[derive(Debug)]
pub struct Carried<'a> {
    /// Centre and displacement [m, relative to the origin].
    pub position: [&'a mut [f32]; 3],
    /// Of the orbit alone [m/s].
    pub velocity: [&'a mut [f32]; 3],
}

/// Carries each centre along its orbit under the first `count` trains. Takes as many centres as the shortest
/// of the nine slices has. The same bytes at every level, and wherever the slices are cut.
pub fn carry(level: Level, trains: &Trains, count: usize, centers: Points<'_>, out: Carried<'_>) {
    crate::dispatch!(level, simd => {
        // Sixteen lanes are two registers below AVX-512, too many for what this kernel keeps.
        if matches!(simd.level(), fearless_simd::Level::Avx512(_)) {
            wide::<_, f32x16<_>, 16>(simd, trains, count, centers, out);
        } else {
            wide::<_, f32x8<_>, 8>(simd, trains, count, centers, out);
        }
    });
}

#[inline(always)]
fn wide<S: Simd, V: Lanes<S>, const WIDTH: usize>(
    simd: S,
    trains: &Trains,
    count: usize,
    centers: Points<'_>,
    out: Carried<'_>,
) {
    let [px, py, pz] = out.position;
    let [vx, vy, vz] = out.velocity;
    let lengths = [
        centers.x.len(),
        centers.y.len(),
        centers.z.len(),
        px.len(),
        py.len(),
        pz.len(),
        vx.len(),
        vy.len(),
        vz.len(),
    ];
    let points = lengths.into_iter().fold(usize::MAX, usize::min);
    let whole = points - points % WIDTH;
    let mut first = 0;
    while first < whole {
        let here = first..first + WIDTH;
        let x = V::from_slice(simd, &centers.x[here.clone()]);
        let y = V::from_slice(simd, &centers.y[here.clone()]);
        let z = V::from_slice(simd, &centers.z[here.clone()]);
        let Orbit { displacement: [dx, dy, dz], velocity, .. } = orbit(simd, trains, count, [x, y, z]);
        (x + dx).store_slice(&mut px[here.clone()]);
        (y + dy).store_slice(&mut py[here.clone()]);
        (z + dz).store_slice(&mut pz[here.clone()]);
        velocity[0].store_slice(&mut vx[here.clone()]);
        velocity[1].store_slice(&mut vy[here.clone()]);
        velocity[2].store_slice(&mut vz[here.clone()]);
        first += WIDTH;
    }
    if whole == points {
        return;
    }
    // The rest, filled up with zeros to a whole vector.
    let rest = points - whole;
    let fill = |values: &[f32]| {
        let mut lanes = [0.0; WIDTH];
        lanes[..rest].copy_from_slice(&values[whole..points]);
        V::from_slice(simd, &lanes)
    };
    let (x, y, z) = (fill(centers.x), fill(centers.y), fill(centers.z));
    let Orbit { displacement: [dx, dy, dz], velocity, .. } = orbit(simd, trains, count, [x, y, z]);
    let store = |to: &mut [f32], value: V| {
        let mut lanes = [0.0; WIDTH];
        value.store_slice(&mut lanes);
        to[whole..points].copy_from_slice(&lanes[..rest]);
    };
    store(px, x + dx);
    store(py, y + dy);
    store(pz, z + dz);
    store(vx, velocity[0]);
    store(vy, velocity[1]);
    store(vz, velocity[2]);
}
