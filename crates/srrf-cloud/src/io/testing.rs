//! What the tests of the formats share.

use std::io::{self, Write};

use super::{CloudFormat, FormatError, ReadOptions};
use crate::Rigid;

/// The points of a file.
pub(super) fn points_of(format: &dyn CloudFormat, bytes: &[u8]) -> Result<Vec<[f64; 3]>, FormatError> {
    format.read(bytes, &ReadOptions::default()).map(|contents| contents.points)
}

/// Writes a moved copy of a file.
pub(super) fn moved_copy(
    format: &dyn CloudFormat,
    bytes: &[u8],
    motion: &Rigid,
    out: &mut dyn Write,
) -> io::Result<()> {
    format.rewrite(bytes, &ReadOptions::default(), motion, out)
}
