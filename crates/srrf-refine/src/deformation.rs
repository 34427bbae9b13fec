//! Whether the residuals of a pose look like noise or like deformation.

use nalgebra::Vector3;
use serde::Serialize;
use srrf_cloud::{KnnIndex, Rigid};

use crate::matching::{Side, side_matches};
use crate::prepared::CloudLevel;

/// Neighbours of the same cloud whose residuals a residual is compared with.
const NEIGHBOURS: usize = 6;
/// Neighbours of the other cloud.
const ACROSS: usize = 16;
/// Neighbours of the other cloud farther away than this, in point spacings, are no neighbours: that cloud has a hole there.
const REACH: f64 = 8.0;
/// Fewer neighbours of the other cloud than this say nothing.
const FEWEST: usize = 3;
/// Matches farther apart than this, in point spacings, are no matches and left out.
const CAP: f64 = 2.0;

/// How the residuals of a pose hang together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ResidualStructure {
    /// Correlation of a residual vector with the mean of those of its neighbours, over both clouds.
    /// Noise gives about 0, and so do points that are simply missing; a bend or a shear moves
    /// neighbours alike, and gives more. In [-1, 1].
    pub correlation: f64,
    /// The same of the residuals along the normals.
    pub normal_correlation: f64,
    /// Correlation along the normals of what a point of one cloud is away from its match with what its 16 neighbours in the
    /// *other* cloud are away from theirs. A bend moves both alike. What two samplings of a curved surface have in common, that
    /// matches lie towards the centre of curvature, has the opposite sign seen from the other cloud, and a part that one cloud
    /// lacks is seen by the other alone: neither looks like a bend.
    pub across_correlation: f64,
    /// Median distance of the matches, in point spacings: near 0 where most points are in both clouds.
    pub median: f64,
}

/// The matches of one cloud, in the order of its points.
struct OneSide<'a> {
    index: &'a KnnIndex,
    /// Index of each point's match in the other cloud.
    partner: Vec<usize>,
    /// Target less source, where that is a match.
    residual: Vec<Option<Vector3<f64>>>,
    /// The same along the normal.
    along: Vec<Option<Vector3<f64>>>,
}

/// Measures the structure at `pose`.
pub(crate) fn residual_structure(
    source: &CloudLevel,
    target: &CloudLevel,
    pose: &Rigid,
) -> ResidualStructure {
    let spacing = source.spacing.max(target.spacing);
    let cap = CAP * spacing;
    let mut squares = Vec::new();
    let sides = [(Side::Source, &source.index), (Side::Target, &target.index)].map(|(side, index)| {
        let (partner, matches): (Vec<_>, Vec<_>) =
            side_matches(source, target, pose, side).into_iter().unzip();
        squares.extend(matches.iter().map(|m| (m.fixed - m.moved).norm_squared()));
        let residual: Vec<Option<Vector3<f64>>> = matches
            .iter()
            .map(|m| Some(m.fixed - m.moved).filter(|r| r.norm_squared() < cap * cap))
            .collect();
        let along =
            residual.iter().zip(&matches).map(|(r, m)| r.map(|r| m.normal * m.normal.dot(&r))).collect();
        OneSide { index, partner, residual, along }
    });
    let (mut full, mut normal, mut across) =
        (CorrelationSums::default(), CorrelationSums::default(), CorrelationSums::default());
    for side in &sides {
        full.add(side.index, &side.residual);
        normal.add(side.index, &side.along);
    }
    let [of_source, of_target] = &sides;
    across.add_across(of_source, of_target, |x| pose.apply(x), REACH * spacing);
    let inverse = pose.inverse();
    across.add_across(of_target, of_source, |y| inverse.apply(y), REACH * spacing);
    let middle = squares.len() / 2;
    ResidualStructure {
        correlation: full.correlation(),
        normal_correlation: normal.correlation(),
        across_correlation: across.correlation(),
        median: squares.select_nth_unstable_by(middle, f64::total_cmp).1.sqrt() / spacing,
    }
}

#[derive(Default)]
struct CorrelationSums {
    shared: f64,
    own: f64,
}

impl CorrelationSums {
    /// Residuals beside those of their neighbours in the same cloud.
    fn add(&mut self, index: &KnnIndex, residuals: &[Option<Vector3<f64>>]) {
        for (i, residual) in residuals.iter().enumerate() {
            let Some(r) = residual else { continue };
            // Points that coincide share their residual: they would look like deformation.
            let others = index
                .k_nearest(&index.points()[i], NEIGHBOURS + 1)
                .into_iter()
                .filter(|(_, squared)| *squared > 0.0)
                .filter_map(|(j, _)| residuals[j]);
            self.add_one(r, others, 1);
        }
    }

    /// Residuals of one side beside those of their neighbours on the other one, whose coordinates `place` gives.
    fn add_across(
        &mut self,
        of: &OneSide,
        among: &OneSide,
        place: impl Fn(&[f64; 3]) -> [f64; 3],
        reach: f64,
    ) {
        for (i, residual) in of.along.iter().enumerate() {
            let Some(r) = residual else { continue };
            // A pair of points, seen from both sides, would agree with itself.
            let others = among
                .index
                .k_nearest(&place(&of.index.points()[i]), ACROSS)
                .into_iter()
                .filter(|(j, squared)| {
                    *squared < reach * reach && of.partner[i] != *j && among.partner[*j] != i
                })
                .filter_map(|(j, _)| among.along[j]);
            self.add_one(r, others, FEWEST);
        }
    }

    fn add_one(&mut self, r: &Vector3<f64>, others: impl Iterator<Item = Vector3<f64>>, fewest: usize) {
        let (mut sum, mut count) = (Vector3::zeros(), 0);
        for other in others {
            sum += other;
            count += 1;
        }
        if count >= fewest {
            self.shared += r.dot(&sum) / count as f64;
            self.own += r.norm_squared();
        }
    }

    fn correlation(&self) -> f64 {
        if self.own > 0.0 { self.shared / self.own } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};
    use srrf_cloud::PointCloud;

    use super::*;
    use crate::prepared::RefineCloud;

    /// Points where `at` puts pairs of numbers in [0, 1), `n` of them, of one sampling.
    fn sampled(seed: u64, n: usize, at: impl Fn(f64, f64) -> [f64; 3]) -> Vec<[f64; 3]> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..n).map(|_| at(rng.random(), rng.random())).collect()
    }

    /// The structure at the identity, of clouds that stay where they are.
    fn structure(source: Vec<[f64; 3]>, target: Vec<[f64; 3]>) -> ResidualStructure {
        let prepared = |points| RefineCloud::of(&PointCloud::new(points).unwrap());
        let (source, target) = (prepared(source), prepared(target));
        let pose = source.frame_to(&target).pose(&Rigid::identity());
        residual_structure(source.coarse(), target.coarse(), &pose)
    }

    #[test]
    fn a_bend_is_seen_from_both_clouds() {
        let flat = sampled(1, 900, |u, v| [u, v, 0.0]);
        let wave = |height: f64| sampled(2, 900, move |u, v| [u, v, height * (6.0 * u).sin()]);
        let bent = structure(flat.clone(), wave(0.03));
        assert!(bent.across_correlation > 0.4 && bent.correlation > 0.15, "{bent:?}");
        let straight = structure(flat, wave(0.0));
        assert!(straight.across_correlation.abs() < 0.03, "{straight:?}");
    }

    #[test]
    fn curvature_looks_like_a_bend_from_one_cloud_alone() {
        // A tube that is three spacings thick.
        let tube = |seed| {
            sampled(seed, 700, |u, v| {
                [0.1 * (std::f64::consts::TAU * v).cos(), 0.1 * (std::f64::consts::TAU * v).sin(), 2.0 * u]
            })
        };
        let found = structure(tube(3), tube(4));
        assert!(found.normal_correlation > 0.05 && found.across_correlation < 0.0, "{found:?}");
    }

    #[test]
    fn what_one_cloud_lacks_does_not_look_like_a_bend() {
        let ball = |seed| {
            sampled(seed, 1000, |u, v| {
                let (z, turn) = (2.0 * u - 1.0, std::f64::consts::TAU * v);
                let r = (1.0 - z * z).sqrt();
                [r * turn.cos(), 0.7 * r * turn.sin(), 0.5 * z]
            })
        };
        let part: Vec<[f64; 3]> = ball(6).into_iter().filter(|p| p[0] < 0.2).collect();
        let found = structure(ball(5), part);
        assert!(found.across_correlation < 0.05, "{found:?}");
    }
}
