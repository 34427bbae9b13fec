//! [`skeleton`]: the spheres along the middle of a shape that the network's first stage sees.

use srrf_cloud::{CloudError, PointCloud, Solid};
use srrf_model::PairBatch;
use srrf_model::ops::{even_subsample, to_host};

use crate::frame::Centred;
use crate::network::{open, thinned};
use crate::registrar::Error;

/// Points of a cloud that the network looks at: as many as it was trained with.
const POINTS: usize = 1024;

/// Spheres along the middle of a shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    /// Centres in the coordinates of the cloud, shape `[s, 3]` (Eq. 5).
    pub points: Vec<[f64; 3]>,
    /// Radii in the unit of the cloud, shape `[s]` (Eq. 6).
    pub radii: Vec<f64>,
    /// Name of the weights.
    pub weights: String,
}

/// The skeleton of a cloud. `weights` is a file or the name of a model in the program (`None`: the
/// default), `device` where the network runs (`flex`).
///
/// # Errors
/// [`Error::Setup`] for unknown weights or devices, [`Error::Source`] for a cloud of fewer than three
/// points or on one line, [`Error::NoPose`] where the network's answer is not finite.
pub fn skeleton(cloud: &PointCloud, weights: Option<&str>, device: &str) -> Result<Skeleton, Error> {
    let cloud = Solid::new(cloud).map_err(Error::Source)?;
    let loaded = open(weights, device).map_err(Error::Setup)?;
    let device = srrf_model::device(device).map_err(|e| Error::Setup(e.to_string()))?;
    let centred = Centred::new(&cloud).map_err(Error::Source)?;
    let seen = subsample(&thinned(&centred.cloud)).map_err(Error::Source)?;
    let not_finite = || Error::NoPose("the skeleton is not finite; are the coordinates extreme?".into());
    let batch = PairBatch::new(&[(&seen, &seen)], &device).ok_or_else(not_finite)?;
    let found = loaded.model.sem.forward(batch.source.clone())?;
    let (centres, radii) = (to_host::<f64, 3>(&found.points)?, to_host::<f64, 2>(&found.radii)?);
    let frame = &batch.frames[0];
    // The frame's scale: what a unit of the network is in the cloud.
    let scale = frame.undo_source(&[1.0, 0.0, 0.0])[0] - frame.undo_source(&[0.0; 3])[0];
    let points: Vec<[f64; 3]> = centres
        .chunks_exact(3)
        .map(|p| {
            let local = frame.undo_source(&[p[0], p[1], p[2]]);
            std::array::from_fn(|c| local[c] + centred.centre[c])
        })
        .collect();
    let radii: Vec<f64> = radii.iter().map(|r| r * scale).collect();
    let finite = points.iter().flatten().chain(&radii).all(|v| v.is_finite());
    if !finite || points.is_empty() || points.len() != radii.len() {
        return Err(not_finite());
    }
    Ok(Skeleton { points, radii, weights: loaded.name })
}

/// [`POINTS`] points of the cloud, evenly along a space-filling curve.
fn subsample(cloud: &PointCloud) -> Result<PointCloud, CloudError> {
    if cloud.len() <= POINTS {
        return Ok(cloud.clone());
    }
    let (unit, _) = cloud.to_unit_sphere();
    let unit: Vec<[f32; 3]> = unit.points().iter().map(|p| p.map(|v| v as f32)).collect();
    let chosen = even_subsample(&unit, POINTS, 0.5);
    PointCloud::new(chosen.into_iter().map(|i| cloud.points()[i as usize]).collect())
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
        let near = skeleton(&cloud, None, "flex").unwrap();
        assert_eq!((near.points.len(), near.radii.len(), near.weights.as_str()), (256, 256, "srrf"));
        assert!(near.points.iter().all(|p| Vector3::from(*p).norm() < 1.1));
        assert!(near.radii.iter().all(|r| (0.0..1.0).contains(r)));

        let away = Rigid { translation: Vector3::new(5e5, 4e6, 300.0), ..Rigid::identity() };
        let far = skeleton(&cloud.transformed(&away), None, "flex").unwrap();
        for (p, q) in near.points.iter().zip(&far.points) {
            assert!((Vector3::from(away.apply(p)) - Vector3::from(*q)).norm() < 1e-3);
        }
        assert!(skeleton(&cloud, None, "abacus").unwrap_err().to_string().contains("abacus"));
    }
}
