//! A folder of files with clouds, of any names and formats.

use std::path::{Path, PathBuf};

use rand::rngs::ChaCha8Rng;
use rand::seq::SliceRandom;

use srrf_cloud::PointCloud;
use srrf_cloud::io::{is_cloud_file, read_cloud};

use super::catalogue::{Catalogue, Entry, Listed, checked};
use super::error::SourceError;
use super::source::Split;

/// Depth to which folders in folders are searched.
const MAX_DEPTH: usize = 8;

/// Files that are read at each sampling, each brought to zero mean and unit radius: severities of
/// corruptions and ranges of translations are lengths in that frame.
///
/// The points of a scan are often in the order of the scan, so a sampling takes random ones.
#[derive(Debug)]
pub(super) struct Folder {
    /// With the path of each file. A shape is called by its path below the root, without extension.
    files: Catalogue<PathBuf>,
}

/// All files with clouds in `root` and the folders in it, or `root` itself if it is such a file;
/// `None` if there are none. Where `root` holds a folder named as the split, only that one counts.
pub(super) fn open(root: &Path, split: Split) -> Result<Option<Folder>, SourceError> {
    let split_folder = root.join(split.to_string());
    let (top, part) = if split_folder.is_dir() {
        (split_folder, format!(", {split} split"))
    } else {
        (root.to_owned(), String::new())
    };
    let mut paths = Vec::new();
    if top.is_file() {
        paths.extend(is_cloud_file(&top).then(|| top.clone()));
    } else {
        collect(&top, 0, &mut paths)?;
    }
    if paths.is_empty() {
        return Ok(None);
    }
    paths.sort();
    let files: Vec<Entry<PathBuf>> = paths
        .into_iter()
        .map(|path| {
            let below = path.strip_prefix(&top).ok().filter(|p| p.file_name().is_some());
            let below = below.unwrap_or(path.file_name().map_or(Path::new(""), Path::new)).with_extension("");
            let class = below.parent().and_then(Path::file_name).unwrap_or_default();
            let class = class.to_string_lossy().into_owned();
            Entry::new(below.to_string_lossy().into_owned(), class, path)
        })
        .collect();
    let description = format!("clouds in files{part}: {} shapes, {}", files.len(), root.display());
    Ok(Some(Folder { files: Catalogue::new(description, files) }))
}

/// Adds the files with clouds below `folder`. Links to folders are not followed, so there is an end.
fn collect(folder: &Path, depth: usize, paths: &mut Vec<PathBuf>) -> Result<(), SourceError> {
    let failed = |e| SourceError::io(folder, e);
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let (path, kind) = (entry.path(), entry.file_type().map_err(failed)?);
        if entry.file_name().to_string_lossy().starts_with('.') {
            continue;
        }
        if kind.is_dir() && depth < MAX_DEPTH {
            collect(&path, depth + 1, paths)?;
        } else if path.is_file() && is_cloud_file(&path) && !is_note(&path) {
            paths.push(path);
        }
    }
    Ok(())
}

/// Text files that lie beside clouds and are none.
fn is_note(path: &Path) -> bool {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    ["readme", "license", "licence", "notice", "notes"].contains(&stem.as_str())
}

/// `count` random points of the file, none of them twice.
fn drawn(path: &Path, count: usize, rng: &mut ChaCha8Rng) -> Result<Vec<[f64; 3]>, SourceError> {
    let (unit, _) = read_cloud(path)?.to_unit_sphere();
    let mut points = unit.into_points();
    Ok(points.partial_shuffle(rng, count).0.to_vec())
}

impl Listed for Folder {
    type Item = PathBuf;

    fn catalogue(&self) -> &Catalogue<PathBuf> {
        &self.files
    }

    /// `count` random points of the file, none of them twice.
    fn draw(
        &self,
        file: &Entry<PathBuf>,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<PointCloud, SourceError> {
        checked(drawn(&file.item, count, rng)?, &file.item, index)
    }

    /// Two disjoint random parts of the file; each at most half of it.
    fn draw_two(
        &self,
        file: &Entry<PathBuf>,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), SourceError> {
        let points = drawn(&file.item, count.saturating_mul(2), rng)?;
        let (first, second) = points.split_at(points.len() / 2);
        let second = &second[..first.len()];
        Ok((checked(first.to_vec(), &file.item, index)?, checked(second.to_vec(), &file.item, index)?))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use rand::SeedableRng;

    use super::*;
    use crate::datasets;
    use srrf_cloud::io::write_cloud;

    fn rng() -> ChaCha8Rng {
        ChaCha8Rng::seed_from_u64(1)
    }

    fn line(n: usize) -> PointCloud {
        PointCloud::new((0..n).map(|i| [i as f64, 0.5, -1.0]).collect()).unwrap()
    }

    #[test]
    fn finds_files_of_all_formats() {
        let root = tempfile::tempdir().unwrap();
        fs::create_dir_all(root.path().join("b/cup")).unwrap();
        write_cloud(&root.path().join("z.ply"), &line(21)).unwrap();
        write_cloud(&root.path().join("b/cup/one.npy"), &line(5)).unwrap();
        write_cloud(&root.path().join("b/two.off"), &line(6)).unwrap();
        fs::write(root.path().join("README.txt"), "Not a cloud.").unwrap();
        fs::write(root.path().join("picture.png"), "Not a cloud.").unwrap();
        let shapes = datasets::open(root.path(), Split::Test).unwrap();
        assert_eq!((0..shapes.len()).map(|i| shapes.id(i)).collect::<Vec<_>>(), ["b/cup/one", "b/two", "z"]);
        assert_eq!([shapes.class(0), shapes.class(1), shapes.class(2)], ["cup", "b", ""]);
        assert!(shapes.is_symmetric(0) && !shapes.is_symmetric(2));

        let cloud = shapes.sample(2, 13, &mut rng()).unwrap();
        assert_eq!(cloud.len(), 13);
        assert!(cloud.points().iter().any(|p| p[0] > 0.4), "points from all of the file");
        let all = shapes.sample(2, 21, &mut rng()).unwrap();
        assert!(all.centroid().norm() < 1e-12, "centred");
        assert!((all.points().iter().map(|p| p[0]).fold(0.0, f64::max) - 1.0).abs() < 1e-12, "unit radius");
        assert_eq!(shapes.sample(2, 99, &mut rng()).unwrap().len(), 21);
        for (count, each) in [(4, 4), (10, 10), (99, 10)] {
            let (a, b) = shapes.sample_two(2, count, &mut rng()).unwrap();
            assert_eq!((a.len(), b.len()), (each, each));
            assert!(a.points().iter().all(|p| !b.points().contains(p)));
        }

        let one = datasets::open(&root.path().join("z.ply"), Split::Train).unwrap();
        assert_eq!((one.len(), one.id(0).as_str(), one.class(0)), (1, "z", ""));
    }

    #[test]
    fn splits_and_damage() {
        let root = tempfile::tempdir().unwrap();
        for (split, n) in [("train", 5), ("test", 6)] {
            fs::create_dir(root.path().join(split)).unwrap();
            write_cloud(&root.path().join(split).join("a.xyz"), &line(n)).unwrap();
        }
        let test = datasets::open(root.path(), Split::Test).unwrap();
        assert_eq!((test.len(), test.sample(0, 99, &mut rng()).unwrap().len()), (1, 6));
        fs::write(root.path().join("test/a.xyz"), "1 2 3\nnan 0 0\n").unwrap();
        let message = test.sample(0, 9, &mut rng()).unwrap_err().to_string();
        assert!(message.contains("a.xyz") && message.contains("1 of 2 points"), "{message}");
    }
}
