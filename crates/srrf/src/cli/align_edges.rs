//! Registered pairs in a file: one JSON line a pair, by the hashes of the two scans.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use srrf_align::{OtherPose, PairAnswer, PairStore};
use srrf_args::{Failure, files, interrupt};

use super::align_poses::{matrix, rigid_of};
use super::align_scans::ScanFiles;

/// A line of the file.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct EdgeLine {
    /// Hashes of the points.
    source: String,
    target: String,
    /// The files when it was made, for readers.
    source_name: String,
    target_name: String,
    /// 4 rows of 4; null where no pose was found.
    target_from_source: Option<[[f64; 4]; 4]>,
    probability: f64,
    /// Earlier versions wrote none.
    #[serde(default)]
    probability_of_fit: Option<f64>,
    abstain: bool,
    /// The other poses that fit as well. Earlier versions wrote none.
    #[serde(default)]
    others: Vec<OtherLine>,
    /// What it was made with.
    options: String,
}

/// Another pose.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct OtherLine {
    target_from_source: [[f64; 4]; 4],
    probability: f64,
}

/// A file of edges that is being filled, or none.
#[derive(Debug)]
pub struct EdgeFile<'a> {
    scans: &'a ScanFiles,
    options: String,
    known: BTreeMap<(String, String), PairAnswer>,
    out: Option<(PathBuf, Mutex<Written>)>,
}

#[derive(Debug)]
struct Written {
    file: File,
    failed: Option<io::Error>,
}

impl<'a> EdgeFile<'a> {
    /// Opens a file, and finds the pairs that are in it already.
    ///
    /// # Errors
    /// [`Failure::usage`] for a file that holds anything but pairs, or pairs that other options made; [`Failure::failed`] where it
    /// cannot be written.
    pub fn open(path: Option<&Path>, scans: &'a ScanFiles, options: &str) -> Result<Self, Failure> {
        let mut edges = Self { scans, options: options.to_owned(), known: BTreeMap::new(), out: None };
        let Some(path) = path else { return Ok(edges) };
        let failed =
            |e: io::Error| Failure::failed(format!("cannot write {path:?}: {e}; choose another --edges"));
        let file = OpenOptions::new().read(true).append(true).create(true).open(path).map_err(failed)?;
        let text = files::read_bytes(path, scans.options(), "it should hold the pairs of an earlier run")?;
        // A line without an end was cut off when the run was ended by force.
        let whole = text.iter().rposition(|b| *b == b'\n').map_or(0, |end| end + 1);
        edges.known = parse(&text[..whole], options).map_err(|(line, problem)| {
            Failure::usage(format!(
                "{path:?}, line {line}: {problem}; choose another --edges, or delete this file"
            ))
        })?;
        if whole < text.len() {
            file.set_len(whole as u64).map_err(failed)?;
        }
        edges.out = Some((path.to_owned(), Mutex::new(Written { file, failed: None })));
        Ok(edges)
    }

    /// How many pairs of these scans are known.
    pub fn known(&self) -> usize {
        let mine: std::collections::BTreeSet<&str> =
            (0..self.scans.len()).map(|i| self.scans.hash(i)).collect();
        self.known.keys().filter(|(s, t)| mine.contains(s.as_str()) && mine.contains(t.as_str())).count()
    }

    /// The end: whether all could be written.
    ///
    /// # Errors
    /// [`Failure::failed`] where it could not.
    pub fn finish(&self) -> Result<(), Failure> {
        let Some((path, written)) = &self.out else { return Ok(()) };
        let mut written = written.lock().unwrap_or_else(PoisonError::into_inner);
        match written.failed.take() {
            Some(e) => {
                Err(Failure::failed(format!("cannot write {path:?}: {e}; free some space and start again"))
                    .because(e))
            }
            None => Ok(()),
        }
    }
}

impl PairStore for EdgeFile<'_> {
    fn find(&self, source: usize, target: usize) -> Option<PairAnswer> {
        let key = (self.scans.hash(source).to_owned(), self.scans.hash(target).to_owned());
        self.known.get(&key).cloned()
    }

    fn pairs(&self) -> Vec<(usize, usize)> {
        let mut numbers = BTreeMap::new();
        for number in (0..self.scans.len()).rev() {
            numbers.insert(self.scans.hash(number), number);
        }
        let both = |(s, t): &(String, String)| Some((*numbers.get(s.as_str())?, *numbers.get(t.as_str())?));
        self.known.keys().filter_map(both).filter(|(s, t)| s != t).collect()
    }

    fn keep(&self, source: usize, target: usize, answer: &PairAnswer) {
        let Some((_, written)) = &self.out else { return };
        let line = EdgeLine {
            source: self.scans.hash(source).to_owned(),
            target: self.scans.hash(target).to_owned(),
            source_name: self.scans.name(source),
            target_name: self.scans.name(target),
            target_from_source: answer.target_from_source.as_ref().map(matrix),
            probability: answer.probability,
            probability_of_fit: Some(answer.probability_of_fit),
            abstain: answer.abstain,
            others: answer.others.iter().map(OtherLine::of).collect(),
            options: self.options.clone(),
        };
        let _guard = interrupt::hold();
        let mut written = written.lock().unwrap_or_else(PoisonError::into_inner);
        if written.failed.is_none() {
            // Strings and finite numbers: this cannot fail.
            let mut text = serde_json::to_string(&line).unwrap_or_default();
            text.push('\n');
            written.failed =
                written.file.write_all(text.as_bytes()).and_then(|()| written.file.flush()).err();
        }
    }
}

/// The pairs of a file. The error is the line and what is wrong with it.
fn parse(text: &[u8], options: &str) -> Result<BTreeMap<(String, String), PairAnswer>, (usize, String)> {
    let mut known = BTreeMap::new();
    for (number, line) in (1..).zip(text.split(|b| *b == b'\n')) {
        if line.trim_ascii().is_empty() {
            continue;
        }
        let problem = |what: String| (number, what);
        let line: EdgeLine =
            serde_json::from_slice(line).map_err(|e| problem(format!("not a registered pair ({e})")))?;
        if line.options != options {
            return Err(problem(format!("made with other options ({})", line.options)));
        }
        let pose = match &line.target_from_source {
            Some(rows) => Some(rigid_of(rows).map_err(problem)?),
            None => None,
        };
        let probability_of_fit = line.probability_of_fit.unwrap_or(line.probability);
        if let Some(p) = [line.probability, probability_of_fit].into_iter().find(|p| !(0.0..=1.0).contains(p))
        {
            return Err(problem(format!("a probability of {p}; it must be from 0 to 1")));
        }
        let answer = PairAnswer {
            target_from_source: pose,
            probability: line.probability,
            probability_of_fit,
            abstain: line.abstain,
            others: line.others.iter().map(OtherLine::pose).collect::<Result<_, _>>().map_err(problem)?,
        };
        known.insert((line.source, line.target), answer);
    }
    Ok(known)
}

impl OtherLine {
    fn of(other: &OtherPose) -> Self {
        Self { target_from_source: matrix(&other.target_from_source), probability: other.probability }
    }

    fn pose(&self) -> Result<OtherPose, String> {
        let p = self.probability;
        if !(0.0..=1.0).contains(&p) {
            return Err(format!("a probability of {p}; it must be from 0 to 1"));
        }
        Ok(OtherPose { target_from_source: rigid_of(&self.target_from_source)?, probability: p })
    }
}

#[cfg(test)]
fn line_of(source: &str, target: &str, pose: &srrf_cloud::Rigid, options: &str) -> String {
    let line = EdgeLine {
        source: source.into(),
        target: target.into(),
        source_name: "a".into(),
        target_name: "b".into(),
        target_from_source: Some(matrix(pose)),
        probability: 0.9,
        probability_of_fit: Some(0.95),
        abstain: false,
        others: vec![OtherLine { target_from_source: matrix(pose), probability: 0.05 }],
        options: options.into(),
    };
    format!("{}\n", serde_json::to_string(&line).unwrap())
}

#[cfg(test)]
mod tests {
    use srrf_cloud::Rigid;

    use super::*;

    #[test]
    fn lines_come_back_and_others_are_refused() {
        let mut pose = Rigid::identity();
        pose.translation.x = 0.1 + 0.2;
        let text = line_of("aa", "bb", &pose, "o") + &line_of("bb", "cc", &pose, "o");
        let known = parse(text.as_bytes(), "o").unwrap();
        let first = &known[&("aa".to_owned(), "bb".to_owned())];
        assert_eq!((known.len(), first.target_from_source, first.probability), (2, Some(pose), 0.9));
        assert_eq!((first.probability_of_fit, first.others.len()), (0.95, 1));
        assert_eq!(first.others[0], OtherPose { target_from_source: pose, probability: 0.05 });
        // As versions wrote them that knew no other poses.
        let mut old: serde_json::Value = serde_json::from_str(text.lines().next().unwrap()).unwrap();
        let fields = old.as_object_mut().unwrap();
        assert!(fields.remove("others").is_some() && fields.remove("probability_of_fit").is_some());
        let known = parse(old.to_string().as_bytes(), "o").unwrap();
        let first = &known[&("aa".to_owned(), "bb".to_owned())];
        assert_eq!((first.probability_of_fit, first.others.len()), (0.9, 0));
        let error = |text: &str| parse(text.as_bytes(), "o").unwrap_err();
        assert_eq!(error(&(text.clone() + "hello\n")).0, 3);
        assert!(error(&line_of("aa", "bb", &pose, "p")).1.contains("other options"));
        assert!(error(&text.replace("0.9", "1.9")).1.contains("probability of 1.9"));
        let sheared = text.replace("[0.0,1.0,0.0,0.0]", "[0.0,2.0,0.0,0.0]");
        assert!(error(&sheared).1.contains("neither scale nor shear"), "{:?}", error(&sheared));
    }
}
