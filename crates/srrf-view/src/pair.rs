//! [`Pair`]: two clouds and what was found between them.

use srrf_cloud::{PointCloud, Registration, Rigid, Skeleton, SoftMatch};

use crate::{Number, Up};

/// A pose to show, with its name and figures of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Pose {
    pub(crate) name: String,
    pub(crate) target_from_source: Rigid,
    pub(crate) numbers: Vec<Number>,
}

impl Pose {
    /// `target ~ R source + t`, in the coordinates of the clouds.
    pub fn new(name: impl Into<String>, target_from_source: Rigid) -> Self {
        Self { name: name.into(), target_from_source, numbers: Vec::new() }
    }

    /// A figure of this pose, such as its error. Figures with the same label make one column of the
    /// table of poses.
    #[must_use]
    pub fn number(mut self, number: Number) -> Self {
        self.numbers.push(number);
        self
    }
}

/// Two clouds, the poses found between them, and whatever else is worth seeing.
#[derive(Debug, Clone)]
pub struct Pair<'a> {
    pub(crate) name: String,
    pub(crate) source: &'a PointCloud,
    pub(crate) target: &'a PointCloud,
    pub(crate) before: Pose,
    pub(crate) poses: Vec<Pose>,
    pub(crate) skeletons: Option<[Skeleton; 2]>,
    pub(crate) matches: Vec<SoftMatch>,
    pub(crate) numbers: Vec<Number>,
    pub(crate) warnings: Vec<String>,
    pub(crate) unit: String,
    pub(crate) up: Option<Up>,
    /// Of the source and of the target.
    pub(crate) values: [PointValues<'a>; 2],
}

/// What a cloud holds for each of its points besides the place.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PointValues<'a> {
    /// Red, green, blue.
    pub colours: Option<&'a [[u8; 3]]>,
    /// Intensity of the return, in any unit.
    pub intensities: Option<&'a [f64]>,
}

impl<'a> Pair<'a> {
    /// A pair whose pose before any registration is the identity.
    pub fn new(name: impl Into<String>, source: &'a PointCloud, target: &'a PointCloud) -> Self {
        Self {
            name: name.into(),
            source,
            target,
            before: Pose::new("as given", Rigid::identity()),
            poses: Vec::new(),
            skeletons: None,
            matches: Vec::new(),
            numbers: Vec::new(),
            warnings: Vec::new(),
            unit: String::new(),
            up: None,
            values: [PointValues::default(); 2],
        }
    }

    /// The pose before registration, instead of the identity.
    #[must_use]
    pub fn before(mut self, pose: Pose) -> Self {
        self.before = pose;
        self
    }

    /// A pose that was found. The first is shown when the page opens: add the result first, then
    /// branches, starts or other methods.
    #[must_use]
    pub fn pose(mut self, pose: Pose) -> Self {
        self.poses.push(pose);
        self
    }

    /// The answer of a method: its pose under the name `result`, its branches under theirs, its
    /// skeletons and its soft matches.
    #[must_use]
    pub fn registration(mut self, registration: &Registration) -> Self {
        self.poses.push(Pose::new("result", registration.target_from_source));
        self.poses.extend(registration.branches.iter().map(|branch| {
            Pose::new(branch.kind.name(), branch.target_from_source).number(
                Number::new("Inlier ratio", branch.inlier_ratio)
                    .help("share of the branch's correspondences that agree with its pose"),
            )
        }));
        self.matches.extend(registration.matches.iter().copied());
        match &registration.skeletons {
            Some(both) => self.skeletons(both.source.clone(), both.target.clone()),
            None => self,
        }
    }

    /// The skeletons of the two clouds, each in the coordinates of its cloud.
    #[must_use]
    pub fn skeletons(mut self, source: Skeleton, target: Skeleton) -> Self {
        self.skeletons = Some([source, target]);
        self
    }

    /// Matches, in any order; the [`crate::MATCHES_PER_PAIR`] strongest are drawn.
    #[must_use]
    pub fn matches(mut self, matches: impl IntoIterator<Item = SoftMatch>) -> Self {
        self.matches.extend(matches);
        self
    }

    /// A figure beside the view.
    #[must_use]
    pub fn number(mut self, number: Number) -> Self {
        self.numbers.push(number);
        self
    }

    /// A warning above the figures, one sentence.
    #[must_use]
    pub fn warning(mut self, warning: impl Into<String>) -> Self {
        self.warnings.push(warning.into());
        self
    }

    /// The unit of the coordinates, such as `m`. Without it lengths are shown as bare numbers.
    #[must_use]
    pub fn unit(mut self, unit: impl Into<String>) -> Self {
        self.unit = unit.into();
        self
    }

    /// Colours and intensities of the source and of the target, one for each point. The reader switches between them and one
    /// colour a cloud.
    #[must_use]
    pub fn values(mut self, source: PointValues<'a>, target: PointValues<'a>) -> Self {
        self.values = [source, target];
        self
    }

    /// Which axis of the target points up on the screen; without it, [`Up::guess`] says.
    #[must_use]
    pub fn up(mut self, up: Up) -> Self {
        self.up = Some(up);
        self
    }
}

#[cfg(test)]
mod tests {
    use srrf_cloud::{Branch, BranchKind, Skeletons};

    use super::*;

    #[test]
    fn a_registration_brings_its_branches_and_skeletons() {
        let cloud = PointCloud::new(vec![[0.0; 3]]).unwrap();
        let mut answer = Registration::from_pose(Rigid::identity());
        answer.branches.push(Branch {
            kind: BranchKind::Dense,
            target_from_source: Rigid::identity(),
            inlier_ratio: 0.25,
        });
        answer.skeletons = Some(Skeletons {
            source: Skeleton { points: vec![[1.0; 3]], radii: vec![0.5] },
            target: Skeleton { points: vec![[2.0; 3], [3.0; 3]], radii: Vec::new() },
        });
        answer.matches.push(SoftMatch { source: [0.0; 3], target: [2.0; 3], weight: 0.75 });
        let pair = Pair::new("a", &cloud, &cloud).registration(&answer);
        assert_eq!(pair.matches, answer.matches);
        assert_eq!(pair.poses.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), ["result", "dense"]);
        assert_eq!(pair.poses[1].numbers[0].value, "0.25");
        assert_eq!(pair.skeletons.unwrap().map(|s| s.points.len()), [1, 2]);
    }
}
