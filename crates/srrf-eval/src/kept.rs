//! [`KeptAnswer`]: what a method answered on a pair, as it is scored and kept.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use srrf_cloud::{Certainty, RegisterError, Registration, Rigid};

use crate::chamfer::SkeletonAgreement;

/// What a method answered on a pair, and how long it took. Written as JSON it keeps every bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct KeptAnswer {
    /// Time of the call, in seconds, divided by the pairs in it.
    #[serde(rename = "s")]
    pub seconds: Exact,
    /// The answer, or why there is none.
    #[serde(flatten)]
    pub answer: Result<KeptPoses, String>,
}

/// The parts of a [`Registration`] that are scored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct KeptPoses {
    /// The method's pose.
    #[serde(rename = "p", with = "pose")]
    pub pose: Rigid,
    /// The poses of its branches, by name.
    #[serde(rename = "b", default, skip_serializing_if = "Vec::is_empty")]
    pub branches: Vec<KeptBranch>,
    /// Iterations used.
    #[serde(rename = "i")]
    pub iterations: usize,
    /// Whether the method's own stopping rule was met.
    #[serde(rename = "c")]
    pub converged: bool,
    /// How well the skeletons agree under the true pose: Chamfer, sum of distances, spread.
    #[serde(rename = "k", default, skip_serializing_if = "Option::is_none")]
    pub skeletons: Option<[Exact; 3]>,
    /// How sure the method is: the probability, and whether it abstains.
    #[serde(rename = "q", default, skip_serializing_if = "Option::is_none")]
    pub certainty: Option<(Exact, bool)>,
}

/// The pose of a branch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct KeptBranch {
    /// Name of the branch.
    #[serde(rename = "n")]
    pub name: String,
    /// Its pose.
    #[serde(rename = "p", with = "pose")]
    pub pose: Rigid,
}

impl KeptAnswer {
    /// Keeps what is scored of an answer.
    pub fn new(answer: Result<Registration, RegisterError>, truth: &Rigid, seconds: f64) -> Self {
        let poses = |found: Registration| KeptPoses {
            pose: found.target_from_source,
            branches: found
                .branches
                .iter()
                .map(|b| KeptBranch { name: b.kind.to_string(), pose: b.target_from_source })
                .collect(),
            iterations: found.iterations,
            converged: found.converged,
            skeletons: found
                .skeletons
                .and_then(|s| SkeletonAgreement::new(&s.source.points, &s.target.points, truth).ok())
                .map(|a| [a.chamfer, a.chamfer_sum, a.spread].map(Exact)),
            certainty: found.certainty.map(|c| (Exact(c.probability), c.abstain)),
        };
        Self { seconds: Exact(seconds), answer: answer.map(poses).map_err(|e| e.to_string()) }
    }
}

impl KeptPoses {
    /// How well the skeletons agree; `None` from methods without skeletons.
    pub fn agreement(&self) -> Option<SkeletonAgreement> {
        self.skeletons.map(|[chamfer, chamfer_sum, spread]| SkeletonAgreement {
            chamfer: chamfer.0,
            chamfer_sum: chamfer_sum.0,
            spread: spread.0,
        })
    }

    /// How sure the method is; `None` from methods that do not say.
    pub fn certainty(&self) -> Option<Certainty> {
        self.certainty.map(|(probability, abstain)| Certainty { probability: probability.0, abstain })
    }
}

/// A number that is written as text, in the fewest digits that give it back bit for bit; NaN and
/// infinity included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Exact(pub f64);

impl Serialize for Exact {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{:e}", self.0))
    }
}

impl<'de> Deserialize<'de> for Exact {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map(Self).map_err(D::Error::custom)
    }
}

/// A pose as 12 numbers, the rotation column by column, then the translation.
mod pose {
    use super::*;

    pub fn serialize<S: Serializer>(pose: &Rigid, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(pose.rotation.iter().chain(&pose.translation).map(|v| Exact(*v)))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Rigid, D::Error> {
        let numbers: Vec<Exact> = Vec::deserialize(deserializer)?;
        let numbers: Vec<f64> = numbers.iter().map(|n| n.0).collect();
        if numbers.len() != 12 {
            return Err(D::Error::custom("a pose has 12 numbers"));
        }
        Ok(Rigid {
            rotation: nalgebra::Matrix3::from_column_slice(&numbers[..9]),
            translation: nalgebra::Vector3::from_column_slice(&numbers[9..]),
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use srrf_cloud::{Branch, BranchKind, EulerXyz, Skeleton, Skeletons};

    use super::*;

    #[test]
    fn every_bit_comes_back() {
        let pose = Rigid {
            rotation: EulerXyz::from_deg([10.1, 20.2, 1.0 / 3.0]).to_matrix(),
            translation: Vector3::new(1e-310, -0.1 - 0.2, 12_345.678_9),
        };
        let mut broken = pose;
        broken.translation.y = f64::NEG_INFINITY;
        let found = Registration {
            branches: vec![Branch { kind: BranchKind::Dense, target_from_source: broken, inlier_ratio: 0.5 }],
            skeletons: Some(Skeletons {
                source: Skeleton { points: vec![[0.1, 0.2, 0.3]], radii: Vec::new() },
                target: Skeleton { points: vec![[1.0; 3], [2.0; 3]], radii: Vec::new() },
            }),
            iterations: 7,
            converged: false,
            certainty: Some(Certainty { probability: 1.0 / 3.0, abstain: true }),
            ..Registration::from_pose(pose)
        };
        let answers = [Ok(found), Err(RegisterError::NoPose("a \"reason\"\nof two lines".into()))];
        for answer in answers {
            let kept = KeptAnswer::new(answer, &pose, 0.1 + 0.7);
            let text = serde_json::to_string(&kept).unwrap();
            assert!(!text.contains('\n'));
            assert_eq!(serde_json::from_str::<KeptAnswer>(&text).unwrap(), kept);
            assert!(kept.answer.is_err() || kept.answer.as_ref().unwrap().agreement().unwrap().spread > 0.0);
        }
    }

    #[test]
    fn answers_that_were_kept_before_methods_were_sure_can_be_read() {
        let one = r#""1e0","0e0","0e0","0e0","1e0","0e0","0e0","0e0","1e0","0e0","0e0","0e0""#;
        let line = format!(r#"{{"s":"5e-1","Ok":{{"p":[{one}],"i":3,"c":true}}}}"#);
        let kept: KeptAnswer = serde_json::from_str(&line).unwrap();
        let poses = kept.answer.unwrap();
        assert_eq!((poses.pose, poses.iterations, poses.certainty()), (Rigid::identity(), 3, None));
    }
}
