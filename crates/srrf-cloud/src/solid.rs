//! [`Solid`]: a cloud that determines a rotation.

use std::ops::Deref;

use nalgebra::{Matrix3, Vector3};

use crate::{CloudError, PointCloud, extent};

/// A cloud that was found to determine a rotation: three points or more, not all on one line.
///
/// Whoever takes one need not check again. It is a borrow, copied freely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid<'a>(&'a PointCloud);

impl<'a> Solid<'a> {
    /// Checks `cloud`. It counts as a line when the second singular value of its centred points is under `1e-6` of
    /// the first.
    ///
    /// # Errors
    /// [`CloudError::TooFew`] or [`CloudError::Collinear`]; [`CloudError::OutOfRange`] and [`CloudError::Stray`] for coordinates that
    /// cannot be computed with.
    pub fn new(cloud: &'a PointCloud) -> Result<Self, CloudError> {
        if cloud.len() < 3 {
            return Err(CloudError::TooFew { have: cloud.len(), need: 3 });
        }
        extent::check(cloud)?;
        let mean = cloud.centroid();
        let scatter = cloud.points().iter().fold(Matrix3::zeros(), |sum, p| {
            let d = Vector3::from(*p) - mean;
            sum + d * d.transpose()
        });
        let mut eigen: Vec<f64> = scatter.symmetric_eigenvalues().iter().copied().collect();
        eigen.sort_by(f64::total_cmp);
        // Eigenvalues are squared singular values.
        let line = eigen[1] <= 1e-12 * eigen[2] || eigen[2] == 0.0;
        if line { Err(CloudError::Collinear) } else { Ok(Self(cloud)) }
    }

    /// A cloud of which the caller knows that it was checked.
    pub(crate) fn promised(cloud: &'a PointCloud) -> Self {
        Self(cloud)
    }

    /// The cloud, for as long as it was borrowed.
    pub fn cloud(self) -> &'a PointCloud {
        self.0
    }
}

impl Deref for Solid<'_> {
    type Target = PointCloud;

    fn deref(&self) -> &PointCloud {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(points: Vec<[f64; 3]>) -> Result<usize, CloudError> {
        Solid::new(&PointCloud::new(points).unwrap()).map(|solid| solid.len())
    }

    #[test]
    fn refuses_lines_and_coinciding_points() {
        assert_eq!(checked(vec![[0.0; 3], [1.0, 0.0, 0.0]]), Err(CloudError::TooFew { have: 2, need: 3 }));
        let line = (0..7).map(|i| [1e6 + i as f64, 2.0 * i as f64, -i as f64]).collect();
        assert_eq!(checked(line), Err(CloudError::Collinear));
        assert_eq!(checked(vec![[2.0; 3]; 5]), Err(CloudError::Collinear));
    }

    #[test]
    fn takes_a_triangle_wherever_it_lies() {
        assert_eq!(checked(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), Ok(3));
        let far = [5e5, 4e6, 300.0];
        let triangle = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1e-3, 0.0]];
        assert_eq!(checked(triangle.map(|p| std::array::from_fn(|c| p[c] + far[c])).to_vec()), Ok(3));
    }
}
