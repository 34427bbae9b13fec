//! The modified Chamfer distance of RPMNet.

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
}
