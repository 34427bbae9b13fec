//! Replays the decisions of an alignment on pairs that were registered before, and scores them against the truth.
//!
//!     replay [--edges] [--guesses] [--bound SHARE] [--tolerance DEG LENGTH] FOLDER...
//!
//! FOLDER holds scans and `truth.poses`, as the example `scenes` of `srrf-corrupt` writes them; FOLDER.jsonl the pairs, as
//! `srrf align FOLDER --edges FOLDER.jsonl` keeps them. A pair that is not there counts as one without a pose. Each map is held
//! against the truth by the scan by which most are right. `--edges` lists each pair that says something. `--guesses` takes the pose
//! in which a pair was chosen for its registration, in place of those that are kept. `--bound` says how many scans hang together by
//! pairs that share so much: what could be placed at most by one who knew them.

#![allow(clippy::print_stdout, reason = "an example that prints its figures")]

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::error::Error;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use srrf_align::{AlignOptions, Map, OtherPose, PairAnswer, PairStore, RegisterPairs, Scans, align};
use srrf_cloud::io::CloudFile;
use srrf_cloud::{KnnIndex, PointCloud, Rigid, estimate_normals, spacing_of};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// A line of the file of pairs, as far as it is asked.
#[derive(Deserialize)]
struct Line {
    source_name: String,
    target_name: String,
    target_from_source: Option<[[f64; 4]; 4]>,
    probability: f64,
    probability_of_fit: Option<f64>,
    abstain: bool,
    #[serde(default)]
    others: Vec<OtherLine>,
}

/// Another pose of a pair.
#[derive(Deserialize)]
struct OtherLine {
    target_from_source: [[f64; 4]; 4],
    probability: f64,
}

/// Scans with the truth and their pairs.
struct Scene {
    names: Vec<String>,
    clouds: Vec<PointCloud>,
    eyes: Vec<Option<[f64; 3]>>,
    map_from_scan: Vec<Rigid>,
    pairs: BTreeMap<(usize, usize), PairAnswer>,
    missing: AtomicUsize,
    guesses: bool,
}

/// What the registration of a guess says, where guesses are taken as they are.
const GUESS_PROBABILITY: f64 = 0.8;

impl Scene {
    fn read(folder: &Path, guesses: bool) -> Outcome<Self> {
        let mut scene = Self {
            names: Vec::new(),
            clouds: Vec::new(),
            eyes: Vec::new(),
            map_from_scan: Vec::new(),
            pairs: BTreeMap::new(),
            missing: AtomicUsize::new(0),
            guesses,
        };
        let mut numbers = BTreeMap::new();
        for line in std::fs::read_to_string(folder.join("truth.poses"))?.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let [file, station, rows @ ..] = &words[..] else { continue };
            if line.starts_with('#') {
                continue;
            }
            let rows: Vec<f64> = rows.iter().map(|w| w.parse()).collect::<Result<_, _>>()?;
            let mut contents = CloudFile::open(&folder.join(file))?.contents()?;
            contents.drop_not_finite();
            numbers.insert((*file).to_owned(), scene.names.len());
            scene.names.push((*station).to_owned());
            scene.eyes.push(contents.viewpoint);
            scene.clouds.push(PointCloud::new(contents.points)?);
            scene.map_from_scan.push(rigid(|r, c| rows[4 * r + c]));
        }
        let lines =
            if guesses { String::new() } else { std::fs::read_to_string(folder.with_extension("jsonl"))? };
        for line in lines.lines() {
            let line: Line = serde_json::from_str(line)?;
            let number = |name: &str| {
                let name = Path::new(name).file_name()?.to_str()?;
                numbers.get(name).copied()
            };
            if let (Some(source), Some(target)) = (number(&line.source_name), number(&line.target_name)) {
                let other = |o: &OtherLine| OtherPose {
                    target_from_source: rigid(|r, c| o.target_from_source[r][c]),
                    probability: o.probability,
                };
                let answer = PairAnswer {
                    target_from_source: line.target_from_source.map(|m| rigid(|r, c| m[r][c])),
                    probability: line.probability,
                    probability_of_fit: line.probability_of_fit.unwrap_or(line.probability),
                    abstain: line.abstain,
                    others: line.others.iter().map(other).collect(),
                };
                scene.pairs.insert((source, target), answer);
            }
        }
        Ok(scene)
    }

    /// The largest sets of scans that pairs join of which one shares so much of its points with the other.
    fn bound(&self, share: f64) -> Outcome<(usize, Vec<usize>)> {
        let mut surfaces = Vec::new();
        for (i, cloud) in self.clouds.iter().enumerate() {
            let moved: Vec<[f64; 3]> =
                cloud.points().iter().map(|p| self.map_from_scan[i].apply(p)).collect();
            let eye = self.eyes[i].map(|e| Vector3::from(self.map_from_scan[i].apply(&e)));
            let normals: Vec<Vector3<f64>> = estimate_normals(&moved, 12)?
                .into_iter()
                .zip(&moved)
                .map(|(n, p)| {
                    let n = Vector3::from(n);
                    if eye.is_some_and(|e| n.dot(&(e - Vector3::from(*p))) < 0.0) { -n } else { n }
                })
                .collect();
            let index = KnnIndex::new(&moved)?;
            let near = 2.0 * spacing_of(&index);
            surfaces.push((moved, normals, index, near));
        }
        let on = |a: usize, b: usize| {
            let (points, normals, ..) = &surfaces[a];
            let (_, theirs, index, near) = &surfaces[b];
            let lies = |i: &usize| {
                let (at, squared) = index.nearest(&points[*i]);
                squared <= near * near && theirs[at].dot(&normals[*i]) > 0.7
            };
            let asked: Vec<usize> = (0..points.len()).step_by(8).collect();
            asked.iter().filter(|i| lies(i)).count() as f64 / asked.len() as f64
        };
        let n = self.count();
        let mut of: Vec<usize> = (0..n).collect();
        let mut pairs = 0;
        for a in 0..n {
            for b in 0..a {
                if on(a, b).max(on(b, a)) >= share {
                    pairs += 1;
                    let (x, y) = (of[a], of[b]);
                    of.iter_mut().filter(|o| **o == x).for_each(|o| *o = y);
                }
            }
        }
        let mut sizes = vec![0; n];
        of.iter().for_each(|o| sizes[*o] += 1);
        sizes.retain(|s| *s > 0);
        sizes.sort_unstable_by(|a, b| b.cmp(a));
        Ok((pairs, sizes))
    }

    /// How far a pose of a scan in the frame of another is off: degrees, and how far it moves the mean of the scan.
    fn off(&self, source: usize, target: usize, target_from_source: &Rigid) -> (f64, f64) {
        let right = self.map_from_scan[target].inverse().compose(&self.map_from_scan[source]);
        let off = right.inverse().compose(target_from_source);
        let middle = self.clouds[source].centroid();
        let moved = Vector3::from(off.apply(&middle.into()));
        (off.angle_to_deg(&Rigid::identity()), (moved - middle).norm())
    }
}

fn rigid(at: impl Fn(usize, usize) -> f64) -> Rigid {
    Rigid { rotation: Matrix3::from_fn(&at), translation: Vector3::from_fn(|r, _| at(r, 3)) }
}

impl Scans for Scene {
    type Error = Infallible;

    fn count(&self) -> usize {
        self.clouds.len()
    }

    fn viewpoint(&self, number: usize) -> Option<[f64; 3]> {
        self.eyes[number]
    }

    fn cloud(&self, number: usize) -> Result<Cow<'_, PointCloud>, Infallible> {
        Ok(Cow::Borrowed(&self.clouds[number]))
    }
}

/// Only those that a run asks for.
impl PairStore for Scene {
    fn find(&self, source: usize, target: usize) -> Option<PairAnswer> {
        self.pairs.get(&(source, target)).cloned()
    }

    fn keep(&self, _: usize, _: usize, _: &PairAnswer) {}
}

impl RegisterPairs for Scene {
    type Target = ();
    type Error = Infallible;

    fn prepare(&self, _: &PointCloud) -> Result<(), Infallible> {
        Ok(())
    }

    fn register(&self, _: &PointCloud, (): &(), guess: Option<Rigid>) -> Result<PairAnswer, Infallible> {
        if self.guesses && guess.is_some() {
            return Ok(PairAnswer {
                target_from_source: guess,
                probability: GUESS_PROBABILITY,
                probability_of_fit: GUESS_PROBABILITY,
                abstain: false,
                others: Vec::new(),
            });
        }
        self.missing.fetch_add(1, Ordering::Relaxed);
        Ok(PairAnswer::NOTHING)
    }
}

/// For each scan whether it is right in its map; none for one that is alone.
fn right(scene: &Scene, map: &Map, limits: (f64, f64)) -> Vec<Option<bool>> {
    let mut verdicts = vec![None; scene.count()];
    for members in map.components.iter().filter(|m| m.len() > 1) {
        let by = |anchor: usize| -> Vec<bool> {
            let to_anchor = map.scans[anchor].map_from_scan.inverse();
            members
                .iter()
                .map(|&i| scene.off(i, anchor, &to_anchor.compose(&map.scans[i].map_from_scan)))
                .map(|(turned, moved)| turned <= limits.0 && moved <= limits.1)
                .collect()
        };
        let count = |verdicts: &Vec<bool>| verdicts.iter().filter(|v| **v).count();
        let best = members.iter().map(|&a| by(a)).max_by_key(count).unwrap_or_default();
        members.iter().zip(best).for_each(|(&i, right)| verdicts[i] = Some(right));
    }
    verdicts
}

fn main() -> Outcome<()> {
    let mut args = std::env::args().skip(1).peekable();
    let (mut limits, mut list, mut guesses, mut bound, mut folders) =
        ((2.0, 0.3), false, false, None, Vec::new());
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--edges" => list = true,
            "--guesses" => guesses = true,
            "--bound" => bound = Some(args.next().ok_or("--bound SHARE")?.parse()?),
            "--tolerance" => {
                let mut number =
                    || -> Outcome<f64> { Ok(args.next().ok_or("--tolerance DEG LENGTH")?.parse()?) };
                limits = (number()?, number()?);
            }
            _ => folders.push(arg),
        }
    }
    let mut edges = Vec::new();
    println!(
        "scene\tscans\tlargest\tplaced\twrong\twrong_sure\tmaps\tabstain\trivals\ttried\tmissing\tseconds"
    );
    for folder in &folders {
        let scene = Scene::read(Path::new(folder), guesses)?;
        if let Some(share) = bound {
            let (pairs, sizes) = scene.bound(share)?;
            println!("{folder}\tpairs that share {share}: {pairs}\thang together: {sizes:?}");
            continue;
        }
        let begun = std::time::Instant::now();
        let map = align(&scene, &scene, &AlignOptions::default(), &scene, &|_| {})?;
        let seconds = begun.elapsed().as_secs_f64();
        let verdicts = right(&scene, &map, limits);
        let wrong: Vec<usize> = (0..verdicts.len()).filter(|i| verdicts[*i] == Some(false)).collect();
        let placed = verdicts.iter().filter(|v| v.is_some()).count();
        println!(
            "{folder}\t{}\t{}\t{placed}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{seconds:.1}",
            verdicts.len(),
            map.components[0].len(),
            wrong.len(),
            wrong.iter().filter(|i| !map.scans[**i].abstain).count(),
            map.components.iter().filter(|c| c.len() > 1).count(),
            map.scans.iter().filter(|s| s.abstain).count(),
            map.rivals.len(),
            map.choice.tried,
            scene.missing.load(Ordering::Relaxed),
        );
        if list {
            print_edges(&scene, &map, limits);
        }
        for e in &map.edges {
            if let Some(pose) = &e.target_from_source {
                let (turned, moved) = scene.off(e.source, e.target, pose);
                edges.push((e.probability, e.posterior, turned <= limits.0 && moved <= limits.1));
            }
        }
    }
    reliability("registered", edges.iter().map(|e| (e.0, e.2)));
    reliability("after loops and sight", edges.iter().map(|e| (e.1, e.2)));
    Ok(())
}

/// How often pairs are right, by their probability.
fn reliability(what: &str, edges: impl Iterator<Item = (f64, bool)> + Clone) {
    const BOUNDS: [f64; 6] = [0.0, 0.2, 0.5, 0.8, 0.9, 1.01];
    let score: Vec<f64> = edges.clone().map(|(p, right)| (p - f64::from(u8::from(right))).powi(2)).collect();
    println!(
        "{what}: Brier score {:.3} of {} pairs",
        score.iter().sum::<f64>() / score.len() as f64,
        score.len()
    );
    for bounds in BOUNDS.windows(2) {
        let inside: Vec<(f64, bool)> =
            edges.clone().filter(|(p, _)| *p >= bounds[0] && *p < bounds[1]).collect();
        let mean = inside.iter().map(|e| e.0).sum::<f64>() / inside.len() as f64;
        let right = inside.iter().filter(|e| e.1).count();
        println!("  from {}: said {mean:.2}, right {right} of {}", bounds[0], inside.len());
    }
}

fn print_edges(scene: &Scene, map: &Map, limits: (f64, f64)) {
    println!(
        "#edge\tsource\ttarget\tright\tprobability\tabstain\tposterior\tverdict\toverlap\toverlap\tseen_through\tdeg\tlength\treason"
    );
    for e in &map.edges {
        if let Some(pose) = &e.target_from_source {
            let (turned, moved) = scene.off(e.source, e.target, pose);
            println!(
                "#edge\t{}\t{}\t{}\t{:.3}\t{}\t{:.3}\t{}\t{:.3}\t{:.3}\t{:.5}\t{turned:.2}\t{moved:.3}\t{}",
                scene.names[e.source],
                scene.names[e.target],
                u8::from(turned <= limits.0 && moved <= limits.1),
                e.probability,
                u8::from(e.abstain),
                e.posterior,
                e.verdict,
                e.overlap[0],
                e.overlap[1],
                e.seen_through.unwrap_or(f64::NAN),
                e.reason,
            );
        }
    }
}
