//! A request: a cloud or a prepared target, with or without a first guess.
#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

mod common;

use srrf::{Error, Method, Options, Registrar, Request, Start};
use srrf_cloud::{EulerXyz, PointCloud, Rigid};

fn motion(degrees: [f64; 3]) -> Rigid {
    Rigid { rotation: EulerXyz::from_deg(degrees).to_matrix(), translation: [5e5, -2e5, 3.0].into() }
}

#[test]
fn a_prepared_target_gives_the_same_answer() {
    let registrar = Registrar::new(Options { method: Method::FpfhRansac, ..Options::default() }).unwrap();
    let (source, truth) = (common::shape(900), motion([100.0, 20.0, -70.0]));
    let cloud = source.transformed(&truth);
    let prepared = registrar.prepare(&cloud).unwrap();
    let once = registrar.register(&Request::new(&source, &cloud)).unwrap();
    assert!(once.target_from_source.angle_to_deg(&truth) < 0.1);
    assert!(matches!(once.start, Start::FpfhRansac { feature_voxels } if feature_voxels == 5.0));
    assert_eq!(once.tried.len(), once.refinement.as_ref().unwrap().starts.len());
    for _ in 0..2 {
        let again = registrar.register(&Request::new(&source, &prepared)).unwrap();
        let without_times = |found: &srrf::Outcome| {
            let mut json = serde_json::to_value(found).unwrap();
            json.as_object_mut().unwrap().remove("seconds").unwrap();
            json
        };
        assert_eq!(without_times(&again), without_times(&once));
    }
    // Features are made where they are asked for, whatever the target was prepared for.
    let icp = Registrar::new(Options { method: Method::Icp, ..Options::default() }).unwrap();
    let elsewhere = registrar.register(&Request::new(&source, &icp.prepare(&cloud).unwrap())).unwrap();
    assert_eq!(elsewhere.target_from_source, once.target_from_source);
}

#[test]
fn a_first_guess_is_where_the_search_starts() {
    let given = Options { method: Method::Given, refine: None, ..Options::default() };
    let registrar = Registrar::new(given).unwrap();
    let (source, truth) = (common::shape(500), motion([10.0, 20.0, 160.0]));
    let target = source.transformed(&truth);
    let found = registrar.register(&Request::new(&source, &target).with_initial(truth)).unwrap();
    assert!(found.target_from_source.angle_to_deg(&truth) < 1e-9 && found.start == Start::Given);
    assert!(!found.abstain && found.probability.get() > 0.5, "{}", found.probability);
    assert!(registrar.register(&Request::new(&source, &target)).unwrap().abstain);
}

#[test]
fn the_cloud_that_cannot_be_used_is_named() {
    let registrar = Registrar::new(Options { method: Method::Given, ..Options::default() }).unwrap();
    let line = PointCloud::new((0..7).map(|i| [f64::from(i), 0.0, 0.0]).collect()).unwrap();
    let shape = common::shape(300);
    assert!(matches!(registrar.register(&Request::new(&line, &line)), Err(Error::Source(_))));
    assert!(matches!(registrar.register(&Request::new(&shape, &line)), Err(Error::Target(_))));
    let weights = Options { weights: Some("srrf-huge".into()), ..Options::default() };
    assert!(matches!(Registrar::new(weights), Err(Error::Weights(_))));
    let device = Options { device: "abacus".into(), ..Options::default() };
    assert!(matches!(Registrar::new(device), Err(Error::Device(_))));
}
