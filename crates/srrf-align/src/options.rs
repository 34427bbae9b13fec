//! [`AlignOptions`], progress, and what can go wrong.

use std::fmt;

use serde::{Serialize, Serializer};
use srrf_cloud::{CloudError, Rigid};

/// What a user may want to change.
#[derive(Debug, Clone, PartialEq)]
pub struct AlignOptions {
    /// First guesses of `map_from_scan`, one a scan; none where nothing is known.
    pub initial: Vec<Option<Rigid>>,
    /// Whether the scans were taken one after the other, each overlapping the next.
    pub sequence: bool,
    /// Scans whose pairs with each other are not tried, only those with the others: the first so many.
    pub settled: usize,
    /// Up to so many scans all pairs are tried. Default 12.
    pub all_pairs: usize,
    /// Most pairs that are tried for one scan, where not all are. Default 8.
    pub pairs_per_scan: usize,
    /// Whether to end with the joint refinement on points. Default true.
    pub refine: bool,
    /// Threads that register at once keep one target each. Default: those of the current pool.
    pub at_once: Option<usize>,
}

impl Default for AlignOptions {
    fn default() -> Self {
        Self {
            initial: Vec::new(),
            sequence: false,
            settled: 0,
            all_pairs: 12,
            pairs_per_scan: 8,
            refine: true,
            at_once: None,
        }
    }
}

/// Why a pair was tried. [`fmt::Display`] gives the name in results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PairReason {
    /// All pairs of few scans are.
    All,
    /// The scans follow each other.
    Sequence,
    /// The first guesses overlap.
    Guess,
    /// Their descriptors look alike.
    Alike,
    /// It would join two components.
    Join,
    /// They overlap in the map so far.
    Loop,
    /// It was kept from an earlier run.
    Kept,
}

impl fmt::Display for PairReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::All => "all",
            Self::Sequence => "sequence",
            Self::Guess => "guess",
            Self::Alike => "alike",
            Self::Join => "join",
            Self::Loop => "loop",
            Self::Kept => "kept",
        })
    }
}

/// By its name.
impl Serialize for PairReason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// What is being done. [`fmt::Display`] gives words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AlignStage {
    /// Reading and thinning the scans.
    Read,
    /// Finding pairs that may overlap.
    Candidates,
    /// Registering pairs.
    Pairs,
    /// Finding the poses that the pairs agree on.
    Graph,
    /// Refining all poses on the points.
    Joint,
}

impl fmt::Display for AlignStage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Read => "reading scans",
            Self::Candidates => "finding candidates",
            Self::Pairs => "registering pairs",
            Self::Graph => "pose graph",
            Self::Joint => "joint refinement",
        })
    }
}

/// Progress of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AlignProgress {
    /// The stage.
    pub stage: AlignStage,
    /// What is done of it.
    pub done: usize,
    /// All of it; later rounds may add to it.
    pub total: usize,
}

/// Why scans could not be aligned.
#[derive(Debug, thiserror::Error)]
pub enum AlignError<S: std::error::Error + 'static, R: std::error::Error + 'static> {
    /// There are fewer than two scans.
    #[error("there are {0} scans: at least two are needed")]
    TooFew(usize),
    /// The first guesses are not one a scan.
    #[error("there are {guesses} first guesses for {scans} scans: give one for each, or none at all")]
    Guesses {
        /// How many there are.
        guesses: usize,
        /// How many there should be.
        scans: usize,
    },
    /// A first guess is no finite motion: its scan, from 0.
    #[error("the first guess of scan {0} (from 0) has numbers that are not finite")]
    Guess(usize),
    /// A scan cannot be read.
    #[error("scan {number}: {source}")]
    Scan {
        /// Its number, from 0.
        number: usize,
        /// Why.
        source: S,
    },
    /// A scan cannot be used.
    #[error("scan {number}: {source}")]
    Cloud {
        /// Its number, from 0.
        number: usize,
        /// Why.
        source: CloudError,
    },
    /// The method cannot use a scan.
    #[error("scan {number}: {source}")]
    Register {
        /// Number of the scan that it was about, from 0.
        number: usize,
        /// Why.
        source: R,
    },
}
