//! The seam that every registration method implements.

use std::fmt;

use crate::{CloudError, PointCloud, Rigid, Solid};

/// Why two clouds could not be registered.
#[derive(Debug, thiserror::Error)]
pub enum RegisterError {
    /// The source cloud cannot be used.
    #[error("source: {0}")]
    Source(#[source] CloudError),
    /// The target cloud cannot be used.
    #[error("target: {0}")]
    Target(#[source] CloudError),
    /// The device that the method runs on did not give its numbers.
    #[error("{0}")]
    Device(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// The method ran and found no pose.
    #[error("no pose found: {0}")]
    NoPose(#[source] Box<dyn std::error::Error + Send + Sync>),
}

/// Which of the poses that a method finds on its way to its answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum BranchKind {
    /// By the points of the clouds themselves.
    Dense,
    /// By the skeletons.
    Skeleton,
    /// Before the refinement.
    Unrefined,
}

impl BranchKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Dense, Self::Skeleton, Self::Unrefined];

    /// Suffix of the method's name under which the pose is scored, such as `dense`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Dense => "dense",
            Self::Skeleton => "skeleton",
            Self::Unrefined => "unrefined",
        }
    }
}

impl fmt::Display for BranchKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// One of several poses that a method finds on its way to its answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    /// Which one.
    pub kind: BranchKind,
    /// The pose of this branch.
    pub target_from_source: Rigid,
    /// Share of the branch's correspondences that agree with its pose, in [0, 1].
    pub inlier_ratio: f64,
}

/// A skeleton: spheres along the middle of a shape.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Skeleton {
    /// Centres in the coordinates of their cloud, shape `[s, 3]`.
    pub points: Vec<[f64; 3]>,
    /// Radii in the unit of the cloud, shape `[s]`; empty where they are not known.
    pub radii: Vec<f64>,
}

/// Skeletons that a method extracted on its way, each in the coordinates of its cloud.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Skeletons {
    /// Of the source.
    pub source: Skeleton,
    /// Of the target.
    pub target: Skeleton,
}

/// A soft match: a point of the source, and where a method expects it in the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoftMatch {
    /// In source coordinates.
    pub source: [f64; 3],
    /// In target coordinates.
    pub target: [f64; 3],
    /// Not negative; the greater, the stronger.
    pub weight: f64,
}

/// What a method answers.
#[derive(Debug, Clone, PartialEq)]
pub struct Registration {
    /// The pose: `target ~ R source + t`.
    pub target_from_source: Rigid,
    /// Whether the method's own stopping rule was met; methods without one say `true`.
    pub converged: bool,
    /// Iterations used; 1 for methods that do not iterate.
    pub iterations: usize,
    /// Poses found on the way, each scored as a row of its own.
    pub branches: Vec<Branch>,
    /// The skeletons, from methods that make them.
    pub skeletons: Option<Skeletons>,
    /// Soft matches behind the pose, from methods that make them.
    pub matches: Vec<SoftMatch>,
    /// Weight of the dense branch in the fused pose, in [0, 1], from methods that fuse two branches: the number that the pose was
    /// made with.
    pub lambda: Option<f64>,
    /// How sure the method is of its pose, where it says so.
    pub certainty: Option<Certainty>,
}

/// What a method says of its own pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Certainty {
    /// Probability that the pose is right ([`is_right`](crate::is_right)), in [0, 1].
    pub probability: f64,
    /// Whether that is too little to rely on the pose.
    pub abstain: bool,
}

impl Registration {
    /// An answer without branches from a method that does not iterate.
    pub fn from_pose(target_from_source: Rigid) -> Self {
        Self {
            target_from_source,
            converged: true,
            iterations: 1,
            branches: Vec::new(),
            skeletons: None,
            matches: Vec::new(),
            lambda: None,
            certainty: None,
        }
    }

    /// The answer for the source itself, where this one is for the source as `start` moved it.
    pub fn after(mut self, start: &Rigid) -> Self {
        self.target_from_source = self.target_from_source.compose(start);
        for branch in &mut self.branches {
            branch.target_from_source = branch.target_from_source.compose(start);
        }
        let back = start.inverse();
        if let Some(skeletons) = &mut self.skeletons {
            skeletons.source.points.iter_mut().for_each(|p| *p = back.apply(p));
        }
        self.matches.iter_mut().for_each(|m| m.source = back.apply(&m.source));
        self
    }
}

/// A registration method: two clouds in, one pose out. Same input, same answer.
pub trait Register: Send + Sync {
    /// The name in tables, in lower case, such as `icp`.
    fn name(&self) -> &str;

    /// Finds the pose that maps `source` onto `target`: checks both clouds, then [`Register::register_solid`].
    ///
    /// # Errors
    /// [`RegisterError`] when a cloud cannot be used or no pose is found.
    fn register(&self, source: &PointCloud, target: &PointCloud) -> Result<Registration, RegisterError> {
        let source = Solid::new(source).map_err(RegisterError::Source)?;
        let target = Solid::new(target).map_err(RegisterError::Target)?;
        self.register_solid(source, target)
    }

    /// As [`Register::register`], of clouds that determine a rotation. This is what a method writes.
    ///
    /// # Errors
    /// [`RegisterError`] when no pose is found.
    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError>;
}
