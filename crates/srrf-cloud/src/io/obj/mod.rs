//! OBJ, Wavefront's text format.

mod colours;

use std::io::{self, Write};

use super::outgoing::COLOURS;
use super::scan::{ByteLines, Line, Splice, moved, number, quote, turned};
use super::{Attribute, CloudFormat, Contents, FormatError, Note, Outgoing, ReadOptions};
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
            statements(bytes).find_map(|line| words(&line).next().filter(|(_, word)| word[0] != b'#'));
        first.is_some_and(|(_, word)| WORDS.iter().any(|known| known.as_bytes() == word))
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let mut points: Vec<[f64; 3]> = Vec::new();
        let mut faces: Vec<[u32; 3]> = Vec::new();
        let mut largest: Option<(usize, u64)> = None;
        let mut unknown: Option<(Line, usize)> = None;
        for line in statements(bytes) {
            let mut words = words(&line);
            let Some((_, word)) = words.next() else { continue };
            let held = bytes.len();
            match word {
                b"v" => {
                    options.grow("the points", held + size_of_val(&faces[..]), &mut points)?;
                    points.push(triple(&line)?.1);
                }
                b"f" | b"fo" => {
                    let (mut first, mut before) = (0, 0);
                    for (place, (_, corner)) in words.enumerate() {
                        let index = vertex(corner, points.len());
                        let index =
                            index.ok_or_else(|| line.error(format!("{} is no corner", quote(corner))))?;
                        if largest.is_none_or(|(_, largest)| index > largest) {
                            largest = Some((line.number, index));
                        }
                        let corner = u32::try_from(index - 1).unwrap_or(u32::MAX);
                        match place {
                            0 => first = corner,
                            1 => {}
                            _ => {
                                options.grow("the faces", held + size_of_val(&points[..]), &mut faces)?;
                                faces.push([first, before, corner]);
                            }
                        }
                        before = corner;
                    }
                }
                _ if word[0] == b'#' || WORDS.iter().any(|known| known.as_bytes() == word) => {}
                _ if word[0].is_ascii_alphabetic() => {
                    unknown = Some(unknown.map_or((line, 1), |(first, count)| (first, count + 1)));
                }
                _ => return Err(begins_nothing(&line, word)),
            }
        }
        if let Some((line, index)) = largest.filter(|(_, index)| *index > points.len() as u64) {
            let problem = format!(
                "a face names vertex {index}, but there are {}; is the file cut short?",
                points.len()
            );
            return Err(FormatError::line(line, problem));
        }
        let mut notes = Vec::new();
        if let Some((line, count)) = unknown {
            let word = words(&line).next().map_or(&b""[..], |(_, word)| word);
            if points.is_empty() {
                return Err(begins_nothing(&line, word));
            }
            let what = format!(
                "{count} line{} that OBJ does not know, the first is line {}: {}",
                if count == 1 { "" } else { "s" },
                line.number,
                quote(word)
            );
            notes.push(Note::Ignored { what });
        }
        Ok(Contents { points, faces, notes, ..Contents::default() })
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        colours::read(bytes, options)
    }

    fn keeps(&self, attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
        COLOURS.contains(&attribute.name.as_str()) && cloud.triple(COLOURS).is_some()
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        colours::write(cloud, out)
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        self.read(bytes, options)?;
        let mut splice = Splice::new(bytes, out);
        for line in statements(bytes) {
            let turn = match words(&line).next() {
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

fn begins_nothing(line: &Line, word: &[u8]) -> FormatError {
    line.error(format!("{} begins no line of an OBJ file", quote(word)))
}

/// The lines, each with those that a backslash at its end joins to it, without a byte order mark.
fn statements(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    let mut lines = ByteLines::new(bytes);
    std::iter::from_fn(move || {
        let mut line = lines.next()?;
        if line.start == 0 && line.text.starts_with("\u{feff}".as_bytes()) {
            line = Line { start: 3, text: &line.text[3..], ..line };
        }
        while line.text.trim_ascii_end().ends_with(b"\\") {
            let Some(more) = lines.next() else { break };
            line.text = &bytes[line.start..more.start + more.text.len()];
        }
        Some(line)
    })
}

/// The words of a statement with their offsets in the file.
fn words<'a>(line: &Line<'a>) -> impl Iterator<Item = (usize, &'a [u8])> + use<'a> {
    let bare = |(at, word): (usize, &'a [u8])| (at, word.strip_suffix(b"\\").unwrap_or(word));
    line.words().map(bare).filter(|(_, word)| !word.is_empty())
}

/// The number, from 1, of the vertex of a corner `vertex/texture/normal`; negative ones count back from the last of
/// the `known` vertices.
fn vertex(corner: &[u8], known: usize) -> Option<u64> {
    let index = corner.split(|&b| b == b'/').next().unwrap_or_default();
    let index: i64 = std::str::from_utf8(index).ok()?.parse().ok()?;
    match index {
        1.. => Some(index as u64),
        _ if index < 0 => (known as u64 + 1).checked_sub(index.unsigned_abs()).filter(|&index| index > 0),
        _ => None,
    }
}

/// The three numbers behind the first word of a line.
fn triple(line: &Line) -> Result<([std::ops::Range<usize>; 3], [f64; 3]), FormatError> {
    let mut words = words(line).skip(1);
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
    use crate::io::testing::{moved_copy, points_of};

    const TEXT: &str = "# a\r\nmtllib a.mtl\r\nv 1 2.0 3 0.5 0.5 0.5\nvn 0 0 1\nv  -1 0 1e2\nv 0 0 0\n\
                        f 1//1 2//1 \\\n3//1\nf -1 -2 -3\n";

    #[test]
    fn vertices_are_points() {
        assert_eq!(
            points_of(&Obj, TEXT.as_bytes()).unwrap(),
            [[1.0, 2.0, 3.0], [-1.0, 0.0, 100.0], [0.0; 3]]
        );
        let motion = Rigid {
            rotation: nalgebra::Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0),
            ..Rigid::identity()
        };
        let mut copy = Vec::new();
        moved_copy(&Obj, TEXT.as_bytes(), &motion, &mut copy).unwrap();
        let expected = TEXT.replace("v 1 2.0 3", "v 1 -3 2").replace("vn 0 0 1", "vn 0 -1 0");
        assert_eq!(String::from_utf8(copy).unwrap(), expected.replace("-1 0 1e2", "-1 -100 0"));
    }

    #[test]
    fn colours_of_vertices() {
        use crate::io::AttributeValues as V;
        let of = |text: &str| Obj.attributes(text.as_bytes(), &ReadOptions::default()).unwrap();
        let named = |values: [V; 3]| -> Vec<Attribute> {
            let names = COLOURS.iter().zip(values);
            names.map(|(name, values)| Attribute { name: (*name).into(), values }).collect()
        };
        let eight = named([V::U8(vec![255, 0]), V::U8(vec![128, 0]), V::U8(vec![0, 51])]);
        assert_eq!(of("v 1 2 3 1 0.501961 0\nv 4 5 6 0 0 0.2\nf 1 2 1\n"), eight);
        assert_eq!(of("v 1 2 3 255 128 0\nv 4 5 6 0 0 51\n"), eight);
        assert_eq!(of("v 1 2 3 0.3 0.5 0.7\n"), named([0.3, 0.5, 0.7].map(|v| V::F32(vec![v]))));
        // A weight is no colour, and neither is one that only some have.
        assert!(of("v 1 2 3 1\n").is_empty() && of("v 1 2 3 1 0 0\nv 1 2 3\n").is_empty());
        let points = [[1.0, 2.0, 3.0], [4.0, 5.5, 6.0]];
        let mut out = Vec::new();
        let cloud = Outgoing { attributes: &eight, ..Outgoing::of_points(&points) };
        Obj.write_cloud(&cloud, &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        assert_eq!(text, "v 1 2 3 1 0.5019608 0\nv 4 5.5 6 0 0 0.2\n");
        assert_eq!(of(&text), eight);
    }

    #[test]
    fn damage_is_found() {
        let error = |text: &str| points_of(&Obj, text.as_bytes()).unwrap_err().to_string();
        assert!(error("v 1 2\n").contains("line 1: 2 numbers"));
        assert!(error("v 1,5 2 3\n").contains("write decimals with a point"));
        assert!(error("v 1 2 3\nf 1 2 3\n").contains("line 2: a face names vertex 3"));
        assert!(error("v 1 2 3\nf 1 a\n").contains("\"a\" is no corner"));
        assert!(error("ply\n").contains("line 1"));
    }
}
