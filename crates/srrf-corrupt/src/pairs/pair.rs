//! [`Pair`]: what comes out of pair synthesis.

use srrf_cloud::{CloudError, PointCloud, Rigid};

use super::config::InvalidConfig;
use crate::corruption::CorruptError;
use crate::corruptions::CorruptionKind;
use crate::datasets::SourceError;
use crate::severity::Severity;

/// Two clouds of one shape, and the pose between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Shape `[points, 3]`, in the shape's canonical frame.
    pub source: PointCloud,
    /// Shape `[points, 3]`, posed by [`Pair::target_from_source`].
    pub target: PointCloud,
    /// The pose that was applied: exact, up to what the corruptions moved. With
    /// [`Normalize::AfterPose`](crate::Normalize::AfterPose) only its rotation means something.
    pub target_from_source: Rigid,
    /// For each source point the base point that it is, `None` for points that a corruption
    /// added. Absent for independent sampling, or where the config does not keep it.
    pub source_origin: Option<Vec<Option<u32>>>,
    /// The same for the target. Points with equal entries correspond.
    pub target_origin: Option<Vec<Option<u32>>>,
    /// What was done to the clouds; `None` if they are clean, or corrupted by what is not
    /// in the registry.
    pub corruption: Option<(CorruptionKind, Severity)>,
    /// Name of the shape.
    pub id: String,
    /// Name of its category, empty if unknown.
    pub class: String,
    /// Whether its class is symmetric about an axis, so that no pose is unique.
    pub symmetric: bool,
}

/// The clean points from which a pair is made, canonical frame.
#[derive(Debug, Clone, Copy)]
pub enum Bases<'a> {
    /// Source and target are made from the same points.
    Shared(&'a PointCloud),
    /// Source and target (in this order) are made from points of their own.
    Independent(&'a PointCloud, &'a PointCloud),
}

/// Why a pair could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PairError {
    /// The config makes no sense.
    #[error("pair configuration: {0}")]
    Config(#[from] InvalidConfig),
    /// The shape could not be had.
    #[error("{0}")]
    Shape(#[from] SourceError),
    /// The shape could not be corrupted.
    #[error("shape {id}: {source}")]
    Corrupt {
        /// Name of the shape.
        id: String,
        /// Why.
        source: CorruptError,
    },
    /// The pair has coordinates that are not finite, as huge input coordinates may give.
    #[error("shape {id}: {source}")]
    Cloud {
        /// Name of the shape.
        id: String,
        /// Which.
        source: CloudError,
    },
}
