//! The merged cloud of a map: thinned by voxels, with the number of the scan of each point and what all scans have besides.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use clap::Args;
use srrf_align::{Map, Scans};
use srrf_args::Failure;
use srrf_args::files;
use srrf_args::words::count;
use srrf_cloud::io::{Attribute, AttributeValues, Outgoing, write_outgoing_to};
use srrf_cloud::{PointCloud, point_spacing};

use super::align_gather::Gathered;
use super::align_scans::{ScanAttributes, ScanFiles};

/// The attribute that is the number of the scan.
const SCAN: &str = "scan";
/// Indices of voxels up to here are exact.
const LARGEST_INDEX: f64 = 9.0e15;

/// What to write of the merged cloud.
#[derive(Debug, Clone, Args)]
pub struct MergedCloudArgs {
    /// Write the largest map as one cloud, PLY, with the number of the scan as the field `scan`, and colours, intensities and others that all its scans have
    #[arg(long, value_name = "FILE")]
    pub save: Option<PathBuf>,

    /// Side of the voxels of the merged cloud, of which each keeps one point [default: the spacing of the scans]
    #[arg(long, value_name = "LENGTH", requires = "save", value_parser = length)]
    pub voxel: Option<f64>,
}

fn length(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("a length above 0, in the unit of the scans".into()),
    }
}

impl MergedCloudArgs {
    /// Checks what can be checked before any work.
    ///
    /// # Errors
    /// [`Failure::usage`] for another format than PLY.
    pub fn check(&self) -> Result<(), Failure> {
        match &self.save {
            Some(path) if !files::is_stream(path) && !is_ply(path) => Err(Failure::usage(format!(
                "cannot write {path:?}: the merged cloud has the number of the scan as a field, and is written as PLY; name it `.ply`"
            ))),
            _ => Ok(()),
        }
    }
}

fn is_ply(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply"))
        || path.metadata().is_ok_and(|m| !m.is_file())
}

/// The point of a voxel that is nearest to its middle.
struct VoxelPoint {
    scan: u32,
    /// Its place in the scan.
    index: usize,
    point: [f64; 3],
    squared: f64,
}

/// What was written.
#[derive(Debug)]
pub struct Merged {
    /// Points, and those of the scans.
    pub points: [usize; 2],
    /// Names of attributes that came along, and of those that not all scans have.
    pub attributes: [Vec<String>; 2],
}

impl Merged {
    /// In words, for people.
    pub fn words(&self) -> String {
        let ([points, of], [with, without]) = (self.points, &self.attributes);
        let mut what = format!(
            "{} of {} points of the largest map, with the number of their scan",
            count(points),
            count(of)
        );
        if !with.is_empty() {
            what += &format!(" and {}", with.join(", "));
        }
        if !without.is_empty() {
            what += &format!("; without {}, which not all its scans have", without.join(", "));
        }
        what
    }
}

/// Writes the largest map to `path`, with what all its scans have besides: colours, intensities, normals.
///
/// # Errors
/// [`Failure`] for scans that cannot be read again, voxels far too small, and where it cannot be written.
pub fn merge(map: &Map, scans: &ScanFiles, args: &MergedCloudArgs, path: &Path) -> Result<Merged, Failure> {
    let members = &map.components[0];
    let size = match args.voxel {
        Some(size) => size,
        None => spacing(members, scans)?,
    };
    let mut voxels: HashMap<[i64; 3], VoxelPoint> = HashMap::new();
    let mut total = 0;
    for &number in members {
        let cloud = scans.cloud(number)?;
        total += cloud.len();
        let pose = &map.scans[number].map_from_scan;
        for (index, p) in cloud.points().iter().enumerate() {
            keep(&mut voxels, (number, index), pose.apply(p), size)?;
        }
    }
    let mut kept: Vec<([i64; 3], VoxelPoint)> = voxels.into_iter().collect();
    kept.sort_unstable_by_key(|(key, k)| (k.scan, *key));
    let mut gathered = Gathered::default();
    for &number in members {
        let places: Vec<usize> =
            kept.iter().filter(|(_, k)| k.scan as usize == number).map(|(_, k)| k.index).collect();
        let ScanAttributes { all, places: in_file } = scans.attributes(number)?;
        let places: Vec<usize> = places.iter().filter_map(|i| in_file.get(*i).copied()).collect();
        gathered.add(all, &places, &map.scans[number].map_from_scan);
    }
    let left_out = gathered.left_out;
    let mut attributes = gathered.kept;
    attributes.retain(|a| a.values.len() == kept.len());
    let names = attributes.iter().map(|a| a.name.clone()).collect();
    attributes.retain(|a| a.name != SCAN);
    attributes.push(Attribute {
        name: SCAN.into(),
        values: AttributeValues::U32(kept.iter().map(|(_, k)| k.scan).collect()),
    });
    let points: Vec<[f64; 3]> = kept.iter().map(|(_, k)| k.point).collect();
    let cloud = Outgoing { attributes: &attributes, extension: "ply", ..Outgoing::of_points(&points) };
    let mut bytes = Vec::new();
    write_outgoing_to(&mut bytes, "ply", &cloud)?;
    files::write(path, &bytes)?;
    Ok(Merged { points: [kept.len(), total], attributes: [names, left_out] })
}

fn keep(
    voxels: &mut HashMap<[i64; 3], VoxelPoint>,
    (number, index): (usize, usize),
    point: [f64; 3],
    size: f64,
) -> Result<(), Failure> {
    if point.iter().any(|c| (c / size).abs() > LARGEST_INDEX) {
        return Err(Failure::usage(format!(
            "--voxel {size} is too small for a map of this extent: choose larger ones"
        )));
    }
    let key = point.map(|c| (c / size).floor() as i64);
    let squared = (0..3).map(|c| (point[c] - (key[c] as f64 + 0.5) * size).powi(2)).sum();
    let next = VoxelPoint { scan: u32::try_from(number).unwrap_or(u32::MAX), index, point, squared };
    match voxels.entry(key) {
        std::collections::hash_map::Entry::Vacant(free) => {
            free.insert(next);
        }
        std::collections::hash_map::Entry::Occupied(mut taken) => {
            // The first of equals stays.
            if squared < taken.get().squared {
                taken.insert(next);
            }
        }
    }
    Ok(())
}

/// The median spacing of the scans.
fn spacing(members: &[usize], scans: &ScanFiles) -> Result<f64, Failure> {
    let mut all = Vec::new();
    for &number in members {
        let cloud: &PointCloud = &*scans.cloud(number)?;
        all.push(point_spacing(cloud.points()).map_err(|e| Failure::cloud(&scans.name(number), &e))?);
    }
    all.sort_by(f64::total_cmp);
    // Scans determine a rotation, so that their points do not all coincide.
    Ok(all.get(all.len() / 2).copied().filter(|s| *s > 0.0).unwrap_or(f64::MIN_POSITIVE.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_voxel_keeps_the_point_nearest_to_its_middle_and_its_scan() {
        let mut voxels = HashMap::new();
        for (scan, x) in [(0, 0.1), (1, 0.6), (2, 0.45), (3, 0.55), (4, -0.2)] {
            keep(&mut voxels, (scan, 7), [x, 0.5, 0.5], 1.0).unwrap();
        }
        assert_eq!((voxels.len(), voxels[&[0, 0, 0]].scan, voxels[&[-1, 0, 0]].scan), (2, 2, 4));
        let error = keep(&mut voxels, (0, 0), [1e9, 0.0, 0.0], 1e-12).unwrap_err().to_string();
        assert!(error.contains("--voxel") && error.contains("too small"), "{error}");
    }

    #[test]
    fn nothing_but_ply() {
        let args = |name: &str| MergedCloudArgs { save: Some(name.into()), voxel: None };
        assert!(args("m.PLY").check().is_ok() && args("-").check().is_ok());
        assert!(args("m.pcd").check().unwrap_err().to_string().contains("name it `.ply`"));
        assert!(
            length("0").is_err()
                && length("-1").is_err()
                && length("nan").is_err()
                && length("0.5") == Ok(0.5)
        );
    }
}
