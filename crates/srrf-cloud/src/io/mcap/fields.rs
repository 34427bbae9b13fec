//! Numbers and texts one after another, as ROS writes them.

/// Reads numbers from the front to the back; `None` past the end.
#[derive(Debug, Clone)]
pub(super) struct RosWords<'a> {
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
    /// Numbers begin at multiples of their size, and texts end with a zero.
    cdr: bool,
}

impl<'a> RosWords<'a> {
    /// Little endian and without gaps, as in MCAP's own records and in ROS 1.
    pub fn plain(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, big_endian: false, cdr: false }
    }

    /// As in ROS 2, behind the four bytes that say the order of the others; `None` for an encoding that is not
    /// supported.
    pub fn cdr(bytes: &'a [u8]) -> Option<Self> {
        let (header, bytes) = bytes.split_first_chunk::<4>()?;
        let big_endian = match header[..2] {
            [0, 0 | 6] => true,
            [0, 1 | 7] => false,
            _ => return None,
        };
        Some(Self { bytes, at: 0, big_endian, cdr: true })
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let begin = if self.cdr { self.at.next_multiple_of(N) } else { self.at };
        let mut raw: [u8; N] = *self.bytes.get(begin..)?.first_chunk()?;
        self.at = begin + N;
        if self.big_endian {
            raw.reverse();
        }
        Some(raw)
    }

    pub fn u8(&mut self) -> Option<u8> {
        self.take::<1>().map(|[byte]| byte)
    }

    pub fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    /// A list of bytes behind its length.
    pub fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()? as usize;
        let begin = self.at;
        self.at = begin.checked_add(length)?;
        self.bytes.get(begin..self.at)
    }

    pub fn text(&mut self) -> Option<String> {
        let cdr = self.cdr;
        let bytes = self.bytes()?;
        let bytes = if cdr { bytes.strip_suffix(&[0]).unwrap_or(bytes) } else { bytes };
        Some(String::from_utf8_lossy(bytes).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_orders_and_gaps() {
        let little = [0, 1, 0, 0, 7, 0, 0, 0, 3, 0, 0, 0, b'a', b'b', 0, 0, 0x39, 0x30];
        let big = [0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 3, b'a', b'b', 0, 0, 0x30, 0x39];
        for bytes in [little, big] {
            let mut words = RosWords::cdr(&bytes).unwrap();
            assert_eq!(words.u8(), Some(7));
            assert_eq!(words.text().as_deref(), Some("ab"));
            assert_eq!(words.u16(), Some(12_345), "begins at an even place");
            assert_eq!(words.u8(), None);
        }
        let mut plain = RosWords::plain(&[2, 0, 0, 0, b'a', b'b', 9]);
        assert_eq!((plain.text().as_deref(), plain.u8(), plain.u32()), (Some("ab"), Some(9), None));
        assert!(RosWords::cdr(&[0, 3, 0, 0, 1]).is_none() && RosWords::cdr(&[0]).is_none());
        assert_eq!(RosWords::plain(&[255, 255, 255, 255, 1]).bytes(), None);
    }
}
