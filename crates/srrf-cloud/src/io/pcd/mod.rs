//! PCD, the format of the Point Cloud Library: text, binary, and binary compressed with LZF.

mod attributes;
mod body;
mod header;
mod lzf;
mod rewrite;

use std::io::{self, Write};

use super::{Attribute, CloudFormat, Contents, FormatError, Outgoing, ReadOptions};
use crate::Rigid;

/// PCD files; the points are the fields `x`, `y` and `z`, wherever and of whatever type they are.
/// Written as binary, in the precision that is asked for, colours packed in one number as PCL has them. A moved copy keeps all other fields, the grid and the
/// viewpoint as they are; normals (`normal_x`, `normal_y`, `normal_z`) are turned.
pub(super) struct Pcd;

impl CloudFormat for Pcd {
    fn name(&self) -> &'static str {
        "pcd"
    }

    fn extensions(&self) -> &[&'static str] {
        &["pcd"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        [&b"# .PCD"[..], b"VERSION ", b"FIELDS ", b"COLUMNS "].iter().any(|word| bytes.starts_with(word))
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        body::read(bytes, options)
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        attributes::read(bytes, options)
    }

    fn keeps(&self, attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
        attributes::keeps(attribute, cloud)
    }

    fn has_both_precisions(&self) -> bool {
        true
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        attributes::write(cloud, out)
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        rewrite::rewrite(bytes, options, motion, out)
    }
}

#[cfg(test)]
mod tests;
