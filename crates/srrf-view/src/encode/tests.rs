use srrf_cloud::EulerXyz;

use super::*;

fn pose() -> Rigid {
    Rigid {
        rotation: EulerXyz::from_deg([10.0, -20.0, 75.0]).to_matrix(),
        translation: Vector3::new(499_000.0, 5.3e6, -3.0),
    }
}

/// The source near its origin, the target in survey coordinates.
fn clouds(n: usize) -> (PointCloud, PointCloud) {
    let source: Vec<[f64; 3]> = (0..n)
        .map(|i| {
            let s = i as f64;
            [3.0 * s.sin() + 7.0, (1.7 * s).cos(), (0.3 * s * s).sin()]
        })
        .collect();
    let source = PointCloud::new(source).unwrap();
    let target = source.transformed(&pose());
    (source, target)
}

/// What the script computes.
fn apply(matrix: &[f64; 12], p: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|r| (0..3).map(|c| matrix[4 * r + c] * p[c]).sum::<f64>() + matrix[4 * r + 3])
}

#[test]
fn local_frames_keep_survey_coordinates_exact() {
    let (source, target) = clouds(211);
    let encoded = encode(&Pair::new("p", &source, &target).pose(Pose::new("result", pose())), 1);
    let matrix = &encoded.poses[0].matrix;
    assert!(matrix.iter().all(|v| v.abs() < 10.0), "{matrix:?}");
    for (p, q) in source.points().iter().zip(target.points()) {
        let local = |p: &[f64; 3], centre: &[f64; 3]| -> [f32; 3] {
            std::array::from_fn(|axis| (p[axis] - centre[axis]) as f32)
        };
        let moved = apply(matrix, &local(p, &encoded.source.points.centre).map(f64::from));
        let expected = local(q, &encoded.target.points.centre);
        assert!((0..3).all(|c| (moved[c] - f64::from(expected[c])).abs() < 2e-6));
    }
    let summary = encoded.poses[0].summary.unwrap();
    assert!(summary.p90 < 1e-6 && encoded.before.summary.unwrap().median > 1e6);
    assert!((encoded.poses[0].turn_deg - pose().angle_to_deg(&Rigid::identity())).abs() < 1e-9);
    assert_eq!(encoded.before.shift, 0.0);
}

#[test]
fn large_clouds_are_thinned_and_the_budget_is_shared() {
    assert_eq!(budgets(1, 4), (POINTS_PER_CLOUD, POINTS_PER_CLOUD));
    for (pairs, poses) in [(1, 1), (1, 40), (36, 7), (500, 3)] {
        let (source, target) = budgets(pairs, poses);
        assert!(pairs * (source * (6 + 2 * poses) + target * 6) <= PAGE_BYTES);
        assert!(source > 100 && target > 100);
    }
    let (source, target) = clouds(POINTS_PER_CLOUD + 13);
    let encoded = encode(&Pair::new("p", &source, &target), 1);
    assert_eq!((encoded.source.count, encoded.source.shown), (POINTS_PER_CLOUD + 13, POINTS_PER_CLOUD));
    assert!(encoded.description.contains("120,000 of 120,013"), "{}", encoded.description);
}

#[test]
fn what_cannot_be_drawn_becomes_a_warning() {
    let (source, target) = clouds(17);
    let mut broken = Rigid::identity();
    broken.translation.y = f64::NAN;
    let few_radii = Skeleton { points: vec![[1.0; 3], [2.0; 3]], radii: vec![0.1] };
    let nan = Skeleton { points: vec![[f64::NAN; 3]], radii: vec![] };
    let pair = Pair::new("p", &source, &target)
        .before(Pose::new("start", broken))
        .pose(Pose::new("lost", broken))
        .pose(Pose::new("found", pose()))
        .skeletons(few_radii, nan)
        .warning("own");
    let encoded = encode(&pair, 1);
    assert_eq!(encoded.poses.len(), 1);
    assert_eq!(encoded.before.matrix[0], 1.0);
    assert_eq!(encoded.warnings.len(), 5, "{:?}", encoded.warnings);
    assert!(encoded.warnings[2].contains("lost"));
    assert!(encoded.skeletons.unwrap().iter().all(|s| s.points.is_empty()));
}

#[test]
fn the_strongest_matches_are_kept_in_order() {
    let (source, target) = clouds(5);
    let one = |i: usize, weight| SoftMatch { source: source.points()[i], target: target.points()[i], weight };
    let mut matches: Vec<SoftMatch> = (0..MATCHES_PER_PAIR).map(|i| one(i % 5, 0.001 * i as f64)).collect();
    matches.push(one(2, 5.0));
    matches.push(one(3, f64::NAN));
    let encoded = encode(&Pair::new("p", &source, &target).matches(matches), 1);
    assert_eq!((encoded.matches.len(), encoded.match_count), (MATCHES_PER_PAIR, MATCHES_PER_PAIR + 2));
    assert_eq!(encoded.matches[0].weight, 5.0);
    assert!(encoded.matches.windows(2).all(|w| w[0].weight >= w[1].weight));
    assert!(encoded.matches.last().unwrap().weight > 0.0);
}

#[test]
fn says_in_words_what_the_picture_shows() {
    let cloud =
        PointCloud::new(vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]]).unwrap();
    let mut pose = Rigid::identity();
    pose.translation.x = 0.5;
    let pair = Pair::new("p", &cloud, &cloud).pose(Pose::new("icp", pose)).unit("mm");
    let text = encode(&pair, 1).description;
    assert!(text.contains("4 points, in orange"), "{text}");
    assert!(text.contains("(as given), half of the source's points lie within 0 mm"), "{text}");
    assert!(text.contains("“icp” turns the source by 0 degrees and moves its centre by 0.5 mm"), "{text}");
    assert!(text.ends_with("nine in ten within 0.5 mm."), "{text}");
}

#[test]
fn colours_and_intensities_go_with_their_points() {
    let (source, target) = clouds(5);
    let colours: Vec<[u8; 3]> = (0..5).map(|i| [i, 10 * i, 255 - i]).collect();
    let intensities = [0.0, 1.0, 2.0, 3.0, 4.0];
    let values = PointValues { colours: Some(&colours), intensities: Some(&intensities) };
    let short = PointValues { colours: Some(&colours[1..]), intensities: None };
    let encoded = encode(&Pair::new("p", &source, &target).values(values, short), 1);
    let bytes = |text: &Option<String>| STANDARD.decode(text.as_ref().unwrap()).unwrap();
    assert_eq!(bytes(&encoded.source.colours), colours.concat());
    assert_eq!(bytes(&encoded.source.intensities), [0, 64, 128, 191, 255]);
    assert_eq!(encoded.target.colours, None);
    assert_eq!(encoded.warnings, ["The target has 4 colours for 5 points; they are left out."]);
}

#[test]
fn up_is_as_given_or_guessed() {
    let (source, target) = clouds(300);
    let up = |pair: Pair<'_>| encode(&pair, 1).up;
    assert_eq!(up(Pair::new("p", &source, &target).up(Up::MinusY)), "-y");
    assert_eq!(up(Pair::new("p", &source, &target)), Up::guess(&target).name());
}
