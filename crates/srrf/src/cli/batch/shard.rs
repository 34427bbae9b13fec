//! [`Shard`]: which pairs of a list one of many machines does.

use std::fmt;
use std::str::FromStr;

/// Part `number` (from 1) of `of` parts. A pair belongs to a part by its id alone, so that a list that grows moves none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    number: u64,
    of: u64,
}

impl Shard {
    /// Whether a pair belongs to it.
    pub fn has(self, id: &str) -> bool {
        hash(id) % self.of == self.number - 1
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts =
            text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((number, of)) if (1..=of).contains(&number) => Ok(Self { number, of }),
            _ => Err("expected a part of all parts, such as 3/64, from 1/64 to 64/64".into()),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// FNV-1a of 64 bits (Fowler, Noll and Vo): the same on every machine and in every version.
pub fn hash(text: &str) -> u64 {
    text.bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_is_in_one_part() {
        let parts: Vec<Shard> = (1..=7).map(|k| format!("{k}/7").parse().unwrap()).collect();
        let mut sizes = [0; 7];
        for i in 0..7000 {
            let id = format!("scan{i:05}.ply -> map.ply");
            let of: Vec<usize> = (0..7).filter(|k| parts[*k].has(&id)).collect();
            assert_eq!(of.len(), 1);
            sizes[of[0]] += 1;
        }
        // Five standard deviations of a fair draw are 146.
        assert!(sizes.iter().all(|size: &usize| size.abs_diff(1000) < 146), "{sizes:?}");
        // The published values of the hash.
        assert_eq!(
            (hash(""), hash("a"), hash("foobar")),
            (0xcbf29ce484222325, 0xaf63dc4c8601ec8c, 0x85944171f73967e8)
        );
        for bad in ["0/4", "5/4", "3", "a/b", "1/0", "-1/4", ""] {
            assert!(bad.parse::<Shard>().unwrap_err().contains("3/64"), "{bad}");
        }
        assert_eq!(parts[2].to_string(), "3/7");
    }
}
