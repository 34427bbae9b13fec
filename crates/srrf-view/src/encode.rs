//! A [`Pair`] as the data that the page's script reads.
//!
//! The script works in the target's axes with the origin at the centre of the target's bounding
//! box, and each cloud comes relative to the centre of its own box, so that survey coordinates lose
//! nothing on their way to the graphics card's single precision.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use nalgebra::Vector3;
use srrf_cloud::{PairFrame, PointCloud, Rigid, Skeleton, SoftMatch};

use crate::describe::describe;
use crate::encoded::{EncodedCloud, EncodedMatch, EncodedPair, EncodedPose, EncodedSkeleton};
use crate::quantise::{quantise_bytes, quantise_points, quantise_values};
use crate::residual::{Distances, Residuals};
use crate::sample::even_indices;
use crate::{MATCHES_PER_PAIR, PAGE_BYTES, POINTS_PER_CLOUD, Pair, PointValues, Pose, Up};

/// Encodes one of the `pairs` pairs of a page.
pub(crate) fn encode(pair: &Pair<'_>, pairs: usize) -> EncodedPair {
    let mut warnings = pair.warnings.clone();
    let clouds = [("source", pair.source), ("target", pair.target)];
    let values = [0, 1].map(|i| fitting(clouds[i], pair.values[i], &mut warnings));
    let (source_budget, target_budget) = budgets(pairs, pair.poses.len() + 1);
    let (source, drawn) = encode_cloud(pair.source, values[0], source_budget);
    let (target, _) = encode_cloud(pair.target, values[1], target_budget);
    let distances = Distances::new(pair.target).ok();
    let source_centre = source.points.centre;
    let frame = PairFrame::about(source_centre.into(), target.points.centre.into());

    let mut before = pair.before.clone();
    if !is_finite(&before.target_from_source) {
        warnings.push(format!("The pose “{}” is not finite; the clouds are shown as given.", before.name));
        before = Pose::new("as given", Rigid::identity());
    }
    let encode_pose = |pose: &Pose| {
        let residuals = distances.as_ref().map(|d| Residuals::new(d, &drawn, &pose.target_from_source));
        let centre = |p: &Pose| Vector3::from(p.target_from_source.apply(&source_centre));
        EncodedPose {
            name: pose.name.clone(),
            matrix: rows_of_4(&frame.pose(&pose.target_from_source)),
            turn_deg: pose.target_from_source.angle_to_deg(&before.target_from_source),
            shift: (centre(pose) - centre(&before)).norm(),
            residual: residuals.as_ref().map(|r| quantise_values(&r.values)),
            summary: residuals.as_ref().map(|r| r.summary),
            numbers: pose.numbers.clone(),
        }
    };
    let mut poses = Vec::new();
    for pose in &pair.poses {
        if is_finite(&pose.target_from_source) {
            poses.push(encode_pose(pose));
        } else {
            warnings.push(format!("The pose “{}” is not finite and cannot be shown.", pose.name));
        }
    }
    let skeletons = pair.skeletons.as_ref().map(|[s, t]| {
        [
            encode_skeleton("source", s, |p| frame.source(p), &mut warnings),
            encode_skeleton("target", t, |p| frame.target(p), &mut warnings),
        ]
    });
    let mut encoded = EncodedPair {
        name: pair.name.clone(),
        unit: pair.unit.clone(),
        up: pair.up.unwrap_or_else(|| Up::guess(pair.target)).name(),
        before: encode_pose(&before),
        poses,
        skeletons,
        matches: encode_matches(&pair.matches, &frame),
        match_count: pair.matches.len(),
        distance_limit: distances.as_ref().and_then(Distances::limit),
        numbers: pair.numbers.clone(),
        warnings,
        description: String::new(),
        source,
        target,
    };
    encoded.description = describe(&encoded);
    encoded
}

/// Most points of the source and of the target in a page with so many pairs and poses a pair.
///
/// Half of a pair's share of [`PAGE_BYTES`] goes to each cloud: 6 bytes a point, and in the source
/// 2 more for each pose's distance. Colours and intensities are on top of it, 4 bytes a point at most.
fn budgets(pairs: usize, poses: usize) -> (usize, usize) {
    let half = PAGE_BYTES / pairs.max(1) / 2;
    ((half / (6 + 2 * poses)).min(POINTS_PER_CLOUD), (half / 6).min(POINTS_PER_CLOUD))
}

fn encode_cloud(cloud: &PointCloud, values: PointValues<'_>, budget: usize) -> (EncodedCloud, Vec<[f64; 3]>) {
    let indices = even_indices(cloud.len(), budget);
    let drawn: Vec<[f64; 3]> = indices.iter().map(|&i| cloud.points()[i]).collect();
    let points = quantise_points(drawn.iter().copied());
    let colours = values.colours.map(|all| {
        let bytes: Vec<u8> = indices.iter().flat_map(|&i| all[i]).collect();
        STANDARD.encode(bytes)
    });
    let intensities = values.intensities.map(|all| {
        let some: Vec<f64> = indices.iter().map(|&i| all[i]).collect();
        STANDARD.encode(quantise_bytes(&some))
    });
    (EncodedCloud { count: cloud.len(), shown: drawn.len(), points, colours, intensities }, drawn)
}

/// The values of a cloud that are one for each point.
fn fitting<'a>(
    (which, cloud): (&str, &PointCloud),
    values: PointValues<'a>,
    warnings: &mut Vec<String>,
) -> PointValues<'a> {
    let mut fits = |name: &str, have: usize| {
        let fits = have == cloud.len();
        if !fits {
            let points = cloud.len();
            warnings.push(format!("The {which} has {have} {name} for {points} points; they are left out."));
        }
        fits
    };
    let colours = values.colours.filter(|all| fits("colours", all.len()));
    let intensities = values.intensities.filter(|all| fits("intensities", all.len()));
    PointValues { colours, intensities }
}

/// The pose as 3 rows of 4.
fn rows_of_4(pose: &Rigid) -> [f64; 12] {
    std::array::from_fn(|i| match i % 4 {
        3 => pose.translation[i / 4],
        column => pose.rotation[(i / 4, column)],
    })
}

fn encode_skeleton(
    which: &str,
    skeleton: &Skeleton,
    local: impl Fn(&[f64; 3]) -> [f64; 3],
    warnings: &mut Vec<String>,
) -> EncodedSkeleton {
    let (points, radii) = (&skeleton.points, &skeleton.radii);
    let usable = points.iter().flatten().chain(radii).all(|v| v.is_finite());
    if !usable || (!radii.is_empty() && radii.len() != points.len()) {
        warnings.push(format!(
            "The skeleton of the {which} has numbers that are not finite, or radii for only some of its \
             points; it is left out."
        ));
        return EncodedSkeleton { points: Vec::new(), radii: Vec::new() };
    }
    EncodedSkeleton {
        points: points.iter().map(|p| single(local(p))).collect(),
        radii: radii.iter().map(|&r| r as f32).collect(),
    }
}

/// The strongest finite matches, strongest first; of equals those that came first.
fn encode_matches(matches: &[SoftMatch], frame: &PairFrame) -> Vec<EncodedMatch> {
    let finite =
        |m: &&SoftMatch| m.source.iter().chain(&m.target).chain([&m.weight]).all(|value| value.is_finite());
    let mut strongest: Vec<&SoftMatch> = matches.iter().filter(finite).collect();
    strongest.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    strongest.truncate(MATCHES_PER_PAIR);
    let encoded = strongest.into_iter().map(|m| EncodedMatch {
        source: single(frame.source(&m.source)),
        target: single(frame.target(&m.target)),
        weight: m.weight as f32,
    });
    encoded.collect()
}

fn single(point: [f64; 3]) -> [f32; 3] {
    point.map(|v| v as f32)
}

fn is_finite(pose: &Rigid) -> bool {
    pose.rotation.iter().chain(pose.translation.iter()).all(|v| v.is_finite())
}

#[cfg(test)]
mod tests;
