//! Scans of built-in shapes from all around, registered by an oracle that errs where it is told to.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use srrf_align::{
    AlignError, AlignOptions, AlignProgress, EdgeVerdict, Map, NoStore, PairAnswer, PairReason, PairStore,
    RegisterPairs, align,
};
use srrf_cloud::{PointCloud, Rigid};
use srrf_corrupt::datasets::ShapeSource;
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::views::{anywhere, seen_from, turntable};

/// Scans that lie anywhere, and the truth.
struct Scene {
    scans: Vec<PointCloud>,
    /// The frame of the object, or of one of several objects.
    object_from_scan: Vec<Rigid>,
    /// Object of each scan, and its place around that.
    places: Vec<(usize, usize)>,
    /// Views of a full turn.
    around: usize,
}

impl Scene {
    /// Views of objects, each all around from so many sides, of which so many are kept.
    fn new(objects: &[(usize, usize)], around: usize, seed: u64) -> Self {
        let shapes = ProceduralShapes::new(23, 6, None).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut scene = Self { scans: Vec::new(), object_from_scan: Vec::new(), places: Vec::new(), around };
        for (number, &(shape, kept)) in objects.iter().enumerate() {
            let dense = shapes.sample(shape, 40_000, &mut rng).unwrap();
            for (place, eye) in turntable(around, 3.5, 1.3).into_iter().take(kept).enumerate() {
                let seen = seen_from(&dense, eye, 0.015).unwrap();
                let scan_from_object = anywhere(
                    std::array::from_fn(|_| rng.random_range(-3.0..3.0)),
                    std::array::from_fn(|_| rng.random_range(-5.0..5.0)),
                );
                let kept = seen.points().iter().filter(|_| rng.random_range(0.0..1.0) < 0.2);
                scene.scans.push(PointCloud::new(kept.map(|p| scan_from_object.apply(p)).collect()).unwrap());
                scene.object_from_scan.push(scan_from_object.inverse());
                scene.places.push((number, place));
            }
        }
        scene
    }

    fn relative(&self, source: usize, target: usize) -> Rigid {
        self.object_from_scan[target].inverse().compose(&self.object_from_scan[source])
    }

    /// Whether two scans share a good part.
    fn overlap(&self, a: usize, b: usize) -> bool {
        let ((first, i), (second, j)) = (self.places[a], self.places[b]);
        let apart = i.abs_diff(j).min(self.around - i.abs_diff(j));
        first == second && apart * 4 <= self.around
    }

    /// Largest rotation error in degrees of the scans of a component against its first.
    fn worst_deg(&self, map: &Map, component: usize) -> f64 {
        let members = &map.components[component];
        let pose = |i: usize| map.scans[i].map_from_scan;
        members
            .iter()
            .map(|&i| {
                let found = pose(members[0]).inverse().compose(&pose(i));
                found.angle_to_deg(&self.relative(i, members[0]))
            })
            .fold(0.0, f64::max)
    }
}

/// Knows the truth, by the first point of each scan.
struct Oracle<'a> {
    scene: &'a Scene,
    /// Pairs (lower number first) that it gets wrong while being sure.
    wrong: Vec<(usize, usize)>,
    asked: AtomicUsize,
}

impl<'a> Oracle<'a> {
    fn new(scene: &'a Scene) -> Self {
        Self { scene, wrong: Vec::new(), asked: AtomicUsize::new(0) }
    }

    fn number(&self, scan: &PointCloud) -> usize {
        self.scene.scans.iter().position(|s| s.points()[0] == scan.points()[0]).unwrap()
    }
}

impl RegisterPairs for Oracle<'_> {
    type Target = usize;
    type Error = Infallible;

    fn prepare(&self, target: &PointCloud) -> Result<usize, Infallible> {
        Ok(self.number(target))
    }

    fn register(
        &self,
        source: &PointCloud,
        target: &usize,
        _: Option<Rigid>,
    ) -> Result<PairAnswer, Infallible> {
        self.asked.fetch_add(1, Ordering::Relaxed);
        let (source, target) = (self.number(source), *target);
        let right = self.scene.relative(source, target);
        let key = (source.min(target), source.max(target));
        // A tenth of a degree off, and another one for each pair.
        let s = (7 * source + 13 * target) as f64;
        let off =
            anywhere([0.002 * s.sin(), 0.002 * s.cos(), 0.001], [0.002 * s.cos(), 0.0, 0.002 * s.sin()]);
        let centre = self.scene.scans[target].centroid();
        let to = Rigid { translation: centre, ..Rigid::identity() };
        let about = |m: &Rigid| to.compose(m).compose(&to.inverse());
        let (by, probability) = if self.wrong.contains(&key) {
            (anywhere([0.9 * s.sin(), 0.5, 1.1 * s.cos()], [0.1, 0.0, 0.1]), 0.95)
        } else if self.scene.overlap(source, target) {
            (off, 0.95)
        } else {
            (anywhere([1.5, 0.4 * s.sin(), 2.0], [0.0; 3]), 0.1)
        };
        let pose = about(&by).compose(&right);
        Ok(PairAnswer {
            target_from_source: Some(pose),
            probability,
            probability_of_fit: probability,
            abstain: probability < 0.5,
            others: Vec::new(),
        })
    }
}

fn run(scene: &Scene, oracle: &Oracle<'_>, options: &AlignOptions) -> Map {
    align(&scene.scans[..], oracle, options, &NoStore, &|_| {}).unwrap()
}

#[test]
fn a_ring_of_views_comes_together_better_than_its_pairs() {
    let scene = Scene::new(&[(1, 8)], 8, 3);
    let oracle = Oracle::new(&scene);
    let map = run(&scene, &oracle, &AlignOptions::default());
    assert_eq!(map.components, [(0..8).collect::<Vec<_>>()]);
    assert_eq!(
        (map.choice.tried, map.choice.possible, map.choice.rounds[0]),
        (28, 28, (PairReason::All, 28))
    );
    let worst = scene.worst_deg(&map, 0);
    assert!(worst < 0.1, "{worst}");
    let probabilities: Vec<f64> = map.scans.iter().map(|s| s.probability).collect();
    assert!(probabilities.iter().all(|p| *p > 0.95), "{probabilities:?}");
    for scan in &map.scans {
        assert!(!scan.abstain && scan.held_by.len() >= 2 && scan.undetermined.is_empty(), "{scan:?}");
        assert!(scan.residual.unwrap() < 0.05 && scan.spread.unwrap() < 0.05, "{scan:?}");
    }
    assert_eq!(map.scans[0].map_from_scan, Rigid::identity());
    assert!(map.worst_loop.unwrap().angle_deg < 2.0);
}

#[test]
fn two_objects_give_two_maps_and_a_scan_alone_abstains() {
    let scene = Scene::new(&[(0, 5), (2, 4), (4, 1)], 8, 5);
    let map = run(&scene, &Oracle::new(&scene), &AlignOptions::default());
    assert_eq!(map.components, [(0..5).collect::<Vec<_>>(), (5..9).collect(), vec![9]]);
    assert!(scene.worst_deg(&map, 0) < 0.2 && scene.worst_deg(&map, 1) < 0.2);
    let alone = &map.scans[9];
    assert!(alone.abstain && alone.probability == 0.0 && alone.held_by.is_empty() && alone.spread.is_none());
    assert!(map.scans[..9].iter().all(|s| !s.abstain));
}

#[test]
fn sure_and_wrong_pairs_are_found_and_named() {
    let scene = Scene::new(&[(1, 10)], 10, 7);
    let mut oracle = Oracle::new(&scene);
    oracle.wrong = vec![(0, 5), (1, 2), (3, 8), (2, 7), (4, 9), (6, 7)];
    let map = run(&scene, &oracle, &AlignOptions::default());
    assert_eq!(map.components.len(), 1);
    assert!(scene.worst_deg(&map, 0) < 0.2, "{}", scene.worst_deg(&map, 0));
    for edge in &map.edges {
        let pair = (edge.source.min(edge.target), edge.source.max(edge.target));
        if oracle.wrong.contains(&pair) {
            assert!(edge.verdict != EdgeVerdict::Holds && edge.posterior < 0.5, "{edge:?}");
        } else if scene.overlap(pair.0, pair.1) {
            assert_eq!(edge.verdict, EdgeVerdict::Holds, "{edge:?}");
        }
    }
}

/// Pairs that somebody threw in.
struct ThrownIn(BTreeMap<(usize, usize), PairAnswer>);

impl PairStore for ThrownIn {
    fn find(&self, source: usize, target: usize) -> Option<PairAnswer> {
        self.0.get(&(source, target)).cloned()
    }

    fn pairs(&self) -> Vec<(usize, usize)> {
        self.0.keys().copied().collect()
    }

    fn keep(&self, _: usize, _: usize, _: &PairAnswer) {}
}

#[test]
fn a_turntable_comes_together_though_three_in_ten_pairs_are_sure_and_wrong() {
    let scene = Scene::new(&[(1, 36)], 36, 4);
    let oracle = Oracle::new(&scene);
    let without = run(&scene, &oracle, &AlignOptions::default());
    let wanted = without.choice.tried * 3 / 7;
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut wrong = BTreeMap::new();
    let known = |a: usize, b: usize| {
        without.edges.iter().any(|e| (e.source, e.target) == (a, b) || (e.source, e.target) == (b, a))
    };
    while wrong.len() < wanted {
        let (a, b) = (rng.random_range(0..36), rng.random_range(0..36));
        if a < b && !known(a, b) {
            let angles = std::array::from_fn(|_| rng.random_range(-3.0..3.0));
            let off = anywhere(angles, std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
            let pose = Some(scene.relative(a, b).compose(&off));
            wrong.insert(
                (a, b),
                PairAnswer {
                    target_from_source: pose,
                    probability: 0.95,
                    probability_of_fit: 0.95,
                    abstain: false,
                    others: Vec::new(),
                },
            );
        }
    }
    let map = align(&scene.scans[..], &oracle, &AlignOptions::default(), &ThrownIn(wrong.clone()), &|_| {})
        .unwrap();
    assert_eq!(map.components, [(0..36).collect::<Vec<_>>()]);
    assert!(scene.worst_deg(&map, 0) < 0.1, "{}", scene.worst_deg(&map, 0));
    let of_wrong =
        map.edges.iter().filter(|e| wrong.contains_key(&(e.source.min(e.target), e.source.max(e.target))));
    let (mut asked, mut held) = (0, 0);
    for edge in of_wrong {
        asked += 1;
        held += usize::from(edge.verdict == EdgeVerdict::Holds);
    }
    assert_eq!((asked, held), (wanted, 0));
    assert!(map.scans.iter().all(|s| !s.abstain && s.probability > 0.9));
}

#[test]
fn many_scans_try_few_pairs_and_the_answer_is_the_same_for_any_threads() {
    let scene = Scene::new(&[(1, 12), (3, 12)], 12, 11);
    let oracle = Oracle::new(&scene);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&scene, &oracle, &AlignOptions::default()))
    };
    let map = with(1);
    assert!(map.choice.tried < 150 && map.choice.possible == 276, "{:?}", map.choice);
    assert_eq!(map.choice.compared, 276);
    assert_eq!(map.components, [(0..12).collect::<Vec<_>>(), (12..24).collect()]);
    assert!(scene.worst_deg(&map, 0) < 0.1 && scene.worst_deg(&map, 1) < 0.1);
    let again = with(3);
    for (a, b) in map.scans.iter().zip(&again.scans) {
        assert_eq!((a.map_from_scan, a.covariance), (b.map_from_scan, b.covariance));
    }
}

#[test]
fn a_sequence_tries_neighbours_and_closes_the_loop() {
    let scene = Scene::new(&[(1, 14)], 14, 2);
    let options = AlignOptions { sequence: true, ..AlignOptions::default() };
    let map = run(&scene, &Oracle::new(&scene), &options);
    assert_eq!(map.choice.rounds[0], (PairReason::Sequence, 13));
    assert!(map.edges.iter().any(|e| e.reason == PairReason::Loop && e.source.abs_diff(e.target) == 13));
    assert!(map.choice.tried < 60 && scene.worst_deg(&map, 0) < 0.1, "{:?}", map.choice);
}

#[test]
fn guesses_choose_the_pairs_and_place_the_map() {
    let scene = Scene::new(&[(1, 14)], 14, 2);
    let map_from_object = anywhere([0.4, -0.2, 1.0], [100.0, 50.0, -3.0]);
    let initial: Vec<Option<Rigid>> =
        scene.object_from_scan.iter().map(|pose| Some(map_from_object.compose(pose))).collect();
    let options = AlignOptions { initial: initial.clone(), ..AlignOptions::default() };
    let map = run(&scene, &Oracle::new(&scene), &options);
    assert_eq!(map.choice.rounds[0].0, PairReason::Guess);
    assert_eq!(map.components.len(), 1);
    for (scan, guess) in map.scans.iter().zip(&initial) {
        let off = guess.unwrap().inverse().compose(&scan.map_from_scan);
        assert!(off.angle_to_deg(&Rigid::identity()) < 0.1 && off.translation.norm() < 0.05, "{off:?}");
    }
    let error = |initial: Vec<Option<Rigid>>| {
        let options = AlignOptions { initial, ..AlignOptions::default() };
        align(&scene.scans[..], &Oracle::new(&scene), &options, &NoStore, &|_| {}).unwrap_err()
    };
    assert!(matches!(error(initial[..3].to_vec()), AlignError::Guesses { guesses: 3, scans: 14 }));
    let mut bad = initial;
    bad[4] = Some(Rigid { translation: nalgebra::Vector3::repeat(f64::NAN), ..Rigid::identity() });
    assert!(matches!(error(bad), AlignError::Guess(4)));
}

/// Keeps pairs in memory.
#[derive(Default)]
struct Kept(Mutex<BTreeMap<(usize, usize), PairAnswer>>);

impl PairStore for Kept {
    fn find(&self, source: usize, target: usize) -> Option<PairAnswer> {
        self.0.lock().unwrap().get(&(source, target)).cloned()
    }

    fn keep(&self, source: usize, target: usize, answer: &PairAnswer) {
        assert!(self.0.lock().unwrap().insert((source, target), answer.clone()).is_none(), "asked twice");
    }
}

#[test]
fn kept_pairs_are_not_asked_again_and_an_added_scan_is_registered_alone() {
    let scene = Scene::new(&[(1, 8)], 8, 3);
    let kept = Kept::default();
    let oracle = Oracle::new(&scene);
    let first = align(&scene.scans[..7], &oracle, &AlignOptions::default(), &kept, &|_| {}).unwrap();
    let asked = oracle.asked.load(Ordering::Relaxed);
    assert_eq!((first.components.len(), asked), (1, 21));
    let options = AlignOptions { settled: 7, ..AlignOptions::default() };
    let all = align(&scene.scans[..], &oracle, &options, &kept, &|_| {}).unwrap();
    assert_eq!((all.components.len(), oracle.asked.load(Ordering::Relaxed)), (1, asked + 7));
    assert!(scene.worst_deg(&all, 0) < 0.1);
    let again = align(&scene.scans[..], &oracle, &options, &kept, &|_| {}).unwrap();
    assert_eq!(oracle.asked.load(Ordering::Relaxed), asked + 7);
    assert_eq!(again.scans[7].map_from_scan, all.scans[7].map_from_scan);
}

#[test]
fn identical_scans_lie_on_each_other() {
    let mut scene = Scene::new(&[(1, 3)], 8, 3);
    let again = scene.scans[1].clone();
    // The oracle tells scans by their first point: the copy has its points in another order.
    let mut points = again.into_points();
    points.rotate_left(1);
    scene.scans.push(PointCloud::new(points).unwrap());
    scene.object_from_scan.push(scene.object_from_scan[1]);
    scene.places.push(scene.places[1]);
    let map = run(&scene, &Oracle::new(&scene), &AlignOptions::default());
    assert_eq!(map.components.len(), 1);
    let (a, b) = (map.scans[1].map_from_scan, map.scans[3].map_from_scan);
    assert!(a.angle_to_deg(&b) < 0.05, "{}", a.angle_to_deg(&b));
}

#[test]
fn too_few_scans_and_progress() {
    let scene = Scene::new(&[(1, 2)], 8, 3);
    let error = align(&scene.scans[..1], &Oracle::new(&scene), &AlignOptions::default(), &NoStore, &|_| {});
    assert!(matches!(error, Err(AlignError::TooFew(1))));
    let seen: Mutex<Vec<AlignProgress>> = Mutex::default();
    let map = align(&scene.scans[..], &Oracle::new(&scene), &AlignOptions::default(), &NoStore, &|p| {
        seen.lock().unwrap().push(p);
    })
    .unwrap();
    assert_eq!(map.components, [vec![0, 1]]);
    let stages: Vec<String> =
        seen.lock().unwrap().iter().map(|p| format!("{} {}/{}", p.stage, p.done, p.total)).collect();
    assert!(stages.contains(&"registering pairs 1/1".to_owned()), "{stages:?}");
    assert_eq!(stages.last().unwrap(), "joint refinement 1/1");
}
