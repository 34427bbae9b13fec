//! LZF, the compression of PCD's `binary_compressed`, in the format of Marc Lehmann's LibLZF: a byte
//! below 32 is followed by that many plain bytes and one more; any other byte, with those that
//! follow, is a length and a distance back.

/// Longest run of plain bytes.
const MAX_LITERAL: usize = 32;
/// Longest copy, and how far back it may reach.
const MAX_COPY: usize = 264;
const MAX_DISTANCE: usize = 8192;
/// The most bytes that one compressed byte can stand for: 3 bytes copy `MAX_COPY`.
pub(super) const MAX_RATIO: usize = MAX_COPY / 3;

/// The `length` bytes that `input` stands for; `None` where it stands for anything else. Takes no
/// more memory than `MAX_RATIO` times the input.
pub(super) fn decompress(input: &[u8], length: usize) -> Option<Vec<u8>> {
    if length > input.len().checked_mul(MAX_RATIO)? {
        return None;
    }
    let mut output = Vec::with_capacity(length);
    let mut input = input.iter();
    while let Some(&control) = input.next() {
        let control = usize::from(control);
        if control < MAX_LITERAL {
            let literal = input.as_slice().get(..=control)?;
            if output.len() + literal.len() > length {
                return None;
            }
            output.extend_from_slice(literal);
            input.nth(control)?;
            continue;
        }
        let mut count = control >> 5;
        if count == 7 {
            count += usize::from(*input.next()?);
        }
        count += 2;
        let distance = ((control & 31) << 8 | usize::from(*input.next()?)) + 1;
        let from = output.len().checked_sub(distance)?;
        if output.len() + count > length {
            return None;
        }
        if distance >= count {
            output.extend_from_within(from..from + count);
        } else {
            // The copy overlaps what it writes.
            for at in from..from + count {
                output.push(output[at]);
            }
        }
    }
    (output.len() == length).then_some(output)
}

/// Compresses `input`; at most one byte in 32 longer than it.
pub(super) fn compress(input: &[u8]) -> Vec<u8> {
    let mut output = Vec::with_capacity(input.len() / 2);
    // Where three bytes with this hash were last; one more than the index, 0 for nowhere.
    let mut seen = vec![0usize; 1 << 14];
    let mut plain = 0;
    let mut at = 0;
    while at + 2 < input.len() {
        let three = u32::from_le_bytes([input[at], input[at + 1], input[at + 2], 0]);
        let slot = &mut seen[(three.wrapping_mul(0x9e37_79b1) >> 18) as usize];
        let before = std::mem::replace(slot, at + 1);
        let from = before.wrapping_sub(1);
        if before == 0 || at - from > MAX_DISTANCE || input[from..from + 3] != input[at..at + 3] {
            at += 1;
            continue;
        }
        let most = MAX_COPY.min(input.len() - at);
        let count = (3..most).find(|&n| input[from + n] != input[at + n]).unwrap_or(most);
        put_plain(&mut output, &input[plain..at]);
        let distance = at - from - 1;
        let length = count - 2;
        output.push(((length.min(7) << 5) | (distance >> 8)) as u8);
        if length >= 7 {
            output.push((length - 7) as u8);
        }
        output.push((distance & 0xff) as u8);
        at += count;
        plain = at;
    }
    put_plain(&mut output, &input[plain..]);
    output
}

fn put_plain(output: &mut Vec<u8>, bytes: &[u8]) {
    for run in bytes.chunks(MAX_LITERAL) {
        output.push((run.len() - 1) as u8);
        output.extend_from_slice(run);
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn goes_round() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let noise: Vec<u8> = (0..20_011).map(|_| rng.random()).collect();
        let few: Vec<u8> = (0..20_011).map(|_| rng.random_range(0..3)).collect();
        for input in
            [&b""[..], b"a", b"ab", b"aaa", &[7; 9000], &noise, &few, &[&noise[..9000], &noise].concat()]
        {
            let packed = compress(input);
            assert!(packed.len() <= input.len() + input.len().div_ceil(32));
            assert_eq!(decompress(&packed, input.len()).as_deref(), Some(input));
            if !input.is_empty() {
                assert_eq!(decompress(&packed, input.len() - 1), None);
                assert_eq!(decompress(&packed[..packed.len() - 1], input.len()), None);
            }
            assert_eq!(decompress(&packed, input.len() + 1), None);
        }
        assert!(compress(&[7; 9000]).len() < 150);
    }

    #[test]
    fn known_bytes() {
        // "abcabcabcabc": three plain bytes, then 9 bytes from 3 back (length 9 - 2 = 7 + 0).
        assert_eq!(
            decompress(&[2, b'a', b'b', b'c', 7 << 5, 0, 2], 12).as_deref(),
            Some(&b"abcabcabcabc"[..])
        );
        assert_eq!(decompress(&[0x20, 5], 3), None, "a distance before the begin");
        assert_eq!(decompress(&[], usize::MAX), None);
    }
}
