//! The points behind the header of a PCD file.

use std::borrow::Cow;

use super::super::scan::{ByteLines, Line, number, quote};
use super::super::{Contents, FormatError, ReadOptions};
use super::header::{PcdEncoding, PcdHeader};
use super::lzf;

/// The numbers of a binary file, one field after the other or point by point.
pub(super) struct PcdTable<'a> {
    pub bytes: Cow<'a, [u8]>,
    /// Of each field: the offset of its first number, and the step from point to point.
    pub layout: Vec<(usize, usize)>,
}

impl<'a> PcdTable<'a> {
    /// # Errors
    /// [`FormatError`] where there are other numbers than the header announces.
    pub fn new(bytes: &'a [u8], header: &PcdHeader, options: &ReadOptions) -> Result<Self, FormatError> {
        let rest = bytes.get(header.body..).unwrap_or_default();
        let announced = || {
            let stride =
                header.sizes().map_or_else(|| "too many".to_owned(), |(stride, _)| stride.to_string());
            format!("{} points of {stride} bytes", header.points)
        };
        let short = |found: usize| FormatError::truncated(announced(), format!("{found} bytes"));
        let (stride, size) = header.sizes().ok_or_else(|| short(rest.len()))?;
        let mut layout = Vec::with_capacity(header.fields.len());
        let mut at = 0;
        if header.encoding == PcdEncoding::Binary {
            let body = rest.get(..size).ok_or_else(|| short(rest.len()))?;
            if rest.len() - size >= stride.max(1) && rest[size..].iter().any(|&b| b != 0) {
                let problem = format!(
                    "{} announced, but {} bytes follow; correct POINTS and WIDTH",
                    announced(),
                    rest.len()
                );
                return Err(FormatError::Content(problem));
            }
            for field in &header.fields {
                layout.push((at, stride));
                at += field.bytes();
            }
            return Ok(Self { bytes: Cow::Borrowed(body), layout });
        }
        let word = |at: usize| {
            let bytes = rest.get(at..).and_then(|rest| rest.first_chunk::<4>());
            bytes.map(|&bytes| u32::from_le_bytes(bytes) as usize)
        };
        let (Some(packed), Some(unpacked)) = (word(0), word(4)) else { return Err(short(rest.len())) };
        if unpacked != size {
            let problem = format!("{} announced, but the compressed data are {unpacked} bytes", announced());
            return Err(FormatError::Content(problem));
        }
        let found = rest.len() - 8;
        let body = rest[8..].get(..packed).ok_or_else(|| {
            FormatError::truncated(format!("{packed} bytes of compressed data"), format!("{found} bytes"))
        })?;
        options.check_memory("the unpacked points", bytes.len(), size)?;
        let unpacked = lzf::decompress(body, size)
            .ok_or_else(|| FormatError::Content("the compressed data are damaged".into()))?;
        for field in &header.fields {
            layout.push((at, field.bytes()));
            at += field.bytes() * header.points;
        }
        Ok(Self { bytes: Cow::Owned(unpacked), layout })
    }

    /// Where the first number of a field of a point is.
    #[inline]
    pub fn place(&self, field: usize, point: usize) -> usize {
        let (begin, step) = self.layout[field];
        begin + step * point
    }

    /// Three fields of all points.
    pub fn triples(&self, header: &PcdHeader, fields: [usize; 3]) -> Vec<[f64; 3]> {
        let value = |field: usize, point: usize| {
            let number = header.fields[field].scalar.get(&self.bytes, self.place(field, point), false);
            number.unwrap_or(f64::NAN)
        };
        (0..header.points).map(|point| fields.map(|field| value(field, point))).collect()
    }
}

/// Goes through the lines of a text file: `each` gets the words of a point.
pub(super) fn ascii_rows<E: From<FormatError>>(
    bytes: &[u8],
    header: &PcdHeader,
    mut each: impl FnMut(&Line, &[(usize, &[u8])]) -> Result<(), E>,
) -> Result<(), E> {
    let columns = header.fields.iter().map(|field| field.count).sum::<usize>();
    let mut words = Vec::new();
    let mut found = 0;
    for line in ByteLines::new(&bytes[header.body..]) {
        let number = line.number + header.lines;
        let line = Line { number, start: line.start + header.body, ..line };
        words.clear();
        words.extend(line.words());
        if words.is_empty() {
            continue;
        }
        if words.len() != columns {
            return Err(line.error(format!("{} words where {columns} are expected", words.len())).into());
        }
        if found == header.points {
            let problem = format!("{found} points announced, but more follow; correct POINTS and WIDTH");
            return Err(line.error(problem).into());
        }
        found += 1;
        each(&line, &words)?;
    }
    if found < header.points {
        return Err(FormatError::truncated(format!("{} points", header.points), found.to_string()).into());
    }
    Ok(())
}

/// The index of the first word of a field on a line.
pub(super) fn column(header: &PcdHeader, field: usize) -> usize {
    header.fields[..field].iter().map(|field| field.count).sum()
}

/// Three numbers of a line.
pub(super) fn numbers(
    line: &Line,
    words: &[(usize, &[u8])],
    columns: [usize; 3],
) -> Result<[f64; 3], FormatError> {
    let value = |column: usize| number(words[column].1).map_err(|problem| line.error(problem));
    Ok([value(columns[0])?, value(columns[1])?, value(columns[2])?])
}

/// The points of a PCD file.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
    if !bytes.iter().find(|b| !b.is_ascii_whitespace()).is_some_and(|b| b"#VFCvfc".contains(b)) {
        let begin = quote(&bytes[..bytes.len().min(20)]);
        return Err(FormatError::Content(format!("the file begins with {begin}, not with a PCD header")));
    }
    let header = PcdHeader::parse(bytes)?;
    let axes = header.axes()?;
    let contents = |points| Contents {
        points,
        single: axes.iter().all(|&axis| header.fields[axis].scalar.is_single()),
        viewpoint: header.viewpoint,
        grid: header.grid,
        ..Contents::default()
    };
    if header.encoding != PcdEncoding::Ascii {
        let table = PcdTable::new(bytes, &header, options)?;
        let held = bytes.len() + if matches!(table.bytes, Cow::Owned(_)) { table.bytes.len() } else { 0 };
        options.check_points(held, header.points)?;
        return Ok(contents(table.triples(&header, axes)));
    }
    let columns = axes.map(|axis| column(&header, axis));
    // The count is not trusted with memory: a number takes two bytes or more.
    let most = header.points.min((bytes.len() - header.body) / 6 + 1);
    options.check_points(bytes.len(), most)?;
    let mut points = Vec::with_capacity(most);
    ascii_rows(bytes, &header, |line, words| {
        points.push(numbers(line, words, columns)?);
        Ok::<_, FormatError>(())
    })?;
    Ok(contents(points))
}
