//! MCAP, the recordings of ROS: topics with messages, of which `sensor_msgs/PointCloud2` hold clouds.

mod cloud;
mod fields;
mod messages;

use std::collections::BTreeMap;
use std::io::{self, Write};

use self::cloud::Message;
use self::messages::{Topic, each_cloud};
use super::scan::quote;
use super::{
    Attribute, CloudFormat, Contents, FormatError, Outgoing, ReadOptions, ReadSwitch, Room, ScanEntry,
};
use crate::Rigid;

/// MCAP files of ROS 2 (CDR) and ROS 1. The cloud is one message of one topic; where there are
/// several, [`ReadOptions::topic`] and [`ReadOptions::message`] (or the number of the scan) say which.
/// Not written.
pub(super) struct Mcap;

/// How many messages each topic holds.
fn topics(bytes: &[u8], options: &ReadOptions) -> Result<Vec<(Topic, usize)>, FormatError> {
    let mut counts: BTreeMap<String, (Topic, usize)> = BTreeMap::new();
    each_cloud(bytes, options, |topic, _| {
        counts.entry(topic.name.clone()).or_insert_with(|| (topic.clone(), 0)).1 += 1;
        Ok(true)
    })?;
    Ok(counts.into_values().collect())
}

fn listed(topics: &[(Topic, usize)]) -> String {
    let words = |(topic, count): &(Topic, usize)| {
        let plural = if *count == 1 { "" } else { "s" };
        format!("{} ({count} message{plural})", quote(topic.name.as_bytes()))
    };
    topics.iter().take(20).map(words).collect::<Vec<_>>().join(", ")
}

/// The topic that is asked for, or the only one, and the number of its messages.
fn choose(bytes: &[u8], options: &ReadOptions) -> Result<(Topic, usize), FormatError> {
    let topics = topics(bytes, options)?;
    let chosen = match &options.topic {
        Some(name) => {
            let bare = |name: &str| name.trim_start_matches('/').to_owned();
            topics.iter().find(|(topic, _)| bare(&topic.name) == bare(name))
        }
        None if topics.len() > 1 => {
            return Err(FormatError::Unclear {
                problem: format!("the clouds of {} topics: {}", topics.len(), listed(&topics)),
                switch: "--topic",
            });
        }
        None => topics.first(),
    };
    match (chosen, &options.topic) {
        (Some((Topic { encoding: None, kind, .. }, _)), _) => Err(FormatError::Content(format!(
            "messages of the type {kind} are not supported; sensor_msgs/PointCloud2 in cdr or ros1 are"
        ))),
        (Some(chosen), _) => Ok(chosen.clone()),
        (None, Some(name)) if !topics.is_empty() => Err(FormatError::Unclear {
            problem: format!(
                "no topic {} with clouds; there are {}",
                quote(name.as_bytes()),
                listed(&topics)
            ),
            switch: "--topic",
        }),
        (None, _) => Err(FormatError::Content("there are no messages of the type PointCloud2".into())),
    }
}

/// Calls `each` with the message that is asked for, or the only one.
fn with_message<T>(
    bytes: &[u8],
    options: &ReadOptions,
    each: impl Fn(&Message) -> Result<T, FormatError>,
) -> Result<T, FormatError> {
    let (chosen, count) = choose(bytes, options)?;
    let name = quote(chosen.name.as_bytes());
    let wanted = match options.message.or(options.scan) {
        Some(number) if number == 0 || number > count => {
            let problem =
                format!("message {number} is asked for, and the topic {name} has {count}, from 1 on");
            return Err(FormatError::Content(problem));
        }
        Some(number) => number,
        None if count == 1 => 1,
        None => {
            return Err(FormatError::Unclear {
                problem: format!(
                    "the topic {name} has {count} messages, each a cloud of its own; the first is 1"
                ),
                switch: "--message",
            });
        }
    };
    let (mut number, mut found) = (0, None);
    each_cloud(bytes, options, |topic, message| {
        number += usize::from(topic.name == chosen.name);
        if number < wanted || topic.name != chosen.name {
            return Ok(true);
        }
        let encoding =
            topic.encoding.ok_or_else(|| FormatError::Content("two encodings in one topic".into()))?;
        found = Some(each(&Message::parse(message, encoding)?)?);
        Ok(false)
    })?;
    found.ok_or_else(|| FormatError::truncated(format!("message {wanted}"), number.to_string()))
}

const NOT_WRITTEN: &str = "recordings of ROS are not written; write .pcd or .ply";

impl CloudFormat for Mcap {
    fn name(&self) -> &'static str {
        "mcap"
    }

    fn extensions(&self) -> &[&'static str] {
        &["mcap"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        bytes.starts_with(mcap::MAGIC)
    }

    fn takes(&self) -> &'static [ReadSwitch] {
        &[ReadSwitch::Topic, ReadSwitch::Message]
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        with_message(bytes, options, |message| message.contents(bytes.len(), options))
    }

    fn holds_scans(&self) -> bool {
        true
    }

    fn scans(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<ScanEntry>, FormatError> {
        let (chosen, _) = choose(bytes, options)?;
        let mut entries = Vec::new();
        each_cloud(bytes, options, |topic, message| {
            if let Some(encoding) = topic.encoding.filter(|_| topic.name == chosen.name) {
                let message = Message::parse(message, encoding)?;
                let [seconds, nanoseconds] = message.stamp;
                let name = format!("{} {seconds}.{nanoseconds:09} {}", topic.name, message.frame);
                entries.push(ScanEntry { name, points: message.len() as u64, pose: None });
            }
            Ok(true)
        })?;
        Ok(entries)
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        with_message(bytes, options, |message| Ok(message.attributes()))
    }

    fn room(&self) -> Room {
        Room::Nothing(NOT_WRITTEN)
    }

    fn check_rewrite(
        &self,
        _from: &str,
        _bytes: &[u8],
        _options: &ReadOptions,
    ) -> Option<Result<Room, FormatError>> {
        None
    }

    fn write_cloud(&self, _cloud: &Outgoing<'_>, _out: &mut dyn Write) -> io::Result<()> {
        Err(Room::refusal(NOT_WRITTEN).into())
    }

    fn rewrite(
        &self,
        _bytes: &[u8],
        _options: &ReadOptions,
        _motion: &Rigid,
        _out: &mut dyn Write,
    ) -> io::Result<()> {
        Err(Room::refusal(NOT_WRITTEN).into())
    }
}

#[cfg(test)]
mod tests;
