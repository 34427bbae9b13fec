//! Surface normals by principal component analysis of neighbourhoods.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::{CloudError, KnnIndex};

/// Clouds up to this size are done on the caller's thread.
const SEQUENTIAL: usize = 4096;

/// Eigenvalues closer than this, for a matrix whose largest entry is 1, are told apart by an iteration.
const LEAST_GAP: f64 = 1e-5;
/// Rows of `A - least I` whose longest cross product is shorter than this are too: a root is right to about 1e-8 only, and
/// its error is divided by that length.
const LEAST_ACROSS: f64 = 1e-2;

/// A unit normal for each of `points` (shape `[n, 3]` in and out): the direction in which its `k`
/// nearest points, itself among them, vary least.
///
/// A neighbourhood has no inside, so the sign is a convention: normals point away from the mean of
/// the cloud. Rotating the cloud rotates the normals. Where the neighbours lie on one line the
/// normal is one of the directions across it. `k` is raised to 3 and lowered to `n`.
///
/// Source: Hoppe et al., "Surface reconstruction from unorganized points", 1992, section 3.1.
///
/// # Errors
/// [`CloudError::TooFew`] under 3 points, [`CloudError::NotFinite`] at the first NaN or infinity.
pub fn estimate_normals(points: &[[f64; 3]], k: usize) -> Result<Vec<[f64; 3]>, CloudError> {
    if points.len() < 3 {
        return Err(CloudError::TooFew { have: points.len(), need: 3 });
    }
    let index = KnnIndex::new(points)?;
    let mean = mean_of(points.iter());
    let normal = |point: &[f64; 3]| -> [f64; 3] {
        let neighbours = index.k_nearest(point, k.max(3));
        let normal = least_direction(neighbours.iter().map(|&(i, _)| &points[i]));
        let outward = normal.dot(&(Vector3::from(*point) - mean)) >= 0.0;
        (if outward { normal } else { -normal }).into()
    };
    // Small clouds come by the thousand, and waking threads for each costs more than it gives.
    Ok(if points.len() <= SEQUENTIAL {
        points.iter().map(normal).collect()
    } else {
        points.par_iter().map(normal).collect()
    })
}

fn mean_of<'a>(points: impl ExactSizeIterator<Item = &'a [f64; 3]>) -> Vector3<f64> {
    let count = points.len() as f64;
    points.map(|p| Vector3::from(*p)).sum::<Vector3<f64>>() / count
}

/// The direction in which these points vary least, a unit vector whose sign says nothing.
pub fn least_direction<'a>(points: impl ExactSizeIterator<Item = &'a [f64; 3]> + Clone) -> Vector3<f64> {
    let mean = mean_of(points.clone());
    let scatter = points.fold(Matrix3::zeros(), |sum, p| {
        let d = Vector3::from(*p) - mean;
        sum + d * d.transpose()
    });
    closed_form(&scatter).unwrap_or_else(|| {
        let eigen = scatter.symmetric_eigen();
        eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned()
    })
}

/// The eigenvector of the smallest eigenvalue of a symmetric matrix, by the roots of its characteristic polynomial (Smith 1961), in
/// a tenth of the time of an iteration; `None` where two eigenvalues are too close for it.
fn closed_form(matrix: &Matrix3<f64>) -> Option<Vector3<f64>> {
    let size = matrix.amax();
    if !size.is_finite() || size <= 0.0 {
        return None;
    }
    let m = matrix / size;
    let third = m.trace() / 3.0;
    let apart = m - Matrix3::identity() * third;
    let spread = (apart.norm_squared() / 6.0).sqrt();
    if spread < LEAST_GAP {
        return None;
    }
    let cosine = ((apart / spread).determinant() / 2.0).clamp(-1.0, 1.0);
    // Of the three angles, the one past 120 degrees has the smallest cosine.
    let least = third + 2.0 * spread * (cosine.acos() / 3.0 + std::f64::consts::TAU / 3.0).cos();
    let rest = m - Matrix3::identity() * least;
    // The rows span the plane across the eigenvector.
    let rows = [0, 1, 2].map(|i| rest.row(i).transpose());
    let crosses = [rows[0].cross(&rows[1]), rows[1].cross(&rows[2]), rows[2].cross(&rows[0])];
    let longest = crosses.into_iter().max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))?;
    longest.try_normalize(LEAST_ACROSS)
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::EulerXyz;

    fn sphere() -> Vec<[f64; 3]> {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        (0..901)
            .map(|_| {
                let p = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0f64));
                p.normalize().into()
            })
            .collect()
    }

    #[test]
    fn normals_of_a_sphere_point_outwards() {
        let points = sphere();
        for (normal, point) in estimate_normals(&points, 15).unwrap().iter().zip(&points) {
            let cosine = Vector3::from(*normal).dot(&Vector3::from(*point));
            assert!(cosine > 0.97, "{cosine}");
        }
    }

    #[test]
    fn normals_turn_with_the_cloud() {
        let points: Vec<[f64; 3]> = sphere().iter().map(|p| [p[0], 0.5 * p[1], 2.0 * p[2]]).collect();
        let rotation = EulerXyz::from_deg([20.0, -50.0, 110.0]).to_matrix();
        let turn = |p: &[f64; 3]| -> [f64; 3] { (rotation * Vector3::from(*p)).into() };
        let turned: Vec<_> = points.iter().map(turn).collect();
        let (before, after) =
            (estimate_normals(&points, 12).unwrap(), estimate_normals(&turned, 12).unwrap());
        for (b, a) in before.iter().zip(&after) {
            assert!(Vector3::from(turn(b)).dot(&Vector3::from(*a)) > 1.0 - 1e-6);
        }
    }

    #[test]
    fn the_closed_form_is_the_least_direction() {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        for scale in [1e-9, 1.0, 1e7] {
            for thin in [0.0, 1e-3, 0.3] {
                let rotation = EulerXyz::from_deg([20.0, rng.random_range(-90.0..90.0), 110.0]).to_matrix();
                let diagonal = Matrix3::from_diagonal(&Vector3::new(1.0, thin, 0.6));
                let matrix = rotation * diagonal * rotation.transpose() * scale;
                let found = closed_form(&matrix).unwrap();
                assert!(found.dot(&rotation.column(1)).abs() > 1.0 - 1e-12, "{scale} {thin}");
            }
        }
        let line = Matrix3::from_diagonal(&Vector3::new(1.0, 0.0, 0.0));
        for unclear in [line, Matrix3::zeros(), Matrix3::identity(), line * f64::NAN] {
            assert_eq!(closed_form(&unclear), None);
        }
    }

    #[test]
    fn degenerate_clouds() {
        assert_eq!(estimate_normals(&[[0.0; 3]; 2], 5), Err(CloudError::TooFew { have: 2, need: 3 }));
        let line: Vec<[f64; 3]> = (0..20).map(|i| [0.0, i as f64, 0.0]).collect();
        for normal in estimate_normals(&line, 0).unwrap() {
            let n = Vector3::from(normal);
            assert!((n.norm() - 1.0).abs() < 1e-9 && n.y.abs() < 1e-9);
        }
        assert!(estimate_normals(&[[1.0; 3]; 50], 9).unwrap().iter().flatten().all(|c| c.is_finite()));
    }
}
