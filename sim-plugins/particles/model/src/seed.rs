//! Where particles begin, by hashing.

use reef_flow::random::mix;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_fills_its_box_evenly() {
        let places: Vec<[i32; 3]> = (0..8).map(|i| grid_place([2, 2, 2], i)).collect();
        let quarter = 1 << 30;
        assert_eq!(places[0], [-quarter; 3]);
        assert_eq!(places[7], [quarter; 3]);
        assert_eq!(grid_place([1, 1, 1], 0), [0; 3]);
    }
}
