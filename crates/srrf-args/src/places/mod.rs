//! [`Places`]: the files that a run reads and writes, checked before any work is done.

mod identity;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use srrf_cloud::io::{check_format, format_names, is_cloud_file, place_of, remove_left_overs};

use self::identity::{FileIdentity, existing};
use crate::failure::Failure;
use crate::files::{check_output, is_special, is_stream};

/// What an output is, and the extensions that its name may have. A name without an extension says nothing against it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OutputKind {
    /// In words, such as `a page`.
    pub what: &'static str,
    /// In lower case and without the dot.
    pub extensions: &'static [&'static str],
}

impl OutputKind {
    /// A page for a browser.
    pub const PAGE: Self = Self { what: "a page", extensions: &["html", "htm"] };
    /// One JSON object.
    pub const JSON: Self = Self { what: "JSON", extensions: &["json"] };
    /// JSON objects, one a line.
    pub const JSON_LINES: Self = Self { what: "JSON lines", extensions: &["jsonl", "ndjson"] };
    /// Poses, one a line, as the TUM benchmark has them.
    pub const TUM: Self = Self { what: "poses of TUM", extensions: &["tum", "txt"] };
    /// Poses, one a line, as KITTI has them.
    pub const KITTI: Self = Self { what: "poses of KITTI", extensions: &["kitti", "txt"] };
    /// A Rerun recording.
    pub const RECORDING: Self = Self { what: "a Rerun recording", extensions: &["rrd"] };
    /// A PLY file.
    pub const PLY: Self = Self { what: "a PLY file", extensions: &["ply"] };
    /// A picture.
    pub const PNG: Self = Self { what: "a PNG picture", extensions: &["png"] };
    /// Arrays.
    pub const NPZ: Self = Self { what: "arrays of NumPy", extensions: &["npz"] };
    /// Weights of a network.
    pub const WEIGHTS: Self = Self { what: "weights", extensions: &["safetensors"] };

    fn check(self, flag: &str, path: &Path) -> Result<(), Failure> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        if extension.is_empty() || self.extensions.contains(&&*extension) {
            return Ok(());
        }
        let known: Vec<String> = self.extensions.iter().map(|known| format!(".{known}")).collect();
        Err(Failure::usage(format!(
            "{flag} {path:?}: this output is {}, and the name says .{extension}; give it a name with {}",
            self.what,
            known.join(" or ")
        )))
    }
}

/// The files that a run reads and writes. No output may be an input or another output: not by another path, by a link,
/// or by another name of the same file.
#[derive(Debug, Clone, Default)]
pub struct Places {
    inputs: Vec<NamedPlace>,
    outputs: Vec<NamedPlace>,
}

#[derive(Debug, Clone)]
struct NamedPlace {
    /// What it is to the user: a flag, or words.
    what: String,
    path: PathBuf,
}

impl Places {
    /// None so far.
    pub fn new() -> Self {
        Self::default()
    }

    /// A file that is read, if there is one; `what` is its flag, or words such as `the source`.
    #[must_use]
    pub fn reads<'a>(mut self, what: impl Into<String>, path: impl Into<Option<&'a Path>>) -> Self {
        if let Some(path) = path.into() {
            self.inputs.push(NamedPlace { what: what.into(), path: path.to_owned() });
        }
        self
    }

    /// A file that is written, if there is one, of the kind that `kind` says.
    ///
    /// # Errors
    /// [`Failure::usage`] for a name of another kind, and for a place that takes no file.
    pub fn writes<'a>(
        self,
        flag: &str,
        path: impl Into<Option<&'a Path>>,
        kind: OutputKind,
    ) -> Result<Self, Failure> {
        self.output(flag, path.into(), |path| kind.check(flag, path))
    }

    /// As [`writes`](Self::writes), for a cloud of points: its extension says the format, which has room for them.
    ///
    /// # Errors
    /// As [`writes`](Self::writes).
    pub fn writes_cloud<'a>(self, flag: &str, path: impl Into<Option<&'a Path>>) -> Result<Self, Failure> {
        self.output(flag, path.into(), |path| {
            is_named(path)?;
            check_format(path).map_err(|error| Failure::input(error).at(flag))
        })
    }

    /// As [`writes`](Self::writes), for a copy of a file: its extension says the format, which may be one that the file
    /// itself has to be of.
    ///
    /// # Errors
    /// As [`writes`](Self::writes).
    pub fn writes_copy<'a>(self, flag: &str, path: impl Into<Option<&'a Path>>) -> Result<Self, Failure> {
        self.output(flag, path.into(), is_named)
    }

    /// As [`writes`](Self::writes); `check` looks at the name.
    ///
    /// # Errors
    /// As [`writes`](Self::writes), and those of `check`.
    pub fn writes_checked<'a>(
        self,
        flag: &str,
        path: impl Into<Option<&'a Path>>,
        check: impl FnOnce(&Path) -> Result<(), Failure>,
    ) -> Result<Self, Failure> {
        self.output(flag, path.into(), check)
    }

    /// A file that will be written into the folder of `flag`, which may not be there yet.
    #[must_use]
    pub fn writes_into(mut self, flag: &str, folder: &Path, name: &str) -> Self {
        self.outputs.push(NamedPlace { what: format!("{name} in {flag}"), path: folder.join(name) });
        self
    }

    /// A folder that is filled, if there is one. It may not be there yet.
    #[must_use]
    pub fn fills<'a>(mut self, flag: &str, folder: impl Into<Option<&'a Path>>) -> Self {
        if let Some(folder) = folder.into() {
            self.outputs.push(NamedPlace { what: flag.to_owned(), path: folder.to_owned() });
        }
        self
    }

    fn output(
        mut self,
        flag: &str,
        path: Option<&Path>,
        check: impl FnOnce(&Path) -> Result<(), Failure>,
    ) -> Result<Self, Failure> {
        let Some(path) = path else { return Ok(self) };
        check_output(path).map_err(|failure| failure.at(flag))?;
        if !is_stream(path) && !is_special(path) {
            check(path)?;
        }
        self.outputs.push(NamedPlace { what: flag.to_owned(), path: path.to_owned() });
        Ok(self)
    }

    /// Whether a result goes to standard output.
    pub fn takes_standard_output(&self) -> bool {
        self.outputs.iter().any(|output| is_stream(&output.path))
    }

    /// Checks that no output is an input or another output, and that standard input and output have one use each. What
    /// killed processes left half written where this one writes is removed then.
    ///
    /// # Errors
    /// [`Failure::usage`], which names both.
    pub fn check(&self) -> Result<(), Failure> {
        let streams = |places: &[NamedPlace]| places.iter().filter(|place| is_stream(&place.path)).count();
        if streams(&self.inputs) > 1 {
            return Err(Failure::usage(
                "two inputs are `-`: standard input holds one; name a file for the other".into(),
            ));
        }
        if streams(&self.outputs) > 1 {
            return Err(Failure::usage(format!(
                "{} results are to go to `-`: standard output takes one; name files for the others",
                streams(&self.outputs)
            )));
        }
        let files: Vec<(&NamedPlace, FileIdentity)> = self
            .outputs
            .iter()
            .filter(|output| !is_stream(&output.path) && !is_special(&output.path))
            .map(|output| (output, FileIdentity::of(&output.path)))
            .collect();
        for input in self.inputs.iter().filter(|input| !is_stream(&input.path)) {
            let identity = FileIdentity::of(&existing(&input.path));
            if let Some((output, _)) = files.iter().find(|(_, of_output)| of_output.is(&identity)) {
                return Err(Failure::usage(format!(
                    "cannot write {:?} ({}): it is the same file as {:?} ({}), which would be lost; choose another place \
                     for the output",
                    output.path, output.what, input.path, input.what
                )));
            }
        }
        for (place, (output, identity)) in files.iter().enumerate() {
            if let Some((other, _)) = files[..place].iter().find(|(_, other)| other.is(identity)) {
                return Err(Failure::usage(format!(
                    "{} {:?} and {} {:?} are one file, and only the last of the two results would remain; name another \
                     file for one of them",
                    other.what, other.path, output.what, output.path
                )));
            }
        }
        let folders: BTreeSet<PathBuf> = files
            .iter()
            .map(|(output, _)| place_of(&output.path))
            .map(|place| match place.parent().filter(|folder| !folder.as_os_str().is_empty()) {
                Some(folder) => folder.to_owned(),
                None => PathBuf::from("."),
            })
            .collect();
        folders.iter().for_each(|folder| remove_left_overs(folder));
        Ok(())
    }
}

/// Checks that the extension names a format of clouds.
fn is_named(path: &Path) -> Result<(), Failure> {
    if is_cloud_file(path) {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "cannot write {path:?}: its extension names no format of clouds that this build has; use one of {}",
        format_names().join(", ")
    )))
}

#[cfg(test)]
mod tests;
