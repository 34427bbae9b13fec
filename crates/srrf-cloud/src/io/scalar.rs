//! [`Scalar`]: the number types of binary files.

/// A type of numbers in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
}

impl Scalar {
    /// Bytes of one number.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 | Self::F16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number at offset `at` as `f64` (64-bit integers are rounded); `None` past the end.
    #[inline]
    pub fn get(self, bytes: &[u8], at: usize, big_endian: bool) -> Option<f64> {
        macro_rules! number {
            ($kind:ty) => {{
                let raw = *bytes.get(at..)?.first_chunk()?;
                (if big_endian { <$kind>::from_be_bytes(raw) } else { <$kind>::from_le_bytes(raw) }) as f64
            }};
        }
        Some(match self {
            Self::I8 => number!(i8),
            Self::U8 => number!(u8),
            Self::I16 => number!(i16),
            Self::U16 => number!(u16),
            Self::I32 => number!(i32),
            Self::U32 => number!(u32),
            Self::I64 => number!(i64),
            Self::U64 => number!(u64),
            Self::F16 => {
                let raw = *bytes.get(at..)?.first_chunk()?;
                half(if big_endian { u16::from_be_bytes(raw) } else { u16::from_le_bytes(raw) })
            }
            Self::F32 => number!(f32),
            Self::F64 => number!(f64),
        })
    }

    /// Appends `value`, rounded to this type.
    pub fn put(self, value: f64, big_endian: bool, out: &mut Vec<u8>) {
        macro_rules! number {
            ($kind:ty) => {{
                let value = value as $kind;
                out.extend_from_slice(&if big_endian { value.to_be_bytes() } else { value.to_le_bytes() })
            }};
        }
        match self {
            Self::I8 => number!(i8),
            Self::U8 => number!(u8),
            Self::I16 => number!(i16),
            Self::U16 => number!(u16),
            Self::I32 => number!(i32),
            Self::U32 => number!(u32),
            Self::I64 => number!(i64),
            Self::U64 => number!(u64),
            // Nothing is written in half precision: `holds` is false.
            Self::F16 => out.extend_from_slice(&[0, 0x7e]),
            Self::F32 => number!(f32),
            Self::F64 => number!(f64),
        }
    }

    /// Whether single precision holds every number of this type.
    pub fn is_single(self) -> bool {
        matches!(self, Self::I8 | Self::U8 | Self::I16 | Self::U16 | Self::F16 | Self::F32)
    }

    /// Whether this type holds `value` without rounding.
    pub fn holds(self, value: f64) -> bool {
        let mut bytes = Vec::with_capacity(8);
        self.put(value, false, &mut bytes);
        self.get(&bytes, 0, false).is_some_and(|back| back == value || (back.is_nan() && value.is_nan()))
    }

    /// The type for coordinate `axis` of a moved copy: this one if it holds all that has changed
    /// from `old` to `new`, otherwise `F32` where that is enough, or `F64`.
    pub fn for_moved(self, axis: usize, old: &[[f64; 3]], new: &[[f64; 3]], single: bool) -> Self {
        let pairs = || old.iter().zip(new).map(|(old, new)| (old[axis], new[axis]));
        let holds = |(old, new): (f64, f64)| old == new || old.is_nan() || self.holds(new);
        match pairs().all(holds) {
            true => self,
            false if single => Self::F32,
            false => Self::F64,
        }
    }

    /// The type for the components of a turned normal: floating point.
    pub fn for_turned(self) -> Self {
        match self {
            Self::F32 | Self::F64 => self,
            _ => Self::F32,
        }
    }
}

/// A number of half precision.
fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 0x3ff));
    let size = match exponent {
        0 => fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction / 1024.0) * 2f64.powi(exponent - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Scalar; 10] = [
        Scalar::I8,
        Scalar::U8,
        Scalar::I16,
        Scalar::U16,
        Scalar::I32,
        Scalar::U32,
        Scalar::I64,
        Scalar::U64,
        Scalar::F32,
        Scalar::F64,
    ];

    #[test]
    fn numbers_go_round_in_both_byte_orders() {
        for kind in ALL {
            for big in [false, true] {
                let mut bytes = vec![9];
                kind.put(113.0, big, &mut bytes);
                assert_eq!(bytes.len(), 1 + kind.size());
                assert_eq!(kind.get(&bytes, 1, big), Some(113.0));
                assert_eq!(kind.get(&bytes, 2, big), None);
                assert_eq!(kind.get(&bytes, usize::MAX, big), None);
            }
        }
        let mut bytes = Vec::new();
        Scalar::I16.put(-2.0, true, &mut bytes);
        assert_eq!(bytes, [0xff, 0xfe]);
    }

    #[test]
    fn half_precision() {
        for (bits, value) in [
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x3555, 0.333_251_953_125),
            (1, 2f64.powi(-24)),
            (0x7bff, 65_504.0),
        ] {
            assert_eq!(half(bits), value);
        }
        assert!(half(0x7e00).is_nan() && half(0xfc00) == f64::NEG_INFINITY);
        assert!(!Scalar::F16.holds(1.0), "a moved copy takes another type");
    }

    #[test]
    fn what_a_type_holds() {
        assert!(Scalar::F32.holds(0.5) && !Scalar::F32.holds(0.1) && Scalar::F32.holds(f64::NAN));
        assert!(Scalar::U8.holds(255.0) && !Scalar::U8.holds(256.0) && !Scalar::I32.holds(0.5));
        let (old, new) = ([[0.1, 1.0, 2.0], [1.0, 2.0, f64::NAN]], [[0.1, 0.1, 2.0], [2.5, 2.0, f64::NAN]]);
        let types = |single| [0, 1, 2].map(|axis| Scalar::F32.for_moved(axis, &old, &new, single));
        assert_eq!(types(false), [Scalar::F32, Scalar::F64, Scalar::F32]);
        assert_eq!(types(true), [Scalar::F32; 3]);
    }
}
