//! [`FileIdentity`]: which file a path names.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use srrf_cloud::io::place_of;

/// The file that an input names: `scan.e57#2` is a scan of `scan.e57`.
pub(super) fn existing(path: &Path) -> PathBuf {
    let name = path.to_string_lossy();
    match name.rsplit_once('#') {
        Some((file, _)) if !path.exists() && Path::new(file).exists() => PathBuf::from(file),
        _ => path.to_owned(),
    }
}

/// What tells one file from another, whatever it is called.
#[derive(Debug)]
pub(super) enum FileIdentity {
    /// A file that is there.
    #[cfg(unix)]
    There { device: u64, inode: u64 },
    /// A file that is there.
    #[cfg(not(unix))]
    There(same_file::Handle),
    /// A file that is not there yet: its folder, with all links followed, and its name.
    New { folder: PathBuf, name: OsString },
}

impl FileIdentity {
    pub fn of(path: &Path) -> Self {
        let path = place_of(path);
        if let Some(there) = Self::there(&path) {
            return there;
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
        Self::New { folder, name: path.file_name().unwrap_or_default().to_owned() }
    }

    #[cfg(unix)]
    fn there(path: &Path) -> Option<Self> {
        use std::os::unix::fs::MetadataExt;
        let metadata = fs::metadata(path).ok()?;
        Some(Self::There { device: metadata.dev(), inode: metadata.ino() })
    }

    #[cfg(not(unix))]
    fn there(path: &Path) -> Option<Self> {
        same_file::Handle::from_path(path).ok().map(Self::There)
    }

    pub fn is(&self, other: &Self) -> bool {
        match (self, other) {
            #[cfg(unix)]
            (Self::There { device, inode }, Self::There { device: other, inode: inode_of_other }) => {
                device == other && inode == inode_of_other
            }
            #[cfg(not(unix))]
            (Self::There(handle), Self::There(other)) => handle == other,
            (Self::New { folder, name }, Self::New { folder: of_other, name: other }) => {
                folder == of_other && (name == other || (same_letters(name, other) && ignores_case(folder)))
            }
            _ => false,
        }
    }
}

fn same_letters(a: &OsString, b: &OsString) -> bool {
    a.to_string_lossy().to_lowercase() == b.to_string_lossy().to_lowercase()
}

/// Whether a folder takes `A` and `a` for one name. A folder that takes no files keeps none apart.
pub(super) fn ignores_case(folder: &Path) -> bool {
    let made = tempfile::Builder::new().prefix(".case-").suffix("-a").tempfile_in(folder);
    made.is_ok_and(|file| {
        let name = file.path().file_name().unwrap_or_default().to_string_lossy().to_uppercase();
        folder.join(name).exists()
    })
}
