use nalgebra::Vector3;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use super::{FAMILIES, ProceduralShapes};
use crate::datasets::{ShapeSource, SourceError};
use srrf_cloud::{EulerXyz, KnnIndex, PointCloud, Rigid};

fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// Mean distance of the points of `a` to their nearest in `b`.
fn distance(a: &PointCloud, b: &PointCloud) -> f64 {
    let index = KnnIndex::new(b.points()).unwrap();
    a.points().iter().map(|p| index.nearest(p).1.sqrt()).sum::<f64>() / a.len() as f64
}

#[test]
fn names_are_unique_and_most_families_have_no_symmetry() {
    let mut names: Vec<&str> = FAMILIES.iter().map(|f| f.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), FAMILIES.len());
    assert!(names.len() >= 20);
    assert!(FAMILIES.iter().filter(|f| f.symmetric).count() * 5 < names.len());
}

#[test]
fn every_family_is_centred_scaled_and_solid() {
    let shapes = ProceduralShapes::new(11, 4 * FAMILIES.len(), None).unwrap();
    for i in 0..shapes.len() {
        let cloud = shapes.sample(i, 1500, &mut rng(i as u64)).unwrap();
        assert_eq!(cloud.len(), 1500);
        let id = shapes.id(i);
        let radius = cloud.points().iter().map(|p| Vector3::from(*p).norm()).fold(0.0, f64::max);
        assert!((0.85..1.1).contains(&radius), "{id}: radius {radius}");
        assert!(cloud.centroid().norm() < 0.06, "{id}: centre {}", cloud.centroid());
        let scatter = cloud.points().iter().fold(nalgebra::Matrix3::zeros(), |sum, p| {
            sum + Vector3::from(*p) * Vector3::from(*p).transpose()
        });
        let spread = (scatter.symmetric_eigenvalues().min() / 1500.0).sqrt();
        assert!(spread > 0.004, "{id}: flat or thin, {spread}");
    }
}

#[test]
fn the_same_numbers_give_the_same_cloud() {
    let (a, b) = (ProceduralShapes::new(3, 9, None).unwrap(), ProceduralShapes::new(3, 500, None).unwrap());
    // The order of asking, and the size of the set, change nothing.
    let late = a.sample(8, 300, &mut rng(1)).unwrap();
    for i in 0..9 {
        assert_eq!(a.sample(i, 300, &mut rng(1)).unwrap(), b.sample(i, 300, &mut rng(1)).unwrap());
    }
    assert_eq!(a.sample(8, 300, &mut rng(1)).unwrap(), late);
    let other = ProceduralShapes::new(4, 9, None).unwrap();
    assert_ne!(a.sample(2, 300, &mut rng(1)).unwrap(), other.sample(2, 300, &mut rng(1)).unwrap());
}

/// Two samplings share no point, and lie in one frame: a small shift of one shows.
#[test]
fn two_samplings_show_one_surface() {
    let shapes = ProceduralShapes::new(5, FAMILIES.len(), None).unwrap();
    let shift = Rigid { translation: Vector3::new(0.1, -0.1, 0.1), ..Rigid::identity() };
    for i in 0..shapes.len() {
        let (a, b) = shapes.sample_two(i, 1000, &mut rng(9)).unwrap();
        assert!(a.points().iter().all(|p| !b.points().contains(p)));
        let (near, shifted) = (distance(&a, &b), distance(&a, &b.transformed(&shift)));
        assert!(near < 0.06 && 1.15 * near < shifted, "{}: {near} {shifted}", shapes.id(i));
    }
}

/// Turning a shape about its upright axis shows whether it is symmetric as its family says.
#[test]
fn symmetry_is_as_stated() {
    let shapes = ProceduralShapes::new(6, 2 * FAMILIES.len(), None).unwrap();
    for i in 0..shapes.len() {
        let (a, b) = shapes.sample_two(i, 1500, &mut rng(2)).unwrap();
        let turned = |angle: f64| {
            let rotation = EulerXyz::from_deg([0.0, 0.0, angle]).to_matrix();
            b.transformed(&Rigid { rotation, translation: Vector3::zeros() })
        };
        let ratio = |angle: f64| distance(&a, &turned(angle)) / distance(&a, &b);
        if shapes.is_symmetric(i) {
            assert!(ratio(77.0) < 1.25, "{} {}", shapes.id(i), ratio(77.0));
        } else {
            assert!(ratio(77.0) > 1.15, "{} {}", shapes.id(i), ratio(77.0));
        }
    }
}

#[test]
fn families_can_be_chosen() {
    let shapes = ProceduralShapes::new(1, 5, Some(&["mug", "chair"])).unwrap();
    let ids: Vec<String> = (0..5).map(|i| shapes.id(i)).collect();
    assert_eq!(ids, ["mug_0000", "chair_0000", "mug_0001", "chair_0001", "mug_0002"]);
    assert_eq!((shapes.class(3), shapes.is_symmetric(3)), ("chair", false));
    assert!(shapes.description().contains("5 shapes of 2 families"), "{}", shapes.description());

    let error = ProceduralShapes::new(1, 5, Some(&["unicorn"])).unwrap_err().to_string();
    assert!(error.contains("unicorn") && error.contains("airplane"), "{error}");
    assert!(ProceduralShapes::new(1, 5, Some(&[])).is_err());
    assert!(matches!(ProceduralShapes::new(1, 0, None), Err(SourceError::NoShapes)));
    assert!(matches!(shapes.sample(5, 9, &mut rng(0)), Err(SourceError::NoSuchShape { index: 5, len: 5 })));
    assert!(shapes.sample(0, 0, &mut rng(0)).is_err());
}
