//! Every instruction set gives the same bytes.

use reef_flow::{Level, Packed};

use crate::common::{Random, sea, velocities};

#[test]
fn every_level_gives_the_same_bytes() {
    let levels = Level::all();
    println!("levels of this machine: {:?}", levels.iter().map(|l| l.name()).collect::<Vec<_>>());
    for seed in 0..40 {
        let flows = sea(seed, 35, [0.0; 3], 2.0);
        let mut random = Random(seed);
        let mut points: Vec<[f32; 3]> = (0..203).map(|_| random.point(2.5).map(|c| c as f32)).collect();
        // Centres and axes, where directions are undefined.
        points.extend(flows.iter().map(|f| f.position.map(|c| c as f32)));
        let mut packed = Packed::new();
        packed.fill(&flows, [0.0; 3], 0);
        let bits = |level| {
            velocities(level, &packed, &points).into_iter().map(|v| v.map(f32::to_bits)).collect::<Vec<_>>()
        };
        let scalar = bits(Level::scalar());
        for &level in &levels {
            assert_eq!(bits(level), scalar, "{} differs from scalar, seed {seed}", level.name());
        }
    }
}

#[test]
fn a_level_can_be_forced_and_never_passes_what_is_asked() {
    for code in [reef_abi::SIMD_SCALAR, reef_abi::SIMD_SSE4_2, reef_abi::SIMD_AVX2, reef_abi::SIMD_AVX512, 99]
    {
        assert!(Level::at_most(code).code() <= code);
    }
    assert_eq!(Level::at_most(reef_abi::SIMD_SCALAR).name(), "scalar");
    assert_eq!(Level::best().code(), Level::all().last().map_or(0, |l| l.code()));
}
