//! Which columns of a table are x, y and z, and their numbers.

use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    Decimal32Type, Decimal64Type, Decimal128Type, Float16Type, Float32Type, Float64Type, Int8Type, Int16Type,
    Int32Type, Int64Type, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef};
use arrow_schema::{DataType, Field, Schema};

use super::super::{ColumnName, FormatError, PointColumns, axes};

/// Where the coordinates are.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Place {
    /// Three columns.
    Columns([usize; 3]),
    /// One column of lists of three numbers.
    List(usize),
    /// One column of structures, the fields of structures inside it down to the one with three numbers, and those.
    Struct(usize, Vec<usize>, [usize; 3]),
}

impl Place {
    /// The columns that are read.
    pub fn roots(&self) -> Vec<usize> {
        match self {
            Self::Columns(axes) => axes.to_vec(),
            Self::List(column) | Self::Struct(column, ..) => vec![*column],
        }
    }
}

/// The type of the values, which a dictionary holds once each.
fn values_of(kind: &DataType) -> &DataType {
    match kind {
        DataType::Dictionary(_, values) => values,
        other => other,
    }
}

/// Names of columns of lists.
const LISTS: [&str; 10] = [
    "points",
    "xyz",
    "point",
    "position",
    "positions",
    "pos",
    "coords",
    "coordinates",
    "vertices",
    "geometry",
];

fn is_number(kind: &DataType) -> bool {
    values_of(kind).is_numeric()
}

fn is_list(kind: &DataType) -> bool {
    match kind {
        DataType::FixedSizeList(item, size) => *size == 3 && is_number(item.data_type()),
        DataType::List(item) | DataType::LargeList(item) => is_number(item.data_type()),
        _ => false,
    }
}

/// Structures in structures that are looked into.
const DEPTH: usize = 8;

/// All structures with three numbers x, y and z in a type: the fields on the way to them, and those.
fn struct_axes(kind: &DataType, depth: usize) -> Vec<(Vec<usize>, [usize; 3])> {
    let DataType::Struct(fields) = kind else { return Vec::new() };
    let find = |name: &str| {
        fields
            .iter()
            .position(|field| field.name().eq_ignore_ascii_case(name) && is_number(field.data_type()))
    };
    if let (Some(x), Some(y), Some(z)) = (find("x"), find("y"), find("z")) {
        return vec![(Vec::new(), [x, y, z])];
    }
    let inside = |(index, field): (usize, &Arc<Field>)| {
        let below = if depth > 0 { struct_axes(field.data_type(), depth - 1) } else { Vec::new() };
        below.into_iter().map(move |(way, axes)| ([vec![index], way].concat(), axes))
    };
    fields.iter().enumerate().flat_map(inside).collect()
}

fn unclear(problem: String) -> FormatError {
    FormatError::Unclear { problem, switch: "--columns" }
}

fn names(schema: &Schema) -> Vec<&str> {
    schema.fields().iter().map(|field| field.name().as_str()).take(40).collect()
}

/// Finds the coordinates.
///
/// # Errors
/// [`FormatError::Unclear`] with the names of the columns.
pub(super) fn find(schema: &Schema, columns: Option<&PointColumns>) -> Result<Place, FormatError> {
    let fields = schema.fields();
    if let Some(columns) = columns {
        let mut axes = [0; 3];
        for (slot, column) in axes.iter_mut().zip(&columns.0) {
            let found = match column {
                ColumnName::Number(number) => number.checked_sub(1).filter(|&index| index < fields.len()),
                ColumnName::Name(name) => fields
                    .iter()
                    .position(|field| field.name() == name)
                    .or_else(|| fields.iter().position(|field| field.name().eq_ignore_ascii_case(name))),
            };
            *slot =
                found.ok_or_else(|| unclear(format!("no column {column}; there are {:?}", names(schema))))?;
        }
        if let Some(&wrong) = axes.iter().find(|&&axis| !is_number(fields[axis].data_type())) {
            let (name, kind) = (fields[wrong].name(), fields[wrong].data_type());
            return Err(unclear(format!("the column {name:?} is of the type {kind}, no number")));
        }
        return Ok(Place::Columns(axes));
    }
    let number = |field: &Arc<Field>| {
        if is_number(field.data_type()) { field.name().clone() } else { String::new() }
    };
    let numbers: Vec<String> = fields.iter().map(number).collect();
    if let axes::Axes::Found(axes) = axes::find(&numbers) {
        return Ok(Place::Columns(axes));
    }
    let mut lists = LISTS.iter().filter_map(|name| {
        fields.iter().position(|field| field.name().eq_ignore_ascii_case(name) && is_list(field.data_type()))
    });
    if let Some(list) = lists.next() {
        return Ok(Place::List(list));
    }
    let mut structs = fields.iter().enumerate().flat_map(|(column, field)| {
        struct_axes(field.data_type(), DEPTH).into_iter().map(move |(way, axes)| (column, way, axes))
    });
    match (structs.next(), structs.next()) {
        (Some((column, way, axes)), None) => Ok(Place::Struct(column, way, axes)),
        _ if axes::find(&numbers) == axes::Axes::Degrees => {
            Err(axes::choose(&numbers, None).err().unwrap_or_else(|| unclear("degrees".into())))
        }
        _ => Err(unclear(format!("no columns x, y and z of numbers, but {:?}", names(schema)))),
    }
}

/// Whether single precision holds every number of a type.
pub(super) fn is_single(kind: &DataType) -> bool {
    match values_of(kind) {
        DataType::Float16
        | DataType::Float32
        | DataType::Int8
        | DataType::UInt8
        | DataType::Int16
        | DataType::UInt16 => true,
        DataType::List(item) | DataType::LargeList(item) | DataType::FixedSizeList(item, _) => {
            is_single(item.data_type())
        }
        DataType::Struct(fields) => fields.iter().all(|field| is_single(field.data_type())),
        _ => false,
    }
}

/// The numbers of an array; NaN for those that are missing.
///
/// # Errors
/// [`FormatError::Content`] where they are no numbers.
pub(super) fn numbers(array: &dyn Array) -> Result<Vec<f64>, FormatError> {
    macro_rules! cast {
        ($kind:ty, $value:ident => $number:expr) => {{
            let array = array.as_primitive::<$kind>();
            array.iter().map(|value| value.map_or(f64::NAN, |$value| $number)).collect()
        }};
    }
    Ok(match array.data_type() {
        DataType::Float16 => cast!(Float16Type, v => f64::from(v)),
        DataType::Float32 => cast!(Float32Type, v => f64::from(v)),
        DataType::Float64 => cast!(Float64Type, v => v),
        DataType::Int8 => cast!(Int8Type, v => f64::from(v)),
        DataType::Int16 => cast!(Int16Type, v => f64::from(v)),
        DataType::Int32 => cast!(Int32Type, v => f64::from(v)),
        DataType::Int64 => cast!(Int64Type, v => v as f64),
        DataType::UInt8 => cast!(UInt8Type, v => f64::from(v)),
        DataType::UInt16 => cast!(UInt16Type, v => f64::from(v)),
        DataType::UInt32 => cast!(UInt32Type, v => f64::from(v)),
        DataType::UInt64 => cast!(UInt64Type, v => v as f64),
        DataType::Decimal32(_, scale) => cast!(Decimal32Type, v => decimal(i128::from(v), *scale)),
        DataType::Decimal64(_, scale) => cast!(Decimal64Type, v => decimal(i128::from(v), *scale)),
        DataType::Decimal128(_, scale) => cast!(Decimal128Type, v => decimal(v, *scale)),
        DataType::Dictionary(..) => {
            let array = array.as_any_dictionary();
            let values = numbers(array.values())?;
            if values.is_empty() {
                return Ok(vec![f64::NAN; array.len()]);
            }
            // A key that is missing stands for any value of the list.
            let keys = array.normalized_keys();
            let value = |(row, key): (usize, usize)| {
                if array.is_null(row) { f64::NAN } else { values.get(key).copied().unwrap_or(f64::NAN) }
            };
            keys.into_iter().enumerate().map(value).collect()
        }
        other => {
            return Err(FormatError::Content(format!("a column of the type {other}, which is no number")));
        }
    })
}

/// The nearest double to `digits` times ten to the power of `-scale`.
fn decimal(digits: i128, scale: i8) -> f64 {
    format!("{digits}e{}", -i32::from(scale)).parse().unwrap_or(f64::NAN)
}

/// The points of a part of the table, whose columns are those of [`Place::roots`] in the order of the file.
pub(super) fn points(
    place: &Place,
    columns: &[ArrayRef],
    points: &mut Vec<[f64; 3]>,
) -> Result<(), FormatError> {
    let triples = |[x, y, z]: [&ArrayRef; 3], points: &mut Vec<[f64; 3]>| {
        let [x, y, z] = [numbers(x)?, numbers(y)?, numbers(z)?];
        points.extend(x.into_iter().zip(y).zip(z).map(|((x, y), z)| [x, y, z]));
        Ok(())
    };
    let missing = || FormatError::Content("a column is missing".into());
    match place {
        Place::Columns(axes) => {
            let mut order = axes.to_vec();
            order.sort_unstable();
            let column = |axis: usize| {
                let at = order.iter().position(|&index| index == axis);
                at.and_then(|at| columns.get(at)).ok_or_else(missing)
            };
            triples([column(axes[0])?, column(axes[1])?, column(axes[2])?], points)
        }
        Place::Struct(_, way, axes) => {
            let array = columns.first().ok_or_else(missing)?;
            let mut fields = array.as_struct_opt().ok_or_else(missing)?;
            let mut empty: Vec<bool> = (0..fields.len()).map(|row| fields.is_null(row)).collect();
            for &step in way {
                fields = fields.columns().get(step).and_then(|a| a.as_struct_opt()).ok_or_else(missing)?;
                empty.iter_mut().enumerate().for_each(|(row, empty)| *empty |= fields.is_null(row));
            }
            let before = points.len();
            triples(axes.map(|axis| fields.column(axis)), points)?;
            for (row, _) in empty.iter().enumerate().filter(|(_, empty)| **empty) {
                points[before + row] = [f64::NAN; 3];
            }
            Ok(())
        }
        Place::List(_) => {
            let array = columns.first().ok_or_else(missing)?;
            let offsets =
                |offset: &dyn Fn(usize) -> (usize, usize)| (0..array.len()).map(offset).collect::<Vec<_>>();
            let (values, places) = match array.data_type() {
                DataType::FixedSizeList(..) => {
                    let list = array.as_fixed_size_list();
                    let length = usize::try_from(list.value_length()).unwrap_or(0);
                    (numbers(list.values())?, offsets(&|row| (list.value_offset_at(row), length)))
                }
                DataType::LargeList(_) => {
                    let list = array.as_list::<i64>();
                    let place =
                        |row: usize| (list.value_offsets()[row] as usize, list.value_length(row) as usize);
                    (numbers(list.values())?, offsets(&place))
                }
                _ => {
                    let list = array.as_list::<i32>();
                    let place =
                        |row: usize| (list.value_offsets()[row] as usize, list.value_length(row) as usize);
                    (numbers(list.values())?, offsets(&place))
                }
            };
            for (row, (begin, length)) in places.into_iter().enumerate() {
                points.push(match values.get(begin..begin + length) {
                    _ if array.is_null(row) => [f64::NAN; 3],
                    Some(&[x, y, z]) => [x, y, z],
                    _ => {
                        let problem = format!("row {row} holds a list of {length} numbers, not of 3");
                        return Err(FormatError::Content(problem));
                    }
                });
            }
            Ok(())
        }
    }
}
