//! The messages of an MCAP file, by the `mcap` crate, which unpacks its chunks.

use std::collections::BTreeMap;

use mcap::McapError;
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::super::{FormatError, ReadOptions};
use super::fields::RosWords;

/// Records may unpack to this many times the file's size and `SLACK` more.
const RATIO: usize = 200;
const SLACK: usize = 1 << 20;

/// How the numbers of a message are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    /// ROS 2.
    Cdr,
    /// ROS 1.
    Ros1,
}

/// A topic that holds clouds.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Topic {
    pub name: String,
    /// How its messages are written; `None` for one that is not supported.
    pub encoding: Option<Encoding>,
    /// The words for its encoding and type.
    pub kind: String,
}

/// Goes through the messages with clouds, in the order of the file, until `each` says `false`.
///
/// # Errors
/// [`FormatError`] where the file is damaged, cut short, or unpacks to too much.
pub(super) fn each_cloud(
    bytes: &[u8],
    options: &ReadOptions,
    mut each: impl FnMut(&Topic, &[u8]) -> Result<bool, FormatError>,
) -> Result<(), FormatError> {
    let most = bytes.len().saturating_mul(RATIO).saturating_add(SLACK);
    let most = most.min(usize::try_from(options.memory()).unwrap_or(usize::MAX));
    let settings =
        LinearReaderOptions::default().with_record_length_limit(most).with_validate_chunk_crcs(true);
    let mut reader = LinearReader::new_with_options(settings);
    let mut rest = bytes;
    // By id: the name and encoding of a schema, and the topic of a channel.
    let mut schemas: BTreeMap<u16, String> = BTreeMap::new();
    let mut channels: BTreeMap<u16, Option<Topic>> = BTreeMap::new();
    let damaged = || FormatError::Content("a record of the MCAP file is damaged".into());
    while let Some(event) = reader.next_event() {
        match event.map_err(problem)? {
            LinearReadEvent::ReadRequest(need) => {
                let (now, later) = rest.split_at(need.min(rest.len()));
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                rest = later;
            }
            LinearReadEvent::Record { data, opcode: op::SCHEMA } => {
                let mut words = RosWords::plain(data);
                let (id, name) = words.u16().zip(words.text()).ok_or_else(damaged)?;
                schemas.insert(id, name);
            }
            LinearReadEvent::Record { data, opcode: op::CHANNEL } => {
                let mut words = RosWords::plain(data);
                let ids = words.u16().zip(words.u16());
                let names = words.text().zip(words.text());
                let ((id, schema), (name, encoding)) = ids.zip(names).ok_or_else(damaged)?;
                channels.insert(id, topic(name, &encoding, schemas.get(&schema)));
            }
            LinearReadEvent::Record { data, opcode: op::MESSAGE } => {
                let id = RosWords::plain(data).u16().ok_or_else(damaged)?;
                // Behind the channel: a number, the time of the record and that of the message.
                let message = data.get(2 + 4 + 8 + 8..).ok_or_else(damaged)?;
                if let Some(Some(topic)) = channels.get(&id)
                    && !each(topic, message)?
                {
                    return Ok(());
                }
            }
            // Attachments, metadata, indices and the summary.
            LinearReadEvent::Record { .. } => {}
        }
    }
    Ok(())
}

/// The topic of a channel, if it holds clouds.
fn topic(name: String, encoding: &str, schema: Option<&String>) -> Option<Topic> {
    let schema = schema?;
    if !matches!(schema.rsplit(['/', '.']).next(), Some("PointCloud2" | "PointCloud")) {
        return None;
    }
    let ros = matches!(schema.as_str(), "sensor_msgs/msg/PointCloud2" | "sensor_msgs/PointCloud2");
    let known = match encoding {
        "cdr" if ros => Some(Encoding::Cdr),
        "ros1" if ros => Some(Encoding::Ros1),
        _ => None,
    };
    Some(Topic { name, encoding: known, kind: format!("{schema} in {encoding}") })
}

fn problem(error: McapError) -> FormatError {
    match error {
        McapError::UnexpectedEof | McapError::BadMagic => FormatError::Content(
            "the MCAP file is cut short or damaged; save what is left with `mcap recover in.mcap -o out.mcap`".into(),
        ),
        McapError::UnsupportedCompression(name) => FormatError::Content(format!(
            "the MCAP file is compressed by {name:?}; only lz4 and zstd are read, use `mcap compress`"
        )),
        other => FormatError::Content(format!("the MCAP file is damaged: {other}")),
    }
}
