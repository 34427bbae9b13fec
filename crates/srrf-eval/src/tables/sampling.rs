//! Table 4: what a method gets from few points, chosen in three ways.

use rand::seq::index;
use srrf_cloud::{PointCloud, Register, farthest_point_sampling};
use srrf_corrupt::{Pair, Purpose, Stream};

use crate::pairs::{EvalPair, Group, PairSource};
use crate::protocol::SynthesizedPairs;
use crate::{EvalError, PairFault};

/// How the points of the pairs of a group are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PointChoice {
    Original,
    Random,
    Farthest,
    Skeleton,
}

/// The ways to choose, and whether the target has the source's points, posed, instead of its own.
const GROUPS: [(&str, PointChoice, bool); 7] = [
    ("original", PointChoice::Original, false),
    ("random, corresponding", PointChoice::Random, true),
    ("random, independent", PointChoice::Random, false),
    ("farthest, corresponding", PointChoice::Farthest, true),
    ("farthest, independent", PointChoice::Farthest, false),
    ("skeleton, corresponding", PointChoice::Skeleton, true),
    ("skeleton, independent", PointChoice::Skeleton, false),
];

/// Clean pairs reduced to few points: those of the paper's table 4 in each reading. Corresponding
/// subsets are one subset of the source, posed; independent ones are chosen in each cloud by itself.
pub(crate) struct SampledPairs<'a> {
    /// Clean pairs, in group 0.
    pub clean: SynthesizedPairs,
    /// The method whose skeletons are taken.
    pub skeletons: &'a dyn Register,
    /// Points kept by the random and the farthest point choice.
    pub count: usize,
    /// Seed of the random choice.
    pub seed: u64,
    groups: Vec<Group>,
}

impl<'a> SampledPairs<'a> {
    /// Of the clean pairs in group 0 of `clean`.
    pub fn new(clean: SynthesizedPairs, skeletons: &'a dyn Register, count: usize, seed: u64) -> Self {
        let pairs = clean.groups()[0].pairs;
        let groups =
            GROUPS.map(|(name, _, _)| Group { corruption: name.into(), severity: 0, pairs }).to_vec();
        Self { clean, skeletons, count, seed, groups }
    }

    /// The chosen points of both clouds of a pair.
    fn chosen(&self, choice: PointChoice, item: usize, pair: &Pair) -> Result<[Vec<[f64; 3]>; 2], PairFault> {
        let clouds = [&pair.source, &pair.target];
        match choice {
            PointChoice::Original => Ok(clouds.map(|c| c.points().to_vec())),
            PointChoice::Random => {
                let stream = Stream { seed: self.seed, item: item as u64 };
                let mut rng = stream.rng(Purpose::Choice);
                Ok(clouds.map(|cloud| {
                    let chosen = index::sample(&mut rng, cloud.len(), self.count.min(cloud.len()));
                    chosen.iter().map(|i| cloud.points()[i]).collect()
                }))
            }
            PointChoice::Farthest => Ok(clouds.map(|cloud| {
                let chosen = farthest_point_sampling(cloud.points(), self.count, 0);
                chosen.into_iter().map(|i| cloud.points()[i]).collect()
            })),
            PointChoice::Skeleton => {
                let found = self.skeletons.register(&pair.source, &pair.target)?;
                let skeletons = found.skeletons.ok_or(PairFault::NoSkeletons)?;
                Ok([skeletons.source.points, skeletons.target.points])
            }
        }
    }
}

impl PairSource for SampledPairs<'_> {
    fn description(&self) -> String {
        format!("{}; {} points kept", self.clean.description(), self.count)
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn has_oracle(&self) -> bool {
        false
    }

    fn pair(&self, group: usize, item: usize) -> Result<EvalPair, EvalError> {
        let EvalPair { mut pair, clean } = self.clean.pair(0, item)?;
        let (name, choice, corresponding) = GROUPS[group];
        let failed =
            |source: PairFault| EvalError::Pair { group: name.to_owned(), item, source: Box::new(source) };
        let [source, mut target] = self.chosen(choice, item, &pair).map_err(failed)?;
        if corresponding {
            target = source.iter().map(|p| pair.target_from_source.apply(p)).collect();
        }
        pair.source = PointCloud::new(source).map_err(|e| failed(e.into()))?;
        pair.target = PointCloud::new(target).map_err(|e| failed(e.into()))?;
        (pair.source_origin, pair.target_origin) = (None, None);
        Ok(EvalPair { pair, clean })
    }
}

#[cfg(test)]
mod tests {
    use srrf_cloud::{RegisterError, Registration, Rigid, Skeleton, Skeletons, Solid};
    use srrf_corrupt::PairConfig;

    use super::*;
    use crate::data;
    use crate::protocol::Protocol;

    /// Its skeleton of a cloud is the cloud's first 5 points.
    struct FirstFive;

    impl Register for FirstFive {
        fn name(&self) -> &str {
            "first-five"
        }

        fn register_solid(
            &self,
            source: Solid<'_>,
            target: Solid<'_>,
        ) -> Result<Registration, RegisterError> {
            let five = |cloud: &PointCloud| cloud.points()[..5].to_vec();
            let skeletons = Some(Skeletons {
                source: Skeleton { points: five(&source), radii: Vec::new() },
                target: Skeleton { points: five(&target), radii: Vec::new() },
            });
            Ok(Registration { skeletons, ..Registration::from_pose(Rigid::identity()) })
        }
    }

    #[test]
    fn corresponding_subsets_match_exactly_and_independent_ones_do_not() {
        let protocol = Protocol {
            clean: true,
            corruptions: vec![],
            mixtures: vec![],
            severities: vec![],
            shapes: 2,
            seed: 3,
            pair: PairConfig { points: 67, ..PairConfig::default() },
            crop: None,
            dcp_poses: false,
            spread: false,
        };
        let clean = SynthesizedPairs::new(data::procedural(2).unwrap(), protocol).unwrap();
        let pairs = SampledPairs::new(clean, &FirstFive, 13, 3);
        for (group, (name, choice, corresponding)) in GROUPS.into_iter().enumerate() {
            let found = pairs.pair(group, 1).unwrap().pair;
            let expected = match choice {
                PointChoice::Original => 67,
                PointChoice::Random | PointChoice::Farthest => 13,
                PointChoice::Skeleton => 5,
            };
            assert_eq!((found.source.len(), found.target.len()), (expected, expected), "{name}");
            let moved = found.source.transformed(&found.target_from_source);
            let same = |a: &[f64; 3], b: &[f64; 3]| (0..3).all(|c| (a[c] - b[c]).abs() < 1e-12);
            let exact = moved.points().iter().zip(found.target.points()).all(|(a, b)| same(a, b));
            assert_eq!(exact, corresponding, "{name}");
            // The target's points are in the clean target all the same.
            let whole = pairs.clean.pair(0, 1).unwrap().pair.target;
            assert!(
                found.target.points().iter().all(|p| whole.points().iter().any(|q| same(p, q))),
                "{name}"
            );
        }
    }
}
