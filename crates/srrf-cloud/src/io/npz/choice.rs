//! Which arrays of an archive are the cloud.

use std::io::Read;

use super::super::npy::{could_be_cloud, holds_numbers};
use super::super::{ColumnName, FormatError, ReadOptions, axes};
use super::Archive;

/// Names of the array that is the cloud.
const NAMES: [&str; 20] = [
    "points",
    "point",
    "xyz",
    "positions",
    "position",
    "pos",
    "pts",
    "coords",
    "coord",
    "coordinates",
    "cloud",
    "pointcloud",
    "point_cloud",
    "pcd",
    "pc",
    "pcl",
    "vertices",
    "verts",
    "data",
    "arr_0",
];
/// Names of arrays that have three columns and are no points.
const NO_POINTS: [&str; 24] = [
    "colors",
    "color",
    "colours",
    "colour",
    "rgb",
    "normals",
    "normal",
    "faces",
    "face",
    "triangles",
    "tri",
    "cells",
    "indices",
    "labels",
    "k",
    "r",
    "rotation",
    "intrinsics",
    "intrinsic",
    "pose",
    "extrinsics",
    "flow",
    "velocity",
    "velocities",
];

/// The arrays that are the cloud, by their places in the archive.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum NpzCloud {
    /// One array.
    One(usize),
    /// An array for each of x, y and z.
    Axes([usize; 3]),
}

impl NpzCloud {
    /// Whether the array at this place is one of them.
    pub fn is_of(&self, index: usize) -> bool {
        match self {
            Self::One(one) => *one == index,
            Self::Axes(axes) => axes.contains(&index),
        }
    }
}

struct NpzCandidate {
    index: usize,
    name: String,
    could_be: bool,
    /// Whether it holds single numbers, so that it may be a coordinate.
    numbers: bool,
}

/// Finds the cloud.
///
/// # Errors
/// [`FormatError::Unclear`] with the names of the arrays.
pub(super) fn choose(archive: &mut Archive, options: &ReadOptions) -> Result<NpzCloud, FormatError> {
    let arrays = candidates(archive);
    let names: Vec<&str> = arrays.iter().map(|array| array.name.as_str()).take(20).collect();
    if let Some(asked) = &options.array {
        let asked = asked.strip_suffix(".npy").unwrap_or(asked);
        let found = arrays.iter().find(|array| array.name == asked);
        return found.map(|array| NpzCloud::One(array.index)).ok_or_else(|| {
            FormatError::unclear(format!("there is no array {asked:?}; the arrays are {names:?}"), "--array")
        });
    }
    if let Some(axes) = asked_axes(&arrays, options) {
        return Ok(NpzCloud::Axes(axes));
    }
    let has = |list: &[&str], array: &NpzCandidate| list.contains(&array.name.to_ascii_lowercase().as_str());
    let named = || arrays.iter().filter(|array| has(&NAMES, array));
    let fitting = || arrays.iter().filter(|array| array.could_be);
    let both = || fitting().filter(|array| has(&NAMES, array));
    let coordinate = |array: &NpzCandidate| if array.numbers { array.name.clone() } else { String::new() };
    let coordinates: Vec<String> = arrays.iter().map(coordinate).collect();
    let three = axes::find(&coordinates);
    let one = match [both().count(), named().count(), fitting().count()] {
        [1, _, _] => both().next(),
        // Said by its name, so that its own error tells what is wrong with it.
        [0, 1, _] if !matches!(three, axes::Axes::Found(_)) => named().next(),
        [0, 0, 1] if !matches!(three, axes::Axes::Found(_)) => {
            fitting().next().filter(|array| !has(&NO_POINTS, array))
        }
        _ => None,
    };
    match (one, three) {
        (Some(one), _) => Ok(NpzCloud::One(one.index)),
        (None, axes::Axes::Found(axes)) if both().count() == 0 => {
            Ok(NpzCloud::Axes(axes.map(|place| arrays[place].index)))
        }
        (None, axes::Axes::Degrees) if fitting().count() == 0 => {
            Err(axes::choose(&coordinates, None).err().unwrap_or_else(|| unfit(&names)))
        }
        _ if fitting().count() == 0 => Err(unfit(&names)),
        _ => {
            let several: Vec<&str> = fitting().map(|array| array.name.as_str()).take(20).collect();
            let problem = match several.len() {
                1 => format!(
                    "of the arrays {names:?} only {several:?} has the shape of a cloud, and its name says another"
                ),
                _ => format!("of the arrays {names:?} more than one could be the cloud: {several:?}"),
            };
            Err(FormatError::unclear(problem, "--array"))
        }
    }
}

fn unfit(names: &[&str]) -> FormatError {
    FormatError::unclear(
        format!(
            "of the arrays {names:?} none has a shape [points, 3], and no three are called x, y and z; save one that has, \
             such as `points=numpy.stack([x, y, z], axis=1)`, or if three of them are the coordinates, such as x,y,z"
        ),
        "--columns",
    )
}

/// The arrays whose names were asked for as columns.
fn asked_axes(arrays: &[NpzCandidate], options: &ReadOptions) -> Option<[usize; 3]> {
    let place = |column: &ColumnName| match column {
        ColumnName::Name(name) => {
            arrays.iter().find(|array| array.numbers && array.name == *name).map(|array| array.index)
        }
        ColumnName::Number(_) => None,
    };
    let [x, y, z] = &options.columns.as_ref()?.0;
    Some([place(x)?, place(y)?, place(z)?])
}

fn candidates(archive: &mut Archive) -> Vec<NpzCandidate> {
    let mut arrays = Vec::new();
    for index in 0..archive.len() {
        let Ok(entry) = archive.by_index(index) else { continue };
        let Some(name) = entry.name().ok().and_then(|name| Some(name.strip_suffix(".npy")?.to_owned()))
        else {
            continue;
        };
        // Enough for the header of any array that could be a cloud.
        let mut begin = Vec::new();
        let read = entry.take(16_384).read_to_end(&mut begin).is_ok();
        let (could_be, numbers) = (read && could_be_cloud(&begin), read && holds_numbers(&begin));
        arrays.push(NpzCandidate { index, name, could_be, numbers });
    }
    arrays
}
