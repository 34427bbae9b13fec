//! The scans of an alignment: files and folders, kept in memory or read again.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use sha2::{Digest, Sha256};
use srrf_align::Scans;
use srrf_args::Failure;
use srrf_args::files::{self, Input};
use srrf_cloud::PointCloud;
use srrf_cloud::io::{ReadOptions, is_cloud_file};

/// Bytes of a point in memory.
const POINT: f64 = 24.0;
/// Bytes that a target takes that is made ready, besides its points three times over.
const READY: f64 = 60e6;

/// Scans in two units differ by so much at least: a metre has 39 inches.
const OTHER_UNIT: f64 = 25.0;

/// Scans by number.
#[derive(Debug)]
pub struct ScanFiles {
    options: ReadOptions,
    scans: Vec<OneScan>,
    budget: Option<f64>,
}

#[derive(Debug)]
struct OneScan {
    path: PathBuf,
    hash: String,
    points: usize,
    dropped: usize,
    /// Largest distance from the middle of the box.
    size: f64,
    /// Where its scanner stood, where the file says it.
    viewpoint: Option<[f64; 3]>,
    /// None where it is read again each time.
    cloud: Option<PointCloud>,
}

impl ScanFiles {
    /// Reads all scans once: those of an earlier result, then `given`, files and folders. Keeps them in memory as far as
    /// half of the budget (bytes) allows.
    ///
    /// # Errors
    /// [`Failure::usage`] for what cannot be read or used.
    pub fn open(
        before: &[PathBuf],
        given: &[PathBuf],
        budget: Option<f64>,
        options: &ReadOptions,
    ) -> Result<Self, Failure> {
        let mut paths = before.to_vec();
        for path in expanded(given)? {
            if paths.contains(&path) {
                return Err(Failure::usage(format!(
                    "{path:?} is there twice; name each scan once{}",
                    if before.contains(&path) { ", and only new ones with --add" } else { "" }
                )));
            }
            paths.push(path);
        }
        let keep_bytes = budget.map_or(f64::INFINITY, |b| 0.5 * b);
        let mut scans = Vec::new();
        let mut kept = 0.0;
        // A few at a time, so that those which are not kept are not in memory all at once.
        for some in paths.chunks(rayon::current_num_threads().max(1)) {
            let read: Vec<OneScan> =
                some.par_iter().map(|path| read(path, options)).collect::<Result<_, _>>()?;
            for mut scan in read {
                kept += POINT * scan.points as f64;
                if kept > keep_bytes {
                    kept -= POINT * scan.points as f64;
                    scan.cloud = None;
                }
                scans.push(scan);
            }
        }
        Ok(Self { options: options.clone(), scans, budget })
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.scans.len()
    }

    /// The path of one, as given.
    pub fn name(&self, number: usize) -> String {
        self.scans[number].path.display().to_string()
    }

    /// All paths.
    pub fn names(&self) -> Vec<String> {
        (0..self.len()).map(|i| self.name(i)).collect()
    }

    /// Hash of the points of one.
    pub fn hash(&self, number: usize) -> &str {
        &self.scans[number].hash
    }

    /// Points of one, and those left out for NaN or infinity.
    pub fn points(&self, number: usize) -> (usize, usize) {
        (self.scans[number].points, self.scans[number].dropped)
    }

    /// The smallest and the largest scan, and the factor between them, where it is that of a change of units.
    pub fn far_apart(&self) -> Option<(String, String, f64)> {
        let order = |a: &&OneScan, b: &&OneScan| a.size.total_cmp(&b.size);
        let (small, large) = (self.scans.iter().min_by(order)?, self.scans.iter().max_by(order)?);
        let factor = large.size / small.size;
        let name = |scan: &OneScan| scan.path.display().to_string();
        (factor > OTHER_UNIT).then(|| (name(small), name(large), factor))
    }

    /// How many targets may be ready at once: one a thread, or as many as the rest of the budget takes.
    pub fn at_once(&self, threads: usize) -> usize {
        let Some(budget) = self.budget else { return threads };
        let largest = self.scans.iter().map(|s| s.points).max().unwrap_or(0) as f64;
        let each = READY + 6.0 * POINT * largest;
        ((0.4 * budget / each) as usize).clamp(1, threads)
    }
}

impl Scans for ScanFiles {
    type Error = Failure;

    fn count(&self) -> usize {
        self.len()
    }

    fn viewpoint(&self, number: usize) -> Option<[f64; 3]> {
        self.scans[number].viewpoint
    }

    fn cloud(&self, number: usize) -> Result<Cow<'_, PointCloud>, Failure> {
        match &self.scans[number].cloud {
            Some(cloud) => Ok(Cow::Borrowed(cloud)),
            None => {
                let again = read(&self.scans[number].path, &self.options)?;
                if again.hash != self.scans[number].hash {
                    return Err(Failure::usage(format!(
                        "{:?} has changed since it was read first; start again when nobody writes it",
                        self.scans[number].path
                    )));
                }
                match again.cloud {
                    Some(cloud) => Ok(Cow::Owned(cloud)),
                    None => {
                        Err(Failure::failed(format!("{:?}: its points are gone", self.scans[number].path)))
                    }
                }
            }
        }
    }
}

fn read(path: &Path, options: &ReadOptions) -> Result<OneScan, Failure> {
    let Input { cloud, dropped, viewpoint, .. } = files::read_solid(path, None, options.clone())?;
    let middle = cloud.middle();
    let size =
        cloud.points().iter().map(|p| (nalgebra::Vector3::from(*p) - middle).norm()).fold(0.0, f64::max);
    let hash = hash_of(&cloud);
    Ok(OneScan {
        path: path.to_owned(),
        hash,
        points: cloud.len(),
        dropped,
        size,
        viewpoint,
        cloud: Some(cloud),
    })
}

/// The first 16 bytes of the SHA-256 of the coordinates, in hexadecimal.
fn hash_of(cloud: &PointCloud) -> String {
    let mut hash = Sha256::new();
    for point in cloud.points() {
        point.iter().for_each(|c| hash.update(c.to_le_bytes()));
    }
    hash.finalize().iter().take(16).map(|b| format!("{b:02x}")).collect()
}

/// The files of folders, by name; files as they are.
fn expanded(given: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut paths = Vec::new();
    for path in given {
        if files::is_stream(path) {
            return Err(Failure::usage("a scan is `-`: the scans of a map are files; name them".into()));
        }
        if !path.is_dir() {
            paths.push(path.clone());
            continue;
        }
        let unreadable = |e| Failure::usage(format!("cannot read the folder {path:?}: {e}"));
        let mut inside = Vec::new();
        for entry in std::fs::read_dir(path).map_err(unreadable)? {
            let entry = entry.map_err(unreadable)?.path();
            if entry.is_file() && is_cloud_file(&entry) {
                inside.push(entry);
            }
        }
        if inside.is_empty() {
            return Err(Failure::usage(format!(
                "the folder {path:?} holds no file whose extension names a format of clouds; name the files, or another folder"
            )));
        }
        inside.sort();
        paths.extend(inside);
    }
    Ok(paths)
}

#[cfg(test)]
mod tests {
    use srrf_cloud::io::write_cloud;

    use super::*;

    fn open(given: &[PathBuf], budget: Option<f64>) -> Result<ScanFiles, Failure> {
        ScanFiles::open(&[], given, budget, &ReadOptions::default())
    }

    fn cloud(n: usize) -> PointCloud {
        PointCloud::new((0..n).map(|i| [i as f64, (i * i % 7) as f64, (i % 3) as f64]).collect()).unwrap()
    }

    #[test]
    fn folders_give_their_clouds_by_name_and_nothing_twice() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b.ply", "a.xyz"] {
            write_cloud(&folder.path().join(name), &cloud(9)).unwrap();
        }
        std::fs::write(folder.path().join("notes.md"), "hello").unwrap();
        let given = [folder.path().to_owned()];
        let scans = open(&given, None).unwrap();
        assert!(scans.name(0).ends_with("a.xyz") && scans.name(1).ends_with("b.ply"));
        assert_eq!((scans.len(), scans.points(1), scans.hash(0)), (2, (9, 0), scans.hash(1)));
        let twice = [folder.path().to_owned(), folder.path().join("b.ply")];
        let error = open(&twice, None).unwrap_err().to_string();
        assert!(error.contains("b.ply") && error.contains("twice"), "{error}");
        let empty = tempfile::tempdir().unwrap();
        let error = open(&[empty.path().to_owned()], None).unwrap_err().to_string();
        assert!(error.contains("holds no file"), "{error}");
    }

    #[test]
    fn scans_in_two_units_are_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let paths = [1.0, 2.0, 40.0].map(|factor| {
            let path = folder.path().join(format!("{factor}.ply"));
            let points = cloud(9).points().iter().map(|p| p.map(|c| factor * c)).collect();
            write_cloud(&path, &PointCloud::new(points).unwrap()).unwrap();
            path
        });
        assert_eq!(open(&paths[..2], None).unwrap().far_apart(), None);
        let (small, large, factor) = open(&paths, None).unwrap().far_apart().unwrap();
        assert!(small.ends_with("1.ply") && large.ends_with("40.ply") && (factor - 40.0).abs() < 1e-9);
    }

    #[test]
    fn what_does_not_fit_is_read_again_and_a_change_is_seen() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        write_cloud(&path, &cloud(9)).unwrap();
        let scans = open(std::slice::from_ref(&path), Some(100.0)).unwrap();
        assert!(scans.scans[0].cloud.is_none() && scans.at_once(8) == 1);
        assert_eq!(scans.cloud(0).unwrap().len(), 9);
        write_cloud(&path, &cloud(10)).unwrap();
        assert!(scans.cloud(0).unwrap_err().to_string().contains("has changed"));
    }
}
