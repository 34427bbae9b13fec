//! Transforms made by any other tool on the same pairs: `--transforms FILE`.
//!
//! A transform maps source to target, `target = R source + t`. Accepted are
//!
//! - `.npz`: for each group, `<group>_R` `[n, 3, 3]` and `<group>_t` `[n, 3]`, or `<group>_T`
//!   `[n, 4, 4]` or `[n, 3, 4]`;
//! - `.npy`: one array `[n, 4, 4]` or `[n, 3, 4]` for all pairs, group after group;
//! - `.json`: an object with a list for each group, or one list for all pairs; each entry is a 4 x 4
//!   or 3 x 4 matrix as nested rows, or `null` where the tool found no pose.
//!
//! A transform that holds NaN counts as failed, as `null` does.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use srrf_cloud::Rigid;
use srrf_cloud::io::{Array, ReadOptions, read_file, read_npy, read_npz};

use crate::EvalError;
use crate::metrics::is_finite;
use crate::pair_file::checked_rotation;
use crate::pairs::Group;

/// The answers of a tool: for each group, for each pair, a pose or a failure.
#[derive(Debug, Clone, PartialEq)]
pub struct Transforms {
    /// Name of its row: the name of the file without extension.
    pub name: String,
    /// Shape `[groups][pairs]`.
    pub poses: Vec<Vec<Option<Rigid>>>,
}

impl Transforms {
    /// Reads transforms for the pairs of `groups`, within the memory that the options allow.
    ///
    /// # Errors
    /// [`EvalError::Transforms`] or [`EvalError::Arrays`] with the file, what is wrong with it and
    /// what is expected.
    pub fn read(path: &Path, groups: &[Group], options: &ReadOptions) -> Result<Self, EvalError> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        let per_group = match extension.as_str() {
            "npz" => from_npz(&read_npz(path, options)?.arrays, groups),
            "npy" => matrices(&read_npy(path, options)?).and_then(|all| split(all, groups)),
            "json" => {
                let text = read_file(path, options).map_err(|e| e.to_string()).and_then(|bytes| {
                    String::from_utf8(bytes).map_err(|_| "not UTF-8; save it in UTF-8".to_owned())
                });
                text.and_then(|text| from_json(&text, groups))
            }
            _ => Err("transforms are read from .npz, .npy and .json files".to_owned()),
        };
        let poses = per_group
            .and_then(|lists| groups.iter().zip(lists).map(|(group, list)| checked(group, list)).collect())
            .map_err(|problem| EvalError::Transforms { path: path.to_owned(), problem })?;
        let name = path.file_stem().map_or("transforms".into(), |stem| stem.to_string_lossy().into_owned());
        Ok(Self { name, poses })
    }
}

type Poses = Vec<Option<Rigid>>;

fn from_npz(arrays: &BTreeMap<String, Array>, groups: &[Group]) -> Result<Vec<Poses>, String> {
    let group_poses = |group: &Group| {
        let name = group.name();
        if let Some(array) = arrays.get(&format!("{name}_T")) {
            return matrices(array).map_err(|e| format!("array {name}_T: {e}"));
        }
        let (Some(r), Some(t)) = (arrays.get(&format!("{name}_R")), arrays.get(&format!("{name}_t"))) else {
            let have: Vec<&str> = arrays.keys().map(String::as_str).collect();
            return Err(format!(
                "no transforms for the group {name}: expected {name}_R [n, 3, 3] and {name}_t [n, 3], or \
                 {name}_T [n, 4, 4]; found {have:?}"
            ));
        };
        let n = group.pairs;
        if r.shape != [n, 3, 3] || t.shape != [n, 3] {
            return Err(format!(
                "arrays {name}_R and {name}_t have shapes {:?} and {:?}, expected [{n}, 3, 3] and [{n}, 3]",
                r.shape, t.shape
            ));
        }
        let rows = r.values.chunks_exact(9).zip(t.values.chunks_exact(3));
        Ok(rows
            .map(|(r, t)| {
                Some(Rigid { rotation: Matrix3::from_row_slice(r), translation: Vector3::from_row_slice(t) })
            })
            .collect())
    };
    groups.iter().map(group_poses).collect()
}

/// Poses from an array `[n, 4, 4]` or `[n, 3, 4]`.
fn matrices(array: &Array) -> Result<Poses, String> {
    let &[_, rows @ (3 | 4), 4] = array.shape.as_slice() else {
        return Err(format!("has shape {:?}, expected [n, 4, 4] or [n, 3, 4]", array.shape));
    };
    Ok(array.values.chunks_exact(4 * rows).map(|m| Some(pose(m))).collect())
}

/// The pose in the first three rows of a row-major 4 x 4 or 3 x 4 matrix.
fn pose(m: &[f64]) -> Rigid {
    Rigid {
        rotation: Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]),
        translation: Vector3::new(m[3], m[7], m[11]),
    }
}

/// Cuts a list for all pairs into one for each group.
fn split(all: Poses, groups: &[Group]) -> Result<Vec<Poses>, String> {
    let expected: usize = groups.iter().map(|g| g.pairs).sum();
    if all.len() != expected {
        return Err(format!(
            "holds {} transforms, but this run has {expected} pairs in {} groups",
            all.len(),
            groups.len()
        ));
    }
    let mut rest = all.into_iter();
    Ok(groups.iter().map(|g| rest.by_ref().take(g.pairs).collect()).collect())
}

/// Nested rows; `null` is how JSON writes NaN.
type JsonMatrix = Vec<Vec<Option<f64>>>;

#[derive(Deserialize)]
#[serde(untagged)]
enum Json {
    Groups(BTreeMap<String, Vec<Option<JsonMatrix>>>),
    All(Vec<Option<JsonMatrix>>),
}

fn from_json(text: &str, groups: &[Group]) -> Result<Vec<Poses>, String> {
    let json: Json = serde_json::from_str(text).map_err(|_| {
        "not what is expected: {\"<group>\": [matrix, ...], ...} or [matrix, ...], where a matrix is 4 x 4 or \
         3 x 4 as nested rows, or null"
            .to_owned()
    })?;
    let read = |list: Vec<Option<JsonMatrix>>| -> Result<Poses, String> {
        list.into_iter()
            .enumerate()
            .map(|(pair, matrix)| {
                let Some(rows) = matrix else { return Ok(None) };
                if !(rows.len() == 3 || rows.len() == 4) || rows.iter().any(|r| r.len() != 4) {
                    return Err(format!("transform {pair} is no 4 x 4 or 3 x 4 matrix"));
                }
                let values: Vec<f64> = rows.concat().into_iter().map(|v| v.unwrap_or(f64::NAN)).collect();
                Ok(Some(pose(&values)))
            })
            .collect()
    };
    match json {
        Json::All(list) => split(read(list)?, groups),
        Json::Groups(mut lists) => groups
            .iter()
            .map(|group| {
                let name = group.name();
                let list =
                    lists.remove(&name).ok_or_else(|| format!("no transforms for the group {name}"))?;
                read(list).map_err(|e| format!("group {name}: {e}"))
            })
            .collect(),
    }
}

/// Checks number and rotations; poses that are not finite become failures.
fn checked(group: &Group, poses: Poses) -> Result<Poses, String> {
    let name = group.name();
    if poses.len() != group.pairs {
        return Err(format!("group {name}: {} transforms for {} pairs", poses.len(), group.pairs));
    }
    poses
        .into_iter()
        .enumerate()
        .map(|(pair, pose)| {
            let Some(mut pose) = pose.filter(is_finite) else { return Ok(None) };
            pose.rotation = checked_rotation(&pose.rotation).map_err(|problem| {
                format!(
                    "group {name}, transform {pair} {problem}; transforms are row-major and map source to target"
                )
            })?;
            Ok(Some(pose))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use srrf_cloud::EulerXyz;

    use std::fs;

    use super::*;
    use srrf_cloud::io::NpzWriter;

    fn npy_bytes(shape: &[usize], values: &[f64]) -> Vec<u8> {
        let mut bytes = Vec::new();
        Array::write(shape, values, &mut bytes).unwrap();
        bytes
    }

    fn groups() -> Vec<Group> {
        let group =
            |corruption: &str, severity, pairs| Group { corruption: corruption.into(), severity, pairs };
        vec![group("clean", 0, 1), group("cutout", 3, 2)]
    }

    fn pose_of(i: usize) -> Rigid {
        Rigid {
            rotation: EulerXyz::from_deg([10.0 * i as f64, 5.0, -20.0]).to_matrix(),
            translation: Vector3::new(i as f64, 0.5, -0.25),
        }
    }

    fn rows(pose: &Rigid) -> Vec<f64> {
        pose.to_matrix4().transpose().iter().copied().collect()
    }

    fn check(transforms: &Transforms) {
        let found: Vec<&Option<Rigid>> = transforms.poses.iter().flatten().collect();
        for (i, pose) in found.iter().enumerate().take(2) {
            let difference = pose.unwrap().to_matrix4() - pose_of(i).to_matrix4();
            assert!(difference.norm() < 1e-9, "{difference}");
        }
        assert_eq!((transforms.poses[0].len(), transforms.poses[1].len()), (1, 2));
        assert_eq!(*found[2], None);
    }

    #[test]
    fn all_three_formats_say_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let values = [rows(&pose_of(0)), rows(&pose_of(1)), vec![f64::NAN; 16]];

        let npz = folder.path().join("tool.npz");
        let mut writer = NpzWriter::new(fs::File::create(&npz).unwrap());
        let rotation: Vec<f64> = pose_of(0).rotation.transpose().iter().copied().collect();
        writer.array("clean_R", &[1, 3, 3], &rotation).unwrap();
        writer.array("clean_t", &[1, 3], pose_of(0).translation.as_slice()).unwrap();
        writer.array("cutout_s3_T", &[2, 4, 4], &values[1..].concat()).unwrap();
        writer.finish().unwrap();
        let read = Transforms::read(&npz, &groups(), &ReadOptions::default()).unwrap();
        assert_eq!(read.name, "tool");
        check(&read);

        let npy = folder.path().join("tool.npy");
        fs::write(&npy, npy_bytes(&[3, 4, 4], &values.concat())).unwrap();
        check(&Transforms::read(&npy, &groups(), &ReadOptions::default()).unwrap());

        let matrix = |v: &[f64]| v.chunks(4).map(<[f64]>::to_vec).collect::<Vec<_>>();
        let json = folder.path().join("tool.json");
        let by_group = serde_json::json!({
            "clean": [matrix(&values[0])], "cutout_s3": [matrix(&values[1]), null]
        });
        fs::write(&json, by_group.to_string()).unwrap();
        check(&Transforms::read(&json, &groups(), &ReadOptions::default()).unwrap());
        let list = serde_json::json!([matrix(&values[0]), matrix(&values[1]), null]);
        fs::write(&json, list.to_string()).unwrap();
        check(&Transforms::read(&json, &groups(), &ReadOptions::default()).unwrap());
    }

    #[test]
    fn what_is_wrong_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let message = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            fs::write(&path, bytes).unwrap();
            Transforms::read(&path, &groups(), &ReadOptions::default()).unwrap_err().to_string()
        };
        let npy = npy_bytes;
        let two = message("a.npy", &npy(&[2, 4, 4], &[0.0; 32]));
        assert!(two.contains("2 transforms") && two.contains("3 pairs") && two.contains("a.npy"), "{two}");
        let shape = message("a.npy", &npy(&[3, 3, 3], &[0.0; 27]));
        assert!(shape.contains("[3, 3, 3]") && shape.contains("[n, 4, 4]"), "{shape}");
        let mirrored = [-1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let mirrored = message("a.npy", &npy(&[3, 3, 4], &mirrored.repeat(3)));
        assert!(mirrored.contains("clean") && mirrored.contains("det R = -1"), "{mirrored}");
        assert!(message("a.json", b"{}").contains("no transforms for the group clean"));
        assert!(message("a.json", b"7").contains("not what is expected"));
        assert!(message("a.txt", b"").contains(".npz, .npy and .json"));
        let missing = Transforms::read(&folder.path().join("none.npy"), &groups(), &ReadOptions::default())
            .unwrap_err()
            .to_string();
        assert!(missing.contains("none.npy"), "{missing}");
    }

    #[test]
    fn memory_is_bounded() {
        let folder = tempfile::tempdir().unwrap();
        let limited = ReadOptions { max_memory: Some(300), ..ReadOptions::default() };
        for name in ["a.npy", "a.json"] {
            let path = folder.path().join(name);
            let values = [0.0; 3 * 16];
            let bytes = if name == "a.npy" { npy_bytes(&[3, 4, 4], &values) } else { vec![b' '; 400] };
            fs::write(&path, bytes).unwrap();
            let error = Transforms::read(&path, &groups(), &limited).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains("--max-memory"), "{error}");
        }
    }
}
