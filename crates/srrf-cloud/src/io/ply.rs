//! PLY, the Stanford polygon format: text, and binary of both byte orders.

use std::io::{self, Write};

use super::{CloudFormat, FormatError};

/// PLY files; the points are the `x`, `y` and `z` of the element `vertex`. Written as binary little
/// endian in double precision.
pub(super) struct Ply;

impl CloudFormat for Ply {
    fn extensions(&self) -> &[&'static str] {
        &["ply"]
    }

    fn read(&self, bytes: &[u8]) -> Result<Vec<[f64; 3]>, FormatError> {
        let (encoding, elements, body) = parse_header(bytes)?;
        match encoding {
            Encoding::Ascii => read_vertices(&elements, &mut AsciiBody::new(body)),
            Encoding::Binary { big_endian } => {
                read_vertices(&elements, &mut BinaryBody { rest: body, big_endian })
            }
        }
    }

    fn write(&self, points: &[[f64; 3]], out: &mut dyn Write) -> io::Result<()> {
        let axes = "property double x\nproperty double y\nproperty double z";
        let count = points.len();
        write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{axes}\nend_header\n")?;
        points.iter().flatten().try_for_each(|c| out.write_all(&c.to_le_bytes()))
    }
}

#[derive(Clone, Copy)]
enum Encoding {
    Ascii,
    Binary { big_endian: bool },
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }
}

struct Property {
    name: String,
    /// The type of the length, for a list.
    length: Option<Scalar>,
    scalar: Scalar,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

/// The encoding, the elements and the bytes behind the header.
fn parse_header(bytes: &[u8]) -> Result<(Encoding, Vec<Element>, &[u8]), FormatError> {
    let mut rest = bytes;
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    for number in 1.. {
        let end = rest.iter().position(|&b| b == b'\n').ok_or_else(|| match number {
            1 => FormatError::Content("the file does not begin with `ply`".into()),
            _ => FormatError::truncated("a header that closes with `end_header`", format!("{number} lines")),
        })?;
        let line = String::from_utf8_lossy(&rest[..end]);
        rest = &rest[end + 1..];
        let words: Vec<&str> = line.split_whitespace().collect();
        let bad = || FormatError::line(number, format!("{:?} is not understood", line.trim()));
        match (number, &words[..]) {
            (1, ["ply"]) => {}
            (1, _) => return Err(FormatError::Content("the file does not begin with `ply`".into())),
            (_, [] | ["comment" | "obj_info", ..]) => {}
            (_, ["format", "ascii", ..]) => encoding = Some(Encoding::Ascii),
            (_, ["format", "binary_little_endian", ..]) => {
                encoding = Some(Encoding::Binary { big_endian: false });
            }
            (_, ["format", "binary_big_endian", ..]) => {
                encoding = Some(Encoding::Binary { big_endian: true });
            }
            (_, ["element", name, count]) => {
                let count = count.parse().map_err(|_| bad())?;
                elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
            }
            (_, ["property", tail @ ..]) => {
                let (length, scalar, name) = match tail {
                    ["list", length, scalar, name] => {
                        (Some(Scalar::parse(length).ok_or_else(bad)?), scalar, name)
                    }
                    [scalar, name] => (None, scalar, name),
                    _ => return Err(bad()),
                };
                let scalar = Scalar::parse(scalar).ok_or_else(bad)?;
                let element = elements.last_mut().ok_or_else(bad)?;
                element.properties.push(Property { name: (*name).to_owned(), length, scalar });
            }
            (_, ["end_header"]) => break,
            _ => return Err(bad()),
        }
    }
    let encoding = encoding.ok_or_else(|| FormatError::Content("the header names no format".into()))?;
    Ok((encoding, elements, rest))
}

/// What follows the header, number by number.
trait Body {
    /// The next number; `None` at the end.
    fn next(&mut self, scalar: Scalar) -> Result<Option<f64>, FormatError>;
    /// Bytes that are left, at most that many numbers.
    fn bytes_left(&self) -> usize;
}

struct BinaryBody<'a> {
    rest: &'a [u8],
    big_endian: bool,
}

impl BinaryBody<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.rest.split_first_chunk::<N>()?;
        self.rest = rest;
        let mut head = *head;
        if self.big_endian {
            head.reverse();
        }
        Some(head)
    }
}

impl Body for BinaryBody<'_> {
    fn next(&mut self, scalar: Scalar) -> Result<Option<f64>, FormatError> {
        Ok(match scalar {
            Scalar::I8 => self.take().map(|b| i8::from_le_bytes(b).into()),
            Scalar::U8 => self.take().map(|b| u8::from_le_bytes(b).into()),
            Scalar::I16 => self.take().map(|b| i16::from_le_bytes(b).into()),
            Scalar::U16 => self.take().map(|b| u16::from_le_bytes(b).into()),
            Scalar::I32 => self.take().map(|b| i32::from_le_bytes(b).into()),
            Scalar::U32 => self.take().map(|b| u32::from_le_bytes(b).into()),
            Scalar::F32 => self.take().map(|b| f32::from_le_bytes(b).into()),
            Scalar::F64 => self.take().map(f64::from_le_bytes),
        })
    }

    fn bytes_left(&self) -> usize {
        self.rest.len()
    }
}

struct AsciiBody<'a> {
    words: std::str::SplitAsciiWhitespace<'a>,
    length: usize,
}

impl<'a> AsciiBody<'a> {
    fn new(body: &'a [u8]) -> Self {
        // Up to the first byte that is not text.
        let text = match std::str::from_utf8(body) {
            Ok(text) => text,
            Err(e) => std::str::from_utf8(&body[..e.valid_up_to()]).unwrap_or_default(),
        };
        Self { words: text.split_ascii_whitespace(), length: text.len() }
    }
}

impl Body for AsciiBody<'_> {
    fn next(&mut self, _scalar: Scalar) -> Result<Option<f64>, FormatError> {
        let Some(word) = self.words.next() else { return Ok(None) };
        word.parse().map(Some).map_err(|_| FormatError::Content(format!("{word:?} is not a number")))
    }

    fn bytes_left(&self) -> usize {
        self.length
    }
}

fn read_vertices(elements: &[Element], body: &mut impl Body) -> Result<Vec<[f64; 3]>, FormatError> {
    for element in elements {
        let axes = ["x", "y", "z"]
            .map(|axis| element.properties.iter().position(|p| p.name == axis && p.length.is_none()));
        let is_vertex = element.name == "vertex";
        if is_vertex && axes.contains(&None) {
            return Err(FormatError::Content("the element `vertex` lacks x, y or z".into()));
        }
        if element.properties.is_empty() {
            continue;
        }
        let mut points = Vec::new();
        if is_vertex {
            // The count is not trusted with memory.
            points.reserve(element.count.min(body.bytes_left() / element.properties.len()));
        }
        for row in 0..element.count {
            let mut point = [f64::NAN; 3];
            for (index, property) in element.properties.iter().enumerate() {
                let Some(value) = read_property(property, body)? else {
                    let announced = format!("{} elements `{}`", element.count, element.name);
                    return Err(FormatError::truncated(announced, row.to_string()));
                };
                if let Some(axis) = axes.iter().position(|&a| a == Some(index)) {
                    point[axis] = value;
                }
            }
            if is_vertex {
                points.push(point);
            }
        }
        if is_vertex {
            return Ok(points);
        }
    }
    Err(FormatError::Content("the file has no element `vertex`".into()))
}

/// The value of a scalar, or the last one of a list; `None` at the end of the file.
fn read_property(property: &Property, body: &mut impl Body) -> Result<Option<f64>, FormatError> {
    let Some(length) = property.length else { return body.next(property.scalar) };
    let Some(length) = body.next(length)? else { return Ok(None) };
    if length.is_nan() || length < 0.0 || length.fract() != 0.0 {
        return Err(FormatError::Content(format!("a list of {length} numbers")));
    }
    let mut value = Some(0.0);
    for _ in 0..length as u64 {
        value = body.next(property.scalar)?;
        if value.is_none() {
            break;
        }
    }
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [[f64; 3]; 2] = [[1.5, -2.0, 0.25], [4.0, 5.0, -6.5]];

    fn header(format: &str) -> String {
        format!(
            "ply\r\nformat {format} 1.0\ncomment a face before the vertices\nelement face 1\n\
             property list uchar short vertex_indices\nelement vertex 2\nproperty uchar red\n\
             property float y\nproperty float x\nproperty double z\nelement edge 9\nproperty int a\nend_header\n"
        )
    }

    fn binary(big_endian: bool) -> Vec<u8> {
        let mut bytes =
            header(if big_endian { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
        let mut put = |value: &[u8]| {
            let mut value = value.to_vec();
            if big_endian {
                value.reverse();
            }
            bytes.extend(value);
        };
        put(&[3]);
        (0i16..3).for_each(|i| put(&i.to_le_bytes()));
        for [x, y, z] in POINTS {
            put(&[200]);
            put(&(y as f32).to_le_bytes());
            put(&(x as f32).to_le_bytes());
            put(&z.to_le_bytes());
        }
        bytes
    }

    #[test]
    fn three_encodings() {
        let text = format!("{}3 0 1 2\n200 -2 1.5 0.25\n200 5 4\n -6.5\n", header("ascii"));
        assert_eq!(Ply.read(text.as_bytes()).unwrap(), POINTS);
        assert_eq!(Ply.read(&binary(false)).unwrap(), POINTS);
        assert_eq!(Ply.read(&binary(true)).unwrap(), POINTS);
    }

    #[test]
    fn files_cut_short() {
        for big_endian in [false, true] {
            let whole = binary(big_endian);
            for length in 0..whole.len() {
                assert!(Ply.read(&whole[..length]).is_err(), "{length}");
            }
        }
        let error = Ply.read(&binary(false)[..binary(false).len() - 1]).unwrap_err().to_string();
        assert!(error.contains("2 elements `vertex` announced, 1 found"), "{error}");
    }

    #[test]
    fn headers_that_lie() {
        let head = |body: &str| format!("ply\nformat binary_little_endian 1.0\n{body}\nend_header\n");
        let error = |body: &str| Ply.read(head(body).as_bytes()).unwrap_err().to_string();
        let axes = "property float x\nproperty float y\nproperty float z";
        assert!(error(&format!("element vertex 18446744073709551615\n{axes}")).contains("cut short"));
        assert!(error(&format!("element vertex -3\n{axes}")).contains("line 3"));
        assert!(error("element vertex 3\nproperty float x\nproperty float y").contains("lacks"));
        assert!(error("element face 0\nproperty list uchar int i").contains("no element `vertex`"));
        assert!(error("property float x").contains("line 3"));
        assert!(error("element vertex 3\nproperty quad x").contains("line 4"));
        // Rows without properties would be free of bytes: they are passed over.
        assert!(
            error(&format!("element ghost 18446744073709551615\nelement vertex 9\n{axes}")).contains("cut")
        );
        assert!(Ply.read(b"solid").is_err() && Ply.read(b"").is_err());
        assert!(Ply.read(b"ply\nelement vertex 0\nend_header\n").is_err());
    }
}
