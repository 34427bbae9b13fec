//! The header of a PLY file.

use std::ops::Range;

use super::super::FormatError;
use super::super::scalar::Scalar;
use super::super::scan::{ByteLines, Line, quote};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum PlyEncoding {
    Ascii,
    Binary { big_endian: bool },
}

pub(super) struct Property {
    pub name: String,
    /// The type of the length, for a list.
    pub length: Option<Scalar>,
    pub scalar: Scalar,
    /// The word of a type that is none of PLY's, or whose size is not the same everywhere. `scalar` has its size.
    pub foreign: Option<String>,
    /// Where in the file the word of its type is.
    pub place: Range<usize>,
}

pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// The indices of the three properties of these names which are not lists.
    pub fn triple(&self, names: [&str; 3]) -> Option<[usize; 3]> {
        let find = |name: &str| {
            let scalar = |p: &&Property| p.length.is_none();
            let exact = self.properties.iter().position(|p| p.name == name && scalar(&p));
            exact.or_else(|| {
                self.properties.iter().position(|p| p.name.eq_ignore_ascii_case(name) && scalar(&p))
            })
        };
        let [a, b, c] = names.map(find);
        Some([a?, b?, c?])
    }

    /// The index of the list that names the corners of faces.
    pub fn face_list(&self) -> Option<usize> {
        let is_faces = ["face", "faces", "tristrips"].contains(&self.name.as_str());
        let named = |p: &Property| ["vertex_indices", "vertex_index"].contains(&p.name.as_str());
        self.properties.iter().position(|p| p.length.is_some() && named(p)).filter(|_| is_faces)
    }

    /// Bytes of a row, if all rows have as many.
    pub fn stride(&self) -> Option<usize> {
        let size = |p: &Property| p.length.is_none().then(|| p.scalar.size());
        self.properties.iter().map(size).sum()
    }
}

pub(super) struct PlyHeader {
    pub encoding: PlyEncoding,
    pub elements: Vec<Element>,
    /// Offset of the first byte behind the header.
    pub body: usize,
}

fn scalar(name: &[u8]) -> Option<Scalar> {
    Some(match name {
        b"char" | b"int8" => Scalar::I8,
        b"uchar" | b"uint8" | b"bool" => Scalar::U8,
        b"half" | b"float16" => Scalar::F16,
        b"short" | b"int16" => Scalar::I16,
        b"ushort" | b"uint16" => Scalar::U16,
        b"int" | b"int32" => Scalar::I32,
        b"uint" | b"uint32" => Scalar::U32,
        b"int64" | b"longlong" => Scalar::I64,
        b"uint64" | b"ulonglong" => Scalar::U64,
        b"float" | b"float32" => Scalar::F32,
        b"double" | b"float64" => Scalar::F64,
        _ => return None,
    })
}

impl PlyHeader {
    /// How many of the elements are read: up to the last vertices or faces.
    pub fn needed(&self) -> usize {
        let needed = |element: &Element| element.name == "vertex" || element.face_list().is_some();
        self.elements.iter().rposition(needed).map_or(0, |last| last + 1)
    }

    /// # Errors
    /// [`FormatError`] with the line that cannot be understood.
    pub fn parse(bytes: &[u8]) -> Result<Self, FormatError> {
        let mut lines = ByteLines::of_header(bytes);
        if lines.next().is_none_or(|line| line.text.trim_ascii() != b"ply") {
            return Err(FormatError::Content("the file does not begin with a line `ply`".into()));
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut number = 1;
        while let Some(line) = lines.next() {
            number = line.number;
            let words: Vec<&[u8]> = line.words().map(|(_, word)| word).take(6).collect();
            match &words[..] {
                [] | [b"comment" | b"obj_info", ..] => {}
                [b"format", name, ..] => encoding = Some(parse_encoding(&line, name)?),
                [b"element", name, count] => {
                    let name = String::from_utf8_lossy(name).into_owned();
                    if name == "vertex" && elements.iter().any(|e| e.name == name) {
                        return Err(line.error("a second element `vertex`; one is expected"));
                    }
                    let count = parse_count(&line, count)?;
                    elements.push(Element { name, count, properties: Vec::new() });
                }
                [b"property", ..] => match elements.last_mut() {
                    Some(element) => element.properties.push(parse_property(&line)?),
                    None => return Err(line.error("a property before the first element")),
                },
                // A cut `end_header` without its line end is not one.
                [b"end_header"] if lines.offset() > line.start + line.text.len() => {
                    let encoding = encoding
                        .ok_or_else(|| FormatError::Content("the header has no line `format`".into()))?;
                    return Ok(Self { encoding, elements, body: lines.offset() });
                }
                _ => return Err(not_understood(&line)),
            }
        }
        Err(FormatError::truncated("a header that ends with `end_header`", format!("{number} lines")))
    }
}

fn not_understood(line: &Line) -> FormatError {
    line.error(format!("{} is not a line of a PLY header", quote(line.text.trim_ascii())))
}

fn parse_encoding(line: &Line, name: &[u8]) -> Result<PlyEncoding, FormatError> {
    match name {
        b"ascii" => Ok(PlyEncoding::Ascii),
        b"binary_little_endian" => Ok(PlyEncoding::Binary { big_endian: false }),
        b"binary_big_endian" => Ok(PlyEncoding::Binary { big_endian: true }),
        _ => Err(line.error(format!(
            "the format {} is none of ascii, binary_little_endian, binary_big_endian",
            quote(name)
        ))),
    }
}

fn parse_count(line: &Line, word: &[u8]) -> Result<u64, FormatError> {
    let count = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
    count.ok_or_else(|| line.error(format!("{} is not a number of elements", quote(word))))
}

fn parse_property(line: &Line) -> Result<Property, FormatError> {
    let words: Vec<(usize, &[u8])> = line.words().skip(1).take(5).collect();
    let (length, kind, name) = match words[..] {
        [(_, b"list"), length, kind, (_, name)] => (Some(length), kind, name),
        [kind, (_, name)] => (None, kind, name),
        _ => return Err(not_understood(line)),
    };
    let known = |word: &[u8]| {
        let unknown = || line.error(format!("{} is not a type of PLY numbers", quote(word)));
        scalar(word).ok_or_else(unknown)
    };
    let name = String::from_utf8_lossy(name).into_owned();
    // Lists are how the rows are told apart.
    let foreign = length.is_none() && scalar(kind.1).is_none();
    if foreign && !is_word(kind.1) {
        known(kind.1)?;
    }
    Ok(Property {
        name,
        length: length.map(|(_, word)| known(word)).transpose()?,
        scalar: if foreign { Scalar::F64 } else { known(kind.1)? },
        foreign: foreign.then(|| String::from_utf8_lossy(kind.1).into_owned()),
        place: kind.0..kind.0 + kind.1.len(),
    })
}

/// Whether this may be the name of a type.
fn is_word(word: &[u8]) -> bool {
    word.len() <= 32
        && word[0].is_ascii_alphabetic()
        && word.iter().all(|b| b.is_ascii_alphanumeric() || *b == b'_')
}
