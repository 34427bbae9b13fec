//! NumPy arrays of points.

mod array;
mod columns;
mod header;
mod shape;

pub use array::Array;
pub(super) use columns::{array_of, array_of_shape, columns, holds_numbers, kind_of};

use std::io::{self, Write};

use self::header::{Descr, NpyField, NpyHeader, NpyKind};
use self::shape::{is_picture, rows_and_columns, squeezed};
use super::outgoing::stays_single;
use super::poses::poses_not_points;
use super::scalar::Scalar;
use super::scan::moved;
use super::width::check_first_column;
use super::{Attribute, CloudFormat, Contents, FormatError, Note, Outgoing, ReadOptions, ReadSwitch, axes};
use crate::Rigid;

const SINGLE: NpyKind = NpyKind { scalar: Scalar::F32, big_endian: false };
const DOUBLE: NpyKind = NpyKind { scalar: Scalar::F64, big_endian: false };

/// An array `[n, columns]` of at least 3 columns, in C or Fortran order, of single or double
/// precision or integers, whose first three columns are x, y and z; or an array `[n]` with fields
/// `x`, `y` and `z`. Written as `float32` or `float64`, with attributes as an array of fields. A moved copy keeps the other columns and fields as they
/// are, normals too, the order, and the type where it holds the moved numbers (otherwise it becomes
/// `float64`).
pub(super) struct Npy;

impl CloudFormat for Npy {
    fn name(&self) -> &'static str {
        "npy"
    }

    fn extensions(&self) -> &[&'static str] {
        &["npy"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        bytes.starts_with(b"\x93NUMPY")
    }

    fn takes(&self) -> &'static [ReadSwitch] {
        &[ReadSwitch::Columns]
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let table = NpyTable::parse(bytes, options)?;
        options.check_points(bytes.len(), table.rows)?;
        let (shape, plain) = (&table.header.shape, matches!(table.header.descr, Descr::Plain(_)));
        if plain && options.columns.is_none() && table.cells.len() <= 16 {
            let rows = (0..table.rows).map(|row| Some(table.row(row)));
            poses_not_points(rows, table.rows)?;
            if is_picture(shape, &table.header.descr) {
                return Err(FormatError::unclear(
                    format!(
                        "an array of shape {shape:?} of 8-bit numbers is a picture; if its numbers are points all the same, such as 1,2,3"
                    ),
                    "--columns",
                ));
            }
        }
        let points = table.points();
        if plain && options.columns.is_none() && table.cells.len() > 3 {
            check_first_column(&points)?;
        }
        let single =
            table.axes.iter().all(|&axis| table.cells[axis].kind.is_some_and(|k| k.scalar.is_single()));
        let mut contents = Contents { points, single, ..Contents::default() };
        if shape.len() > if plain { 2 } else { 1 } {
            contents.notes.push(Note::Flattened { shape: shape.clone() });
        }
        if let [height, width, _] = squeezed(shape)[..]
            && plain
            && height > 1
            && !table.header.fortran
        {
            contents.grid =
                usize::try_from(width).ok().zip(usize::try_from(height).ok()).map(|(w, h)| [w, h]);
        }
        Ok(contents)
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        Ok(NpyTable::parse(bytes, options)?.attributes())
    }

    fn has_both_precisions(&self) -> bool {
        true
    }

    fn keeps(&self, _: &Attribute, _: &Outgoing<'_>) -> bool {
        true
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        let kind = if cloud.single { SINGLE } else { DOUBLE };
        let rows = cloud.points.len() as u64;
        let (descr, shape) = if cloud.attributes.is_empty() {
            (Descr::Plain(kind), vec![rows, 3])
        } else {
            (Descr::Fields(fields_of(cloud, kind)), vec![rows])
        };
        out.write_all(&NpyHeader::bytes(&descr, false, &shape))?;
        let mut row = Vec::with_capacity(64);
        cloud.points.iter().enumerate().try_for_each(|(index, point)| {
            row.clear();
            point.iter().for_each(|&c| kind.scalar.put(c, false, &mut row));
            cloud.attributes.iter().for_each(|attribute| attribute.values.put(index, &mut row));
            out.write_all(&row)
        })
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        let table = NpyTable::parse(bytes, options)?;
        options.check_points(bytes.len() + table.body.len(), 2 * table.rows)?;
        let old = table.points();
        let new: Vec<[f64; 3]> = old.iter().map(|&point| moved(motion, point)).collect();
        let kind_of = |axis: usize| table.cells[table.axes[axis]].kind.unwrap_or(DOUBLE);
        let single = (0..3).all(|axis| kind_of(axis).scalar.is_single()) && stays_single(&old, &new).is_ok();
        let fits =
            |axis: usize| kind_of(axis).scalar.for_moved(axis, &old, &new, single) == kind_of(axis).scalar;
        let all_fit = (0..3).all(fits);
        // All columns of a plain array have one type.
        let mut kinds: Vec<Option<NpyKind>> = table.cells.iter().map(|cell| cell.kind).collect();
        let mut header = table.header.clone();
        match &mut header.descr {
            _ if all_fit => {}
            Descr::Plain(kind) => {
                *kind = DOUBLE;
                kinds = vec![Some(DOUBLE); kinds.len()];
            }
            Descr::Fields(fields) => {
                for &axis in &table.axes {
                    let kind = NpyKind { scalar: Scalar::F64, ..kinds[axis].unwrap_or(DOUBLE) };
                    (kinds[axis], fields[axis].kind) = (Some(kind), Some(kind));
                    fields[axis].descr = format!("'{}'", kind.name());
                }
            }
        }
        if all_fit {
            out.write_all(&bytes[..header.body])?;
        } else {
            out.write_all(&NpyHeader::bytes(&header.descr, header.fortran, &header.shape))?;
        }
        let mut cells: Vec<u8> = Vec::with_capacity(table.body.len());
        table.in_order(|row, column| {
            let place = table.place(row, column);
            let (from, to) = match (table.cells[column].kind, kinds[column]) {
                (Some(from), Some(to)) => (from, to),
                _ => return cells.extend_from_slice(&table.body[place..place + table.cells[column].size]),
            };
            let axis = table.axes.iter().position(|&axis| axis == column);
            let changed = axis.filter(|&axis| new[row][axis] != old[row][axis] && !old[row][axis].is_nan());
            match changed {
                None if from == to => cells.extend_from_slice(&table.body[place..place + from.scalar.size()]),
                None => {
                    let value = from.scalar.get(table.body, place, from.big_endian).unwrap_or(f64::NAN);
                    to.scalar.put(value, to.big_endian, &mut cells);
                }
                Some(axis) => to.scalar.put(new[row][axis], to.big_endian, &mut cells),
            }
        });
        out.write_all(&cells)
    }
}

/// The fields x, y and z of this type, and those of the attributes.
fn fields_of(cloud: &Outgoing<'_>, kind: NpyKind) -> Vec<NpyField> {
    let field = |name: &str, kind: NpyKind| {
        // What would end the name in the header.
        let name = name.replace(['\'', '"', '\\', '\n', '\r'], "_");
        NpyField { name, descr: String::new(), kind: Some(kind), size: kind.scalar.size() }
    };
    let axes = ["x", "y", "z"].map(|axis| field(axis, kind)).into_iter();
    let others = cloud.attributes.iter().map(|attribute| {
        field(&attribute.name, NpyKind { scalar: attribute.values.scalar(), big_endian: false })
    });
    axes.chain(others).collect()
}

/// A column of an array.
struct ArrayCell {
    /// The type, where it is one of single numbers.
    kind: Option<NpyKind>,
    /// Bytes of a cell, offset of the first one, and step from row to row.
    size: usize,
    at: usize,
    step: usize,
}

/// The numbers of an array as rows and columns.
pub(super) struct NpyTable<'a> {
    header: NpyHeader,
    body: &'a [u8],
    rows: usize,
    cells: Vec<ArrayCell>,
    /// The columns of x, y and z.
    axes: [usize; 3],
}

/// The name by which all formats know a field.
pub(super) fn known(name: &str) -> String {
    match &*name.to_ascii_lowercase() {
        "r" => "red".into(),
        "g" => "green".into(),
        "b" => "blue".into(),
        "normal_x" => "nx".into(),
        "normal_y" => "ny".into(),
        "normal_z" => "nz".into(),
        "i" => "intensity".into(),
        other => other.to_owned(),
    }
}

/// Most columns of an array without rows.
const MOST_COLUMNS: u64 = 64;

/// Whether the array at the begin of `bytes` could be a cloud.
pub(super) fn could_be_cloud(bytes: &[u8]) -> bool {
    let Ok(header) = NpyHeader::parse(bytes) else { return false };
    match &header.descr {
        Descr::Plain(_) if header.booleans => false,
        Descr::Plain(_) => rows_and_columns(&header.shape, false).is_ok(),
        Descr::Fields(fields) => matches!(axes::find(&names(fields)), axes::Axes::Found(_)),
    }
}

fn names(fields: &[NpyField]) -> Vec<String> {
    fields.iter().map(|field| field.name.clone()).collect()
}

impl<'a> NpyTable<'a> {
    pub fn parse(bytes: &'a [u8], options: &ReadOptions) -> Result<Self, FormatError> {
        let header = NpyHeader::parse(bytes)?;
        if header.booleans {
            return Err(FormatError::Content("the array holds truth values and no coordinates".into()));
        }
        let body = &bytes[header.body..];
        let shape = &header.shape;
        let (rows, width, stride) = match &header.descr {
            Descr::Plain(kind) => {
                let (rows, columns) = rows_and_columns(shape, options.columns.is_some())?;
                (rows, columns, columns.checked_mul(kind.scalar.size() as u64))
            }
            Descr::Fields(fields) => {
                let rows = shape.iter().try_fold(1u64, |n, &axis| n.checked_mul(axis)).unwrap_or(u64::MAX);
                let stride = fields.iter().try_fold(0u64, |n, field| n.checked_add(field.size as u64));
                (rows, fields.len() as u64, stride)
            }
        };
        let expected = stride.and_then(|stride| usize::try_from(rows.checked_mul(stride)?).ok());
        let Some(expected) = expected else {
            return Err(FormatError::Content(format!("an array of shape {shape:?}, which no memory holds")));
        };
        if expected != body.len() {
            let announced = format!("an array of shape {shape:?} in {expected} bytes");
            return Err(FormatError::truncated(announced, format!("{} bytes", body.len())));
        }
        // Both are bounded by the bytes that are there, but for arrays without rows.
        let rows = usize::try_from(rows).unwrap_or(0);
        let width =
            if rows == 0 { width.min(MOST_COLUMNS) as usize } else { usize::try_from(width).unwrap_or(0) };
        let mut cells = Vec::new();
        let axes = match &header.descr {
            Descr::Plain(kind) => {
                let size = kind.scalar.size();
                options.check_memory("the columns of the array", bytes.len(), width.saturating_mul(64))?;
                for column in 0..width {
                    let (at, step) = if header.fortran {
                        (column * rows * size, size)
                    } else {
                        (column * size, width * size)
                    };
                    cells.push(ArrayCell { kind: Some(*kind), size, at, step });
                }
                match &options.columns {
                    // Columns without names are named by their numbers.
                    Some(asked) => {
                        let numbers: Vec<String> = (1..=width.min(1000)).map(|n| n.to_string()).collect();
                        axes::choose(&numbers, Some(asked))?
                    }
                    None => [0, 1, 2],
                }
            }
            Descr::Fields(fields) => {
                let step = fields.iter().map(|field| field.size).sum();
                let mut at = 0;
                for field in fields {
                    cells.push(ArrayCell { kind: field.kind, size: field.size, at, step });
                    at += field.size;
                }
                axes::choose(&names(fields), options.columns.as_ref())?
            }
        };
        if let Some(&axis) = axes.iter().find(|&&axis| cells[axis].kind.is_none()) {
            return Err(FormatError::Content(format!(
                "the field number {} holds no single numbers",
                axis + 1
            )));
        }
        Ok(Self { header, body, rows, cells, axes })
    }

    fn place(&self, row: usize, column: usize) -> usize {
        self.cells[column].at + row * self.cells[column].step
    }

    fn points(&self) -> Vec<[f64; 3]> {
        let kinds = self.axes.map(|column| self.cells[column].kind.unwrap_or(DOUBLE));
        let value = |row: usize, axis: usize| {
            let number =
                kinds[axis].scalar.get(self.body, self.place(row, self.axes[axis]), kinds[axis].big_endian);
            number.unwrap_or(f64::NAN)
        };
        (0..self.rows).map(|row| [value(row, 0), value(row, 1), value(row, 2)]).collect()
    }

    /// All numbers of a row of a plain array.
    fn row(&self, row: usize) -> Vec<f64> {
        let value = |column: usize| {
            let kind = self.cells[column].kind?;
            kind.scalar.get(self.body, self.place(row, column), kind.big_endian)
        };
        (0..self.cells.len()).map(|column| value(column).unwrap_or(f64::NAN)).collect()
    }

    /// The named fields but x, y and z.
    fn attributes(&self) -> Vec<Attribute> {
        let Descr::Fields(fields) = &self.header.descr else { return Vec::new() };
        let others = fields.iter().enumerate().filter(|(column, _)| !self.axes.contains(column));
        others
            .filter_map(|(column, NpyField { name, kind, .. })| {
                let kind = (*kind)?;
                let places = (0..self.rows).map(|row| self.place(row, column));
                let values = kind.scalar.column(self.body, kind.big_endian, places);
                Some(Attribute { name: known(name), values })
            })
            .collect()
    }

    /// Calls `each` with the row and the column of every number, in the order of the file.
    fn in_order(&self, mut each: impl FnMut(usize, usize)) {
        let columns = self.cells.len();
        if self.header.fortran && matches!(self.header.descr, Descr::Plain(_)) {
            (0..columns).for_each(|column| (0..self.rows).for_each(|row| each(row, column)));
        } else {
            (0..self.rows).for_each(|row| (0..columns).for_each(|column| each(row, column)));
        }
    }
}

#[cfg(test)]
mod tests;
