//! [`Stream`]: where the random numbers of a pair come from.

use rand::{SeedableRng, rngs::ChaCha8Rng};

/// Names the random numbers of one pair: the same `seed` and `item` give the same pair, on any
/// thread, in any order, in any batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Stream {
    /// Seed of the whole run.
    pub seed: u64,
    /// Number of the pair in the run.
    pub item: u64,
}

/// What the numbers are for. Every purpose has a generator of its own, so that, say, another
/// corruption leaves the pose as it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u64)]
pub enum Purpose {
    /// For the caller: which corruption, which severity, which shape.
    Choice = 0,
    /// Points of the shape.
    Base = 1,
    /// Corruption of the source.
    SourceCorruption = 2,
    /// Corruption of the target.
    TargetCorruption = 3,
    /// The pose.
    Pose = 4,
    /// Resampling and order of the source.
    SourceResampling = 5,
    /// Resampling and order of the target.
    TargetResampling = 6,
    /// Which part of each cloud a crop keeps.
    Crop = 7,
}

impl Stream {
    /// The generator for `purpose`: ChaCha8 whose key is the seed (8 bytes, little endian), the
    /// purpose (8 bytes) and a fixed tag (16 bytes), and whose stream number is the item.
    pub fn rng(self, purpose: Purpose) -> ChaCha8Rng {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&self.seed.to_le_bytes());
        key[8..16].copy_from_slice(&(purpose as u64).to_le_bytes());
        key[16..].copy_from_slice(b"srrf pair stream");
        let mut rng = ChaCha8Rng::from_seed(key);
        rng.set_stream(self.item);
        rng
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    #[test]
    fn every_name_is_another_stream() {
        let mut firsts: Vec<u64> = Vec::new();
        for seed in [0, 1, u64::MAX] {
            for item in [0, 1, 1 << 40] {
                for purpose in [Purpose::Choice, Purpose::Pose, Purpose::TargetResampling] {
                    let stream = Stream { seed, item };
                    assert_eq!(stream.rng(purpose).next_u64(), stream.rng(purpose).next_u64());
                    firsts.push(stream.rng(purpose).next_u64());
                }
            }
        }
        firsts.sort_unstable();
        firsts.dedup();
        assert_eq!(firsts.len(), 27);
    }
}
