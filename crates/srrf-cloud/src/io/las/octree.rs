//! The octree of COPC, which says of each cube of space where its points are in the file: it holds for no other places.

use super::header::{LasHeader, put_word};

/// The name of its records: the first says where the octree begins, and the octree lies behind the points.
const OWNER: [u8; 16] = *b"copc\0\0\0\0\0\0\0\0\0\0\0\0";
/// The name that they get in a copy in which it does not hold.
const NO_OWNER: [u8; 16] = *b"copc before move";
/// Bytes before the content of a record behind the points.
const EXTENDED: u64 = 60;

/// Whether a file has an octree.
pub(super) fn is_there(bytes: &[u8]) -> bool {
    LasHeader::parse(bytes).is_ok_and(|header| !owners(&header, bytes).is_empty())
}

/// Renames the records of the octree, so that no reader takes it for one.
pub(super) fn take_away(bytes: &mut [u8]) {
    let Ok(header) = LasHeader::parse(bytes) else { return };
    for place in owners(&header, bytes) {
        put_word(bytes, place, &NO_OWNER);
    }
}

/// Where the names of its records are.
fn owners(header: &LasHeader, bytes: &[u8]) -> Vec<usize> {
    let mut places: Vec<usize> =
        header.variable_records(bytes).into_iter().map(|record| record.start + 2).collect();
    let word =
        |at: usize| bytes.get(at..).and_then(|rest| rest.first_chunk().copied()).map(u64::from_le_bytes);
    if let Some(tail) = header.extended_records(bytes) {
        let count =
            bytes.get(243..).and_then(|rest| rest.first_chunk().copied()).map_or(0, u32::from_le_bytes);
        let mut at = bytes.len() - tail.len();
        for _ in 0..count {
            places.push(at + 2);
            let next = word(at + 20)
                .and_then(|length| length.checked_add(EXTENDED))
                .and_then(|length| at.checked_add(usize::try_from(length).ok()?));
            match next.filter(|next| *next < bytes.len()) {
                Some(next) => at = next,
                None => break,
            }
        }
    }
    places.retain(|&at| bytes.get(at..).is_some_and(|rest| rest.starts_with(&OWNER)));
    places
}
