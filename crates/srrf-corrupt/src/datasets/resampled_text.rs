//! ModelNet40 as text: `modelnet40_normal_resampled`, 10,000 points with normals a shape.
//!
//! A folder with `modelnet40_train.txt` and `modelnet40_test.txt` (names such as `airplane_0001`,
//! one a line) and a folder for each class with `airplane_0001.txt`, lines of `x,y,z,nx,ny,nz`.

use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use rand::rngs::ChaCha8Rng;
use rand::seq::SliceRandom;

use srrf_cloud::PointCloud;
use srrf_cloud::io::{FormatError, IoError, parse_point};

use super::catalogue::{Catalogue, Entry, Listed, checked};
use super::error::SourceError;
use super::source::Split;

/// Shapes that are read from disk at each sampling, so that memory stays small.
#[derive(Debug)]
pub(super) struct ResampledText {
    folder: PathBuf,
    /// With the file of each shape.
    shapes: Catalogue<PathBuf>,
}

fn list_of(folder: &Path, split: Split) -> PathBuf {
    folder.join(format!("modelnet40_{split}.txt"))
}

/// Whether `folder` is in this layout.
pub(super) fn detect(folder: &Path) -> bool {
    [Split::Train, Split::Test].iter().any(|&split| list_of(folder, split).is_file())
}

/// Reads the list of `split`.
pub(super) fn open(folder: &Path, split: Split) -> Result<ResampledText, SourceError> {
    let list = list_of(folder, split);
    let text = fs::read_to_string(&list).map_err(|e| SourceError::io(&list, e))?;
    let (mut shapes, mut classes) = (Vec::new(), Vec::new());
    for (number, line) in text.lines().enumerate() {
        let name = line.trim();
        if name.is_empty() {
            continue;
        }
        let Some((class, _)) = name.rsplit_once('_') else {
            let problem = format!("line {}: {name:?} is no name such as airplane_0001", number + 1);
            return Err(SourceError::layout(&list, problem));
        };
        let file = folder.join(class).join(format!("{name}.txt"));
        classes.push(class);
        shapes.push(Entry::new(name.to_owned(), class.to_owned(), file));
    }
    if shapes.is_empty() {
        return Err(SourceError::layout(&list, "the list is empty"));
    }
    classes.sort_unstable();
    classes.dedup();
    let description = format!(
        "ModelNet40 (resampled text), {split} split: {} shapes of {} classes, {}",
        shapes.len(),
        classes.len(),
        folder.display()
    );
    Ok(ResampledText { folder: folder.to_owned(), shapes: Catalogue::new(description, shapes) })
}

/// At most the first `limit` points of a file.
fn read(path: &Path, limit: usize) -> Result<Vec<[f64; 3]>, SourceError> {
    let failed = |source| IoError::Read { path: path.to_owned(), source };
    let mut points = Vec::new();
    for (number, line) in BufReader::new(File::open(path).map_err(failed)?).lines().enumerate() {
        if points.len() == limit {
            break;
        }
        let line = line.map_err(failed)?;
        if line.trim().is_empty() {
            continue;
        }
        let point = parse_point(&line).map_err(|problem| IoError::Format {
            path: path.to_owned(),
            source: FormatError::Line { line: number + 1, problem },
        })?;
        points.push(point);
    }
    Ok(points)
}

impl Listed for ResampledText {
    type Item = PathBuf;

    fn catalogue(&self) -> &Catalogue<PathBuf> {
        &self.shapes
    }

    /// The first `count` points.
    fn draw(
        &self,
        shape: &Entry<PathBuf>,
        _index: usize,
        count: usize,
        _rng: &mut ChaCha8Rng,
    ) -> Result<PointCloud, SourceError> {
        checked(read(&shape.item, count)?, &self.folder, shape.id())
    }

    /// Two disjoint random parts of the stored points; each at most half of them.
    fn draw_two(
        &self,
        shape: &Entry<PathBuf>,
        _index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), SourceError> {
        let mut points = read(&shape.item, usize::MAX)?;
        let each = count.min(points.len() / 2);
        let (drawn, _) = points.partial_shuffle(rng, 2 * each);
        let (first, second) = drawn.split_at(each);
        let cloud = |points: &[[f64; 3]]| checked(points.to_vec(), &self.folder, shape.id());
        Ok((cloud(first)?, cloud(second)?))
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::datasets::{self, ShapeSource};

    fn rng() -> ChaCha8Rng {
        ChaCha8Rng::seed_from_u64(1)
    }

    fn folder() -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("modelnet40_test.txt"), "night_stand_0201\nbowl_0065\n\n").unwrap();
        for (class, name) in [("night_stand", "night_stand_0201"), ("bowl", "bowl_0065")] {
            fs::create_dir(root.path().join(class)).unwrap();
            let lines: Vec<String> = (0..31).map(|i| format!("{}.5,{i},-1e-2,0,0,1", i)).collect();
            fs::write(root.path().join(class).join(format!("{name}.txt")), lines.join("\n")).unwrap();
        }
        root
    }

    #[test]
    fn reads_lists_and_points() {
        let root = folder();
        let shapes = datasets::open(root.path(), Split::Test).unwrap();
        assert_eq!(shapes.len(), 2);
        assert_eq!((shapes.id(0).as_str(), shapes.class(0)), ("night_stand_0201", "night_stand"));
        assert!(shapes.is_symmetric(1) && !shapes.is_symmetric(0));
        let cloud = shapes.sample(1, 7, &mut rng()).unwrap();
        assert_eq!((cloud.len(), cloud.points()[6]), (7, [6.5, 6.0, -0.01]));
        assert_eq!(shapes.sample(1, 99, &mut rng()).unwrap().len(), 31);
        let (a, b) = shapes.sample_two(0, 99, &mut rng()).unwrap();
        assert_eq!((a.len(), b.len()), (15, 15));
        assert!(a.points().iter().all(|p| !b.points().contains(p)));
        assert!(shapes.sample(2, 7, &mut rng()).is_err());
    }

    #[test]
    fn damage_is_named() {
        let root = folder();
        let shapes = open(root.path(), Split::Test).unwrap();
        let file = root.path().join("bowl/bowl_0065.txt");
        let message = || shapes.sample(1, 9, &mut rng()).unwrap_err().to_string();
        fs::write(&file, "1,2,3,0,0,1\n4,5").unwrap();
        assert!(message().contains("bowl_0065.txt") && message().contains("line 2"), "{}", message());
        fs::write(&file, "1,2,3\nnan,2,3").unwrap();
        assert!(message().contains("bowl_0065: point 1"), "{}", message());
        fs::remove_file(&file).unwrap();
        assert!(message().contains("cannot read"));
        let train = open(root.path(), Split::Train).unwrap_err().to_string();
        assert!(train.contains("modelnet40_train.txt"), "{train}");
    }
}
