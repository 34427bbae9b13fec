//! OBJ, Wavefront's text format.

use std::io::{self, Write};

use super::scan::{ByteLines, Line, Splice, moved, number, quote, turned, write_rows};
use super::{CloudFormat, FormatError};
use crate::Rigid;

/// The words with which lines of an OBJ file begin.
const WORDS: &[&str] = &[
    "v",
    "vn",
    "vt",
    "vp",
    "f",
    "l",
    "p",
    "o",
    "g",
    "s",
    "usemtl",
    "mtllib",
    "fo",
    "cstype",
    "deg",
    "bmat",
    "step",
    "curv",
    "curv2",
    "surf",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "mg",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "maplib",
    "usemap",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
];

/// OBJ files; all vertices (`v`) are the points, whether faces use them or not. (`tobj` drops those
/// which no face uses.) A moved copy keeps faces, colours and all else as they are; normals (`vn`)
/// are turned.
pub(super) struct Obj;

impl CloudFormat for Obj {
    fn name(&self) -> &'static str {
        "obj"
    }

    fn extensions(&self) -> &[&'static str] {
        &["obj"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        let first =
            ByteLines::new(bytes).find_map(|line| line.words().next().filter(|(_, word)| word[0] != b'#'));
        first.is_some_and(|(_, word)| WORDS.iter().any(|known| known.as_bytes() == word))
    }

    fn read(&self, bytes: &[u8]) -> Result<Vec<[f64; 3]>, FormatError> {
        let mut points = Vec::new();
        let mut last_face: Option<(usize, u64)> = None;
        for line in ByteLines::new(bytes) {
            let mut words = line.words();
            let Some((_, word)) = words.next() else { continue };
            match word {
                b"v" => points.push(triple(&line)?.1),
                b"f" => {
                    // Corners are `vertex/texture/normal`; negative ones count from the last vertex.
                    for (_, corner) in words.take_while(|(_, word)| *word != b"\\") {
                        let index = corner.split(|&b| b == b'/').next().unwrap_or_default();
                        let index = std::str::from_utf8(index).ok().and_then(|i| i.parse::<i64>().ok());
                        let index = index.filter(|&index| index != 0 && index >= -(points.len() as i64));
                        let index =
                            index.ok_or_else(|| line.error(format!("{} is no corner", quote(corner))))?;
                        let largest = last_face.map_or(0, |(_, index)| index);
                        if index.unsigned_abs() > largest && index > 0 {
                            last_face = Some((line.number, index.unsigned_abs()));
                        }
                    }
                }
                _ if word[0] == b'#' || WORDS.iter().any(|known| known.as_bytes() == word) => {}
                // The rest of a line that was broken with a backslash.
                _ if line.start >= 2 && bytes[..line.start].trim_ascii_end().ends_with(b"\\") => {}
                _ => return Err(line.error(format!("{} begins no line of an OBJ file", quote(word)))),
            }
        }
        match last_face {
            Some((line, index)) if index > points.len() as u64 => Err(FormatError::line(
                line,
                format!(
                    "a face names vertex {index}, but there are {}; is the file cut short?",
                    points.len()
                ),
            )),
            _ => Ok(points),
        }
    }

    fn write(&self, points: &[[f64; 3]], out: &mut dyn Write) -> io::Result<()> {
        write_rows(points, "v ", out)
    }

    fn rewrite(&self, bytes: &[u8], motion: &Rigid, out: &mut dyn Write) -> io::Result<()> {
        self.read(bytes)?;
        let mut splice = Splice::new(bytes, out);
        for line in ByteLines::new(bytes) {
            let turn = match line.words().next() {
                Some((_, b"v")) => moved,
                Some((_, b"vn")) => turned,
                _ => continue,
            };
            // A damaged normal stays; the points have been read before.
            let Ok((places, old)) = triple(&line) else { continue };
            splice.numbers(&places, old, turn(motion, old))?;
        }
        splice.finish()
    }
}

/// The three numbers behind the first word of a line.
fn triple(line: &Line) -> Result<([std::ops::Range<usize>; 3], [f64; 3]), FormatError> {
    let mut words = line.words().skip(1);
    let (mut places, mut point) = ([0..0, 0..0, 0..0], [0.0; 3]);
    for axis in 0..3 {
        let (at, word) =
            words.next().ok_or_else(|| line.error(format!("{axis} numbers where 3 are expected")))?;
        places[axis] = at..at + word.len();
        point[axis] = number(word).map_err(|problem| line.error(problem))?;
    }
    Ok((places, point))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# a\r\nmtllib a.mtl\r\nv 1 2.0 3 0.5 0.5 0.5\nvn 0 0 1\nv  -1 0 1e2\nv 0 0 0\n\
                        f 1//1 2//1 \\\n3//1\nf -1 -2 -3\n";

    #[test]
    fn vertices_are_points() {
        assert_eq!(Obj.read(TEXT.as_bytes()).unwrap(), [[1.0, 2.0, 3.0], [-1.0, 0.0, 100.0], [0.0; 3]]);
        let motion = Rigid {
            rotation: nalgebra::Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0),
            ..Rigid::identity()
        };
        let mut copy = Vec::new();
        Obj.rewrite(TEXT.as_bytes(), &motion, &mut copy).unwrap();
        let expected = TEXT.replace("v 1 2.0 3", "v 1 -3 2").replace("vn 0 0 1", "vn 0 -1 0");
        assert_eq!(String::from_utf8(copy).unwrap(), expected.replace("-1 0 1e2", "-1 -100 0"));
    }

    #[test]
    fn damage_is_found() {
        let error = |text: &str| Obj.read(text.as_bytes()).unwrap_err().to_string();
        assert!(error("v 1 2\n").contains("line 1: 2 numbers"));
        assert!(error("v 1,5 2 3\n").contains("write decimals with a point"));
        assert!(error("v 1 2 3\nf 1 2 3\n").contains("line 2: a face names vertex 3"));
        assert!(error("v 1 2 3\nf 1 a\n").contains("\"a\" is no corner"));
        assert!(error("ply\n").contains("line 1"));
    }
}
