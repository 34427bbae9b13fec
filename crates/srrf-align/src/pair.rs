//! The seams of an alignment: scans by number, a method that registers two of them, and a store of pairs that are done.

use std::borrow::Cow;
use std::convert::Infallible;

use serde::{Deserialize, Serialize};
use srrf_cloud::{PointCloud, Rigid};

/// Scans by number. They may be read anew each time they are asked for.
pub trait Scans: Sync {
    /// What can go wrong.
    type Error: std::error::Error + Send + Sync + 'static;

    /// How many there are.
    fn count(&self) -> usize;

    /// Where the scanner of one stood, in the frame of its points; none where that is not known.
    fn viewpoint(&self, _number: usize) -> Option<[f64; 3]> {
        None
    }

    /// One of them.
    ///
    /// # Errors
    /// Where it cannot be read.
    fn cloud(&self, number: usize) -> Result<Cow<'_, PointCloud>, Self::Error>;
}

impl Scans for [PointCloud] {
    type Error = Infallible;

    fn count(&self) -> usize {
        self.len()
    }

    fn cloud(&self, number: usize) -> Result<Cow<'_, PointCloud>, Infallible> {
        Ok(Cow::Borrowed(&self[number]))
    }
}

/// A method that registers two scans, the target made ready once for many sources.
pub trait RegisterPairs: Sync {
    /// A target made ready.
    type Target: Send + Sync;
    /// What can go wrong with a scan or the method; a pair without a pose is no error.
    type Error: std::error::Error + Send + Sync + 'static;

    /// Makes a target ready.
    ///
    /// # Errors
    /// For a scan that cannot be a target.
    fn prepare(&self, target: &PointCloud) -> Result<Self::Target, Self::Error>;

    /// Lays a source on a target, from a first guess if there is one.
    ///
    /// # Errors
    /// For a scan that cannot be a source.
    fn register(
        &self,
        source: &PointCloud,
        target: &Self::Target,
        target_from_source: Option<Rigid>,
    ) -> Result<PairAnswer, Self::Error>;

    /// Lays a source on a target from a pose near which it must be, and looks nowhere else. As
    /// [`register`](Self::register) where a method cannot do so.
    ///
    /// # Errors
    /// For a scan that cannot be a source.
    fn refine(
        &self,
        source: &PointCloud,
        target: &Self::Target,
        target_from_source: Rigid,
    ) -> Result<PairAnswer, Self::Error> {
        self.register(source, target, Some(target_from_source))
    }
}

/// Another pose of a pair that fits as well.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OtherPose {
    /// The pose, in input coordinates.
    pub target_from_source: Rigid,
    /// Probability that it is the right one, in [0, 1].
    pub probability: f64,
}

/// The registration of a pair.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairAnswer {
    /// The pose, in input coordinates; none where no pose was found.
    pub target_from_source: Option<Rigid>,
    /// Probability that it is right, in [0, 1].
    pub probability: f64,
    /// The same as far as its fit tells, in [0, 1]: as if there were no other poses that fit as well, which what scanners saw may exclude.
    /// The same as `probability` where that is not known.
    pub probability_of_fit: f64,
    /// Whether the probability is too little.
    pub abstain: bool,
    /// The other poses that fit as well.
    pub others: Vec<OtherPose>,
}

impl PairAnswer {
    /// No pose.
    pub const NOTHING: Self = Self {
        target_from_source: None,
        probability: 0.0,
        probability_of_fit: 0.0,
        abstain: true,
        others: Vec::new(),
    };

    /// The same with source and target exchanged.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let inverse = |other: &OtherPose| OtherPose {
            target_from_source: other.target_from_source.inverse(),
            ..*other
        };
        Self {
            target_from_source: self.target_from_source.map(|pose| pose.inverse()),
            others: self.others.iter().map(inverse).collect(),
            ..*self
        }
    }
}

/// Pairs that are done, so that an alignment can go on where it stopped, and a scan be added later.
pub trait PairStore: Sync {
    /// The answer of a pair in this order, if it is there.
    fn find(&self, source: usize, target: usize) -> Option<PairAnswer>;

    /// Pairs that are there, whether or not they would be tried: they cost nothing.
    fn pairs(&self) -> Vec<(usize, usize)> {
        Vec::new()
    }

    /// Keeps an answer. Called in no certain order, from many threads.
    fn keep(&self, source: usize, target: usize, answer: &PairAnswer);
}

/// Keeps nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoStore;

impl PairStore for NoStore {
    fn find(&self, _: usize, _: usize) -> Option<PairAnswer> {
        None
    }

    fn keep(&self, _: usize, _: usize, _: &PairAnswer) {}
}
