//! Runs methods over pairs and keeps every answer.

use std::time::Instant;

use rayon::prelude::*;
use srrf_cloud::{Rigid, profile};
use srrf_corrupt::oracle_pose;

use crate::EvalError;
use crate::cache::{Cache, PairHash};
use crate::chamfer::{CleanShape, SkeletonAgreement};
use crate::found::{Found, Poses};
use crate::methods::{METHODS, Method, ORACLE};
use crate::metrics::{PairError, is_finite};
use crate::pairs::{EvalPair, Group, PairSource};
use crate::transforms::Transforms;

/// Pairs of each thread between two reports of progress.
const CHUNK: usize = 8;

/// What is run, and how.
pub struct Run<'a> {
    /// The pairs.
    pub pairs: &'a dyn PairSource,
    /// The methods, set up, each with the names of the rows that it may fill. Those that fill none of
    /// [`Run::rows`] are not run.
    pub methods: &'a [(&'static [&'static str], Method)],
    /// Answers of other tools, a row each.
    pub transforms: Vec<Transforms>,
    /// Names of the rows to keep, in the order of the tables.
    pub rows: Vec<String>,
    /// Worker threads, at least 1.
    pub threads: usize,
    /// Answers that were computed before, and where new ones are kept.
    pub cache: Option<&'a Cache>,
}

/// A method's answer on one pair.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Its errors.
    pub error: PairError,
    /// The pose; `None` where there is none.
    pub pose: Option<Rigid>,
    /// Why there is no pose.
    pub failure: Option<String>,
    /// Iterations that the method used.
    pub iterations: Option<usize>,
    /// Whether the method's own stopping rule was met.
    pub converged: Option<bool>,
    /// Time of the call; `None` for the oracle and transforms from a file.
    pub seconds: Option<f64>,
    /// How well the skeletons agree under the true pose; only in the row of a method that makes
    /// skeletons, not in those of its branches.
    pub skeletons: Option<SkeletonAgreement>,
}

/// A pair with the answers of all rows.
#[derive(Debug, Clone)]
pub struct PairRecord {
    /// Number of its group.
    pub group: usize,
    /// Its number in the group.
    pub item: usize,
    /// Name of the shape.
    pub id: String,
    /// Its category; empty if unknown.
    pub class: String,
    /// Whether its category is symmetric about an axis.
    pub symmetric: bool,
    /// The true pose.
    pub truth: Rigid,
    /// The answers, one for each of [`Outcome::rows`].
    pub answers: Vec<Answer>,
}

/// All answers of a run.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The groups.
    pub groups: Vec<Group>,
    /// Names of the rows, in the order of the tables.
    pub rows: Vec<String>,
    /// The pairs, group after group.
    pub records: Vec<PairRecord>,
}

impl Run<'_> {
    /// Runs every method on every pair. `after_chunk` hears how many pairs have just been done, and
    /// the name of the group of the last.
    ///
    /// Answers do not depend on `threads`.
    ///
    /// # Errors
    /// [`EvalError`] where a pair cannot be made, or an answer not be kept. A method that fails is no
    /// error: its failures are counted.
    pub fn execute(&self, after_chunk: &mut (dyn FnMut(usize, &str) + Send)) -> Result<Outcome, EvalError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build()?;
        pool.install(|| self.execute_here(after_chunk))
    }

    fn execute_here(&self, after_chunk: &mut (dyn FnMut(usize, &str) + Send)) -> Result<Outcome, EvalError> {
        let groups = self.pairs.groups();
        let methods = self.running();
        let work: Vec<(usize, usize)> = groups
            .iter()
            .enumerate()
            .flat_map(|(group, g)| (0..g.pairs).map(move |item| (group, item)))
            .collect();
        let mut records = Vec::with_capacity(work.len());
        for chunk in work.chunks(CHUNK * self.threads.max(1)) {
            let pairs: Vec<EvalPair> = chunk
                .par_iter()
                .map(|&(group, item)| self.pairs.pair(group, item))
                .collect::<Result<_, _>>()?;
            let hash = |pair: &EvalPair| Cache::pair_hash(&pair.pair);
            let hashes: Vec<PairHash> =
                self.cache.map_or(Vec::new(), |_| pairs.par_iter().map(hash).collect());
            let answers: Vec<Vec<Found>> = methods
                .iter()
                .map(|(_, method)| self.answers(method, &pairs, &hashes))
                .collect::<Result<_, _>>()?;
            let scored: Vec<PairRecord> = (0..chunk.len())
                .into_par_iter()
                .map(|i| {
                    let found: Vec<&Found> = answers.iter().map(|of_method| &of_method[i]).collect();
                    self.record(chunk[i], &pairs[i], &found)
                })
                .collect();
            records.extend(scored);
            let last = chunk.last().map_or(String::new(), |&(group, _)| groups[group].name());
            after_chunk(chunk.len(), &last);
        }
        Ok(Outcome { groups: groups.to_vec(), rows: self.rows.clone(), records })
    }

    /// The methods that fill a row.
    fn running(&self) -> Vec<&(&'static [&'static str], Method)> {
        let fills = |rows: &[&str]| rows.iter().any(|row| self.rows.iter().any(|wanted| wanted == row));
        self.methods.iter().filter(|(rows, _)| fills(rows)).collect()
    }

    /// One method on the pairs of a chunk; only those that the cache lacks are computed.
    fn answers(
        &self,
        method: &Method,
        pairs: &[EvalPair],
        hashes: &[PairHash],
    ) -> Result<Vec<Found>, EvalError> {
        let Some(cache) = self.cache else {
            return Ok(self.register(method, &pairs.iter().collect::<Vec<_>>()));
        };
        let mut known: Vec<Option<Found>> = hashes.iter().map(|hash| cache.get(method, hash)).collect();
        // Two groups may hold the same clouds; they are computed once.
        let missing: Vec<usize> =
            (0..pairs.len()).filter(|&i| known[i].is_none() && !hashes[..i].contains(&hashes[i])).collect();
        let unanswered: Vec<&EvalPair> = missing.iter().map(|&i| &pairs[i]).collect();
        for (i, found) in missing.into_iter().zip(self.register(method, &unanswered)) {
            cache.put(method, &hashes[i], &found)?;
            known[i] = Some(found);
        }
        let answer = |i: usize| {
            let first = hashes.iter().position(|hash| *hash == hashes[i]).unwrap_or(i);
            known[i].clone().or_else(|| known[first].clone())
        };
        Ok((0..pairs.len()).filter_map(answer).collect())
    }

    /// One method on pairs, side by side.
    fn register(&self, method: &Method, pairs: &[&EvalPair]) -> Vec<Found> {
        let known = METHODS.iter().find(|entry| entry.name == method.register.name());
        let name = known.map_or("another method", |entry| entry.name);
        let call = |pair: &&EvalPair| {
            let pair = &pair.pair;
            let start = Instant::now();
            let answer = profile::stage(name, || method.register.register(&pair.source, &pair.target));
            Found::new(answer, &pair.target_from_source, start.elapsed().as_secs_f64())
        };
        // One part for each thread, so that none takes up another pair while the first is being timed.
        let part = pairs.len().div_ceil(self.threads.max(1)).max(1);
        pairs.par_chunks(part).flat_map_iter(|part| part.iter().map(call)).collect()
    }

    /// Scores all rows on one pair.
    fn record(&self, (group, item): (usize, usize), pair: &EvalPair, found: &[&Found]) -> PairRecord {
        let clean = pair.clean.as_ref().and_then(|points| CleanShape::new(points).ok());
        let answers = self.rows.iter().map(|row| {
            let mut answer = self.answer(row, group, item, pair, found);
            let pose = answer.pose.unwrap_or_else(Rigid::identity);
            let truth = &pair.pair.target_from_source;
            answer.error.chamfer = clean
                .as_ref()
                .map(|shape| shape.modified_chamfer(&pair.pair.source, &pair.pair.target, &pose, truth));
            answer
        });
        PairRecord {
            group,
            item,
            id: pair.pair.id.clone(),
            class: pair.pair.class.clone(),
            symmetric: pair.pair.symmetric,
            truth: pair.pair.target_from_source,
            answers: answers.collect(),
        }
    }

    /// The answer of the row of this name: a method, one of its branches, the oracle, or a file.
    fn answer(&self, row: &str, group: usize, item: usize, pair: &EvalPair, found: &[&Found]) -> Answer {
        let truth = &pair.pair.target_from_source;
        if row == ORACLE {
            let pose = oracle_pose(&pair.pair);
            let failure = pose.is_none().then(|| "the correspondences determine no pose".to_owned());
            return Answer::new(pose, failure, truth);
        }
        if let Some(file) = self.transforms.iter().find(|t| t.name == row) {
            let pose = file.poses[group][item];
            return Answer::new(pose, pose.is_none().then(|| "the file holds no pose".to_owned()), truth);
        }
        let running = self.running();
        let filled = running.iter().zip(found).find(|((rows, _), _)| rows.contains(&row));
        let held = || running.iter().zip(found).find(|((_, method), _)| method.branch_of(row).is_some());
        let Some(((_, method), found)) = filled.or_else(held) else {
            return Answer::new(None, Some(format!("no method fills the row {row}")), truth);
        };
        // What a method that goes on took, and how it ended, is not the row's.
        let own = method.branch_of(row).is_none();
        let seconds = own.then_some(found.seconds.0);
        let poses = match &found.answer {
            Ok(poses) => poses,
            Err(failure) => return Answer { seconds, ..Answer::new(None, Some(failure.clone()), truth) },
        };
        let (pose, failure) = match pose_of_row(poses, method, row) {
            Some(pose) if is_finite(&pose) => (Some(pose), None),
            Some(_) => (None, Some("the pose is not finite".to_owned())),
            None => (None, Some("the method gave no pose for this branch".to_owned())),
        };
        Answer {
            seconds,
            iterations: own.then_some(poses.iterations),
            converged: own.then_some(poses.converged),
            skeletons: poses.agreement().filter(|_| row == method.register.name()),
            ..Answer::new(pose, failure, truth)
        }
    }
}

/// The pose of the row `<method>`, or of the branch in the row `<method>-<branch>`.
fn pose_of_row(found: &Poses, method: &Method, row: &str) -> Option<Rigid> {
    let name = method.register.name();
    if row == name {
        return Some(found.pose);
    }
    let branch = match method.branch_of(row) {
        Some(branch) => branch,
        None => row.strip_prefix(name)?.strip_prefix('-')?,
    };
    found.branches.iter().find(|b| b.name == branch).map(|b| b.pose)
}

impl Answer {
    fn new(pose: Option<Rigid>, failure: Option<String>, truth: &Rigid) -> Self {
        let error = PairError::new(pose.as_ref(), truth);
        Self { error, pose, failure, iterations: None, converged: None, seconds: None, skeletons: None }
    }
}

#[cfg(test)]
mod tests {
    use srrf_cloud::{Branch, Register, RegisterError, Registration, Skeleton, Skeletons, Solid};
    use srrf_corrupt::{CorruptionKind, PairConfig, Severity};

    use super::*;
    use crate::data;
    use crate::synthesized::{Protocol, SynthesizedPairs};

    /// Answers the identity with two branches; fails on clouds whose first source coordinate is
    /// positive.
    struct Moody;

    impl Register for Moody {
        fn name(&self) -> &str {
            "moody"
        }

        fn register_solid(&self, source: Solid<'_>, _: Solid<'_>) -> Result<Registration, RegisterError> {
            if source.points()[0][0] > 0.0 {
                return Err(RegisterError::NoPose("not today".into()));
            }
            let mut broken = Rigid::identity();
            broken.rotation[(0, 0)] = f64::NAN;
            let branch = |name, target_from_source| Branch { name, target_from_source, inlier_ratio: 0.0 };
            let branches = vec![branch("left", Rigid::identity()), branch("right", broken)];
            // Skeletons that agree under no pose but the identity.
            let skeleton = Skeleton { points: vec![[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]], radii: Vec::new() };
            let skeletons = Some(Skeletons { source: skeleton.clone(), target: skeleton });
            Ok(Registration { branches, skeletons, ..Registration::from_pose(Rigid::identity()) })
        }
    }

    const ROWS: &[&str] = &["moody-left", "moody-right", "moody"];

    fn pairs() -> SynthesizedPairs {
        let protocol = Protocol {
            clean: true,
            corruptions: vec![CorruptionKind::Shear],
            mixtures: vec![],
            severities: vec![Severity::ALL[2]],
            shapes: 11,
            seed: 3,
            pair: PairConfig { points: 129, ..PairConfig::default() },
            dcp_poses: false,
            spread: false,
        };
        SynthesizedPairs::new(data::procedural(11).unwrap(), protocol).unwrap()
    }

    fn run(pairs: &SynthesizedPairs, threads: usize) -> Outcome {
        cached(pairs, threads, None)
    }

    fn cached(pairs: &SynthesizedPairs, threads: usize, cache: Option<&Cache>) -> Outcome {
        let moody = crate::methods::plain(Moody);
        let icp = crate::methods::METHODS.iter().find(|m| m.name == "icp").unwrap();
        let methods = vec![(ROWS, moody), (icp.rows, (icp.build)(&Default::default()).unwrap())];
        let rows = ["icp", ORACLE, "moody-left", "moody-right", "moody"].map(str::to_owned).to_vec();
        let run = Run { pairs, methods: &methods, transforms: vec![], rows, threads, cache };
        let mut done = 0;
        let outcome = run.execute(&mut |pairs, _| done += pairs).unwrap();
        assert_eq!(done, 22);
        outcome
    }

    #[test]
    fn threads_change_nothing() {
        let pairs = pairs();
        let one = run(&pairs, 1);
        for threads in [2, 3, 30] {
            let other = run(&pairs, threads);
            for (a, b) in one.records.iter().zip(&other.records) {
                assert_eq!((a.group, a.item, &a.id), (b.group, b.item, &b.id));
                for (a, b) in a.answers.iter().zip(&b.answers) {
                    assert_eq!((a.pose, a.error), (b.pose, b.error));
                }
            }
        }
    }

    #[test]
    fn the_cache_gives_back_every_bit_of_the_answers() {
        let (pairs, folder) = (pairs(), tempfile::tempdir().unwrap());
        let fresh = cached(&pairs, 2, Some(&Cache::open(folder.path(), "flex").unwrap()));
        let cache = Cache::open(folder.path(), "flex").unwrap();
        let again = cached(&pairs, 1, Some(&cache));
        assert_eq!(cache.reused(), 2 * 22, "both methods on every pair");
        // Answers hold NaN nowhere, so their text says all; times are those of the first run.
        assert_eq!(format!("{:?}", fresh.records), format!("{:?}", again.records));
    }

    #[test]
    fn branches_failures_and_the_oracle_are_scored() {
        let outcome = run(&pairs(), 2);
        let (mut failed, mut answered) = (0, 0);
        for record in &outcome.records {
            let [_, oracle, left, right, moody] = &record.answers[..] else { panic!() };
            assert!(right.error.failed, "NaN is a failure");
            assert_eq!(left.pose, moody.pose);
            if moody.error.failed {
                assert!(moody.failure.as_ref().unwrap().contains("not today"));
                failed += 1;
            } else {
                assert!(right.failure.as_ref().unwrap().contains("not finite"));
                assert!(moody.skeletons.unwrap().chamfer > 1e-3 && left.skeletons.is_none());
                answered += 1;
            }
            assert!(!oracle.error.failed);
            if record.group == 0 {
                assert!(oracle.error.rotation_deg < 1e-6, "exact on clean pairs");
                assert!(oracle.error.chamfer.unwrap() < 1e-12);
            }
        }
        assert!(failed > 0 && answered > 0);
    }
}
