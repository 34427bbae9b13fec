//! [`TextEncoding`]: text in UTF-16 and UTF-32, as PowerShell and spreadsheets write it.

use std::borrow::Cow;
use std::fmt;

use super::FormatError;

/// Bytes at the begin that say what a text without a mark is.
const BEGIN: usize = 4096;
/// Characters that are looked at, at least: a few bytes say nothing.
const FEWEST: usize = 4;

/// An encoding of text that is not made of single bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextEncoding {
    /// UTF-16, the lower byte first.
    Utf16Le,
    /// UTF-16, the higher byte first.
    Utf16Be,
    /// UTF-32, the lower byte first.
    Utf32Le,
    /// UTF-32, the higher byte first.
    Utf32Be,
}

impl fmt::Display for TextEncoding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Utf16Le => "UTF-16 (little endian)",
            Self::Utf16Be => "UTF-16 (big endian)",
            Self::Utf32Le => "UTF-32 (little endian)",
            Self::Utf32Be => "UTF-32 (big endian)",
        })
    }
}

impl TextEncoding {
    /// In the order in which they are tried: the mark of UTF-32 begins as that of UTF-16.
    const ALL: [Self; 4] = [Self::Utf32Le, Self::Utf32Be, Self::Utf16Le, Self::Utf16Be];

    /// The encoding of a text that is in one of these, by its mark or by the zeros in it; `None` for anything else. The
    /// begin of the text has to be letters, digits and signs of ASCII for the most part, so that files of numbers are none.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let begin = &bytes[..bytes.len().min(BEGIN)];
        Self::ALL.into_iter().find(|encoding| encoding.is_of(begin))
    }

    fn is_of(self, begin: &[u8]) -> bool {
        let marked = begin.starts_with(self.mark());
        let (mut all, mut plain, mut ended) = (0usize, 0usize, false);
        for character in self.characters(begin.strip_prefix(self.mark()).unwrap_or(begin)) {
            // What is cut at the end is no character, and nothing follows it.
            let Some(character) = character.filter(|_| !ended) else {
                if ended {
                    return false;
                }
                ended = true;
                continue;
            };
            if character.is_control() && !matches!(character, '\t' | '\n' | '\r' | '\u{c}') {
                return false;
            }
            all += 1;
            plain += usize::from(character.is_ascii());
        }
        all >= if marked { 1 } else { FEWEST } && 10 * plain >= 9 * all
    }

    /// What stands before a text in this encoding, if the program that wrote it says so.
    fn mark(self) -> &'static [u8] {
        match self {
            Self::Utf16Le => &[0xff, 0xfe],
            Self::Utf16Be => &[0xfe, 0xff],
            Self::Utf32Le => &[0xff, 0xfe, 0, 0],
            Self::Utf32Be => &[0, 0, 0xfe, 0xff],
        }
    }

    /// The characters; `None` for one that is none.
    fn characters(self, bytes: &[u8]) -> Box<dyn Iterator<Item = Option<char>> + '_> {
        let pairs = |read: fn([u8; 2]) -> u16| {
            let (units, rest) = bytes.as_chunks::<2>();
            let cut = (!rest.is_empty()).then_some(None);
            char::decode_utf16(units.iter().map(move |unit| read(*unit))).map(Result::ok).chain(cut)
        };
        let fours = |read: fn([u8; 4]) -> u32| {
            let (units, rest) = bytes.as_chunks::<4>();
            let cut = (!rest.is_empty()).then_some(None);
            units.iter().map(move |unit| char::from_u32(read(*unit))).chain(cut)
        };
        match self {
            Self::Utf16Le => Box::new(pairs(u16::from_le_bytes)),
            Self::Utf16Be => Box::new(pairs(u16::from_be_bytes)),
            Self::Utf32Le => Box::new(fours(u32::from_le_bytes)),
            Self::Utf32Be => Box::new(fours(u32::from_be_bytes)),
        }
    }

    /// The text as UTF-8, without its mark.
    ///
    /// # Errors
    /// [`FormatError::Content`] with the character that is none.
    pub fn decode(self, bytes: &[u8]) -> Result<String, FormatError> {
        let bare = bytes.strip_prefix(self.mark()).unwrap_or(bytes);
        let mut text = String::with_capacity(bare.len() / 2 + 4);
        for (number, character) in (1..).zip(self.characters(bare)) {
            text.push(character.ok_or_else(|| {
                FormatError::Content(format!(
                    "the text is {self}, and damaged at character {number}; save it as UTF-8"
                ))
            })?);
        }
        Ok(text)
    }
}

/// A text as UTF-8 where it is in another of these encodings; what is not in one stays as it is.
///
/// # Errors
/// As [`TextEncoding::decode`].
pub fn as_utf8(bytes: &[u8]) -> Result<Cow<'_, [u8]>, FormatError> {
    match TextEncoding::of(bytes) {
        Some(encoding) => Ok(Cow::Owned(encoding.decode(bytes)?.into_bytes())),
        None => Ok(Cow::Borrowed(bytes)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(encoding: TextEncoding, text: &str) -> Vec<u8> {
        let units = || text.encode_utf16();
        let points = || text.chars().map(u32::from);
        match encoding {
            TextEncoding::Utf16Le => units().flat_map(u16::to_le_bytes).collect(),
            TextEncoding::Utf16Be => units().flat_map(u16::to_be_bytes).collect(),
            TextEncoding::Utf32Le => points().flat_map(u32::to_le_bytes).collect(),
            TextEncoding::Utf32Be => points().flat_map(u32::to_be_bytes).collect(),
        }
    }

    #[test]
    fn every_encoding_with_and_without_its_mark() {
        let text = "x,y,z,Höhe 𝄞\r\n1.5,-2,3e-4,7\r\n";
        for encoding in TextEncoding::ALL {
            let bare = encoded(encoding, text);
            let marked = encoded(encoding, &format!("\u{feff}{text}"));
            for bytes in [bare, marked] {
                assert_eq!(TextEncoding::of(&bytes), Some(encoding));
                assert_eq!(&*as_utf8(&bytes).unwrap(), text.as_bytes(), "{encoding}");
            }
            let long = encoded(encoding, &"1.25 2.5 -3.75\n".repeat(900));
            assert_eq!(TextEncoding::of(&long), Some(encoding), "cut at {BEGIN} bytes");
            let cut = &encoded(encoding, "\u{feff}1 2 3\n4 5 6\n");
            let error = as_utf8(&cut[..cut.len() - 1]).unwrap_err().to_string();
            assert!(error.contains("damaged at character 12; save it as UTF-8"), "{error}");
            assert!(error.contains(&encoding.to_string()), "{error}");
        }
    }

    #[test]
    fn anything_else_stays() {
        let floats: Vec<u8> = (1..400).flat_map(|i| (0.1 * i as f32).to_le_bytes()).collect();
        let words: Vec<u8> = (0..400u16).flat_map(u16::to_le_bytes).collect();
        let zeros = [0; 64];
        let marked = [&[0xff, 0xfe][..], &floats].concat();
        let some: Vec<u8> = (0..9).flat_map(|_| [0, 0, 0, b'7', 0xff, 0xff, 0xff, 0xff]).collect();
        let german = b"x y H\xf6he\n1 2 3\n";
        for bytes in [
            &b"1 2 3\n"[..],
            b"",
            b"1",
            "\u{feff}1 2 3".as_bytes(),
            &floats,
            &words,
            &zeros,
            &some,
            &marked,
            german,
        ] {
            assert_eq!(TextEncoding::of(bytes), None, "{:?}", &bytes[..bytes.len().min(8)]);
            assert!(matches!(as_utf8(bytes), Ok(Cow::Borrowed(same)) if same == bytes));
        }
    }
}
