//! Cells of VTK as triangles: polygons as fans, strips and quads cut, everything else passed over.

use super::super::FormatError;

/// What the connectivity of a list of cells describes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum CellKind {
    /// A convex polygon, its corners in order.
    Polygon,
    /// A strip of triangles.
    Strip,
    /// Four corners in the order of an image: the last two are swapped.
    Pixel,
    /// Points, lines, volumes: no surface of their own.
    Other,
}

impl CellKind {
    /// The kind of a cell type of VTK (`vtkCellType.h`); of curved faces the corners come first, and
    /// `corners` says how many of them there are.
    pub fn of_type(number: f64) -> (Self, Option<usize>) {
        match number as i64 {
            5 | 7 | 9 => (Self::Polygon, None),
            6 => (Self::Strip, None),
            8 => (Self::Pixel, None),
            // Triangles and quads of second order: corners, then the middles of edges.
            22 | 34 => (Self::Polygon, Some(3)),
            23 | 28 | 30 => (Self::Polygon, Some(4)),
            _ => (Self::Other, None),
        }
    }
}

/// Appends the triangles of one cell.
///
/// # Errors
/// [`FormatError::Content`] where a corner is none of the `points` points.
pub(super) fn add_cell(
    kind: CellKind,
    corners: &[f64],
    points: usize,
    faces: &mut Vec<[u32; 3]>,
) -> Result<(), FormatError> {
    let index = |at: usize| {
        let corner = corners.get(at).copied().unwrap_or(-1.0);
        if corner >= 0.0 && corner < points as f64 && corner.fract() == 0.0 {
            return u32::try_from(corner as u64).map_err(|_| too_many());
        }
        Err(FormatError::Content(format!("a cell names point {corner} of {points}")))
    };
    match kind {
        CellKind::Other => {}
        CellKind::Polygon => {
            for next in 2..corners.len() {
                faces.push([index(0)?, index(next - 1)?, index(next)?]);
            }
        }
        CellKind::Pixel if corners.len() == 4 => {
            faces.push([index(0)?, index(1)?, index(3)?]);
            faces.push([index(0)?, index(3)?, index(2)?]);
        }
        CellKind::Pixel => {}
        CellKind::Strip => {
            for next in 2..corners.len() {
                let [a, b] = if next % 2 == 0 { [next - 2, next - 1] } else { [next - 1, next - 2] };
                faces.push([index(a)?, index(b)?, index(next)?]);
            }
        }
    }
    Ok(())
}

fn too_many() -> FormatError {
    FormatError::Content("a mesh of more than 4,294,967,295 points".into())
}

/// Appends the triangles of cells given as offsets and connectivity, where cell `i` has the corners
/// from `ends[i - 1]` (0 for the first) up to `ends[i]`.
///
/// # Errors
/// [`FormatError::Content`] where the offsets leave the connectivity.
pub(super) fn add_cells(
    kinds: impl Fn(usize) -> (CellKind, Option<usize>),
    ends: &[f64],
    connectivity: &[f64],
    points: usize,
    faces: &mut Vec<[u32; 3]>,
) -> Result<(), FormatError> {
    let mut begin = 0usize;
    for (cell, &end) in ends.iter().enumerate() {
        let usable = end >= begin as f64 && end <= connectivity.len() as f64;
        if !usable {
            let problem = format!("cell {cell} ends at {end} of {} corners", connectivity.len());
            return Err(FormatError::Content(problem));
        }
        let end = end as usize;
        let (kind, corners) = kinds(cell);
        let all = &connectivity[begin..end];
        add_cell(kind, &all[..corners.unwrap_or(all.len()).min(all.len())], points, faces)?;
        begin = end;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faces(kind: CellKind, corners: &[f64]) -> Result<Vec<[u32; 3]>, FormatError> {
        let mut faces = Vec::new();
        add_cell(kind, corners, 6, &mut faces).map(|()| faces)
    }

    #[test]
    fn cells_become_triangles() {
        let polygon = faces(CellKind::Polygon, &[5.0, 1.0, 2.0, 3.0]);
        assert_eq!(polygon, Ok(vec![[5, 1, 2], [5, 2, 3]]));
        assert_eq!(faces(CellKind::Pixel, &[0.0, 1.0, 2.0, 3.0]), Ok(vec![[0, 1, 3], [0, 3, 2]]));
        let strip = faces(CellKind::Strip, &[0.0, 1.0, 2.0, 3.0, 4.0]);
        assert_eq!(strip, Ok(vec![[0, 1, 2], [2, 1, 3], [2, 3, 4]]), "all turn the same way");
        assert_eq!(faces(CellKind::Other, &[99.0]), Ok(vec![]));
        for wrong in [6.0, -1.0, 0.5, f64::NAN] {
            assert!(faces(CellKind::Polygon, &[0.0, 1.0, wrong]).is_err(), "{wrong}");
        }
    }

    #[test]
    fn offsets_stay_inside() {
        let mut faces = Vec::new();
        let polygon = |_| (CellKind::Polygon, None);
        let corners = [0.0, 1.0, 2.0, 1.0, 2.0, 3.0];
        add_cells(polygon, &[3.0, 6.0], &corners, 4, &mut faces).unwrap();
        assert_eq!(faces, [[0, 1, 2], [1, 2, 3]]);
        for ends in [[3.0, 7.0], [4.0, 3.0], [f64::NAN, 6.0], [-1.0, 6.0]] {
            assert!(add_cells(polygon, &ends, &corners, 4, &mut faces).is_err(), "{ends:?}");
        }
    }
}
