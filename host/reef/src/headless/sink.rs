//! Where rendered pictures go: a file, a folder, a film.

use std::path::Path;

use reef_files::{Folder, Writing};
use reef_gpu::Picture;
use reef_render::pictures::{encode_png, write_png_fast};
use reef_report::failure::{Failure, Outcome};

use super::{container::Container, film::Film};

/// Where pictures go. Nothing of it can be seen before [`Sink::finish`].
#[derive(Debug)]
pub(super) enum Sink {
    /// The last picture.
    Png { out: Writing, last: Option<Picture> },
    /// All pictures.
    Folder { out: Folder, count: u64 },
    /// All pictures, moving.
    Film(Film),
}

impl Sink {
    /// Tries the place, and begins what the path's ending asks for; pictures have this size [px], `fps` a
    /// second.
    pub(super) fn open(path: &Path, size: (u32, u32), fps: f64) -> Result<Self, Failure> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            _ if path.is_dir() => Self::folder(path),
            None => Self::folder(path),
            Some("png") => {
                let out = Writing::create(path).map_err(Failure::input)?;
                Ok(Sink::Png { out, last: None })
            }
            Some("mp4") => Ok(Sink::Film(Film::create(path, Container::Mp4, size, fps)?)),
            Some("webm") => Ok(Sink::Film(Film::create(path, Container::Webm, size, fps)?)),
            Some(other) => Err(Failure::input(miette::miette!(
                help =
                    "file.png keeps the last frame, a folder all of them, file.mp4 and file.webm are videos",
                "{}: `.{other}` is none of the kinds that can be written",
                path.display()
            ))),
        }
    }

    fn folder(path: &Path) -> Result<Self, Failure> {
        let out = Folder::create(path).map_err(|error| {
            Failure::input(miette::miette!(
                help = "name a folder that is empty or does not exist yet",
                "{error}"
            ))
        })?;
        Ok(Sink::Folder { out, count: 0 })
    }

    /// Does it want more than the last picture?
    pub(super) fn wants_all(&self) -> bool {
        !matches!(self, Sink::Png { .. })
    }

    /// Takes the next picture.
    pub(super) fn take(&mut self, picture: Picture) -> Outcome {
        match self {
            Sink::Png { last, .. } => *last = Some(picture),
            Sink::Folder { out, count } => {
                *count += 1;
                let name = format!("frame-{count:06}.png");
                write_png_fast(&out.part().join(name), &picture).map_err(Failure::input)?;
            }
            Sink::Film(film) => film.take(&picture)?,
        }
        Ok(())
    }

    /// Puts everything in its place.
    pub(super) fn finish(self) -> Outcome {
        match self {
            Sink::Png { out, last: Some(picture) } => encode_png(out, &picture).map_err(Failure::input),
            Sink::Png { .. } => Ok(()),
            Sink::Folder { out, .. } => out.finish().map_err(Failure::input),
            Sink::Film(film) => film.finish(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(v: u8) -> Picture {
        Picture { width: 2, height: 2, rgba: [v, v, v, 255].repeat(4) }
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(folder)
            .expect("a folder")
            .flatten()
            .map(|e| e.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_folder_gets_all_pictures_and_appears_only_when_it_is_whole() {
        let place = tempfile::tempdir().expect("a folder");
        let out = place.path().join("pictures");
        let mut sink = Sink::open(&out, (2, 2), 60.0).expect("a sink");
        sink.take(picture(1)).expect("taken");
        sink.take(picture(2)).expect("taken");
        assert!(!out.exists());
        sink.finish().expect("finished");
        assert_eq!(names(&out), ["frame-000001.png", "frame-000002.png"]);
        assert_eq!(names(place.path()), ["pictures"]);
    }

    #[test]
    fn what_was_given_up_leaves_nothing_behind() {
        let place = tempfile::tempdir().expect("a folder");
        let mut sink = Sink::open(&place.path().join("pictures"), (2, 2), 60.0).expect("a sink");
        sink.take(picture(1)).expect("taken");
        drop(sink);
        assert!(names(place.path()).is_empty());
    }

    #[test]
    fn a_png_keeps_the_last_picture() {
        let place = tempfile::tempdir().expect("a folder");
        let out = place.path().join("a.png");
        let mut sink = Sink::open(&out, (2, 2), 60.0).expect("a sink");
        sink.take(picture(1)).expect("taken");
        sink.take(picture(9)).expect("taken");
        sink.finish().expect("finished");
        assert_eq!(reef_render::pictures::read_png(&out).expect("read"), picture(9));
    }

    #[test]
    fn unwritable_places_and_unknown_kinds_are_bad_input() {
        let place = tempfile::tempdir().expect("a folder");
        std::fs::write(place.path().join("file"), "").expect("written");
        for wrong in ["missing/a.png", "missing/a.mp4", "missing/folder", "a.tiff", "file/a.png"] {
            let failure = Sink::open(&place.path().join(wrong), (2, 2), 60.0).expect_err(wrong);
            assert_eq!(failure.code, 2, "{wrong}");
        }
        let full = place.path().to_owned();
        assert_eq!(Sink::open(&full, (2, 2), 60.0).expect_err("not empty").code, 2);
    }
}
