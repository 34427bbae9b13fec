//! Writing a file so that it appears whole or not at all.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Most symbolic links in a row that are followed, as Linux has it.
const MOST_LINKS: usize = 40;

/// Where a file at `path` is written: symbolic links are followed, also to a file that is not there yet.
pub fn place_of(path: &Path) -> PathBuf {
    let mut place = path.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(to) = std::fs::read_link(&place) else { break };
        // An absolute link replaces the folder.
        place = place.parent().unwrap_or(Path::new("")).join(to);
    }
    place
}

/// What the name of a file begins with while it is written.
const WRITING: &str = ".writing-";

/// Removes what processes that were killed left half written in `folder`; what a living one writes is locked, and stays.
pub fn remove_left_overs(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if !entry.file_name().to_string_lossy().starts_with(WRITING) {
            continue;
        }
        let path = entry.path();
        let is_file = std::fs::symlink_metadata(&path).is_ok_and(|m| m.is_file());
        // It stays where it cannot be locked or removed: it only takes room.
        if is_file && std::fs::File::open(&path).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = std::fs::remove_file(&path);
        }
    }
}

/// Lets `write` fill a temporary file beside `path`, then renames it to `path`. On any error the
/// temporary file is removed and a file that was at `path` before stays as it was. A symbolic link at
/// `path` is followed.
///
/// # Errors
/// Those of the file system and of `write`.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let path = &*place_of(path);
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(WRITING);
    #[cfg(unix)]
    {
        // As for any new file; the user's umask applies. Temporary files are private otherwise.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder)?;
    // Tells it from what a killed process left; without locks in this file system nothing is removed.
    let _ = file.as_file().try_lock();
    let mut out = BufWriter::new(file.as_file_mut());
    write(&mut out)?;
    out.flush()?;
    drop(out);
    file.as_file().sync_all()?;
    file.persist(path).map(|_| ()).map_err(|e| e.error)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_atomically(&path, |out| out.write_all(b"first")).unwrap();
        let failed = write_atomically(&path, |out| {
            out.write_all(b"second")?;
            Err(io::Error::other("no"))
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(write_atomically(&folder.path().join("none/b.txt"), |_| Ok(())).is_err());
    }

    #[test]
    fn left_overs_go_and_what_is_being_written_stays() {
        let folder = tempfile::tempdir().unwrap();
        let left = folder.path().join(".writing-abc123");
        fs::write(&left, "half").unwrap();
        fs::write(folder.path().join("mine"), "").unwrap();
        let path = folder.path().join("a.txt");
        write_atomically(&path, |out| {
            out.write_all(b"whole")?;
            remove_left_overs(folder.path());
            Ok(())
        })
        .unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert!(!left.exists());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::create_dir(path("sub")).unwrap();
        symlink("sub/file", path("link")).unwrap();
        symlink(path("link"), path("second")).unwrap();
        for (name, text) in [("second", "not there yet"), ("link", "there")] {
            write_atomically(&path(name), |out| out.write_all(text.as_bytes())).unwrap();
            assert_eq!(fs::read_to_string(path("sub/file")).unwrap(), text);
            assert!(fs::symlink_metadata(path(name)).unwrap().is_symlink());
        }
        symlink("loop", path("loop")).unwrap();
        assert_eq!(place_of(&path("loop")), path("loop"));
    }

    #[cfg(unix)]
    #[test]
    fn the_file_is_readable_as_any_other() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        write_atomically(&ours, |out| out.write_all(b"x")).unwrap();
        fs::write(&plain, b"x").unwrap();
        let mode = |path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }
}
