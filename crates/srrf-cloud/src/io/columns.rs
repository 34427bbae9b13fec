//! Columns of one type: out of bytes, out of numbers, and back into bytes.

use super::AttributeValues;
use super::scalar::Scalar;

impl Scalar {
    /// The numbers of this type at `places` in `bytes`; 0 past the end.
    pub fn column(
        self,
        bytes: &[u8],
        big_endian: bool,
        places: impl Iterator<Item = usize>,
    ) -> AttributeValues {
        macro_rules! column {
            ($kind:ty, $variant:ident) => {
                AttributeValues::$variant(
                    places
                        .map(|at| {
                            let raw = bytes.get(at..).and_then(|rest| rest.first_chunk()).copied();
                            let raw = raw.unwrap_or_default();
                            if big_endian { <$kind>::from_be_bytes(raw) } else { <$kind>::from_le_bytes(raw) }
                        })
                        .collect(),
                )
            };
        }
        match self {
            Self::I8 => column!(i8, I8),
            Self::U8 => column!(u8, U8),
            Self::I16 => column!(i16, I16),
            Self::U16 => column!(u16, U16),
            Self::I32 => column!(i32, I32),
            Self::U32 => column!(u32, U32),
            Self::I64 => column!(i64, I64),
            Self::U64 => column!(u64, U64),
            Self::F16 => AttributeValues::F32(
                places.map(|at| self.get(bytes, at, big_endian).unwrap_or(0.0) as f32).collect(),
            ),
            Self::F32 => column!(f32, F32),
            Self::F64 => column!(f64, F64),
        }
    }

    /// Numbers rounded to this type.
    pub fn of_numbers(self, numbers: &[f64]) -> AttributeValues {
        macro_rules! cast {
            ($kind:ty, $variant:ident) => {
                AttributeValues::$variant(numbers.iter().map(|&number| number as $kind).collect())
            };
        }
        match self {
            Self::I8 => cast!(i8, I8),
            Self::U8 => cast!(u8, U8),
            Self::I16 => cast!(i16, I16),
            Self::U16 => cast!(u16, U16),
            Self::I32 => cast!(i32, I32),
            Self::U32 => cast!(u32, U32),
            Self::I64 => cast!(i64, I64),
            Self::U64 => cast!(u64, U64),
            Self::F16 | Self::F32 => cast!(f32, F32),
            Self::F64 => cast!(f64, F64),
        }
    }
}

impl AttributeValues {
    /// The type.
    pub(super) fn scalar(&self) -> Scalar {
        match self {
            Self::I8(_) => Scalar::I8,
            Self::U8(_) => Scalar::U8,
            Self::I16(_) => Scalar::I16,
            Self::U16(_) => Scalar::U16,
            Self::I32(_) => Scalar::I32,
            Self::U32(_) => Scalar::U32,
            Self::I64(_) => Scalar::I64,
            Self::U64(_) => Scalar::U64,
            Self::F32(_) => Scalar::F32,
            Self::F64(_) => Scalar::F64,
        }
    }

    /// Appends the bytes of a value, little endian; of 0 past the end.
    pub(super) fn put(&self, index: usize, out: &mut Vec<u8>) {
        macro_rules! put {
            ($values:expr) => {
                out.extend_from_slice(&$values.get(index).copied().unwrap_or_default().to_le_bytes())
            };
        }
        match self {
            Self::I8(v) => put!(v),
            Self::U8(v) => put!(v),
            Self::I16(v) => put!(v),
            Self::U16(v) => put!(v),
            Self::I32(v) => put!(v),
            Self::U32(v) => put!(v),
            Self::I64(v) => put!(v),
            Self::U64(v) => put!(v),
            Self::F32(v) => put!(v),
            Self::F64(v) => put!(v),
        }
    }

    /// Appends a value as text, in the fewest digits that read back as the same.
    pub(super) fn put_text(&self, index: usize, out: &mut Vec<u8>) {
        match self {
            Self::F64(v) => super::scan::put_number(out, v.get(index).copied().unwrap_or(f64::NAN)),
            Self::F32(v) => super::scan::put_single(out, v.get(index).copied().unwrap_or(f32::NAN)),
            Self::I64(v) => out.extend(v.get(index).copied().unwrap_or(0).to_string().bytes()),
            Self::U64(v) => out.extend(v.get(index).copied().unwrap_or(0).to_string().bytes()),
            _ => super::scan::put_number(out, self.get(index).unwrap_or(f64::NAN)),
        }
    }

    /// Whether all values are whole numbers from 0 to `most`.
    pub(super) fn are_whole(&self, most: f64) -> bool {
        (0..self.len())
            .filter_map(|i| self.get(i))
            .all(|value| value.fract() == 0.0 && (0.0..=most).contains(&value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_keep_their_type_and_bits() {
        let bytes: Vec<u8> = (1..=16).collect();
        let column = Scalar::U16.column(&bytes, false, [0, 4, 14, 99].into_iter());
        assert_eq!(column, AttributeValues::U16(vec![0x0201, 0x0605, 0x100f, 0]));
        assert_eq!(Scalar::U16.column(&bytes, true, [0].into_iter()), AttributeValues::U16(vec![0x0102]));
        let big = AttributeValues::I64(vec![i64::MIN + 1, (1 << 53) + 1]);
        let mut out = Vec::new();
        (0..2).for_each(|i| big.put(i, &mut out));
        assert_eq!(Scalar::I64.column(&out, false, [0, 8].into_iter()), big, "more bits than f64 has");
        let mut text = Vec::new();
        big.put_text(1, &mut text);
        AttributeValues::F32(vec![0.1]).put_text(0, &mut text);
        assert_eq!(text, b"90071992547409930.1");
        assert_eq!(Scalar::U8.of_numbers(&[3.0, 300.0]), AttributeValues::U8(vec![3, 255]));
        assert!(big.scalar() == Scalar::I64 && !big.are_whole(9.0));
    }
}
