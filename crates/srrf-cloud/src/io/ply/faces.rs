//! The faces of a PLY file as triangles.

use super::super::{FormatError, ReadOptions};
use super::cursor::{Cursor, cut_short};
use super::header::{Element, PlyEncoding, Property};

/// An element whose rows are polygons, or strips of triangles.
pub(super) struct Faces<'a> {
    pub element: &'a Element,
    /// The property that lists the corners.
    pub list: usize,
    /// Number of points that the file announces.
    pub vertices: u64,
    /// Bytes of memory in use.
    pub held: usize,
}

impl Faces<'_> {
    /// The triangles at the cursor, which moves behind them.
    pub fn read(&self, cursor: &mut Cursor, options: &ReadOptions) -> Result<Vec<[u32; 3]>, FormatError> {
        let strips = self.element.name == "tristrips";
        let mut triangles = Vec::new();
        let mut corners = Vec::new();
        for row in 0..self.element.count {
            for (index, property) in self.element.properties.iter().enumerate() {
                let whole = if index == self.list {
                    self.corners(cursor, property, &mut corners, options)?
                } else {
                    cursor.property(property)?.is_some()
                };
                if !whole {
                    return Err(cut_short(self.element, row));
                }
            }
            for strip in corners.split(|&corner| corner == RESTART) {
                for at in 0..strip.len().saturating_sub(2) {
                    let [a, b, c] = [strip[at], strip[at + 1], strip[at + 2]];
                    options.grow("the faces", self.held, &mut triangles)?;
                    // A strip turns round with each triangle.
                    triangles.push(match (strips, at.is_multiple_of(2)) {
                        (false, _) => [strip[0], b, c],
                        (true, true) => [a, b, c],
                        (true, false) => [b, a, c],
                    });
                }
            }
        }
        Ok(triangles)
    }

    /// The corners of a row; whether the file holds them all.
    fn corners(
        &self,
        cursor: &mut Cursor,
        property: &Property,
        corners: &mut Vec<u32>,
        options: &ReadOptions,
    ) -> Result<bool, FormatError> {
        corners.clear();
        let Some(length) = property.length else { return Ok(false) };
        let Some((_, count)) = cursor.count(length, property)? else { return Ok(false) };
        for _ in 0..count {
            let Some(place) = cursor.next(property.scalar) else { return Ok(false) };
            let value = cursor.value(&place, property.scalar)?;
            options.grow("the corners of a face", self.held, corners)?;
            // -1 begins a new strip.
            if value == -1.0 && self.element.name == "tristrips" {
                corners.push(RESTART);
            } else if value >= 0.0 && value.fract() == 0.0 && value < self.vertices.min(RESTART.into()) as f64
            {
                corners.push(value as u32);
            } else {
                let problem = format!("a face names vertex {value}, and there are {}", self.vertices);
                return Err(match cursor.encoding {
                    PlyEncoding::Ascii => FormatError::line(cursor.line(place.start), problem),
                    PlyEncoding::Binary { .. } => {
                        FormatError::Content(format!("byte {}: {problem}", place.start))
                    }
                });
            }
        }
        Ok(true)
    }
}

/// Stands for the end of a strip among its corners.
const RESTART: u32 = u32::MAX;
