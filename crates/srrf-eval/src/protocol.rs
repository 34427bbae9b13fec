//! Pairs made from shapes: clean ones, and each corruption at each severity.

use serde::Serialize;
use srrf_cloud::{CloudError, PointCloud};
use srrf_corrupt::crop::{crop, random_direction};
use srrf_corrupt::datasets::ShapeSource;
use srrf_corrupt::{
    CorruptionKind, Mixture, Normalize, Pair, PairConfig, PairSynthesizer, PoseDraw, Purpose, RotationRange,
    Sampling, Severity, Stream,
};

use crate::EvalError;
use crate::pairs::{EvalPair, Group, PairSource};

/// Name of the group of pairs without corruption.
pub const CLEAN: &str = "clean";

/// The severity of the ablations.
pub(crate) const MIDDLE: Severity = Severity::ALL[2];

/// Which pairs are made.
#[derive(Debug, Clone, PartialEq)]
pub struct Protocol {
    /// Whether pairs without corruption are among them.
    pub clean: bool,
    /// Corruptions, in the order of the report.
    pub corruptions: Vec<CorruptionKind>,
    /// Mixtures of corruptions, after them.
    pub mixtures: Vec<Mixture>,
    /// Severities of each corruption and mixture.
    pub severities: Vec<Severity>,
    /// Number of shapes; all where the source has fewer.
    pub shapes: usize,
    /// Seed of the pairs.
    pub seed: u64,
    /// How a pair is made.
    pub pair: PairConfig,
    /// Share of each cloud that a crop keeps, in (0, 1], after the corruption: the points farthest along a random direction, another
    /// one for each cloud (RPMNet's partial pairs keep 0.7).
    pub crop: Option<f64>,
    /// Whether shape `i` has the pose of item `i` of DCP's test set instead of a seeded one.
    pub dcp_poses: bool,
    /// Whether each shape is shown at one severity only, the severities in turn, so that as many shapes
    /// cost a fraction of the time.
    pub spread: bool,
}

impl Default for Protocol {
    /// What the program scores without options: 4 shapes, clean and with every corruption at every severity.
    fn default() -> Self {
        Self {
            clean: true,
            corruptions: CorruptionKind::ALL.to_vec(),
            mixtures: Vec::new(),
            severities: Severity::ALL.to_vec(),
            shapes: 4,
            seed: 1,
            pair: PairConfig::default(),
            crop: None,
            dcp_poses: false,
            spread: false,
        }
    }
}

/// Pairs made on demand. Pair `item` is derived from the seed and the number of its shape alone, so
/// that threads, batches and the number of shapes change nothing; all groups show a shape in the
/// same pose.
pub struct SynthesizedPairs {
    source: Box<dyn ShapeSource>,
    /// Numbers of the shapes, spread evenly over the source.
    shapes: Vec<usize>,
    synthesizer: PairSynthesizer,
    protocol: Protocol,
    conditions: Vec<Condition>,
    groups: Vec<Group>,
}

/// What is done to the pairs of a group.
#[derive(Debug, Clone, Copy)]
enum Condition {
    Clean,
    Corrupted(CorruptionKind, Severity),
    Mixed(Mixture, Severity),
}

/// Which of the shapes a group shows: the first, and then every so many.
struct Step {
    first: usize,
    by: usize,
}

impl Protocol {
    fn step(&self, condition: Condition) -> Step {
        match condition {
            Condition::Corrupted(_, severity) | Condition::Mixed(_, severity) if self.spread => {
                let first = self.severities.iter().position(|s| *s == severity).unwrap_or(0);
                Step { first, by: self.severities.len() }
            }
            _ => Step { first: 0, by: 1 },
        }
    }
}

impl Condition {
    fn group(self, pairs: usize) -> Group {
        let (corruption, severity) = match self {
            Self::Clean => (CLEAN.into(), 0),
            Self::Corrupted(kind, severity) => (kind.name().into(), severity.get()),
            Self::Mixed(mixture, severity) => (mixture.to_string(), severity.get()),
        };
        Group { corruption, severity, pairs }
    }
}

impl SynthesizedPairs {
    /// Pairs of `source` by `protocol`.
    ///
    /// # Errors
    /// [`EvalError::Usage`] where the protocol names no pairs or makes no sense.
    pub fn new(source: Box<dyn ShapeSource>, protocol: Protocol) -> Result<Self, EvalError> {
        let synthesizer = PairSynthesizer::new(protocol.pair)
            .map_err(|e| EvalError::Usage(format!("pairs cannot be made so: {e}")))?;
        if protocol.crop.is_some_and(|keep| !(keep > 0.0 && keep <= 1.0)) {
            return Err(EvalError::Usage("--crop: the share that is kept is above 0 and at most 1".into()));
        }
        let count = protocol.shapes.min(source.len());
        let shapes: Vec<usize> = (0..count).map(|i| i * source.len() / count).collect();
        let clean = protocol.clean.then_some(Condition::Clean);
        let at = |make: &dyn Fn(Severity) -> Condition| -> Vec<Condition> {
            protocol.severities.iter().map(|&severity| make(severity)).collect()
        };
        let corrupted = protocol.corruptions.iter().flat_map(|&k| at(&|s| Condition::Corrupted(k, s)));
        let mixed = protocol.mixtures.iter().flat_map(|&m| at(&|s| Condition::Mixed(m, s)));
        let conditions: Vec<Condition> = clean.into_iter().chain(corrupted).chain(mixed).collect();
        if conditions.is_empty() || shapes.is_empty() {
            return Err(EvalError::Usage(
                "no pairs to score: at least one shape, and `clean` or a corruption with a severity are needed"
                    .into(),
            ));
        }
        let (severities, count) = (protocol.severities.len(), shapes.len());
        if protocol.spread && count < severities {
            return Err(EvalError::Usage(format!(
                "{count} shapes cannot be spread over {severities} severities; give more --shapes, or leave \
                 --spread out"
            )));
        }
        let groups = conditions.iter().map(|condition| {
            let step = protocol.step(*condition);
            condition.group((count - step.first).div_ceil(step.by))
        });
        let groups = groups.collect();
        Ok(Self { source, shapes, synthesizer, protocol, conditions, groups })
    }

    /// As [`PairSource::pair`], without the clean shape.
    ///
    /// # Errors
    /// [`EvalError::Pair`] where it cannot be made.
    pub fn bare_pair(&self, group: usize, item: usize) -> Result<Pair, EvalError> {
        let (shape, stream) = self.shape(group, item);
        let pose = if self.protocol.dcp_poses { PoseDraw::DcpTest(shape as u32) } else { PoseDraw::Seeded };
        let shapes = &*self.source;
        let pair = match self.conditions[group] {
            Condition::Clean => self.synthesizer.pair(shapes, shape, None, pose, stream),
            Condition::Corrupted(kind, severity) => {
                self.synthesizer.pair(shapes, shape, Some((kind, severity)), pose, stream)
            }
            Condition::Mixed(mixture, severity) => {
                let corruption = mixture.corruption(&self.synthesizer.config().variants);
                self.synthesizer.pair_with(shapes, shape, Some((&*corruption, severity)), pose, stream)
            }
        };
        let named = |e: srrf_corrupt::PairError| EvalError::Pair {
            group: self.groups[group].name(),
            item,
            source: Box::new(e.into()),
        };
        let mut pair = pair.map_err(named)?;
        if let Some(keep) = self.protocol.crop {
            crop_pair(&mut pair, keep, stream).map_err(|source| {
                named(srrf_corrupt::PairError::Cloud { id: self.source.id(shape), source })
            })?;
        }
        Ok(pair)
    }

    /// The shape of a pair, and its random numbers.
    fn shape(&self, group: usize, item: usize) -> (usize, Stream) {
        let step = self.protocol.step(self.conditions[group]);
        let shape = self.shapes[step.first + item * step.by];
        (shape, Stream { seed: self.protocol.seed, item: shape as u64 })
    }

    /// The points from which the pair was made. `None` with box normalisation, which moves and scales
    /// clouds against their clean shape.
    fn clean(&self, shape: usize, stream: Stream) -> Result<Option<Vec<[f64; 3]>>, EvalError> {
        let config = &self.protocol.pair;
        if config.normalize != Normalize::None {
            return Ok(None);
        }
        // The synthesizer draws its points from the same stream.
        let mut rng = stream.rng(Purpose::Base);
        let points = match config.sampling {
            Sampling::Shared => self.source.sample(shape, config.points, &mut rng)?.into_points(),
            Sampling::Independent => {
                let (source, target) = self.source.sample_two(shape, config.points, &mut rng)?;
                [source.into_points(), target.into_points()].concat()
            }
        };
        Ok(Some(points))
    }
}

/// The name of a switch of [`PairConfig`] as in configs and options.
fn word(switch: impl Serialize) -> String {
    let value = serde_json::to_value(switch).ok();
    value.as_ref().and_then(|v| v.as_str()).unwrap_or_default().to_owned()
}

impl PairSource for SynthesizedPairs {
    fn description(&self) -> String {
        let pair = &self.protocol.pair;
        let poses = match pair.rotation {
            _ if self.protocol.dcp_poses => "DCP's test poses".to_owned(),
            RotationRange::EulerAxes { max_deg } => {
                format!("Euler angles in [0, {max_deg}] degrees, translation within {}", pair.translation)
            }
            RotationRange::So3 => format!("all rotations, translation within {}", pair.translation),
        };
        format!(
            "{}; {} shapes scored{}; corrupt {}, sampling {}, normalize {}, {} points{}; {poses}",
            self.source.description(),
            self.shapes.len(),
            if self.protocol.spread { ", each at one severity" } else { "" },
            word(pair.corrupt),
            word(pair.sampling),
            word(pair.normalize),
            pair.points,
            self.protocol.crop.map_or(String::new(), |keep| format!(", {keep} of each kept by a crop")),
        )
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn has_oracle(&self) -> bool {
        self.protocol.pair.sampling == Sampling::Shared && self.protocol.pair.keep_correspondence
    }

    fn pair(&self, group: usize, item: usize) -> Result<EvalPair, EvalError> {
        let (shape, stream) = self.shape(group, item);
        Ok(EvalPair { pair: self.bare_pair(group, item)?, clean: self.clean(shape, stream)? })
    }
}

/// Keeps the `keep` share of each cloud that lies farthest along a direction of its own.
fn crop_pair(pair: &mut Pair, keep: f64, stream: Stream) -> Result<(), CloudError> {
    let mut rng = stream.rng(Purpose::Crop);
    let clouds = [(&mut pair.source, &mut pair.source_origin), (&mut pair.target, &mut pair.target_origin)];
    for (cloud, origin) in clouds {
        let kept = crop(cloud.points(), &random_direction(&mut rng), keep);
        *cloud = PointCloud::new(kept.iter().map(|&i| cloud.points()[i]).collect())?;
        if let Some(origin) = origin {
            *origin = kept.iter().map(|&i| origin[i]).collect();
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use srrf_corrupt::Corrupt;

    use super::*;
    use crate::data;

    fn protocol() -> Protocol {
        Protocol {
            clean: true,
            corruptions: vec![CorruptionKind::Gaussian, CorruptionKind::Cutout],
            mixtures: vec![],
            severities: vec![Severity::ALL[0], Severity::ALL[4]],
            shapes: 3,
            seed: 7,
            pair: PairConfig { points: 65, ..PairConfig::default() },
            crop: None,
            dcp_poses: false,
            spread: false,
        }
    }

    fn pairs(protocol: Protocol) -> SynthesizedPairs {
        SynthesizedPairs::new(data::procedural(protocol.shapes).unwrap(), protocol).unwrap()
    }

    #[test]
    fn groups_are_clean_and_each_corruption_at_each_severity() {
        let pairs = pairs(protocol());
        let names: Vec<String> = pairs.groups().iter().map(Group::name).collect();
        assert_eq!(names, ["clean", "gaussian_s1", "gaussian_s5", "cutout_s1", "cutout_s5"]);
        assert!(pairs.groups().iter().all(|g| g.pairs == 3));
        assert!(pairs.has_oracle());
        assert!(pairs.description().contains("corrupt both, sampling shared, normalize none, 65 points"));
    }

    #[test]
    fn spread_shapes_are_shown_at_one_severity_each() {
        let spread = pairs(Protocol { spread: true, ..protocol() });
        // 3 shapes at 2 severities: the first and the third at the lower one.
        assert_eq!(spread.groups().iter().map(|g| g.pairs).collect::<Vec<_>>(), [3, 2, 1, 2, 1]);
        let all = pairs(protocol());
        assert_eq!(spread.pair(1, 1).unwrap().pair, all.pair(1, 2).unwrap().pair);
        assert_eq!(spread.pair(4, 0).unwrap().pair, all.pair(4, 1).unwrap().pair);
        let few = Protocol { spread: true, shapes: 1, ..protocol() };
        let error = SynthesizedPairs::new(data::procedural(1).unwrap(), few).err().unwrap();
        assert!(error.to_string().contains("--spread"), "{error}");
    }

    #[test]
    fn a_pair_depends_on_seed_and_item_alone() {
        let few = pairs(protocol());
        let only_cutout =
            pairs(Protocol { clean: false, corruptions: vec![CorruptionKind::Cutout], ..protocol() });
        let (a, b) = (few.pair(4, 2).unwrap(), only_cutout.pair(1, 2).unwrap());
        assert_eq!(a.pair, b.pair);
        assert_eq!(a.clean, b.clean);
        let other = pairs(Protocol { seed: 8, ..protocol() });
        assert_ne!(other.pair(4, 2).unwrap().pair.target_from_source, a.pair.target_from_source);
        // One shape keeps its pose through all groups.
        let clean = few.pair(0, 2).unwrap();
        assert_eq!(clean.pair.target_from_source, a.pair.target_from_source);
    }

    #[test]
    fn the_clean_shape_is_the_one_the_pair_was_made_from() {
        let target_only =
            Protocol { pair: PairConfig { corrupt: Corrupt::Target, ..protocol().pair }, ..protocol() };
        let pair = pairs(target_only).pair(2, 1).unwrap();
        let sorted = |mut points: Vec<[f64; 3]>| {
            points.sort_by(|a, b| a.partial_cmp(b).unwrap());
            points
        };
        assert_eq!(sorted(pair.clean.unwrap()), sorted(pair.pair.source.into_points()));
        let boxed = Protocol {
            pair: PairConfig { normalize: Normalize::Canonical, ..protocol().pair },
            ..protocol()
        };
        assert_eq!(pairs(boxed).pair(2, 1).unwrap().clean, None);
    }

    #[test]
    fn a_crop_keeps_a_share_of_each_cloud_and_what_corresponds() {
        let cropped = pairs(Protocol { crop: Some(0.7), ..protocol() });
        assert!(cropped.description().contains("0.7 of each kept"));
        let (part, whole) = (cropped.pair(0, 1).unwrap().pair, pairs(protocol()).pair(0, 1).unwrap().pair);
        assert_eq!((part.source.len(), part.target.len()), (46, 46), "of 65");
        assert_eq!(part.target_from_source, whole.target_from_source);
        assert!(part.source.points().iter().all(|p| whole.source.points().contains(p)));
        let found = srrf_corrupt::oracle_pose(&part).unwrap();
        assert!(found.angle_to_deg(&part.target_from_source) < 1e-6, "correspondences were cropped along");
        // Another part of each: fewer points correspond than each cloud has.
        let origins = part.source_origin.unwrap();
        let shared = part.target_origin.unwrap().into_iter().filter(|o| origins.contains(o)).count();
        assert!(shared < 46);
        let nothing = Protocol { crop: Some(0.0), ..protocol() };
        assert!(SynthesizedPairs::new(data::procedural(3).unwrap(), nothing).is_err());
    }

    #[test]
    fn dcp_poses_are_those_of_the_shape_number() {
        let pairs = pairs(Protocol { dcp_poses: true, ..protocol() });
        let pose = pairs.pair(0, 2).unwrap().pair.target_from_source;
        assert_eq!(pose, srrf_corrupt::dcp_test_pose(2));
    }

    #[test]
    fn mixtures_come_after_the_corruptions_in_the_same_poses() {
        let mixture = Mixture::Both(CorruptionKind::Cutout, CorruptionKind::Gaussian);
        let pairs = pairs(Protocol { mixtures: vec![mixture], ..protocol() });
        assert_eq!(pairs.groups()[6].name(), "cutout + gaussian_s5");
        let (mixed, clean) = (pairs.pair(6, 1).unwrap().pair, pairs.pair(0, 1).unwrap().pair);
        assert_eq!(mixed.target_from_source, clean.target_from_source);
        assert_eq!((mixed.source.len(), mixed.corruption), (65, None));
        assert_ne!(mixed.source, clean.source);
    }

    #[test]
    fn no_pairs_is_an_error() {
        let nothing = Protocol { clean: false, corruptions: vec![], ..protocol() };
        let error = SynthesizedPairs::new(data::procedural(3).unwrap(), nothing).err().unwrap();
        assert!(error.is_usage());
        let two_points = Protocol { pair: PairConfig { points: 2, ..PairConfig::default() }, ..protocol() };
        let error = SynthesizedPairs::new(data::procedural(3).unwrap(), two_points).err().unwrap();
        assert!(error.to_string().contains("at least 3 points"), "{error}");
    }
}
