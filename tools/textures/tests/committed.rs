//! The files in assets/textures are what the generator makes, and look as sprites have to.

use std::{fs::File, io::BufReader, path::Path};

use reef_textures::{SIDE, TEXTURES, bytes};

fn committed(name: &str) -> Vec<u8> {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/textures").join(format!("{name}.png"));
    let file = File::open(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut reader = png::Decoder::new(BufReader::new(file)).read_info().expect("a PNG file");
    let mut pixels = vec![0; reader.output_buffer_size().expect("it fits")];
    let info = reader.next_frame(&mut pixels).expect("whole");
    assert_eq!((info.width as usize, info.height as usize), (SIDE, SIDE), "{name}");
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Rgba, png::BitDepth::Eight), "{name}");
    pixels
}

#[test]
fn the_committed_files_are_what_the_generator_makes() {
    for (name, paint) in TEXTURES {
        let made = bytes(&paint().texels);
        assert!(made == committed(name), "{name}: run `cargo xtask textures`, and look at what changed");
    }
}

#[test]
fn sprites_end_before_their_edge_and_are_neither_empty_nor_full() {
    for (name, _) in TEXTURES {
        let pixels = committed(name);
        let alpha = |x: usize, y: usize| pixels[(y * SIDE + x) * 4 + 3];
        for i in 0..SIDE {
            for edge in [alpha(i, 0), alpha(i, SIDE - 1), alpha(0, i), alpha(SIDE - 1, i)] {
                assert!(edge <= 8, "{name}: {edge} of 255 is left at the edge");
            }
        }
        let mean =
            pixels.chunks_exact(4).map(|p| f64::from(p[3])).sum::<f64>() / (SIDE * SIDE) as f64 / 255.0;
        assert!((0.05..0.7).contains(&mean), "{name}: it covers {mean} of its square");
    }
}
