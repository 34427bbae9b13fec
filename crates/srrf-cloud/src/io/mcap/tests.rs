use std::io::Cursor;

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use ros_pointcloud2::prelude::*;
use ros_pointcloud2::ros::make_field_name;

use super::*;
use crate::io::{AttributeValues, Contents};

/// Writes numbers and texts as ROS does.
struct Ros {
    bytes: Vec<u8>,
    big: bool,
    /// ROS 2; without gaps otherwise.
    cdr: bool,
}

impl Ros {
    fn put<const N: usize>(&mut self, mut little: [u8; N]) {
        while self.cdr && !self.bytes.len().is_multiple_of(N) {
            self.bytes.push(0);
        }
        if self.big {
            little.reverse();
        }
        self.bytes.extend(little);
    }

    fn u32(&mut self, value: u32) {
        self.put(value.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.u32((text.len() + usize::from(self.cdr)) as u32);
        self.bytes.extend(text.as_bytes());
        if self.cdr {
            self.bytes.push(0);
        }
    }

    fn message(message: &PointCloud2Msg, big: bool, cdr: bool) -> Vec<u8> {
        let mut ros = Self { bytes: Vec::new(), big, cdr };
        if !cdr {
            ros.u32(41);
        }
        ros.u32(message.header.stamp.sec as u32);
        ros.u32(message.header.stamp.nanosec);
        ros.text(message.header.frame_id.as_str());
        ros.u32(message.dimensions.height);
        ros.u32(message.dimensions.width);
        ros.u32(message.fields.len() as u32);
        for field in &message.fields {
            ros.text(field.name.as_str());
            ros.u32(field.offset);
            ros.put([field.datatype]);
            ros.u32(field.count);
        }
        ros.put([u8::from(message.endian == Endian::Big)]);
        ros.u32(message.point_step);
        ros.u32(message.row_step);
        ros.u32(message.data.len() as u32);
        ros.bytes.extend(message.data.iter());
        ros.put([1]);
        let header = [0, u8::from(!big), 0, 0];
        if cdr { [&header[..], &ros.bytes].concat() } else { ros.bytes }
    }
}

/// A topic: its name, schema, encoding, and messages.
type Topic<'a> = (&'a str, &'a str, &'a str, Vec<Vec<u8>>);

fn file(topics: &[Topic], compression: Option<Compression>) -> Vec<u8> {
    let mut writer = WriteOptions::new().compression(compression).create(Cursor::new(Vec::new())).unwrap();
    for (name, schema, encoding, messages) in topics {
        let schema = writer.add_schema(schema, "ros2msg", b"#").unwrap();
        let channel_id = writer.add_channel(schema, name, encoding, &Default::default()).unwrap();
        for (number, message) in messages.iter().enumerate() {
            let time = number as u64;
            let header =
                MessageHeader { channel_id, sequence: number as u32, log_time: time, publish_time: time };
            writer.write_to_known_channel(&header, message).unwrap();
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

const ROS2: &str = "sensor_msgs/msg/PointCloud2";

fn cloud(shift: f32) -> PointCloud2Msg {
    let points = vec![PointXYZI::new(1.5 + shift, -2.0, 3.25, 0.5), PointXYZI::new(f32::NAN, 0.0, 7.0, 9.0)];
    PointCloud2Msg::try_from_vec(points).unwrap()
}

fn read(bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
    Mcap.read(bytes, options)
}

fn default() -> ReadOptions {
    ReadOptions::default()
}

#[test]
fn one_message_of_one_topic() {
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        for (big, cdr, schema, encoding) in [
            (false, true, ROS2, "cdr"),
            (true, true, ROS2, "cdr"),
            (false, false, "sensor_msgs/PointCloud2", "ros1"),
        ] {
            let message = Ros::message(&cloud(0.0), big, cdr);
            let other = ("/imu", "sensor_msgs/msg/Imu", "cdr", vec![vec![1, 2, 3]; 3]);
            let bytes = file(&[other, ("/points", schema, encoding, vec![message])], compression);
            assert!(Mcap.recognises(&bytes));
            let contents = read(&bytes, &default()).unwrap();
            assert_eq!(contents.points[0], [1.5, -2.0, 3.25]);
            assert!(contents.points[1][0].is_nan() && contents.points.len() == 2);
            assert_eq!((contents.single, contents.grid), (true, None));
            let attributes = Mcap.attributes(&bytes, &default()).unwrap();
            let intensity = AttributeValues::F32(vec![0.5, 9.0]);
            assert_eq!(attributes, [Attribute { name: "intensity".into(), values: intensity }]);
        }
    }
}

/// Two rows of two points with gaps: doubles in big endian, a colour, and bytes between the rows.
fn padded() -> PointCloud2Msg {
    let mut message = cloud(0.0);
    let field = |name: &'static str, offset, datatype| PointFieldMsg {
        name: make_field_name(name),
        offset,
        datatype,
        count: 1,
    };
    message.fields = vec![
        field("rgb", 28, 7),
        field("Z", 16, 8),
        field("X", 0, 8),
        field("Y", 8, 8),
        field("ring", 26, 4),
    ];
    (message.point_step, message.row_step) = (36, 80);
    (message.dimensions.width, message.dimensions.height) = (2, 2);
    message.endian = Endian::Big;
    let mut data = Vec::new();
    for row in 0..2u8 {
        for column in 0..2u8 {
            for axis in 0..3 {
                let value = 431_234.567 + f64::from(row) * 10.0 + f64::from(column) + f64::from(axis) * 100.0;
                data.extend(value.to_be_bytes());
            }
            data.extend([0xee, 0xee, 0, row]);
            data.extend([0, 10 + row, 20 + column, 30, 0xee, 0xee, 0xee, 0xee]);
        }
        data.extend([0xee; 8]);
    }
    message.data = data;
    message
}

#[test]
fn rows_gaps_doubles_and_colours() {
    let bytes = file(&[("/p", ROS2, "cdr", vec![Ros::message(&padded(), false, true)])], None);
    let contents = read(&bytes, &default()).unwrap();
    assert_eq!(contents.points[3], [431_245.567, 431_345.567, 431_445.567]);
    assert_eq!((contents.points.len(), contents.single, contents.grid), (4, false, Some([2, 2])));
    let attributes = Mcap.attributes(&bytes, &default()).unwrap();
    let names: Vec<&str> = attributes.iter().map(|attribute| attribute.name.as_str()).collect();
    assert_eq!(names, ["red", "green", "blue", "ring"]);
    assert_eq!(attributes[0].values, AttributeValues::U8(vec![10, 10, 11, 11]));
    assert_eq!(attributes[1].values, AttributeValues::U8(vec![20, 21, 20, 21]));
    assert_eq!(attributes[3].values, AttributeValues::U16(vec![0, 0, 1, 1]));
}

#[test]
fn several_topics_and_messages_are_asked_for() {
    let messages = |count: usize| {
        (0..count).map(|number| Ros::message(&cloud(number as f32), false, true)).collect::<Vec<_>>()
    };
    let bytes = file(
        &[("/front/points", ROS2, "cdr", messages(3)), ("/rear/points", ROS2, "cdr", messages(1))],
        Some(Compression::Zstd),
    );
    let error = read(&bytes, &default()).unwrap_err();
    assert!(matches!(error, FormatError::Unclear { switch: "--topic", .. }));
    let words = error.to_string();
    assert!(words.contains("\"/front/points\" (3 messages), \"/rear/points\" (1 message)"), "{words}");
    let of = |topic: &str| ReadOptions { topic: Some(topic.into()), ..default() };
    assert_eq!(read(&bytes, &of("/rear/points")).unwrap().points[0][0], 1.5);
    assert_eq!(read(&bytes, &of("rear/points")).unwrap().points[0][0], 1.5, "without the first slash");
    assert!(read(&bytes, &of("/none")).unwrap_err().to_string().contains("/front/points"));
    let error = read(&bytes, &of("/front/points")).unwrap_err();
    assert!(matches!(error, FormatError::Unclear { switch: "--message", .. }), "{error}");
    for number in 1..=3 {
        let options = ReadOptions { message: Some(number), ..of("/front/points") };
        assert_eq!(read(&bytes, &options).unwrap().points[0][0], 0.5 + number as f64);
        assert_eq!(
            read(&bytes, &of("/front/points").of_scan(number)).unwrap().points[0][0],
            0.5 + number as f64
        );
    }
    for wrong in [0, 4] {
        let options = ReadOptions { message: Some(wrong), ..of("/front/points") };
        assert!(read(&bytes, &options).unwrap_err().to_string().contains("has 3, from 1 on"));
    }
    let scans = Mcap.scans(&bytes, &of("/front/points")).unwrap();
    assert_eq!(scans.iter().map(|scan| scan.points).collect::<Vec<_>>(), [2, 2, 2]);
    assert!(scans[0].name.starts_with("/front/points 0.000000000"), "{}", scans[0].name);
}

#[test]
fn what_is_not_supported_or_damaged() {
    let message = Ros::message(&cloud(0.0), false, true);
    let error = |topics: &[Topic]| read(&file(topics, None), &default()).unwrap_err().to_string();
    assert!(error(&[("/imu", "sensor_msgs/msg/Imu", "cdr", vec![vec![1]])]).contains("no messages"));
    let foxglove = error(&[("/p", "foxglove.PointCloud", "protobuf", vec![vec![1]])]);
    assert!(foxglove.contains("foxglove.PointCloud in protobuf"), "{foxglove}");
    for length in [0, 3, 4, 30, message.len() - 3] {
        let words = error(&[("/p", ROS2, "cdr", vec![message[..length].to_vec()])]);
        assert!(words.contains("CDR") || words.contains("cut short"), "{length}: {words}");
    }
    let changed = |change: fn(&mut PointCloud2Msg)| {
        let mut cloud = cloud(0.0);
        change(&mut cloud);
        error(&[("/p", ROS2, "cdr", vec![Ros::message(&cloud, false, true)])])
    };
    assert!(changed(|m| m.dimensions.width = 4_000_000_000).contains("4000000000 x 1 points"));
    assert!(changed(|m| m.dimensions.height = 3).contains("2 x 3 points"));
    assert!(changed(|m| m.point_step = 0).contains("behind the 0 bytes"));
    assert!(changed(|m| m.fields[0].offset = u32::MAX).contains("\"x\" ends behind"));
    assert!(changed(|m| m.fields[1].datatype = 99).contains("unknown type 99"));
    assert!(changed(|m| m.fields[2].name = make_field_name("w")).contains("no fields x, y and z"));
    let bytes = file(&[("/p", ROS2, "cdr", vec![message])], Some(Compression::Lz4));
    for length in 0..bytes.len() {
        assert!(read(&bytes[..length], &default()).is_err(), "{length}");
    }
    let mut out = Vec::new();
    let refused = Mcap.write_cloud(&Outgoing::of_points(&[[0.0; 3]]), &mut out).unwrap_err().to_string();
    assert!(refused.contains(".pcd"));
}

/// A chunk that says that it unpacks to 1 TB.
#[test]
fn claims_of_chunks_are_checked() {
    let message = Ros::message(&cloud(0.0), false, true);
    for compression in [Compression::Lz4, Compression::Zstd] {
        let mut bytes = file(&[("/p", ROS2, "cdr", vec![message.clone()])], Some(compression));
        assert_eq!(read(&bytes, &default()).unwrap().points.len(), 2);
        // Behind the magic number comes the header: its kind, its length, its content. Then the chunk: its kind, its
        // length, two times, and the size.
        let length = u64::from_le_bytes(*bytes[9..].first_chunk().unwrap()) as usize;
        let chunk = 8 + 9 + length;
        assert_eq!(bytes[chunk], mcap::records::op::CHUNK);
        let size = chunk + 9 + 16;
        bytes[size..size + 8].copy_from_slice(&(1u64 << 40).to_le_bytes());
        let error = read(&bytes, &default()).unwrap_err().to_string();
        assert!(error.contains("MCAP"), "{error}");
    }
    let bytes = file(&[("/p", ROS2, "cdr", vec![message])], None);
    let limited = ReadOptions { max_memory: Some(50), ..default() };
    assert!(read(&bytes, &limited).is_err(), "no record may be longer than the memory that is allowed");
}
