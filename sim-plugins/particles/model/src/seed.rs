//! Where particles begin, by hashing; and which of them are neighbours.

/// A hash of one number (splitmix64's last steps).
pub fn mix(v: u64) -> u64 {
    let v = v.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let v = (v ^ (v >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let v = (v ^ (v >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    v ^ (v >> 31)
}

/// A random place in a box: its offset from the middle in 2⁻³² of the extent, along each axis.
pub fn place(seed: u64, number: u64) -> [i32; 3] {
    let first = mix(seed ^ mix(number));
    let second = mix(first);
    [(first >> 32) as i32, first as i32, (second >> 32) as i32]
}

/// The middle of a cell of a regular grid, x fastest.
pub fn grid_place(grid: [u32; 3], number: u64) -> [i32; 3] {
    let [x, y, _] = grid.map(u64::from);
    let cell = [number % x, number / x % y, number / (x * y)];
    core::array::from_fn(|i| {
        let whole = (2 * cell[i] + 1) * ((1_u64 << 32) / (2 * u64::from(grid[i])));
        (whole as u32 ^ 0x8000_0000) as i32
    })
}

/// Places of a box in an order in which neighbours in the list are neighbours in the water, so that `members` in a row make
/// a master and its slaves: along Hilbert's curve, the one nearest to the middle of its group first.
///
/// The places themselves are independent of one another: groups are found among them, none is put beside another.
pub fn grouped(mut places: Vec<[i32; 3]>, extent: [f64; 3], members: usize) -> Vec<[i32; 3]> {
    if members < 2 {
        return places;
    }
    let greatest = extent.into_iter().fold(0.0, f64::max);
    // Cubic cells: 2¹⁶ along the longest side.
    let share = extent.map(|e| e / greatest);
    let key = |place: &[i32; 3]| {
        let cell = core::array::from_fn(|i| {
            let offset = (place[i] as u32) ^ 0x8000_0000;
            (f64::from(offset) * share[i] / 65536.0) as u32
        });
        hilbert(cell)
    };
    places.sort_by_cached_key(key);
    for group in places.chunks_mut(members) {
        let mut middle = [0.0; 3];
        for place in group.iter() {
            for i in 0..3 {
                middle[i] += f64::from(place[i]) / group.len() as f64;
            }
        }
        let distance = |place: &[i32; 3]| -> f64 {
            (0..3).map(|i| ((f64::from(place[i]) - middle[i]) * share[i]).powi(2)).sum()
        };
        let nearest = (0..group.len())
            .min_by(|a, b| distance(&group[*a]).total_cmp(&distance(&group[*b])))
            .unwrap_or(0);
        group.swap(0, nearest);
    }
    places
}

/// Place along Hilbert's curve through 2¹⁶ cells an axis (Skilling, "Programming the Hilbert curve", 2004).
fn hilbert(mut x: [u32; 3]) -> u64 {
    const BITS: u32 = 16;
    let mut q = 1_u32 << (BITS - 1);
    while q > 1 {
        let p = q - 1;
        for i in 0..3 {
            if x[i] & q != 0 {
                x[0] ^= p;
            } else {
                let t = (x[0] ^ x[i]) & p;
                x[0] ^= t;
                x[i] ^= t;
            }
        }
        q >>= 1;
    }
    x[1] ^= x[0];
    x[2] ^= x[1];
    let mut t = 0;
    let mut q = 1_u32 << (BITS - 1);
    while q > 1 {
        if x[2] & q != 0 {
            t ^= q - 1;
        }
        q >>= 1;
    }
    let x = x.map(|v| v ^ t);
    (0..BITS).rev().fold(0, |key, bit| (0..3).fold(key, |key, i| (key << 1) | u64::from((x[i] >> bit) & 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_in_a_row_along_the_curve_are_neighbours() {
        // A 16³ corner of the curve: whoever comes next shares a face.
        let mut cells: Vec<[u32; 3]> = (0..4096).map(|i| [i & 15, (i >> 4) & 15, i >> 8]).collect();
        cells.sort_by_key(|cell| hilbert(*cell));
        for pair in cells.windows(2) {
            let apart: u32 = (0..3).map(|i| pair[0][i].abs_diff(pair[1][i])).sum();
            assert_eq!(apart, 1, "{pair:?}");
        }
    }

    #[test]
    fn a_grid_fills_its_box_evenly() {
        let places: Vec<[i32; 3]> = (0..8).map(|i| grid_place([2, 2, 2], i)).collect();
        let quarter = 1 << 30;
        assert_eq!(places[0], [-quarter; 3]);
        assert_eq!(places[7], [quarter; 3]);
        assert_eq!(grid_place([1, 1, 1], 0), [0; 3]);
    }
}
