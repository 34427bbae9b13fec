//! NumPy arrays of points.

mod array;
mod columns;
mod header;

pub use array::Array;
pub(super) use columns::{array_of, columns};

use std::io::{self, Write};

use self::header::{Descr, NpyHeader, NpyKind};
use super::outgoing::stays_single;
use super::scalar::Scalar;
use super::scan::moved;
use super::{Attribute, CloudFormat, Contents, FormatError, Outgoing, ReadOptions};
use crate::Rigid;

const SINGLE: NpyKind = NpyKind { scalar: Scalar::F32, big_endian: false };
const DOUBLE: NpyKind = NpyKind { scalar: Scalar::F64, big_endian: false };

/// An array `[n, columns]` of at least 3 columns, in C or Fortran order, of single or double
/// precision or integers, whose first three columns are x, y and z; or an array `[n]` with fields
/// `x`, `y` and `z`. Written as `float32` or `float64`. A moved copy keeps the other columns and fields as they
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

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let table = NpyTable::parse(bytes)?;
        options.check_points(bytes.len(), table.rows)?;
        let single = table.axes.iter().all(|&axis| table.kinds[axis].scalar.is_single());
        Ok(Contents { points: table.points(), single, ..Contents::default() })
    }

    fn attributes(&self, bytes: &[u8], _: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        Ok(NpyTable::parse(bytes)?.attributes())
    }

    fn write(&self, points: &[[f64; 3]], out: &mut dyn Write) -> io::Result<()> {
        self.write_cloud(&Outgoing::of_points(points), out)
    }

    fn has_both_precisions(&self) -> bool {
        true
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        let kind = if cloud.single { SINGLE } else { DOUBLE };
        out.write_all(&NpyHeader::bytes(&Descr::Plain(kind), false, &[cloud.points.len() as u64, 3]))?;
        let mut row = Vec::with_capacity(24);
        cloud.points.iter().try_for_each(|point| {
            row.clear();
            point.iter().for_each(|&c| kind.scalar.put(c, false, &mut row));
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
        let table = NpyTable::parse(bytes)?;
        options.check_points(bytes.len(), 2 * table.rows)?;
        let old = table.points();
        let new: Vec<[f64; 3]> = old.iter().map(|&point| moved(motion, point)).collect();
        let kind = |axis: usize| table.kinds[table.axes[axis]].scalar;
        let single = (0..3).all(|axis| kind(axis).is_single()) && stays_single(&old, &new).is_ok();
        let fits = |axis: usize| kind(axis).for_moved(axis, &old, &new, single) == kind(axis);
        let all_fit = (0..3).all(fits);
        // All columns of a plain array have one type.
        let kinds: Vec<NpyKind> = match &table.header.descr {
            _ if all_fit => table.kinds.clone(),
            Descr::Plain(_) => vec![DOUBLE; table.kinds.len()],
            Descr::Fields(_) => {
                let mut kinds = table.kinds.clone();
                table.axes.iter().for_each(|&axis| kinds[axis].scalar = Scalar::F64);
                kinds
            }
        };
        let descr = match &table.header.descr {
            Descr::Plain(_) => Descr::Plain(kinds[0]),
            Descr::Fields(fields) => Descr::Fields(
                fields.iter().zip(&kinds).map(|((name, _), &kind)| (name.clone(), kind)).collect(),
            ),
        };
        if all_fit {
            out.write_all(&bytes[..table.header.body])?;
        } else {
            out.write_all(&NpyHeader::bytes(&descr, table.header.fortran, &table.header.shape))?;
        }
        let mut cells: Vec<u8> = Vec::with_capacity(table.body.len());
        table.in_order(|row, column| {
            let (from, to) = (table.kinds[column], kinds[column]);
            let place = table.place(row, column);
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

/// The numbers of an array as rows and columns.
pub(super) struct NpyTable<'a> {
    header: NpyHeader,
    body: &'a [u8],
    rows: usize,
    kinds: Vec<NpyKind>,
    /// Of each column: the offset of its first number, and the step from row to row.
    layout: Vec<(usize, usize)>,
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

/// Whether the array at the begin of `bytes` could be a cloud, and how many bytes it takes.
pub(super) fn cloud_bytes(bytes: &[u8]) -> Option<usize> {
    let header = NpyHeader::parse(bytes).ok()?;
    let columns = match (&header.descr, &header.shape[..]) {
        (Descr::Plain(kind), &[_, columns]) if columns >= 3 => {
            columns.checked_mul(kind.scalar.size() as u64)?
        }
        (Descr::Fields(fields), &[_]) => {
            let named = ["x", "y", "z"].iter().all(|axis| fields.iter().any(|(name, _)| name == axis));
            named.then(|| fields.iter().map(|(_, kind)| kind.scalar.size() as u64).sum())?
        }
        _ => return None,
    };
    usize::try_from(header.shape[0].checked_mul(columns)?).ok()?.checked_add(header.body)
}

impl<'a> NpyTable<'a> {
    pub fn parse(bytes: &'a [u8]) -> Result<Self, FormatError> {
        let header = NpyHeader::parse(bytes)?;
        let body = &bytes[header.body..];
        let whole = cloud_bytes(bytes);
        let shape = &header.shape;
        let (&rows, columns) = match (&header.descr, &shape[..]) {
            (Descr::Plain(_), [rows, columns]) if *columns >= 3 => (rows, *columns),
            (Descr::Fields(fields), [rows]) => (rows, fields.len() as u64),
            _ => {
                let hint = if shape[..].first() == Some(&3) { "; transpose it" } else { "" };
                return Err(FormatError::Content(format!(
                    "the array has shape {shape:?}, [points, 3] or wider is expected{hint}"
                )));
            }
        };
        let Some(expected) = whole.map(|whole| whole - header.body) else {
            let problem =
                format!("an array of shape {shape:?} has no fields x, y and z, or no memory holds it");
            return Err(FormatError::Content(problem));
        };
        if expected != body.len() {
            let announced = format!("an array of shape {shape:?} in {expected} bytes");
            return Err(FormatError::truncated(announced, format!("{} bytes", body.len())));
        }
        // Both are bounded by the bytes that are there, but for arrays without rows.
        let rows = usize::try_from(rows).unwrap_or(0);
        let columns = if rows == 0 { 3 } else { usize::try_from(columns).unwrap_or(0) };
        let mut axes = [0, 1, 2];
        let (mut kinds, mut layout) = (Vec::new(), Vec::new());
        match &header.descr {
            Descr::Plain(kind) => {
                let size = kind.scalar.size();
                for column in 0..columns {
                    kinds.push(*kind);
                    layout.push(match header.fortran {
                        true => (column * rows * size, size),
                        false => (column * size, columns * size),
                    });
                }
            }
            Descr::Fields(fields) => {
                let stride = fields.iter().map(|(_, kind)| kind.scalar.size()).sum();
                let mut at = 0;
                for (_, kind) in fields {
                    kinds.push(*kind);
                    layout.push((at, stride));
                    at += kind.scalar.size();
                }
                for (slot, axis) in axes.iter_mut().zip(["x", "y", "z"]) {
                    *slot = fields.iter().position(|(name, _)| name == axis).unwrap_or(0);
                }
            }
        }
        Ok(Self { header, body, rows, kinds, layout, axes })
    }

    fn place(&self, row: usize, column: usize) -> usize {
        let (begin, step) = self.layout[column];
        begin + row * step
    }

    fn points(&self) -> Vec<[f64; 3]> {
        let value = |row: usize, column: usize| {
            let kind = self.kinds[column];
            let number = kind.scalar.get(self.body, self.place(row, column), kind.big_endian);
            number.unwrap_or(f64::NAN)
        };
        (0..self.rows).map(|row| self.axes.map(|column| value(row, column))).collect()
    }

    /// The named fields but x, y and z.
    fn attributes(&self) -> Vec<Attribute> {
        let Descr::Fields(fields) = &self.header.descr else { return Vec::new() };
        let others = fields.iter().enumerate().filter(|(column, _)| !self.axes.contains(column));
        others
            .map(|(column, (name, kind))| {
                let places = (0..self.rows).map(|row| self.place(row, column));
                let values = kind.scalar.column(self.body, kind.big_endian, places);
                Attribute { name: known(name), values }
            })
            .collect()
    }

    /// Calls `each` with the row and the column of every number, in the order of the file.
    fn in_order(&self, mut each: impl FnMut(usize, usize)) {
        let columns = self.kinds.len();
        if self.header.fortran && matches!(self.header.descr, Descr::Plain(_)) {
            (0..columns).for_each(|column| (0..self.rows).for_each(|row| each(row, column)));
        } else {
            (0..self.rows).for_each(|row| (0..columns).for_each(|column| each(row, column)));
        }
    }
}

#[cfg(test)]
mod tests;
