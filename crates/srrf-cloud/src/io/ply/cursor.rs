//! [`Cursor`]: number by number through the rows behind the header of a PLY file.

use std::ops::Range;

use super::super::FormatError;
use super::super::scalar::Scalar;
use super::super::scan::number;
use super::header::{Element, PlyEncoding, PlyHeader, Property};

/// A place in the body that moves on number by number.
pub(super) struct Cursor<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
    pub encoding: PlyEncoding,
}

impl<'a> Cursor<'a> {
    /// The place of the first row of `vertex`, and that element.
    pub fn at_vertices<'h>(
        bytes: &'a [u8],
        header: &'h PlyHeader,
    ) -> Result<(Self, &'h Element), FormatError> {
        let mut cursor = Self { bytes, at: header.body, encoding: header.encoding };
        for element in &header.elements {
            if element.name == "vertex" {
                return Ok((cursor, element));
            }
            cursor.skip_element(element)?;
        }
        Err(no_vertices())
    }

    /// The place of the next number; `None` at the end.
    #[inline]
    pub fn next(&mut self, scalar: Scalar) -> Option<Range<usize>> {
        let rest = self.bytes.get(self.at..)?;
        let (skipped, length) = match self.encoding {
            PlyEncoding::Binary { .. } => (0, (rest.len() >= scalar.size()).then_some(scalar.size())?),
            PlyEncoding::Ascii => {
                let begin = rest.iter().position(|b| !b.is_ascii_whitespace())?;
                let word = &rest[begin..];
                (begin, word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len()))
            }
        };
        let begin = self.at + skipped;
        self.at = begin + length;
        Some(begin..self.at)
    }

    /// The number at a place from [`next`](Self::next).
    #[inline]
    pub fn value(&self, place: &Range<usize>, scalar: Scalar) -> Result<f64, FormatError> {
        match self.encoding {
            PlyEncoding::Binary { big_endian } => scalar
                .get(self.bytes, place.start, big_endian)
                .ok_or_else(|| FormatError::truncated("a number", "the end of the file")),
            PlyEncoding::Ascii => {
                number(&self.bytes[place.clone()]).map_err(|e| FormatError::line(self.line(place.start), e))
            }
        }
    }

    /// The line that holds the byte at `at`, from 1.
    pub fn line(&self, at: usize) -> usize {
        1 + self.bytes[..at].iter().filter(|&&b| b == b'\n').count()
    }

    /// Passes over a property; its place if it is a scalar. `None` at the end of the file.
    pub fn property(&mut self, property: &Property) -> Result<Option<Range<usize>>, FormatError> {
        let Some(length) = property.length else { return Ok(self.next(property.scalar)) };
        let Some((place, count)) = self.count(length, property)? else { return Ok(None) };
        if let PlyEncoding::Binary { .. } = self.encoding {
            // More than there are bytes is the end of the file.
            let bytes = count.checked_mul(property.scalar.size());
            return Ok(bytes.filter(|&n| n <= self.bytes.len() - self.at).map(|n| {
                self.at += n;
                place
            }));
        }
        let whole = (0..count).all(|_| self.next(property.scalar).is_some());
        Ok(whole.then_some(place))
    }

    /// The length of a list, and where it is. `None` at the end of the file.
    pub fn count(
        &mut self,
        length: Scalar,
        property: &Property,
    ) -> Result<Option<(Range<usize>, usize)>, FormatError> {
        let Some(place) = self.next(length) else { return Ok(None) };
        let count = self.value(&place, length)?;
        if !(count >= 0.0 && count.fract() == 0.0) {
            let problem = format!("the list `{}` has the length {count}", property.name);
            return Err(match self.encoding {
                PlyEncoding::Ascii => FormatError::line(self.line(place.start), problem),
                PlyEncoding::Binary { .. } => {
                    FormatError::Content(format!("byte {}: {problem}", place.start))
                }
            });
        }
        // A count in floating point saturates.
        Ok(Some((place, count as usize)))
    }

    pub fn skip_element(&mut self, element: &Element) -> Result<(), FormatError> {
        // Rows without properties take no bytes.
        let rows = if element.properties.is_empty() { 0 } else { element.count };
        if let (PlyEncoding::Binary { .. }, Some(stride)) = (self.encoding, element.stride()) {
            let whole = (self.bytes.len() - self.at) / stride.max(1);
            let count = usize::try_from(rows).unwrap_or(usize::MAX);
            if count > whole {
                return Err(cut_short(element, whole as u64));
            }
            self.at += count * stride;
            return Ok(());
        }
        for row in 0..rows {
            for property in &element.properties {
                if self.property(property)?.is_none() {
                    return Err(cut_short(element, row));
                }
            }
        }
        Ok(())
    }

    /// Goes through the rows of the vertices: `row` gets the places of all properties.
    pub fn rows(
        &mut self,
        element: &Element,
        mut row: impl FnMut(&Self, &[Range<usize>]) -> Result<(), FormatError>,
    ) -> Result<(), FormatError> {
        let mut places = Vec::with_capacity(element.properties.len());
        for index in 0..element.count {
            places.clear();
            for property in &element.properties {
                places.push(self.property(property)?.ok_or_else(|| cut_short(element, index))?);
            }
            row(self, &places)?;
        }
        Ok(())
    }
}

pub(super) fn cut_short(element: &Element, found: u64) -> FormatError {
    FormatError::truncated(format!("{} elements `{}`", element.count, element.name), found.to_string())
}

pub(super) fn no_vertices() -> FormatError {
    FormatError::Content("the file has no element `vertex`: it holds no points".into())
}
