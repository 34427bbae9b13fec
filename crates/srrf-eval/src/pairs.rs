//! Pairs to be scored: what a pair is, and where pairs come from.

use srrf_corrupt::Pair;

use crate::EvalError;

/// A pair to be scored.
#[derive(Debug, Clone)]
pub struct EvalPair {
    /// The clouds, the true pose, the shape's name and, where known, the correspondences.
    pub pair: Pair,
    /// The clean shape in the source frame, shape `[k, 3]`, where it is known.
    pub clean: Option<Vec<[f64; 3]>>,
}

/// A set of pairs that are summed up together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// Name of the corruption; `clean`; or the name of the group in a file of pairs.
    pub corruption: String,
    /// 1 to 5; 0 for clean pairs and groups of a file.
    pub severity: u8,
    /// Number of pairs, at least 1.
    pub pairs: usize,
}

impl Group {
    /// The prefix of the group's arrays in a file: the corruption, and `_s` with the severity if
    /// it has one, such as `cutout_s3`.
    pub fn name(&self) -> String {
        if self.severity == 0 {
            self.corruption.clone()
        } else {
            format!("{}_s{}", self.corruption, self.severity)
        }
    }
}

/// Groups of pairs. The same group and item give the same pair, in any order and on any thread.
pub trait PairSource: Sync {
    /// One line: which data, which split, which protocol.
    fn description(&self) -> String;

    /// The groups, in the order of the report; at least 1.
    fn groups(&self) -> &[Group];

    /// Whether the pairs keep their correspondences, so that the oracle can be scored.
    fn has_oracle(&self) -> bool;

    /// Pair `item` of group `group`.
    ///
    /// # Errors
    /// [`EvalError`] where it cannot be read or made.
    fn pair(&self, group: usize, item: usize) -> Result<EvalPair, EvalError>;
}
