//! The header of a LAS file and its variable length records.

use std::ops::Range;

use laz::LazVlr;

use super::super::FormatError;
use super::laz_record;

/// Bytes of the header of versions 1.0 to 1.2, and of 1.4.
const HEADER: usize = 227;
const HEADER_14: usize = 375;
/// Bytes before the content of a variable length record.
const VLR: usize = 54;

/// How steps of a coordinate become its value: `steps * scale + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LasAxis {
    pub scale: f64,
    pub offset: f64,
}

impl LasAxis {
    pub fn value(self, steps: i32) -> f64 {
        f64::from(steps) * self.scale + self.offset
    }

    pub fn steps(self, value: f64) -> i32 {
        ((value - self.offset) / self.scale).round() as i32
    }
}

pub(super) struct LasHeader {
    /// Offset of the first point.
    pub points_at: usize,
    pub points: u64,
    /// Bytes of each uncompressed point.
    pub record_length: usize,
    pub zipped: bool,
    pub axes: [LasAxis; 3],
    length: usize,
    vlrs: u32,
}

fn word<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}

fn double(bytes: &[u8], at: usize) -> Option<f64> {
    word(bytes, at).map(f64::from_le_bytes)
}

impl LasHeader {
    pub fn parse(bytes: &[u8]) -> Result<Self, FormatError> {
        if !bytes.starts_with(b"LASF") {
            return Err(FormatError::Content("the file does not begin with LASF".into()));
        }
        let short = || {
            FormatError::truncated(format!("a header of {HEADER} bytes"), format!("{} bytes", bytes.len()))
        };
        Self::words(bytes).ok_or_else(short)?.checked(bytes)
    }

    fn words(bytes: &[u8]) -> Option<Self> {
        let length = usize::from(u16::from_le_bytes(word(bytes, 94)?));
        let legacy = u64::from(u32::from_le_bytes(word(bytes, 107)?));
        let large = if length >= HEADER_14 { u64::from_le_bytes(word(bytes, 247)?) } else { 0 };
        let format = *bytes.get(104)?;
        let mut axes = [LasAxis { scale: 1.0, offset: 0.0 }; 3];
        for (axis, slot) in axes.iter_mut().enumerate() {
            *slot = LasAxis { scale: double(bytes, 131 + 8 * axis)?, offset: double(bytes, 155 + 8 * axis)? };
        }
        word::<48>(bytes, 179)?;
        Some(Self {
            points_at: u32::from_le_bytes(word(bytes, 96)?) as usize,
            points: if large > 0 { large } else { legacy },
            record_length: usize::from(u16::from_le_bytes(word(bytes, 105)?)),
            zipped: format & 0x80 != 0,
            axes,
            length,
            vlrs: u32::from_le_bytes(word(bytes, 100)?),
        })
    }

    fn checked(self, bytes: &[u8]) -> Result<Self, FormatError> {
        let wrong = |what: String| Err(FormatError::Content(format!("the header is damaged: {what}")));
        if self.length < HEADER || self.points_at < self.length {
            return wrong(format!(
                "points at byte {}, behind a header of {} bytes",
                self.points_at, self.length
            ));
        }
        if self.points_at > bytes.len() {
            let announced = format!("points from byte {} on", self.points_at);
            return Err(FormatError::truncated(announced, format!("{} bytes", bytes.len())));
        }
        if self.record_length < 20 {
            return wrong(format!("points of {} bytes, 20 is the least", self.record_length));
        }
        let usable = |axis: &LasAxis| axis.scale.is_finite() && axis.scale != 0.0 && axis.offset.is_finite();
        if !self.axes.iter().all(usable) {
            return wrong(format!(
                "the scales and offsets {:?}",
                self.axes.map(|axis| (axis.scale, axis.offset))
            ));
        }
        Ok(self)
    }

    /// What says how the points are compressed.
    pub fn laz(&self, bytes: &[u8]) -> Result<LazVlr, FormatError> {
        let found = self.variable_records(bytes).into_iter().find(|record| self.is_laz_record(bytes, record));
        match found {
            Some(record) => laz_record::vlr(&bytes[record.start + VLR..record.end], self.record_length),
            None => Err(FormatError::Content(
                "the points are compressed, but no record says how (`laszip encoded`)".into(),
            )),
        }
    }

    /// Where the variable length records are, as far as they end before the points.
    pub fn variable_records(&self, bytes: &[u8]) -> Vec<Range<usize>> {
        let mut records = Vec::new();
        let mut at = self.length;
        for _ in 0..self.vlrs {
            let Some(length) = word(bytes, at + 20).map(u16::from_le_bytes) else { break };
            let end = at + VLR + usize::from(length);
            if end > self.points_at {
                break;
            }
            records.push(at..end);
            at = end;
        }
        records
    }

    /// Whether a record says how points are compressed.
    pub fn is_laz_record(&self, bytes: &[u8], record: &Range<usize>) -> bool {
        let id = word(bytes, record.start + 18).map(u16::from_le_bytes);
        bytes[record.start + 2..].starts_with(LazVlr::USER_ID.as_bytes()) && id == Some(LazVlr::RECORD_ID)
    }

    /// Bytes of the header itself.
    pub fn length(&self) -> usize {
        self.length
    }

    /// The number of variable length records that the header says.
    pub fn record_count(&self) -> u32 {
        self.vlrs
    }

    /// Whether waveforms follow the points inside this file.
    pub fn waveforms_inside(&self, bytes: &[u8]) -> bool {
        let inside = word(bytes, 6).map(u16::from_le_bytes).is_some_and(|encoding| encoding & 2 != 0);
        self.length >= 235 && inside && word(bytes, 227).map(u64::from_le_bytes).is_some_and(|at| at > 0)
    }

    /// The records behind the points, from version 1.4 on.
    pub fn extended_records<'a>(&self, bytes: &'a [u8]) -> Option<&'a [u8]> {
        if self.length < HEADER_14 || word(bytes, 243).map(u32::from_le_bytes)? == 0 {
            return None;
        }
        let at = usize::try_from(u64::from_le_bytes(word(bytes, 235)?)).ok()?;
        bytes.get(at..).filter(|_| at >= self.points_at)
    }
}

/// Writes a word of a header, if it is that long.
pub(super) fn put_word(bytes: &mut [u8], at: usize, word: &[u8]) {
    if let Some(slot) = bytes.get_mut(at..at + word.len()) {
        slot.copy_from_slice(word);
    }
}

/// Writes scales, offsets and bounds.
pub(super) fn put_axes(bytes: &mut [u8], axes: &[LasAxis; 3], points: &[[f64; 3]]) {
    for (index, axis) in axes.iter().enumerate() {
        put_word(bytes, 131 + 8 * index, &axis.scale.to_le_bytes());
        put_word(bytes, 155 + 8 * index, &axis.offset.to_le_bytes());
        let values = || points.iter().map(|p| p[index]);
        if !points.is_empty() {
            put_word(bytes, 179 + 16 * index, &values().fold(f64::NEG_INFINITY, f64::max).to_le_bytes());
            put_word(bytes, 187 + 16 * index, &values().fold(f64::INFINITY, f64::min).to_le_bytes());
        }
    }
}

/// The variable length record that says how points are compressed.
pub(super) fn laz_record(vlr: &LazVlr) -> Result<Vec<u8>, FormatError> {
    let content = laz_record::vlr_bytes(vlr)?;
    let mut record = vec![0; VLR];
    put_word(&mut record, 2, LazVlr::USER_ID.as_bytes());
    put_word(&mut record, 18, &LazVlr::RECORD_ID.to_le_bytes());
    put_word(&mut record, 20, &(content.len() as u16).to_le_bytes());
    put_word(&mut record, 22, b"http://laszip.org");
    record.extend(content);
    Ok(record)
}

/// All before the points of a file of version 1.2 with points of a format and length, and how they are
/// compressed.
pub(super) fn new_header(
    points: &[[f64; 3]],
    axes: &[LasAxis; 3],
    (format, record_length): (u8, usize),
    zipped: bool,
) -> Result<(Vec<u8>, Option<LazVlr>), FormatError> {
    let count = u32::try_from(points.len()).map_err(|_| {
        FormatError::Unwritable(format!("LAS 1.2 holds no {} points; write .ply", points.len()))
    })?;
    let mut bytes = vec![0; HEADER];
    put_word(&mut bytes, 0, b"LASF");
    put_word(&mut bytes, 24, &[1, 2]);
    put_word(&mut bytes, 26, b"EXTRACTION");
    put_word(&mut bytes, 58, b"srrf");
    put_word(&mut bytes, 94, &(HEADER as u16).to_le_bytes());
    put_word(&mut bytes, 104, &[if zipped { format | 0x80 } else { format }]);
    put_word(&mut bytes, 105, &(record_length as u16).to_le_bytes());
    put_word(&mut bytes, 107, &count.to_le_bytes());
    put_word(&mut bytes, 111, &count.to_le_bytes());
    let rounded: Vec<[f64; 3]> = points
        .iter()
        .map(|p| std::array::from_fn(|axis| axes[axis].value(axes[axis].steps(p[axis]))))
        .collect();
    put_axes(&mut bytes, axes, &rounded);
    let vlr = if zipped { Some(laz_record::new_vlr(format)?) } else { None };
    if let Some(vlr) = &vlr {
        put_word(&mut bytes, 100, &1u32.to_le_bytes());
        bytes.extend(laz_record(vlr)?);
    }
    let points_at = bytes.len() as u32;
    put_word(&mut bytes, 96, &points_at.to_le_bytes());
    // A return number of 1 of 1 is left to the records, which are all 0.
    Ok((bytes, vlr))
}
