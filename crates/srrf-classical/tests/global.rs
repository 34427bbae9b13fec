//! What the methods of this crate must do, on built-in shapes.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use srrf_classical::{Fgr, FpfhRansac, IcpPlane, IcpRobust, IcpTrimmed};
use srrf_cloud::{CloudError, EulerXyz, PointCloud, Register, RegisterError, Rigid};
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::{CorruptionKind, Pair, PairConfig, PairSynthesizer, PoseDraw, Severity, Stream};

fn motion(angles_deg: [f64; 3], translation: [f64; 3]) -> Rigid {
    Rigid { rotation: EulerXyz::from_deg(angles_deg).to_matrix(), translation: translation.into() }
}

fn pair(kind: CorruptionKind, pose: Rigid, shape: usize) -> Pair {
    let shapes = ProceduralShapes::new(11, 9, None).unwrap();
    let synthesizer = PairSynthesizer::new(PairConfig { points: 1024, ..PairConfig::default() }).unwrap();
    let corruption = Some((kind, Severity::try_from(2).unwrap()));
    synthesizer.pair(&shapes, shape, corruption, PoseDraw::Given(pose), Stream { seed: 5, item: 1 }).unwrap()
}

fn far() -> Rigid {
    motion([120.0, -50.0, 35.0], [0.4, 2.0, -0.7])
}

fn near() -> Rigid {
    motion([5.0, -4.0, 6.0], [0.03, -0.02, 0.04])
}

fn global() -> [Box<dyn Register>; 2] {
    [Box::new(FpfhRansac::default()), Box::new(Fgr::default())]
}

fn local() -> [Box<dyn Register>; 3] {
    [Box::new(IcpPlane::default()), Box::new(IcpTrimmed::default()), Box::new(IcpRobust::default())]
}

fn pose(method: &dyn Register, source: &PointCloud, target: &PointCloud) -> Rigid {
    method.register(source, target).unwrap().target_from_source
}

fn distance(a: &Rigid, b: &Rigid) -> f64 {
    (a.to_matrix4() - b.to_matrix4()).norm()
}

#[test]
fn names() {
    let names =
        |methods: &[Box<dyn Register>]| methods.iter().map(|m| m.name().to_owned()).collect::<Vec<_>>();
    assert_eq!(names(&global()), ["fpfh-ransac", "fgr"]);
    assert_eq!(names(&local()), ["icp-plane", "icp-trimmed", "icp-robust"]);
}

#[test]
fn global_methods_need_no_start() {
    for method in global() {
        for (kind, shape) in [(CorruptionKind::Cutout, 0), (CorruptionKind::DensityDec, 4)] {
            let pair = pair(kind, far(), shape);
            let found = pose(&*method, &pair.source, &pair.target);
            assert!(distance(&found, &far()) < 0.01, "{} {kind} {shape}: {found:?}", method.name());
        }
    }
}

#[test]
fn local_methods_find_small_motions() {
    for method in local() {
        let pair = pair(CorruptionKind::Cutout, near(), 4);
        let found = method.register(&pair.source, &pair.target).unwrap();
        assert!(distance(&found.target_from_source, &near()) < 0.02, "{}: {found:?}", method.name());
        assert!(found.iterations > 1);
    }
}

#[test]
fn the_answer_follows_when_the_clouds_move() {
    let (a, b) = (motion([30.0, 80.0, -45.0], [3.0, 1.0, 2.0]), motion([-70.0, 10.0, 5.0], [-1.0, 4.0, 0.5]));
    for method in global() {
        let pair = pair(CorruptionKind::Cutout, far(), 0);
        let moved = pose(&*method, &pair.source.transformed(&a), &pair.target.transformed(&b));
        assert!(distance(&b.inverse().compose(&moved).compose(&a), &far()) < 0.01, "{}", method.name());
    }
    // The local methods start at the identity, so that both clouds must move alike.
    for method in local() {
        let pair = pair(CorruptionKind::Uniform, near(), 4);
        let plain = pose(&*method, &pair.source, &pair.target);
        let moved = pose(&*method, &pair.source.transformed(&b), &pair.target.transformed(&b));
        let back = b.inverse().compose(&moved).compose(&b);
        assert!(distance(&back, &plain) < 1e-3, "{}: {}", method.name(), distance(&back, &plain));
    }
}

#[test]
fn order_and_threads_do_not_matter() {
    let pair = pair(CorruptionKind::Impulse, near(), 0);
    let shuffled =
        |c: &PointCloud| PointCloud::new((0..1024).map(|i| c.points()[i * 77 % 1024]).collect()).unwrap();
    let (source, target) = (shuffled(&pair.source), shuffled(&pair.target));
    for method in global().into_iter().chain(local()) {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| method.register(&pair.source, &pair.target).unwrap())
        };
        let one = with(1);
        assert_eq!(one, with(3), "{}", method.name());
        let other = pose(&*method, &source, &target);
        assert!(distance(&one.target_from_source, &other) < 1e-4, "{}", method.name());
    }
}

#[test]
fn refuse_what_they_cannot_register() {
    let line = PointCloud::new((0..9).map(|i| [f64::from(i), 0.0, 0.0]).collect()).unwrap();
    let cloud = pair(CorruptionKind::Cutout, near(), 0).source;
    let few = PointCloud::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]).unwrap();
    for method in global().into_iter().chain(local()) {
        let error = method.register(&line, &cloud).unwrap_err();
        assert!(matches!(error, RegisterError::Source(CloudError::Collinear)), "{}", method.name());
        let error = method.register(&cloud, &line).unwrap_err();
        assert!(matches!(error, RegisterError::Target(CloudError::Collinear)), "{}", method.name());
        // Three points: an answer or an error, and no panic.
        let _ = method.register(&few, &cloud);
        let _ = method.register(&few, &few);
    }
}
