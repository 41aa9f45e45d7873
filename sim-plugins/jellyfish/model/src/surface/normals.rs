//! Normals from a grid of places around a tube, and vertices as the contract has them.

use fearless_simd::{Select, Simd, f32x8, i32x8, prelude::*};
use reef_flow::simd::{neg_mul_add, splat};
use reef_sdk::abi::DrawVertex;

use crate::lanes::WIDTH;

/// Rows of places; each has a vector's room before and behind it, so that neighbours around are there.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    pub(crate) around: usize,
    /// x, y, z and thickness of each row.
    pub(crate) data: Vec<f32>,
}

/// Numbers of a row.
const PARTS: usize = 4;

impl Rows {
    pub(crate) fn new(rows: usize, around: usize) -> Self {
        Self { around, data: vec![0.0; rows * PARTS * (around + 2 * WIDTH)] }
    }

    pub(crate) fn stride(&self) -> usize {
        self.around + 2 * WIDTH
    }

    /// Where a part of a row begins.
    #[inline(always)]
    pub(crate) fn at(&self, row: usize, part: usize) -> usize {
        (row * PARTS + part) * self.stride() + WIDTH
    }

    /// Makes the last of a row the neighbour of its first.
    #[inline(always)]
    pub(crate) fn close(&mut self, row: usize) {
        for part in 0..3 {
            let at = self.at(row, part);
            self.data[at - 1] = self.data[at + self.around - 1];
            self.data[at + self.around] = self.data[at];
        }
    }

    /// Sets a whole row to one point: where the rows end in one.
    pub(crate) fn gather(&mut self, row: usize, place: [f32; 3]) {
        for (part, value) in place.into_iter().enumerate() {
            let at = self.at(row, part);
            self.data[at - WIDTH..at + self.around + WIDTH].fill(value);
        }
    }

    /// Eight numbers of a row.
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, at: usize) -> f32x8<S> {
        f32x8::from_slice(simd, &self.data[at..at + WIDTH])
    }

    /// Vertices of a row: its normals are across its neighbours, before and behind it and around.
    #[inline(always)]
    pub(crate) fn emit<S: Simd>(&self, simd: S, row: usize, into: &mut [DrawVertex]) {
        let stride = self.stride();
        let ahead = PARTS * stride;
        for (block, into) in into.chunks_exact_mut(WIDTH).enumerate() {
            let [x, y, z] = [0, 1, 2].map(|part| self.at(row, part) + block * WIDTH);
            let along_x = self.load(simd, x + ahead) - self.load(simd, x - ahead);
            let along_y = self.load(simd, y + ahead) - self.load(simd, y - ahead);
            let along_z = self.load(simd, z + ahead) - self.load(simd, z - ahead);
            let around_x = self.load(simd, x + 1) - self.load(simd, x - 1);
            let around_y = self.load(simd, y + 1) - self.load(simd, y - 1);
            let around_z = self.load(simd, z + 1) - self.load(simd, z - 1);
            let normal = [
                neg_mul_add(around_z, along_y, around_y * along_z),
                neg_mul_add(around_x, along_z, around_z * along_x),
                neg_mul_add(around_y, along_x, around_x * along_y),
            ];
            let packed: [i32; WIDTH] = pack(simd, normal).into();
            let thickness = z + stride;
            for (lane, vertex) in into.iter_mut().enumerate() {
                *vertex = DrawVertex {
                    position: [self.data[x + lane], self.data[y + lane], self.data[z + lane]],
                    normal: packed[lane].cast_unsigned(),
                    thickness: self.data[thickness + lane],
                };
            }
        }
    }
}

/// Eight normals of any length as the contract packs them (reef_mesh_vertex): an octahedron, 16 bits an axis.
#[inline(always)]
pub(crate) fn pack<S: Simd>(simd: S, [x, y, z]: [f32x8<S>; 3]) -> i32x8<S> {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let sum = x.abs() + y.abs() + z.abs();
    // A normal of length 0 is packed as the contract's zeros.
    let scale = one / sum.max(splat(simd, f32::MIN_POSITIVE));
    let (a, b) = (x * scale, y * scale);
    let back = z.simd_lt(zero);
    let folded_a = (one - b.abs()).copysign(a);
    let folded_b = (one - a.abs()).copysign(b);
    let steps = splat(simd, 32767.0);
    let low: i32x8<S> = (back.select(folded_a, a) * steps).round_ties_even().to_int();
    let high: i32x8<S> = (back.select(folded_b, b) * steps).round_ties_even().to_int();
    (low & i32x8::splat(simd, 0xffff)) | (high << 16)
}
