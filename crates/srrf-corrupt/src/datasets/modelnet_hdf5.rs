//! ModelNet40 in the HDF5 layout of `modelnet40_ply_hdf5_2048`.
//!
//! A folder with `train_files.txt` and `test_files.txt` (names of HDF5 files, one a line),
//! `shape_names.txt` (the classes in the order of their labels) and, for each HDF5 file, an
//! optional `*_id2file.json` (a list of `class/name`). Each file holds `data`, float
//! `[shapes, points, 3]`, and `label`, integer `[shapes, 1]`.

use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use srrf_cloud::CloudError;

use super::catalogue::{Catalogue, Entry};
use super::error::SourceError;
use super::source::Split;
use super::stored::{StoredClouds, StoredPoints};

/// Most bytes that one stored byte can unpack to: deflate's bound is 1032.
const MAX_EXPANSION: u64 = 1040;

/// Whether `path` is an HDF5 file or a folder in this layout.
pub(super) fn detect(path: &Path) -> bool {
    if path.is_file() {
        return has_extension(path, "h5") || has_extension(path, "hdf5");
    }
    [Split::Train, Split::Test].iter().any(|&split| !find_files(path, split).is_empty())
}

/// Loads the shapes of `split` from a folder, or all shapes of a single HDF5 file.
pub(super) fn open(path: &Path, split: Split) -> Result<StoredClouds, SourceError> {
    let (folder, files) = if path.is_file() {
        (path.parent().unwrap_or(Path::new(".")), vec![path.to_owned()])
    } else {
        (path, listed_files(path, split)?)
    };
    if files.is_empty() {
        return Err(SourceError::NotFound {
            path: path.to_owned(),
            looked: format!("the folder holds no ply_data_{split}*.h5"),
        });
    }
    let classes = class_names(folder)?;
    let loaded: Vec<Vec<Entry<StoredPoints>>> =
        files.par_iter().map(|file| load(file, &classes)).collect::<Result<_, _>>()?;
    let clouds: Vec<Entry<StoredPoints>> = loaded.into_iter().flatten().collect();
    let Some(points) = clouds.first().map(|c| c.item.len()) else {
        return Err(SourceError::layout(path, "there are no shapes in the HDF5 files"));
    };
    let part = if path.is_file() { "one file".to_owned() } else { format!("{split} split") };
    let description =
        format!("ModelNet40 (HDF5), {part}: {} shapes of {points} points, {}", clouds.len(), path.display());
    Ok(StoredClouds { path: path.to_owned(), clouds: Catalogue::new(description, clouds) })
}

/// The HDF5 files of the list of `split`, by file name alone since the folders in the lists are
/// often stale; without a list, or where none of its files is here, all that match by name.
fn listed_files(folder: &Path, split: Split) -> Result<Vec<PathBuf>, SourceError> {
    let list = folder.join(format!("{split}_files.txt"));
    if !list.is_file() {
        return Ok(find_files(folder, split));
    }
    let text = fs::read_to_string(&list).map_err(|e| SourceError::io(&list, e))?;
    let files: Vec<PathBuf> = text
        .lines()
        .filter_map(|line| line.trim().rsplit(['/', '\\']).next().filter(|name| !name.is_empty()))
        .map(|name| folder.join(name))
        .collect();
    if !files.iter().any(|f| f.is_file()) {
        return Ok(find_files(folder, split));
    }
    match files.iter().find(|f| !f.is_file()) {
        Some(missing) => Err(SourceError::layout(
            missing,
            format!("the file is missing, but {list:?} names it; fetch it, or delete its line"),
        )),
        None => Ok(files),
    }
}

/// `ply_data_<split>*.h5` in the order of their numbers.
fn find_files(folder: &Path, split: Split) -> Vec<PathBuf> {
    let prefix = format!("ply_data_{split}");
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| has_extension(path, "h5") && file_stem(path).starts_with(&prefix))
        .collect();
    files.sort_by_key(|path| (path.as_os_str().len(), path.clone()));
    files
}

fn class_names(folder: &Path) -> Result<Vec<String>, SourceError> {
    let path = folder.join("shape_names.txt");
    if !path.is_file() {
        return Ok(MODELNET40_CLASSES.iter().map(|name| (*name).to_owned()).collect());
    }
    let text = fs::read_to_string(&path).map_err(|e| SourceError::io(&path, e))?;
    Ok(text.lines().map(|line| line.trim().to_owned()).filter(|line| !line.is_empty()).collect())
}

fn load(path: &Path, classes: &[String]) -> Result<Vec<Entry<StoredPoints>>, SourceError> {
    let bytes = fs::read(path).map_err(|e| SourceError::io(path, e))?;
    let size = bytes.len() as u64;
    let file = hdf5_pure::File::from_bytes(bytes).map_err(|e| SourceError::hdf5(path, e))?;
    let hdf5 = |e| SourceError::hdf5(path, e);

    let data = file.dataset("data").map_err(hdf5)?;
    let shape = data.shape().map_err(hdf5)?;
    let [shapes, points, 3] = shape[..] else {
        let problem = format!("dataset `data` has shape {shape:?}, expected [shapes, points, 3]");
        return Err(SourceError::layout(path, problem));
    };
    if shapes.checked_mul(points).is_none_or(|n| n / MAX_EXPANSION > size) {
        let problem = format!("dataset `data` claims shape {shape:?}, more than {size} bytes can hold");
        return Err(SourceError::layout(path, problem));
    }
    let values = data.read_f32().map_err(hdf5)?;
    let (shapes, points) = (shapes as usize, points as usize);
    if values.len() != shapes * points * 3 {
        let problem = format!("dataset `data` of shape {shape:?} holds {} numbers", values.len());
        return Err(SourceError::layout(path, problem));
    }
    let labels = labels(&file, path, shapes)?;
    let names = shape_ids(path, shapes)?;

    let (values, _) = values.as_chunks::<3>();
    let mut clouds = Vec::with_capacity(shapes);
    for row in 0..shapes {
        let cloud = &values[row * points..(row + 1) * points];
        if let Some(index) = cloud.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
            return Err(SourceError::Shape {
                path: path.to_owned(),
                shape: row.to_string(),
                source: CloudError::NotFinite { index, point: cloud[index].map(f64::from) },
            });
        }
        if points == 0 {
            return Err(SourceError::layout(path, "the shapes of dataset `data` have no points"));
        }
        let id = names.get(row).cloned().unwrap_or_else(|| format!("{}_{row:04}", file_stem(path)));
        let class = labels.get(row).and_then(|&l| classes.get(l as usize)).cloned().unwrap_or_default();
        clouds.push(Entry::new(id, class, cloud.to_vec()));
    }
    Ok(clouds)
}

/// The labels, one a shape; none where the file has no dataset `label`.
fn labels(file: &hdf5_pure::File, path: &Path, shapes: usize) -> Result<Vec<u8>, SourceError> {
    let hdf5 = |e| SourceError::hdf5(path, e);
    if !file.root().datasets().map_err(hdf5)?.iter().any(|name| name == "label") {
        return Ok(Vec::new());
    }
    let dataset = file.dataset("label").map_err(hdf5)?;
    let shape = dataset.shape().map_err(hdf5)?;
    if shape.iter().try_fold(1u64, |n, &d| n.checked_mul(d)) != Some(shapes as u64) {
        let problem = format!("dataset `label` has shape {shape:?}, expected [{shapes}, 1]");
        return Err(SourceError::layout(path, problem));
    }
    dataset.read_u8().map_err(hdf5)
}

/// Names of the shapes from `ply_data_train_0_id2file.json` beside `ply_data_train0.h5`; none
/// where that file does not exist. The class folder and the extension are dropped.
fn shape_ids(path: &Path, shapes: usize) -> Result<Vec<String>, SourceError> {
    let stem = file_stem(path);
    let digits = stem.len() - stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    let (name, number) = stem.split_at(stem.len() - digits);
    let json = path.with_file_name(format!("{name}_{number}_id2file.json"));
    if !json.is_file() {
        return Ok(Vec::new());
    }
    let text = fs::read_to_string(&json).map_err(|e| SourceError::io(&json, e))?;
    let names: Vec<String> = serde_json::from_str(&text)
        .map_err(|e| SourceError::layout(&json, format!("not a list of names ({e}); it may be deleted")))?;
    if names.len() != shapes {
        let problem = format!("{} names for {shapes} shapes; it may be deleted", names.len());
        return Err(SourceError::layout(&json, problem));
    }
    Ok(names.iter().map(|name| file_stem(Path::new(name))).collect())
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

fn file_stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The classes in the order of their labels, for sets without `shape_names.txt`.
#[rustfmt::skip]
const MODELNET40_CLASSES: [&str; 40] = [
    "airplane", "bathtub", "bed", "bench", "bookshelf", "bottle", "bowl", "car", "chair", "cone",
    "cup", "curtain", "desk", "door", "dresser", "flower_pot", "glass_box", "guitar", "keyboard", "lamp",
    "laptop", "mantel", "monitor", "night_stand", "person", "piano", "plant", "radio", "range_hood", "sink",
    "sofa", "stairs", "stool", "table", "tent", "toilet", "tv_stand", "vase", "wardrobe", "xbox",
];

#[cfg(test)]
#[path = "modelnet_hdf5_tests.rs"]
mod tests;
