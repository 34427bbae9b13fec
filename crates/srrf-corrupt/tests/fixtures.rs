//! Agreement with the numpy implementation in `fixtures/corruption_fixtures.py`, which shares no
//! code with this crate and wrote `tests/fixtures`.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

use rand::{SeedableRng, rngs::ChaCha8Rng};
use serde::{Deserialize, de::DeserializeOwned};
use srrf_cloud::Rigid;
use srrf_corrupt::corruptions::{
    clusters::split_nearest, distortion, gaussian::clip, rbf::Kernel, shear::Coefficients,
};
use srrf_corrupt::{Corrupted, Severity, Variants, box_normalize, corruption, dcp_test_pose};

fn load<T: DeserializeOwned>(text: &str) -> T {
    serde_json::from_str(text).unwrap()
}

/// Uniform in [0, 1) from splitmix64, as in the script.
fn hashed(stream: u64, n: u64) -> f64 {
    let mut z = ((stream << 32) + n + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

fn hashed_table<const ROWS: usize>(stream: u64, half_width: f64) -> [[f64; 3]; ROWS] {
    std::array::from_fn(|row| {
        std::array::from_fn(|c| (2.0 * hashed(stream, (3 * row + c) as u64) - 1.0) * half_width)
    })
}

/// The script's cloud: the surface of a box with half sides 0.8, 0.45, 0.3.
fn box_surface(count: u64) -> Vec<[f64; 3]> {
    let half = [0.8, 0.45, 0.3];
    let area = [half[1] * half[2], half[0] * half[2], half[0] * half[1]];
    let total = area[0] + area[1] + area[2];
    let edges = [area[0] / total, (area[0] + area[1]) / total];
    (0..count)
        .map(|i| {
            let u = hashed(7, 4 * i);
            let face = edges.iter().filter(|edge| u >= **edge).count();
            let mut p: [f64; 3] =
                std::array::from_fn(|c| (2.0 * hashed(7, 4 * i + 1 + c as u64) - 1.0) * half[c]);
            p[face] = if p[face] >= 0.0 { half[face] } else { -half[face] };
            p
        })
        .collect()
}

fn largest_difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.as_flattened().iter().zip(b.as_flattened()).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

#[derive(Deserialize)]
struct Deformations {
    points: Vec<[f64; 3]>,
    shear: ShearCase,
    distortion: Vec<[f64; 3]>,
    distortion_rbf: Vec<[f64; 3]>,
    distortion_rbf_inv: Vec<[f64; 3]>,
    clip: Vec<[f64; 3]>,
    box_normalize: Vec<[f64; 3]>,
    nearest: Vec<NearestCase>,
}

#[derive(Deserialize)]
struct ShearCase {
    b: f64,
    d: f64,
    e: f64,
    f: f64,
    out: Vec<[f64; 3]>,
}

#[derive(Deserialize)]
struct NearestCase {
    centre: usize,
    size: usize,
    members: Vec<u32>,
}

#[test]
fn deterministic_cores_agree_within_rounding() {
    let expected: Deformations = load(include_str!("fixtures/deformations.json"));
    let points = &expected.points;
    // serde_json reads decimals to the last place but one.
    assert!(largest_difference(&points[..12], &hashed_table::<12>(1, 1.0)) < 3e-16, "the hash differs");

    // Sums of a few terms of size 1: some units in the last place.
    let ShearCase { b, d, e, f, out } = &expected.shear;
    let shear = Coefficients { x_from_y: *d, x_from_z: *f, z_from_x: *b, z_from_y: *e };
    let sheared: Vec<_> = points.iter().map(|p| shear.apply(p)).collect();
    assert!(largest_difference(&sheared, out) < 1e-15);

    // Sums of 125 terms of size 1 at most.
    let mu = hashed_table(3, 0.5);
    let bent = distortion::deform(points, &mu);
    assert!(largest_difference(&bent, &expected.distortion) < 1e-14);

    // The systems have condition numbers 3e4 and 8e2, and the two sides solve different ones.
    let shifts = hashed_table(4, 0.1);
    let warped = Kernel::Multiquadric.deform(points, &shifts).unwrap();
    assert!(largest_difference(&warped, &expected.distortion_rbf) < 1e-11);
    let warped = Kernel::InverseMultiquadric.deform(points, &shifts).unwrap();
    assert!(largest_difference(&warped, &expected.distortion_rbf_inv) < 1e-12);

    let mut clipped: Vec<_> = points.iter().map(|p| p.map(|c| 1.5 * c)).collect();
    clip(&mut clipped);
    assert!(largest_difference(&clipped, &expected.clip) < 1e-15);

    let mut boxed = points.clone();
    box_normalize(&mut boxed);
    assert!(largest_difference(&boxed, &expected.box_normalize) < 1e-15);

    let cloud = box_surface(257);
    let pool: Vec<u32> = (0..257).collect();
    for case in &expected.nearest {
        let (near, far) = split_nearest(&cloud, &pool, &cloud[case.centre], case.size);
        assert_eq!(near, case.members);
        assert_eq!(near.len() + far.len(), 257);
    }
}

#[derive(Deserialize)]
struct DcpPose {
    item: u32,
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

#[test]
fn dcp_poses_are_numpys() {
    for pose in load::<Vec<DcpPose>>(include_str!("fixtures/dcp_poses.json")) {
        let Rigid { rotation, translation } = dcp_test_pose(pose.item);
        for r in 0..3 {
            // The draws are equal to the bit; sines and cosines may differ in the last place.
            assert!((translation[r] - pose.translation[r]).abs() < 1e-15);
            assert!((0..3).all(|c| (rotation[(r, c)] - pose.rotation[r][c]).abs() < 1e-15));
        }
    }
}

#[derive(Deserialize)]
struct Statistics {
    draws: usize,
    rows: Vec<Row>,
}

#[derive(Deserialize)]
struct Row {
    corruption: String,
    severity: u8,
    points: usize,
    mean: [f64; 4],
    deviation: [f64; 4],
}

/// Rms movement of the points that are left, movement of the centroid, and mean and deviation
/// over every eighth point of the distance to the eighth nearest other.
fn measures(base: &[[f64; 3]], out: &Corrupted) -> [f64; 4] {
    let squared = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>();
    let moves: Vec<f64> = out
        .points
        .iter()
        .zip(&out.origin)
        .filter_map(|(p, o)| Some(squared(p, &base[(*o)? as usize])))
        .collect();
    let mean = |points: &[[f64; 3]]| -> [f64; 3] {
        std::array::from_fn(|c| points.iter().map(|p| p[c]).sum::<f64>() / points.len() as f64)
    };
    let mut distances = Vec::new();
    let spacings: Vec<f64> = out
        .points
        .iter()
        .step_by(8)
        .map(|p| {
            distances.clear();
            distances.extend(out.points.iter().map(|q| squared(p, q)));
            distances.select_nth_unstable_by(8, f64::total_cmp).1.sqrt()
        })
        .collect();
    let n = spacings.len() as f64;
    let spacing = spacings.iter().sum::<f64>() / n;
    let deviation = (spacings.iter().map(|s| (s - spacing).powi(2)).sum::<f64>() / n).sqrt();
    let rms = (moves.iter().sum::<f64>() / moves.len() as f64).sqrt();
    [rms, squared(&mean(&out.points), &mean(base)).sqrt(), spacing, deviation]
}

#[test]
fn counts_agree_and_moments_agree_within_sampling_error() {
    const DRAWS: usize = 60;
    let expected: Statistics = load(include_str!("fixtures/statistics.json"));
    assert_eq!(expected.rows.len(), 75, "12 corruptions and 3 variants, 5 severities");
    for (number, row) in expected.rows.iter().enumerate() {
        let (name, variants) = match row.corruption.split_once('/') {
            Some((name, _)) => (name, Variants::modelnet40_c()),
            None => (row.corruption.as_str(), Variants::paper()),
        };
        let base = box_surface(if row.corruption == "density_inc/modelnet40_c" { 2048 } else { 1024 });
        let corruption = corruption(name.parse().unwrap(), &variants);
        let severity = Severity::try_from(row.severity).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(number as u64);
        let mut sums = [0.0; 4];
        for _ in 0..DRAWS {
            let out = corruption.apply(&base, severity, &mut rng).unwrap();
            assert_eq!(out.points.len(), row.points, "{} {}", row.corruption, row.severity);
            let found = measures(&base, &out);
            (0..4).for_each(|m| sums[m] += found[m] / DRAWS as f64);
        }
        for (m, found) in sums.into_iter().enumerate() {
            // The standard error of the difference of two means. 300 comparisons with a fixed
            // seed: beyond 4 of them a difference is not chance. 1e-6 is the rounding in the file.
            let error = row.deviation[m] * (1.0 / DRAWS as f64 + 1.0 / expected.draws as f64).sqrt();
            assert!(
                (found - row.mean[m]).abs() < 4.0 * error + 1e-6,
                "{} {} measure {m}: {found} against {} +- {error}",
                row.corruption,
                row.severity,
                row.mean[m]
            );
        }
    }
}
