//! [`Array`]: an array of numbers of any shape.

use std::io::{self, Write};

use super::header::{Descr, NpyHeader};
use crate::io::FormatError;

/// Numbers with a shape, in row-major (C) order whatever the file's order was.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// The numbers, as many as the product of `shape`.
    pub values: Vec<f64>,
}

impl Array {
    /// Reads the bytes of a `.npy` file of floating point numbers, integers (64-bit ones are rounded) or booleans, in either byte
    /// order and in C or Fortran order. What its header says is checked against the bytes that are there.
    ///
    /// # Errors
    /// [`FormatError`] where the bytes are no such array.
    pub fn parse(bytes: &[u8]) -> Result<Self, FormatError> {
        let header = NpyHeader::parse(bytes)?;
        let Descr::Plain(kind) = header.descr else {
            return Err(FormatError::Content(
                "an array of records cannot be read here; save each field as an array of float32 or float64"
                    .into(),
            ));
        };
        let (body, size) = (&bytes[header.body..], kind.scalar.size());
        let announced = || format!("an array of shape {:?} of numbers of {size} bytes", header.shape);
        let short = || FormatError::truncated(announced(), format!("{} bytes", body.len()));
        let numbers = header.shape.iter().try_fold(1u64, |n, &axis| n.checked_mul(axis));
        let expected = numbers.and_then(|n| usize::try_from(n).ok()?.checked_mul(size));
        if expected != Some(body.len()) {
            return Err(short());
        }
        // Bounded by the bytes, but for arrays without numbers, one of whose axes is 0.
        let shape: Vec<usize> = header
            .shape
            .iter()
            .map(|&axis| usize::try_from(axis).map_err(|_| short()))
            .collect::<Result<_, _>>()?;
        let number = |at| kind.scalar.get(body, at, kind.big_endian).ok_or_else(short);
        let values = (0..body.len()).step_by(size).map(number).collect::<Result<Vec<f64>, _>>()?;
        let values = if header.fortran { to_row_major(&shape, &values) } else { values };
        Ok(Self { shape, values })
    }

    /// How many numbers the bytes of a `.npy` file hold, as far as its header and its length go together.
    ///
    /// # Errors
    /// [`FormatError`] where the bytes have no header of an array of numbers.
    pub(in crate::io) fn numbers(bytes: &[u8]) -> Result<usize, FormatError> {
        let header = NpyHeader::parse(bytes)?;
        Ok(match header.descr {
            Descr::Plain(kind) => (bytes.len() - header.body) / kind.scalar.size(),
            Descr::Fields(_) => 0,
        })
    }

    /// Writes `values` of `shape` as a `.npy` file of `float64`.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(shape: &[usize], values: &[f64], out: &mut dyn Write) -> io::Result<()> {
        // A blank after the last comma, as the files of earlier versions have it, so that exported pairs keep their bytes.
        let axes: String = shape.iter().map(|axis| format!("{axis}, ")).collect();
        let text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({axes}), }}");
        out.write_all(&NpyHeader::framed(text))?;
        values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
    }
}

/// Column-major (Fortran) to row-major (C) order.
fn to_row_major(shape: &[usize], values: &[f64]) -> Vec<f64> {
    let mut strides = vec![1; shape.len()];
    for axis in 1..shape.len() {
        strides[axis] = strides[axis - 1] * shape[axis - 1];
    }
    (0..values.len())
        .map(|mut index| {
            let mut position = 0;
            for axis in (0..shape.len()).rev() {
                position += index % shape[axis] * strides[axis];
                index /= shape[axis];
            }
            values[position]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use npyz::{Order, WriteOptions, WriterBuilder};

    use super::*;

    fn bytes(shape: &[usize], values: &[f64]) -> Vec<u8> {
        let mut bytes = Vec::new();
        Array::write(shape, values, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn there_and_back() {
        let values: Vec<f64> = (0..2 * 3 * 5).map(|i| f64::from(i) / 7.0).collect();
        let array = Array::parse(&bytes(&[2, 3, 5], &values)).unwrap();
        assert_eq!(array, Array { shape: vec![2, 3, 5], values });
        assert_eq!(Array::parse(&bytes(&[], &[7.0])).unwrap().values, [7.0]);
        assert_eq!(Array::parse(&bytes(&[0, 3], &[])).unwrap().shape, [0, 3]);
    }

    /// The bytes that another library writes, so that files stay as they were.
    #[test]
    fn the_bytes_are_those_of_npyz() {
        let mut theirs = Vec::new();
        let mut writer =
            WriteOptions::<f64>::new().default_dtype().shape(&[2, 3]).writer(&mut theirs).begin_nd().unwrap();
        let values = [1.0, -2.5, 1e300, 4.0, 5.0, 6.0];
        writer.extend(values).unwrap();
        writer.finish().unwrap();
        assert_eq!(bytes(&[2, 3], &values), theirs);
    }

    #[test]
    fn fortran_order_single_precision_and_booleans() {
        // numpy.asfortranarray([[1, 2, 3], [4, 5, 6]], dtype="<f4") holds 1 4 2 5 3 6.
        let mut file = Vec::new();
        let mut writer = WriteOptions::<f32>::new()
            .default_dtype()
            .order(Order::Fortran)
            .shape(&[2, 3])
            .writer(&mut file)
            .begin_nd()
            .unwrap();
        writer.extend([1.0_f32, 4.0, 2.0, 5.0, 3.0, 6.0]).unwrap();
        writer.finish().unwrap();
        let array = Array::parse(&file).unwrap();
        assert_eq!(array, Array { shape: vec![2, 3], values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0] });
        let flags = [header("|b1", "(3,)"), vec![1, 0, 1]].concat();
        assert_eq!(Array::parse(&flags).unwrap().values, [1.0, 0.0, 1.0]);
    }

    #[test]
    fn damaged_files_are_errors() {
        let whole = bytes(&[4, 3], &[0.5; 12]);
        let error = |bytes: &[u8]| Array::parse(bytes).unwrap_err().to_string();
        assert!(matches!(Array::parse(&whole[..whole.len() - 3]), Err(FormatError::Truncated { .. })));
        assert!(matches!(Array::parse(&whole[..20]), Err(FormatError::Truncated { .. })));
        assert!(error(b"no array").contains("not a NumPy array"));
        // A header that promises more than any machine holds.
        let huge = Array::parse(&header("<f8", "(99999999999, 99999999999)"));
        assert!(matches!(huge, Err(FormatError::Truncated { .. })));
        assert!(error(&header("<c16", "(0,)")).contains("float32, float64"));
    }

    /// A key that NumPy does not write. A header is text that Python could evaluate; only what NumPy writes is read.
    #[test]
    fn a_header_with_more_than_numpy_writes_is_refused() {
        let text = "{'descr': '<f8', 'fortran_order': False, 'shape': (1,), 'comment': ('a', 'b')}\n";
        let length = (text.len() as u16).to_le_bytes();
        let bytes = [b"\x93NUMPY\x01\x00", &length[..], text.as_bytes(), &1.0f64.to_le_bytes()].concat();
        let error = Array::parse(&bytes).unwrap_err().to_string();
        assert!(error.contains("one of descr, fortran_order, shape"), "{error}");
    }

    fn header(descr: &str, shape: &str) -> Vec<u8> {
        let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
        [b"\x93NUMPY\x01\x00", &(text.len() as u16).to_le_bytes()[..], text.as_bytes()].concat()
    }
}
