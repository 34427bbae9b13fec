//! [`skeleton`]: the spheres along the middle of a shape that the network's first stage sees.

use srrf_cloud::{CentredCloud, PointCloud, Skeleton};
use srrf_model::ops::to_host;
use srrf_model::{PairBatch, subsample};

use crate::error::Error;
use crate::network::{open, thinned};

/// Points of a cloud that the network looks at: as many as it was trained with.
const POINTS: usize = 1024;

/// The skeleton of a cloud (Eq. 5 and 6), and what found it.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundSkeleton {
    /// Spheres along the middle of the shape.
    pub skeleton: Skeleton,
    /// Name of the weights.
    pub weights: String,
}

/// The skeleton of a cloud. `weights` is a file or the name of a model in the program (`None`: the
/// default), `device` where the network runs (`flex`).
///
/// # Errors
/// [`Error::Weights`] and [`Error::Device`] for those that cannot be used, [`Error::Source`] for a cloud of fewer than three
/// points or on one line, [`Error::NoSkeleton`] where the network's answer is not finite.
pub fn skeleton(cloud: &PointCloud, weights: Option<&str>, device: &str) -> Result<FoundSkeleton, Error> {
    let centred = CentredCloud::new(cloud).map_err(Error::Source)?;
    let loaded = open(weights, device)?;
    let device = srrf_model::device(device).map_err(Error::Device)?;
    let seen = subsample(&thinned(&centred.cloud()), POINTS).map_err(|_| Error::NoSkeleton)?;
    let batch = PairBatch::new(&[(&seen, &seen)], &device).ok_or(Error::NoSkeleton)?;
    let found = loaded.model.sem.forward(batch.source.clone())?;
    let (centres, radii) = (to_host::<f64, 3>(&found.points)?, to_host::<f64, 2>(&found.radii)?);
    let frame = &batch.frames[0];
    // The frame's scale: what a unit of the network is in the cloud.
    let scale = frame.undo_source(&[1.0, 0.0, 0.0])[0] - frame.undo_source(&[0.0; 3])[0];
    let input = centred.frame_to(&centred);
    let points: Vec<[f64; 3]> =
        centres.chunks_exact(3).map(|p| input.undo_source(&frame.undo_source(&[p[0], p[1], p[2]]))).collect();
    let radii: Vec<f64> = radii.iter().map(|r| r * scale).collect();
    let finite = points.iter().flatten().chain(&radii).all(|v| v.is_finite());
    if !finite || points.is_empty() || points.len() != radii.len() {
        return Err(Error::NoSkeleton);
    }
    Ok(FoundSkeleton { skeleton: Skeleton { points, radii }, weights: loaded.name })
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use rand::{SeedableRng, rngs::ChaCha8Rng};
    use srrf_cloud::Rigid;
    use srrf_corrupt::{datasets::ShapeSource, shapes::ProceduralShapes};

    use super::*;

    #[test]
    fn lies_in_the_shape_wherever_it_is() {
        let shapes = ProceduralShapes::new(7, 3, None).unwrap();
        let cloud = shapes.sample(1, 3001, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        let FoundSkeleton { skeleton: near, weights } = skeleton(&cloud, None, "flex").unwrap();
        assert_eq!((near.points.len(), near.radii.len(), weights.as_str()), (256, 256, "srrf"));
        assert!(near.points.iter().all(|p| Vector3::from(*p).norm() < 1.1));
        assert!(near.radii.iter().all(|r| (0.0..1.0).contains(r)));

        let away = Rigid { translation: Vector3::new(5e5, 4e6, 300.0), ..Rigid::identity() };
        let far = skeleton(&cloud.transformed(&away), None, "flex").unwrap().skeleton;
        for (p, q) in near.points.iter().zip(&far.points) {
            assert!((Vector3::from(away.apply(p)) - Vector3::from(*q)).norm() < 1e-3);
        }
        assert!(skeleton(&cloud, None, "abacus").unwrap_err().to_string().contains("abacus"));
    }
}
