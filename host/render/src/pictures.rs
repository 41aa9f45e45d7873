//! PNG files: read whole, written whole or not at all.

use std::{
    fs::File,
    io::BufReader,
    path::{Path, PathBuf},
};

use reef_files::{WriteError, Writing};
use reef_gpu::Picture;

/// Greatest side of a picture that is read [px].
const MOST: u32 = 16_384;

/// Why a picture could not be read.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The file or its folder.
    #[error("{path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// It is no PNG that Reef reads.
    #[error("{path}: {reason}")]
    Format {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

impl miette::Diagnostic for PictureError {}

/// Writes a picture as PNG, whole or not at all. Alpha is left out.
pub fn write_png(path: &Path, picture: &Picture) -> Result<(), WriteError> {
    encode_png(Writing::create(path)?, picture)
}

/// The same into a file that was begun.
pub fn encode_png(file: Writing, picture: &Picture) -> Result<(), WriteError> {
    write(file, picture, png::Compression::Balanced)
}

/// The same sooner, in a larger file: for one picture of many.
pub fn write_png_fast(path: &Path, picture: &Picture) -> Result<(), WriteError> {
    write(Writing::create(path)?, picture, png::Compression::Fast)
}

fn write(mut file: Writing, picture: &Picture, compression: png::Compression) -> Result<(), WriteError> {
    if let Err(error) = encode(&mut file, picture, compression) {
        // The encoder's own wrapping hides what the system said.
        let error = match error {
            png::EncodingError::IoError(error) => error,
            error => std::io::Error::other(error),
        };
        return Err(file.error(&error));
    }
    file.finish()
}

fn encode(
    file: &mut Writing,
    picture: &Picture,
    compression: png::Compression,
) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(file, picture.width, picture.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(compression);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut png = encoder.write_header()?;
    let rgb: Vec<u8> = picture.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    png.write_image_data(&rgb)?;
    png.finish()?;
    Ok(())
}

/// Reads a PNG of 8 bits a channel.
pub fn read_png(path: &Path) -> Result<Picture, PictureError> {
    let refuse = |reason: String| PictureError::Format { path: path.to_owned(), reason };
    let file = File::open(path).map_err(|source| PictureError::Io { path: path.to_owned(), source })?;
    let mut decoder = png::Decoder::new(BufReader::new(file));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(|error| refuse(error.to_string()))?;
    let (width, height) = (reader.info().width, reader.info().height);
    if width > MOST || height > MOST {
        return Err(refuse(format!("{width}x{height} pixels: at most {MOST}x{MOST} are read")));
    }
    let size = reader.output_buffer_size().ok_or_else(|| refuse("it is too large".to_owned()))?;
    let mut bytes = vec![0; size];
    let info = reader.next_frame(&mut bytes).map_err(|error| refuse(error.to_string()))?;
    bytes.truncate(info.buffer_size());
    let rgba = match info.color_type {
        png::ColorType::Rgba => bytes,
        png::ColorType::Rgb => bytes.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 255]).collect(),
        other => return Err(refuse(format!("{other:?} is no colour picture"))),
    };
    Ok(Picture { width, height, rgba })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_picture_reads_back_the_same() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let picture = Picture {
            width: 3,
            height: 2,
            rgba: (0..24).map(|i| if i % 4 == 3 { 255 } else { i * 9 }).collect(),
        };
        write_png(&path, &picture).expect("written");
        assert_eq!(read_png(&path).expect("read"), picture);
    }

    #[test]
    fn a_folder_that_is_not_there_is_named_and_nothing_is_left_behind() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("missing/a.png");
        let error =
            write_png(&path, &Picture { width: 1, height: 1, rgba: vec![0; 4] }).expect_err("no folder");
        assert!(error.to_string().contains("missing"), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 0);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_told_in_plain_words() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        std::os::unix::fs::symlink("/dev/full", &path).expect("a link");
        let picture = Picture { width: 64, height: 64, rgba: vec![0; 64 * 64 * 4] };
        let error = write_png(&path, &picture).expect_err("full").to_string();
        assert!(error.ends_with("a.png cannot be written: no space is left"), "{error}");
    }

    #[test]
    fn what_is_no_png_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        for content in [&b""[..], b"not a picture", b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR"] {
            std::fs::write(&path, content).expect("written");
            assert!(matches!(read_png(&path), Err(PictureError::Format { .. })));
        }
    }
}
