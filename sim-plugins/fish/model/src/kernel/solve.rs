//! The linear system of an implicit sub-step, A dv = impulse, by Cholesky's method in blocks of one node:
//! A = G Gᵀ. Which blocks there are is the plan's; lanes go over fish.

use fearless_simd::{Simd, f32x8, prelude::*};
use reef_flow::simd::{neg_mul_add, splat};

use super::{Plan, Room};
use crate::lanes::{Lane, Vector, load, load3, store, store3};

/// Least square of a diagonal element [kg]: rounding takes none below it.
const LEAST: f32 = 1e-20;

/// A node's own triangle: G's inverted diagonal, and what is below it (10, 20, 21).
pub(super) type Triangle = [Lane; 6];

#[inline(always)]
fn load9<S: Simd>(simd: S, block: &[Lane; 9]) -> [f32x8<S>; 9] {
    [
        load(simd, &block[0]),
        load(simd, &block[1]),
        load(simd, &block[2]),
        load(simd, &block[3]),
        load(simd, &block[4]),
        load(simd, &block[5]),
        load(simd, &block[6]),
        load(simd, &block[7]),
        load(simd, &block[8]),
    ]
}

/// Takes A apart, and turns the impulses into G⁻¹ impulse on the way.
#[inline(always)]
pub(super) fn factor<S: Simd>(simd: S, plan: &Plan, room: &mut Room) {
    for (j, column) in plan.columns.iter().enumerate() {
        let mut d = [splat(simd, 0.0); 6];
        for (into, from) in d.iter_mut().zip(&room.own[j]) {
            *into = load(simd, from);
        }
        let mut right = load3(simd, &room.impulse[j]);
        for [block, k] in &plan.lefts[column.lefts[0] as usize..column.lefts[1] as usize] {
            let g = load9(simd, &room.low[*block as usize]);
            let y = load3(simd, &room.impulse[*k as usize]);
            for c in 0..3 {
                d[0] = neg_mul_add(g[c], g[c], d[0]);
                d[1] = neg_mul_add(g[c], g[3 + c], d[1]);
                d[2] = neg_mul_add(g[c], g[6 + c], d[2]);
                d[3] = neg_mul_add(g[3 + c], g[3 + c], d[3]);
                d[4] = neg_mul_add(g[3 + c], g[6 + c], d[4]);
                d[5] = neg_mul_add(g[6 + c], g[6 + c], d[5]);
                for r in 0..3 {
                    right[r] = neg_mul_add(g[3 * r + c], y[c], right[r]);
                }
            }
        }
        let triangle = triangle(simd, d);
        for (into, from) in room.triangles[j].iter_mut().zip(triangle) {
            store(into, from);
        }
        let [i0, i1, i2, g10, g20, g21] = triangle;
        let y0 = right[0] * i0;
        let y1 = neg_mul_add(g10, y0, right[1]) * i1;
        let y2 = neg_mul_add(g21, y1, neg_mul_add(g20, y0, right[2])) * i2;
        store3(&mut room.impulse[j], [y0, y1, y2]);
        for number in column.blocks[0] as usize..column.blocks[1] as usize {
            let block = &plan.blocks[number];
            let mut e = [splat(simd, 0.0); 9];
            if block.own {
                for (into, from) in e.iter_mut().zip(EXPANDED) {
                    *into = load(simd, &room.off[number][from]);
                }
            }
            for [p, q] in &plan.terms[block.terms[0] as usize..block.terms[1] as usize] {
                let (p, q) = (&room.low[*p as usize], &room.low[*q as usize]);
                for c in 0..3 {
                    let column = [load(simd, &q[c]), load(simd, &q[3 + c]), load(simd, &q[6 + c])];
                    for r in 0..3 {
                        let g = load(simd, &p[3 * r + c]);
                        for s in 0..3 {
                            e[3 * r + s] = neg_mul_add(g, column[s], e[3 * r + s]);
                        }
                    }
                }
            }
            let into = &mut room.low[number];
            for r in 0..3 {
                let x0 = e[3 * r] * i0;
                let x1 = neg_mul_add(x0, g10, e[3 * r + 1]) * i1;
                let x2 = neg_mul_add(x1, g21, neg_mul_add(x0, g20, e[3 * r + 2])) * i2;
                store(&mut into[3 * r], x0);
                store(&mut into[3 * r + 1], x1);
                store(&mut into[3 * r + 2], x2);
            }
        }
    }
}

/// Where the elements of a symmetric block (xx, xy, xz, yy, yz, zz) go in a whole one.
const EXPANDED: [usize; 9] = [0, 1, 2, 1, 3, 4, 2, 4, 5];

/// Cholesky of a symmetric 3 × 3.
#[inline(always)]
fn triangle<S: Simd>(simd: S, d: [f32x8<S>; 6]) -> [f32x8<S>; 6] {
    let (one, least) = (splat(simd, 1.0), splat(simd, LEAST));
    let i0 = one / d[0].max(least).sqrt();
    let (g10, g20) = (d[1] * i0, d[2] * i0);
    let i1 = one / neg_mul_add(g10, g10, d[3]).max(least).sqrt();
    let g21 = neg_mul_add(g20, g10, d[4]) * i1;
    let i2 = one / neg_mul_add(g21, g21, neg_mul_add(g20, g20, d[5])).max(least).sqrt();
    [i0, i1, i2, g10, g20, g21]
}

/// The way back: G⁻ᵀ of what [`factor`] left in the impulses, which is dv.
#[inline(always)]
pub(super) fn back<S: Simd>(simd: S, plan: &Plan, room: &mut Room) {
    for (j, column) in plan.columns.iter().enumerate().rev() {
        let mut x: Vector<S> = load3(simd, &room.impulse[j]);
        for number in column.blocks[0] as usize..column.blocks[1] as usize {
            let g = &room.low[number];
            let known = load3(simd, &room.impulse[plan.blocks[number].row as usize]);
            for r in 0..3 {
                for c in 0..3 {
                    x[c] = neg_mul_add(load(simd, &g[3 * r + c]), known[r], x[c]);
                }
            }
        }
        let [i0, i1, i2, g10, g20, g21] = &room.triangles[j];
        let [i0, i1, i2] = [load(simd, i0), load(simd, i1), load(simd, i2)];
        let [g10, g20, g21] = [load(simd, g10), load(simd, g20), load(simd, g21)];
        x[2] *= i2;
        x[1] = neg_mul_add(g21, x[2], x[1]) * i1;
        x[0] = neg_mul_add(g20, x[2], neg_mul_add(g10, x[1], x[0])) * i0;
        store3(&mut room.impulse[j], x);
    }
}
