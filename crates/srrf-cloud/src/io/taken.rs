//! [`Taken`]: which options of reading say something to a format.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::choice::{detect, format_of, scan_of};
use super::{CloudFormat, FormatError, ReadOptions, ReadSwitch, as_utf8};

/// Bytes of a file by which its format is known where its name does not say it.
const BEGINNING: u64 = 1 << 16;

/// The options of reading that say something to a format.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Taken {
    /// Name of the format.
    pub format: &'static str,
    /// The options.
    pub switches: Vec<ReadSwitch>,
}

impl Taken {
    pub(super) fn of(format: &dyn CloudFormat) -> Self {
        let mut switches = format.takes().to_vec();
        switches.extend(format.holds_scans().then_some(ReadSwitch::Scan));
        Self { format: format.name(), switches }
    }

    /// Those of the format of a file, by its extension, or its beginning where that says nothing. `None` where that cannot
    /// be known: reading the file says why.
    pub fn by(path: &Path) -> Option<Self> {
        let inside = scan_of(path);
        let path = inside.as_ref().map_or(path, |(file, _)| file);
        if let Ok(format) = format_of(path) {
            return Some(Self::of(format));
        }
        let mut bytes = Vec::new();
        File::open(path).ok()?.take(BEGINNING).read_to_end(&mut bytes).ok()?;
        // Cut anywhere, so that its last character may be none.
        let text = as_utf8(&bytes[..bytes.len() / 4 * 4]).ok()?;
        detect(path, &text).ok().map(Self::of)
    }

    /// The flags of the options, in words.
    pub fn words(&self) -> String {
        if self.switches.is_empty() {
            return "none of the switches of reading".to_owned();
        }
        let flags: Vec<&str> = self.switches.iter().map(|switch| switch.flag()).collect();
        flags.join(", ")
    }

    /// Leaves those of `options` out that were said of several files and say nothing to this format.
    pub(super) fn pass_over(&self, options: &mut ReadOptions) {
        for switch in std::mem::take(&mut options.shared) {
            if self.switches.contains(&switch) {
                options.shared.push(switch);
            } else {
                options.leave_out(switch);
            }
        }
    }

    /// Refuses options that say nothing to the format: whoever set them expects something of them.
    pub(super) fn check(&self, options: &ReadOptions) -> Result<(), FormatError> {
        let format = self.format;
        // The first scan of one is all that there is.
        let strange = |switch: &ReadSwitch| {
            !self.switches.contains(switch) && (*switch != ReadSwitch::Scan || options.scan != Some(1))
        };
        match options.switches().find(strange) {
            None => Ok(()),
            Some(ReadSwitch::Scan) => Err(FormatError::Content(format!(
                "scan {} is asked for, and a file of the format {format} holds one; leave the number out",
                options.scan.unwrap_or_default()
            ))),
            Some(switch) => Err(FormatError::Content(format!(
                "`{}` says nothing to a file of the format {format}, which takes {}; leave it out",
                switch.flag(),
                self.words()
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CloudFile, PointColumns};
    use super::*;

    #[test]
    fn by_the_name_or_by_the_beginning() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name);
        std::fs::write(place("cloud"), "OFF\n1 0 0\n0 0 0\n").unwrap();
        let taken = |name: &str| Taken::by(&place(name)).map(|taken| (taken.format, taken.words()));
        assert_eq!(taken("a.csv"), Some(("xyz", "--columns".to_owned())), "a file need not be there");
        assert_eq!(taken("a.pts"), Some(("pts", "--columns, --scan".to_owned())));
        assert_eq!(taken("cloud"), Some(("off", "none of the switches of reading".to_owned())));
        assert_eq!(taken("nothing"), None);
    }

    #[test]
    fn what_is_said_of_several_files_is_passed_over_where_it_says_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let columns: PointColumns = "3,2,1".parse().unwrap();
        let options =
            ReadOptions { columns: Some(columns), scan: Some(2), ..ReadOptions::default() }.of_several();
        let off = place("a.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n");
        let file = CloudFile::open_with(&off, options.clone()).unwrap();
        assert_eq!(file.points().unwrap()[1], [1.0, 0.0, 0.0]);
        assert_eq!((file.options().columns.as_ref(), file.options().scan), (None, None));
        let text = place("a.xyz", "0 0 0\n1 0 0\n0 1 0\n");
        let file = CloudFile::open_with(&text, options.clone()).unwrap();
        assert_eq!(file.points().unwrap()[1], [0.0, 0.0, 1.0]);
        // The number of the scan in a name is said of that file alone.
        let error = CloudFile::open_with(&folder.path().join("a.off#3"), options);
        assert!(error.unwrap().points().unwrap_err().to_string().contains("scan 3 is asked for"));
    }
}
