//! Iterative closest point (Besl and McKay 1992), point to point.

use serde::{Deserialize, Serialize};
use srrf_cloud::{KnnIndex, PointCloud, Register, RegisterError, Registration, Rigid, Solid};

/// Settings of [`Icp`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IcpConfig {
    /// Largest number of iterations. Default 50, the setting of CFNet's ICP; Open3D's default, used
    /// by RPMNet, is 30.
    pub max_iterations: usize,
    /// Matches farther apart than this are left out, unit of the clouds. Default `None`: every
    /// source point keeps its nearest neighbour (as PointNetLK's ICP does). RPMNet's setting is 0.5,
    /// CFNet's 0.1 with `centred`; both score worse on clean ModelNet40 pairs in the DCP range.
    pub max_distance: Option<f64>,
    /// Whether to start with the centroids aligned instead of at the identity. Default `false`.
    pub centred: bool,
    /// Stops when one iteration moves the source by less than this, as root mean square over its
    /// points, divided by the root mean square radius of the target. Default 1e-7 (the threshold
    /// of PointNetLK on its motion parameters).
    pub tolerance: f64,
}

impl Default for IcpConfig {
    fn default() -> Self {
        Self { max_iterations: 50, max_distance: None, centred: false, tolerance: 1e-7 }
    }
}

/// Iterative closest point, point to point, in `f64`: match each moved source point with its
/// nearest target point, fit the pose to the matches, repeat.
///
/// It starts at the identity, and so finds only motions that are small against the shape.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Icp {
    /// The settings.
    pub config: IcpConfig,
}

impl Icp {
    /// The method with these settings.
    pub fn new(config: IcpConfig) -> Self {
        Self { config }
    }
}

impl Register for Icp {
    fn name(&self) -> &str {
        if self.config.centred { "icp-centred" } else { "icp" }
    }

    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError> {
        let neighbours = KnnIndex::new(target.points()).map_err(RegisterError::Target)?;
        let limit = self.config.max_distance.map_or(f64::INFINITY, |d| d * d);
        let step_limit = self.config.tolerance * rms_radius(&target);

        let mut pose = Rigid::identity();
        if self.config.centred {
            pose.translation = target.centroid() - source.centroid();
        }
        let mut matched_source = Vec::with_capacity(source.len());
        let mut matched_target = Vec::with_capacity(source.len());
        for iteration in 1..=self.config.max_iterations {
            matched_source.clear();
            matched_target.clear();
            for point in source.points() {
                let (nearest, squared_distance) = neighbours.nearest(&pose.apply(point));
                if squared_distance <= limit {
                    matched_source.push(*point);
                    matched_target.push(target.points()[nearest]);
                }
            }
            let next = Rigid::fit(&matched_source, &matched_target, None).ok_or_else(|| {
                RegisterError::NoPose(format!(
                    "iteration {iteration}: {} of {} source points have a match within {}, at least 3 are \
                     needed; raise `max_distance`",
                    matched_source.len(),
                    source.len(),
                    limit.sqrt()
                ).into())
            })?;
            let step = rms_between(&source, &pose, &next);
            pose = next;
            if step <= step_limit {
                return Ok(answer(pose, true, iteration));
            }
        }
        Ok(answer(pose, false, self.config.max_iterations))
    }
}

fn answer(target_from_source: Rigid, converged: bool, iterations: usize) -> Registration {
    Registration { converged, iterations, ..Registration::from_pose(target_from_source) }
}

/// Root mean square distance of the points from their centroid.
fn rms_radius(cloud: &PointCloud) -> f64 {
    let centre = cloud.centroid();
    let sum: f64 = cloud.points().iter().map(|p| (nalgebra::Vector3::from(*p) - centre).norm_squared()).sum();
    (sum / cloud.len() as f64).sqrt()
}

/// Root mean square distance between the cloud moved by `a` and moved by `b`.
fn rms_between(cloud: &PointCloud, a: &Rigid, b: &Rigid) -> f64 {
    let (rotation, translation) = (a.rotation - b.rotation, a.translation - b.translation);
    let sum: f64 = cloud
        .points()
        .iter()
        .map(|p| (rotation * nalgebra::Vector3::from(*p) + translation).norm_squared())
        .sum();
    (sum / cloud.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use srrf_cloud::{CloudError, EulerXyz};

    use super::*;

    /// A bent sheet: no symmetry, every point different.
    fn sheet() -> PointCloud {
        let points = (0..23).flat_map(|i| {
            (0..17).map(move |j| {
                let (u, v) = (i as f64 / 22.0, j as f64 / 16.0);
                [1.3 * u - 0.5, 0.8 * v * (1.0 + 0.3 * u), 0.4 * (3.0 * u).sin() + 0.3 * v * v]
            })
        });
        PointCloud::new(points.collect()).unwrap()
    }

    fn motion(angles_deg: [f64; 3], translation: [f64; 3]) -> Rigid {
        Rigid { rotation: EulerXyz::from_deg(angles_deg).to_matrix(), translation: translation.into() }
    }

    fn distance(a: &Rigid, b: &Rigid) -> f64 {
        (a.to_matrix4() - b.to_matrix4()).norm()
    }

    fn shuffled(cloud: &PointCloud) -> PointCloud {
        let n = cloud.len(); // 391 = 17 * 23, coprime with 150
        PointCloud::new((0..n).map(|i| cloud.points()[(i * 150 + 7) % n]).collect()).unwrap()
    }

    #[test]
    fn finds_a_small_motion_exactly() {
        let truth = motion([4.0, -3.0, 5.0], [0.02, -0.03, 0.01]);
        let target = shuffled(&sheet().transformed(&truth));
        let found = Icp::default().register(&sheet(), &target).unwrap();
        assert!(found.converged && found.iterations > 1 && found.iterations <= 50);
        assert!(distance(&found.target_from_source, &truth) < 1e-9);
    }

    #[test]
    fn centroids_bridge_a_far_translation() {
        let truth = motion([3.0, 2.0, -4.0], [40.0, -7.0, 12.0]);
        let target = sheet().transformed(&truth);
        let centred = Icp::new(IcpConfig { centred: true, ..IcpConfig::default() });
        let found = centred.register(&sheet(), &target).unwrap();
        assert!(distance(&found.target_from_source, &truth) < 1e-9);
        let plain = Icp::default().register(&sheet(), &target).unwrap();
        assert!(distance(&plain.target_from_source, &truth) > 0.1);
    }

    #[test]
    fn order_of_the_points_does_not_matter() {
        let target = sheet().transformed(&motion([9.0, 14.0, -11.0], [0.1, 0.2, -0.1]));
        let a = Icp::default().register(&sheet(), &target).unwrap();
        let b = Icp::default().register(&shuffled(&sheet()), &shuffled(&target)).unwrap();
        assert!(distance(&a.target_from_source, &b.target_from_source) < 1e-9);
    }

    #[test]
    fn the_answer_follows_when_both_clouds_move() {
        let target = sheet().transformed(&motion([9.0, 14.0, -11.0], [0.1, 0.2, -0.1]));
        let frame = motion([130.0, 40.0, -75.0], [3.0, 5.0, -2.0]);
        let a = Icp::default().register(&sheet(), &target).unwrap();
        let b = Icp::default().register(&sheet().transformed(&frame), &target.transformed(&frame)).unwrap();
        let expected = frame.compose(&a.target_from_source).compose(&frame.inverse());
        assert!(distance(&b.target_from_source, &expected) < 1e-8);
    }

    #[test]
    fn says_when_it_did_not_converge() {
        let target = sheet().transformed(&motion([30.0, 20.0, 10.0], [0.3, 0.2, -0.1]));
        let icp = Icp::new(IcpConfig { max_iterations: 2, ..IcpConfig::default() });
        let found = icp.register(&sheet(), &target).unwrap();
        assert!(!found.converged);
        assert_eq!(found.iterations, 2);
    }

    #[test]
    fn refuses_what_it_cannot_register() {
        let line = PointCloud::new((0..5).map(|i| [i as f64, 0.0, 0.0]).collect()).unwrap();
        let icp = Icp::default();
        assert!(matches!(icp.register(&line, &sheet()), Err(RegisterError::Source(CloudError::Collinear))));
        assert!(matches!(icp.register(&sheet(), &line), Err(RegisterError::Target(CloudError::Collinear))));
        assert_eq!(PointCloud::new(vec![]), Err(CloudError::Empty));
        assert!(PointCloud::new(vec![[f64::NAN; 3]; 9]).is_err());

        let far = sheet().transformed(&motion([0.0; 3], [100.0, 0.0, 0.0]));
        let near = Icp::new(IcpConfig { max_distance: Some(0.5), ..IcpConfig::default() });
        let message = near.register(&sheet(), &far).unwrap_err().to_string();
        assert!(message.contains("0 of 391") && message.contains("max_distance"), "{message}");
    }
}
