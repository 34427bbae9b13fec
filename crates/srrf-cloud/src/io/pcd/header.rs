//! The header of a PCD file.

use std::ops::Range;

use super::super::FormatError;
use super::super::scalar::Scalar;
use super::super::scan::{ByteLines, Line, number, quote};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum PcdEncoding {
    Ascii,
    Binary,
    Compressed,
}

pub(super) struct Field {
    pub name: String,
    pub scalar: Scalar,
    /// Numbers of this field in each point.
    pub count: usize,
    /// Where in the file the words of its size and its type are.
    pub places: [Range<usize>; 2],
}

impl Field {
    pub fn bytes(&self) -> usize {
        self.scalar.size() * self.count
    }
}

pub(super) struct PcdHeader {
    pub fields: Vec<Field>,
    pub points: usize,
    pub encoding: PcdEncoding,
    /// Offset of the first byte behind the header, and the number of its lines.
    pub body: usize,
    pub lines: usize,
    /// Width and height of an organised cloud.
    pub grid: Option<[usize; 2]>,
    /// Where the scanner stood, if that is not left at its default.
    pub viewpoint: Option<[f64; 3]>,
}

/// The words of the lines, each with its place.
#[derive(Default)]
struct Words<'a> {
    fields: Vec<&'a [u8]>,
    sizes: Vec<(Range<usize>, &'a [u8])>,
    types: Vec<(Range<usize>, &'a [u8])>,
    counts: Vec<u64>,
    width: Option<u64>,
    height: Option<u64>,
    points: Option<u64>,
    viewpoint: Option<[f64; 3]>,
}

impl PcdHeader {
    /// # Errors
    /// [`FormatError`] with the line that cannot be understood.
    pub fn parse(bytes: &[u8]) -> Result<Self, FormatError> {
        let mut lines = ByteLines::of_header(bytes);
        let mut words = Words::default();
        let mut last = 0;
        while let Some(line) = lines.next() {
            last = line.number;
            let mut tail = line.words();
            let Some((_, key)) = tail.next().filter(|(_, key)| !key.starts_with(b"#")) else { continue };
            match key.to_ascii_uppercase().as_slice() {
                b"VERSION" => {}
                b"VIEWPOINT" => words.viewpoint = viewpoint(tail.map(|(_, word)| word)),
                b"FIELDS" | b"COLUMNS" => words.fields = tail.map(|(_, word)| word).collect(),
                b"SIZE" => words.sizes = tail.map(|(at, word)| (at..at + word.len(), word)).collect(),
                b"TYPE" => words.types = tail.map(|(at, word)| (at..at + word.len(), word)).collect(),
                b"COUNT" => words.counts = tail.map(|word| count(&line, word.1)).collect::<Result<_, _>>()?,
                b"WIDTH" => words.width = Some(single(&line)?),
                b"HEIGHT" => words.height = Some(single(&line)?),
                b"POINTS" => words.points = Some(single(&line)?),
                b"DATA" => {
                    let encoding = match tail.next().map(|(_, word)| word.to_ascii_lowercase()).as_deref() {
                        Some(b"ascii") => PcdEncoding::Ascii,
                        // A cut line could be either of the two.
                        _ if lines.offset() == line.start + line.text.len() => break,
                        Some(b"binary") => PcdEncoding::Binary,
                        Some(b"binary_compressed") => PcdEncoding::Compressed,
                        _ => return Err(line.error("DATA is none of ascii, binary, binary_compressed")),
                    };
                    let (fields, points) = (words.fields(&line)?, words.points(&line)?);
                    let (grid, viewpoint) = (words.grid(), words.viewpoint);
                    return Ok(Self {
                        fields,
                        points,
                        encoding,
                        body: lines.offset(),
                        lines: last,
                        grid,
                        viewpoint,
                    });
                }
                _ => return Err(line.error(format!("{} is not a line of a PCD header", quote(key)))),
            }
        }
        Err(FormatError::truncated("a header that ends with a line `DATA`", format!("{last} lines")))
    }

    /// The index of the field of this name.
    pub fn field(&self, name: &str) -> Option<usize> {
        let named = |exact: bool| {
            let same = |field: &Field| {
                if exact { field.name == name } else { field.name.eq_ignore_ascii_case(name) }
            };
            self.fields.iter().position(|field| same(field) && field.count == 1)
        };
        named(true).or_else(|| named(false))
    }

    /// The indices of three fields.
    pub fn triple(&self, names: [&str; 3]) -> Option<[usize; 3]> {
        let [a, b, c] = names.map(|name| self.field(name));
        Some([a?, b?, c?])
    }

    /// The indices of x, y and z.
    pub fn axes(&self) -> Result<[usize; 3], FormatError> {
        let lacking = || FormatError::Content("the line FIELDS lacks x, y or z".into());
        self.triple(["x", "y", "z"]).ok_or_else(lacking)
    }

    /// Bytes of a point, and of all points; `None` where memory cannot hold them.
    pub fn sizes(&self) -> Option<(usize, usize)> {
        let stride: usize = self.fields.iter().map(Field::bytes).sum();
        Some((stride, stride.checked_mul(self.points)?))
    }
}

fn count(line: &Line, word: &[u8]) -> Result<u64, FormatError> {
    let count = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
    count.ok_or_else(|| line.error(format!("{} is not a number", quote(word))))
}

fn single(line: &Line) -> Result<u64, FormatError> {
    let word = line.words().nth(1).ok_or_else(|| line.error("a number is missing"))?;
    count(line, word.1)
}

/// The place of a viewpoint `x y z qw qx qy qz`; `None` for the default, and for one that cannot be read.
fn viewpoint<'a>(words: impl Iterator<Item = &'a [u8]>) -> Option<[f64; 3]> {
    let numbers: Vec<f64> = words.map_while(|word| number(word).ok()).collect();
    let [x, y, z, rotation @ ..] = &numbers[..] else { return None };
    let default = [x, y, z].iter().all(|c| **c == 0.0) && matches!(rotation, [] | [1.0, 0.0, 0.0, 0.0, ..]);
    (!default && numbers.iter().all(|c| c.is_finite())).then_some([*x, *y, *z])
}

impl Words<'_> {
    fn grid(&self) -> Option<[usize; 2]> {
        let [width, height] = [self.width?, self.height?].map(|side| usize::try_from(side).ok());
        Some([width?, height?]).filter(|[_, height]| *height > 1)
    }

    fn fields(&self, line: &Line) -> Result<Vec<Field>, FormatError> {
        let n = self.fields.len();
        let counts = if self.counts.is_empty() { vec![1; n] } else { self.counts.clone() };
        // Version .5 has neither sizes nor types: all fields are text of floats.
        let old = self.sizes.is_empty() && self.types.is_empty();
        if !old && [self.sizes.len(), self.types.len(), counts.len()] != [n; 3] {
            let problem = format!(
                "FIELDS names {n} fields, SIZE has {} words, TYPE {}, COUNT {}; they must agree",
                self.sizes.len(),
                self.types.len(),
                counts.len()
            );
            return Err(line.error(problem));
        }
        let mut fields = Vec::with_capacity(n);
        for (index, name) in self.fields.iter().enumerate() {
            let none = (0..0, &b""[..]);
            let (size, kind) = match old {
                true => (&(none.0.clone(), &b"4"[..]), &(none.0.clone(), &b"F"[..])),
                false => (&self.sizes[index], &self.types[index]),
            };
            let kind = (kind.0.clone(), kind.1.to_ascii_uppercase());
            let name = String::from_utf8_lossy(name).into_owned();
            let scalar = match (kind.1.as_slice(), size.1) {
                (b"F", b"4") => Scalar::F32,
                (b"F", b"8") => Scalar::F64,
                (b"I", b"1") => Scalar::I8,
                (b"I", b"2") => Scalar::I16,
                (b"I", b"4") => Scalar::I32,
                (b"I", b"8") => Scalar::I64,
                (b"U", b"1") => Scalar::U8,
                (b"U", b"2") => Scalar::U16,
                (b"U", b"4") => Scalar::U32,
                (b"U", b"8") => Scalar::U64,
                (kind, size) => {
                    let problem =
                        format!("the field {name:?} has type {} of size {}", quote(kind), quote(size));
                    return Err(line.error(format!("{problem}; F, I or U of 1 to 8 bytes are expected")));
                }
            };
            // A count is not trusted: the sum of all stays far from overflow.
            let count = usize::try_from(counts[index]).ok().filter(|&count| count <= 1 << 32);
            let count =
                count.ok_or_else(|| line.error(format!("the field {name:?} has COUNT {}", counts[index])))?;
            fields.push(Field { name, scalar, count, places: [size.0.clone(), kind.0.clone()] });
        }
        Ok(fields)
    }

    fn points(&self, line: &Line) -> Result<usize, FormatError> {
        let grid = self.width.map(|width| width.saturating_mul(self.height.unwrap_or(1)));
        let points = match (self.points, grid) {
            (Some(points), Some(grid)) if points != grid => {
                let problem = format!("POINTS is {points}, but WIDTH times HEIGHT {grid}; they must agree");
                return Err(line.error(problem));
            }
            (Some(points), _) | (None, Some(points)) => points,
            (None, None) => return Err(line.error("there is neither POINTS nor WIDTH before DATA")),
        };
        usize::try_from(points).map_err(|_| line.error(format!("{points} points")))
    }
}
