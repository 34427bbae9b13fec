//! The pages of an E57 file: 1,020 bytes each, followed by their checksum. The XML section, which
//! holds the poses, is replaced without touching the other sections.

use std::io;

use super::super::FormatError;

/// Bytes of a page, and of it without the checksum.
const PAGE: usize = 1024;
const CONTENT: usize = PAGE - 4;

fn word(bytes: &[u8], at: usize) -> Option<usize> {
    let word = bytes.get(at..)?.first_chunk().copied()?;
    usize::try_from(u64::from_le_bytes(word)).ok()
}

/// Checks that the XML section is inside the file, before memory is taken for it.
pub(super) fn check(bytes: &[u8]) -> Result<(), FormatError> {
    let found = || format!("{} bytes", bytes.len());
    let (Some(at), Some(length)) = (word(bytes, 24), word(bytes, 32)) else {
        return Err(FormatError::truncated("a header of 48 bytes", found()));
    };
    if at.checked_add(length).is_none_or(|end| end > bytes.len()) {
        return Err(FormatError::truncated(
            format!("an XML section of {length} bytes at byte {at}"),
            found(),
        ));
    }
    Ok(())
}

/// The file in `bytes` with another XML section at its end. The old one is dropped if it was the
/// last, otherwise it stays as unused bytes, so that no other section moves.
pub(super) fn with_xml(bytes: &[u8], xml: &str) -> io::Result<Vec<u8>> {
    let (Some(old_at), Some(old_length)) = (word(bytes, 24), word(bytes, 32)) else {
        return Err(FormatError::truncated("a header of 48 bytes", format!("{} bytes", bytes.len())).into());
    };
    let mut content: Vec<u8> =
        bytes.chunks(PAGE).flat_map(|page| &page[..page.len().min(CONTENT)]).copied().collect();
    let begin = old_at / PAGE * CONTENT + (old_at % PAGE).min(CONTENT);
    let end = begin.saturating_add(old_length);
    if content.get(end..).is_none_or(|rest| rest.iter().all(|&b| b == 0)) {
        content.truncate(begin);
    }
    // Sections begin at multiples of 4 bytes.
    content.resize(content.len().next_multiple_of(4), 0);
    let at = content.len() / CONTENT * PAGE + content.len() % CONTENT;
    content.extend_from_slice(xml.as_bytes());
    content.resize(content.len().next_multiple_of(CONTENT), 0);
    let size = content.len() / CONTENT * PAGE;
    for (offset, value) in [(16, size), (24, at), (32, xml.len())] {
        if let Some(slot) = content.get_mut(offset..offset + 8) {
            slot.copy_from_slice(&(value as u64).to_le_bytes());
        }
    }
    let mut out = Vec::with_capacity(size);
    for page in content.chunks(CONTENT) {
        out.extend_from_slice(page);
        out.extend_from_slice(&checksum(page).to_be_bytes());
    }
    Ok(out)
}

/// CRC-32C (Castagnoli), which E57 stores in big endian.
fn checksum(page: &[u8]) -> u32 {
    const TABLE: [u32; 256] = {
        let mut table = [0; 256];
        let mut index = 0;
        while index < 256 {
            let mut value = index as u32;
            let mut bit = 0;
            while bit < 8 {
                value = if value & 1 == 1 { value >> 1 ^ 0x82f6_3b78 } else { value >> 1 };
                bit += 1;
            }
            table[index] = value;
            index += 1;
        }
        table
    };
    !page.iter().fold(!0, |sum: u32, &byte| TABLE[usize::from(sum as u8 ^ byte)] ^ (sum >> 8))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_of_the_standard() {
        assert_eq!(checksum(b"123456789"), 0xe306_9283);
    }
}
