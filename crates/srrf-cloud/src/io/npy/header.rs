//! The header of a NumPy array: a magic number, a length, and a Python dictionary as text.

use super::super::FormatError;
use super::super::scalar::Scalar;
use super::super::scan::quote;

/// A type of numbers and its byte order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NpyKind {
    pub scalar: Scalar,
    pub big_endian: bool,
}

impl NpyKind {
    fn parse(name: &[u8]) -> Result<Self, FormatError> {
        let scalar = match name.get(1..).unwrap_or_default() {
            b"f2" => Scalar::F16,
            b"f4" => Scalar::F32,
            b"f8" => Scalar::F64,
            b"i1" => Scalar::I8,
            b"i2" => Scalar::I16,
            b"i4" => Scalar::I32,
            b"i8" => Scalar::I64,
            b"u1" | b"b1" => Scalar::U8, // fields of booleans are bytes of 0 and 1
            b"u2" => Scalar::U16,
            b"u4" => Scalar::U32,
            b"u8" => Scalar::U64,
            b"O" => {
                return Err(FormatError::Content(
                    "it holds Python objects (lists, dictionaries, arrays of several lengths), which may run code when they \
                     are opened; save each cloud as an array of numbers of its own, of shape [points, 3]"
                        .into(),
                ));
            }
            _ => {
                return Err(FormatError::Content(format!(
                    "cannot read numbers of type {}; save the array as float32, float64 or integers",
                    quote(name)
                )));
            }
        };
        Ok(Self { scalar, big_endian: name.first() == Some(&b'>') })
    }

    /// NumPy's name.
    pub fn name(self) -> String {
        let order = if self.big_endian { '>' } else { '<' };
        let kind = match self.scalar {
            Scalar::F16 | Scalar::F32 | Scalar::F64 => 'f',
            Scalar::I8 | Scalar::I16 | Scalar::I32 | Scalar::I64 => 'i',
            Scalar::U8 | Scalar::U16 | Scalar::U32 | Scalar::U64 => 'u',
        };
        format!("{order}{kind}{}", self.scalar.size())
    }
}

/// What the elements of an array are.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Descr {
    Plain(NpyKind),
    /// Named fields, one after the other.
    Fields(Vec<NpyField>),
}

/// A field of a structured array.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NpyField {
    /// Empty for padding.
    pub name: String,
    /// NumPy's words for the type, as the file has them.
    pub descr: String,
    /// The type, where it is one of single numbers.
    pub kind: Option<NpyKind>,
    /// Bytes of the field.
    pub size: usize,
}

impl NpyField {
    fn new(name: String, descr: &[u8]) -> Result<Self, FormatError> {
        let text = String::from_utf8_lossy(descr);
        let quoted = format!("'{text}'");
        if let Ok(kind) = NpyKind::parse(descr) {
            // The numbers of a field of booleans or half precision stay as they are.
            return Ok(Self { name, size: kind.scalar.size(), kind: Some(kind), descr: quoted });
        }
        // Padding, bytes, text (four bytes a letter), times, complex numbers.
        let size = text.get(2..).and_then(|digits| digits.split('[').next()?.parse::<usize>().ok());
        let size = match (text.as_bytes().get(1), size) {
            (Some(b'V' | b'S' | b'c' | b'f' | b'i' | b'u'), Some(size)) => Some(size),
            (Some(b'U'), Some(letters)) => letters.checked_mul(4),
            (Some(b'M' | b'm'), _) => Some(8),
            _ => None,
        };
        match size.filter(|&size| size <= 1 << 20) {
            Some(size) => Ok(Self { name, descr: quoted, kind: None, size }),
            None => Err(FormatError::Content(format!(
                "the field {name:?} is of type {}; save the array without it",
                quote(descr)
            ))),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct NpyHeader {
    pub descr: Descr,
    pub fortran: bool,
    pub shape: Vec<u64>,
    /// Whether it is a plain array of truth values, which are read as 0 and 1.
    pub booleans: bool,
    /// Offset of the first byte behind the header.
    pub body: usize,
}

impl NpyHeader {
    /// Reads the header at the begin of `bytes`. A small parser of our own: `npyz` hands the text to
    /// a recursive one, and trusts the length before it.
    ///
    /// # Errors
    /// [`FormatError`]
    pub fn parse(bytes: &[u8]) -> Result<Self, FormatError> {
        let Some(rest) = bytes.strip_prefix(b"\x93NUMPY") else {
            return Err(FormatError::Content(
                "not a NumPy array: the file does not begin with \\x93NUMPY".into(),
            ));
        };
        let word = |range: std::ops::Range<usize>| {
            let bytes = rest.get(range)?;
            Some(bytes.iter().rev().fold(0usize, |all, &byte| all << 8 | usize::from(byte)))
        };
        let short = || FormatError::truncated("a NumPy header", format!("{} bytes", bytes.len()));
        let (begin, length) = match rest.first() {
            Some(1) => (4, word(2..4).ok_or_else(short)?),
            Some(2 | 3) => (6, word(2..6).ok_or_else(short)?),
            Some(version) => {
                let problem = format!("NumPy's file format {version} is not known; save the array anew");
                return Err(FormatError::Content(problem));
            }
            None => return Err(short()),
        };
        let text = rest.get(begin..begin + length).ok_or_else(short)?;
        let mut parser = Parser { rest: text, booleans: false };
        let mut header = parser.dictionary()?;
        header.body = 6 + begin + length;
        Ok(header)
    }

    /// The bytes of a header for an array in C order (or Fortran's).
    pub fn bytes(descr: &Descr, fortran: bool, shape: &[u64]) -> Vec<u8> {
        let descr = match descr {
            Descr::Plain(kind) => format!("'{}'", kind.name()),
            Descr::Fields(fields) => {
                let field = |NpyField { name, descr, kind, .. }: &NpyField| {
                    let quote = if name.contains('\'') { '"' } else { '\'' };
                    let descr = kind.map_or_else(|| descr.clone(), |kind| format!("'{}'", kind.name()));
                    format!("({quote}{name}{quote}, {descr})")
                };
                format!("[{}]", fields.iter().map(field).collect::<Vec<_>>().join(", "))
            }
        };
        let shape = match shape {
            [n] => format!("({n},)"),
            _ => format!("({})", shape.iter().map(u64::to_string).collect::<Vec<_>>().join(", ")),
        };
        let fortran = if fortran { "True" } else { "False" };
        Self::framed(format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}"))
    }

    /// The bytes of a header with this dictionary: the magic number, the length, blanks up to a multiple of 64.
    pub fn framed(mut text: String) -> Vec<u8> {
        let short = text.len() + 64 < usize::from(u16::MAX);
        let before = if short { 10 } else { 12 };
        while !(before + text.len() + 1).is_multiple_of(64) {
            text.push(' ');
        }
        text.push('\n');
        let mut bytes = b"\x93NUMPY".to_vec();
        if short {
            bytes.extend([1, 0]);
            bytes.extend((text.len() as u16).to_le_bytes());
        } else {
            bytes.extend([2, 0]);
            bytes.extend((text.len() as u32).to_le_bytes());
        }
        bytes.extend(text.bytes());
        bytes
    }
}

/// Goes through the text from the front; nothing in it is nested deeper than two levels.
struct Parser<'a> {
    rest: &'a [u8],
    booleans: bool,
}

impl<'a> Parser<'a> {
    fn error(&self, expected: &str) -> FormatError {
        let found = if self.rest.is_empty() { "its end".to_owned() } else { quote(self.rest) };
        FormatError::Content(format!("the NumPy header has {found} where {expected} is expected"))
    }

    /// Passes over `byte` and white space before it, if it is next.
    fn eat(&mut self, byte: u8) -> bool {
        self.rest = self.rest.trim_ascii_start();
        let rest = self.rest.strip_prefix(&[byte]);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }

    fn expect(&mut self, byte: u8) -> Result<(), FormatError> {
        if self.eat(byte) { Ok(()) } else { Err(self.error(&format!("`{}`", char::from(byte)))) }
    }

    fn string(&mut self) -> Result<&'a [u8], FormatError> {
        let quote = if self.eat(b'\'') {
            b'\''
        } else if self.eat(b'"') {
            b'"'
        } else {
            return Err(self.error("a string"));
        };
        let end =
            self.rest.iter().position(|&b| b == quote).ok_or_else(|| self.error("the end of a string"))?;
        let string = &self.rest[..end];
        self.rest = &self.rest[end + 1..];
        Ok(string)
    }

    fn word(&mut self) -> &'a [u8] {
        self.rest = self.rest.trim_ascii_start();
        let end = self.rest.iter().position(|b| !b.is_ascii_alphanumeric()).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        word
    }

    fn dictionary(&mut self) -> Result<NpyHeader, FormatError> {
        let (mut descr, mut fortran, mut shape) = (None, None, None);
        self.expect(b'{')?;
        while !self.eat(b'}') {
            let key = self.string()?;
            self.expect(b':')?;
            match key {
                b"descr" => descr = Some(self.descr()?),
                b"shape" => shape = Some(self.shape()?),
                b"fortran_order" => {
                    fortran = Some(match self.word() {
                        b"True" => true,
                        b"False" => false,
                        _ => return Err(self.error("True or False")),
                    });
                }
                _ => return Err(self.error("one of descr, fortran_order, shape")),
            }
            if !self.eat(b',') {
                self.expect(b'}')?;
                break;
            }
        }
        match (descr, fortran, shape) {
            (Some(descr), Some(fortran), Some(shape)) => {
                Ok(NpyHeader { descr, fortran, shape, booleans: self.booleans, body: 0 })
            }
            _ => Err(FormatError::Content("the NumPy header lacks descr, fortran_order or shape".into())),
        }
    }

    fn descr(&mut self) -> Result<Descr, FormatError> {
        if !self.eat(b'[') {
            let name = self.string()?;
            self.booleans = name.ends_with(b"b1");
            return Ok(Descr::Plain(NpyKind::parse(name)?));
        }
        let mut fields = Vec::new();
        while !self.eat(b']') {
            self.expect(b'(')?;
            let name = String::from_utf8_lossy(self.string()?).into_owned();
            self.expect(b',')?;
            if self.rest.trim_ascii_start().starts_with(b"[") {
                return Err(FormatError::Content(format!(
                    "the field {} holds fields of its own; save its own array, `array[{}]`",
                    quote(name.as_bytes()),
                    quote(name.as_bytes())
                )));
            }
            let mut field = NpyField::new(name, self.string()?)?;
            // A third entry is the shape of an array inside the field.
            if self.eat(b',') && !self.rest.trim_ascii_start().starts_with(b")") {
                let shape = self.shape()?;
                let count = shape.iter().try_fold(1u64, |n, &axis| n.checked_mul(axis));
                let size = count.and_then(|n| usize::try_from(n).ok()?.checked_mul(field.size));
                field.size =
                    size.filter(|&size| size <= 1 << 30).ok_or_else(|| self.error("a smaller shape"))?;
                // Some numbers in a row are fields of their own, which can be named.
                if let ([count @ 1..=64], Some(_)) = (&shape[..], field.kind) {
                    let size = field.size / *count as usize;
                    let part = |number: u64| NpyField {
                        name: format!("{}_{number}", field.name),
                        size,
                        ..field.clone()
                    };
                    fields.extend((0..*count).map(part));
                    self.expect(b')')?;
                    if !self.eat(b',') {
                        self.expect(b']')?;
                        break;
                    }
                    continue;
                }
                let axes: String = shape.iter().map(|axis| format!("{axis}, ")).collect();
                field.descr = format!("{}, ({axes})", field.descr);
                field.kind = None;
            }
            fields.push(field);
            self.expect(b')')?;
            if !self.eat(b',') {
                self.expect(b']')?;
                break;
            }
        }
        Ok(Descr::Fields(fields))
    }

    fn shape(&mut self) -> Result<Vec<u64>, FormatError> {
        let mut shape = Vec::new();
        self.expect(b'(')?;
        while !self.eat(b')') {
            let number = std::str::from_utf8(self.word()).ok().and_then(|word| word.parse().ok());
            shape.push(number.ok_or_else(|| self.error("a size"))?);
            if !self.eat(b',') {
                self.expect(b')')?;
                break;
            }
        }
        Ok(shape)
    }
}
