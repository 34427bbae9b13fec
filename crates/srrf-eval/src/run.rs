//! Runs methods over pairs and keeps every answer.

use std::time::Instant;

use rayon::prelude::*;
use srrf_cloud::{Rigid, profile};
use srrf_corrupt::oracle_pose;

use crate::EvalError;
use crate::answers::{Answer, PairRecord, RunOutcome};
use crate::cache::{Cache, PairHash};
use crate::chamfer::CleanShape;
use crate::kept::KeptAnswer;
use crate::method_set::{MethodSet, source_of};
use crate::methods::ReadyMethod;
use crate::metrics::{is_finite, is_right};
use crate::pairs::{EvalPair, PairSource};
use crate::rows::{RowSource, TableRow};
use crate::transforms::Transforms;

/// Pairs of each thread between two reports of progress.
const CHUNK: usize = 8;

/// What is run, and how.
pub struct Run<'a> {
    /// The pairs.
    pub pairs: &'a dyn PairSource,
    /// The methods, set up. Those that fill none of [`Run::rows`] are not run.
    pub methods: &'a [ReadyMethod],
    /// Answers of other tools, a row each.
    pub transforms: Vec<Transforms>,
    /// The rows to keep, in the order of the tables.
    pub rows: Vec<TableRow>,
    /// Worker threads, at least 1.
    pub threads: usize,
    /// Answers that were computed before, and where new ones are kept.
    pub cache: Option<&'a Cache>,
}

impl<'a> Run<'a> {
    /// All methods and rows of a set on pairs, on all cores, without files of transforms and without a cache.
    pub fn new(pairs: &'a dyn PairSource, set: &'a MethodSet) -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let (methods, rows) = (&set.methods[..], set.rows.clone());
        Self { pairs, methods, transforms: Vec::new(), rows, threads, cache: None }
    }
}

impl Run<'_> {
    /// Runs every method on every pair. `after_chunk` hears how many pairs have just been done, and
    /// the name of the group of the last.
    ///
    /// Answers do not depend on `threads`.
    ///
    /// # Errors
    /// [`EvalError`] where nothing fills a row, a pair cannot be made, or an answer not be kept. A method that fails is no
    /// error: its failures are counted.
    pub fn execute(
        &self,
        after_chunk: &mut (dyn FnMut(usize, &str) + Send),
    ) -> Result<RunOutcome, EvalError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build()?;
        pool.install(|| self.execute_here(after_chunk))
    }

    fn execute_here(
        &self,
        after_chunk: &mut (dyn FnMut(usize, &str) + Send),
    ) -> Result<RunOutcome, EvalError> {
        let groups = self.pairs.groups();
        let sources = self.sources()?;
        let runs = |number: usize| {
            sources.iter().any(|s| matches!(s, RowSource::Answer { method, .. } if *method == number))
        };
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
            // As many as there are methods; empty for those that fill no row.
            let answers: Vec<Vec<KeptAnswer>> = self
                .methods
                .iter()
                .enumerate()
                .map(
                    |(number, m)| {
                        if runs(number) { self.answers(m, &pairs, &hashes) } else { Ok(Vec::new()) }
                    },
                )
                .collect::<Result<_, _>>()?;
            let scored: Vec<PairRecord> = (0..chunk.len())
                .into_par_iter()
                .map(|i| {
                    let found: Vec<Option<&KeptAnswer>> =
                        answers.iter().map(|of_method| of_method.get(i)).collect();
                    self.record(chunk[i], &pairs[i], &sources, &found)
                })
                .collect();
            records.extend(scored);
            let last = chunk.last().map_or(String::new(), |&(group, _)| groups[group].name());
            after_chunk(chunk.len(), &last);
        }
        Ok(RunOutcome { groups: groups.to_vec(), rows: self.rows.clone(), records })
    }

    /// What fills each row.
    fn sources(&self) -> Result<Vec<RowSource>, EvalError> {
        let source = |row: &TableRow| source_of(row, self.methods, &self.transforms);
        let missing = |row: &TableRow| EvalError::Usage(format!("no method of this run fills the row {row}"));
        self.rows.iter().map(|row| source(row).ok_or_else(|| missing(row))).collect()
    }

    /// One method on the pairs of a chunk; only those that the cache lacks are computed.
    fn answers(
        &self,
        method: &ReadyMethod,
        pairs: &[EvalPair],
        hashes: &[PairHash],
    ) -> Result<Vec<KeptAnswer>, EvalError> {
        let Some(cache) = self.cache else {
            return Ok(self.register(method, &pairs.iter().collect::<Vec<_>>()));
        };
        let mut known: Vec<Option<KeptAnswer>> = hashes.iter().map(|hash| cache.get(method, hash)).collect();
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
    fn register(&self, method: &ReadyMethod, pairs: &[&EvalPair]) -> Vec<KeptAnswer> {
        let call = |pair: &&EvalPair| {
            let pair = &pair.pair;
            let start = Instant::now();
            let answer =
                profile::stage(method.stage, || method.register.register(&pair.source, &pair.target));
            KeptAnswer::new(answer, &pair.target_from_source, start.elapsed().as_secs_f64())
        };
        // One part for each thread, so that none takes up another pair while the first is being timed.
        let part = pairs.len().div_ceil(self.threads.max(1)).max(1);
        pairs.par_chunks(part).flat_map_iter(|part| part.iter().map(call)).collect()
    }

    /// Scores all rows on one pair.
    fn record(
        &self,
        (group, item): (usize, usize),
        pair: &EvalPair,
        sources: &[RowSource],
        found: &[Option<&KeptAnswer>],
    ) -> PairRecord {
        let clean = pair.clean.as_ref().and_then(|points| CleanShape::new(points).ok());
        let (source, target, truth) = (&pair.pair.source, &pair.pair.target, &pair.pair.target_from_source);
        let answers = sources.iter().map(|row| {
            let mut answer = self.answer(*row, (group, item), pair, found);
            let pose = answer.pose.unwrap_or_else(Rigid::identity);
            answer.error.chamfer =
                clean.as_ref().map(|shape| shape.modified_chamfer(source, target, &pose, truth));
            answer.error.right = Some(answer.pose.is_some_and(|pose| is_right(&pose, truth, source, target)));
            answer
        });
        PairRecord {
            group,
            item,
            id: pair.pair.id.clone(),
            class: pair.pair.class.clone(),
            symmetric: pair.pair.symmetric,
            truth: *truth,
            answers: answers.collect(),
        }
    }

    /// The answer of a row: of a method, one of its branches, the oracle, or a file.
    fn answer(
        &self,
        row: RowSource,
        (group, item): (usize, usize),
        pair: &EvalPair,
        found: &[Option<&KeptAnswer>],
    ) -> Answer {
        let truth = &pair.pair.target_from_source;
        let (method, branch, own) = match row {
            RowSource::Oracle => {
                let pose = oracle_pose(&pair.pair);
                let failure = pose.is_none().then(|| "the correspondences determine no pose".to_owned());
                return Answer::new(pose, failure, truth);
            }
            RowSource::File(number) => {
                let pose = self.transforms[number].poses[group][item];
                let failure = pose.is_none().then(|| "the file holds no pose".to_owned());
                return Answer::new(pose, failure, truth);
            }
            RowSource::Answer { method, branch, own } => (method, branch, own),
        };
        let Some(found) = found[method] else {
            return Answer::new(None, Some("the method did not run".to_owned()), truth);
        };
        // What a method that goes on took, and how it ended, is not the row's.
        let seconds = own.then_some(found.seconds.0);
        let poses = match &found.answer {
            Ok(poses) => poses,
            Err(failure) => return Answer { seconds, ..Answer::new(None, Some(failure.clone()), truth) },
        };
        let pose = match branch {
            None => Some(poses.pose),
            Some(branch) => poses.branches.iter().find(|b| b.name == branch).map(|b| b.pose),
        };
        let (pose, failure) = match pose {
            Some(pose) if is_finite(&pose) => (Some(pose), None),
            Some(_) => (None, Some("the pose is not finite".to_owned())),
            None => (None, Some("the method gave no pose for this branch".to_owned())),
        };
        Answer {
            seconds,
            iterations: own.then_some(poses.iterations),
            converged: own.then_some(poses.converged),
            skeletons: poses.agreement().filter(|_| branch.is_none()),
            certainty: poses.certainty().filter(|_| branch.is_none()),
            ..Answer::new(pose, failure, truth)
        }
    }
}

#[cfg(test)]
mod tests {
    use srrf_cloud::{
        Branch, BranchKind, Certainty, Register, RegisterError, Registration, Skeleton, Skeletons, Solid,
    };
    use srrf_corrupt::{CorruptionKind, PairConfig, Severity};

    use super::*;
    use crate::certainty::Claim;
    use crate::data;
    use crate::protocol::{Protocol, SynthesizedPairs};

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
            let branch = |kind, target_from_source| Branch { kind, target_from_source, inlier_ratio: 0.0 };
            let branches =
                vec![branch(BranchKind::Dense, Rigid::identity()), branch(BranchKind::Skeleton, broken)];
            // Skeletons that agree under no pose but the identity.
            let skeleton = Skeleton { points: vec![[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]], radii: Vec::new() };
            let skeletons = Some(Skeletons { source: skeleton.clone(), target: skeleton });
            let certainty = Some(Certainty { probability: 0.75, abstain: false });
            Ok(Registration { branches, skeletons, certainty, ..Registration::from_pose(Rigid::identity()) })
        }
    }

    fn pairs() -> SynthesizedPairs {
        let protocol = Protocol {
            clean: true,
            corruptions: vec![CorruptionKind::Shear],
            mixtures: vec![],
            severities: vec![Severity::ALL[2]],
            shapes: 11,
            seed: 3,
            pair: PairConfig { points: 129, ..PairConfig::default() },
            crop: None,
            dcp_poses: false,
            spread: false,
        };
        SynthesizedPairs::new(data::procedural(11).unwrap(), protocol).unwrap()
    }

    fn run(pairs: &SynthesizedPairs, threads: usize) -> RunOutcome {
        cached(pairs, threads, None)
    }

    fn cached(pairs: &SynthesizedPairs, threads: usize, cache: Option<&Cache>) -> RunOutcome {
        let moody = ReadyMethod { branches: &["dense", "skeleton"], ..ReadyMethod::new(Moody) };
        let icp = ReadyMethod::new(srrf_classical::Icp::default());
        let methods = [moody, icp];
        let rows = [&[TableRow::ICP, TableRow::Oracle][..], &methods[0].rows()].concat();
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
                assert_eq!(moody.claim(), Some(Claim::NO_POSE));
                failed += 1;
            } else {
                assert!(right.failure.as_ref().unwrap().contains("not finite"));
                assert!(moody.skeletons.unwrap().chamfer > 1e-3 && left.skeletons.is_none());
                assert_eq!(moody.claim().unwrap().probability, 0.75);
                assert!(left.certainty.is_none() && oracle.claim().is_none());
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

    #[test]
    fn a_row_that_nothing_fills_is_an_error() {
        let pairs = pairs();
        let rows = vec![TableRow::DCP];
        let run = Run { pairs: &pairs, methods: &[], transforms: vec![], rows, threads: 1, cache: None };
        assert!(run.execute(&mut |_, _| {}).unwrap_err().to_string().contains("dcp"));
    }
}
