//! Files that appear whole or not at all: written under a temporary name, then renamed.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use tempfile::NamedTempFile;

/// A temporary file in the folder of `path`.
pub(crate) fn temporary_beside(path: &Path) -> io::Result<NamedTempFile> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    tempfile::Builder::new().prefix(".srrf-").suffix(".tmp").tempfile_in(folder)
}

/// Gives a finished temporary file its name, in place of any file of that name.
pub(crate) fn persist(mut file: NamedTempFile, path: &Path) -> io::Result<()> {
    file.flush()?;
    make_readable(file.as_file())?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

/// Temporary files are private; results are for everyone whom the folder admits.
#[cfg(unix)]
fn make_readable(file: &fs::File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn make_readable(_: &fs::File) -> io::Result<()> {
    Ok(())
}

/// Writes `bytes` to `path`, whole or not at all.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = temporary_beside(path)?;
    file.write_all(bytes)?;
    persist(file, path)
}

/// Makes the folder and checks that files can be written in it.
pub(crate) fn prepare_folder(path: &Path) -> io::Result<()> {
    fs::create_dir_all(path)?;
    temporary_beside(&path.join("probe"))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_whole_files_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b");
        prepare_folder(&path).unwrap();
        let file = path.join("table.md");
        write(&file, b"one").unwrap();
        write(&file, b"two").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"two");
        assert_eq!(fs::read_dir(&path).unwrap().count(), 1);
        // A file stands where the folder should be.
        assert!(prepare_folder(&file).is_err());
    }
}
