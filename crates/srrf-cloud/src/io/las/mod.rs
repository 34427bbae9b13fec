//! LAS and LAZ, the formats of airborne laser scanning. The header is read by a small parser of our
//! own, which checks every count before it is used (the `las` crate allocates by the header's
//! words); the compression of LAZ is that of the `laz` crate.

mod attributes;
mod convert;
mod header;
mod laz_record;
mod octree;
mod zipped;

use std::borrow::Cow;
use std::io::{self, Write};

use self::header::{LasAxis, LasHeader};
use super::scan::moved;
use super::{Attribute, CloudFormat, Contents, FormatError, Outgoing, ReadOptions, Room};
use crate::Rigid;

/// LAS and LAZ files.
pub(super) struct LasFormat {
    zipped: bool,
}

/// LAS files, versions 1.0 to 1.4. Coordinates are 32-bit integers times a scale plus an offset;
/// they are read exactly so, and written with a step of at most a billionth of the cloud's size (a
/// micrometre on a kilometre), to which points are rounded. A moved copy keeps all attributes,
/// records and the coordinate system as they are; its step is up to 100 times finer than the
/// original's.
pub(super) const LAS: LasFormat = LasFormat { zipped: false };

/// LAZ files, which are LAS compressed. Where a file is compressed but for its name, or the other
/// way round, it is read (and copied) as what it is.
pub(super) const LAZ: LasFormat = LasFormat { zipped: true };

impl CloudFormat for LasFormat {
    fn name(&self) -> &'static str {
        if self.zipped { "laz" } else { "las" }
    }

    fn extensions(&self) -> &[&'static str] {
        if self.zipped { &["laz"] } else { &["las"] }
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        bytes.starts_with(b"LASF") && (self.zipped || bytes.get(104).is_none_or(|format| format & 0x80 == 0))
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        read(bytes, options)
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        read_attributes(bytes, options)
    }

    fn keeps(&self, attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
        attributes::keeps(attribute, cloud)
    }

    fn room(&self) -> Room {
        Room::SomePoints
    }

    fn check_points(&self, points: &[[f64; 3]]) -> Result<(), FormatError> {
        axes_for(points, None).map(drop)
    }

    fn check_rewrite(
        &self,
        from: &str,
        bytes: &[u8],
        options: &ReadOptions,
    ) -> Option<Result<Room, FormatError>> {
        let _ = options;
        let check = || {
            let header = LasHeader::parse(bytes)?;
            match from == self.name() {
                true => check_movable(&header, bytes)?,
                false => convert::check(&header, bytes, self.zipped)?,
            }
            Ok(Room::SomePoints)
        };
        ["las", "laz"].contains(&from).then(check)
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(&file(cloud, self.zipped)?)
    }

    fn lost_in_copies(&self, bytes: &[u8]) -> Vec<String> {
        if octree::is_there(bytes) { vec!["the octree of COPC".to_owned()] } else { Vec::new() }
    }

    fn rewrite_from(
        &self,
        format: &str,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
    ) -> Option<io::Result<Vec<u8>>> {
        let twin = if self.zipped { "las" } else { "laz" };
        let repack = |moved: Vec<u8>| {
            let mut copy = convert::repacked(&moved, options, self.zipped)?;
            octree::take_away(&mut copy);
            Ok(copy)
        };
        (format == twin).then(|| rewritten(bytes, options, motion).and_then(repack))
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        out.write_all(&rewritten(bytes, options, motion)?)
    }
}

fn read(bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
    let header = LasHeader::parse(bytes)?;
    let records = records(&header, bytes, options)?;
    let held = bytes.len() + if matches!(records, Cow::Owned(_)) { records.len() } else { 0 };
    options.check_points(held, records.len() / header.record_length)?;
    Ok(Contents::of_points(points(&header, &records)))
}

fn read_attributes(bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
    let header = LasHeader::parse(bytes)?;
    let records = records(&header, bytes, options)?;
    let held = bytes.len() + if matches!(records, Cow::Owned(_)) { records.len() } else { 0 };
    options.check_memory("the attributes", held, records.len())?;
    Ok(attributes::read(bytes[104] & 0x3f, header.record_length, &records))
}

/// The points of a file as records, uncompressed.
fn records<'a>(
    header: &LasHeader,
    bytes: &'a [u8],
    options: &ReadOptions,
) -> Result<Cow<'a, [u8]>, FormatError> {
    if header.zipped {
        return zipped::decompress(header, header.laz(bytes)?, bytes, options).map(Cow::Owned);
    }
    let body = &bytes[header.points_at..];
    let length = usize::try_from(header.points).ok().and_then(|n| n.checked_mul(header.record_length));
    let records = length.and_then(|length| body.get(..length)).ok_or_else(|| {
        let found = format!("{} bytes", body.len());
        FormatError::truncated(format!("{} points of {} bytes", header.points, header.record_length), found)
    })?;
    Ok(Cow::Borrowed(records))
}

/// The points of uncompressed records.
fn points(header: &LasHeader, records: &[u8]) -> Vec<[f64; 3]> {
    let word = |record: &[u8], axis: usize| {
        record
            .get(axis * 4..)
            .and_then(|rest| rest.first_chunk())
            .map_or(0, |&bytes| i32::from_le_bytes(bytes))
    };
    let value = |record: &[u8], axis: usize| header.axes[axis].value(word(record, axis));
    let rows = records.chunks_exact(header.record_length);
    rows.map(|record| [value(record, 0), value(record, 1), value(record, 2)]).collect()
}

/// The axes that hold `points`, with a step of at most `coarsest`.
fn axes_for(points: &[[f64; 3]], coarsest: Option<[f64; 3]>) -> Result<[LasAxis; 3], FormatError> {
    let mut axes = [LasAxis { scale: 1.0, offset: 0.0 }; 3];
    for (axis, slot) in axes.iter_mut().enumerate() {
        let values = || points.iter().map(|p| p[axis]);
        let (low, high) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        if points.is_empty() {
            continue;
        }
        let extent = high - low;
        if !(extent.is_finite() && low.abs().max(high.abs()) < 1e15) {
            let problem = format!("LAS holds no coordinates from {low:e} to {high:e}; write .ply");
            return Err(FormatError::Unwritable(problem));
        }
        slot.offset = ((low + high) / 2.0).round();
        // The finest power of ten with which the extent stays under 10^9 steps; the offset adds one
        // unit at most.
        let reach = (extent / 2.0 + 1.0).min(if extent > 0.0 { f64::INFINITY } else { 1.0 });
        slot.scale = 10f64.powi((reach.log10() - 9.0).ceil() as i32);
        if let Some(coarsest) = coarsest {
            let fine = |n: i32| coarsest[axis] / 10f64.powi(n);
            let fits = |scale: f64| (extent / 2.0 + 1.0) / scale < 2e9;
            slot.scale =
                (0..3).rev().map(fine).find(|&scale| fits(scale)).unwrap_or(slot.scale.max(coarsest[axis]));
        }
    }
    Ok(axes)
}

/// A whole file of version 1.2 with points of format 0, or 2 where there are colours.
fn file(cloud: &Outgoing<'_>, zipped: bool) -> io::Result<Vec<u8>> {
    let points = cloud.points;
    let axes = axes_for(points, None)?;
    let (length, format) = attributes::layout(cloud);
    let mut records = vec![0; points.len() * length];
    put_points(points, &axes, length, &mut records);
    attributes::put(cloud, length, &mut records);
    let (mut bytes, vlr) = header::new_header(points, &axes, (format, length), zipped)?;
    match vlr {
        Some(vlr) => zipped::compress(&mut bytes, vlr, &records)?,
        None => bytes.extend(records),
    }
    Ok(bytes)
}

/// Puts the coordinates into records.
fn put_points(points: &[[f64; 3]], axes: &[LasAxis; 3], length: usize, records: &mut [u8]) {
    for (record, point) in records.chunks_exact_mut(length).zip(points) {
        for (axis, slot) in record.as_chunks_mut::<4>().0.iter_mut().take(3).enumerate() {
            *slot = axes[axis].steps(point[axis]).to_le_bytes();
        }
    }
}

fn check_movable(header: &LasHeader, bytes: &[u8]) -> Result<(), FormatError> {
    if header.zipped && header.waveforms_inside(bytes) {
        return Err(Room::refusal("LAZ with waveforms inside cannot be moved; unpack it to .las first"));
    }
    Ok(())
}

fn rewritten(bytes: &[u8], options: &ReadOptions, motion: &Rigid) -> io::Result<Vec<u8>> {
    let header = LasHeader::parse(bytes)?;
    let mut records = records(&header, bytes, options)?.into_owned();
    let old = points(&header, &records);
    let new: Vec<[f64; 3]> = old.iter().map(|&point| moved(motion, point)).collect();
    if old == new {
        return Ok(bytes.to_vec());
    }
    let axes = axes_for(&new, Some(header.axes.map(|axis| axis.scale)))?;
    put_points(&new, &axes, header.record_length, &mut records);
    let mut copy = bytes[..header.points_at].to_vec();
    let steps: Vec<[f64; 3]> =
        new.iter().map(|p| std::array::from_fn(|axis| axes[axis].value(axes[axis].steps(p[axis])))).collect();
    header::put_axes(&mut copy, &axes, &steps);
    if !header.zipped {
        copy.extend(&records);
        copy.extend(&bytes[header.points_at + records.len()..]);
        octree::take_away(&mut copy);
        return Ok(copy);
    }
    check_movable(&header, bytes)?;
    let vlr = header.laz(bytes)?;
    zipped::compress(&mut copy, vlr, &records)?;
    if let Some(tail) = header.extended_records(bytes) {
        let at = copy.len() as u64;
        header::put_word(&mut copy, 235, &at.to_le_bytes());
        copy.extend(tail);
    }
    octree::take_away(&mut copy);
    Ok(copy)
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod versions;
