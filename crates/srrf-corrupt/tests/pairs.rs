//! Pair synthesis through the public door.

#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr, reason = "helpers of tests")]

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use srrf_cloud::{PointCloud, Rigid};
use srrf_corrupt::{
    Bases, Corrupt, CorruptionKind, Label, Normalize, Pair, PairConfig, PairError, PairSynthesizer, PoseDraw,
    RotationRange, Severity, Stream, oracle_pose,
};

const STREAM: Stream = Stream { seed: 3, item: 8 };

fn base(n: usize, seed: u64) -> PointCloud {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let points =
        (0..n).map(|_| std::array::from_fn(|c| (1.0 - 0.3 * c as f64) * rng.random_range(-1.0..1.0)));
    PointCloud::new(points.collect()).unwrap().to_unit_sphere().0
}

fn severity(s: u8) -> Severity {
    Severity::try_from(s).unwrap()
}

fn make(config: PairConfig, cloud: &PointCloud, corruption: Option<(CorruptionKind, u8)>) -> Pair {
    let corruption = corruption.map(|(kind, s)| (kind, severity(s)));
    PairSynthesizer::new(config)
        .unwrap()
        .pair_from_bases(Bases::Shared(cloud), Label::default(), corruption, PoseDraw::Seeded, STREAM)
        .unwrap()
}

fn largest_box_side(cloud: &PointCloud) -> f64 {
    (0..3)
        .map(|c| {
            let values = cloud.points().iter().map(|p| p[c]);
            values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
        })
        .fold(0.0, f64::max)
}

#[test]
fn a_clean_pair_is_its_base_posed_and_shuffled() {
    let cloud = base(131, 1);
    let pair = make(PairConfig { points: 131, ..PairConfig::default() }, &cloud, None);
    for (side, origins, pose) in [
        (&pair.source, &pair.source_origin, Rigid::identity()),
        (&pair.target, &pair.target_origin, pair.target_from_source),
    ] {
        let origins: Vec<usize> = origins.as_ref().unwrap().iter().map(|o| o.unwrap() as usize).collect();
        for (p, &o) in side.points().iter().zip(&origins) {
            assert_eq!(*p, pose.apply(&cloud.points()[o]));
        }
        let mut sorted = origins.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..131).collect::<Vec<_>>());
        assert_ne!(sorted, origins, "shuffled");
    }
    assert_ne!(pair.source_origin, pair.target_origin, "by shuffles of their own");
    let found = oracle_pose(&pair).unwrap();
    assert!((found.to_matrix4() - pair.target_from_source.to_matrix4()).norm() < 1e-12);
}

#[test]
fn every_corruption_gives_exactly_so_many_points() {
    for kind in CorruptionKind::ALL {
        for s in 1..=5 {
            for points in [57, 200, 1000] {
                let pair =
                    make(PairConfig { points, ..PairConfig::default() }, &base(200, 2), Some((kind, s)));
                assert_eq!((pair.source.len(), pair.target.len()), (points, points), "{kind} {s}");
                assert_eq!(pair.source_origin.unwrap().len(), points);
            }
        }
    }
}

#[test]
fn resampling_repeats_only_when_it_must() {
    let distinct = |pair: &Pair| {
        let mut origins = pair.source_origin.clone().unwrap();
        origins.sort_unstable();
        origins.dedup();
        origins.len()
    };
    let cloud = base(1024, 2);
    let config = PairConfig::default();
    assert_eq!(distinct(&make(config, &cloud, Some((CorruptionKind::Cutout, 5)))), 724);
    assert_eq!(distinct(&make(PairConfig { points: 700, ..config }, &cloud, None)), 700);
}

#[test]
fn one_stream_one_pair_and_one_pose_for_all_corruptions() {
    let cloud = base(256, 4);
    let config = PairConfig { points: 128, ..PairConfig::default() };
    let pose = make(config, &cloud, None).target_from_source;
    for kind in CorruptionKind::ALL {
        let pair = make(config, &cloud, Some((kind, 4)));
        assert_eq!(pair, make(config, &cloud, Some((kind, 4))));
        assert_eq!(pair.target_from_source, pose);
    }
}

#[test]
fn only_the_chosen_cloud_is_corrupted() {
    let cloud = base(300, 5);
    let moved = |points: &PointCloud, origins: &Option<Vec<Option<u32>>>, pose: &Rigid| {
        points.points().iter().zip(origins.as_ref().unwrap()).any(|(p, o)| {
            let q = pose.inverse().apply(p);
            o.is_none_or(|o| (Vector3::from(q) - Vector3::from(cloud.points()[o as usize])).norm() > 1e-9)
        })
    };
    for (corrupt, expected) in
        [(Corrupt::Both, (true, true)), (Corrupt::Source, (true, false)), (Corrupt::Target, (false, true))]
    {
        let config = PairConfig { corrupt, points: 300, ..PairConfig::default() };
        let pair = make(config, &cloud, Some((CorruptionKind::Uniform, 2)));
        let found = (
            moved(&pair.source, &pair.source_origin, &Rigid::identity()),
            moved(&pair.target, &pair.target_origin, &pair.target_from_source),
        );
        assert_eq!(found, expected, "{corrupt:?}");
    }
    // Both: the draws are independent.
    let config = PairConfig {
        points: 300,
        rotation: RotationRange::EulerAxes { max_deg: 0.0 },
        translation: 0.0,
        ..PairConfig::default()
    };
    let pair = make(config, &cloud, Some((CorruptionKind::Uniform, 2)));
    let sorted = |c: &PointCloud| {
        let mut points = c.points().to_vec();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        points
    };
    assert_ne!(sorted(&pair.source), sorted(&pair.target));
}

#[test]
fn normalisation_where_modelnet40_c_has_it() {
    let cloud = base(1024, 6);
    let side = |normalize, kind, pick: fn(&Pair) -> &PointCloud| {
        largest_box_side(pick(&make(
            PairConfig { normalize, ..PairConfig::default() },
            &cloud,
            Some((kind, 1)),
        )))
    };
    let boxed = |length: f64| (length - 2.0).abs() < 1e-9;
    // The longest side of a posed cloud is another one: canonical normalisation shows on the source.
    assert!(!boxed(side(Normalize::None, CorruptionKind::Uniform, |p| &p.source)));
    assert!(boxed(side(Normalize::Canonical, CorruptionKind::Uniform, |p| &p.source)));
    assert!(!boxed(side(Normalize::Canonical, CorruptionKind::Gaussian, |p| &p.source)));
    assert!(!boxed(side(Normalize::Canonical, CorruptionKind::Uniform, |p| &p.target)));
    assert!(boxed(side(Normalize::AfterPose, CorruptionKind::Uniform, |p| &p.target)));
    assert!(!boxed(side(Normalize::AfterPose, CorruptionKind::Cutout, |p| &p.target)));
}

#[test]
fn independent_bases_keep_no_correspondence() {
    let pair = PairSynthesizer::new(PairConfig::default())
        .unwrap()
        .pair_from_bases(
            Bases::Independent(&base(512, 1), &base(512, 2)),
            Label { id: "x".into(), class: "vase".into(), symmetric: true },
            None,
            PoseDraw::DcpTest(17),
            STREAM,
        )
        .unwrap();
    assert_eq!((pair.source.len(), pair.target.len()), (1024, 1024));
    assert_eq!((oracle_pose(&pair), pair.source_origin), (None, None));
    assert_eq!(pair.target_from_source, srrf_corrupt::dcp_test_pose(17));
    assert_eq!((pair.id.as_str(), pair.class.as_str(), pair.symmetric), ("x", "vase", true));
}

#[test]
fn what_cannot_be_made_is_an_error_that_says_why() {
    let three = PointCloud::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]).unwrap();
    let synthesizer = PairSynthesizer::new(PairConfig::default()).unwrap();
    let label = Label { id: "tiny".into(), ..Label::default() };
    let corruption = Some((CorruptionKind::Cutout, severity(1)));
    let error = synthesizer
        .pair_from_bases(Bases::Shared(&three), label, corruption, PoseDraw::Seeded, STREAM)
        .unwrap_err();
    assert!(matches!(error, PairError::Corrupt { .. }));
    assert_eq!(error.to_string(), "shape tiny: cutout needs at least 32 points, the cloud has 3");
    assert!(PairSynthesizer::new(PairConfig { points: 0, ..PairConfig::default() }).is_err());
}
