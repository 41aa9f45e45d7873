//! A module's own files: what `asset_read` gives, and what the host remembers of it, so that an edit of one
//! of them is taken up.

use std::{
    collections::BTreeMap,
    io::ErrorKind,
    path::{Component, Path, PathBuf},
};

use reef_files::bounded;

/// Most bytes that one call of a plugin may read.
const MOST_BYTES: u64 = 64 << 20;
/// Longest name [bytes].
pub(super) const LONGEST_NAME: u64 = 1 << 10;
/// The host's folder of assets has modules' own in here.
const MODULES: &str = "modules";

/// A file that a module read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Asset {
    /// Where it is.
    pub path: PathBuf,
    /// Of its content when it was read.
    hash: [u8; 32],
}

impl Asset {
    /// Whether the file has another content now, or is gone.
    pub fn has_changed(&self) -> bool {
        bounded::read(&self.path, MOST_BYTES).map_or(true, |now| *blake3::hash(&now).as_bytes() != self.hash)
    }
}

/// Why a file was not read.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Unread {
    /// There is none, or none that may be read.
    Unfit(String),
    /// It is one too large.
    TooMuch(String),
}

/// The files of one instance.
#[derive(Debug, Default)]
pub(crate) struct Assets {
    /// Where they are looked for, in this order.
    folders: Vec<PathBuf>,
    read: BTreeMap<PathBuf, [u8; 32]>,
    /// What the present call of the plugin read.
    lent: Vec<Box<[u8]>>,
}

impl Assets {
    /// Those of the plugin `id`, among the host's and beside its library.
    pub(crate) fn new(id: &str, host: Option<&Path>, library: Option<&Path>) -> Self {
        let own = |folder: &Path| folder.join(id);
        let beside = library.and_then(Path::parent).map(own);
        let folders = host.map(|host| own(&host.join(MODULES))).into_iter().chain(beside).collect();
        Self { folders, ..Self::default() }
    }

    /// What was read so far.
    pub(crate) fn all(&self) -> Vec<Asset> {
        self.read.iter().map(|(path, hash)| Asset { path: path.clone(), hash: *hash }).collect()
    }

    /// A call of the plugin is over: what was lent to it is gone.
    pub(crate) fn end_call(&mut self) {
        self.lent = Vec::new();
    }

    /// The bytes of a file, which stay until the call is over.
    pub(crate) fn read(&mut self, name: &str) -> Result<&[u8], Unread> {
        let plain = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
        if name.is_empty() || !plain || name.contains(['\\', '\0']) {
            let allowed = "allowed is a path within the module's folder, with `/`";
            return Err(Unread::Unfit(format!("`{}` is no name: {allowed}", name.escape_debug())));
        }
        let path = self.find(name)?;
        let room = MOST_BYTES - self.lent.iter().map(|bytes| bytes.len() as u64).sum::<u64>();
        let shown = path.display();
        let bytes = bounded::read(&path, room).map_err(|error| match error.kind() {
            ErrorKind::FileTooLarge => Unread::TooMuch(format!(
                "{shown}: with it the call has read more than {} MiB",
                MOST_BYTES >> 20
            )),
            _ => Unread::Unfit(format!("{shown}: {error}")),
        })?;
        self.read.insert(path, *blake3::hash(&bytes).as_bytes());
        self.lent.push(bytes.into());
        Ok(self.lent.last().map_or(&[], |bytes| bytes))
    }

    /// Where a file is, once links are followed: within its folder.
    fn find(&self, name: &str) -> Result<PathBuf, Unread> {
        for folder in &self.folders {
            let Ok(path) = folder.join(name).canonicalize() else { continue };
            if !folder.canonicalize().is_ok_and(|folder| path.starts_with(folder)) {
                return Err(Unread::Unfit(format!("`{name}` leads out of {}", folder.display())));
            }
            return Ok(path);
        }
        let looked: Vec<String> = self.folders.iter().map(|folder| folder.display().to_string()).collect();
        Err(Unread::Unfit(format!("`{name}` is not there; looked in {}", looked.join(", "))))
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, os::unix::fs::symlink};

    use super::*;

    fn place() -> (tempfile::TempDir, Assets) {
        let place = tempfile::tempdir().expect("a folder");
        let own = place.path().join("assets/modules/test.plugin");
        fs::create_dir_all(own.join("deep")).expect("folders");
        fs::create_dir_all(place.path().join("lib/test.plugin")).expect("folders");
        fs::write(own.join("deep/a.bin"), b"one").expect("a file");
        fs::write(place.path().join("lib/test.plugin/b.bin"), b"two").expect("a file");
        fs::write(place.path().join("secret"), b"three").expect("a file");
        let (host, library) = (place.path().join("assets"), place.path().join("lib/libtest.so"));
        let assets = Assets::new("test.plugin", Some(&host), Some(&library));
        (place, assets)
    }

    #[test]
    fn files_come_from_the_hosts_assets_and_from_beside_the_library() {
        let (place, mut assets) = place();
        assert_eq!(assets.read("deep/a.bin"), Ok(&b"one"[..]));
        assert_eq!(assets.read("b.bin"), Ok(&b"two"[..]));
        // The host's come first.
        fs::write(place.path().join("assets/modules/test.plugin/b.bin"), b"other").expect("a file");
        assert_eq!(assets.read("b.bin"), Ok(&b"other"[..]));
        let all = assets.all();
        assert_eq!(all.len(), 3);
        assert!(all.iter().all(|asset| !asset.has_changed()));
        fs::write(place.path().join("lib/test.plugin/b.bin"), b"too").expect("a file");
        fs::remove_file(place.path().join("assets/modules/test.plugin/deep/a.bin")).expect("it is there");
        assert_eq!(all.iter().filter(|asset| asset.has_changed()).count(), 2);
    }

    #[test]
    fn what_leads_out_of_the_folder_is_refused_by_its_name() {
        let (place, mut assets) = place();
        let own = place.path().join("assets/modules/test.plugin");
        symlink(place.path().join("secret"), own.join("link")).expect("a link");
        symlink(own.join("deep/a.bin"), own.join("inside")).expect("a link");
        for name in
            ["../../../secret", "/etc/passwd", "", "deep/../deep/a.bin", "a\\b", "link", "gone", "deep"]
        {
            match assets.read(name).map(<[u8]>::to_vec) {
                Err(Unread::Unfit(told)) => {
                    assert!(told.contains(&name.escape_debug().to_string()), "{told}")
                }
                other => panic!("{name}: {other:?}"),
            }
        }
        assert_eq!(assets.read("inside"), Ok(&b"one"[..]));
    }

    #[test]
    fn a_call_reads_so_much_and_no_more() {
        let (place, mut assets) = place();
        let large = place.path().join("assets/modules/test.plugin/large");
        fs::File::create(&large).and_then(|file| file.set_len(MOST_BYTES - 2)).expect("a file");
        assert!(assets.read("deep/a.bin").is_ok());
        assert!(matches!(assets.read("large").map(<[u8]>::len), Err(Unread::TooMuch(_))));
        assets.end_call();
        assert_eq!(assets.read("large").map(<[u8]>::len), Ok((MOST_BYTES - 2) as usize));
    }
}
