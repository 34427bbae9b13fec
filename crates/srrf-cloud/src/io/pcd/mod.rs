//! PCD, the format of the Point Cloud Library: text, binary, and binary compressed with LZF.

mod body;
mod header;
mod lzf;
mod rewrite;

use std::io::{self, Write};

use super::{CloudFormat, Contents, FormatError, ReadOptions};
use crate::Rigid;

/// PCD files; the points are the fields `x`, `y` and `z`, wherever and of whatever type they are.
/// Written as binary in double precision. A moved copy keeps all other fields, the grid and the
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
        bytes.starts_with(b"# .PCD") || bytes.starts_with(b"VERSION ") || bytes.starts_with(b"FIELDS ")
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        body::read(bytes, options)
    }

    fn write(&self, points: &[[f64; 3]], out: &mut dyn Write) -> io::Result<()> {
        let n = points.len();
        write!(
            out,
            "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\n\
             COUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA binary\n"
        )?;
        points.iter().flatten().try_for_each(|c| out.write_all(&c.to_le_bytes()))
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
