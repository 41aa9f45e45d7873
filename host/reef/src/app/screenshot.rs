//! Pictures that somebody wants to keep: PNG, whole or not at all.

use std::{
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use reef_files as files;

/// Why a picture could not be kept.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The folder cannot be written, the disk is full.
    #[error("the picture could not be written to {path}: {source}")]
    Write {
        /// Where it should have gone.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// No name was free.
    #[error("no free name for a picture in {0}")]
    NoName(PathBuf),
}

/// Writes 8-bit RGBA pixels (sRGB, row after row) as `reef-STEM-NNN.png` with the first free number into the
/// folder. The file appears with its whole content, or not at all.
pub fn save(folder: &Path, stem: &str, size: [u32; 2], rgba: &[u8]) -> Result<PathBuf, Error> {
    let stem: String =
        stem.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '-' }).take(60).collect();
    let fail = |path: &Path| {
        let path = path.to_owned();
        move |source| Error::Write { path, source }
    };
    let file = files::beside(folder, None).map_err(fail(folder))?;
    encode(file.as_file(), size, rgba).map_err(fail(folder))?;
    let mut file = file;
    for number in 1..=9999 {
        let path = folder.join(format!("reef-{stem}-{number:03}.png"));
        match file.persist_noclobber(&path) {
            Ok(_) => return Ok(path),
            Err(error) if error.error.kind() == io::ErrorKind::AlreadyExists => file = error.file,
            Err(error) => return Err(Error::Write { path, source: error.error }),
        }
    }
    Err(Error::NoName(folder.to_owned()))
}

fn encode(file: &std::fs::File, size: [u32; 2], rgba: &[u8]) -> io::Result<()> {
    let mut writer = BufWriter::new(file);
    let mut encoder = png::Encoder::new(&mut writer, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut png = encoder.write_header()?;
    png.write_image_data(rgba)?;
    png.finish()?;
    writer.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_get_the_next_free_number_and_never_replace_one() {
        let folder = tempfile::tempdir().unwrap();
        let pixels = [10, 20, 30, 255].repeat(6);
        let first = save(folder.path(), "a scene", [3, 2], &pixels).unwrap();
        let second = save(folder.path(), "a scene", [3, 2], &pixels).unwrap();
        assert_eq!(first.file_name().unwrap(), "reef-a-scene-001.png");
        assert_eq!(second.file_name().unwrap(), "reef-a-scene-002.png");
        let decoder = png::Decoder::new(io::BufReader::new(std::fs::File::open(first).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut read = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut read).unwrap();
        assert_eq!(read, pixels);
    }

    #[test]
    fn a_picture_that_cannot_be_written_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        // Too few pixels: the encoder refuses after the header was written.
        assert!(save(folder.path(), "x", [3, 2], &[0; 8]).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        let error = save(&folder.path().join("missing"), "x", [1, 1], &[0; 4]).unwrap_err();
        assert!(error.to_string().contains("missing"), "{error}");
    }
}
