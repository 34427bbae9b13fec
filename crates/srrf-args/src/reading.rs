//! Flags that say how files of clouds are read where they do not say so themselves.

use std::collections::BTreeSet;
use std::path::Path;

use clap::Args;
use srrf_cloud::io::{CloudFile, PointColumns, PointLayout, ReadOptions, ReadSwitch, Taken};

use crate::failure::Failure;
use crate::flags::value;
use crate::numbers::{bytes, whole};

/// Most scans and messages of a file.
const MOST: usize = u32::MAX as usize;

/// How the clouds of a verb are read.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "How to read files that do not say it themselves")]
pub struct ReadFlags {
    /// The columns of a text, or the fields of an array, that are x, y and z: by name, or by number from 1
    #[arg(long, value_name = "X,Y,Z")]
    pub columns: Option<PointColumns>,

    /// The array of an archive that is the cloud
    #[arg(long, value_name = "NAME")]
    pub array: Option<String>,

    /// What a point of a `.bin` is: `kitti`, `nuscenes`, or its numbers and their type, such as `3xf32` or `6xf64`
    #[arg(long, value_name = "LAYOUT")]
    pub layout: Option<PointLayout>,

    /// The scan of a file that holds several, from 1, as `FILE#2` says too [default: all of them]
    #[arg(long, value_name = value::NUMBER, value_parser = whole(1, MOST))]
    pub scan: Option<usize>,

    /// The topic whose messages are the cloud
    #[arg(long, value_name = "NAME")]
    pub topic: Option<String>,

    /// The message of a topic, from 1
    #[arg(long, value_name = value::NUMBER, value_parser = whole(1, MOST))]
    pub message: Option<usize>,

    /// Keep points at exactly 0, 0, 0 where they lie in a pile, which stands for "no return" of depth cameras and scanners
    #[arg(long)]
    pub keep_zeros: bool,

    /// Most memory that reading a file may take, such as `4G` [default: half of the machine's]
    #[arg(long, value_name = "SIZE", value_parser = bytes)]
    pub max_memory: Option<u64>,
}

impl ReadFlags {
    /// The library's options.
    pub fn options(&self) -> ReadOptions {
        ReadOptions {
            columns: self.columns.clone(),
            array: self.array.clone(),
            layout: self.layout,
            scan: self.scan,
            topic: self.topic.clone(),
            message: self.message,
            keep_zeros: self.keep_zeros,
            max_memory: self.max_memory,
            folder: None,
            shared: Vec::new(),
        }
    }

    /// The library's options for each of these files; a switch holds for those whose formats take it.
    ///
    /// # Errors
    /// [`Failure::usage`] for a switch that none of several files takes; one file alone refuses it itself.
    pub fn options_for(&self, paths: &[impl AsRef<Path>]) -> Result<ReadOptions, Failure> {
        if paths.len() < 2 {
            return Ok(self.options());
        }
        let options = self.options().of_several();
        check_taken(paths.iter().map(|path| (&options, || Taken::by(path.as_ref()))))?;
        Ok(options)
    }
}

/// Refuses switches that were said of several files together and say nothing to any of them. A file of which it is not
/// known what it takes is believed to take them: reading it says what is wrong.
///
/// # Errors
/// [`Failure::usage`], which names the switch.
pub fn check_taken<'a, T: FnOnce() -> Option<Taken>>(
    files: impl Iterator<Item = (&'a ReadOptions, T)>,
) -> Result<(), Failure> {
    let (mut taken, mut strange) = (Vec::new(), Vec::new());
    let mut formats = BTreeSet::new();
    for (options, taken_by_file) in files {
        let first = |switch: ReadSwitch| switch == ReadSwitch::Scan && options.scan == Some(1);
        let open =
            options.shared.iter().copied().filter(|&switch| !taken.contains(&switch) && !first(switch));
        let open: Vec<ReadSwitch> = open.collect();
        if open.is_empty() {
            continue;
        }
        let Some(file) = taken_by_file() else {
            taken.extend(open);
            continue;
        };
        for switch in open {
            if file.switches.contains(&switch) { taken.push(switch) } else { strange.push(switch) }
        }
        formats.insert(format!("{} takes {}", file.format, file.words()));
    }
    match strange.into_iter().find(|switch| !taken.contains(switch)) {
        None => Ok(()),
        Some(switch) => {
            let formats: Vec<String> = formats.into_iter().collect();
            let (flag, formats) = (switch.flag(), formats.join("; "));
            Err(Failure::usage(format!(
                "`{flag}` says nothing to any of these files: {formats}; leave it out"
            )))
        }
    }
}

macro_rules! of_one_cloud {
    ($name:ident, $cloud:literal, $columns:literal, $array:literal, $layout:literal, $scan:literal, $topic:literal, $message:literal) => {
        #[doc = concat!("What holds of the ", $cloud, " alone.")]
        #[derive(Debug, Clone, Default, Args)]
        struct $name {
            #[arg(id = $columns, long = $columns, value_name = "X,Y,Z", hide_short_help = true,
                  help = concat!("As --columns, of the ", $cloud, " alone"))]
            columns: Option<PointColumns>,
            #[arg(id = $array, long = $array, value_name = "NAME", hide_short_help = true,
                  help = concat!("As --array, of the ", $cloud, " alone"))]
            array: Option<String>,
            #[arg(id = $layout, long = $layout, value_name = "LAYOUT", hide_short_help = true,
                  help = concat!("As --layout, of the ", $cloud, " alone"))]
            layout: Option<PointLayout>,
            #[arg(id = $scan, long = $scan, value_name = value::NUMBER, hide_short_help = true,
                  value_parser = whole(1, MOST), help = concat!("As --scan, of the ", $cloud, " alone"))]
            scan: Option<usize>,
            #[arg(id = $topic, long = $topic, value_name = "NAME", hide_short_help = true,
                  help = concat!("As --topic, of the ", $cloud, " alone"))]
            topic: Option<String>,
            #[arg(id = $message, long = $message, value_name = value::NUMBER, hide_short_help = true,
                  value_parser = whole(1, MOST), help = concat!("As --message, of the ", $cloud, " alone"))]
            message: Option<usize>,
        }

        impl $name {
            /// What holds of both clouds, but for what is said of this one.
            fn over(&self, both: &ReadFlags) -> ReadOptions {
                let both = both.options();
                let own = [
                    (self.columns.is_some(), ReadSwitch::Columns),
                    (self.array.is_some(), ReadSwitch::Array),
                    (self.layout.is_some(), ReadSwitch::Layout),
                    (self.scan.is_some(), ReadSwitch::Scan),
                    (self.topic.is_some(), ReadSwitch::Topic),
                    (self.message.is_some(), ReadSwitch::Message),
                ];
                let shared = both.switches().filter(|switch| !own.contains(&(true, *switch))).collect();
                ReadOptions {
                    columns: self.columns.clone().or(both.columns),
                    array: self.array.clone().or(both.array),
                    layout: self.layout.or(both.layout),
                    scan: self.scan.or(both.scan),
                    topic: self.topic.clone().or(both.topic),
                    message: self.message.or(both.message),
                    keep_zeros: both.keep_zeros,
                    max_memory: both.max_memory,
                    folder: None,
                    shared,
                }
            }
        }
    };
}

of_one_cloud!(
    SourceReadFlags,
    "source",
    "source-columns",
    "source-array",
    "source-layout",
    "source-scan",
    "source-topic",
    "source-message"
);
of_one_cloud!(
    TargetReadFlags,
    "target",
    "target-columns",
    "target-array",
    "target-layout",
    "target-scan",
    "target-topic",
    "target-message"
);

/// How two clouds are read: `--columns` holds of both, `--source-columns` and `--target-columns` of one, and so
/// the others.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "How to read files that do not say it themselves")]
pub struct PairReadFlags {
    #[command(flatten)]
    both: ReadFlags,
    #[command(flatten)]
    source: SourceReadFlags,
    #[command(flatten)]
    target: TargetReadFlags,
}

impl PairReadFlags {
    /// The library's options for the source.
    pub fn source(&self) -> ReadOptions {
        self.source.over(&self.both)
    }

    /// The library's options for the target.
    pub fn target(&self) -> ReadOptions {
        self.target.over(&self.both)
    }

    /// Refuses a switch for both that neither takes.
    ///
    /// # Errors
    /// [`Failure::usage`].
    pub fn check(&self, source: &CloudFile, target: &CloudFile) -> Result<(), Failure> {
        let (of_source, of_target) = (self.source(), self.target());
        let files = [(&of_source, source), (&of_target, target)];
        check_taken(files.into_iter().map(|(options, file)| (options, || Some(file.taken()))))
    }
}

/// What was asked, in words that stay the same: each option that is set, as `name=value`.
pub fn described(options: &ReadOptions) -> Vec<String> {
    let ReadOptions {
        columns,
        array,
        layout,
        scan,
        topic,
        message,
        keep_zeros,
        max_memory: _,
        folder: _,
        shared: _,
    } = options;
    [
        columns.as_ref().map(|v| format!("columns={v}")),
        array.as_ref().map(|v| format!("array={v}")),
        layout.map(|v| format!("layout={v}")),
        scan.map(|v| format!("scan={v}")),
        topic.as_ref().map(|v| format!("topic={v}")),
        message.map(|v| format!("message={v}")),
        keep_zeros.then(|| "keep-zeros".to_owned()),
    ]
    .into_iter()
    .flatten()
    .collect()
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, Parser};

    use super::*;

    #[derive(Debug, Parser)]
    struct Program {
        #[command(flatten)]
        read: PairReadFlags,
    }

    #[test]
    fn what_is_said_of_one_cloud_comes_first() {
        Program::command().debug_assert();
        let words = "p --columns x,y,z --target-columns 2,3,4 --layout kitti --source-scan 2 --max-memory 2G";
        let read = Program::try_parse_from(words.split(' ')).unwrap().read;
        let (source, target) = (read.source(), read.target());
        assert_eq!(described(&source), ["columns=x,y,z", "layout=4xf32", "scan=2"]);
        assert_eq!(described(&target), ["columns=2,3,4", "layout=4xf32"]);
        assert_eq!((source.max_memory, target.max_memory), (Some(2_000_000_000), Some(2_000_000_000)));
    }

    #[test]
    fn a_switch_holds_for_the_files_that_take_it() {
        let flags = |words: &str| Program::try_parse_from(words.split(' ')).unwrap().read;
        let read = flags("p --columns x,y,z --layout kitti --target-columns 2,3,4");
        assert_eq!(read.source().shared, [ReadSwitch::Columns, ReadSwitch::Layout]);
        assert_eq!(read.target().shared, [ReadSwitch::Layout], "its columns were said of it alone");
        let read = flags("p --columns x,y,z --layout kitti --scan 1").both;
        let options = |names: &[&str]| read.options_for(names).map_err(|e| e.to_string());
        assert_eq!(options(&["a.ply"]).unwrap().shared, [], "one file alone refuses what it does not take");
        assert_eq!(options(&["a.ply", "a.csv", "a.bin"]).unwrap().shared.len(), 3);
        let error = options(&["a.ply", "a.csv", "b.ply"]).unwrap_err();
        assert!(error.contains("`--layout`") && error.contains("xyz takes --columns"), "{error}");
        assert!(options(&["a.ply", "a.csv", "not-there"]).is_ok(), "reading says what is wrong");
    }

    #[test]
    fn a_wrong_value_says_its_flag_and_the_way_out() {
        for (words, flag, way_out) in [
            ("p --columns x,y", "--columns", "three columns"),
            ("p --source-layout 2xf32", "--source-layout", "3xf32"),
            ("p --scan 0", "--scan", "from 1"),
            ("p --max-memory much", "--max-memory", "4G"),
        ] {
            let error = Program::try_parse_from(words.split(' ')).unwrap_err().to_string();
            assert!(error.contains(flag) && error.contains(way_out), "{error}");
        }
    }
}
