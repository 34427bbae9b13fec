//! STL, triangles as text or binary.

use std::collections::HashMap;
use std::io::{self, Write};
use std::ops::Range;

use super::scan::{ByteLines, Line, Splice, moved, number, quote, turned, words};
use super::single::check_single;
use super::{CloudFormat, Contents, FormatError, Note, Outgoing, ReadOptions, Room};
use crate::Rigid;

/// Bytes before the triangles of a binary file, and of a triangle: a normal, three corners and two
/// bytes of attributes.
const HEADER: usize = 84;
const RECORD: usize = 50;

const NO_POINTS: &str = "STL holds triangles, and a cloud has none; write .ply or .obj";

/// STL files. The points are the corners of the triangles, each only once however many triangles
/// share it, in the order in which they first appear. A moved copy keeps triangles, names and
/// attributes as they are and turns the normals; as the coordinates of binary files are in single
/// precision, it is refused where that is not enough. A cloud cannot be written as STL, which has
/// no points.
pub(super) struct Stl;

impl CloudFormat for Stl {
    fn name(&self) -> &'static str {
        "stl"
    }

    fn extensions(&self) -> &[&'static str] {
        &["stl"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        announced(bytes).is_some_and(|count| count > 0 && whole_length(count) == Some(bytes.len()))
            || is_text(bytes)
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let mut mesh =
            Corners { seen: HashMap::new(), points: Vec::new(), triangle: Vec::new(), faces: Vec::new() };
        let (binary, extra) = is_binary(bytes)?;
        if binary {
            let triangles = triangles(bytes);
            // Each triangle has at most three points of its own, in a list and in a table.
            let most = triangles.len().saturating_mul(3 * 72 + 12);
            options.check_memory(&format!("{} triangles", triangles.len()), bytes.len(), most)?;
            for record in triangles {
                (1..4).for_each(|corner| mesh.add(vector(record, corner)));
            }
        } else {
            let held = bytes.len();
            text_rows(bytes, |_, _, kind, point| {
                if kind == StlKind::Vertex {
                    options.check_memory("the triangles", held, mesh.points.len().saturating_mul(3 * 72))?;
                    mesh.add(point);
                }
                Ok::<_, FormatError>(())
            })?;
        }
        let notes = if extra > 0 { vec![Note::ExtraBytes { bytes: extra }] } else { Vec::new() };
        Ok(Contents { points: mesh.points, faces: mesh.faces, single: binary, notes, ..Contents::default() })
    }

    fn room(&self) -> Room {
        Room::Nothing(NO_POINTS)
    }

    fn check_points(&self, points: &[[f64; 3]]) -> Result<(), FormatError> {
        check_single(points, "binary STL")
    }

    fn check_rewrite(
        &self,
        from: &str,
        bytes: &[u8],
        _options: &ReadOptions,
    ) -> Option<Result<Room, FormatError>> {
        let room = |(binary, _)| if binary { Room::SomePoints } else { Room::Anything };
        (from == self.name()).then(|| is_binary(bytes).map(room))
    }

    fn write_cloud(&self, _cloud: &Outgoing<'_>, _out: &mut dyn Write) -> io::Result<()> {
        Err(Room::refusal(NO_POINTS).into())
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        let moved_points: Vec<[f64; 3]> =
            self.read(bytes, options)?.points.into_iter().map(|p| moved(motion, p)).collect();
        let mut splice = Splice::new(bytes, out);
        let change = |kind: StlKind| if kind == StlKind::Vertex { moved } else { turned };
        if !is_binary(bytes)?.0 {
            text_rows(bytes, |_, places, kind, old| splice.numbers(places, old, change(kind)(motion, old)))?;
            return splice.finish();
        }
        self.check_points(&moved_points)?;
        for (index, record) in triangles(bytes).iter().enumerate() {
            for part in 0..4 {
                let old = vector(record, part);
                let new = change(if part == 0 { StlKind::Normal } else { StlKind::Vertex })(motion, old);
                for axis in (0..3).filter(|&axis| old[axis] != new[axis] && !new[axis].is_nan()) {
                    let at = HEADER + index * RECORD + part * 12 + axis * 4;
                    splice.replace(at..at + 4, &(new[axis] as f32).to_le_bytes())?;
                }
            }
        }
        splice.finish()
    }
}

/// The number of triangles that a binary header announces.
fn announced(bytes: &[u8]) -> Option<u32> {
    bytes.get(80..)?.first_chunk().map(|&word| u32::from_le_bytes(word))
}

fn whole_length(count: u32) -> Option<usize> {
    usize::try_from(count).ok()?.checked_mul(RECORD)?.checked_add(HEADER)
}

fn is_text(bytes: &[u8]) -> bool {
    let begin = &bytes[..bytes.len().min(4096)];
    let has = |word: &[u8]| begin.windows(word.len()).any(|window| window.eq_ignore_ascii_case(word));
    begins_solid(begin) && (has(b"facet") || has(b"endsolid")) && !begin.contains(&0)
}

/// Whether the first word is `solid`, in letters of any size.
fn begins_solid(bytes: &[u8]) -> bool {
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    words(&bytes[..bytes.len().min(200)]).next().is_some_and(|(_, word)| word.eq_ignore_ascii_case(b"solid"))
}

/// Whether the file is binary, and how many bytes it has beyond those it announces. Binary files may begin with
/// `solid` too.
fn is_binary(bytes: &[u8]) -> Result<(bool, usize), FormatError> {
    let count = announced(bytes);
    if count.is_some_and(|count| whole_length(count) == Some(bytes.len())) {
        return Ok((true, 0));
    }
    if is_text(bytes) {
        return Ok((false, 0));
    }
    let extra = count.filter(|&count| count > 0).and_then(whole_length).and_then(|n| bytes.get(n..));
    match count {
        Some(_) if extra.is_some_and(|rest| rest.len() < RECORD || rest.iter().all(|&b| b == 0)) => {
            Ok((true, extra.map_or(0, <[u8]>::len)))
        }
        _ if begins_solid(bytes) => {
            Err(FormatError::truncated("a text that ends with `endsolid`", format!("{} bytes", bytes.len())))
        }
        Some(count) if extra.is_some() || count == 0 => Err(FormatError::Content(format!(
            "the header says {count} triangles, and there is room for {}: the number at byte 80 is wrong; save the mesh again",
            (bytes.len() - HEADER) / RECORD
        ))),
        Some(count) => {
            let found = (bytes.len() - HEADER) as f64 / RECORD as f64;
            Err(FormatError::truncated(format!("a binary STL of {count} triangles"), format!("{found}")))
        }
        None => {
            Err(FormatError::Content("neither text STL (`solid`) nor 84 bytes of a binary header".into()))
        }
    }
}

/// The triangles of a binary file.
fn triangles(bytes: &[u8]) -> &[[u8; RECORD]] {
    let rows = bytes.get(HEADER..).unwrap_or_default().as_chunks::<RECORD>().0;
    let count = announced(bytes).map_or(0, |count| usize::try_from(count).unwrap_or(usize::MAX));
    &rows[..rows.len().min(count)]
}

/// Corners of triangles, each only once.
struct Corners {
    seen: HashMap<[u64; 3], u32>,
    points: Vec<[f64; 3]>,
    triangle: Vec<u32>,
    faces: Vec<[u32; 3]>,
}

impl Corners {
    fn add(&mut self, point: [f64; 3]) {
        // 0 and -0 are the same place.
        let next = self.points.len() as u32;
        let place = *self.seen.entry(point.map(|c| (c + 0.0).to_bits())).or_insert(next);
        if place == next {
            self.points.push(point);
        }
        self.triangle.push(place);
        if let [a, b, c] = self.triangle[..] {
            self.faces.push([a, b, c]);
            self.triangle.clear();
        }
    }
}

/// The normal (0) or a corner (1 to 3) of a triangle.
fn vector(record: &[u8; RECORD], part: usize) -> [f64; 3] {
    let words = record.as_chunks::<4>().0;
    std::array::from_fn(|axis| f32::from_le_bytes(words[part * 3 + axis]).into())
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum StlKind {
    Normal,
    Vertex,
}

/// Goes through the normals and corners of a text file.
fn text_rows<E: From<FormatError>>(
    bytes: &[u8],
    mut each: impl FnMut(&Line, &[Range<usize>; 3], StlKind, [f64; 3]) -> Result<(), E>,
) -> Result<(), E> {
    let mut corners = 0usize;
    let mut open = false;
    for line in ByteLines::new(bytes) {
        let mut words = line.words();
        let Some((_, word)) = words.next() else { continue };
        let word = word.strip_prefix("\u{feff}".as_bytes()).unwrap_or(word);
        let kind = match word.to_ascii_lowercase().as_slice() {
            b"solid" | b"outer" => {
                open = true;
                continue;
            }
            b"endsolid" => {
                open = false;
                continue;
            }
            b"endloop" | b"endfacet" => {
                if corners != 3 {
                    return Err(line.error(format!("a facet of {corners} corners, 3 are expected")).into());
                }
                continue;
            }
            b"facet" => {
                words.next();
                corners = 0;
                StlKind::Normal
            }
            b"vertex" => {
                corners += 1;
                StlKind::Vertex
            }
            _ => return Err(line.error(format!("{} begins no line of a text STL", quote(word))).into()),
        };
        let (mut places, mut point) = ([0..0, 0..0, 0..0], [0.0; 3]);
        for axis in 0..3 {
            let few = || line.error(format!("{axis} numbers where 3 are expected"));
            let (at, word) = words.next().ok_or_else(few)?;
            places[axis] = at..at + word.len();
            point[axis] = number(word).map_err(|problem| line.error(problem))?;
        }
        each(&line, &places, kind, point)?;
    }
    if open {
        return Err(FormatError::truncated("a text that ends with `endsolid`", "none").into());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::testing::{moved_copy, points_of};

    const TEXT: &str = "solid a b\r\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1.50 0 0\n   \
                        vertex 0 1 0\n  endloop\n endfacet\n facet normal 0 0 1\n  outer loop\n   vertex 1.5 0 0\n   \
                        vertex 1 1 0\n   vertex -0 1 0\n  endloop\n endfacet\nendsolid a b\n";
    const POINTS: [[f64; 3]; 4] = [[0.0; 3], [1.5, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];

    fn binary() -> Vec<u8> {
        let mut bytes = b"solid, but binary".to_vec();
        bytes.resize(80, b' ');
        bytes.extend(2u32.to_le_bytes());
        for corners in [[0, 1, 2], [1, 3, 2]] {
            let normal = [0.0, 0.0, 1.0];
            for value in normal.iter().chain(corners.iter().flat_map(|&i: &usize| POINTS[i].iter())) {
                bytes.extend((*value as f32).to_le_bytes());
            }
            bytes.extend([7, 9]);
        }
        bytes
    }

    #[test]
    fn corners_appear_once() {
        assert_eq!(points_of(&Stl, TEXT.as_bytes()).unwrap(), POINTS);
        assert_eq!(points_of(&Stl, &binary()).unwrap(), POINTS);
        assert!(Stl.recognises(TEXT.as_bytes()) && Stl.recognises(&binary()) && !Stl.recognises(b"solid"));
    }

    #[test]
    fn a_moved_copy_keeps_the_rest() {
        let motion = Rigid {
            rotation: nalgebra::Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0),
            translation: [0.5, 0.0, 0.0].into(),
        };
        let copy = |bytes: &[u8]| {
            let mut out = Vec::new();
            moved_copy(&Stl, bytes, &motion, &mut out).unwrap();
            out
        };
        let moved = [[0.5, 0.0, 0.0], [2.0, 0.0, 0.0], [0.5, 0.0, 1.0], [1.5, 0.0, 1.0]];
        assert_eq!(points_of(&Stl, &copy(TEXT.as_bytes())).unwrap(), moved);
        assert!(String::from_utf8(copy(TEXT.as_bytes())).unwrap().contains("facet normal 0 -1 0\n"));
        let bytes = copy(&binary());
        assert_eq!(points_of(&Stl, &bytes).unwrap(), moved);
        assert_eq!((&bytes[..84], &bytes[132..134]), (&binary()[..84], &[7u8, 9][..]));
        assert_eq!(vector(bytes[84..].first_chunk().unwrap(), 0), [0.0, -1.0, 0.0]);
    }

    #[test]
    fn damage_is_found() {
        for bytes in [binary(), TEXT.as_bytes().to_vec()] {
            for length in 0..bytes.len() - 12 {
                assert!(points_of(&Stl, &bytes[..length]).is_err(), "{length}");
            }
        }
        let error = |text: &str| points_of(&Stl, text.as_bytes()).unwrap_err().to_string();
        assert!(error("solid\nfacet normal 0 0 1\nvertex 0 0\n").contains("line 3: 2 numbers"));
        assert!(error("solid\nfacet normal 0 0 1\nvertex 0 0 0\nendfacet").contains("facet of 1 corners"));
        assert!(
            Stl.write_cloud(&Outgoing::of_points(&POINTS), &mut Vec::new())
                .unwrap_err()
                .to_string()
                .contains("write .ply")
        );
    }
}
