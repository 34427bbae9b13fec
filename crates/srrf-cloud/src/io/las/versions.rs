//! Tests: every format of points, LAS and LAZ, and chunks of any length as in COPC.

use std::io::{Cursor, Write};

use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlrBuilder};

use super::*;

/// Bytes of a record of each format of points (LAS 1.4, tables 7 to 17).
const LENGTHS: [usize; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// How the points are compressed.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Chunks {
    None,
    Fixed,
    /// Chunks of 1, 2, 3, ... points.
    Variable,
}

fn points(count: usize) -> Vec<[f64; 3]> {
    (0..count)
        .map(|i| [431_234.25 + i as f64 * 0.5, 4_812_345.0 - (i * i) as f64, i as f64 % 7.0 / 4.0])
        .collect()
}

/// A file of version 1.4 with `extra` bytes behind each point.
fn file(format: u8, extra: usize, chunks: Chunks, points: &[[f64; 3]]) -> Vec<u8> {
    let length = LENGTHS[usize::from(format)] + extra;
    let mut bytes = vec![0; 375];
    bytes[..4].copy_from_slice(b"LASF");
    bytes[24..26].copy_from_slice(&[1, 4]);
    bytes[94..96].copy_from_slice(&375u16.to_le_bytes());
    bytes[104] = format;
    bytes[105..107].copy_from_slice(&(length as u16).to_le_bytes());
    bytes[247..255].copy_from_slice(&(points.len() as u64).to_le_bytes());
    let axes = [LasAxis { scale: 0.25, offset: 4e6 }; 3];
    header::put_axes(&mut bytes, &axes, points);
    let mut records: Vec<u8> = (0..points.len() * length).map(|i| (i % 5) as u8).collect();
    put_points(points, &axes, length, &mut records);
    if chunks == Chunks::None {
        bytes[96..100].copy_from_slice(&375u32.to_le_bytes());
        return [bytes, records].concat();
    }
    let items = LazItemRecordBuilder::default_for_point_format_id(format, extra as u16).unwrap();
    let builder = LazVlrBuilder::new(items);
    let vlr = match chunks {
        Chunks::Variable => builder.with_variable_chunk_size().build(),
        _ => builder.with_fixed_chunk_size(40).build(),
    };
    // COPC has a record of its own in front.
    let copc = [1u8; 160];
    let content = laz_record::vlr_bytes(&vlr).unwrap();
    bytes[104] |= 0x80;
    bytes[100..104].copy_from_slice(&2u32.to_le_bytes());
    for (user, id, content) in [(&b"copc"[..], 1u16, &copc[..]), (b"laszip encoded", 22204, &content)] {
        let mut record = vec![0; 54];
        header::put_word(&mut record, 2, user);
        header::put_word(&mut record, 18, &id.to_le_bytes());
        header::put_word(&mut record, 20, &(content.len() as u16).to_le_bytes());
        bytes.extend(record);
        bytes.extend(content);
    }
    let at = bytes.len() as u32;
    bytes[96..100].copy_from_slice(&at.to_le_bytes());
    let mut out = Cursor::new(bytes);
    out.set_position(u64::from(at));
    let mut compressor = LasZipCompressor::new(out, vlr).unwrap();
    let (mut chunk, mut left) = (1, 1);
    for record in records.chunks_exact(length) {
        compressor.compress_one(record).unwrap();
        left -= 1;
        if left == 0 && chunks == Chunks::Variable {
            compressor.finish_current_chunk().unwrap();
            chunk += 1;
            left = chunk;
        } else if left == 0 {
            left = usize::MAX;
        }
    }
    compressor.done().unwrap();
    let mut out = compressor.into_inner();
    // COPC has its octree behind the points.
    out.set_position(out.get_ref().len() as u64);
    let at = out.position();
    let mut tail = vec![0; 60];
    header::put_word(&mut tail, 2, b"copc");
    header::put_word(&mut tail, 18, &1000u16.to_le_bytes());
    header::put_word(&mut tail, 20, &40u64.to_le_bytes());
    tail.extend([7; 40]);
    out.write_all(&tail).unwrap();
    let mut bytes = out.into_inner();
    bytes[235..243].copy_from_slice(&at.to_le_bytes());
    bytes[243..247].copy_from_slice(&1u32.to_le_bytes());
    bytes
}

#[test]
fn all_formats_of_points() {
    let points = points(101);
    for format in 0..=10 {
        for extra in [0, 3] {
            for chunks in [Chunks::None, Chunks::Fixed, Chunks::Variable] {
                let bytes = file(format, extra, chunks, &points);
                let read = super::read(&bytes, &ReadOptions::default());
                let read = read.unwrap_or_else(|e| panic!("format {format}, {extra} extra, {chunks:?}: {e}"));
                assert_eq!(read.points, points, "format {format}, {extra} extra bytes, {chunks:?}");
            }
        }
    }
}

#[test]
fn chunks_of_any_length_cut_short() {
    let bytes = file(7, 0, Chunks::Variable, &points(101));
    for cut in (0..bytes.len() - 120).step_by(41) {
        assert!(super::read(&bytes[..cut], &ReadOptions::default()).is_err(), "{cut}");
    }
}

#[test]
fn copc_moves() {
    let points = points(101);
    let bytes = file(6, 0, Chunks::Variable, &points);
    let motion = Rigid { translation: [10.0, 20.0, -0.5].into(), ..Rigid::identity() };
    let mut copy = Vec::new();
    LAZ.rewrite(&bytes, &ReadOptions::default(), &motion, &mut copy).unwrap();
    let moved = super::read(&copy, &ReadOptions::default()).unwrap().points;
    for (old, new) in points.iter().zip(moved) {
        let expected = [old[0] + 10.0, old[1] + 20.0, old[2] - 0.5];
        assert!((0..3).all(|axis| (expected[axis] - new[axis]).abs() < 1e-6), "{expected:?} {new:?}");
    }
    // The octree names places in the file, and they are others now: the copy is a LAZ file and no COPC.
    assert_eq!(LAZ.lost_in_copies(&bytes), ["the octree of COPC"]);
    let unpacked = LAS.rewrite_from("laz", &bytes, &ReadOptions::default(), &motion).unwrap().unwrap();
    for copy in [&copy, &unpacked] {
        assert!(LAZ.lost_in_copies(copy).is_empty() && super::read(copy, &ReadOptions::default()).is_ok());
        let names = copy.windows(16).filter(|name| *name == b"copc before move").count();
        assert_eq!(names, 2, "the record in front and the one behind the points");
    }
    assert!(LAZ.lost_in_copies(&file(7, 0, Chunks::None, &points)).is_empty());
}
