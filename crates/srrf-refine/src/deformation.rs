//! Whether the residuals of a pose look like noise or like deformation.

use nalgebra::Vector3;
use serde::Serialize;
use srrf_cloud::{KnnIndex, Rigid};

use crate::matching::{Side, side_matches};
use crate::prepared::Level;

/// Neighbours whose residuals a residual is compared with.
const NEIGHBOURS: usize = 6;
/// The same, far enough that two samplings of one surface are no longer alike.
const WIDE: usize = 32;
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
    /// The same along the normals with 32 neighbours in place of 6. What two samplings of one surface have in common
    /// ends within a few points; a bend goes on.
    pub wide_correlation: f64,
    /// Median distance of the matches, in point spacings: near 0 where most points are in both clouds.
    pub median: f64,
}

/// Measures the structure at `pose`.
pub(crate) fn residual_structure(source: &Level, target: &Level, pose: &Rigid) -> ResidualStructure {
    let spacing = source.spacing.max(target.spacing);
    let cap = CAP * spacing;
    let (mut full, mut normal, mut wide) = (Sums::default(), Sums::default(), Sums::default());
    let mut squares = Vec::new();
    for (side, index) in [(Side::Source, &source.index), (Side::Target, &target.index)] {
        let matches = side_matches(source, target, pose, side);
        let vectors: Vec<Option<Vector3<f64>>> = matches
            .iter()
            .map(|m| Some(m.fixed - m.moved).filter(|r| r.norm_squared() < cap * cap))
            .collect();
        let along: Vec<Option<Vector3<f64>>> =
            vectors.iter().zip(&matches).map(|(r, m)| r.map(|r| m.normal * m.normal.dot(&r))).collect();
        squares.extend(matches.iter().map(|m| (m.fixed - m.moved).norm_squared()));
        full.add(index, &vectors, NEIGHBOURS);
        normal.add(index, &along, NEIGHBOURS);
        wide.add(index, &along, WIDE);
    }
    let middle = squares.len() / 2;
    ResidualStructure {
        correlation: full.correlation(),
        normal_correlation: normal.correlation(),
        wide_correlation: wide.correlation(),
        median: squares.select_nth_unstable_by(middle, f64::total_cmp).1.sqrt() / spacing,
    }
}

#[derive(Default)]
struct Sums {
    shared: f64,
    own: f64,
}

impl Sums {
    fn add(&mut self, index: &KnnIndex, residuals: &[Option<Vector3<f64>>], neighbours: usize) {
        for (i, residual) in residuals.iter().enumerate() {
            let Some(r) = residual else { continue };
            let (mut mean, mut count) = (Vector3::zeros(), 0.0);
            // Points that coincide share their residual: they would look like deformation.
            for (j, squared) in index.k_nearest(&index.points()[i], neighbours + 1) {
                if let (true, Some(other)) = (squared > 0.0, residuals[j]) {
                    mean += other;
                    count += 1.0;
                }
            }
            if count > 0.0 {
                self.shared += r.dot(&mean) / count;
                self.own += r.norm_squared();
            }
        }
    }

    fn correlation(&self) -> f64 {
        if self.own > 0.0 { self.shared / self.own } else { 0.0 }
    }
}
