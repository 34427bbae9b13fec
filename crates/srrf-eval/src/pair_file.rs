//! Files of pairs: `--pairs FILE.npz` and `--export-pairs FILE.npz`.
//!
//! For each group of `n` pairs the file holds
//!
//! | array | shape | |
//! |---|---|---|
//! | `<group>_x` | `[n, N, 3]` | sources |
//! | `<group>_y` | `[n, M, 3]` | targets |
//! | `<group>_R` | `[n, 3, 3]` | true rotations |
//! | `<group>_t` | `[n, 3]` | true translations: `target = R source + t` |
//! | `<group>_clean` | `[n, K, 3]` | optional: the clean shape in the source frame |
//! | `<group>_symmetric` | `[n]` | optional: whether the shape is symmetric about an axis |
//! | `<group>_x_origin`, `<group>_y_origin` | `[n, N]`, `[n, M]` | optional: number of the clean point that each point is, -1 for none; points of equal number correspond |
//!
//! as `float32` or `float64`, in C or Fortran order. Exported files hold `float64`.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Vector3};
use srrf_cloud::io::{Array, ArrayError, NpzArrays, NpzWriter, ReadOptions, read_npz, write_atomically};
use srrf_cloud::{PointCloud, Rigid};
use srrf_corrupt::Pair;

use crate::EvalError;
use crate::pairs::{EvalPair, Group, PairSource};

/// Largest deviation of `R^T R` from the identity, per entry, in a true rotation: well above
/// `float32` rounding.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// The pairs of a file, in memory.
#[derive(Debug)]
pub struct PairFile {
    path: PathBuf,
    groups: Vec<Group>,
    contents: Vec<GroupArrays>,
}

#[derive(Debug)]
struct GroupArrays {
    x: Array,
    y: Array,
    poses: Vec<Rigid>,
    clean: Option<Array>,
    symmetric: Option<Array>,
    x_origin: Option<Array>,
    y_origin: Option<Array>,
}

impl PairFile {
    /// Reads and checks a file of pairs, within the memory that the options allow.
    ///
    /// # Errors
    /// [`ArrayError`] which names the file, the array, what is wrong and what is expected.
    pub fn read(path: &Path, options: &ReadOptions) -> Result<Self, ArrayError> {
        let NpzArrays { names: have, mut arrays } = read_npz(path, options)?;
        let mut names: Vec<&str> = Vec::new();
        for array in &have {
            let group = ["_x", "_y", "_R", "_t"].iter().find_map(|end| array.strip_suffix(end));
            names.extend(group.filter(|group| !names.contains(group)));
        }
        let bad = |array: &str, problem: String| ArrayError::Array {
            path: path.to_owned(),
            array: array.to_owned(),
            problem,
        };
        if names.is_empty() {
            let problem = format!(
                "no group of pairs: expected arrays <group>_x, <group>_y, <group>_R and <group>_t, found {have:?}"
            );
            return Err(bad("<group>_x", problem));
        }
        let (mut groups, mut contents) = (Vec::new(), Vec::new());
        for name in names {
            let content =
                GroupArrays::take(&mut arrays, name).map_err(|(array, problem)| bad(&array, problem))?;
            groups.push(Group { corruption: name.to_owned(), severity: 0, pairs: content.poses.len() });
            contents.push(content);
        }
        Ok(Self { path: path.to_owned(), groups, contents })
    }
}

/// Name of an array and what is wrong with it.
type ArrayProblem = (String, String);

impl GroupArrays {
    /// Takes and checks the arrays of one group.
    fn take(arrays: &mut BTreeMap<String, Array>, group: &str) -> Result<Self, ArrayProblem> {
        let x = take(arrays, group, "x", &[None, None, Some(3)])?;
        let n = x.shape[0];
        let y = take(arrays, group, "y", &[Some(n), None, Some(3)])?;
        let rotations = take(arrays, group, "R", &[Some(n), Some(3), Some(3)])?;
        let translations = take(arrays, group, "t", &[Some(n), Some(3)])?;
        let mut optional = |suffix: &str, shape: &[Option<usize>]| {
            let present = arrays.contains_key(&format!("{group}_{suffix}"));
            present.then(|| take(arrays, group, suffix, shape)).transpose()
        };
        let clean = optional("clean", &[Some(n), None, Some(3)])?;
        let symmetric = optional("symmetric", &[Some(n)])?;
        let x_origin = optional("x_origin", &[Some(n), Some(x.shape[1])])?;
        let y_origin = optional("y_origin", &[Some(n), Some(y.shape[1])])?;
        let poses = poses(&rotations, &translations).map_err(|problem| (format!("{group}_R"), problem))?;
        Ok(Self { x, y, poses, clean, symmetric, x_origin, y_origin })
    }
}

/// Takes the array `<group>_<suffix>`, which must have the shape `expected` (`None`: any length),
/// some entries, and finite ones only.
fn take(
    arrays: &mut BTreeMap<String, Array>,
    group: &str,
    suffix: &str,
    expected: &[Option<usize>],
) -> Result<Array, ArrayProblem> {
    let name = format!("{group}_{suffix}");
    let Some(array) = arrays.remove(&name) else {
        return Err((name, format!("is missing; expected shape {}", describe(expected))));
    };
    let fits = array.shape.len() == expected.len()
        && array.shape.iter().zip(expected).all(|(&have, want)| want.is_none_or(|w| w == have));
    if !fits {
        let problem = format!("has shape {:?}, expected {}", array.shape, describe(expected));
        return Err((name, problem));
    }
    if array.values.is_empty() {
        return Err((name, format!("has shape {:?}: it is empty", array.shape)));
    }
    if let Some(index) = array.values.iter().position(|v| !v.is_finite()) {
        let pair = index / (array.values.len() / array.shape[0]);
        let value = array.values[index];
        return Err((name, format!("pair {pair} holds {value}: every number must be finite")));
    }
    Ok(array)
}

/// A shape in words, such as `[7, any, 3]`.
fn describe(shape: &[Option<usize>]) -> String {
    let axes: Vec<String> = shape.iter().map(|d| d.map_or("any".into(), |d| d.to_string())).collect();
    format!("[{}]", axes.join(", "))
}

/// The true poses, whose rotations are checked and rid of rounding.
fn poses(rotations: &Array, translations: &Array) -> Result<Vec<Rigid>, String> {
    let rows = rotations.values.chunks_exact(9).zip(translations.values.chunks_exact(3));
    rows.enumerate()
        .map(|(pair, (r, t))| {
            let rotation = checked_rotation(&Matrix3::from_row_slice(r))
                .map_err(|problem| format!("pair {pair} {problem}"))?;
            Ok(Rigid { rotation, translation: Vector3::from_row_slice(t) })
        })
        .collect()
}

/// The rotation nearest to `matrix`, which must be one up to rounding.
///
/// # Errors
/// In words, where it is not.
pub(crate) fn checked_rotation(matrix: &Matrix3<f64>) -> Result<Matrix3<f64>, String> {
    let deviation = (matrix.transpose() * matrix - Matrix3::identity()).abs().max();
    let determinant = matrix.determinant();
    if deviation.is_nan() || deviation > ROTATION_TOLERANCE || determinant < 0.0 {
        return Err(format!(
            "is not a rotation: R^T R is off the identity by {deviation:.2e} and det R = {determinant:.4}"
        ));
    }
    Rigid::nearest_rotation(matrix).ok_or_else(|| "is not a rotation".to_owned())
}

impl PairSource for PairFile {
    fn description(&self) -> String {
        let pairs: usize = self.groups.iter().map(|g| g.pairs).sum();
        let (groups, path) = (self.groups.len(), self.path.display());
        format!("{pairs} pairs in {groups} group{}, {path}", if groups == 1 { "" } else { "s" })
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn has_oracle(&self) -> bool {
        self.contents.iter().all(|c| c.x_origin.is_some() && c.y_origin.is_some())
    }

    fn pair(&self, group: usize, item: usize) -> Result<EvalPair, EvalError> {
        let arrays = &self.contents[group];
        let name = &self.groups[group].corruption;
        let cloud = |array: &Array, suffix: &str| {
            PointCloud::new(row(array, item)).map_err(|e| {
                EvalError::from(ArrayError::Array {
                    path: self.path.clone(),
                    array: format!("{name}_{suffix}"),
                    problem: format!("pair {item}: {e}"),
                })
            })
        };
        let pair = Pair {
            source: cloud(&arrays.x, "x")?,
            target: cloud(&arrays.y, "y")?,
            target_from_source: arrays.poses[item],
            source_origin: arrays.x_origin.as_ref().map(|a| origins(a, item)),
            target_origin: arrays.y_origin.as_ref().map(|a| origins(a, item)),
            corruption: None,
            id: format!("{name}_{item}"),
            class: String::new(),
            symmetric: arrays.symmetric.as_ref().is_some_and(|a| a.values[item] != 0.0),
        };
        Ok(EvalPair { pair, clean: arrays.clean.as_ref().map(|a| row(a, item)) })
    }
}

/// Row `item` of an array of shape `[n, k, 3]`.
fn row(array: &Array, item: usize) -> Vec<[f64; 3]> {
    let length = array.shape[1];
    let (points, _) = array.values.as_chunks::<3>();
    points[item * length..(item + 1) * length].to_vec()
}

/// Row `item` of an array of origins; negative numbers stand for none.
fn origins(array: &Array, item: usize) -> Vec<Option<u32>> {
    let length = array.shape[1];
    let row = &array.values[item * length..(item + 1) * length];
    row.iter().map(|&v| (v >= 0.0).then_some(v as u32)).collect()
}

/// Writes all pairs of `source` to `path`, first under a temporary name. `after_pair` is called
/// after each pair.
///
/// # Errors
/// [`EvalError`] where a pair cannot be made or the file cannot be written, and where the clouds of
/// one group differ in size.
pub fn export(source: &dyn PairSource, path: &Path, after_pair: &mut dyn FnMut()) -> Result<(), EvalError> {
    // What goes wrong besides the writing; `None` until the file is open.
    let mut outcome = None;
    let written = write_atomically(path, |out| {
        let result = export_to(source, out, after_pair);
        let failed = result.is_err();
        outcome = Some(result);
        if failed { Err(io::Error::other("the export was given up")) } else { Ok(()) }
    });
    let output = |source| EvalError::Output { path: path.to_owned(), source };
    match (outcome, written) {
        (None, Err(source)) => Err(EvalError::ExportPath { path: path.to_owned(), source }),
        (Some(Err(ExportError::Pair(error))), _) => Err(error),
        (Some(Err(ExportError::Write(source))), _) => Err(output(source)),
        (_, written) => written.map_err(output),
    }
}

/// What stops an export: a pair, or the writing.
enum ExportError {
    Pair(EvalError),
    Write(io::Error),
}

impl From<io::Error> for ExportError {
    fn from(error: io::Error) -> Self {
        Self::Write(error)
    }
}

fn export_to(
    source: &dyn PairSource,
    out: &mut dyn io::Write,
    after_pair: &mut dyn FnMut(),
) -> Result<(), ExportError> {
    let mut npz = NpzWriter::new(out);
    for (index, group) in source.groups().iter().enumerate() {
        let pairs = (0..group.pairs)
            .map(|item| {
                let pair = source.pair(index, item);
                after_pair();
                pair
            })
            .collect::<Result<Vec<_>, _>>()
            .map_err(ExportError::Pair)?;
        write_group(&mut npz, &group.name(), &pairs)?;
    }
    npz.finish()?;
    Ok(())
}

/// Writes the arrays of one group.
fn write_group<W: io::Write>(
    npz: &mut NpzWriter<W>,
    name: &str,
    pairs: &[EvalPair],
) -> Result<(), ExportError> {
    let n = pairs.len();
    let mut array = |suffix: &str, shape: &[usize], values: Vec<f64>| {
        npz.array(&format!("{name}_{suffix}"), shape, &values)
    };
    let points = |suffix: &str, clouds: Vec<&[[f64; 3]]>| {
        let length = clouds[0].len();
        if clouds.iter().any(|c| c.len() != length) {
            let (group, array) = (name.to_owned(), format!("{name}_{suffix}"));
            return Err(ExportError::Pair(EvalError::Ragged { group, array }));
        }
        Ok((length, clouds.iter().flat_map(|c| c.as_flattened()).copied().collect::<Vec<f64>>()))
    };
    let (sources, x) = points("x", pairs.iter().map(|p| p.pair.source.points()).collect())?;
    let (targets, y) = points("y", pairs.iter().map(|p| p.pair.target.points()).collect())?;
    array("x", &[n, sources, 3], x)?;
    array("y", &[n, targets, 3], y)?;
    let poses = || pairs.iter().map(|p| p.pair.target_from_source);
    // nalgebra stores columns: the transpose gives rows.
    array(
        "R",
        &[n, 3, 3],
        poses().flat_map(|p| <[[f64; 3]; 3]>::from(p.rotation.transpose())).flatten().collect(),
    )?;
    array("t", &[n, 3], poses().flat_map(|p| <[f64; 3]>::from(p.translation)).collect())?;
    array("symmetric", &[n], pairs.iter().map(|p| f64::from(p.pair.symmetric)).collect())?;

    let clean: Vec<&[[f64; 3]]> = pairs.iter().filter_map(|p| p.clean.as_deref()).collect();
    if clean.len() == n {
        let (length, values) = points("clean", clean)?;
        array("clean", &[n, length, 3], values)?;
    }
    let origins = |of: fn(&Pair) -> &Option<Vec<Option<u32>>>| -> Vec<f64> {
        let rows = pairs.iter().filter_map(|p| of(&p.pair).as_deref());
        rows.flatten().map(|origin| origin.map_or(-1.0, f64::from)).collect()
    };
    let (x_origin, y_origin) = (origins(|p| &p.source_origin), origins(|p| &p.target_origin));
    if x_origin.len() == n * sources && y_origin.len() == n * targets {
        array("x_origin", &[n, sources], x_origin)?;
        array("y_origin", &[n, targets], y_origin)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
