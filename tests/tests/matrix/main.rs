//! Every method of the benchmark against what every method must hold: its answer follows when the clouds move, swapped
//! clouds give the inverse, the order of the points and the number of threads do not matter, nothing that is not finite
//! gets in or out, and clouds on a line are refused. What a method does not promise, and why, stands in `methods.rs`.

#![allow(clippy::panic, clippy::unwrap_used, reason = "helpers of tests")]

mod methods;

use rand::{SeedableRng, rngs::ChaCha8Rng};
use srrf_cloud::{CloudError, EulerXyz, PointCloud, RegisterError, Registration, Rigid};
use srrf_corrupt::datasets::ShapeSource;
use srrf_corrupt::shapes::ProceduralShapes;

use methods::{Case, Follows, Swaps, cases};

/// A prime, so that any step visits every point once.
const POINTS: usize = 601;

fn motion(angles_deg: [f64; 3], translation: [f64; 3]) -> Rigid {
    Rigid { rotation: EulerXyz::from_deg(angles_deg).to_matrix(), translation: translation.into() }
}

/// So small that methods find it which start where the source lies.
fn truth() -> Rigid {
    motion([5.0, -4.0, 6.0], [0.03, -0.02, 0.04])
}

fn shift(translation: [f64; 3]) -> Rigid {
    motion([0.0; 3], translation)
}

fn reordered(cloud: &PointCloud, step: usize) -> PointCloud {
    PointCloud::new((0..POINTS).map(|i| cloud.points()[i * step % POINTS]).collect()).unwrap()
}

/// A shape without symmetry, and the same points moved and in another order.
fn pair() -> (PointCloud, PointCloud) {
    let shapes = ProceduralShapes::new(3, 1, Some(&["chair"])).unwrap();
    let source = shapes.sample(0, POINTS, &mut ChaCha8Rng::seed_from_u64(4)).unwrap();
    let target = reordered(&source.transformed(&truth()), 150);
    (source, target)
}

fn line() -> PointCloud {
    PointCloud::new((0..POINTS).map(|i| [i as f64, 2.0 * i as f64, -1.0]).collect()).unwrap()
}

fn answer(case: &Case, source: &PointCloud, target: &PointCloud) -> Registration {
    case.method.register(source, target).unwrap_or_else(|e| panic!("{}: {e}", case.name))
}

fn pose(case: &Case, source: &PointCloud, target: &PointCloud) -> Rigid {
    answer(case, source, target).target_from_source
}

/// Distance of two poses: of the rotation matrices, and of where they bring the origin of the source.
fn gap(a: &Rigid, b: &Rigid) -> f64 {
    (a.to_matrix4() - b.to_matrix4()).norm()
}

/// Fails with all cases that differ by more than `most`, not with the first.
fn all_within(most: f64, gaps: impl Iterator<Item = (&'static str, f64)>) {
    let beyond: Vec<_> = gaps.filter(|(_, gap)| gap.is_nan() || *gap > most).collect();
    assert!(beyond.is_empty(), "more than {most}: {beyond:?}");
}

#[test]
fn the_answer_follows_when_the_clouds_move() {
    let (source, target) = pair();
    let gaps = cases().iter().map(|case| {
        let (a, b) = match case.promise.follows {
            Follows::Any => (
                motion([100.0, -40.0, 20.0], [2.0, 1.0, -3.0]),
                motion([-70.0, 10.0, 150.0], [-1.0, 4.0, 0.5]),
            ),
            Follows::Shifts => (shift([2.0, 1.0, -3.0]), shift([-1.0, 4.0, 0.5])),
            Follows::Together => {
                let both = motion([30.0, 80.0, -45.0], [3.0, 1.0, 2.0]);
                (both, both)
            }
            Follows::Nothing => (Rigid::identity(), Rigid::identity()),
        };
        let moved = pose(case, &source.transformed(&a), &target.transformed(&b));
        (case.name, gap(&b.inverse().compose(&moved).compose(&a), &pose(case, &source, &target)))
    });
    all_within(1e-3, gaps);
}

#[test]
fn swapped_clouds_give_the_inverse() {
    let (source, target) = pair();
    let inverted = |case: &&Case| match case.promise.swaps {
        Swaps::Inverted => true,
        Swaps::Not(why) => why.is_empty(),
    };
    let gaps = cases().iter().filter(inverted).map(|case| {
        let (there, back) = (pose(case, &source, &target), pose(case, &target, &source));
        (case.name, gap(&back.compose(&there), &Rigid::identity()))
    });
    all_within(5e-3, gaps);
}

#[test]
fn the_order_of_the_points_does_not_matter() {
    let (source, target) = pair();
    let (other_source, other_target) = (reordered(&source, 77), reordered(&target, 200));
    let moved: Vec<_> = cases()
        .iter()
        .map(|case| (case, gap(&pose(case, &source, &target), &pose(case, &other_source, &other_target))))
        .filter(|(case, gap)| gap.is_nan() || *gap > case.promise.moved_by_order)
        .map(|(case, gap)| (case.name, gap))
        .collect();
    assert!(moved.is_empty(), "{moved:?}");
}

#[test]
fn threads_change_no_bit() {
    let (source, target) = pair();
    for case in cases() {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| answer(case, &source, &target))
        };
        assert_eq!(with(1), with(3), "{}", case.name);
    }
}

/// No cloud holds NaN, so none gets in. Coordinates whose squares are beyond the largest number do: no method may panic,
/// run on, or answer with a pose that is not finite.
#[test]
fn nothing_that_is_not_finite_gets_in_or_out() {
    let (source, target) = pair();
    let mut points = source.points().to_vec();
    points[7][1] = f64::NAN;
    assert!(matches!(PointCloud::new(points), Err(CloudError::NotFinite { index: 7, .. })));

    let scaled = |cloud: &PointCloud, by: f64| {
        PointCloud::new(cloud.points().iter().map(|p| p.map(|v| v * by)).collect()).unwrap()
    };
    for by in [1e-200, 1e200] {
        let (tiny_or_huge, other) = (scaled(&source, by), scaled(&target, by));
        for case in cases() {
            for (source, target) in [(&tiny_or_huge, &other), (&tiny_or_huge, &target), (&source, &other)] {
                if let Ok(found) = case.method.register(source, target) {
                    let Rigid { rotation, translation } = found.target_from_source;
                    let finite = rotation.iter().chain(translation.iter()).all(|v| v.is_finite());
                    assert!(finite, "{} of clouds scaled by {by}: {found:?}", case.name);
                }
            }
        }
    }
}

#[test]
fn clouds_on_a_line_are_refused_by_side() {
    let (source, line) = (pair().0, line());
    for case in cases().iter().filter(|case| case.promise.refuses_lines) {
        let refused = |source, target| case.method.register(source, target).err();
        assert!(
            matches!(refused(&line, &source), Some(RegisterError::Source(CloudError::Collinear))),
            "{}",
            case.name
        );
        assert!(
            matches!(refused(&source, &line), Some(RegisterError::Target(CloudError::Collinear))),
            "{}",
            case.name
        );
    }
}
