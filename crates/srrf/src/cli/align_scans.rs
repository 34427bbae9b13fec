//! The scans of an alignment: files and folders, kept in memory or read again.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use sha2::{Digest, Sha256};
use srrf_align::Scans;
use srrf_args::Failure;
use srrf_args::files::{self, Input};
use srrf_args::surface::{DrawnHow, SurfaceFlag};
use srrf_cloud::io::{Attribute, ReadOptions};
use srrf_cloud::{PointCloud, Rigid};

use super::align_places::{ScanFile, apart, expanded};

/// Bytes of a point in memory.
const POINT: f64 = 24.0;
/// Bytes that a target takes that is made ready, besides its points three times over.
const READY: f64 = 60e6;

/// Scans in two units differ by so much at least: a metre has 39 inches.
const OTHER_UNIT: f64 = 25.0;

/// How the points of all meshes are drawn.
const SEED: u64 = 0;

/// How scans are read.
#[derive(Debug, Clone, Default)]
pub struct ScanReading {
    /// Of each file.
    pub options: ReadOptions,
    /// Bytes for all scans together: what does not fit is read again when it is needed.
    pub memory: Option<u64>,
    /// Whether meshes are their vertices.
    pub vertices: bool,
}

/// Scans by number.
#[derive(Debug)]
pub struct ScanFiles {
    reading: ScanReading,
    scans: Vec<OneScan>,
    budget: Option<f64>,
}

#[derive(Debug)]
struct OneScan {
    place: ScanFile,
    hash: String,
    points: usize,
    dropped: usize,
    /// Largest distance from the middle of the box.
    size: f64,
    /// Where its scanner stood, where the file says it.
    viewpoint: Option<[f64; 3]>,
    /// Whether its points were drawn from the surface of a mesh.
    drawn: bool,
    /// None where it is read again each time.
    cloud: Option<PointCloud>,
}

impl ScanFiles {
    /// Reads all scans once: those of an earlier result, then `given`, files and folders; each scan of a file that holds
    /// several. Keeps them in memory as far as half of the memory that may be taken allows.
    ///
    /// # Errors
    /// [`Failure::usage`] for what cannot be read or used.
    pub fn open(before: &[PathBuf], given: &[PathBuf], reading: &ScanReading) -> Result<Self, Failure> {
        let mut places: Vec<ScanFile> = before.iter().map(|path| ScanFile::of(path)).collect();
        for path in expanded(given)? {
            for place in apart(path, &reading.options) {
                if places.iter().any(|known| known.path == place.path) {
                    return Err(Failure::usage(format!(
                        "{:?} is there twice; name each scan once{}",
                        place.path,
                        if before.contains(&place.path) { ", and only new ones with --add" } else { "" }
                    )));
                }
                places.push(place);
            }
        }
        let budget = reading.memory.map(|bytes| bytes as f64);
        let keep_bytes = budget.map_or(f64::INFINITY, |b| 0.5 * b);
        let mut scans = Vec::new();
        let mut kept = 0.0;
        // A few at a time, so that those which are not kept are not in memory all at once.
        for some in places.chunks(rayon::current_num_threads().max(1)) {
            let read: Vec<OneScan> =
                some.par_iter().map(|place| read(place, reading)).collect::<Result<_, _>>()?;
            for mut scan in read {
                kept += POINT * scan.points as f64;
                if kept > keep_bytes {
                    kept -= POINT * scan.points as f64;
                    scan.cloud = None;
                }
                scans.push(scan);
            }
        }
        Ok(Self { reading: reading.clone(), scans, budget })
    }

    /// How files are read.
    pub fn options(&self) -> &ReadOptions {
        &self.reading.options
    }

    /// The file of one, and its number in it where that holds several.
    pub fn file(&self, number: usize) -> (&Path, Option<usize>) {
        let (file, scan) = &self.scans[number].place.file;
        (file, *scan)
    }

    /// First guesses by the poses in the files: the frame of the file that has most scans with poses. None where no file has
    /// two that differ.
    pub fn guesses(&self) -> Vec<Option<Rigid>> {
        let mut of: BTreeMap<&Path, Vec<(usize, &Rigid)>> = BTreeMap::new();
        for (number, scan) in self.scans.iter().enumerate() {
            if let Some(pose) = &scan.place.pose {
                of.entry(&scan.place.file.0).or_default().push((number, pose));
            }
        }
        // A file whose scans were never registered has the same pose everywhere.
        of.retain(|_, scans| scans.iter().any(|(_, pose)| *pose != scans[0].1));
        let best = of.values().rev().max_by_key(|scans| scans.len());
        let mut guesses = Vec::new();
        if let Some(best) = best {
            guesses.resize(self.len(), None);
            // Their points are read where the poses put them.
            best.iter().for_each(|(number, _)| guesses[*number] = Some(Rigid::identity()));
        }
        guesses
    }

    /// What the points of one have besides their place; nothing for a drawn surface.
    ///
    /// # Errors
    /// [`Failure::usage`] where the file cannot be read again.
    pub fn attributes(&self, number: usize) -> Result<ScanAttributes, Failure> {
        let scan = &self.scans[number];
        if scan.drawn {
            return Ok(ScanAttributes { all: Vec::new(), places: Vec::new() });
        }
        let input = files::read(&scan.place.path, None, self.reading.options.clone())?;
        let places = match &input.kept {
            Some(kept) => (0..kept.len()).filter(|i| kept[*i]).collect(),
            None => (0..input.cloud.len()).collect(),
        };
        Ok(ScanAttributes { all: input.file.attributes()?, places })
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.scans.len()
    }

    /// The path of one, as given.
    pub fn name(&self, number: usize) -> String {
        self.scans[number].place.path.display().to_string()
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
        let name = |scan: &OneScan| scan.place.path.display().to_string();
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
                let again = read(&self.scans[number].place, &self.reading)?;
                if again.hash != self.scans[number].hash {
                    return Err(Failure::usage(format!(
                        "{:?} has changed since it was read first; start again when nobody writes it",
                        self.scans[number].place.path
                    )));
                }
                match again.cloud {
                    Some(cloud) => Ok(Cow::Owned(cloud)),
                    None => Err(Failure::failed(format!(
                        "{:?}: its points are gone",
                        self.scans[number].place.path
                    ))),
                }
            }
        }
    }
}

/// Attributes of a file.
#[derive(Debug)]
pub struct ScanAttributes {
    /// One value for each point of the file.
    pub all: Vec<Attribute>,
    /// For each point of the cloud its place in the file.
    pub places: Vec<usize>,
}

fn read(place: &ScanFile, reading: &ScanReading) -> Result<OneScan, Failure> {
    let mut input = files::read_solid(&place.path, None, reading.options.clone())?;
    let drawn = SurfaceFlag { vertices: reading.vertices }.draw_alone(&mut input, SEED)?;
    let is_drawn = drawn.is_some_and(|drawn| matches!(drawn.how, DrawnHow::Points(..)));
    let Input { cloud, dropped, viewpoint, .. } = input;
    let middle = cloud.middle();
    let size =
        cloud.points().iter().map(|p| (nalgebra::Vector3::from(*p) - middle).norm()).fold(0.0, f64::max);
    let hash = hash_of(&cloud);
    Ok(OneScan {
        place: place.clone(),
        hash,
        points: cloud.len(),
        dropped,
        size,
        viewpoint,
        drawn: is_drawn,
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

#[cfg(test)]
mod tests {
    use srrf_cloud::io::write_cloud;

    use super::*;

    fn open(given: &[PathBuf], budget: Option<u64>) -> Result<ScanFiles, Failure> {
        ScanFiles::open(&[], given, &ScanReading { memory: budget, ..ScanReading::default() })
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
        let scans = open(std::slice::from_ref(&path), Some(100)).unwrap();
        assert!(scans.scans[0].cloud.is_none() && scans.at_once(8) == 1);
        assert_eq!(scans.cloud(0).unwrap().len(), 9);
        write_cloud(&path, &cloud(10)).unwrap();
        assert!(scans.cloud(0).unwrap_err().to_string().contains("has changed"));
    }
}
