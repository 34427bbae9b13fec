//! ModelNet40 as meshes: `class/train/name.off` and `class/test/name.off`.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use nalgebra::Vector3;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use srrf_cloud::io::{IoError, off};
use srrf_cloud::{PointCloud, Triangles, UnitSphere};

use super::catalogue::{Catalogue, Entry, Listed, checked};
use super::error::SourceError;
use super::source::Split;

/// Points from which the centre and radius of a mesh are estimated.
const FRAME_POINTS: usize = 4096;

/// Seed of those points.
const FRAME_SEED: u64 = 40;

/// Meshes that are read from disk at each sampling, so that memory stays small.
///
/// Points are drawn by area, and normalised to mean 0 and radius 1 as estimated once from 4,096
/// points of the surface: all samplings of a mesh share one frame.
#[derive(Debug)]
pub(super) struct ModelnetOff {
    meshes: Catalogue<MeshFile>,
}

#[derive(Debug)]
pub(super) struct MeshFile {
    path: PathBuf,
    frame: OnceLock<UnitSphere>,
}

/// The class folders in `folder` that hold meshes of `split`.
fn split_folders(folder: &Path, split: Split) -> Vec<(String, PathBuf)> {
    let mut folders: Vec<(String, PathBuf)> = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .filter_map(|entry| {
            let entry = entry.ok()?;
            let inner = entry.path().join(split.to_string());
            inner.is_dir().then(|| (entry.file_name().to_string_lossy().into_owned(), inner))
        })
        .collect();
    folders.sort();
    folders
}

fn meshes_in(folder: &Path) -> Result<Vec<PathBuf>, SourceError> {
    let entries = fs::read_dir(folder).map_err(|e| SourceError::io(folder, e))?;
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("off")))
        .collect();
    files.sort();
    Ok(files)
}

/// Whether `folder` is in this layout.
pub(super) fn detect(folder: &Path) -> bool {
    [Split::Train, Split::Test].iter().any(|&split| {
        split_folders(folder, split)
            .iter()
            .any(|(_, inner)| meshes_in(inner).is_ok_and(|files| !files.is_empty()))
    })
}

/// Lists the meshes of `split`.
pub(super) fn open(folder: &Path, split: Split) -> Result<ModelnetOff, SourceError> {
    let mut meshes = Vec::new();
    let classes = split_folders(folder, split);
    for (class, inner) in &classes {
        for path in meshes_in(inner)? {
            let id = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            meshes.push(Entry::new(id, class.clone(), MeshFile { path, frame: OnceLock::new() }));
        }
    }
    if meshes.is_empty() {
        let looked = format!("no class folder holds {split}/*.off");
        return Err(SourceError::NotFound { path: folder.to_owned(), looked });
    }
    let description = format!(
        "ModelNet40 (OFF meshes), {split} split: {} shapes of {} classes, {}",
        meshes.len(),
        classes.len(),
        folder.display()
    );
    Ok(ModelnetOff { meshes: Catalogue::new(description, meshes) })
}

impl MeshFile {
    fn load(&self, index: usize) -> Result<(Triangles, UnitSphere), SourceError> {
        let bytes =
            fs::read(&self.path).map_err(|source| IoError::Read { path: self.path.clone(), source })?;
        let parsed =
            off::parse_mesh(&bytes).map_err(|source| IoError::Format { path: self.path.clone(), source })?;
        let mut surface = Triangles::default();
        for corners in &parsed.triangles {
            let [a, b, c] = corners.map(|corner| Vector3::from(parsed.vertices[corner as usize]));
            surface.push(a, b, c);
        }
        if surface.area() <= 0.0 {
            return Err(SourceError::layout(&self.path, "the mesh has no surface to draw points from"));
        }
        let frame = match self.frame.get() {
            Some(frame) => *frame,
            None => {
                let mut rng = ChaCha8Rng::seed_from_u64(FRAME_SEED);
                let found = self.points(&surface, None, index, FRAME_POINTS, &mut rng)?.to_unit_sphere().1;
                *self.frame.get_or_init(|| found)
            }
        };
        Ok((surface, frame))
    }

    fn points(
        &self,
        surface: &Triangles,
        frame: Option<&UnitSphere>,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<PointCloud, SourceError> {
        let points = (0..count).map(|_| {
            let point = surface.sample(rng).into();
            frame.map_or(point, |frame| frame.apply(&point))
        });
        checked(points.collect(), &self.path, index)
    }
}

impl Listed for ModelnetOff {
    type Item = MeshFile;

    fn catalogue(&self) -> &Catalogue<MeshFile> {
        &self.meshes
    }

    fn draw(
        &self,
        mesh: &Entry<MeshFile>,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<PointCloud, SourceError> {
        let (surface, frame) = mesh.item.load(index)?;
        mesh.item.points(&surface, Some(&frame), index, count, rng)
    }

    fn draw_two(
        &self,
        mesh: &Entry<MeshFile>,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), SourceError> {
        let (surface, frame) = mesh.item.load(index)?;
        let first = mesh.item.points(&surface, Some(&frame), index, count, rng)?;
        Ok((first, mesh.item.points(&surface, Some(&frame), index, count, rng)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::datasets::{self, ShapeSource};

    /// A box of 2 x 4 x 6 about (10, 20, 30), its faces as quadrilaterals.
    fn write_box(path: &Path, header: &str) {
        let mut text = format!("{header}\n");
        for i in 0..8 {
            let at = |bit: usize, half: f64| if i >> bit & 1 == 0 { -half } else { half };
            text += &format!("{} {} {}\n", 10.0 + at(0, 1.0), 20.0 + at(1, 2.0), 30.0 + at(2, 3.0));
        }
        for face in ["0 1 3 2", "4 5 7 6", "0 1 5 4", "2 3 7 6", "0 2 6 4", "1 3 7 5"] {
            text += &format!("4 {face}\n");
        }
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    #[test]
    fn meshes_are_sampled_by_area_in_one_frame() {
        let root = tempfile::tempdir().unwrap();
        let set = root.path().join("ModelNet40");
        write_box(&set.join("bed/train/bed_0001.off"), "OFF8 6 0");
        write_box(&set.join("vase/test/vase_0009.off"), "OFF\n8 6 0");
        write_box(&set.join("bed/test/bed_0007.off"), "OFF\n8 6 0");
        assert_eq!(datasets::open(&set, Split::Train).unwrap().len(), 1);
        let shapes = datasets::open(root.path(), Split::Test).unwrap();
        assert_eq!(shapes.len(), 2);
        assert_eq!(
            (shapes.id(1).as_str(), shapes.class(1), shapes.is_symmetric(1)),
            ("vase_0009", "vase", true)
        );

        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (a, b) = shapes.sample_two(0, 4000, &mut rng).unwrap();
        let radius = 14f64.sqrt();
        for cloud in [&a, &b] {
            assert!(cloud.centroid().norm() < 0.06);
            let extent = cloud.points().iter().map(|p| p[2].abs()).fold(0.0, f64::max);
            assert!((extent - 3.0 / radius).abs() < 0.06, "{extent}");
            // Two ends of 8, and 72 around of which a fifteenth is that near to the ends, of 88.
            let ends = cloud.points().iter().filter(|p| p[2].abs() > 2.8 / radius).count() as f64;
            assert!((ends / 4000.0 - (16.0 + 72.0 / 15.0) / 88.0).abs() < 0.04, "{ends}");
        }
        assert!(a.points().iter().all(|p| !b.points().contains(p)));
    }

    #[test]
    fn damage_is_named() {
        let root = tempfile::tempdir().unwrap();
        let file = root.path().join("bed/test/bed_0007.off");
        write_box(&file, "OFF\n8 7 0");
        let message = |shapes: &dyn ShapeSource| {
            shapes.sample(0, 9, &mut ChaCha8Rng::seed_from_u64(1)).unwrap_err().to_string()
        };
        let shapes = open(root.path(), Split::Test).unwrap();
        assert!(message(&shapes).contains("bed_0007.off") && message(&shapes).contains("7 faces"));
        fs::write(&file, "OFF\n1 0 0\n0 0 0\n").unwrap();
        assert!(message(&shapes).contains("no surface"), "{}", message(&shapes));
        fs::remove_file(&file).unwrap();
        assert!(message(&shapes).contains("cannot read"));
        assert!(matches!(open(root.path(), Split::Train), Err(SourceError::NotFound { .. })));
    }
}
