//! What every refinement must do, on built-in shapes.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use nalgebra::{Matrix6, Vector3};
use srrf_cloud::{CloudError, EulerXyz, PointCloud, Register, RegisterError, Registration, Rigid, Solid};
use srrf_corrupt::crop::visible;
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::{CorruptionKind, Pair, PairConfig, PairSynthesizer, PoseDraw, Sampling, Severity, Stream};
use srrf_refine::{Deformed, RefineConfig, RefineError, RefineTarget, Refined, Verdict, refine};

fn motion(angles_deg: [f64; 3], translation: [f64; 3]) -> Rigid {
    Rigid { rotation: EulerXyz::from_deg(angles_deg).to_matrix(), translation: translation.into() }
}

fn pair(kind: CorruptionKind, severity: u8, points: usize, item: u64) -> Pair {
    let shapes = ProceduralShapes::new(11, 9, None).unwrap();
    let synthesizer = PairSynthesizer::new(PairConfig { points, ..PairConfig::default() }).unwrap();
    let corruption = Some((kind, Severity::try_from(severity).unwrap()));
    let stream = Stream { seed: 5, item };
    synthesizer.pair(&shapes, item as usize % 9, corruption, PoseDraw::Seeded, stream).unwrap()
}

/// The true pose, off by 5 degrees and 0.02.
fn off(pair: &Pair) -> Rigid {
    pair.target_from_source.compose(&motion([3.0, -2.0, 3.5], [0.01, -0.015, 0.01]))
}

fn answer(source: &PointCloud, target: &PointCloud, start: Rigid) -> Rigid {
    refine(source, target, &[start], &RefineConfig::default()).unwrap().target_from_source
}

fn distance(a: &Rigid, b: &Rigid) -> f64 {
    (a.to_matrix4() - b.to_matrix4()).norm()
}

#[test]
fn points_in_both_clouds_give_the_exact_pose() {
    for (item, kind) in [CorruptionKind::Cutout, CorruptionKind::DensityDec, CorruptionKind::Background]
        .into_iter()
        .enumerate()
    {
        let pair = pair(kind, 3, 701, item as u64);
        let found = refine(&pair.source, &pair.target, &[off(&pair)], &RefineConfig::default()).unwrap();
        assert_eq!(found.verdict, Verdict::Rigid);
        assert!(found.kept && distance(&found.target_from_source, &pair.target_from_source) < 2e-3, "{kind}");
        let rotation = found.target_from_source.rotation;
        assert!(
            (rotation.determinant() - 1.0).abs() < 1e-9
                && (rotation * rotation.transpose()).trace() < 3.0 + 1e-9
        );
        assert!(found.evidence.fitness > 0.6 && found.evidence.inlier_rmse < found.evidence.spacing);
    }
}

#[test]
fn soft_matches_average_noise_away() {
    let hard = RefineConfig { soft: false, ..RefineConfig::default() };
    let (mut with, mut without) = (0.0, 0.0);
    for item in 0..6 {
        let pair = pair(CorruptionKind::Gaussian, 4, 701, item);
        let starts = [off(&pair)];
        let angle = |config: &RefineConfig| {
            let found = refine(&pair.source, &pair.target, &starts, config).unwrap();
            found.target_from_source.angle_to_deg(&pair.target_from_source)
        };
        with += angle(&RefineConfig::default()) / 6.0;
        without += angle(&hard) / 6.0;
    }
    assert!(with < 0.75 * without && with < 1.0, "{with} against {without} degrees");
}

#[test]
fn the_answer_follows_when_the_clouds_move() {
    let pair = pair(CorruptionKind::Uniform, 2, 501, 3);
    let plain = answer(&pair.source, &pair.target, off(&pair));
    let (a, b) =
        (motion([130.0, 40.0, -75.0], [3.0, 5.0, -2.0]), motion([-20.0, 80.0, 15.0], [4e5, -5e5, 10.0]));
    let start = b.compose(&off(&pair)).compose(&a.inverse());
    let moved = answer(&pair.source.transformed(&a), &pair.target.transformed(&b), start);
    let back = b.inverse().compose(&moved).compose(&a);
    assert!(distance(&back, &plain) < 1e-5, "{}", distance(&back, &plain));
}

#[test]
fn neither_order_nor_threads_matter() {
    let pair = pair(CorruptionKind::Impulse, 3, 6007, 2);
    let config = RefineConfig { coarse_points: 1000, max_points: 5500, ..RefineConfig::default() };
    let run = |source: &PointCloud, target: &PointCloud, threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let starts = [off(&pair), Rigid::identity()];
        pool.install(|| refine(source, target, &starts, &config).unwrap())
    };
    let one = run(&pair.source, &pair.target, 1);
    assert_eq!(one, run(&pair.source, &pair.target, 3));
    assert!(one.target_from_source.angle_to_deg(&pair.target_from_source) < 0.2);
    assert!(one.evidence.source_points <= 5500 && one.evidence.source_points > 2000);

    let shuffled =
        |c: &PointCloud| PointCloud::new((0..6007).map(|i| c.points()[i * 100 % 6007]).collect()).unwrap();
    let other = run(&shuffled(&pair.source), &shuffled(&pair.target), 2);
    assert!(distance(&one.target_from_source, &other.target_from_source) < 1e-6);
}

#[test]
fn the_better_start_wins() {
    let pair = pair(CorruptionKind::DensityInc, 3, 701, 4);
    let wrong = pair.target_from_source.compose(&motion([70.0, 30.0, -50.0], [0.2, 0.1, 0.0]));
    let starts = [wrong, off(&pair), Rigid::identity()];
    let found = refine(&pair.source, &pair.target, &starts, &RefineConfig::default()).unwrap();
    assert_eq!(found.start, 1);
    assert!(found.starts[1].support > found.starts[0].support && found.starts.len() == 3);
    assert!(distance(&found.target_from_source, &pair.target_from_source) < 2e-3);
}

#[test]
fn deformation_is_told_from_noise() {
    let config = RefineConfig::default();
    for item in 0..4 {
        for (kind, verdict) in
            [(CorruptionKind::Distortion, Verdict::Deformed), (CorruptionKind::Gaussian, Verdict::Rigid)]
        {
            let pair = pair(kind, 4, 1024, item);
            let found = refine(&pair.source, &pair.target, &[off(&pair)], &config).unwrap();
            assert_eq!(found.verdict, verdict, "{kind} {item}: {:?}", found.residuals);
        }
    }
}

#[test]
fn where_the_clouds_are_bent_the_first_start_is_the_answer_whatever_the_support() {
    let pair = pair(CorruptionKind::Distortion, 4, 1024, 1);
    let worse = motion([4.0, 3.0, -5.0], [0.03, 0.0, -0.02]).compose(&off(&pair));
    let starts = [worse, pair.target_from_source];
    let by = |deformed| {
        let config = RefineConfig { deformed, ..RefineConfig::default() };
        refine(&pair.source, &pair.target, &starts, &config).unwrap()
    };
    let found = by(Deformed::Start);
    assert!(found.starts[1].support > found.starts[0].support, "{:?}", found.starts);
    assert_eq!((found.verdict, found.start), (Verdict::Deformed, 0));
    assert_eq!((found.target_from_source, found.kept), (worse, false));
    assert_ne!(by(Deformed::Halfway).target_from_source, worse);
}

#[test]
fn what_two_cameras_see_of_one_shape_is_not_taken_for_bent() {
    let shapes = ProceduralShapes::new(11, 9, None).unwrap();
    let config = PairConfig {
        sampling: Sampling::Independent,
        keep_correspondence: false,
        points: 700,
        ..PairConfig::default()
    };
    let synthesizer = PairSynthesizer::new(config).unwrap();
    let (mut bent, mut wrong) = (Vec::new(), Vec::new());
    for item in 0..45 {
        let stream = Stream { seed: 8, item };
        let pair = synthesizer.pair(&shapes, item as usize % 9, None, PoseDraw::Seeded, stream).unwrap();
        let seen = |cloud: &PointCloud, from: Vector3<f64>| {
            let kept = visible(cloud.points(), &from.normalize(), 0.1, 0.15);
            PointCloud::new(kept.into_iter().map(|i| cloud.points()[i]).collect()).unwrap()
        };
        let camera = motion([0.0, 8.0 * item as f64, 0.0], [0.0; 3]).rotation * Vector3::new(0.8, 0.4, 0.0);
        let source = seen(&pair.source, camera);
        let other = camera + Vector3::new(0.0, 0.3, 0.3);
        let target = seen(&pair.target, pair.target_from_source.rotation * other);
        let found = refine(&source, &target, &[off(&pair)], &RefineConfig::default()).unwrap();
        if found.verdict == Verdict::Deformed {
            bent.push((item, found.residuals));
        }
        let error = found.target_from_source.angle_to_deg(&pair.target_from_source);
        if error > 5.0 {
            wrong.push((item, error));
        }
    }
    assert!(bent.is_empty() && wrong.is_empty(), "{bent:?}, {wrong:?}");
}

#[test]
fn a_start_that_knows_shapes_is_not_left_by_a_wide_turn_unless_points_coincide() {
    let known = RefineConfig::default();
    let unknown = RefineConfig { deformed: Deformed::Halfway, ..known };
    let turned = |start: Rigid, pair: &Pair, config| {
        let found = refine(&pair.source, &pair.target, &[start], config).unwrap();
        (found.verdict, found.target_from_source.angle_to_deg(&start))
    };
    // A sheared box fits well where it is wrong by 30 degrees.
    let sheared = pair(CorruptionKind::Shear, 5, 1024, 7);
    let start = off(&sheared);
    let (verdict, turn) = turned(start, &sheared, &unknown);
    assert!(verdict == Verdict::Rigid && turn > 25.0, "{verdict:?} {turn}");
    assert_eq!(turned(start, &sheared, &known), (Verdict::Deformed, 0.0));
    // A start that is that far off is left where points coincide, or where it knew no shapes.
    for (kind, config) in [(CorruptionKind::Cutout, &known), (CorruptionKind::Gaussian, &unknown)] {
        let pair = pair(kind, 4, 1024, 3);
        let start = motion([24.0, -12.0, 9.0], [0.0; 3]).compose(&pair.target_from_source);
        let (verdict, turn) = turned(start, &pair, config);
        let far = start.angle_to_deg(&pair.target_from_source);
        assert!(verdict == Verdict::Rigid && far > 25.0 && (turn - far).abs() < 1.0, "{kind}: {turn}, {far}");
    }
}

#[test]
fn a_shear_that_fits_like_a_rigid_pair_is_told_by_an_affine_map() {
    let sheared = pair(CorruptionKind::Shear, 1, 1024, 10);
    let start = sheared.target_from_source;
    let by = |config| refine(&sheared.source, &sheared.target, &[start], &config).unwrap();
    let known = by(RefineConfig::default());
    assert!(known.residuals.across_correlation < 0.04, "{:?}", known.residuals);
    assert!(known.affine.is_some_and(|fit| fit.bend > 1.0 && fit.gain > 0.3), "{:?}", known.affine);
    assert_eq!((known.verdict, known.target_from_source), (Verdict::Deformed, start));
    // Who knows no shapes is not asked, nor who wants no check.
    for config in [
        RefineConfig { deformed: Deformed::Halfway, ..RefineConfig::default() },
        RefineConfig { check_deformation: false, ..RefineConfig::default() },
    ] {
        let found = by(config);
        assert_eq!((found.verdict, found.affine), (Verdict::Rigid, None));
    }
}

#[test]
fn a_prepared_target_serves_many_sources() {
    let pair = pair(CorruptionKind::Upsampling, 2, 501, 5);
    let target = RefineTarget::new(Solid::new(&pair.target).unwrap(), &RefineConfig::default()).unwrap();
    let frame = motion([30.0, 20.0, 50.0], [1.0, 2.0, 3.0]);
    for move_source in [Rigid::identity(), frame] {
        let source = pair.source.transformed(&move_source);
        let start = off(&pair).compose(&move_source.inverse());
        let found = target.refine(Solid::new(&source).unwrap(), &[start]).unwrap();
        let expected = pair.target_from_source.compose(&move_source.inverse());
        assert!(found.target_from_source.angle_to_deg(&expected) < 0.5);
    }
}

#[test]
fn information_is_the_sum_over_inliers() {
    let pair = pair(CorruptionKind::Cutout, 1, 401, 6);
    let target = &pair.source; // a cloud on itself: every point is its own match
    let found = refine(target, target, &[Rigid::identity()], &RefineConfig::default()).unwrap();
    assert_eq!((found.evidence.inliers, found.evidence.source_points), (401, 401));
    assert_eq!((found.evidence.fitness, found.evidence.overlap_target), (1.0, 1.0));
    let mut expected = Matrix6::zeros();
    for p in target.points() {
        let mut j = nalgebra::Matrix3x6::zeros();
        j.fixed_view_mut::<3, 3>(0, 0).copy_from(&-Vector3::from(*p).cross_matrix());
        j.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        expected += j.transpose() * j;
    }
    assert!((found.evidence.information_at_origin() - expected).norm() < 1e-6 * expected.norm());
    // About the mean, turning and shifting do not mix.
    assert!(found.evidence.information.fixed_view::<3, 3>(0, 3).norm() < 1e-6 * expected.norm());
}

#[test]
fn refuses_what_it_cannot_refine() {
    let pair = pair(CorruptionKind::Cutout, 1, 101, 6);
    let config = RefineConfig::default();
    let line = PointCloud::new((0..9).map(|i| [f64::from(i), 0.0, 0.0]).collect()).unwrap();
    let start = [Rigid::identity()];
    assert_eq!(
        refine(&line, &pair.target, &start, &config).unwrap_err(),
        RefineError::Source(CloudError::Collinear)
    );
    assert_eq!(
        refine(&pair.source, &line, &start, &config).unwrap_err(),
        RefineError::Target(CloudError::Collinear)
    );
    assert_eq!(refine(&pair.source, &pair.target, &[], &config).unwrap_err(), RefineError::NoStart);
    let broken =
        [Rigid::identity(), Rigid { translation: Vector3::new(f64::NAN, 0.0, 0.0), ..Rigid::identity() }];
    let error = refine(&pair.source, &pair.target, &broken, &config).unwrap_err();
    assert_eq!(error, RefineError::Start(1));
    assert!(matches!(RegisterError::from(error), RegisterError::NoPose(_)));
    // Far away and tiny clouds: any answer, but no panic.
    let far = motion([0.0; 3], [1e6, 0.0, 0.0]);
    let tiny = PointCloud::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]).unwrap();
    assert!(refine(&tiny, &pair.target, &[far], &config).is_ok());
    let flat =
        PointCloud::new(vec![[1.0, 2.0, 0.0], [1.0, 2.0, 0.0], [2.0, 2.0, 0.0], [1.0, 3.0, 0.0]]).unwrap();
    assert!(refine(&flat, &flat, &start, &config).unwrap().evidence.fitness > 0.99);
}

/// Answers the pose it was made with.
struct Fixed(Rigid);

impl Register for Fixed {
    fn name(&self) -> &str {
        "fixed"
    }

    fn register_solid(&self, _: Solid<'_>, _: Solid<'_>) -> Result<Registration, RegisterError> {
        Ok(Registration::from_pose(self.0))
    }
}

#[test]
fn refined_wraps_any_method() {
    let pair = pair(CorruptionKind::Cutout, 2, 501, 1);
    let method = Refined::new(Fixed(off(&pair)), RefineConfig::default());
    assert_eq!(method.name(), "fixed+refine");
    let found = method.register(&pair.source, &pair.target).unwrap();
    assert!(distance(&found.target_from_source, &pair.target_from_source) < 2e-3);
    assert_eq!(
        (found.branches[0].kind.name(), found.branches[0].target_from_source),
        ("unrefined", off(&pair))
    );
}
