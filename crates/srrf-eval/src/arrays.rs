//! Arrays of numbers in NumPy's `.npy` and `.npz` files.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use npyz::{NpyFile, Order, TypeChar, WriteOptions, WriterBuilder};

/// Why a NumPy file cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ArrayError {
    /// The file cannot be opened, read or written.
    #[error("{path:?}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The file is not an archive of arrays.
    #[error("{path:?} is not an .npz archive, or is damaged ({source}); write it with numpy.savez")]
    Archive {
        /// The file.
        path: PathBuf,
        /// The reader's reason.
        source: zip::result::ZipError,
    },
    /// An array cannot be used.
    #[error("{path:?}, array {array}: {problem}")]
    Array {
        /// The file.
        path: PathBuf,
        /// Name of the array.
        array: String,
        /// What is wrong, and what is expected.
        problem: String,
    },
}

/// Numbers with a shape, in row-major (C) order whatever the file's order was.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// The numbers, as many as the product of `shape`.
    pub values: Vec<f64>,
}

impl Array {
    /// Reads one `.npy` stream of `f32`, `f64`, integers or booleans, in either byte order and in C
    /// or Fortran order. `size` is the number of bytes that the stream can hold at most.
    fn read(stream: impl Read, size: u64) -> Result<Self, String> {
        let file = NpyFile::new(stream)
            .map_err(|e| format!("not in NumPy's .npy format, or damaged ({e}); write it with numpy"))?;
        let shape: Vec<usize> = file.shape().iter().map(|&d| d as usize).collect();
        let order = file.order();
        let dtype = file.dtype();
        let unsupported =
            || format!("type {} is not supported: save it as float32 or float64", dtype.descr());
        let npyz::DType::Plain(type_str) = &dtype else { return Err(unsupported()) };
        let item = type_str.size_field();
        let count = file.shape().iter().try_fold(1u64, |n, &d| n.checked_mul(d));
        if count.and_then(|n| n.checked_mul(item)).is_none_or(|bytes| bytes > size) {
            return Err(format!("truncated: its header says {shape:?}, more than its {size} bytes can hold"));
        }
        let values = match (type_str.type_char(), item) {
            (TypeChar::Float, 8) => read_as::<f64>(file, |v| v),
            (TypeChar::Float, 4) => read_as::<f32>(file, f64::from),
            (TypeChar::Bool, 1) => read_as::<bool>(file, f64::from),
            (TypeChar::Int, 1) => read_as::<i8>(file, f64::from),
            (TypeChar::Uint, 1) => read_as::<u8>(file, f64::from),
            (TypeChar::Int, 4) => read_as::<i32>(file, f64::from),
            (TypeChar::Int, 8) => read_as::<i64>(file, |v| v as f64),
            _ => return Err(unsupported()),
        }
        .map_err(|e| format!("truncated or damaged ({e})"))?;
        let values = if order == Order::Fortran { to_row_major(&shape, &values) } else { values };
        Ok(Self { shape, values })
    }

    /// Writes `values` of `shape` as one `.npy` stream of `f64`.
    pub(crate) fn write(stream: impl Write, shape: &[usize], values: &[f64]) -> io::Result<()> {
        let shape: Vec<u64> = shape.iter().map(|&d| d as u64).collect();
        let mut writer =
            WriteOptions::<f64>::new().default_dtype().shape(&shape).writer(stream).begin_nd()?;
        writer.extend(values.iter().copied())?;
        writer.finish()
    }
}

fn read_as<T: npyz::Deserialize>(file: NpyFile<impl Read>, convert: fn(T) -> f64) -> io::Result<Vec<f64>> {
    let reader = file.data::<T>().map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e.to_string()))?;
    reader.map(|value| value.map(convert)).collect()
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

/// Reads a `.npy` file.
///
/// # Errors
/// [`ArrayError`] with the file and what is wrong with it.
pub fn read_npy(path: &Path) -> Result<Array, ArrayError> {
    let io = |source| ArrayError::Io { path: path.to_owned(), source };
    let file = File::open(path).map_err(io)?;
    let size = file.metadata().map_err(io)?.len();
    Array::read(BufReader::new(file), size).map_err(|problem| ArrayError::Array {
        path: path.to_owned(),
        array: "(the only one)".into(),
        problem,
    })
}

/// The arrays of a `.npz` file.
#[derive(Debug, Clone, Default)]
pub struct Npz {
    /// Names in the order of the file.
    pub names: Vec<String>,
    /// The arrays by name.
    pub arrays: BTreeMap<String, Array>,
}

/// Reads all arrays of a `.npz` file.
///
/// # Errors
/// [`ArrayError`] with the file, the array and what is wrong with it.
pub fn read_npz(path: &Path) -> Result<Npz, ArrayError> {
    let file = File::open(path).map_err(|source| ArrayError::Io { path: path.to_owned(), source })?;
    let archive = |source| ArrayError::Archive { path: path.to_owned(), source };
    let mut zip = zip::ZipArchive::new(BufReader::new(file)).map_err(archive)?;
    let mut npz = Npz::default();
    for index in 0..zip.len() {
        let entry = zip.by_index(index).map_err(archive)?;
        let Some(name) = entry.name().map_err(archive)?.strip_suffix(".npy").map(str::to_owned) else {
            continue;
        };
        let size = entry.size();
        let array = Array::read(entry, size).map_err(|problem| ArrayError::Array {
            path: path.to_owned(),
            array: name.clone(),
            problem,
        })?;
        npz.names.push(name.clone());
        npz.arrays.insert(name, array);
    }
    Ok(npz)
}

/// The bytes of a `.npy` file.
#[cfg(test)]
pub(crate) fn npy_bytes(shape: &[usize], values: &[f64]) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    Array::write(&mut bytes, shape, values)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(shape: &[usize], values: &[f64]) -> Vec<u8> {
        npy_bytes(shape, values).unwrap()
    }

    fn read(bytes: &[u8]) -> Result<Array, String> {
        Array::read(bytes, bytes.len() as u64)
    }

    #[test]
    fn there_and_back() {
        let values: Vec<f64> = (0..2 * 3 * 5).map(|i| f64::from(i) / 7.0).collect();
        let array = read(&bytes(&[2, 3, 5], &values)).unwrap();
        assert_eq!(array, Array { shape: vec![2, 3, 5], values });
    }

    #[test]
    fn fortran_order_and_single_precision() {
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
        let array = read(&file).unwrap();
        assert_eq!(array, Array { shape: vec![2, 3], values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0] });
    }

    #[test]
    fn damaged_files_are_errors() {
        let whole = bytes(&[4, 3], &[0.5; 12]);
        assert!(read(&whole[..whole.len() - 3]).unwrap_err().contains("truncated"));
        assert!(read(&whole[..20]).unwrap_err().contains("damaged"));
        assert!(read(b"no array").unwrap_err().contains("not in NumPy's"));
        // A header that promises more than any machine holds.
        let huge = read(&header("<f8", "(99999999999, 99999999999)")).unwrap_err();
        assert!(huge.contains("truncated"), "{huge}");
        let complex = read(&header("<c16", "(0,)")).unwrap_err();
        assert!(complex.contains("float32 or float64"), "{complex}");
    }

    fn header(descr: &str, shape: &str) -> Vec<u8> {
        let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
        [b"\x93NUMPY\x01\x00", &(text.len() as u16).to_le_bytes()[..], text.as_bytes()].concat()
    }
}
