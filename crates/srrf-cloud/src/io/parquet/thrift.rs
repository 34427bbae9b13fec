//! As much of Thrift's compact protocol as it takes to look at the counts of a Parquet file before the `parquet`
//! crate takes memory for them.

use super::super::FormatError;

/// Structures inside one another; real schemas have fewer.
pub(super) const DEPTH: usize = 32;

/// Types of fields.
pub(super) const TRUE: u8 = 1;
pub(super) const FALSE: u8 = 2;
const BYTE: u8 = 3;
const I16: u8 = 4;
pub(super) const I32: u8 = 5;
const I64: u8 = 6;
const DOUBLE: u8 = 7;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const SET: u8 = 10;
const MAP: u8 = 11;
pub(super) const STRUCT: u8 = 12;
const UUID: u8 = 13;

/// Reads from the front to the back; `None` at the end or where nothing makes sense.
pub(super) struct Thrift<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
}

impl Thrift<'_> {
    fn byte(&mut self) -> Option<u8> {
        let byte = *self.bytes.get(self.at)?;
        self.at += 1;
        Some(byte)
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0u64;
        for shift in (0..70).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f).checked_shl(shift).unwrap_or(0);
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }

    pub fn int(&mut self) -> Option<i64> {
        let value = self.varint()?;
        Some((value >> 1) as i64 ^ -((value & 1) as i64))
    }

    /// The number and the type of the next field; `None` inside at the end of the structure.
    pub fn field(&mut self, last: &mut i64) -> Option<Option<(i64, u8)>> {
        let byte = self.byte()?;
        if byte == 0 {
            return Some(None);
        }
        let step = i64::from(byte >> 4);
        *last = if step == 0 { self.int()? } else { last.checked_add(step)? };
        Some(Some((*last, byte & 15)))
    }

    fn list(&mut self) -> Option<(u64, u8)> {
        let byte = self.byte()?;
        let size = if byte >> 4 == 15 { self.varint()? } else { u64::from(byte >> 4) };
        Some((size, byte & 15))
    }

    pub fn skip(&mut self, kind: u8, depth: usize) -> Option<()> {
        let depth = depth.checked_sub(1)?;
        match kind {
            TRUE | FALSE => {}
            BYTE => self.at += 1,
            I16 | I32 | I64 => drop(self.varint()?),
            DOUBLE => self.at += 8,
            UUID => self.at += 16,
            BINARY => {
                let length = usize::try_from(self.varint()?).ok()?;
                self.at = self.at.checked_add(length)?;
            }
            LIST | SET => {
                let (size, kind) = self.list()?;
                // Truth values take a byte each in a list.
                let kind = if matches!(kind, TRUE | FALSE) { BYTE } else { kind };
                for _ in 0..size {
                    self.skip(kind, depth)?;
                }
            }
            MAP => {
                let size = self.varint()?;
                let kinds = if size > 0 { self.byte()? } else { 0 };
                for _ in 0..size {
                    self.skip(kinds >> 4, depth)?;
                    self.skip(kinds & 15, depth)?;
                }
            }
            STRUCT => {
                let mut last = 0;
                while let Some((_, kind)) = self.field(&mut last)? {
                    self.skip(kind, depth)?;
                }
            }
            _ => return None,
        }
        (self.at <= self.bytes.len()).then_some(())
    }
}

pub(super) fn damaged(what: impl Into<String>) -> FormatError {
    FormatError::Content(format!("the Parquet file is damaged or cut short: {}", what.into()))
}

/// Checks that the schema in the footer is a tree of as many elements as it says, and not too deep.
pub(super) fn check_footer(bytes: &[u8]) -> Result<(), FormatError> {
    let end = bytes.len().saturating_sub(8);
    if bytes.len() < 12 || !bytes.starts_with(b"PAR1") || !bytes.ends_with(b"PAR1") {
        if bytes.ends_with(b"PARE") {
            return Err(FormatError::Content(
                "the Parquet file is encrypted; save it without encryption".into(),
            ));
        }
        return Err(damaged("it does not end with PAR1"));
    }
    let length =
        bytes.get(end..).and_then(|rest| rest.first_chunk()).map_or(0, |&word| u32::from_le_bytes(word));
    let begin =
        end.checked_sub(length as usize).ok_or_else(|| damaged(format!("a footer of {length} bytes")))?;
    let mut thrift = Thrift { bytes: &bytes[begin..end], at: 0 };
    let children = schema(&mut thrift).ok_or_else(|| damaged("the footer makes no sense"))?;
    let mut open: Vec<i64> = Vec::new();
    for (index, &count) in children.iter().enumerate() {
        if count < 0 || count > (children.len() - index) as i64 || open.len() > DEPTH {
            return Err(damaged("a schema that is no tree, or too deep"));
        }
        while open.last().is_some_and(|&left| left == 0) {
            open.pop();
        }
        if let Some(left) = open.last_mut() {
            *left -= 1;
        }
        if count > 0 {
            open.push(count);
        }
    }
    Ok(())
}

/// How many children each element of the schema has.
fn schema(thrift: &mut Thrift) -> Option<Vec<i64>> {
    let mut children = Vec::new();
    let mut last = 0;
    while let Some((id, kind)) = thrift.field(&mut last)? {
        if (id, kind) != (2, LIST) {
            thrift.skip(kind, DEPTH)?;
            continue;
        }
        let (size, kind) = thrift.list()?;
        if kind != STRUCT {
            return None;
        }
        for _ in 0..size {
            let (mut last, mut count) = (0, 0);
            while let Some((id, kind)) = thrift.field(&mut last)? {
                if (id, kind) == (5, I32) {
                    count = thrift.int()?;
                } else {
                    thrift.skip(kind, DEPTH)?;
                }
            }
            children.push(count);
        }
    }
    Some(children)
}
