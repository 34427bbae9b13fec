//! The floors that perfect correspondences leave under the deformations, against those measured
//! with another implementation on ModelNet40 test shapes.

#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr, reason = "helpers of tests")]

use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use srrf_cloud::{EulerXyz, PointCloud};
use srrf_corrupt::datasets::{ShapeSource, SourceError, Split, default_data_path, open};
use srrf_corrupt::{
    Corrupt, CorruptionKind, PairConfig, PairSynthesizer, PoseDraw, Severity, Stream, oracle_pose,
};

/// Surfaces of boxes with random sides, centred, radius 1: shapes as elongated as real ones.
struct Boxes;

impl ShapeSource for Boxes {
    fn len(&self) -> usize {
        usize::MAX
    }

    fn description(&self) -> String {
        "boxes".into()
    }

    fn id(&self, index: usize) -> String {
        format!("box_{index}")
    }

    fn class(&self, _: usize) -> &str {
        "box"
    }

    fn sample(&self, index: usize, count: usize, rng: &mut ChaCha8Rng) -> Result<PointCloud, SourceError> {
        let mut sides = ChaCha8Rng::seed_from_u64(index as u64);
        let half: [f64; 3] = std::array::from_fn(|_| sides.random_range(0.02..1.0));
        let area = [half[1] * half[2], half[0] * half[2], half[0] * half[1]];
        let points = (0..count)
            .map(|_| {
                let mut pick = rng.random::<f64>() * area.iter().sum::<f64>();
                let face = (0..2).find(|&c| {
                    pick -= area[c];
                    pick < 0.0
                });
                let mut p: [f64; 3] = std::array::from_fn(|c| half[c] * rng.random_range(-1.0..1.0));
                let face = face.unwrap_or(2);
                p[face] = half[face] * p[face].signum();
                p
            })
            .collect();
        Ok(PointCloud::new(points).unwrap().to_unit_sphere().0)
    }

    fn sample_two(
        &self,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), SourceError> {
        Ok((self.sample(index, count, rng)?, self.sample(index, count, rng)?))
    }
}

/// RMSE and MAE in degrees over all angles, and RMSE of the translation.
fn floor(
    shapes: &dyn ShapeSource,
    pairs: usize,
    kind: CorruptionKind,
    severity: u8,
    corrupt: Corrupt,
) -> [f64; 3] {
    let synthesizer = PairSynthesizer::new(PairConfig { corrupt, ..PairConfig::default() }).unwrap();
    let (mut squares, mut absolute, mut t_squares) = (0.0, 0.0, 0.0);
    for i in 0..pairs {
        let pair = synthesizer
            .pair(
                shapes,
                i * (shapes.len() / pairs).min(1000),
                Some((kind, Severity::try_from(severity).unwrap())),
                PoseDraw::DcpTest(i as u32),
                Stream { seed: 5, item: i as u64 },
            )
            .unwrap();
        let found = oracle_pose(&pair).unwrap();
        let angles = |r| EulerXyz::from_matrix(r).to_deg();
        let (a, b) = (angles(&found.rotation), angles(&pair.target_from_source.rotation));
        for c in 0..3 {
            squares += (a[c] - b[c]).powi(2);
            absolute += (a[c] - b[c]).abs();
        }
        t_squares += (found.translation - pair.target_from_source.translation).norm_squared();
    }
    let n = 3.0 * pairs as f64;
    [(squares / n).sqrt(), absolute / n, (t_squares / n).sqrt()]
}

/// Kind, severity, which cloud, then the measured RMSE and MAE in degrees and RMSE(t), 0 where
/// none was measured. From 300 ModelNet40 test shapes.
const MEASURED: [(CorruptionKind, u8, Corrupt, [f64; 3]); 12] = [
    (CorruptionKind::Shear, 1, Corrupt::Target, [2.3, 1.8, 0.0]),
    (CorruptionKind::Shear, 3, Corrupt::Target, [6.2, 5.5, 0.0]),
    (CorruptionKind::Shear, 1, Corrupt::Both, [3.2, 2.4, 0.0]),
    (CorruptionKind::Shear, 3, Corrupt::Both, [8.9, 6.6, 0.0]),
    (CorruptionKind::Shear, 5, Corrupt::Both, [14.8, 11.1, 0.0]),
    (CorruptionKind::Distortion, 3, Corrupt::Target, [2.8, 2.3, 0.040]),
    (CorruptionKind::Distortion, 1, Corrupt::Both, [1.3, 1.0, 0.018]),
    (CorruptionKind::Distortion, 5, Corrupt::Both, [6.6, 5.3, 0.094]),
    (CorruptionKind::DistortionRbf, 1, Corrupt::Target, [0.5, 0.4, 0.005]),
    (CorruptionKind::DistortionRbf, 5, Corrupt::Both, [4.1, 2.9, 0.035]),
    (CorruptionKind::DistortionRbfInv, 1, Corrupt::Both, [0.8, 0.6, 0.007]),
    (CorruptionKind::DistortionRbfInv, 5, Corrupt::Both, [4.1, 3.0, 0.033]),
];

/// `tolerance` and, for the radial basis functions, `tolerance_rbf` are relative.
fn compare(shapes: &dyn ShapeSource, tolerance: f64, tolerance_rbf: f64) {
    for (kind, severity, corrupt, measured) in MEASURED {
        let found = floor(shapes, 300, kind, severity, corrupt);
        let rbf = matches!(kind, CorruptionKind::DistortionRbf | CorruptionKind::DistortionRbfInv);
        let tolerance = if rbf { tolerance_rbf } else { tolerance };
        println!("{kind:18} {severity} {corrupt:?}: {found:.3?} measured {measured:?}");
        for (found, measured) in found.into_iter().zip(measured) {
            // Half a unit of the last printed digit on top.
            let rounding = if measured < 0.2 { 0.0005 } else { 0.05 };
            assert!(
                measured == 0.0 || (found - measured).abs() < tolerance * measured + rounding,
                "{kind} {severity} {corrupt:?}: {found:.3} against {measured}"
            );
        }
    }
}

/// Boxes are not ModelNet40: shear and the free-form lattice, which act on the whole cloud, come
/// out within 10 %, the more local radial basis functions 30 % lower. A factor of 2 would show.
#[test]
fn floors_on_boxes() {
    compare(&Boxes, 0.2, 0.4);
}

/// On the data themselves two samples of 300 shapes differ by some percent.
#[test]
fn floors_on_modelnet40() {
    let Some(path) = default_data_path() else {
        eprintln!("skipped: SRRF_DATA is not set");
        return;
    };
    compare(&*open(&path, Split::Test).unwrap(), 0.15, 0.2);
}

#[test]
fn surviving_points_are_exact_under_density_and_added_points() {
    let kinds = [
        CorruptionKind::DensityInc,
        CorruptionKind::DensityDec,
        CorruptionKind::Cutout,
        CorruptionKind::Background,
        CorruptionKind::Upsampling,
    ];
    for kind in kinds {
        let [rmse, _, rmse_t] = floor(&Boxes, 9, kind, 5, Corrupt::Both);
        assert!(rmse < 1e-9 && rmse_t < 1e-12, "{kind}: {rmse} {rmse_t}");
    }
    // Noise averages out over the points.
    for kind in [CorruptionKind::Gaussian, CorruptionKind::Uniform, CorruptionKind::Impulse] {
        let [rmse, _, _] = floor(&Boxes, 30, kind, 5, Corrupt::Both);
        assert!((1e-3..0.4).contains(&rmse), "{kind}: {rmse}");
    }
}
