//! The pairs that the probability is fitted on, and others that it is measured on.

use std::fmt;

use nalgebra::{Matrix3, Rotation3};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde::{Deserialize, Serialize};
use srrf::{Method, RotationRange};
use srrf_calibrate::point_sets::PointSet;
use srrf_calibrate::{VALIDATION_SHAPES, keep};
use srrf_cloud::{PointCloud, Rigid};
use srrf_corrupt::crop::{crop, random_direction, visible};
use srrf_corrupt::datasets::{ShapeSource, held_out};
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::{CorruptionKind, PairConfig, PairSynthesizer, PoseDraw, Sampling, Severity, Stream};

/// Seeds of the pairs to fit and of those to measure.
pub const SEEDS: [u64; 2] = [77_001, 91_003];

/// What the reliability is measured on by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Group {
    /// The 12 corruptions, and clean pairs.
    Corrupted,
    /// Crops and views from one side.
    Partial,
    /// Built-in shapes, whose families ModelNet40 does not have, lightly corrupted, and pairs of meshes of a table.
    Meshes,
    /// Point sets that have nothing in common, and small ones that are copies.
    Few,
    /// Metres against millimetres.
    Scaled,
    /// Public scans.
    Scans,
}

impl fmt::Display for Group {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Corrupted => "corrupted objects",
            Self::Partial => "partial objects",
            Self::Meshes => "other meshes",
            Self::Few => "few and unrelated points",
            Self::Scaled => "scales apart",
            Self::Scans => "real scans",
        })
    }
}

/// How a pair is registered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Way {
    pub method: Method,
    pub rotation: RotationRange,
}

/// One pair.
pub struct Case {
    pub group: Group,
    pub kind: String,
    pub source: PointCloud,
    pub target: PointCloud,
    /// None where the two have nothing in common.
    pub truth: Option<Rigid>,
    pub initial: Option<Rigid>,
    pub way: Way,
}

/// Where shapes come from.
pub struct Shapes<'a> {
    pub built_in: &'a ProceduralShapes,
    pub modelnet: Option<&'a dyn ShapeSource>,
}

/// Pair `item` of those to fit (`part` 0) or to measure (1): other seeds, and other shapes.
pub fn case(item: u64, part: usize, shapes: &Shapes<'_>) -> Option<Case> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEEDS[part]);
    rng.set_stream(item);
    let rng = &mut rng;
    let group = match rng.random_range(0..20) {
        0..9 => Group::Corrupted,
        9..14 => Group::Partial,
        14..17 => Group::Meshes,
        17..19 => Group::Few,
        _ => Group::Scaled,
    };
    let (kind, source, target, truth) = match group {
        Group::Few => few(item, part, rng)?,
        _ => shape_pair(group, item, part, shapes, rng)?,
    };
    let any = rng.random_bool(0.6);
    let rotation = if any { RotationRange::Any } else { RotationRange::Within45 };
    let method = drawn_method(rng);
    let initial = (method == Method::Given).then(|| guess(truth.as_ref(), rng)).flatten();
    Some(Case { group, kind, source, target, truth, initial, way: Way { method, rotation } })
}

/// The default method three times in ten; the others are cheaper.
pub fn drawn_method(rng: &mut ChaCha8Rng) -> Method {
    match rng.random_range(0..10) {
        0..3 => Method::Auto,
        3..7 => Method::FpfhRansac,
        _ => Method::Given,
    }
}

/// A first guess that is good three times in five, and none or a poor one else.
pub fn guess(truth: Option<&Rigid>, rng: &mut ChaCha8Rng) -> Option<Rigid> {
    let truth = truth?;
    let degrees: f64 = match rng.random_range(0..5) {
        0..3 => rng.random_range(0.0..12.0),
        3 => rng.random_range(20.0..90.0),
        _ => return None,
    };
    let axis = random_direction(rng) * degrees.to_radians();
    let by = Rigid { rotation: Rotation3::from_scaled_axis(axis).into_inner(), ..Rigid::identity() };
    let off = truth.compose(&by);
    Some(Rigid { translation: off.translation + random_direction(rng) * 0.05, ..off })
}

type Pair = (String, PointCloud, PointCloud, Option<Rigid>);

fn shape_pair(
    group: Group,
    item: u64,
    part: usize,
    shapes: &Shapes<'_>,
    rng: &mut ChaCha8Rng,
) -> Option<Pair> {
    let kinds = CorruptionKind::ALL;
    // Shears twice as often.
    let pick = rng.random_range(0..kinds.len() + 2);
    let kind = if pick == kinds.len() + 1 { Some(CorruptionKind::Shear) } else { kinds.get(pick).copied() };
    let severity = Severity::ALL[rng.random_range(0..5)];
    let severity = if group == Group::Meshes { Severity::ALL[rng.random_range(0..2)] } else { severity };
    let sampling = if rng.random_bool(0.4) { Sampling::Independent } else { Sampling::Shared };
    let (source, points): (&dyn ShapeSource, usize) = match shapes.modelnet {
        Some(modelnet) if group != Group::Meshes && rng.random_bool(0.6) => {
            (modelnet, if sampling == Sampling::Shared { 1024 } else { 512 })
        }
        _ => (shapes.built_in, 1024),
    };
    // The shapes of the two parts are different ones.
    let half = |n: usize, rng: &mut ChaCha8Rng| 2 * rng.random_range(0..n / 2) + part;
    let shape = if source.len() > 1000 {
        held_out(source.len(), VALIDATION_SHAPES)[half(VALIDATION_SHAPES, rng)]
    } else {
        half(source.len(), rng)
    };
    let pose = if rng.random_bool(0.5) {
        let axis = random_direction(rng) * rng.random_range(0.0..std::f64::consts::PI);
        let rotation = Rotation3::from_scaled_axis(axis).into_inner();
        PoseDraw::Given(Rigid { rotation, translation: random_direction(rng) * 0.5 })
    } else {
        PoseDraw::Seeded
    };
    let config = PairConfig { points, sampling, keep_correspondence: false, ..PairConfig::default() };
    let synthesizer = PairSynthesizer::new(config).ok()?;
    let stream = Stream { seed: SEEDS[part], item };
    let pair = synthesizer.pair(source, shape, kind.map(|k| (k, severity)), pose, stream).ok()?;
    let (mut source, mut target, truth) = (pair.source, pair.target, pair.target_from_source);
    let mut name = kind.map_or("clean".to_owned(), |k| k.to_string());
    match group {
        Group::Partial if rng.random_bool(0.6) => {
            name = "cropped".to_owned();
            for cloud in [&mut source, &mut target] {
                let kept = crop(cloud.points(), &random_direction(rng), rng.random_range(0.5..1.0));
                keep(cloud, &kept).ok()?;
            }
        }
        Group::Partial => {
            // Two cameras some 40 degrees apart.
            name = "one view".to_owned();
            let camera = random_direction(rng);
            for (cloud, frame) in [(&mut source, Matrix3::identity()), (&mut target, truth.rotation)] {
                let from = frame * (camera + 0.5 * random_direction(rng)).normalize();
                let kept = visible(cloud.points(), &from, 0.1, 0.15);
                keep(cloud, &kept).ok()?;
            }
        }
        Group::Scaled => {
            let by = [1000.0, 100.0, 25.4, 3.28, 0.3048, 0.0254, 0.01, 0.001][rng.random_range(0..8)];
            source = PointCloud::new(source.points().iter().map(|p| p.map(|c| c * by)).collect()).ok()?;
            return Some((format!("{by}"), source, target, None));
        }
        _ => {}
    }
    Some((name, source, target, Some(truth)))
}

/// Sets that have nothing in common, or some points of one set, or copies.
fn few(item: u64, part: usize, rng: &mut ChaCha8Rng) -> Option<Pair> {
    let set = |rng: &mut ChaCha8Rng| PointSet::ALL[rng.random_range(0..PointSet::ALL.len())];
    let kind = set(rng);
    let other = if rng.random_bool(0.5) { kind } else { set(rng) };
    let n = 10f64.powf(rng.random_range(0.5..3.0)) as usize;
    let seed = SEEDS[part].wrapping_mul(1000) + 2 * item;
    let source = kind.sample(n, seed)?;
    let axis = random_direction(rng) * rng.random_range(0.0..std::f64::consts::PI);
    let truth = Rigid { rotation: Rotation3::from_scaled_axis(axis).into_inner(), ..Rigid::identity() };
    Some(match rng.random_range(0..4) {
        0 | 1 => (format!("unrelated {kind}"), source, other.sample(n, seed + 1)?, None),
        2 => (format!("few {kind}"), source, other.sample(1500, seed + 1)?, None),
        _ => {
            let mut points = source.transformed(&truth).into_points();
            points.reverse();
            ("copies".into(), source, PointCloud::new(points).ok()?, Some(truth))
        }
    })
}
