//! OFF meshes, with the broken headers of ModelNet.

use std::io::{self, Write};
use std::ops::Range;

use super::scan::{ByteLines, Line, Splice, moved, number, turned, words, write_rows};
use super::{CloudFormat, Contents, FormatError, Outgoing, ReadOptions};
use crate::Rigid;

/// A mesh: vertices `[n, 3]`, and triangles as indices of vertices.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OffMesh {
    /// Shape `[n, 3]`.
    pub vertices: Vec<[f64; 3]>,
    /// Three numbers of vertices each.
    pub triangles: Vec<[u32; 3]>,
}

/// Text OFF files; the vertices are the points. A moved copy keeps faces and colours as they are;
/// the normals of NOFF are turned.
pub(super) struct Off;

impl CloudFormat for Off {
    fn name(&self) -> &'static str {
        "off"
    }

    fn extensions(&self) -> &[&'static str] {
        &["off"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        let line = ByteLines::new(bytes).map(|line| content(line.text)).find(|text| !text.is_empty());
        line.is_some_and(|text| magic(text).is_some())
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let OffMesh { vertices, triangles } = parse(bytes, options)?;
        Ok(Contents { points: vertices, faces: triangles, ..Contents::default() })
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "OFF\n{} 0 0", cloud.points.len())?;
        write_rows(cloud.points, "", out)
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        parse(bytes, options)?;
        let mut lines = significant(bytes);
        let header = OffHeader::parse(&mut lines)?;
        let mut splice = Splice::new(bytes, out);
        for line in lines.take(header.vertices) {
            let (places, old) = triple(&line, 0)?;
            splice.numbers(&places, old, moved(motion, old))?;
            if header.normals {
                // A damaged normal stays; the points have been read before.
                if let Ok((places, old)) = triple(&line, 3) {
                    splice.numbers(&places, old, turned(motion, old))?;
                }
            }
        }
        splice.finish()
    }
}

/// A line without its comment.
fn content(text: &[u8]) -> &[u8] {
    text.split(|&b| b == b'#').next().unwrap_or_default().trim_ascii()
}

/// The lines that hold anything, without their comments.
fn significant(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    ByteLines::new(bytes)
        .map(|line| {
            let skipped = line.text.len() - line.text.trim_ascii_start().len();
            let text = content(line.text);
            Line { start: line.start + if text.is_empty() { 0 } else { skipped }, text, ..line }
        })
        .filter(|line| !line.text.is_empty())
}

/// What follows the magic word, and whether it says that there are normals.
fn magic(text: &[u8]) -> Option<(&[u8], bool)> {
    let words: [&[u8]; 5] = [b"OFF", b"COFF", b"NOFF", b"CNOFF", b"NCOFF"];
    words.iter().find_map(|word| Some((text.strip_prefix(*word)?, word.contains(&b'N'))))
}

struct OffHeader {
    vertices: usize,
    faces: usize,
    normals: bool,
}

impl OffHeader {
    /// The counts may follow `OFF` on its own line with or without a space, as in some ModelNet
    /// files.
    fn parse<'a>(lines: &mut impl Iterator<Item = Line<'a>>) -> Result<Self, FormatError> {
        let first = lines.next().ok_or_else(|| FormatError::truncated("a header", "nothing"))?;
        let (rest, normals) = magic(first.text)
            .ok_or_else(|| FormatError::Content("the file does not begin with OFF".into()))?;
        let rest = rest.trim_ascii();
        if rest.starts_with(b"BINARY") {
            return Err(FormatError::Content("binary OFF is not supported; save it as text".into()));
        }
        let line = if rest.is_empty() {
            lines.next().ok_or_else(|| FormatError::truncated("the counts", "nothing"))?
        } else {
            Line { text: rest, ..first }
        };
        let count = |(_, word)| std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        let counts: Vec<usize> = words(line.text).take(3).map_while(count).collect();
        match counts[..] {
            [vertices, faces, ..] => Ok(Self { vertices, faces, normals }),
            _ => Err(line.error("the numbers of vertices and faces are expected")),
        }
    }
}

/// Three numbers of a line, behind `skip` words.
fn triple(line: &Line, skip: usize) -> Result<([Range<usize>; 3], [f64; 3]), FormatError> {
    let mut found = line.words().skip(skip);
    let (mut places, mut point) = ([0..0, 0..0, 0..0], [0.0; 3]);
    for axis in 0..3 {
        let few = || line.error(format!("{} numbers where {} are expected", skip + axis, skip + 3));
        let (at, word) = found.next().ok_or_else(few)?;
        places[axis] = at..at + word.len();
        point[axis] = number(word).map_err(|problem| line.error(problem))?;
    }
    Ok((places, point))
}

/// Reads a text OFF file. Polygons become fans of triangles; colours and normals are passed over.
pub fn parse_mesh(bytes: &[u8]) -> Result<OffMesh, FormatError> {
    parse(bytes, &ReadOptions::default())
}

fn parse(bytes: &[u8], options: &ReadOptions) -> Result<OffMesh, FormatError> {
    let mut lines = significant(bytes);
    let OffHeader { vertices, faces, .. } = OffHeader::parse(&mut lines)?;
    // The counts are not trusted with memory: a line takes 6 bytes or more.
    let mut mesh = OffMesh::default();
    let most = vertices.min(bytes.len() / 6);
    options.check_points(bytes.len(), most)?;
    mesh.vertices.reserve(most);
    for line in lines.by_ref().take(vertices) {
        mesh.vertices.push(triple(&line, 0)?.1);
    }
    if mesh.vertices.len() < vertices {
        let found = mesh.vertices.len().to_string();
        return Err(FormatError::truncated(format!("{vertices} vertices"), found));
    }
    let mut found = 0;
    for line in lines.by_ref().take(faces) {
        let held = bytes.len() + size_of_val(&mesh.vertices[..]);
        fan(&line, vertices, |triangle| {
            options.grow("the faces", held, &mut mesh.triangles)?;
            mesh.triangles.push(triangle);
            Ok(())
        })?;
        found += 1;
    }
    if found < faces {
        return Err(FormatError::truncated(format!("{faces} faces"), found.to_string()));
    }
    match lines.next() {
        Some(line) if faces == 0 => {
            Err(line
                .error(format!("{vertices} vertices announced, but more lines follow; correct the counts")))
        }
        _ => Ok(mesh),
    }
}

/// The triangles of a face.
fn fan(
    line: &Line,
    vertices: usize,
    mut each: impl FnMut([u32; 3]) -> Result<(), FormatError>,
) -> Result<(), FormatError> {
    let index = |(_, word)| std::str::from_utf8(word).ok().and_then(|word| word.parse::<u32>().ok());
    let mut fields = line.words().map(index);
    let Some(Some(count)) = fields.next() else {
        return Err(line.error("the number of corners of a face is expected"));
    };
    let (mut first, mut before) = (0, 0);
    for place in 0..count {
        let Some(Some(corner)) = fields.next() else {
            return Err(line.error("the face has fewer corners than it says"));
        };
        if corner as usize >= vertices {
            return Err(line.error("the face names a vertex that does not exist"));
        }
        match place {
            0 => first = corner,
            1 => {}
            _ => each([first, before, corner])?,
        }
        before = corner;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::testing::moved_copy;

    const BODY: &str = "0 0 0\n1 0 0 255 0 0\n1 1 0\n0 1 0.5\n\n4 0 1 2 3\n3 0 2 3 0.5 0.5 0.5\n";

    #[test]
    fn headers_of_all_kinds() {
        for head in ["OFF\n4 2 0\n", "OFF4 2 0\n", "OFF 4 2 0\r\n", "# made\nCOFF\n# counts\n4 2 5 # end\n"] {
            let mesh = parse_mesh(format!("{head}{BODY}").as_bytes()).unwrap();
            assert_eq!(mesh.vertices[3], [0.0, 1.0, 0.5], "{head:?}");
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 3]]);
        }
    }

    #[test]
    fn damage_is_found() {
        let read = |text: &str| parse_mesh(text.as_bytes()).unwrap_err().to_string();
        assert!(read("PLY\n").contains("begin with OFF"));
        assert!(read("OFF\n3 x\n").contains("line 2"));
        assert!(read("OFF\n3 0 0\n0 0 0\n1 1\n").contains("line 4"));
        assert!(read("OFF\n999999999999 1 0\n0 0 0\n").contains("999999999999 vertices announced, 1 found"));
        assert!(read("OFF\n1 1 0\n0 0 0\n3 0 0 7\n").contains("does not exist"));
        assert!(read("OFF\n1 1 0\n0 0 0\n3 0 0\n").contains("fewer corners"));
        assert!(read("OFF\n1 2 0\n0 0 0\n3 0 0 0\n").contains("2 faces announced, 1 found"));
        assert!(read("").contains("nothing") && read("OFF").contains("nothing"));
        assert!(read("OFF\n1 0 0\n0 0 0\n1 1 1\n").contains("line 4: 1 vertices announced"));
    }

    #[test]
    fn a_moved_copy_keeps_the_rest() {
        let motion = Rigid { translation: [1.0, 0.0, -2.0].into(), ..Rigid::identity() };
        let text = "# a\r\n NOFF # b\r2 1 0\n  0 0.50 0 1 0 0 255 # c\n\n1 1 1 0 0 1 9\n2 0 1 0.1\n";
        let mut copy = Vec::new();
        moved_copy(&Off, text.as_bytes(), &motion, &mut copy).unwrap();
        let expected = text.replace("0 0.50 0 1", "1 0.50 -2 1").replace("1 1 1 0", "2 1 -1 0");
        assert_eq!(String::from_utf8(copy).unwrap(), expected);
    }
}
