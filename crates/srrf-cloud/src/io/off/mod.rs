//! OFF meshes, with the broken headers of ModelNet.

mod attributes;
mod header;
mod lines;
mod rows;

use std::io::{self, Write};
use std::ops::Range;

use self::header::OffHeader;
use self::lines::Lines;
use self::rows::Rows;
use super::scan::{Line, Splice, moved, number, quote, turned};
use super::{Attribute, CloudFormat, Contents, FormatError, Outgoing, ReadOptions};
use crate::Rigid;

/// A mesh: vertices `[n, 3]`, and triangles as indices of vertices.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OffMesh {
    /// Shape `[n, 3]`.
    pub vertices: Vec<[f64; 3]>,
    /// Three numbers of vertices each.
    pub triangles: Vec<[u32; 3]>,
}

/// Text OFF files of all kinds that have points of three dimensions, a line a row or all in one; the vertices are the
/// points. A moved copy keeps faces and colours as they are; the normals of NOFF are turned.
pub(super) struct Off;

impl CloudFormat for Off {
    fn name(&self) -> &'static str {
        "off"
    }

    fn extensions(&self) -> &[&'static str] {
        &["off"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        Lines::new(bytes).next().is_some_and(|line| header::is_magic(line.text))
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let (OffMesh { vertices, triangles }, ..) = parse(bytes, options)?;
        Ok(Contents { points: vertices, faces: triangles, ..Contents::default() })
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        attributes::read(bytes, options)
    }

    fn keeps(&self, attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
        attributes::keeps(attribute, cloud)
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
        let (_, header, rows) = parse(bytes, options)?;
        let mut lines = Lines::new(bytes);
        OffHeader::parse(&mut lines)?;
        let mut splice = Splice::new(bytes, out);
        let mut row = Vec::new();
        for _ in 0..header.vertices {
            let Some(line) = rows.vertex(&mut lines, &mut row) else { break };
            let (places, old) = triple(&line, &row, 0)?;
            let weight = weight(&line, &row, header)?;
            let new = moved(motion, old.map(|c| c / weight)).map(|c| c * weight);
            splice.numbers(&places, old, new)?;
            if header.normals {
                // A damaged normal stays; the points have been read before.
                if let Ok((places, old)) = triple(&line, &row, header.place()) {
                    splice.numbers(&places, old, turned(motion, old))?;
                }
            }
        }
        splice.finish()
    }
}

/// Three numbers of a row, behind `skip` words.
fn triple(
    line: &Line<'_>,
    row: &[(usize, &[u8])],
    skip: usize,
) -> Result<([Range<usize>; 3], [f64; 3]), FormatError> {
    let (mut places, mut point) = ([0..0, 0..0, 0..0], [0.0; 3]);
    for axis in 0..3 {
        let few = || line.error(format!("{} numbers where {} are expected", skip + axis, skip + 3));
        let &(at, word) = row.get(skip + axis).ok_or_else(few)?;
        places[axis] = at..at + word.len();
        point[axis] = number(word).map_err(|problem| line.error(problem))?;
    }
    Ok((places, point))
}

/// What the coordinates are to be divided by.
fn weight(line: &Line<'_>, row: &[(usize, &[u8])], header: OffHeader) -> Result<f64, FormatError> {
    if !header.homogeneous {
        return Ok(1.0);
    }
    let (_, word) = row.get(3).ok_or_else(|| line.error("3 numbers where 4OFF has 4"))?;
    match number(word).map_err(|problem| line.error(problem))? {
        0.0 => Err(line.error("the fourth coordinate of 4OFF is 0: a point at infinity")),
        weight => Ok(weight),
    }
}

/// Reads a text OFF file. Polygons become fans of triangles; colours and normals are passed over.
pub fn parse_mesh(bytes: &[u8]) -> Result<OffMesh, FormatError> {
    parse(bytes, &ReadOptions::default()).map(|(mesh, ..)| mesh)
}

/// The mesh, its header, and how its rows are apart.
fn parse(bytes: &[u8], options: &ReadOptions) -> Result<(OffMesh, OffHeader, Rows), FormatError> {
    let mut lines = Lines::new(bytes);
    let header = OffHeader::parse(&mut lines)?;
    let mut first = None;
    let mut whole = Vec::new();
    let mut uneven = false;
    for rows in Rows::candidates(header) {
        match (body(bytes, lines.clone(), header, rows, options), rows) {
            (Ok(mesh), Rows::Lines) => return Ok((mesh, header, rows)),
            (Ok(mesh), _) => whole.push((mesh, header, rows)),
            (Err(error @ FormatError::Memory { .. }), _) => return Err(error),
            (Err(error), Rows::Lines) => first = Some(error),
            (Err(error), _) => uneven |= !matches!(error, FormatError::Truncated { .. }),
        }
    }
    let first = first.unwrap_or_else(|| FormatError::truncated("rows", "none"));
    match (whole.pop(), whole.is_empty(), first) {
        (Some(found), true, _) => Ok(found),
        (Some(_), false, _) => Err(FormatError::Content(
            "the rows are not a line each, and colours may have three or four numbers; put each vertex and each face on \
             a line of its own"
                .into(),
        )),
        (None, _, FormatError::Truncated { .. }) if uneven => Err(FormatError::Content(
            "the rows are not a line each, and word by word they do not come out even; put each vertex and each face on \
             a line of its own"
                .into(),
        )),
        (None, _, first) => Err(first),
    }
}

/// What follows the header.
fn body(
    bytes: &[u8],
    mut lines: Lines<'_>,
    header: OffHeader,
    rows: Rows,
    options: &ReadOptions,
) -> Result<OffMesh, FormatError> {
    let OffHeader { vertices, faces, .. } = header;
    let mut mesh = OffMesh::default();
    // The counts are not trusted with memory: a vertex takes 6 bytes or more.
    let most = vertices.min(bytes.len() / 6);
    options.check_points(bytes.len(), most)?;
    mesh.vertices.reserve(most);
    let mut row = Vec::new();
    while mesh.vertices.len() < vertices {
        let Some(line) = rows.vertex(&mut lines, &mut row) else {
            let found = mesh.vertices.len().to_string();
            return Err(FormatError::truncated(format!("{vertices} vertices"), found));
        };
        let weight = weight(&line, &row, header)?;
        mesh.vertices.push(triple(&line, &row, 0)?.1.map(|c| c / weight));
    }
    let held = bytes.len() + size_of_val(&mesh.vertices[..]);
    for found in 0..faces {
        let (mut corners, mut first, mut before) = (0usize, 0, 0);
        let there = rows.face(&mut lines, |line, word| {
            let corner = corner(line, word, vertices)?;
            match corners {
                0 => first = corner,
                1 => {}
                _ => {
                    options.grow("the faces", held, &mut mesh.triangles)?;
                    mesh.triangles.push([first, before, corner]);
                }
            }
            corners += 1;
            before = corner;
            Ok(())
        })?;
        if !there {
            return Err(FormatError::truncated(format!("{faces} faces"), found.to_string()));
        }
    }
    match lines.next() {
        Some(line) if faces == 0 || rows != Rows::Lines => {
            let what = if faces == 0 { format!("{vertices} vertices") } else { format!("{faces} faces") };
            Err(line.error(format!("{what} announced, but more lines follow; correct the counts")))
        }
        _ => Ok(mesh),
    }
}

/// The vertex of a corner.
fn corner(line: &Line<'_>, word: &[u8], vertices: usize) -> Result<u32, FormatError> {
    let index = std::str::from_utf8(word).ok().and_then(|word| word.parse::<u32>().ok());
    let index = index.ok_or_else(|| line.error(format!("{} is no corner of a face", quote(word))))?;
    if index as usize >= vertices {
        return Err(line.error("the face names a vertex that does not exist"));
    }
    Ok(index)
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

    fn cube_of(head: &str, separator: &str) -> String {
        let rows = ["0 0 0", "1 0 0", "1 1 0", "0 1 0.5", "4 0 1 2 3", "3 0 2 3"];
        format!("{head}{separator}{}", rows.join(separator))
    }

    #[test]
    fn rows_need_no_lines() {
        let expected = parse_mesh(cube_of("OFF\n4 2 0", "\n").as_bytes()).unwrap();
        assert_eq!((expected.vertices[3], expected.triangles.len()), ([0.0, 1.0, 0.5], 3));
        for text in [
            cube_of("OFF 4 2 0", " "),
            cube_of("off 4 2 5", " "),
            cube_of("off\n4 2 0", "  "),
            cube_of("OFF\n4\n2\n0", "\n"),
            cube_of("OFF\n4 2", "\n"),
            cube_of("4 2 0", "\n"),
            cube_of("4 2 0", "\n").replacen(" 0\n0", " 0\r\n0", 1),
            "OFF 4 2 0 0 0 0 1 0 0\n1 1 0 0 1 0.5 4\n0 1 2 3 3 0\n2 3".into(),
            "OFF\n4 2 0\n0\n0\n0\n1\n0\n0\n1\n1\n0\n0\n1\n0.5\n4 0 1 2 3\n3 0 2 3\n".into(),
        ] {
            assert_eq!(parse_mesh(text.as_bytes()), Ok(expected.clone()), "{text:?}");
        }
        let points = "OFF 2 0 0 1 2 3 4 5 6";
        assert_eq!(parse_mesh(points.as_bytes()).unwrap().vertices, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        let read = |text: &str| parse_mesh(text.as_bytes()).unwrap_err().to_string();
        assert!(read("OFF 2 0 0 1 2 3 4 5 6 7").contains("do not come out even"));
        assert!(read("OFF 3 1 0 0 0 0 1 0 0 0 1 0 3 0 1 2 255 0 0").contains("a line of its own"));
        assert!(read("OFF 3 1 0 0 0 0 1 0 0").contains("3 vertices announced, 1 found"));
    }

    #[test]
    fn letters_before_the_word() {
        let read = |text: &str| parse_mesh(text.as_bytes()).map(|mesh| mesh.vertices);
        let expected = Ok(vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        for text in [
            "STOFF\n2 0 0\n1 2 3 0.1 0.2\n4 5 6 0.3 0.4\n",
            "STOFF 2 0 0 1 2 3 0.1 0.2 4 5 6 0.3 0.4",
            "coff\n2 0 0\n1 2 3 255 0 0\n4 5 6 0 0 255\n",
            "COFF 2 0 0 1 2 3 255 0 0 4 5 6 0 0 255",
            "COFF 2 0 0 1 2 3 255 0 0 255 4 5 6 0 0 255 255",
            "NOFF 2 0 0 1 2 3 0 0 1 4 5 6 0 1 0",
            "noff\n2 0 0\n1 2 3 0 0 1\n4 5 6 0 1 0\n",
            "nOFF\n3\n2 0 0\n1 2 3\n4 5 6\n",
            "nOFF 3 2 0 0 1 2 3 4 5 6",
            "noff\n3\n2 0 0\n1 2 3\n4 5 6\n",
            "4OFF\n2 0 0\n1 2 3 1\n8 10 12 2\n",
            "STCN4OFF 1 0 0 2 4 6 2 0 0 1 1 0 0 1 0.1 0.2",
            "STCNOFF 2 0 0 1 2 3 0 0 1 1 0 0 1 0.1 0.2 4 5 6 0 0 1 1 0 0 1 0.3 0.4",
        ] {
            let found = read(text).map(|mut points| {
                if points.len() == 1 {
                    points.push([4.0, 5.0, 6.0]);
                }
                points
            });
            assert_eq!(found, expected, "{text:?}");
        }
        for (text, fact) in [
            ("nOFF\n4\n1 0 0\n1 2 3 4\n", "points of 4 dimensions"),
            ("4OFF\n1 0 0\n1 2 3 0\n", "point at infinity"),
            ("4OFF\n1 0 0\n1 2 3\n", "4OFF has 4"),
            ("OFF BINARY\n\0\0", "binary OFF"),
            ("off binary\n\0\0", "binary OFF"),
            ("XOFF\n1 0 0\n1 2 3\n", "begin with OFF"),
            ("OFFICE\n1 0 0\n1 2 3\n", "follows OFF"),
            ("1 2 3\n4 5 6\n", "2 faces announced"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(fact), "{text:?}: {error}");
        }
        for text in ["# by hand\n off\n", "OFF4 2 0\n", "OFF BINARY\n", "STCN4nOFF 3\n"] {
            assert!(Off.recognises(text.as_bytes()), "{text}");
        }
        for text in ["1 2 3\n4 5 6\n", "offset x y z\n1 2 3 4\n", "coffee\n", "off x y\n"] {
            assert!(!Off.recognises(text.as_bytes()), "{text}");
        }
    }

    #[test]
    fn colours_and_normals_are_attributes() {
        use crate::io::AttributeValues as V;
        let text = "CNOFF\n2 0 0\n1 2 3 0 0 1 255 0 7 255\n4 5 6 0 0.5 0 9 8 255 255\n";
        let found = Off.attributes(text.as_bytes(), &ReadOptions::default()).unwrap();
        let expected = [
            ("nx", V::U8(vec![0, 0])),
            ("ny", V::F32(vec![0.0, 0.5])),
            ("nz", V::U8(vec![1, 0])),
            ("red", V::U8(vec![255, 9])),
            ("green", V::U8(vec![0, 8])),
            ("blue", V::U8(vec![7, 255])),
            ("alpha", V::U8(vec![255, 255])),
        ];
        let expected = expected.map(|(name, values)| Attribute { name: name.into(), values });
        assert_eq!(found, expected);
        let mut out = Vec::new();
        let points = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
        let cloud = Outgoing { attributes: &found, ..Outgoing::of_points(&points) };
        Off.write_cloud(&cloud, &mut out).unwrap();
        assert_eq!(String::from_utf8(out).unwrap(), text);
        let plain = "OFF\n1 0 0\n1 2 3 255 0 0\n";
        assert_eq!(Off.attributes(plain.as_bytes(), &ReadOptions::default()), Ok(vec![]));
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
        let copy = |text: &str| {
            let mut copy = Vec::new();
            moved_copy(&Off, text.as_bytes(), &motion, &mut copy).unwrap();
            String::from_utf8(copy).unwrap()
        };
        assert_eq!(copy("OFF 2 0 0 1 2 3 4 5 6"), "OFF 2 0 0 2 2 1 5 5 4");
        assert_eq!(copy("4OFF\n1 0 0\n2 4 6 2\n"), "4OFF\n1 0 0\n4 4 2 2\n", "(1, 2, 3) goes to (2, 2, 1)");
    }
}
