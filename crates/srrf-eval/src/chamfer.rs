//! Chamfer distances: of registered clouds to their clean shape, and between skeletons.

use serde::Serialize;
use srrf_cloud::{CloudError, KnnIndex, PointCloud, Rigid};

/// Compares a registered pair with the clean shape that both clouds were made from (RPMNet, its
/// `compute_metrics`):
///
/// `mean over x in X of min |T x - T_gt c|^2  +  mean over y in Y of min |y - T c|^2`,
///
/// where `c` runs over the clean shape in the source frame, `T` is the predicted pose and `T_gt` the
/// true one. It is low for any pose that lays a symmetric shape onto itself.
#[derive(Debug)]
pub struct CleanShape {
    index: KnnIndex,
}

impl CleanShape {
    /// Indexes the clean shape, given in the source frame, shape `[k, 3]`.
    ///
    /// # Errors
    /// [`CloudError`] if it is empty or not finite.
    pub fn new(points: &[[f64; 3]]) -> Result<Self, CloudError> {
        Ok(Self { index: KnnIndex::new(points)? })
    }

    /// The distance for one prediction, in the squared unit of the clouds.
    pub fn modified_chamfer(
        &self,
        source: &PointCloud,
        target: &PointCloud,
        predicted: &Rigid,
        truth: &Rigid,
    ) -> f64 {
        // Both searches run in the source frame, where the clean shape stays put: distances are
        // the same, and one index serves every method.
        let source_error = truth.inverse().compose(predicted);
        let source_from_target = predicted.inverse();
        self.mean_squared(source, &source_error) + self.mean_squared(target, &source_from_target)
    }

    fn mean_squared(&self, cloud: &PointCloud, pose: &Rigid) -> f64 {
        let sum: f64 = cloud.points().iter().map(|p| self.index.nearest(&pose.apply(p)).1).sum();
        sum / cloud.len() as f64
    }
}

/// How well the skeleton of a source, moved by the true pose, agrees with that of its target.
///
/// The paper gives one number, "d_CD", whose unit it does not say; these are the readings of it. A
/// skeleton that has collapsed to a point agrees perfectly: read `spread` too.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SkeletonAgreement {
    /// Mean squared distance to the nearest point of the other skeleton, both ways added.
    pub chamfer: f64,
    /// Sum of the distances to the nearest point, over the points of both skeletons.
    pub chamfer_sum: f64,
    /// Root mean square distance of the points of both skeletons from the mean of their own.
    pub spread: f64,
}

impl SkeletonAgreement {
    /// Compares two skeletons, shapes `[s, 3]` and `[r, 3]`.
    ///
    /// # Errors
    /// [`CloudError`] if one is empty or not finite.
    pub fn new(
        source: &[[f64; 3]],
        target: &[[f64; 3]],
        target_from_source: &Rigid,
    ) -> Result<Self, CloudError> {
        let source = PointCloud::new(source.to_vec())?.transformed(target_from_source);
        let target = PointCloud::new(target.to_vec())?;
        let squared = |from: &PointCloud, to: &PointCloud| -> Result<Vec<f64>, CloudError> {
            let index = KnnIndex::new(to.points())?;
            Ok(from.points().iter().map(|p| index.nearest(p).1).collect())
        };
        let (forth, back) = (squared(&source, &target)?, squared(&target, &source)?);
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let deviation = |cloud: &PointCloud| -> f64 {
            let centre = cloud.centroid();
            cloud.points().iter().map(|p| (nalgebra::Vector3::from(*p) - centre).norm_squared()).sum()
        };
        let count = (source.len() + target.len()) as f64;
        Ok(Self {
            chamfer: mean(&forth) + mean(&back),
            chamfer_sum: forth.iter().chain(&back).map(|d| d.sqrt()).sum(),
            spread: ((deviation(&source) + deviation(&target)) / count).sqrt(),
        })
    }

    /// The mean of each number; `None` without any.
    pub fn mean(agreements: &[Self]) -> Option<Self> {
        let count = agreements.len() as f64;
        let average = |value: fn(&Self) -> f64| agreements.iter().map(value).sum::<f64>() / count;
        (!agreements.is_empty()).then(|| Self {
            chamfer: average(|a| a.chamfer),
            chamfer_sum: average(|a| a.chamfer_sum),
            spread: average(|a| a.spread),
        })
    }
}

#[cfg(test)]
mod tests {
    use srrf_cloud::EulerXyz;

    use super::*;

    fn pose(angles_deg: [f64; 3], translation: [f64; 3]) -> Rigid {
        Rigid { rotation: EulerXyz::from_deg(angles_deg).to_matrix(), translation: translation.into() }
    }

    #[test]
    fn agrees_with_the_definition_by_brute_force() {
        let clean: Vec<[f64; 3]> =
            (0..29).map(|i| [(i as f64).sin(), (1.3 * i as f64).cos(), 0.05 * i as f64]).collect();
        let source: Vec<[f64; 3]> = clean.iter().step_by(2).map(|p| [p[0] + 0.1, p[1], p[2]]).collect();
        let (truth, predicted) =
            (pose([10.0, 20.0, 30.0], [0.1, 0.2, 0.3]), pose([14.0, 18.0, 3.0], [0.0; 3]));
        let target: Vec<[f64; 3]> = clean.iter().step_by(3).map(|p| truth.apply(p)).collect();
        let nearest = |p: &[f64; 3], others: &[[f64; 3]]| {
            others
                .iter()
                .map(|q| (0..3).map(|c| (p[c] - q[c]).powi(2)).sum::<f64>())
                .fold(f64::INFINITY, f64::min)
        };
        let clean_target: Vec<_> = clean.iter().map(|p| truth.apply(p)).collect();
        let clean_predicted: Vec<_> = clean.iter().map(|p| predicted.apply(p)).collect();
        let mut expected = 0.0;
        for p in &source {
            expected += nearest(&predicted.apply(p), &clean_target) / source.len() as f64;
        }
        for p in &target {
            expected += nearest(p, &clean_predicted) / target.len() as f64;
        }
        let (source, target) = (PointCloud::new(source).unwrap(), PointCloud::new(target).unwrap());
        let shape = CleanShape::new(&clean).unwrap();
        let found = shape.modified_chamfer(&source, &target, &predicted, &truth);
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        assert!(found > shape.modified_chamfer(&source, &target, &truth, &truth));
    }

    #[test]
    fn is_zero_on_clean_clouds_at_the_truth() {
        let clean = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]];
        let truth = pose([5.0, 6.0, 7.0], [1.0, 2.0, 3.0]);
        let source = PointCloud::new(clean.clone()).unwrap();
        let shape = CleanShape::new(&clean).unwrap();
        let zero = shape.modified_chamfer(&source, &source.transformed(&truth), &truth, &truth);
        assert!(zero < 1e-20, "{zero}");
    }

    #[test]
    fn skeletons_by_hand() {
        let truth = pose([0.0; 3], [1.0, 0.0, 0.0]);
        // Moved by 1 along x: (0, 0, 0) and (2, 0, 0), against (0, 3, 0).
        let found =
            SkeletonAgreement::new(&[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], &[[0.0, 3.0, 0.0]], &truth).unwrap();
        assert!((found.chamfer - ((9.0 + 13.0) / 2.0 + 9.0)).abs() < 1e-12);
        assert!((found.chamfer_sum - (3.0 + 13.0_f64.sqrt() + 3.0)).abs() < 1e-12);
        assert!((found.spread - (2.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(SkeletonAgreement::new(&[], &[[0.0; 3]], &truth), Err(CloudError::Empty));
        let perfect = SkeletonAgreement { chamfer: 0.0, chamfer_sum: 0.0, spread: 0.0 };
        let mean = SkeletonAgreement::mean(&[found, perfect]).unwrap();
        assert!((mean.chamfer - found.chamfer / 2.0).abs() < 1e-12);
        assert_eq!(SkeletonAgreement::mean(&[]), None);
    }
}
