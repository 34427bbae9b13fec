//! [`Mixture`]: corruptions that are not even over the cloud, or that come together. The paper leaves
//! them to future work.

use std::fmt;

use rand::{RngExt, rngs::ChaCha8Rng};
use rand_distr::StandardNormal;

use crate::corruption::{CorruptError, Corrupted, Corruption, check_points};
use crate::corruptions::CorruptionKind;
use crate::kind::corruption;
use crate::severity::Severity;
use crate::variants::Variants;

/// Two corruptions at once, or one in a part of the cloud only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mixture {
    /// The second corrupts what the first left, both at the same severity.
    Both(CorruptionKind, CorruptionKind),
    /// The corruption reaches only the half of the points that lies farthest in a random direction,
    /// another one for each cloud. Within that half it is what it is over a whole cloud (counts are a
    /// share of the half's points); a deformation tears the shape along the edge of the half.
    Local(CorruptionKind),
}

impl Mixture {
    /// The corruption, in the readings that `variants` chooses.
    ///
    /// [`DensityInc::ModelNet40C`](crate::DensityInc::ModelNet40C) halves the points that it is given;
    /// pair synthesis gives it twice as many only where it stands alone.
    pub fn corruption(self, variants: &Variants) -> Box<dyn Corruption> {
        match self {
            Self::Both(first, second) => {
                Box::new(Both([corruption(first, variants), corruption(second, variants)]))
            }
            Self::Local(kind) => Box::new(HalfOf(corruption(kind, variants))),
        }
    }
}

impl fmt::Display for Mixture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Both(first, second) => write!(f, "{first} + {second}"),
            Self::Local(kind) => write!(f, "local {kind}"),
        }
    }
}

struct Both([Box<dyn Corruption>; 2]);

impl Corruption for Both {
    fn name(&self) -> &'static str {
        "both"
    }

    fn apply(
        &self,
        points: &[[f64; 3]],
        severity: Severity,
        rng: &mut ChaCha8Rng,
    ) -> Result<Corrupted, CorruptError> {
        let [first, second] = &self.0;
        let first = first.apply(points, severity, rng)?;
        let mut both = second.apply(&first.points, severity, rng)?;
        for origin in &mut both.origin {
            *origin = origin.and_then(|index| first.origin[index as usize]);
        }
        Ok(both)
    }
}

struct HalfOf(Box<dyn Corruption>);

impl Corruption for HalfOf {
    fn name(&self) -> &'static str {
        "local"
    }

    fn apply(
        &self,
        points: &[[f64; 3]],
        severity: Severity,
        rng: &mut ChaCha8Rng,
    ) -> Result<Corrupted, CorruptError> {
        check_points(points, self.name(), 2)?;
        let direction: [f64; 3] = std::array::from_fn(|_| rng.sample(StandardNormal));
        let height = |index: u32| -> f64 { (0..3).map(|c| points[index as usize][c] * direction[c]).sum() };
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        order.sort_by(|&a, &b| height(a).total_cmp(&height(b)).then(a.cmp(&b)));
        let (rest, half) = order.split_at(points.len() / 2);
        // In the order of the cloud, as the corruption would see them.
        let mut half = half.to_vec();
        half.sort_unstable();
        let inside: Vec<[f64; 3]> = half.iter().map(|&i| points[i as usize]).collect();
        let changed = self.0.apply(&inside, severity, rng)?;
        let mut cloud = Corrupted::subset(points, rest);
        cloud.points.extend(changed.points);
        cloud.origin.extend(changed.origin.into_iter().map(|origin| Some(half[origin? as usize])));
        Ok(cloud)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corruptions::testing::{cloud, rng};

    const STRONG: Severity = Severity::ALL[4];

    fn apply(mixture: Mixture, points: &[[f64; 3]]) -> Corrupted {
        mixture.corruption(&Variants::paper()).apply(points, STRONG, &mut rng(8)).unwrap()
    }

    #[test]
    fn two_at_once_keep_the_way_back_to_the_points() {
        let points = cloud(1024);
        let out = apply(Mixture::Both(CorruptionKind::Cutout, CorruptionKind::Background), &points);
        // 300 of 1,024 are cut out; 36 (one of 20) of clutter come on top.
        assert_eq!(out.points.len(), 724 + 36);
        assert_eq!(out.origin.iter().filter(|o| o.is_none()).count(), 36);
        let kept: Vec<(u32, [f64; 3])> =
            out.origin.iter().zip(&out.points).filter_map(|(o, p)| Some(((*o)?, *p))).collect();
        assert!(kept.iter().all(|(origin, p)| points[*origin as usize] == *p));
        let noisy = apply(Mixture::Both(CorruptionKind::Cutout, CorruptionKind::Uniform), &points);
        let far = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max);
        let moves: Vec<f64> = noisy
            .origin
            .iter()
            .zip(&noisy.points)
            .map(|(o, p)| far(p, &points[o.unwrap() as usize]))
            .collect();
        assert_eq!(moves.len(), 724);
        assert!(moves.iter().all(|m| *m > 0.0 && *m <= 0.05));
    }

    #[test]
    fn a_local_corruption_leaves_half_of_the_cloud_alone() {
        let points = cloud(1023);
        let out = apply(Mixture::Local(CorruptionKind::Uniform), &points);
        let same = |o: &Option<u32>, p: &[f64; 3]| points[o.unwrap() as usize] == *p;
        let untouched: Vec<bool> = out.origin.iter().zip(&out.points).map(|(o, p)| same(o, p)).collect();
        assert_eq!(untouched.iter().filter(|u| **u).count(), 511);
        let mut origins: Vec<u32> = out.origin.iter().map(|o| o.unwrap()).collect();
        origins.sort_unstable();
        assert_eq!(origins, (0..1023).collect::<Vec<u32>>());
        // A plane parts the two halves: their means are as far apart as halves of this cloud are.
        let mean = |touched: bool| -> [f64; 3] {
            let chosen: Vec<&[f64; 3]> =
                out.points.iter().zip(&untouched).filter(|(_, u)| **u != touched).map(|(p, _)| p).collect();
            std::array::from_fn(|c| chosen.iter().map(|p| p[c]).sum::<f64>() / chosen.len() as f64)
        };
        let (a, b) = (mean(true), mean(false));
        assert!((0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt() > 0.25);

        let cut = apply(Mixture::Local(CorruptionKind::Cutout), &points);
        // 10 clusters of 15 in a half of 512.
        assert_eq!(cut.points.len(), 1023 - 150);
    }

    #[test]
    fn names_say_what_is_done() {
        let both = Mixture::Both(CorruptionKind::Shear, CorruptionKind::Gaussian);
        assert_eq!(both.to_string(), "shear + gaussian");
        assert_eq!(Mixture::Local(CorruptionKind::Impulse).to_string(), "local impulse");
    }
}
