//! Flags that say how files of clouds are read where they do not say so themselves.

use clap::Args;
use srrf_cloud::io::{PointColumns, PointLayout, ReadOptions};

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
}

/// What was asked, in words that stay the same: each option that is set, as `name=value`.
pub fn described(options: &ReadOptions) -> Vec<String> {
    let ReadOptions { columns, array, layout, scan, topic, message, keep_zeros, max_memory: _, folder: _ } =
        options;
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
