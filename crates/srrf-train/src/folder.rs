//! The folder of a run: one training at a time, nothing of an old run lost before a new one can stand for it, nothing left
//! over from one that was killed.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use crate::checkpoint;
use crate::error::TrainError;

/// Where the files of a run go while another one that is to replace it has no checkpoint yet.
const ASIDE: &str = "before-restart";
/// In it, once all of the old run is there.
const WHOLE: &str = "whole";
/// What a folder holds of a run beside its checkpoint.
const OTHERS: [&str; 5] = [CONFIG, BEST, LAST, crate::log::FILE, crate::log::PICTURE];
/// Held by the training that is at work.
const LOCK: &str = ".lock";
/// What files are called while they are written; see [`srrf_cloud::io::write_atomically`].
const WRITING: &str = ".writing-";
/// The weights with the best validation.
pub(crate) const BEST: &str = "best.safetensors";
/// The weights of the last step.
pub(crate) const LAST: &str = "last.safetensors";
/// The resolved configuration.
pub(crate) const CONFIG: &str = "config.toml";

/// A folder that this process has to itself.
pub(crate) struct RunFolder {
    path: PathBuf,
    /// Locked as long as it is open.
    _lock: File,
}

impl RunFolder {
    /// Makes the folder if it is not there, and takes it. What a killed training left half written is removed; a run that
    /// was moved aside for one that never had a checkpoint is brought back.
    ///
    /// # Errors
    /// [`TrainError::Busy`], or [`TrainError::Io`].
    pub(crate) fn open(path: &Path) -> Result<Self, TrainError> {
        let io = |path: &Path| {
            let path = path.to_path_buf();
            move |source| TrainError::Io { path, source }
        };
        std::fs::create_dir_all(path).map_err(io(path))?;
        let lock = path.join(LOCK);
        let mut options = File::options();
        let mut file =
            options.create(true).read(true).write(true).truncate(false).open(&lock).map_err(io(&lock))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(std::fs::TryLockError::WouldBlock) => {
                let mut process = String::new();
                let _ = file.read_to_string(&mut process);
                let process = if process.is_empty() { "unknown".into() } else { process };
                return Err(TrainError::Busy { path: path.into(), process });
            }
            Err(std::fs::TryLockError::Error(source)) => return Err(io(&lock)(source)),
        }
        // For people only: the lock itself goes with the process.
        let note = format!("process {}", std::process::id());
        file.set_len(0).and_then(|()| file.write_all(note.as_bytes())).map_err(io(&lock))?;
        for entry in std::fs::read_dir(path).map_err(io(path))?.flatten() {
            if entry.file_name().to_string_lossy().starts_with(WRITING) {
                let _ = std::fs::remove_file(entry.path());
            }
        }
        let folder = Self { path: path.into(), _lock: file };
        if folder.path.join(ASIDE).is_dir() {
            match folder.path.join(checkpoint::FILE).exists() {
                true => folder.forget()?,
                false => folder.bring_back()?,
            }
        }
        Ok(folder)
    }

    /// Whether a run with a checkpoint waits aside for the first checkpoint of the one that is to replace it.
    pub(crate) fn replaces_a_run(&self) -> bool {
        self.path.join(ASIDE).join(checkpoint::FILE).exists() && !self.path.join(checkpoint::FILE).exists()
    }

    /// Brings the run back that was moved aside, with nothing of the one that was to replace it.
    ///
    /// # Errors
    /// [`TrainError::Io`].
    pub(crate) fn bring_back(&self) -> Result<(), TrainError> {
        let aside = self.path.join(ASIDE);
        let back = self.clear_restarted(&aside).and_then(|()| self.move_files(&aside, &self.path));
        back.map_err(|source| TrainError::Io { path: self.path.clone(), source })
    }

    /// Moves what the folder holds of a run aside; [`RunFolder::forget`] removes it.
    pub(crate) fn set_aside(&self) -> Result<(), TrainError> {
        let aside = self.path.join(ASIDE);
        let moved = std::fs::create_dir_all(&aside)
            .and_then(|()| self.move_files(&self.path, &aside))
            .and_then(|()| std::fs::write(aside.join(WHOLE), ""));
        moved.map_err(|source| TrainError::Io { path: aside, source })
    }

    /// Removes what a run that was started over, and has no checkpoint, left in the folder. It did so only if the old
    /// run had been moved aside as a whole.
    fn clear_restarted(&self, aside: &Path) -> std::io::Result<()> {
        let whole = aside.join(WHOLE);
        if !whole.exists() {
            return Ok(());
        }
        for name in OTHERS {
            match std::fs::remove_file(self.path.join(name)) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        std::fs::remove_file(whole)
    }

    /// Removes what was moved aside, if anything was.
    pub(crate) fn forget(&self) -> Result<(), TrainError> {
        let aside = self.path.join(ASIDE);
        match std::fs::remove_dir_all(&aside) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                Err(TrainError::Io { path: aside, source })
            }
            _ => Ok(()),
        }
    }

    /// The checkpoint moves last in and first out, so that a kill in between leaves a run that can go on, or none.
    fn move_files(&self, from: &Path, to: &Path) -> std::io::Result<()> {
        let names: Vec<&str> = match to == self.path {
            true => OTHERS.into_iter().chain([checkpoint::FILE]).collect(),
            false => [checkpoint::FILE].into_iter().chain(OTHERS).collect(),
        };
        for name in names {
            match std::fs::rename(from.join(name), to.join(name)) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        match to == self.path {
            true => std::fs::remove_dir(from),
            false => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_training_at_a_time_and_no_left_overs() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(".writing-abc"), "half").unwrap();
        let first = RunFolder::open(folder.path()).unwrap();
        assert!(!folder.path().join(".writing-abc").exists());
        let Err(TrainError::Busy { process, .. }) = RunFolder::open(folder.path()) else {
            panic!("two in one folder")
        };
        assert_eq!(process, format!("process {}", std::process::id()));
        drop(first);
        assert!(RunFolder::open(folder.path()).is_ok());
    }

    #[test]
    fn an_old_run_is_lost_only_to_a_checkpoint() {
        let scratch = tempfile::tempdir().unwrap();
        let path = |name: &str| scratch.path().join(name);
        let write = |name: &str, text: &str| std::fs::write(path(name), text).unwrap();
        write(checkpoint::FILE, "old");
        write(BEST, "old best");
        write("mine.txt", "not of a run");
        let folder = RunFolder::open(scratch.path()).unwrap();
        folder.set_aside().unwrap();
        assert!(!path(checkpoint::FILE).exists() && path("mine.txt").exists());
        drop(folder);
        // Killed before its first checkpoint: the old one is back, with nothing of the new one.
        write(CONFIG, "new");
        write(BEST, "new best");
        write(LAST, "new last");
        let folder = RunFolder::open(scratch.path()).unwrap();
        assert_eq!(std::fs::read_to_string(path(checkpoint::FILE)).unwrap(), "old");
        assert_eq!(std::fs::read_to_string(path(BEST)).unwrap(), "old best");
        assert!(!path(ASIDE).exists() && !path(CONFIG).exists() && !path(LAST).exists());
        // Killed after it: the new one stays.
        folder.set_aside().unwrap();
        write(checkpoint::FILE, "new");
        drop(folder);
        let _folder = RunFolder::open(scratch.path()).unwrap();
        assert_eq!(std::fs::read_to_string(path(checkpoint::FILE)).unwrap(), "new");
        assert!(!path(ASIDE).exists() && !path(BEST).exists());
    }
}
