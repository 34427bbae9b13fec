//! NumPy arrays of shape `[n, 3]` or wider.

use std::io::{self, Write};

use npyz::{NpyFile, NpyHeader, WriterBuilder};

use super::{CloudFormat, FormatError};

/// An array `[n, columns]` of at least 3 columns, in C or Fortran order, of any float or of 8- to
/// 32-bit integers; the first three columns are x, y and z.
pub(super) struct Npy;

impl CloudFormat for Npy {
    fn extensions(&self) -> &[&'static str] {
        &["npy"]
    }

    fn read(&self, bytes: &[u8]) -> Result<Vec<[f64; 3]>, FormatError> {
        let mut rest = bytes;
        let header = NpyHeader::from_reader(&mut rest)
            .map_err(|e| FormatError::Content(format!("not a NumPy array: {e}")))?;
        let shape = header.shape().to_vec();
        let (rows, columns) = match shape[..] {
            [rows, columns] if columns >= 3 => (rows, columns),
            _ => {
                let problem = format!("the array has shape {shape:?}, expected [points, 3] or wider");
                return Err(FormatError::Content(problem));
            }
        };
        let (kind, width) = (header.dtype().descr(), header.dtype().num_bytes().unwrap_or(0));
        let fortran = header.order() == npyz::Order::Fortran;
        let expected = rows.checked_mul(columns).and_then(|n| n.checked_mul(width as u64));
        if expected.is_none_or(|n| n > rest.len() as u64) {
            let announced = format!("{rows} x {columns} numbers of {width} bytes");
            return Err(FormatError::truncated(announced, format!("{} bytes", rest.len())));
        }
        let values = values(header, rest)
            .map_err(|e| FormatError::Content(format!("cannot read numbers of type {kind}: {e}")))?;
        let (rows, columns) = (rows as usize, columns as usize);
        if values.len() != rows * columns {
            return Err(FormatError::truncated((rows * columns).to_string(), values.len().to_string()));
        }
        let at = |row: usize, column: usize| match fortran {
            true => values[column * rows + row],
            false => values[row * columns + column],
        };
        Ok((0..rows).map(|row| std::array::from_fn(|column| at(row, column))).collect())
    }

    fn write(&self, points: &[[f64; 3]], out: &mut dyn Write) -> io::Result<()> {
        let mut writer = npyz::WriteOptions::new()
            .default_dtype()
            .shape(&[points.len() as u64, 3])
            .writer(out)
            .begin_nd()?;
        writer.extend(points.iter().flatten().copied())?;
        writer.finish()
    }
}

/// All numbers in the order of the file, as `f64`.
fn values(header: NpyHeader, bytes: &[u8]) -> io::Result<Vec<f64>> {
    fn collect<T: npyz::Deserialize>(
        header: NpyHeader,
        bytes: &[u8],
        convert: impl Fn(T) -> f64,
    ) -> io::Result<Result<Vec<f64>, NpyHeader>> {
        match NpyFile::with_header(header, bytes).try_data::<T>() {
            Ok(numbers) => numbers.map(|n| n.map(&convert)).collect::<io::Result<_>>().map(Ok),
            Err(file) => Ok(Err(file.header().clone())),
        }
    }
    let header = match collect::<f64>(header, bytes, |v| v)? {
        Ok(values) => return Ok(values),
        Err(header) => header,
    };
    let header = match collect::<f32>(header, bytes, f64::from)? {
        Ok(values) => return Ok(values),
        Err(header) => header,
    };
    let header = match collect::<i64>(header, bytes, |v| v as f64)? {
        Ok(values) => return Ok(values),
        Err(header) => header,
    };
    let header = match collect::<i32>(header, bytes, f64::from)? {
        Ok(values) => return Ok(values),
        Err(header) => header,
    };
    let header = match collect::<i16>(header, bytes, f64::from)? {
        Ok(values) => return Ok(values),
        Err(header) => header,
    };
    match collect::<u8>(header, bytes, f64::from)? {
        Ok(values) => Ok(values),
        Err(_) => Err(io::Error::other("32- or 64-bit floats or integers are expected")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn array<T: npyz::AutoSerialize + Copy>(shape: &[u64], order: npyz::Order, data: &[T]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut writer = npyz::WriteOptions::new()
            .default_dtype()
            .shape(shape)
            .order(order)
            .writer(&mut bytes)
            .begin_nd()
            .unwrap();
        writer.extend(data.iter().copied()).unwrap();
        writer.finish().unwrap();
        bytes
    }

    #[test]
    fn orders_types_and_widths() {
        let expected = vec![[0.0, 1.0, 2.0], [4.0, 5.0, 6.0]];
        let c: Vec<f32> = (0..8).map(|v| v as f32).collect();
        assert_eq!(Npy.read(&array(&[2, 4], npyz::Order::C, &c)).unwrap(), expected);
        let f: Vec<i32> = vec![0, 4, 1, 5, 2, 6];
        assert_eq!(Npy.read(&array(&[2, 3], npyz::Order::Fortran, &f)).unwrap(), expected);
        let i: Vec<i64> = vec![0, 1, 2, 4, 5, 6];
        assert_eq!(Npy.read(&array(&[2, 3], npyz::Order::C, &i)).unwrap(), expected);
    }

    #[test]
    fn bad_arrays() {
        let good = array(&[2, 3], npyz::Order::C, &[0.0f64; 6]);
        for length in 0..good.len() {
            assert!(Npy.read(&good[..length]).is_err(), "{length}");
        }
        assert!(Npy.read(&array(&[6], npyz::Order::C, &[0.0f64; 6])).is_err());
        assert!(Npy.read(&array(&[3, 2], npyz::Order::C, &[0.0f64; 6])).is_err());
        // A header that announces more than memory holds.
        let text = "{'descr': '<f8', 'fortran_order': False, 'shape': (4611686018427387904, 3), }\n";
        let mut huge = b"\x93NUMPY\x01\x00".to_vec();
        huge.extend((text.len() as u16).to_le_bytes());
        huge.extend(text.as_bytes());
        assert!(matches!(Npy.read(&huge), Err(FormatError::Truncated { .. })));
    }
}
